"""All methods side by side on one mechanism: order, frequencies, error against the exact ones, time.

Every method is a function of one task (`Method`); how it works is in its own module, and nothing of it here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.deadline import Listener, OutOfTime, Progress, time_limit
from flexura.errors import FlexuraError, OptionError
from flexura.full_order import assemble, plan_of
from flexura.mechanism import Mechanism
from flexura.methods.chain_equations import reverberation_ray, spectral_element, transfer_matrix
from flexura.methods.discrete_models import (
    convergence,
    finite_elements,
    low_order_solution,
    lumped_parameter,
    pseudo_rigid_body,
)
from flexura.methods.dynamic_stiffness import dynamic_stiffness
from flexura.methods.solution import Solution, agree, pair
from flexura.modal import in_order
from flexura.records import Record
from flexura.reduction import reduce
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan, one_design
from flexura.tables import Facts, Item, Table, quantity, signed_percent
from flexura.thresholds import PROVEN

CERTIFIED_BEYOND = 1.01
"""The certified reduction reaches so many times the highest frequency compared."""

REPEATS = 5
"""Methods are timed by the best of so many runs, as long as all runs together take less than `PATIENCE`, s."""

PATIENCE = 0.5

BUDGET = 60.0
"""Time, s, that every row is given: its solution, its modes' counterparts and further modes to find them together."""

FAILURES = (FlexuraError, np.linalg.LinAlgError, FloatingPointError, OverflowError, MemoryError)
"""What a method may end with that is an answer about the mechanism, and none about the program."""


@dataclass(frozen=True)
class Task:
    """What is asked of every method; `model` serves to make shapes, and is not what a method solves."""

    plan: Plan
    parameters: dict[str, float]
    n: int
    model: FullOrderModel
    top_hz: float = 0.0


@dataclass(frozen=True)
class Method:
    """A method under its key, with its name in words."""

    key: str
    label: str
    solve: Callable[[Task], Solution]


def _of(method: Callable[..., Solution], *options: int) -> Callable[[Task], Solution]:
    """A method of a full-order model, which is assembled anew, and a number of modes."""
    return lambda task: method(assemble(task.plan, task.parameters), task.n, *options)


def _constraint_modes(task: Task) -> Solution:
    """The RPR paper's model."""
    return low_order_solution(reduce(task.plan, task.parameters), task.model, task.n)


def _certified(task: Task) -> Solution:
    """The smallest model that is proven to be within the tolerance of the full-order one."""
    low = reduce(task.plan, task.parameters, tolerance=PROVEN, up_to=CERTIFIED_BEYOND * task.top_hz)
    solution = low_order_solution(low, task.model, task.n)
    worst = float(low.certificate.error_bound.max()) if low.certificate is not None else PROVEN
    return replace(solution, note=f"proven within {worst:.1g} of the full-order model; {low.steps[0]}")


EXACT = Method("dynamic_stiffness", "dynamic stiffness", _of(dynamic_stiffness))
MESHES = tuple(
    Method("finite_elements", f"finite elements {pieces}x", _of(finite_elements, pieces)) for pieces in (1, 2, 4)
)
FINEST = MESHES[-1]
METHODS = (
    EXACT,
    Method("transfer_matrix", "transfer matrix", _of(transfer_matrix)),
    Method("spectral_element", "spectral element", _of(spectral_element)),
    Method("reverberation_ray", "reverberation-ray", _of(reverberation_ray)),
    *MESHES,
    Method("constraint_modes", "constraint modes alone", _constraint_modes),
    Method("certified_reduction", "certified reduction", _certified),
    Method("pseudo_rigid_body", "pseudo-rigid-body", _of(pseudo_rigid_body)),
    Method("lumped_parameter", "lumped parameter", _of(lumped_parameter)),
)
"""All methods, in the order of the rows."""


@dataclass(frozen=True, repr=False)
class ComparisonRow(Record):
    """One method's answer.

    `order` is None for methods without a finite one. `frequency_hz` are the lowest asked for, and later ones that are
    counterparts of the modes compared. Of each, `counterpart` is the number, from 1, of the reference mode that it
    stands for, and `error` the relative difference from it; None where there is none.
    `missed` are the reference modes compared that have no counterpart, `worst_error` is the error largest in size of
    the others. `seconds` lead from a plan to frequencies and shapes. A method that cannot answer has `failure` and no
    numbers.
    """

    _shown = ("method", "frequency_hz", "failure")

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

    def remarks(self, count: int) -> Iterator[str]:
        """Its failure, its note, which of the first `count` modes it has not, and what else it has."""
        if self.failure:
            yield self.failure
            return
        if self.note:
            yield self.note
        if self.missed:
            yield f"has no mode {', '.join(map(str, self.missed))}"
        pairs = zip(self.frequency_hz, self.counterpart, strict=True)
        if others := [quantity(hz, "Hz") for hz, k in pairs if k is None or k > count]:
            yield f"has {', '.join(others)} beside the modes compared"


@dataclass(frozen=True, repr=False)
class Comparison(Tabular):
    """Methods side by side: `n` modes of a mechanism, with errors against the `reference` method, which is empty when
    no method could answer that others are held against."""

    _shown = ("name", "n", "reference", "rows")

    name: str
    n: int
    reference: str
    parameters: dict[str, float]
    rows: tuple[ComparisonRow, ...]

    def _title(self) -> str:
        return f"errors against {self.reference}" if self.reference else "nothing to hold them against"

    def presentation(self) -> Iterator[Item]:
        """One row a method: order, the frequency of every mode compared, worst error, time; then what it says."""
        rows = [row for row in self.rows if not row.failure]
        # the highest mode compared that any row has, or has missed
        seen = [k for row in rows for k in (*row.counterpart, *row.missed) if k is not None and k <= self.n]
        of_mode = [dict(zip(row.counterpart, row.frequency_hz, strict=True)) for row in rows]
        columns: dict[str, Any] = {
            "method": [row.method for row in rows],
            "order": [row.order for row in rows],
            "worst error": ["" if row.method == self.reference else signed_percent(row.worst_error) for row in rows],
            "time": [quantity(row.seconds, "s", 3) for row in rows],
        }
        columns |= {f"mode {k} [Hz]": [hz.get(k) for hz in of_mode] for k in range(1, max(seen, default=0) + 1)}
        yield Table(columns, "methods")
        yield Facts({row.method: "; ".join(row.remarks(max(seen, default=0))) for row in self.rows})

    def _columns(self) -> dict[str, Any]:
        """A row for each frequency of each method."""
        return {
            "method": [row.method for row in self.rows for _ in row.frequency_hz],
            "mode": [number for row in self.rows for number in row.counterpart],
            "frequency [Hz]": [hz for row in self.rows for hz in row.frequency_hz],
            "relative error": [error for row in self.rows for error in row.error],
        }

    def ended(self, methods: Sequence[str] | None, reason: str) -> Comparison:
        """The same with a row for every method chosen that has none yet, which fails for this reason."""
        answered = {row.method for row in self.rows}
        labels = [method.label for method in _chosen(methods) if method.label not in answered]
        return replace(self, rows=(*self.rows, *(ComparisonRow(label, failure=reason) for label in labels)))


@verb
def compare(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    methods: Sequence[str] | None = None,
    budget: float | None = BUDGET,
    progress: Listener | None = None,
) -> Comparison:
    """The `n` lowest modes by every method, or by those named, each against the exact dynamic stiffness.

    Modes are paired by shape where a method has shapes, else by frequency without crossing; a mode that a method misses
    is said to be missed, not given its neighbour's number. A method that cannot answer for this mechanism, or not
    within `budget` seconds (None: without end), has a row that says why; the search for further modes that a row is
    paired with counts. Without an exact answer finite elements take its place where there are other rows, at fourfold
    refinement if they can; meshes that have no row of their own share one budget. `progress` is told of every
    row, with the part of its work that is done. Raises ModelError and OptionError.
    """
    *_, last = progressively(model, parameters, n=n, methods=methods, budget=budget, progress=progress)
    return last


def progressively(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    n: int = 6,
    methods: Sequence[str] | None = None,
    budget: float | None = BUDGET,
    progress: Listener | None = None,
) -> Iterator[Comparison]:
    """`compare` as it grows: without rows, then after each."""
    if not isinstance(n, int | np.integer) or n < 1:
        raise OptionError(f"the number of modes is a whole number, at least 1, not {n!r}")
    if budget is not None and not (np.isfinite(budget) and budget > 0):
        raise OptionError(f"the budget of a method is a positive number of seconds, or None, not {budget!r}")
    chosen = _chosen(methods)
    plan, single = plan_of(model, parameters), one_design(parameters)
    plan.refuse_loads("a comparison with exact methods", plan.values(single))
    full = assemble(plan, single)
    if full.order == 0:
        raise OptionError("nothing in this mechanism can move: every node is held")
    done = Comparison(plan.mechanism.name, int(n), "", single, ())
    yield done
    run = _Run(Task(plan, single, int(n), full), _Clock(budget, progress or (lambda _: None), len(chosen)), chosen)
    run.find_reference()
    for number, method in enumerate(chosen):
        run.clock.done = number
        done = replace(done, reference=run.label, rows=(*done.rows, run.row(method)))
        yield done


def _chosen(names: Sequence[str] | None) -> list[Method]:
    """The exact method and those named, in the order of the rows. Raises OptionError for unknown names."""
    keys = list(dict.fromkeys(method.key for method in METHODS))
    if names is None:
        return list(METHODS)
    if isinstance(names, str):
        raise OptionError(f"methods is a list of names, not {names!r}")
    wanted = [name.strip().replace("-", "_") for name in names]
    for name in wanted:
        if name not in keys:
            raise OptionError(f"there is no method {name!r}; there are {', '.join(keys)}")
    return [method for method in METHODS if method is EXACT or method.key in wanted]


@dataclass
class _Clock:
    """Gives all work for a row one budget, and says what is going on."""

    budget: float | None
    progress: Listener
    of: int
    done: int = 0
    stage: str = ""
    spent: dict[str, float] = field(default_factory=dict)

    def run(self, row: str, stage: str, work: Callable[[], Any]) -> Any:
        """Do a piece of work within what is left of a row's budget; without a `stage` it belongs to that announced
        last. Raises OutOfTime, at once when nothing is left."""
        if stage:
            self.stage = stage
            self.progress(Progress(stage, self.done, self.of))
        used, begin = self.spent.get(row, 0.0), time.monotonic()
        left = None if self.budget is None else self.budget - used
        if self.budget is not None and used >= self.budget:
            raise OutOfTime(self.budget)
        try:
            with time_limit(left, lambda share: self.progress(Progress(self.stage, self.done, self.of, share))):
                return work()
        except OutOfTime as error:
            if self.budget is None or error.seconds != left:
                raise
            raise OutOfTime(self.budget) from None
        finally:
            self.spent[row] = used + time.monotonic() - begin


class _Run:
    """The reference, and rows against it."""

    def __init__(self, task: Task, clock: _Clock, chosen: list[Method]) -> None:
        self.task, self.clock, self.chosen = task, clock, chosen
        self.solved: dict[str, tuple[Solution, float]] = {}
        self.failed: dict[str, str] = {}
        self.reference: Solution | None = None
        self.method, self.label = EXACT, ""  # those of the reference
        self.compared = task.n
        self.is_extended = False

    def find_reference(self) -> None:
        """Solve by the exact method, else, where there are other rows, by the finest mesh that has an answer."""
        others = [mesh for mesh in reversed(MESHES) if mesh in METHODS and mesh is not FINEST]
        is_alone = self.chosen == [EXACT]
        for method in (EXACT, *(() if is_alone else (FINEST, *others))):
            self._solve(method)
            if method.label in self.solved:
                self.method, self.label = method, method.label
                reference = self.solved[method.label][0]
                self.compared = min(self.task.n, len(reference.frequency_hz))
                top = float(reference.frequency_hz[: self.compared].max(initial=0.0))
                self.task = replace(self.task, top_hz=top)
                self.reference = reference if is_alone else self._with_shapes_of_a_mesh(method, reference, self.task)
                return

    def row(self, method: Method) -> ComparisonRow:
        """The row of a method; it says why when there is no answer."""
        if method.label not in self.solved:
            self._solve(method)
        if method.label in self.failed:
            return ComparisonRow(method.label, failure=self.failed[method.label])
        solution, seconds = self.solved[method.label]
        meshes = [self.solved[mesh.label][0] for mesh in MESHES if mesh.label in self.solved]
        if method is FINEST and len(meshes) == len(MESHES):
            solution = replace(solution, note=_observed(meshes, self.task.n))
        if method is self.method or self.reference is None:
            return self._against(method, solution, list(range(len(solution.frequency_hz))), seconds)
        try:
            return self._paired(method, solution, seconds)
        except FAILURES as error:
            return ComparisonRow(
                method.label, failure=f"has an answer, but its modes were not paired: {_reason(error)}"
            )

    def _solve(self, method: Method) -> None:
        """Solve by a method, or note why there is no answer."""
        if method.label in self.failed:
            return
        try:
            solved = self.clock.run(self._row_of(method), method.label, lambda: _timed(method, self.task))
            self.solved[method.label] = solved
        except FAILURES as error:
            self.failed[method.label] = _reason(error)

    def _row_of(self, method: Method) -> str:
        """The row whose time a method takes; meshes without one, in place of the exact method, share theirs."""
        return method.label if method in self.chosen else ""

    def _paired(self, method: Method, solution: Solution, seconds: float) -> ComparisonRow:
        """The row of a solution, with more modes where some have no counterpart."""
        assert self.reference is not None
        partner = pair(self.task.model, self.reference, solution)
        has_shapes = self.reference.shapes is not None and solution.shapes is not None
        # frequencies alone may have paired modes that are not the same
        if -1 in partner or not (has_shapes or agree(self.reference, solution, partner)):
            solution = self._more_of(method, solution)
            partner = pair(self.task.model, self.reference, solution)
        return self._against(method, solution, partner, seconds)

    def _more_of(self, method: Method, solution: Solution) -> Solution:
        """Solve for more reference modes, and more of the method where it has them, to find those that come late."""
        more = replace(self.task, n=2 * self.task.n + 4)
        try:
            if not self.is_extended:
                self.is_extended = True
                stage = f"{self.label}, more modes to compare with"
                extended = self.clock.run(method.label, stage, lambda: self.method.solve(more))
                self.reference = self._with_shapes_of_a_mesh(method, extended, more)
            if len(solution.frequency_hz) == self.task.n:
                extended = self.clock.run(method.label, f"{method.label}, more modes", lambda: method.solve(more))
                return replace(extended, note=solution.note, order=solution.order)
        except FAILURES as error:
            note = f"later modes could not be looked for: {_reason(error)}"
            return replace(solution, note=f"{solution.note}; {note}" if solution.note else note)
        return solution

    def _against(self, method: Method, solution: Solution, partner: list[int], seconds: float) -> ComparisonRow:
        """The row of a solution whose frequencies have these counterparts; without a reference they have none."""
        shown = [k for k, p in enumerate(partner) if k < self.task.n or 0 <= p < self.compared]
        hz, partner = solution.frequency_hz[shown], [partner[k] for k in shown]
        errors: list[float | None] = [None] * len(hz)
        missed: list[int] = []
        if self.reference is not None:
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

    def _with_shapes_of_a_mesh(self, method: Method, reference: Solution, task: Task) -> Solution:
        """The reference with shapes of the finest mesh, which are independent where frequencies are close or repeated.

        It is left as it is when the mesh does not have all its frequencies, or no answer in what is left of the time of
        the row of `method`.
        """
        try:
            solve = partial(finite_elements, task.model, len(reference.frequency_hz), 4)
            mesh = self.clock.run(self._row_of(method), "", solve)
        except FAILURES:
            return reference
        partner = in_order(mesh.frequency_hz, reference.frequency_hz)
        if -1 in partner or mesh.shapes is None:
            return reference
        return replace(reference, shapes=mesh.shapes[..., partner])


def _reason(error: BaseException) -> str:
    """Why there is no answer, in words."""
    if isinstance(error, OutOfTime):
        return f"{error}: option --budget gives a method more time"
    if isinstance(error, FlexuraError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"needs more memory than there is: {error}".rstrip(": ")
    return f"lost all digits before the end ({error})"


def _timed(method: Method, task: Task) -> tuple[Solution, float]:
    """The solution, and the best time of a few when it is quick."""
    begin = time.perf_counter()
    solution = method.solve(task)
    best = time.perf_counter() - begin
    for _ in range(REPEATS - 1):
        start = time.perf_counter()
        if start - begin > PATIENCE:
            break
        try:
            method.solve(task)
        except OutOfTime:  # there is an answer already
            break
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
