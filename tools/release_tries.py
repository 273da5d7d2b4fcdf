"""What the release check runs: every command with core dependencies alone, and what each extra adds.

A command that needs an extra ends without it in a sentence that names it, and works with it. Files are those of
examples/ and tests/fuzz/; `out` is a folder of their own.
"""

from __future__ import annotations

GUIDE = "examples/guide/guide.yaml"
PIEZO = "examples/rpr/rpr_piezo.yaml"
TEST = "examples/rpr/rpr_test.yaml"
FILES = "tests/fuzz"
INTERFACE = f"{FILES}/interface.csv"
VARIED = f"{GUIDE} --vary thickness=0.2mm:0.6mm"

CORE = (
    "--version",
    "--help",
    "doctor",
    "schema",
    "new",
    "new parallelogram --out out/parallelogram.yaml",
    "published out/parallelogram.yaml",
    "examples --out out/gallery",
    f"check {GUIDE} --plot out",
    f"modes {GUIDE} -n 3 --plot out",
    "modes examples/rpr/rpr.yaml -n 6",
    "statics examples/amplifier/amplifier.yaml",
    f"kinetostatics {PIEZO}",
    "buckling examples/amplifier/amplifier.yaml",
    f"compare {GUIDE} -n 3 --budget 2s",
    f"verify {GUIDE} -n 2 --size 2.5",
    f"stroke {GUIDE} --move carriage.x=0:5mm --steps 3 -n 3 --out out/stroke.csv",
    f"frequency-response {GUIDE} --band 3Hz,60Hz -i carriage.tx -o carriage.tx --plot out",
    f"time-response {PIEZO} --dt 1ms --duration 20ms --step '*.piezo=75V' --out out/lift.csv",
    f"sweep {VARIED}:5 --ask f1,mass --out out/sweep.csv --plot out",
    f"sensitivity {GUIDE} --ask f1,mass",
    f"tolerance {GUIDE} --vary 'thickness=normal 0.02 mm' --ask f1 --samples 64 --workers 1",
    f"optimize {VARIED} --minimise mass --subject-to 'f1 >= 40 Hz'",
    f"design {FILES}/wish.yaml --most 1 --samples 1 --out out/designs",
    f"virtual-test {TEST} --out out/test.npz",
    "estimate-frf out/test.npz --out out/responses.npz",
    "identify out/test.npz --band 4Hz,30Hz",
    f"correlate {TEST} out/test.npz",
    "calibrate examples/rpr/start.yaml examples/rpr/table5.csv --free platform_size",
    "place-sensors examples/rpr/rpr.yaml --sensors 8 -n 6",
    f"export {PIEZO} --out out/platform.npz -n 6",
    f"export {PIEZO} --out out/platform.mat -n 6",
    "budget examples/guide/servo.yaml --loop open",
    f"constraints {GUIDE}",
    f"free {GUIDE} --plot out",
    f"misalignment {GUIDE} --mount 'leaf2.foot=0.1 mm,2 mrad'",
    f"heat {GUIDE}",
    f"backbone {GUIDE} --amplitude carriage.tx=1mm",
    f"nonlinear-response {GUIDE} --input carriage.tx=0.01N --output carriage.tx --band 50,60Hz --damping 0.02",
    f"scheduled-plant {GUIDE} --move carriage.x=0:2mm -i carriage.tx -o carriage.tx -n 3 --out out/plant.npz",
    f"couple A={INTERFACE} B={INTERFACE} --join A.s1=B.s1",
    f"decouple {INTERFACE} {FILES}/corpus/model/floating.yaml --join s1=a.tx",
    f"virtual-points {INTERFACE} --point top=0,0,0",
    f"view {GUIDE} --out out/view.html",
    f"report {GUIDE} --out out/report.html",
)
"""Command lines that need nothing but core dependencies."""

NAMED = {
    "cluster": f"sweep {VARIED}:5 --ask f1 --scheduler tcp://127.0.0.1:9",
    "live": f"live {GUIDE} --no-browser",
}
"""Command lines that name an extra without it, and wait for others with it."""

EXTRA = {
    "experiment": tuple(
        line
        for suffix in ("uff", "h5")
        for line in (f"virtual-test {TEST} --out out/test.{suffix}", f"correlate {TEST} out/test.{suffix}")
    ),
    "export": tuple(f"export {PIEZO} -n 6 --out out/platform.{suffix}" for suffix in ("h5", "uff", "vtu")),
    "parquet": (f"stroke {GUIDE} --move carriage.x=0:5mm --steps 3 -n 3 --out out/stroke.parquet",),
    "solid": (
        f"faces {FILES}/bar.step",
        f"understand {FILES}/guide.svg --thickness 12mm --material Al-7075-T6 --hold x=0mm --without-solid",
        f"model {FILES}/bar.step --material Al-7075-T6 --hold base -n 1 --mesh-tolerance 0.1 --out out/bar.yaml",
    ),
    "study": (f"sweep {VARIED}:5 --ask f1 --folder out/study", f"optimize {VARIED} --minimise mass --maximise f1"),
}
"""Command lines of an extra, the first of which names it without it."""

_LOADED = f"""
import flexura as fx
mechanism = fx.load("{GUIDE}")
"""
CODE = {
    "ansys": """
import flexura as fx
try:
    from ansys.mapdl.reader import examples
    files = examples.fullfile, examples.hexarchivefile
except ImportError:
    files = "none.full", "none.cdb"
assert fx.solid.read_ansys(*files).K.shape[0] > 0
""",
    "control": f"""
import flexura as fx
assert fx.to_control(fx.state_space(fx.system(fx.load("{PIEZO}")), n=6)).nstates > 0
""",
    "notebook": _LOADED + "fx.sliders(mechanism)\n",
    "fmi": f"""
import flexura as fx
from flexura.errors import need
fmpy = need("fmpy", "fmi")
fx.export(fx.state_space(fx.system(fx.load("{PIEZO}")), n=6), "platform.fmu")
assert fmpy.simulate_fmu("platform.fmu", stop_time=0.01) is not None
""",
    "pandas": _LOADED + "assert len(fx.modes(mechanism, n=3).to_frame()) == 3\n",
    "solid": _LOADED
    + """
fx.solid.write_step(fx.assemble(mechanism), "guide.step")
import platform
if (platform.system(), platform.machine()) == ("Linux", "x86_64"):
    import pypardiso
""",
}
"""Python of an extra, which ends without it in an error that names it."""
WITH = {
    "cluster": _LOADED
    + """
if __name__ == "__main__":
    from distributed import LocalCluster
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as own:
        fx.sweep(mechanism, vary={"thickness": [2e-4, 3e-4]}, ask="f1", scheduler=own.scheduler_address)
""",
    "live": """
import re, subprocess, sys, urllib.request
command = [sys.executable, "-u", "-m", "flexura", "live", "examples/guide/guide.yaml", "--no-browser", "--keep"]
own = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
try:
    address = next(found[0] for line in own.stdout if (found := re.search(r"http://127[^ \\n]*", line)))
    assert b"<html" in urllib.request.urlopen(address, timeout=60).read()
finally:
    own.kill()
""",
}
"""Python that works with an extra, where what names it would wait."""

IMPORT_ALL = """
import importlib, pkgutil, flexura
names = [m.name for m in pkgutil.walk_packages(flexura.__path__, "flexura.") if not m.name.endswith("__main__")]
for name in names:
    importlib.import_module(name)
faces = [flexura, flexura.describe, flexura.modal, flexura.solid, flexura.testing, flexura.view]
assert all(getattr(face, name) is not None for face in faces for name in face.__all__)
"""
"""Imports every module, and looks up every public name."""
TESTS = (
    "tests/beam",
    "tests/units",
    "tests/mechanism",
    "tests/linalg",
    "tests/statics",
    "tests/cli/test_cli_commands.py",
)
"""Run with the least versions; none of them needs an extra."""
SITE = ("-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "docs", "docs/_build/html")
"""Words of Python that build the site, as `make docs` does."""
