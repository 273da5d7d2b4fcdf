"""A frequency response of one design with exact derivatives by parameters, of the full-order model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.duals import Dual
from flexura.linalg import count_below, inverse_roots
from flexura.mechanism import expressions
from flexura.records import Record
from flexura.sensitivity import Cluster, FullOrderFamily, moved_clusters, whole_clusters
from flexura.structure import Design, Plan
from flexura.systems import Ports, System, system

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

BEYOND = 4.0
"""Modes up to so many times the highest frequency have the modal damping ratios that are described."""


@dataclass(frozen=True, repr=False)
class SlopedResponse(Record):
    """The response of one output to one input of a design of a plan, with slopes by the parameters `names`, up to
    frequencies of `top`, Hz.

    Damping by modal ratios, Rayleigh's, and one loss factor for everything, of constant numbers, at rest or under loads
    (`is_known`); not dashpots, accelerated bases, or sensors of force.
    """

    _shown = ("names",)

    plan: Plan
    parameters: Mapping[str, float]
    names: Sequence[str]
    output: str
    input: str
    top: float

    @cached_property
    def _system(self) -> System:
        return system(self.plan, self.parameters, inputs=[self.input], outputs=[self.output], order="full")

    @property
    def is_known(self) -> bool:
        """Whether these slopes hold for the damping, the input and the output."""
        if self.plan.is_posed or next(expressions(self.plan.mechanism.damping), None) is not None:
            return False
        own = self._system
        still = own.input_ports[0].base is None and not own.D.any()
        return still and own.uniform_loss is not None and not abs(own.dashpots).max() > 0

    @cached_property
    def _clusters(self) -> tuple[Any, list[Cluster], Array]:
        """Modes that are damped by ratios, how they move, and M' Phi (P, n, r)."""
        own = self._system
        count = count_below(own.K, own.M, (2 * np.pi * BEYOND * self.top) ** 2) if own.law.is_modal else 0
        if not count:
            return np.zeros((own.order, 0)), [], np.zeros((len(self.names), own.order, 0))
        pairs = whole_clusters(own.K, own.M, count)
        changes = self._changes(pairs.vectors)
        return pairs.vectors, moved_clusters(own.K, own.M, pairs, changes), np.stack([c.M for c in changes])

    def _changes(self, X: Array) -> list[Any]:
        return FullOrderFamily(self.plan).changes(self.parameters, list(self.names), X)

    @cached_property
    def _damping(self) -> tuple[Array, Array]:
        """2 zeta omega (r,) of the damped modes and its derivatives by their eigenvalues."""
        omega = np.sqrt(np.maximum([own.value for own in self._clusters[1] for _ in own.at], 0.0))
        zeta = self._system.law.modal_ratios(omega / (2 * np.pi))
        return 2 * zeta * omega, zeta / np.where(omega > 0, omega, np.inf)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Slopes (P, n) of the row that is read and of the load."""
        ports = Ports(Design.with_slopes(self.plan.at_rest(), self.parameters, self.names))
        both = ports.outputs([self.output])[0].row, ports.inputs([self.input])[0].load
        row, load = (own.slope if isinstance(own, Dual) else np.zeros((len(self.names), len(own))) for own in both)
        return row, load

    def _factors(self, w: float) -> tuple[complex, complex]:
        """What K and M are multiplied by in the dynamic stiffness (theory eq. T10)."""
        own = self._system
        loss = own.uniform_loss or 0.0
        return 1 + 1j * (loss + w * own.law.beta), -(w**2) + 1j * w * own.law.alpha

    def _solved(self, w: float) -> Complex:
        """Displacements (n, 2) by the load and by a unit force along what is read."""
        own, (k, m) = self._system, self._factors(w)
        W = np.asarray(own.M @ self._clusters[0])
        d = inverse_roots(own.K.diagonal())
        S = sp.diags(d)
        edge = d[:, None] * W
        Z = S @ (k * sp.csc_matrix(own.K) + m * sp.csc_matrix(own.M)) @ S
        right = d[:, None] * np.stack([own.B[:, 0], own.rows[0]], axis=1).astype(complex)
        if W.shape[1]:
            size = np.linalg.norm(edge, axis=0)
            gain = 1j * w * self._damping[0] * size**2
            Z = sp.bmat([[Z, (edge / size) * gain], [(edge / size).T, -sp.eye(W.shape[1])]])
            right = np.concatenate([right, np.zeros((W.shape[1], 2))])
        return np.asarray(d[:, None] * spla.splu(sp.csc_matrix(Z)).solve(right)[: own.order], dtype=complex)

    def by_frequency(self, hz: float) -> float:
        """How the squared magnitude grows with the frequency."""
        own, w = self._system, 2 * np.pi * hz
        x, y = self._solved(w).T
        order, Phi = int(own.derivative[0]), self._clusters[0]
        change = (1j * own.law.beta) * (own.K @ x) + (-2 * w + 1j * own.law.alpha) * (own.M @ x)
        change = change + 1j * (own.M @ (Phi @ (self._damping[0] * (Phi.T @ (own.M @ x)))))
        H = own.rows[0] @ x
        return float(((-(y @ change) + order / w * H) * np.conj(H)).real * w ** (2 * order))

    def magnitude(self, hz: float) -> Dual:
        """The magnitude at a frequency, with slopes there (theory eq. V10); NaN at kinks and where it is zero."""
        own, w = self._system, 2 * np.pi * hz
        x, y = self._solved(w).T
        scale = w ** int(own.derivative[0])
        H = own.rows[0] @ x
        row, load = self._ends
        changes = self._changes(np.stack([x.real, x.imag], axis=1))
        K, M = (
            np.stack([A[:, 0] + 1j * A[:, 1] for A in of]) for of in zip(*((c.K, c.M) for c in changes), strict=True)
        )
        k, m = self._factors(w)
        slope = row @ x + load @ y - k * (K @ y) - m * (M @ y) - 1j * w * self._modal(x, y, M)
        with np.errstate(divide="ignore", invalid="ignore"):
            moved = (slope * np.conj(H)).real / abs(H)
        kinked = [not c.is_smooth for c in changes]
        return Dual(np.array(abs(H) * scale), np.where(kinked, np.nan, moved * scale))

    def _modal(self, x: Complex, y: Complex, Mx: Complex) -> Complex:
        """y' C' x (P,) of C = M Phi diag(2 zeta omega) Phi' M, with M' x (P, n)."""
        own, (Phi, found, moved) = self._system, self._clusters
        out = np.zeros(len(self.names), dtype=complex)
        if not found:
            return out
        gain, bend = self._damping
        a, b = Phi.T @ (own.M @ x), Phi.T @ (own.M @ y)
        out += np.einsum("n,pnr,r->p", y, moved, gain * a) + (Mx @ Phi) @ (gain * b)
        for c in found:
            at = c.at
            by_x, by_y = (np.einsum("n,pnr->pr", own.M @ z, c.outer) for z in (x, y))
            out += by_y @ (gain[at] * a[at]) + by_x @ (gain[at] * b[at])
            turned = bend[at[0]] * c.slope - gain[at[0]] * c.mass
            out += np.einsum("i,pij,j->p", b[at], turned, a[at])
        return out
