"""Where parts of the mechanism file are, what holds, loads and moves them, each beside a piece of a file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from drawing import GREY, KEY, LOOK, WIDTH, Area, Scene, Sheet, mechanism, scene
from file_parts import ARM, CAMERA, GUIDE, STEEL

import flexura as fx
from flexura.view import moved_solids, solids


def whole() -> Sheet:
    """A whole file: which key describes what."""
    fragment = """\
name: parallel guide
parameters: {length: 60 mm, ...}
materials: {steel: spring-steel}
substructures:
  leaf: {nodes, flexures, interface}
instances:
  leaf: {of: leaf, pattern, ...}
bodies:
  carriage: {centre, solid,
             carries: ["leaf*.head"]}
ground: {"leaf*.foot": clamped}
actuators, sensors, loads, ...
motion, disturbances, controllers,
requirements, studies, test, published"""
    sheet = Sheet("What the keys of a whole file describe", fragment, 290)
    drawn = scene(sheet, mechanism(GUIDE), CAMERA, (120, 34, 150, 34), over=("carriage",))
    drawn.name((60, -10, 65), "bodies: carriage", (46, -18))
    drawn.name((0, -10, 30), "instances: leaf1", (-40, -20))
    drawn.name((50, 10, 30), "leaf2", (50, -10))
    drawn.name((50, 0, 60), "carries: leaf2.head", (60, 12))
    drawn.name((50, 0, 0), "ground", (60, 6))
    drawn.size((0, -10, 0), (0, -10, 60), "length", by=(-18, 0, 0), shift=(-30, 20))
    return sheet


def parameters() -> Sheet:
    """Parameters that sizes are worked out from, with their bounds."""
    fragment = """\
parameters:
  length: {value: 40 mm, minimum: 20 mm, maximum: 60 mm}
  width: length/2
nodes:
  foot: [0, 0, 0]
  head: [0, 0, length]
flexures:
  blade:
    nodes: [foot, head]
    material: steel
    reference: x
    profile: {type: leaf, width: width, thickness: 1 mm}"""
    sheet = Sheet("Sizes that are worked out from a parameter, and the bounds of the parameter", fragment, 270)
    drawn = scene(
        sheet,
        mechanism("materials: {steel: spring-steel}\nground: {foot: clamped}", fragment),
        CAMERA,
        (40, 34, 150, 40),
    )
    drawn.size((0, 10, 0), (0, 10, 40), "length", by=(0, 9, 0), shift=(32, 0))
    drawn.size((0, -10, 40), (0, 10, 40), "width = length/2", by=(0, 0, 5), shift=(-44, -10))
    x = WIDTH - 112
    top, bottom = 50, sheet.height - 40
    scale = (bottom - top) / 60
    sheet.line((x, bottom), (x, top), width=1.4)
    for value, words in ((20, "minimum"), (40, "value"), (60, "maximum")):
        y = bottom - scale * value
        sheet.line((x - 6, y), (x + 6, y), width=1.4)
        sheet.text(x + 12, y + 4, words, anchor="start", key=True)
    sheet.add(f'<circle cx="{x}" cy="{bottom - scale * 40:.1f}" r="5" fill="#1a5fb4"/>')
    return sheet


def substructures() -> Sheet:
    """A substructure in its own frame, and the instances that are placed of it."""
    fragment = """\
substructures:
  leaf:
    nodes: {foot: [0, 0, 0], head: [0, 0, 60 mm]}
    flexures:
      blade: {nodes: [foot, head], ...}
    interface: [foot, head]
instances:
  leaf:
    of: leaf
    at: [20 mm, 0, 0]
    pattern: {type: linear, count: 3,
              step: [30 mm, 0, 0]}"""
    own = fragment.replace(
        ", ...}", ", material: steel, reference: x, profile: {type: leaf, width: 20 mm, thickness: 1.5 mm}}"
    )
    sheet = Sheet("A substructure in its own frame, and its copies", fragment, 260)
    rest = """
bodies:
  top:
    centre: [50 mm, 0, 63 mm]
    solid: {shape: box, size: [70 mm, 20 mm, 6 mm], material: aluminium}
    carries: ["leaf*.head"]
ground: {"leaf*.foot": clamped}
"""
    drawn = scene(sheet, mechanism(STEEL, rest, own), CAMERA, (90, 46, 90, 50), over=("top",))
    drawn.axes_at((0, 0, 0), 12)
    drawn.size((0, 0, 0), (20, 0, 0), "at", by=(0, -16, 0), shift=(-4, 16))
    drawn.size((20, -10, 0), (50, -10, 0), "step", by=(0, -8, 0), shift=(-4, 15))
    drawn.size((50, -10, 0), (80, -10, 0), "step", by=(0, -8, 0), shift=(-4, 15))
    drawn.name((20, 0, 60), "leaf1.head", (-50, -20))
    drawn.name((80, 0, 60), "leaf3.head", (50, -14))
    drawn.name((80, 0, 0), "leaf3.foot", (46, 4))
    return sheet


def instances() -> Sheet:
    """Circular patterns and mirrors."""
    fragment = """\
instances:
  leg:
    of: leg
    at: [30 mm, 0, 0]
    rotate: {axis: z, angle: 90 deg}
    pattern:
      - {type: circular, count: 3, axis: z}
      - {type: mirror, normal: z,
         point: [0, 0, 30 mm]}"""
    rest = """
substructures:
  leg:
    nodes: {foot: [0, 0, 0], head: [0, 0, 24 mm]}
    flexures:
      blade:
        nodes: [foot, head]
        material: steel
        reference: y
        profile: {type: leaf, width: 16 mm, thickness: 1.5 mm}
    interface: [foot, head]
bodies:
  hub:
    centre: [0, 0, 30 mm]
    solid: {shape: cylinder, diameter: 74 mm, length: 12 mm, material: aluminium}
    carries: ["leg*.head"]
ground: {"leg*.foot": clamped}
"""
    sheet = Sheet("A circular pattern of three, and its mirror image", fragment, 320)
    drawn = scene(sheet, mechanism(STEEL, rest, fragment), (24, -48), (120, 52, 150, 38))
    square = [(-50, -50, 30), (50, -50, 30), (50, 50, 30), (-50, 50, 30)]
    drawn.path([*square, square[0]], dashed=True, colour=KEY)
    drawn.name((50, -50, 30), "mirror", (-70, 34))
    drawn.path([(0, 0, -8), (0, 0, 84)], dashed=True, colour=KEY)
    drawn.turn((0, 0, 80), (0, 0, 1), (14, 0, 0), 120, "axis, count", (62, 2), colour=KEY)
    drawn.name((30, 0, 6), "leg1", (46, 22))
    drawn.name((-15, -26, 6), "leg3", (-40, 24))
    drawn.name((30, 0, 54), "leg4", (56, -22))
    return sheet


def joints() -> Sheet:
    """Two nodes at one place that are made one."""
    fragment = """\
instances:
  leg: {of: leg, at: [40 mm, 0, 0]}
joints:
  - [b, leg.foot]"""
    rest = """
substructures:
  leg:
    nodes: {foot: [0, 0, 0], head: [0, 0, 30 mm]}
    flexures:
      blade:
        nodes: [foot, head]
        material: steel
        reference: x
        profile: {type: leaf, width: 10 mm, thickness: 1.5 mm}
    interface: [foot, head]
"""
    sheet = Sheet("A joint makes one node of two at the same place", fragment, 190)
    drawn = scene(sheet, mechanism(ARM, rest, fragment), CAMERA, (100, 26, 200, 30))
    drawn.name((40, 0, 0), "b = leg.foot", (52, 8))
    drawn.name((0, 0, 0), "a", (-10, -34))
    return sheet


def ground() -> Sheet:
    """What is held, all or some of it."""
    fragment = """\
ground:
  a: {free: [ry]}
  b: {fixed: [tz]}
  c: clamped"""
    rest = """
nodes: {a: [0, 0, 0], b: [40 mm, 0, 0], c: [80 mm, 0, 0]}
links:
  next: {nodes: [b, c], material: steel, reference: z, section: {shape: rectangle, width: 10 mm, thickness: 6 mm}}
"""
    sheet = Sheet("Nodes that are clamped, or held along some displacements", fragment, 170)
    drawn = scene(sheet, mechanism(ARM, rest, fragment), (22, -66), (60, 46, 60, 56))
    drawn.turn((0, -5, 0), (0, 1, 0), (0, 0, 12), 120, "ry free", (44, -18), colour=KEY)
    drawn.arrow((40, 0, -14), (0, 0, 10), "", colour=KEY)
    drawn.arrow((40, 0, 15), (0, 0, -11), "tz fixed", colour=KEY, shift=(40, -22))
    for name, x, move in (("a", 0, (-18, 26)), ("b", 40, (20, 34)), ("c", 80, (10, -26))):
        drawn.name((x, 0, -3), name, move)
    return sheet


def _pose(title: str, fragment: str, move: dict[str, tuple[float, float]]) -> tuple[Sheet, Scene]:
    """The guide at the end of a way, over where it is at its beginning."""
    sheet = Sheet(title, fragment, 230)
    mechanism(GUIDE, fragment)
    found = fx.stroke(mechanism(GUIDE), move=move, steps=3, n=1)
    parts = solids(found.model, look=LOOK)
    moved = [moved_solids(found.model, frames, look=LOOK) for frames in found.frames]
    first, *_, last = (own.points + own.motions for own in moved)
    area = Area(sheet.left + 120, 44, WIDTH - 130, 196)
    drawn = Scene(sheet, area, (12, -70), 1e3 * np.concatenate([first, last]))
    drawn.draw(parts, first, ghost=True)
    drawn.draw(parts, last, over=("carriage",))
    return sheet, drawn


def at() -> Sheet:
    """The pose about which everything linear is."""
    fragment = """\
at:
  carriage: {x: 12 mm}"""
    title = "Everything linear is about the pose, with large displacements"
    sheet, drawn = _pose(title, fragment, {"carriage.x": (0.0, 12e-3)})
    drawn.size((-10, -10, 76), (2, -10, 76), "x: 12 mm", shift=(0, -14))
    return sheet


def motion() -> Sheet:
    """The way from one end of a stroke to the other."""
    fragment = """\
motion:
  move:
    carriage: {x: [-12 mm, 12 mm]}
  steps: 11
  modes: 3"""
    title = "A stroke from one end to the other, in steps, with the modes about each pose"
    sheet, drawn = _pose(title, fragment, {"carriage.x": (-12e-3, 12e-3)})
    left, right = drawn.at((13, -10, 82)), drawn.at((37, -10, 82))
    sheet.line(left, right, width=1.4)
    for x in np.linspace(left[0], right[0], 11):
        y = np.interp(x, [left[0], right[0]], [left[1], right[1]])
        sheet.line((x, y - 5), (x, y + 5), width=1.2)
    sheet.text(left[0] - 8, left[1] + 4, "-12 mm", anchor="end", key=True)
    sheet.text(right[0] + 8, right[1] + 4, "12 mm, steps: 11", anchor="start", key=True)
    return sheet


def loads() -> Sheet:
    """Gravity and a dead load."""
    fragment = """\
gravity: -z
loads:
  b:
    force: [0, 0, -20 N]
    moment: [200 N*mm, 0, 0]"""
    sheet = Sheet("Weight of everything, and a force and a moment that keep their directions", fragment, 200)
    parts = solids(fx.assemble(mechanism(ARM, fragment)), look=LOOK)
    drawn = Scene(sheet, Area(sheet.left + 130, 60, WIDTH - 200, 130), (22, -60), 1e3 * parts.points)
    drawn.draw(parts)
    for x in (8, 16, 24):
        drawn.arrow((x, -5, -5), (0, 0, -8), width=1.2, colour=GREY)
    drawn.name((8, -5, -9), "gravity", (-50, 10), led=False)
    drawn.arrow((40, 0, 16), (0, 0, -13), colour="#990d40")
    drawn.name((40, 0, 14), "force", (16, 0), led=False)
    drawn.turn((50, 0, 0), (1, 0, 0), (0, 5, 0), 270, "moment", (50, 10), colour="#990d40")
    drawn.name((0, 0, 0), "a", (-20, -30))
    return sheet


PICTURES: tuple[Callable[[], Sheet], ...] = (
    whole,
    parameters,
    substructures,
    instances,
    joints,
    ground,
    at,
    motion,
    loads,
)
