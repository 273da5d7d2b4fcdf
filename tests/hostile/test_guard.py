"""Whatever goes wrong in a command ends in a sentence on stderr and a status."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flexura.cli import guard
from flexura.errors import OptionError
from helpers.shell import GUIDE, flexura, refused


def raises(error: BaseException):
    def command() -> None:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (MemoryError("Unable to allocate 7 TiB"), "more memory than there is"),
        (RecursionError("maximum recursion depth exceeded"), "nested too deeply"),
        (np.linalg.LinAlgError("singular"), "too far apart"),
        (KeyError("x"), "not foreseen (KeyError: 'x')"),
        (EOFError("ended early"), "not foreseen (EOFError"),
        (OSError(36, "File name too long", "x"), "not foreseen"),
    ],
)
def test_unforeseen_errors_end_in_a_sentence(capsys, monkeypatch, error, said):
    monkeypatch.delenv(guard.TRACEBACK, raising=False)
    assert guard.run(raises(error)) == 2
    printed = capsys.readouterr().err
    assert said in printed and "--traceback" in printed and "Traceback" not in printed
    monkeypatch.setenv(guard.TRACEBACK, "1")
    assert guard.run(raises(error)) == 2
    assert "Traceback" in capsys.readouterr().err


def test_foreseen_errors_have_their_words_alone(capsys):
    assert guard.run(raises(OptionError("no such node"))) == 2
    assert capsys.readouterr().err == "flexura: no such node\n"


NOISY = """
import os, sys, warnings
from flexura.cli import guard
def command():
    import numpy as np
    warnings.warn("of a library", RuntimeWarning, stacklevel=1)
    np.log(np.array(-1.0))
    os.write(2, b" ** On entry to DLASCL parameter number 4 had an illegal value")
    sys.stderr.write("our own words")
sys.exit(guard.run(command))
"""


def test_libraries_are_silent_on_stderr():
    result = subprocess.run([sys.executable, "-c", NOISY], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "our own words")


INTERRUPTED_AT_IMPORT = """
import os, signal, sys
at, sys.argv = sys.argv[1], ["flexura", *sys.argv[2:]]
class Interrupting:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == at:
            os.kill(os.getpid(), signal.SIGINT)
import flexura.__main__
sys.meta_path.insert(0, Interrupting)
flexura.__main__.main()
"""


@pytest.mark.parametrize("module", ["numpy", "typer", "flexura.cli.app", "flexura.analysis", "flexura.modelfile"])
def test_an_interruption_at_any_import_ends_without_a_traceback(module):
    run = [sys.executable, "-c", INTERRUPTED_AT_IMPORT, module, "check", str(GUIDE)]
    result = subprocess.run(run, capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == 130, result.stderr
    assert "Traceback" not in result.stderr and "KeyboardInterrupt" not in result.stderr


def test_an_interruption_that_was_turned_into_another_error_is_one(capsys):
    import signal

    def command() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("numpy could not be imported") from None

    assert guard.run(command) == 130
    assert "interrupted" in capsys.readouterr().err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("args", [("check", GUIDE), ("modes", GUIDE, "--json"), ("schema",)])
def test_a_full_disk_is_said(args):
    with Path("/dev/full").open("w") as full:
        refused(flexura(*args, stdout=full), "the output cannot be written: No space left")


def test_a_closed_pipe_is_silent():
    command = f'"{sys.executable}" -m flexura schema | true'
    result = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert result.stderr == ""


@pytest.mark.parametrize("env", [{"PYTHONIOENCODING": "ascii"}, {"LANG": "C", "LC_ALL": "C", "PYTHONUTF8": "0"}])
def test_a_terminal_without_our_characters(tmp_path, env):
    file = tmp_path / "m.yaml"
    text = GUIDE.read_text().replace("name: parallel leaf-spring guide", "name: Führung … ± 中")
    file.write_text(text, encoding="utf-8")
    result = flexura("check", file, **env)
    assert result.returncode == 0, result.stderr
    assert "hrung" in result.stdout
    if "PYTHONIOENCODING" in env:
        assert "Fuhrung ... +- \\u4e2d" in result.stdout


@pytest.mark.slow
def test_common_options_stand_anywhere():
    for args in (("--limit", "nodes=3", "check", GUIDE), ("check", GUIDE, "--limit=nodes=3")):
        refused(flexura(*args), "at most 3 nodes", "--limit nodes=")
    refused(flexura("check", GUIDE, FLEXURA_LIMITS="nodes=3"), "at most 3 nodes")
    refused(flexura("check", GUIDE, "--limit", "sense=3"), "no limit 'sense'")
