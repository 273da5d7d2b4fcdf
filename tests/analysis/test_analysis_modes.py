"""What comes with a modal result: motions, energies, evidence, pairing, doubts."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest

import flexura as fx

STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)


def guide(**changes: object) -> fx.Mechanism:
    """A body on two parallel leaves that bend along x."""
    blade = fx.describe.Leaf(width=0.02, thickness=0.0005)
    data: dict[str, object] = {
        "materials": {"steel": STEEL},
        "nodes": {"f1": (0, 0, 0), "h1": (0, 0, 0.06), "f2": (0.05, 0, 0), "h2": (0.05, 0, 0.06)},
        "flexures": {
            "left": fx.describe.Flexure(nodes=("f1", "h1"), material="steel", reference=(1, 0, 0), profile=blade),
            "right": fx.describe.Flexure(nodes=("f2", "h2"), material="steel", reference=(1, 0, 0), profile=blade),
        },
        "bodies": {
            "table": fx.describe.RigidBody(
                centre=(0.025, 0, 0.065), mass=0.1, inertia=(1e-5, 3e-5, 3e-5), carries=("h1", "h2")
            )
        },
        "ground": {
            "f1": fx.describe.Support(fixed=fx.describe.DOF_NAMES),
            "f2": fx.describe.Support(fixed=fx.describe.DOF_NAMES),
        },
    }
    return fx.Mechanism(**(data | changes))


def test_guided_mode_is_described() -> None:
    mode = fx.modes(guide(), n=1).modes[0]
    body = mode.motion.bodies[0]
    assert (body.body, body.kind) == ("table", "translation")
    assert body.translation == pytest.approx((1, 0, 0), abs=0.01)
    assert mode.motion.summary.startswith("table moves along x")
    assert mode.motion.deformation["left: thickness bending"] == pytest.approx(0.5, abs=0.01)


def test_shares_add_up_to_one() -> None:
    for mode in fx.modes(guide(), n=6, keep=2).modes:
        assert sum(mode.motion.strain_share.values()) == pytest.approx(1.0)
        assert sum(mode.motion.kinetic_share.values()) == pytest.approx(1.0)
        assert sum(mode.motion.strain_by_substructure.values()) == pytest.approx(1.0)
        assert sum(mode.motion.deformation.values()) == pytest.approx(1.0, abs=0.01)


def test_strain_and_kinetic_energy_balance() -> None:
    """In a normal mode of unit modal mass both amplitudes are omega^2 / 2 (Rayleigh's principle)."""
    from flexura.analysis.strain.energy import energies

    result = fx.modes(guide(), n=5, order="full")
    parts = energies(result.model, result.shapes)
    strain = sum(kinds.sum(axis=0) for part in parts for kinds in part.strain.values())
    kinetic = sum(part.kinetic for part in parts) * result.angular_frequency**2
    np.testing.assert_allclose(strain, kinetic, rtol=1e-6)
    np.testing.assert_allclose(kinetic, result.angular_frequency**2 / 2, rtol=1e-6)


def test_masses_are_those_described() -> None:
    evidence = fx.modes(guide(), n=1).evidence
    assert evidence.model_mass.mass == pytest.approx(0.1 + 2 * 7800 * 0.02 * 0.0005 * 0.06, rel=1e-12)
    assert evidence.model_mass.centre[0] == pytest.approx(0.025)


def test_wrong_mass_matrix_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The check of masses does not use the matrices that it checks: spoil those, and it must say so."""
    from flexura.structure.elements import Elements

    good = Elements.M.func
    monkeypatch.setattr(Elements.M, "func", lambda self: 1.01 * good(self))
    assert fx.modes(guide(), n=1).evidence.mass_error > 1e-4


def test_missing_modes_are_counted_and_named() -> None:
    blind = fx.modes(guide(), n=6, keep=0).evidence
    assert not blind.complete
    assert blind.sturm_count > blind.reported_below
    assert all("left" in missed.summary or "right" in missed.summary for missed in blind.missed)
    frequencies = fx.modes(guide(), n=blind.sturm_count, order="full").frequency_hz
    for missed in blind.missed:
        assert np.abs(frequencies / missed.frequency_hz - 1).min() < 1e-6


def test_keeping_modes_below_a_frequency_sees_everything_below_it() -> None:
    result = fx.modes(guide(), n=6, keep_below=20000.0)
    assert result.evidence.complete
    assert max(abs(result.frequency_hz / result.full_frequency_hz - 1)) < 1e-3


def test_ungrounded_mechanism_has_six_zeros_and_then_elastic_modes() -> None:
    result = fx.modes(guide(ground={}), n=8, order="full")
    assert (result.frequency_hz[:6] == 0.0).all()
    assert result.frequency_hz[6] > 1.0
    assert result.evidence.rigid_body_modes == 6
    low = fx.modes(guide(ground={}), n=7, keep=2)
    assert (low.frequency_hz[:6] == 0.0).all()
    assert low.frequency_hz[6] == pytest.approx(result.frequency_hz[6], rel=1e-3)


def test_json_has_no_nan_and_reads_back() -> None:
    data = fx.modes(guide(), n=6, keep=0).to_dict()
    again = json.loads(json.dumps(data, allow_nan=False))
    assert again["evidence"]["complete"] is False
    assert len(again["modes"]) == 6


@pytest.mark.parametrize(
    "arguments", [{"n": 0}, {"order": "half"}, {"keep": -1}, {"keep": {"nowhere": 2}}, {"keep_below": np.nan}]
)
def test_impossible_options_are_refused(arguments: dict[str, object]) -> None:
    with pytest.raises(fx.OptionError):
        fx.modes(guide(), **arguments)  # type: ignore[arg-type]


def test_everything_held_is_refused() -> None:
    held = guide(ground={name: fx.describe.Support(fixed=fx.describe.DOF_NAMES) for name in ("f1", "f2", "table")})
    low = fx.modes(held, n=2, keep=2)
    assert low.evidence.complete  # the leaves still vibrate between held ends
    by_tolerance = fx.modes(held, n=2)
    np.testing.assert_allclose(by_tolerance.frequency_hz, by_tolerance.full_frequency_hz, rtol=1e-3)
    with pytest.raises(fx.OptionError):
        fx.modes(held, n=2, keep=0)


def test_check_doubts_near_mechanism_by_the_name_of_the_dof() -> None:
    loose = guide(
        nodes={"f1": (0, 0, 0), "h1": (0, 0, 0.06)},
        flexures={
            "left": fx.describe.Flexure(
                nodes=("f1", "h1"),
                material="steel",
                reference=(1, 0, 0),
                profile=fx.describe.Leaf(width=0.02, thickness=0.0005),
            )
        },
        bodies={
            "table": fx.describe.RigidBody(centre=(0, 0, 0.065), mass=0.1, inertia=(1e-5, 1e-5, 1e-5), carries=("h1",))
        },
        ground={"f1": fx.describe.Support(free=("rx",))},
    )
    doubts = fx.check(loose).warnings
    free = [doubt for doubt in doubts if doubt.kind == "mechanism"]
    assert len(free) == 1
    assert "free to move" in free[0].text
    # the free rotation about x at the foot moves the table along y
    assert free[0].place == "table.ty" or free[0].place == "f1.rx"


def test_check_doubts_ungrounded_overlapping_wide_and_shear_members() -> None:
    free = fx.check(guide(ground={}, corrections="none"))
    assert {"ungrounded", "beam"} <= {doubt.kind for doubt in free.warnings}
    # what moves the modes beyond the six rigid motions is told, and nothing is not a number
    (wide,) = [
        doubt for doubt in free.warnings if doubt.text.startswith("thickness bending of a leaf, taken as a plain")
    ]
    assert wide.places == ("left", "right")
    assert not [doubt for doubt in (*free.warnings, *free.minor) if "nan" in doubt.text or "(0 Hz)" in doubt.text]
    stub = fx.describe.Link(
        nodes=("h1", "h2"),
        material="steel",
        reference=(0, 0, 1),
        section=fx.describe.Rectangle(width=0.02, thickness=0.02),
    )
    # of a thick link between two leaves the width bending is off, where shear counts
    doubts = fx.check(guide(links={"stub": stub}, bodies={}, corrections="none")).warnings
    assert [d for d in doubts if d.kind == "beam" and "stub" in d.places and d.text.startswith("width bending")]
    twin = guide(
        nodes={**guide().nodes, "h3": (0, 0, 0.06)},
        masses={"m": fx.describe.PointMass(node="h3", mass=0.01)},
        springs={
            "s": fx.describe.Spring(
                nodes=("h3", "f2"), stiffness=fx.describe.DiagonalStiffness(tx=1e3, ty=1e3, tz=1e3, rx=1, ry=1, rz=1)
            )
        },
    )
    assert any(d.kind == "overlap" and "h3" in d.text + d.place for d in fx.check(twin).warnings)


def test_check_counts() -> None:
    report = fx.check(guide())
    assert report.full_order == 6 * (2 * 9 + 1)
    assert report.low_order == 6
    assert report.held == {"f1": fx.describe.DOF_NAMES, "f2": fx.describe.DOF_NAMES}
    assert report.rigid_bodies == {"table": pytest.approx(0.1)}


def test_a_reduced_model_stands_in_place_of_the_mechanism():
    low = fx.reduce(guide(), tolerance=1e-4, up_to=700.0)
    own, direct = fx.modes(low, n=2), fx.modes(guide(), n=2, tolerance=1e-4, up_to=700.0)
    np.testing.assert_allclose(own.frequency_hz, direct.frequency_hz[:2], rtol=1e-9)
    assert own.order == low.order and own.steps == low.steps
    for mode in own.modes:
        lower, upper = mode.interval_hz
        assert (
            mode.is_indexed
            and lower <= mode.full_frequency_hz * (1 + 1e-9)
            and mode.full_frequency_hz <= upper * (1 + 1e-9)
        )
        assert upper / lower < 1 + 3e-4
    with pytest.raises(fx.OptionError, match="already"):
        fx.modes(low, keep=2)


def test_intervals_of_the_full_model_are_those_of_round_off():
    result = fx.modes(guide(), n=3, order="full")
    assert result.certificate.is_complete
    assert result.certificate.error_bound.max() < 1e-8  # what bounds are widened by for round-off
    data = json.loads(json.dumps(result.to_dict()))
    assert data["certificate"]["missing"] == 0
    assert data["modes"][0]["interval_hz"][0] <= data["modes"][0]["frequency_hz"] <= data["modes"][0]["interval_hz"][1]


def test_a_missing_mode_widens_intervals_and_is_counted():
    result = fx.modes(guide(), n=6, keep=0)
    assert result.certificate.missing >= len(result.evidence.missed) > 0
    assert not result.modes[-1].is_indexed
    assert result.modes[0].is_indexed


ARM = {
    "nodes": {"foot": (0, 0, 0), "tip": (0.05, 0, 0)},
    "flexures": {
        "blade": fx.describe.Flexure(
            nodes=("foot", "tip"),
            material="steel",
            reference=(0, 0, 1),
            profile=fx.describe.Leaf(width=0.01, thickness=0.0005),
        )
    },
}


def test_a_heavy_point_mass_beside_a_light_body_is_what_moves() -> None:
    """The mass at the end of one leaf swings, a light body at the end of another stands nearly still: the summary
    names what the table of kinetic energy names."""
    leaf = {"material": "steel", "reference": (0, 0, 1), "profile": fx.describe.Leaf(width=0.01, thickness=0.0005)}
    both = fx.Mechanism(
        materials={"steel": STEEL},
        nodes={"foot": (0, 0, 0), "end": (0.05, 0, 0), "far": (0.1, 0, 0), "other": (0, 0.05, 0)},
        flexures={
            "long": fx.describe.Flexure(nodes=("foot", "end"), **leaf),
            "joint": fx.describe.Flexure(nodes=("end", "far"), **leaf),
            "short": fx.describe.Flexure(nodes=("foot", "other"), **leaf),
        },
        masses={"payload": fx.describe.PointMass(node="far", mass=1.0, offset=(0.01, 0, 0))},
        bodies={
            "light": fx.describe.RigidBody(centre=(0.05, 0, 0), mass=1e-3, inertia=(1e-8, 1e-8, 1e-8), carries=("end",))
        },
        ground={"foot": "clamped"},
    )
    mode = fx.modes(both, n=1, order="full").modes[0]
    assert mode.motion.summary.startswith("payload moves along z")
    assert mode.motion.masses[0].kinetic_share > 0.99
    assert mode.motion.bodies[0].kinetic_share < 0.01


def test_a_mass_that_a_body_carries_counts_as_the_body() -> None:
    loaded = guide(masses={"payload": fx.describe.PointMass(node="h1", mass=5.0)})
    motion = fx.modes(loaded, n=1).modes[0].motion
    assert motion.summary.startswith("table moves along x (")
    assert motion.masses[0].body == "payload" and motion.masses[0].kinetic_share > 0.9


def test_kinetic_energies_of_bodies_and_masses_are_those_of_the_mass_matrix() -> None:
    """With massless leaves everything that moves is rigid, masses off their node and with inertia included."""
    air = fx.describe.Material(E=200e9, nu=0.3, rho=1e-9)
    point = fx.describe.PointMass(node="h1", mass=0.3, offset=(0.01, 0.02, -0.03), inertia=(1e-4, 2e-4, 3e-4))
    for mode in fx.modes(guide(materials={"steel": air}, masses={"m": point}), n=4).modes:
        motion = mode.motion
        assert sum(m.kinetic_share for m in (*motion.bodies, *motion.masses)) == pytest.approx(1.0, abs=1e-6)


def test_leaves_that_hold_most_of_the_energy_come_before_a_body_that_shakes() -> None:
    for mode in fx.modes(guide(), n=12, order="full").modes:
        share, said = mode.motion.bodies[0].kinetic_share, mode.motion.summary
        assert said.startswith("table") == (share >= 0.5)
        assert ("table" in said) == (share > 0.05)


@pytest.mark.parametrize("interface", [("foot", "tip"), ("foot",)])
def test_a_mechanism_of_instances_alone_names_their_nodes(interface: tuple[str, ...]) -> None:
    """f1 = 1.8751^2/(2 pi L^2) sqrt(EI/(rho A)) of a cantilever that is an instance, the top level having no nodes."""
    arms = fx.Mechanism(
        materials={"steel": STEEL},
        corrections="none",
        substructures={"arm": fx.describe.Substructure(**ARM, interface=interface)},
        instances={"arm": fx.describe.Instance(of="arm")},
        ground={"arm.foot": "clamped"},
    )
    first = fx.modes(arms, n=2, order="full").modes[0]
    expected = 1.8751040687**2 / (2 * np.pi * 0.05**2) * np.sqrt(200e9 * 0.0005**2 / 12 / 7800)
    assert first.frequency_hz == pytest.approx(expected, rel=1e-4)
    assert first.motion.summary == "arm.tip moves along z (arm: thickness bending 100%)"


def test_many_equal_bodies_are_not_said_to_stand_still() -> None:
    """Forty bodies on forty springs, none with more than a fortieth of the energy."""
    spring = fx.describe.DiagonalStiffness(tx=1e3, ty=1e5, tz=1e5, rx=1e2, ry=1e2, rz=1e2)
    names = [f"b{k}" for k in range(40)]
    held = {k: fx.describe.Spring(nodes=(k,), stiffness=spring) for k in names}
    tie = fx.describe.DiagonalStiffness(tx=1e4, ty=1e4, tz=1e4, rx=1, ry=1, rz=1)
    ties = {f"t{a}": fx.describe.Spring(nodes=(a, b), stiffness=tie) for a, b in pairwise(names)}
    row = fx.Mechanism(
        bodies={k: fx.describe.RigidBody(centre=(0, 0, 0), mass=0.1, inertia=(1e-5,) * 3) for k in names},
        springs={f"s{k}": s for k, s in held.items()} | ties,
    )
    said = fx.modes(row, n=1, order="full").modes[0].motion.summary
    assert said.startswith("b") and "moves along x" in said and "and 38 more" in said
