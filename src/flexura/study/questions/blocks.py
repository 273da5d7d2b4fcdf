"""Blocks of designs: which of them cannot be, and what is answered for all others at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Index
from flexura.errors import FlexuraError, ModelError, OptionError
from flexura.records import Record
from flexura.reduction import independent_flexibility
from flexura.structure import Design, DiscreteElement, Part, Plan
from flexura.study.questions.grammar import Quantity
from flexura.study.questions.reading import Freedom, Port
from flexura.systems import Action, Ports

TOLERANCE = 1e-3
"""Relative error within which frequencies are to be proven."""


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
    is_proven: NDArray[np.bool_]
    reason: NDArray[np.object_]
    mode: NDArray[np.intp]

    @staticmethod
    def of(designs: int, quantities: int) -> Answers:
        """Answers that are still to be worked out."""
        value, lower, upper = np.full((3, designs, quantities), np.nan)
        proven, reason = np.zeros(designs, dtype=bool), np.full(designs, "", dtype=object)
        return Answers(value, lower, upper, proven, reason, np.full((designs, quantities), -1))

    def tell(self, designs: int | slice, place: int, found: Bounded, number: int) -> None:
        """Take frequency `number`, from 0, of those that were found as the answer at a place."""
        for own, bound in zip((self.value, self.lower, self.upper), found, strict=True):
            own[designs, place] = bound[..., number]
        self.mode[designs, place] = number

    def say(self, design: int, text: str) -> None:
        """Add a reason for a design, once."""
        said = self.reason[design]
        if text not in said.split("; "):
            self.reason[design] = f"{said}; {text}" if said else text


def are_proven(value: Array, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Where bounds are within 0.1 %, or a value is proven to be zero."""
    with np.errstate(all="ignore"):
        return (upper - lower <= TOLERANCE * lower) | ((value == 0) & (lower == 0))


FAILURES = (FlexuraError, ArithmeticError, np.linalg.LinAlgError, ValueError)
"""What a design that cannot be worked out may end in."""


class Block:
    """Some designs of a plan: `parameters` (designs,) by name, `count` of them, and `refused`, why a design cannot be,
    by its number.

    Raises OptionError for unknown parameters and arrays that do not fit.
    """

    def __init__(self, plan: Plan, parameters: Mapping[str, ArrayLike]) -> None:
        self.plan = plan
        own = {name: _numbers(name, value) for name, value in parameters.items()}
        lengths = {len(value) for value in own.values() if value.ndim}
        if len(lengths) > 1:
            raise OptionError(f"arrays of parameters have one length, not {', '.join(map(str, sorted(lengths)))}")
        self.count: int = lengths.pop() if lengths else 1
        self.parameters: dict[str, Array] = {name: np.broadcast_to(value, self.count) for name, value in own.items()}
        plan.parameter_values(dict.fromkeys((name for name in own if name not in plan.mechanism.parameters), 0.0))
        with np.errstate(all="ignore"):
            self.refused: dict[int, str] = self._refused()

    def one(self, number: int) -> dict[str, float]:
        """Parameters of one design."""
        return {name: float(value[number]) for name, value in self.parameters.items()}

    def some(self, numbers: Index) -> dict[str, Array]:
        """Parameters of some designs."""
        return {name: value[numbers] for name, value in self.parameters.items()}

    @cached_property
    def possible(self) -> Index:
        """Numbers of the designs that are not refused."""
        return np.array([d for d in range(self.count) if d not in self.refused], dtype=np.intp)

    def divided(self, work: Callable[[Index], None], designs: Index | None = None) -> dict[int, str]:
        """Have some designs, by default all that are possible, worked on together, or each by itself where that fails;
        why some of them fail even so, by their numbers."""
        designs, failed = self.possible if designs is None else designs, dict[int, str]()
        try:
            work(designs)
        except FAILURES:
            for d in designs:
                try:
                    work(np.array([d]))
                except FAILURES as error:
                    failed[int(d)] = reason_of(error)
        return failed

    def _refused(self) -> dict[int, str]:
        """Designs with values out of bounds or not finite, or with a size that has gone through zero."""
        out = dict[int, str]()
        everyone = np.arange(self.count)
        try:
            values = np.atleast_2d(self.plan.values(self.some(everyone)))
            inside = everyone if len(values) == self.count else everyone[:1]
        except FlexuraError:
            rows, kept = [], []
            for d in everyone:
                try:
                    rows.append(self.plan.values(self.one(int(d))))
                    kept.append(d)
                except FlexuraError as error:
                    out[int(d)] = reason_of(error)
            inside, values = np.array(kept, dtype=np.intp), np.array(rows)
        known = np.isfinite(self.plan.values())
        broken = np.flatnonzero(~np.isfinite(values[:, known]).all(axis=1)) if len(values) else ()
        for k in np.union1d(broken, self.plan.turned(values)).astype(int) if len(values) else ():
            number = int(inside[k])
            try:
                self.plan.verify(self.one(number))
                if k in broken:
                    out[number] = "a number of the description has no finite value"
            except FlexuraError as error:
                out[number] = reason_of(error)
        return out


def reason_of(error: Exception) -> str:
    """Why a design could not be worked out, in one line."""
    if isinstance(error, ModelError):
        what = error.problems[0]
        return f"{what.place}: {what.rule} (found {what.value})"
    return " ".join(str(error).split()) or type(error).__name__


def _numbers(name: str, value: ArrayLike) -> Array:
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise OptionError(f"parameter {name}: {value!r} is neither a number nor an array of them") from None
    if found.ndim > 1:
        raise OptionError(f"parameter {name} is a number or an array (designs,), not of shape {found.shape}")
    return found


def total_mass(design: Design) -> Array:
    """Mass of everything (...), kg: what meets a unit acceleration, r' M r, of all copies of all prototypes."""
    B = design.elements.mass_basis.reshape(-1, 12, 12)
    along = B[:, 0, 0] + B[:, 0, 6] + B[:, 6, 0] + B[:, 6, 6]
    elements = (design.elements.mass_coefficients * along).sum(axis=-1)
    discrete_elements, start = design.discrete_elements(), 0
    total = np.zeros(design.values.shape[:-1])
    for name, part in design.plan.parts.items():
        stop = start + len(part.connectivity)
        own = elements[..., start:stop].sum(axis=-1) + _discrete_mass(part, discrete_elements.get(name, []))
        total = total + len(design.plan.topology.copies[name].paths) * own
        start = stop
    return total


def body_mass(design: Design, body: str) -> Array:
    """Mass (...) of a rigid body as placed, kg, without what it carries."""
    *path, key = body.split(".")
    for copies in design.plan.topology.copies.values():
        if tuple(path) in copies.paths and key in copies.part.bodies:
            own = copies.part.bodies[key][1].matrix(design.values)[..., 0, 0]
            return np.broadcast_to(own, design.values.shape[:-1])
    raise KeyError(body)


def _discrete_mass(part: Part, discrete_elements: list[DiscreteElement]) -> Array | float:
    """Mass (...) of the discrete elements of one copy of a part."""
    found: Array | float = 0.0
    for discrete in discrete_elements:
        if discrete.M is not None:
            at = 6 * np.array([k for k, node in enumerate(discrete.nodes) if node < part.n_positioned], dtype=np.intp)
            along = [discrete.M[..., at[:, None] + axis, at + axis].sum(axis=(-1, -2)) for axis in range(3)]
            found = found + (along[0] + along[1] + along[2]) / 3
    return found


STATIC = ("compliance", "stiffness", "coupling", "amplification")
"""What is asked here."""

ROUNDING = 1e-8
"""Compliances below so much of their bound, sqrt(C_ii C_jj), are round-off."""


def without_round_off(moved: Any, bound: Any) -> Any:
    """Motions by forces elsewhere, zero where they are round-off of the bound that stands for C_ii C_jj."""
    return np.where(abs(moved) < ROUNDING * np.sqrt(abs(bound)), 0.0, moved)


class Statics:
    """What is asked of static kinds, answered for designs at rest without loads: `value` (designs, q), NaN where a
    design has to be worked out by itself."""

    def __init__(self, block: Block, asked: Sequence[Quantity]) -> None:
        self.plan: Plan = block.plan
        self.asked = asked
        self.value: Array = np.full((block.count, len(asked)), np.nan)
        block.divided(lambda designs: self._solve(block, designs))

    @cached_property
    def _names(self) -> list[Freedom | Port]:
        """What moves or is moved, each once."""
        return list(dict.fromkeys(own for quantity in self.asked for own in ends_of(quantity)))

    @cached_property
    def _nodes(self) -> Index:
        """The global nodes of all of them."""
        design = Design.of(self.plan)
        return np.unique([node for own in self._names for node in _action(design, own).nodes])

    def _motions(self, design: Design, B: Array) -> Array:
        """Rows (..., 2 k, n) of all that moves, then of the loads that a unit of each puts on."""
        actions = [_action(design, own) for own in self._names]
        rows = [own.row(B[..., np.searchsorted(self._nodes, own.nodes), :, :]) for own in actions]
        loads = [np.asarray(own.gain)[..., None] * row for own, row in zip(actions, rows, strict=True)]
        return np.stack(np.broadcast_arrays(*rows, *loads), axis=-2)

    def _solve(self, block: Block, designs: Index) -> None:
        found = independent_flexibility(self.plan, block.some(designs), self._nodes, self._motions)
        if found is None:
            return
        C, settled = found
        for q, quantity in enumerate(self.asked):
            self.value[designs[settled], q] = self._read(C[settled], quantity)

    def _read(self, C: Array, asked: Quantity) -> Array:
        """A quantity (designs,) from the flexibility (designs, 2 k, 2 k) along all rows."""
        to, by = (self._names.index(own) for own in ends_of(asked))
        moved = without_round_off(C[:, to, by], C[:, to, to] * C[:, by, by])
        if asked.kind in ("compliance", "stiffness"):
            return np.asarray(1 / moved if asked.kind == "stiffness" else moved)
        load = len(self._names) + by
        moved = np.where(moved == 0.0, 0.0, C[:, to, load])
        return np.asarray(moved if asked.kind == "coupling" else moved / abs(C[:, by, load]))


def ends_of(asked: Quantity) -> tuple[Freedom | Port, Freedom | Port]:
    """What is moved, and by what."""
    first, last = asked.arguments[0], asked.arguments[-1]
    assert isinstance(first, Freedom | Port)
    assert isinstance(last, Freedom | Port)
    return (first, last) if asked.kind in ("compliance", "stiffness") else (last, first)


def _action(design: Design, own: Freedom | Port) -> Action:
    if isinstance(own, Port):
        return Ports(design).action(own.known)
    node = int(design.plan.topology.numbers([own.node])[0])
    return Action([node], np.eye(3)[own.component % 3], own.turns, 1.0)
