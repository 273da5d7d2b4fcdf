"""Four walks from the front page of the docs to an answer about a double parallelogram, by what pages on the way show.

Nobody on such a walk knows flexura. Pages are reached by links alone, every word of the file and of the commands stands
in a code block or between backticks of a page that was read, reading takes less than five minutes, and the answer is
held against what the walker works out by hand: leaves wider than thick bend between a beam and a plate.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.linalg

from helpers.doc_snippets import ROOT, run_command

FRONT = "docs/index.md"
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\[[^\]\n]*\]\(([^)\s]+)\)")
FIVE_MINUTES = 5 * 238
"""Words that are read in that time: adults reading silently do 238 a minute (Brysbaert 2019, J. Memory Lang. 109)."""

SKETCH = """\
flexura: 1
name: double parallelogram
substructures:
  leaf:
    nodes: {foot: [0, 0, 0], head: [0, 0, 50 mm]}
    flexures:
      blade:
        nodes: [foot, head]
        material: spring-steel
        reference: x
        profile: {type: leaf, width: 12 mm, thickness: 0.4 mm}
    interface: [foot, head]
instances:
  outer: {of: leaf, at: [-40 mm, 0, 0], pattern: {type: linear, count: 2, step: [80 mm, 0, 0]}}
  inner: {of: leaf, at: [-20 mm, 0, 0], pattern: {type: linear, count: 2, step: [40 mm, 0, 0]}}
bodies:
  bar:
    centre: [0, 0, 55 mm]
    solid: {shape: box, size: [100 mm, 12 mm, 10 mm], material: Al-6061-T6}
    carries: ["outer*.head", "inner*.head"]
  stage:
    centre: [0, 0, -5 mm]
    solid: {shape: box, size: [60 mm, 12 mm, 10 mm], material: Al-6061-T6}
    carries: ["inner*.foot"]
ground: {"outer*.foot": clamped}
"""
"""Two parallelograms in series: the bar stands on the outer leaves, and the stage hangs from it on the inner ones."""

OWN = {
    "double",
    "parallelogram",
    "outer",
    "inner",
    "bar",
    "stage",
    "leaf",
    "blade",
    "foot",
    "head",
    "drive",
    "gauge",
    "mine",
}
"""Names that the walker makes up."""

LENGTH, WIDTH, THICKNESS = 50e-3, 12e-3, 0.4e-3
MODULUS, POISSON, STEEL, ALUMINIUM = 206e9, 0.2956, 7850.0, 2700.0
BENDING = np.array([MODULUS, MODULUS / (1 - POISSON**2)])
"""Modulus in bending of a beam, and of a plate that is much wider than thick, Pa."""

ROOT_LENGTH = 16.67 / (12 * np.pi)
"""Length of leaf, over its thickness, that turns as an elastic root: O'Donnell (1960), J. Appl. Mech. 27, 461."""


class Walk:
    """What was read since the front page."""

    def __init__(self, folder: Path, *way: str) -> None:
        self.folder, self.read = folder, {FRONT: text_of(FRONT)}
        for target in way:
            assert target.partition("#")[0] in links(self.read), f"no page on the way leads to {target}"
            self.read[target] = text_of(target)
        prose = " ".join(FENCE.sub("", text) for target, text in self.read.items() if target != FRONT)
        assert len(re.findall(r"[A-Za-z]{2,}", prose)) < FIVE_MINUTES

    def writes(self, text: str) -> None:
        """The walker writes a file, of words that were read."""
        self._knows(re.sub(r"#.*", "", text))
        (self.folder / "mine.yaml").write_text(text, encoding="utf-8")

    def runs(self, command: str) -> str:
        """The walker types a command, of words that were read."""
        self._knows(command)
        found = run_command(command)
        assert found is not None and "error(s)" not in found and not found.startswith("flexura:"), found
        return found

    def _knows(self, text: str) -> None:
        shown = "\n".join(code for page in self.read.values() for code in code_of(page))
        words = set(re.findall(r"-{0,2}[A-Za-z][\w-]*", text)) - OWN
        unknown = sorted(word for word in words if not re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", shown))
        assert not unknown, f"no page on the way shows {unknown}"


def text_of(target: str) -> str:
    """Text of a page, or of the section that is named behind `#`."""
    path, _, anchor = target.partition("#")
    text = (ROOT / path).read_text(encoding="utf-8")
    if not anchor:
        return text
    for section in re.split(r"^(?=## )", text, flags=re.MULTILINE):
        heading = section.splitlines()[0].lstrip("# ").lower()
        if re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") == anchor:
            return section
    raise AssertionError(f"no section {target}")


def links(read: dict[str, str]) -> set[str]:
    """Pages to which those that were read lead, by links and tables of contents."""
    found = set()
    for target, text in read.items():
        here = (ROOT / target.partition("#")[0]).parent
        listed = [
            entry for block in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL) for entry in block.split("\n")
        ]
        names = [re.sub(r"^.*<(.*)>$", r"\1", entry.strip()) + ".md" for entry in listed if entry and entry[0] != ":"]
        names += LINK.findall(FENCE.sub("", text))
        for name in names:
            file = (here / name.partition("#")[0]).resolve()
            if file.is_file() and file.is_relative_to(ROOT):
                found.add(str(file.relative_to(ROOT)))
    return found


def code_of(page: str) -> list[str]:
    """Code blocks of a page and what stands between backticks."""
    return [*re.findall(r"^```.*?^```", page, re.MULTILINE | re.DOTALL), *re.findall(r"`[^`\n]+`", FENCE.sub("", page))]


def stiffness() -> np.ndarray:
    """Stiffness of one parallelogram, N/m, of beams and of plates: two leaves, guided between elastic roots."""
    return 24 * BENDING * WIDTH * THICKNESS**3 / 12 / (LENGTH**3 * (1 + 6 * ROOT_LENGTH * THICKNESS / LENGTH))


def frequency() -> np.ndarray:
    """First frequency, Hz, of beams and of plates: stage and bar on two springs, leaves with mass, bent as cubics."""
    leaves = 2 * STEEL * WIDTH * THICKNESS * LENGTH
    stage, bar = (ALUMINIUM * length * 12e-3 * 10e-3 for length in (60e-3, 100e-3))
    M = np.array([[stage + 13 / 35 * leaves, 9 / 70 * leaves], [9 / 70 * leaves, bar + 26 / 35 * leaves]])
    shape = np.array([[1.0, -1.0], [-1.0, 2.0]])
    return np.sqrt([scipy.linalg.eigh(k * shape, M, eigvals_only=True)[0] for k in stiffness()]) / (2 * np.pi)


def stroke(stress: float) -> np.ndarray:
    """Stroke, m, at a stress, Pa, of beams and of plates: 3 E t d / L^2 at the ends of leaves that take half, d."""
    return 2 * stress * LENGTH**2 / (3 * BENDING * THICKNESS)


def between(value: float, ends: np.ndarray) -> bool:
    return bool(ends.min() < value < ends.max())


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def first(printed: str) -> float:
    """Frequency, Hz, of the first row of a table of modes, in which the stage moves along x."""
    row = re.search(r"^ +1 +([\d.]+) .*stage moves along x", printed, re.MULTILINE)
    assert row, printed
    return float(row[1])


def test_first_frequency(folder):
    walk = Walk(folder, "docs/start/first.md")
    walk.writes(SKETCH)
    assert between(first(walk.runs("flexura modes mine.yaml -n 1")), frequency())


def test_stroke_at_400_MPa(folder):
    walk = Walk(folder, "docs/how-to/index.md", "docs/how-to/safe-stroke.md")
    mine = """\
parameters: {thickness: 0.4 mm}
materials: {mine: {E: 206 GPa, G: 79.5 GPa, rho: 7850 kg/m^3, yield_stress: 400 MPa}}
"""
    walk.writes(mine + SKETCH.replace("spring-steel", "mine").replace("thickness: 0.4 mm", "thickness: thickness"))
    printed = walk.runs("flexura sweep mine.yaml --vary thickness=0.3mm:0.5mm:3 --ask 'reach(stage.x)' --workers 1")
    row = re.search(r"^ +1 +0\.4 +([\d.]+) *$", printed, re.MULTILINE)
    assert row, printed
    assert between(float(row[1]) * 1e-3, stroke(400e6))


def test_frequency_at_that_stroke(folder):
    """Nothing draws along the leaves of a double parallelogram: its frequency stays, to 2 %, what it is at rest."""
    walk = Walk(folder, "docs/how-to/index.md", "docs/how-to/over-the-stroke.md")
    far = f"{1e3 * stroke(400e6).mean():.1f}"
    walk.writes(SKETCH + f"motion: {{move: {{stage: {{x: [0 mm, {far} mm]}}}}, steps: 3, modes: 1}}\n")
    rest = first(walk.runs("flexura modes mine.yaml -n 1"))
    poses = [line.split() for line in walk.runs("flexura stroke mine.yaml").splitlines() if " driven " in line]
    assert [float(row[0]) for row in poses] == pytest.approx([0.0, float(far) / 2, float(far)], rel=1e-3)
    assert float(poses[-1][2]) == pytest.approx(rest, rel=0.02)
    assert between(float(poses[-1][2]), frequency())


def test_state_space(folder):
    walk = Walk(folder, "docs/how-to/index.md", "docs/how-to/controller.md")
    driven = """\
actuators:
  drive: {type: force, nodes: [stage], direction: x}
sensors:
  gauge: {type: displacement, nodes: [stage], direction: x}
damping: 0.5 %
"""
    walk.writes(SKETCH + driven)
    printed = walk.runs("flexura export mine.yaml --what state-space -n 4 --out mine.mat")
    assert "is left out" in printed
    A, B, C, D = (scipy.io.loadmat("mine.mat")[name] for name in "ABCD")
    poles = scipy.linalg.eigvals(A)
    lowest = poles[np.abs(poles).argmin()]
    assert A.shape == (8, 8)
    assert between(abs(lowest) / (2 * np.pi), frequency())
    assert -lowest.real / abs(lowest) == pytest.approx(0.005, rel=1e-6)
    assert between(float((D - C @ scipy.linalg.solve(A, B))[0, 0]), 2 / stiffness())


def test_a_walk_knows_only_what_it_read(folder):
    walk = Walk(folder, "docs/start/first.md")
    with pytest.raises(AssertionError, match=r"leads to docs/how-to/doubts\.md"):
        Walk(folder, "docs/start/first.md", "docs/how-to/doubts.md")
    with pytest.raises(AssertionError, match="superelements"):
        walk.writes("superelements: {}\n")
    with pytest.raises(AssertionError, match="--residual-modes"):
        walk.runs("flexura modes mine.yaml --residual-modes")
