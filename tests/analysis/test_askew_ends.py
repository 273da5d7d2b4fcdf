"""Leaves that end in faces that are not square to them: what the nearer edge of the face holds, against plane strain by
scikit-fem, and how steep faces are."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, condense, solve
from skfem.helpers import ddot, sym_grad, trace

import flexura as fx

NU, LENGTH = 0.3, 12.0
"""Poisson's ratio, and length of the leaf over its thickness."""


def turned_by_a_moment(slope: float) -> float:
    """Rotation by a unit moment of a leaf between rigid faces that are not square to it, E = t = 1, per width."""
    x = LENGTH * np.sin(np.linspace(0, np.pi / 2, 60)) ** 2 / np.sqrt(1 + slope**2)
    mesh = MeshQuad.init_tensor(x, np.linspace(-0.5, 0.5, 25) * np.sqrt(1 + slope**2))
    p = mesh.p.copy()
    p[1] += slope * p[0]
    basis = Basis(MeshQuad(p, mesh.t), ElementVector(ElementQuad2()), intorder=5)
    lame, mu = NU / ((1 + NU) * (1 - 2 * NU)), 1 / (2 * (1 + NU))

    @BilinearForm
    def stiffness(u, v, _):
        return 2 * mu * ddot(sym_grad(u), sym_grad(v)) + lame * trace(sym_grad(u)) * trace(sym_grad(v))

    K, at = stiffness.assemble(basis), basis.doflocs
    start, end = (basis.get_dofs(lambda q, own=own: np.abs(q[0] - own) < 1e-9) for own in (x[0], x[-1]))
    across = end.all("u^2")
    motions = np.zeros((3, K.shape[0]))
    motions[0, np.setdiff1d(end.all(), across)] = 1.0
    motions[1, across] = 1.0
    motions[2, end.all()] = np.where(
        np.isin(end.all(), across), -(at[0] - x[-1])[end.all()], (at[1] - slope * x[-1])[end.all()]
    )
    held = np.concatenate([start.all(), end.all()])
    motions = np.array([solve(*condense(K, x=own, D=held)) for own in motions])
    return float(np.linalg.inv(motions @ (K @ motions.T))[2, 2])


def leaf(degrees: float, width: float = 40.0) -> fx.Mechanism:
    """A wide leaf from one large block to another, whose faces are at an angle to it."""
    angle = np.radians(degrees)
    to = np.array([np.sin(angle), 0.0, np.cos(angle)]) * LENGTH
    block = "{shape: box, size: [60 mm, 80 mm, 20 mm], material: own}"
    return fx.loads(
        f"""flexura: 1
materials: {{own: {{E: 70 GPa, nu: {NU}, rho: 2700 kg/m^3}}}}
nodes: {{foot: [0, 0, 0], head: [{to[0]} mm, 0, {to[2]} mm]}}
flexures:
  leaf:
    {{nodes: [foot, head], material: own, reference: x, profile: {{type: leaf, width: {width} mm, thickness: 1 mm}}}}
bodies:
  base: {{centre: [0, 0, -10 mm], solid: {block}, carries: [foot]}}
  stage: {{centre: [{to[0]} mm, 0, {to[2] + 10} mm], solid: {block}, carries: [head]}}
ground: {{base: clamped}}
"""
    )


@pytest.mark.parametrize("degrees", [15, 30, 45, 60])
def test_the_nearer_edge_of_a_face_holds_what_it_holds_in_plane_strain(degrees: float) -> None:
    slope = np.tan(np.radians(degrees))
    own = fx.kinetostatics(leaf(degrees), platform="stage").model_errors
    (effect,) = (one for one in own.effects if one.text == "end at an angle to its block")
    model = 1 / fx.kinetostatics(leaf(degrees), platform="stage").stiffness[4]
    bending = 12 * LENGTH * 1e-3 / (70e9 * 40e-3 * 1e-9) * (1 - NU**2)
    held = (turned_by_a_moment(slope) / turned_by_a_moment(0.0) - 1) * bending / model
    low, high = sorted(-end / (1 + end) for end in (effect.low[4], effect.high[4]))
    assert low < held < high < 0
    assert np.isfinite(own.low).all()


def test_square_ends_and_what_is_not_drawn_have_no_angle() -> None:
    assert not [
        one for one in fx.kinetostatics(leaf(0.0), platform="stage").model_errors.effects if "angle" in one.text
    ]
