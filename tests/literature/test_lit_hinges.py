"""Right-circular notch hinges, against closed forms and quadrature of the beam integrals.

Paros and Weisbord, How to design flexure hinges, Machine Design 37 (1965) 151-156, full equations; the same in simpler
form by Wu and Zhou, Rev. Sci. Instrum. 73 (2002) 3101-3106. A hinge of radius R and web t, E = b = 1, clamped at one
end: rotation per moment 12 int dx/h^3, extension per force int dx/h, and bending part of the deflection per force
12 int (R - x)^2 dx/h^3, with h = t + 2R - 2 sqrt(R^2 - x^2).

Tolerances: 1e-3 for 4 tapered elements and for 100 stepped ones. The 10 stepped elements of the RPR paper are held to
what midpoint sampling of the same integrals gives.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from flexura.full_order import assemble
from flexura.mechanism import CircularContour, Flexure, Material, Mechanism, Notch
from flexura.reduction.assembly import low_order
from flexura.reduction.low_order import reduce
from flexura.structure import Plan
from flexura.structure.design import Design
from helpers.verification_report import Case

CLOSED_FORMS = {  # (R, t): rotation per moment, extension per force, deflection per force
    (4.0, 0.3): (568.113434957, 9.208600189, 9295.623094336),
    (5.0, 1.0): (30.799930062, 4.938822902, 810.89984228),
    (3.0, 0.5): (135.557013496, 5.570887661, 1275.749223521),
    (2.0, 1.0): (18.714616562, 2.592689581, 82.716359925),
}
QUANTITIES = ("rotation per moment", "extension per force", "deflection per force")


def hinge(R, t, elements, integration):
    """Describe a hinge along x that bends about y."""
    notch = Notch(width=1.0, contour=CircularContour(radius=R, web=t))
    shape = {"profile": notch, "elements": elements, "integration": integration}
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes={"a": (-R, 0, 0), "b": (R, 0, 0)},
        materials={"unit": Material(E=1.0, nu=0.3, rho=1.0)},
        flexures={"hinge": Flexure(nodes=("a", "b"), material="unit", reference="z", **shape)},
        ground={"a": "clamped"},
    )


def compliances(mechanism):
    """Return the three compliances of node b from the chain of flexibilities.

    The assembled stiffness, full and reduced, must give the same up to its conditioning, which worsens with the number
    of elements.
    """
    plan = Plan(mechanism)
    model, low = assemble(plan), reduce(plan)
    assert low.coordinate_names == [f"b.{dof}" for dof in ("tx", "ty", "tz", "rx", "ry", "rz")]
    chain, _ = low_order(plan).stack(Design.of(plan))
    exact = np.diagonal(np.linalg.inv(chain))[[4, 0, 2]]
    b = [model.dof_names.index(f"b.{dof}") for dof in ("ry", "tx", "tz")]
    np.testing.assert_allclose(np.linalg.inv(model.K.toarray())[b, b], exact, rtol=2e-6)
    np.testing.assert_allclose(np.diagonal(np.linalg.inv(low.K))[[4, 0, 2]], exact, rtol=2e-6)
    return exact


def thickness(x, R, t):
    """Return the thickness h(x)."""
    return t + 2 * R - 2 * np.sqrt(R * R - x * x)


def integrals(R, t, rule):
    """Return the three compliances by an integration rule over (-R, R)."""
    return [
        rule(lambda x: 12 / thickness(x, R, t) ** 3),
        rule(lambda x: 1 / thickness(x, R, t)),
        rule(lambda x: 12 * (R - x) ** 2 / thickness(x, R, t) ** 3),
    ]


@pytest.mark.parametrize(("R", "t"), CLOSED_FORMS)
def test_right_circular_hinge(verify, R, t):
    case = Case(
        "Right-circular hinge",
        "Paros and Weisbord, Machine Design 37 (1965) 151-156, full equations; Wu and Zhou, RSI 73 (2002) 3101-3106",
        "Euler-Bernoulli, varying section; E = b = 1",
        "Beam theory itself is up to 15 % (rotation) and 22 % (extension) from plane-stress elasticity here.",
    )
    closed = CLOSED_FORMS[R, t]
    quadrature = integrals(R, t, lambda f: quad(f, -R, R, epsabs=0, epsrel=1e-11, limit=200)[0])
    np.testing.assert_allclose(quadrature, closed, rtol=1e-9)
    for kind, elements in (("tapered", 4), ("stepped", 100)):
        for name, computed, reference in zip(QUANTITIES, compliances(hinge(R, t, elements, kind)), closed, strict=True):
            verify(case, f"R {R:g}, t {t:g}: {name}, {elements} {kind} elements", computed, reference, 1e-3, "-")


@pytest.mark.parametrize(("R", "t"), CLOSED_FORMS)
@pytest.mark.parametrize("n", [10, 40])
def test_stepped_elements_are_sums_over_uniform_beams(R, t, n):
    """Element k of n, uniform with the thickness at its middle, adds its own integrals over its length 2R/n."""
    edges = np.linspace(-R, R, n + 1)
    h = thickness((edges[1:] + edges[:-1]) / 2, R, t)
    lever = ((R - edges[:-1]) ** 3 - (R - edges[1:]) ** 3) / 3
    steps = [np.sum(12 * np.diff(edges) / h**3), np.sum(np.diff(edges) / h), np.sum(12 * lever / h**3)]
    np.testing.assert_allclose(compliances(hinge(R, t, n, "stepped")), steps, rtol=1e-9)


def test_ten_stepped_elements_of_the_rpr_hinge(verify):
    case = Case(
        "Right-circular hinge, ten stepped elements",
        "Paros and Weisbord, Machine Design 37 (1965) 151-156, full equations",
        "Euler-Bernoulli, every element uniform with the thickness at its middle",
        "The discretisation of the RPR paper, R = 4 and t = 0.3: the tolerance is the error that ten steps make.",
    )
    computed = compliances(hinge(4.0, 0.3, 10, "stepped"))
    for name, value, reference in zip(QUANTITIES, computed, CLOSED_FORMS[4.0, 0.3], strict=True):
        verify(case, name, value, reference, 0.02, "-")
