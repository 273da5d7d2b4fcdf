"""Diaphragms in every verb: a voice coil's shaft between two of them, and one by itself."""

import numpy as np
import pytest

import flexura as fx
from flexura.beam import ring_plate
from flexura.beam.ring_plate import RingPlate
from flexura.view import solids

METAL = fx.Mechanism().material("Al-7075-T6")
PLATE = RingPlate(30e-3, 10e-3, 0.3e-3, METAL.E, METAL.nu, METAL.rho)
K = ring_plate.stiffnesses(PLATE)
STIFFER = 2 * ring_plate.membrane(PLATE).axial * PLATE.thickness**2 / K[2]

STAGE = """
flexura: 1
parameters:
  t: {value: 0.3 mm}
  hub: {value: 20 mm, minimum: 10 mm, maximum: 80 mm}
nodes: {a: [0, 0, 0], ac: [0, 0, 0], b: [0, 20 mm, 40 mm], bc: [0, 0, 40 mm]}
diaphragms:
  lower: {nodes: [a, ac], material: Al-7075-T6, rim_diameter: 60 mm, hub_diameter: hub, thickness: t}
  upper:
    nodes: [b, bc]
    material: Al-7075-T6
    normal: [0, 0.1, 1]
    rim_diameter: 60 mm
    hub_diameter: hub
    thickness: t
bodies:
  shaft:
    centre: [0, 0, 20 mm]
    carries: [ac, bc]
    solid: {shape: cylinder, diameter: 20 mm, length: 50 mm, material: Al-7075-T6}
ground: {a: clamped, b: clamped}
"""


@pytest.fixture(scope="module")
def stage():
    return fx.loads(STAGE)


def single(**more):
    """One diaphragm in the plane z = 0 that carries a mass on its hub."""
    ring = fx.describe.Diaphragm(
        nodes=("rim", "hub"), material="Al-7075-T6", rim_diameter=60e-3, hub_diameter=20e-3, thickness=0.3e-3
    )
    described = {
        "nodes": {"rim": (0, 0, 0), "hub": (0, 0, 0)},
        "diaphragms": {"ring": ring},
        "masses": {"mass": fx.describe.PointMass(node="hub", mass=0.1, inertia=(1e-5,) * 3)},
        "ground": {"rim": "clamped"},
    }
    return fx.Mechanism(**{**described, **more})


def test_the_shaft_moves_on_both(stage):
    assert fx.loads(fx.dumps(stage)) == stage
    found = fx.modes(single())
    M = ring_plate.mass(PLATE)[6:, 6:] + np.diag([0.1, 0.1, 0.1, 1e-5, 1e-5, 1e-5])
    expected = np.sort(np.sqrt(K / np.diag(M)) / (2 * np.pi))
    np.testing.assert_allclose(found.frequency_hz, expected, rtol=1e-9)
    modes = fx.modes(stage)
    assert modes.evidence.mass_error < 1e-12 and modes.evidence.inertia_error < 1e-12
    assert [w.place for w in modes.warnings if w.kind == "resonance"] == ["lower", "upper"]
    assert not fx.modes(stage, n=1).warnings
    assert not [w for w in fx.check(stage).warnings if w.kind == "overlap"]
    low, high = modes.model_errors.intervals[0]
    assert low < -0.03 < 0.01 < high  # edges that give as half planes do: up to 2.65 t/w = 4 % of compliance


def test_batches_slopes_and_exact_methods_are_those_of_single_designs(stage):
    t = np.array([0.2e-3, 0.4e-3])
    batch = fx.natural_frequencies(stage, {"t": t}, n=3).frequency_hz
    for row, value in zip(batch, t, strict=True):
        np.testing.assert_allclose(row, fx.modes(stage, {"t": value}, n=3, order="full").frequency_hz, rtol=1e-5)
    slopes = fx.sensitivity(stage, ask=["f1", "f3"])
    for name, value, step in (("t", 0.3e-3, 1e-8), ("hub", 20e-3, 1e-6)):
        ahead, behind = (fx.modes(stage, {name: value + sign * step}, order="full").frequency_hz for sign in (1, -1))
        wanted = (ahead - behind)[[0, 2]] / (2 * step)
        np.testing.assert_allclose(slopes.slope[:, slopes.parameters.index(name)], wanted, rtol=1e-5)
    table = fx.compare(stage, n=3)
    assert all(abs(row.worst_error) < 1e-4 for row in table.rows if row.worst_error is not None)


def test_a_mirrored_copy_is_the_same(stage):
    inner = fx.describe.Instance(of="half", pattern=fx.describe.MirrorPattern(normal=(1, 0.2, 0.1)))
    half = fx.describe.Substructure(
        **{kind: getattr(stage, kind) for kind in ("nodes", "diaphragms", "bodies")}, interface=("a", "b", "shaft")
    )
    both = fx.Mechanism(
        parameters=stage.parameters,
        substructures={"half": half},
        instances={"h": inner},
        springs={"between": fx.describe.Spring(nodes=("h1.a", "h2.a"), stiffness={"tx": 1.0})},
        ground={"h*.a": "clamped", "h*.b": "clamped"},
    )
    np.testing.assert_allclose(
        fx.modes(both, order="full").frequency_hz.reshape(3, 2),
        fx.modes(stage, n=3, order="full").frequency_hz[:, None] * [1, 1],
        rtol=1e-9,
    )  # fmt: skip
    push = {"h1.shaft": (0, 0, 0.5, 2e-3, 0, 0), "h2.shaft": (0, 0, 0.5, 2e-3, 0, 0)}
    assert fx.stroke(both, loads={k: ((0,) * 6, v) for k, v in push.items()}, steps=2).poses[-1].frequency_hz[0] > 0


def test_a_stroke_stiffens_it_as_membrane_forces_do():
    t = PLATE.thickness
    path = fx.stroke(single(), move={"hub.z": (0, t)}, steps=3)
    for pose, share in zip(path.poses, (0.0, 0.5, 1.0), strict=True):
        assert pose.reaction["hub.z"] == pytest.approx(K[2] * share * t * (1 + STIFFER * share**2), rel=1e-9, abs=1e-9)
    assert not path.warnings
    far = fx.stroke(single(), move={"hub.z": (0, 2 * t)}, steps=2)
    assert [(w.place, w.value) for w in far.warnings] == [("ring", pytest.approx(2.0))]
    at = fx.modes(fx.at(single(), {"hub.z": t / 2}), n=1).frequency_hz[0]
    assert at == pytest.approx(fx.modes(single(), n=1).frequency_hz[0] * np.sqrt(1 + 3 * STIFFER / 4), rel=1e-6)


def test_linear_answers_say_where_it_stiffens():
    push = K[2] * PLATE.thickness
    near, far = (fx.statics(single(), loads={"hub": (0, 0, share * push, 0, 0, 0)}) for share in (0.05, 0.5))
    assert not near.warnings
    (warning,) = (w for w in far.warnings if w.kind == "stiffness")
    x = np.roots([STIFFER, 0, 1, -0.5])
    assert warning.value == pytest.approx(2 * float(x[np.isreal(x)].real[0]), rel=1e-3)
    hanging = single(loads={"hub": fx.describe.Load(force=(0, 0, 0.2 * push))})
    assert [w.kind for w in fx.modes(hanging, n=1).warnings] == ["stiffness"]


def test_membrane_forces_soften_it_as_in_large_motion():
    """A force in the plane, in the state that gravity and loads describe, and along a stroke."""
    push = (200.0, 0.0, 0.0)
    linear = fx.modes(single(loads={"hub": fx.describe.Load(force=push)}), n=3).frequency_hz
    large = fx.stroke(single(), loads={"hub": ((0,) * 6, (*push, 0, 0, 0))}, steps=2).poses[-1].frequency_hz
    np.testing.assert_allclose(linear, large[:3], rtol=1e-4)
    assert linear[0] < 0.98 * fx.modes(single(), n=1).frequency_hz[0]


def test_bad_sizes_are_named():
    with pytest.raises(fx.ModelError) as error:
        fx.loads(STAGE.replace("value: 20 mm", "value: 70 mm").replace("normal: [0, 0.1, 1]", "normal: [0, 0, 0]"))
    text = str(error.value)
    assert "diaphragms.upper.normal" in text
    with pytest.raises(fx.ModelError, match="hub of a diaphragm is smaller than its rim of 60 mm"):
        fx.loads(STAGE.replace("value: 20 mm", "value: 70 mm"))
    with pytest.raises(fx.ModelError, match="smaller than its rim"):
        fx.modes(fx.loads(STAGE), {"hub": 70e-3})


def test_pictures_bend_from_rim_to_hub():
    model = fx.assemble(single())
    u = np.zeros((2, 6))
    u[1] = [1e-3, -2e-3, 3e-3, 0.02, 0.03, 0.01]
    drawn = solids(model, u)
    radius = np.hypot(*drawn.points[:, :2].T)
    at = [np.flatnonzero(np.abs(radius - r) < 1e-9) for r in (PLATE.rim, PLATE.hub)]
    assert len(at[0]) and np.abs(drawn.motions[at[0]]).max() < 1e-12
    arms = drawn.points[at[1]] * [1, 1, 0]  # the plate's normals turn, but its thickness is drawn as it is
    np.testing.assert_allclose(drawn.motions[at[1]], u[1, :3] + np.cross(u[1, 3:], arms), atol=1e-12)
