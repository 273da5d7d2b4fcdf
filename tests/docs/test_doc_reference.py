"""The reference pages name everything there is: keys, defaults, catalogue, functions, limits, exports, signatures."""

import inspect
import re
from pathlib import Path
from typing import get_args

import pytest

from flexura import describe
from flexura.analysis.checks import model_warnings
from flexura.expressions import CONSTANTS, FUNCTIONS, parser
from flexura.mechanism import member as members
from flexura.mechanism import patterns
from flexura.mechanism.checks import survey
from flexura.modelfile import document
from flexura.sizes import LIMITS
from flexura.structure import UNITS
from helpers import api_page
from helpers.over import over
from helpers.public_names import public_names

DOCS = Path(__file__).parents[2] / "docs"

ACTUATORS = (
    *(describe.ForceActuator, describe.MomentActuator, describe.BaseMotion, describe.BaseRotation, describe.PiezoStack),
    describe.StrainActuator,
)
SENSORS = (describe.MotionSensor, describe.ForceSensor)
TABLES = {  # heading in file-format.md: the classes whose keys its table holds
    "Top level": (describe.Mechanism,),
    "Parameters": (describe.Parameter,),
    "Materials": (describe.Material,),
    "Links and flexures": (describe.Link, describe.Flexure),
    "Diaphragms": (describe.Diaphragm,),
    "Flat springs": (describe.FlatSpring,),
    "Springs": (describe.Spring,),
    "Dashpots": (describe.Dashpot,),
    "Stops": (describe.Stop,),
    "Bodies": (describe.RigidBody,),
    "Masses": (describe.PointMass,),
    "Superelements": (describe.Superelement,),
    "Parts": (describe.SolidPart, describe.Interface),
    "Actuators": ACTUATORS,
    "Sensors": SENSORS,
    "Damping": (describe.Damping,),
    "Temperatures": (describe.Warmer,),
    "Thermal contacts": (describe.ThermalContact,),
    "Disturbances": (describe.Disturbance,),
    "Test": (describe.ModalTest, describe.HammerPoint, describe.Accelerometer),
    "Substructures": (describe.Substructure,),
    "Instances": (describe.Instance,),
}
KINDS = {  # heading: the classes that its second table tells apart by `shape` or `type`
    "Sections": (describe.Rectangle, describe.Circle, describe.Tube, describe.SectionConstants),
    "Profiles": (describe.Leaf, describe.Layered, describe.Notch, describe.RoundNotch, describe.TwoAxisNotch),
    "Contours": (
        *(describe.CircularContour, describe.EllipticalContour, describe.ParabolicContour, describe.HyperbolicContour),
        *(describe.CornerFilletedContour, describe.VShapedContour, describe.TabulatedContour, describe.StraightContour),
    ),
    "Bodies": (describe.Box, describe.Cylinder, describe.Plate, describe.Composite),
    "Actuators": ACTUATORS,
    "Sensors": SENSORS,
    "Instances": (describe.CircularPattern, describe.LinearPattern, describe.MirrorPattern),
}
FILE_ONLY = {"Top level": {"flexura", "extends"}, "Superelements": {"units"}, "Disturbances": {"file"}}
NOT_IN_FILES = {
    "Parameters": {"unit"},
    "Top level": set(describe.Substructure.model_fields),
    "Actuators": {"type"},
    "Sensors": {"type"},
    "Superelements": {"variation"},
}


def section(page: str, heading: str) -> str:
    """Text below a heading of the second level."""
    text = (DOCS / page).read_text(encoding="utf-8")
    match = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    assert match, f"{page} has no section {heading}"
    return match[1]


def tables(text: str) -> list[list[list[str]]]:
    """Tables of a text: rows of cells, heading included."""
    found = re.findall(r"(?:^\|.*\|\n)+", text, re.MULTILINE)
    return [[[c.strip() for c in row.strip("|").split(" | ")] for row in table.splitlines()] for table in found]


def names(cell: str) -> list[str]:
    """Names in backticks."""
    return re.findall(r"`([^`]+)`", cell)


@over("heading", TABLES)
def test_keys(heading):
    rows = next(t for t in tables(section("file-format.md", heading)) if names(t[0][0]) == [] and "key" in t[0][0])[2:]
    cells = {names(row[0])[0]: row[2] for row in rows}
    required: dict[str, list[bool]] = {}
    for part in TABLES[heading]:
        for name, field in part.model_fields.items():
            required.setdefault(field.alias or name, []).append(field.is_required())
    expected = (set(required) | FILE_ONLY.get(heading, set())) - NOT_IN_FILES.get(heading, set())
    assert set(cells) == expected
    for name in expected & set(required):
        assert (cells[name] == "required") == all(required[name]), name


@pytest.mark.parametrize("heading", KINDS)
def test_kinds(heading):
    rows = next(t for t in tables(section("file-format.md", heading)) if names(t[0][0]) in (["shape"], ["type"]))[2:]
    described = {kind: set(names(row[1])) for row in rows for kind in names(row[0])}
    expected = {}
    for part in KINDS[heading]:
        key = "shape" if "shape" in part.model_fields else "type"
        fields = {name for name, field in part.model_fields.items() if not field.exclude} - {key}
        expected |= dict.fromkeys(get_args(part.model_fields[key].annotation), fields)
    assert described == expected


def test_how_many_examples_there_are():
    """The number of files is that of the folder."""
    page = (DOCS / "file-format.md").read_text(encoding="utf-8")
    files, folders = re.search(r"has (\d+) such files\s+in (\d+) folders", page).groups()
    found = list((DOCS.parent / "examples").glob("*/*.yaml"))
    assert (int(files), int(folders)) == (len(found), len({file.parent for file in found}))


def test_outputs_of_sensors():
    rows = next(t for t in tables(section("file-format.md", "Sensors")) if names(t[0][0]) == ["type"])[2:]
    for row in rows[:2]:
        units = [UNITS[kind].replace("*", " ") for kind in names(row[0])]
        assert ", ".join(units) in row[2]


def test_catalogue():
    rows = next(t for t in tables(section("file-format.md", "Materials")) if t[0][0].strip("| ") == "name")[2:]
    described = {names(row[0])[0]: row[1:] for row in rows}
    assert set(described) == set(describe.CATALOGUE)
    for name, material in describe.CATALOGUE.items():
        values = (material.E, material.nu, material.G, material.rho, material.yield_stress)
        values += (material.expansion, material.softening, material.conductivity, material.heat_capacity)
        for cell, value, unit in zip(described[name], values, (1e9, 1, 1e9, 1, 1e6, 1e-6, 1e-6, 1, 1), strict=False):
            assert cell == ("" if value is None else f"{value / unit:.6g}"), name
        assert described[name][9].rstrip(" |") == material.source


def test_functions_and_dofs():
    listed = set(names(section("file-format.md", "Expressions").split("* Functions:")[1].split("*")[0]))
    assert listed == {*FUNCTIONS, *CONSTANTS}
    assert " ".join(describe.DOF_NAMES) in section("file-format.md", "Ground")


def test_grammar_is_that_of_the_parser():
    grammar = next(
        block for block in re.findall(r"```text\n(.*?)```", section("file-format.md", "Expressions"), re.DOTALL)
    )
    for line in grammar.splitlines():
        assert " ".join(line.split()) in " ".join(parser.__doc__.split())


def test_limits():
    said = dict(row[:2] for row in tables(section("file-format.md", "Limits"))[0][2:])
    said = {key.strip("| "): cell.rstrip(" |") for key, cell in said.items()}

    def most(kind):
        return next(m.le for m in kind.__metadata__[0].metadata if hasattr(m, "le"))

    expected = {
        "nesting of the file": document.MAX_DEPTH,
        "characters in an expression": parser.MAX_LENGTH,
        "numbers and names in an expression": parser.MAX_OPERANDS,
        "nesting of an expression": parser.MAX_DEPTH,
        "exponent": parser.MAX_EXPONENT,
        "files below one that extends others": document.MAX_BASES,
        "elements of a member": most(members.ElementCount),
        "copies of one pattern": most(patterns.PatternCount),
        "nesting of substructures": survey.MAX_NESTING,
    }
    assert {key: int(cell.replace(" million", "000000")) for key, cell in said.items()} == expected


def test_limits_of_size():
    page = (DOCS / "limits.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([\d ]+) \| (.+) \|$", page, flags=re.MULTILINE)
    assert {name: (int(most.replace(" ", "")), of) for name, most, of in rows} == LIMITS


def test_doubts():
    text = section("theory/validity.md", "Where the theory stops")
    for words, value in (
        ("from 1 % on", 100 * model_warnings.WORTH_A_WARNING),
        ("length over depth above 500", model_warnings.SLENDER),
    ):
        assert words in text
        assert f" {value:g}" in words


def test_exports():
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    missing = []
    for place in public_names():
        namespace, _, name = place.rpartition(".")
        if not re.search(rf"`({namespace}\.)?{name}\b", page):
            missing.append(place)
    assert not missing


def test_verbs_are_told_as_their_docstrings_say():
    """Bring them up to date: PYTHONPATH=tests python -m helpers.api_page."""
    page = api_page.PAGE.read_text(encoding="utf-8")
    assert api_page.current(page) == page
    verbs = {place for place, own in public_names().items() if inspect.isfunction(own)}
    assert verbs <= set(re.findall(r"`([\w.]+)[`(]", page))
    assert len(api_page.ROW.findall(page)) > 40
