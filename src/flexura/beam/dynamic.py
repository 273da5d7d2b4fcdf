"""The exact dynamic stiffness of uniform beams at one frequency (Kolousek 1941; theory eqs. D1-D8).

No displacement field is assumed: the equations of motion of the Euler-Bernoulli, Rayleigh or Timoshenko beam are solved
as they are. A beam's motion is split into the rigid motion r of its first end and the displacement d of its second end
relative to that. Everything that belongs to r is then inertia, of the order of the squared frequency, and is summed as
such: short stiff beams keep their digits, which the usual 12 x 12 matrix over both ends does not.

Motions are written as twists at one pole, so that beams join without transformations: [t, e] are the twist of the first
end and that of the second end less it.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flexura.beam.frames import rigid_arm
from flexura.beam.uniform import UniformBeam
from flexura.linalg import scaled, unit_scale

Array: TypeAlias = NDArray[Any]
"""Real or complex."""

TERMS = 20
"""Terms of the power series, which for SMALL end below round-off."""

SMALL = 0.5
"""Largest number of radians of any wave on a piece whose matrices are summed as power series. No such piece has an
eigenvalue of its own with both ends held: the first lies beyond pi."""

AXIAL, TORSION = ((0, 1.0),), ((3, 1.0),)
BENDING_XY, BENDING_XZ = ((1, 1.0), (5, 1.0)), ((2, 1.0), (4, -1.0))


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
    own = scaled(H, d)
    P = -d[..., :, None] * np.linalg.solve(own, d[..., :, None] * g)
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
        J0 = J0 + (np.linalg.eigvalsh((own + np.swapaxes(own, -1, -2)) / 2) < 0).sum(axis=-1)
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
        own = DynamicBeam(K[at], slope[at], J0[at])
        spring = DynamicBeam(
            *(
                np.broadcast_to(f.reshape(len(at), *(1,) * (J0.ndim - 1), *f.shape[1:]), to.shape)
                for f, to in zip(spring, own, strict=True)
            )
        )
        K[at], slope[at], J0[at] = join(own, spring).beam if end else join(spring, own).beam
    return DynamicBeam(K, slope, J0)


def root_spring(C: Array, at: Array) -> DynamicBeam:
    """Springs without mass of flexibility C (n, 6, 6), at (n,) m along x from the pole of the twists."""
    K = np.zeros((len(C), 12, 12))
    K[:, 6:, 6:] = np.linalg.inv(C)
    arm = np.zeros((len(C), 3))
    arm[:, 0] = at
    return at_pole(DynamicBeam(K, np.zeros_like(K), np.zeros(len(C), dtype=np.intp)), rigid_arm(arm))


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


def dynamic_beam(beam: UniformBeam, lam: float | complex) -> DynamicBeam:
    """The matrices of uniform beams (...) in their own axes, twists at their first end (theory eqs. D1-D5).

    lam: squared angular frequency, rad^2/s^2, real or complex (J0 is then of no meaning). The beams are halved until
    power series are exact, and joined again.
    """
    halvings = _halvings(beam, abs(lam))
    piece = _piece(beam.cut(2**halvings), lam)
    length = np.asarray(beam.length) / 2**halvings
    for _ in range(halvings):
        arm = np.zeros((*length.shape, 3))
        arm[..., 0] = length
        piece = join(piece, at_pole(piece, rigid_arm(arm))).beam
        length = 2 * length
    return piece


def radians(beam: UniformBeam, lam: float) -> NDArray[np.float64]:
    """Upper estimate (...) of the number of radians of the shortest wave along each beam."""
    L2 = beam.length**2
    squares = [beam.mass / beam.EA, beam.polar / beam.GJ]
    for EI, shear, rotary in ((beam.EIz, beam.shear_y, beam.rotary_z), (beam.EIy, beam.shear_z, beam.rotary_y)):
        squares += [np.sqrt(beam.mass / (EI * max(lam, 1e-300))) + beam.mass * shear + rotary / EI]
    return np.sqrt(lam * L2 * np.max(np.broadcast_arrays(*squares), axis=0))


def _halvings(beam: UniformBeam, lam: float) -> int:
    if not lam or not np.size(beam.length):
        return 0
    return max(0, int(np.ceil(np.log2(np.max(radians(beam, lam)) / SMALL))))


def _piece(beam: UniformBeam, lam: float | complex) -> DynamicBeam:
    """Power series of short beams (theory eqs. D2-D5)."""
    shape = np.broadcast(*beam).shape
    K, slope = np.zeros((2, *shape, 12, 12), dtype=complex if np.iscomplexobj(np.asarray(lam)) else float)
    planes = (
        (BENDING_XY, beam.EIz, beam.shear_y, beam.rotary_z),
        (BENDING_XZ, beam.EIy, beam.shear_z, beam.rotary_y),
    )
    for dofs, EI, shear, rotary in planes:
        _place(K, slope, dofs, _bending(EI, shear, beam.mass, rotary, beam.length, lam))
    for dofs, stiff, inertia in ((AXIAL, beam.EA, beam.mass), (TORSION, beam.GJ, beam.polar)):
        _place(K, slope, dofs, _bar(stiff, inertia, beam.length, lam))
    arm = np.zeros((*shape, 3))
    arm[..., 0] = beam.length
    T = np.zeros((*shape, 12, 12))
    T[..., :6, :6] = np.eye(6)
    T[..., 6:, 6:] = rigid_arm(arm)
    Tt = np.swapaxes(T, -1, -2)
    return DynamicBeam(_symmetric(Tt @ K @ T), _symmetric(Tt @ slope @ T), np.zeros(shape, dtype=np.intp))


def _place(K: Array, slope: Array, dofs: tuple[tuple[int, float], ...], own: tuple[Array, Array]) -> None:
    """Add the matrices over (r, d) of some freedoms, with their signs."""
    at = [*(k for k, _ in dofs), *(6 + k for k, _ in dofs)]
    sign = np.array([s for _, s in dofs] * 2)
    for whole, part in zip((K, slope), own, strict=True):
        whole[..., np.array(at)[:, None], at] += part * sign[:, None] * sign


def _bar(stiff: Array, inertia: Array, length: Array, lam: float | complex) -> tuple[Array, Array]:
    """Axial or torsional motion."""
    A0, A1 = bar_system(stiff, inertia, length)
    return _condensed(A0, A1, lam, np.ones((*A0.shape[:-2], 1)), stiff / length)


def bar_system(stiff: Array, inertia: Array, length: Array) -> tuple[Array, Array]:
    """u' = N/S, N' = -lam m u as y' = (A0 + lam A1) y, lengths in units of L and forces of S/L."""
    A0, A1 = np.zeros((2, *np.broadcast(stiff, inertia, length).shape, 2, 2))
    A0[..., 0, 1] = 1.0
    A1[..., 1, 0] = -inertia * length**2 / stiff
    return A0, A1


def _bending(
    EI: Array, shear: Array, mass: Array, rotary: Array, length: Array, lam: float | complex
) -> tuple[Array, Array]:
    """One plane of bending."""
    A0, A1 = bending_system(EI, shear, mass, rotary, length)
    unit = np.ones((*A0.shape[:-2], 2))
    unit[..., 0] = 1 / length
    return _condensed(A0, A1, lam, unit, EI / length)


def bending_system(EI: Array, shear: Array, mass: Array, rotary: Array, length: Array) -> tuple[Array, Array]:
    """v' = theta + shear V, theta' = M/EI, V' = -lam m v, M' = -V - lam r theta as y' = (A0 + lam A1) y, lengths in
    units of L and forces of EI/L^2 (theory eq. D1)."""
    A0, A1 = np.zeros((2, *np.broadcast(EI, shear, mass, rotary, length).shape, 4, 4))
    A0[..., 0, 1] = A0[..., 1, 3] = 1.0
    A0[..., 0, 2] = shear * EI / length**2
    A0[..., 3, 2] = -1.0
    A1[..., 2, 0] = -mass * length**4 / EI
    A1[..., 3, 1] = -rotary * length**2 / EI
    return A0, A1


def _condensed(A0: Array, A1: Array, lam: float | complex, unit: Array, energy: Array) -> tuple[Array, Array]:
    """Matrices over (r, d) and their slopes from y' = (A0 + lam A1) y on [0, 1], y = displacements, then forces.

    `unit` (..., n) makes displacements dimensionless and `energy` (...) is the unit of K.
    """
    n = A0.shape[-1] // 2
    static, change, slope = _series(A0, A1, lam)
    u, q = slice(None, n), slice(n, None)
    R = np.swapaxes(static[..., u, u], -1, -2)
    phi = static + change
    F = np.linalg.inv(phi[..., u, q])
    a, b, c = R @ change[..., q, u], R @ change[..., q, q], change[..., u, u]
    da, db, dc = R @ slope[..., q, u], R @ slope[..., q, q], slope[..., u, u]
    dF = -F @ slope[..., u, q] @ F
    K = _blocks(a - b @ F @ c, b @ F, phi[..., q, q] @ F)
    dK = _blocks(da - db @ F @ c - b @ dF @ c - b @ F @ dc, db @ F + b @ dF, slope[..., q, q] @ F + phi[..., q, q] @ dF)
    units = np.concatenate([unit, unit], axis=-1)
    scale = energy[..., None, None] * units[..., :, None] * units[..., None, :]
    return _symmetric(K) * scale, _symmetric(dK) * scale


def _series(A0: Array, A1: Array, lam: float | complex) -> tuple[Array, Array, Array]:
    """exp(A0), exp(A0 + lam A1) less that, and the derivative of the latter by lam, summed without cancellation."""
    A = A0 + lam * A1
    own, whole = (np.broadcast_to(np.eye(A.shape[-1]), A.shape).astype(A.dtype) for _ in range(2))
    more, rate = np.zeros_like(A), np.zeros_like(A)
    static, change, slope = own.copy(), np.zeros_like(A), np.zeros_like(A)
    for k in range(1, TERMS):
        more = (A @ more + lam * (A1 @ own)) / k
        rate = (A @ rate + A1 @ whole) / k
        own, whole = A0 @ own / k, A @ whole / k
        static, change, slope = static + own, change + more, slope + rate
    return static, change, slope


def _blocks(rr: Array, rd: Array, dd: Array) -> Array:
    n = rr.shape[-1]
    out = np.empty((*rr.shape[:-2], 2 * n, 2 * n), dtype=rr.dtype)
    out[..., :n, :n], out[..., :n, n:], out[..., n:, n:] = rr, rd, dd
    out[..., n:, :n] = np.swapaxes(rd, -1, -2)
    return out


def _symmetric(A: Array) -> Array:
    return (A + np.swapaxes(A, -1, -2)) / 2


def transfer_matrix(beam: UniformBeam, lam: float | complex) -> Array:
    """Transfer matrices (..., 12, 12) of uniform beams (Pestel and Leckie 1963; theory eq. W1).

    The state is the twist at the first end and the wrench that the part behind a section exerts on the part before it,
    both at the pole of the first end; the matrix leads from the first end to the second. Arguments as in
    `dynamic_beam`; pieces that are short enough for power series are multiplied.
    """
    halvings = _halvings(beam, abs(lam))
    own = beam.cut(2**halvings)
    shape = np.broadcast(*own).shape
    L = own.length
    phi = np.zeros((*shape, 12, 12), dtype=np.result_type(lam, float))
    for dofs, EI, shear, rotary in (
        (BENDING_XY, own.EIz, own.shear_y, own.rotary_z),
        (BENDING_XZ, own.EIy, own.shear_z, own.rotary_y),
    ):
        A0, A1 = bending_system(EI, shear, own.mass, rotary, L)
        _place_transfer(phi, dofs, A0, A1, lam, np.stack([L, np.ones(shape), EI / L**2, EI / L], axis=-1))
    for dofs, stiff, inertia in ((AXIAL, own.EA, own.mass), (TORSION, own.GJ, own.polar)):
        A0, A1 = bar_system(stiff, inertia, L)
        _place_transfer(phi, dofs, A0, A1, lam, np.stack([np.ones(shape), stiff / L], axis=-1))
    arm = np.zeros((*shape, 3))
    arm[..., 0] = L
    D, back = rigid_arm(arm), rigid_arm(-arm)
    phi = np.concatenate([back @ phi[..., :6, :], np.swapaxes(D, -1, -2) @ phi[..., 6:, :]], axis=-2)
    for _ in range(halvings):
        phi = transfer_at_pole(phi, rigid_arm(arm)) @ phi
        arm = 2 * arm
    return phi


def transfer_at_pole(phi: Array, X: Array) -> Array:
    """Transfer matrices with the state at another pole: X (..., 6, 6) takes twists there to the present ones."""
    Xt, inverse = np.swapaxes(X, -1, -2), np.linalg.inv(X)
    left = np.concatenate([inverse @ phi[..., :6, :], Xt @ phi[..., 6:, :]], axis=-2)
    return np.concatenate([left[..., :6] @ X, left[..., 6:] @ np.swapaxes(inverse, -1, -2)], axis=-1)


def transfer_rooted(phi: Array, root: NDArray[np.intp], roots: Array, length: Array) -> Array:
    """Transfer matrices (n, 12, 12) of beams with springs at their ends; other arguments as in `rooted`."""
    found = phi.copy()
    for end in (0, 1):
        at = np.flatnonzero(root[:, end] >= 0)
        spring = np.broadcast_to(np.eye(12), (len(at), 12, 12)).copy()
        spring[:, :6, 6:] = roots[root[at, end]]
        arm = np.zeros((len(at), 3))
        arm[:, 0] = end * length[at]
        spring = transfer_at_pole(spring, rigid_arm(arm))
        found[at] = spring @ found[at] if end else found[at] @ spring
    return found


def transfer_turned(phi: Array) -> Array:
    """Transfer matrices from the second end to the first: the wrench then acts the other way round."""
    sign = np.repeat([1.0, -1.0], 6)
    return np.linalg.inv(phi) * sign[:, None] * sign


def _place_transfer(
    phi: Array, dofs: tuple[tuple[int, float], ...], A0: Array, A1: Array, lam: float | complex, unit: Array
) -> None:
    static, change, _ = _series(A0, A1, lam)
    own = (static + change) * unit[..., :, None] / unit[..., None, :]
    at = np.array([*(k for k, _ in dofs), *(6 + k for k, _ in dofs)])
    sign = np.array([s for _, s in dofs] * 2)
    phi[..., at[:, None], at] = own * sign[:, None] * sign
