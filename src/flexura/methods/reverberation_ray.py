"""The reverberation-ray matrix method: waves that leave and reach joints (Pao, Keh and Howard 1999).

Uniform members carry rays: six waves depart from each end, and arrive at the other changed by their phase. Junctions
with their bodies, springs and masses scatter them; so do stepped flexures, which enter as elastic joints with their
exact dynamic stiffness, and members so short against their waves that these are all but parallel. With departing
amplitudes d the arriving ones are P U d, what a joint makes of these is S P U d, and natural frequencies are where
det(I - S P U) is zero. The scattering S has poles of its own, at resonances of joints on members without end, so the
equations are solved before S is formed, with d and the junctions' displacements unknown (theory eqs. W10-W12).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.beam import DynamicBeam, UniformBeam, reversed_waves, rigid_arm, waves
from flexura.methods.chain_equations import ChainEquations
from flexura.methods.exact_chains import ExactChains, in_series
from flexura.methods.roots import natural_frequencies
from flexura.methods.solution import Solution
from flexura.reduction import full_order_modes
from flexura.structure import FullOrderModel

Array = NDArray[Any]

MEMBER = 7
"""At least so many equal pieces in line are a member that carries rays: more than one element of a stepped flexure."""

EQUAL = 1e-9
"""Relative difference of sections below which a run of segments is one uniform ray member."""

SHORT = 0.05
"""Least number of radians of every bending wave on a ray member, at the lowest frequency: below, the waves of a member
differ so little that more than four digits are lost."""

TO_RELATIVE = np.block([[np.eye(6), np.zeros((6, 6))], [-np.eye(6), np.eye(6)]])
"""From the twists of both ends to [t, e]."""


class ReverberationRays(ChainEquations):
    """Chains as runs of pieces: uniform ones carry rays, with the amplitudes that depart from either end as unknowns;
    stepped ones are joints with two free twists inside. Between runs there is a twist."""

    pieces = 6
    is_real = False

    def __init__(self, model: FullOrderModel, omega: float) -> None:
        self._omega = omega
        super().__init__(model)

    def extra(self, chains: ExactChains) -> int:
        """Twelve for every run, and six between runs."""
        return 18 * len(self.runs(chains)) - 6

    def runs(self, chains: ExactChains) -> list[tuple[int, int, bool]]:
        """Runs of pieces (first, end, whether a ray member)."""
        return _runs(chains, self._omega)

    def add_chains(
        self, local: Array, chains: ExactChains, first: Index, last: Index, own: Index, lam: complex
    ) -> None:
        """Rays of uniform runs, and joints of the others."""
        runs = self.runs(chains)
        pieces = chains.pieces(lam)
        eye, end = np.broadcast_to(np.eye(6), (len(own), 6, 6)), rigid_arm(-chains.arms[:, -1])
        at = 0
        left, to_left = first, eye
        for number, (a, b, is_ray) in enumerate(runs):
            inner, at = own[:, at : at + 12], at + 12
            right, to_right = (last, end) if number == len(runs) - 1 else (own[:, at : at + 6], eye)
            at += 6
            ends = (left, right), (to_left, to_right)
            if is_ray:
                _add_rays(local, chains, (a, b), ends, inner, lam)
            else:
                _add_joints(local, DynamicBeam(*(f[:, a:b] for f in pieces)), ends, inner)
            left, to_left = right, to_right

    def own_poles(self, chains: ExactChains, lam: float) -> int:
        """Frequencies at which a part of a stepped run with held ends vibrates."""
        pieces = chains.pieces(lam)
        stepped = (DynamicBeam(*(f[:, a:b] for f in pieces)) for a, b, is_ray in self.runs(chains) if not is_ray)
        return sum(int(own.J0.sum()) for run in stepped for own in _thirds(run))


RunEnds = tuple[tuple[Index, Index], tuple[Array, Array]]
"""DOFs (c, 6) of the two ends of a run, and what takes them to twists at the pole (c, 6, 6)."""


def _add_rays(
    local: Array, chains: ExactChains, span: tuple[int, int], ends: RunEnds, own: Index, lam: complex
) -> None:
    """Displacements of both ends by waves, and what these exert on the nodes (theory eqs. W10-W11)."""
    a, b = span
    back = chains.reverse[:, a]
    beam = UniformBeam(*(field[chains.kind[:, a]] for field in chains.beam))
    length = beam.length * (b - a)
    forward = waves(beam, lam)
    backward = reversed_waves(forward)
    phase = np.exp(-1j * forward.k * length[:, None])[:, None, :]
    # amplitudes that leave the start of the member, then those that leave its end
    u = [np.concatenate(x, -1) for x in ((forward.u, backward.u * phase), (forward.u * phase, backward.u))]
    q = [np.concatenate(x, -1) for x in ((forward.q, backward.q * phase), (forward.q * phase, backward.q))]
    along = np.zeros((len(own), 3))
    along[:, 0] = length
    # twists at the pole to displacements of the member's start and end in its axes
    X = np.where(back[:, None, None], chains.X[:, b - 1], chains.X[:, a])
    reach = (X, rigid_arm(along) @ X)
    for k in range(len(own)):
        for side, sign in ((0, -1.0), (1, 1.0)):
            place = 1 - side if back[k] else side
            dofs, rows = ends[0][place][k], own[k, 6 * side : 6 * side + 6]
            T = reach[side][k] @ ends[1][place][k]
            local[np.ix_(rows, dofs)] += T
            local[np.ix_(rows, own[k])] -= u[side][k]
            local[np.ix_(dofs, own[k])] += sign * T.T @ q[side][k]


def _add_joints(local: Array, pieces: DynamicBeam, ends: RunEnds, own: Index) -> None:
    """Three exact beams in series, with two free twists between them (theory eq. W12)."""
    thirds = _thirds(pieces)
    for k in range(len(own)):
        start, end = np.eye(12), np.eye(12)
        start[:6, :6], end[6:, 6:] = ends[1][0][k], ends[1][1][k]
        inner = (own[k, :6], own[k, 6:])
        spans = ((ends[0][0][k], inner[0], start), (*inner, np.eye(12)), (inner[1], ends[0][1][k], end))
        for beam, (a, b, to_twists) in zip(thirds, spans, strict=True):
            T = TO_RELATIVE @ to_twists
            dofs = np.concatenate([a, b])
            local[np.ix_(dofs, dofs)] += T.T @ beam.K[k] @ T


def _thirds(pieces: DynamicBeam) -> list[DynamicBeam]:
    """Pieces (c, s) in series, in three unequal runs (c,): modes with held ends have no nodes at such ends."""
    n = pieces.J0.shape[-1]
    cuts = (0, max(1, (2 * n) // 7), max(2, (5 * n) // 8), n)
    return [in_series(DynamicBeam(*(f[:, a:b] for f in pieces)))[0] for a, b in pairwise(cuts)]


def _runs(chains: ExactChains, omega: float) -> list[tuple[int, int, bool]]:
    """Runs of pieces (first, end, whether uniform) that all chains of a group have in common: a uniform run is made of
    equal pieces on one line, and stepped pieces that follow each other are one run."""
    turn = chains.X[..., :3, :3]
    place = np.swapaxes(turn, -1, -2) @ chains.X[..., :3, 3:]
    at = np.stack([place[..., 1, 2], place[..., 2, 0], place[..., 0, 1]], axis=-1)
    same = (np.abs(np.diff(turn, axis=1)).max(axis=(2, 3)) <= EQUAL) & (chains.reverse[:, 1:] == chains.reverse[:, :-1])
    same &= ~chains.is_rooted[:, 1:] & ~chains.is_rooted[:, :-1]
    length = chains.beam.length[chains.kind]
    for field in chains.beam:
        own = field[chains.kind]
        same &= np.abs(np.diff(own, axis=1)) <= EQUAL * np.abs(own[:, 1:])
    step = np.abs(
        np.diff(at, axis=1)
        - np.where(chains.reverse[:, 1:, None], -1, 1) * (turn[..., 0, :] * length[..., None])[:, 1:]
    )
    same &= step.max(axis=2) <= 1e-6 * length[:, 1:]
    breaks = [0, *(np.flatnonzero(~same.all(axis=0)) + 1).tolist(), chains.kind.shape[1]]
    runs: list[tuple[int, int, bool]] = []
    for a, b in pairwise(breaks):
        is_ray = b - a >= MEMBER and _shortest_waves(chains, a, b, omega) >= SHORT
        if runs and not is_ray and not runs[-1][2]:
            runs[-1] = (runs[-1][0], b, False)
        else:
            runs.append((a, b, is_ray))
    return runs


def _shortest_waves(chains: ExactChains, a: int, b: int, omega: float) -> float:
    """Least radians of a bending wave along a run of equal pieces of all chains, at omega."""
    beam = UniformBeam(*(field[chains.kind[:, a]] for field in chains.beam))
    k = (beam.mass * omega**2 / np.maximum(beam.EIy, beam.EIz)) ** 0.25
    return float((k * beam.length * (b - a)).min())


def reverberation_ray(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies by reverberation rays.

    Raises OptionError when nothing can move, SolverError when the contours do not separate the frequencies. Members
    shorter than SHORT against their waves are joints.
    """
    values = full_order_modes(model, min(7, model.order)).values
    elastic = values[values > 0]
    equations = ReverberationRays(model, float(np.sqrt(elastic[0])) if len(elastic) else 1.0)
    hz = natural_frequencies(equations.matrix, model, count, equations.poles, is_real=False)
    rays = sum(
        copies * len(chains.kind) * sum(is_ray for _, _, is_ray in equations.runs(chains))
        for part, copies in zip(equations.exact.parts.values(), equations.exact.copies, strict=True)
        for chains in part.chains
    )
    return Solution(
        "reverberation-ray", None, hz, note=f"{rays} ray members; stepped or very short ones are elastic joints"
    )
