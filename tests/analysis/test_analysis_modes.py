"""What comes with a modal result: motions, energies, evidence, pairing, doubts."""

from __future__ import annotations

import json

import numpy as np
import pytest

import flexura as fx

STEEL = fx.Material(E=200e9, nu=0.3, rho=7800.0)


def guide(**changes: object) -> fx.Mechanism:
    """A body on two parallel leaves that bend along x."""
    blade = fx.Leaf(width=0.02, thickness=0.0005)
    data: dict[str, object] = {
        "materials": {"steel": STEEL},
        "nodes": {"f1": (0, 0, 0), "h1": (0, 0, 0.06), "f2": (0.05, 0, 0), "h2": (0.05, 0, 0.06)},
        "flexures": {
            "left": fx.Flexure(nodes=("f1", "h1"), material="steel", reference=(1, 0, 0), profile=blade),
            "right": fx.Flexure(nodes=("f2", "h2"), material="steel", reference=(1, 0, 0), profile=blade),
        },
        "bodies": {
            "table": fx.RigidBody(centre=(0.025, 0, 0.065), mass=0.1, inertia=(1e-5, 3e-5, 3e-5), carries=("h1", "h2"))
        },
        "ground": {"f1": fx.Support(fixed=fx.DOF_NAMES), "f2": fx.Support(fixed=fx.DOF_NAMES)},
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
    from flexura.analysis.energy import energies

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
    from flexura.structure.members import Elements

    good = Elements.M.func
    monkeypatch.setattr(Elements.M, "func", lambda self: 1.01 * good(self))
    assert fx.modes(guide(), n=1).evidence.mass_error > 1e-4


def test_missing_modes_are_counted_and_named() -> None:
    blind = fx.modes(guide(), n=6).evidence
    assert not blind.complete
    assert blind.sturm_count > blind.reported_below
    assert all("left" in missed.summary or "right" in missed.summary for missed in blind.missed)
    frequencies = fx.modes(guide(), n=blind.sturm_count, order="full").frequency_hz
    for missed in blind.missed:
        assert np.abs(frequencies / missed.frequency_hz - 1).min() < 1e-6


def test_keeping_modes_below_a_frequency_sees_everything_below_it() -> None:
    result = fx.modes(guide(), n=6, keep_below=20000.0)
    assert result.evidence.complete
    assert max(abs(mode.relative_error or 1) for mode in result.modes) < 1e-3


def test_ungrounded_mechanism_has_six_zeros_and_then_elastic_modes() -> None:
    result = fx.modes(guide(ground={}), n=8, order="full")
    assert (result.frequency_hz[:6] == 0.0).all()
    assert result.frequency_hz[6] > 1.0
    assert result.evidence.rigid_body_modes == 6
    low = fx.modes(guide(ground={}), n=7, keep=2)
    assert (low.frequency_hz[:6] == 0.0).all()
    assert low.frequency_hz[6] == pytest.approx(result.frequency_hz[6], rel=1e-3)


def test_json_has_no_nan_and_reads_back() -> None:
    data = fx.modes(guide(), n=6).to_dict()
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
    held = guide(ground={name: fx.Support(fixed=fx.DOF_NAMES) for name in ("f1", "f2", "table")})
    low = fx.modes(held, n=2, keep=2)
    assert low.evidence.complete  # the leaves still vibrate between held ends
    with pytest.raises(fx.OptionError):
        fx.modes(held, n=2)


def test_check_doubts_near_mechanism_by_the_name_of_the_dof() -> None:
    loose = guide(
        nodes={"f1": (0, 0, 0), "h1": (0, 0, 0.06)},
        flexures={
            "left": fx.Flexure(
                nodes=("f1", "h1"), material="steel", reference=(1, 0, 0), profile=fx.Leaf(width=0.02, thickness=0.0005)
            )
        },
        bodies={"table": fx.RigidBody(centre=(0, 0, 0.065), mass=0.1, inertia=(1e-5, 1e-5, 1e-5), carries=("h1",))},
        ground={"f1": fx.Support(free=("rx",))},
    )
    doubts = fx.check(loose).doubts
    free = [doubt for doubt in doubts if doubt.kind == "mechanism"]
    assert len(free) == 1
    assert "free to move" in free[0].text
    # the free rotation about x at the foot moves the table along y
    assert free[0].place == "table.ty" or free[0].place == "f1.rx"


def test_check_doubts_ungrounded_overlapping_wide_and_shear_members() -> None:
    doubts = {doubt.kind for doubt in fx.check(guide(ground={}, corrections="none")).doubts}
    assert {"ungrounded", "wide"} <= doubts
    stub = fx.Link(
        nodes=("h1", "h2"), material="steel", reference=(0, 0, 1), section=fx.Rectangle(width=0.02, thickness=0.02)
    )
    assert "shear" in {d.kind for d in fx.check(guide(links={"stub": stub}, corrections="none")).doubts}
    twin = guide(
        nodes={**guide().nodes, "h3": (0, 0, 0.06)},
        masses={"m": fx.PointMass(node="h3", mass=0.01)},
        springs={
            "s": fx.Spring(nodes=("h3", "f2"), stiffness=fx.DiagonalStiffness(tx=1e3, ty=1e3, tz=1e3, rx=1, ry=1, rz=1))
        },
    )
    assert any(d.kind == "overlap" and "h3" in d.text + d.place for d in fx.check(twin).doubts)


def test_check_counts() -> None:
    report = fx.check(guide())
    assert report.full_order == 6 * (2 * 9 + 1)
    assert report.low_order == 6
    assert report.held == {"f1": fx.DOF_NAMES, "f2": fx.DOF_NAMES}
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
    assert data["modes"][0]["interval_hz"][0] <= data["modes"][0]["frequency_hz"] * (1 + 1e-9)


def test_a_missing_mode_widens_intervals_and_is_counted():
    result = fx.modes(guide(), n=6)
    assert result.certificate.missing >= len(result.evidence.missed) > 0
    assert not result.modes[-1].is_indexed
    assert result.modes[0].is_indexed
