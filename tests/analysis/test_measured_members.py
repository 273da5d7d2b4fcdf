"""Corrected members that were measured to be far off solids are doubts where that carries energy."""

from __future__ import annotations

import csv
from importlib.resources import files

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.measured_members import BEAMS, ERRORS, KINDS_OF_MEMBERS, MemberErrors, stiffness_errors

CLAMPED = fx.describe.Support(fixed=fx.describe.DOF_NAMES)


def on_member(profile: fx.describe.Leaf | fx.describe.Notch, length: float, **more: object) -> fx.Mechanism:
    member = fx.describe.Flexure(
        nodes=("a", "b"), material="spring-steel", reference=(0, 0, 1), profile=profile, **more
    )
    body = fx.describe.RigidBody(centre=(length, 0, 0), mass=0.1, inertia=(1e-4,) * 3, carries=("b",))
    return fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (length, 0, 0)},
        flexures={"member": member},
        bodies={"body": body},
        ground={"a": CLAMPED},
    )


def doubts(mechanism: fx.Mechanism) -> list[str]:
    return [d.text for d in fx.check(mechanism).doubts if d.kind == "measured"]


def notch(radius: float, web: float, width: float) -> fx.describe.Notch:
    return fx.describe.Notch(width=width, contour=fx.describe.CircularContour(radius=radius, web=web))


def leaf(width: float, thickness: float) -> fx.describe.Leaf:
    return fx.describe.Leaf(width=width, thickness=thickness)


def errors(profile: fx.describe.Leaf | fx.describe.Notch, length: float, beam: str = "auto", nu=0.3) -> MemberErrors:
    member = fx.describe.Flexure(nodes=("a", "b"), material="m", profile=profile)
    return stiffness_errors(member, length, beam == "auto", shears=beam == "shear", nu=nu)


def rows(kind: str, beam: str, nu: str = "0.3") -> list[dict[str, str]]:
    with files("flexura.analysis").joinpath("member_errors.csv").open() as file:
        found = csv.DictReader(line for line in file if not line.startswith("#"))
        return [row for row in found if (row["kind"], row["beam"], row["nu"]) == (kind, beam, nu)]


def of_row(row: dict[str, str]) -> tuple[fx.describe.Leaf | fx.describe.Notch, float]:
    """A member with the ratios of a row, and its length, m."""
    first, second = float(row["first"]), float(row["second"])
    if row["kind"] == "leaf":
        return leaf(5e-3, 5e-3 / first), 5e-3 * second
    return notch(2e-3, 2e-3 / first, 4e-3 * second), 4e-3


@pytest.mark.parametrize("kind", KINDS_OF_MEMBERS)
@pytest.mark.parametrize("beam", BEAMS)
def test_rows_are_met_at_their_own_ratios(kind: str, beam: str) -> None:
    for row in rows(kind, beam):
        found = errors(*of_row(row), beam)
        e, mesh = np.array([float(row[name]) for name in ERRORS]), float(row["mesh"])
        pairs = [e[[0, 0]], e[[1, 1]], e[2:4], e[4:6]]
        np.testing.assert_allclose(found.low, [(1 + min(p)) * np.exp(-mesh) - 1 for p in pairs], atol=1e-6)
        np.testing.assert_allclose(found.high, [(1 + max(p)) * np.exp(mesh) - 1 for p in pairs], atol=1e-6)
        assert found.reason == ""


def test_other_ratios_of_poisson_make_them_more_uncertain() -> None:
    on, off = (errors(leaf(5e-3, 1e-3), 5e-3, nu=nu) for nu in (0.3, 0.4))
    assert np.all(off.high - off.low > on.high - on.low) and off.reason == ""
    assert "Poisson's ratio 0.48, measured to 0.45" in errors(leaf(5e-3, 1e-3), 5e-3, nu=0.48).reason


def test_outside_of_what_was_measured_the_nearest_row_counts_and_it_is_said() -> None:
    edge, beyond = errors(leaf(60e-3, 1e-3), 60e-3), errors(leaf(90e-3, 1e-3), 90e-3)
    np.testing.assert_allclose(beyond.low, edge.low, atol=1e-9)
    assert beyond.reason == "leaf of larger side over smaller side 90, measured to 60"
    reason = errors(notch(3e-3, 0.5e-3, 0.3e-3), 6e-3).reason
    assert reason == "right-circular notch of width over length 0.05, measured from 0.1"


def test_a_thick_notch_is_a_doubt_by_direction() -> None:
    (text,) = doubts(on_member(notch(3e-3, 1.5e-3, 6e-3), 6e-3))
    assert "% in stretch" in text and "% in width bending" in text and "thickness bending" not in text
    assert "fidelity: solid" in text


def test_a_long_leaf_and_an_uncorrected_notch_are_no_doubt() -> None:
    assert doubts(on_member(fx.describe.Leaf(width=10e-3, thickness=0.5e-3), 50e-3)) == []
    assert doubts(on_member(notch(3e-3, 1.5e-3, 6e-3), 6e-3, corrections="none")) == []


def test_what_was_not_measured_has_no_number() -> None:
    profile = fx.describe.TwoAxisNotch(
        y_contour=fx.describe.StraightContour(web=1e-3), z_contour=fx.describe.StraightContour(web=1e-3)
    )
    found = errors(profile, 6e-3)
    assert not found.is_known and found.reason == "no two-axis notch was measured"


@pytest.mark.parametrize("beam", BEAMS)
def test_a_leaf_described_on_its_side_has_the_same_errors(beam: str) -> None:
    flat, standing = errors(leaf(1e-2, 1e-3), 6e-3, beam), errors(leaf(1e-3, 1e-2), 6e-3, beam)
    np.testing.assert_allclose(flat.low, standing.low[[0, 1, 3, 2]])
    np.testing.assert_allclose(flat.high, standing.high[[0, 1, 3, 2]])


def uncovered(mechanism: fx.Mechanism) -> list[str]:
    return [d.text for d in fx.check(mechanism).doubts if d.kind == "evidence"]


FILLETED = fx.describe.Notch(width=10e-3, contour=fx.describe.CornerFilletedContour(fillet_radius=1e-3, web=0.5e-3))


def test_contours_that_were_not_measured_are_named() -> None:
    (text,) = uncovered(on_member(FILLETED, 10e-3))
    assert "no evidence covers" in text and "corner-filleted" in text
    assert uncovered(on_member(FILLETED, 10e-3, corrections="none")) == []
    (text,) = uncovered(on_member(notch(4e-3, 0.5e-3, 6e-3), 6e-3))
    assert "not right-circular" in text


def test_what_was_measured_nearby_is_not_named() -> None:
    assert uncovered(on_member(notch(3e-3, 0.5e-3, 6e-3), 6e-3)) == []
    assert uncovered(on_member(fx.describe.Leaf(width=10e-3, thickness=0.5e-3), 50e-3)) == []
    assert uncovered(on_member(fx.describe.Leaf(width=50e-3, thickness=0.5e-3), 5e-3)) != []
    (text,) = uncovered(on_member(notch(3e-3, 0.5e-3, 40e-3), 6e-3))
    assert "width over length 6.67, measured to 5" in text


def test_members_of_one_sort_are_one_doubt_by_what_they_hold_together() -> None:
    count = 14  # less than a tenth of the energy each
    one = on_member(FILLETED, 10e-3)
    ends = {f"{side}{k}": (x, 0.02 * k, 0.0) for k in range(count) for side, x in (("a", 0.0), ("b", 0.01))}
    flexures = {f"m{k}": one.flexures["member"].model_copy(update={"nodes": (f"a{k}", f"b{k}")}) for k in range(count)}
    body = fx.describe.RigidBody(centre=(0.01, 0.13, 0), mass=0.1, inertia=(1e-4,) * 3, carries=("b*",))
    held = {f"a{k}": CLAMPED for k in range(count)}
    (text,) = uncovered(fx.Mechanism(nodes=ends, flexures=flexures, bodies={"table": body}, ground=held))
    assert "(so of m1, m2, m3 and 10 more)" in text
