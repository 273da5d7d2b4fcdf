"""Published frequencies that tell beam theories apart.

Han, Benaroya and Wei, Dynamics of transversely vibrating beams using four engineering theories, J. Sound Vib. 225
(1999) 935-988, doi 10.1006/jsvi.1999.2257: cantilever tube, Rayleigh and Timoshenko.
Labuschagne, van Rensburg and van der Merwe, Comparison of linear beam theories, Math. Comput. Model. 49 (2009) 20-30:
cantilever, Timoshenko and Euler-Bernoulli.

Tolerances: one unit of the last digit for the four-digit values of Han et al., half a unit of the third digit for
Labuschagne et al. Timoshenko elements converge with second order: 400 and 1200 of them.
"""

import numpy as np
import pytest

from flexura.beam import tube
from flexura.mechanism import Material, SectionConstants, Tube
from helpers.beam_models import in_plane, last_digit, straight
from helpers.literature_cases import HAN_RATIOS, LABUSCHAGNE
from helpers.verification_report import Case


def han(theory, count):
    """Return angular frequencies of the tube of Han et al., rad/s."""
    metal = Material(E=200e9, rho=7830.0, nu=0.29)
    section = Tube(outer_diameter=0.32, inner_diameter=0.30)
    return 2 * np.pi * in_plane(straight(section, metal, 1.0, 400, {"a": "clamped"}, theory), count, ("ty", "rz"))


@pytest.mark.parametrize("theory", HAN_RATIOS)
def test_han_cantilever_tube(verify, theory):
    case = Case(
        f"Han 1999, cantilever tube, {theory.capitalize()}",
        "Han, Benaroya, Wei, J. Sound Vib. 225 (1999) 935-988, cantilever of slenderness 9.12",
        theory.capitalize(),
        "The paper uses the shear coefficient 0.53066, which is Cowper's for this tube.",
    )
    first, ratios = HAN_RATIOS[theory]
    w = han(theory, 1 + len(ratios))
    verify(case, "first angular frequency", w[0], first, last_digit([first], 4, 1.0)[0], "rad/s")
    verify(case, "ratio to the first, mode 1 +", w[1:] / w[0], ratios, last_digit(ratios, 4, 1.0), "-")


def test_han_shear_coefficient_is_cowpers():
    assert tube(0.32, 0.30, 0.29).ky == pytest.approx(0.53066, abs=5e-6)


def test_han_tube_tells_the_theories_apart():
    first = {theory: han(theory, 2) for theory in ("euler_bernoulli", "rayleigh", "timoshenko")}
    euler = 1.8751041**2 * np.sqrt(200e9 * (0.32**2 + 0.30**2) / 16 / 7830)
    assert first["euler_bernoulli"][0] == pytest.approx(euler, rel=1e-6)
    assert first["euler_bernoulli"][0] > 1.02 * first["rayleigh"][0]
    assert first["rayleigh"][0] > 1.1 * first["timoshenko"][0]


@pytest.mark.parametrize(("theory", "h"), LABUSCHAGNE)
def test_labuschagne_cantilever(verify, theory, h):
    name = theory.replace("_", "-").title()
    case = Case(
        f"Labuschagne 2009, cantilever, {name}",
        "Labuschagne, van Rensburg, van der Merwe, Math. Comput. Model. 49 (2009) 20-30",
        f"{name}; Poisson's ratio 0.3, shear coefficient 5/6",
        "Dimensionless eigenvalues omega^2 rho L^2 / (5/6 G) for depth-to-length ratios h/L.",
    )
    printed = LABUSCHAGNE[theory, h]
    section = SectionConstants(A=h, Iy=h / 12, Iz=h**3 / 12, J=h**3 / 3, ky=5 / 6, kz=5 / 6)
    metal = Material(E=1.0, rho=1.0, nu=0.3)
    f = in_plane(straight(section, metal, 1.0, 1200, {"a": "clamped"}, theory), len(printed), ("ty", "rz"))
    eigenvalues = (2 * np.pi * f) ** 2 / (5 / 6 / 2.6)
    verify(case, f"h/L = {h}, eigenvalue", eigenvalues, printed, last_digit(printed, 3), "-")
