"""Anticlastic bending and held warping of strips against minimised energies, quadratures and limits."""

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solve_banded

from flexura.beam import rectangle
from flexura.beam.section import (
    anticlastic_compliance,
    mean_cosh,
    secondary_constant,
    warping_compliance,
    warping_constant,
    warping_decay,
    warping_element,
)
from flexura.duals import Dual


def hermite(n, span):
    """Return nodes, points, weights (n, g) and cubic functions with two derivatives (n, g, 4) on a graded mesh."""
    x = span / 2 * np.sin(np.linspace(-np.pi / 2, np.pi / 2, n + 1))
    g, w = np.polynomial.legendre.leggauss(5)
    s, L = (1 + g) / 2, np.diff(x)[:, None]
    zero = np.stack([1 - 3 * s**2 + 2 * s**3, s - 2 * s**2 + s**3, 3 * s**2 - 2 * s**3, s**3 - s**2], -1)
    one = np.stack([6 * s**2 - 6 * s, 1 - 4 * s + 3 * s**2, 6 * s - 6 * s**2, 3 * s**2 - 2 * s], -1)
    two = np.stack([12 * s - 6, 6 * s - 4, 6 - 12 * s, 6 * s - 2], -1)
    size = np.stack([np.ones_like(L), L, np.ones_like(L), L], -1)
    places = x[:-1, None] + L * s
    return x, places, L * w / 2, zero * size, one * size / L[..., None], two * size / L[..., None] ** 2


def strip_by_energy(nu, b, span):
    """Return x and the compliance factor there, from the plate energy of w0'' and f, minimised by finite elements.

    D = 1/b per unit moment, the curvature w0'' being eliminated last.
    """
    n = 80
    _, places, weights, f, df, ddf = hermite(n, span)
    y, v = np.polynomial.legendre.leggauss(6)
    y, v = y * b / 2, v * b / 2
    p = y**2 - b**2 / 12
    K, F = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros(2 * n + 2)
    for k in range(n):
        at = slice(2 * k, 2 * k + 4)
        for q, weight in enumerate(weights[k]):
            kx, ky, kxy = np.outer(p, ddf[k, q]), np.outer(2 * np.ones_like(y), f[k, q]), np.outer(2 * y, df[k, q])
            bend = (
                kx.T * v @ kx + ky.T * v @ ky + nu * (kx.T * v @ ky + ky.T * v @ kx) + 2 * (1 - nu) * (kxy.T * v @ kxy)
            )
            couple = v @ (kx + nu * ky)  # with w0'' = c constant across
            K[at, at] += weight * (bend - np.outer(couple, couple) / b)
            F[at] -= weight * couple / b
    inner = slice(2, 2 * n)
    u = np.zeros(2 * n + 2)
    u[inner] = np.linalg.solve(K[inner, inner], F[inner])
    value = np.stack([f[k] @ u[2 * k : 2 * k + 4] for k in range(n)])
    return places, weights, (1 - nu**2) * (1 - 2 * nu * b * value)


@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.33, 0.5])
@pytest.mark.parametrize("ratio", [0.2, 1.0, 4.0])
def test_bending_minimises_the_plate_energy(nu, ratio):
    b = 7.0
    span = ratio * b
    _, weights, factor = strip_by_energy(nu, b, span)
    mean = (weights * factor).sum() / span
    assert_allclose(anticlastic_compliance(nu, b, span, -span / 2, span / 2), mean, rtol=1e-7)


def test_bending_next_to_the_end_minimises_the_plate_energy():
    places, weights, factor = strip_by_energy(0.33, 1.0, 2.0)
    taken = (places < -0.9).all(axis=1)
    mean = (weights * factor)[taken].sum() / weights[taken].sum()
    stop = -1 + weights[taken].sum()
    assert_allclose(anticlastic_compliance(0.33, 1.0, 2.0, -1.0, stop), mean, rtol=1e-7)


def test_bending_has_its_limits():
    nu = np.array([0.1, 0.33, 0.5])
    for ratio, limit in ((1e-3, 1 - nu**2), (1e9, 1.0)):
        assert_allclose(anticlastic_compliance(nu, 1.0, ratio, -ratio / 2, ratio / 2), limit, rtol=1e-6)
    L = np.geomspace(1e-2, 1e3, 80)
    factor = anticlastic_compliance(0.33, 1.0, L, -L / 2, L / 2)
    assert (np.diff(factor) > 0).all()
    assert (factor > 1 - 0.33**2).all() and (factor < 1).all()
    assert_allclose(anticlastic_compliance(0.0, 1.0, L, -L / 2, L / 2), 1.0, rtol=0, atol=0)


@pytest.mark.parametrize("n", [1, 3, 10])
def test_means_over_elements_add_up(n):
    edges = np.linspace(-0.5, 0.5, n + 1) * 3.0
    whole = anticlastic_compliance(0.3, 2.0, 3.0, -1.5, 1.5)
    assert_allclose(anticlastic_compliance(0.3, 2.0, 3.0, edges[:-1], edges[1:]).mean(), whole, rtol=1e-13)
    args = (2.5, 0.9, 3.0)
    whole = warping_compliance(*args, -1.5, 1.5)
    assert_allclose(warping_compliance(*args, edges[:-1], edges[1:]).mean(), whole, rtol=1e-13)


@pytest.mark.parametrize("decay", [0.02, 1.0, 9.0])
def test_an_element_between_ends_that_warp(decay):
    """Against the least energy of polynomials of degree 50, psi^2 + (2 psi'/decay)^2 - 2 T psi, with ends given."""
    kappa, n = 0.9, np.polynomial.legendre
    s, w = n.leggauss(80)
    V, ends = n.legvander(s, 50), n.legvander(np.array([-1.0, 1.0]), 50)
    slope = np.stack([n.legval(s, n.legder(row)) for row in np.eye(51)], axis=1)
    P, w = V[:, :3], w / 2
    K = (V.T * w) @ V + (slope.T * w) @ slope * (2 / decay) ** 2
    load = np.concatenate([np.hstack([(V.T * w) @ P, np.zeros((51, 2))]), np.eye(5)[3:]])
    solved = np.linalg.solve(np.block([[K, ends.T], [ends, np.zeros((2, 2))]]), load)
    twist = kappa * (P.T * w) @ V @ solved[:51] + (1 - kappa) * np.hstack([(P.T * w) @ P, np.zeros((3, 2))])
    A, B, Z = warping_element(decay, kappa)
    assert_allclose(np.hstack([A, B]), twist, atol=1e-10)
    assert_allclose(np.hstack([-B.T, Z]), -kappa * solved[51:], rtol=1e-8, atol=1e-10)


def test_the_bessel_functions_of_elements_that_warp_to_their_last_digits():
    decay = np.array([1e-3, 0.4, 3.9999, 4.0, 12.0, 900.0])
    A, B, _ = warping_element(Dual(decay, np.ones((1, 6))), 1.0)

    def ratio(n, x):
        z = x / 2
        under = mpmath.sinh(z) if n == 1 else mpmath.cosh(z)
        return mpmath.sqrt(mpmath.pi / (2 * z)) * mpmath.besseli(n + 0.5, z) / under

    with mpmath.workdps(40):
        for n, found in enumerate((2 * B[:, 0, 0], 2 * B[:, 1, 1], -A[:, 0, 2])):
            values = [ratio(n, mpmath.mpf(float(x))) for x in decay]
            slopes = [mpmath.diff(lambda x, n=n: ratio(n, x), mpmath.mpf(float(x))) for x in decay]
            assert_allclose(found.value, np.array(values, dtype=float), rtol=1e-14)
            assert_allclose(found.slope[0], np.array(slopes, dtype=float), rtol=1e-12)


def test_one_clamped_end_is_half_of_twice_the_length():
    x = np.linspace(0, 1, 6)
    held = anticlastic_compliance(0.3, 1.0, 4.0, 2 * x[:-1] - 2, 2 * x[1:] - 2)
    mirrored = anticlastic_compliance(0.3, 1.0, 4.0, 2 * x[:-1], 2 * x[1:])
    assert_allclose(held, mirrored[::-1], rtol=1e-14)


def test_long_spans_do_not_overflow():
    assert_allclose(mean_cosh(2.0, 1e6, -5e5, -5e5 + 3), (1 - np.exp(-6)) / 6, rtol=1e-12)
    assert mean_cosh(2.0, 1e6, -1.0, 1.0) == 0.0
    x = np.array([-0.5, 0.2])
    expected = (np.sinh(3 * x[1]) - np.sinh(3 * x[0])) / 3 / np.cosh(3 * 0.7) / 0.7
    assert_allclose(mean_cosh(3.0, 1.4, *x), expected, rtol=1e-14)


def saint_venant(b, t, degree=9):
    """Return J and Gamma from a polynomial warping function with the least shear energy."""
    g, w = np.polynomial.legendre.leggauss(30)
    y, z = np.meshgrid(g * b / 2, g * t / 2, indexing="ij")
    weight = np.outer(w, w) * b * t / 4
    odd = np.polynomial.legendre.legval
    powers = range(1, 2 * degree, 2)
    basis, by, bz = [], [], []
    for m in powers:
        for n in powers:
            cm, cn = np.eye(2 * degree)[m], np.eye(2 * degree)[n]
            Y, Z = odd(2 * y / b, cm), odd(2 * z / t, cn)
            dY = odd(2 * y / b, np.polynomial.legendre.legder(cm)) * 2 / b
            dZ = odd(2 * z / t, np.polynomial.legendre.legder(cn)) * 2 / t
            basis.append(Y * Z), by.append(dY * Z), bz.append(Y * dZ)
    basis, by, bz = (np.array(f) for f in (basis, by, bz))
    K = np.einsum("iyz,jyz,yz->ij", by, by, weight) + np.einsum("iyz,jyz,yz->ij", bz, bz, weight)
    F = np.einsum("iyz,yz->i", by * z - bz * y, weight)
    c = np.linalg.lstsq(K, F, rcond=1e-13)[0]
    phi = np.einsum("i,iyz->yz", c, basis)
    return ((y**2 + z**2) * weight).sum() - c @ F, (phi**2 * weight).sum()


@pytest.mark.parametrize(("b", "t"), [(1.0, 1.0), (1.3, 1.0), (3.0, 1.0), (1.0, 2.0)])
def test_warping_constant_is_that_of_saint_venants_function(b, t):
    J, warping = saint_venant(b, t)
    assert_allclose(rectangle(b, t, 0.3).J, J, rtol=1e-6)
    assert_allclose(warping_constant(b, t), warping, rtol=1e-4)


def test_warping_constant_of_a_thin_strip():
    assert_allclose(warping_constant(1.0, 1e-3), 1e-9 / 144, rtol=1e-5)
    assert_allclose(warping_constant(2.0, 0.3), warping_constant(0.3, 2.0), rtol=0)


def torsion_by_energy(nu, J, warping, secondary, L, both):
    """Return twist per torque over 1/GJ, from linear elements for the rate of warping; G = 1."""
    n = 4000
    dx = L / n
    stiff = 2 / (1 - nu) * warping
    K = np.zeros((3, n + 1))
    mid = J * secondary / (J + secondary)  # what is left of GJ theta'^2 + GJs (theta' - psi)^2 once theta' is free
    K[1, :-1] += stiff / dx + mid * dx / 3
    K[1, 1:] += stiff / dx + mid * dx / 3
    K[0, 1:] += -stiff / dx + mid * dx / 6
    K[2, :-1] += -stiff / dx + mid * dx / 6
    load = np.full(n + 1, dx) * secondary / (J + secondary)
    load[[0, -1]] /= 2
    last = n if both else n + 1
    free = slice(1, last)
    K = K[:, free].copy()
    psi = np.zeros(n + 1)
    psi[free] = solve_banded((1, 1), K, load[free])
    rate = (1 + secondary * psi) / (J + secondary)
    return np.trapezoid(rate, dx=dx) * J / L


@pytest.mark.parametrize("both", [True, False])
@pytest.mark.parametrize(("b", "t", "L"), [(1.0, 0.05, 0.5), (1.0, 0.05, 3.0), (1.0, 0.4, 1.0), (1.0, 1.0, 2.0)])
def test_torsion_minimises_its_energy(b, t, L, both):
    place = (L, -L / 2, L / 2) if both else (2 * L, -L, 0.0)
    J = rectangle(b, t, 0.33).J
    args = (0.33, J, warping_constant(b, t), secondary_constant(0.33, J, b, t, place[0]))
    assert_allclose(warping_compliance(*warping_decay(*args), *place), torsion_by_energy(*args, L, both), rtol=1e-4)


def test_torsion_has_its_limits():
    J = rectangle(1.0, 0.03, 0.3).J
    args = (0.3, J, warping_constant(1.0, 0.03), secondary_constant(0.3, J, 1.0, 0.03, 0.7))
    L = np.geomspace(1e-3, 1e6, 60)
    decay, kappa = warping_decay(*args)
    factor = warping_compliance(decay, kappa, L, -L / 2, L / 2)
    assert (np.diff(factor) > 0).all() and (factor > 0).all()
    assert_allclose(factor[-1], 1.0, rtol=1e-5)
    assert_allclose(factor[0], args[1] / (args[1] + args[3]), rtol=1e-2)  # secondary shear alone
    z = decay * 0.35
    assert_allclose(warping_compliance(decay, kappa, 0.7, -0.35, 0.35), 1 - kappa * np.tanh(z) / z, rtol=1e-13)


def test_secondary_shear_has_its_limits():
    """5 b^3 t/72 in long thin strips (Reissner 1945), and all of Ip in those without length."""
    b, t = 1.0, 1e-3
    J = rectangle(b, t, 0.3).J
    assert_allclose(secondary_constant(0.3, J, b, t, 1e3 * t), 5 / 72 * b**3 * t, rtol=1e-3)
    for width in (1e-3, 3e-3, 1.0):
        J = rectangle(width, t, 0.3).J
        polar = width * t * (width**2 + t**2) / 12
        assert_allclose(J + secondary_constant(0.3, J, width, t, np.array([0.0, 1e-9])), polar, rtol=1e-9)


def through_the_thickness(nu, t, L):
    """Shear per force of a strip that stays plane but for P3(2z/t), free at its ends or not, G = 1 and t the area."""
    n = 3000
    dx, stiff = L / n, t / 7 * 2 / (1 - nu)
    main = np.full(n + 1, 2 * stiff / dx)
    K = np.zeros((3, n + 1))
    K[1], K[0, 1:], K[2, :-1] = main + 20 / t * dx, -stiff / dx, -stiff / dx  # 24/t less what gamma takes, 4/t
    chi = np.zeros(n + 1)
    chi[1:-1] = solve_banded((1, 1), K[:, 1:-1], np.full(n - 1, -2 / t * dx))
    return np.trapezoid((1 - 2 * chi) / t, dx=dx) / L * t


@pytest.mark.parametrize("ratio", [0.1, 0.5, 2.0, 20.0])
def test_shear_across_the_thickness_minimises_its_energy(ratio):
    b, t = 50.0, 1.0
    J = rectangle(b, t, 0.3).J
    polar = b * t * (b**2 + t**2) / 12
    own = (polar - J) / secondary_constant(0.3, J, b, t, ratio)
    assert_allclose(own, through_the_thickness(0.3, t, ratio), rtol=1e-4)


def test_functions_broadcast():
    L = np.array([[1.0], [2.0]])
    b = np.array([0.1, 0.5, 1.0])
    both = anticlastic_compliance(0.3, b, L, -L / 2, L / 2)
    assert both.shape == (2, 3)
    assert_allclose(both[1, 2], anticlastic_compliance(0.3, 1.0, 2.0, -1.0, 1.0), rtol=1e-15)
