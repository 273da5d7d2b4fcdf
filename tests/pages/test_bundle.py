"""The script that ships is that of its source, with the licences of what is in it."""

import subprocess
import sys
from pathlib import Path

import pytest

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
