"""Responses as sums over poles, in parts that add up, and exact mean squares under densities that are powers of f.

At real f the conjugate of H(f) is a function with the conjugate poles, so that |H|^2 is a sum over single poles, whose
residues follow from the values of that function at the poles of H (theory eq. T33): every integral over a band is one
of 1/(f - z) times powers of f, in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.errors import SolverError
from flexura.modal import close_groups
from flexura.records import Record
from flexura.systems.modal import ModalSystem
from flexura.systems.spectra import Spectrum, plain_primitives, points_of, primitives
from flexura.tables import in_hz

DIRECT = "direct"
"""What goes from inputs to outputs without a mode."""

LEFT_OUT = "modes left out"
"""What modes beyond those that are kept do, by residual modes and static gain."""

NEARLY_CRITICAL = 1e-4
"""Least distance of the two poles of a mode, over twice its frequency: closer ones are moved that far apart."""

REPEATED = 1e-6
"""Relative gap of frequencies up to which modes are one part: their shares depend on which of them are chosen."""

UNDAMPED = 1e-13
"""Damping ratio below which nothing damps a pole."""

SILENT = 1e-13
"""Size of a residue, beside the largest one, that is none."""

PROPER = 1e-12
"""Direct gain, beside the largest response, that is round-off."""

LOST = 1e-7
"""Round-off of a mean square, relative, from which it is integrated by panels instead."""

CACHED = 256
"""Frequencies that are worked out at a time."""

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
    T32-T35). Raises SolverError where nothing damps what moves."""
    points = points_of(spectra, hz)
    points = points[np.isfinite(points)]
    read, found = np.searchsorted(points, hz), dict[int, MeanSquares]()
    sums = [_Sums.of(form.damped(), spectrum) for form, spectrum in zip(forms, spectra, strict=True)]
    alike: dict[bytes, list[int]] = {}
    for k, own in enumerate(sums):
        alike.setdefault(own.form.z.tobytes(), []).append(k)
    for group in alike.values():
        of = [sums[k] for k in group]
        for k, own, (up_to, density) in zip(group, of, _curves(of, points), strict=True):
            squares = MeanSquares(own.parts.sum(axis=0), own.parts, up_to[read], density[read], own.lost)
            bad = np.flatnonzero(own.lost > LOST)
            found[k] = _by_panels(own.form, own.spectrum, squares, hz, bad) if len(bad) else squares
    return [found[k] for k in range(len(sums))]


class _Sums(NamedTuple):
    """Mean squares as sums over poles: what integrals of S/(f - z) are multiplied by, `weights` (K, p), what that of S
    is, `direct` (p,), the shares of the whole `parts` (g, p), and the round-off `lost` (p,)."""

    form: PoleForm
    spectrum: Spectrum
    weights: Complex
    direct: Array
    parts: Array
    lost: Array

    @classmethod
    def of(cls, form: PoleForm, spectrum: Spectrum) -> _Sums:
        """Those of a form under a spectrum."""
        K, p, g = len(form.z), form.parts.shape[1], len(form.names)
        A, plain = _whole(form.z, spectrum)
        found = cls(form, spectrum, np.zeros((K, p), dtype=complex), np.zeros(p), np.zeros((g, p)), np.zeros(p))
        for k in range(p):
            weights, direct, size = _weights(form, k)
            found.parts[:, k] = (weights @ A).real
            found.parts[direct != 0, k] += direct[direct != 0] * plain
            noise = float(size @ np.abs(A)) + (np.abs(direct).sum() * plain if direct.any() else 0.0)
            total = float(found.parts[:, k].sum())
            found.lost[k] = np.finfo(float).eps * noise / total if 0 < total < np.inf else 0.0
            found.weights[:, k], found.direct[k] = weights.sum(axis=0), direct.sum()
        return found


def _curves(of: Sequence[_Sums], points: Array) -> list[tuple[Array, Array]]:
    """What frequencies up to each of finite points (j,) contribute (j, p), and the density there (j, p), of sums over
    the same poles; a few frequencies at a time, whose arrays stay in the processor's cache."""
    z, powers = of[0].form.z, {n for own in of for n in own.spectrum.terms}
    weights, direct = np.hstack([own.weights for own in of]), np.concatenate([own.direct for own in of])
    residues = [own.form.parts.sum(axis=0).T[:, :, None] * own.form.loads[:, None, :] for own in of]
    every, through = np.hstack([r.reshape(len(z), -1) for r in residues]), [own.form.direct.sum(axis=0) for own in of]
    ends, columns = (np.cumsum([0, *sizes]) for sizes in ([len(own.direct) for own in of], [d.size for d in through]))
    running = {n: np.empty((len(points), len(direct))) for n in powers}
    H = np.empty((len(points), every.shape[1]), dtype=complex)
    for start in range(0, len(points), CACHED):
        chunk = slice(start, start + CACHED)
        for n, (x, y) in primitives(z, points[chunk], powers).items():
            own = x @ weights.real - y @ weights.imag
            running[n][chunk] = own + np.multiply.outer(plain_primitives(points[chunk], n), direct)
        H[chunk] = (1 / (points[chunk, None] - z)) @ every
    found = []
    for k, own in enumerate(of):
        total, p = np.zeros((len(points), len(own.direct))), slice(ends[k], ends[k + 1])
        for n, c in own.spectrum.coefficients(points).items():
            at = np.flatnonzero(c)
            total[at + 1] += c[at, None] * (running[n][at + 1, p] - running[n][at, p])
        response = H[:, columns[k] : columns[k + 1]].reshape(len(points), *through[k].shape) + through[k]
        density = (response.real**2 + response.imag**2).sum(axis=2) * own.spectrum.at(points)[:, None]
        found.append((np.maximum(total.cumsum(axis=0), 0.0), density))
    return found


def _whole(z: Complex, spectrum: Spectrum) -> tuple[Complex, float]:
    """Integrals of S/(f - z) (K,) and of S, over all frequencies."""
    points = points_of([spectrum], np.empty(0))
    A, plain = np.zeros(len(z), dtype=complex), 0.0
    integrals = primitives(z, points, spectrum.terms)
    for n, c in spectrum.coefficients(points).items():
        at = np.flatnonzero(c)
        A += c[at] @ np.asarray([1, 1j] @ np.stack([x[at + 1] - x[at] for x in integrals[n]], axis=1))
        own = plain_primitives(points, n)
        plain += float(c[at] @ (own[at + 1] - own[at]))
    return A, plain


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
    static gain together as one (theory eq. T31)."""
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
    group, names = parts_of_modes(modes.frequency_hz[:kept])
    own = np.concatenate([group, np.full(r - kept, len(names) - 2)])
    return PoleForm(
        poles / (2j * np.pi),
        _summed(parts, own, len(names)).astype(complex),
        np.asarray(L @ modes.B, dtype=complex),
        _summed(direct, own, len(names)) + _summed(modes.D[None], np.array([len(names) - 1]), len(names)),
        rest,
        names,
    )


def parts_of_modes(frequency_hz: Array) -> tuple[Index, tuple[str, ...]]:
    """The part that each mode is of, modes that coincide together, and names of these parts, of what modes left out do
    and of what goes directly."""
    groups = close_groups(frequency_hz, REPEATED)
    part, names = np.empty(len(frequency_hz), dtype=np.intp), list[str]()
    for k, members in enumerate(groups):
        part[members] = k
        first, last = members[0] + 1, members[-1] + 1
        numbers = f"mode {first}" if first == last else f"modes {first} {'and' if last - first == 1 else 'to'} {last}"
        names.append(f"{numbers}, {in_hz(frequency_hz[members[0]])}")
    return part, (*names, LEFT_OUT, DIRECT)


def _summed(of: Any, part: Index, count: int) -> Any:
    """What is of each mode (r, ...) summed over the modes of each part (count, ...)."""
    found = np.zeros((count, *of.shape[1:]), dtype=of.dtype)
    np.add.at(found, part, of)
    return found


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
