"""Plans, models and results are data: they pickle, go to other processes, and are shown in one line."""

import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"
HZ = np.array([3.0, 40.0])


@pytest.fixture(scope="module", params=["guide", "rpr"])
def example(request) -> fx.Mechanism:
    return fx.load(EXAMPLES / request.param / f"{request.param}.yaml")


def stack(mechanism) -> dict[str, np.ndarray]:
    """Three designs, of one parameter."""
    name, value = next(iter(fx.Plan(mechanism).parameter_values().items()))
    return {name: value * np.array([1.0, 1.01, 1.02])}


def platform(mechanism) -> str:
    return "platform" if "platform" in mechanism.bodies else "carriage"


def driven(mechanism) -> fx.TimeResponse:
    node = f"{platform(mechanism)}.tx"
    return fx.time_response(mechanism, inputs={node: np.ones(12)}, dt=1e-3, outputs=[node], keep_modes=True)


def loaded(mechanism) -> fx.Statics:
    return fx.statics(mechanism, loads={platform(mechanism): [1.0, 0, 0, 0, 0, 0]})


# What makes each object of a mechanism, and numbers that are worked out with it.
OBJECTS = {
    "Plan": (fx.Plan, lambda plan: fx.reduce(plan, tolerance=1e-3, n=3).K),
    "FullOrderModel": (fx.assemble, lambda model: [fx.reduce(model, keep=1).K, model.base_inertia_forces]),
    "LowOrderModel": (
        lambda m: fx.reduce(m, keep=1),
        lambda low: [fx.modes(low, n=3).frequency_hz, low.recovery.toarray(), low.compliance()],
    ),
    "LowOrderModel of modes": (
        lambda m: fx.reduce(m, tolerance=1e-3, n=3),
        lambda low: [fx.models.certify(low, n=3).lower_hz, low.recovery, low.residual],
    ),
    "NestedModel": (lambda m: fx.models.nested(fx.reduce(m), keep=0), lambda part: part.superelement.stiffness.array),
    "Certificate": (lambda m: fx.models.certify(fx.reduce(m), n=2), lambda proof: proof.error_bound),
    "NaturalFrequencies": (
        lambda m: fx.natural_frequencies(m, stack(m), n=3),
        lambda found: [found.frequency_hz, found.lower_hz],
    ),
    "System": (fx.system, lambda system: [system.damping_matrix(), system.modal(3).response(HZ)]),
    "ModalSystem": (
        lambda m: fx.system(m).modal(3),
        lambda modes: [modes.response(HZ), fx.models.neglected_bound(modes, HZ)],
    ),
    "StateSpace": (lambda m: fx.state_space(fx.system(m), n=3), lambda model: model.frequency_response(HZ)),
    "Neglected": (lambda m: fx.state_space(fx.system(m), n=3).neglected, lambda lost: lost.shares),
    "Modes": (fx.modes, lambda found: [found.frequency_hz, fx.reduce(found.model).K]),
    "Modes of full order": (lambda m: fx.modes(m, n=3, order="full"), lambda found: found.shapes),
    "Mode": (lambda m: fx.modes(m, n=1).modes[0], lambda mode: mode.interval_hz),
    "Evidence": (lambda m: fx.modes(m, n=1).evidence, lambda evidence: evidence.full_residual),
    "FrequencyResponse": (
        lambda m: fx.frequency_response(m, frequency_hz=HZ),
        lambda found: [found.response, len(found.warnings)],
    ),
    "TimeResponse": (driven, lambda found: [found.response, found.displacements(5), len(found.warnings)]),
    "Statics": (loaded, lambda found: [found.displacement_vector, len(found.warnings)]),
    "Stresses": (
        lambda m: fx.models.member_stresses(loaded(m).model, loaded(m).displacement_vector),
        lambda found: [len(found.members)],
    ),
    "Preload": (
        lambda m: fx.preload(m, gravity=(0, 0, -9.81)),
        lambda found: [found.buckling_factor, found.K_g.toarray()],
    ),
    "Kinetostatics": (lambda m: fx.kinetostatics(m, platform=platform(m)), lambda found: found.compliance),
    "FreedomSpaces": (fx.free, lambda found: [own.energy for own in found.bodies]),
    "CheckReport": (fx.check, lambda report: [report.full_order, len(report.warnings)]),
    "Comparison": (
        lambda m: fx.compare(m, n=2, methods=["constraint_modes"]),
        lambda found: [row.frequency_hz for row in found.rows],
    ),
}


def same(ours, theirs) -> bool:
    if isinstance(ours, list | tuple):
        return len(ours) == len(theirs) and all(same(a, b) for a, b in zip(ours, theirs, strict=True))
    return np.array_equal(ours, theirs)


@pytest.mark.parametrize("kind", OBJECTS)
def test_pickled_objects_work_out_the_same_numbers(example, kind) -> None:
    make, numbers = OBJECTS[kind]
    original = make(example)
    expected = numbers(original)
    copy = pickle.loads(pickle.dumps(original))
    assert type(copy) is type(original) and type(copy).__name__ == kind.split()[0]
    assert same(expected, numbers(copy))


@pytest.mark.parametrize("kind", OBJECTS)
def test_objects_are_shown_in_one_line(example, kind) -> None:
    shown = repr(OBJECTS[kind][0](example))
    assert "\n" not in shown and len(shown) < 200
    assert kind.split()[0] in shown


def test_what_is_kept_for_later_is_not_pickled(example) -> None:
    plan = fx.Plan(example)
    fresh = len(pickle.dumps(plan))
    model = fx.assemble(plan)
    small = len(pickle.dumps(model))
    fx.modes(plan)
    fx.natural_frequencies(plan, stack(example), n=3)
    fx.system(model, order="full").modal(3)
    assert len(pickle.dumps(plan)) < 1.1 * fresh
    assert len(pickle.dumps(model)) < 1.1 * small


@pytest.mark.slow
def test_other_processes_take_plans(example) -> None:
    plan, parameters = fx.Plan(example), {name: float(v[1]) for name, v in stack(example).items()}
    expected = fx.modes(plan, parameters, n=2)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = pool.submit(fx.modes, plan, parameters, n=2).result(timeout=60)
    assert np.array_equal(found.frequency_hz, expected.frequency_hz)
    assert not np.array_equal(found.frequency_hz, fx.modes(plan, n=2).frequency_hz)
