"""Every result of a public verb has one face: plain data, a table where it is one, warnings and notes, HTML."""

import inspect
import json
import re
import sys
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
import scipy.sparse as sp
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import LimitError, OptionError
from flexura.mechanism import Mechanism
from flexura.results import COLUMNS, ROWS, Result, Tabular, plain
from helpers.every_result import GUIDE_TEXT, HZ, NAME, NODE, RESULTS, STAGE_TEXT, frequency_response, virtual_test
from helpers.public_names import public_names

DIMENSIONLESS = {
    *("relative error", "relative", "mac", "space mac", "likeness", "damping ratio", "loss factor", "confidence"),
    *("identified damping ratio", "frequency spread", "damping spread", "modal phase collinearity", "independence"),
    *("factor to yield", "position", "variance reduction", "relative standard deviation"),
    *("stress margin", "stress position", "buckling factor"),
}
"""Columns of floats that are plain numbers."""

# what verbs return that are no results: files, pictures, text, descriptions and bare arrays
OTHERS = r"Array|sp\.cs._matrix|Figure|str|None|(list\[)?Path\]?|Mechanism|Expression|dict\[str, Any\]|Iterator\[None\]"


@pytest.fixture(params=RESULTS)
def result(request) -> Result:
    return RESULTS[request.param]()


def public(kind: type) -> set[str]:
    return {own.__name__ for own in public_names().values() if inspect.isclass(own) and issubclass(own, kind)}


def test_one_of_each_class_is_made() -> None:
    assert set(RESULTS) == public(Result)
    assert all(type(RESULTS[name]()).__name__ == name for name in ("Modes", "Drift", "Recording"))


def test_verbs_return_results() -> None:
    verbs = {name: own for name, own in public_names().items() if inspect.isfunction(own)}
    returned = {name: str(inspect.signature(verb).return_annotation) for name, verb in verbs.items()}
    several = re.compile(r"tuple\[(\w+), \.\.\.\]")
    odd = {name: kind for name, kind in returned.items() if several.sub(r"\1", kind) not in public(Result)}
    assert {n for n, kind in odd.items() if not re.fullmatch(OTHERS, kind)} == {"to_control"}


def test_data_are_plain(result) -> None:
    data = result.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert len(data) > 2 and {"notes", "warnings"} <= set(data)


def test_warnings_and_notes_are_tuples(result) -> None:
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


def test_tables_are_frames_with_units(result) -> None:
    if not isinstance(result, Tabular):
        assert not hasattr(result, "to_frame")
        return
    frame = result.to_frame()
    assert isinstance(frame, pd.DataFrame) and frame.shape[1] > 1
    floats = [name for name in frame if frame[name].dtype.kind == "f" and name not in DIMENSIONLESS]
    assert all(re.fullmatch(r".+ \[.+\]", name) for name in floats), floats
    assert not any(np.iscomplexobj(frame[name]) for name in frame)


class Page(HTMLParser):
    """The tags of a page, which have to close, and the cells."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.seen: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append(tag)
        self.seen.add(tag)

    def handle_endtag(self, tag) -> None:
        assert self.tags.pop() == tag

    def handle_data(self, data) -> None:
        self.text += data


def test_html_is_short_and_escaped(result) -> None:
    html = result._repr_html_()
    page = Page()
    page.feed(html)
    page.close()
    assert not page.tags and page.seen <= {"p", "strong", "table", "thead", "tbody", "tr", "th", "td"}
    assert html.count("<td>") <= ROWS * COLUMNS and len(html) < 5000
    assert type(result).__name__ in page.text
    if getattr(result, "name", None) == NAME:
        assert NAME in page.text
    assert all(warning.text in page.text for warning in result.warnings[:5])


def test_html_says_what_it_leaves_out() -> None:
    html = frequency_response(np.linspace(1.0, 50.0, 30))._repr_html_()
    assert f"and {30 - ROWS} more rows" in html and "and 1 more columns" in html


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
GUIDE_VERBS = {
    "modes -n 2": lambda m: fx.modes(m, n=2),
    "check": fx.check,
    f"statics --load {NODE}=1N,0,0": lambda m: fx.statics(m, loads={NODE: [1, 0, 0, 0, 0, 0]}),
    f"kinetostatics --platform {NODE}": lambda m: fx.kinetostatics(m, platform=NODE),
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
    "estimate-frf DATA": lambda _, data: fx.Measurement(data.name, data.recordings, fx.estimate_frf(data), data.notes),
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
    assert timeless(printed(verb, file, *more)) == timeless(GUIDE_VERBS[words](mechanism).to_dict())


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
    found = fx.calibrate(fx.load(file), data=fx.read_frequencies(data), free=["thickness"])
    assert printed("calibrate", file, data, "--free", "thickness") == found.to_dict()
    assert printed("calibrate", file, data, "--free", "thickness", "--out", tmp_path / "new.yaml") == {
        **found.to_dict(),
        "files": [str(tmp_path / "new.yaml")],
    }
