"""Frames that several tests share."""

from __future__ import annotations

import flexura as fx


def frame() -> fx.Mechanism:
    """A spatial frame with a closed loop, members off their nodes, and a rigid body on two arms."""
    bar = fx.describe.Rectangle(width=0.02, thickness=0.01)
    corners = {"a": (0, 0, 0), "b": (0.3, 0, 0.1), "c": (0.3, 0.25, 0.2), "d": (0, 0.2, 0.3), "e": (0.1, 0.1, 0.5)}

    def link(i: str, j: str, **more: object) -> fx.describe.Link:
        return fx.describe.Link(
            nodes=(i, j), material="Al-6061-T6", section=bar, reference=(0.2, -0.5, 1.0), elements=4, **more
        )

    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes=corners,
        links={
            "ab": link("a", "b", end_offset=(0.0, 0.01, 0.02)),
            "bc": link("b", "c", start_offset=(0.0, 0.0, 0.015), end_offset=(-0.01, 0.0, 0.0)),
            "cd": link("c", "d"),
            "da": link("d", "a", start_offset=(0.0, 0.0, -0.01)),
            "ce": link("c", "e"),
        },
        bodies={
            "block": fx.describe.RigidBody(
                centre=(0.1, 0.1, 0.56), mass=0.4, inertia=(3e-4, 2e-4, 4e-4), carries=("e",)
            )
        },
        ground={"a": fx.describe.Support(fixed=fx.describe.DOF_NAMES), "d": fx.describe.Support(free=("rx", "rz"))},
    )


def cantilever() -> fx.Mechanism:
    """A beam that lies skew in space, its section turned about its axis."""
    bar = fx.describe.Rectangle(width=0.012, thickness=0.005)
    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes={"a": (0, 0, 0), "b": (0.2, 0.1, 0.05)},
        links={
            "bar": fx.describe.Link(
                nodes=("a", "b"), material="Al-6061-T6", section=bar, reference=(0.2, -0.4, 1), elements=10
            )
        },
        ground={"a": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    )


def mirrored_frame(steel: fx.describe.Material) -> fx.Mechanism:
    """A bent bar with offsets, placed as it is and mirrored, both carrying a body."""
    bar = {"material": "steel", "section": fx.describe.Rectangle(width=6e-3, thickness=4e-3)}
    leg = fx.describe.Substructure(
        nodes={"foot": (0.03, 0, 0), "knee": (0.05, 0.01, 0.04), "top": (0.02, 0.02, 0.07)},
        links={
            "shin": fx.describe.Link(
                nodes=("foot", "knee"), reference=(1, 0, 0), elements=2, end_offset=(0, 2e-3, 1e-3), **bar
            ),
            "thigh": fx.describe.Link(
                nodes=("knee", "top"), reference=(0, 1, 0), elements=1, start_offset=(1e-3, 0, 0), **bar
            ),
        },
        interface=("foot", "top"),
    )
    return fx.Mechanism(
        materials={"steel": steel},
        theory="timoshenko",
        corrections="none",
        substructures={"leg": leg},
        instances={"leg": fx.describe.Instance(of="leg", pattern=fx.describe.MirrorPattern(normal=(1, 0, 0)))},
        bodies={
            "seat": fx.describe.RigidBody(
                centre=(0, 0, 0.08), carries=("leg*.top",), mass=1.0, inertia=(1e-3, 1e-3, 1e-3)
            )
        },
        ground={"leg*.foot": "clamped"},
    )
