"""Root mean square of an output of one design under its disturbances, with exact derivatives by parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis import budget, chosen_disturbances, disturbed, disturbed_modes, sources_in
from flexura.arrays import Array, Complex
from flexura.derivatives.families import FullOrderFamily
from flexura.duals import Dual, plain, slope_of
from flexura.errors import SolverError
from flexura.mechanism import expressions
from flexura.records import Record
from flexura.structure import Channel, Design, FullOrderModel, Ports
from flexura.systems import (
    DampingLaw,
    ModalSystem,
    damping_law,
    load_of,
    mean_squares,
    spectrum_panels,
    system,
    with_residual_modes,
)

ALIKE = 1e-7
"""Relative difference of eigenvalues from which divided differences are derivatives."""


@dataclass(frozen=True, repr=False)
class SlopedRms(Record):
    """The root mean square of one output under all disturbances that are described, or under one, of the full-order
    model, with the loops that are described closed; with slopes where the design has some, but at poses and of closed
    loops."""

    _shown = ("output", "under")

    design: Design
    output: str
    under: str | None = None

    @cached_property
    def _sources(self) -> Any:
        plan = self.design.plan
        names = None if self.under is None else [self.under]
        return sources_in(plan, self.design.still.parameters, chosen_disturbances(plan.mechanism, None, names))

    @cached_property
    def _modes(self) -> ModalSystem:
        """The modes of the full-order model that matter, and as one more input a force along what is read: so residual
        modes carry what the response is to as well as what it is of."""
        parameters = self.design.still.parameters
        built = system(self.design.plan, parameters, inputs=self._inputs, outputs=[self.output], order="full")
        nothing = np.zeros((1, 1))
        with_force = replace(
            built,
            B=np.hstack([built.B, built.rows.T]),
            D=np.hstack([built.D, nothing]),
            residual=np.hstack([built.residual, nothing]),
            inputs=(*built.inputs, Channel(f"along {self.output}", "force")),
        )
        return disturbed_modes(with_force, self._sources)

    @cached_property
    def _inputs(self) -> list[str]:
        return list(dict.fromkeys(name for source in self._sources for name in source.inputs))

    @cached_property
    def value(self) -> float:
        """In closed form. Raises SolverError where it has no bound, where nothing damps what moves, and where a loop is
        unstable."""
        plan, parameters = self.design.plan, self.design.still.parameters
        if plan.mechanism.controllers:
            names = None if self.under is None else [self.under]
            found = float(budget(plan, parameters, outputs=[self.output], sources=names, points=2).rms[0])
        else:
            spectra = [source.spectrum for source in self._sources]
            squares = mean_squares(disturbed(self._modes, self._sources), spectra, np.zeros(0))
            found = float(np.sqrt(sum(own.total[0] for own in squares)))
        if not np.isfinite(found):
            raise SolverError(f"{self.output}: a density that does not end reaches it directly: give it a band")
        return found

    def with_slopes(self) -> Dual | None:
        """The value with its slopes (theory eq. T36); None at poses, where loops are closed, and where a disturbance
        itself depends on parameters.

        Those of matrices in the modes that are held: what else of the modes changes does so to second order, but for
        what lies beyond those kept. Raises SolverError as `value`.
        """
        mechanism = self.design.plan.mechanism
        if (
            self.design.plan.is_posed
            or mechanism.controllers
            or any(list(expressions(own)) for own in mechanism.disturbances.values())
        ):
            return None
        slope = sum((self._of_source(k) for k in range(len(self._sources))), np.zeros(self._count))
        kinked = [not change.is_smooth for change in self._changes]
        slope = np.where(kinked, np.nan, slope)
        with np.errstate(divide="ignore", invalid="ignore"):
            return Dual(np.array(self.value), slope / (2 * self.value))

    @property
    def _count(self) -> int:
        return len(slope_of(self.design.values))

    def _slope(self, x: Any) -> Array:
        """Slopes (P, ...) of something, zero without."""
        return x.slope if isinstance(x, Dual) else np.zeros((self._count, *np.shape(x)))

    @cached_property
    def _whole(self) -> ModalSystem:
        return with_residual_modes(self._modes) if self._modes.order else self._modes

    @cached_property
    def _changes(self) -> Any:
        return FullOrderFamily(self.design.plan).changes_of(self.design, self._whole.shapes)

    @cached_property
    def _matrices(self) -> tuple[Array, Array, Array]:
        """Slopes of M, viscous C and K in the modes, (P, r, r) each."""
        whole, V = self._whole, self._whole.shapes
        plan, design = self.design.plan, self.design
        law = damping_law(plan.mechanism.damping, plan.parameter_values(design.parameters), None)
        M, K = (V.T @ np.stack(own) for own in ([c.M for c in self._changes], [c.K for c in self._changes]))
        lost = FullOrderFamily(plan).dissipated(design, V, law.loss_factor)
        C, H = (V.T @ self._slope(own) for own in lost)
        A = K - _halves(M, np.diag(whole.omega**2))
        C = C + _proportional(whole, law, M, K, A, self._slope)
        return M, C + _equivalent(whole, M, H, A), K

    def _of_source(self, number: int) -> Array:
        """Slopes (P,) of the mean square under one source."""
        source, modes = self._sources[number], self._whole.viscous()
        form = disturbed(self._modes, [source])[0].damped()
        f, weight = spectrum_panels(form.z, source.spectrum)
        w, ports = 2 * np.pi * f, Ports(self.design)
        [out] = ports.outputs([self.output])
        ins = ports.inputs(self._inputs)
        full: Any = FullOrderModel(self.design, modes.system.K, modes.system.M)
        V, weights = modes.shapes, source.weights(modes.inputs)
        loads, fed = np.zeros((self._count, V.shape[1], len(weights))), np.zeros((self._count, len(weights)))
        for k, own in enumerate(ins):
            loads[:, :, k], fed[:, k] = self._slope(load_of(own, full)) @ V, self._slope(out.direct(own))
        row, B, D = self._slope(out.row) @ V, modes.B @ weights, modes.D @ weights + source.read(modes.outputs)
        scale = (1j * w) ** int(modes.derivative[0])
        y = _moved(modes, w, modes.C[0])
        total = np.zeros(self._count)
        for q in range(weights.shape[1]):
            x = _moved(modes, w, B[:, q])
            H = scale * (x @ modes.C[0]) + D[0, q]
            load, direct = loads @ weights[:, q], fed @ weights[:, q]
            for p, (M, C, K) in enumerate(zip(*self._matrices, strict=True)):
                turned = y @ K - w[:, None] ** 2 * (y @ M) + 1j * w[:, None] * (y @ C)
                change = scale * (x @ row[p] + y @ load[p] - (turned * x).sum(axis=1)) + direct[p]
                total[p] += 2 * float(weight @ (H.conj() * change).real)
        return total


def _moved(modes: ModalSystem, w: Array, force: Array) -> Complex:
    """Modal coordinates (f, r) under a harmonic force (r,)."""
    stiff = modes.omega**2 - w[:, None] ** 2
    if modes.is_proportional:
        return np.asarray(force / (stiff + 1j * w[:, None] * modes.damping.diagonal()), dtype=complex)
    Z = 1j * w[:, None, None] * modes.damping
    k = np.arange(modes.order)
    Z[:, k, k] += stiff
    forces = np.broadcast_to(force, stiff.shape)[:, :, None].astype(complex)
    return np.asarray(np.linalg.solve(Z, forces)[:, :, 0], dtype=complex)


def _halves(M: Array, X: Array) -> Array:
    """(M X + X M)/2 for each M (P, r, r)."""
    return (M @ X + X @ M) / 2


def _divided(values: Array, of: Array, slope: Array) -> Array:
    """Divided differences (r, r) of a function of eigenvalues (r,), its derivatives where they all but coincide."""
    apart = values[:, None] - values
    alike = np.abs(apart) <= ALIKE * np.maximum(values[:, None], values)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(alike, (slope[:, None] + slope) / 2, (of[:, None] - of) / apart)


def _proportional(whole: ModalSystem, law: DampingLaw, M: Array, K: Array, A: Array, slope: Any) -> Array:
    """Slopes (P, r, r) of damping that follows from modes, g(A) = 2 zeta sqrt(A) by Daleckii and Krein, and of
    Rayleigh's. A are those of the stiffness over unit masses."""
    omega = whole.omega
    ratios = law.modal_ratios(omega / (2 * np.pi))
    zeta = plain(ratios)
    inverse = np.divide(1.0, omega, where=omega > 0, out=np.zeros_like(omega))
    g = 2 * zeta * omega
    changed = _divided(omega**2, g, zeta * inverse) * A + _halves(M, np.diag(g))
    changed = changed + 2 * (slope(ratios) * omega)[:, :, None] * np.eye(len(omega))
    one, square = np.eye(len(omega)), np.diag(omega**2)
    return (
        changed
        + plain(law.alpha) * M
        + plain(law.beta) * K
        + slope(law.alpha)[:, None, None] * one
        + slope(law.beta)[:, None, None] * square
    )


def _equivalent(whole: ModalSystem, M: Array, H: Array, A: Array) -> Array:
    """Slopes (P, r, r) of the viscous damping A^(-1/4) H A^(-1/4) that stands for the structural one."""
    if whole.loss is None:
        return np.zeros_like(M)
    omega, L = whole.omega, whole.loss
    inverse = np.divide(1.0, omega, where=omega > 0, out=np.zeros_like(omega))
    w = np.sqrt(inverse)
    W, turned = np.diag(w), _divided(omega**2, w, -0.25 * w * inverse**2) * A
    half = turned @ L @ W
    whole_change = half + np.swapaxes(half, 1, 2) + W @ (H - _halves(M, L)) @ W
    return whole_change + _halves(M, W @ L @ W)
