"""How natural frequencies, mode shapes and frequency responses change with the parameters of a mechanism.

Responses are those of the lowest modes with static correction, between points that move rigidly with nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.derivatives.eigenpairs import Bends, Cluster, branches, moved_clusters, whole_clusters
from flexura.derivatives.families import Change, Family, FullOrderFamily, LowOrderFamily, Matrices, ModelOrder, Rows
from flexura.duals import zeros
from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.full_order import plan_of
from flexura.linalg import Eigenpairs, is_definite
from flexura.mechanism import DOF_NAMES, HELD, Mechanism
from flexura.reduction import stored_flexibility
from flexura.results import Result, Tabular
from flexura.structure import Design, FullOrderModel, Plan, one_design
from flexura.tables import Facts, Item, Table, ends, in_hz, percent

FULL = "how they turn is known at order full alone"


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

    def presentation(self) -> Iterator[Item]:
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
            branch = branches(cluster, changes[p], p, _bends(family, at, name))
            if np.isnan(branch.vectors).any():
                notes.append(
                    f"shapes at {in_hz(pairs.values[cluster.at[0]] ** 0.5 / (2 * np.pi))} part with {name}; {FULL}"
                )
            slopes[cluster.at, p] = branch.value
            slope_shapes[p][:, cluster.at] = changes[p].Y[:, cluster.at] @ branch.Q
            slope_shapes[p][:, cluster.at] += family.readings(at, branch.vectors)
            branch_shapes[p][:, cluster.at] = family.readings(at, cluster.X @ branch.Q)
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


@dataclass(frozen=True)
class Reading:
    """Displacement, or rotation, along a unit direction (3,) of the point at `arm` (3,), m, from a node.

    A `row` (n,) over the DOFs of the full-order model stands in place of all that, whatever the sizes are.
    """

    node: str
    direction: Array
    turns: bool
    arm: Array
    row: Array | None = None

    @classmethod
    def of_dof(cls, name: str) -> Reading:
        """From the name of a DOF such as `platform.tz`. Raises OptionError for others."""
        node, _, dof = name.rpartition(".")
        if not node or dof not in DOF_NAMES:
            raise OptionError(f"a DOF is written NODE.tx to NODE.rz, not {name!r}")
        k = DOF_NAMES.index(dof)
        return cls(node, np.eye(3)[k % 3], k >= 3, np.zeros(3))


def displacement_rows(places: Sequence[Reading]) -> Rows:
    """Rows (o, n) over the DOFs of a full-order model that give the displacement or rotation at places."""
    placed = [k for k, place in enumerate(places) if place.row is None]
    six = np.zeros((len(placed), 6))
    for at, k in enumerate(placed):
        place = places[k]
        if place.turns:
            six[at, 3:] = place.direction
        else:
            six[at, :3], six[at, 3:] = place.direction, np.cross(place.arm, place.direction)

    def rows(design: Design) -> Any:
        topology = design.plan.topology
        D, dof = design.node_arms(topology.numbers([places[k].node for k in placed]))
        read = zeros((len(places), topology.n_dof + 1), D)
        read[np.array(placed, dtype=np.intp)[:, None], dof] = np.einsum("oi,oij->oj", six, D)
        for k, place in enumerate(places):
            if place.row is not None:
                read[k, :-1] = place.row
        return read[:, :-1]

    return rows


@dataclass(frozen=True, repr=False)
class ResponseSensitivities(Result):
    """H (f, p, m) at `frequency_hz` (f,), and dH/dp (P, f, p, m) per SI unit of the parameters `free`: NaN by one at a
    kink of which the design is."""

    free: tuple[str, ...]
    values: Array
    frequency_hz: Array
    response: Complex
    derivative: Complex

    def presentation(self) -> Iterator[Item]:
        hz = self.frequency_hz
        yield Facts(
            {"band": ends((hz.min(), hz.max()), "Hz", 5), "responses": "{} x {}".format(*self.response.shape[1:])}
        )
        size = np.abs(self.response).max()
        largest = np.abs(self.values[:, None, None, None] * self.derivative).max(axis=(1, 2, 3))
        change = [percent(float(x / size) / 100) for x in largest]
        yield Table({"parameter": self.free, "is [SI]": self.values, "largest change per %": change}, "parameters")


@verb
def response_sensitivities(
    model: Mechanism | Plan,
    parameters: Mapping[str, float] | None = None,
    *,
    frequency_hz: ArrayLike,
    inputs: Sequence[str],
    outputs: Sequence[str],
    free: Sequence[str] | None = None,
    damping: float = 0.01,
    n: int = 12,
    order: ModelOrder = "full",
    keep: int | Mapping[str, int] = 0,
) -> ResponseSensitivities:
    """Receptances between DOFs such as `platform.tz` and their derivatives with respect to the parameters `free`.

    The `n` lowest modes with one damping ratio, and static correction (theory eqs. K10-K12). Raises ModelError,
    OptionError and SolverError.
    """
    plan = plan_of(model, parameters)
    plan.refuse_pose("sensitivities")
    chosen, at = free_names(plan, free), one_design(parameters)
    hz = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    if not (damping > 0 and np.isfinite(hz).all() and (hz > 0).all()):
        raise OptionError("frequencies and the damping ratio are positive finite numbers")
    places = [Reading.of_dof(name) for name in (*outputs, *inputs)]
    family = family_of(plan, order, at, keep, displacement_rows(places))
    solved = family.model(at)
    pairs = whole_clusters(solved.K, solved.M, n)
    G = static_vectors(family, at)
    values = {name: float(plan.parameter_values(at)[name]) for name in chosen}
    X = np.hstack([pairs.vectors, G])
    changes = family.changes(at, chosen, X)
    moved = moved_clusters(solved.K, solved.M, pairs, [first_columns(c, len(pairs.values)) for c in changes])
    count = len(outputs)
    H, dH = modal_response(family, at, pairs, moved, static=G, changes=changes, hz=hz, outputs=count, damping=damping)
    dH[[not c.is_smooth for c in changes]] = np.nan
    return ResponseSensitivities(chosen, np.array(list(values.values())), hz, H, dH)


class Reader(Protocol):
    """Something that reads displacements off vectors."""

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        """What is read (o, k) off vectors X (n, k)."""
        ...


class Model(Reader, Protocol):
    """A family of models that reads displacements off their coordinates."""

    def model(self, parameters: Mapping[str, float]) -> FullOrderModel | Matrices:
        """The model for one design."""
        ...

    def rows(self, parameters: Mapping[str, float]) -> Array:
        """What is read, over the coordinates (o, n)."""
        ...


def static_vectors(family: Model, at: Mapping[str, float]) -> Array:
    """K^-1 O' (n, o) of the rows O that a family reads; none for something that can move freely."""
    model = family.model(at)
    if not is_definite(model.K):
        return np.zeros((model.order, 0))
    return stored_flexibility(model.K, model.M, 0.0)(family.rows(at).T)


def first_columns(change: Change, count: int) -> Change:
    """A change of the first vectors alone."""
    return Change(change.K[:, :count], change.M[:, :count], change.Y[:, :count], change.is_smooth)


def modal_response(
    family: Reader,
    at: Mapping[str, float],
    pairs: Eigenpairs,
    moved: Sequence[Cluster],
    *,
    static: Array,
    changes: Sequence[Change],
    hz: Array,
    outputs: int,
    damping: float | Array,
) -> tuple[Complex, Complex]:
    """H (f, p, m) and dH (P, f, p, m); the family reads p outputs, then m inputs (theory eqs. K10-K12).

    `changes` are those of the vectors and then of `static` ones, of which there may be none: then there is no static
    correction.
    """
    w, k, p, G = 2 * np.pi * hz, len(pairs.values), outputs, static
    Y, S = np.split(family.readings(at, np.hstack([pairs.vectors, G])), [k], axis=1)
    zeta = np.broadcast_to(np.asarray(damping, dtype=float), (k,))
    lam = pairs.values
    omega = np.sqrt(np.maximum(lam, 0.0))
    gain = 1 / (lam - w[:, None] ** 2 + 2j * zeta * omega * w[:, None])
    slope = -(gain**2) * (1 + 1j * zeta * w[:, None] / np.where(omega > 0, omega, np.inf))
    corrected = bool(G.shape[1])
    if corrected:
        gain, slope = gain - 1 / lam, slope + 1 / lam**2
    H = np.einsum("fr,pr,mr->fpm", gain, Y[:p], Y[p:])
    if corrected:
        H = H + S[:p, p:]
    dH = np.zeros((len(changes), *H.shape), dtype=complex)
    for q, change in enumerate(changes):
        dY = change.Y[:, :k].copy()
        for cluster in moved:
            turned = cluster.outer[q] - cluster.X @ cluster.mass[q] / 2
            dY[:, cluster.at] += family.readings(at, turned)
            bend = np.einsum("pi,ij,mj->pm", Y[:p, cluster.at], cluster.slope[q], Y[p:, cluster.at])
            dH[q] += slope[:, cluster.at[0], None, None] * bend
        dH[q] += np.einsum("fr,pr,mr->fpm", gain, dY[:p], Y[p:]) + np.einsum("fr,pr,mr->fpm", gain, Y[:p], dY[p:])
        if corrected:
            dS = change.Y[:, k:]
            dH[q] += dS[:p, p:] + dS[p:, :p].T - (G.T @ change.K[:, k:])[:p, p:]
    return H, dH
