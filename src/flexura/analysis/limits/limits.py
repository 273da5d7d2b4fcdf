"""Where a linear result stops holding: rotations, deflections, stresses, and what drives it, against their limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.strain import (
    YieldRatios,
    bent_plates,
    deformations,
    element_motions,
    end_forces,
    largest_in_parts,
    ratios_to_yield,
    yield_ratios,
)
from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import Diagnostic
from flexura.structure import FullOrderModel, InputPort, Ports
from flexura.tables import quantity

LARGE_ROTATION = 0.1
"""Rotation, rad, from which sin and cos of it are no longer it and one: they are off by 0.2 % and 0.5 %."""

LARGE_DEFLECTION = 0.1
"""Deflection over length of a member from which shortening and stiffening show: the leaves of a parallel guide are then
shorter by 0.6 % of their length."""

STIFFER_SHEET = 0.02
"""Part of the force of a sheet along its normal, by stretching, that is told."""

HINT = "the theory is linear, and motions are small in it"

LIMIT_ROUND_OFF = 1e-9
"""Relative distance beyond a limit that is round-off."""

DATA_SHEET_DIGITS = 1e-4
"""Relative distance beyond the range of a command that the digits of a data sheet leave: it is at its limit."""

ROWS_AT_A_TIME = 64
"""Rows that are evaluated at a time, those of the largest bounds first."""

LARGEST_BLOCK = 4_000_000
"""Numbers that are held at a time."""

MOST_STATES = 2048
"""States whose stresses are worked out, those of the largest bounds first."""

UNIT_FORCES = np.vstack([np.eye(6), np.eye(6)[1:3]])
"""Internal forces that are looked at one by one: each alike at both ends of an element, and shear that changes."""


@dataclass(frozen=True)
class States:
    """Displacements u (n, N) of a model: `columns` (n, c) times `amplitudes` (c, N), or the columns themselves.

    `when` says of the state with a number when or where it is, with a space before it, e.g. ` at 0.01 s`.
    """

    model: FullOrderModel
    columns: Array
    amplitudes: Array | None = None
    when: Callable[[int], str] = lambda _: ""

    @property
    def count(self) -> int:
        """Number N of states."""
        return (self.columns if self.amplitudes is None else self.amplitudes).shape[1]

    def at(self, numbers: NDArray[np.intp]) -> Array:
        """Displacements (n, k) in some states."""
        if self.amplitudes is None:
            return self.columns[:, numbers]
        return self.columns @ self.amplitudes[:, numbers]

    def of(self, row: Array) -> Array:
        """What a row (n,) reads (N,)."""
        read = row @ self.columns
        return read if self.amplitudes is None else read @ self.amplitudes


class _Worst(NamedTuple):
    """The row and the state in which a measure is largest, and its value there."""

    row: int
    state: int
    value: float


def motion_limits(states: States) -> tuple[Diagnostic, ...]:
    """Rotations above 0.1 rad, members whose ends move against each other by a tenth of their length, and sheets that
    stretching would stiffen.

    The motion of a member's end is read in a frame that moves and turns with the other end, so that rigid motions do
    not count; of both ends the larger counts. One warning for each, with the worst place and state.
    """
    if not states.columns.size:
        return ()
    return (*_rotation(states), *_deflection(states), *_sheets(states))


def _rotation(states: States) -> Iterator[Diagnostic]:
    topology = states.model.plan.topology
    roots = np.flatnonzero((topology.root == np.arange(topology.n_nodes)) & topology.has_position)
    rows = states.model.node_displacements(states.columns)[roots, 3:]
    worst = largest(rows, np.full(len(roots), LARGE_ROTATION), states)
    if worst is not None:
        name, inside, _ = topology.node_names[roots[worst.row]].partition("[")
        angle = worst.value * LARGE_ROTATION
        most = "up to " if inside else ""
        text = f"{name} turns by {most}{angle:.3g} rad{states.when(worst.state)}, above {LARGE_ROTATION:g} rad: {HINT}"
        yield Diagnostic("rotation", name, angle, LARGE_ROTATION, "rad", text)


def _deflection(states: States) -> Iterator[Diagnostic]:
    names, length, rows = member_rows(states.model, states.columns)
    worst = largest(rows, LARGE_DEFLECTION * length, states)
    if worst is not None:
        name, L = names[worst.row // 2], float(length[worst.row])
        ratio = worst.value * LARGE_DEFLECTION
        shift = ratio * L
        text = (
            f"{name} is deflected by {quantity(shift, 'm', 4)}{states.when(worst.state)}, {ratio:.3g}"
            f" times its length of {quantity(L, 'm', 4)}, above {LARGE_DEFLECTION:g}: {HINT}"
        )
        yield Diagnostic("displacement", name, shift, LARGE_DEFLECTION * L, "m", text)


def _sheets(states: States) -> Iterator[Diagnostic]:
    moved = states.model.node_displacements(states.columns)
    sheets = [bent for bent in bent_plates(states.model, moved) if bent.plate is None and bent.stiffening > 0]
    if not sheets:
        return
    scale = np.array([np.sqrt(STIFFER_SHEET / bent.stiffening) for bent in sheets])
    worst = largest(np.stack([bent.deflection for bent in sheets]), scale, states)
    if worst is not None:
        bent, stiffer = sheets[worst.row], STIFFER_SHEET * worst.value**2
        text = (
            f"sheet {bent.name} moves along its normal by {worst.value * scale[worst.row]:.3g} times its thickness"
            f"{states.when(worst.state)}, where stretching would add about {100 * stiffer:.2g} % to its force"
        )
        yield Diagnostic("stiffness", bent.name, stiffer, STIFFER_SHEET, "1", text)


def member_rows(model: FullOrderModel, columns: Array) -> tuple[list[str], Array, Array]:
    """Names of all placed members and superelements, their lengths (2k,), and the motion (2k, 3, c) of each of their
    ends seen from the other."""
    names: list[str] = []
    lengths, rows = [np.empty(0)], [np.empty((0, 3, columns.shape[1]))]
    posed = model.design.posed
    if posed is not None:
        names, node, arm, position = posed.member_ends()
        u = model.node_displacements(columns)
        ends = rigid_arm(arm) @ np.concatenate([u, np.zeros((1, *u.shape[1:]))])[node]
        apart = position[:, 1] - position[:, 0]
        rows.append(_relative_motion(ends[:, 0], ends[:, 1], apart))
        lengths.append(np.repeat(np.linalg.norm(apart, axis=1), 2))
    for name in model.matrices:
        part, placed = model.plan.parts[name], model.plan.topology.copies[name]
        if part.members and posed is None:
            length = model.geometry.parts[name].length
            first = element_motions(model, name, columns, part.first[:-1])[:, :, :6]
            last = element_motions(model, name, columns, part.first[1:] - 1)[:, :, 6:]
            rows.append(_relative_motion(first, last, length[:, None] * np.array([1.0, 0.0, 0.0])))
            lengths.append(np.tile(np.repeat(length, 2), len(placed.paths)))
            names += [".".join((*path, member)) for path in placed.paths for member in part.members]
        if part.superelements:
            u, x = model.node_displacements(columns), model.positions
            for superelement, a, b in _superelement_ends(model, name):
                if (length := float(np.linalg.norm(x[b] - x[a]))) > 0:
                    rows.append(_relative_motion(u[a], u[b], x[b] - x[a]))
                    lengths.append(np.array([length, length]))
                    names.append(superelement)
    return names, np.concatenate(lengths), np.concatenate(rows)


def _superelement_ends(model: FullOrderModel, name: str) -> Iterator[tuple[str, int, int]]:
    """By placed superelement of a prototype, its first node and each other one."""
    part, placed = model.plan.parts[name], model.plan.topology.copies[name]
    for offset, path in zip(placed.offset, placed.paths, strict=True):
        for key, nodes in ((key, own.nodes) for key, own in part.superelements.items()):
            first, *others = (offset + node for node in nodes if node < part.n_positioned)
            yield from ((".".join((*path, key)), first, other) for other in others)


def _relative_motion(first: Array, last: Array, apart: Array) -> Array:
    """Translations (2k, 3, c) of each of two ends (..., 6, c) seen in a frame that moves with the other; `apart`
    (..., 3) is the arm from the first to the last."""
    seen = last - rigid_arm(apart) @ first, first - rigid_arm(-apart) @ last
    return np.stack([motion[..., :3, :] for motion in seen], axis=-3).reshape(-1, 3, first.shape[-1])


def largest(rows: Array, scale: Array, states: States) -> _Worst | None:
    """The largest length of vectors rows (r, 3, c) times amplitudes over their scale (r,), if it is above one.

    Rows are taken in order of a bound, the lengths of what each column can add at most, until none can be larger.
    """
    if states.amplitudes is None:
        size = np.sqrt((rows**2).sum(axis=1)) / scale[:, None]
        if not size.size or not size.max() > 1 + LIMIT_ROUND_OFF:
            return None
        row, state = np.unravel_index(int(size.argmax()), size.shape)
        return _Worst(int(row), int(state), float(size[row, state]))
    peak = np.abs(states.amplitudes).max(axis=1, initial=0.0)
    bound = np.sqrt(((np.abs(rows) @ peak) ** 2).sum(axis=1)) / scale
    order, worst, least = np.argsort(-bound), None, 1 + LIMIT_ROUND_OFF
    step = max(LARGEST_BLOCK // (3 * ROWS_AT_A_TIME), 1)
    for first in range(0, len(order), ROWS_AT_A_TIME):
        block = order[first : first + ROWS_AT_A_TIME]
        if not bound[block[0]] > least:
            break
        for start in range(0, states.count, step):
            moved = rows[block].reshape(-1, rows.shape[2]) @ states.amplitudes[:, start : start + step]
            size = np.sqrt((moved.reshape(len(block), 3, -1) ** 2).sum(axis=1)) / scale[block, None]
            if size.max() > least:
                row, state = np.unravel_index(int(size.argmax()), size.shape)
                least = float(size[row, state])
                worst = _Worst(int(block[row]), int(state) + start, least)
    return worst


def stress_limits(states: States, gravity: Sequence[float] | None = None) -> tuple[Diagnostic, ...]:
    """Members stressed beyond the yield stress of their material, notch factors included (see `member_stresses`).

    The stress of a sum of states is at most the sum of their stresses, which rules out most members and states; those
    left are worked out, the largest bounds first, 2048 at most. One warning, with the worst member and state, which
    says so where states are left that might be worse.
    """
    numbers, bound = _candidates(states, gravity)
    worst, beyond, least, names = None, 0, 1 + LIMIT_ROUND_OFF, ()
    for first in range(0, min(len(numbers), MOST_STATES), ROWS_AT_A_TIME):
        block = numbers[first : first + ROWS_AT_A_TIME]
        if not bound[block[0]] > least:
            break
        yields = yield_ratios(states.model, states.at(block), gravity)
        names, ratio = yields.names, _finite(yields)
        if ratio.size and ratio.max() > least:
            member, state = np.unravel_index(int(ratio.argmax()), ratio.shape)
            least = float(ratio[member, state])
            worst, beyond = _Worst(int(member), int(block[state]), least), int((ratio.max(axis=1) > 1).sum())
    rest = len(numbers) - MOST_STATES
    left = ""
    if rest > 0 and bound[numbers[MOST_STATES]] > least:
        left = f"the stresses of {rest} other states, which may be worse, were not worked out"
    if worst is None:
        text = f"whether anything yields is not known: {left}"
        return (Diagnostic("stress", "", float(rest), 0.0, "1", text),) if left else ()
    name = names[worst.row]
    others = f", and {beyond - 1} other member{'s' if beyond > 2 else ''} beyond it" if beyond > 1 else ""
    text = f"{name} is stressed to {times(least)} times its yield stress{states.when(worst.state)}{others}"
    text += f"; {left}" if left else ""
    return (Diagnostic("stress", name, least, 1.0, "1", text),)


def _candidates(states: States, gravity: Sequence[float] | None) -> tuple[NDArray[np.intp], Array]:
    """States that may be stressed beyond yield, the largest bounds first, and bounds (N,) on the stress over yield.

    Without amplitudes, one bound holds for all states; where it rules out none, those with most strain energy come
    first.
    """
    if states.amplitudes is None:
        K, u = states.model.K, states.columns
        if states.count > len(UNIT_FORCES) and not (_together(states.model, u, gravity) > 1).any():
            return np.empty(0, dtype=np.intp), np.zeros(states.count)
        energy = np.einsum("nk,nk->k", u, K @ u) if states.count > MOST_STATES else np.zeros(states.count)
        return np.argsort(-energy, kind="stable"), np.full(states.count, np.inf)
    peak = np.abs(states.amplitudes).max(axis=1, initial=0.0)
    each = _finite(yield_ratios(states.model, states.columns * peak))
    there = np.zeros((len(each), 1))
    if states.model.plan.is_posed:  # what is there without motion is in every column
        there = _finite(yield_ratios(states.model, np.zeros((states.model.order, 1))))
        each = each + there
    may_yield = each.sum(axis=1) + there[:, 0] > 1
    if not may_yield.any():
        return np.empty(0, dtype=np.intp), np.zeros(states.count)
    share = np.abs(states.amplitudes) / np.where(peak > 0, peak, 1.0)[:, None]
    bound = (each[may_yield] @ share + there[may_yield]).max(axis=0)
    return np.argsort(-bound)[: int((bound > 1).sum())], bound


def _finite(yields: YieldRatios) -> Array:
    """Stress over yield stress (m, k), zero where it is not known."""
    return np.where(np.isfinite(yields.ratio), yields.ratio, 0.0)


def _together(model: FullOrderModel, u: Array, gravity: Sequence[float] | None) -> Array:
    """Bounds (m,) on the stress over yield of members and parts in all states u (n, k), NaN where yield is not known.

    Stress is a norm of internal forces, at most the sum of what each of them gives alone at its largest, and
    of what shear that changes along an element adds to its moments; of parts it is one of their coordinates.
    """
    g = None if gravity is None else np.asarray(gravity, dtype=float)

    def forces(name: str) -> tuple[Array, Array]:
        start, end = end_forces(model, name, u, g)
        most = np.maximum(np.abs(start), np.abs(end)).max(axis=-1, keepdims=True) * UNIT_FORCES[:6].T
        changed = np.abs(end - start).max(axis=-1, keepdims=True) * UNIT_FORCES[6:].T / 2
        return np.concatenate([most, -changed], axis=-1), np.concatenate([most, changed], axis=-1)

    of_members = _finite(ratios_to_yield(model, forces, {}, len(UNIT_FORCES))).sum(axis=1)
    alone = {name: np.diag(np.abs(d).max(axis=1)) for name, d in deformations(model, u).items()}
    return np.append(of_members, [sizes.sum() / limit for _, sizes, _, limit in largest_in_parts(model, alone)])


def merged(warnings: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The worst of each kind, of commands and forces for each place and side."""
    worst: dict[tuple[str, str, bool], Diagnostic] = {}
    for new in warnings:
        each = new.kind in ("command", "force")
        key = (new.kind, new.place if each else "", each and new.value < 0)
        if key not in worst or abs(new.value) * abs(worst[key].limit) > abs(worst[key].value) * abs(new.limit):
            worst[key] = new
    return tuple(worst.values())


def command_limits(
    inputs: Sequence[InputPort], commands: Array, when: Callable[[int], str] = lambda _: ""
) -> tuple[Diagnostic, ...]:
    """Commands (m, N) to inputs beyond their range, above and below: a stack's free stroke or blocked force, or the
    limit of a force or moment."""
    warnings = []
    for port, u in zip(inputs, commands, strict=True):
        low, high = port.limits
        for state, limit in ((int(u.argmax()), high), (int(u.argmin()), low)):
            value = float(u[state])
            side, margin = np.sign(limit) or -1.0, DATA_SHEET_DIGITS * (high - low)
            if not (np.isfinite(limit) and side * (value - limit) > margin):
                continue
            name, unit = port.channel.name, port.channel.unit
            head = f"{name} is driven with {quantity(value, unit, 4)}{when(state)}"
            if port.stiffness is None:
                text = f"{head}, {times(value / limit)} times its limit of {quantity(high, unit, 4)}"
            elif value > high:
                text = f"{head}, {times(value / high)} times what gives its free stroke, {quantity(high, unit, 4)}"
            else:
                text = f"{head}, below its range from 0 to {quantity(high, unit, 4)}: a stack is driven to one side"
            warnings.append(Diagnostic("command", name, value, limit, unit, text))
    return tuple(warnings)


def force_limits(states: States, ports: Ports, commands: dict[str, Array]) -> tuple[Diagnostic, ...]:
    """Forces in piezo stacks, driven or not, beyond their blocked force: stiffness times free stroke."""
    warnings = []
    for port in ports.inputs(ports.actuators):
        if port.stiffness is None or not np.isfinite(port.limits[1]):
            continue
        name, blocked = port.channel.name, port.stiffness * port.stroke * port.limits[1]
        unloaded = port.stiffness * port.stroke * commands.get(name, np.zeros(1))
        force = unloaded - port.stiffness * states.of(port.row)
        state = int(np.abs(force).argmax())
        value = float(force[state])
        if abs(value) > blocked * (1 + DATA_SHEET_DIGITS):
            pushes = "pushes" if value > 0 else "is pulled"
            text = (
                f"{name} {pushes} with {quantity(abs(value), 'N', 4)}{states.when(state)}, {times(value / blocked)}"
                f" times its blocked force of {quantity(blocked, 'N', 4)}"
            )
            warnings.append(Diagnostic("force", name, value, blocked if value > 0 else -blocked, "N", text))
    return tuple(warnings)


def times(ratio: float) -> str:
    """How many times something is its limit, in as many digits as tell it from one."""
    return next(text for k in (3, 5, 10) if (text := f"{abs(ratio):.{k}g}") != "1" or k == 10)
