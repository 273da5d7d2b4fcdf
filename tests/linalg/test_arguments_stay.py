"""No function of linear algebra changes its arguments, ours or SciPy's as we call it, whatever verb calls it."""

from __future__ import annotations

import functools
import hashlib
import importlib
import inspect
import pkgutil
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"

SCIPY = {
    spla: ("splu", "spsolve", "eigsh", "factorized"),
    la: ("eigh", "eig", "eigvalsh", "cholesky", "cho_factor", "cho_solve", "solve", "solve_triangular", "svd", "qr"),
}


def digest(value: Any, seen: tuple[int, ...] = ()) -> Any:
    """What is stored in arrays, sparse matrices and whatever holds them; other things count as their type."""
    if isinstance(value, np.ndarray):
        return (value.shape, value.dtype.str, hashlib.sha1(np.ascontiguousarray(value).tobytes()).hexdigest())
    if hasattr(value, "tocsc"):
        kept = [getattr(value, name) for name in ("data", "indices", "indptr", "row", "col", "offsets")
                if isinstance(getattr(value, name, None), np.ndarray)]  # fmt: skip
        return (value.shape, *map(digest, kept))
    if isinstance(value, list | tuple):
        return tuple(digest(v, seen) for v in value)
    if isinstance(value, dict):
        return tuple((str(k), digest(v, seen)) for k, v in value.items())
    if is_dataclass(value) and not isinstance(value, type) and id(value) not in seen and len(seen) < 3:
        return tuple((f.name, digest(getattr(value, f.name), (*seen, id(value)))) for f in fields(value))
    return type(value).__name__


class Watch:
    """Stands for functions and compares what they were given before and after; `calls` by name, `changed` in words."""

    def __init__(self):
        self.calls: dict[str, int] = {}
        self.changed: list[str] = []

    def of(self, function, name):
        @functools.wraps(function)
        def watched(*args, **options):
            before = digest((args, options))
            self.calls[name] = self.calls.get(name, 0) + 1
            try:
                return function(*args, **options)
            finally:
                if digest((args, options)) != before:
                    self.changed.append(name)

        return watched


@pytest.fixture
def watch(monkeypatch):
    """Every function of `flexura.linalg`, wherever it was imported to, and those of SciPy that factorise or solve."""
    found = Watch()
    for own in pkgutil.walk_packages(fx.__path__, "flexura."):
        if not own.name.endswith("__main__"):
            importlib.import_module(own.name)
    modules = {name: module for name, module in sys.modules.items() if name.startswith("flexura")}
    ours = {
        function
        for name, module in modules.items()
        if name.startswith("flexura.linalg.")
        for function in vars(module).values()
        if inspect.isfunction(function) and function.__module__ == name
    }
    for module in modules.values():
        for key, value in list(vars(module).items()):
            if inspect.isfunction(value) and value in ours:
                monkeypatch.setattr(module, key, found.of(value, f"{value.__module__}.{value.__name__}"))
    for library, names in SCIPY.items():
        for name in names:
            monkeypatch.setattr(library, name, found.of(getattr(library, name), f"{library.__name__}.{name}"))
    return found


def modes(design, held):
    return fx.modes(design, n=6).frequency_hz


def full_modes(design, held):
    return fx.modes(design, n=6, order="full").frequency_hz


def certificate(design, held):
    return fx.models.certify(fx.reduce(design), held, n=4).lower_hz


def batch(design, held):
    return fx.natural_frequencies(design, {}, n=3).frequency_hz


def modal(design, held):
    return fx.system(held).modal(4).response([5.0, 50.0])


def balanced(design, held):
    return fx.state_space(fx.system(design, damping=0.01, tolerance=0.01, n=4), balanced=4).A


def response(design, held):
    return fx.frequency_response(held, frequency_hz=[5.0, 50.0], damping=0.01, order="full", method="direct").response


def buckling(design, held):
    return fx.preload(held, gravity=(0, 0, -9.81)).buckling_factors(2)


def gravity(design, held):
    return fx.statics(held, gravity=(0, 0, -9.81)).displacement_vector


VERBS = (modes, full_modes, certificate, batch, modal, balanced, response, buckling, gravity)


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize(
    "name", ["rpr", *(pytest.param(n, marks=pytest.mark.slow) for n in ("guide", "xy_stage", "tip_tilt"))]
)
def test_no_argument_is_changed(watch, name, verb):
    """The model that is held between the calls stays as it was assembled, and asking twice gives the same digits."""
    design = fx.load(EXAMPLES / name / f"{name}.yaml")
    held = fx.assemble(design)
    before = digest((held.K, held.M))
    first = verb(design, held)
    assert sum(watch.calls.values()) > 0
    assert watch.changed == []
    assert np.array_equal(verb(design, held), first)
    assert digest((held.K, held.M)) == before


def test_a_change_would_be_seen(watch):
    """SuperLU sorts the indices of what it is given, which is why it is given a copy."""
    A = sp.csc_matrix(np.array([[2.0, 1.0], [1.0, 3.0]]))
    A.indices, A.data = A.indices[[1, 0, 2, 3]], A.data[[1, 0, 2, 3]]
    A.has_sorted_indices = False
    fx.linalg.factorise(A)
    assert "flexura.linalg.factor.factorise" in watch.calls and watch.changed == []
    spla.splu(A)
    assert watch.changed == ["scipy.sparse.linalg.splu"]


@pytest.mark.parametrize("name", ["guide", "rpr", "xy_stage", "tip_tilt", "amplifier", "pivot"])
def test_stiffness_and_mass_are_symmetric_to_the_last_bit(name):
    design = fx.load(EXAMPLES / name / f"{name}.yaml")
    for model in (fx.assemble(design), fx.reduce(design), fx.reduce(design, keep=2)):
        for A in (model.K, model.M):
            assert abs(A - A.T).max() == 0
