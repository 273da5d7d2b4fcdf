"""One of each kind of result, of small mechanisms with a name that a page must not run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp

import flexura as fx
from flexura.results import Result
from flexura.solid.whole import WholeMode
from flexura.synthesis import Candidate
from helpers.tested_stage import STAGE, TEST

NAME = "<script>alert('&')</script>"
GUIDE = Path(__file__).parents[2] / "examples" / "guide" / "guide.yaml"
NODE = "carriage"
LOAD = {NODE: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]}
GRAVITY = (0.0, 0.0, -9.81)
HZ = np.array([3.0, 40.0])


def named(text: str) -> str:
    """A description with the name."""
    lines = [line for line in text.strip().splitlines() if not line.startswith("name:")]
    return "\n".join([lines[0], f'name: "{NAME}"', *lines[1:], ""])


GUIDE_TEXT = named(GUIDE.read_text(encoding="utf-8"))
STAGE_TEXT = named(STAGE + TEST)


@cache
def guide() -> fx.Mechanism:
    return fx.loads(GUIDE_TEXT)


def requirements() -> fx.Requirements:
    return fx.requirements(guide().replaced({"requirements": {"first mode": "f1 >= 20 Hz", "light": "mass <= 1 g"}}))


def published() -> fx.Published:
    known = fx.describe.PublishedValue(ask="f1", value="55 Hz", source="A")
    return fx.published(guide().replaced({"published": (known,)}))


def candidates() -> fx.Candidates:
    required = fx.requirements(guide().replaced({"requirements": {"first mode": "f1 >= 90 Hz"}})).requirements
    own = Candidate("candidate-01.yaml", NAME, "1T", 2, 1, 40.0, 10.0, 54.0, 0.05, required)
    return fx.Candidates(NAME, "1T", 30, 1, 65, (own,), {"freedoms": 0, "first mode": 1}, ("posts are not drawn",))


@cache
def stage() -> fx.Mechanism:
    return fx.loads(STAGE_TEXT)


@cache
def virtual_test() -> fx.VirtualTest:
    return fx.virtual_test(stage(), seed=1)


def identified() -> fx.IdentifiedModes:
    found = virtual_test().identified
    assert found is not None
    return found


@cache
def statics() -> fx.Statics:
    return fx.statics(guide(), loads=LOAD)


@cache
def system() -> fx.System:
    return fx.system(guide(), inputs=[f"{NODE}.tx"], outputs=[f"{NODE}.tx", f"{NODE}.rz"])


def frequency_response(frequency_hz: np.ndarray = HZ) -> fx.FrequencyResponse:
    ends = [f"{NODE}.tx", f"{NODE}.rz"]
    return fx.frequency_response(guide(), frequency_hz=frequency_hz, inputs=ends, outputs=ends)


def time_response() -> fx.TimeResponse:
    return fx.time_response(
        guide(), inputs={f"{NODE}.tx": np.ones(12)}, dt=1e-3, outputs=[f"{NODE}.tx", f"{NODE}.rz:velocity"]
    )


SERVO_TEXT = (
    GUIDE_TEXT
    + """
damping: 0.01
disturbances:
  floor: {base: x, spectrum: VC-C}
controllers:
  servo: {sensor: carriage.tx, actuator: carriage.tx, integral: 20 N/mm/s}
"""
)


@cache
def servo() -> fx.Mechanism:
    return fx.loads(SERVO_TEXT)


@cache
def sensed() -> fx.Mechanism:
    """The guide with a coil and a gauge, and white noise in both."""
    return fx.loads(
        GUIDE_TEXT
        + """
damping: 0.01
actuators:
  coil: {type: force, nodes: [carriage], direction: x}
sensors:
  gauge: {type: displacement, nodes: [carriage], direction: x}
disturbances:
  amplifier: {input: coil, density: 20 uN/sqrt(Hz)}
  noise: {sensor: gauge, density: 50 pm/sqrt(Hz)}
"""
    )


def natural_frequencies() -> fx.NaturalFrequencies:
    return fx.natural_frequencies(guide(), {"thickness": np.array([5e-4, 6e-4])}, n=3)


def neglected() -> fx.types.Neglected:
    found = fx.state_space(system(), n=3).neglected
    assert found is not None
    return found


def calibration() -> fx.Calibration:
    hz = [56.0, 170.0]
    return fx.calibrate(guide(), data=hz, free=["thickness", "length"])


DRAWN = Path(__file__).parents[1] / "fuzz"
"""Where a part and a drawing are."""


def drift() -> fx.models.Drift:
    found = statics()
    turning = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    return fx.models.drift(found.model, found.displacement_vector, node=NODE, load=turning)


def screw_axis() -> fx.types.ScrewAxis:
    return fx.models.screw_axis([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def signal_file() -> fx.types.SignalFile:
    time = np.array([0.0, 1e-3, 2e-3])
    return fx.types.SignalFile(1e-3, time, {NODE: time})


def left_out() -> fx.types.LeftOut:
    found = time_response().neglected
    assert found is not None
    return found


def mode_pairing() -> fx.modal.ModePairing:
    found = fx.modes(guide(), n=3)
    shapes = found.shapes.reshape(-1, 3)
    return fx.modal.pair_modes(found.frequency_hz, shapes, model_hz=found.frequency_hz, model_shapes=shapes)


def imported_part() -> fx.solid.ImportedPart:
    folder = GUIDE.parents[1] / "imported"
    stored = fx.solid.read_calculix(folder / "leaf.inp", units={"length": "mm", "mass": "t", "time": "s"})
    return fx.solid.imported(stored, {"foot": "FOOT", "head": "HEAD"})


def stored_matrices() -> fx.solid.StoredMatrices:
    one = np.array([1], dtype=np.intp)
    K = sp.csc_matrix(np.array([[2.0]]))
    return fx.solid.StoredMatrices(K, K, one, np.array([0], dtype=np.intp), one, np.zeros((1, 3)))


def understanding() -> fx.Understanding:
    options = {"thickness": 12e-3, "material": "Al-7075-T6", "hold": "x = 0 mm", "with_solid": False}
    found = fx.understand(DRAWN / "guide.svg", **options)
    mode = fx.types.ComparedMode(290.7, 2e-3, 288.6, 0.999, -7e-3, (-0.02, 0.02), True)
    return replace(found, modes=(mode,), cells=8000, dofs=130000)


def coupled() -> fx.CoupledResponse:
    measured = replace(frequency_response(), name=NAME)
    joins = [(f"A.{NODE}.tx", f"B.{NODE}.tx")]
    return fx.couple({"A": measured, "B": measured}, joins=joins, noise={"A": 1e-9})


def virtual_points() -> fx.VirtualPointResponse:
    point = fx.VirtualPoint((0.0, 0.0, 0.065), ("tx",), (f"{NODE}.tx",), (f"{NODE}.tx",))
    return fx.virtual_points(frequency_response(), {"point": point}, name=NAME)


def reciprocity() -> fx.testing.Reciprocity:
    places = [(NODE, (1.0, 0.0, 0.0)), (NODE, (0.0, 1.0, 0.0))]
    inputs, outputs = (
        tuple(fx.testing.MeasuredChannel(f"{kind} {k}", kind, *place) for k, place in enumerate(places))
        for kind in ("force", "displacement")
    )
    H = np.array([[2.0, 0.5], [0.6, 1.0]]) / np.array([1 + 1j, 2 + 1j])[:, None, None]
    return fx.testing.reciprocity(fx.testing.MeasuredFRF(np.array([1.0, 2.0]), H, inputs, outputs))


MAKERS: dict[str, Callable[[], Result]] = {
    "Backbone": lambda: fx.backbone(guide(), amplitude={f"{NODE}.tx": 1e-4}, harmonics=1),
    "Budget": lambda: fx.budget(servo(), outputs=[f"{NODE}.tx", f"{NODE}.rz"], frequency_hz=HZ),
    "Calibration": calibration,
    "Certificate": lambda: fx.models.certify(fx.reduce(guide()), n=2),
    "ChannelPairing": lambda: fx.testing.pair_channels(fx.assemble(stage()), identified().outputs),
    "CheckReport": lambda: fx.check(guide()),
    "ClosedLoop": lambda: fx.closed_loop(servo(), outputs=[f"{NODE}.tx"]),
    "Comparison": lambda: fx.compare(guide(), n=2, methods=["constraint_modes"]),
    "ComplexModes": lambda: system().modal(3).complex_modes,
    "ComplianceSpectrum": lambda: fx.kinetostatics(guide(), platform=NODE).spectrum,
    "Constraints": lambda: fx.constraints(guide()),
    "Heat": lambda: fx.heat(guide(), states=["temperature"], n=2),
    "Correlation": lambda: fx.correlate(stage(), test=virtual_test().measurement),
    "CoupledResponse": coupled,
    "Drawing": lambda: fx.faces(DRAWN / "bar.step"),
    "Drift": drift,
    "FreedomSpaces": lambda: fx.free(guide()),
    "FrequencyResponse": frequency_response,
    "FullOrderModel": lambda: fx.assemble(guide()),
    "IdentifiedModes": identified,
    "ImportedPart": imported_part,
    "Kinetostatics": lambda: fx.kinetostatics(guide(), platform=NODE),
    "LeftOut": left_out,
    "LowOrderModel": lambda: fx.reduce(guide(), keep=1),
    "MeasuredFRF": lambda: virtual_test().measurement.frfs[0],
    "MeasuredFrequencies": lambda: fx.testing.MeasuredFrequencies.of([10.0, None, 30.0], name=NAME),
    "Measurement": lambda: virtual_test().measurement,
    "Misalignment": lambda: fx.misalignment(guide(), mounts={"leaf2.*": (1e-4, 1e-3)}, node=NODE, samples=2),
    "ModalSystem": lambda: system().modal(3),
    "ModePairing": mode_pairing,
    "Modes": lambda: fx.modes(guide(), n=3),
    "NaturalFrequencies": natural_frequencies,
    "Neglected": neglected,
    "NonlinearResponse": lambda: fx.nonlinear_response(
        guide(), inputs={f"{NODE}.tx": 1e-3}, outputs=[f"{NODE}.tx"], band=(40, 50), damping=0.02, harmonics=1
    ),
    "NestedModel": lambda: fx.models.nested(fx.reduce(guide()), [NODE], keep=0),
    "Observer": lambda: fx.observer(sensed(), dt=1e-4, n=2),
    "Shaper": lambda: fx.shaper(servo(), dt=1e-4),
    "Reciprocity": reciprocity,
    "SinglePrecision": lambda: fx.models.single_precision(
        fx.state_space(fx.system(sensed(), order="full"), n=2).discretised(1e-4)
    ),
    "Optimum": lambda: fx.optimize(guide(), vary={"thickness": (4e-4, 6e-4)}, minimise="mass", starts=2),
    "Pareto": lambda: fx.optimize(
        guide(), vary={"thickness": [4e-4, 5e-4, 6e-4]}, maximise="f1", minimise="mass", points=2
    ),
    "Candidates": candidates,
    "Preload": lambda: fx.preload(guide(), gravity=GRAVITY),
    "Report": lambda: fx.report(guide()),
    "Recording": lambda: virtual_test().measurement.recordings[0],
    "ResponseSensitivities": lambda: fx.models.response_sensitivities(
        guide(), free=["length"], inputs=[f"{NODE}.tx"], outputs=[f"{NODE}.tx"], frequency_hz=HZ
    ),
    "ScheduledPlant": lambda: fx.scheduled_plant(
        guide(), move={f"{NODE}.x": (0.0, 1e-3)}, inputs=[f"{NODE}.tx"], outputs=[f"{NODE}.tx"], n=3
    ),
    "ScrewAxis": screw_axis,
    "ModeSensitivities": lambda: fx.models.mode_sensitivities(guide(), free=["length"], n=2),
    "Sensitivity": lambda: fx.sensitivity(guide(), ask="f1, mass"),
    "Published": published,
    "Requirements": requirements,
    "SensorPlacement": lambda: fx.place_sensors(guide(), sensors=2, n=1),
    "SignalFile": signal_file,
    "StateSpace": lambda: fx.state_space(system(), n=3),
    "Statics": statics,
    "StoredMatrices": stored_matrices,
    "Stresses": lambda: statics().stresses(),
    "Stroke": lambda: fx.stroke(guide(), move={f"{NODE}.tx": (0.0, 1e-3)}, steps=2, n=2),
    "StudyTable": lambda: fx.sweep(guide(), vary={"thickness": (4e-4, 6e-4, 40)}, ask="f1, f2, mass"),
    "System": system,
    "TimeResponse": time_response,
    "Tolerance": lambda: fx.tolerance(guide(), vary={"thickness": "± 1 %"}, ask="f1, mass", samples=24, workers=1),
    "Understanding": understanding,
    "Verification": lambda: fx.verify(guide(), n=1, size=2.0),
    "WholeVerification": lambda: fx.types.WholeVerification(
        *("a guide", {"thickness": 5e-4}),
        (WholeMode(54.1, 2e-3, 54.35, 0.999, 4.6e-3, 1e-3, -2e-3, -1e-3, None), WholeMode(803.0, 4e-3)),
        *(3, 1.0, 4000, 90000, 0.05, 20.0, ("ground: held on a face",)),
    ),
    "VirtualPointResponse": virtual_points,
    "VirtualTest": virtual_test,
}
"""How to make one of each public class of results, by its name."""

RESULTS = {name: cache(make) for name, make in MAKERS.items()}
"""The same, made once."""
