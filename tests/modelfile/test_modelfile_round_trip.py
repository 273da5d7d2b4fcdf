"""What is written reads back as the same description, whether it came from a file or from Python."""

from __future__ import annotations

import math
import os
from operator import neg
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexura.errors import ModelError, OptionError
from flexura.expressions import Expression, parameter
from flexura.expressions.tree import Call, Number
from flexura.mechanism import (
    Circle,
    CircularContour,
    CircularPattern,
    DiagonalStiffness,
    Flexure,
    Instance,
    Layer,
    Layered,
    Leaf,
    LinearPattern,
    Link,
    Load,
    Material,
    Mechanism,
    MirrorPattern,
    Notch,
    Parameter,
    PointMass,
    Rectangle,
    RigidBody,
    Rotation,
    SectionConstants,
    Spring,
    Substructure,
    Superelement,
    Support,
    Tube,
    parameter_values,
)
from flexura.mechanism.base import CONTROL
from flexura.modelfile import dumps, load, loads, save
from helpers.modelfile_samples import AMPLIFIER, BEAM

sizes = st.floats(1e-6, 10)
angles = st.floats(-10, 10).filter(lambda a: abs(a) > 1e-6)
texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=30).filter(
    lambda t: not CONTROL.search(t)
) | st.sampled_from(
    [
        "null",
        "1e3",
        "yes",
        "# no",
        ":",
        ":0",
        "a:",
        "?x",
        "- ",
        "[",
        "{a}",
        "%",
        "@a",
        "---",
        "...",
        "`",
        "a: b",
        "- x",
        "*",
        "two\nlines",
        "two\n\nparagraphs\n",
        "0x10",
        "\x85",
        "'",
        '"',
        " ",
    ]
)
LENGTHS = ("a", "b", "m", "null")


def combined(inner: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    """Positive lengths made of positive lengths, with literals as Python writes them: bare, in SI."""
    pure = st.floats(0.1, 10)
    return st.one_of(
        st.builds(lambda x, k: x * k, inner, pure),
        st.builds(lambda x, k: k * x, inner, pure),
        st.builds(lambda x, k: x / k, inner, pure),
        st.builds(lambda x, y: x + y, inner, inner),
        st.builds(lambda x, k: x + k, inner, sizes),
        st.builds(lambda x, k: k + x, inner, sizes),
        st.builds(lambda x, k: neg(-x) + k, inner, sizes),
        st.builds(lambda x, y, z: x * y / z, inner, inner, inner),
        st.builds(lambda x, y: x**2 / y, inner, inner),
        st.builds(lambda x, y: x**-1 * y**2, inner, inner),
        st.builds(lambda x, y: Expression(Call("max", (x.tree, y.tree))), inner, inner),
        st.builds(lambda x, y: Expression(Call("sqrt", ((x * y).tree,))), inner, inner),
        st.builds(lambda x, y, k: Expression(Call("abs", ((x - y).tree,))) + k, inner, inner, sizes),
        st.builds(lambda x, y: x * Expression(Call("cos", ((y / y * parameter("angle") * 0).tree,))), inner, inner),
        st.builds(lambda x, k: x * (1 + k * parameter("ratio")), inner, pure),
    )


expressions = st.recursive(st.sampled_from([parameter(name) for name in LENGTHS]), combined, max_leaves=6)
# what double precision can hold beside others
held = expressions.map(lambda x: Expression(Call("max", (Call("min", (x.tree, Number(1e6))), Number(1e-6)))))
lengths = sizes | held
small = expressions.map(lambda x: Expression(Call("min", (x.tree, Number(1.0)))) * 1e-3)

sections = st.one_of(
    st.builds(Rectangle, width=lengths, thickness=lengths),
    st.builds(Circle, diameter=lengths),
    st.builds(lambda d: Tube(outer_diameter=d, inner_diameter=d / 2), sizes),
    st.builds(SectionConstants, A=sizes, Iy=sizes, Iz=sizes, J=sizes, ky=st.just(1.0) | st.floats(0.1, 1)),
)
materials = st.one_of(
    st.just("silicon"),
    st.builds(Material, E=sizes.map(lambda x: x * 1e9), rho=sizes, nu=st.floats(-0.9, 0.5), source=texts),
    st.builds(Material, E=sizes, rho=sizes, G=sizes, loss_factor=st.none() | st.floats(0, 1), yield_stress=sizes),
)
directions = st.sampled_from([(0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (0.1, 0.7, 0.3)])
inertias = sizes.map(lambda i: (i, i, 1.5 * i)) | sizes.map(lambda i: (i, i, 1.5 * i, 0.0, 0.1 * i, -0.1 * i))
supports = st.sampled_from([Support(fixed=("tx",)), Support(free=("rx", "rz")), "clamped", Support(free=())])


@st.composite
def branches(draw) -> Substructure:
    """A chain of members along x, of which nothing collapses whatever the parameters."""
    count = draw(st.integers(2, 4))
    nodes = {f"n{i}": (float(i), draw(small), 0.0) for i in range(count)}
    links, flexures = {}, {}
    for i in range(count - 1):
        common = {
            "nodes": (f"n{i}", f"n{i + 1}"),
            "material": draw(st.sampled_from(["own", "Al-7075-T6"])),
            "reference": (0.0, 0.0, 1.0),
            "start_offset": (0.0, 0.0, draw(st.sampled_from([0.0, 1e-3]))),
            "corrections": draw(st.sampled_from([None, "auto", "none", ("shear",)])),
            "ends": draw(st.sampled_from([None, ("clamped", "free")])),
        }
        if draw(st.booleans()):
            links[f"l{i}"] = Link(
                section=draw(sections | st.just("shared")), elements=draw(st.integers(1, 9)), **common
            )
        else:
            contour = CircularContour(radius=draw(st.floats(1, 9)), web=draw(lengths))
            profile = draw(
                st.sampled_from(
                    [
                        Leaf(width=draw(lengths), thickness=draw(lengths)),
                        Leaf(width=(draw(lengths), draw(lengths)), thickness=draw(lengths)),
                        Layered(width=draw(lengths), layers=(Layer(thickness=draw(lengths), free_strain=draw(small)),)),
                        Notch(width=1.0, contour=contour),
                    ]
                )
            )
            flexures[f"f{i}"] = Flexure(
                profile=profile, integration=draw(st.sampled_from([None, "stepped", "tapered"])), **common
            )
    springs = {"k": Spring(nodes=("n0",), stiffness=DiagonalStiffness(tx=draw(sizes), rz=draw(sizes)))}
    matrix = Superelement(nodes=("n0",), stiffness=np.diag([draw(sizes)] * 6), mass=np.eye(6))
    return Substructure(
        nodes=nodes,
        links=links,
        flexures=flexures,
        springs=springs,
        superelements={"s": matrix},
        interface=("n0", f"n{count - 1}"),
    )


patterns = st.sampled_from(
    [
        (),
        (CircularPattern(count=3),),
        (MirrorPattern(normal=(1.0, 0.0, 0.0)), LinearPattern(count=2, step=(0.0, parameter("a"), 0.0))),
    ]
)


forces = st.tuples(*3 * [st.sampled_from([0.0, -1.5])])
loads_of_a_node = (
    st.builds(Load, force=forces) | st.builds(Load, moment=forces) | st.builds(Load, force=forces, moment=forces)
)


@st.composite
def mechanisms(draw) -> Mechanism:
    """Mechanisms as Python builds them: SI numbers without units, expressions with bare literals."""
    parameters = {name: Parameter(value=draw(sizes), source=draw(texts)) for name in LENGTHS}
    parameters["a"] = Parameter(value=1.0, minimum=draw(st.none() | st.floats(0, 1)), maximum=parameter("a") * 2)
    parameters["angle"] = Parameter(value=draw(angles))
    parameters["ratio"] = Parameter(value=draw(st.floats(0, 10)), unit="1")
    parameters["derived"] = Parameter(value=draw(held))
    used = {f"p{i}": (parameter(name), 0.0, 0.0) for i, name in enumerate(parameters) if name not in ("angle", "ratio")}
    pattern = draw(patterns)
    rotate = draw(st.sampled_from([(), (Rotation(axis=(0.0, 0.0, 1.0), angle=parameter("angle")),)]))
    tie = {"carries": ("arm*.n*", "p*"), "mass": draw(sizes), "inertia": draw(inertias)}
    return Mechanism(
        name=draw(texts),
        loads=draw(st.dictionaries(st.just("stage"), loads_of_a_node)),
        description=draw(texts),
        theory=draw(st.sampled_from(["rayleigh", "timoshenko"])),
        corrections=draw(st.sampled_from(["auto", "none", ("plate", "notch")])),
        parameters=parameters,
        materials={"own": draw(materials)},
        sections={"shared": draw(sections)},
        substructures={"branch": draw(branches())},
        nodes=used,
        instances={"arm": Instance(of="branch", at=(draw(lengths), 0.0, 0.0), rotate=rotate, pattern=pattern)},
        bodies={"stage": RigidBody(centre=(0.0, 0.0, draw(lengths)), **tie)},
        masses={"tip": PointMass(node="p0", mass=draw(sizes), offset=(draw(lengths) * parameter("ratio"), 0.0, 0.0))},
        ground={"p*": draw(supports)},
    )


@settings(max_examples=60, deadline=None)
@given(mechanisms())
def test_what_python_builds_reads_back_equal(mechanism):
    text = dumps(mechanism)
    read = loads(text)
    assert read == mechanism, text
    assert dumps(read) == text
    dimensions = {name: p.unit for name, p in read.parameters.items()}
    assert [dimensions[name] for name in (*LENGTHS, "angle", "ratio", "derived")] == [*"mmmm", "1", "1", "m"]


def test_text_of_any_characters_survives():
    """Every pair of characters that mean something to YAML, in the middle of a block and of a flow mapping."""
    awkward = "a: #-?,[]{}&*!|>'\"%@`\\\n\t~=.0\x85\u2028\ufeff<"
    texts = [*awkward, *(a + b for a in awkward for b in awkward)]
    sources = {f"p{i}": Parameter(value=1.0, unit="1", source=text) for i, text in enumerate(texts)}
    mechanism = loads(BEAM).model_copy(update={"parameters": {"t": Parameter(value=1e-3), **sources}})
    assert loads(dumps(mechanism)) == mechanism
    for text in texts[: len(awkward)]:
        described = mechanism.model_copy(update={"parameters": {"t": Parameter(value=1e-3)}, "description": text})
        assert loads(dumps(described)).description == text


@pytest.mark.parametrize("text", [AMPLIFIER, BEAM], ids=["amplifier", "beam"])
def test_what_is_read_from_a_file_is_written_the_same(text):
    mechanism = loads(text)
    written = dumps(mechanism)
    again = loads(written)
    assert again == mechanism
    assert {n: p.unit for n, p in again.parameters.items()} == {n: p.unit for n, p in mechanism.parameters.items()}
    assert dumps(again) == written


def test_the_text_is_the_one_a_person_would_write():
    assert (
        dumps(loads(AMPLIFIER))
        == """\
flexura: 1
name: amplifier
description: A bridge amplifier with a stage, in three branches.
theory: timoshenko
parameters:
  t: 0.3 mm
  m: {value: 20 g, minimum: 10 g, maximum: 50 g, source: measured}
  L: {value: 10 mm, minimum: 5 mm}
  half: L / 2
  phi: 0.5235987755982988
materials:
  al: Al-7075-T6
  mine: {E: 70 GPa, rho: '2700 [kg/m^3]', nu: 0.33, loss_factor: 0.001}
sections:
  bar: {shape: rectangle, width: 10 mm, thickness: 5 mm}
substructures:
  amp:
    nodes:
      a: [0, 0, 0]
      b: [L, 0, 0]
      c: [2 * L + 1 mm, 0, 0]
    links:
      bar: {nodes: [b, c], material: mine, reference: -z, section: bar, elements: 2}
    flexures:
      leaf:
        nodes: [a, b]
        material: al
        reference: z
        profile: {type: notch, width: 10 mm, contour: {shape: circular, radius: half, web: t}}
    interface: [a, c]
springs:
  soft: {nodes: [stage], stiffness: {tx: 2 N/um, rz: '3 [N*m/rad]'}}
bodies:
  stage:
    centre: [0, 0, 10 mm]
    carries: [amp*.c]
    mass: 0.5 kg
    inertia: [100 kg*mm^2, 100 kg*mm^2, 150 kg*mm^2]
masses:
  tip: {node: stage, mass: m}
instances:
  amp: {of: amp, rotate: {axis: z, angle: 90 deg}, pattern: {type: circular, count: 3}}
ground:
  amp*.a: clamped
"""
    )


def test_bare_literals_of_python_take_the_dimension_of_their_place():
    t, k = parameter("t"), parameter("k")
    text = dumps(
        Mechanism(
            parameters={"t": Parameter(value=1e-3), "k": Parameter(value=2.0, unit="1"), "rest": Parameter(value=3.0)},
            nodes={"a": (0, 0, 0), "b": (t * 2 + 0.1, 0.001 * k, (t + 1e-3) ** 2 / 0.5)},
            links={"l": Link(nodes=("a", "b"), material="silicon", section=Circle(diameter=t))},
        )
    )
    assert "t: 1 mm" in text
    assert "rest: 3\n" in text
    assert "b: [t * 2 + 0.1 m, 1 mm * k, (t + 1 mm) ^ 2 / 0.5 m]" in text


def test_a_parameter_whose_unit_cannot_be_told_is_asked_for():
    area = parameter("w") * parameter("h")
    section = SectionConstants(A=area, Iy=1e-12, Iz=1e-12, J=1e-12)
    open_ = {"w": Parameter(value=1e-3), "h": Parameter(value=2e-3)}

    def mechanism(parameters):
        link = Link(nodes=("a", "b"), material="silicon", section=section, reference="z")
        return Mechanism(parameters=parameters, nodes={"a": (0, 0, 0), "b": (1, 0, 0)}, links={"l": link})

    with pytest.raises(ModelError, match="neither given nor follows") as caught:
        dumps(mechanism(open_))
    assert [p.place for p in caught.value.problems] == ["parameters.w.unit", "parameters.h.unit"]
    told = mechanism({**open_, "w": Parameter(value=1e-3, unit="m")})
    assert "h: 2 mm" in dumps(told)
    assert loads(dumps(told)) == told


def test_squares_of_lengths_and_areas_stay_apart():
    text = BEAM.replace("{t: 1 mm}", "{t: 1 mm, a: t*t + 9 mm^2, b: t*t + (9 mm)^2}")
    for mechanism in (loads(text), loads(dumps(loads(text)))):
        values = parameter_values(mechanism)
        assert (values["a"], values["b"]) == (pytest.approx(10e-6), pytest.approx(82e-6))


def test_saved_files_are_complete_or_not_there(tmp_path, monkeypatch):
    mechanism = loads(BEAM)
    file = tmp_path / "m.yaml"
    save(mechanism, file)
    assert load(file) == mechanism

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OptionError, match="No space left"):
        save(loads(AMPLIFIER), file)
    assert load(file) == mechanism
    assert [p.name for p in tmp_path.iterdir()] == ["m.yaml"]


def test_saving_where_one_cannot(tmp_path: Path):
    with pytest.raises(OptionError, match="cannot be written"):
        save(loads(BEAM), tmp_path / "nowhere" / "m.yaml")
    with pytest.raises(OptionError, match="cannot be written"):
        save(loads(BEAM), tmp_path)


def test_angles_survive_to_the_last_bit():
    for degrees in range(-360, 361, 7):
        for angle in (math.radians(degrees), degrees / 180 * math.pi):
            rotate = Rotation(axis="z", angle=angle)
            base = loads(BEAM)
            instance = Instance(of="s", rotate=(rotate,))
            body = RigidBody(mass=1, inertia=(1, 1, 1), carries=("i.x", "a"))
            mechanism = base.model_copy(
                update={
                    "substructures": {"s": Substructure(nodes={"x": (0, 0, 0)}, interface=("x",))},
                    "instances": {"i": instance},
                    "bodies": {"hub": body},
                }
            )
            assert loads(dumps(mechanism)).instances["i"].rotate[0].angle == angle
        if degrees > 0:
            break
