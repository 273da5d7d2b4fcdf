"""Every public verb says which argument has a wrong type, in an error of flexura's own."""

from __future__ import annotations

import inspect
import pickle

import numpy as np
import pytest

import flexura as fx
from flexura.arguments import verb
from helpers.over import over
from helpers.public_names import public_names

VERBS = {
    name: own
    for name, own in public_names().items()
    if inspect.isfunction(own) and name not in ("size_limits", "schema")
}
OF_NUMBERS = {"modal.comac", "modal.frac", "modal.mac", "screw_axis"}
"""Verbs that take a single number for an array."""

OF_NAMES = {"describe.parameter"}
"""Verbs that take any text."""


def needed(function, value):
    """Positions and keywords of the arguments that a function must have, all of one value."""
    own = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty]
    places = [value for p in own if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    return places, {p.name: value for p in own if p.kind is p.KEYWORD_ONLY}


@over("value", [3, None, "no/such/path", object(), [object()], {"a": 1}])
@over("name", VERBS)
def test_a_wrong_type_is_an_error_of_ours(name, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    places, keywords = needed(VERBS[name], value)
    if (name in OF_NUMBERS and value == 3) or (name in OF_NAMES and isinstance(value, str)):
        return
    with pytest.raises(fx.FlexuraError) as caught:
        VERBS[name](*places, **keywords)
    assert str(caught.value).strip()
    assert not list(tmp_path.iterdir())


def test_the_argument_its_type_and_what_is_expected_are_said():
    mechanism = fx.load("examples/guide/guide.yaml")
    with pytest.raises(fx.OptionError, match=r"state_space: `system` is System or ModalSystem, not Mechanism"):
        fx.state_space(mechanism)  # pyright: ignore[reportArgumentType]
    with pytest.raises(fx.OptionError, match=r"save: `path` is str or FilePath, not int \(3\)"):
        fx.save(mechanism, 3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(fx.OptionError, match=r"read_frequencies: `path` is str or Path, not int"):
        fx.testing.read_frequencies(3)  # pyright: ignore[reportArgumentType]


def test_what_no_argument_explains_stays_as_it_is():
    @verb
    def count(text: str, of: str = "a") -> int:
        return {"a": 1}[text]

    assert count("a") == 1
    with pytest.raises(KeyError):
        count("b")
    with pytest.raises(TypeError, match="unexpected keyword"):
        count("a", to="b")  # pyright: ignore[reportCallIssue]
    with pytest.raises(fx.OptionError, match=r"count: `text` is str, not list \(\[\]\)"):
        count([])  # pyright: ignore[reportArgumentType]


def test_numbers_that_no_solver_takes():
    @verb
    def lowest(K: object) -> object:
        return np.linalg.inv(np.zeros((2, 2)))

    with pytest.raises(fx.SolverError, match="lowest: numbers too far apart"):
        lowest(None)


def test_verbs_are_found_again_by_other_processes():
    assert all(pickle.loads(pickle.dumps(own)) is own for own in VERBS.values())
