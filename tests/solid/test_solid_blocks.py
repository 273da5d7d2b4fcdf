"""Mapped meshes of single members: volumes and inertias in closed form, points on the true contour, refusals."""

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.fem.geometry import solids
from flexura.fem.mapped import KIND, section_mesh
from flexura.fem.matrices import mesh_mass
from flexura.fem.meshing import group_mesh

W, T, R = 10e-3, 0.5e-3, 4e-3
ELLIPSE = fx.describe.EllipticalContour(depth=3e-3, web=T)
CIRCLE = fx.describe.CircularContour(radius=R, web=T)
PARABOLA = fx.describe.ParabolicContour(depth=3e-3, web=T)


def described(form, length=2 * R):
    """Describe a member along x from a to b."""
    shared = {"nodes": ("a", "b"), "material": "Al-7075-T6", "reference": "z"}
    kind = "flexures" if hasattr(form, "type") else "links"
    member = (
        fx.describe.Flexure(profile=form, **shared) if kind == "flexures" else fx.describe.Link(section=form, **shared)
    )
    return fx.Mechanism(nodes={"a": (0, 0, 0), "b": (length, 0, 0)}, ground={"a": "clamped"}, **{kind: {"m": member}})


def solid(form, **parameters):
    """Return the member as a solid."""
    mechanism = form if isinstance(form, fx.Mechanism) else described(form)
    (member,) = solids(fx.assemble(mechanism, parameters))
    return member


def mesh_of(form, size=1.0):
    return group_mesh([solid(form)], size)


def parabola(power):
    """Integral of (t + 2 b s^2)^power over 0 <= s <= 1, times the length."""
    return 2 * R * np.polynomial.Polynomial([T, 0, 6e-3]).__pow__(power).integ()(1.0)


VOLUMES = {
    "leaf": (fx.describe.Leaf(width=W, thickness=T), W * T * 2 * R, 1e-12),
    "rectangle": (fx.describe.Rectangle(width=2e-3, thickness=3e-3), 6e-6 * 2 * R, 1e-12),
    "circular notch": (fx.describe.Notch(width=W, contour=CIRCLE), W * ((T + 2 * R) * 2 * R - np.pi * R**2), 3e-4),
    "elliptical notch": (
        fx.describe.Notch(width=W, contour=ELLIPSE),
        W * ((T + 6e-3) * 2 * R - np.pi * R * 3e-3),
        3e-4,
    ),
    "parabolic notch": (fx.describe.Notch(width=W, contour=PARABOLA), W * parabola(1), 1e-6),
    "two axes": (fx.describe.TwoAxisNotch(y_contour=PARABOLA, z_contour=PARABOLA), parabola(2), 1e-6),
    "round": (fx.describe.RoundNotch(contour=PARABOLA), np.pi / 4 * parabola(2), 1e-3),
    "table": (
        fx.describe.Notch(
            width=W, contour=fx.describe.TabulatedContour(positions=(0, 3e-3, 8e-3), thicknesses=(3e-3, 1e-3, 2e-3))
        ),
        W * (2e-3 * 3e-3 + 1.5e-3 * 5e-3),
        1e-12,
    ),
    "sharp V": (
        fx.describe.Notch(width=W, contour=fx.describe.VShapedContour(angle=0.5, root_radius=0, web=T)),
        W * 2 * R * (T + R * np.tan(0.5)),
        1e-12,
    ),
    "circle": (fx.describe.Circle(diameter=2e-3), np.pi * 1e-6 * 2 * R, 1e-3),
    "tube": (fx.describe.Tube(outer_diameter=2e-3, inner_diameter=1e-3), np.pi * 0.75e-6 * 2 * R, 1e-3),
}


@pytest.mark.parametrize("name", VOLUMES)
def test_volume(name):
    form, volume, tolerance = VOLUMES[name]
    found = mesh_mass(mesh_of(form))
    assert found.volume == pytest.approx(volume, rel=tolerance)
    assert found.mass == pytest.approx(2810 * found.volume, rel=1e-12)
    assert solid(form).volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("name", ["circular notch", "round"])
def test_finer_meshes_come_nearer_to_the_volume(name):
    form, volume, _ = VOLUMES[name]
    errors = [abs(mesh_mass(mesh_of(form, size)).volume / volume - 1) for size in (1, 0.5)]
    assert errors[1] < errors[0] / 4


def test_points_lie_on_the_contour():
    mesh = mesh_of(fx.describe.Notch(width=W, contour=CIRCLE))
    x, _, z = mesh.points.T
    top = np.array([z[np.isclose(x, station, rtol=0, atol=1e-12)].max() for station in np.unique(x)])
    centre_distance = np.hypot(np.unique(x) - R, T / 2 + R - top)
    np.testing.assert_allclose(centre_distance, R, rtol=1e-9)


def test_shifted_notches_have_cells_up_to_their_ends():
    shape = fx.describe.TwoAxisNotch(y_contour=PARABOLA, z_contour=PARABOLA, shift=2e-3)
    mesh = mesh_of(shape)
    corners = np.unique(mesh.points[mesh.cells[KIND][:, :8], 0])
    for station in (2e-3, 6e-3):
        assert np.abs(corners - station).min() < 1e-12
    full = T + 6e-3
    assert np.ptp(mesh.points[:, 1]) == pytest.approx(full)
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(full)


def test_end_faces_and_materials():
    mesh = mesh_of(fx.describe.Leaf(width=W, thickness=T))
    for name, x in (("start", 0.0), ("end", 2 * R)):
        face = mesh.points[mesh.point_sets[f"m {name}"]]
        np.testing.assert_allclose(face[:, 0], x, atol=1e-15)
        np.testing.assert_allclose(np.ptp(face, axis=0), [0, W, T], atol=1e-15)
    assert (np.isclose(mesh.points[:, 0], 0, atol=1e-12)).sum() == len(mesh.point_sets["m start"])
    material = mesh.materials[0]
    assert (material.name, material.E, material.nu, material.rho) == ("Al-7075-T6", 71.7e9, 0.33, 2810.0)
    assert set(mesh.parts[KIND]) == {"m"}
    assert len(mesh.parts[KIND]) == len(mesh.cells[KIND])


def test_parameters_change_the_mesh():
    mechanism = described(fx.describe.Leaf(width=W, thickness=fx.describe.Expression.parse("t")))
    mechanism = mechanism.model_copy(update={"parameters": {"t": fx.describe.Parameter(value=T, unit="m")}})
    mesh = group_mesh([solid(mechanism, t=2 * T)])
    assert np.ptp(mesh.points[:, 2]) == pytest.approx(2 * T)


def test_a_disc_has_the_area_and_moments_of_a_circle():
    mesh = mesh_of(fx.describe.Circle(diameter=2e-3), 0.5)
    found = mesh_mass(mesh)
    assert found.inertia[0, 0] == pytest.approx(found.mass * 1e-6 / 2, rel=1e-4)
    np.testing.assert_allclose(found.centre, [R, 0, 0], atol=1e-12)


def test_cells_shrink_with_size():
    shape = solid(fx.describe.Leaf(width=W, thickness=T)).shape
    assert len(section_mesh(shape, 0.5)[1]) > len(section_mesh(shape, 1.0)[1])


def test_refusals():
    constants = fx.describe.SectionConstants(A=1e-6, Iy=1e-12, Iz=1e-12, J=1e-12)
    with pytest.raises(OptionError, match="m: a section given by constants has no solid"):
        mesh_of(constants)
    for size in (0, -1, 100, float("nan")):
        with pytest.raises(OptionError, match="size"):
            mesh_of(fx.describe.Leaf(width=W, thickness=T), size)
