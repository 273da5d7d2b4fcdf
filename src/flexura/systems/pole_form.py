"""Responses as sums over poles, in parts that add up, and exact mean squares under densities that are powers of f.

At real f the conjugate of H(f) is a function with the conjugate poles, so that |H|^2 is a sum over single poles, whose
residues follow from the values of that function at the poles of H (theory eq. B3): every integral over a band is one of
1/(f - z) times powers of f, in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import SolverError
from flexura.records import Record
from flexura.systems.modal import ModalSystem
from flexura.systems.spectra import Spectrum, increments, plain_increments, points_of
from flexura.tables import in_hz

DIRECT = "direct"
"""What goes from inputs to outputs without a mode."""

LEFT_OUT = "modes left out"
"""What modes beyond those that are kept do, by residual modes and static gain."""

NEARLY_CRITICAL = 1e-4
"""Least distance of the two poles of a mode, over twice its frequency: closer ones are moved that far apart."""

UNDAMPED = 1e-13
"""Damping ratio below which nothing damps a pole."""

SILENT = 1e-13
"""Size of a residue, beside the largest one, that is none."""

PROPER = 1e-12
"""Direct gain, beside the largest response, that is round-off."""

LOST = 1e-7
"""Round-off of a mean square, relative, from which it is integrated by panels instead."""

NODES, OCTAVES = 20, 70
"""Points of Gauss's rule in a panel, and octaves up to which an infinite band is integrated."""


@dataclass(frozen=True, repr=False)
class PoleForm(Record):
    """H (p, q) = sum of parts (g, p, K) / (f - z) loads (K, q) + direct (g, p, q) over poles z (K,), Hz, and parts g.

    z are poles over 2 pi i, so that stable ones have a positive imaginary part; `names` (g,) say what the parts are.
    `static` (p, q) is the static gain that the modes lack, which belongs to those left out, up to where anybody asks.
    """

    _shown = ("names", "z")

    z: Complex
    parts: Complex
    loads: Complex
    direct: Array
    static: Array
    names: tuple[str, ...]

    def response(self, hz: Array) -> Complex:
        """H (f, p, q) at frequencies (f,), Hz."""
        residues = self.parts.sum(axis=0).T[:, :, None] * self.loads[:, None, :]
        H = (1 / (hz[:, None] - self.z)) @ residues.reshape(len(self.z), -1)
        return H.reshape(len(hz), *residues.shape[1:]) + self.direct.sum(axis=0)

    def driven_by(self, weights: Array, direct: Array, has_static: bool = True) -> PoleForm:
        """The response to other inputs, which drive those of it by `weights` (q, s) and reach outputs by `direct`
        (p, s) beside; the static gain that modes lack is part of it, or left out."""
        more = self.direct @ weights
        more[self.names.index(DIRECT)] += direct
        more[self.names.index(LEFT_OUT)] += has_static * (self.static @ weights)
        return replace(self, loads=self.loads @ weights, direct=more, static=0 * more[0])

    def damped(self) -> PoleForm:
        """The same without poles that nothing damps and nothing drives or reads. Raises SolverError where something
        moves that nothing damps, or that grows, naming the pole."""
        worst = self.z.imag <= UNDAMPED * np.abs(self.z)
        seen = np.abs(self.parts.sum(axis=0)).max(axis=0, initial=0.0) * np.abs(self.loads).max(axis=1, initial=0.0)
        bad = np.flatnonzero(worst & (seen > SILENT * seen.max(initial=0.0)))
        if len(bad):
            k = bad[np.argmin(self.z.imag[bad])]
            size = in_hz(abs(self.z[k]))
            if self.z[k].imag < -UNDAMPED * abs(self.z[k]):
                raise SolverError(f"unstable: the pole at {size} grows by {-2 * np.pi * self.z[k].imag:.4g} 1/s")
            raise SolverError(f"nothing damps what moves at {size}: its mean square is infinite; describe `damping`")
        return replace(self, z=self.z[~worst], parts=self.parts[:, :, ~worst], loads=self.loads[~worst])


@dataclass(frozen=True)
class MeanSquares:
    """Mean squares of outputs (p,) under one density at inputs that are independent of each other.

    `parts` (g, p) are the shares of the parts of a response, which add up to `total` (p,); `up_to` (f, p) what
    frequencies up to each contribute, `density` (f, p), per Hz. `lost` (p,) is the round-off, relative.
    """

    total: Array
    parts: Array
    up_to: Array
    density: Array
    lost: Array


def mean_squares(forms: Sequence[PoleForm], spectra: Sequence[Spectrum], hz: Array) -> list[MeanSquares]:
    """Mean squares of the responses of some forms, each under one spectrum, read at frequencies (f,), Hz (theory eqs.
    B2-B5). Raises SolverError where nothing damps what moves."""
    points, found = points_of(spectra, hz), []
    steps: dict[bytes, dict[int, Complex]] = {}
    powers = {n for spectrum in spectra for n in spectrum.terms}
    for form, spectrum in zip(forms, spectra, strict=True):
        own = form.damped()
        key = own.z.tobytes()
        if key not in steps:
            steps[key] = increments(own.z, points, powers)
        found.append(_of_one(own, spectrum, points, steps[key], hz))
    return found


def _of_one(form: PoleForm, spectrum: Spectrum, points: Array, steps: dict[int, Complex], hz: Array) -> MeanSquares:
    own = spectrum.coefficients(points)
    A = np.zeros((len(points), len(form.z)), dtype=complex)
    plain = np.zeros(len(points))
    for n, c in own.items():
        at = np.flatnonzero(c)
        A[at + 1] += c[at, None] * steps[n][at]
        plain[at + 1] += c[at] * plain_increments(points, n)[at]
    A, plain = A.cumsum(axis=0), plain.cumsum()
    if not spectrum.is_bounded:  # what goes directly has no end
        plain[-1] = np.inf
    read, p = np.searchsorted(points, hz), form.parts.shape[1]
    shares: list[Array] = []
    lost, up_to = np.zeros(p), np.zeros((len(hz), p))
    for k in range(p):
        weights, direct, size = _weights(form, k)
        through = np.zeros((len(plain), len(direct)))
        through[:, direct != 0] = np.multiply.outer(plain, direct[direct != 0])
        shares.append((weights @ A[-1]).real + through[-1])
        noise = np.finfo(float).eps * float(size @ np.abs(A[-1]) + np.abs(through[-1]).sum())
        total = float(shares[-1].sum())
        lost[k] = noise / total if 0 < total < np.inf else 0.0
        up_to[:, k] = (A[read] @ weights.sum(axis=0)).real + through[read].sum(axis=1)
    parts = np.stack(shares, axis=1) if p else np.zeros((len(form.names), 0))
    density = (np.abs(form.response(hz)) ** 2).sum(axis=2) * spectrum.at(hz)[:, None]
    found = MeanSquares(parts.sum(axis=0), parts, np.maximum(up_to, 0.0), density, lost)
    bad = np.flatnonzero(lost > LOST)
    return _by_panels(form, spectrum, found, hz, bad) if len(bad) else found


def _weights(form: PoleForm, output: int) -> tuple[Complex, Array, Array]:
    """What integrals of S/(f - z) (K,) and of S are multiplied by for the shares (g, K) and (g,), and the sizes (K,)
    of what adds up in them."""
    z, R = form.z, form.parts[:, output, :]
    G = 1 / (z[:, None] - z.conj())
    weights = np.zeros(R.shape, dtype=complex)
    size = np.zeros(len(z))
    direct = np.zeros(len(R))
    scale = float((np.abs(R.sum(axis=0)) / np.abs(z.imag)) @ np.abs(form.loads).max(axis=1, initial=0.0))
    for q in range(form.loads.shape[1]):
        r, d = R * form.loads[:, q], form.direct[:, output, q]
        d = np.where(np.abs(d) > PROPER * scale, d, 0.0)
        mirrored = r.conj() @ G.T + d[:, None]
        whole, total = r.sum(axis=0), mirrored.sum(axis=0)
        weights += r * total + whole * mirrored
        size += 2 * np.abs(whole * total)
        direct += d * d.sum()
    return weights, direct, size


def panels(z: Complex, start: float, stop: float) -> tuple[Array, Array]:
    """Nodes and weights (n,) of Gauss's rule between two frequencies, Hz, in panels that halve towards every pole."""
    sizes = np.abs(z)
    low = max(start, 1e-6 * float(sizes.min(initial=1.0)))
    high = stop if np.isfinite(stop) else float(max(sizes.max(initial=1.0), low)) * 2.0**OCTAVES
    edges = [np.array([start, high]), np.exp2(np.arange(np.log2(low), np.log2(high), 0.5))]
    for pole in z:
        reach = abs(pole.imag) * np.exp2(np.arange(-1, max(np.log2(2 * abs(pole) / abs(pole.imag)), 0) + 1))
        edges += [pole.real + reach, pole.real - reach, np.array([pole.real])]
    ends = np.unique(np.concatenate(edges))
    ends = ends[(ends >= start) & (ends <= high)]
    x, w = np.polynomial.legendre.leggauss(NODES)
    half, middle = np.diff(ends)[:, None] / 2, (ends[1:] + ends[:-1])[:, None] / 2
    return (middle + half * x).ravel(), (half * w).ravel()


def spectrum_panels(z: Complex, spectrum: Spectrum) -> tuple[Array, Array]:
    """Nodes and weights (n,) times the density there."""
    pieces = [panels(z, float(a), float(b)) for a, b in zip(spectrum.start, spectrum.stop, strict=True)]
    f, w = (np.concatenate(own) for own in zip(*pieces, strict=True))
    return f, w * spectrum.at(f)


def _by_panels(form: PoleForm, spectrum: Spectrum, found: MeanSquares, hz: Array, outputs: Any) -> MeanSquares:
    """The same by Gauss's rule for outputs of which closed forms lose digits, as where poles all but coincide."""
    f, w = spectrum_panels(form.z, spectrum)
    order = np.argsort(f)
    f, w = f[order], w[order]
    inverse = 1 / (f[:, None] - form.z)
    for k in outputs:
        shares, running = np.zeros(len(form.names)), np.zeros(len(f))
        for q in range(form.loads.shape[1]):
            H = inverse @ (form.parts[:, k, :] * form.loads[:, q]).T + form.direct[:, k, q]
            shares += w @ (H * H.sum(axis=1, keepdims=True).conj()).real
            running += w * np.abs(H.sum(axis=1)) ** 2
        found.parts[:, k], found.total[k], found.lost[k] = shares, shares.sum(), np.finfo(float).eps
        found.up_to[:, k] = np.interp(hz, f, running.cumsum(), left=0.0)
    return found


def pole_form(modes: ModalSystem, kept: int | None = None) -> PoleForm:
    """A system of viscously damped modes as a sum over poles, each of the `kept` modes a part, with residual modes and
    static gain together as one (theory eq. B1)."""
    r, order = modes.order, modes.derivative
    kept = r if kept is None else kept
    if modes.is_proportional:
        poles, E, L = _real_modes(modes)
    else:
        own = modes.complex_modes
        poles, E, L = own.poles, own.right[:r], own.left
    scale = poles ** order[:, None] / (2j * np.pi)
    parts: Complex = np.asarray(modes.C.T[:, :, None] * (E[:, None, :] * scale), dtype=complex)
    direct = np.where((order == 2)[:, None], modes.C.T[:, :, None] * modes.B[:, None, :], 0.0)
    rest = np.where((order == 0)[:, None], modes.residual, 0.0)
    names = (*(f"mode {k + 1}, {in_hz(modes.frequency_hz[k])}" for k in range(kept)), LEFT_OUT, DIRECT)
    nothing = np.zeros((1, *parts.shape[1:]))
    return PoleForm(
        poles / (2j * np.pi),
        np.concatenate([parts[:kept], parts[kept:].sum(axis=0, keepdims=True), nothing]).astype(complex),
        np.asarray(L @ modes.B, dtype=complex),
        np.concatenate([direct[:kept], direct[kept:].sum(axis=0, keepdims=True), modes.D[None]]),
        rest,
        names,
    )


def _real_modes(modes: ModalSystem) -> tuple[Complex, Complex, Complex]:
    """Poles (2r,), what modes (r, 2r) do at them, and what forces on modes drive them (2r, r)."""
    half = modes.damping.diagonal() / 2
    root: Complex = np.sqrt(half**2 - modes.omega**2 + 0j)
    least = NEARLY_CRITICAL * np.where(modes.omega > 0, modes.omega, 1.0)
    root = np.asarray(np.where(np.abs(root) < least, 1j * least, root), dtype=complex)
    poles: Complex = np.stack([root - half, -root - half], axis=1).ravel()
    twice, r = np.repeat(np.eye(modes.order), 2, axis=1), modes.order
    signs = np.stack([0.5 / root, -0.5 / root], axis=1).ravel()
    left: Complex = twice.T.astype(complex)
    return poles, np.asarray(twice * signs, dtype=complex).reshape(r, 2 * r), left
