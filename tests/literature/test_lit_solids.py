"""Solid finite elements against plane elasticity.

Labuschagne, van Rensburg and van der Merwe, Comparison of linear beam theories, Math. Comput. Model. 49 (2009) 20-30:
cantilevers as two-dimensional bodies in plane stress. A thin sheet whose middle plane stays plane is such a body.

Tolerance: half a unit of the third digit, and 0.3 % for the mesh.
"""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.fem.matrices import elastic_matrices
from helpers.beam_models import last_digit
from helpers.direct_solids import lowest_modes
from helpers.solid_wholes import solid_mesh
from helpers.verification_report import Case

PLANE = {  # height over length
    0.1: [0.0317, 1.14, 7.72, 7.92, 26.2, 60.8, 69.3, 115],
    0.2: [0.122, 3.55, 7.73, 20.2, 56.1, 69.2, 114, 189],
}


@pytest.mark.slow
@pytest.mark.parametrize("height", PLANE)
def test_cantilever_as_a_plane_body(verify, height):
    case = Case(
        "Labuschagne 2009, cantilever, plane elasticity",
        "Labuschagne, van Rensburg, van der Merwe, Math. Comput. Model. 49 (2009) 20-30",
        "solid: hexahedra with 27 points; Poisson's ratio 0.3",
        "Dimensionless eigenvalues omega^2 rho L^2 / (5/6 G) for depth-to-length ratios h/L.",
    )
    section = fx.describe.Rectangle(width=1e-3, thickness=height)
    mechanism = fx.Mechanism(
        materials={"unit": fx.describe.Material(E=1.0, nu=0.3, rho=1.0)},
        nodes={"a": (0, 0, 0), "b": (1, 0, 0)},
        links={"bar": fx.describe.Link(nodes=("a", "b"), material="unit", section=section, reference=(0, 0, 1))},
        ground={"a": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    )
    mesh = solid_mesh(fx.assemble(mechanism), 0.7, "bar")
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    held[mesh.points[:, 0] < 1e-9] = True
    held[np.abs(mesh.points[:, 1]) < 1e-9, 1] = True
    free = np.flatnonzero(~held.ravel())
    K, M = (A[free][:, free] for A in elastic_matrices(mesh))
    reference = PLANE[height]
    found = lowest_modes(K, M, len(reference)).pairs.values / (5 / 6 / 2.6)
    tolerance = [0.003 + digit for digit in last_digit(reference, 3)]
    verify(case, f"h/L = {height}, eigenvalue", found.tolist(), reference, tolerance, "-")
