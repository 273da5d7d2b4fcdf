"""No stiffness jumps as a size changes: every switch of theory is swept, and what changes most is bisected."""

from functools import cache

import numpy as np
import pytest

import flexura as fx

MM = 1e-3
POINTS = 18
"""Sizes of a sweep."""

SUSPECTS = 2
"""Steps of a sweep that are bisected for each entry, those over which it changes most."""

CLOSE = 1e-6
"""Relative difference of sizes down to which steps are bisected."""

JUMP = 1e-3
"""Relative change over that from which a stiffness jumps: some power of a size changes it by a few times CLOSE."""


def stiffness(profile, length=10 * MM, ends=None, material=None, others=None, **more):
    """Diagonal stiffness (6,) of a flexure along x, held at its start, at its end: with tip forces and moments in turn.

    `others` are further members by name, given as (place of their far end in mm, profile), that meet it there.
    """
    others = others or {}
    nodes = {"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)} | {name: at for name, (at, _) in others.items()}
    own = {"material": "own", "elements": 3, **more}
    flexures = {"f": fx.describe.Flexure(nodes=("a", "b"), reference="z", profile=profile, ends=ends, **own)}
    for name, (_, other) in others.items():
        flexures[name] = fx.describe.Flexure(
            nodes=("b", name), reference="z", profile=other, material="own", elements=3
        )
    tip = next(iter(others)) if others else "b"
    mechanism = fx.Mechanism(
        materials={"own": fx.describe.Material(E=200e9, nu=0.3 if material is None else material, rho=7850.0)},
        nodes=nodes,
        flexures=flexures,
        ground={"a": "clamped"},
    )
    return 1 / np.diag(fx.compliance(mechanism, nodes=[tip]))


def largest_jump(function, sizes):
    """The largest relative change of any entry of `function` that bisection cannot make less than JUMP.

    Steps over which an entry changes most unlike its neighbours are halved where it changes more, until it changes
    little or the sizes are CLOSE.
    """
    log = cache(lambda size: np.log(function(size)))
    sizes = [float(size) for size in sizes]
    change = np.diff([log(size) for size in sizes], axis=0)
    unlike = np.abs(np.diff(change, axis=0, prepend=change[:1], append=change[-1:]))
    unlike = np.maximum(unlike[:-1], unlike[1:]) + 1e-3 * np.abs(change)
    worst = 0.0
    for entry in range(change.shape[1]):
        for k in np.argsort(unlike[:, entry])[-SUSPECTS:]:
            low, high = sizes[k], sizes[k + 1]
            while abs(log(high) - log(low))[entry] > JUMP and high - low > CLOSE * max(abs(low), abs(high)):
                middle = np.sqrt(low * high) if low > 0 else (low + high) / 2
                if abs(log(middle) - log(low))[entry] > abs(log(high) - log(middle))[entry]:
                    high = middle
                else:
                    low = middle
            worst = max(worst, abs(log(high) - log(low))[entry])
    return worst


def leaf(width, thickness):
    return fx.describe.Leaf(width=width * MM, thickness=thickness * MM)


def notch(contour, width=8.0):
    return fx.describe.Notch(width=width * MM, contour=contour)


def arc(radius=5.0, web=0.4):
    return fx.describe.CircularContour(radius=radius * MM, web=web * MM)


def turned(angle):
    """A member of the same leaf that goes on at an angle, rad."""
    return {"c": ((10 * MM * (1 + np.cos(angle)), 10 * MM * np.sin(angle), 0.0), leaf(5, 0.5))}


def inline(thickness):
    return {"c": ((20 * MM, 0.0, 0.0), leaf(5, thickness))}


def across(thickness):
    return {"c": ((10 * MM, 10 * MM, 0.0), leaf(5, thickness))}


BOTH, FIRST = ("clamped", "clamped"), ("clamped", "free")
GROWING = np.geomspace(0.1, 40, POINTS)

SWEEPS = {
    "length, square": (lambda s: stiffness(leaf(1, 1), s * MM, BOTH), GROWING),
    "length, b/t = 5": (lambda s: stiffness(leaf(5, 1), s * MM, BOTH), GROWING),
    "length, b/t = 15, one end": (lambda s: stiffness(leaf(15, 1), s * MM, FIRST), GROWING),
    "length, ends worked out": (lambda s: stiffness(leaf(5, 1), s * MM), GROWING),
    "width": (lambda s: stiffness(leaf(s, 1), ends=BOTH), GROWING),
    "width at one end": (lambda s: stiffness(fx.describe.Leaf(width=(5 * MM, s * MM), thickness=MM)), GROWING),
    "thickness": (lambda s: stiffness(leaf(3, s), ends=FIRST), GROWING),
    "Poisson's ratio": (lambda s: stiffness(leaf(5, 1), ends=BOTH, material=s), np.linspace(-0.4, 0.49, POINTS)),
    "arm": (lambda s: stiffness(leaf(5, 0.5), end_offset=(0, 0, s * MM)), np.geomspace(1e-3, 2, POINTS)),
    "bulk of a member in line": (lambda s: stiffness(leaf(5, 0.5), others=inline(s)), np.geomspace(0.1, 5, POINTS)),
    "bulk of a member across": (lambda s: stiffness(leaf(5, 0.5), others=across(s)), np.geomspace(0.1, 5, POINTS)),
    "angle": (lambda s: stiffness(leaf(5, 0.5), others=turned(s)), np.linspace(0, 1.7, POINTS)),
    "web": (lambda s: stiffness(notch(arc(web=s))), np.geomspace(0.1, 20, POINTS)),
    "web, tapered": (lambda s: stiffness(notch(arc(web=s)), integration="tapered"), np.geomspace(0.1, 20, POINTS)),
    "width of a notch": (lambda s: stiffness(notch(arc(), s)), GROWING),
    "width of a notch held at one end": (lambda s: stiffness(notch(arc(), s), ends=FIRST), GROWING),
    "radius": (lambda s: stiffness(notch(arc(s))), np.geomspace(5, 500, POINTS)),
    "fillet": (
        lambda s: stiffness(notch(fx.describe.CornerFilletedContour(fillet_radius=s * MM, web=0.5 * MM))),
        np.linspace(0, 5, POINTS),
    ),
    "depth of an ellipse": (
        lambda s: stiffness(notch(fx.describe.EllipticalContour(depth=s * MM, web=0.5 * MM))),
        np.linspace(0, 8, POINTS),
    ),
    "depth of a parabola": (
        lambda s: stiffness(notch(fx.describe.ParabolicContour(depth=s * MM, web=0.5 * MM))),
        np.linspace(0, 8, POINTS),
    ),
    "angle of a V": (
        lambda s: stiffness(notch(fx.describe.VShapedContour(angle=s, root_radius=1 * MM, web=0.5 * MM))),
        np.linspace(0.01, 1.4, POINTS),
    ),
    "shift of two notches": (
        lambda s: stiffness(fx.describe.TwoAxisNotch(y_contour=arc(9), z_contour=arc(9), shift=s * MM)),
        np.linspace(-8, 8, POINTS),
    ),
    "round": (lambda s: stiffness(fx.describe.RoundNotch(contour=arc(web=s))), np.geomspace(0.1, 20, POINTS)),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_no_stiffness_jumps(name):
    function, sizes = SWEEPS[name]
    assert largest_jump(function, sizes) <= JUMP


def test_a_jump_is_seen():
    """The search itself, on a step of 2 % within a change by orders of magnitude."""
    assert largest_jump(lambda s: np.array([s**3 * (1 + 0.02 * (s > 2.345))]), GROWING) > 0.01
