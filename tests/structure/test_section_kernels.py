"""Sections along members by kernels and in NumPy: every contour, alone and beside others, of one design and of many."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.expressions import parameter
from flexura.mechanism import (
    Circle,
    CircularContour,
    CornerFilletedContour,
    EllipticalContour,
    HyperbolicContour,
    Leaf,
    Notch,
    ParabolicContour,
    Parameter,
    Rectangle,
    RoundNotch,
    SectionConstants,
    StraightContour,
    TabulatedContour,
    Tube,
    TwoAxisNotch,
    VShapedContour,
)
from flexura.structure import Design
from helpers.kernels import both, compiled
from helpers.mechanism_samples import flexure, link, mechanism

pytestmark = compiled

t = parameter("t")
CONTOURS = [
    CircularContour(radius=0.05 + t, web=t),
    CircularContour(radius=0.2, web=t),
    EllipticalContour(depth=2 * t, web=1e-3),
    EllipticalContour(depth=0.0, web=t),
    ParabolicContour(depth=2 * t, web=1e-3),
    HyperbolicContour(depth=2 * t, web=1e-3),
    CornerFilletedContour(fillet_radius=5 * t, web=t),
    CornerFilletedContour(fillet_radius=0.0, web=t),
    VShapedContour(angle=100 * t, root_radius=3 * t, web=t),
    VShapedContour(angle=0.3, root_radius=0.0, web=t),
    StraightContour(web=t),
    TabulatedContour(positions=(0.0, 0.03, 0.1), thicknesses=(3e-3, t, 3e-3)),
]
SECTIONS = [
    Rectangle(width=3e-3, thickness=t),
    Circle(diameter=t),
    Tube(outer_diameter=5e-3, inner_diameter=t),
    SectionConstants(A=1e-6, Iy=1e-13, Iz=2e-13, J=t * 1e-10),
]
LEAVES = [Leaf(width=8e-3, thickness=t), Leaf(width=(8e-3, 6e-3), thickness=t)]


def profiles(contour):
    yield Notch(width=8e-3, contour=contour)
    yield RoundNotch(contour=contour)
    for other in (StraightContour(web=t), EllipticalContour(depth=t, web=t)):
        for shift in (0.0, 0.02, -20 * t) if not isinstance(contour, TabulatedContour) else (0.0,):
            yield TwoAxisNotch(y_contour=contour, z_contour=other, shift=shift)
            yield TwoAxisNotch(y_contour=other, z_contour=contour, shift=shift)


def sections(plan, values):
    _, _, nu, _ = plan.members.moduli(values)
    return np.array(plan.members.section_properties(values, nu, plan.geometry(values).lengths))


def same(described):
    plan = fx.Plan(described)
    stack = Design.of(plan, {"t": np.linspace(9e-4, 1.1e-3, 6)}).values
    kernel, numpy = both(lambda: sections(plan, stack))
    assert kernel.shape == numpy.shape and np.ptp(kernel, axis=1).any()
    np.testing.assert_allclose(kernel, numpy, rtol=1e-13)
    for own, values in zip(np.moveaxis(kernel, 1, 0), stack, strict=True):
        assert np.array_equal(own, sections(plan, values))
    return plan


@pytest.mark.parametrize("contour", CONTOURS, ids=lambda contour: contour.shape)
def test_contours(contour):
    flexures = {f"f{k}": flexure(profile, elements=5 + k % 3) for k, profile in enumerate(profiles(contour))}
    same(mechanism(parameters={"t": Parameter(value=1e-3)}, links={}, flexures=flexures))


def test_all_families_beside_each_other():
    links = {f"l{k}": link(section=section, reference=(0, 0, 1), elements=2) for k, section in enumerate(SECTIONS)}
    shapes = [*LEAVES, *(profile for contour in CONTOURS[::2] for profile in list(profiles(contour))[:3])]
    flexures = {f"f{k}": flexure(profile, elements=3) for k, profile in enumerate(shapes)}
    plan = same(mechanism(parameters={"t": Parameter(value=1e-3)}, links=links, flexures=flexures))
    assert len({group.family for group, _, _ in plan.members.groups}) == 4
