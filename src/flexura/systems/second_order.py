"""M q'' + C q' + (K + i H) q = B u with named inputs and outputs: its damping, static responses and lowest modes.

What the modes left out of a modal system do: their flexibility, inertia and damping to first order, and a bound on the
rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray
from pydantic import ValidationError

from flexura.arrays import Array, Complex
from flexura.duals import Dual, moves, plain
from flexura.errors import ExpressionError, OptionError
from flexura.linalg import Eigenpairs, least_pivot, lowest, lowest_modes
from flexura.mechanism import Damping, evaluated, problems_of, validated
from flexura.records import Record
from flexura.reduction import WELL, Flexibility, LowOrderModel, chained, flexibility, stored_flexibility
from flexura.results import Result
from flexura.structure import (
    Channel,
    FullOrderModel,
    InputPort,
    OutputPort,
    channel_positions,
    ends_of,
    full_order_model,
)
from flexura.tables import Facts, Item

Model = FullOrderModel | LowOrderModel

MOST_MODES = 3000
"""Coordinates up to which all modes are found for a matrix of modal damping ratios."""

MOST_BY_ENERGIES = 400
"""Modes up to which those of a stiffness that loses digits are found by energies."""


@dataclass(frozen=True)
class DampingLaw:
    """Damping of a mechanism as a whole, in numbers, which may have slopes.

    `ratio`, `bands` ((up to, Hz; ratio), ...) and `ratios` give modal damping ratios; `alpha`, 1/s, and `beta`, s, are
    the factors of Rayleigh damping; `loss_factor` is that of everything elastic without one of its own.
    """

    ratio: Any = 0.0
    bands: tuple[tuple[Any, Any], ...] = ()
    ratios: tuple[Any, ...] = ()
    alpha: Any = 0.0
    beta: Any = 0.0
    loss_factor: Any = 0.0

    @property
    def is_modal(self) -> bool:
        """True when modal damping ratios are given."""
        return bool(plain(self.ratio) or moves(self.ratio) or self.bands or self.ratios)

    def modal_ratios(self, frequency_hz: Array) -> Array:
        """Damping ratios (r,) of modes with frequencies (r,), Hz, ascending, from the modal rules alone."""
        known = np.stack([self.ratio, *(ratio for _, ratio in self.bands), *self.ratios])
        rule = np.zeros(len(frequency_hz), dtype=np.intp)
        for number, (up_to, _) in reversed(list(enumerate(self.bands, 1))):
            rule[frequency_hz <= plain(up_to)] = number
        n = min(len(self.ratios), len(rule))
        rule[:n] = 1 + len(self.bands) + np.arange(n)
        return known[rule]


def damping_law(
    described: Damping, values: Mapping[str, Any], replaced: Damping | float | Mapping[str, Any] | None
) -> DampingLaw:
    """Damping of a description at parameter values, which may have slopes, or what replaces it: a ratio, a Damping or
    its keys.

    Raises OptionError for impossible numbers. Rayleigh damping follows from zeta = (alpha/omega + beta omega)/2 at its
    two frequencies (theory eq. T4).
    """
    damping = described
    if replaced is not None:
        damping = replaced if isinstance(replaced, Damping) else _validated(replaced)
    try:
        _validated(evaluated(damping, {name: plain(value) for name, value in values.items()}).model_dump())
        damping = evaluated(damping, dict(values))
    except ExpressionError as error:
        raise OptionError(f"damping: {error}") from None
    alpha: Any = 0.0
    beta: Any = 0.0
    if damping.rayleigh is not None:
        low, high = (2 * np.pi * _number(f) for f in damping.rayleigh.frequencies)
        at_low, at_high = map(_number, damping.rayleigh.ratios)
        wide = high**2 - low**2
        alpha = 2 * low * high * (at_low * high - at_high * low) / wide
        beta = 2 * (at_high * high - at_low * low) / wide
        if plain(alpha) < 0 or plain(beta) < 0:
            rule = "these ratios need a negative damping matrix: between the two frequencies damping would be negative"
            raise OptionError(f"rayleigh damping: {rule}; bring the ratios closer together")
    return DampingLaw(
        _number(damping.ratio),
        tuple((_number(b.up_to), _number(b.ratio)) for b in damping.bands),
        tuple(map(_number, damping.ratios)),
        alpha,
        beta,
        0.0 if damping.loss_factor is None else _number(damping.loss_factor),
    )


def _number(x: Any) -> Any:
    return x if isinstance(x, Dual) else float(x)


def _validated(raw: Any) -> Damping:
    """Damping from its keys or a ratio. Raises OptionError for what it cannot be."""
    try:
        return validated(Damping, raw)
    except ValidationError as error:
        problem = problems_of(error, raw)[0]
        where = "".join(f".{key}" for key in problem.path)
        raise OptionError(f"damping{where}: {problem.rule}, not {problem.value or raw}") from None


@dataclass(frozen=True, repr=False)
class SecondOrder(Result):
    """M q'' + C q' + (K + i H) q = B u, and outputs y = (d/dt)^k (rows q + residual u) + D u.

    M, C, K (n, n) dense or sparse, SI; H (n, n) is structural damping, None without; B (n, m); rows (p, n) and the
    order k of differentiation, `derivative` (p,), of every output; D (p, m) reaches the outputs directly; `residual`
    (p, m) is the static gain that the coordinates q lack. `law` holds the modal damping ratios, which C does not
    contain and `damping_matrix` does. C is that of `dashpots` and Rayleigh damping, and H is `uniform_loss` times K
    unless that is None. `model` recovers physical displacements from q.
    """

    _shown = ("name", "order", "inputs", "outputs")
    _told = (
        "name",
        "order",
        "inputs",
        "outputs",
        "M",
        "C",
        "K",
        "H",
        "B",
        "rows",
        "derivative",
        "D",
        "residual",
        "limits",
    )

    model: Model
    M: Any
    C: Any
    K: Any
    H: Any | None
    dashpots: Any
    uniform_loss: float | None
    B: Array
    rows: Array
    derivative: NDArray[np.intp]
    D: Array
    residual: Array
    law: DampingLaw
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    limits: tuple[tuple[float, float], ...]
    input_ports: tuple[InputPort, ...]
    output_ports: tuple[OutputPort, ...]

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return self.K.shape[0]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.plan.mechanism.name

    def presentation(self) -> Iterator[Item]:
        yield Facts({"order": self.order, **ends_of(self.inputs, self.outputs), "damped": self.is_damped})

    @cached_property
    def is_damped(self) -> bool:
        """True when anything dissipates."""
        has_C = bool(abs(self.C).max() > 0) if self.order else False
        return has_C or self.H is not None or self.law.is_modal

    @cached_property
    def full_order(self) -> FullOrderModel:
        """The full-order model behind `model`."""
        return full_order_of(self.model)

    def damping_matrix(self) -> Any:
        """C (n, n), N s/m, with modal damping ratios in it: C + M Phi diag(2 zeta omega) Phi' M (theory eq. T27).

        Over all modes of the system (Wilson and Penzien 1972, Earthquake Eng. Struct. Dyn. 1, 5): each gets the ratio
        that the law gives it, and none is left undamped but rigid motions and directions without mass. Dense where
        there are such ratios. Raises OptionError where there are too many modes for that.
        """
        if not self.law.is_modal:
            return self.C
        if self.order > MOST_MODES:
            raise OptionError(
                f"modal damping ratios as a matrix need all modes, of {self.order} coordinates; at most {MOST_MODES}:"
                " reduce the mechanism, or give Rayleigh damping, loss factors or dashpots"
            )
        pairs = self.lowest(self.order).finite
        omega = np.sqrt(np.maximum(pairs.values, 0.0))
        forces = self.M @ pairs.vectors
        modal = (forces * (2 * self.law.modal_ratios(omega / (2 * np.pi)) * omega)) @ forces.T
        C = self.C if isinstance(self.C, np.ndarray) else self.C.toarray()
        return C + (modal + modal.T) / 2

    @cached_property
    def flexibility(self) -> Flexibility:
        """Static responses in the coordinates of the system."""
        return flexibility(self.full_order) if self._is_full else stored_flexibility(self.K, self.M)

    @cached_property
    def full_flexibility(self) -> Flexibility:
        """Static responses of the full-order model."""
        return self.flexibility if self._is_full else flexibility(self.full_order)

    @property
    def _is_full(self) -> bool:
        return isinstance(self.model, FullOrderModel) and self.order == self.model.order

    def lowest(self, count: int) -> Eigenpairs:
        """The `count` lowest eigenpairs of K and M; those of a full-order model by energies, which keep the digits of
        soft modes beside stiff ones.

        With a mass or a stiffness that the model does not have, as that of sensors, they are those of K and M.
        """
        is_own = self._is_full and self.K is self.full_order.K and self.M is self.full_order.M
        if not is_own or count > MOST_BY_ENERGIES or least_pivot(self.K) > WELL:
            return lowest(self.K, self.M, count)
        full = chained(self.full_order)
        pairs = lowest_modes(full.pencil, count, full.rigid_motions)
        return Eigenpairs(pairs.values, full.recover(pairs.vectors))

    def matrices(self) -> tuple[Any, Any, Any, Any]:
        """M, C, K and H (None without) with the modal damping ratios in C; all dense, or all sparse."""
        C, others = self.damping_matrix(), (self.M, self.K, self.H)
        if isinstance(C, np.ndarray):
            others = tuple(A if A is None or isinstance(A, np.ndarray) else A.toarray() for A in others)
        M, K, H = others
        return M, C, K, H

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> Self:
        """The system with some of its inputs and outputs, by name. Raises OptionError for others."""
        if inputs is outputs is None:
            return self
        i, o = channel_positions(self.inputs, inputs), channel_positions(self.outputs, outputs)
        return replace(
            self,
            B=self.B[:, i],
            rows=self.rows[o],
            derivative=self.derivative[o],
            D=self.D[np.ix_(o, i)],
            residual=self.residual[np.ix_(o, i)],
            inputs=tuple(self.inputs[k] for k in i),
            outputs=tuple(self.outputs[k] for k in o),
            limits=tuple(self.limits[k] for k in i),
            input_ports=tuple(self.input_ports[k] for k in i),
            output_ports=tuple(self.output_ports[k] for k in o),
        )


def full_order_of(model: Model) -> FullOrderModel:
    """The full-order model behind a model."""
    return model if isinstance(model, FullOrderModel) else full_order_model(model.design)


@dataclass(frozen=True, repr=False)
class Remainder(Record):
    """Products W' Y X of columns W = [B, rows', C Phi, H Phi] (n, k) with their static responses X = K^-1 W in the
    modes left out: `stiff` (Y = K), `heavy` (M), `viscous` (C, of dashpots), `lossy` (H), each (k, k).

    `places` are the columns of B, rows, C Phi and H Phi; the last two are empty where damping does not couple modes.
    C Phi are forces of dashpots and H Phi, where loss factors differ, of structural damping on modes that are kept.
    `largest` are the greatest eigenvalues of K^-1 C, s, and of K^-1 H. `whole` (k,) is W' K^-1 W, kept modes included.
    """

    _shown = ("stiff", "largest")

    stiff: Array
    heavy: Array
    viscous: Array
    lossy: Array
    places: tuple[NDArray[np.intp], ...]
    largest: tuple[float, float]
    whole: Array

    @property
    def couples(self) -> bool:
        """True when damping couples modes that are kept to those left out."""
        return bool(len(self.places[2]) or len(self.places[3]))

    def selected(self, inputs: list[int], outputs: list[int]) -> Remainder:
        """With some of the inputs and outputs, by position."""
        B, rows, C, H = self.places
        return replace(self, places=(B[inputs], rows[outputs], C, H))

    def flexibility(self, system: SecondOrder, w: Array, at: Any) -> Complex:
        """W' (s K + A)^-1 W (f, i, j) to first order in A = -(w^2 - i w alpha) M + i w C + i H: stiff/s - W' A W/s^2.

        s = 1 + i (eta + w beta) is one loss factor for everything and Rayleigh damping. `at` are rows and columns.
        """
        i, j = np.ix_(*at)
        w = w[:, None, None]
        s = stiffening(system, w)
        first = (w**2 - 1j * w * system.law.alpha) * self.heavy[i, j]
        first -= 1j * (w * self.viscous[i, j] + np.sign(w) * self.lossy[i, j])
        return np.asarray(self.stiff[i, j] / s + first / s**2, dtype=complex)

    def forces(self, w: Array) -> Complex:
        """What [C Phi, H Phi] are multiplied by for the forces of damping on the modes left out (f, c + h)."""
        counts = [len(self.places[2]), len(self.places[3])]
        return np.asarray(np.repeat(np.stack([1j * w, 1j * np.sign(w)], axis=1), counts, axis=1), dtype=complex)


def stiffening(system: SecondOrder, w: Array, lossy: bool = True) -> Complex:
    """1 + i (eta sgn w + w beta) (f,): what one loss factor and Rayleigh damping multiply the stiffness by."""
    eta = (system.uniform_loss or 0.0) if lossy else 0.0
    return np.asarray(1 + 1j * (eta * np.sign(w) + system.law.beta * w), dtype=complex)


def remainder_of(system: SecondOrder, omega: Array, V: Array) -> Remainder:
    """What the modes of a system beyond the kept ones, `omega` (r,) and V (n, r), do."""
    Cd, H = system.dashpots, None if system.uniform_loss is not None else system.H
    m, p = system.B.shape[1], len(system.rows)
    blocks = [system.B, system.rows.T]
    dashpots = dashpot_columns(Cd)
    blocks.append(np.asarray(Cd @ V) if dashpots.shape[1] else V[:, :0])
    blocks.append(np.asarray(H @ V) if H is not None else V[:, :0])
    W = np.hstack(blocks)
    shift, static = system.flexibility.shift, system.flexibility(np.hstack([W, dashpots]))
    X = static[:, : W.shape[1]]
    whole = np.einsum("ij,ij->j", X, W)
    X = X - V @ ((V.T @ W) / (omega**2 + shift)[:, None])
    X = X - V @ (V.T @ (system.M @ X))
    nothing = np.zeros((W.shape[1],) * 2)
    viscous = symmetric(X.T @ (Cd @ X)) if dashpots.shape[1] else nothing
    lossy = symmetric(X.T @ (H @ X)) if H is not None else nothing
    steepest = float(la.eigvalsh(dashpots.T @ static[:, W.shape[1] :])[-1]) if dashpots.shape[1] else 0.0
    ends = np.cumsum([0, m, p, *(b.shape[1] for b in blocks[2:])])
    places = tuple(np.arange(a, b) for a, b in pairwise(ends))
    largest = (max(steepest, 0.0), _largest_loss(system) if H is not None else 0.0)
    return Remainder(
        symmetric(W.T @ X), symmetric(X.T @ (system.M @ X)), viscous, lossy, places, largest, np.abs(whole)
    )  # fmt: skip


def symmetric(A: Array) -> Array:
    return (A + A.T) / 2


def dashpot_columns(C: Any) -> Array:
    """L (n, d) with C = L L', of the damping matrix of dashpots."""
    at = np.flatnonzero(C.diagonal())
    L = np.zeros((C.shape[0], len(at)))
    if not len(at):
        return L
    damped = C[np.ix_(at, at)] if isinstance(C, np.ndarray) else C[at][:, at].toarray()
    values, vectors = la.eigh(damped)
    keep = values > 1e-15 * values[-1]
    L = np.zeros((C.shape[0], int(keep.sum())))
    L[at] = vectors[:, keep] * np.sqrt(values[keep])
    return L


def _largest_loss(system: SecondOrder) -> float:
    """The greatest loss factor of anything elastic, which bounds the eigenvalues of K^-1 H."""
    model, default = system.model, system.law.loss_factor
    factors = [default]
    for part in model.plan.parts.values():
        factors += np.ravel(part.table.loss_factors(model.values, default)).tolist()
        factors += part.discrete_losses(model.values, default)
    return float(max(factors))
