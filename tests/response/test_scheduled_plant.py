"""Plants that are scheduled by their pose: against the full order about poses, closed forms and large motion."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.linalg as la
from numpy.typing import NDArray

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = fx.load(EXAMPLES / "guide/guide.yaml")
DRIVE, ENDS = ["carriage.tx"], ["carriage.tx", "carriage.tz", "carriage.tx:velocity", "carriage.tz:acceleration"]
RAYLEIGH = {"rayleigh": {"frequencies": [50.0, 700.0], "ratios": [0.01, 0.01]}}
L, EI = 60e-3, 206e9 * 20e-3 * 0.5e-3**3 / 12


def guide(**more: Any) -> fx.ScheduledPlant:
    options: dict[str, Any] = {"move": {"carriage.x": (-9e-3, 9e-3)}, "inputs": DRIVE, "outputs": ENDS, "n": 8}
    options["tolerance"] = 2e-3
    return fx.scheduled_plant(GUIDE, **{**options, "damping": RAYLEIGH, "up_to": 1000.0, **more})


@pytest.fixture(scope="module")
def plant() -> fx.ScheduledPlant:
    return guide()


@pytest.mark.parametrize("pose", [-7.3e-3, 1.1e-3, 5.17e-3])
def test_a_frozen_plant_is_that_of_the_full_order_about_the_pose(plant: fx.ScheduledPlant, pose: float) -> None:
    """At poses that it has never seen, within the tolerance that was asked for, 0.2 %."""
    own = fx.system(fx.at(GUIDE, {"carriage.x": pose}), inputs=DRIVE, outputs=ENDS, order="full", damping=RAYLEIGH)
    modes = own.modal(up_to=2000.0)
    resonances = modes.frequency_hz[modes.frequency_hz < 1000]
    hz = np.unique(np.concatenate([np.geomspace(1, 1000, 80), resonances, 1.01 * resonances]))
    exact, found = modes.response(hz), plant.state_space(pose).frequency_response(hz)
    size = np.abs(exact).max(axis=0)
    assert (np.abs(found - exact).max(axis=0) <= 2e-3 * size).all()
    assert plant.at(pose).frequencies_hz()[: len(resonances)] == pytest.approx(resonances, rel=2e-3)
    assert not plant.warnings


def test_static_states_are_the_equilibria(plant: fx.ScheduledPlant) -> None:
    """Under the force that holds a pose the plant rests there, and its frozen stiffness is the slope of that force."""
    for pose in fx.stroke(GUIDE, move={"carriage.x": (-8e-3, 8e-3)}, steps=4, n=1, nodes=["carriage"]).poses:
        x, force = pose.move["carriage.x"], pose.reaction["carriage.x"]
        assert plant.family.resting(np.array([force]))[0] == pytest.approx(x, rel=2e-5)
        assert plant.at(x).K[0, 0] == pytest.approx(pose.drive_stiffness["carriage.x"], rel=2e-4)
        assert plant.at(x).readings[:2] == pytest.approx(np.array(pose.displacement["carriage"])[[0, 2]], rel=2e-4)
    x, h = 3e-3, 1e-6
    slope = (plant.at(x + h).force - plant.at(x - h).force) / (2 * h)
    assert slope == pytest.approx(plant.at(x).K[0, 0], rel=1e-7)


def test_a_loaded_guide_has_the_stiffness_of_columns() -> None:
    """Two clamped and guided columns under P each have k = P / (L (tan(u)/u - 1)), u = L sqrt(P/EI)/2 (Timoshenko and
    Gere 1961); the carriage sinks by 3 x^2 / 5 L as it moves without a load."""
    text = (EXAMPLES / "guide/guide.yaml").read_text() + "\ncorrections: none\n"
    move: Any = {"move": {"carriage.x": (-5e-4, 5e-4)}, "inputs": DRIVE, "outputs": ["carriage.tz"], "n": 4}
    for total in (100.0, 200.0):
        loaded = fx.loads(f"{text}loads: {{carriage: {{force: [0, 0, -{total} N]}}}}\n")
        u = L * np.sqrt(total / 2 / EI) / 2
        k = total / (L * (np.tan(u) / u - 1))
        assert fx.scheduled_plant(loaded, **move).at(0.0).K[0, 0] == pytest.approx(k, rel=2e-3)
    free = fx.scheduled_plant(fx.loads(text), **move)
    assert free.at(5e-4).readings[0] == pytest.approx(-3 * 5e-4**2 / (5 * L), rel=2e-3)


SNAP = """
flexura: 1
name: shallow pair of leaves
nodes: {left: [-30 mm, 0, 0], right: [30 mm, 0, 0], a: [-2 mm, 0, 0.6 mm], b: [2 mm, 0, 0.6 mm]}
flexures:
  one: {nodes: [left, a], material: spring-steel, reference: z, profile: {type: leaf, width: 10 mm, thickness: 0.3 mm}}
  two: {nodes: [b, right], material: spring-steel, reference: z, profile: {type: leaf, width: 10 mm, thickness: 0.3 mm}}
bodies:
  shuttle:
    centre: [0, 0, 0.6 mm]
    solid: {shape: box, size: [4 mm, 10 mm, 4 mm], material: Al-6061-T6}
    carries: [a, b]
ground: {left: clamped, right: clamped}
damping: 0.01
"""


def test_a_plant_that_snaps_is_unstable_on_its_way() -> None:
    """The force of a shallow pair falls past its limit point: poses there are unstable under it, which is reported, and
    grow as quickly as in the full order."""
    ends: Any = {"inputs": ["shuttle.tz"], "outputs": ["shuttle.tz"]}
    found = fx.scheduled_plant(
        fx.loads(SNAP), move={"shuttle.z": (-1.0e-3, 0.0)}, n=6, up_to=1500.0, tolerance=0.2, **ends
    )
    falling = [found.at(check.at).K[0, 0] < 0 for check in found.checks]
    unstable = [check.exact_hz[0] < 0 for check in found.checks]
    assert falling == unstable and 3 < sum(unstable) < len(unstable)
    assert found.frequency_error < 5e-3
    assert "buckling" in [w.kind for w in found.warnings]
    assert any("unstable, responses are not compared" in note for note in found.notes)


def test_inertia_along_the_stroke_is_that_of_lagrange(plant: fx.ScheduledPlant) -> None:
    """Of a single coordinate, m(p) p'' + m'(p) p'^2 / 2; the forces of speed come from Newton's equations."""
    family = plant.family
    half = family.slopes(family.samples.M[:, 0, 0]) / 2
    assert family.samples.swing[:, 0] == pytest.approx(half, abs=1e-5 * np.abs(half).max())


def test_free_and_undamped_its_energy_stays() -> None:
    undamped = guide(damping=None, move={"carriage.x": (0.0, 9e-3)}, n=6)
    own = undamped.at(4.1e-3)
    A = undamped.state_space(4.1e-3).A
    r = len(own.M)
    energy = la.block_diag(own.K, own.M)
    z = np.append(np.linspace(1e-4, 2e-4, r), np.zeros(r))
    step = la.expm(A * 1e-3)
    first, powers = z @ energy @ z, []
    for _ in range(200):
        z = step @ z
        powers.append(z @ energy @ z / first)
    assert powers == pytest.approx(np.ones(200), abs=1e-9)
    assert any("damping ratio of 0.01" in note for note in undamped.notes)


def push(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(t < 0.01, 20.0 * np.sin(np.pi * t / 0.01) ** 2, 0.0)


def test_over_time_it_is_the_large_motion(plant: fx.ScheduledPlant) -> None:
    """Thrown 5 mm far at up to 2 m/s; the error of the large motion falls with the square of its step, down to a few
    parts in ten thousand between the two. Linear motion does not sink at all."""
    ways: Any = {"inputs": {"carriage.tx": push}, "dt": 2e-4, "duration": 0.014}
    full: Any = {**ways, "outputs": ENDS, "damping": RAYLEIGH}
    large = fx.time_response(GUIDE, motion="large", order="full", rho_infinity=1.0, **full).response
    linear, found = fx.time_response(GUIDE, **full).response, plant.time_response(**ways).response
    size = np.abs(large).max(axis=1)
    assert size[0] > 4e-3
    assert (np.abs(found - large).max(axis=1) < np.array([1.5e-3, 1.5e-3, 1.5e-3, 4e-3]) * size).all()
    assert (np.abs(linear - large).max(axis=1) > np.array([4e-3, 0.9, 4e-3, 0.9]) * size).all()


def test_a_start_under_load_is_let_go(plant: fx.ScheduledPlant) -> None:
    """The speed at the middle is that of the work of the static force: m v^2 / 2 = the integral of f dx, all of the
    mass, leaves included, moving along the stroke; 0.5 % are left to vibrations of the leaves."""
    amplitude = 8e-3
    free = guide(damping={"rayleigh": {"frequencies": [50.0, 700.0], "ratios": [1e-6, 1e-6]}})
    force = float(free.at(amplitude).force)
    found = free.time_response(inputs={}, start={"carriage.tx": force}, dt=1e-4, duration=0.02)
    assert found.of("carriage.tx")[0] == pytest.approx(amplitude, rel=1e-6)
    path = np.linspace(0, amplitude, 400)
    work = np.trapezoid([plant.at(x).force for x in path], path)
    speed = np.abs(found.of("carriage.tx:velocity")).max()
    assert plant.at(0.0).M[0, 0] * speed**2 / 2 == pytest.approx(work, rel=5e-3)


def test_modes_that_cross_keep_their_coordinates() -> None:
    """The second and the third mode of the guide change places near 5 mm; frequencies between poses stay true."""
    found = guide(move={"carriage.x": (0.0, 9e-3)}, n=6)
    assert any(note.startswith("modes 2 and 3 cross between") for note in found.notes)
    assert found.frequency_error < 2e-3


def test_far_turned_modes_change_and_stay_within_the_tolerance() -> None:
    """The second mode of the pivot falls from 190 to 83 Hz as it turns by 20 degrees."""
    pivot = fx.load(EXAMPLES / "pivot/pivot.yaml")
    found = fx.scheduled_plant(pivot, move={"arm.ry": (0.0, np.radians(20))}, n=8, up_to=200.0, damping=0.01)
    exact = np.array([check.exact_hz[1] for check in found.checks])
    assert exact[0] / exact[-1] > 2.2
    assert found.error < 0.01
    assert not found.warnings


def test_too_few_deviations_are_reported() -> None:
    found = guide(n=1, up_to=900.0, move={"carriage.x": (0.0, 9e-3)})
    assert found.warnings[0].kind == "tolerance"
    assert "keep more modes" in str(found.warnings[0])
    assert found.state_space(1e-3).warnings == found.warnings


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mat"])
def test_files_hold_the_plant_by_pose(plant: fx.ScheduledPlant, tmp_path: Path, suffix: str) -> None:
    """Weights of the file give the state space between poses, and under the force of a pose nothing moves there."""
    (path,) = fx.export(plant, tmp_path / f"plant{suffix}")
    if suffix == ".mat":
        data = scipy.io.loadmat(path)
        known = {name: data[name] for name in ("A", "B", "C", "D", "dx0", "force", "pose", "weights", "y0")}
        assert data["A"].shape == (18, 18, len(plant.family.points)) and data["pose"].shape[1] == 1
        known = {name: np.moveaxis(a, -1, 0) if a.ndim == 3 else a[:, 0] for name, a in known.items()}
        known["dx0"] = known["dx0"][..., 0]
    elif suffix == ".npz":
        known = dict(np.load(path))
    else:
        with pytest.importorskip("h5py").File(path) as file:
            known = {name: file[name][()] for name in ("A", "B", "C", "D", "dx0", "force", "pose", "weights")}
    pose = 2.34e-3
    weights = known["weights"] / (pose - known["pose"])
    weights /= weights.sum()
    exact = plant.state_space(pose)
    for name in "ABCD":
        found, wanted = np.tensordot(weights, known[name], 1), getattr(exact, name)
        assert found == pytest.approx(wanted, abs=2e-3 * np.abs(wanted).max())
    for dx0, B, force in zip(known["dx0"], known["B"], known["force"], strict=True):
        assert dx0 + B[:, 0] * force == pytest.approx(0.0, abs=1e-8 * np.abs(B).max() * np.abs(known["force"]).max())


def test_python_control_has_it_at_a_pose(plant: fx.ScheduledPlant) -> None:
    pytest.importorskip("control")
    own = fx.to_control(plant.state_space(4e-3))
    assert own.nstates == 18
    assert own.state_labels[:2] == ["carriage_x", "deviation_1"]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"move": {"carriage.x": (0, 1e-3), "carriage.y": (0, 1e-3)}}, "one displacement and its range"),
        ({"move": {"carriage.x": 1e-3}}, "goes from one number to another"),
        ({"move": {"carriage.x": (1e-3, 1e-3)}}, "goes from one number to another"),
        ({"move": {"carriage.q": (0, 1e-3)}}, "is no displacement"),
        ({"n": 0}, "the number of modes"),
        ({"up_to": -1.0}, "up_to is a positive frequency"),
        ({"tolerance": np.nan}, "tolerance is a positive"),
        ({"outputs": ["nothing.tx"]}, "nothing"),
    ],
)
def test_what_is_refused(more: dict[str, Any], message: str) -> None:
    with pytest.raises(fx.OptionError, match=message):
        guide(**more)


def test_poses_and_motions_off_the_stroke_are_refused(plant: fx.ScheduledPlant) -> None:
    with pytest.raises(fx.OptionError, match=r"carriage.x = 12 mm is not on the stroke, -9 to 9 mm"):
        plant.state_space(0.012)
    with pytest.raises(fx.OptionError, match=r"no static state under these inputs is on the stroke"):
        plant.time_response(inputs={}, start={"carriage.tx": 100.0}, dt=1e-3, duration=0.01)
    with pytest.raises(
        fx.SolverError, match=r"leaves the stroke, -9 to 9 mm, at carriage.x = 9 mm, .* after the start"
    ):
        plant.time_response(inputs={"carriage.tx": np.full(200, 60.0)}, dt=1e-4)
    with pytest.raises(fx.OptionError, match=r"there is no input 'motor'; known: carriage.tx"):
        plant.time_response(inputs={"motor": [1.0, 1.0]}, dt=1e-3)
