"""A discrete state space in float32, in blocks of two states, and a proven bound on how far it is from the double one.

Steps are x += (A - 1) x + B w (Middleton and Goodwin 1986), whose coefficients keep their digits however short a step
is; each state carries what its last sum lost (Knuth 1998, section 4.2.2, theorem B). Rounding is then at most some
units of 2^-24 of every change, and responses to that are summed in absolute value (theory eqs. X6-X9).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.results import Result
from flexura.structure import Channel, ends_of
from flexura.systems.state_space import DEPENDENT_POLES, FAINT, WORTH, StateSpace, rounded_up
from flexura.tables import Facts, Item, percent, quantity

Single = NDArray[np.float32]

UNIT = 2.0**-24
"""Unit round-off of float32."""

TINY = 2.0**-126
"""What a product may lose where processors take numbers below this as zero."""

MOST = 0.5
"""Part of a change by rounding that rounding may add to it again, beyond which nothing is proven."""

NOTHING = 1e-10
"""Size of a channel that is round-off, beside those of its output and of its input."""

IN_SUMS = 1e-3
"""Share by which a bound is raised for the rounding of its own sums, in double precision."""

CHUNK, LONGEST = 256, 1 << 22
"""Steps that are summed at a time, and at most."""

DECAYED = 1 / 64
"""Share of a block's motion that is left where its sum goes on as a geometric series."""

LARGEST_ORDER = 400
"""Order of the largest model."""


@dataclass(frozen=True, repr=False)
class SinglePrecision(Result):
    """y = C x + D w, x += (A - 1) x + B w in float32, w being the inputs of this step and those before.

    `change` (b, 2, 2) is A - 1 by blocks, `B` (2b, m (d + 1)), `C` (p, 2b), `D` (p, m (d + 1)) with d `steps_before`;
    x (n,) of `model`, but for inputs that it delays, are `states` (n, 2b) times these. From rest and under inputs of at
    most U (m,) an output differs from that of `model` in exact arithmetic by at most `bound` (p, m) U + `floor` (p,),
    at all times; `size` (p, m) is the largest gain of each channel, at poles and at rest.
    """

    _shown = ("name", "inputs", "outputs")

    name: str
    dt: float
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    change: Single
    B: Single
    C: Single
    D: Single
    steps_before: int
    states: Array
    bound: Array
    floor: Array
    size: Array
    known: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def order(self) -> int:
        """Number of states, one that rests included where it is odd."""
        return 2 * len(self.change)

    @property
    def shares(self) -> Array:
        """The bound over the size of every channel (p, m); zero for those that are round-off beside the others."""
        rows = self.size / np.maximum(self.size.max(axis=1, keepdims=True), 1e-300)
        heard = rows > NOTHING * rows.max(axis=0)
        return np.divide(self.bound, self.size, out=np.zeros_like(self.bound), where=heard)

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max(initial=0.0))

    @property
    def text(self) -> str:
        """One sentence."""
        return f"float32 differs from double by at most {rounded_up(self.share, 2)} of the largest responses, proven"

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Those of the model, and one when the bound is more than 1 % of a channel."""
        if self.share <= WORTH:
            return self.known
        k, j = np.unravel_index(int(self.shares.argmax()), self.shares.shape)
        place = f"{self.outputs[k].name} / {self.inputs[j].name}"
        advice = "take longer steps, or leave out modes that nothing damps"
        return (*self.known, Diagnostic("tolerance", place, self.share, WORTH, "1", f"{self.text}: {advice}"))

    def presentation(self) -> Iterator[Item]:
        facts = {"order": self.order, **ends_of(self.inputs, self.outputs), "step": quantity(self.dt, "s")}
        yield Facts({**facts, "float32 differs by at most": percent(self.share)})

    def _data(self) -> dict[str, Any]:
        names = ("name", "inputs", "outputs", "change", "B", "C", "D", "steps_before", "bound", "floor", "size", "text")
        return {**{name: getattr(self, name) for name in names}, "dt_s": self.dt, "share": self.share}

    def run(self, inputs: Array) -> Single:
        """Outputs (k, p) from rest under inputs (k, m), in float32 as the C code has them but for the order of sums."""
        x, rest = np.zeros(self.order, dtype=np.float32), np.zeros(self.order, dtype=np.float32)
        before = np.zeros((self.steps_before, len(self.inputs)), dtype=np.float32)
        found = np.empty((len(inputs), len(self.outputs)), dtype=np.float32)
        for k, u in enumerate(np.asarray(inputs, dtype=np.float32)):
            w = np.concatenate([u, before.ravel()])
            found[k] = self.D @ w + self.C @ x
            t = rest + (self.B @ w + (self.change @ x.reshape(-1, 2, 1)).ravel())
            total = x + t
            part = total - x
            x, rest = total, (x - (total - part)) + (t - part)
            before = np.concatenate([u[None], before])[: self.steps_before]
        return found


class _Delayed(NamedTuple):
    """The states of a model that are no inputs of steps before, and matrices by which inputs reach these and outputs
    as soon as they are given, a step later, and so on: (d + 1, n, m) and (d + 1, p, m)."""

    core: Index
    B: Array
    D: Array


class _Steps(NamedTuple):
    """Coefficients of `SinglePrecision`."""

    change: Any
    B: Any
    C: Any
    D: Any


class _Blocks(NamedTuple):
    """x = T z with A T = T (1 + change) + T `lost`, `change` (b, 2, 2), and the inverse of T."""

    change: Array
    T: Array
    inverse: Array
    lost: Array


@verb
def single_precision(model: StateSpace) -> SinglePrecision:
    """A discrete state space in float32 with a proven bound on how far it is from the double one (theory eqs. X6-X9).

    States are in blocks of two: those of a modal model as they are, others by eigenvectors; inputs that are states for
    their delay are told apart. Raises OptionError for continuous models, those without inputs, outputs or states, and
    poles that all but coincide; SolverError where motion does not decay, or has too few digits in float32.
    """
    if model.dt is None:
        raise OptionError("float32 is for steps: discretise the model first, `model.discretised(1e-4)` or --dt 0.1ms")
    if not (model.inputs and model.outputs and model.order):
        raise OptionError("a model without inputs, outputs or states has no steps")
    if model.order > LARGEST_ORDER:
        raise OptionError(f"a model of {model.order} states; at most {LARGEST_ORDER} go into steps: keep fewer modes")
    delayed = _delayed_inputs(model)
    A = model.A[np.ix_(delayed.core, delayed.core)]
    blocks = _in_blocks(A)
    m, p = len(model.inputs), len(model.outputs)
    B = np.einsum("ij,djm->dim", blocks.inverse, delayed.B)
    C = model.C[:, delayed.core] @ blocks.T
    gains = _sums(blocks.change, C, B)
    scale = 2.0 ** -np.ceil(np.log2(np.maximum(gains.largest.max(axis=1), 1e-300)))
    scale = np.where(gains.largest.any(axis=1), scale, 1.0).reshape(-1, 2).min(axis=1).repeat(2)
    change, lost = blocks.change, scale[:, None] * blocks.lost / scale
    B, C = B * scale[:, None], C / scale
    gains = gains.scaled(scale)
    flat, D = (np.concatenate(list(X), axis=1) for X in (B, delayed.D))
    exact = _Steps(change, flat, C, D)
    near = _Steps(*(X.astype(np.float32) for X in exact))
    if not all(np.isfinite(X).all() for X in near):
        raise SolverError("coefficients are beyond the range of float32")
    bound, floor = _bound(gains, lost, exact, near, m)
    response = np.abs(_largest_gain(model))
    size = np.maximum(response, FAINT * (np.abs(C) @ gains.largest + np.abs(D).reshape(p, -1, m).sum(axis=1)))
    states = np.zeros((model.order, len(scale)))
    states[delayed.core] = blocks.T / scale
    about = (model.name, float(model.dt), model.inputs, model.outputs)
    found = SinglePrecision(*about, *near, len(B) - 1, states, bound, floor, size, model.warnings)
    return replace(found, notes=(*model.notes, found.text))


def _delayed_inputs(model: StateSpace) -> _Delayed:
    """States that are inputs of steps before are found by their rows: one unit entry of B, or of A at such a state."""
    A, B, n = model.A, model.B, model.order
    place: dict[int, tuple[int, int]] = {}
    found = True
    while found:
        found = False
        for i in set(range(n)) - place.keys():
            a, b = np.flatnonzero(A[i]), np.flatnonzero(B[i])
            if not len(a) and len(b) == 1 and B[i, b[0]] == 1:
                place[i], found = (1, int(b[0])), True
            elif len(a) == 1 and not len(b) and A[i, a[0]] == 1 and int(a[0]) in place:
                d, j = place[int(a[0])]
                place[i], found = (d + 1, j), True
    core = np.array([i for i in range(n) if i not in place], dtype=np.intp)
    depth = max((d for d, _ in place.values()), default=0)
    early, direct = np.zeros((depth + 1, len(core), B.shape[1])), np.zeros((depth + 1, *model.D.shape))
    early[0], direct[0] = B[core], model.D
    for i, (d, j) in place.items():
        early[d, :, j] += A[core, i]
        direct[d, :, j] += model.C[:, i]
    return _Delayed(core, early, direct)


def _in_blocks(A: Array) -> _Blocks:
    """Components of up to two states are balanced by powers of two, others go into real eigenvectors."""
    n = len(A)
    T, inverse = np.zeros((n, n)), np.zeros((n, n))
    pairs: list[list[int]] = []
    single: list[int] = []
    at = 0
    count, label = connected_components(sp.csr_matrix(A != 0), directed=False) if n else (0, np.zeros(0))
    for k in range(count):
        of = np.flatnonzero(label == k)
        own, size = A[np.ix_(of, of)] - np.eye(len(of)), len(of)
        if size <= 2:
            _, (factor, _) = la.matrix_balance(own, permute=False, separate=True)
            T[of, at : at + size], inverse[at : at + size, of] = np.diag(factor), np.diag(1 / factor)
            twos = [size == 2]
        else:
            V, twos = _real_eigenvectors(own)
            T[of, at : at + size], inverse[at : at + size, of] = V, np.linalg.inv(V)
        for is_pair in twos:
            (pairs.append([at, at + 1]) if is_pair else single.append(at))
            at += 2 if is_pair else 1
    order = [i for pair in pairs for i in pair] + single
    odd = np.zeros((n, len(order) % 2))
    T, inverse = np.hstack([T[:, order], odd]), np.vstack([inverse[order], odd.T])
    more = inverse.astype(np.longdouble)  # as the inverse is a rounded one, and products of mixed states cancel
    more = more @ (2 * np.eye(n) - T @ more)
    whole = (more @ (A - np.eye(n)) @ T).astype(float)
    change = np.zeros((len(whole) // 2, 2, 2))
    for k in range(len(change)):
        change[k] = whole[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
        if 2 * k >= 2 * len(pairs):
            change[k] = np.diag(change[k].diagonal())
    if odd.size:
        change[-1, 1, 1] = -1.0
    mixed = np.array([np.count_nonzero(row) > 1 for row in inverse])
    lost = np.abs(whole - la.block_diag(*change))
    if odd.size:
        lost[-1, -1] = 0.0
    lost += mixed[:, None] * 4 * n * np.finfo(np.longdouble).eps * (np.abs(inverse) @ np.abs(A) @ np.abs(T))
    return _Blocks(change, T, more.astype(float), lost)


def _real_eigenvectors(change: Array) -> tuple[Array, list[bool]]:
    """Real and imaginary parts of eigenvectors (n, n), and which of these are pairs. Raises OptionError where they are
    all but dependent."""
    balanced, (factor, _) = la.matrix_balance(change, permute=False, separate=True)
    values, vectors = np.linalg.eig(balanced)
    columns, twos = list[Array](), list[bool]()
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag > 0:
            columns += [vector.real, -vector.imag]
        elif value.imag == 0:
            columns.append(vector.real)
        if value.imag >= 0:
            twos.append(bool(value.imag > 0))
    V = np.array(columns).T
    if not np.linalg.cond(V) < DEPENDENT_POLES:
        raise OptionError(
            "poles all but coincide, so that states do not come apart into blocks: take the modal form, or keep fewer"
        )
    return factor[:, None] * V, twos


class _Gains(NamedTuple):
    """Sums over all steps of absolute responses: `largest` (n, m) of states to inputs, `held` (b, 2, 2) of the states
    of a block to each other's changes, `read` (p, n) of outputs to changes of states."""

    largest: Array
    held: Array
    read: Array

    def scaled(self, by: Array) -> _Gains:
        """In states `by` (n,) times as large, the same for both of a block."""
        return _Gains(self.largest * by[:, None], self.held, self.read / by)


def _sums(change: Array, C: Array, B: Array) -> _Gains:
    """Sums of |L A^k h| (theory eq. X8), the rest after K steps bounded by sums of |L A^k| times |A^K h|. Raises
    SolverError where motion does not decay."""
    b, p = len(change), len(C)
    A = np.eye(2) + change
    first, late = np.zeros(B.shape[1:]), B[0]
    for later in B[1:]:
        first += np.abs(late)
        late = (A @ late.reshape(b, 2, -1)).reshape(late.shape) + later
    reads = np.concatenate([np.broadcast_to(np.eye(2), (b, 2, 2)), C.reshape(p, b, 2).transpose(1, 0, 2)], axis=1)
    drives = np.concatenate([np.broadcast_to(np.eye(2), (b, 2, 2)), late.reshape(b, 2, -1)], axis=2)
    total = np.stack([_block_sums(*of) for of in zip(A, reads, drives, strict=True)])
    first += total[:, :2, 2:].reshape(first.shape)
    return _Gains(first, total[:, :2, :2], total[:, 2:, :2].transpose(1, 0, 2).reshape(p, 2 * b))


def _block_sums(A: Array, L: Array, h: Array) -> Array:
    """Sums (q, w) of |L A^k h| over k of one block, the first columns of h being 1."""
    powers = np.empty((CHUNK, 2, 2))
    powers[0] = np.eye(2)
    for k in range(1, CHUNK):
        powers[k] = powers[k - 1] @ A
    over = powers[-1] @ A
    total, ahead, steps, left = np.zeros((len(L), h.shape[1])), L @ powers, 0, np.eye(2)
    ends = np.abs(left)
    while steps < LONGEST:
        total += np.abs(ahead @ h).sum(axis=0)
        steps, left = steps + CHUNK, over @ left
        ahead, ends = (L @ left) @ powers, np.abs(left)
        if np.linalg.norm(ends, np.inf) <= DECAYED:
            break
    if not np.linalg.norm(ends, np.inf) < 1:
        pole = np.abs(la.eigvals(A)).max()
        raise SolverError(
            f"a pole of size {pole:.9g} does not decay within {LONGEST} steps, so that nothing is proven of rounding:"
            " give everything some damping, hold what floats, or take longer steps"
        )
    return (1 + IN_SUMS) * (total + total[:, :2] @ np.linalg.inv(np.eye(2) - ends) @ np.abs(left @ h))


def _bound(gains: _Gains, lost: Array, exact: _Steps, rounded: _Steps, m: int) -> tuple[Array, Array]:
    """What outputs may be off by per unit of each input (p, m), and beside that (p,) (theory eqs. X6-X9).

    Inputs are summed before states: a product with a state is rounded itself and in two sums, what the state carries is
    left out of it, and its sum with that is rounded. States that rounding makes larger are rounded as such.
    """
    (change, B, C, D), (n, w) = exact, exact.B.shape
    near = _Steps(*(X.astype(float) for X in rounded))
    block, block_near = (la.block_diag(*X) for X in (change, near.change))

    def by_input(X: Array) -> Array:
        return X.reshape(len(X), -1, m).sum(axis=1)

    def rounding(terms: int) -> float:
        return terms * UNIT / (1 - terms * UNIT)

    moved = lost + np.abs(block_near - block) + rounding(5) * np.abs(block_near) + 2 * UNIT**2 * np.eye(n)
    own = by_input(np.abs(near.B - B) + rounding(3 + w) * np.abs(near.B))
    again = la.block_diag(*gains.held) @ moved
    if not np.abs(la.eigvals(again)).max() < MOST:
        raise SolverError("motion decays too slowly for the digits of float32: give it damping, or take longer steps")
    off = np.linalg.solve(np.eye(n) - again, la.block_diag(*gains.held) @ (moved @ gains.largest + own))
    values = gains.largest + off
    sums = rounding(n + w) * (1 + 2 * UNIT) + UNIT
    bound = gains.read @ (moved @ values + own) + (np.abs(near.C - C) + sums * np.abs(near.C)) @ values
    bound += by_input(np.abs(near.D - D) + sums * np.abs(near.D))
    small = 8 * (n + w) * TINY
    return (1 + IN_SUMS) * bound, small * (2 * gains.read.sum(axis=1) + np.abs(near.C).sum(axis=1) + 1)


def _largest_gain(model: StateSpace) -> Array:
    """The largest of |H| (p, m) at rest and at the frequencies of poles."""
    assert model.dt is not None
    poles = model.poles()
    hz = np.abs(np.angle(poles[np.abs(poles) > 0])) / (2 * np.pi * model.dt)
    return np.abs(model.frequency_response(np.unique(np.append(hz, 0.0)))).max(axis=0)
