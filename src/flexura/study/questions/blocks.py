"""Blocks of designs: which of them cannot be, and what is answered for all others at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Bools, Index
from flexura.derivatives import without_round_off
from flexura.errors import FlexuraError, ModelError, OptionError
from flexura.records import Record
from flexura.reduction import independent_flexibility
from flexura.structure import Action, Design, Plan, Ports
from flexura.study.questions.kinds import Quantity
from flexura.study.questions.reading import Freedom, Port
from flexura.thresholds import PROVEN


class Bounded(NamedTuple):
    """Frequencies (..., n), Hz, with their lower and upper bounds, NaN where nothing is proven."""

    hertz: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, repr=False)
class Answers(Record):
    """What was asked of each of some designs, SI.

    `value` (designs, q), NaN where a quantity could not be worked out, for which `reason` (designs,) has the words. It
    also says where the mode that moves something is in doubt, beside a value, and is empty otherwise. `lower` and
    `upper` (designs, q) are proven bounds, NaN where none are claimed; `is_proven` (designs,) says that frequencies
    were asked for and that all of them are proven within 0.1 %. `mode` (designs, q) is the number of the mode of a
    frequency, from 0, and -1 of anything else.
    """

    value: Array
    lower: Array
    upper: Array
    is_proven: Bools
    reason: NDArray[np.object_]
    mode: Index

    @staticmethod
    def of(designs: int, quantities: int) -> Answers:
        """Answers that are still to be worked out."""
        value, lower, upper = np.full((3, designs, quantities), np.nan)
        proven, reason = np.zeros(designs, dtype=bool), np.full(designs, "", dtype=object)
        return Answers(value, lower, upper, proven, reason, np.full((designs, quantities), -1))

    def say(self, design: int, text: str) -> None:
        """Add a reason for a design, once."""
        before = self.reason[design]
        if text not in before.split("; "):
            self.reason[design] = f"{before}; {text}" if before else text


def are_proven(value: Array, lower: Array, upper: Array) -> Bools:
    """Where bounds are within 0.1 %, or a value is proven to be zero."""
    with np.errstate(all="ignore"):
        return (upper - lower <= PROVEN * lower) | ((value == 0) & (lower == 0))


FAILURES = (FlexuraError, ArithmeticError, np.linalg.LinAlgError, ValueError)
"""What a design that cannot be worked out may end in."""


class Block:
    """Some designs of a plan: `parameters` (designs,) by name, `count` of them, and `refused`, why a design cannot be,
    by its number.

    Raises OptionError for unknown parameters and arrays that do not fit.
    """

    def __init__(self, plan: Plan, parameters: Mapping[str, ArrayLike]) -> None:
        self.plan = plan
        arrays = {name: _numbers(name, value) for name, value in parameters.items()}
        lengths = {len(values) for values in arrays.values() if values.ndim}
        if len(lengths) > 1:
            raise OptionError(f"arrays of parameters have one length, not {', '.join(map(str, sorted(lengths)))}")
        self.count: int = lengths.pop() if lengths else 1
        self.parameters: dict[str, Array] = {
            name: np.broadcast_to(values, self.count) for name, values in arrays.items()
        }
        plan.parameter_values(dict.fromkeys((name for name in arrays if name not in plan.mechanism.parameters), 0.0))
        with np.errstate(all="ignore"):
            self.refused: dict[int, str] = self._refused()

    def one(self, number: int) -> dict[str, float]:
        """Parameters of one design."""
        return {name: float(values[number]) for name, values in self.parameters.items()}

    def some(self, numbers: Index) -> dict[str, Array]:
        """Parameters of some designs."""
        return {name: values[numbers] for name, values in self.parameters.items()}

    @cached_property
    def possible(self) -> Index:
        """Numbers of the designs that are not refused."""
        return np.array([number for number in range(self.count) if number not in self.refused], dtype=np.intp)

    def divided(self, work: Callable[[Index], None], designs: Index | None = None) -> dict[int, str]:
        """Have some designs, by default all that are possible, worked on together, or each by itself where that fails;
        why some of them fail even so, by their numbers."""
        designs, failed = self.possible if designs is None else designs, dict[int, str]()
        try:
            work(designs)
        except FAILURES:
            for number in designs:
                try:
                    work(np.array([number]))
                except FAILURES as error:
                    failed[int(number)] = reason_of(error)
        return failed

    def _refused(self) -> dict[int, str]:
        """Designs with values out of bounds or not finite, or with a size that has gone through zero."""
        refused = dict[int, str]()
        numbers = np.arange(self.count)
        try:
            values = np.atleast_2d(self.plan.values(self.some(numbers)))
            numbers = numbers if len(values) == self.count else numbers[:1]
        except FlexuraError:
            rows = dict[int, Array]()
            for number in range(self.count):
                try:
                    rows[number] = self.plan.values(self.one(number))
                except FlexuraError as error:
                    refused[number] = reason_of(error)
            numbers, values = np.array(list(rows), dtype=np.intp), np.array(list(rows.values()))
        if not len(values):
            return refused
        known = np.isfinite(self.plan.values())
        broken = np.flatnonzero(~np.isfinite(values[:, known]).all(axis=1))
        for row in np.union1d(broken, self.plan.turned(values)).astype(int):
            number = int(numbers[row])
            try:
                self.plan.verify(self.one(number))
                if row in broken:
                    refused[number] = "a number of the description has no finite value"
            except FlexuraError as error:
                refused[number] = reason_of(error)
        return refused


def reason_of(error: Exception) -> str:
    """Why a design could not be worked out, in one line."""
    if isinstance(error, ModelError):
        problem = error.problems[0]
        return f"{problem.place}: {problem.rule} (found {problem.value})"
    return " ".join(str(error).split()) or type(error).__name__


def _numbers(name: str, value: ArrayLike) -> Array:
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise OptionError(f"parameter {name}: {value!r} is neither a number nor an array of them") from None
    if numbers.ndim > 1:
        raise OptionError(f"parameter {name} is a number or an array (designs,), not of shape {numbers.shape}")
    return numbers


def mass_of(design: Design, quantity: Quantity) -> Array:
    """Mass (...), kg, of everything, or of a rigid body as placed, without what it carries."""
    if quantity.arguments:
        *path, key = str(quantity.arguments[0]).split(".")
        [body] = (
            copies.part.bodies[key][1]
            for copies in design.plan.topology.copies.values()
            if tuple(path) in copies.paths and key in copies.part.bodies
        )
        return np.broadcast_to(body.matrix(design.values)[..., 0, 0], design.values.shape[:-1])
    # what meets a unit acceleration r: r' M r, of all copies of all prototypes
    B = design.elements.mass_basis.reshape(-1, 12, 12)
    along = B[:, 0, 0] + B[:, 0, 6] + B[:, 6, 0] + B[:, 6, 6]
    elements = (design.elements.mass_coefficients * along).sum(axis=-1)
    discrete_elements, start = design.discrete_elements, 0
    total = np.zeros(design.values.shape[:-1])
    for name, part in design.plan.parts.items():
        stop = start + len(part.connectivity)
        discrete: Array | float = 0.0
        for element in discrete_elements.get(name, []):
            if element.M is not None:
                nodes = [k for k, node in enumerate(element.nodes) if node < part.n_positioned]
                dofs = 6 * np.array(nodes, dtype=np.intp)
                x, y, z = (element.M[..., dofs[:, None] + axis, dofs + axis].sum(axis=(-1, -2)) for axis in range(3))
                discrete = discrete + (x + y + z) / 3
        mass = elements[..., start:stop].sum(axis=-1) + discrete
        total = total + len(design.plan.topology.copies[name].paths) * mass
        start = stop
    return total


STATIC = ("compliance", "stiffness", "coupling", "amplification")
"""Kinds that follow from the flexibility."""


class Statics:
    """Static quantities of designs at rest without loads: `value` (designs, q), NaN where a design has to be worked out
    by itself."""

    def __init__(self, block: Block, quantities: Sequence[Quantity]) -> None:
        self.plan: Plan = block.plan
        self.quantities = quantities
        self.value: Array = np.full((block.count, len(quantities)), np.nan)
        block.divided(lambda designs: self._solve(block, designs))

    @cached_property
    def _ends(self) -> list[Freedom | Port]:
        """What moves or is moved, each once."""
        return list(dict.fromkeys(end for quantity in self.quantities for end in ends_of(quantity)))

    @cached_property
    def _nodes(self) -> Index:
        """The global nodes of all of them."""
        design = Design.of(self.plan)
        return np.unique([node for end in self._ends for node in _action(design, end).nodes])

    def _motions(self, design: Design, B: Array) -> Array:
        """Rows (..., 2 k, n) of all that moves, then of the loads that a unit of each puts on."""
        actions = [_action(design, end) for end in self._ends]
        rows = [action.row(B[..., np.searchsorted(self._nodes, action.nodes), :, :]) for action in actions]
        loads = [np.asarray(action.gain)[..., None] * row for action, row in zip(actions, rows, strict=True)]
        return np.stack(np.broadcast_arrays(*rows, *loads), axis=-2)

    def _solve(self, block: Block, designs: Index) -> None:
        solved = independent_flexibility(self.plan, block.some(designs), self._nodes, self._motions)
        if solved is None:
            return
        C, settled = solved
        for q, quantity in enumerate(self.quantities):
            self.value[designs[settled], q] = self._read(C[settled], quantity)

    def _read(self, C: Array, quantity: Quantity) -> Array:
        """A quantity (designs,) from the flexibility (designs, 2 k, 2 k) along all rows."""
        to, by = (self._ends.index(end) for end in ends_of(quantity))
        displacement = without_round_off(C[:, to, by], C[:, to, to] * C[:, by, by])
        if quantity.kind in ("compliance", "stiffness"):
            return np.asarray(1 / displacement if quantity.kind == "stiffness" else displacement)
        load = len(self._ends) + by
        displacement = np.where(displacement == 0.0, 0.0, C[:, to, load])
        return np.asarray(displacement if quantity.kind == "coupling" else displacement / abs(C[:, by, load]))


def ends_of(quantity: Quantity) -> tuple[Freedom | Port, Freedom | Port]:
    """What is moved, and by what."""
    first, last = quantity.arguments[0], quantity.arguments[-1]
    assert isinstance(first, Freedom | Port)
    assert isinstance(last, Freedom | Port)
    return (first, last) if quantity.kind in ("compliance", "stiffness") else (last, first)


def _action(design: Design, end: Freedom | Port) -> Action:
    if isinstance(end, Port):
        return Ports(design).action(end.known)
    node = int(design.plan.topology.numbers([end.node])[0])
    return Action([node], np.eye(6)[end.component][None], 1.0)
