"""Parts of the mechanism file, each beside a piece of a file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from drawing import INK, LOOK, WIDTH, Area, Scene, Sheet, mechanism, scene

import flexura as fx
from flexura.view import solids

CAMERA = (24.0, -58.0)

STEEL = """
materials: {steel: spring-steel, aluminium: Al-6061-T6}
parameters: {length: 40 mm, width: 16 mm, thickness: 2 mm}
"""
ARM = """
materials: {steel: spring-steel, aluminium: Al-6061-T6}
nodes: {a: [0, 0, 0], b: [40 mm, 0, 0]}
links:
  bar: {nodes: [a, b], material: steel, reference: z, section: {shape: rectangle, width: 10 mm, thickness: 6 mm}}
ground: {a: clamped}
"""
GUIDE = """
parameters: {length: 60 mm, thickness: 1 mm}
materials: {steel: spring-steel}
substructures:
  leaf:
    nodes: {foot: [0, 0, 0], head: [0, 0, length]}
    flexures:
      blade:
        nodes: [foot, head]
        material: steel
        reference: x
        profile: {type: leaf, width: 20 mm, thickness: thickness}
    interface: [foot, head]
instances:
  leaf: {of: leaf, pattern: {type: linear, count: 2, step: [50 mm, 0, 0]}}
bodies:
  carriage:
    centre: [25 mm, 0, length + 5 mm]
    solid: {shape: box, size: [70 mm, 20 mm, 10 mm], material: Al-6061-T6}
    carries: ["leaf*.head"]
ground: {"leaf*.foot": clamped}
"""


def sections() -> Sheet:
    """Sections in the plane of their local axes."""
    fragment = """\
sections:
  bar:
    shape: rectangle
    width: 16 mm
    thickness: 8 mm
  rod: {shape: circle, diameter: 12 mm}
  pipe:
    shape: tube
    outer_diameter: 14 mm
    inner_diameter: 9 mm"""
    sheet = Sheet("Sections: width along local y, thickness along local z; diameters", fragment, 190)
    fill = 'fill="#6ba3d6" stroke="#22344e"'
    x, y = sheet.left + 84, 92
    sheet.add(f'<rect x="{x - 48}" y="{y - 24}" width="96" height="48" {fill}/>')
    sheet.arrow((x - 48, y + 42), (x + 48, y + 42), both=True)
    sheet.text(x, y + 62, "width", key=True)
    sheet.arrow((x + 62, y - 24), (x + 62, y + 24), both=True)
    sheet.text(x + 70, y + 4, "thickness", anchor="start", key=True)
    sheet.arrow((x, y), (x + 34, y))
    sheet.text(x + 39, y + 4, "y")
    sheet.arrow((x, y), (x, y - 42))
    sheet.text(x, y - 48, "z")
    x += 224
    sheet.add(f'<circle cx="{x}" cy="{y}" r="36" {fill}/>')
    sheet.arrow((x - 36, y), (x + 36, y), both=True)
    sheet.text(x, y + 62, "diameter", key=True)
    x += 132
    sheet.add(
        f'<circle cx="{x}" cy="{y}" r="42" {fill}/>', f'<circle cx="{x}" cy="{y}" r="27" fill="#fff" stroke="#22344e"/>'
    )
    sheet.arrow((x - 27, y), (x + 27, y), both=True)
    sheet.text(x, y - 54, "inner_diameter", key=True)
    sheet.arrow((x - 42, y + 54), (x + 42, y + 54), both=True)
    sheet.text(x, y + 74, "outer_diameter", key=True)
    return sheet


def nodes() -> Sheet:
    """Nodes by their coordinates."""
    fragment = """\
nodes:
  a: [0, 0, 0]
  b: [40 mm, 0, 0]
  c: [40 mm, 20 mm, 30 mm]"""
    sheet = Sheet("Nodes by their coordinates in the frame of the substructure", fragment, 200)
    corners = np.array([[0, 0, 0], [40, 0, 0], [40, 20, 0], [40, 20, 30], [54, 0, 0]])
    drawn = Scene(sheet, Area(sheet.left + 120, 40, WIDTH - 150, 160), CAMERA, corners)
    drawn.axes_at((0, 0, 0), 14)
    drawn.size((0, 0, 0), (40, 0, 0), "40 mm", by=(0, -8, 0), shift=(0, 12))
    drawn.path([(40, 0, 0), (40, 20, 0), (40, 20, 30)], dashed=True)
    drawn.name((40, 10, 0), "20 mm", (16, 14), led=False)
    drawn.name((40, 20, 15), "30 mm", (14, 0), led=False)
    for name, place, shift in (("a", (0, 0, 0), (-16, 6)), ("b", (40, 0, 0), (-4, -12)), ("c", (40, 20, 30), (14, -6))):
        drawn.dot(place)
        drawn.name(place, name, shift, led=False)
    return sheet


def links() -> Sheet:
    """A link between nodes, with the direction of its thickness and an offset."""
    fragment = """\
nodes:
  a: [0, 0, 0]
  b: [60 mm, 0, 8 mm]
links:
  bar:
    nodes: [a, b]
    end_offset: [0, 0, -8 mm]
    material: steel
    reference: z
    section:
      shape: rectangle
      width: 16 mm
      thickness: 6 mm
ground: {a: clamped}"""
    sheet = Sheet("A link runs between its nodes; reference is the direction of its thickness", fragment)
    drawn = scene(sheet, mechanism(STEEL, fragment), CAMERA, (90, 70, 110, 60))
    drawn.size((60, -8, -3), (60, 8, -3), "width", by=(14, 0, 0), shift=(32, 4))
    drawn.size((60, 8, -3), (60, 8, 3), "thickness", by=(8, 0, 0), shift=(48, 0))
    drawn.size((60, 0, 0), (60, 0, 8), "end_offset", by=(0, -27, 0), shift=(-48, 4))
    drawn.arrow((22, 0, 3), (0, 0, 14), "reference", shift=(0, -10))
    drawn.name((0, 0, 0), "a", (-20, -26))
    drawn.name((60, 0, 8), "b", (14, -22))
    drawn.axes_at((0, -26, -14), 9)
    return sheet


def profiles() -> Sheet:
    """The four profiles of flexures."""
    fragment = """\
blade:
  profile:
    type: leaf
    width: [16 mm, 10 mm]
    thickness: 2 mm
hinge:
  profile:
    type: notch
    width: 16 mm
    contour: {shape: circular,
              radius: 20 mm, web: 2 mm}
neck:
  profile:
    type: round
    contour: {shape: elliptical,
              depth: 6 mm, web: 3 mm}
universal:
  profile:
    type: two_axis
    y_contour: {shape: elliptical,
                depth: 6 mm, web: 3 mm}
    z_contour: {shape: elliptical,
                depth: 6 mm, web: 3 mm}
    shift: 12 mm"""
    sheet = Sheet("Profiles of flexures: leaf, notch, round, two-axis", fragment)
    whole = f"""
{STEEL}
flexures:
  blade: {{nodes: [a, b], material: steel, reference: x}}
  hinge: {{nodes: [c, d], material: steel, reference: x}}
  neck: {{nodes: [e, f], material: steel, reference: x}}
  universal: {{nodes: [g, h], material: steel, reference: x}}
nodes: {{a: [0, 0, 0], b: [0, 0, 40 mm], c: [60 mm, 0, 0], d: [60 mm, 0, 40 mm],
  e: [115 mm, 0, 0], f: [115 mm, 0, 40 mm], g: [160 mm, 0, 0], h: [160 mm, 0, 40 mm]}}
bodies:
  base:
    centre: [80 mm, 0, -3 mm]
    solid: {{shape: box, size: [190 mm, 24 mm, 6 mm], material: aluminium}}
    carries: [a, c, e, g]
ground: {{base: clamped}}
"""
    own = mechanism(whole, "flexures:\n" + "\n".join("  " + line for line in fragment.split("\n")))
    drawn = scene(sheet, own, (20, -70), (64, 60, 70, 90))
    drawn.size((-1, -8, 0), (-1, 8, 0), "width", by=(-22, 0, 0), shift=(-26, 6))
    drawn.size((-1, -5, 40), (1, -5, 40), "thickness", by=(0, 0, 9), shift=(0, -12))
    drawn.name((60, -8, 20), "web", (-46, 0))
    drawn.size((160, -9, 14), (160, -9, 26), "shift", by=(16, 0, 0), shift=(22, 0))
    for x, words in ((0, "leaf"), (60, "notch"), (115, "round"), (160, "two_axis")):
        u, v = drawn.at((x, 0, -16))
        sheet.text(u, v + 20, words, key=True)
    return sheet


def ends() -> Sheet:
    """Which ends of a leaf are held flat."""
    fragment = """\
corrections: auto
flexures:
  strip:
    nodes: [foot, head]
    corrections: [plate, warping]
    ends: [clamped, free]"""
    rest = """
nodes: {foot: [0, 0, 0], head: [40 mm, 0, 0], tip: [62 mm, 0, 0]}
materials: {steel: spring-steel}
flexures:
  strip: {material: steel, reference: z, profile: {type: leaf, width: 18 mm, thickness: 1.2 mm}}
  on: {nodes: [head, tip], material: steel, reference: z, profile: {type: leaf, width: 18 mm, thickness: 1.2 mm}}
ground: {foot: clamped}
"""
    sheet = Sheet("An end is clamped where its section is held flat, free where the strip goes on", fragment, 180)
    parts = solids(fx.assemble(mechanism(rest, fragment)), look=LOOK)
    area = Area(sheet.left + 80, 50, WIDTH - 80, 140)
    drawn = Scene(sheet, area, (34, -58), 1e3 * parts.points)
    drawn.draw(parts)
    drawn.name((0, 9, 0), "clamped", (-10, -30))
    drawn.path([(40, -9, 0.6), (40, 9, 0.6)], dashed=True, colour=INK)
    drawn.name((40, 9, 0.6), "free", (20, -26))
    drawn.name((20, -9, 0), "strip", (-20, 30))
    return sheet


def roots() -> Sheet:
    """A leaf whose end in a block gives, with fillets, and whose end in a clamp does not."""
    fragment = """\
flexures:
  blade:
    nodes: [foot, head]
    root: [rigid, elastic]
    fillet: [0 mm, 3 mm]"""
    rest = """
nodes: {foot: [0, 0, 0], head: [40 mm, 0, 0]}
materials: {steel: spring-steel}
flexures:
  blade: {material: steel, reference: z, profile: {type: leaf, width: 18 mm, thickness: 1.6 mm}}
bodies:
  block:
    centre: [50 mm, 0, 0]
    solid: {shape: box, size: [20 mm, 18 mm, 22 mm], material: steel}
    carries: [head]
ground: {foot: clamped}
"""
    sheet = Sheet(
        "The root of a leaf in a block gives, with fillets in its corners; a rigid one does not", fragment, 180
    )
    parts = solids(fx.assemble(mechanism(rest, fragment)), look=LOOK)
    area = Area(sheet.left + 50, 30, WIDTH - 60, 150)
    drawn = Scene(sheet, area, (1, -89), 1e3 * parts.points)
    drawn.draw(parts)
    angles = np.linspace(0, np.pi / 2, 9)
    for side in (1, -1):
        arc = [(37 + 3 * np.sin(a), -9, side * (3.8 - 3 * np.cos(a))) for a in angles]
        drawn.path(arc, colour=INK, width=1.4)
    drawn.name((38.2, -9, 1.4), "fillet", (-34, -34))
    drawn.name((0, -9, 0), "rigid", (-4, 34))
    drawn.name((41, -9, -1), "elastic", (-40, 44))
    return sheet


def diaphragms() -> Sheet:
    """A shaft on two diaphragms."""
    fragment = """\
diaphragms:
  lower:
    nodes: [a, foot]
    material: aluminium
    normal: z
    rim_diameter: 60 mm
    hub_diameter: 20 mm
    thickness: 1 mm"""
    rest = """
materials: {aluminium: Al-6061-T6}
nodes: {a: [0, 0, 0], foot: [0, 0, 0], b: [0, 0, 36 mm], head: [0, 0, 36 mm]}
diaphragms:
  upper: {nodes: [b, head], material: aluminium, rim_diameter: 60 mm, hub_diameter: 20 mm, thickness: 1 mm}
bodies:
  shaft:
    centre: [0, 0, 18 mm]
    carries: [foot, head]
    solid: {shape: cylinder, diameter: 20 mm, length: 50 mm, material: aluminium}
"""
    sheet = Sheet("Two diaphragms that guide a shaft", fragment, 230)
    drawn = scene(sheet, mechanism(rest, fragment), (24, -70), (60, 40, 110, 40))
    drawn.name((24, 0, 0), "lower", (40, 16))
    drawn.name((24, 0, 36), "upper", (40, -12))
    return sheet


def flat_springs() -> Sheet:
    """A flat spring in its plane, with its edges by number."""
    fragment = """\
flat_springs:
  arm:
    material: steel
    reference: x
    thickness: 0.2 mm
    outline:
      - [0, 0]
      - [30 mm, 0]
      - through: [34 mm, 4 mm]
        to: [30 mm, 8 mm]
      - [20 mm, 8 mm]
      - [20 mm, 4 mm]
      - [0, 4 mm]
    holes:
      - centre: [30 mm, 4 mm]
        diameter: 3 mm
    pads: {a: {edges: [6]}, b: {holes: [1]}}"""
    sheet = Sheet("A flat spring between two nodes: its outline, its edges by number, and a hole", fragment, 320)
    x, y, mm = sheet.left + 70, 190.0, 11.0

    def at(u: float, v: float) -> tuple[float, float]:
        return x + mm * u, y - mm * v

    corners = [at(*corner) for corner in ((0, 0), (30, 0), (30, 8), (20, 8), (20, 4), (0, 4))]
    (p, q), r = (f"{u:g} {v:g}" for u, v in corners[1:3]), 4 * mm
    rest = " ".join(f"L{u:g} {v:g}" for u, v in corners[3:])
    (u, v), start = at(30, 4), f"{corners[0][0]:g} {corners[0][1]:g}"
    w = 1.5 * mm
    hole = f"M{u + w:g} {v:g}a{w:g} {w:g} 0 1 0 {-2 * w:g} 0a{w:g} {w:g} 0 1 0 {2 * w:g} 0z"
    outline = f"M{start}L{p}A{r:g} {r:g} 0 0 0 {q}{rest}z {hole}"
    sheet.add(f'<path d="{outline}" fill="#f6c9ab" fill-rule="evenodd" stroke="{INK}"/>')
    for number, (a, b) in enumerate(((15, -1.4), (35.4, 4), (25, 9), (19, 6), (10, 5), (-1.2, 2)), start=1):
        sheet.text(*at(a, b - 0.4), str(number))
    sheet.text(at(-3.4, 0)[0], at(0, 1.6)[1], "a", key=True)
    sheet.text(*at(30, 3.6), "b", key=True)
    sheet.text(*at(14, 1.6), "arm", key=True)
    return sheet


def springs() -> Sheet:
    """A spring to ground, and one between two nodes with axes that are turned."""
    fragment = """\
springs:
  mount: {nodes: [b], stiffness: {tz: 0.5 N/um}}
  strut:
    nodes: [b, c]
    stiffness: {tx: 20 N/um}
    rotate: {axis: y, angle: -45 deg}
dashpots:
  oil: {nodes: [d], damping: {tz: 5 N*s/m}}"""
    rest = """
nodes: {c: [62 mm, 0, 22 mm], d: [80 mm, 0, 22 mm]}
bodies:
  top: {centre: [71 mm, 0, 26 mm], solid: {shape: box, size: [30 mm, 8 mm, 8 mm], material: aluminium}, carries: [c, d]}
"""
    sheet = Sheet(
        "A spring from a node to ground, one between two nodes along turned axes, and a dashpot", fragment, 230
    )
    drawn = scene(sheet, mechanism(ARM, rest, fragment), (14, -70), (60, 50, 110, 56))
    drawn.name((40, 0, -3), "mount", (22, 34))
    drawn.name((51, 0, 11), "strut", (34, 12))
    drawn.name((80, 0, 34), "oil", (26, -8))
    drawn.name((40, 0, 0), "b", (-22, -18))
    drawn.name((62, 0, 22), "c", (-22, -4))
    drawn.name((80, 0, 22), "d", (22, 8))
    drawn.name((0, 0, 0), "a", (-12, -30))
    return sheet


def bodies() -> Sheet:
    """A body with what it carries, and a point mass on an arm."""
    fragment = """\
bodies:
  table:
    centre: [20 mm, 0, 30 mm]
    solid:
      shape: plate
      length: 50 mm
      width: 26 mm
      thickness: 6 mm
      material: aluminium
    carries: ["leaf*.head"]
masses:
  probe: {node: table, mass: 5 g, offset: [0, 0, 16 mm]}"""
    rest = """
substructures:
  leaf:
    nodes: {foot: [0, 0, 0], head: [0, 0, 27 mm]}
    flexures:
      blade:
        nodes: [foot, head]
        material: steel
        reference: x
        profile: {type: leaf, width: 20 mm, thickness: 1.5 mm}
    interface: [foot, head]
instances:
  leaf: {of: leaf, pattern: {type: linear, count: 2, step: [40 mm, 0, 0]}}
ground: {"leaf*.foot": clamped}
"""
    sheet = Sheet("A body with its size, its centre and what it carries; a point mass on an arm", fragment, 270)
    drawn = scene(sheet, mechanism(STEEL, rest, fragment), CAMERA, (80, 46, 120, 46), over=("table",))
    drawn.size((-5, 13, 33), (45, 13, 33), "length", by=(0, 0, 7), shift=(-46, -18))
    drawn.size((45, -13, 27), (45, 13, 27), "width", by=(7, 0, 0), shift=(30, 5))
    drawn.size((45, 13, 27), (45, 13, 33), "thickness", by=(6, 0, 0), shift=(48, 0))
    drawn.path([(20, 0, 30), (20, 0, 46)], dashed=True, colour=INK)
    drawn.dot((20, 0, 30))
    drawn.name((20, 0, 30), "centre", (-74, -16))
    drawn.name((20, 0, 39), "offset", (16, -6), led=False)
    drawn.dot((20, 0, 46), 6, "#734099")
    drawn.name((20, 0, 46), "probe", (22, -12))
    drawn.dot((0, 0, 27))
    drawn.name((0, 0, 27), "leaf1.head", (-40, 24))
    return sheet


def superelements() -> Sheet:
    """An elastic part given by matrices over its nodes."""
    fragment = """\
superelements:
  part:
    nodes: [b, d]
    stiffness: {file: part_K.mtx}
    mass: {file: part_M.mtx}
    units: {length: m, mass: kg, time: s}"""
    sheet = Sheet("A superelement: matrices over the six displacements of each of its nodes", fragment, 190)
    x, y = sheet.left + 80, 100
    pink = 'fill="#f3d3e4" stroke="#cc3385"'
    sheet.add(f'<path d="M{x - 56} {y}c0 -62 50 -30 76 -52 s64 -4 66 42 s-30 60 -66 46 s-76 24 -76 -36z" {pink}/>')
    sheet.text(x + 14, y + 2, "part", key=True)
    for u, v, name, anchor in ((x - 56, y, "b", "end"), (x + 86, y - 8, "d", "start")):
        sheet.add(f'<circle cx="{u}" cy="{v}" r="4" fill="#fff" stroke="{INK}"/>')
        sheet.text(u + (12 if anchor == "start" else -12), v + 4, name, anchor=anchor, key=True)
    left, top = x + 148, y - 58
    for k, name in enumerate(("stiffness", "mass")):
        at = left + 140 * k
        for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
            dark = "#e9a9c9" if row == column else "#f8e5ef"
            place = f'x="{at + 60 * column}" y="{top + 60 * row}" width="60" height="60"'
            sheet.add(f'<rect {place} fill="{dark}" stroke="#cc3385"/>')
        sheet.text(at + 30, top - 8, "b")
        sheet.text(at + 90, top - 8, "d")
        sheet.text(at + 60, top + 138, name, key=True)
    sheet.text(left - 8, top + 34, "b", anchor="end")
    sheet.text(left - 8, top + 94, "d", anchor="end")
    sheet.text(left + 30, top + 34, "6 × 6")
    return sheet


def actuators() -> Sheet:
    """What drives and what is read."""
    fragment = """\
actuators:
  voice_coil: {type: force, nodes: [carriage], direction: x}
  stack:
    type: piezo
    nodes: [post, carriage]
    stiffness: 20 N/um
    free_stroke: 15 um
  floor: {type: base, direction: y}
sensors:
  height: {type: displacement, nodes: [carriage], direction: z}"""
    rest = "nodes: {post: [-50 mm, 0, 65 mm]}\nground: {post: clamped}"
    sheet = Sheet("A force, a piezo stack between two nodes, motion of the base, and a sensor", fragment, 280)
    drawn = scene(
        sheet,
        mechanism(GUIDE, rest, fragment),
        CAMERA,
        (40, 56, 110, 46),
        over=("carriage",),
        look=LOOK._replace(channels=False),
    )
    drawn.arrow((60, 0, 65), (26, 0, 0), "voice_coil", colour="#990d40", shift=(30, 16))
    drawn.arrow((25, 0, 70), (0, 0, 22), "height", colour="#214dbf", shift=(0, -10))
    drawn.arrow((50, 0, -6), (0, 30, 0), "floor", colour="#990d40", shift=(26, 0))
    drawn.arrow((0, 0, -6), (0, 30, 0), colour="#990d40")
    drawn.name((-32, 0, 65), "stack", (6, -26))
    drawn.name((-50, 0, 65), "post", (-6, 30))
    return sheet


def parts() -> Sheet:
    """A part from CAD, held at one face and with a node at another."""
    fragment = """\
parts:
  bracket:
    step: bracket.step
    material: aluminium
    interfaces:
      foot: {x: 0 mm}
      bore: {radius: 6 mm}"""
    sheet = Sheet("A part from CAD: faces that others meet, each with its node", fragment, 200)
    x, y = sheet.left + 140, 34
    grey = f'fill="#d9dee6" stroke="{INK}"'
    sheet.add(f'<path d="M{x} {y}h34v72q0 18 18 18h138a26 26 0 0 1 0 52h-190z" {grey} fill-rule="evenodd"/>')
    sheet.add(f'<circle cx="{x + 190}" cy="{y + 116}" r="13" fill="#fff" stroke="#cc3385" stroke-width="3"/>')
    sheet.add(f'<path d="M{x} {y}v142" stroke="#cc3385" stroke-width="3"/>')
    for u, v, name, shift, anchor in (
        (x, y + 71, "bracket.foot", -12, "end"),
        (x + 190, y + 116, "bracket.bore", 44, "start"),
    ):
        sheet.add(f'<circle cx="{u}" cy="{v}" r="4" fill="#fff" stroke="{INK}"/>')
        sheet.text(u + shift, v + 4, name, anchor=anchor, key=True)
    return sheet


def outlines() -> Sheet:
    """The outline of a planar part with its corners, arcs, named faces and a hole."""
    fragment = """\
parts:
  arm:
    outline:
      - {to: [0, 0], name: base}
      - [40 mm, 0]
      - to: [40 mm, 16 mm]
        radius: 8 mm
        name: tip
      - [26 mm, 16 mm]
      - to: [14 mm, 16 mm]
        through: [20 mm, 10 mm]
      - [0, 16 mm]
    holes:
      - centre: [40 mm, 8 mm]
        diameter: 8 mm
        name: bore"""
    sheet = Sheet("The outline of a part: corners, arcs, names of faces, a hole", fragment, 330)
    x, y, mm = sheet.left + 90, 210.0, 8.0

    def at(u: float, v: float) -> str:
        return f"{x + mm * u:g} {y - mm * v:g}"

    far, near, bore = 8 * mm, 6 * mm, 4 * mm
    sides = f"M{at(0, 0)}L{at(40, 0)}A{far:g} {far:g} 0 0 0 {at(40, 16)}L{at(26, 16)}A{near:g} {near:g} 0 0 1 "
    sides += f"{at(14, 16)}L{at(0, 16)}z"
    hole = f"M{at(44, 8)}a{bore:g} {bore:g} 0 1 0 {-2 * bore:g} 0a{bore:g} {bore:g} 0 1 0 {2 * bore:g} 0z"
    sheet.add(f'<path d="{sides}{hole}" fill="#d9dee6" fill-rule="evenodd" stroke="{INK}"/>')
    named = f"M{at(0, 16)}L{at(0, 0)}M{at(40, 0)}A{far:g} {far:g} 0 0 0 {at(40, 16)}{hole}"
    sheet.add(f'<path d="{named}" fill="none" stroke="#cc3385" stroke-width="3"/>')
    for corner in ((0, 0), (40, 0), (40, 16), (26, 16), (14, 16), (0, 16), (20, 10)):
        u, v = at(*corner).split()
        sheet.add(f'<circle cx="{u}" cy="{v}" r="3.5" fill="#fff" stroke="{INK}"/>')
    for place, text, anchor, key in (
        ((-1.2, 7.4), "base", "end", True),
        ((49.2, 7.4), "tip", "start", True),
        ((40, 7.4), "bore", "middle", True),
        ((20, 7.4), "through", "middle", False),
        ((0, -3), "0, 0", "middle", False),
        ((40, -3), "40, 0", "middle", False),
        ((40, 17.6), "40, 16", "middle", False),
    ):
        u, v = map(float, at(*place).split())
        sheet.text(u, v, text, anchor=anchor, key=key)
    return sheet


PICTURES: tuple[Callable[[], Sheet], ...] = (
    sections,
    nodes,
    links,
    profiles,
    ends,
    roots,
    diaphragms,
    flat_springs,
    springs,
    bodies,
    superelements,
    parts,
    outlines,
    actuators,
)
