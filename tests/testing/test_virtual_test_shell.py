"""`flexura virtual-test`, its files and pictures, and the key `test` of mechanism files."""

import json
import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import ModelError
from helpers.tested_stage import STAGE, TEST

EXAMPLES = Path(__file__).parents[2] / "examples" / "rpr"


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def file(tmp_path) -> Path:
    path = tmp_path / "stage.yaml"
    path.write_text(STAGE + TEST, encoding="utf-8")
    return path


@pytest.mark.slow
def test_table_files_and_pictures(file, tmp_path):
    listed = tmp_path / "measured.csv"
    listed.write_text("frequency,unit\n97.5,rad/s\n120,rad/s\n", encoding="utf-8")
    done = run("virtual-test", file, "--out", tmp_path / "t.uff", "--plot", tmp_path / "p", "--measured", listed)
    assert done.exit_code == 0, done.output
    text = done.stdout
    assert "mechanism: 30 hits, 2 placements" in text
    assert re.search(r"^ *1 +(.* )?15\.518 *$", text, re.MULTILINE)  # 97.5 rad/s
    assert "missed" in text
    assert "wrote" in text
    assert len(fx.read_measurement(tmp_path / "t.uff").recordings) == 30
    for name in ("virtual_test", "stabilisation_01", "synthesis_02"):
        assert (tmp_path / "p" / f"{name}.png").stat().st_size > 10_000


def test_json(file):
    done = run(
        "virtual-test", file, "--json", "--band", "20,60 Hz", "--damping", "0.02", "--seed", "3", "--double-hits", "1"
    )
    assert done.exit_code == 0, done.output
    shown = json.loads(done.stdout)
    assert shown["placements"] == {"first": ["az", "ax", "ay"], "second": ["bz", "cz"]}
    assert (shown["seed"], shown["records"]) == (3, 36)
    assert shown["band"][0] >= 20
    assert [m["number"] for m in shown["modes"]] == [1, 2, 3, 4]
    assert all(m["damping_ratio"] == pytest.approx(0.02) for m in shown["modes"])
    assert all(abs(m["error"]) < 1e-3 for m in shown["modes"])


def test_a_file_without_a_test():
    done = run("virtual-test", EXAMPLES / "rpr.yaml")
    assert isinstance(done.exception, fx.OptionError)
    assert "describes no test" in str(done.exception)


def test_written_files_keep_the_test(tmp_path):
    mechanism = fx.load(EXAMPLES / "rpr_test.yaml")
    assert fx.loads(fx.dumps(mechanism)) == mechanism
    whole = YAML(typ="safe", pure=True).load(fx.dumps(mechanism))
    assert whole["test"]["accelerometers"]["p1z"]["mass"] == "sensor_mass"
    assert list(Draft202012Validator(fx.schema()).iter_errors(whole)) == []


def test_parameters_reach_the_test():
    mechanism = fx.loads(STAGE + "parameters: {m: 8 g}\n" + TEST.replace("mass: 8 g", "mass: m"))
    light, heavy = (fx.virtual_test(mechanism, {"m": m}).modes[3].mass_loaded_hz for m in (0.008, 0.016))
    assert heavy < light


def test_a_record_that_is_too_short_is_told_first_of_every_hammer(tmp_path):
    file = tmp_path / "stage.yaml"
    file.write_text((STAGE + TEST).replace("duration: 5 s", "duration: 0.5 s"), encoding="utf-8")
    done = run("virtual-test", file)
    assert done.exit_code == 0, done.output
    hammers = fx.load(file).test.hammer
    assert len(hammers) > 1 and "missed" not in done.stdout
    lines = done.stdout.splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("mode"))
    assert lines[1].startswith("no frequency responses: none of the")
    for name in hammers:
        assert any(f"records with {name} can be used" in line for line in lines[:head])


@pytest.mark.parametrize(
    ("old", "new", "place", "rule"),
    [
        ("stage, direction: z, at: [20", "stag, direction: z, at: [20", "test.hammer.h1.node", "no such node"),
        ("[bz, cz]", "[bz, dz]", "test.placements.second.1", "the test has no such accelerometer"),
        ("mass: 5 g", "mass: 5 mm", "test.accelerometers.ax.mass", "a mass is expected here"),
        ("mass: 5 g", "mass: -5 g", "test.accelerometers.ax.mass", "a mass must be non-negative"),
        ("az: {node: stage, direction: z, at: [30 mm, 30 mm, 5 mm], mass: 8 g}", "az: pickup", "test.accelerometers.az",
         "this is the name of none of the sensors"),
        ("duration: 5 s", "duration: 0.1 s", "test", "a record of 0.1 s at 400 Hz has 40 samples; at least 64"),
        ("pulse: 12 ms", "pulse: 2 s", "test", "a pulse of 2 s in a record of 5 s: it takes at most a quarter of it"),
        ("pulse: 12 ms", "pulse: 1 ms", "test", "a pulse of 1 ms at 400 Hz has 0.4 samples; at least 4 are needed"),
        ("[bz, cz]", "[bz, bz]", "test", "placement second holds an accelerometer twice"),
        ("sample_rate: 400 Hz", "hits: 0", "test.sample_rate", "required, but missing"),
        ("duration: 5 s", "duration: 5 s\n  band: [30 Hz, 10 Hz]", "test", "a band is from a lower to"),
        ("duration: 5 s", "duration: 5 s\n  exponential: 3", "test", "the exponential window ends between 0 and 1"),
    ],
)  # fmt: skip
def test_faults_of_a_file(old, new, place, rule):
    with pytest.raises(ModelError) as caught:
        fx.loads(STAGE + TEST.replace(old, new, 1))
    found = {(".".join(map(str, p.path)), p.rule) for p in caught.value.problems}
    assert any(where == place and rule in said for where, said in found), found


def test_sensors_of_another_kind_are_refused():
    more = "sensors: {gap: {type: displacement, nodes: [stage], direction: z}}\n"
    more += "actuators: {floor: {type: base, direction: z}}\n"
    text = (
        STAGE
        + more
        + TEST.replace("    ax: {", "    aw: gap\n    ax: {").replace("    h2: {", "    h0: floor\n    h2: {")
    )
    with pytest.raises(ModelError) as caught:
        fx.loads(text)
    rules = [p.rule for p in caught.value.problems]
    assert rules == [
        "a force at one node is expected here",
        "a sensor of acceleration at one node is expected here",
    ]
