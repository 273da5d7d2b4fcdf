"""Every result of a public verb has one face: plain data, a table where it is one, warnings and notes, HTML."""

import inspect
import json
import re
import sys
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.sparse as sp
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import LimitError, OptionError, foremost
from flexura.mechanism import Mechanism
from flexura.results import Result, Tabular, plain
from flexura.tables import COLUMNS, ROWS
from helpers import json_keys
from helpers.every_result import (
    GUIDE,
    GUIDE_TEXT,
    HZ,
    NAME,
    NODE,
    RESULTS,
    STAGE_TEXT,
    frequency_response,
    guide,
    virtual_test,
)
from helpers.over import over
from helpers.public_names import public_names

EXAMPLES = GUIDE.parents[1]

DIMENSIONLESS = {
    *("error of frequency", "left of mode 1"),
    *("relative error", "relative", "mac", "space mac", "likeness", "damping ratio", "loss factor", "confidence"),
    *("identified damping ratio", "frequency spread", "damping spread", "modal phase collinearity", "independence"),
    *("uncertainty", "difference", "beams", "roots", "bodies", "ground"),
    *("factor to yield", "position", "variance reduction", "relative standard deviation"),
    *("stress margin", "stress position", "buckling factor", "model error, lower", "model error, upper"),
    *("model error, low", "model error, high", "deviation", "scatter", "gain"),
    *("frequency error", "response error", "static error"),
    *("gain margin", "distance from -1", "sensitivity peak", "gap", "factor to buckle"),
    *("direction x", "direction y", "direction z", "stiff over soft energy"),
}
"""Columns of floats that are plain numbers."""

UNITLESS = {
    "consistency",
    "lowest consistency",
    *("averages", "coherence", "CoMAC", "gain", "condition"),
    *(
        "in sigma",
        "test",
        "model",
        "lines",
        "independence",
        "in design",
        "at design",
        "sizes",
        "DOFs",
        "rad/s",
        "CoMAC",
        "gain",
    ),
    *(
        "resonance",
        "face",
        "order",
        "mode",
        "copies",
        "members",
        "elements",
        "nodes",
        "test mode",
        "model mode",
        "missed",
        "design",
    ),
    *(
        "factor to yield",
        "to yield",
        "to buckle",
        "mac",
        "likeness",
        "MAC",
        "MAC of close modes",
        "confidence",
        "MPC",
        "interior DOFs",
    ),
    *(
        "median coherence",
        "gain margin",
        "distance from -1",
        "sensitivity peak",
        "gap",
        "share",
        "group",
        "n constraints",
    ),
    *(
        "over-constraints",
        "over-constraints left",
        "in place",
        "5 %",
        "50 %",
        "95 %",
        "worst found",
        "stiff over soft energy",
    ),
}
"""Headings of plain numbers in notebooks."""

# what verbs return that are no results: files, pictures, text, descriptions and bare arrays
OTHERS = (
    r"Animation|Array|View|sp\.cs._matrix|Figure|str|None|(list\[)?Path\]?|Mechanism|Expression"
    r"|dict\[str, Any\]|Iterator\[None\]"
)


def public(kind: type) -> set[str]:
    return {own.__name__ for own in public_names().values() if inspect.isclass(own) and issubclass(own, kind)}


def test_one_of_each_class_is_made() -> None:
    assert set(RESULTS) == public(Result)
    assert all(type(RESULTS[name]()).__name__ == name for name in ("Modes", "Drift", "Recording"))


def test_verbs_return_results() -> None:
    verbs = {name: own for name, own in public_names().items() if inspect.isfunction(own)}
    returned = {name: str(inspect.signature(verb).return_annotation) for name, verb in verbs.items()}
    several = re.compile(r"tuple\[(\w+), \.\.\.\]")
    odd = {
        name: kind
        for name, kind in returned.items()
        if not {several.sub(r"\1", one) for one in kind.split(" | ")} <= public(Result)
    }
    others = {"sliders", "to_control", "to_scipy", "describe.with_own_copies", "questions", "formula", "relation"}
    assert {n for n, kind in odd.items() if not re.fullmatch(OTHERS, kind)} == others


@over("name", RESULTS)
def test_data_are_plain(name) -> None:
    result = RESULTS[name]()
    data = result.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert len(data) > 2 and {"notes", "warnings"} <= set(data)


def test_keys_of_data_are_those_of_the_page() -> None:
    assert json_keys.PAGE.read_text(encoding="utf-8") == json_keys.page()
    assert json_keys.kind({"a": [None, {"b": 1.0}]}) == "object of `a`"
    assert json_keys.kind([[]]) == "list: list" and json_keys.kind({"x": True}, True) == "by name, true or false each"


@over("name", RESULTS)
def test_warnings_and_notes_are_tuples(name) -> None:
    result = RESULTS[name]()
    assert isinstance(result.warnings, tuple) and isinstance(result.notes, tuple)
    assert all(isinstance(note, str) for note in result.notes)
    data = result.to_dict()
    assert [w["text"] for w in data["warnings"]] == [w.text for w in result.warnings]
    assert data["notes"] == list(result.notes)
    if not result.warnings:
        assert result.raise_warnings() is result
        return
    with pytest.raises(LimitError):
        result.raise_warnings()


@over("name", RESULTS)
def test_tables_are_frames_with_units(name) -> None:
    result = RESULTS[name]()
    if not isinstance(result, Tabular):
        assert not hasattr(result, "to_frame")
        return
    frame = result.to_frame()
    assert isinstance(frame, pd.DataFrame) and frame.shape[1] > 1
    plain = {name for name in frame if re.sub(r"^f\d+ ", "", name) in DIMENSIONLESS}
    floats = [name for name in frame if frame[name].dtype.kind == "f" and name not in plain]
    assert all(re.fullmatch(r".+ \[.+\]", name) for name in floats), floats
    assert not any(np.iscomplexobj(frame[name]) for name in frame)


class Page(HTMLParser):
    """The tags of a page, which have to close, its tables of cells, and all text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.seen: set[str] = set()
        self.styles: set[str] = set()
        self.tables: list[list[list[str]]] = []
        self.text = ""
        self.feed(html)
        self.close()
        assert not self.tags

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append(tag)
        self.seen.add(tag)
        assert {name for name, _ in attrs} <= {"style"}
        self.styles |= {value for _, value in attrs}
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag) -> None:
        assert self.tags.pop() == tag

    def handle_data(self, data) -> None:
        self.text += data
        if self.tags and self.tags[-1] in ("td", "th"):
            self.tables[-1][-1][-1] += data


OTHERS_SHOWN = {
    "Mechanism": guide,
    "Plan": lambda: fx.Plan(guide()),
    "mechanism of many parameters": lambda: fx.load(EXAMPLES / "rpr" / "rpr.yaml"),
    "modes of many parts": lambda: fx.modes(fx.load(EXAMPLES / "rpr" / "rpr.yaml"), n=10),
    "check with doubts": lambda: fx.check(fx.load(EXAMPLES / "rpr" / "rpr.yaml")),
    "responses of actuators": lambda: fx.frequency_response(fx.load(EXAMPLES / "rpr" / "rpr_piezo.yaml"), band=(1, 60)),
    "statics of actuators": lambda: fx.statics(fx.load(EXAMPLES / "rpr" / "rpr_piezo.yaml"), actuators={"*": 1e-6}),
    "many designs": lambda: fx.natural_frequencies(guide(), {"thickness": np.linspace(4e-4, 6e-4, 200)}, n=9),
}
"""What else stands at the end of a cell, and larger ones."""


SHOWN = RESULTS | {name: cache(make) for name, make in OTHERS_SHOWN.items()}


@cache
def html_of(name: str) -> str:
    return SHOWN[name]()._repr_html_()


@over("name", SHOWN)
def test_html_is_short_and_escaped(name) -> None:
    shown, html = SHOWN[name](), html_of(name)
    page = Page(html)
    allowed = {"p", "strong", "table", "thead", "tbody", "tr", "th", "td", "details", "summary"}
    assert page.seen <= allowed and len(html) < 8000
    assert all(len(table) <= ROWS + 1 and max(map(len, table)) <= COLUMNS for table in page.tables)
    assert 1 <= len(page.tables) <= 5 and sum(len(row) for table in page.tables for row in table) <= 2 * ROWS * COLUMNS
    assert max(len(cell) for table in page.tables for row in table for cell in row) <= 240
    assert type(shown).__name__ in page.text and "script" not in page.seen
    if getattr(shown, "name", None) == NAME:
        assert NAME in page.text


@over("name", SHOWN)
def test_one_line_is_one_line(name) -> None:
    shown = SHOWN[name]()
    assert "\n" not in repr(shown) and len(repr(shown)) < 200
    assert type(shown).__name__ in repr(shown)


@over("name", SHOWN)
def test_html_has_no_colour_of_its_own(name) -> None:
    """Pages are dark or light: what is marked has the colour of the text."""
    styles = ";".join(Page(html_of(name)).styles)
    assert not re.search(r"color|background|#|rgb|hsl|white|black", styles)


@over("name", SHOWN)
def test_html_has_rounded_numbers_with_units(name) -> None:
    """Five digits at most, and columns of SI numbers have a heading with their unit or cells that each have it."""
    for table in Page(html_of(name)).tables:
        for cell in (cell for row in table for cell in row):
            for digits in re.findall(r"(?<![\w.])(\d+\.\d+)(?:e[+-]?\d+)?(?!\w)", cell):
                assert len(digits.replace(".", "").lstrip("0")) <= 5, cell
        if len(table) > 1 and len(table[0]) == len(table[1]) > 2:
            for heading, *column in zip(*table, strict=True):
                bare = [cell for cell in column if re.fullmatch(r"-?\d+(\.\d+)?(e[+-]?\d+)?", cell)]
                assert not bare or heading.endswith("]") or heading in UNITLESS, (heading, bare)


@over("name", SHOWN)
def test_html_shows_warnings_and_notes(name) -> None:
    shown, page = SHOWN[name](), Page(html_of(name))
    warnings = getattr(shown, "warnings", ())
    said = foremost(warnings, 3) if not isinstance(shown, fx.CheckReport) else [str(own) for own in warnings]
    assert all(text in page.text for text in said[:5])
    assert all(note in page.text for note in getattr(shown, "notes", ())[:5])
    assert ("border-left" in ";".join(page.styles)) == bool(said)


def test_html_says_what_it_leaves_out() -> None:
    designs = Page(OTHERS_SHOWN["many designs"]()._repr_html_())
    assert f"and {200 - ROWS} more designs" in designs.text
    report = OTHERS_SHOWN["check with doubts"]()
    many = replace(report, warnings=tuple(replace(report.warnings[0], text=f"the {k}th") for k in range(12)))
    text = Page(many._repr_html_()).text
    assert "the 4th" in text and "the 5th" not in text and "and 7 more warnings" in text


def cells(result: Any, heading: str) -> list[str]:
    """The cells of a result below a heading."""
    for table in Page(result._repr_html_()).tables:
        if heading in table[0]:
            return [row[table[0].index(heading)] for row in table[1:]]
    raise AssertionError(f"no column {heading}")


def test_html_of_modes_has_proven_frequencies_and_what_moves() -> None:
    found = RESULTS["Modes"]()
    assert [f"{own} Hz" for own in cells(found, "frequency [Hz]")] == [mode.frequency_text for mode in found.modes]
    assert all(text.startswith("within") for text in cells(found, "proven"))
    assert cells(found, "what moves")[0].startswith("carriage moves along x")
    poor = fx.modes(fx.load(EXAMPLES / "rpr" / "rpr.yaml"), n=10)
    assert "8 modes in this range are MISSING" in Page(poor._repr_html_()).text and len(poor.warnings) > 0


def test_html_of_statics_has_micrometres_and_what_yields_first() -> None:
    """A guide of two leaves, L = 60 mm, 20 x 0.5 mm, E = 210 GPa: k = 24 E I / L^3 to a per cent."""
    found = RESULTS["Statics"]()
    leaf = fx.load(GUIDE).parameters
    t, length = float(leaf["thickness"].value), float(leaf["length"].value)
    assert cells(found, "node")[0] == NODE and "leaf1.blade" in cells(found, "member")
    u = float(cells(found, "tx [mm]")[0])
    assert u == pytest.approx(1e3 * found.displacement(NODE)[0], rel=1e-4) and 0 < t < length
    assert float(cells(found, "ty [mm]")[0]) == 0
    assert float(cells(found, "factor to yield")[0]) == pytest.approx(found.stresses().factor_to_yield, rel=1e-4)


def test_html_of_responses_names_resonances_by_what_moves() -> None:
    found = fx.frequency_response(guide(), inputs=[f"{NODE}.tx"], outputs=[f"{NODE}.tx"], band=(10, 900), damping=0.01)
    assert len(found.resonance_motions) == len(found.resonances_hz) == 3
    assert found.resonance_motions == tuple(m.motion.summary for m in fx.modes(guide(), n=3).modes)
    assert cells(found, "what moves")[0].startswith("carriage moves along x")
    assert float(cells(found, "peak at [Hz]")[0]) == pytest.approx(found.resonances_hz[0], rel=1e-3)
    poles = fx.frequency_response(RESULTS["StateSpace"](), frequency_hz=HZ)
    assert poles.resonance_motions == ()


def test_html_of_strokes_has_poses_from_the_first_to_the_last() -> None:
    found = fx.stroke(guide(), move={f"{NODE}.tx": (0.0, 4e-3)}, steps=5, n=2)
    assert cells(found, f"{NODE}.tx [mm]") == ["0", "1", "2", "3", "4"]
    many = replace(found, poses=found.poses * 9)
    assert len(cells(many, f"{NODE}.tx [mm]")) == ROWS and cells(many, f"{NODE}.tx [mm]")[-1] == "4"
    assert cells(found, "f1 [Hz]")[2] == f"{found.poses[2].frequency_hz[0]:.5g}"


def test_html_of_a_mechanism_has_its_parameters_with_units_and_bounds() -> None:
    own = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    assert "platform" in Page(own._repr_html_()).text
    k = cells(own, "parameter").index("r_web")
    assert [cells(own, heading)[k] for heading in ("value", "least", "most")] == ["1 mm", "0.1 mm", "2 mm"]
    assert cells(own, "source")[k].startswith("assumed")
    assert f"and {len(own.parameters) - ROWS} more parameters" in Page(own._repr_html_()).text


def test_frames_hold_the_numbers_of_the_results() -> None:
    found = frequency_response()
    frame, pair = found.to_frame(), f"{NODE}.rz / {NODE}.tx"
    H = frame[f"{pair} [rad/N]"] * np.exp(1j * np.radians(frame[f"phase of {pair} [deg]"]))
    assert np.array_equal(frame["frequency [Hz]"], HZ)
    assert np.abs(H - found.of(f"{NODE}.rz", f"{NODE}.tx")).max() <= 1e-12 * np.abs(H).max()
    designs = RESULTS["NaturalFrequencies"]()
    table = designs.to_frame().pivot(index="design", columns="mode", values="frequency [Hz]")
    assert np.array_equal(table.to_numpy(), designs.frequency_hz)


def test_frames_need_pandas(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(OptionError, match=re.escape("flexura[pandas]")):
        RESULTS["Modes"]().to_frame()


def test_how_arrays_are_told() -> None:
    told = plain(
        {
            "z": np.array([1 + 2j, complex(np.nan, np.inf)]),
            "one": 3 - 4j,
            "list": (1j,),
            "n": np.float64("inf"),
            "k": np.int64(7),
            "yes": np.bool_(True),
            "text": np.str_("a"),
            "K": sp.coo_array(([5.0], ([1], [0])), shape=(2, 3)),
        }
    )
    assert told == {
        "z_real": [1.0, None],
        "z_imaginary": [2.0, None],
        "one_real": 3.0,
        "one_imaginary": -4.0,
        "list": [{"real": 0.0, "imaginary": 1.0}],
        "n": None,
        "k": 7,
        "yes": True,
        "text": "a",
        "K": {"shape": [2, 3], "rows": [1], "columns": [0], "values": [5.0]},
    }
    with pytest.raises(TypeError, match="object"):
        plain(object())


# of every verb that prints JSON: the words after the file or files, and the same question in Python
MORE = {"check": {"requirements": []}}
"""What commands print beside the result of their verb."""

GUIDE_VERBS = {
    "modes -n 2": lambda m: fx.modes(m, n=2),
    "check": fx.check,
    f"statics --load {NODE}=1N,0,0": lambda m: fx.statics(m, loads={NODE: [1, 0, 0, 0, 0, 0]}),
    f"kinetostatics --platform {NODE}": lambda m: fx.kinetostatics(m, platform=NODE),
    "free": fx.free,
    "buckling --gravity 0,0,-9.81m/s^2": lambda m: fx.preload(m, gravity=(0, 0, -9.81)),
    "compare -n 2 --methods constraint_modes": lambda m: fx.compare(m, n=2, methods=["constraint_modes"]),
    "place-sensors --sensors 2 -n 1": lambda m: fx.place_sensors(m, sensors=2, n=1),
    f"frequency-response -i {NODE}.tx -o {NODE}.tx --band 3,40Hz": lambda m: fx.frequency_response(
        m, inputs=[f"{NODE}.tx"], outputs=[f"{NODE}.tx"], band=(3, 40)
    ),
    f"time-response --dt 1ms --duration 5ms --impulse {NODE}.tx=1N*s -o {NODE}.tx": lambda m: fx.time_response(
        m, inputs={}, outputs=[f"{NODE}.tx"], dt=1e-3, duration=5e-3, impulses={f"{NODE}.tx": 1}
    ),
}
TEST_VERBS = {
    "virtual-test --seed 1 STAGE": lambda m, _: fx.virtual_test(m, seed=1),
    "correlate STAGE DATA": lambda m, data: fx.correlate(m, test=data),
    "identify DATA": lambda _, data: fx.identify(data),
    "estimate-frf DATA": lambda _, data: fx.Measurement(
        data.name, data.recordings, fx.testing.estimate_frf(data), data.notes
    ),
}


def printed(*arguments: object) -> object:
    done = CliRunner().invoke(app, [*map(str, arguments), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def timeless(data: object) -> object:
    """Without what the clock says."""
    if isinstance(data, dict):
        return {key: timeless(own) for key, own in data.items() if key != "seconds"}
    return [timeless(own) for own in data] if isinstance(data, list) else data


@pytest.mark.parametrize("words", GUIDE_VERBS)
def test_the_shell_prints_the_same(words, tmp_path) -> None:
    file = tmp_path / "guide.yaml"
    file.write_text(GUIDE_TEXT, encoding="utf-8")
    verb, *more = words.split()
    mechanism: Mechanism = fx.load(file)
    assert timeless(printed(verb, file, *more)) == {
        **timeless(GUIDE_VERBS[words](mechanism).to_dict()),
        **MORE.get(words, {}),
    }


@pytest.mark.parametrize("words", TEST_VERBS)
def test_the_shell_prints_the_same_of_tests(words, tmp_path) -> None:
    file = tmp_path / "stage.yaml"
    file.write_text(STAGE_TEXT, encoding="utf-8")
    data = fx.write_measurement(virtual_test().measurement, tmp_path / "data.npz")
    places = {"STAGE": file, "DATA": data}
    found = TEST_VERBS[words](fx.load(file), fx.read_measurement(data))
    assert printed(*(places.get(word, word) for word in words.split())) == found.to_dict()


def test_the_shell_prints_the_same_of_calibrations(tmp_path) -> None:
    file, data = tmp_path / "guide.yaml", tmp_path / "measured.csv"
    file.write_text(GUIDE_TEXT, encoding="utf-8")
    data.write_text("frequency,unit\n56,Hz\n170,Hz\n", encoding="utf-8")
    found = fx.calibrate(fx.load(file), data=fx.testing.read_frequencies(data), free=["thickness"])
    assert printed("calibrate", file, data, "--free", "thickness") == found.to_dict()
    assert printed("calibrate", file, data, "--free", "thickness", "--out", tmp_path / "new.yaml") == {
        **found.to_dict(),
        "files": [str(tmp_path / "new.yaml")],
    }
