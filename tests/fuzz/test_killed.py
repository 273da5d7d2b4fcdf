"""Whenever a writing command is killed, every result is as it was before or complete, and the next run cleans up."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from random import Random, SystemRandom

import pytest

from flexura.cli import app
from flexura.io import FORMATS
from helpers.killer import OLD, Killer, is_whole

ROOT = Path(__file__).parents[2]
GUIDE, PIVOT, FLOATING = (
    "examples/guide/guide.yaml",
    "examples/pivot/pivot.yaml",
    "tests/fuzz/corpus/model/floating.yaml",
)
ENDS = "-i carriage.tx -o carriage.tx"
CORPUS = "tests/fuzz/corpus/"
INTERFACE, FREE = "tests/fuzz/interface.csv", "tests/fuzz/corpus/model/floating.yaml"
COMMANDS = {
    "modes": f"modes {PIVOT} -n 1 --plot OUT/a --json",
    "statics": f"statics {GUIDE} --load carriage=2,0,0N --plot OUT/a",
    "buckling": f"buckling {GUIDE} --load carriage=0,0,-2N --plot OUT/a",
    "constraints": f"constraints {GUIDE} --out OUT/a.csv",
    "free": f"free {GUIDE} --out OUT/a.csv --plot OUT",
    "free page": f"free {GUIDE} --out OUT/a.html",
    "heat": f"heat {GUIDE} --out OUT/a.csv",
    "misalignment": f"misalignment {GUIDE} --mount leaf2.root=0.1mm,1mrad --samples 2 --out OUT/a.csv",
    "kinetostatics": f"kinetostatics {GUIDE} --plot OUT/a",
    "check": f"check {GUIDE} --plot OUT/a",
    "view": f"view {GUIDE} --plot OUT/a --out OUT/a.html -n 1",
    "frequency-response": f"frequency-response {GUIDE} --band 10Hz,200Hz {ENDS} --out OUT/a.csv --plot OUT",
    "time-response": f"time-response {GUIDE} --dt 1ms --step carriage.tx=1N --duration 0.1s -o carriage.tx"
    " --damping 0.01 --out OUT/a.csv --plot OUT",
    "backbone": f"backbone {GUIDE} --amplitude carriage.tx=0.1mm --harmonics 1 --out OUT/a.csv --plot OUT",
    "nonlinear-response": f"nonlinear-response {GUIDE} --input carriage.tx=1mN -o carriage.tx --band 40,50Hz"
    " --damping 0.02 --harmonics 1 --out OUT/a.csv --plot OUT",
    "budget": "budget examples/guide/servo.yaml --out OUT/a.csv --plot OUT",
    "verify": f"verify {GUIDE} -n 1 --size 2 --out OUT/a.step --plot OUT",
    "virtual-test": "virtual-test tests/fuzz/hit.yaml --out OUT/a.uff --plot OUT",
    "faces": "faces tests/fuzz/bar.step --out OUT/a.csv --plot OUT",
    "faces page": "faces tests/fuzz/bar.step --out OUT/a.html",
    "model": "model tests/fuzz/bar.step --material Al-7075-T6 --hold base -n 1 --mesh-tolerance 0.1 --out OUT/a.yaml",
    "understand": "understand tests/fuzz/guide.svg --thickness 12mm --material Al-7075-T6 --hold x=0mm --without-solid"
    " --out OUT/a.yaml",
    "report": f"report {GUIDE} --out OUT/a.html",
    "stroke": f"stroke {GUIDE} --move carriage.x=0:2mm --steps 3 -n 2 --out OUT/a.csv --plot OUT",
    "scheduled-plant": f"scheduled-plant {GUIDE} --move carriage.x=0:2mm {ENDS} -n 3 --out OUT/a.mat",
    "scheduled-plant fmu": f"scheduled-plant {GUIDE} --move carriage.x=0:2mm {ENDS} -n 3 --out OUT/a.fmu",
    "published": "published src/flexura/gallery/parallelogram.yaml --out OUT/a.csv",
    "sensitivity": f"sensitivity {GUIDE} --ask f1 --out OUT/a.csv --plot OUT",
    "tolerance": f"tolerance {GUIDE} --vary thickness=±1% --ask f1 --samples 96 --out OUT/a.csv --plot OUT",
    "sweep": f"sweep {GUIDE} --vary thickness=0.2mm:0.6mm:200 --ask f1 --out OUT/a.csv --plot OUT",
    "identify": f"identify {CORPUS}measured/modes.csv --out OUT/a.json --plot OUT",
    "couple": f"couple A={INTERFACE} B={INTERFACE} --join A.s1=B.s1 --out OUT/a.uff --plot OUT",
    "decouple": f"decouple {INTERFACE} {FREE} --join s1=a.tx --out OUT/a.uff --plot OUT",
    "virtual-points": f"virtual-points {INTERFACE} --point top=0,0,0 --out OUT/a.uff --plot OUT",
    "estimate-frf": f"estimate-frf {CORPUS}measured/hit.csv --exponential 0.1 --out OUT/a.h5",
    "calibrate": f"calibrate {GUIDE} {CORPUS}frequencies/guide.csv --free thickness --out OUT/a.yaml --plot OUT",
    "optimize": f"optimize {GUIDE} --vary thickness=0.4mm:0.6mm --maximise f1 --starts 2 --out OUT/a.yaml --plot OUT",
    "design": "design tests/fuzz/wish.yaml --most 1 --samples 1 --workers 1 --out OUT/designs",
    "place-sensors": f"place-sensors {PIVOT} --sensors 2 -n 1 --plot OUT",
    "correlate": f"correlate {GUIDE} {CORPUS}measured/guide.uff -n 1 --plot OUT",
    "export fmu": f"export {GUIDE} --out OUT/a.fmu {ENDS} -n 1",
    "export c": f"export {GUIDE} --out OUT/a.c {ENDS} -n 1 --dt 0.1ms --damping 0.01",
    "export fmi3": f"export {GUIDE} --out OUT/a.fmu --format fmi3 --payload carriage {ENDS} -n 1",
    "export mat": f"export {GUIDE} --out OUT/a.mat {ENDS} -n 1",
    "export m": f"export {GUIDE} --out OUT/a.m {ENDS} -n 1",
    "export modelica": f"export {GUIDE} --out OUT/a.mo {ENDS} -n 1",
    "export npz": f"export {GUIDE} --out OUT/a.npz {ENDS} -n 1",
    "export hdf5": f"export {GUIDE} --out OUT/a.h5 {ENDS} -n 1",
    "export matrix-market": f"export {GUIDE} --out OUT/a.mtx",
    "export simscape": f"export {CORPUS}model/floating.yaml --out OUT/a.mat --format simscape",
    "export vtu": f"export {GUIDE} --out OUT/a.vtu -n 1",
    "export uff": f"export {GUIDE} --out OUT/a.uff -n 1",
}
"""A run of every command that writes, OUT being where it does."""

NEVER_OVER_ANOTHER = {"new", "examples"}
"""Commands that refuse to write where there is a file."""

QUICK = ("estimate-frf", "export npz", "export matrix-market")


def killed(name: str, kills: int, seed: int) -> None:
    """Kill a command; nothing may be half written, and the run was at work when it was killed."""
    command = [sys.executable, "tests/helpers/killer.py", str(seed), str(kills), "--", *COMMANDS[name].split()]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=500)
    assert done.returncode == 0, f"seed {seed}: {done.stderr}"
    found = json.loads(done.stdout)
    assert not found["faults"], f"seed {seed}: {found['faults']}"
    assert found["met"] >= 1, found


@pytest.mark.parametrize("name", QUICK)
def test_killed_at_a_few_points(name):
    killed(name, 3, 1)


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_killed_at_random_points(name):
    killed(name, 6, SystemRandom().randrange(10**6))


def test_every_command_that_writes_is_killed():
    writing = {
        name
        for name in app.COMMANDS
        for option in app.loaded(name).params
        if (getattr(option, "help", "") or "").startswith("Write ")
    }
    assert writing - NEVER_OVER_ANOTHER <= {name.split()[0] for name in COMMANDS}
    assert {f"export {name}" for name, own in FORMATS.items() if own.takes} <= set(COMMANDS)


class Careless(Killer):
    """A command that writes its result where it belongs, line by line, and a file beside it."""

    def run(self) -> None:
        (self.scratch / "notes").write_text("left")
        with (self.out / "a.csv").open("w") as stream:
            for _ in range(50):
                stream.write("1,2,3\n")
                stream.flush()
        (self.scratch / "notes").unlink()


def test_careless_writing_is_seen(tmp_path, monkeypatch):
    for name in ("FLEXURA_CACHE", "TMPDIR"):
        monkeypatch.setenv(name, str(tmp_path))
    killer = Careless([], tmp_path, Random(1))
    killer.kill(6)
    assert any("neither as before nor complete" in fault for fault in killer.faults)
    assert any("notes is left" in fault for fault in killer.faults)


@pytest.mark.parametrize("suffix", [".png", ".npz", ".h5", ".mat", ".fmu", ".uff", ".csv"])
def test_a_part_of_a_file_is_not_whole(tmp_path, suffix):
    file = tmp_path / f"a{suffix}"
    file.write_bytes(OLD[:-1])
    assert not is_whole(file)
