"""Descriptions in Python are refused as files are: with the place, the value and the rule, never with a traceback of
the library that validates them."""

from __future__ import annotations

import pytest

import flexura as fx
from helpers.over import over

LEAF = fx.describe.Leaf(width=0.01, thickness=0.001)
MEMBER = fx.describe.Flexure(nodes=("a", "b"), material="spring-steel", reference=(0, 0, 1), profile=LEAF)
BEAM = fx.Mechanism(
    nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
    flexures={"leaf": MEMBER},
    ground={"a": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
)

REFUSED = {
    "positional": (lambda: fx.describe.Leaf(0.01, 0.001), "Leaf", "keywords", "width=..."),
    "unknown keyword": (
        lambda: fx.describe.Leaf(widht=0.01, width=1, thickness=1),
        "widht",
        "unknown key",
        "did you mean width",
    ),
    "missing": (lambda: fx.describe.Leaf(width=0.01), "thickness", "missing", ""),
    "text": (lambda: fx.describe.Leaf(width="10 mm", thickness=1), "width", "no unit", "model file"),
    "nothing": (lambda: fx.describe.Leaf(width=None, thickness=1), "width", "a number in SI", ""),
    "nested": (
        lambda: fx.describe.Flexure(
            nodes=("a", "b"), material="m", profile={"type": "leaf", "width": -1, "thickness": 1}
        ),
        *("profile.width", "positive", ""),
    ),
    "another part": (lambda: fx.Mechanism(flexures={"f": LEAF}), "flexures.f", "mapping", ""),
    "as a whole": (
        lambda: fx.describe.Material(E=1e9, rho=1e3, nu=0.3, G=1e9),
        "Material",
        "exactly one of nu and G",
        "follows",
    ),
    "validated": (lambda: fx.describe.Leaf.model_validate({"width": -1, "thickness": 1}), "width", "positive", ""),
    "validated JSON": (
        lambda: fx.describe.Leaf.model_validate_json('{"width": -1, "thickness": 1}'),
        "width",
        "positive",
        "",
    ),
    "no JSON": (lambda: fx.describe.Leaf.model_validate_json('{"width"'), "Leaf", "JSON", ""),
    "assigned": (lambda: setattr(LEAF, "width", 2.0), "Leaf.width", "does not change", "model_copy"),
    "deleted": (lambda: delattr(LEAF, "width"), "Leaf.width", "does not change", "model_copy"),
    "copied": (lambda: LEAF.model_copy(update={"width": -1.0}), "width", "positive", ""),
    "copied with another key": (lambda: LEAF.model_copy(update={"widht": 1.0}), "widht", "unknown key", "width"),
    "copied member": (lambda: MEMBER.model_copy(update={"elements": "x"}), "elements", "whole number", ""),
    "copied mechanism": (lambda: BEAM.model_copy(update={"theory": "none"}), "theory", "one of", ""),
    "copied with a number for a part": (
        lambda: BEAM.model_copy(update={"ground": {"a": 3}}),
        "ground.a",
        "mapping",
        "",
    ),
}


@over("case", REFUSED)
def test_python_is_refused_as_files_are(case: str) -> None:
    make, place, rule, hint = REFUSED[case]
    with pytest.raises(fx.ModelError) as caught:
        make()
    (problem,) = caught.value.problems
    assert problem.place == place
    assert rule in problem.rule
    assert hint in problem.hint


def test_a_copy_is_the_part_with_other_values() -> None:
    thick = LEAF.model_copy(update={"thickness": 0.002})
    assert thick == fx.describe.Leaf(width=0.01, thickness=0.002)
    assert LEAF.thickness == 0.001
    assert LEAF.model_copy() == LEAF and LEAF.model_copy(deep=True) == LEAF
    assert BEAM.model_copy(update={"theory": "timoshenko"}).flexures == BEAM.flexures
    assert "theory" not in BEAM.model_copy(update={"name": "b"}).model_fields_set


@pytest.mark.parametrize("call", [lambda: fx.load(None), lambda: fx.loads(3), lambda: fx.modes(BEAM, 3)])
def test_other_arguments_are_refused_by_name(call) -> None:
    with pytest.raises(fx.OptionError, match=r"expected|by name"):
        call()
