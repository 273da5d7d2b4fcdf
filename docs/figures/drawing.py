"""What pictures of the mechanism file are drawn with: a sheet with a piece of a file beside what it describes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import reduce
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from ruamel.yaml import YAML

import flexura as fx
from flexura.view import COLOURS, Kind, Look, solids
from flexura.view.drawing.painting import Camera, outlines
from flexura.view.scene.meshes import Array, normals
from flexura.view.scene.scene import Solids

INK, KEY, GREY, PAPER, RULE = "#22262b", "#1a5fb4", "#5b6570", "#ffffff", "#c8cdd3"
CHARACTER, LINE = 7.3, 17.0
"""Width and height of a character of the piece of a file, pixels."""
WIDTH = 860
LOOK = Look(faces=260, most_faces=4000, plain=True, channels=True)
LIGHT = np.array([[-0.45, 0.75, 0.8], [0.85, 0.1, 0.5]])


def _colour(rgb: ArrayLike) -> str:
    return "#" + "".join(f"{round(255 * float(c)):02x}" for c in np.clip(rgb, 0, 1))


def _points(image: ArrayLike) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in np.asarray(image, dtype=float))


@dataclass
class Sheet:
    """A picture of some height with a piece of a file on the left, and room for drawings to the right of it."""

    title: str
    fragment: str
    height: int = 0
    body: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        lines = self.fragment.strip("\n").split("\n")
        self.height = max(self.height, round(LINE * len(lines)) + 44)
        self.left = round(max(map(len, lines)) * CHARACTER) + 48 if self.fragment else 16
        top = (self.height - LINE * (len(lines) - 1)) / 2 + 4
        for k, line in enumerate(lines):
            self.body.append(
                f'<text x="22" y="{top + LINE * k:.0f}" class="c" xml:space="preserve">{_highlighted(line)}</text>'
            )
        if self.fragment:
            self.body.append(f'<path d="M{self.left - 8} 14V{self.height - 14}" stroke="{RULE}"/>')

    def add(self, *elements: str) -> None:
        """Draw over what there is."""
        self.body.extend(elements)

    def text(self, x: float, y: float, words: str, *, anchor: str = "middle", key: bool = False) -> None:
        """Words at a point; keys of a file are set as there. A halo keeps them apart from lines below."""
        kind = "k" if key else "t"
        self.add(f'<text x="{x:.1f}" y="{y:.1f}" class="{kind}" text-anchor="{anchor}">{escape(words)}</text>')

    def line(self, *points: ArrayLike, colour: str = GREY, width: float = 1.0, more: str = "") -> None:
        """A line through points (2,), pixels."""
        drawn = _points(np.array(points, dtype=float))
        self.add(f'<polyline points="{drawn}" fill="none" stroke="{colour}" stroke-width="{width}"{more}/>')

    def arrow(
        self, start: ArrayLike, end: ArrayLike, *, colour: str = GREY, width: float = 1.2, both: bool = False
    ) -> None:
        """An arrow between points (2,), pixels, with one head or two."""
        a, b = np.array(start, dtype=float), np.array(end, dtype=float)
        along = (b - a) / max(float(np.hypot(*(b - a))), 1e-9)
        size = 3.2 + 2.2 * width
        for tip, towards in ((b, along), (a, -along))[: 2 if both else 1]:
            side = np.array([-towards[1], towards[0]])
            head = [tip, tip - size * towards + 0.36 * size * side, tip - size * towards - 0.36 * size * side]
            self.add(f'<polygon points="{_points(head)}" fill="{colour}"/>')
        tail, neck = (a + 0.8 * size * along if both else a), b - 0.8 * size * along
        self.line(tail, neck, colour=colour, width=width)

    def svg(self) -> str:
        """The picture as a file."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {self.height}" width="{WIDTH}"'
            f' role="img" font-family="sans-serif">\n<title>{escape(self.title)}</title>\n'
            "<style>.c{font:12.1px monospace;fill:#22262b}.c .y{fill:#1a5fb4}.t{font-size:13px;fill:#22262b}"
            ".k{font:bold 12.5px monospace;fill:#1a5fb4}"
            ".t,.k{paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-linejoin:round}"
            "polygon{stroke-linejoin:round}</style>\n"
            f'<rect x="0.5" y="0.5" width="{WIDTH - 1}" height="{self.height - 1}" rx="6" fill="{PAPER}"'
            f' stroke="{RULE}"/>'
        )
        return "\n".join([head, *self.body, "</svg>"]) + "\n"


def _highlighted(line: str) -> str:
    """A line of YAML with its keys in colour."""
    parts = re.split(r"(?<![\w.\"*])([\w]+)(?=:(?:\s|$))", line)
    return "".join(
        f'<tspan class="y">{escape(part)}</tspan>' if k % 2 else escape(part) for k, part in enumerate(parts)
    )


@dataclass(frozen=True)
class Area:
    """A rectangle of a sheet, pixels."""

    left: float
    top: float
    right: float
    bottom: float


class Scene:
    """Solids of a mechanism on a sheet, with marks at places in space, mm."""

    def __init__(
        self,
        sheet: Sheet,
        area: Area,
        camera: tuple[float, float],
        points: Array,
    ) -> None:
        """The view in which points (n, 3), mm, fill the area, seen from an elevation and an azimuth, degrees."""
        self.sheet, self.axes = sheet, Camera(*camera).axes
        image = points @ self.axes[:2].T
        low, high = image.min(axis=0), image.max(axis=0)
        room = np.array([area.right - area.left, area.bottom - area.top])
        self.scale = float((room / np.maximum(high - low, 1e-9)).min())
        middle = np.array([area.left + area.right, area.top + area.bottom]) / 2
        self.origin = middle - self.scale * np.array([1, -1]) * (low + high) / 2

    def at(self, place: ArrayLike) -> Array:
        """Where places (..., 3), mm, are on the sheet."""
        image = np.asarray(place, dtype=float) @ self.axes[:2].T
        return self.origin + self.scale * image * [1, -1]

    def draw(
        self, parts: Solids, points: Array | None = None, *, ghost: bool = False, over: Iterable[str] = ()
    ) -> None:
        """Draw solids at points (v, 3), m, by default where they are; what is named in `over` comes last."""
        x = 1e3 * (parts.points if points is None else points)
        area = normals(x, parts.faces)
        unit = area / np.maximum(np.linalg.norm(area, axis=1), 1e-12)[:, None]
        front = unit @ self.axes[2] > 1e-9
        drawn = [
            (self._late(parts.names[parts.face_parts[f]], over), self._depth(x[parts.faces[f]]), text)
            for f, text in self._faces(parts, x, unit, front, ghost)
        ]
        ends, pair, _ = outlines(parts.faces, unit, front)
        for (a, b), two in zip(ends, pair, strict=True):
            seen = two[0] if front[two[0]] else two[1]
            colour = "#b9bec5" if ghost else _colour(0.5 * np.array(COLOURS[Kind(parts.face_kinds[seen])]))
            text = f'<path d="M{_points(self.at(x[[a, b]])).replace(" ", "L")}" stroke="{colour}" stroke-width="0.9"/>'
            late = self._late(parts.names[parts.face_parts[seen]], over)
            drawn.append((late, self._depth(x[parts.faces[seen]]) + 1e-3, text))
        if not ghost:
            drawn += [(True, 0.0, text) for text in self._lines_and_dots(parts, x)]
        self.sheet.add(*(text for _, _, text in sorted(drawn, key=lambda own: own[:2])))

    def _faces(self, parts: Solids, x: Array, unit: Array, front: Any, ghost: bool) -> Iterable[tuple[int, str]]:
        """Faces that are turned to the viewer, by number."""
        for f in np.flatnonzero(front):
            lit = np.clip((LIGHT @ self.axes) @ unit[f], 0, None) @ [0.62, 0.25]
            fill = (
                "#eef0f2"
                if ghost
                else _colour(np.array(COLOURS[Kind(parts.face_kinds[f])]) * min(0.62 + 0.45 * lit, 1))
            )
            corners = self.at(x[parts.faces[f]])
            yield f, f'<polygon points="{_points(corners)}" fill="{fill}" stroke="{fill}" stroke-width="0.8"/>'

    def _lines_and_dots(self, parts: Solids, x: Array) -> Iterable[str]:
        for (a, b), kind in zip(parts.lines, parts.line_kinds, strict=True):
            path = _points(self.at(x[[a, b]])).replace(" ", "L")
            yield f'<path d="M{path}" stroke="{_colour(COLOURS[Kind(kind)])}" stroke-width="1.5"/>'
        for d, kind in zip(parts.dots, parts.dot_kinds, strict=True):
            u, v = self.at(x[d])
            yield f'<circle cx="{u:.1f}" cy="{v:.1f}" r="3.4" fill="{_colour(COLOURS[Kind(kind)])}" stroke="{INK}"/>'

    def _depth(self, corners: Array) -> float:
        return float((corners @ self.axes[2]).mean())

    @staticmethod
    def _late(name: str, over: Iterable[str]) -> bool:
        return any(name == own or name.startswith(f"{own}.") for own in over)

    def size(
        self, a: ArrayLike, b: ArrayLike, words: str, *, by: ArrayLike = (0, 0, 0), shift: ArrayLike = (0, 0)
    ) -> None:
        """A size between two places, mm, with its line moved by `by`, mm, and its words by `shift`, pixels."""
        first, last = np.array(a, dtype=float), np.array(b, dtype=float)
        off = np.array(by, dtype=float)
        if off.any():
            reach = 1 + 4 / max(float(np.hypot(*(self.at(off) - self.at(np.zeros(3))))), 1e-9)
            for place in (first, last):
                self.sheet.line(self.at(place), self.at(place + reach * off), width=0.7)
        p, q = self.at(first + off), self.at(last + off)
        if np.hypot(*(q - p)) > 18:
            self.sheet.arrow(p, q, both=True)
        else:
            along = (q - p) / max(float(np.hypot(*(q - p))), 1e-9)
            self.sheet.arrow(p - 16 * along, p)
            self.sheet.arrow(q + 16 * along, q)
        x, y = (p + q) / 2 + np.array(shift, dtype=float)
        self.sheet.text(x, y + 4, words, key=True)

    def name(self, place: ArrayLike, words: str, shift: ArrayLike, *, key: bool = True, led: bool = True) -> None:
        """Words beside a place, mm, with a line to it; moved from there by `shift`, pixels."""
        p = self.at(place)
        x, y = p + np.array(shift, dtype=float)
        if led:
            self.sheet.line(p, (x, y), width=0.8)
        side = np.sign(np.array(shift, dtype=float)[0]) if abs(np.array(shift)[0]) > 12 else 0
        anchor = {1: "start", -1: "end", 0: "middle"}[int(side)]
        lift = 4 if side else (-4 if np.array(shift)[1] < 0 else 13)
        self.sheet.text(x + 3 * side, y + lift, words, anchor=anchor, key=key)

    def arrow(
        self,
        place: ArrayLike,
        along: ArrayLike,
        words: str = "",
        *,
        colour: str = INK,
        shift: ArrayLike = (0, 0),
        key: bool = True,
        width: float = 2.0,
    ) -> None:
        """An arrow from a place along a vector, both mm, with words at its tip."""
        start = np.array(place, dtype=float)
        tip = self.at(start + np.array(along, dtype=float))
        self.sheet.arrow(self.at(start), tip, colour=colour, width=width)
        if words:
            x, y = tip + np.array(shift, dtype=float)
            self.sheet.text(x, y + 4, words, key=key)

    def dot(self, place: ArrayLike, radius: float = 3.4, fill: str = "#ffffff") -> None:
        """A dot at a place, mm."""
        x, y = self.at(place)
        self.sheet.add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{fill}" stroke="{INK}"/>')

    def path(self, places: ArrayLike, *, dashed: bool = False, colour: str = GREY, width: float = 1.0) -> None:
        """A line through places (n, 3), mm."""
        more = ' stroke-dasharray="5 3"' if dashed else ""
        self.sheet.line(*self.at(places), colour=colour, width=width, more=more)

    def patch(self, places: ArrayLike, colour: str = KEY, opacity: float = 0.12) -> None:
        """A plane through places (n, 3), mm, that is seen through."""
        drawn = _points(self.at(places))
        self.sheet.add(
            f'<polygon points="{drawn}" fill="{colour}" fill-opacity="{opacity}" stroke="{colour}" stroke-width="0.8"/>'
        )

    def turn(
        self,
        centre: ArrayLike,
        axis: ArrayLike,
        start: ArrayLike,
        angle: float,
        words: str = "",
        shift: ArrayLike = (0, 0),
        colour: str = INK,
    ) -> None:
        """An arrow that turns by an angle, degrees, about an axis through a centre, from `centre + start`, mm."""
        n = np.array(axis, dtype=float) / np.linalg.norm(np.array(axis, dtype=float))
        r, c = np.array(start, dtype=float), np.array(centre, dtype=float)
        angles = np.radians(np.linspace(0, angle, 25))[:, None]
        places = c + r * np.cos(angles) + np.cross(n, r) * np.sin(angles) + n * (n @ r) * (1 - np.cos(angles))
        image = self.at(places)
        self.sheet.line(*image[:-2], colour=colour, width=1.6)
        self.sheet.arrow(image[-4], image[-1], colour=colour, width=1.6)
        if words:
            x, y = image[len(image) // 2] + np.array(shift, dtype=float)
            self.sheet.text(x, y + 4, words, key=True)

    def axes_at(
        self, place: ArrayLike, length: float, frame: Sequence[ArrayLike] = np.eye(3), names: str = "xyz"
    ) -> None:
        """Three axes at a place, mm."""
        for name, along in zip(names, frame, strict=True):
            tip = self.at(np.array(place, dtype=float) + length * np.array(along, dtype=float))
            base = self.at(place)
            way = (tip - base) / max(float(np.hypot(*(tip - base))), 1e-9)
            self.sheet.arrow(base, tip, colour=GREY, width=1.3)
            self.sheet.text(*(tip + 9 * way + [0, 4]), name)


def mechanism(*pieces: str) -> fx.Mechanism:
    """What pieces of a file describe together, later ones over earlier ones."""
    return fx.loads(json.dumps(reduce(_merged, map(_read, pieces)), ensure_ascii=False), "picture")


def _read(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text) or {}


def _merged(base: Any, extra: Any) -> Any:
    if not (isinstance(base, dict) and isinstance(extra, dict)):
        return extra
    return {**base, **{key: _merged(base.get(key), value) for key, value in extra.items()}}


def scene(
    sheet: Sheet,
    own: fx.Mechanism,
    camera: tuple[float, float],
    pad: tuple[float, float, float, float],
    over: Iterable[str] = (),
    look: Look = LOOK,
) -> Scene:
    """The scene of a mechanism, drawn in the room right of the piece of the file, with room left on four sides."""
    parts = solids(fx.assemble(own), look=look)
    left, top, right, bottom = pad
    area = Area(sheet.left + left, top, WIDTH - right, sheet.height - bottom)
    found = Scene(sheet, area, camera, 1e3 * parts.points)
    found.draw(parts, over=over)
    return found
