"""Goals and limits of the designs around an optimum, over one or two of its variables.

Values between designs that are worked out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexura.arrays import Array
from flexura.structure import Plan, plan_of
from flexura.study.optimum.landscape import Box
from flexura.study.optimum.results import Optimum, OptimumVariable
from flexura.study.questions import Formula, Quantity, Questions, Relation, formula, relation
from flexura.tables import counted


@dataclass(frozen=True)
class Way:
    """The way along which a variable is interpolated: by its logarithm where that is known."""

    low: float
    high: float
    by_logarithm: bool

    @staticmethod
    def of(low: float, high: float) -> Way:
        """The way between two values, by the logarithm where both are positive."""
        return Way(float(low), float(high), low > 0)

    def at(self, x: Array) -> Array:
        """How far (n,) values lie along it."""
        return np.log(x) if self.by_logarithm else x

    def values(self, part: Array) -> Array:
        """Values (n,) at parts of it."""
        own = self.low + (self.high - self.low) * part
        if self.by_logarithm:
            own = self.low * (self.high / self.low) ** part
        return np.clip(own, self.low, self.high)


@dataclass(frozen=True)
class Fit:
    """Values between `nodes` along each way: by a polynomial, of logarithms where they are positive, or straight."""

    ways: Sequence[Way]
    nodes: Sequence[Array]
    values: Array

    def at(self, x: Sequence[Array], is_smooth: bool = True) -> Array:
        """Values over a grid; straight, none beside nodes without an answer."""
        is_smooth &= bool(np.isfinite(self.values).all())
        by_logarithm = is_smooth and bool((self.values > 0).all())
        own = np.log(self.values) if by_logarithm else self.values
        for axis, (way, nodes, values) in enumerate(zip(self.ways, self.nodes, x, strict=True)):
            along, at = way.at(nodes), way.at(values)
            own = _polynomial(along, own, axis, at) if is_smooth else _straight(along, own, axis, at)
        return np.exp(own) if by_logarithm else own

    def off(self, probes: Sequence[Array], known: Array) -> float:
        """The largest difference from answers at probes (n,) along each way, relative to the answers; infinite where
        there is none."""
        grid = self.at(probes)
        found = grid[(np.arange(len(known)),) * len(probes)]
        size = np.abs(known) if (known > 0).all() else np.abs(known).max()
        with np.errstate(invalid="ignore"):
            worst = float(np.max(np.abs(found - known) / np.maximum(size, 1e-300)))
        return worst if np.isfinite(worst) and np.isfinite(self.values).all() else np.inf


def _polynomial(nodes: Array, values: Array, axis: int, at: Array) -> Array:
    """Values along an axis by Lagrange's polynomials."""
    apart = nodes[:, None] - nodes + np.eye(len(nodes))
    off = np.broadcast_to((at[:, None] - nodes)[:, None], (len(at), *apart.shape))
    share = np.prod(np.where(np.eye(len(nodes), dtype=bool), 1.0, off / apart), axis=-1)
    return np.moveaxis(np.moveaxis(values, axis, -1) @ share.T, -1, axis)


def _straight(nodes: Array, values: Array, axis: int, at: Array) -> Array:
    k = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    part, lines = (at - nodes[k]) / (nodes[k + 1] - nodes[k]), np.moveaxis(values, axis, -1)
    return np.moveaxis((1 - part) * lines[..., k] + part * lines[..., k + 1], -1, axis)


ALONG = {1: 81, 2: 24}
"""Values of a variable, of one and of two of them."""

NODES = {1: (5, 15), 2: (3, 7)}
"""Values at which is asked what takes each design by itself; the second where the first do not tell enough."""

PROBES = np.array([[0.27, 0.71], [0.78, 0.33], [0.45, 0.12]])
"""Parts of the ranges at which interpolated values are held against answers."""

QUICK_PROBES = np.random.default_rng(7).random((32, 2))
"""The same of frequencies of many designs at once, which are asked of all where they are not `EXACT` between some."""

EXACT = 1e-3
"""Difference from answers that nobody sees in a picture."""

LEVELS = 60
"""Values of a list, or whole numbers, that are shown."""

LARGE = 3000
"""Free DOFs of a mechanism of which nothing is asked everywhere."""

NEAR = 0.01
"""Difference from the answers up to which interpolated values are taken for them."""

SMOOTH = 0.1
"""Difference from which on nothing is taken to be smooth."""

STEP = 0.1
"""Part of its range that each variable is moved by to see which matter most."""


@dataclass(frozen=True)
class DesignSlice:
    """Designs through an optimum over one or two variables `along`, SI: their values `x`, ascending, one of which is
    the optimum's; the `goal` and `margins` of limits by their text, not negative where they are met, over the values of
    the variables in their order, NaN where there is no answer. All others are `held`; `notes` say what is not asked of
    each design."""

    along: tuple[OptimumVariable, ...]
    x: tuple[Array, ...]
    goal: Array
    margins: Mapping[str, Array]
    held: tuple[OptimumVariable, ...]
    is_discrete: bool
    by_logarithm: tuple[bool, ...]
    notes: tuple[str, ...]


def slice_of(result: Optimum) -> DesignSlice:
    """The slice through an optimum along the two continuous variables that matter most to the goal and to the limits
    that hold it, along one where there is one, else along one of integers or of a list."""
    asked = _Asked.of(result)
    ranged = [own for own in result.variables if own.kind == "continuous"]
    count = min(len(ranged), 2) or 1
    chosen = asked.foremost(ranged or list(result.variables), count)
    box = _box(chosen)
    x = [_values(own, box, k, ALONG[count]) for k, own in enumerate(chosen)]
    found = asked.over(box, x, count if ranged else 0)
    shape = tuple(map(len, x))
    goal, *rows = (np.asarray(own.evaluate(found), dtype=float) for own in (asked.goal, *asked.limits))
    margins = {own.text: np.broadcast_to(row, shape) for own, row in zip(asked.limits, rows, strict=True)}
    held = tuple(own for own in result.variables if own not in chosen)
    wide, notes = tuple(map(bool, box.by_logarithm)), tuple(asked.notes)
    return DesignSlice(chosen, tuple(x), np.broadcast_to(goal, shape), margins, held, not ranged, wide, notes)


def _box(variables: Sequence[OptimumVariable]) -> Box:
    low, high = np.array([(own.low, own.high) for own in variables]).T
    return Box(tuple(own.name for own in variables), low, high)


def _values(own: OptimumVariable, box: Box, k: int, count: int) -> Array:
    """Values of a variable of a box, with the optimum's among them."""
    if own.kind != "continuous":
        whole = np.round(np.linspace(own.low, own.high, int(min(own.high - own.low + 1, LEVELS))))
        levels = np.array(own.levels or whole)
        return np.union1d(levels[:: -(-len(levels) // LEVELS)], own.value)
    found = box.values(np.repeat(np.linspace(0, 1, count)[:, None], len(box.names), axis=1))[:, k]
    found[1 + np.abs(found[1:-1] - own.value).argmin()] = own.value
    return np.unique(found)


@dataclass(frozen=True)
class _Asked:
    """What is asked of designs around one, whose variables are `at`."""

    plan: Plan
    at: Mapping[str, float]
    goal: Formula
    limits: Sequence[Relation]
    active: Sequence[Relation]
    notes: list[str] = field(default_factory=list)

    @staticmethod
    def of(result: Optimum) -> _Asked:
        plan = plan_of(result.mechanism, result.parameters)
        limits = [relation(plan, text) for text in result.subject_to]
        active = {own.text for own in result.active}
        goal = formula(plan, result.goal.partition(" ")[2])
        holding = [own for own in limits if own.text in active]
        return _Asked(plan, {**result.parameters, **result.design}, goal, limits, holding)

    @property
    def quantities(self) -> list[Quantity]:
        """All of it, each once."""
        return [*dict.fromkeys(q for own in (self.goal, *self.limits) for q in own.quantities)]

    def values(self, quantities: Sequence[Quantity], x: Mapping[str, Array]) -> dict[str, Array]:
        """What is asked by its text, of designs whose variables are moved."""
        found = Questions(self.plan, tuple(quantities)).values({**self.at, **x}).value
        return {own.text: found[:, k] for k, own in enumerate(quantities)}

    def foremost(self, variables: Sequence[OptimumVariable], count: int) -> tuple[OptimumVariable, ...]:
        """So many variables, those first that change the goal, or a limit that holds it, by most of their size."""
        if len(variables) <= count:
            return tuple(variables)
        box = _box(variables)
        here = box.positions(np.array([own.value for own in variables]))
        moved = np.concatenate([here[None], *(here + way * STEP * np.eye(len(here)) for way in (1, -1))])
        x = box.values(moved)
        found = self.values(self.quantities, {own.name: x[:, k] for k, own in enumerate(variables)})
        goal = np.broadcast_to(np.asarray(self.goal.evaluate(found), dtype=float), len(x))
        rows = [goal / (abs(goal[0]) or 1.0), *(own.evaluate(found) for own in self.active)]
        change = np.nan_to_num(np.max([np.abs(own[1:] - own[0]) for own in rows], axis=0), posinf=0.0)
        order = np.argsort(-np.maximum(*np.split(change, 2)), kind="stable")[:count]
        return tuple(variables[k] for k in sorted(order))

    def over(self, box: Box, x: Sequence[Array], smooth: int) -> dict[str, Array]:
        """What is asked over a grid of values; of `smooth` variables that are continuous, what takes each design by
        itself is interpolated between some, and over two of them frequencies where nobody would see it."""
        quick, some = [], []
        for own in self.quantities:
            at_once = Questions(self.plan, (own,)).is_stacked and self.plan.topology.n_dof <= LARGE
            (quick if at_once or not smooth else some).append(own)
        found, near = dict[str, Array](), dict[str, Fit]()
        if smooth == len(NODES) and (many := [own for own in quick if own.kind == "f"]):
            fits, off = self._fitted(many, box, NODES[smooth][1:], QUICK_PROBES)
            near = {text: own for text, own in fits.items() if off[text] <= EXACT}
            found = self._told(near, off, x)
        everywhere = [own for own in quick if own.text not in near]
        if everywhere:
            found |= self._grid(everywhere, box.names, x)
        if some:
            found |= self._told(*self._fitted(some, box, NODES[smooth], PROBES), x)
        return found

    def _grid(self, quantities: Sequence[Quantity], names: Sequence[str], x: Sequence[Array]) -> dict[str, Array]:
        mesh = np.meshgrid(*x, indexing="ij")
        found = self.values(quantities, {name: own.ravel() for name, own in zip(names, mesh, strict=True)})
        return {text: own.reshape(mesh[0].shape) for text, own in found.items()}

    def _fitted(
        self, quantities: Sequence[Quantity], box: Box, counts: Sequence[int], parts: Array
    ) -> tuple[dict[str, Fit], dict[str, float]]:
        """What is between some designs, of as few of the `counts` of them along each way as tell enough, and how far it
        is off at `parts` of the ranges."""
        ways = [Way.of(low, high) for low, high in zip(box.low, box.high, strict=True)]
        probes = [way.values(own) for way, own in zip(ways, parts.T, strict=False)]
        known = self.values(quantities, dict(zip(box.names, probes, strict=True)))
        fits, off, left = dict[str, Fit](), dict[str, float](), list(quantities)
        for count in counts:
            nodes = [way.values(0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))) for way in ways]
            found = self._grid(left, box.names, nodes)
            fits |= {text: Fit(ways, nodes, own) for text, own in found.items()}
            off |= {text: fits[text].off(probes, known[text]) for text in found}
            left = [own for own in left if off[own.text] > NEAR]
            if not left:
                break
        return fits, off

    def _told(self, fits: Mapping[str, Fit], off: Mapping[str, float], x: Sequence[Array]) -> dict[str, Array]:
        """Values over a grid between designs; `notes` say of how many, and how far they are off at others."""
        for text, own in fits.items():
            by = max(100 * off[text], 1e-4)
            said = f"{by:.2g} % off at others" if np.isfinite(by) else "not all of which have an answer"
            self.notes.append(f"{text} is interpolated between {counted(own.values.size, 'design')}, {said}")
        return {text: fit.at(x, off[text] <= SMOOTH) for text, fit in fits.items()}
