"""Uniform beams at one frequency, exactly: dynamic stiffness, transfer matrices and waves.

No displacement field is assumed: the equations of motion of the Euler-Bernoulli, Rayleigh or Timoshenko beam are solved
as they are (Kolousek 1941; theory eqs. D1-D8). A beam's motion is split into the rigid motion r of its first end and
the displacement d of its second end relative to that. Everything that belongs to r is then inertia, of the order of the
squared frequency, and is summed as such: short stiff beams keep their digits, which the usual 12 x 12 matrix over both
ends does not.

Motions are written as twists at one pole, so that beams join without transformations: [t, e] are the twist of the first
end and that of the second end less it.

For evaluation at many frequencies `BeamSeries` holds K as a power series of the squared frequency. It converges up to
the first eigenvalue that a beam has with both ends held; pieces short enough that this is far away need few terms, and
are joined to whole beams (theory eqs. D4, D6-D7).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flexura.beam.element import UniformBeam
from flexura.beam.frames import arm_along_x
from flexura.linalg import scaled, unit_scale

Array: TypeAlias = NDArray[Any]
"""Real or complex."""

PIECE_RADIANS = 0.5
"""Largest number of radians of any wave on a piece whose matrices are summed as power series at one frequency. No such
piece has an eigenvalue of its own with both ends held: the first lies beyond pi."""

PIECE_TERMS = 20
"""Terms of these series, which for PIECE_RADIANS end below round-off."""

SERIES_RADIANS = 1.0
"""Largest number of radians of any wave on a piece of a `BeamSeries`; its own first eigenvalue lies beyond pi."""

SERIES_TERMS = 26
"""Terms of the series of the exponential function in a `BeamSeries`."""

SERIES_DEGREE = 17
"""Degree of the series of K in a `BeamSeries`."""

SignedDofs: TypeAlias = tuple[tuple[int, float], ...]
"""Freedoms of a motion in one dimension, with their signs."""

AXIAL: SignedDofs = ((0, 1.0),)
TORSION: SignedDofs = ((3, 1.0),)
BENDING_XY: SignedDofs = ((1, 1.0), (5, 1.0))
BENDING_XZ: SignedDofs = ((2, 1.0), (4, -1.0))


class DynamicBeam(NamedTuple):
    """Matrices over [t, e] at one squared angular frequency lam: K, its derivative by lam (both (..., 12, 12)), and the
    number J0 (...) of eigenvalues below lam with both ends held."""

    K: Array
    slope: Array
    J0: NDArray[np.intp]


class Joint(NamedTuple):
    """Two beams a and b in series: the joined beam, and P (..., 6, 12): e_a = P [t, e]."""

    beam: DynamicBeam
    P: Array


def join(a: DynamicBeam, b: DynamicBeam, count: bool = True) -> Joint:
    """Join beams end to end, all twists at one pole, and eliminate the node between them (theory eqs. D6-D8).

    The eigenvalues of the pair with both ends held are counted by Wittrick and Williams (1971) unless `count` says that
    there are none. Broadcasts over leading axes. Raises numpy.linalg.LinAlgError at an eigenvalue of the pair with both
    ends held.
    """
    A, B = a.K, b.K
    Brr, Brd, Bdr, Bdd = B[..., :6, :6], B[..., :6, 6:], B[..., 6:, :6], B[..., 6:, 6:]
    H = A[..., 6:, 6:] + Brr - Brd - Bdr + Bdd
    g = np.concatenate([A[..., 6:, :6] + Brr - Bdr, Brd - Bdd], axis=-1)
    d = unit_scale(H)
    scaled_H = scaled(H, d)
    P = -d[..., :, None] * np.linalg.solve(scaled_H, d[..., :, None] * g)
    Ea, Eb = np.zeros((2, *P.shape[:-2], 12, 12), dtype=P.dtype)
    Ea[..., :6, :6] = Eb[..., :6, :6] = np.eye(6)
    Eb[..., 6:, 6:] = np.eye(6)
    Ea[..., 6:, :] = P
    Eb[..., :6, :] += P
    Eb[..., 6:, :] -= P
    Eat, Ebt = np.swapaxes(Ea, -1, -2), np.swapaxes(Eb, -1, -2)
    K, slope = (_symmetric(Eat @ x @ Ea + Ebt @ y @ Eb) for x, y in ((A, B), (a.slope, b.slope)))
    J0 = a.J0 + b.J0
    if count and not np.iscomplexobj(H):
        J0 = J0 + (np.linalg.eigvalsh((scaled_H + np.swapaxes(scaled_H, -1, -2)) / 2) < 0).sum(axis=-1)
    return Joint(DynamicBeam(K, slope, J0), P)


def rooted(beam: DynamicBeam, root: NDArray[np.intp], roots: Array, length: Array) -> DynamicBeam:
    """Beams (n, ...) of lengths (n,), m, twists at their first end, with the springs of flexibility roots (k, 6, 6)
    between their ends and what they are joined to; root (n, 2): which one at each end, -1 for none."""
    K, slope, J0 = (field.copy() for field in beam)
    for end in (0, 1):
        at = np.flatnonzero(root[:, end] >= 0)
        if not len(at):
            continue
        spring = root_spring(roots[root[at, end]], end * length[at])
        piece = DynamicBeam(K[at], slope[at], J0[at])
        spring = DynamicBeam(
            *(
                np.broadcast_to(f.reshape(len(at), *(1,) * (J0.ndim - 1), *f.shape[1:]), to.shape)
                for f, to in zip(spring, piece, strict=True)
            )
        )
        K[at], slope[at], J0[at] = join(piece, spring).beam if end else join(spring, piece).beam
    return DynamicBeam(K, slope, J0)


def root_spring(C: Array, at: Array) -> DynamicBeam:
    """Springs without mass of flexibility C (n, 6, 6), at (n,) m along x from the pole of the twists."""
    K = np.zeros((len(C), 12, 12))
    K[:, 6:, 6:] = np.linalg.inv(C)
    return at_pole(DynamicBeam(K, np.zeros_like(K), np.zeros(len(C), dtype=np.intp)), arm_along_x(at))


def turned(beam: DynamicBeam) -> DynamicBeam:
    """The beam walked from its second end to its first: t of the other end, and e reversed."""
    S = np.eye(12)
    S[:6, 6:], S[6:, 6:] = np.eye(6), -np.eye(6)
    return DynamicBeam(S.T @ beam.K @ S, S.T @ beam.slope @ S, beam.J0)


def at_pole(beam: DynamicBeam, X: Array) -> DynamicBeam:
    """The beam with twists at another pole: X (..., 6, 6) takes them to twists at the present one."""
    T = np.zeros((*X.shape[:-2], 12, 12))
    T[..., :6, :6] = T[..., 6:, 6:] = X
    Tt = np.swapaxes(T, -1, -2)
    return DynamicBeam(Tt @ beam.K @ T, Tt @ beam.slope @ T, beam.J0)


class _Motion(NamedTuple):
    """A motion of beams in one dimension, y' = (A0 + lam A1) y on [0, 1] (theory eq. D1): displacements at `dofs`, then
    the forces that belong to them, in the units `displacement` and `force` (..., n)."""

    dofs: SignedDofs
    A0: Array
    A1: Array
    displacement: Array
    force: Array


def _bars(beam: UniformBeam) -> tuple[tuple[SignedDofs, Array, Array], ...]:
    """Axial motion and torsion: freedoms, stiffness and inertia."""
    return (AXIAL, beam.EA, beam.mass), (TORSION, beam.GJ, beam.polar)


def _planes(beam: UniformBeam) -> tuple[tuple[SignedDofs, Array, Array, Array], ...]:
    """Bending: freedoms, stiffness, shear flexibility and rotary inertia."""
    return (BENDING_XY, beam.EIz, beam.shear_y, beam.rotary_z), (BENDING_XZ, beam.EIy, beam.shear_z, beam.rotary_y)


def _motions(beam: UniformBeam) -> Iterator[_Motion]:
    """The four motions that make up that of a beam.

    Bars: u' = N/S, N' = -lam m u. Bending: v' = theta + shear V, theta' = M/EI, V' = -lam m v, M' = -V - lam r theta.
    Lengths are in units of L, forces of S/L and EI/L^2.
    """
    shape, L = np.broadcast(*beam).shape, beam.length
    for dofs, stiff, inertia in _bars(beam):
        A0, A1 = np.zeros((2, *shape, 2, 2))
        A0[..., 0, 1] = 1.0
        A1[..., 1, 0] = -inertia * L**2 / stiff
        yield _Motion(dofs, A0, A1, np.ones((*shape, 1)), np.broadcast_to(stiff / L, shape)[..., None])
    for dofs, EI, shear, rotary in _planes(beam):
        A0, A1 = np.zeros((2, *shape, 4, 4))
        A0[..., 0, 1] = A0[..., 1, 3] = 1.0
        A0[..., 0, 2] = shear * EI / L**2
        A0[..., 3, 2] = -1.0
        A1[..., 2, 0] = -beam.mass * L**4 / EI
        A1[..., 3, 1] = -rotary * L**2 / EI
        displacement = np.stack(np.broadcast_arrays(L, np.ones(shape)), axis=-1)
        yield _Motion(dofs, A0, A1, displacement, np.stack(np.broadcast_arrays(EI / L**2, EI / L), axis=-1))


def dynamic_beam(beam: UniformBeam, lam: float | complex) -> DynamicBeam:
    """The matrices of uniform beams (...) in their own axes, twists at their first end (theory eqs. D1-D5).

    lam: squared angular frequency, rad^2/s^2, real or complex (J0 is then of no meaning). The beams are halved until
    power series are exact, and joined again.
    """
    halvings = _halvings(beam, abs(lam))
    piece = _piece(beam.cut(2**halvings), lam)
    length = np.asarray(beam.length) / 2**halvings
    for _ in range(halvings):
        piece = join(piece, at_pole(piece, arm_along_x(length))).beam
        length = 2 * length
    return piece


def radians(beam: UniformBeam, lam: float) -> NDArray[np.float64]:
    """Upper estimate (...) of the number of radians of the shortest wave along each beam."""
    L2 = beam.length**2
    squares = [beam.mass / beam.EA, beam.polar / beam.GJ]
    for _, EI, shear, rotary in _planes(beam):
        squares += [np.sqrt(beam.mass / (EI * max(lam, 1e-300))) + beam.mass * shear + rotary / EI]
    return np.sqrt(lam * L2 * np.max(np.broadcast_arrays(*squares), axis=0))


def _halvings(beam: UniformBeam, lam: float) -> int:
    if not lam or not np.size(beam.length):
        return 0
    return max(0, int(np.ceil(np.log2(np.max(radians(beam, lam)) / PIECE_RADIANS))))


def _piece(beam: UniformBeam, lam: float | complex) -> DynamicBeam:
    """Power series of short beams (theory eqs. D2-D5)."""
    shape = np.broadcast(*beam).shape
    K, slope = np.zeros((2, *shape, 12, 12), dtype=complex if np.iscomplexobj(np.asarray(lam)) else float)
    for motion in _motions(beam):
        for whole, part in zip((K, slope), _condensed(motion, lam), strict=True):
            _place(whole, motion.dofs, part)
    K, slope = (_to_second_end(A, beam.length) for A in (K, slope))
    return DynamicBeam(K, slope, np.zeros(shape, dtype=np.intp))


def _place(whole: Array, dofs: SignedDofs, part: Array) -> None:
    """Put a matrix over the two vectors of a motion where its freedoms are in that of the beam."""
    at = np.array([*(k for k, _ in dofs), *(6 + k for k, _ in dofs)])
    sign = np.array([s for _, s in dofs] * 2)
    whole[..., at[:, None], at] = part * sign[:, None] * sign


def _to_second_end(K: Array, length: Array) -> Array:
    """Symmetric matrices (..., 12, 12) over (r, d) as those over [t, e]: d is e seen from the second end."""
    D = arm_along_x(length)
    T = np.zeros((*D.shape[:-2], 12, 12))
    T[..., :6, :6] = np.eye(6)
    T[..., 6:, 6:] = D
    return _symmetric(np.swapaxes(T, -1, -2) @ K @ T)


def _condensed(motion: _Motion, lam: float | complex) -> tuple[Array, Array]:
    """Matrices over (r, d) and their slopes of one motion."""
    n = len(motion.dofs)
    static, change, slope = _exponential(motion.A0, motion.A1, lam)
    u, q = slice(None, n), slice(n, None)
    R = np.swapaxes(static[..., u, u], -1, -2)
    phi = static + change
    F = np.linalg.inv(phi[..., u, q])
    a, b, c = R @ change[..., q, u], R @ change[..., q, q], change[..., u, u]
    da, db, dc = R @ slope[..., q, u], R @ slope[..., q, q], slope[..., u, u]
    dF = -F @ slope[..., u, q] @ F
    K = _blocks(a - b @ F @ c, b @ F, phi[..., q, q] @ F)
    dK = _blocks(da - db @ F @ c - b @ dF @ c - b @ F @ dc, db @ F + b @ dF, slope[..., q, q] @ F + phi[..., q, q] @ dF)
    scale = _units(motion)
    return _symmetric(K) * scale, _symmetric(dK) * scale


def _units(motion: _Motion) -> Array:
    """Units (..., 2n, 2n) of stiffness over (r, d)."""
    unit = np.concatenate([1 / motion.displacement] * 2, axis=-1)
    return motion.force[..., -1, None, None] * unit[..., :, None] * unit[..., None, :]


def _exponential(A0: Array, A1: Array, lam: float | complex) -> tuple[Array, Array, Array]:
    """exp(A0), exp(A0 + lam A1) less that, and the derivative of the latter by lam, summed without cancellation."""
    A = A0 + lam * A1
    static_term, term = (np.broadcast_to(np.eye(A.shape[-1]), A.shape).astype(A.dtype) for _ in range(2))
    more, rate = np.zeros_like(A), np.zeros_like(A)
    static, change, slope = static_term.copy(), np.zeros_like(A), np.zeros_like(A)
    for k in range(1, PIECE_TERMS):
        more = (A @ more + lam * (A1 @ static_term)) / k
        rate = (A @ rate + A1 @ term) / k
        static_term, term = A0 @ static_term / k, A @ term / k
        static, change, slope = static + static_term, change + more, slope + rate
    return static, change, slope


def _blocks(rr: Array, rd: Array, dd: Array) -> Array:
    n = rr.shape[-1]
    out = np.empty((*rr.shape[:-2], 2 * n, 2 * n), dtype=rr.dtype)
    out[..., :n, :n], out[..., :n, n:], out[..., n:, n:] = rr, rd, dd
    out[..., n:, :n] = np.swapaxes(rd, -1, -2)
    return out


def _symmetric(A: Array) -> Array:
    return (A + np.swapaxes(A, -1, -2)) / 2


class BeamSeries:
    """Matrices over [t, e] of uniform beams (k,) at any real or complex lam with |lam| <= `limit`, rad^2/s^2."""

    def __init__(self, beam: UniformBeam, limit: float) -> None:
        self.limit = limit
        waves = radians(beam, limit) / SERIES_RADIANS
        self.halvings: NDArray[np.intp] = np.ceil(np.log2(np.maximum(waves, 1.0))).astype(np.intp)
        pieces = 2.0**self.halvings
        self._length = beam.length / pieces
        self._coefficients = _series(beam._replace(length=self._length), limit)

    def __call__(self, lam: Array, count: bool = True) -> DynamicBeam:
        """Matrices (k, l, 12, 12) at squared angular frequencies lam (l,); eigenvalues with both ends held are counted
        on demand only."""
        lam = np.asarray(lam)
        C = self._coefficients
        n, k = C.shape[:2]
        powers = (lam / self.limit)[:, None] ** np.arange(n)
        rates = np.arange(1, n) * powers[:, :-1] / self.limit
        flat = C.reshape(n, -1)
        K, slope = (
            np.swapaxes((p @ flat[n - p.shape[1] :]).reshape(len(lam), k, 12, 12), 0, 1) for p in (powers, rates)
        )
        beam = DynamicBeam(K, slope, np.zeros((k, len(lam)), dtype=np.intp))
        for step in range(int(self.halvings.max(initial=0))):
            at = np.flatnonzero(self.halvings > step)
            piece = DynamicBeam(*(field[at] for field in beam))
            arm = arm_along_x(self._length[at, None] * 2**step)
            whole = join(piece, at_pole(piece, arm), count).beam
            if len(at) == k:
                beam = whole
                continue
            for field, longer in zip(beam, whole, strict=True):
                field[at] = longer
        return beam


def _series(beam: UniformBeam, limit: float) -> Array:
    """Coefficients (n, k, 12, 12) of K over [t, e] in powers of lam / limit (theory eq. D4), for beams (k,) of at most
    `SERIES_RADIANS` radians at the limit."""
    K = np.zeros((SERIES_DEGREE + 1, len(beam.length), 12, 12))
    for motion in _motions(beam):
        _place(K, motion.dofs, _condensed_series(motion, limit))
    return _to_second_end(K, beam.length)


def _exponential_series(A0: Array, A1: Array) -> Array:
    """Coefficients (n, k, m, m) of exp(A0 + x A1) in powers of x."""
    term = np.zeros((SERIES_DEGREE + 1, *A0.shape))
    term[0] = np.eye(A0.shape[-1])
    total = term.copy()
    for k in range(1, SERIES_TERMS):
        more = A0 @ term
        more[1:] += A1 @ term[:-1]
        term = more / k
        total += term
    return total


def _condensed_series(motion: _Motion, limit: float) -> Array:
    """Series of K over (r, d) of one motion, from that of its transfer matrix."""
    phi = _exponential_series(motion.A0, limit * motion.A1)
    n = len(motion.dofs)
    u, q = slice(None, n), slice(n, None)
    R = np.swapaxes(phi[0][..., u, u], -1, -2)
    first = np.linalg.inv(phi[0][..., u, q])
    F = np.zeros_like(phi[..., u, q])
    F[0] = first
    for k in range(1, len(F)):
        F[k] = -first @ (phi[1 : k + 1, ..., u, q] @ F[k - 1 :: -1]).sum(axis=0)
    dynamic = phi.copy()
    dynamic[0][..., q, u] = dynamic[0][..., u, u] = 0.0
    change = phi[..., q, q].copy()
    change[0] = 0.0
    bF = _series_product(R @ change, F)
    K = np.zeros((len(phi), *phi.shape[1:]))
    K[..., u, u] = R @ dynamic[..., q, u] - _series_product(bF, dynamic[..., u, u])
    K[..., u, q] = bF
    K[..., q, u] = np.swapaxes(bF, -1, -2)
    K[..., q, q] = _series_product(phi[..., q, q], F)
    return K * _units(motion)


def _series_product(a: Array, b: Array) -> Array:
    """Product of two series of matrices."""
    out = np.zeros((len(a), *a.shape[1:-1], b.shape[-1]))
    for k in range(len(a)):
        out[k] = (a[: k + 1] @ b[k::-1]).sum(axis=0)
    return out


def transfer_matrix(beam: UniformBeam, lam: float | complex) -> Array:
    """Transfer matrices (..., 12, 12) of uniform beams (Pestel and Leckie 1963; theory eq. W1).

    The state is the twist at the first end and the wrench that the part behind a section exerts on the part before it,
    both at the pole of the first end; the matrix leads from the first end to the second. Arguments as in
    `dynamic_beam`; pieces that are short enough for power series are multiplied.
    """
    halvings = _halvings(beam, abs(lam))
    piece = beam.cut(2**halvings)
    phi = np.zeros((*np.broadcast(*piece).shape, 12, 12), dtype=np.result_type(lam, float))
    for motion in _motions(piece):
        static, change, _ = _exponential(motion.A0, motion.A1, lam)
        unit = np.concatenate([motion.displacement, motion.force], axis=-1)
        _place(phi, motion.dofs, (static + change) * unit[..., :, None] / unit[..., None, :])
    length = np.asarray(piece.length)
    D = arm_along_x(length)
    phi = np.concatenate([arm_along_x(-length) @ phi[..., :6, :], np.swapaxes(D, -1, -2) @ phi[..., 6:, :]], axis=-2)
    for _ in range(halvings):
        phi = transfer_at_pole(phi, arm_along_x(length)) @ phi
        length = 2 * length
    return phi


def transfer_at_pole(phi: Array, X: Array) -> Array:
    """Transfer matrices with the state at another pole: X (..., 6, 6) takes twists there to the present ones."""
    Xt, inverse = np.swapaxes(X, -1, -2), np.linalg.inv(X)
    left = np.concatenate([inverse @ phi[..., :6, :], Xt @ phi[..., 6:, :]], axis=-2)
    return np.concatenate([left[..., :6] @ X, left[..., 6:] @ np.swapaxes(inverse, -1, -2)], axis=-1)


def transfer_rooted(phi: Array, root: NDArray[np.intp], roots: Array, length: Array) -> Array:
    """Transfer matrices (n, 12, 12) of beams with springs at their ends; other arguments as in `rooted`."""
    whole = phi.copy()
    for end in (0, 1):
        at = np.flatnonzero(root[:, end] >= 0)
        spring = np.broadcast_to(np.eye(12), (len(at), 12, 12)).copy()
        spring[:, :6, 6:] = roots[root[at, end]]
        spring = transfer_at_pole(spring, arm_along_x(end * length[at]))
        whole[at] = spring @ whole[at] if end else whole[at] @ spring
    return whole


def transfer_turned(phi: Array) -> Array:
    """Transfer matrices from the second end to the first: the wrench then acts the other way round."""
    sign = np.repeat([1.0, -1.0], 6)
    return np.linalg.inv(phi) * sign[:, None] * sign


class Waves(NamedTuple):
    """Six waves that travel or decay along +x: wavenumbers k (..., 6), exp(-i k x), and for unit amplitudes the
    displacements u and internal forces q (..., 6, 6) of a section, in local axes; columns are waves."""

    k: Array
    u: Array
    q: Array


def waves(beam: UniformBeam, lam: complex) -> Waves:
    """Axial, torsional and two pairs of bending waves of uniform beams (...) (theory eqs. W7-W9; Graff 1975).

    lam: squared angular frequency, rad^2/s^2, not zero. The second wave of a bending plane decays below the cut-off
    frequency of the Timoshenko beam; the branch of its wavenumber is continuous there only on one side.
    """
    shape = np.broadcast(*beam).shape
    k, u, q = np.zeros((*shape, 6), complex), np.zeros((*shape, 6, 6), complex), np.zeros((*shape, 6, 6), complex)
    for ((dof, _),), stiff, inertia in _bars(beam):
        wavenumber = np.sqrt(lam * inertia / stiff + 0j)
        k[..., dof], u[..., dof, dof], q[..., dof, dof] = wavenumber, 1.0, -1j * wavenumber * stiff
    for ((v, _), (turn, sign)), EI, shear, rotary in _planes(beam):
        b = lam * (rotary + EI * shear * beam.mass)
        root = np.sqrt(b * b + 4 * EI * lam * beam.mass * (1 - lam * rotary * shear) + 0j)
        pair = (np.sqrt((b + root) / (2 * EI)), -1j * np.sqrt((root - b) / (2 * EI)))
        for column, wavenumber in zip((v, turn), pair, strict=True):
            V = -1j * lam * beam.mass / wavenumber
            theta = -1j * wavenumber - shear * V
            k[..., column] = wavenumber
            u[..., v, column], u[..., turn, column] = 1.0, sign * theta
            q[..., v, column], q[..., turn, column] = V, sign * -1j * wavenumber * EI * theta
    return Waves(k, u, q)


def reversed_waves(forward: Waves) -> Waves:
    """The same waves along -x, exp(+i k x): mirror images of those along +x."""
    mirror = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    return Waves(forward.k, forward.u * mirror[:, None], -forward.q * mirror[:, None])
