"""Corrections of short wide leaves and steep notches, against elasticity computed with finite elements.

Solid leaf with a block: quadratic tetrahedra, 192 000 DOFs. Right-circular notches, first four: plane-stress nine-node
quadrilaterals. All other elements: scikit-fem 12.0.2, nine-node quadrilaterals in plane stress (24 elements over half
the height, 170 along half the length) and 27-node hexahedra (an eighth, graded), with the share of the straight ends as
beams taken off. Units such that E = 1, nu = 0.3 in three dimensions.

Tolerances: 3 % for the modes; 2 % for rotations of notches and bending of leaves, whose strip theory with one shape
across the width is an upper bound of stiffness; 8 % for the stretch of notches; for contours on all faces, where the
rule is empirical, 6 and 4 %; for torsion of wide notches, which warp what they sit on, 13 %.

The closed forms of Paros and Weisbord, Machine Design 37 (1965) 151-156, Wu and Zhou, Rev. Sci. Instrum. 73 (2002)
3101-3106, and Lobontiu, Paine, Garcia and Goldfarb, J. Mech. Des. 123 (2001) 346-352, are integrals of beam theory; the
beam integrals here and tapered elements without corrections agree with them.
"""

import numpy as np
import pytest

import flexura as fx
from flexura.beam import notch
from flexura.mechanism import with_rigid_bodies
from helpers.verification_report import Case

SOLID = "quadratic tetrahedra, 192 000 DOFs"
PLANE = "nine-node quadrilaterals, plane stress, between long straight ends whose share as beams is taken off"
HEXAHEDRA = "27-node hexahedra, an eighth of the part"
UNIT = {"unit": fx.describe.Material(E=1.0, nu=0.3, rho=1.0)}

BLOCK_HZ = [127.1, 607.0, 1399, 3696]
CIRCULAR = {(4.0, 0.3): (585.0, 10.50), (5.0, 1.0): (33.18, 5.97), (3.0, 0.5): (144.4, 6.66), (2.0, 1.0): (22.00, 3.32)}
"""(R, t): rotation per moment, stretch per force."""

OTHERS = {  # length, contour: rotation per moment, stretch per force
    "elliptical a 5, b 4.75, t 0.5": (10.0, fx.describe.EllipticalContour(depth=4.75, web=0.5), 187.724, 9.0657),
    "elliptical a 6, b 2, t 0.5": (12.0, fx.describe.EllipticalContour(depth=2.0, web=0.5), 332.413, 13.2455),
    "elliptical a 2, b 4, t 0.5": (4.0, fx.describe.EllipticalContour(depth=4.0, web=0.5), 91.951, 5.0256),
    "parabolic a 5, b 4, t 0.5": (10.0, fx.describe.ParabolicContour(depth=4.0, web=0.5), 149.355, 7.7171),
    "parabolic a 5, b 1, t 0.5": (10.0, fx.describe.ParabolicContour(depth=1.0, web=0.5), 284.645, 11.2976),
    "V 45 deg, r 1, t 0.5": (
        8.0,
        fx.describe.VShapedContour(angle=np.pi / 4, root_radius=1.0, web=0.5),
        90.585,
        5.4345,
    ),
    "V 30 deg, r 0.2, t 0.5": (
        8.0,
        fx.describe.VShapedContour(angle=np.pi / 6, root_radius=0.2, web=0.5),
        64.477,
        5.0280,
    ),
    "corner-filleted a 5, r 1, t 1": (
        10.0,
        fx.describe.CornerFilletedContour(fillet_radius=1.0, web=1.0),
        112.060,
        10.0278,
    ),
    "corner-filleted a 5, r 3, t 0.5": (
        10.0,
        fx.describe.CornerFilletedContour(fillet_radius=3.0, web=0.5),
        528.126,
        14.6783,
    ),
    "corner-filleted a 3, r 0.5, t 1": (
        6.0,
        fx.describe.CornerFilletedContour(fillet_radius=0.5, web=1.0),
        71.156,
        6.1483,
    ),
}

LEAVES = {  # L/b, t/b: compliance times EI under a constant moment, between parallel ends without shear; GJ/L stiffness
    (0.5, 0.03): (0.9247, 0.9146, 4.016),
    (1.0, 0.03): (0.9404, 0.9227, 1.887),
    (2.0, 0.03): (0.9645, 0.9367, 1.321),
    (5.0, 0.03): (0.9856, 0.9635, 1.108),
    (1.0, 0.1): (0.9441, 0.9231, 1.844),
    (2.0, 0.1): (0.9676, 0.9398, 1.310),
    (3.0, 0.3): (0.9832, 0.9591, 1.135),
    (5.0, 1.0): (0.9909, 0.9735, 1.007),
}

TAPERED = {  # width, thickness, length: stretch, twist, turn about y, shift along z, turn about z, shift along y
    ((10.0, 10.0), (0.6, 0.3), 25.0): (0.1750705, 4.786227e-3, 2.483797e-3, 5.734425e-5, 1.450514, 0.01894784),
    ((12.0, 6.0), (0.3, 0.6), 30.0): (0.1300585, 3.583635e-3, 1.988165e-3, 2.806460e-5, 0.7696880, 8.668448e-3),
    ((20.0, 8.0), (0.4, 0.4), 40.0): (0.1303043, 3.096749e-3, 1.780574e-3, 1.388574e-5, 1.490575, 0.01135236),
    ((4.0, 2.0), (2.0, 1.0), 15.0): (0.268165, 0.042261, 0.038403, 2.733e-3, 0.152592, 9.949e-3),
}
"""Stiffness of leaves that taper between rigid faces: the face turned by moments alone, or shifted without turning.

NGSolve 6.2.2608, hexahedra of order 4 graded to all edges, 12 x 8 x 1 of them, 24 255 DOFs (the last one 10 x 4 x 4 and
35 547), within 1e-4 of order 3 but for the shift along z, 3e-4.
"""

WIDE = {  # R, t, b: rotation per moment (plane stress with the same mesh over it), twist per torque
    (4.0, 0.3, 10.0): (52.3391 * 584.493 / 568.432, 2.6169),
    (4.0, 0.3, 3.0): (179.456 * 584.493 / 568.432, 57.801),
    (4.0, 0.3, 1.0): (562.540 * 584.493 / 568.432, 441.30),
    (5.0, 1.0, 10.0): (3.06540 * 33.169 / 32.755, 0.56435),
    (2.0, 1.0, 4.0): (5.24286 * 22.001 / 21.888, 2.0882),
}

TWO_AXES = {  # kind, a, b, t: rotation per moment, stretch per force
    ("two-axis", 4.0, 3.0, 0.5): (225.363, 7.8744),
    ("two-axis", 2.0, 3.0, 0.5): (124.335, 4.7414),
    ("two-axis", 3.0, 1.5, 1.0): (21.6809, 2.8473),
    ("round", 4.0, 3.0, 0.5): (381.179, 9.8636),
    ("round", 2.0, 3.0, 0.5): (206.497, 5.7807),
    ("round", 3.0, 1.5, 1.0): (36.4775, 3.5581),
}


def flexure(profile, length, corrections="auto", **shape):
    """Describe a flexure along x between clamped ends, `a` held and `b` loaded."""
    ends = ("clamped", "clamped")
    member = fx.describe.Flexure(
        nodes=("a", "b"), material="unit", reference="z", profile=profile, ends=ends, root="rigid", **shape
    )
    nodes = {"a": (0, 0, 0), "b": (length, 0, 0)}
    return fx.Mechanism(
        nodes=nodes, materials=UNIT, flexures={"hinge": member}, ground={"a": "clamped"}, corrections=corrections
    )


def compliance(mechanism):
    """Return the 6 x 6 compliance of node b."""
    return np.linalg.inv(fx.reduce(mechanism).K)


def test_leaf_that_carries_a_block(verify):
    case = Case(
        "Short wide leaf with a block",
        SOLID,
        "Rayleigh with corrections: plate, warping, shear, root at the block",
        "A clamped leaf of 10 x 10 x 0.3 mm carries a block of 10 x 10 x 8 mm, Al-7075; plain beams miss up to 27 %.",
    )
    leaf = fx.describe.Leaf(width=10e-3, thickness=0.3e-3)
    mechanism = fx.Mechanism(
        materials={"metal": fx.describe.Material(E=71.7e9, nu=0.33, rho=2810.0)},
        nodes={"foot": (0, 0, 0), "head": (10e-3, 0, 0)},
        flexures={
            "leaf": fx.describe.Flexure(
                nodes=("foot", "head"), material="metal", reference="z", profile=leaf, root=("rigid", "elastic")
            )
        },
        bodies={
            "block": fx.describe.RigidBody(
                centre=(15e-3, 0, 0),
                solid=fx.describe.Box(size=(10e-3, 10e-3, 8e-3), material="metal"),
                carries=("head",),
            )
        },
        ground={"foot": "clamped"},
    )
    for order in ("full", "low"):
        hz = fx.modes(mechanism, n=4, order=order).frequency_hz
        verify(case, f"{order} order, mode", hz, BLOCK_HZ, 0.03)
    rigid = with_rigid_bodies(mechanism.model_copy(update={"corrections": "none"}))
    plain = fx.modes(rigid, n=4, order="full").frequency_hz
    np.testing.assert_allclose(plain, [122.4, 441.3, 1354, 4032], rtol=5e-4)


@pytest.mark.parametrize(("R", "t"), CIRCULAR)
def test_right_circular_notch(verify, R, t):
    """A narrow notch, in plane stress, ten stepped elements."""
    case = Case(
        "Right-circular notch, corrected",
        PLANE,
        "Rayleigh with corrections, ten stepped elements; E = b = 1",
        "The beam integral misses up to 15 % of the rotation and 22 % of the stretch.",
    )
    width = 1e-3
    narrow = fx.describe.Notch(width=width, contour=fx.describe.CircularContour(radius=R, web=t))
    for name, at, reference, tolerance in zip(
        ("rotation per moment", "stretch per force"), (4, 0), CIRCULAR[R, t], (0.02, 0.01), strict=True
    ):
        computed = compliance(flexure(narrow, 2 * R))[at, at] * width
        verify(case, f"R {R:g}, t {t:g}: {name}", computed, reference, tolerance, "-")


@pytest.mark.parametrize("shape", [{"elements": 1}, {"elements": 7}, {"elements": 200}, {"integration": "tapered"}])
def test_elements_do_not_matter(shape):
    """What the ten stepped elements of plain beams miss is not in the corrected ones."""
    notch = fx.describe.Notch(width=1e-3, contour=fx.describe.CircularContour(radius=4.0, web=0.3))
    few, other = (np.diagonal(compliance(flexure(notch, 8.0, **more)))[[0, 4]] for more in ({}, shape))
    np.testing.assert_allclose(other, few, rtol=1e-3)


@pytest.mark.parametrize("name", OTHERS)
def test_other_contours(verify, name):
    case = Case(
        "Notches of other contours, corrected", PLANE, "Rayleigh with corrections, ten stepped elements; E = b = 1"
    )
    length, shape, rotation, stretch = OTHERS[name]
    width = 1e-3
    C = compliance(flexure(fx.describe.Notch(width=width, contour=shape), length))
    verify(case, f"{name}: rotation per moment", C[4, 4] * width, rotation, 0.02, "-")
    verify(case, f"{name}: stretch per force", C[0, 0] * width, stretch, 0.07, "-")


@pytest.mark.parametrize(("width", "thickness", "length"), TAPERED)
def test_leaf_that_tapers(verify, width, thickness, length):
    """Between parallel ends the wide way faces hold the ends of stubby members in shear, too, which no beam knows."""
    case = Case(
        "Leaf that tapers, corrected",
        "NGSolve, hexahedra of order 4, 24 255 and 35 547 DOFs",
        "Rayleigh with corrections, ten tapered elements; E = 1",
        "Between rigid faces.",
    )
    C = compliance(flexure(fx.describe.Leaf(width=width, thickness=thickness), length))
    K = np.linalg.inv(C)
    found = (*1 / C.diagonal()[[0, 3, 4]], K[2, 2], 1 / C[5, 5], K[1, 1])
    names = ("stretch", "twist", "turn about y", "shift along z", "turn about z", "shift along y")
    for name, computed, reference in zip(names, found, TAPERED[width, thickness, length], strict=True):
        tolerance = 0.03 if name == "shift along y" else 0.015
        sizes = f"{width[0]:g} to {width[1]:g} x {thickness[0]:g} to {thickness[1]:g} x {length:g}"
        verify(case, f"{sizes}: {name}", computed, reference, tolerance, "-")


@pytest.mark.parametrize(("length", "t"), LEAVES)
def test_leaf_between_flat_ends(verify, length, t):
    case = Case(
        "Leaf between flat ends, corrected",
        HEXAHEDRA,
        "Plate bending and held warping, without shear; width 1",
        "In units of plain beam theory.",
    )
    bend, guided, twist = LEAVES[length, t]
    leaf = fx.describe.Leaf(width=1.0, thickness=t)
    C, plain = (compliance(flexure(leaf, length, names)) for names in (("plate", "warping"), "none"))
    name = f"L {length:g}, t {t:g}"
    assert C[4, 4] / plain[4, 4] < bend
    verify(case, f"{name}: bending compliance", C[4, 4] / plain[4, 4], bend, 0.02, "-")
    sway, plain_sway = (A[2, 2] - A[2, 4] ** 2 / A[4, 4] for A in (C, plain))
    verify(case, f"{name}: compliance between parallel ends", sway / plain_sway, guided, 0.02, "-")
    verify(case, f"{name}: torsional stiffness", plain[3, 3] / C[3, 3], twist, 0.02, "-")


@pytest.mark.parametrize(("R", "t", "b"), WIDE)
def test_wide_notch(verify, R, t, b):
    case = Case(
        "Wide right-circular notch, corrected",
        HEXAHEDRA,
        "Rayleigh with corrections, ten stepped elements",
        "Between straight ends as long as they are high. The bending of solids is scaled by what their mesh misses in "
        "plane stress. Plain beams are up to 15 times as soft in torsion.",
    )
    bend, twist = WIDE[R, t, b]
    C = compliance(flexure(fx.describe.Notch(width=b, contour=fx.describe.CircularContour(radius=R, web=t)), 2 * R))
    verify(case, f"R {R:g}, t {t:g}, b {b:g}: rotation per moment", C[4, 4], bend, 0.01, "-")
    verify(case, f"R {R:g}, t {t:g}, b {b:g}: twist per torque", C[3, 3], twist, 0.03, "-")


@pytest.mark.parametrize(("kind", "a", "b", "t"), TWO_AXES)
def test_contours_on_all_faces(verify, kind, a, b, t):
    case = Case(
        "Two-axis and round notches, corrected", HEXAHEDRA, "Rayleigh with corrections; parabolic contours, 40 elements"
    )
    shape = fx.describe.ParabolicContour(depth=b, web=t)
    profile = (
        fx.describe.RoundNotch(contour=shape)
        if kind == "round"
        else fx.describe.TwoAxisNotch(y_contour=shape, z_contour=shape)
    )
    C = compliance(flexure(profile, 2 * a, elements=40))
    rotation, stretch = TWO_AXES[kind, a, b, t]
    name = f"{kind}, a {a:g}, b {b:g}, t {t:g}"
    verify(case, f"{name}: rotation per moment", C[4, 4], rotation, 0.06, "-")
    verify(case, f"{name}: stretch per force", C[0, 0], stretch, 0.04, "-")


def wu_zhou(R, t):
    """Return rotation per moment and stretch per force of a right-circular hinge, E = b = 1."""
    s = R / t
    angle = np.arctan(np.sqrt(4 * s + 1))
    first = 2 * s**3 * (6 * s * s + 4 * s + 1) / ((2 * s + 1) * (4 * s + 1) ** 2)
    rotation = 12 / R**2 * (first + 12 * s**4 * (2 * s + 1) / (4 * s + 1) ** 2.5 * angle)
    return rotation, 2 * (2 * s + 1) / np.sqrt(4 * s + 1) * angle - np.pi / 2


def paros_weisbord(R, t):
    """Return the same by the full equations of 1965 with gamma = 1 + beta."""
    beta = t / (2 * R)
    gamma, q = 1 + beta, 2 * beta + beta**2
    angle = np.arctan(np.sqrt((2 + beta) / beta))
    rotation = (1 + beta) / gamma**2 + (3 + 2 * beta + beta**2) / (gamma * q) + 6 * (1 + beta) / q**1.5 * angle
    return 1.5 / R**2 / q * rotation, 2 * (1 + beta) / np.sqrt(q) * angle - np.pi / 2


def lobontiu(length, r, t):
    """Return the same of a corner-filleted hinge."""
    angle = np.arctan(np.sqrt(1 + 4 * r / t))
    fillets = t * (4 * r + t) * (6 * r * r + 4 * r * t + t * t)
    fillets += 6 * r * (2 * r + t) ** 2 * np.sqrt(t * (4 * r + t)) * angle
    rotation = (length - 2 * r) / t**3 + 2 * r / (t**3 * (2 * r + t) * (4 * r + t) ** 3) * fillets
    stretch = (length - 2 * r) / t + 2 * (2 * r + t) / np.sqrt(t * (4 * r + t)) * angle - np.pi / 2
    return 12 * rotation, stretch


@pytest.mark.parametrize("R, t", CIRCULAR)
def test_closed_forms_of_right_circular_hinges(R, t):
    np.testing.assert_allclose(wu_zhou(R, t), paros_weisbord(R, t), rtol=1e-12)
    x = np.linspace(-R, R, 20001)
    sums = [s.sum() for s in notch.beam_flexibility(R / 10000, notch.circular(x, R, t))]
    np.testing.assert_allclose(sums, wu_zhou(R, t), rtol=2e-6)


@pytest.mark.parametrize(("length", "r", "t"), [(10.0, 1.0, 1.0), (10.0, 3.0, 0.5), (6.0, 0.5, 1.0)])
def test_corner_filleted_hinge(verify, length, r, t):
    case = Case(
        "Corner-filleted hinge",
        "Lobontiu, Paine, Garcia and Goldfarb, J. Mech. Des. 123 (2001) 346-352",
        "Euler-Bernoulli, varying section, 40 tapered elements; E = b = 1",
    )
    profile = fx.describe.Notch(width=1.0, contour=fx.describe.CornerFilletedContour(fillet_radius=r, web=t))
    C = compliance(flexure(profile, length, "none", elements=40, integration="tapered"))
    for name, at, reference in zip(
        ("rotation per moment", "stretch per force"), (4, 0), lobontiu(length, r, t), strict=True
    ):
        verify(case, f"l {length:g}, r {r:g}, t {t:g}: {name}", C[at, at], reference, 1e-4, "-")
