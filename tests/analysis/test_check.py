"""What `check` says of free motions, loads and gravity."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.modelfile import save

STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)
LEAF = fx.describe.Leaf(width=0.02, thickness=0.0005)


def guide(**changes: object) -> fx.Mechanism:
    """A table on two parallel leaves along z."""
    leaves = {"left": ("f1", "h1"), "right": ("f2", "h2")}
    data: dict[str, object] = {
        "materials": {"steel": STEEL},
        "nodes": {"f1": (0, 0, 0), "h1": (0, 0, 0.06), "f2": (0.05, 0, 0), "h2": (0.05, 0, 0.06)},
        "flexures": {
            key: fx.describe.Flexure(nodes=nodes, material="steel", reference=(1, 0, 0), profile=LEAF)
            for key, nodes in leaves.items()
        },
        "bodies": {
            "table": fx.describe.RigidBody(
                centre=(0.025, 0, 0.065), mass=0.1, inertia=(1e-5, 3e-5, 3e-5), carries=("h1", "h2")
            )
        },
        "ground": {"f*": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    }
    return fx.Mechanism(**(data | changes))


def with_rider(tx: float) -> fx.Mechanism:
    """The guide with a second body, held along x by a stiffness of its own."""
    rider = fx.describe.RigidBody(centre=(0, 0, 0.2), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    stiffness = fx.describe.DiagonalStiffness(tx=tx, ty=1e3, tz=1e3, rx=1.0, ry=1.0, rz=1.0)
    springs = {"s": fx.describe.Spring(nodes=("rider", "table"), stiffness=stiffness)}
    return guide(bodies={**guide().bodies, "rider": rider}, springs=springs)


def bungee(hz: float) -> fx.Mechanism:
    """Two bodies on a leaf of many elements, held along z by a spring to the ground alone."""
    return fx.Mechanism(
        materials={"steel": STEEL},
        nodes={"a": (0, 0, 0), "b": (0, 0, 0.05)},
        flexures={
            "leaf": fx.describe.Flexure(
                nodes=("a", "b"), material="steel", reference=(1, 0, 0), profile=LEAF, elements=200
            )
        },
        bodies={
            "base": fx.describe.RigidBody(centre=(0, 0, -0.005), mass=10.0, inertia=(0.01, 0.01, 0.01), carries=("a",)),
            "head": fx.describe.RigidBody(centre=(0, 0, 0.055), mass=1.0, inertia=(1e-3, 1e-3, 1e-3), carries=("b",)),
        },
        springs={
            "bungee": fx.describe.Spring(
                nodes=("base",), stiffness=fx.describe.DiagonalStiffness(tz=11.0039 * (2 * np.pi * hz) ** 2)
            )
        },
    )


def test_a_soft_spring_to_the_ground_is_no_rigid_motion() -> None:
    report = fx.check(bungee(0.03))
    assert report.rigid_body_modes == 5
    lower, upper = report.lowest_hz
    assert lower <= upper < lower * (1 + 1e-3)
    assert lower == pytest.approx(0.03, rel=1e-4)  # mass and spring alone
    free = [d for d in report.warnings if d.kind == "mechanism"]
    assert {d.kind for d in report.warnings} <= {"mechanism", "root"}
    assert sum(len(d.places) for d in free) == 5
    assert all(d.text.startswith("free to move") for d in free)


def test_what_nothing_holds_is_said_once() -> None:
    report = fx.check(guide(ground={}))
    assert report.rigid_body_modes == 6
    assert [d.kind for d in report.warnings if d.kind != "beam"] == ["ungrounded"]


@pytest.mark.parametrize("tx", [1e-9, 1e-15, 1e-21, 1e-28])
def test_all_but_free_motions_have_their_frequency(tx: float) -> None:
    """Table and rider are one rigid body beside so soft a spring: the rider alone swings on it."""
    report = fx.check(with_rider(tx))
    expected = np.sqrt(tx / 0.1) / (2 * np.pi)
    assert report.rigid_body_modes == 0
    assert report.lowest_hz[0] <= expected * (1 + 1e-6) and expected <= report.lowest_hz[1] * (1 + 1e-6)
    (doubt,) = (d for d in report.warnings if d.kind == "mechanism")
    assert doubt.place == "rider.tx" and "all but free" in doubt.text


def test_a_very_soft_motion_hides_no_other_mode() -> None:
    soft, stiff = (fx.modes(with_rider(tx), n=6, order="full").frequency_hz for tx in (1e-21, 1e-6))
    np.testing.assert_allclose(soft[1:], stiff[1:], rtol=1e-6)


def test_free_motions_within_a_mechanism_are_doubts() -> None:
    rider = fx.describe.RigidBody(centre=(0, 0, 0.2), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    springs = {"s": fx.describe.Spring(nodes=("rider", "table"), stiffness=fx.describe.DiagonalStiffness(ty=1e3))}
    report = fx.check(guide(bodies={**guide().bodies, "rider": rider}, springs=springs))
    free = [d for d in report.warnings if d.kind == "mechanism"]
    assert len({place for d in free for place in d.places}) == sum(len(d.places) for d in free) == 5
    assert all(place.startswith("rider.") for d in free for place in d.places)
    assert all("free to move" in d.text for d in free)


def test_leaves_of_many_elements_are_proven() -> None:
    flexures = {k: f.model_copy(update={"elements": 600}) for k, f in guide().flexures.items()}
    report = fx.check(guide(flexures=flexures))
    assert not [d for d in report.warnings if d.kind in ("proof", "mechanism")]
    assert report.lowest_hz[0] == pytest.approx(fx.check(guide()).lowest_hz[0], rel=2e-3)


def test_loads_and_gravity_are_reported() -> None:
    loads = {"table": fx.describe.Load(force=(0, 0, -20.0), moment=(0.1, 0, 0))}
    loaded, bare = fx.check(guide(loads=loads, gravity=(0, 0, -9.81))), fx.check(guide())
    assert loaded.loads == {"table": (0, 0, -20.0, 0.1, 0, 0)}
    assert loaded.gravity == (0, 0, -9.81)
    assert loaded.is_preloaded and not bare.is_preloaded
    assert bare.loads == {} and bare.gravity == (0, 0, 0)
    assert loaded.lowest_hz[1] < bare.lowest_hz[0]  # pressed leaves are softer
    assert loaded.lowest_hz[0] == pytest.approx(
        fx.modes(guide(loads=loads, gravity=(0, 0, -9.81)), n=1, order="full").frequency_hz[0]
    )


def test_the_command_prints_loads_and_proofs(tmp_path) -> None:
    loads = {"table": fx.describe.Load(force=(0, 0, -20.0), moment=(0.1, 0, 0))}
    path = tmp_path / "guide.yaml"
    save(guide(loads=loads, gravity=(0, 0, -9.81)), path)
    text = CliRunner().invoke(app, ["check", str(path)]).output
    assert "load on table: (0, 0, -20) N, (0.1, 0, 0) N m" in text
    assert "gravity: (0, 0, -9.81) m/s²" in text
    assert "preloaded" in text
    assert "Hz, proven" in text
    data = json.loads(CliRunner().invoke(app, ["check", str(path), "--json"]).output)
    assert data["loads"] == {"table": [0, 0, -20, 0.1, 0, 0]}
    assert data["gravity"] == [0, 0, -9.81] and data["is_preloaded"] is True


def test_a_warning_about_several_places_names_the_first_four() -> None:
    warning = fx.Diagnostic.about("slender", "is slender", *(f"leaf{k}" for k in range(6)))
    assert str(warning) == "leaf0, leaf1, leaf2, leaf3 and 2 more: is slender"
    assert warning.is_about("leaf5") and not warning.is_about("leaf6")
    assert warning.to_dict()["value"] is None and len(warning.to_dict()["places"]) == 6
    assert "places" not in fx.Diagnostic("stress", "leaf", 2.0, 1.0, "Pa", "too much").to_dict()


def test_warnings_of_check_are_also_doubts() -> None:
    report = fx.check(guide(ground={}))
    assert report.warnings
    with pytest.warns(DeprecationWarning, match=r"CheckReport\.doubts is called warnings"):
        assert report.doubts is report.warnings
    data = report.to_dict()
    keys = ("kind", "place", "text", "places")
    assert data["doubts"] == [{key: own[key] for key in keys} for own in data["warnings"]]
