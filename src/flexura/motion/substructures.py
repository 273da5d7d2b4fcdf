"""Substructures of a moving model: what lies between frames that are kept, and what it answers with at these alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.linalg import Eigenpairs, factorise, next_to
from flexura.motion.elements import Frames
from flexura.motion.layout import taken
from flexura.motion.model import MovingModel, element_masses
from flexura.motion.se3 import Logarithm, exponential
from flexura.motion.superelements import Sagging, Superelements
from flexura.thresholds import SAME_SIZE

Flags = NDArray[np.bool_]

INSIDE_SETTLED = 1e-9
"""Largest last step of Newton's method inside, over the size of the substructure or in rad."""

INSIDE_STEPS = 12

MODES = 12
"""Modes of a substructure by itself that are known at most."""

TURNING = ("axes", "arm")
"""What elements hold in global axes; all else that they hold is the same however they lie."""


class Condensed(NamedTuple):
    """Forces (m, d) of substructures by their deformations, with all inside in equilibrium, and derivatives of these
    (m, d, d); NaN where there is no equilibrium. `frames` (m, k + i) are as seen from the first."""

    force: Array
    tangent: Array
    frames: Frames


def kept_frames(model: MovingModel) -> Flags:
    """Frames (n + 1,) that are kept as they are: those between the parts of the description, those that are held, and
    those of superelements, actuators, dashpots and stops."""
    topology = model.design.plan.topology
    kept = ~(model.dof >= 0).all(axis=1) | ~model.rest.placed
    for copies in topology.copies.values():
        kept[topology.root[copies.numbers(copies.part.boundary)]] = True
    driven = [model.elements[number] for number in model.actuators.values()]
    for group in (
        *driven,
        *model.dashpots,
        *model.stops,
        *(own for own in model.elements if isinstance(own, Superelements)),
    ):
        kept[group.node] = True
    return kept


@dataclass(frozen=True)
class Substructure:
    """Elements and frames inside, `frames` (k + i,) of which the first k are kept and the others are its own.

    `rows` are the numbers of its elements in each group of `model`. Its own axes, those of the first of its equals,
    are turned by `turn` (3, 3) in the model.
    """

    model: MovingModel
    frames: Index
    k: int
    rows: tuple[Index, ...]
    name: str
    turn: Array

    @cached_property
    def elements(self) -> tuple[Any, ...]:
        """Its elements, between frames that are numbered from 0, in its own axes."""
        local = np.full(len(self.model.dof), -1, dtype=np.intp)
        local[self.frames] = np.arange(len(self.frames))
        elements = []
        for group, rows in zip(self.model.elements, self.rows, strict=True):
            if len(rows):
                element = taken(group, rows)
                node = local[element.node]
                arm = (element.arm - np.pad(self.arm, ((0, len(self.frames) - self.k), (0, 0)))[node]) @ self.turn
                element = replace(element, node=node, arm=arm)
                elements.append(
                    replace(element, axes=self.turn.T @ element.axes) if hasattr(element, "axes") else element
                )
        return tuple(elements)

    @cached_property
    def arm(self) -> Array:
        """From the kept frames to the points (k, 3) where it is attached, global axes, m; zero where these are many."""
        arms = np.zeros((self.k, 3))
        for j, frame in enumerate(self.frames[: self.k]):
            groups: tuple[Any, ...] = self.model.elements
            touching = zip(groups, self.rows, strict=True)
            ends = [group.arm[rows][group.node[rows] == frame] for group, rows in touching if len(rows)]
            arm = np.concatenate(ends)
            if np.ptp(arm, axis=0).max() <= SAME_SIZE * max(np.abs(arm).max(), 1e-300):
                arms[j] = arm[0]
        return arms

    @cached_property
    def rest(self) -> Array:
        """Where it is attached and where its own frames (k + i, 3) are at rest, m, seen from the first of these."""
        x = self.model.rest.x[self.frames]
        x[: self.k] += self.arm
        return (x - x[0]) @ self.turn

    @cached_property
    def inertia(self) -> Array:
        """What its own frames (i, 6, 6) carry, in its axes."""
        T = np.kron(np.eye(2), self.turn)
        return T.T @ self.model.inertia[self.frames[self.k :]] @ T

    @property
    def size(self) -> float:
        """Diagonal of the box around it, m."""
        return float(np.linalg.norm(np.ptp(self.rest, axis=0))) or 1.0

    def equals(self, other: Substructure) -> bool:
        """Whether another one is the same, as it lies in its own axes."""
        if (self.k, len(self.frames), len(self.elements)) != (other.k, len(other.frames), len(other.elements)):
            return False
        pairs = [(self.rest, other.rest), (self.inertia, other.inertia)]
        for mine, theirs in zip(self.elements, other.elements, strict=True):
            if type(mine) is not type(theirs):
                return False
            pairs += zip(_arrays(mine), _arrays(theirs), strict=True)
        return all(_alike(mine, theirs) for mine, theirs in pairs)

    def turned_like(self, other: Substructure) -> Substructure:
        """Itself with the axes in which it could be equal to another one."""
        axes, other_axes = (_axes(elements) for elements in (self.elements, other.elements))
        return self if axes is None or other_axes is None else replace(self, turn=self.turn @ axes @ other_axes.T)

    @cached_property
    def _matrices(self) -> tuple[sp.csc_matrix, sp.csc_matrix, Array]:
        """K and M of all its frames at rest, those inside first, and minus how these follow the others (6i, 6k)."""
        tiled = _Tiled(self, 1, hold=0)
        K = tiled.tangent(tiled.model.forces(tiled.rest, np.zeros(3)).blocks)
        inertia = np.concatenate([np.zeros((self.k, 6, 6)), self.inertia])
        blocks = [*element_masses(tiled.model.elements, tiled.rest), np.zeros((0, 12, 12)), inertia]
        return K, tiled.tangent(blocks), tiled.condensed(K)[1][0]

    @cached_property
    def _modes(self) -> Eigenpairs:
        """The lowest modes with the kept frames held, orthonormal by M."""
        K, M, follow = self._matrices
        inside = slice(0, len(follow))
        return next_to(K[inside, inside].tocsc(), M[inside, inside].tocsc(), min(MODES, len(follow)), 0.0)

    @property
    def frequencies(self) -> Array:
        """The lowest natural frequencies, rad/s, with the kept frames held."""
        return np.sqrt(np.maximum(self._modes.values, 0.0))

    def with_modes(self, count: int) -> Array:
        """M (6k + 6a, 6k + 6a) by velocities of its kept frames and of so many amplitudes of modes, in a sixes."""
        _, M, follow = self._matrices
        T = np.zeros((M.shape[0], 6 * (self.k + sixes(count))))
        T[: len(follow), : 6 * self.k] = -follow
        T[len(follow) :, : 6 * self.k] = np.eye(6 * self.k)
        T[: len(follow), 6 * self.k : 6 * self.k + count] = self._modes.vectors[:, :count]
        return np.asarray(T.T @ (M @ T))

    @cached_property
    def following(self) -> Array:
        """How the frames inside follow the others (6i, 6k) at rest."""
        return -self._matrices[2]

    def condensed(self, d: Array, inside: tuple[Array, Array] | None = None) -> Condensed:
        """What it answers with at deformations (m, d); the frames inside are looked for about x (m, i, 3) and
        R (m, i, 3, 3), as seen from the first, by default where they are in small motions."""
        return _Tiled(self, len(d), hold=1).at(d, inside)

    def seen(self, frames: Frames, x: Array, R: Array) -> tuple[Array, Array]:
        """Positions x (i, 3) and rotations R (i, 3, 3) as seen from its first frame, in its axes."""
        first = self.frames[0]
        axes = frames.R[first] @ self.turn
        return (x - frames.x[first] - frames.R[first] @ self.arm[0]) @ axes, axes.T @ R @ self.turn


class _Tiled:
    """So many of a substructure side by side, each with its first `hold` frames in place."""

    def __init__(self, of: Substructure, count: int, hold: int) -> None:
        self.of, self.count, self.hold = of, count, hold
        n, k = len(of.frames), of.k
        self.inside, self.between = 6 * (n - k), 6 * (k - hold)
        self.rest = Frames.at_rest(np.tile(of.rest, (count, 1)), np.ones(count * n, dtype=bool))
        dof = np.full((count, n, 6), -1, dtype=np.intp)
        dof[:, k:] = np.arange(count * self.inside).reshape(count, -1, 6)
        dof[:, hold:k] = count * self.inside + np.arange(count * self.between).reshape(count, -1, 6)
        elements = tuple(_repeated(group, count, n) for group in of.elements)
        none = np.zeros((count * n, 6, 6))
        self.model = replace(
            of.model,
            rest=self.rest,
            dof=dof.reshape(-1, 6),
            elements=elements,
            names=(),
            actuators={},
            dashpots=(),
            inertia=none,
            sagging=Sagging.of((), self.rest),
        )

    def tangent(self, blocks: list[Array]) -> sp.csc_matrix:
        """Derivatives by all free displacements, those inside first, of forces that do not turn with frames between."""
        blocks[-1].reshape(self.count, -1, 6, 6)[:, : self.of.k] = 0.0
        return self.model.pattern.sparse(blocks)

    def condensed(self, K: sp.csc_matrix) -> tuple[Array, Array]:
        """Derivatives (m, b, b) at the frames between, and minus how the frames inside follow (m, i, b)."""
        m, i, b = self.count, self.inside, self.between
        inner = m * i
        right, below = (_blocks(block, m, i, b) for block in (K[:inner, inner:], K[inner:, :inner].T))
        follow = factorise(K[:inner, :inner].tocsc()).solve(right.reshape(inner, b)).reshape(m, i, b)
        return _blocks(K[inner:, inner:], m, b, b) - np.swapaxes(below, 1, 2) @ follow, follow

    def at(self, d: Array, inside: tuple[Array, Array] | None) -> Condensed:
        """What each answers with at deformations (m, d), the frames inside being about there."""
        of, m, k = self.of, self.count, self.of.k
        rest = np.zeros((k - 1, 6))
        rest[:, :3] = of.rest[1:k]
        R, x = exponential(rest + d.reshape(m, k - 1, 6))
        turn = Logarithm(R, np.zeros_like(x)).e[..., 3:]
        step = np.zeros((m, len(of.frames), 6))
        step[:, 1:k] = np.concatenate([x - of.rest[1:k], turn], axis=-1)
        step[:, k:] = (step[:, :k].reshape(m, -1) @ of.following.T).reshape(m, -1, 6)
        frames = self.rest.moved(step.reshape(-1, 6))
        if inside is not None:
            frames.x.reshape(m, -1, 3)[:, k:], frames.R.reshape(m, -1, 3, 3)[:, k:] = inside
        K, force, frames, settled = self._settled(frames)
        K, _ = self.condensed(K)
        log = Logarithm(R, x)
        twists = np.zeros((m, k - 1, 6, 6))
        twists[..., :3, :3] = twists[..., 3:, 3:] = np.swapaxes(R, -1, -2)
        rows = np.linalg.inv(log.after @ twists)
        n = (np.swapaxes(rows, -1, -2) @ force[..., None])[..., 0]
        slope = np.swapaxes(twists, -1, -2) @ log.second(n)[1]
        back, local = np.zeros(K.shape), np.zeros(K.shape)
        for j in range(k - 1):
            six = slice(6 * j, 6 * j + 6)
            back[:, six, six], local[:, six, six] = rows[:, j], slope[:, j]
        H = np.swapaxes(back, 1, 2) @ (K @ back - local)
        n, H = n.reshape(m, -1), (H + np.swapaxes(H, 1, 2)) / 2
        n[~settled], H[~settled] = np.nan, np.nan
        return Condensed(n, H, frames)

    def _settled(self, frames: Frames) -> tuple[sp.csc_matrix, Array, Frames, Flags]:
        """Equilibrium inside: tangent, forces (m, k - 1, 6) between but for squares of the last step, frames there,
        and where it was found."""
        of, m = self.of, self.count
        scale = np.append(np.full(3, 1 / of.size), np.ones(3))
        settled = np.ones(m, dtype=bool)
        for _ in range(INSIDE_STEPS):
            forces = self.model.forces(frames, np.zeros(3))
            K = self.tangent(forces.blocks)
            by_frame = forces.force.reshape(m, -1, 6)
            inner = m * self.inside
            missing = np.where(settled[:, None, None], by_frame[:, of.k :], 0.0)
            step = np.zeros(by_frame.shape)
            try:
                solution = -factorise(K[:inner, :inner].tocsc()).solve(missing.ravel())
            except SolverError:
                solution = np.full(inner, np.nan)
            step[:, of.k :] = solution.reshape(missing.shape)
            sizes = np.abs(step * scale).max(axis=(1, 2), initial=0.0)
            settled &= np.isfinite(sizes) & (sizes < 1.0)
            step[~settled] = 0.0
            if sizes[settled].max(initial=0.0) < INSIDE_SETTLED:
                break
            frames = frames.moved(step.reshape(-1, 6))
        left = K[inner:, :inner] @ step[:, of.k :].ravel()
        return K, by_frame[:, 1 : of.k] + left.reshape(m, -1, 6), frames, settled & (sizes < INSIDE_SETTLED)


def partition(model: MovingModel, kept: Flags) -> list[list[Substructure]]:
    """The substructures between kept frames (n + 1,), those that are equal together."""
    kinds: list[list[Substructure]] = []
    for substructure in _substructures(model, kept):
        for others in kinds:
            turned = substructure.turned_like(others[0])
            if turned.equals(others[0]):
                others.append(turned)
                break
        else:
            kinds.append([substructure])
    return kinds


def _substructures(model: MovingModel, kept: Flags) -> Iterator[Substructure]:
    """All substructures, by the order of their elements."""
    label = components(model, kept)
    by_group = []
    for group in model.elements:
        own = np.where(kept[group.node], -1, label[group.node])
        by_group.append(own.max(axis=1))
    for number in dict.fromkeys(np.concatenate(by_group).tolist()):
        if number < 0:
            continue
        rows = tuple(np.flatnonzero(own == number) for own in by_group)
        nodes = [g.node[r].ravel() for g, r in zip(model.elements, rows, strict=True)]
        nodes = np.array(list(dict.fromkeys(np.concatenate(nodes).tolist())), dtype=np.intp)
        between = nodes[kept[nodes]]
        names = [model.names[g][row] for g, own in enumerate(rows) for row in own.tolist()]
        frames = np.concatenate([between, nodes[~kept[nodes]]])
        yield Substructure(model, frames, len(between), rows, _common(names), np.eye(3))


def components(model: MovingModel, kept: Flags) -> Index:
    """Numbers (n + 1,) of the parts that hang together when frames are taken out."""
    pairs = [np.empty((0, 2), dtype=np.intp)]
    for group in model.elements:
        pairs += [group.node[:, [0, j]] for j in range(1, group.node.shape[1])]
    edges = np.concatenate(pairs)
    edges = edges[~kept[edges].any(axis=1)]
    graph = sp.coo_matrix((np.ones(len(edges)), edges.T), shape=(len(kept), len(kept)))
    return np.asarray(sp.csgraph.connected_components(graph, directed=False)[1], dtype=np.intp)


def middle(substructure: Substructure, kept: Flags) -> int:
    """The frame inside that, once it is kept, leaves the smallest parts."""
    inside = substructure.frames[substructure.k :]
    left = []
    for frame in inside:
        without = kept.copy()
        without[frame] = True
        others = components(substructure.model, without)[inside[inside != frame]]
        left.append(np.bincount(others).max(initial=0) if len(others) else 0)
    return int(inside[int(np.argmin(left))])


def sixes(count: int) -> int:
    """Frames that so many amplitudes take."""
    return -(-count // 6)


def _common(names: Sequence[str]) -> str:
    """The first steps that the dotted names of elements have in common."""
    steps = [step for step, *others in zip(*(name.split(".") for name in names), strict=False) if {step} >= {*others}]
    return ".".join(steps) or names[0]


def _repeated(elements: Any, count: int, frames: int) -> Any:
    """Elements of one substructure side by side, each with so many frames."""
    e = len(elements.node)
    tiled = taken(elements, np.tile(np.arange(e), count))
    return replace(tiled, node=tiled.node + frames * np.repeat(np.arange(count), e)[:, None])


def _arrays(elements: Any) -> Iterator[Array]:
    for f in fields(elements):
        value = getattr(elements, f.name)
        if is_dataclass(value):
            yield from _arrays(value)
        else:
            yield value


def _alike(a: Array, b: Array) -> bool:
    if a.shape != b.shape:
        return False
    size = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    return bool(np.abs(a - b).max(initial=0.0) <= SAME_SIZE * size)


def _axes(elements: Sequence[Any]) -> Array | None:
    """The axes of the first element that has some."""
    return next((group.axes[0, 0] for group in elements if hasattr(group, "axes")), None)


def _blocks(K: Any, m: int, rows: int, columns: int) -> Array:
    """The m blocks (rows, columns) on the diagonal."""
    entries = K.tocoo()
    blocks = np.zeros((m, rows, columns))
    np.add.at(blocks, (entries.row // rows, entries.row % rows, entries.col % columns), entries.data)
    return blocks
