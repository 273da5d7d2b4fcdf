"""Constants that no material has and degrees that count as radians are doubts; what real materials have is none."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.analysis.checks.slips import angle_warnings, material_warnings
from flexura.cli.app import app
from flexura.mechanism import Layout
from flexura.mechanism.material import CATALOGUE
from helpers.over import over

# E (GPa), rho, nu, yield (MPa) from handbooks
REAL = {
    "lead": (16, 11340, 0.44, 11),
    "beryllium": (303, 1850, 0.07, 240),
    "magnesium": (45, 1740, 0.35, 130),
    "osmium": (550, 22590, 0.25, 300),
    "tungsten": (411, 19300, 0.28, 750),
    "annealed aluminium": (69, 2700, 0.33, 15),
    "grey iron": (100, 7150, 0.26, 150),
    "gold": (78, 19300, 0.44, 100),
    "diamond": (1050, 3520, 0.1, 2800),
    "tungsten carbide": (620, 15600, 0.24, 3000),
    "zirconia": (205, 6050, 0.31, 900),
    "Zerodur": (90.3, 2530, 0.24, 50),
    "silicon, strong": (169, 2329, 0.064, 7000),
    "PTFE": (0.5, 2170, 0.46, 20),
    "polypropylene": (1.3, 905, 0.42, 33),
    "PEEK": (3.6, 1300, 0.38, 100),
    "nylon with glass": (10, 1360, 0.35, 150),
    "silicone rubber": (0.003, 1150, 0.495, 5),
    "carbon-fibre laminate": (140, 1580, 0.3, 1500),
    "balsa": (3.5, 150, 0.3, 20),
    "foam": (0.05, 60, 0.3, 1),
}


def of(**constants: float) -> list[str]:
    """Doubts about a material in a description that uses it."""
    mechanism = fx.Mechanism(materials={"own": fx.describe.Material(**constants)})
    return [str(d) for d in material_warnings(Layout(mechanism), {})]


@over("name", REAL)
def test_real_materials_are_no_doubt(name: str) -> None:
    E, rho, nu, strength = REAL[name]
    assert of(E=E * 1e9, rho=rho, nu=nu, yield_stress=strength * 1e6) == []


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_catalogue_is_no_doubt(name: str) -> None:
    own = {key: v for key, v in CATALOGUE[name].model_dump().items() if v is not None and key != "source"}
    assert of(**own) == []


@pytest.mark.parametrize(
    ("constants", "said"),
    [
        ({"E": 206e6, "rho": 7850.0, "nu": 0.3}, "did you mean E = 206 GPa in place of 206 MPa?"),
        ({"E": 71.7e6, "rho": 2810.0, "nu": 0.33}, "aluminium has E = 70 GPa"),
        ({"E": 206.0, "rho": 7850.0, "nu": 0.3}, "E = 206 GPa in place of 206 Pa"),
        ({"E": 206e9, "rho": 7.85, "nu": 0.3}, "rho = 7.85 g/cm^3 in place of 7.85 kg/m^3"),
        ({"E": 206e9, "rho": 7.85e-9, "nu": 0.3}, "rho = 7.85e-09 t/mm^3 in place of 7.85e-09 kg/m^3"),
        ({"E": 206e9, "rho": 785.0, "nu": 0.3}, "with rho = 785 kg/m^3"),
        ({"E": 206e9, "rho": 7850.0, "G": 79.5e6}, "did you mean G = 79.5 GPa in place of 79.5 MPa?"),
        ({"E": 206e9, "rho": 7850.0, "G": 120e9}, "give Poisson's ratio -0.142; with this E, G lies between"),
        ({"E": 206e9, "rho": 7850.0, "nu": -0.3}, "Poisson's ratio -0.3"),
        ({"E": 71.7e9, "rho": 2810.0, "nu": 0.33, "yield_stress": 503e3}, "503 MPa in place of 503 kPa?"),
        ({"E": 71.7e9, "rho": 2810.0, "nu": 0.33, "yield_stress": 503e9}, "503 MPa in place of 503 GPa?"),
    ],
)
def test_slips_of_units_are_doubts_with_what_was_meant(constants: dict[str, float], said: str) -> None:
    (doubt,) = of(**constants)
    assert doubt.startswith("materials.own: ")
    assert said in doubt


LEAF = """\
parameters:
  {parameters}
nodes: {a: [0, 0, 0], b: [40 mm*{factor}, 0, 1 mm]}
flexures:
  leaf: {nodes: [a, b], material: spring-steel, reference: y, profile: {type: leaf, width: 9 mm, thickness: 1 mm}}
ground: {a: clamped}
"""


def leaf(parameters: str = "L: 40 mm", factor: str = "1") -> fx.Mechanism:
    return fx.loads(LEAF.replace("{parameters}", parameters).replace("{factor}", factor))


def of_angles(mechanism: fx.Mechanism, values: dict[str, float] | None = None) -> list[str]:
    own = {k: p.value for k, p in mechanism.parameters.items() if isinstance(p.value, float)}
    return [str(d) for d in angle_warnings(mechanism, {**own, **(values or {})})]


@pytest.mark.parametrize(
    ("parameters", "factor", "place", "said"),
    [
        (
            "L: 40 mm",
            "cos(45)",
            "nodes.b.0",
            "cos(45): 45 without a unit is in radians, 7.16 turns; did you mean 45 deg?",
        ),
        ("L: 40 mm*cos(45)", "1", "parameters.L", "did you mean 45 deg?"),
        ("c: 1 + sin(-30)/2", "c", "parameters.c", "did you mean -30 deg?"),
        ("angle: 60", "tan(angle)", "parameters.angle", "60 without a unit"),
        ("angle: 60", "tan(2*angle)", "nodes.b.0", "tan(2 * angle): 120 without a unit"),
    ],
)
def test_degrees_without_a_unit_are_doubts(parameters: str, factor: str, place: str, said: str) -> None:
    (doubt,) = of_angles(leaf(parameters, factor))
    assert doubt.startswith(f"{place}: ") and said in doubt


def test_an_angle_from_a_parameter_without_a_unit_is_a_doubt() -> None:
    text = "parameters: {turn: 45}\nsubstructures: {s: {nodes: {a: [0, 0, 0], b: [1 mm, 0, 0]}, links: {l: {"
    text += "nodes: [a, b], material: silicon, section: {shape: circle, diameter: 1 mm}}}, interface: [a]}}\n"
    text += "instances: {one: {of: s, rotate: {axis: z, angle: turn}}}\nground: {one.a: clamped}\n"
    (doubt,) = of_angles(fx.loads(text))
    assert doubt.startswith("parameters.turn: turn: 45 without a unit") and "45 deg" in doubt
    assert of_angles(fx.loads(text.replace("turn: 45}", "turn: 45 deg}"))) == []
    rotation = fx.describe.Rotation(axis=(0, 0, 1), angle=90)
    assert "90 deg" in of_angles(fx.Mechanism(instances={"i": fx.describe.Instance(of="s", rotate=rotation)}))[0]


@pytest.mark.parametrize(
    ("parameters", "factor"),
    [
        ("L: 40 mm", "cos(45 deg)"),
        ("L: 40 mm", "cos(720 deg)"),
        ("L: 40 mm", "sin(1.2)"),
        ("L: 40 mm", "sin(2*pi*7/3)"),
        ("a: 45 deg", "sin(a)"),
        ("a: 45*pi/180", "cos(9*a)"),
        ("n: 12", "cos(n*pi/5)"),
        ("L: 40 mm", "atan(45)"),
        ("L: 40 mm", "sqrt(90)"),
    ],
)
def test_angles_with_units_and_radians_are_no_doubt(parameters: str, factor: str) -> None:
    assert of_angles(leaf(parameters, factor)) == []


def test_a_folded_number_is_a_number() -> None:
    own = leaf("L: 40 mm*cos(45)").parameters["L"]
    assert own.value == 0.04 * np.cos(45) and json.loads(own.model_dump_json())["value"] == own.value
    assert fx.loads(fx.dumps(leaf("L: 40 mm*cos(45)"))).parameters["L"] == own


def test_check_says_so_in_the_terminal_and_in_json(tmp_path) -> None:
    path = tmp_path / "leaf.yaml"
    text = LEAF.replace("{parameters}", "L: 40 mm").replace("{factor}", "cos(45)")
    path.write_text(text.replace("spring-steel", "own") + "materials: {own: {E: 206 MPa, nu: 0.3, rho: 7850 kg/m^3}}\n")
    said = CliRunner().invoke(app, ["check", str(path)]).output
    assert "206 GPa" in said and "45 deg?" in said
    data = json.loads(CliRunner().invoke(app, ["check", str(path), "--json"]).output)
    own = [(d["kind"], d["place"]) for d in data["doubts"] if d["kind"] in ("material", "angle")]
    assert own == [("material", "materials.own"), ("angle", "nodes.b.0")]
