"""All methods side by side on one mechanism: order, frequencies, error against the exact ones, time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.errors import FlexuraError, OptionError
from flexura.linalg import lowest
from flexura.mechanism.substructure import Mechanism
from flexura.methods.finite_elements import convergence, finite_elements
from flexura.methods.pairing import agree, in_order, pair
from flexura.methods.solution import Solution
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.structure.plan import one_design, plan_of

TOLERANCE = 1e-3
"""Relative error that the certified reduction is asked for."""

MARGIN = 1.01
"""The certified reduction reaches so many times the highest frequency compared."""

REPEATS = 5
"""Methods are timed by the best of so many runs, as long as all runs together take less than `PATIENCE`, s."""

PATIENCE = 0.5

Announce = Callable[[str], None]


@dataclass(frozen=True)
class ComparisonRow:
    """One method's answer.

    `order` is None for methods without a finite one. `frequency_hz` are the lowest asked for, and later ones that are
    counterparts of the modes compared. Of each, `counterpart` is the number, from 1, of the reference mode that it
    stands for, and `error` the relative difference from it; None where there is none.
    `missed` are the reference modes compared that have no counterpart, `worst_error` is the error largest in size of
    the others. `seconds` lead from a plan to frequencies and shapes. A method that cannot answer has `failure` and no
    numbers.
    """

    method: str
    order: int | None = None
    frequency_hz: tuple[float, ...] = ()
    counterpart: tuple[int | None, ...] = ()
    error: tuple[float | None, ...] = ()
    missed: tuple[int, ...] = ()
    worst_error: float | None = None
    seconds: float | None = None
    note: str = ""
    failure: str = ""


@dataclass(frozen=True)
class Comparison:
    """Methods side by side: `n` modes of a mechanism, with errors against the `reference` method."""

    name: str
    n: int
    reference: str
    parameters: dict[str, float]
    rows: tuple[ComparisonRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "mechanism": self.name,
            "n": self.n,
            "reference": self.reference,
            "parameters": self.parameters,
            "rows": [asdict(row) for row in self.rows],
        }


@dataclass(frozen=True)
class _Task:
    """What is asked of every method; `model` serves to make shapes, and is not what a method solves."""

    plan: Plan
    parameters: dict[str, float]
    n: int
    model: FullOrderModel
    top_hz: float = 0.0

    def assembled(self) -> FullOrderModel:
        """The full-order model, assembled anew."""
        return assemble(self.plan, self.parameters)


@dataclass(frozen=True)
class _Method:
    key: str
    label: str
    solve: Callable[[_Task], Solution]


def _from(module: str, name: str) -> Callable[[_Task], Solution]:
    """A method in a module of its own, imported when it is first asked."""

    def solve(task: _Task) -> Solution:
        try:
            method = getattr(import_module(f"flexura.methods.{module}"), name)
        except ModuleNotFoundError as error:
            if error.name != f"flexura.methods.{module}":
                raise
            raise OptionError("this method is not part of this version") from None
        return method(task.assembled(), task.n)

    return solve


def _refined(pieces: int) -> Callable[[_Task], Solution]:
    return lambda task: finite_elements(task.assembled(), task.n, pieces)


def _constraint_modes(task: _Task) -> Solution:
    """The RPR paper's model."""
    from flexura.reduction import reduce

    return _of_low_order(task, reduce(task.plan, task.parameters))


def _certified(task: _Task) -> Solution:
    """The smallest model that is proven to be within the tolerance of the full-order one."""
    from flexura.reduction import reduce

    low = reduce(task.plan, task.parameters, tolerance=TOLERANCE, up_to=MARGIN * task.top_hz)
    solution = _of_low_order(task, low)
    worst = float(low.certificate.error_bound.max()) if low.certificate is not None else TOLERANCE
    return replace(solution, note=f"proven within {worst:.1g} of the full-order model; {low.steps[0]}")


def _of_low_order(task: _Task, low: Any) -> Solution:
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held")
    pairs = lowest(low.K, low.M, task.n)
    finite = np.isfinite(pairs.values)
    hz = np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi)
    shapes = task.model.node_displacements(np.asarray(low.recover(pairs.vectors[:, finite])))
    return Solution("low order", low.order, hz, shapes)


EXACT = _Method("dynamic_stiffness", "dynamic stiffness", _from("dynamic_stiffness", "dynamic_stiffness"))
MESHES = tuple(_Method("finite_elements", f"finite elements {pieces}x", _refined(pieces)) for pieces in (1, 2, 4))
FINEST = MESHES[-1]
METHODS = (
    EXACT,
    _Method("transfer_matrix", "transfer matrix", _from("transfer_matrix", "transfer_matrix")),
    _Method("spectral_element", "spectral element", _from("spectral", "spectral_element")),
    _Method("reverberation_ray", "reverberation-ray", _from("reverberation_ray", "reverberation_ray")),
    *MESHES,
    _Method("constraint_modes", "constraint modes alone", _constraint_modes),
    _Method("certified_reduction", "certified reduction", _certified),
    _Method("pseudo_rigid_body", "pseudo-rigid-body", _from("pseudo_rigid_body", "pseudo_rigid_body")),
    _Method("lumped_parameter", "lumped parameter", _from("lumped", "lumped_parameter")),
)
"""All methods, in the order of the rows."""


def compare(
    mechanism: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    methods: Sequence[str] | None = None,
) -> Comparison:
    """The `n` lowest modes by every method, or by those named, each against the exact dynamic stiffness.

    Modes are paired by shape where a method has shapes, else by frequency without crossing; a mode that a method misses
    is said to be missed, not given its neighbour's number. A method that cannot answer for this mechanism has a row
    that says why. Without an exact answer finite elements at fourfold refinement take its place. Raises ModelError and
    OptionError.
    """
    *_, last = progressively(mechanism, parameters, n=n, methods=methods)
    return last


def progressively(
    mechanism: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    methods: Sequence[str] | None = None,
    announce: Announce | None = None,
) -> Iterator[Comparison]:
    """`compare` after every row; `announce` is told each method before it starts."""
    if not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    chosen = _chosen(methods)
    plan, single = plan_of(mechanism), one_design(parameters)
    model = assemble(plan, single)
    if model.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    task = _Task(plan, single, int(n), model)
    announce = announce or (lambda _: None)
    announce(EXACT.label)
    run = _Run(task, announce)
    done = Comparison(plan.mechanism.name, task.n, run.label, single, (run.first,))
    yield done
    solved: dict[str, Solution] = {}
    for method in chosen:
        if method is EXACT:
            continue
        announce(method.label)
        row, solution = run.row(method)
        if solution is not None:
            solved[method.label] = solution
        meshes = [solved[m.label] for m in MESHES if m.label in solved]
        if method is FINEST and len(meshes) == len(MESHES):
            row = replace(row, note=_observed(meshes, task.n))
        done = replace(done, rows=(*done.rows, row))
        yield done


def _chosen(names: Sequence[str] | None) -> list[_Method]:
    """The methods named, in the order of the rows. Raises OptionError for unknown names."""
    keys = list(dict.fromkeys(method.key for method in METHODS))
    if names is None:
        return list(METHODS)
    if isinstance(names, str):
        raise OptionError(f"methods is a list of names, not {names!r}")
    wanted = [name.strip().replace("-", "_") for name in names]
    for name in wanted:
        if name not in keys:
            raise OptionError(f"there is no method {name!r}; there are {', '.join(keys)}")
    return [method for method in METHODS if method.key in wanted]


class _Run:
    """The reference, and rows against it."""

    def __init__(self, task: _Task, announce: Announce) -> None:
        self.announce = announce
        self.method = EXACT
        self.task = task
        failure = ""
        try:
            self.reference, seconds = _timed(EXACT, task)
        except FlexuraError as error:
            failure = str(error)
            self.method = FINEST
            announce(FINEST.label)
            self.reference, seconds = _timed(FINEST, task)
        self.label = self.method.label
        self.is_extended = False
        self.compared = min(task.n, len(self.reference.frequency_hz))
        self.task = replace(task, top_hz=float(self.reference.frequency_hz[: self.compared].max(initial=0.0)))
        self.reference = _with_shapes_of_a_mesh(self.reference, self.task)
        if failure:
            self.first = ComparisonRow(EXACT.label, failure=failure)
        else:
            self.first = self._against(EXACT, self.reference, list(range(self.compared)), seconds)

    def row(self, method: _Method) -> tuple[ComparisonRow, Solution | None]:
        """Solve by a method; a row that says why when it cannot."""
        try:
            solution, seconds = _timed(method, self.task)
        except FlexuraError as error:
            return ComparisonRow(method.label, failure=str(error)), None
        partner = pair(self.task.model, self.reference, solution)
        if self._in_doubt(solution, partner):
            solution = self._more_of(method, solution)
            partner = pair(self.task.model, self.reference, solution)
        return self._against(method, solution, partner, seconds), solution

    def _in_doubt(self, solution: Solution, partner: list[int]) -> bool:
        """Whether a mode has no counterpart, or frequencies alone decided between modes that are not the same."""
        if -1 in partner:
            return True
        has_shapes = self.reference.shapes is not None and solution.shapes is not None
        return not has_shapes and not agree(self.reference, solution, partner)

    def _more_of(self, method: _Method, solution: Solution) -> Solution:
        """Solve for more reference modes, and more of the method where it has them, to find those that come late."""
        more = replace(self.task, n=2 * self.task.n + 4)
        with suppress(FlexuraError):
            if not self.is_extended:
                self.announce(f"{self.label}, more modes to compare with")
                self.is_extended = True
                self.reference = _with_shapes_of_a_mesh(self.method.solve(more), more)
            if len(solution.frequency_hz) == self.task.n:
                self.announce(f"{method.label}, more modes")
                return replace(method.solve(more), note=solution.note, order=solution.order)
        return solution

    def _against(self, method: _Method, solution: Solution, partner: list[int], seconds: float) -> ComparisonRow:
        shown = [k for k, p in enumerate(partner) if k < self.task.n or 0 <= p < self.compared]
        hz, partner = solution.frequency_hz[shown], [partner[k] for k in shown]
        base = self.reference.frequency_hz
        errors = [None if p < 0 else _relative(float(f), float(base[p])) for f, p in zip(hz, partner, strict=True)]
        missed = sorted(set(range(self.compared)) - set(partner))
        rated = [e for e, p in zip(errors, partner, strict=True) if e is not None and p < self.compared]
        return ComparisonRow(
            method=method.label,
            order=solution.order,
            frequency_hz=tuple(float(f) for f in hz),
            counterpart=tuple(None if p < 0 else p + 1 for p in partner),
            error=tuple(errors),
            missed=tuple(k + 1 for k in missed),
            worst_error=max(rated, key=abs, default=None),
            seconds=seconds,
            note=solution.note,
        )


def _with_shapes_of_a_mesh(reference: Solution, task: _Task) -> Solution:
    """The reference with shapes of the finest mesh, which are independent where frequencies are close or repeated.

    It is left as it is when the mesh does not have all its frequencies.
    """
    mesh = finite_elements(task.model, len(reference.frequency_hz), 4)
    partner = in_order(mesh.frequency_hz, reference.frequency_hz)
    if -1 in partner or mesh.shapes is None:
        return reference
    return replace(reference, shapes=mesh.shapes[..., partner])


def _timed(method: _Method, task: _Task) -> tuple[Solution, float]:
    """The solution, and the best time of a few when it is quick."""
    begin = time.perf_counter()
    solution = method.solve(task)
    best = time.perf_counter() - begin
    for _ in range(REPEATS - 1):
        start = time.perf_counter()
        if start - begin > PATIENCE:
            break
        method.solve(task)
        best = min(best, time.perf_counter() - start)
    return solution, best


def _relative(value: float, reference: float) -> float | None:
    """Relative difference; none from a zero, unless both are."""
    if reference == 0:
        return 0.0 if value == 0 else None
    return value / reference - 1


def _observed(meshes: list[Solution], n: int) -> str:
    """Observed order of convergence and Richardson's estimate of three meshes, in words."""
    k = min(n, *(len(mesh.frequency_hz) for mesh in meshes))
    seen = convergence(*(mesh.frequency_hz[:k] for mesh in meshes))
    orders = ", ".join("-" if np.isnan(p) else f"{p:.2f}" for p in seen.order)
    limits = ", ".join(f"{f:.8g}" for f in seen.frequency_hz)
    return f"observed order of convergence {orders}; Richardson's estimate {limits} Hz"
