"""A topology as a mechanism file: limbs with sizes to vary, the platform, what holds it, its drives and its stroke."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import scipy.linalg
from scipy.spatial.transform import Rotation

from flexura.arrays import Array
from flexura.mechanism import Mechanism, Parameter
from flexura.modelfile import described
from flexura.synthesis.amplifiers import ZERO, Drive, substructures
from flexura.synthesis.drives import motion, reach
from flexura.synthesis.fitting import drawn_first, limits_of, lug_of, posts_at
from flexura.synthesis.limbs import LEAF, PROFILES, Terms, describe_member
from flexura.synthesis.patterns import ALONG, Pattern
from flexura.synthesis.posts import Form, Post, plus, with_fixed
from flexura.synthesis.topologies import Topology
from flexura.synthesis.wish import DOFS, Make, Room, Wish, WishFile

RADIUS_LIMITS = (0.3, 0.95)
STEPS = 5
INTO = 0.03
"""How far lugs reach into a round platform, which they would touch along a line, over their edge."""

DRIVE_RADIUS = 0.7
"""Distance of drives from the axis, over the way to the edge of the platform."""


def draft(topology: Topology, file: WishFile, room: Room, name: str) -> Mechanism:
    """The mechanism of a topology, with its sizes as drawn first and their limits as parameters."""
    return described(_data(topology, file, room, name), name)


def with_values(mechanism: Mechanism, values: Mapping[str, float]) -> Mechanism:
    """A mechanism with other sizes, in four digits, within their limits."""
    parameters = {
        name: own.model_copy(update={"value": _rounded(values[name], own)}) if name in values else own
        for name, own in mechanism.parameters.items()
    }
    return mechanism.replaced({"parameters": parameters})


def _rounded(value: float, own: Parameter) -> float:
    low, high = float(own.minimum or -np.inf), float(own.maximum or np.inf)  # type: ignore[arg-type]
    return float(np.clip(float(f"{value:.4g}"), low, high))


def _data(topology: Topology, file: WishFile, room: Room, name: str) -> dict[str, Any]:
    wish = file.wish
    data: dict[str, Any] = {
        "name": name,
        "description": f"Held by {topology.name}.",
        "parameters": {},
        "nodes": {"about": _point([(None, room.turn @ room.about)])},
        "substructures": {},
        "instances": {},
        "ground": {},
    }
    carried = ["about"]
    for letter, own in zip("abc", topology.patterns, strict=False):
        data["parameters"] |= _parameters(letter, own, room, float(wish.make.thinnest))  # type: ignore[arg-type]
        data["substructures"][letter] = _substructure(letter, own, room, wish.make)
        data["instances"][letter] = _placed(letter, own, room)
        copies = f"{letter}*" if own.count > 1 else letter
        carried += [f"{copies}.lug"] if own.has_lug else [f"{copies}.{head}" for head in own.kind.heads]
    required = dict(file.required)
    move = {"about": own} if (own := _move(wish, room)) else {}
    if topology.drive is not None:
        carried += _stacks(data, topology.drive, room, wish.make.material)
        move, required = motion(topology.drive), {**reach(topology.drive, wish), **required}
    else:
        data["actuators"], drives = _drives(wish, room)
        data["nodes"] |= drives
        carried += drives
    data["bodies"] = _platform(wish, room, carried)
    if wish.platform.mass is not None:
        data["masses"] = {"payload": {"node": "platform", "mass": f"{float(wish.platform.mass):.9g} kg"}}  # type: ignore[arg-type]
    if move:
        data["motion"] = {"move": move, "steps": STEPS, "modes": 3}
    data["requirements"] = required
    return {key: value for key, value in data.items() if value}


def _parameters(letter: str, own: Pattern, room: Room, thinnest: float) -> dict[str, Any]:
    """Sizes of a pattern with their limits."""
    limits = {name: ends for name, ends in limits_of(own, room, thinnest).items() if name != own.kind.pinned}
    values = dict(drawn_first(own, room, thinnest))
    if (radius := radius_name(letter, own)) is not None:
        name = radius.removeprefix(f"{letter}_")
        low, high = (own.site.reach * k for k in RADIUS_LIMITS)
        limits[name], values[name] = (low, high), own.site.reach * own.site.out
    return {
        f"{letter}_{name}": {"value": _mm(values[name]), "minimum": _mm(low), "maximum": _mm(high)}
        for name, (low, high) in limits.items()
    }


def radius_name(letter: str, own: Pattern) -> str | None:
    """The parameter that says how far from the axis a pattern is, if there is one."""
    if own.site.where != "below" or not own.site.reach or own.pinned:
        return None
    return f"{letter}_way" if "radius" in own.kind.sizes else f"{letter}_radius"


def _substructure(letter: str, own: Pattern, room: Room, make: Make) -> dict[str, Any]:
    """One limb, in the global frame."""
    material = make.material
    turn = room.turn
    axes, radial = turn @ own.axes, turn @ own.site.axes[:, 0]
    start = turn @ own.site.head(room)
    terms: list[tuple[str | None, Array]] = [(None, start)]
    if radius := radius_name(letter, own):
        terms = [(None, start - radial * own.site.reach * own.site.out), (radius, radial)]
    fixed, drawn = own.shift(own.lug(room))

    def along(way: Terms) -> list[tuple[str | None, Array]]:
        """A way by its sizes, in the global frame."""
        named = ((f"{letter}_{size}", axes @ np.array(c)) for size, c in way.items() if size != own.kind.pinned)
        held = axes @ np.array(way.get(own.kind.pinned, (0.0, 0.0, 0.0))) * own.held
        return [(None, held), *named]

    terms += [(None, turn @ fixed), *along(drawn)]
    nodes = {name: _point([*terms, *along(node)]) for name, node in own.kind.nodes.items()}
    names = {size: f"{letter}_{size}" for size in own.kind.sizes}
    at = own.kind.points(drawn_first(own, room, float(make.thinnest)))  # type: ignore[arg-type]
    flexures, links = dict[str, Any](), dict[str, Any]()
    for name, (a, b, profile) in own.kind.members.items():
        d = at[b] - at[a]
        m = axes @ np.cross([0.0, 1.0, 0.0], d / np.linalg.norm(d))
        member = {"nodes": [a, b], "material": material} | describe_member(profile, _vector(m), names)
        if profile == LEAF and (corner := make.radius) is not None:
            member["fillet"] = _mm(corner)
        (flexures if PROFILES[profile].free else links)[name] = member
    found: dict[str, Any] = {"nodes": nodes, "flexures": flexures, "links": links, "bodies": {}}
    interface = list(own.kind.heads)
    for name, (low, high) in own.kind.blocks.items():
        block = _box(letter, own, (_forms(low), _forms(high)), axes, material, terms)
        found["bodies"][name] = block | {"carries": list(own.kind.at(name))}
    if own.has_lug:
        found["bodies"]["lug"] = _lug(letter, own, room, terms, axes, material)
        interface = ["lug"]
    named = [(None if name is None else name.removeprefix(f"{letter}_"), v) for name, v in terms]
    found["bodies"] |= {post.name: _post(letter, own, post, material) for post in posts_at(own, room, axes, named)}
    return {key: value for key, value in found.items() if value} | {"interface": interface}


def _box(
    letter: str,
    own: Pattern,
    ends: tuple[Sequence[Form], Sequence[Form]],
    axes: Array,
    material: str,
    at: Sequence[tuple[str | None, Array]] = (),
) -> dict[str, Any]:
    """A box along axes between two of its corners, about a point or the origin."""
    low, high = ([with_fixed(form, own.kind.pinned, own.held) for form in end] for end in ends)
    middle = [plus({None: 0.0}, a, b, by=0.5) for a, b in zip(low, high, strict=True)]
    edges = [plus(b, a, by=-1.0) for a, b in zip(low, high, strict=True)]
    return {
        "centre": _point([*at, *_along(letter, middle, axes)]),
        "solid": {"shape": "box", "size": [_length(letter, edge) for edge in edges], "material": material},
        "rotate": _rotation(axes),
    }


def _forms(corner: Terms) -> list[Form]:
    """A corner by its coordinates."""
    return [{size: c[k] for size, c in corner.items()} for k in range(3)]


def _along(letter: str, place: Sequence[Form], axes: Array) -> list[tuple[str | None, Array]]:
    """A point by its coordinates along axes (3, 3), in the global frame."""
    return [
        (None if name is None else f"{letter}_{name}", c * axes[:, k])
        for k, form in enumerate(place)
        for name, c in form.items()
    ]


def _post(letter: str, own: Pattern, post: Post, material: str) -> dict[str, Any]:
    """A block of the base."""
    return {
        **_box(letter, own, (post.low, post.high), post.axes, material),
        **({"held": {"face": post.held}} if post.held else {}),
        **({"carries": list(post.carries)} if post.carries else {}),
    }


def _length(letter: str, form: Form) -> str:
    """A length as the sum of a number and sizes."""
    number = form.get(None, 0.0)
    sizes = ((f"{letter}_{name}", c) for name, c in form.items() if name is not None)
    return f"{_mm(number)} {_sum(sizes, '+ ')}".strip() if abs(number) > 1e-9 else _sum(sizes)


def _lug(
    letter: str, own: Pattern, room: Room, terms: list[tuple[str | None, Array]], axes: Array, material: str
) -> dict[str, Any]:
    """What a limb beside the platform begins at: a block behind its heads along d, as wide as its flexures, which
    reaches a little into a round platform."""
    longer, edges = lug_of(own, room)
    into = own.axes.T @ own.site.axes[:, 0] * (INTO * edges[2] if room.shape == "cylinder" else 0.0)
    middle = -axes[:, 2] * edges[2] / 2 - axes @ into / 2
    edges = edges + np.abs(into)
    sums = [_sum((f"{letter}_{size}", c[k]) for size, c in longer.items() if c[k]) for k in range(3)]
    return {
        "centre": _point([*terms, (None, middle)]),
        "solid": {
            "shape": "box",
            "size": [" + ".join(filter(None, (_mm(edge), own))) for edge, own in zip(edges, sums, strict=True)],
            "material": material,
        },
        "rotate": _rotation(axes),
        "carries": list(own.kind.heads),
    }


def _placed(letter: str, own: Pattern, room: Room) -> dict[str, Any]:
    placed: dict[str, Any] = {"of": letter}
    if own.mirrored:
        middle = _point([(None, room.turn @ room.middle)])
        placed["pattern"] = {"type": "mirror", "normal": _vector(room.turn @ own.site.axes[:, 0]), "point": middle}
    elif own.count > 1:
        centre = room.turn @ np.array([*room.middle[:2], 0.0])
        placed["pattern"] = {
            "type": "circular",
            "count": own.count,
            "axis": _vector(room.turn[:, 2]),
            "centre": _point([(None, centre)]),
        }
    return placed


def _platform(wish: Wish, room: Room, carried: list[str]) -> dict[str, Any]:
    size = room.platform
    material = wish.platform.material or wish.make.material
    if room.shape == "cylinder":
        axis = "xyz"[int(np.argmax(np.abs(room.turn[:, 2])))]
        solid: dict[str, Any] = {"shape": "cylinder", "axis": axis, "diameter": _mm(2 * size[0])}
        solid |= {"length": _mm(2 * size[2]), "material": material}
    else:
        edges = np.abs(room.turn @ (2 * size))
        solid = {"shape": "box", "size": [_mm(x) for x in edges], "material": material}
    return {"platform": {"centre": _point([(None, room.turn @ room.middle)]), "solid": solid, "carries": carried}}


def _drives(wish: Wish, room: Room) -> tuple[dict[str, Any], dict[str, Any]]:
    """Voice coils that push at the platform, and the nodes at which they do."""
    own = wish.drives
    if own is None or own.is_stacks:
        return {}, {}
    actuators, nodes = {}, {}
    for k, along in enumerate(own.axes):
        angle = 2 * np.pi * k / own.count
        r = DRIVE_RADIUS * room.platform[0] * (own.count > len(set(own.axes)))
        x = room.middle + np.array([r * np.cos(angle), r * np.sin(angle), 0.0])
        nodes[f"push{k + 1}"] = _point([(None, room.turn @ x)])
        actuators[f"drive{k + 1}"] = {"type": "force", "nodes": [f"push{k + 1}"], "direction": along}
    return actuators, nodes


def _stacks(data: dict[str, Any], drive: Drive, room: Room, material: str) -> list[str]:
    """Add piezo stacks with their amplifiers; what of them the platform carries."""
    parts = drive.amplifier.parts(drive.stack, material, drive.sizes, drive.top)
    data["parameters"] |= {
        f"drive_{name}": {"value": _mm(own.value), "minimum": _mm(own.least), "maximum": _mm(own.most)}
        for name, own in drive.sizes.items()
    }
    tips = parts.tips
    if drive.lug is not None:
        low, high = ([ZERO + float(x) for x in corner] for corner in drive.lug)
        parts.box("lug", low, high, list(tips), material)
        tips = ("lug",)
    data["substructures"] |= substructures(parts, drive.stack, tips)
    for k, (head, frame) in enumerate(zip(drive.heads, drive.frames, strict=True)):
        placed = {"at": _point([(None, room.turn @ head)]), "rotate": _rotation(room.turn @ frame)}
        data["instances"][f"drive{k + 1}"] = {"of": "drive", **placed}
    data["ground"] |= {f"drive*.{held}": "clamped" for held in parts.held}
    return [f"drive*.{tip}" for tip in tips]


def ends_of(wish: Wish, room: Room) -> list[str]:
    """Both ends of the stroke as poses, in the words of questions; none where there is no stroke."""
    move = _move(wish, room)
    return [", ".join(f"about.{name} = {ends[k]}" for name, ends in move.items()) for k in (0, 1)] if move else []


def _move(wish: Wish, room: Room) -> dict[str, Any]:
    """The stroke from one end to the other: as many components of the motion of the point of the wish as there are
    freedoms, those that tell these apart best (Businger and Golub 1965), of which the stroke has any."""
    end, scale = wish.stroke_twist, np.repeat([1.0, room.freedoms.length / 2], 3)
    if not end.any():
        return {}
    free = np.array(list(wish.twists.values())) * scale
    _, _, best = scipy.linalg.qr(free, mode="economic", pivoting=True)
    end[np.abs(end * scale) < ALONG * np.abs(end * scale).max()] = 0.0
    units = {DOFS[k]: (end[k], "mrad" if k > 2 else "mm") for k in sorted(best[: room.freedoms.dimension]) if end[k]}
    return {name: [f"{s * 1e3 * own:.9g} {unit}" for s in (-1, 1)] for name, (own, unit) in units.items()}


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.6g} mm"


def _vector(v: Array) -> list[float]:
    return [round(float(x), 12) + 0.0 for x in v]


def _sum(terms: Iterable[tuple[str, float]], first: str = "") -> str:
    """Sizes so many times each; `first` stands before them where that is positive."""
    texts = (
        f"{'+' if c > 0 else '-'} {name if abs(abs(c) - 1) < ALONG else f'{abs(c):.12g}*{name}'}" for name, c in terms
    )
    text = " ".join(texts)
    return first + text.removeprefix("+ ") if text.startswith("+ ") else text


def _point(terms: Iterable[tuple[str | None, Array]]) -> list[str | float]:
    """Coordinates as sums of numbers, in mm, and sizes times directions."""
    terms = list(terms)
    found: list[str | float] = []
    for k in range(3):
        fixed = sum(float(v[k]) for name, v in terms if name is None)
        texts = [] if abs(fixed) < 1e-12 else [_mm(fixed)]
        for name, v in terms:
            if name is not None and abs(v[k]) > ALONG:
                texts.append(_sum([(name, float(v[k]))], "+ "))
        found.append(" ".join(texts).removeprefix("+ ") if texts else 0.0)
    return found


def _rotation(axes: Array) -> dict[str, Any]:
    """The turn that leads global axes to these, columns of (3, 3); of a mirrored set with its first axis reversed."""
    R = axes if np.linalg.det(axes) > 0 else axes * [-1.0, 1.0, 1.0]
    turn = Rotation.from_matrix(R).as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > ALONG else np.array([0.0, 0.0, 1.0])
    return {"axis": _vector(axis), "angle": f"{np.degrees(angle):.9g} deg"}
