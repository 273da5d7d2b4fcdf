"""Goals and limits of the designs around an optimum, over one or two of its variables.

What takes each design by itself is interpolated between some: along every variable, by its logarithm where it is
positive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexura.arrays import Array
from flexura.full_order import plan_of
from flexura.structure import Plan
from flexura.study.optimum.landscape import Box
from flexura.study.optimum.results import Optimum, OptimumVariable
from flexura.study.questions import Formula, Quantity, Questions, Relation, formula, relation
from flexura.tables import counted

ALONG = {1: 81, 2: 24}
"""Values of a variable, of one and of two of them."""

NODES = {1: (5, 15), 2: (3, 7)}
"""Values at which is asked what takes each design by itself; the second where the first do not tell enough."""

PROBES = np.array([[0.27, 0.71], [0.78, 0.33], [0.45, 0.12]])
"""Parts of the ranges at which interpolated values are held against answers."""

QUICK_PROBES = np.random.default_rng(7).random((32, 2))
"""The same of frequencies of many designs at once, which are asked of all where they are not `INVISIBLE` between
some."""

INVISIBLE = 1e-3
"""Difference from answers that nobody sees in a picture."""

MOST_LEVELS = 60
"""Values of a list, or whole numbers, that are shown."""

LARGE_ORDER = 3000
"""Free DOFs of a mechanism of which nothing is asked everywhere."""

NEAR_ENOUGH = 0.01
"""Difference from the answers up to which interpolated values are taken for them."""

NOT_SMOOTH = 0.1
"""Difference from which on nothing is taken to be smooth."""

SIGNIFICANCE_STEP = 0.1
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
    ranged = [variable for variable in result.variables if variable.kind == "continuous"]
    count = min(len(ranged), 2) or 1
    along = asked.foremost(ranged or list(result.variables), count)
    box = _box(along)
    x = [_values(variable, box, k, ALONG[count]) for k, variable in enumerate(along)]
    answers = asked.over(box, x, count if ranged else 0)
    shape = tuple(map(len, x))
    goal, *margins = (
        np.broadcast_to(np.asarray(function.evaluate(answers), dtype=float), shape)
        for function in (asked.goal, *asked.limits)
    )
    return DesignSlice(
        along=along,
        x=tuple(x),
        goal=goal,
        margins={limit.text: margin for limit, margin in zip(asked.limits, margins, strict=True)},
        held=tuple(variable for variable in result.variables if variable not in along),
        is_discrete=not ranged,
        by_logarithm=tuple(map(bool, box.by_logarithm)),
        notes=tuple(asked.notes),
    )


def _box(variables: Sequence[OptimumVariable]) -> Box:
    low, high = np.array([(variable.low, variable.high) for variable in variables]).T
    return Box(tuple(variable.name for variable in variables), low, high)


def _values(variable: OptimumVariable, box: Box, k: int, count: int) -> Array:
    """Values of a variable of a box, with the optimum's among them."""
    low, high, best = variable.low, variable.high, variable.value
    if variable.kind != "continuous":
        whole = np.round(np.linspace(low, high, int(min(high - low + 1, MOST_LEVELS))))
        levels = np.array(variable.levels or whole)
        return np.union1d(levels[:: -(-len(levels) // MOST_LEVELS)], best)
    values = box.values(np.repeat(np.linspace(0, 1, count)[:, None], len(box.names), axis=1))[:, k]
    values[1 + np.abs(values[1:-1] - best).argmin()] = best
    return np.unique(values)


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
        active = {limit.text for limit in result.active}
        goal = formula(plan, result.goal.partition(" ")[2])
        holding = [limit for limit in limits if limit.text in active]
        return _Asked(plan, {**result.parameters, **result.design}, goal, limits, holding)

    @property
    def quantities(self) -> list[Quantity]:
        """All of it, each once."""
        return [*dict.fromkeys(quantity for asked in (self.goal, *self.limits) for quantity in asked.quantities)]

    def values(self, quantities: Sequence[Quantity], x: Mapping[str, Array]) -> dict[str, Array]:
        """What is asked by its text, of designs whose variables are moved."""
        answers = Questions(self.plan, tuple(quantities)).values({**self.at, **x}).value
        return {quantity.text: answers[:, k] for k, quantity in enumerate(quantities)}

    def foremost(self, variables: Sequence[OptimumVariable], count: int) -> tuple[OptimumVariable, ...]:
        """So many variables, those first that change the goal, or a limit that holds it, by most of their size."""
        if len(variables) <= count:
            return tuple(variables)
        box = _box(variables)
        here = box.positions(np.array([variable.value for variable in variables]))
        step = SIGNIFICANCE_STEP * np.eye(len(here))
        x = box.values(np.concatenate([here[None], here + step, here - step]))
        answers = self.values(self.quantities, {variable.name: x[:, k] for k, variable in enumerate(variables)})
        goal = np.broadcast_to(np.asarray(self.goal.evaluate(answers), dtype=float), len(x))
        rows = [goal / (abs(goal[0]) or 1.0), *(limit.evaluate(answers) for limit in self.active)]
        change = np.nan_to_num(np.max([np.abs(row[1:] - row[0]) for row in rows], axis=0), posinf=0.0)
        order = np.argsort(-np.maximum(*np.split(change, 2)), kind="stable")[:count]
        return tuple(variables[k] for k in sorted(order))

    def over(self, box: Box, x: Sequence[Array], smooth: int) -> dict[str, Array]:
        """What is asked over a grid of values; of `smooth` variables that are continuous, what takes each design by
        itself is interpolated between some, and over two of them frequencies where nobody would see it."""
        quick, slow = list[Quantity](), list[Quantity]()
        for quantity in self.quantities:
            is_quick = Questions(self.plan, (quantity,)).is_stacked and self.plan.topology.n_dof <= LARGE_ORDER
            (quick if is_quick or not smooth else slow).append(quantity)
        answers = dict[str, Array]()
        if smooth == len(NODES) and (frequencies := [quantity for quantity in quick if quantity.kind == "f"]):
            fits, off = self._fitted(frequencies, box, NODES[smooth][1:], QUICK_PROBES)
            answers = self._read({text: fit for text, fit in fits.items() if off[text] <= INVISIBLE}, off, x)
        if everywhere := [quantity for quantity in quick if quantity.text not in answers]:
            answers |= self._grid(everywhere, box.names, x)
        if slow:
            answers |= self._read(*self._fitted(slow, box, NODES[smooth], PROBES), x)
        return answers

    def _grid(self, quantities: Sequence[Quantity], names: Sequence[str], x: Sequence[Array]) -> dict[str, Array]:
        mesh = np.meshgrid(*x, indexing="ij")
        answers = self.values(quantities, {name: values.ravel() for name, values in zip(names, mesh, strict=True)})
        return {text: values.reshape(mesh[0].shape) for text, values in answers.items()}

    def _fitted(
        self, quantities: Sequence[Quantity], box: Box, counts: Sequence[int], parts: Array
    ) -> tuple[dict[str, Fit], dict[str, float]]:
        """What is between some designs, of as few of the `counts` of them along each axis as tell enough, and how far
        it is off at `parts` of the ranges."""
        axes = [Axis.of(low, high) for low, high in zip(box.low, box.high, strict=True)]
        probes = [axis.values(part) for axis, part in zip(axes, parts.T, strict=False)]
        known = self.values(quantities, dict(zip(box.names, probes, strict=True)))
        fits, off, left = dict[str, Fit](), dict[str, float](), list(quantities)
        for count in counts:
            nodes = [axis.values(0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))) for axis in axes]
            for text, values in self._grid(left, box.names, nodes).items():
                fits[text] = Fit(axes, nodes, values)
                off[text] = fits[text].off(probes, known[text])
            left = [quantity for quantity in left if off[quantity.text] > NEAR_ENOUGH]
            if not left:
                break
        return fits, off

    def _read(self, fits: Mapping[str, Fit], off: Mapping[str, float], x: Sequence[Array]) -> dict[str, Array]:
        """Values over a grid between designs; `notes` say of how many, and how far they are off at others."""
        for text, fit in fits.items():
            percent = max(100 * off[text], 1e-4)
            error = f"{percent:.2g} % off at others" if np.isfinite(percent) else "not all of which have an answer"
            self.notes.append(f"{text} is interpolated between {counted(fit.values.size, 'design')}, {error}")
        return {text: fit.at(x, off[text] <= NOT_SMOOTH) for text, fit in fits.items()}


@dataclass(frozen=True)
class Axis:
    """A variable along which values are interpolated: by its logarithm where that is known."""

    low: float
    high: float
    by_logarithm: bool

    @staticmethod
    def of(low: float, high: float) -> Axis:
        """The axis between two values, by the logarithm where both are positive."""
        return Axis(float(low), float(high), low > 0)

    def at(self, x: Array) -> Array:
        """How far (n,) values lie along it."""
        return np.log(x) if self.by_logarithm else x

    def values(self, part: Array) -> Array:
        """Values (n,) at parts of it."""
        ratio = self.high / self.low if self.by_logarithm else 1.0
        values = self.low * ratio**part if self.by_logarithm else self.low + (self.high - self.low) * part
        return np.clip(values, self.low, self.high)


@dataclass(frozen=True)
class Fit:
    """Values between `nodes` along each axis: by a polynomial, of logarithms where they are positive, or straight."""

    axes: Sequence[Axis]
    nodes: Sequence[Array]
    values: Array

    def at(self, x: Sequence[Array], is_smooth: bool = True) -> Array:
        """Values over a grid; straight, none beside nodes without an answer."""
        is_smooth &= bool(np.isfinite(self.values).all())
        by_logarithm = is_smooth and bool((self.values > 0).all())
        values = np.log(self.values) if by_logarithm else self.values
        for k, (axis, nodes, points) in enumerate(zip(self.axes, self.nodes, x, strict=True)):
            interpolated = _polynomial if is_smooth else _straight
            values = np.moveaxis(interpolated(axis.at(nodes), np.moveaxis(values, k, -1), axis.at(points)), -1, k)
        return np.exp(values) if by_logarithm else values

    def off(self, probes: Sequence[Array], known: Array) -> float:
        """The largest difference from answers at probes (n,) along each axis, relative to the answers; infinite where
        there is none."""
        interpolated = self.at(probes)[(np.arange(len(known)),) * len(probes)]
        size = np.abs(known) if (known > 0).all() else np.abs(known).max()
        with np.errstate(invalid="ignore"):
            worst = float(np.max(np.abs(interpolated - known) / np.maximum(size, 1e-300)))
        return worst if np.isfinite(worst) and np.isfinite(self.values).all() else np.inf


def _polynomial(nodes: Array, values: Array, at: Array) -> Array:
    """Values along the last axis by Lagrange's polynomials."""
    apart = nodes[:, None] - nodes + np.eye(len(nodes))
    off = np.broadcast_to((at[:, None] - nodes)[:, None], (len(at), *apart.shape))
    weights = np.prod(np.where(np.eye(len(nodes), dtype=bool), 1.0, off / apart), axis=-1)
    return values @ weights.T


def _straight(nodes: Array, values: Array, at: Array) -> Array:
    k = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    part = (at - nodes[k]) / (nodes[k + 1] - nodes[k])
    return (1 - part) * values[..., k] + part * values[..., k + 1]
