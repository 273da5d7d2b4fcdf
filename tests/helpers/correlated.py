"""Mechanisms and tests of them for the correlation."""

import numpy as np

import flexura as fx
from flexura.linalg import lowest
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.measurement import IdentifiedModes, ModeEvidence

X, Y, Z = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
EXAMPLES = "examples"


def floating():
    """A bar from a box to a cylinder, nothing held, the box turned and everything placed at an angle, and its mirror
    image beside it."""
    half = fx.describe.Substructure(
        nodes={"a": (0, 0, 0), "b": (0.03, 0.01, 0)},
        links={
            "bar": fx.describe.Link(
                nodes=("a", "b"), material="Al-7075-T6", section=fx.describe.Circle(diameter=3e-3), elements=2
            )
        },
        bodies={
            "box": fx.describe.RigidBody(
                centre=(-0.01, 0, 0),
                solid=fx.describe.Box(size=(0.02, 0.03, 0.01), material="Al-7075-T6"),
                rotate=fx.describe.Rotation(axis=(0, 0, 1), angle=0.5),
                carries=("a",),
            ),
            "drum": fx.describe.RigidBody(
                centre=(0.04, 0.01, 0),
                solid=fx.describe.Cylinder(diameter=0.02, length=0.01, axis=(1, 0, 0), material="Al-7075-T6"),
                carries=("b",),
            ),
        },
        interface=("a",),
    )
    turn = fx.describe.Rotation(axis=(1, 2, 3), angle=0.7)
    return fx.Mechanism(
        name="floating",
        links={
            "bridge": fx.describe.Link(
                nodes=("half1.a", "half2.a"),
                material="Al-7075-T6",
                section=fx.describe.Circle(diameter=3e-3),
                elements=1,
            )
        },
        substructures={"half": half},
        instances={
            "half": fx.describe.Instance(
                of="half", rotate=turn, at=(0.1, 0, 0), pattern=fx.describe.MirrorPattern(normal=(1, 0, 0))
            )
        },
    )


def cantilever(diameter=3e-3, elements=10, count=5, mass=0.005, sensors=None, section=None):
    """A bar along x with a mass at its end, round by default: every bending frequency is then repeated."""
    nodes = {f"n{k}": (0.02 * k, 0.0, 0.0) for k in range(count + 1)}
    links = {
        f"bar{k}": fx.describe.Link(
            nodes=(f"n{k}", f"n{k + 1}"),
            material="Al-7075-T6",
            section=section or fx.describe.Circle(diameter=diameter),
            reference=(0, 0, 1),
            elements=elements // count,
        )
        for k in range(count)
    }
    return fx.Mechanism(
        name="cantilever",
        nodes=nodes,
        links=links,
        masses={"end": fx.describe.PointMass(node=f"n{count}", mass=mass)},
        ground={"n0": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
        sensors=sensors or {},
    )


def channel(name, direction, position=None, node=None, quantity="acceleration"):
    """A measured channel."""
    return MeasuredChannel(name, quantity, node, direction, None if position is None else tuple(position))


def grid(count=5):
    """Channels along y and z at the nodes of the cantilever."""
    return tuple(
        channel(f"{axis}{k}", d, (0.02 * k, 0.0, 0.0)) for k in range(1, count + 1) for axis, d in (("y", Y), ("z", Z))
    )


def identified(hz, shapes, channels, ratio=0.01, inputs=(), participation=None):
    """Modes as a test gives them, with the stated frequencies, Hz, and shapes (p, n)."""
    hz, shapes = np.asarray(hz, dtype=float), np.asarray(shapes)
    poles = 2 * np.pi * hz * (-ratio + 1j * np.sqrt(1 - ratio**2))
    if participation is None:
        participation = np.ones((len(inputs), len(hz)), dtype=complex)
    evidence = tuple(ModeEvidence(1.0, 0.0, 0.0, 1.0, 0.0) for _ in hz)
    return IdentifiedModes(
        name="test",
        poles=poles,
        shapes=shapes.astype(complex),
        real_shapes=shapes.real,
        participation=participation,
        inputs=tuple(inputs),
        outputs=tuple(channels),
        evidence=evidence,
        diagram=(),
        synthesis_error=0.0,
    )


def modes_of(mechanism, n, parameters=None):
    """Model, frequencies, Hz, and full-order vectors."""
    full = fx.assemble(mechanism, parameters)
    pairs = lowest(full.K, full.M, n)
    return full, np.sqrt(pairs.values) / (2 * np.pi), pairs.vectors
