"""Corrected members that were measured to be far off solids are doubts where that carries energy."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.measured_members import LEAVES, NOTCHES, expected_errors, interpolated

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


@pytest.mark.parametrize("table", [LEAVES, NOTCHES])
def test_the_tables_are_met_at_their_own_ratios(table) -> None:
    for ratios, errors in table.items():
        np.testing.assert_allclose(interpolated(table, *ratios), errors)


def test_a_thick_notch_is_a_doubt_by_direction() -> None:
    (text,) = doubts(on_member(notch(3e-3, 1.5e-3, 6e-3), 6e-3))
    assert "% in stretch" in text and "% in width bending" in text and "thickness bending" not in text
    assert "fidelity: solid" in text


def test_a_long_leaf_and_an_uncorrected_notch_are_no_doubt() -> None:
    assert doubts(on_member(fx.describe.Leaf(width=10e-3, thickness=0.5e-3), 50e-3)) == []
    assert doubts(on_member(notch(3e-3, 1.5e-3, 6e-3), 6e-3, corrections="none")) == []


def test_what_was_not_measured_has_no_number() -> None:
    contour = fx.describe.EllipticalContour(depth=1e-3, web=1e-3)
    flexure = fx.describe.Flexure(
        nodes=("a", "b"), material="m", profile=fx.describe.Notch(width=1e-2, contour=contour)
    )
    assert expected_errors(flexure, 6e-3) is None


def test_a_leaf_described_on_its_side_has_the_same_errors() -> None:
    def of(width: float, thickness: float) -> np.ndarray:
        profile = fx.describe.Leaf(width=width, thickness=thickness)
        return expected_errors(fx.describe.Flexure(nodes=("a", "b"), material="m", profile=profile), 6e-3)

    np.testing.assert_allclose(of(1e-2, 1e-3), of(1e-3, 1e-2)[[0, 1, 4, 5, 2, 3]])


def uncovered(mechanism: fx.Mechanism) -> list[str]:
    return [d.text for d in fx.check(mechanism).doubts if d.kind == "evidence"]


FILLETED = fx.describe.Notch(width=10e-3, contour=fx.describe.CornerFilletedContour(fillet_radius=1e-3, web=0.5e-3))


def test_contours_that_were_not_measured_are_named() -> None:
    (text,) = uncovered(on_member(FILLETED, 10e-3))
    assert "no evidence covers" in text and "no corner-filleted notch was measured" in text
    assert uncovered(on_member(FILLETED, 10e-3, corrections="none")) == []
    (text,) = uncovered(on_member(notch(4e-3, 0.5e-3, 6e-3), 6e-3))
    assert "not right-circular" in text


def test_what_was_measured_nearby_is_not_named() -> None:
    assert uncovered(on_member(notch(3e-3, 0.5e-3, 6e-3), 6e-3)) == []
    assert uncovered(on_member(fx.describe.Leaf(width=10e-3, thickness=0.5e-3), 50e-3)) == []
    assert uncovered(on_member(fx.describe.Leaf(width=50e-3, thickness=0.5e-3), 5e-3)) != []
    (text,) = uncovered(on_member(notch(3e-3, 0.5e-3, 40e-3), 6e-3))
    assert "so wide" in text


def test_members_of_one_sort_are_one_doubt_by_what_they_hold_together() -> None:
    count = 14  # less than a tenth of the energy each
    one = on_member(FILLETED, 10e-3)
    ends = {f"{side}{k}": (x, 0.02 * k, 0.0) for k in range(count) for side, x in (("a", 0.0), ("b", 0.01))}
    flexures = {f"m{k}": one.flexures["member"].model_copy(update={"nodes": (f"a{k}", f"b{k}")}) for k in range(count)}
    body = fx.describe.RigidBody(centre=(0.01, 0.13, 0), mass=0.1, inertia=(1e-4,) * 3, carries=("b*",))
    held = {f"a{k}": CLAMPED for k in range(count)}
    (text,) = uncovered(fx.Mechanism(nodes=ends, flexures=flexures, bodies={"table": body}, ground=held))
    assert "(so of m1, m2, m3 and 10 more)" in text
