"""The system in coordinates of its natural modes: what frequency response, time response and state space start from.

Complex modes, where damping couples the real ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, count_below
from flexura.results import Tabular
from flexura.structure import Channel, channel_positions, ends_of
from flexura.systems.modal_sum import modal_sum
from flexura.systems.second_order import Remainder, SecondOrder, remainder_of, stiffening
from flexura.tables import Facts, Item, Table, in_hz, percent

DEFECTIVE_MODES = 1e10
"""Condition number of the complex modes from which they are taken as defective."""

COUPLED_DAMPING = 1e-7
"""Relative size of a damping coefficient between two modes from which damping is not proportional."""

DAMPING_ROUNDING = 1e-10
"""Size of such a coefficient, beside the larger of the two modes' own, below which it is the modes' round-off."""

MODAL_ROUNDING = 1e-14
"""Size of a damping ratio or loss factor, or of an entry of a matrix in modes beside its terms, that is round-off."""

FREQUENCIES_AT_ONCE = 64
"""Frequencies whose matrices are formed at a time."""

SPARE_MODES = 6
"""Modes sought beyond the number asked for, to see how far the next one is."""


@dataclass(frozen=True, repr=False)
class ComplexModes(Tabular):
    """Poles (2r,), rad/s, in conjugate pairs or real, the lowest first; states (eta, eta') = right z, where
    z' = poles z + left f for modal forces f. right (2r, 2r), left (2r, r)."""

    _shown = ("poles",)

    poles: Complex
    right: Complex
    left: Complex

    @property
    def frequency_hz(self) -> Array:
        """|pole| / 2 pi (2r,), Hz."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def ratios(self) -> Array:
        """Damping ratios (2r,): -Re(pole)/|pole|; 1 for real poles."""
        size = np.abs(self.poles)
        return -self.poles.real / np.where(size > 0, size, np.inf)

    def presentation(self) -> Iterator[Item]:
        upper = np.flatnonzero(self.poles.imag >= 0)
        damping = [percent(float(z)) for z in self.ratios[upper]]
        yield Table({"frequency [Hz]": self.frequency_hz[upper], "damping": damping}, "poles")

    def _columns(self) -> dict[str, Any]:
        poles = {"pole, real [rad/s]": self.poles.real, "pole, imaginary [rad/s]": self.poles.imag}
        return {**poles, "frequency [Hz]": self.frequency_hz, "damping ratio": self.ratios}


def complex_modes(omega: Array, damping: Array) -> ComplexModes:
    """Complex modes of eta'' + damping eta' + omega^2 eta = f (Foss 1958, Trans. ASME J. Appl. Mech. 25, 361).

    omega (r,), rad/s; damping (r, r), 1/s. Raises SolverError where poles coincide so that there are no such modes
    (critical damping); generalised-alpha time integration and direct frequency response need none.
    """
    r = len(omega)
    scale = np.where(omega > 0, omega, 1.0)
    A = np.zeros((2 * r, 2 * r))
    A[:r, r:] = np.diag(scale)
    A[r:, :r], A[r:, r:] = np.diag(-(omega**2) / scale), -damping
    found = np.linalg.eig(A)
    poles: Complex = found[0].astype(complex)
    vectors: Complex = found[1].astype(complex)
    order = np.lexsort((poles.imag < 0, np.abs(poles.imag), np.abs(poles)))
    poles, vectors = poles[order], vectors[:, order]
    if np.linalg.cond(vectors) > DEFECTIVE_MODES:
        raise SolverError("some poles coincide (critical damping, or a free rigid motion): there are no complex modes")
    left: Complex = np.asarray(np.linalg.inv(vectors)[:, r:], dtype=complex)
    right = vectors.copy()
    right[:r] /= scale[:, None]
    return ComplexModes(poles, right, left)


@dataclass(frozen=True, repr=False)
class ModalSystem(Tabular):
    """Mass-normalised modes: eta'' + damping eta' + (omega^2 + i loss) eta = B u.

    Outputs y = (d/dt)^derivative (C eta + residual u) + D u. omega (r,), rad/s, ascending; `damping` (r, r), 1/s, and
    `loss` (r, r), 1/s^2 (None without structural damping); B (r, m); C (p, r); D and `residual` (p, m), the static
    gain of the modes that are left out. `shapes` (n, r) lead back to the coordinates of `system`, and `next_omega` is
    the first frequency left out, infinite when none is. `remainder` says what those modes do beyond their static gain.
    """

    _shown = ("order", "inputs", "outputs", "next_omega")

    system: SecondOrder
    omega: Array
    damping: Array
    loss: Array | None
    B: Array
    C: Array
    derivative: NDArray[np.intp]
    D: Array
    residual: Array
    shapes: Array
    next_omega: float
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    remainder: Remainder | None = None

    @property
    def order(self) -> int:
        """Number of modes."""
        return len(self.omega)

    @property
    def frequency_hz(self) -> Array:
        """Undamped natural frequencies (r,), Hz."""
        return self.omega / (2 * np.pi)

    @cached_property
    def is_proportional(self) -> bool:
        """True when damping does not couple the modes."""
        return not self.coupled.any()

    @cached_property
    def coupled(self) -> NDArray[np.bool_]:
        """Whether damping couples each mode (r,) to others."""
        coupled = np.zeros(self.order, dtype=bool)
        for A, scale in ((self.damping, np.sqrt(self.omega)), (self.loss, self.omega)):
            if A is not None:
                coupled |= _couples(A, scale)
        return coupled

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.system.name

    def presentation(self) -> Iterator[Item]:
        yield Facts(ends_of(self.inputs, self.outputs))
        damping = [percent(float(z)) for z in self.total_ratios]
        rows = {"mode": range(1, self.order + 1), "frequency [Hz]": self.frequency_hz, "damping at resonance": damping}
        yield Table(rows, "modes")
        if np.isfinite(self.next_omega):
            yield Facts({"left out, but for static gain": f"modes from {in_hz(self.next_omega / (2 * np.pi))} on"})

    def _data(self) -> dict[str, Any]:
        """Everything but the shapes."""
        names = ("damping", "loss", "B", "C", "derivative", "D", "residual")
        return {
            "name": self.name,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "frequency_hz": self.frequency_hz,
            "damping_ratios": self.ratios,
            "loss_factors": self.loss_factors,
            "next_frequency_hz": self.next_omega / (2 * np.pi),
            **{name: getattr(self, name) for name in names},
        }

    def _columns(self) -> dict[str, Any]:
        columns = {"frequency [Hz]": self.frequency_hz, "damping ratio": self.ratios, "loss factor": self.loss_factors}
        return {"mode": np.arange(1, self.order + 1), **columns}

    def part(self, modes: NDArray[np.bool_]) -> ModalSystem:
        """The system of some modes (r,) alone, to which damping couples no others."""
        at = np.ix_(modes, modes)
        return replace(
            self,
            omega=self.omega[modes],
            damping=self.damping[at],
            loss=None if self.loss is None else self.loss[at],
            B=self.B[modes],
            C=self.C[:, modes],
            shapes=self.shapes[:, modes],
            remainder=None,
        )

    @property
    def ratios(self) -> Array:
        """Viscous damping ratios (r,), those of the diagonal where damping couples the modes."""
        return self.damping.diagonal() / (2 * np.where(self.omega > 0, self.omega, np.inf))

    @property
    def loss_factors(self) -> Array:
        """Structural loss factors (r,): dissipated over stored energy (Johnson and Kienholz 1982; theory eq. T6)."""
        if self.loss is None:
            return np.zeros(self.order)
        return self.loss.diagonal() / np.where(self.omega > 0, self.omega**2, np.inf)

    @property
    def total_ratios(self) -> Array:
        """Damping ratios (r,) at resonance: viscous ones and half the loss factors."""
        return self.ratios + self.loss_factors / 2

    def viscous(self) -> ModalSystem:
        """The system with structural damping replaced by viscous damping that dissipates the same at each resonance,
        loss_rs / sqrt(omega_r omega_s): structural damping has no causal time response (Crandall 1970; theory eq. T7).
        Modes left out stay static.
        """
        if self.loss is None:
            return self if self.remainder is None else replace(self, remainder=None)
        w = np.sqrt(self.omega)
        w = np.where(w > 0, w, np.inf)
        return replace(self, damping=self.damping + self.loss / w[:, None] / w, loss=None, remainder=None)

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> ModalSystem:
        """The system with some of its inputs and outputs, by name. Raises OptionError for others."""
        if inputs is outputs is None:
            return self
        i, o = channel_positions(self.inputs, inputs), channel_positions(self.outputs, outputs)
        return replace(
            self,
            system=self.system.selected(inputs, outputs),
            B=self.B[:, i],
            C=self.C[o],
            derivative=self.derivative[o],
            D=self.D[np.ix_(o, i)],
            residual=self.residual[np.ix_(o, i)],
            inputs=tuple(self.inputs[k] for k in i),
            outputs=tuple(self.outputs[k] for k in o),
            remainder=None if self.remainder is None else self.remainder.selected(i, o),
        )

    def response(self, frequency_hz: ArrayLike) -> Complex:
        """H (f, p, m) at frequencies (f,), Hz, by modal sum; damping that couples modes is solved as it is.

        The sum takes two real matrix products (theory eq. T10). Modes left out enter by their flexibility, and to first
        order by their inertia and damping, that which couples them to the others included (theory eqs. T25, T26). At an
        undamped resonance H is infinite.
        """
        w = 2 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))
        rest = self.remainder
        if rest is not None and rest.couples:
            H = coupled_response(self, w, rest)[0]
        elif self.is_proportional:
            H = self._sum(w)
        elif self.loss is None:
            H = self._partly_coupled(w)
        else:
            H = self._direct(w)
        return self._outward(H, w)

    def _outward(self, H: Complex, w: Array) -> Complex:
        """Add what the modes left out do, differentiate, and add what goes directly."""
        system, rest, static = self.system, self.remainder, self.residual
        if rest is not None:
            at = (rest.places[1], rest.places[0])
            if not rest.couples:
                H += rest.flexibility(system, w, at)
            static = static - rest.stiff[np.ix_(*at)]
        if static.any():
            H += static / stiffening(system, w, self.loss is not None)[:, None, None]
        for k, order in enumerate(self.derivative):
            if order:
                H[:, k] *= ((1j * w) ** int(order))[:, None]
        if self.D.any():
            H += self.D
        return H

    def _sum(self, w: Array) -> Complex:
        """The sum over modes that damping does not couple."""
        loss = np.zeros(self.order) if self.loss is None else self.loss.diagonal()
        return modal_sum(w, self.omega**2, self.damping.diagonal(), loss, self.C, self.B)

    def _partly_coupled(self, w: Array) -> Complex:
        """Real modes where damping does not couple them, and complex ones where it does and where there are any."""
        together = self.part(self.coupled)
        try:
            H = together._complex_sum(w)
        except SolverError:
            H = together._direct(w)
        return H if self.coupled.all() else H + self.part(~self.coupled)._sum(w)

    def _complex_sum(self, w: Array) -> Complex:
        """The same with complex modes, where viscous damping couples the real ones (Foss 1958; theory eq. T11)."""
        modes = self.complex_modes
        left = modes.right[: self.order]
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = 1 / (1j * w[:, None] - modes.poles)
        residues = (self.C @ left).T[:, :, None] * (modes.left @ self.B)[:, None, :]
        return (factor @ residues.reshape(len(modes.poles), -1)).reshape(len(w), len(self.C), -1)

    def _direct(self, w: Array) -> Complex:
        """Dynamic stiffness of the modes solved frequency by frequency."""
        H = np.empty((len(w), len(self.C), self.B.shape[1]), dtype=complex)
        loss = np.zeros_like(self.damping) if self.loss is None else self.loss
        for start in range(0, len(w), 256):
            v = w[start : start + 256, None, None]
            Z = np.diag(self.omega**2) - v**2 * np.eye(self.order) + 1j * (v * self.damping + np.sign(v) * loss)
            H[start : start + 256] = self.C @ np.linalg.solve(Z, np.broadcast_to(self.B, (len(Z), *self.B.shape)))
        return H

    @cached_property
    def complex_modes(self) -> ComplexModes:
        """Poles and complex modes, with structural damping as equivalent viscous damping."""
        return complex_modes(self.omega, self.viscous().damping)


def modal_system(system: SecondOrder, n: int | None = None, up_to: float | None = None) -> ModalSystem:
    """A system in coordinates of its `n` lowest modes, of those up to `up_to` Hz, or of all (theory eq. T8).

    What the modes left out add at frequency zero is kept as `residual`, so that static gains are those of the whole.
    Raises OptionError for impossible numbers.
    """
    if n is not None and up_to is not None:
        raise OptionError("give the number of modes or the highest frequency, not both")
    if n is not None and n < 1:
        raise OptionError(f"the number of modes is at least 1, not {n}")
    if up_to is not None and not (np.isfinite(up_to) and up_to > 0):
        raise OptionError(f"up_to is a positive frequency in Hz, not {up_to}")
    count = system.order
    if up_to is not None:
        count = count_below(system.K, system.M, (2 * np.pi * up_to) ** 2)
    elif n is not None:
        count = min(n, count)
    pairs = system.lowest(min(count + SPARE_MODES, system.order)).finite
    values = np.maximum(pairs.values, 0.0)
    following = float(np.sqrt(values[count])) if len(values) > count else np.inf
    return in_modes(system, Eigenpairs(values, pairs.vectors).first(count), following)


def in_modes(system: SecondOrder, pairs: Eigenpairs, following: float) -> ModalSystem:
    """A system in coordinates of mass-normalised modes, `following` being the first frequency left out, rad/s."""
    V, omega = pairs.vectors, np.sqrt(pairs.values)
    law = system.law
    proportional = 2 * law.modal_ratios(omega / (2 * np.pi)) * omega + law.alpha + law.beta * pairs.values
    damping = np.diag(proportional) + _in_coordinates(system.dashpots, V)
    loss = None
    if system.uniform_loss is None:
        loss = _in_coordinates(system.H, V)
    elif system.uniform_loss:
        loss = np.diag(system.uniform_loss * pairs.values)
    B, C = V.T @ system.B, system.rows @ V
    residual = system.residual
    if V.shape[1] < system.order and residual.size:
        flexible = system.flexibility
        residual = residual + system.rows @ flexible(system.B) - (C / (pairs.values + flexible.shift)) @ B
    rest = remainder_of(system, omega, V) if np.isfinite(following) and residual.size else None
    return ModalSystem(
        system, omega, damping, loss, B, C, system.derivative, system.D, residual, V, following,
        system.inputs, system.outputs, rest,
    )  # fmt: skip


def _in_coordinates(A: Any, V: Array) -> Array:
    """V' A V without entries that are round-off: that of a mode in one coordinate is beside the largest of all modes
    in this coordinate, as it is a mixture of these."""
    matrix = V.T @ (A @ V)
    size = np.abs(V).max(axis=1, initial=0.0) @ (abs(A) @ np.abs(V))
    return np.where(np.abs(matrix) > MODAL_ROUNDING * np.add.outer(size, size), matrix, 0.0)


def _couples(A: Array, scale: Array) -> NDArray[np.bool_]:
    """Whether each mode (r,) is coupled by the coefficients A (r, r), which are of size `scale` (r,) squared."""
    d = np.abs(A.diagonal())
    off = np.abs(A - np.diag(A.diagonal()))
    least = np.maximum(COUPLED_DAMPING * np.sqrt(np.outer(d, d)), DAMPING_ROUNDING * np.maximum(d[:, None], d))
    least = np.maximum(
        least, DAMPING_ROUNDING**2 * d.max(initial=0.0)
    )  # two modes that damping reaches by round-off alone
    return np.asarray((off > np.maximum(least, MODAL_ROUNDING * np.outer(scale, scale))).any(axis=1))


def coupled_response(modes: ModalSystem, w: Array, remainder: Remainder) -> tuple[Complex, Complex, Complex]:
    """Displacements (f, p, m) where damping couples kept modes with those left out, and what loads (f, k, m) and
    readings (f, k, p) the latter get, in multiples of the columns of W (theory eq. T26).

    With Q the damping forces of kept modes on the others and N their flexibility to first order,
    eta = (Z - Q' N Q)^-1 (Phi' B - Q' N B) and y = C eta + N_rows (B - Q eta).
    """
    system, (B, rows, *others) = modes.system, remainder.places
    damped = np.concatenate(others)
    every = np.concatenate([B, rows, damped])
    m, p, r, c, k = len(B), len(rows), modes.order, len(damped), len(every)
    gather = np.tile(np.eye(r), c // r) if r else np.zeros((0, c))
    loss = np.zeros((r, r)) if modes.loss is None else modes.loss
    y: Complex = np.empty((len(w), p, m), dtype=complex)
    load: Complex = np.zeros((len(w), k, m), dtype=complex)
    reading: Complex = np.zeros((len(w), k, p), dtype=complex)
    for start in range(0, len(w), FREQUENCIES_AT_ONCE):
        chunk = slice(start, start + FREQUENCIES_AT_ONCE)
        v = w[chunk]
        N = remainder.flexibility(system, v, (every, every))
        Z = np.diag(modes.omega**2) - v[:, None, None] ** 2 * np.eye(r)
        Z = Z + 1j * (v[:, None, None] * modes.damping + np.sign(v)[:, None, None] * loss)
        Q = remainder.forces(v)[:, :, None] * gather.T
        QN = np.swapaxes(Q, 1, 2) @ N[:, m + p :]
        Z = Z - QN[:, :, m + p :] @ Q
        sides = np.concatenate(
            [np.broadcast_to(modes.B, (len(v), r, m)), np.broadcast_to(modes.C.T, (len(v), r, p))], 2
        )
        eta = np.linalg.solve(Z, sides - QN[:, :, : m + p])
        left = np.concatenate([np.broadcast_to(np.eye(m + p), (len(v), m + p, m + p)), -Q @ eta], 1)
        load[chunk], reading[chunk] = left[:, :, :m], left[:, :, m:]
        y[chunk] = modes.C @ eta[:, :, :m] + N[:, m : m + p] @ left[:, :, :m]
    return y, load, reading
