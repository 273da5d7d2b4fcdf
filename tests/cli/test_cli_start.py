"""What the command line imports: each command only what it uses, and the help of the group none of them."""

import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

from flexura.cli.app import COMMANDS, app, loaded
from helpers.over import over

HOME = Path(__file__).parents[2]


@over("name", COMMANDS)
def test_the_help_of_the_group_shows_the_first_line_of_a_command(name):
    assert loaded(name).help.split("\n")[0] == COMMANDS[name].line


def test_the_help_of_the_group_names_every_command():
    shown = "".join(CliRunner().invoke(app, ["--help"]).output.split())
    assert all(name + "".join(own.line.split()) in shown for name, own in COMMANDS.items())


def test_a_command_that_does_not_exist_is_refused_with_a_likely_one():
    result = CliRunner().invoke(app, ["mode", "guide.yaml"])
    assert result.exit_code == 2
    assert "Did you mean 'modes'" in result.output


def imported(*arguments: str) -> set[str]:
    """Modules that a command line has imported when it ends."""
    code = (
        "import runpy, sys\n"
        f"sys.argv = ['flexura', *{arguments!r}]\n"
        "try:\n"
        "    runpy.run_module('flexura', run_name='__main__')\n"
        "except SystemExit as end:\n"
        "    assert not end.code, end.code\n"
        "print('\\n'.join(sys.modules), file=sys.__stdout__)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=HOME)
    return set(done.stdout.split("\n"))


def test_help_imports_no_numbers_and_no_room():
    found = imported("--help")
    assert "flexura.cli.app" in found
    assert not found & {"numpy", "scipy", "pydantic", "rich.console", "ruamel.yaml", "pint", "matplotlib"}
    assert {name for name in found if name.startswith("flexura.") and name.count(".") == 1} <= {
        *("flexura.__main__", "flexura._version", "flexura.cli", "flexura.lazy")
    }


def test_modes_imports_what_it_uses():
    found = imported("modes", "examples/guide/guide.yaml")
    assert {"flexura.analysis.natural_modes.modes", "scipy.sparse.linalg", "pydantic"} <= found
    rooms = {"flexura.testing", "flexura.io", "flexura.methods", "flexura.solid", "flexura.view"}
    of_others = {
        "flexura.fem.parts",
        "flexura.systems.system",
        "flexura.analysis.checks.check",
        "flexura.analysis.static.statics",
        "flexura.analysis.responses.signals",
    }
    libraries = {"pint", "matplotlib", "h5py", "scipy.signal", "scipy.optimize", "scipy.spatial", "scipy.interpolate"}
    assert not found & (rooms | of_others | libraries)
