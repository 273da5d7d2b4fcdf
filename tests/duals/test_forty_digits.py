"""Derivatives of frequencies against differences at 40 digits of the same formulas, for every parameter."""

import itertools
from decimal import Decimal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg as la

import flexura as fx
from flexura.derivatives import free_names, frequency_slopes
from flexura.derivatives.eigenpairs import whole_clusters
from flexura.derivatives.families import FullOrderFamily
from flexura.duals import Dual
from flexura.linalg import factorise
from flexura.structure import Design, DiscreteElement
from helpers.forty_digits import Precise, forty_digits

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = ["guide/guide", "pivot/pivot"]
SLOW = ["amplifier/amplifier", "rpr/start", "rpr/start_corrected", "tip_tilt/tip_tilt", "xy_stage/xy_stage"]
LARGE = ["rpr/rpr", "rpr/rpr_piezo", "rpr/rpr_test", "imported/guide"]


def differences(plan, name, X):
    """X' K' X and X' M' X (k, k) for fixed vectors (n, k), by central differences with a step of 1e-12."""
    with forty_digits():
        family, value = FullOrderFamily(plan), Decimal(float(plan.parameter_values()[name]))
        step = (abs(value) or 1) * Decimal(10) ** -12
        up, down = (family.products({name: Precise(value + side * step)}, X)[:2] for side in (1, -1))
        return [np.asarray((X.T @ (a - b)) / (2 * step)) for a, b in zip(up, down, strict=True)]


def numbers(design):
    """All numbers of a design of which its matrices are made, as its parts hold them."""
    found = {}
    for name, own in design.matrices.items():
        part, nodes = design.plan.parts[name], np.arange(design.plan.parts[name].n_nodes)
        found[name, "G"], found[name, "x"] = design.node_transforms(name, nodes), design.geometry.parts[name].positions
        if len(part.connectivity):
            found[name, "T"], elements = own.T, own.elements
            found.update({(name, key): getattr(elements, key) for key in ("K", "M", "length")})
        for k, (_, _, K, M) in enumerate(own.discrete_elements):
            found.update({(name, k, key): A for key, A in (("K", K), ("M", M)) if A is not None})
        found.update({(name, "strips", k): strips.K for k, strips in enumerate(own.strips)})
    return found


def sloped(plan, names):
    """A design whose numbers have slopes by central differences with a step of 1e-12 at 40 digits."""
    at, still = plan.parameter_values(), Design.of(plan)
    base = {key: np.array(x, dtype=float) for key, x in numbers(still).items()}
    slopes = {key: np.zeros((len(names), *x.shape)) for key, x in base.items()}
    with forty_digits():
        for p, name in enumerate(names):
            value = Decimal(float(at[name]))
            step = (abs(value) or 1) * Decimal(10) ** -12
            up, down = (numbers(Design.of(plan, {name: Precise(value + side * step)})) for side in (1, -1))
            for key in base:
                if isinstance(up[key], Precise):
                    slopes[key][p] = np.asarray((up[key] - down[key]) / (2 * step))
    found = {key: Dual(x, slopes[key]) for key, x in base.items()}
    matrices = {}
    for name, own in still.matrices.items():
        elements = SimpleNamespace(**{key: found.get((name, key)) for key in ("K", "M", "length")})
        discrete = [
            x._replace(K=found.get((name, k, "K")), M=found.get((name, k, "M")))
            for k, x in enumerate(own.discrete_elements)
        ]
        strips = [
            SimpleNamespace(
                each=[
                    DiscreteElement("", nodes, found[name, "strips", k][m], None)
                    for m, nodes in enumerate(x.nodes.tolist())
                ]
            )
            for k, x in enumerate(own.strips)
        ]
        matrices[name] = SimpleNamespace(
            T=found.get((name, "T")), elements=elements, discrete_elements=discrete, strips=strips
        )
    return SimpleNamespace(
        plan=plan,
        values=Dual(still.values, np.zeros((len(names), *still.values.shape))),
        matrices=matrices,
        node_transforms=lambda name, nodes: found[name, "G"][:, nodes],
        geometry=SimpleNamespace(parts={name: SimpleNamespace(positions=found[name, "x"]) for name in matrices}),
    )


def changes(plan, names, X):
    """X' K' X and X' M' X (P, k, k) of the whole model for fixed vectors (n, k), each parameter by differences."""
    return [np.stack(own) for own in zip(*(differences(plan, name, X) for name in names), strict=True)]


def changes_by_parts(plan, names, X):
    """The same with differences of the numbers of parts, put together with their slopes."""
    X = np.asarray(X)
    KX, MX, _ = FullOrderFamily(plan).products_of(sloped(plan, names), X)
    return [X.T @ own.slope for own in (KX, MX)]


def precise_pairs(plan, name, n):
    """Eigenvalues (k,) and vectors (n, k) of 40 digits, M-orthonormal to 16: after a step of inverse iteration by the
    residual at 40 digits, of which the factors of the assembled K solve for what is missing; it gains seven digits."""
    family, value = FullOrderFamily(plan), Decimal(float(plan.parameter_values()[name]))
    model = family.model({})
    found, solve = whole_clusters(model.K, model.M, n), factorise(model.K).solve
    with forty_digits():
        X = Precise(found.vectors)
        KX, MX, _ = family.products({name: Precise(value)}, X)
        X = X + solve(np.ascontiguousarray(MX * found.values - KX))
        KX, MX, _ = family.products({name: Precise(value)}, X)
        values, turn = la.eigh(*(np.asarray(X.T @ own) for own in (KX, MX)))
        return values, X @ turn


def expected_slopes(plan, names, n, by):
    """f' (k, P), Hz per SI unit, of the branches that frequencies go into."""
    values, X = precise_pairs(plan, names[0], n)
    found = np.zeros((len(values), len(names)))
    groups = np.split(np.arange(len(values)), 1 + np.flatnonzero(np.diff(values) > 1e-6 * values[1:]))
    K, M = by(plan, names, X)
    for p, at in itertools.product(range(len(names)), groups):
        value, own = values[at].mean(), np.ix_(at, at)
        S = K[p][own] - value * M[p][own]
        found[at, p] = np.linalg.eigvalsh((S + S.T) / 2) / (4 * np.pi * np.sqrt(value))
    return found


def compare(example, by):
    mechanism = fx.load(EXAMPLES / f"{example}.yaml")
    free = {name: p.replaced({"minimum": None, "maximum": None}) for name, p in mechanism.parameters.items()}
    plan = fx.Plan(mechanism.replaced({"parameters": free}))
    names = free_names(plan, None)
    assert names
    found = frequency_slopes(Design.with_slopes(plan, {}, names), 6)
    expected = expected_slopes(plan, names, 6, by)
    at = np.abs([float(plan.parameter_values()[name]) for name in names])
    none = 1e-12 * found.frequency_hz[0] / np.where(at, at, 1.0)
    size = np.maximum(np.abs(expected).max(axis=0), none)
    assert (np.abs(found.slope - expected) <= 1e-7 * size).all()


@pytest.mark.parametrize("example", [*QUICK, *(pytest.param(e, marks=pytest.mark.slow) for e in SLOW)])
def test_frequencies_of_examples(example):
    compare(example, changes)


@pytest.mark.parametrize("example", [QUICK[0], *(pytest.param(e, marks=pytest.mark.slow) for e in LARGE)])
def test_frequencies_of_examples_by_their_parts(example):
    compare(example, changes_by_parts)
