"""A reduced mechanism as a part of another: nothing lost, however it is placed, and everything recovered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import assume, given
from hypothesis import strategies as st

import flexura as fx
from flexura.analysis.natural_modes.evidence import mass_evidence
from flexura.linalg import lowest
from flexura.view.scene.solids import solids
from helpers.random_mechanisms import FEW, mechanisms

EXAMPLES = Path(__file__).parents[2] / "examples"
EVERY_MODE = 10_000
ENDS = {"rpu": ("a.bottom", "b.top"), "upr": ("b.bottom", "a.top")}


def hertz(model, count):
    """The lowest frequencies, Hz."""
    return np.sqrt(np.maximum(lowest(model.K, model.M, count).values, 0.0)) / (2 * np.pi)


def rpr():
    return fx.load(EXAMPLES / "rpr" / "rpr.yaml")


def alone(mechanism, name, **more):
    """A substructure of a mechanism as a mechanism of its own."""
    own = mechanism.substructures[name]
    shared = ("parameters", "materials", "sections", "theory", "corrections", "substructures")
    fields = {key: getattr(own, key) for key in type(own).model_fields}
    return fx.Mechanism(**fields, **({key: getattr(mechanism, key) for key in shared} | more))


def nested_branches(keep):
    """Both branches of the parallel mechanism, reduced by themselves."""
    whole, found = rpr(), {}
    for name, (low, high) in ENDS.items():
        low_order = fx.reduce(alone(whole, name), keep=keep)
        found[name] = fx.models.nested(low_order, {low: "low", high: "high"})
    return found


def platform_on(branches):
    """The parallel mechanism with reduced branches as its substructures."""
    whole = rpr()
    return fx.Mechanism(
        parameters=whole.parameters,
        materials=whole.materials,
        substructures={name: branch.substructure for name, branch in branches.items()},
        instances=whole.instances,
        bodies={"platform": whole.bodies["platform"].model_copy(update={"carries": ("rpu*.high", "upr*.high")})},
        ground={"rpu*.low": "clamped", "upr*.low": "clamped"},
    )


def sizes_at(model, vectors, names, prefix=""):
    """Size (nodes, k) of the displacements of named nodes: the same in every frame."""
    at = model.plan.topology.numbers([prefix + name for name in names])
    return np.linalg.norm(model.node_displacements(vectors)[at, :3], axis=1)


def test_constraint_modes_of_nested_branches_against_flexibilities_of_chains():
    """`unproven_frequencies` sums flexibilities and cancels no digits: an independent way to the same model."""
    quick = fx.unproven_frequencies(rpr(), n=12)
    np.testing.assert_allclose(hertz(fx.assemble(platform_on(nested_branches(0))), 12), quick, rtol=2e-9)
    np.testing.assert_allclose(hertz(fx.reduce(rpr()), 12), quick, rtol=2e-9)


@pytest.mark.parametrize("keep", [0, 2])
def test_branches_reduced_by_themselves_make_the_same_model(keep):
    """Neither loses digits to rigid motions of its branches."""
    branches = nested_branches(keep)
    nested, direct = fx.assemble(platform_on(branches)), fx.reduce(rpr(), keep=keep)
    assert nested.order == direct.order
    np.testing.assert_allclose(hertz(nested, 20), hertz(direct, 20), rtol=2e-9)
    whole = fx.assemble(rpr())
    shapes = direct.recover(lowest(direct.K, direct.M, 6).vectors)
    vectors = lowest(nested.K, nested.M, 6).vectors
    names = ["c.half1.c5", "c.half2.c9", "a.notch[3]", "b.notch[4]"]
    for copy in ("rpu1", "rpu2", "upr2"):
        branch = branches[copy[:3]]
        inside = branch.recover(nested, vectors, f"{copy}.reduced")
        found = sizes_at(fx.assemble(branch.model.plan), inside, names)
        expected = sizes_at(whole, shapes, names, f"{copy}.")
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * expected.max())


def test_two_levels_deep():
    whole = rpr()
    ring = fx.models.nested(fx.reduce(alone(whole, "amplifier"), keep=2), {"half1.c1": "low", "half1.c14": "high"})
    pairs, branches = whole.substructures, {}
    for name, (low, high) in ENDS.items():
        own = whole.substructures[name]
        outside = {"c.half1.c1": "c.low", "c.half1.c14": "c.high"}
        joints = tuple(tuple(outside.get(node, node) for node in pair) for pair in own.joints)
        substructures = {"amplifier": ring.substructure, "r_pair": pairs["r_pair"], "u_pair": pairs["u_pair"]}
        inner = alone(whole, name, substructures=substructures).model_copy(update={"joints": joints})
        branches[name] = fx.models.nested(fx.reduce(inner, keep=EVERY_MODE), {low: "low", high: "high"})
    outer = fx.assemble(platform_on(branches))
    fine = {"half_ring": 2, "r_pair": EVERY_MODE, "u_pair": EVERY_MODE}
    direct, one_level = fx.reduce(whole, keep=fine), fx.assemble(platform_on(nested_branches(fine)))
    assert outer.order == one_level.order == direct.order
    np.testing.assert_allclose(hertz(outer, 12), hertz(one_level, 12), rtol=1e-9)
    np.testing.assert_allclose(hertz(outer, 12), hertz(direct, 12), rtol=2e-9)
    vectors = lowest(outer.K, outer.M, 3).vectors
    middle = branches["upr"]
    middle_model = fx.assemble(middle.model.plan)
    inside = ring.recover(middle_model, middle.recover(outer, vectors, "upr1.reduced"), "c.reduced")
    names = ["half1.c5", "half2.c9"]
    found = sizes_at(fx.assemble(ring.model.plan), inside, names)
    shapes = direct.recover(lowest(direct.K, direct.M, 3).vectors)
    np.testing.assert_allclose(found, sizes_at(fx.assemble(whole), shapes, names, "upr1.c."), rtol=1e-6)


def full_compliance(model, node):
    """Compliance (6, 6) of a full-order model at a node."""
    B = model.design.node_rows(model.plan.topology.numbers([node])).toarray()
    K = model.K.toarray()
    d = 1 / np.sqrt(K.diagonal())
    return B @ (d[:, None] * np.linalg.solve(K * d[:, None] * d, d[:, None] * B.T))


@FEW
@given(
    mechanisms(grounded=False, nested=False),
    st.sampled_from([0, 1, 3, EVERY_MODE]),
    st.sampled_from(["craig_bampton", "rubin"]),
)
def test_a_nested_model_does_not_depend_on_how_it_is_placed(mechanism, keep, method):
    """Turned, moved and mirrored copies between ground and a body, against the same copies described in full."""
    nodes = ("n0", list(mechanism.nodes)[-1])
    own = {key: getattr(mechanism, key) for key in fx.describe.Substructure.model_fields} | {"interface": nodes}
    rigid_roots = ("plate", "warping", "shear", "notch")  # a nested model does not know what it will end in
    shared = {"materials": mechanism.materials, "theory": mechanism.theory, "corrections": rigid_roots}
    reduced = fx.models.nested(fx.reduce(fx.Mechanism(**own, **shared), keep=keep, reduction=method))
    turn = fx.describe.Rotation(axis=(1.0, 2.0, -1.0), angle=0.7)
    pattern = (
        fx.describe.MirrorPattern(normal=(1.0, 0.3, 0.2)),
        fx.describe.CircularPattern(count=2, axis=(0.0, 1.0, 1.0)),
    )
    outer = {
        "instances": {"leg": fx.describe.Instance(of="leg", at=(0.02, 0.01, 0.0), rotate=(turn,), pattern=pattern)},
        "bodies": {"hub": fx.describe.RigidBody(carries=(f"leg*.{nodes[1]}",), mass=0.05, inertia=(1e-6, 2e-6, 3e-6))},
        "ground": {"leg*.n0": "clamped"},
        **shared,
    }
    nested = fx.assemble(fx.Mechanism(substructures={"leg": reduced.substructure}, **outer))
    direct = fx.reduce(
        fx.Mechanism(substructures={"leg": fx.describe.Substructure(**own)}, **outer), keep=keep, reduction=method
    )
    n = min(10, nested.order)
    assert n == min(10, direct.order)
    np.testing.assert_allclose(hertz(nested, n), hertz(direct, n), rtol=1e-7)
    described = fx.assemble(direct.plan)
    full = hertz(described, n)
    assert (hertz(nested, n) >= full * (1 - 1e-7)).all()
    if keep == EVERY_MODE:
        np.testing.assert_allclose(hertz(nested, n), full, rtol=1e-6)
    exact = full_compliance(described, "hub")
    scale = np.sqrt(np.outer(exact.diagonal(), exact.diagonal()))
    for found in (full_compliance(nested, "hub"), fx.reduce(nested.plan).compliance(["hub"])):
        assert (np.abs(found - exact) <= 1e-7 * scale).all()
    mass, expected = (mass_evidence(model)["model_mass"] for model in (nested, described))
    assert mass.mass == pytest.approx(expected.mass, rel=1e-9)
    np.testing.assert_allclose(mass.centre, expected.centre, atol=1e-9)
    np.testing.assert_allclose(mass.inertia, expected.inertia, atol=1e-9 * np.abs(expected.inertia).max())
    assert mass_evidence(nested)["rigid_body_residual"] < 1e-12


@FEW
@given(mechanisms(), st.integers(0, 2))
def test_nesting_is_a_change_of_coordinates(mechanism, keep):
    low = fx.reduce(mechanism.model_copy(update={"ground": {}}), keep=keep)
    nodes = [name for name in mechanism.nodes if name in low.static_nodes] or list(low.static_nodes)
    assume(nodes)
    model = fx.models.nested(low, nodes[:1]).model
    np.testing.assert_allclose(model.node_rows(nodes[:1]), np.eye(6, model.order), atol=1e-9)
    np.testing.assert_allclose(hertz(model, 12)[6:], hertz(low, 12)[6:], rtol=1e-7)


def test_fewer_amplitudes_leave_statics_and_raise_frequencies():
    low = fx.reduce(alone(rpr(), "upr"), keep=2)
    held = {"b_bottom": "clamped"}
    before = None
    for keep in (0, 4, 8, None):
        reduced = fx.models.nested(low, keep=keep)
        model = fx.assemble(fx.Mechanism(**dict(reduced.substructure), ground=held))
        K = model.K.toarray()
        bottom = K[:6, :6] - K[:6, 6:] @ np.linalg.solve(K[6:, 6:], K[6:, :6]) if keep != 0 else K
        hz = hertz(model, 4)
        if before is not None:
            np.testing.assert_allclose(bottom, before[0], rtol=1e-8, atol=1e-9 * np.abs(before[0]).max())
            assert (hz <= before[1] * (1 + 1e-9)).all()
        before = (bottom, hz)


def example():
    """A superelement with amplitudes between a clamp and a body."""
    reduced = fx.models.nested(fx.reduce(alone(rpr(), "upr"), keep=1), {"b.bottom": "low", "a.top": "high"})
    return fx.Mechanism(
        substructures={"leg": reduced.substructure},
        instances={"leg": fx.describe.Instance(of="leg")},
        bodies={"hub": fx.describe.RigidBody(carries=("leg.high",), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))},
        ground={"leg.low": "clamped"},
    )


def test_amplitudes_are_degrees_of_freedom_with_names():
    mechanism = example()
    count = mechanism.substructures["leg"].superelements["reduced"].amplitudes
    model = fx.assemble(mechanism)
    assert model.order == 6 + count and count % 6
    assert model.dof_names[6:] == [f"leg.reduced amplitude {k + 1}" for k in range(count)]
    motions = model.rigid_body_motions()
    assert not motions[6:].any() and motions[:6].any()
    summary = fx.check(mechanism).substructures[0]
    assert (summary.nodes, summary.interior_dofs) == (2, count)
    low = fx.reduce(mechanism)
    assert low.order == 6 and all(name.startswith("hub.") for name in low.coordinate_names)
    every = fx.reduce(mechanism, keep=EVERY_MODE)
    np.testing.assert_allclose(hertz(every, 10), hertz(model, 10), rtol=1e-10)
    np.testing.assert_allclose(np.asarray(every.recovery @ np.eye(every.order)), every.recover(np.eye(every.order)))
    proven = fx.reduce(mechanism, tolerance=1e-4, up_to=hertz(model, 8)[-1] * 1.01)
    np.testing.assert_allclose(hertz(proven, 8), hertz(model, 8), rtol=1e-4)


def test_amplitudes_do_not_show_in_pictures():
    model = fx.assemble(example())
    vector = np.zeros((model.order, 1))
    vector[-3:] = 1e3
    still = solids(model, model.node_displacements(vector)[:, :, 0])
    assert still.largest_motion() == 0.0


def test_amplitudes_survive_the_model_file():
    mechanism = example()
    again = fx.loads(fx.dumps(mechanism))
    assert again == mechanism
    assert "amplitudes" in fx.schema()["$defs"]["Superelement"]["properties"]


def test_amplitudes_in_other_units_from_matrix_market_files(tmp_path):
    """Tonnes and millimetres: rotations carry lengths, amplitudes count as lengths."""
    mechanism = example()
    own = mechanism.substructures["leg"].superelements["reduced"]
    arms = np.append(np.tile([1.0] * 3 + [1e3] * 3, 2), np.ones(own.amplitudes))
    for name, matrix, unit in (("K", own.stiffness.array, 1e-3), ("M", own.mass.array, 1e-3)):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", unit * np.outer(arms, arms) * matrix)
    text = fx.dumps(mechanism.model_copy(update={"substructures": {}}))
    file = tmp_path / "leg.yaml"
    file.write_text(
        text
        + f"""
substructures:
  leg:
    nodes: {{low: [0, 0, 0], high: [0, 0, {float(mechanism.substructures["leg"].nodes["high"][2])!r} m]}}
    superelements:
      reduced:
        nodes: [low, high]
        amplitudes: {own.amplitudes}
        stiffness: {{file: K.mtx}}
        mass: {{file: M.mtx}}
        units: {{length: mm, mass: t, time: s}}
    interface: [low, high]
"""
    )
    read = fx.load(file).substructures["leg"].superelements["reduced"]
    np.testing.assert_allclose(read.stiffness.array, own.stiffness.array, rtol=1e-12)
    np.testing.assert_allclose(read.mass.array, own.mass.array, rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"amplitudes": 2}, "stiffness is 8 x 8: six DOFs for each of 1 nodes, and 2 amplitudes"),
        ({"amplitudes": 0}, "stiffness is 6 x 6"),
        ({"amplitudes": -1}, "at least 0 is expected"),
        ({"amplitudes": 1.0}, "a whole number is expected"),
        ({"stiffness": np.diag([1.0] * 6 + [0.0])}, "every amplitude of a superelement has stiffness"),
    ],
)
def test_impossible_superelements_are_refused(change, words):
    fields = {"nodes": ("a",), "amplitudes": 1, "stiffness": np.eye(7), "mass": np.eye(7)}
    with pytest.raises(fx.ModelError, match=words):
        fx.describe.Superelement(**(fields | change))


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (lambda low: fx.models.nested(low, ["nowhere"]), "no node"),
        (lambda low: fx.models.nested(low, []), "at least one node"),
        (lambda low: fx.models.nested(low, {"rpu1.b.top": "a", "platform": "a"}), "only once"),
        (lambda low: fx.models.nested(low, ["rpu1.a.bottom"]), "is held"),
        (lambda low: fx.models.nested(low, ["platform", "rpu1.b.top"]), "one rigid body"),
        (lambda low: fx.models.nested(low, ["platform"], keep=-1), "whole number"),
        (lambda low: fx.models.nested(fx.models.condense(low, 4), ["platform"]), "do not move these nodes"),
        (
            lambda low: fx.models.nested(fx.models.condense(low, ["platform"]), ["platform", "rpu1.c.half1.c1"]),
            "do not move these",
        ),
    ],
)
def test_impossible_nestings_are_refused(step, words):
    with pytest.raises(fx.OptionError, match=words):
        step(fx.reduce(rpr()))


def test_unknown_superelements_are_refused():
    branches = nested_branches(0)
    model = fx.assemble(platform_on(branches))
    vectors = np.zeros((model.order, 1))
    with pytest.raises(fx.OptionError, match="no superelement"):
        branches["upr"].recover(model, vectors, "upr1.nothing")
    with pytest.raises(fx.OptionError, match="coordinates"):
        nested_branches(1)["upr"].recover(model, vectors, "upr1.reduced")


def test_a_repeated_frequency_is_kept_whole():
    """A round link between two clamps has every bending mode twice."""
    mechanism = fx.Mechanism(
        nodes={"a": (0.0, 0.0, 0.0), "b": (0.1, 0.0, 0.0)},
        links={
            "wire": fx.describe.Link(
                nodes=("a", "b"), material="steel", section=fx.describe.Circle(diameter=1e-3), elements=8
            )
        },
        materials={"steel": fx.describe.Material(E=205e9, nu=0.3, rho=7850.0)},
        ground={"a": "clamped"},
    )
    for keep, kept in ((0, 0), (1, 2), (2, 2), (3, 4)):
        assert len(fx.reduce(mechanism, keep=keep).parts[""].frequencies) == kept


def test_modes_by_free_interface_reduction():
    mechanism = rpr()
    fixed, free = (fx.modes(mechanism, keep=1, reduction=method) for method in ("craig_bampton", "rubin"))
    np.testing.assert_allclose(free.frequency_hz, fx.modes(mechanism, order="full").frequency_hz, rtol=1e-5)
    assert free.order > fixed.order
    with pytest.raises(fx.OptionError, match="only n"):
        fx.modes(fx.reduce(mechanism), reduction="rubin")
