"""Piezo stacks that move the platform along what is wished: where they stand, with which amplifiers, how far they go.

Stacks push at the platform along one axis, or by turns along two axes of the base. Along the normal of the base they
stand below the platform, evenly around its middle at some azimuth and distance; along another axis they lie beside the
platform, or below it at a lug of it.
Each topology is combined with each way to make their stroke longer that may reach: none, a bridge, a rhombus, a lever.
It may where its ratio, at the first sizes that fit, is at least the way of the platform at the drive over the free
stroke. A drive is placed where it is first clear of the limbs as these are drawn first, and of what is below their
feet. Where a translation along the drives is all that is free bridges and rhombi may begin at the platform itself,
which they then hold, beside limbs or alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.synthesis.amplifiers import (
    AMPLIFIERS,
    BRIDGE_BLOCK,
    BRIDGE_WIDTH,
    Amplifier,
    Drive,
    Size,
    Top,
    hull_of,
)
from flexura.synthesis.fitting import obstacles
from flexura.synthesis.patterns import ALONG, LEAST_AWAY, Pattern
from flexura.synthesis.topologies import Topology
from flexura.synthesis.wish import DOFS, ROOM, Room, Stack, Wish

DISTANCES = (0.7, 0.85, 0.5)
"""Of drives from the middle, over the way to the edge of the platform."""

AZIMUTHS = 24
"""Steps of a turn."""

SPENT = 0.92
"""Of the stroke of stacks at a distance at which they alone reach; model errors take the rest."""

AT_LUGS = (0.6, 0.3, 0.0)
"""How far lugs below the platform are from its middle towards where drives push, over the way to its edge."""

LONGEST_ROD, SHORTEST_ROD = 3.0, 0.8
"""Over the edge of the stack."""

NARROW = 0.35
"""Half the width of a platform at whose sides arms begin, over the length of the stack, at most."""

AMPLE = 1.15
"""How many times as far as is needed stacks alone have to go for amplifiers not to be listed."""

_GRID = np.array(list(product(np.linspace(-1.0, 1.0, 9), repeat=3)))


class _Stand(NamedTuple):
    """Where drives may stand: their tips (n, 3), m, and axes (n, 3, 3), and whether they are at lugs below."""

    heads: Array
    frames: Array
    hangs: bool


def driven(listed: Sequence[Topology], room: Room, wish: Wish, thinnest: float) -> list[Topology]:
    """Topologies with each of the amplifiers that may reach what is wished and have a place beside the limbs, as they
    were listed, the plainest amplifier first; before them amplifiers that hold the platform alone. None where there are
    neither limbs nor amplifiers that do. Raises OptionError where none reaches, with the reason."""
    assert wish.drives is not None
    options, least = _options(room, wish, thinnest)
    if not options:
        if not listed:
            return []
        raise OptionError(_nothing_reaches(room, wish, thinnest, least))
    found = [_alone(drives[0]) for drives in options.values() if drives[0].top is not None]
    far, clear = LEAST_AWAY * room.size, dict[int, dict[str, Array]]()
    for pattern in {id(each): each for own in listed for each in own.patterns}.values():
        points = obstacles(pattern, room, thinnest)
        clear[id(pattern)] = {
            name: np.array([own.away(points) > far and _is_cut_alike(pattern, own, wish) for own in all_])
            for name, all_ in options.items()
        }
    for own, (name, drives) in product(listed, options.items()):
        places = np.all([clear[id(pattern)][name] for pattern in own.patterns], axis=0)
        if places.any():
            drive = drives[int(places.argmax())]
            found.append(replace(own, name=f"{own.name}, moved by {drive.name}", drive=drive))
    if listed and not found:
        kinds = " or ".join(next(iter(drives)).name for drives in options.values())
        raise OptionError(
            f"wish.drives: {kinds} would reach, and have no place beside the limbs of any of the {len(listed)}"
            " topologies; give it more room, or a shorter stack"
        )
    return found


def _alone(drive: Drive) -> Topology:
    """Amplifiers that hold the platform by themselves."""
    return Topology((), 0, drive.name_alone, drive)


def _is_cut_alike(pattern: Pattern, drive: Drive, wish: Wish) -> bool:
    """Whether amplifiers that hold the platform can be cut along one line with the limbs, where all is."""
    if drive.top is None or wish.make.process != "wire-cut":
        return True
    return bool((np.abs(pattern.turns() @ pattern.axes[:, 1] @ drive.frames[0][:, 1]) > 1 - ALONG).all())


def _options(room: Room, wish: Wish, thinnest: float) -> tuple[dict[str, list[Drive]], float]:
    """By amplifier, the drives that fit the envelope beside the platform and each other; and the least ratio that is
    needed anywhere. Raises OptionError where so many stacks cannot move what is wished."""
    options: dict[str, list[Drive]] = {}
    least = np.inf
    for amplifier in AMPLIFIERS:
        for stand in _stands(room, wish, amplifier):
            for holds in (True, False) if amplifier.holds and _is_straight(room, stand) else (False,):
                drive, needed = _fitted(stand, amplifier, room, wish, thinnest, holds)
                least = min(least, needed)
                if drive is not None:
                    options.setdefault(f"{amplifier.name} {holds}", []).append(drive)
        if options and AMPLE * least <= 1.0:
            break
    if least == np.inf:
        own, strokes = wish.drives, _strokes(wish)
        assert own is not None
        raise OptionError(
            f"wish.drives: {own.count} piezo stack{'s' * (own.count > 1)} along {own.along} cannot move each of"
            f" {', '.join(strokes)} by itself; freedoms with strokes need as many stacks, that push along them or"
            " beside their axes"
        )
    return options, least


def _is_straight(room: Room, stand: _Stand) -> bool:
    """Whether a translation along the drives is all that is free, so that they may hold the platform."""
    free = room.freedoms.basis
    return free.shape[1] == 1 and not stand.hangs and abs(free[:3, 0] @ stand.frames[0][:, 2]) > 1 - ALONG


def _stands(room: Room, wish: Wish, amplifier: Amplifier) -> Iterator[_Stand]:
    """Where drives may stand, those that move what is wished the farthest first; lying ones where the amplifier is
    turned about their lines by each quarter."""
    wanted = wish.drives
    assert wanted is not None
    quarters = 2 if amplifier.is_mirrored else 4
    ways = {own: room.turn.T @ np.eye(3)["xyz".index(own)] for own in wanted.axes}
    if abs(ways[wanted.axes[0]][2]) > 1 - ALONG:
        yield from _below(room, wish, wanted.count, quarters)
        return
    counts = [wanted.axes.count(own) for own in ways]
    shares = DISTANCES if max(counts) > 1 else (0.0,)
    for hangs, share, sides in product((False, True), shares, product((1.0, -1.0), repeat=len(ways))):
        for at, k in product(AT_LUGS if hangs else (None,), range(quarters)):
            lines = zip(ways.values(), sides, counts, strict=True)
            each = [_lying(room, side * a, n, share, at, k) for a, side, n in lines]
            heads, frames = (np.concatenate(own) for own in zip(*each, strict=True))
            yield _Stand(heads, frames, hangs)


def _lying(room: Room, a: Array, count: int, share: float, at: float | None, quarter: int) -> tuple[Array, Array]:
    """Tips (n, 3), m, and axes (n, 3, 3) of so many that push along a, evenly across the platform as far from its
    middle as some share of the way to its edge: at its side, or below it `at` another share."""
    up = np.array([0.0, 0.0, 1.0])
    b = np.cross(up, a) * np.sign(a.sum())
    across = share * np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)
    edge_a, edge_b = (float(np.abs(room.platform[:2] @ np.abs(d[:2]))) for d in (a, b))
    face = np.sqrt(1 - across**2) if room.shape == "cylinder" else np.ones(count)
    x = -face if at is None else at * np.ones(count)
    first = (b, up)[quarter % 2] * (1.0 if quarter < 2 else -1.0)
    start = room.middle - (0.0 if at is None else room.platform[2]) * up
    heads = start + edge_a * x[:, None] * a + edge_b * across[:, None] * b
    return heads, np.tile(np.array([first, np.cross(a, first), a]).T, (count, 1, 1))


def _below(room: Room, wish: Wish, count: int, quarters: int) -> Iterator[_Stand]:
    """Upright ones, evenly around the middle: first as far from it as stacks alone reach, the stiffer against tilts."""
    low = np.array([*room.middle[:2], room.middle[2] - room.platform[2]])
    for share in (0.0, None, *DISTANCES) if count == 1 else (None, *DISTANCES):
        for n in range(AZIMUTHS // 2 if share == 0.0 else AZIMUTHS // count):
            angles = 2 * np.pi * (n / AZIMUTHS + np.arange(count) / count)
            edge = _edge(room, float(angles[0]), count)
            radial = edge * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
            away = share if share is not None else _reaching(low, radial, room, wish)
            for k in range(1 if away == 0.0 else quarters if away < 1 - ALONG else 0):
                turned = angles + np.pi / 2 * (k + 1)
                x = np.stack([np.cos(turned), np.sin(turned), 0 * angles], axis=1)
                z = np.tile([0.0, 0.0, 1.0], (count, 1))
                yield _Stand(low + away * radial, np.stack([x, np.cross(z, x), z], axis=2), False)


def _reaching(low: Array, radial: Array, room: Room, wish: Wish) -> float:
    """How far from a point (3,) along ways (n, 3) stacks alone reach, with `SPENT` of their stroke; infinite where that
    does not matter."""
    assert wish.drives is not None
    frames = np.tile(np.eye(3), (len(radial), 1, 1))
    outs = np.linspace(0.1, 0.95, 86)
    way = SPENT * wish.drives.stack.free_stroke / 2
    most = np.array([_displacements(low + out * radial, frames, room, wish)[1] for out in outs])
    if not (most <= way).any() or not (np.isinf(most) | (most > way)).any():
        return np.inf
    return float(outs[np.where(most <= way, most, -np.inf).argmax()])


def _edge(room: Room, angle: float, count: int) -> float:
    """How far it is from the middle of the platform to its edge, where so many around it are below it, the first at an
    azimuth, m."""
    a, b = (float(own) for own in room.platform[:2])
    if count > 2 or room.shape == "cylinder":
        return min(a, b)
    with np.errstate(divide="ignore"):
        return float(min(a / abs(np.cos(angle)), b / abs(np.sin(angle))))


def _fitted(
    stand: _Stand, amplifier: Amplifier, room: Room, wish: Wish, thinnest: float, holds: bool
) -> tuple[Drive | None, float]:
    """The plainest drive of a kind at a stand that reaches and fits, and the ratio that is needed there; infinite where
    what is wished cannot be moved from there."""
    assert wish.drives is not None
    top = _top(stand, room, wish.drives.stack) if holds else None
    stack = wish.drives.stack
    rod = SHORTEST_ROD * stack.edge
    drop, least = 0.0, _displacements(stand.heads, stand.frames, room, wish)[1] * 2 / stack.free_stroke
    up = stand.frames[0].T @ [0.0, 0.0, 1.0]
    for sizes in amplifier.sizes(stack, thinnest, rod, least if np.isfinite(least) else 1.0, top):
        first = {name: own.value for name, own in sizes.items()}
        parts = amplifier.parts(stack, "", sizes, top)
        middles, halves = hull_of(parts, first)
        if stand.hangs:
            drop = float((middles @ up + halves @ np.abs(up)).max()) + 0.15 * stack.edge
        heads = stand.heads - [0.0, 0.0, drop]
        ways, most = _displacements(heads, stand.frames, room, wish)
        needed = 2 * most / stack.free_stroke
        if not np.isfinite(needed) or amplifier.ratio(first, stack, top) < needed:
            return None, needed
        if top is None:
            free = _room_behind(heads, stand.frames, room)
            longest = float((halves - middles)[:, 2].max())
            longer = np.clip(rod + free - longest, rod, LONGEST_ROD * stack.edge)
            sizes |= {"rod": Size(longer, 0.6 * longer, 1.2 * longer)}
        shares = parts.sign * ways / most * stack.free_stroke / 2
        lug = _lug(up, drop, stack) if stand.hangs else None
        middles, halves = hull_of(parts, {name: own.value for name, own in sizes.items()})
        if lug is not None:
            middles = np.concatenate([middles, [(lug[0] + lug[1]) / 2]])
            halves = np.concatenate([halves, [(lug[1] - lug[0]) / 2]])
        where = heads, stand.frames, lug, (middles, halves)
        drive = Drive(amplifier.name, stack, sizes, *where, tuple(_strokes(wish)), shares, needed, top)
        if _fits(drive, room):
            return drive, needed
    return None, least


def _top(stand: _Stand, room: Room, stack: Stack) -> Top:
    """What arms at the platform begin at: its sides, where it is a narrow box along the stack, or a block below it."""
    x, y, z = stand.frames[0].T
    below = _room_behind(stand.heads, stand.frames, room)
    beside, deep = (_clear(room, stand.heads, stand.frames[:, :, k]) for k in (0, 1))
    half, wide = (float(room.platform @ np.abs(own)) for own in (x, y))
    e = stack.edge
    block = float(np.clip(beside - stack.length / 2, 0.6 * BRIDGE_BLOCK * e, 1.2 * BRIDGE_BLOCK * e))
    is_upright, lies_along = abs(z[2]) > 1 - ALONG, max(abs(x[:2])) > 1 - ALONG
    in_middle = np.abs((stand.heads - room.middle)[:, :2]).max() < ALONG * room.size
    if room.shape == "box" and is_upright and lies_along and in_middle and half < NARROW * stack.length:
        return Top(half, 2 * float(room.platform[2]), min(2 * wide, 2 * deep), below, beside, block)
    return Top(BRIDGE_WIDTH * e / 2, 0.0, 2 * deep, below, beside, block)


def _clear(room: Room, heads: Array, ways: Array) -> float:
    """How far it is to the envelope from heads (n, 3) to both sides along ways (n, 3), m."""
    p = heads - [0.0, 0.0, room.half[2]]
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(np.abs(ways) > ALONG, (room.half - np.abs(p)) / np.abs(ways), np.inf)
    return float(far.min())


def _displacements(heads: Array, frames: Array, room: Room, wish: Wish) -> tuple[Array, float]:
    """How far (n, f), m, tips move along their lines for each of the wished strokes, and the most that one moves for
    all at once; infinite where drives cannot move each of them by itself."""
    columns = []
    for name, stroke in _strokes(wish).items():
        d = room.turn.T @ np.eye(3)[DOFS.index(name) % 3]
        moved = np.cross(d, heads - room.about) if name[0] == "r" else np.tile(d, (len(heads), 1))
        columns.append(stroke * (moved * frames[:, :, 2]).sum(axis=1))
    ways = np.stack(columns, axis=1)
    values = np.linalg.svd(ways, compute_uv=False)
    if len(ways) < len(columns) or values[-1] < 0.05 * values[0]:
        return ways, np.inf
    return ways, float(np.abs(ways).sum(axis=1).max())


def _room_behind(heads: Array, frames: Array, room: Room) -> float:
    """How far it is from tips down their lines to the envelope, m."""
    p, v = heads - [0.0, 0.0, room.half[2]], -frames[:, :, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        way = np.where(np.abs(v) > ALONG, (np.sign(v) * room.half - p) / v, np.inf)
    clear = 0.0 if abs(v[0, 2]) > ALONG else ROOM * room.size
    return float(way.min()) - clear


def _lug(up: Array, drop: float, stack: Stack) -> tuple[Array, Array]:
    """Opposite corners of a lug that a drive pushes at, in its axes, in which `up` leads to the platform."""
    across = np.abs(np.cross(up, [0.0, 0.0, 1.0])) * stack.edge / 2
    low = -across - 0.4 * stack.edge * up
    high = across + drop * up + [0.0, 0.0, 0.6 * stack.edge]
    return np.minimum(low, high), np.maximum(low, high)


def _fits(drive: Drive, room: Room) -> bool:
    """Whether drives are in the envelope, outside of the platform, and clear of each other."""
    middles, halves = drive.boxes
    local = (middles[:, None] + _GRID * halves[:, None]).reshape(-1, 3)
    points = local @ drive.frames.transpose(0, 2, 1) + drive.heads[:, None]
    own = points[:, : (len(middles) - (drive.lug is not None)) * len(_GRID)].reshape(-1, 3)
    slight = ALONG * room.size
    if (room.outside(points.reshape(-1, 3)) > slight).any() or room.in_platform(own, slight).any():
        return False
    count = len(drive.heads)
    along = np.unique(np.round(np.abs(drive.frames[:, :, 2]), 6), axis=0)
    firsts = {0: range(1, 1 + count // 2)} if len(along) == 1 else {k: range(k + 1, count) for k in range(count)}
    return all(not of or drive.away(points[k], of) > LEAST_AWAY * room.size for k, of in firsts.items())


def _nothing_reaches(room: Room, wish: Wish, thinnest: float, least: float) -> str:
    """Why no amplifier reaches, in words."""
    assert wish.drives is not None
    stack = wish.drives.stack
    gives = []
    for amplifier in AMPLIFIERS[1:]:
        low, high = 0.0, np.log(1e3)
        for _ in range(8):
            middle = (low + high) / 2
            scaled = _scaled(wish, float(np.exp(middle)) / least)
            stands = _stands(room, wish, amplifier)
            fits = any(
                _fitted(own, amplifier, room, scaled, thinnest, holds)[0] is not None
                for own in stands
                for holds in ((True, False) if amplifier.holds and _is_straight(room, own) else (False,))
            )
            low, high = (middle, high) if fits else (low, middle)
        gives.append(
            f"a {amplifier.name} gives {np.exp(low):.2g} at most" if low else f"a {amplifier.name} has no room"
        )
    return (
        f"wish.drives: no stack reaches: what is wished takes {1e6 * least * stack.free_stroke:.4g} um at the drives, a"
        f" ratio of {least:.3g} for a free stroke of {1e6 * stack.free_stroke:.4g} um, and in this envelope"
        f" {', '.join(gives)}; give it more room, a longer stack, or less stroke"
    )


def _strokes(wish: Wish) -> dict[str, float]:
    """How far to either side, m and rad, by displacement of the platform."""
    return {name: own[name[0] == "r"] for name, own in wish.stroke.items()}


def _scaled(wish: Wish, by: float) -> Wish:
    """The wish with strokes that are so many times as long."""
    strokes = {name: {turns: by * size for turns, size in own.items()} for name, own in wish.stroke.items()}
    return wish.replaced({"stroke": strokes})


def reach(drive: Drive, wish: Wish) -> dict[str, str]:
    """That the stacks move what is wished to both ends at once, each within its free stroke, as requirements by name.

    Where stacks expand by `shares` times b each is within its stroke for all b up to one. What they give, over what is
    wished, is M b, and the diagonal of M less the size of all else in a row is to be one or more: the b at all corners
    of what is wished are then one at most (Varah 1975).
    """
    found = {}
    for k, (name, stroke) in enumerate(_strokes(wish).items()):
        rows = [_moved(drive.shares[:, j], name) for j in range(len(drive.names))]
        text = " - ".join([rows[k], *(f"abs({row})" for j, row in enumerate(rows) if j != k)])
        asked = f"{1e3 * stroke:.6g} mrad" if name[0] == "r" else f"{1e6 * stroke:.6g} um"
        found["reach" if len(_strokes(wish)) == 1 else f"reach {name}"] = f"{text} >= {asked}"
    return found


def _moved(expansions: Array, name: str) -> str:
    """What expansions (n,), m, of the stacks move along a freedom, as a formula."""
    um, text = np.round(1e6 * expansions, 5), ""
    for size in dict.fromkeys(np.abs(um[um != 0])):
        alike = np.flatnonzero(np.abs(um) == size)
        lead = um[alike[0]]
        terms = [f"{'+' if um[k] == lead else '-'} coupling(drive{k + 1}.stack, about.{name})" for k in alike]
        moved = " ".join(terms).removeprefix("+ ")
        text += f" {'+' if lead > 0 else '-'} {size:.6g} um*" + (moved if len(terms) == 1 else f"({moved})")
    return text.removeprefix(" + ") if text[1] == "+" else f"-{text[3:]}"


def motion(drive: Drive) -> dict[str, Any]:
    """The expansions of the stacks from one end of all wished strokes to the other."""
    middle, way = drive.stack.free_stroke / 2, drive.shares.sum(axis=1)
    ends = np.round(1e6 * np.stack([middle - way, middle + way], axis=1), 6) + 0.0
    return {f"drive{k + 1}.stack": {"expansion": [f"{own:.9g} um" for own in both]} for k, both in enumerate(ends)}
