"""A report is one file that tells what commands tell, whatever the mechanism is called and whatever fails."""

from __future__ import annotations

import csv
import json
import math
import re
import shlex
from dataclasses import replace
from functools import cache
from html import escape
from html.parser import HTMLParser
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.pages.report.chart import ends, ticks
from flexura.pages.report.document import grouped
from helpers.shell import flexura

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "examples").glob("*/*.yaml"))
GUIDE = ROOT / "examples/guide/guide.yaml"
TEXT = GUIDE.read_text(encoding="utf-8").partition("studies:")[0]
"""The guide without its study, which takes as long as all the rest."""
FLOATING = TEXT.partition("ground:")[0]
DESCRIBED = """
actuators:
  coil: {type: force, nodes: [carriage], direction: x, limit: 2 N}
sensors:
  position: {type: displacement, nodes: [carriage], direction: x}
damping: 0.01
gravity: [0, 0, -9.81 m/s^2]
loads:
  carriage: {force: [1 N, 0, -5 N]}
motion:
  move:
    carriage: {x: [-2 mm, 2 mm]}
  steps: 5
  modes: 3
"""
"""What the guide does not describe: then every section but those of solids and tests is there."""
VOID = {"meta", "img", "br", "hr", "input", "link", "path", "rect"}
COMMAND = r"(\w+) at (-?[\d.e-]+) (mN|N)"
UNITS = np.array([1.0, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12, 100.0, 180 / np.pi])
"""Of an SI number in the units of a page: prefixes, per cent and degrees."""
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


class Page(HTMLParser):
    """A page by its tags: whether they are balanced, what it loads, its tables of numbers with their commands."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.faults: list[str] = []
        self.loads: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.numbers: list[tuple[list[str], str]] = []
        self.commands: list[str] = []
        self._cells: list[str] = []
        self._kind = ""
        self.feed(text)
        self.close()
        self.faults += [f"<{tag}> is not closed" for tag in self.open]

    def handle_starttag(self, tag, attrs):
        own = dict(attrs)
        self.ids += [own["id"] or ""] if "id" in own else []
        self.links += [own["href"] or ""] if "href" in own else []
        self.loads += [own[name] or "" for name in ("src", "srcset", "data", "poster") if name in own]
        kind = own.get("class") or ""
        if tag == "div" and kind == "numbers":
            self._cells = []
        if tag == "td" and kind == "number":
            self._cells.append("")
        if tag == "pre" and kind == "command":
            self.commands.append("")
        self._kind = kind if tag in ("td", "pre") else self._kind
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        if tag not in VOID:
            self.faults.append(f"<{tag}/>")

    def handle_endtag(self, tag):
        if not self.open or self.open[-1] != tag:
            self.faults.append(f"</{tag}> at {self.getpos()} closes {self.open[-1:]}")
            return
        self.open.pop()
        if tag == "pre" and self._kind == "command" and self._cells:
            self.numbers.append((self._cells, self.commands[-1]))
            self._cells = []
        if tag in ("td", "pre"):
            self._kind = ""

    def handle_data(self, data):
        if self._kind == "number" and self._cells:
            self._cells[-1] += data
        elif self._kind == "command":
            self.commands[-1] += data


def described(folder: Path, name: str = "described.yaml", title: str = "a guide") -> Path:
    """A guide whose file describes all that a report tells."""
    text = TEXT.replace("name: parallel leaf-spring guide", f"name: {json.dumps(title)}")
    path = folder / name
    path.write_text(text + DESCRIBED, encoding="utf-8")
    return path


QUICK = ("guide.yaml", "rpr_piezo.yaml")


@pytest.mark.parametrize(
    "example",
    [
        own if own.endswith(QUICK) and "imported" not in own else pytest.param(own, marks=pytest.mark.slow)
        for own in EXAMPLES
    ],
)
def test_examples_have_small_whole_pages(example, monkeypatch):
    monkeypatch.chdir(ROOT)
    found = fx.report(fx.load(example), file=example)
    page = Page(found.html)
    assert page.faults == []
    assert len(found.html.encode()) < 2_000_000
    assert [own for own in page.loads if not own.startswith("data:")] == []
    assert all(own.startswith("#") and own[1:] in page.ids for own in page.links)
    assert len(set(page.ids)) == len(page.ids)
    assert "failed" not in found.states.values()
    assert found.states["modes"] == found.states["scene"] == "shown"


def test_the_same_input_gives_the_same_file(tmp_path):
    path = described(tmp_path)
    first, second = (fx.report(fx.load(path), {"thickness": 4e-4}, file=path) for _ in range(2))
    assert first.html == second.html
    assert fx.report(fx.load(path), {"thickness": 4.1e-4}, file=path).html != first.html


def test_every_section_is_there_or_says_why(tmp_path):
    found = fx.report(fx.load(described(tmp_path)))
    missing = {name for name, state in found.states.items() if state != "shown"}
    assert missing == {"requirements", "budget", "studies", "solid", "test"}
    bare = fx.report(fx.loads(TEXT))
    absent = [name for name, state in bare.states.items() if state == "absent"]
    assert absent == [
        *("requirements", "statics", "stroke", "budget", "stress", "buckling", "studies", "solid", "test")
    ]
    for name in absent:
        section = bare.html.partition(f'<section id="{name}"')[2].partition("</section>")[0]
        assert len(re.sub(r"<[^>]*>", "", section)) > 60


def test_about_a_pose_what_holds_at_rest_alone_says_so(tmp_path):
    found = fx.report(fx.load(described(tmp_path)), at={"carriage.x": 1e-3})
    assert found.states["freedoms"] == "absent" and found.states["modes"] == found.states["stroke"] == "shown"
    assert fx.report(fx.load(described(tmp_path))).html != found.html and "undeformed mechanism alone" in found.html


def values(text: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(text.replace("+-", ""))]


@cache
def printed(command: str) -> NDArray[np.float64]:
    """Numbers that a command of a page prints, and those of the table that it writes, in units that they may have."""
    words = shlex.split(command)
    done = CliRunner().invoke(app, words[1:])
    assert done.exit_code == 0, done.stderr
    found = values(done.stdout)
    if "--out" in words:
        with Path(words[words.index("--out") + 1]).open(encoding="utf-8", newline="") as stream:
            found += [float(cell) for row in list(csv.reader(stream))[1:] for cell in row if cell]
    return np.array(found)[:, None] * UNITS


def is_among(text: str, found: NDArray[np.float64]) -> bool:
    """Whether some number reads as this in the digits of the text; phases, whole turns apart, are the same."""
    number = float(text)
    digits = len(re.sub(r"e.*|[-+.]", "", text).lstrip("0")) or 1
    scale = 10 ** (digits - 1 - math.floor(math.log10(abs(number)))) if number else 1e9
    turns = range(-2, 3) if abs(number) > 180 else [0]
    near = [np.where(abs(found) <= 360, found + 360 * k, found) for k in turns]
    with np.errstate(over="ignore"):
        return bool((np.abs(np.rint(np.stack(near) * scale) - round(number * scale)) <= 1).any())


def numbers_are_made_again(path: Path, settings: dict[str, float], at: dict[str, float]) -> None:
    page = Page(fx.report(fx.load(path), settings, file=path, at=at).html)
    assert len(page.numbers) > 6
    for cells, command in page.numbers:
        found = printed(command)
        missing = [n for cell in cells for n in NUMBER.findall(cell) if not is_among(n, found)]
        assert not missing, (command, missing)


def test_commands_make_the_numbers_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    numbers_are_made_again(described(tmp_path), {"thickness": 4e-4}, {})


@pytest.mark.slow
@pytest.mark.parametrize("example", ["imported/guide.yaml", "rpr/rpr_piezo.yaml", "xy_stage/xy_stage.yaml"])
def test_commands_make_the_numbers_of_examples_again(example, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    numbers_are_made_again(ROOT / "examples" / example, {}, {})


@pytest.mark.slow
def test_commands_make_the_numbers_about_a_pose_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    numbers_are_made_again(described(tmp_path), {"thickness": 4e-4}, {"carriage.y": 1e-4})


STUDIES = """
studies:
  lightest:
    optimize:
      vary: {thickness: {from: 0.3 mm, to: 0.6 mm}}
      minimise: mass
      subject_to: f1 >= 50 Hz
      starts: 1
  over:
    sweep:
      vary: {thickness: {from: 0.3 mm, to: 0.6 mm, steps: 7}, length: [50 mm, 60 mm]}
      ask: f1, mass
  parts:
    tolerance:
      vary: {thickness: ± 0.02 mm, width: {normal: 0.05 mm}}
      ask: [f1, mass]
      require: f1 >= 54 Hz
      samples: 96
  many:
    sweep: {vary: {thickness: {}}, ask: f1, sampling: sobol, samples: 1000000}
"""


def test_studies_are_told_with_commands_that_make_them_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "studies.yaml"
    path.write_text(TEXT + STUDIES, encoding="utf-8")
    found = fx.report(fx.load(path), {"width": 0.021}, file=path, n=1)
    section = found.html.partition('<section id="studies"')[2].partition("</section>")[0]
    page = Page(section)
    assert found.states["studies"] == "shown" and page.faults == []
    assert section.count("<img") == 3 and "f1 &gt;= 50 Hz: 1 % less buys" in section
    for cells, command in page.numbers:
        asked = printed(command)
        missing = [n for cell in cells for n in NUMBER.findall(cell) if not is_among(n, asked)]
        assert cells and not missing, (command, missing)
    assert [len(cells) for cells, _ in page.numbers] == [2, 2, 8, 10]
    assert page.commands[-1] == f"flexura sweep {path} --study many --set 'width=21 mm'"
    assert "takes longer" in section


def test_a_study_that_fails_says_so_beside_those_that_do_not():
    wrong = STUDIES.replace("ask: f1, mass", "ask: f1, stress")
    found = fx.report(fx.loads(TEXT + wrong.replace("samples: 96", "samples: 1000000")), n=1)
    section = found.html.partition('<section id="studies"')[2].partition("</section>")[0]
    assert found.states["studies"] == "failed" and "nothing loads this mechanism" in section
    assert section.count("<img") == 1 and section.count("takes longer") == 2


def test_numbers_that_are_not_printed_are_seen():
    assert is_among("7.5205", np.array([7.52049])) and not is_among("7.5205", np.array([7.531, 75.205]))
    assert is_among("-270", np.array([90.0])) and not is_among("-270", np.array([95.0]))


def section_of(html: str, name: str) -> str:
    return html.partition(f'<section id="{name}"')[2].partition("</section>")[0]


def test_what_is_proven_and_how_far_the_part_may_be_are_columns_of_their_own():
    model = fx.load(ROOT / "examples" / "rpr" / "rpr.yaml")
    found, section = fx.modes(model, n=4), section_of(fx.report(model, n=4).html, "modes")
    assert found.model_error[2] is None and found.model_error[3] is not None
    headings = re.findall(r'<th scope="col"[^>]*>(.*?)</th>', section)
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in re.findall(r"<tr data-motion.*?</tr>", section)]
    columns = dict(zip(headings, zip(*rows, strict=True), strict=True))
    assert list(columns["model error"]) == list(found.model_errors.texts)
    assert list(columns["proven"]) == [mode.proven_text for mode in found.modes]
    assert "two-axis notch" in found.model_errors.reason[2]
    assert f"no evidence: {found.model_errors.reason[2]}" in columns["evidence"][2]
    assert f"{found.model_errors.texts[3]}: " in columns["evidence"][3] and "beam, -" in columns["evidence"][3]
    assert "an estimate from measured errors, not a proof" in section


def test_what_moves_no_frequency_by_a_percent_is_folded():
    model = fx.load(ROOT / "examples" / "rpr" / "rpr.yaml")
    checked, section = fx.check(model), section_of(fx.report(model, n=1).html, "understood")
    shown, _, folded = section.partition(f"{len(checked.minor)} assumptions that move no frequency by 1 %")
    assert len(checked.minor) > 1 and all(escape(str(own)) in folded for own in checked.minor)
    assert not any(escape(str(own)) in shown for own in checked.minor)
    places = [shown.index(escape(own.text)) for own in checked.warnings]
    assert places == sorted(places) and "by" in checked.warnings[0].text


def test_doubts_that_say_the_same_are_one_line():
    doubts = [fx.Diagnostic.about("slenderness", "is short", f"leaf{k}") for k in range(6)]
    assert grouped(doubts[:2]) == ["leaf0, leaf1: is short"]
    assert grouped(doubts) == ["leaf0, leaf1, leaf2, leaf3 and 2 more: is short"]
    assert grouped([*doubts[:1], replace(doubts[1], text="is thick")]) == ["leaf0: is short", "leaf1: is thick"]


TURN = "  turn: {type: moment, nodes: [carriage], direction: z, limit: 3 N*mm}\n"


def test_every_member_is_under_the_worst_corner_of_the_limits(tmp_path):
    path = tmp_path / "two.yaml"
    text = TEXT + DESCRIBED.replace("sensors:\n", f"{TURN}sensors:\n")
    path.write_text(text, encoding="utf-8")
    model = fx.load(path)
    worst: dict[str, tuple[float, dict[str, float]]] = {}
    for coil, turn in product((-2.0, 2.0), (-3e-3, 3e-3)):
        commands = {"coil": coil, "turn": turn}
        for own in fx.statics(model, actuators=commands).stresses().members:
            if own.von_mises is not None and own.von_mises > worst.get(own.name, (0.0,))[0]:
                worst[own.name] = own.von_mises, commands
    section = fx.report(model, n=1).html.partition('<section id="stress"')[2].partition("</section>")[0]
    seen = 0
    for caption, table in re.findall(r"<caption>most stressed with (.*?)</caption>(.*?)</table>", section, re.DOTALL):
        named = {
            name: float(value) * (1e-3 if unit == "mN" else 1.0) for name, value, unit in re.findall(COMMAND, caption)
        }
        for name, shown in re.findall(r"<td>([\w.\[\]]+)</td><td[^>]*>([\d.e+-]+)</td>", table):
            stress, commands = worst[name]
            assert shown == f"{1e-6 * stress:.5g}"
            assert named == pytest.approx(commands)
            seen += 1
    assert seen == len(worst) == 2
    assert all(own != {"coil": 2.0, "turn": 3e-3} for _, own in worst.values())  # not where all limits are the upper


def test_names_are_text_and_nothing_else(tmp_path):
    title = "<script>alert('x')</script> {{ \"&\" }} </title>"
    path = described(tmp_path, "a b;'$(touch x)'.yaml", title)
    found = fx.report(fx.load(path), file=path, title=None)
    page = Page(found.html)
    assert page.faults == [] and "<script>alert" not in found.html
    assert found.html.count("<script") == 2
    assert all(shlex.split(command)[2] == str(path) for command in page.commands)


def test_a_section_that_fails_says_so_and_the_others_go_on():
    found = fx.report(fx.loads(FLOATING + "motion: {move: {carriage: {x: 1 mm}}, steps: 2}\n"))
    assert found.states["stroke"] == "failed" and found.states["modes"] == "shown"
    section = found.html.partition('<section id="stroke"')[2].partition("</section>")[0]
    assert "SolverError" in section and "could not be made" in found.html


def test_what_floats_has_no_freedoms_to_count():
    found = fx.report(fx.loads(FLOATING))
    assert found.states["freedoms"] == "absent" and "failed" not in found.states.values()
    assert "could not be made" not in found.html and "Parts of the mechanism float" in found.html


def test_without_a_file_commands_are_python():
    page = Page(fx.report(fx.loads(TEXT)).html)
    assert page.commands and all(command.startswith("fx.") for command in page.commands)


def test_what_cannot_be_asked_for():
    impossible: list[dict[str, Any]] = [
        {"n": 0},
        {"at": {"nobody.x": 1e-3}},
        {"file": "nowhere.yaml"},
        {"out": "/nowhere/report.html"},
    ]
    for arguments in impossible:
        with pytest.raises(fx.FlexuraError):
            fx.report(fx.loads(TEXT), **arguments)


def test_the_command_writes_the_page(tmp_path):
    path = described(tmp_path)
    done = flexura("report", path, "--out", tmp_path / "page.html", "--set", "thickness=0.4 mm", "--json")
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    assert data["files"] == [str(tmp_path / "page.html")] and data["states"]["stroke"] == "shown"
    alike = fx.report(fx.load(path), {"thickness": 4e-4}, file=path)
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == alike.html
    assert "Natural modes" in done.stderr


def test_a_broken_file_leaves_no_page(tmp_path):
    broken = tmp_path / "broken.yaml"
    broken.write_text("flexura: 1\nnodes: 3\n", encoding="utf-8")
    done = flexura("report", broken, "--out", tmp_path / "page.html")
    assert done.returncode != 0 and "nodes" in done.stderr and not (tmp_path / "page.html").exists()


def test_strict_writes_nothing_where_there_are_warnings(tmp_path):
    done = CliRunner().invoke(app, ["report", str(GUIDE), "--strict", "--out", str(tmp_path / "page.html")])
    assert done.exit_code == 1 and not (tmp_path / "page.html").exists() and done.stdout == ""


@pytest.mark.parametrize(
    ("axis", "texts"),
    [
        ((0.05, 10.0, True, 30), "0.05 0.1 0.2 0.5 1 2 5 10"),
        ((1e-4, 1e-2, True, 3), "10⁻⁴ 0.001 0.01"),
        ((1e3, 1e6, True, 4), "1000 10000 10⁵ 10⁶"),
        ((0.0, 2.0, False, 5), "0 0.5 1.0 1.5 2.0"),
        ((-40e3, 40e3, False, 5), "-40000 -20000 0 20000 40000"),
        ((0.0, 3e-5, False, 4), "0 10⁻⁵ 2·10⁻⁵ 3·10⁻⁵"),
    ],
)
def test_numbers_of_axes_are_plain_where_they_are_not_far_from_one(axis, texts):
    assert " ".join(text for _, text in ticks(*axis)) == texts


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize("values", [[5e-324], [0.0, 5e-324], [-5e-324, 5e-324]])
def test_axes_of_numbers_that_round_off_left_are_those_of_zero(values, log):
    assert ends(np.array(values), log, "N") == ends(np.zeros(1), log, "N")
