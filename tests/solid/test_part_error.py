"""The part's frequency lies within `model_error` of the printed one: whole solids kept by benchmarks/part_error.py.

Their frequencies are those of the part as one elastic piece (NGSolve, curved tetrahedra), within half a per cent.
"""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

KNOWN_TO = 0.005
"""Relative error of the solids."""

QUICK = (
    "leaf_guide_3",
    "notch_guide_1",
    "folded_guide_1",
    "cross_pivot_1",
    "angle_pivot_1",
    "bridge_1",
    "three_leaves_2",
)


@pytest.fixture(scope="module")
def part_error() -> Any:
    """The script, as a module."""
    return [_module(name) for name in ("part_mechanisms", "part_error")][1]


def _module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", QUICK)
def test_part_lies_within_the_margin(part_error: Any, name: str) -> None:
    family, make = part_error.mechanisms()[name]
    rows = part_error.compared(name, family, make(), part_error.read_solids()[name])
    assert len(rows) == part_error.MODES
    beyond = {row["mode"]: part_error.outside(row) for row in rows}
    assert all(by <= KNOWN_TO for by in beyond.values()), beyond


def test_a_part_that_is_softer_than_any_margin_is_found(part_error: Any) -> None:
    """A margin that contained everything would say nothing: that of a plain guide does not hold half the frequency."""
    family, make = part_error.mechanisms()["leaf_guide_3"]
    solid = part_error.read_solids()["leaf_guide_3"]
    rows = part_error.compared("leaf_guide_3", family, make(), replace(solid, hz=solid.hz / 2))
    assert [row["inside"] for row in rows] == ["no"] * part_error.MODES


def test_there_are_sixty_descriptions_and_solids_of_them_alone(part_error: Any) -> None:
    names = list(part_error.mechanisms())
    assert len(names) == 60
    assert set(part_error.read_solids()) <= set(names)
