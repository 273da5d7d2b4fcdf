"""Three methods that write one equation system for all chains and junctions of a mechanism, as checks of the others.

Transfer matrices, spectral elements and reverberation rays: each says which unknowns a serial chain of exact beams has
beside the displacements of its two junctions, and which equations it adds. Natural frequencies are where the matrix of
all equations is singular, found on contours in the complex plane.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Index
from flexura.beam import (
    DynamicBeam,
    UniformBeam,
    reversed_waves,
    rigid_arm,
    transfer_at_pole,
    transfer_rooted,
    transfer_turned,
    waves,
)
from flexura.beam import transfer_matrix as beam_transfer
from flexura.deadline import checkpoint
from flexura.errors import OptionError
from flexura.linalg import real_eigenvalues, scaled, unit_scale
from flexura.methods.dynamic_stiffness import DynamicStiffness
from flexura.methods.exact_chains import ExactChains, beams_at, in_series, starts
from flexura.methods.exact_condensation import refuse_large
from flexura.methods.solution import Solution
from flexura.reduction import full_order_modes
from flexura.structure import FullOrderModel, Scatter
from flexura.thresholds import SAME_SIZE

Array = NDArray[Any]

MOST_CHAIN_UNKNOWNS = 400
"""Unknowns of chains beyond which they are eliminated."""

SPARE_MODES = 4
"""Modes of the finite element model beyond those wanted, to see the gaps between which contours run."""

PER_CONTOUR = 6
"""About how many frequencies a contour encloses."""

CONTOUR_RATIO = 4.0
"""Largest ratio of the ends of a contour, which decides how many points it needs."""

WRAPPED = 1e-6
"""To this part of its size a motion decays within the period of the FFT, by exp(-sigma t)."""

LEAST_PIECES = 7
"""At least so many equal pieces in line are a member that carries rays: more than one element of a stepped flexure."""

IN_LINE = 1e-6
"""Gap between pieces, over their length, below which they are in line."""

LEAST_RADIANS = 0.05
"""Least number of radians of every bending wave on a ray member, at the lowest frequency: below, the waves of a member
differ so little that more than four digits are lost."""

TO_RELATIVE = np.block([[np.eye(6), np.zeros((6, 6))], [-np.eye(6), np.eye(6)]])
"""From the twists of both ends to [t, e]."""


class ChainEquations(ABC):
    """Equations over the displacements of all junctions and further unknowns of every chain.

    Junctions are the nodes that substructures keep, in the global frame, and those where members branch or discrete
    elements sit, in the frame of their part. Elements are cut into `pieces` uniform beams. `is_real` says that the
    equations are real at real frequencies. Raises SolverError where the equations are too many.
    """

    pieces = 1
    is_real = True

    def __init__(self, model: FullOrderModel) -> None:
        self.exact: DynamicStiffness = DynamicStiffness(model, self.pieces)
        assembler, parts = self.exact.assembler, self.exact.parts
        unknowns = {
            name: sum(self.extra(chains) * len(chains.kind) for chains in part.chains) for name, part in parts.items()
        }
        self.condensed: bool = sum(part.copies * unknowns[name] for name, part in parts.items()) > MOST_CHAIN_UNKNOWNS
        """Whether the unknowns of chains are eliminated part by part."""
        dofs, first = [], len(assembler.physical)
        for name, part in parts.items():
            boundary = assembler.coordinates(name, 0, 0)
            inner = 6 * len(part.reducer.remaining) - boundary.shape[1] + (0 if self.condensed else unknowns[name])
            refuse_large(first + inner * len(boundary), "junctions and chains")
            more = first + np.arange(inner * len(boundary)).reshape(len(boundary), inner)
            dofs.append(np.hstack([boundary, more]))
            first += more.size
        self._scatter = Scatter(dofs, first)

    def matrix(self, omega: complex) -> Array:
        """The matrix (n, n) of all equations at an angular frequency, rad/s; the kept DOFs of the low-order model are
        the first unknowns."""
        transforms = self.exact.assembler.transforms(self.exact.model.design)
        blocks = []
        for name in self.exact.parts:
            T = transforms[name]
            b = T.shape[-1]
            local = self._part(name, omega**2)
            wide = np.zeros((len(T), len(local), len(local)))
            wide[:, np.arange(b, len(local)), np.arange(b, len(local))] = 1.0
            wide[:, :b, :b] = T
            blocks.append(np.swapaxes(wide, -1, -2) @ local @ wide)
        return self._scatter.dense(blocks)

    def _part(self, name: str, lam: complex) -> Array:
        """Equations of one prototype: equilibrium of its nodes, then those of its chains."""
        part = self.exact.parts[name]
        n = 6 * len(part.reducer.remaining)
        extra = [self.extra(chains) for chains in part.chains]
        size = n + sum(more * len(chains.kind) for more, chains in zip(extra, part.chains, strict=True))
        local = np.zeros((size, size), dtype=np.result_type(lam, float if self.is_real else complex))
        zeros = [np.zeros((len(group.nodes), 12, 12)) for group in part.reducer.chains]
        local[:n, :n], _ = part.reducer.assembled_chains(zeros, zeros, lam, part.matrices)
        start = n
        for chains, more, ends in zip(part.chains, extra, part.ends, strict=True):
            unknowns = start + np.arange(more * len(chains.kind)).reshape(-1, more)
            self.add_chains(local, chains, ends, unknowns, lam)
            start += unknowns.size
        if not self.condensed or start == n:
            return local
        inner = local[n:, n:]
        scale = 1 / np.maximum(np.abs(inner).max(axis=1), 1e-300)
        return local[:n, :n] - local[:n, n:] @ np.linalg.solve(inner * scale[:, None], scale[:, None] * local[n:, :n])

    def poles(self, omega: float) -> int:
        """Number of poles of det below omega, rad/s: those of the chains' own equations, or when these have been
        eliminated, frequencies at which a chain with held ends vibrates."""
        lam = omega**2
        return sum(
            part.copies * (int(chains.joined(lam)[0].J0.sum()) if self.condensed else self.own_poles(chains, lam))
            for part in self.exact.parts.values()
            for chains in part.chains
        )

    def natural_frequencies(self, count: int) -> Array:
        """The `count` lowest frequencies, Hz, at which the matrix is singular; zero ones are those of rigid motions.

        The finite element model tells where gaps are for the contours to run through, and starting values; how many
        frequencies lie inside a contour is decided by the contour. Raises SolverError when they are not found.
        """
        model = self.exact.model
        guess = np.sqrt(full_order_modes(model, min(count + SPARE_MODES, model.order)).values)
        rigid = int((guess == 0).sum())

        def watched(omega: complex) -> Array:
            checkpoint(len(frequencies) / count)
            return self.matrix(omega)

        frequencies: list[float] = [0.0] * min(rigid, count)
        low = 0.3 * guess[rigid] if rigid < len(guess) else 0.0
        k = rigid
        while len(frequencies) < count and k < len(guess):
            end = k + 1
            while end < len(guess) and end - k < PER_CONTOUR and guess[end] < CONTOUR_RATIO * max(low, guess[k] / 2):
                end += 1
            end = k + 1 + int(np.argmax(np.diff(guess[k : end + 1]))) if end < len(guess) and end > k + 1 else end
            high = (guess[end - 1] + guess[end]) / 2 if end < len(guess) else 1.1 * guess[end - 1]
            poles = self.poles(high) - self.poles(low)
            span = float(low), float(high), guess[k:end]
            frequencies += real_eigenvalues(watched, *span, poles=poles, is_real=self.is_real).tolist()
            low, k = high, end
        return np.array(frequencies[:count]) / (2 * np.pi)

    def own_poles(self, chains: ExactChains, lam: float) -> int:
        """Number of poles below lam that the equations of chains have."""
        del chains, lam
        return 0

    def extra(self, chains: ExactChains) -> int:
        """Number of unknowns that each of the chains adds."""
        del chains
        return 6

    @abstractmethod
    def add_chains(self, local: Array, chains: ExactChains, ends: Index, unknowns: Index, lam: complex) -> None:
        """Add the equations of chains (c,) to those of their part: DOFs (c, 12) of their two end nodes, and their own
        `unknowns` (c, extra)."""


class TransferMatrices(ChainEquations):
    """The transfer matrix method for chains of beams, and for branches joined in loops (Pestel and Leckie 1963).

    Every chain between two junctions is multiplied up into one 12 x 12 matrix; its own unknowns are the wrench at its
    start. Chains give compatibility at their ends, junctions equilibrium. The matrix of these equations has no poles
    (theory eqs. W1-W3).
    """

    def add_chains(self, local: Array, chains: ExactChains, ends: Index, unknowns: Index, lam: complex) -> None:
        """Compatibility at the ends of chains, and what they exert on their nodes (theory eqs. W2-W3)."""
        back = rigid_arm(-chains.arms[:, -1])
        for k, matrix in enumerate(chain_transfer(chains, lam)):
            w, a, e = unknowns[k], ends[k, :6], ends[k, 6:]
            local[np.ix_(w, a)] += matrix[:6, :6]
            local[np.ix_(w, w)] += matrix[:6, 6:]
            local[np.ix_(w, e)] -= back[k]
            local[a, w] -= 1.0
            local[np.ix_(e, a)] += back[k].T @ matrix[6:, :6]
            local[np.ix_(e, w)] += back[k].T @ matrix[6:, 6:]


def chain_transfer(chains: ExactChains, lam: complex) -> Array:
    """Transfer matrices (c, 12, 12) of whole chains, twist and wrench at their poles."""
    pieces = beam_transfer(chains.beam, lam)[chains.kind]
    length = chains.beam.length[chains.kind].ravel()
    rooted = transfer_rooted(pieces.reshape(-1, 12, 12), chains.root.reshape(-1, 2), chains.roots, length)
    phi = transfer_at_pole(rooted.reshape(pieces.shape), chains.X)
    if chains.reverse.any():
        phi = np.where(chains.reverse[..., None, None], transfer_turned(phi), phi)
    whole = phi[:, 0]
    for k in range(1, phi.shape[1]):
        whole = phi[:, k] @ whole
    return whole


def transfer_matrix(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies by transfer matrices, found on contours in the complex plane.

    Raises OptionError when nothing can move, SolverError when the contours do not separate the frequencies. Loses
    digits where waves decay over a whole chain: at many wavelengths per chain.
    """
    hz = TransferMatrices(model).natural_frequencies(count)
    return Solution("transfer matrix", None, hz, note="chains multiplied up, junctions joined in loops")


class Ends(NamedTuple):
    """DOFs (c, 6) of the ends of beams (c,), and what takes them to twists at the pole (c, 6, 6)."""

    dofs: Index
    to_twist: Array


class SpectralElements(ChainEquations):
    """The spectral element method: exact beams at complex frequencies (Doyle 1997; Lee 2009).

    Every chain is two spectral elements, so that its own resonances with held ends are seen; its own unknowns are the
    twist of the node between them. Modes of a uniform chain with held ends have nodes at halves, thirds and quarters,
    where a joint does not move: the first element has two fifths of the pieces.
    """

    pieces = 5

    def own_poles(self, chains: ExactChains, lam: float) -> int:
        """Frequencies at which an element with held ends vibrates."""
        return sum(int(element.J0.sum()) for element in _spectral_elements(chains, lam))

    def add_chains(self, local: Array, chains: ExactChains, ends: Index, unknowns: Index, lam: complex) -> None:
        """The dynamic stiffness of both elements over their end twists (theory eq. W4)."""
        eye = np.broadcast_to(np.eye(6), (len(unknowns), 6, 6))
        nodes = [Ends(ends[:, :6], eye), Ends(unknowns, eye), Ends(ends[:, 6:], rigid_arm(-chains.arms[:, -1]))]
        _add_in_series(local, _spectral_elements(chains, lam), nodes)


def _spectral_elements(chains: ExactChains, lam: complex) -> list[DynamicBeam]:
    pieces = chains.pieces(lam)
    n = pieces.J0.shape[-1]
    return _joined_runs(pieces, (0, 2 * n // 5, n))


def _joined_runs(pieces: DynamicBeam, cuts: Sequence[int]) -> list[DynamicBeam]:
    """Pieces (c, s) in series, joined from each cut to the next to beams (c,)."""
    return [in_series(beams_at(pieces, np.s_[:, a:b]))[0] for a, b in pairwise(cuts)]


def _add_in_series(local: Array, beams: Sequence[DynamicBeam], nodes: Sequence[Ends]) -> None:
    """Add the dynamic stiffness of exact beams (c,) in series between nodes, of which there is one more."""
    for k in range(len(nodes[0].dofs)):
        for beam, (a, b) in zip(beams, pairwise(nodes), strict=True):
            T = TO_RELATIVE @ la.block_diag(a.to_twist[k], b.to_twist[k])
            dofs = np.concatenate([a.dofs[k], b.dofs[k]])
            local[np.ix_(dofs, dofs)] += T.T @ beam.K[k] @ T


def spectral_element(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies as the points where the spectral matrix is singular.

    Raises OptionError when nothing can move, SolverError when the contours do not separate the frequencies.
    """
    hz = SpectralElements(model).natural_frequencies(count)
    return Solution("spectral element", None, hz, note="two elements for every chain")


def spectral_response(
    model: FullOrderModel,
    force: Callable[[NDArray[Any]], ArrayLike],
    at: tuple[str, ArrayLike],
    sensors: Sequence[str],
    *,
    duration: float,
    steps: int = 512,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Displacements of nodes after a force that starts at time zero from rest, without a time-stepping error.

    `force(t)` is the history, N or N m, at times t (steps,); `at` names a node and the direction (6,) of the force in
    its freedoms tx ... rz, global frame; `sensors` name nodes. Nodes are those that substructures keep. Returns times
    (steps,), s, up to `duration`, and displacements (steps, sensors, 6), m and rad. Force and motion are multiplied by
    exp(-sigma t): the response of an undamped mechanism then decays within the period of the FFT and does not wrap
    around (numerical Laplace transform; theory eqs. W5-W6). The spectrum ends at the Nyquist frequency: a force with
    jumps rings there. Raises OptionError for unknown nodes and impossible options.
    """
    if steps < 8 or not (np.isfinite(duration) and duration > 0):
        raise OptionError("a time response needs a positive duration and at least 8 steps")
    equations = SpectralElements(model)
    rows = model.design.node_rows(model.plan.topology.numbers([at[0], *sensors])).toarray()
    B = equations.exact.over_kept(rows)
    if B is None:
        raise OptionError("force and sensors act at nodes that the substructures keep; make these an interface")
    kept = B.shape[1]
    load = np.asarray(at[1], dtype=float) @ B[:6]
    # twice the duration: what the period of the FFT repeats has died out by then
    period, n = 2 * duration, 2 * steps
    t = np.arange(n) * period / n
    sigma = -np.log(WRAPPED) / period
    history = np.broadcast_to(np.asarray(force(t), dtype=float), t.shape)
    spectrum = np.fft.rfft(history * np.exp(-sigma * t))
    omega = 2 * np.pi * np.fft.rfftfreq(n, period / n) - 1j * sigma
    response = np.empty((len(omega), len(rows) - 6), dtype=complex)
    for k, w in enumerate(omega):
        A = equations.matrix(complex(w))
        f = np.zeros(len(A), dtype=complex)
        f[:kept] = load * spectrum[k]
        d = unit_scale(A)
        response[k] = B[6:] @ (d * np.linalg.solve(scaled(A, d), d * f))[:kept]
    u = np.fft.irfft(response, n, axis=0) * np.exp(sigma * t)[:, None]
    return t[:steps], u[:steps].reshape(steps, len(sensors), 6)


class Run(NamedTuple):
    """Pieces `first` to `end` of chains, and whether they are a uniform member that carries rays."""

    first: int
    end: int
    is_ray: bool


class ReverberationRays(ChainEquations):
    """The reverberation-ray matrix method: waves that leave and reach joints (Pao, Keh and Howard 1999).

    Uniform runs of a chain carry rays: six waves depart from each end, and arrive at the other changed by their phase.
    Junctions with their bodies, springs and masses scatter them; so do stepped flexures, which enter as elastic joints
    with their exact dynamic stiffness, and members so short against their waves that these are all but parallel. With
    departing amplitudes d the arriving ones are P U d, what a joint makes of these is S P U d, and natural frequencies
    are where det(I - S P U) is zero. The scattering S has poles of its own, at resonances of joints on members without
    end, so the equations are solved before S is formed, with d and the junctions' displacements unknown (theory eqs.
    W10-W12). Unknown are the amplitudes that depart from either end of a ray member, two free twists inside a joint,
    and a twist between runs; `omega`, rad/s, is the lowest frequency at which a member is to carry rays.
    """

    pieces = 6
    is_real = False

    def __init__(self, model: FullOrderModel, omega: float) -> None:
        self._omega = omega
        super().__init__(model)

    def extra(self, chains: ExactChains) -> int:
        """Twelve for every run, and six between runs."""
        return 18 * len(self.runs(chains)) - 6

    def add_chains(self, local: Array, chains: ExactChains, ends: Index, unknowns: Index, lam: complex) -> None:
        """Rays of uniform runs, and joints of the others: three exact beams in series (theory eq. W12)."""
        runs, pieces = self.runs(chains), chains.pieces(lam)
        eye = np.broadcast_to(np.eye(6), (len(unknowns), 6, 6))
        columns = [Ends(dofs, eye) for dofs in np.split(unknowns, np.arange(6, unknowns.shape[1], 6), axis=1)]
        last = Ends(ends[:, 6:], rigid_arm(-chains.arms[:, -1]))
        between = [Ends(ends[:, :6], eye), *columns[2::3], last]
        for number, (run, (left, right)) in enumerate(zip(runs, pairwise(between), strict=True)):
            inner = columns[3 * number : 3 * number + 2]
            if run.is_ray:
                amplitudes = np.hstack([end.dofs for end in inner])
                _add_rays(local, chains, run, (left, right), amplitudes, lam=lam)
            else:
                thirds = _thirds(beams_at(pieces, np.s_[:, run.first : run.end]))
                _add_in_series(local, thirds, [left, *inner, right])

    def own_poles(self, chains: ExactChains, lam: float) -> int:
        """Frequencies at which a part of a stepped run with held ends vibrates."""
        pieces = chains.pieces(lam)
        stepped = [beams_at(pieces, np.s_[:, run.first : run.end]) for run in self.runs(chains) if not run.is_ray]
        return sum(int(third.J0.sum()) for run in stepped for third in _thirds(run))

    def runs(self, chains: ExactChains) -> list[Run]:
        """Runs of pieces that all chains of a group have in common: a uniform run is made of equal pieces on one line,
        and stepped pieces that follow each other are one run."""
        turn, place = chains.X[..., :3, :3], starts(chains.X)
        reverse, is_rooted = chains.reverse, chains.is_rooted
        same = (np.abs(np.diff(turn, axis=1)).max(axis=(2, 3)) <= SAME_SIZE) & (reverse[:, 1:] == reverse[:, :-1])
        same &= ~is_rooted[:, 1:] & ~is_rooted[:, :-1]
        for field in chains.beam:
            values = field[chains.kind]
            same &= np.abs(np.diff(values, axis=1)) <= SAME_SIZE * np.abs(values[:, 1:])
        length = chains.beam.length[chains.kind]
        along = np.where(reverse[:, 1:, None], -1, 1) * (turn[..., 0, :] * length[..., None])[:, 1:]
        same &= np.abs(np.diff(place, axis=1) - along).max(axis=2) <= IN_LINE * length[:, 1:]
        breaks = [0, *(np.flatnonzero(~same.all(axis=0)) + 1).tolist(), chains.kind.shape[1]]
        runs: list[Run] = []
        for a, b in pairwise(breaks):
            is_ray = b - a >= LEAST_PIECES and _least_radians(chains, a, b, self._omega) >= LEAST_RADIANS
            if runs and not is_ray and not runs[-1].is_ray:
                runs[-1] = runs[-1]._replace(end=b)
            else:
                runs.append(Run(a, b, is_ray))
        return runs


def _add_rays(
    local: Array, chains: ExactChains, run: Run, ends: tuple[Ends, Ends], amplitudes: Index, *, lam: complex
) -> None:
    """Displacements of both ends by waves, and what these exert on the nodes (theory eqs. W10-W11)."""
    is_backward = chains.reverse[:, run.first]
    beam = chains.beam.take(chains.kind[:, run.first])
    length = beam.length * (run.end - run.first)
    forward = waves(beam, lam)
    backward = reversed_waves(forward)
    phase = np.exp(-1j * forward.k * length[:, None])[:, None, :]
    # amplitudes that leave the start of the member, then those that leave its end
    u = [np.concatenate(x, -1) for x in ((forward.u, backward.u * phase), (forward.u * phase, backward.u))]
    q = [np.concatenate(x, -1) for x in ((forward.q, backward.q * phase), (forward.q * phase, backward.q))]
    along = np.zeros((len(amplitudes), 3))
    along[:, 0] = length
    # twists at the pole to displacements of the member's start and end in its axes
    X = np.where(is_backward[:, None, None], chains.X[:, run.end - 1], chains.X[:, run.first])
    to_ends = (X, rigid_arm(along) @ X)
    for k in range(len(amplitudes)):
        for side, sign in ((0, -1.0), (1, 1.0)):
            end = ends[1 - side if is_backward[k] else side]
            dofs, rows = end.dofs[k], amplitudes[k, 6 * side : 6 * side + 6]
            T = to_ends[side][k] @ end.to_twist[k]
            local[np.ix_(rows, dofs)] += T
            local[np.ix_(rows, amplitudes[k])] -= u[side][k]
            local[np.ix_(dofs, amplitudes[k])] += sign * T.T @ q[side][k]


def _thirds(pieces: DynamicBeam) -> list[DynamicBeam]:
    """Pieces (c, s) in series, in three unequal runs (c,): modes with held ends have no nodes at such ends."""
    n = pieces.J0.shape[-1]
    return _joined_runs(pieces, (0, max(1, (2 * n) // 7), max(2, (5 * n) // 8), n))


def _least_radians(chains: ExactChains, a: int, b: int, omega: float) -> float:
    """Least radians of a bending wave along a run of equal pieces of all chains, at omega."""
    beam: UniformBeam = chains.beam.take(chains.kind[:, a])
    k = (beam.mass * omega**2 / np.maximum(beam.EIy, beam.EIz)) ** 0.25
    return float((k * beam.length * (b - a)).min())


def reverberation_ray(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies by reverberation rays.

    Raises OptionError when nothing can move, SolverError when the contours do not separate the frequencies. Members
    shorter than LEAST_RADIANS against their waves are joints.
    """
    values = full_order_modes(model, min(7, model.order)).values
    elastic = values[values > 0]
    equations = ReverberationRays(model, float(np.sqrt(elastic[0])) if len(elastic) else 1.0)
    hz = equations.natural_frequencies(count)
    rays = sum(
        part.copies * len(chains.kind) * sum(run.is_ray for run in equations.runs(chains))
        for part in equations.exact.parts.values()
        for chains in part.chains
    )
    note = f"{rays} ray members; stepped or very short ones are elastic joints"
    return Solution("reverberation-ray", None, hz, note=note)
