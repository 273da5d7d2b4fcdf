"""What keys of the mechanism file mean that are no parts, each beside a piece of a file."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from drawing import GREY, INK, RULE, WIDTH, Area, Sheet, mechanism
from file_parts import GUIDE
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.stats import qmc

from flexura.beam import notch
from flexura.structure import Design, Plan
from flexura.systems import filter_of, spectrum_of

ORANGE, BLUE, RED = "#b8530a", "#1a5fb4", "#990d40"


class Chart:
    """Curves over two axes in an area of a sheet."""

    def __init__(self, sheet: Sheet, area: Area, x: tuple[float, float], y: tuple[float, float], words: Sequence[str]):
        self.sheet, self.area, self.x, self.y = sheet, area, x, y
        sheet.arrow((area.left, area.bottom), (area.right + 10, area.bottom))
        sheet.arrow((area.left, area.bottom), (area.left, area.top - 10))
        sheet.text(area.right + 8, area.bottom + 17, words[0], anchor="end")
        sheet.text(area.left - 4, area.top - 16, words[1], anchor="start")

    def at(self, x: ArrayLike, y: ArrayLike) -> np.ndarray:
        """Places (..., 2) on the sheet."""
        u = (np.asarray(x, dtype=float) - self.x[0]) / (self.x[1] - self.x[0])
        v = (np.asarray(y, dtype=float) - self.y[0]) / (self.y[1] - self.y[0])
        own = self.area
        return np.stack([own.left + u * (own.right - own.left), own.bottom - v * (own.bottom - own.top)], axis=-1)

    def curve(self, x: ArrayLike, y: ArrayLike, colour: str = ORANGE, width: float = 1.8, more: str = "") -> None:
        """A curve through values."""
        self.sheet.line(*self.at(x, y), colour=colour, width=width, more=more)

    def level(self, y: float, words: str, until: float | None = None) -> None:
        """A dashed line at a value, with words at its left end."""
        self.curve([self.x[0], self.x[1] if until is None else until], [y, y], GREY, 0.9, ' stroke-dasharray="4 3"')
        u, v = self.at(self.x[0], y)
        self.sheet.text(u - 6, v + 4, words, anchor="end", key=True)

    def mark(self, x: float, words: str, top: float | None = None) -> None:
        """A dashed line at a value, with words below it."""
        self.curve([x, x], [self.y[0], self.y[1] if top is None else top], GREY, 0.9, ' stroke-dasharray="4 3"')
        u, v = self.at(x, self.y[0])
        self.sheet.text(u, v + 16, words, key=True)

    def dots(self, x: ArrayLike, y: ArrayLike, colour: str = ORANGE, radius: float = 2.6) -> None:
        """Dots at values."""
        for u, v in self.at(x, y):
            self.sheet.add(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="{radius}" fill="{colour}"/>')


def materials() -> Sheet:
    """The line of stress over strain, and its end."""
    fragment = """\
materials:
  wire:
    E: 206 GPa
    G: 79.5 GPa
    rho: 7850 kg/m^3
    yield_stress: 1400 MPa
    loss_factor: 0.1 %"""
    mechanism(GUIDE, fragment)
    sheet = Sheet("Linear elasticity with E and G; stress is held against yield_stress", fragment, 210)
    left = Chart(sheet, Area(sheet.left + 150, 46, sheet.left + 290, 170), (0, 1), (0, 1), ("strain", "stress"))
    left.curve([0, 0.8], [0, 0.9])
    left.level(0.9, "yield_stress", 0.8)
    left.curve([0.25, 0.5, 0.5], [0.28125, 0.28125, 0.5625], GREY, 1.0)
    u, v = left.at(0.5, 0.42)
    sheet.text(u + 6, v + 4, "E", anchor="start", key=True)
    right = Chart(
        sheet, Area(sheet.left + 350, 46, sheet.left + 490, 170), (-1.1, 1.1), (-1.1, 1.1), ("strain", "stress")
    )
    a = np.linspace(0, 2 * np.pi, 73)
    right.curve(0.9 * np.cos(a), 0.8 * np.cos(a + 0.28))
    u, v = right.at(0, 0)
    sheet.line((u + 4, v), (u + 88, v), width=0.8)
    sheet.text(u + 92, v + 4, "loss_factor", anchor="start", key=True)
    sheet.text(u + 92, v + 22, "what a cycle", anchor="start")
    sheet.text(u + 92, v + 38, "loses", anchor="start")
    return sheet


def contours() -> Sheet:
    """Contours with their sizes."""
    fragment = """\
contour:
  shape: circular
  radius: 5 mm
  web: 1 mm"""
    sheet = Sheet("Contours of notches with their sizes", fragment, 420)
    a, x = 5.0, np.linspace(-5.0, 5.0, 81)
    kinds = (
        ("circular", notch.circular(x, a, 1.0)),
        ("elliptical", notch.elliptical(x, a, 3.0, 1.0)),
        ("corner_filleted", notch.corner_filleted(x, a, 2.0, 1.0)),
        ("v_shaped", notch.v_shaped(x, np.radians(35), 1.0, 1.0)),
        ("table", notch.tabulated(x + a, np.array([0.0, 3, 6, 10]), np.array([5.0, 1.5, 1, 4]))),
        ("straight", np.full_like(x, 1.0)),
    )
    for k, (name, h) in enumerate(kinds):
        left, top = sheet.left + 24 + 216 * (k % 3), 110 + 186 * (k // 3)

        def at(u: float, v: float, left: float = left, top: float = top) -> tuple[float, float]:
            return left + 70 + 11 * u, top - 11 * v

        shape = [at(u, v / 2) for u, v in zip(x, h, strict=True)] + [
            at(u, -v / 2) for u, v in zip(x[::-1], h[::-1], strict=True)
        ]
        sheet.add(
            f'<polygon points="{" ".join(f"{u:.1f},{v:.1f}" for u, v in shape)}" fill="#ed6b1a" stroke="#7a3408"/>'
        )
        sheet.text(left + 70, top + 84, name, key=True)
        _sizes(sheet, name, at)
    return sheet


def _sizes(sheet: Sheet, name: str, at: Callable[[float, float], tuple[float, float]]) -> None:
    """The sizes of a contour, at places of its own drawing, mm."""
    if name != "table":
        sheet.arrow(at(0, 2.3), at(0, 0.5))
        sheet.arrow(at(0, -2.3), at(0, -0.5))
        sheet.text(at(0, 0)[0], at(0, -2.3)[1] + 13, "web", key=True)
    if name == "circular":
        sheet.arrow(at(0, 5.5), at(4, 2.5))
        sheet.text(at(0, 0)[0], at(0, 5.7)[1], "radius", key=True)
    elif name == "elliptical":
        sheet.arrow(at(5.6, 0.5), at(5.6, 3.5), both=True)
        sheet.text(at(6, 0)[0], at(0, 2)[1] + 4, "depth", anchor="start", key=True)
    elif name == "corner_filleted":
        sheet.arrow(at(-3, 2.5), at(-3 - 2**0.5, 2.5 - 2**0.5))
        sheet.text(at(-1.2, 0)[0], at(0, 2.9)[1], "fillet_radius", key=True)
    elif name == "v_shaped":
        sheet.line(at(0, 0.5), at(5, 0.5), width=0.8, more=' stroke-dasharray="4 3"')
        bend = np.radians(np.linspace(0, 35, 9))
        sheet.line(*(at(3.4 * np.cos(b), 0.5 + 3.4 * np.sin(b)) for b in bend), colour=INK, width=1.2)
        sheet.line(at(3.3, 1.4), at(1.0, 3.6), width=0.8)
        sheet.text(at(0.6, 0)[0], at(0, 3.9)[1], "angle", key=True)
        sheet.line(at(2.2, -4.4), at(0.3, -0.6), width=0.8)
        sheet.text(at(3.2, 0)[0], at(0, -5.6)[1], "root_radius", key=True)
    elif name == "table":
        for u, h in ((-5, 5.0), (-2, 1.5), (1, 1.0), (5, 4.0)):
            sheet.arrow(at(u, h / 2), at(u, -h / 2), both=True, colour=INK)
            sheet.line(at(u, -h / 2), at(u, -3.2), width=0.7)
        sheet.text(at(0, 0)[0], at(0, -4.5)[1], "positions, thicknesses", key=True)


def reduction() -> Sheet:
    """What a reduction keeps of a substructure."""
    fragment = """\
substructures:
  leaf:
    interface: [foot, head]
reduction:
  keep: {leaf: 2}"""
    mechanism(GUIDE, fragment)
    sheet = Sheet("A reduction keeps the interface and some normal modes with the interface held", fragment, 190)
    x = np.linspace(0, 1, 11)
    left, right = sheet.left + 90.0, WIDTH - 200.0
    u = left + (right - left) * x
    sheet.line((left, 60), (right, 60), colour=ORANGE, width=2.5)
    for k, at in enumerate(u):
        held = k in (0, 10)
        fill, size = (BLUE, 6) if held else ("#ffffff", 3.4)
        sheet.add(f'<circle cx="{at:.1f}" cy="60" r="{size}" fill="{fill}" stroke="{INK}"/>')
    sheet.text(left, 42, "foot", key=True)
    sheet.text(right, 42, "head", key=True)
    sheet.text(right + 18, 64, "interface: kept", anchor="start")
    sheet.text((left + right) / 2, 42, "nodes of elements: left out")
    fine = np.linspace(0, 1, 61)
    for k, (root, y) in enumerate(((4.730040745, 108.0), (7.853204624, 158.0))):
        sigma = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
        shape = np.cosh(root * fine) - np.cos(root * fine) - sigma * (np.sinh(root * fine) - np.sin(root * fine))
        sheet.line((left, y), (right, y), width=0.7)
        drawn = y - 15 * shape / np.abs(shape).max()
        sheet.line(*np.stack([left + (right - left) * fine, drawn], axis=-1), colour=ORANGE, width=1.8)
        for at in (left, right):
            sheet.add(f'<circle cx="{at}" cy="{y}" r="6" fill="{BLUE}" stroke="{INK}"/>')
        sheet.text(right + 18, y + 4, f"keep: mode {k + 1}", anchor="start")
    return sheet


def damping() -> Sheet:
    """Damping ratios over frequency."""
    fragment = """\
damping:
  bands:
    - {up_to: 50 Hz, ratio: 0.5 %}
    - {up_to: 3 kHz, ratio: 1 %}
  rayleigh:
    frequencies: [10 Hz, 1 kHz]
    ratios: [0.2 %, 0.4 %]"""
    mechanism(GUIDE, fragment)
    sheet = Sheet("Damping ratio over frequency: bands, and Rayleigh damping through two points", fragment, 230)
    chart = Chart(
        sheet,
        Area(sheet.left + 100, 52, WIDTH - 60, 186),
        (0.5, 3.9),
        (0, 1.2),
        ("", "damping ratio over frequency; both add up"),
    )
    chart.curve([0.5, np.log10(50), np.log10(50), np.log10(3000)], [0.5, 0.5, 1.0, 1.0], BLUE)
    w = 2 * np.pi * np.array([10.0, 1000.0])
    alpha, beta = np.linalg.solve(np.stack([1 / (2 * w), w / 2], axis=-1), [0.2, 0.4])
    f = np.logspace(0.5, 3.6, 90)
    zeta = alpha / (4 * np.pi * f) + beta * np.pi * f
    chart.curve(np.log10(f)[zeta < 1.15], zeta[zeta < 1.15])
    chart.dots(np.log10([10, 1000]), [0.2, 0.4], INK, 3.6)
    for hz, words in ((10, "10 Hz"), (50, "50 Hz"), (1000, "1 kHz"), (3000, "3 kHz")):
        chart.mark(np.log10(hz), words, {10: 0.2, 50: 1.0, 1000: 0.4, 3000: 1.0}[hz])
    chart.level(0.5, "0.5 %", 0.5)
    chart.level(1.0, "1 %", 0.5)
    sheet.text(*(chart.at(2.5, 1.0) + np.array([0, -8])), "bands: up_to, ratio", key=True)
    sheet.text(*(chart.at(1.45, 0.1) + np.array([0, 2])), "rayleigh", key=True)
    return sheet


def stops() -> Sheet:
    """Force over the way of the node, on the way in and on the way out."""
    fragment = """\
stops:
  end:
    nodes: [carriage]
    direction: x
    gap: 0.5 mm
    stiffness: 1 kN/mm
    damping: 2 s/m"""
    stop = mechanism(GUIDE, fragment).stops["end"]
    gap, k, c = (float(own) for own in (stop.gap, stop.stiffness, stop.damping))
    words = (
        "The force of a stop over the way of its node: none up to the gap, then its stiffness, more on the way in than"
    )
    sheet = Sheet(f"{words} on the way out", fragment, 220)
    speed, mass = 0.2, 1.0
    chart = Chart(
        sheet,
        Area(sheet.left + 60, 52, WIDTH - 60, 176),
        (0, 0.8),
        (0, 260),
        ("way of the node, mm", "force of the stop, N"),
    )

    def rates(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -k * max(state[0], 0.0) * max(1 + c * state[1], 0.0) / mass]

    p, v = solve_ivp(rates, (0, 3.3e-3), [0.0, speed], max_step=2e-5).y
    met = p >= 0
    chart.curve([0, 1e3 * gap], [0, 0], INK, 2.4)
    chart.curve(1e3 * (gap + p[met]), (k * p * (1 + c * v))[met])
    deepest = float(p.max())
    chart.curve(1e3 * (gap + np.array([0, deepest])), k * np.array([0, deepest]), GREY, 0.9, ' stroke-dasharray="4 3"')
    chart.mark(1e3 * gap, "gap", 0)
    sheet.text(
        *(chart.at(1e3 * (gap + 0.85 * deepest), 0.85 * k * deepest) + np.array([8, 14])), "stiffness", anchor="start"
    )
    sheet.text(*(chart.at(1e3 * gap, 150) + np.array([-6, 0])), "damping: in above, out below", anchor="end")
    return sheet


def modal_test() -> Sheet:
    """A record of a hammer test."""
    fragment = """\
test:
  sample_rate: 8 kHz
  duration: 0.5 s
  pulse: 0.6 ms
  force_window: 1 ms
  exponential: 0.1
  hits: 5
  peak: 10 N"""
    point = "{node: carriage, direction: x}"
    mechanism(GUIDE, f"test: {{hammer: {{h: {point}}}, accelerometers: {{p: {point}}}}}", fragment)
    sheet = Sheet("A record of a hammer test: the pulse, the windows, the decay", fragment, 290)
    above = Chart(
        sheet, Area(sheet.left + 110, 46, WIDTH - 60, 120), (0, 0.5), (0, 11), ("time, not to scale", "force")
    )
    t = np.linspace(0, 0.5, 600)
    above.curve(t, np.where(t < 0.04, 10 * np.sin(np.pi * np.clip(t, 0, 0.04) / 0.04) ** 2, 0), RED)
    above.curve([0, 0.06, 0.075, 0.5], [10.8, 10.8, 0.1, 0.1], BLUE, 1.2, ' stroke-dasharray="5 3"')
    above.level(10, "peak", 0.02)
    above.mark(0.04, "pulse", 0)
    sheet.text(*(above.at(0.08, 8)), "force_window", anchor="start", key=True)
    below = Chart(sheet, Area(sheet.left + 110, 176, WIDTH - 60, 256), (0, 0.5), (-1.1, 1.1), ("", "acceleration"))
    late = np.clip(t - 0.02, 0, None)
    below.curve(t, np.exp(-2.5 * late) * np.sin(2 * np.pi * 38 * late) * (late > 0) * 0.9, ORANGE, 1.2)
    below.curve(t, np.exp(np.log(0.1) * t / 0.5), BLUE, 1.2, ' stroke-dasharray="5 3"')
    sheet.text(*(below.at(0.24, 0.62)), "exponential: value at the end", anchor="start", key=True)
    below.mark(0.5, "duration")
    return sheet


def studies() -> Sheet:
    """Samplings of a sweep, an optimum at a limit, and spreads."""
    fragment = """\
studies:
  sizes:
    sweep: {vary: ..., sampling: sobol}
  best:
    optimize:
      maximise: f1
      subject_to: [mass <= 0.3 kg]
  spread:
    tolerance:
      vary: {t: {normal: 5 um, within: 2}}
      require: f1 >= 20 Hz"""
    sheet = Sheet("Samplings of sweeps, an optimum at its limit, and the spread of quantities", fragment, 400)
    grid = np.stack(np.meshgrid(np.linspace(0.1, 0.9, 4), np.linspace(0.1, 0.9, 4)), axis=-1).reshape(-1, 2)
    latin = qmc.LatinHypercube(2, rng=np.random.default_rng(3)).random(16)
    sobol = qmc.Sobol(2, rng=np.random.default_rng(1)).random(16)
    for k, (name, x) in enumerate((("grid", grid), ("latin hypercube", latin), ("sobol", sobol))):
        left = sheet.left + 36 + 168 * k
        chart = Chart(sheet, Area(left, 44, left + 112, 150), (0, 1), (0, 1), ("", ""))
        chart.dots(x[:, 0], x[:, 1])
        sheet.text(left + 56, 172, name, key=True)
    left = sheet.left + 36
    chart = Chart(sheet, Area(left, 240, left + 170, 350), (0, 1), (0, 1), ("t", "f1"))
    x = np.linspace(0.05, 0.95, 50)
    chart.curve(x, 0.12 + 0.85 * x**1.1)
    u, v = chart.at(0.62, 0)
    sheet.add(f'<rect x="{u:.1f}" y="240" width="{left + 170 - u:.1f}" height="110" fill="{RULE}" fill-opacity="0.5"/>')
    chart.dots([0.62], [0.12 + 0.85 * 0.62**1.1], BLUE, 5)
    sheet.text(u, v + 17, "mass = 0.3 kg", key=True)
    left += 250
    chart = Chart(sheet, Area(left, 240, left + 170, 350), (-2.6, 2.6), (0, 1.1), ("f1", "share of parts"))
    x = np.linspace(-2, 2, 60)
    chart.curve([-2, *x, 2], [0, *np.exp(-(x**2) / 2), 0])
    chart.mark(-1.1, "20 Hz")
    u, _ = chart.at(-1.1, 0)
    sheet.add(f'<rect x="{left}" y="240" width="{u - left:.1f}" height="110" fill="{RULE}" fill-opacity="0.5"/>')
    sheet.text(*(chart.at(0.2, 0.3)), "good")
    return sheet


def requirements() -> Sheet:
    """What is required, beside what it is."""
    fragment = """\
requirements:
  first mode: f1 >= 20 Hz
  straight: parasitic(d.x) <= 0.2 mm
    at d.y = 2 mm"""
    mechanism(GUIDE, fragment)
    sheet = Sheet("What the mechanism is to do beside what it does, met and missed", fragment, 170)
    left, right = sheet.left + 60, WIDTH - 60
    for y, name, limit, found, side in ((60.0, "first mode", 0.3, 0.55, 1), (125.0, "straight", 0.6, 0.75, -1)):
        x, own = (left + share * (right - left) for share in (limit, found))
        good = (x, right) if side > 0 else (left, x)
        sheet.line((left, y), (right, y), width=1.4)
        at = f'x="{good[0]:.0f}" y="{y - 12:.0f}" width="{good[1] - good[0]:.0f}" height="24"'
        sheet.add(f'<rect {at} fill="{BLUE}" fill-opacity="0.15"/>')
        sheet.line((x, y - 18), (x, y + 18), colour=BLUE, width=2.0)
        sheet.text(left, y - 20, name, anchor="start", key=True)
        sheet.add(f'<circle cx="{own:.0f}" cy="{y:.0f}" r="5.5" fill="{ORANGE}" stroke="{INK}"/>')
        sheet.text(own, y + 26, "met" if (own - x) * side > 0 else "missed")
    return sheet


def published() -> Sheet:
    """What others give, within how much."""
    fragment = """\
published:
  - ask: f1
    value: 55 Hz
    within: 2 %
    source: "Author, year, Table 2\""""
    mechanism(GUIDE, fragment)
    sheet = Sheet("The number of the mechanism beside that of a source, within so much", fragment, 150)
    y, x = 82.0, float(sheet.left + 260)
    sheet.line((sheet.left + 60, y), (WIDTH - 50, y), width=1.4)
    sheet.add(f'<rect x="{x - 110}" y="{y - 16}" width="220" height="32" fill="{BLUE}" fill-opacity="0.15"/>')
    sheet.line((x, y - 22), (x, y + 22), colour=BLUE, width=2.0)
    sheet.text(x, y - 30, "value", key=True)
    sheet.arrow((x, y + 30), (x + 110, y + 30), both=True)
    sheet.text(x + 55, y + 50, "within", key=True)
    sheet.add(f'<circle cx="{x + 42}" cy="{y}" r="5.5" fill="{ORANGE}" stroke="{INK}"/>')
    sheet.text(x + 46, y - 24, "f1 of the mechanism", anchor="start")
    return sheet


COIL = """\
sensors:
  gauge: {type: displacement, nodes: [carriage], direction: x}
actuators:
  coil: {type: force, nodes: [carriage], direction: x}
"""


def temperatures() -> Sheet:
    """Temperatures along the leaves of a stage that is heated."""
    fragment = """\
temperatures:
  driven: {carriage: {power: 0.5 W}}"""
    described = mechanism(GUIDE, COIL + fragment)
    design = Design.of(Plan(described))
    warm = design.plan.temperatures.of("driven", design)
    sheet = Sheet("A stage that is heated: temperatures along its leaves", fragment, 230)
    leaf = next(own.elements for own in warm.values() if own.elements is not None)
    chart = Chart(
        sheet, Area(sheet.left + 60, 60, sheet.left + 300, 180), (0, 1), (0, 1.05 * float(leaf.max())), ("x / L", "K")
    )
    chart.curve((np.arange(len(leaf)) + 0.5) / len(leaf), leaf)
    return sheet


def thermal_contacts() -> Sheet:
    """How a stage gets warm that is heated and stands in air."""
    fragment = """\
temperatures:
  driven: {carriage: {power: 0.5 W}}
thermal_contacts:
  air: {between: [carriage, air],
        coefficient: 5 W/(m^2*K),
        area: 60 cm^2}"""
    design = Design.of(Plan(mechanism(GUIDE, COIL + fragment)))
    (slowest, *_), _ = design.plan.temperatures.network.time_constants(design)
    sheet = Sheet("A film of air, and how a heated stage gets warm", fragment, 230)
    seconds = np.linspace(0, 5 * slowest, 100)
    warm = 1 - np.exp(-seconds / slowest)
    chart = Chart(sheet, Area(sheet.left + 60, 60, sheet.left + 300, 180), (0, 5 * slowest), (0, 1.05), ("t", "T"))
    chart.curve(seconds, warm)
    chart.mark(float(slowest), f"{slowest / 60:.0f} min")
    return sheet


def disturbances() -> Sheet:
    """Densities over frequency, on logarithmic axes."""
    fragment = """\
disturbances:
  floor: {base: x, spectrum: VC-A}
  amplifier: {input: coil, corner: 10 Hz,
              density: 5 uN/sqrt(Hz),
              band: [1 Hz, 1 kHz]}
  air: {input: carriage.tz, table: [
          [1 Hz, 30 uN/sqrt(Hz)],
          [100 Hz, 2 uN/sqrt(Hz)]]}"""
    described = mechanism(GUIDE, COIL + fragment).disturbances
    sheet = Sheet("A criterion for floors, noise with a corner, and a table of densities", fragment, 250)
    for k, (name, own) in enumerate(described.items()):
        left = sheet.left + 30.0 + 185 * k
        spectrum = spectrum_of(own)
        hz = np.geomspace(float(spectrum.start[0]), float(spectrum.stop[-1]), 80)
        power = spectrum.at(hz)
        x, y = np.log10(hz), np.log10(power / power.max()) / 2
        chart = Chart(sheet, Area(left, 70, left + 140, 190), (-0.1, 3.1), (-1.8, 0.1), ("f", name))
        chart.curve(x, y)
    return sheet


def controllers() -> Sheet:
    """The response of a controller over frequency, on logarithmic axes."""
    fragment = """\
controllers:
  servo:
    sensor: gauge
    actuator: coil
    proportional: 25 N/mm
    integral: 2000 N/(mm*s)
    derivative: 0.06 N*s/mm
    low_pass: 1.5 kHz
    notches: [{frequency: 750 Hz}]
    delay: 0.05 ms"""
    own = filter_of(mechanism(GUIDE, COIL + fragment).controllers["servo"])
    sheet = Sheet("The response of a controller, its filters and its dead time", fragment, 250)
    hz = np.geomspace(1, 1e4, 300)
    K, left = own.response(hz), sheet.left + 60.0
    size, x = np.log10(np.abs(K) / np.abs(K).min()), np.log10(hz)
    chart = Chart(sheet, Area(left, 70, left + 200, 190), (0, 4), (0, float(size.max())), ("f", "|K|"))
    chart.curve(x, size)
    chart.mark(float(np.log10(750)), "750 Hz")
    phase = np.unwrap(np.angle(K))
    chart = Chart(sheet, Area(left + 260, 70, left + 460, 190), (0, 4), (float(phase.min()), 1.6), ("f", "phase"))
    chart.curve(x, phase)
    return sheet


PICTURES: tuple[Callable[[], Sheet], ...] = (
    *(
        materials,
        contours,
        reduction,
        damping,
        stops,
        modal_test,
        temperatures,
        thermal_contacts,
        disturbances,
        controllers,
        requirements,
        studies,
        published,
    ),
)
