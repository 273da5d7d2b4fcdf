"""Errors of members as they were measured.

Errors are held against the solids of benchmarks/octants.py at ratios between the rows, against the theory of plates,
and against the fit of Schotborgh, Kokkeler, Tragter and van Houten, Precis. Eng. 29 (2005), to plane finite elements of
right-circular notches, which is within some per cent of these.
"""

from __future__ import annotations

import csv
import importlib
from importlib.resources import files
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.model_error.measured import (
    BEAMS,
    BETWEEN_BLOCKS,
    ERRORS,
    KINDS_OF_MEMBERS,
    OTHER_BLOCKS,
    OTHER_TWIST,
    RATIOS_OF,
    MemberErrors,
    beam_stiffness,
    ratios_of,
    stiffness_errors,
)


def notch(radius: float, web: float, width: float) -> fx.describe.Notch:
    return fx.describe.Notch(width=width, contour=fx.describe.CircularContour(radius=radius, web=web))


def leaf(width: float, thickness: float) -> fx.describe.Leaf:
    return fx.describe.Leaf(width=width, thickness=thickness)


def errors(form: Any, length: float, beam: str = "auto", nu: float = 0.3, **how: Any) -> MemberErrors:
    is_link = isinstance(form, fx.describe.Circle | fx.describe.Tube)
    own: dict[str, Any] = {"nodes": ("a", "b"), "material": "m"}
    member = fx.describe.Link(section=form, **own) if is_link else fx.describe.Flexure(profile=form, **own, **how)
    return stiffness_errors(member, length, beam == "auto", shears=beam == "shear", nu=nu)


@pytest.fixture
def measuring(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """benchmarks/member_errors.py"""
    pytest.importorskip("pypardiso")
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
    return importlib.import_module("member_errors")


def rows() -> list[dict[str, str]]:
    with files("flexura.analysis.model_error").joinpath("member_errors.csv").open() as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def test_rows_are_met_at_their_own_ratios(measuring: ModuleType) -> None:
    kinds = set()
    for row in rows():
        if row["nu"] != "0.3":
            continue
        ratios = tuple(float(row[name]) for name in RATIOS_OF if row[name])
        form, length = measuring.described(row["kind"], ratios)
        kind, own = ratios_of(form, length)
        if kind != row["kind"]:  # circular notches that are right-circular have rows of their own
            assert (kind, row["kind"]) == ("right-circular notch", "circular notch")
            continue
        np.testing.assert_allclose(own, ratios)
        own_errors, mesh = np.array([float(row[name]) for name in ERRORS]), float(row["mesh"])
        if kind in BETWEEN_BLOCKS:
            broad = ratios[KINDS_OF_MEMBERS[kind].index("width over length")]
            mesh = mesh + OTHER_BLOCKS + OTHER_TWIST * broad**2 * np.array([0, 1, 0, 0, 0, 0])
        found = errors(form, length, row["beam"], elements=100, integration="tapered")
        # rows have five decimals, which is little where a plain beam is a hundred times too soft
        np.testing.assert_allclose(1 + found.least, (1 + own_errors) * np.exp(-mesh), rtol=5e-4, atol=1e-5)
        np.testing.assert_allclose(1 + found.most, (1 + own_errors) * np.exp(mesh), rtol=5e-4, atol=1e-5)
        assert found.reason == "" and kind == row["kind"]
        kinds.add(kind)
    assert kinds <= set(KINDS_OF_MEMBERS)


@pytest.mark.parametrize(
    ("kind", "ratios"),
    [
        ("leaf", (3.0, 1.4)),
        ("leaf", (25.0, 0.45)),
        ("tapered leaf", (6.0, 2.0, 0.55, 1.3)),
        ("right-circular notch", (3.5, 0.55)),
        ("rod", (3.0,)),
    ],
)
def test_solids_between_rows_lie_within_the_errors(kind: str, ratios: tuple[float, ...], measuring: ModuleType) -> None:
    form, length = measuring.described(kind, ratios)
    true, mesh = measuring.solid(form, length, 0.33)
    for beam in BEAMS:
        off = beam_stiffness(form, length, 0.33, beam, 10, "stepped") / true - 1
        found = errors(form, length, beam, nu=0.33)
        assert np.all(found.least < off + mesh) and np.all(off - mesh < found.most)


def test_wide_strips_bend_as_plates_and_long_bars_as_beams() -> None:
    """E t^3 b / 12 is a share nu^2 too soft for a plate that faces hold flat, and right for a slender bar."""
    found = errors(leaf(60e-3, 1e-3), 9e-3, "none")
    plate = found.most[2]
    assert plate == pytest.approx(-(0.3**2), abs=0.005)
    bar = errors(leaf(1e-3, 1e-3), 20e-3, "none")
    assert abs(bar.least).max() < 0.01 and abs(bar.most).max() < 0.02


def test_narrow_right_circular_notches_turn_as_published() -> None:
    R, t = 6.0, 1.0
    x = np.linspace(-R, R, 100_001)
    beam = 1 / np.trapezoid(12 / (t + 2 * (R - np.sqrt(R * R - x * x))) ** 3, x)
    s = np.sqrt(t / (2 * R))
    published = t**2 / 12 * (-0.0089 + 1.3556 * s - 0.5227 * s * s)
    found = errors(notch(R, t, 0.2 * R), 2 * R, "none", elements=100, integration="tapered")
    assert (found.least[2] + found.most[2]) / 2 == pytest.approx(beam / published - 1, abs=0.035)


def test_other_ratios_of_poisson_make_them_more_uncertain() -> None:
    on, off = (errors(leaf(5e-3, 1e-3), 5e-3, nu=nu) for nu in (0.3, 0.4))
    assert np.all(off.most - off.least > on.most - on.least) and off.reason == ""
    assert "Poisson's ratio 0.48, measured to 0.45" in errors(leaf(5e-3, 1e-3), 5e-3, nu=0.48).reason


def test_outside_of_what_was_measured_the_nearest_row_counts_and_it_is_said() -> None:
    """Thin plates and slender beams are limits, to which errors of what is thinner or longer tend."""
    edge, beyond = (errors(leaf(b, 1e-3), b, elements=100, integration="tapered") for b in (60e-3, 90e-3))
    np.testing.assert_allclose(beyond.least, edge.least, atol=1e-9)
    assert beyond.reason == ""
    short = errors(leaf(10e-3, 1e-3), 1e-3).reason
    assert short == "leaf of length over larger side 0.1, measured from 0.15"
    reason = errors(notch(3e-3, 0.5e-3, 0.3e-3), 6e-3).reason
    assert reason == "right-circular notch of width over length 0.05, measured from 0.1"


def test_what_was_not_measured_has_no_number() -> None:
    profile = fx.describe.TwoAxisNotch(
        y_contour=fx.describe.StraightContour(web=1e-3), z_contour=fx.describe.StraightContour(web=1e-3)
    )
    found = errors(profile, 6e-3)
    assert np.isnan(found.least).all() and found.reason == "no two-axis notch of other contours was measured"


@pytest.mark.parametrize("beam", BEAMS)
def test_a_leaf_described_on_its_side_has_the_same_errors(beam: str) -> None:
    flat, standing = errors(leaf(1e-2, 1e-3), 6e-3, beam), errors(leaf(1e-3, 1e-2), 6e-3, beam)
    np.testing.assert_allclose(flat.least, standing.least[[0, 1, 4, 5, 2, 3]])
    np.testing.assert_allclose(flat.most, standing.most[[0, 1, 4, 5, 2, 3]])
