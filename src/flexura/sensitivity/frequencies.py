"""How natural frequencies, mode shapes and frequency responses change with the parameters of a mechanism."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism import HELD, Mechanism
from flexura.results import Tabular
from flexura.sensitivity.eigenpairs import Bends, branches, moved_clusters, whole_clusters
from flexura.sensitivity.low_order import Family, LowOrderFamily, ModelOrder
from flexura.sensitivity.variation import FullOrderFamily, Rows
from flexura.structure import Plan, one_design, plan_of
from flexura.tables import Facts, Table, in_hz, percent


@dataclass(frozen=True, repr=False)
class ModeSensitivities(Tabular):
    """Derivatives of the n lowest natural frequencies and of their shapes with respect to P parameters.

    `derivative` (n, P) is in Hz per SI unit of the parameter; `relative` (n, P), (p/f) df/dp, compares parameters.
    `shapes` (N, n) are M-normalised DOF vectors of the full-order model and `shape_derivative` (P, N, n) their
    derivatives. A repeated frequency has a branch for every distinct derivative; both are those of the branches,
    ascending, of which `branch_shapes` (P, N, n) are the shapes. Where the design is at a kink of a parameter, as a
    notch whose end is a corner of its contour, nothing has a derivative by it: these are NaN, and `notes` says so.
    """

    _shown = ("name", "free", "frequency_hz", "order")
    _told = ("name", "free", "values", "frequency_hz", "derivative", "relative", "order")

    name: str
    free: tuple[str, ...]
    values: Array
    frequency_hz: Array
    derivative: Array
    shapes: Array
    shape_derivative: Array
    branch_shapes: Array
    order: int
    notes: tuple[str, ...] = ()

    @property
    def relative(self) -> Array:
        """(p/f) df/dp (n, P): per cent of frequency per per cent of parameter."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.derivative * self.values / self.frequency_hz[:, None]

    def _view(self) -> Iterator[Facts | Table]:
        modes = {
            f"mode {k + 1}, {in_hz(hz)}": [percent(x / 100, 4) for x in self.relative[k]]
            for k, hz in enumerate(self.frequency_hz)
        }
        yield Table({"per % of": self.free, "is [SI]": self.values, **modes}, "parameters")

    def _columns(self) -> dict[str, Any]:
        """A row for each parameter and frequency."""
        modes, parameters = self.derivative.shape
        return {
            "parameter": np.repeat(self.free, modes),
            "mode": np.tile(np.arange(1, modes + 1), parameters),
            "frequency [Hz]": np.tile(self.frequency_hz, parameters),
            "derivative [Hz per SI unit]": self.derivative.T.ravel(),
            "relative": self.relative.T.ravel(),
        }


@verb
def mode_sensitivities(
    model: Mechanism | Plan,
    parameters: Mapping[str, float] | None = None,
    *,
    free: Sequence[str] | None = None,
    n: int = 6,
    order: ModelOrder = "full",
    keep: int | Mapping[str, int] = 0,
) -> ModeSensitivities:
    """Derivatives of the `n` lowest natural frequencies and mode shapes with respect to the parameters `free`.

    lambda' = x' (K' - lambda M') x (Fox and Kapoor 1968) and shapes by a bordered solve (after Nelson 1976), repeated
    frequencies along their branches (Dailey 1989; theory eqs. K1-K9). K' x and M' x are exact: the formulas of the plan
    are differentiated as they are worked out, of the full-order model or of the low-order one (`order="low"`, with
    `keep` normal modes in each substructure). All parameters that are numbers are taken when none are named. Raises
    ModelError, OptionError and SolverError.
    """
    plan = plan_of(model, parameters)
    plan.refuse_pose("sensitivities")
    chosen = free_names(plan, free)
    at = one_design(parameters)
    family = family_of(plan, order, at, keep)
    values = {name: float(v) for name, v in plan.parameter_values(at).items()}
    solved = family.model(at)
    if n < 1:
        raise OptionError(f"the number of modes is at least 1, not {n}")
    pairs = whole_clusters(solved.K, solved.M, n)
    changes = family.changes(at, chosen, pairs.vectors)
    moved = moved_clusters(solved.K, solved.M, pairs, changes)
    count, N = len(pairs.values), plan.topology.n_dof
    slopes = np.zeros((count, len(chosen)))
    slope_shapes, branch_shapes = np.zeros((2, len(chosen), N, count))
    notes = [
        f"{name}: the design is at a kink, such as a corner of a contour, where nothing has a derivative by it"
        for name, change in zip(chosen, changes, strict=True)
        if not change.is_smooth
    ]
    for p, name in enumerate(chosen):
        for cluster in moved:
            found = branches(cluster, changes[p], p, _bends(family, at, name))
            if np.isnan(found.vectors).any():
                notes.append(
                    f"shapes at {in_hz(pairs.values[cluster.at[0]] ** 0.5 / (2 * np.pi))} part with {name}; {FULL}"
                )
            slopes[cluster.at, p] = found.value
            slope_shapes[p][:, cluster.at] = changes[p].Y[:, cluster.at] @ found.Q
            slope_shapes[p][:, cluster.at] += family.readings(at, found.vectors)
            branch_shapes[p][:, cluster.at] = family.readings(at, cluster.X @ found.Q)
        if not changes[p].is_smooth:
            slopes[:, p] = slope_shapes[p] = np.nan
    omega = np.sqrt(np.maximum(pairs.values, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        derivative = np.where(omega[:, None] > 0, slopes / (4 * np.pi * np.where(omega, omega, 1.0)[:, None]), 0.0)
    return ModeSensitivities(
        plan.mechanism.name,
        chosen,
        np.array([values[name] for name in chosen]),
        omega[:n] / (2 * np.pi),
        derivative[:n],
        family.readings(at, pairs.vectors)[:, :n],
        slope_shapes[:, :, :n],
        branch_shapes[:, :, :n],
        solved.order,
        tuple(notes),
    )


FULL = "how they turn is known at order full alone"


def _bends(family: Family, at: Mapping[str, float], name: str) -> Bends:
    """Second derivatives of a family's products, NaN where they are not known."""
    if isinstance(family, LowOrderFamily):
        return lambda X: (np.full(X.shape, np.nan), np.full(X.shape, np.nan))
    return lambda X: family.bends(at, name, X)


def family_of(
    plan: Plan,
    order: ModelOrder,
    at: Mapping[str, float],
    keep: int | Mapping[str, int] = 0,
    rows: Rows | None = None,
) -> Family:
    """The models of a plan over its parameters. Raises OptionError for unknown orders."""
    if order not in get_args(ModelOrder):
        raise OptionError(f"order is low or full, not {order!r}")
    if order == "full":
        if keep:
            raise OptionError("keep belongs to order low")
        return FullOrderFamily(plan, rows)
    return LowOrderFamily(plan, at, keep, rows)


def free_names(plan: Plan, free: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the parameters that may move; all that are numbers and are not held when none are named.

    Raises OptionError for names that are unknown, held or occur twice, and when there are none.
    """
    known = plan.mechanism.parameters
    if free is None:
        free = [name for name, p in known.items() if not (isinstance(p.value, Expression) or p.is_held)]
    if isinstance(free, str):
        free = [free]
    for name in free:
        if name not in known:
            raise OptionError(f"{name!r} is not a parameter; known: {', '.join(known) or 'none'}")
        if isinstance(known[name].value, Expression):
            raise OptionError(f"{name} follows from {known[name].value}; free what it depends on")
        if known[name].is_held:
            raise OptionError(f"{name} is {HELD}")
    if len(set(free)) < len(free):
        raise OptionError("a parameter is named twice among the free ones")
    if not free:
        raise OptionError("name at least one parameter")
    return tuple(free)
