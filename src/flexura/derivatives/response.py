"""A frequency response of one design, of the full-order model, with exact derivatives by parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.analysis import SEEN, lost_digits
from flexura.arrays import Array, Complex
from flexura.derivatives.eigenpairs import Cluster, moved_clusters, whole_clusters
from flexura.derivatives.families import Change, FullOrderFamily
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.linalg import Eigenpairs, count_below, inverse_roots
from flexura.records import Record
from flexura.structure import Design, FullOrderModel, Ports
from flexura.systems import DampingLaw, System, damping_law, load_of, system
from flexura.tables import in_hz

BEYOND = 4.0
"""Modes up to so many times the highest frequency have the modal damping ratios that are described."""


@dataclass(frozen=True, repr=False)
class SlopedResponse(Record):
    """The response of one output to one input of a design, solved at each frequency, up to frequencies of `top`, Hz,
    with slopes where the design has some; these at rest, or under loads, but not at a pose."""

    _shown = ("output", "input")

    design: Design
    output: str
    input: str
    top: float

    @cached_property
    def _system(self) -> System:
        return system(
            self.design.plan, self.design.still.parameters, inputs=[self.input], outputs=[self.output], order="full"
        )

    @property
    def is_known(self) -> bool:
        """Whether its digits are more than round-off."""
        return not self._system.flexibility.shift and lost_digits(self._system) < SEEN

    @cached_property
    def _modes(self) -> Eigenpairs:
        """Modes that are damped by ratios."""
        built = self._system
        count = count_below(built.K, built.M, (2 * np.pi * BEYOND * self.top) ** 2) if self._law.is_modal else 0
        if not count:
            return Eigenpairs(np.zeros(0), np.zeros((built.order, 0)))
        return whole_clusters(built.K, built.M, count)

    @cached_property
    def _moved(self) -> tuple[list[Cluster], Array]:
        """How these modes move, and M' Phi (P, n, r)."""
        built, pairs = self._system, self._modes
        changes = self._changes(pairs.vectors)
        return moved_clusters(built.K, built.M, pairs, changes), np.stack([c.M for c in changes])

    def _changes(self, X: Array) -> list[Change]:
        return FullOrderFamily(self.design.plan).changes_of(self.design, X)

    @cached_property
    def _law(self) -> DampingLaw:
        """The damping of the mechanism as a whole, with slopes."""
        plan = self.design.plan
        return damping_law(plan.mechanism.damping, plan.parameter_values(self.design.parameters), None)

    @cached_property
    def _omega(self) -> Array:
        """Of the damped modes (r,), rad/s, those that are repeated alike."""
        return np.sqrt(np.maximum(self._modes.values, 0.0))

    @cached_property
    def _ratios(self) -> Any:
        """Of the damped modes (r,), with slopes."""
        return self._law.modal_ratios(self._omega / (2 * np.pi))

    @property
    def _count(self) -> int:
        """Number of slopes."""
        return len(slope_of(self.design.values)) if isinstance(self.design.values, Dual) else 0

    def _slope(self, x: Any) -> Array:
        """Slopes (P, ...) of something, zero without."""
        return x.slope if isinstance(x, Dual) else np.zeros((self._count, *np.shape(x)))

    @cached_property
    def _ends(self) -> tuple[Array, Array, Array]:
        """Slopes of the row (P, n) that is read, of the load (P, n), and (P,) of what is fed directly."""
        built, ports = self._system, Ports(self.design)
        [out], [into] = ports.outputs([self.output]), ports.inputs([self.input])
        load = load_of(into, FullOrderModel(self.design, built.K, built.M))
        row, load, direct = map(self._slope, (out.row, load, out.direct(into)))
        return row, load, direct

    def _solved(self, w: float) -> Complex:
        """Displacements (n, 2) by the load and by a unit force along what is read (theory eq. T14)."""
        built = self._system
        W = np.asarray(built.M @ self._modes.vectors)
        d = inverse_roots(built.K.diagonal())
        S = sp.diags(d)
        edge = d[:, None] * W
        K = built.K if built.H is None else built.K + 1j * built.H
        Z = S @ sp.csc_matrix(K + 1j * w * built.C - w**2 * built.M) @ S
        right = d[:, None] * np.stack([built.B[:, 0], built.rows[0]], axis=1).astype(complex)
        if W.shape[1]:
            size = np.linalg.norm(edge, axis=0)
            gain = 2j * w * plain(self._ratios) * self._omega * size**2
            Z = sp.bmat([[Z, (edge / size) * gain], [(edge / size).T, -sp.eye(W.shape[1])]])
            right = np.concatenate([right, np.zeros((W.shape[1], 2))])
        try:
            solution = spla.splu(sp.csc_matrix(Z)).solve(right)[: built.order]
        except RuntimeError:
            solution = np.full((built.order, 2), np.nan)
        if not np.isfinite(solution).all():
            raise SolverError(f"nothing damps the resonance at {in_hz(w / (2 * np.pi))}; describe `damping`")
        return np.asarray(d[:, None] * solution, dtype=complex)

    def _read(self, w: float, x: Complex) -> tuple[complex, complex]:
        """The response, and what the motion that is read is multiplied by in it."""
        built = self._system
        scale = (1j * w) ** int(built.derivative[0])
        return complex(scale * (built.rows[0] @ x) + built.D[0, 0]), scale

    def at(self, hz: float) -> complex:
        """The response at a frequency. Raises SolverError at a resonance that nothing damps."""
        w = 2 * np.pi * hz
        return self._read(w, self._solved(w)[:, 0])[0]

    def by_frequency(self, hz: float) -> float:
        """How the squared magnitude grows with the frequency. Raises SolverError as `at`."""
        built, w = self._system, 2 * np.pi * hz
        x, y = self._solved(w).T
        order, Phi = int(built.derivative[0]), self._modes.vectors
        damped = built.C @ x + built.M @ (Phi @ (2 * plain(self._ratios) * self._omega * (Phi.T @ (built.M @ x))))
        H, scale = self._read(w, x)
        change = scale * (order / w * (built.rows[0] @ x) - y @ (1j * damped - 2 * w * (built.M @ x)))
        return float((change * np.conj(H)).real)

    def magnitude(self, hz: float) -> Dual:
        """The magnitude at a frequency, with slopes there (theory eq. V10); NaN at kinks and where it is zero. Raises
        SolverError as `at`."""
        built, w = self._system, 2 * np.pi * hz
        x, y = self._solved(w).T
        H, scale = self._read(w, x)
        row, load, direct = self._ends
        parts = np.stack([x.real, x.imag], axis=1)
        changes = self._changes(parts)
        law = self._law
        lost = FullOrderFamily(self.design.plan).dissipated(self.design, parts, law.loss_factor)
        K, M = (_complex(np.stack(of)) for of in zip(*((c.K, c.M) for c in changes), strict=True))
        C, L = (_complex(self._slope(of)) for of in lost)
        Kx, Mx = built.K @ x, built.M @ x
        C = C + plain(law.alpha) * M + plain(law.beta) * K
        C = C + self._slope(law.alpha)[:, None] * Mx + self._slope(law.beta)[:, None] * Kx
        slope = row @ x + load @ y - (K + 1j * L + 1j * w * C - w**2 * M) @ y - 1j * w * self._modal(x, y, M)
        with np.errstate(divide="ignore", invalid="ignore"):
            moved = ((scale * slope + direct) * np.conj(H)).real / abs(H)
        kinked = [not c.is_smooth for c in changes]
        return Dual(np.array(abs(H)), np.where(kinked, np.nan, moved))

    def _modal(self, x: Complex, y: Complex, Mx: Complex) -> Complex:
        """y' C' x (P,) of C = M Phi diag(2 zeta omega) Phi' M, with M' x (P, n)."""
        built, Phi = self._system, self._modes.vectors
        out = np.zeros(self._count, dtype=complex)
        if not Phi.shape[1]:
            return out
        groups, moved = self._moved
        zeta = plain(self._ratios)
        gain, bend = 2 * zeta * self._omega, zeta / np.where(self._omega > 0, self._omega, np.inf)
        a, b = Phi.T @ (built.M @ x), Phi.T @ (built.M @ y)
        out += np.einsum("n,pnr,r->p", y, moved, gain * a) + (Mx @ Phi) @ (gain * b)
        out += self._slope(self._ratios) @ (2 * self._omega * a * b)
        for c in groups:
            at = c.at
            by_x, by_y = (np.einsum("n,pnr->pr", built.M @ z, c.outer) for z in (x, y))
            out += by_y @ (gain[at] * a[at]) + by_x @ (gain[at] * b[at])
            turned = bend[at[0]] * c.slope - gain[at[0]] * c.mass
            out += np.einsum("i,pij,j->p", b[at], turned, a[at])
        return out


def _complex(parts: Array) -> Complex:
    """Numbers (P, n) from their real and imaginary parts (P, n, 2)."""
    return parts[..., 0] + 1j * parts[..., 1]
