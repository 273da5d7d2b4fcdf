"""Planar parts whose thickness, outline and material vary, against beam theory and parts that are meshed anew."""

import json

import numpy as np
import pytest

import flexura as fx
from flexura.derivatives import mode_sensitivities
from flexura.errors import ModelError, OptionError
from helpers.monoliths import drawn

pytest.importorskip("netgen.occ")

HIGH, LONG, THICK = 2e-3, 30e-3, 6e-3
STRIP = [[(0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (30.0, 2.0, 0.0), (0.0, 2.0, 0.0)]]
NOTCHED = [
    [(0, 0, 0), (8, 0, -1.0), (12, 0, 0), (20, 0, 0), (20, 5, 0), (12, 5, -1.0), (8, 5, 0), (0, 5, 0)],
]
PARAMETERS = {
    "thickness": {"value": "6 mm", "minimum": "5 mm", "maximum": "7 mm"},
    "kerf": {"value": "0 mm", "minimum": "-0.1 mm", "maximum": "0.1 mm"},
    "E": {"value": "70 GPa", "minimum": "60 GPa", "maximum": "80 GPa"},
    "rho": {"value": "2700 kg/m^3", "minimum": "2500 kg/m^3", "maximum": "2900 kg/m^3"},
}


def described(file, far, parameters=(), **sizes):
    """A drawing that is held at x = 0 and has a node at its other end."""
    metal = {"E": "E" if "E" in parameters else "70 GPa", "nu": 0}
    metal["rho"] = "rho" if "rho" in parameters else "2700 kg/m^3"
    part = {"drawing": str(file), "thickness": "6 mm", "material": "metal", "mesh_tolerance": 3e-3, **sizes}
    by = part.pop("by", 0.0)
    low, high = (f"{1e3 * x:.9g} mm" for x in (-by, far + by))
    part["interfaces"] = {"base": {"x": low, "at": ["0 mm"] * 3}, "tip": {"x": high, "follow": "rigid"}}
    known = {name: PARAMETERS[name] for name in parameters}
    return fx.loads(
        json.dumps(
            {
                "materials": {"metal": metal},
                "parameters": known,
                "parts": {"strip": part},
                "ground": {"strip.base": "clamped"},
            }
        )
    )


def frequencies(model, count=5, **parameters):
    return np.array([mode.full_frequency_hz for mode in fx.modes(model, n=count, parameters=parameters).modes])


@pytest.fixture(scope="module")
def strip(tmp_path_factory):
    """A strip as a drawing."""
    return drawn(STRIP, "lines", tmp_path_factory.mktemp("strip"))


@pytest.fixture(scope="module")
def varied(strip):
    """The strip with everything that may vary."""
    model = described(strip, LONG, [*PARAMETERS], thickness="thickness", offset="kerf")
    return fx.with_solid_parts(model)


@pytest.mark.parametrize(("thickness", "kerf"), [(5e-3, 0.0), (6.5e-3, 0.05e-3), (7e-3, -0.1e-3)])
def test_a_part_that_varies_is_the_part_that_is_meshed_anew(strip, varied, thickness, kerf):
    """Within what both meshes may be off by, some 1e-4 here; and within 1 % as Timoshenko's beam bends."""
    sizes = {"thickness": f"{1e3 * thickness} mm", "offset": f"{1e3 * kerf} mm", "by": kerf}
    found = frequencies(varied, thickness=thickness, kerf=kerf)
    anew = frequencies(described(strip, LONG, **sizes))
    assert found == pytest.approx(anew, rel=1e-3)
    length, high = LONG + 2 * kerf, HIGH + 2 * kerf
    bending = 1.875104**2 / (2 * np.pi * length**2) * high * np.sqrt(70e9 / (12 * 2700))
    assert found[0] == pytest.approx(bending, rel=0.01)


def test_frequencies_follow_the_material_exactly(varied):
    base = frequencies(varied)
    assert frequencies(varied, E=77e9, rho=2600.0) == pytest.approx(base * np.sqrt(1.1 * 27 / 26), rel=1e-9)


def test_derivatives_come_from_the_motion_of_the_mesh(varied):
    """f goes as h/L^2 with the outline, not with the thickness, and as the roots of E and 1/rho."""
    found = mode_sensitivities(varied, n=1)
    slopes = dict(zip(found.free, found.relative[0].tolist(), strict=True))
    assert slopes["E"] == pytest.approx(0.5, rel=1e-6)
    assert slopes["rho"] == pytest.approx(-0.5, rel=1e-6)
    assert slopes["thickness"] == pytest.approx(0.0, abs=3e-3)
    by_kerf = float(found.derivative[0, found.free.index("kerf")] / found.frequency_hz[0])
    assert by_kerf == pytest.approx(2 / HIGH - 4 / LONG, rel=0.02)


def test_nodes_stay_in_the_middle_of_a_part_that_becomes_thicker(varied):
    model = fx.assemble(varied, {"thickness": 7e-3})
    at = model.positions[model.plan.topology.node_names.index("strip.tip")]
    assert at == pytest.approx([LONG, HIGH / 2, 3.5e-3], abs=1e-12)


def test_studies_ask_parts_that_vary(varied):
    """A sweep is what modes say one by one."""
    places = np.linspace(-5e-5, 5e-5, 3)
    found = fx.sweep(varied, vary={"kerf": places.tolist()}, ask="f1")
    one_by_one = [frequencies(varied, 1, kerf=kerf)[0] for kerf in places]
    assert [found.design(k)["f1 [Hz]"] for k in range(3)] == pytest.approx(one_by_one, rel=1e-9)


def test_webs_of_notches_become_thicker(tmp_path):
    """Two circular notches of radius 2 mm with a web of 1 mm: what a wire leaves on each side, 0.05 mm, makes it 1.1 mm
    and the radius 1.95 mm. Each of the two meshes may be off by 3 %, and is by less than 1 %."""
    file, thin = drawn(NOTCHED, "lines", tmp_path), {"thickness": "1.5 mm", "mesh_tolerance": 0.03}
    model = fx.with_solid_parts(described(file, 20e-3, ["kerf"], offset="kerf", **thin))
    anew = frequencies(described(file, 20e-3, offset="0.05 mm", by=0.05e-3, **thin))
    found = frequencies(model, kerf=0.05e-3)
    assert found == pytest.approx(anew, rel=0.01)
    assert (found / frequencies(model)).max() > 1.05  # of bending in the plane


def bored(length, bore, parameters):
    """A strip with a hole, written as lines, of which length and bore vary."""
    x = [f"{length}/2", "1 mm"]
    part = {
        "outline": [["0 mm", "0 mm"], [length, "0 mm"], {"to": [length, "2 mm"], "name": "end"}, ["0 mm", "2 mm"]],
        "holes": [{"centre": x, "diameter": bore}],
        "thickness": "1 mm",
        "material": "metal",
        "mesh_tolerance": 0.03,
        "interfaces": {"base": {"x": "0 mm"}, "tip": {"face": "end"}},
    }
    return fx.loads(
        json.dumps(
            {
                "materials": {"metal": {"E": "70 GPa", "nu": 0, "rho": "2700 kg/m^3"}},
                "parameters": parameters,
                "parts": {"strip": part},
                "ground": {"strip.base": "clamped"},
            }
        )
    )


def test_all_sizes_of_an_outline_may_vary():
    length = {"value": "30 mm", "minimum": "28 mm", "maximum": "33 mm"}
    bore = {"value": "1.2 mm", "minimum": "1.1 mm", "maximum": "1.3 mm"}
    model = fx.with_solid_parts(bored("length", "bore", {"length": length, "bore": bore}))
    at = {"length": 32e-3, "bore": 1.15e-3}
    assert frequencies(model, 5, **at) == pytest.approx(frequencies(bored("32 mm", "1.15 mm", {})), rel=0.01)
    full = fx.assemble(model, at)
    tip = full.positions[full.plan.topology.node_names.index("strip.tip")]
    assert tip == pytest.approx([32e-3, 1e-3, 0.5e-3], abs=1e-9)
    mass = 2700 * 1e-3 * (32e-3 * 2e-3 - np.pi / 4 * 1.15e-3**2)
    assert fx.check(model, at).mass.mass == pytest.approx(mass, rel=1e-6)


def test_sizes_without_bounds_and_beyond_them_are_refused(strip, varied, tmp_path):
    with pytest.raises(OptionError, match="kerf"):
        frequencies(varied, kerf=0.2e-3)
    model = described(strip, LONG, ["kerf"], offset="kerf")
    loose = {"kerf": model.parameters["kerf"].replaced({"maximum": None})}
    with pytest.raises(ModelError, match="kerf has no minimum and maximum"):
        fx.with_solid_parts(model.replaced({"parameters": loose}))
    wide = {"kerf": model.parameters["kerf"].replaced({"minimum": -1.2e-3})}
    with pytest.raises(ModelError, match=r"parts.strip.offset"):
        fx.with_solid_parts(model.replaced({"parameters": wide}))
