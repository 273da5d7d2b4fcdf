"""Frequency responses from the lowest modes with static correction, and their derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, is_definite
from flexura.mechanism import Mechanism
from flexura.reduction import stored_flexibility
from flexura.results import Result
from flexura.sensitivity.eigenpairs import Cluster, moved_clusters, whole_clusters
from flexura.sensitivity.frequencies import family_of, free_names
from flexura.sensitivity.low_order import Matrices, ModelOrder
from flexura.sensitivity.points import Reading, displacement_rows
from flexura.sensitivity.variation import Change
from flexura.structure import FullOrderModel, Plan, one_design, plan_of
from flexura.tables import Facts, Table, ends, percent


@dataclass(frozen=True, repr=False)
class ResponseSensitivities(Result):
    """H (f, p, m) at `frequency_hz` (f,), and dH/dp (P, f, p, m) per SI unit of the parameters `free`: NaN by one at a
    kink of which the design is."""

    free: tuple[str, ...]
    values: Array
    frequency_hz: Array
    response: Complex
    derivative: Complex

    def _view(self) -> Iterator[Facts | Table]:
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
    H, dH = modal_response(family, at, pairs, moved, G, changes, hz, len(outputs), damping)
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


def first_columns(own: Change, count: int) -> Change:
    """A change of the first vectors alone."""
    return Change(own.K[:, :count], own.M[:, :count], own.Y[:, :count], own.is_smooth)


def modal_response(
    family: Reader,
    at: Mapping[str, float],
    pairs: Eigenpairs,
    moved: Sequence[Cluster],
    G: Array,
    changes: Sequence[Change],
    hz: Array,
    p: int,
    damping: float | Array,
) -> tuple[Complex, Complex]:
    """H (f, p, m) and dH (P, f, p, m); the family reads p outputs, then m inputs (theory eqs. K10-K12).

    `changes` are those of the vectors and then of G, whose columns may be none: then there is no static correction.
    """
    w, k = 2 * np.pi * hz, len(pairs.values)
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
    for q, own in enumerate(changes):
        dY = own.Y[:, :k].copy()
        for cluster in moved:
            turned = cluster.outer[q] - cluster.X @ cluster.mass[q] / 2
            dY[:, cluster.at] += family.readings(at, turned)
            bend = np.einsum("pi,ij,mj->pm", Y[:p, cluster.at], cluster.slope[q], Y[p:, cluster.at])
            dH[q] += slope[:, cluster.at[0], None, None] * bend
        dH[q] += np.einsum("fr,pr,mr->fpm", gain, dY[:p], Y[p:]) + np.einsum("fr,pr,mr->fpm", gain, Y[:p], dY[p:])
        if corrected:
            dS = own.Y[:, k:]
            dH[q] += dS[:p, p:] + dS[p:, :p].T - (G.T @ own.K[:, k:])[:p, p:]
    return H, dH
