"""The depth buffer: nearer surfaces hide farther ones, pixel by pixel."""

import numpy as np
import pytest

from flexura.view.drawing.painting import Camera, View, outlines, painted
from flexura.view.drawing.raster import Lines, Painting, of_faces, render
from flexura.view.scene.meshes import box, normals

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
NOTHING = Painting.of()


def shown(painting, width, height, **options):
    """The image, 0 to 1, and the depth."""
    image, depth = render(painting, width, height, **options)
    return image / 255.0, depth


def rectangle(x0, y0, x1, y1, z, colour):
    """A rectangle; z is a number or four at its corners."""
    corners = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], dtype=float)
    corners[:, 2] = z
    return of_faces(corners[None], np.broadcast_to(colour, (1, 4, 3)))


@pytest.mark.parametrize("order", [1, -1])
def test_the_nearer_surface_is_seen_whatever_the_order(order):
    parts = [rectangle(2, 2, 18, 18, 0.0, RED), rectangle(8, 8, 18, 18, 5.0, BLUE)][::order]
    image, depth = shown(Painting.of(parts), 20, 20)
    np.testing.assert_allclose(image[5, 5], [*RED, 1])
    np.testing.assert_allclose(image[12, 12], [*BLUE, 1])
    np.testing.assert_allclose(image[1, 1, 3], 0)
    assert depth[12, 12] == pytest.approx(5, abs=1e-3)
    assert depth[0, 0] == -np.inf


def test_surfaces_that_pass_through_each_other_are_cut_where_they_cross():
    flat = rectangle(0, 0, 20, 20, 0.0, RED)
    slope = rectangle(0, 0, 20, 20, [-10.0, 10.0, 10.0, -10.0], BLUE)
    image, _ = shown(Painting.of([flat, slope]), 20, 20)
    np.testing.assert_allclose(image[:, :10, :3], np.broadcast_to(RED, (20, 10, 3)))
    np.testing.assert_allclose(image[:, 10:, :3], np.broadcast_to(BLUE, (20, 10, 3)))


@pytest.mark.parametrize("order", [1, -1])
def test_of_coincident_surfaces_the_last_is_seen_everywhere(order):
    def plane(x, y):
        return 0.31 * x + 0.77 * y - 3.3

    def piece(x0, y0, x1, y1, colour):
        return rectangle(x0, y0, x1, y1, [plane(x0, y0), plane(x1, y0), plane(x1, y1), plane(x0, y1)], colour)

    parts = [piece(0, 0, 60, 60, RED), piece(7.3, 5.9, 51.7, 48.1, BLUE)][::order]
    image, _ = shown(Painting.of(parts), 60, 60)
    np.testing.assert_allclose(image[8:46, 9:50, :3], np.broadcast_to(parts[-1].colours[0, 0], (38, 41, 3)))


def test_coverage_equals_area():
    image, _ = shown(Painting.of([rectangle(3, 4, 13, 11, 0.0, RED)]), 20, 20)
    assert image[..., 3].sum() == pytest.approx(70)


def test_every_pixel_of_a_surface_of_many_triangles_belongs_to_one():
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(0, 41, 4.0), np.arange(0, 41, 4.0), indexing="ij")
    inner = (x > 0) & (x < 40) & (y > 0) & (y < 40)
    points = np.stack([x, y, rng.normal(size=x.shape)], axis=-1)
    points[inner, :2] += rng.uniform(-1.5, 1.5, (inner.sum(), 2))
    corners = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    image, _ = shown(Painting.of([of_faces(corners, np.broadcast_to(RED, corners.shape))]), 40, 40)
    np.testing.assert_allclose(image, np.broadcast_to([*RED, 1], image.shape))


def test_colours_vary_linearly_over_a_face():
    corners = np.array([[[0, 0, 0], [20, 0, 0], [20, 20, 0], [0, 20, 0]]], dtype=float)
    faces = of_faces(corners, np.array([[[0.0] * 3, [1.0] * 3, [1.0] * 3, [0.0] * 3]]))
    image, _ = shown(Painting.of([faces]), 20, 20)
    np.testing.assert_allclose(image[9, :, 0], (np.arange(20) + 0.5) / 20, atol=0.5 / 255)


def test_glass_shows_what_is_behind_it_only():
    solid = [rectangle(0, 0, 10, 20, 0.0, RED), rectangle(0, 10, 10, 20, 9.0, RED)]
    glass = [rectangle(0, 0, 20, 20, 5.0, BLUE)]
    lines = [Lines(np.array([[[3.0, -5, z], [3, 25, z]]]), np.array([GREEN]), np.array([4.0])) for z in (2.0,)]
    image, _ = shown(Painting.of(solid, lines, glass), 20, 20, opacity=0.5)
    np.testing.assert_allclose(image[5, 7], [0.5, 0, 0.5, 1], atol=0.003)
    np.testing.assert_allclose(image[15, 7], [*RED, 1])
    np.testing.assert_allclose(image[5, 15], [*BLUE, 0.5], atol=0.003)
    np.testing.assert_allclose(image[5, 3], [0, 0.5, 0.5, 1], atol=0.003)
    np.testing.assert_allclose(image[15, 3], [*RED, 1])


@pytest.mark.parametrize("end", [(90.0, 10.0), (85.0, 70.0), (10.0, 70.0), (10.0, 10.0)])
@pytest.mark.parametrize("width", [3.0, 0.6])
def test_a_line_covers_its_length_times_its_width(end, width):
    ends = np.array([[[10.3, 10.2, 0.0], [*end, 0.0]]])
    image, _ = shown(Painting.of(lines=[Lines(ends, np.array([RED]), np.array([width]))]), 100, 80)
    length = np.hypot(end[0] - 10.3, end[1] - 10.2)
    assert image[..., 3].sum() == pytest.approx(width * length + np.pi * width**2 / 4, rel=0.05, abs=0.7)


def test_a_path_is_as_dark_at_its_corners_as_between_them():
    at = np.stack([np.linspace(5, 95, 31), np.full(31, 20.25), np.zeros(31)], axis=-1)
    pieces = Lines(np.stack([at[:-1], at[1:]], axis=1), np.tile(RED, (30, 1)), np.ones(30))
    whole = Lines(at[None, [0, -1]], np.array([RED]), np.ones(1))
    one, other = (shown(Painting.of(lines=[lines]), 100, 40)[0] for lines in (pieces, whole))
    np.testing.assert_allclose(one, other, atol=1.5 / 255)


def test_lines_are_hidden_by_what_is_nearer_and_lie_over_what_is_farther():
    line = Lines(np.array([[[0.0, 10, 0], [40, 10, 0]]]), np.array([GREEN]), np.array([4.0]))
    halves = [rectangle(0, 0, 20, 20, -1.0, RED), rectangle(20, 0, 40, 20, 1.0, BLUE)]
    image, depth = shown(Painting.of(halves, [line]), 40, 20)
    np.testing.assert_allclose(image[10, 5:18], np.broadcast_to([*GREEN, 1], (13, 4)))
    np.testing.assert_allclose(image[10, 22:35], np.broadcast_to([*BLUE, 1], (13, 4)))
    assert depth[10, 10] == pytest.approx(-1, abs=1e-3)
    near = Lines(np.array([[[10.0, 0, 9], [10, 20, 9]]]), np.array([BLUE]), np.array([4.0]))
    for order in ([line, near], [near, line]):
        crossed, _ = shown(Painting.of(lines=order), 40, 20)
        np.testing.assert_allclose(crossed[10, 10], [*BLUE, 1])


def test_what_lies_outside_the_picture_is_left_out():
    sides = [rectangle(-50, -50, 5, 500, 0.0, RED), rectangle(300, 300, 400, 400, 0.0, BLUE)]
    far = Lines(np.array([[[-90.0, -90, 0], [-80, 900, 0]]]), np.array([GREEN]), np.array([4.0]))
    image, _ = shown(Painting.of(sides, [far]), 20, 10)
    np.testing.assert_allclose(image[:, :5, 3], 1)
    np.testing.assert_allclose(image[:, 5:, 3], 0)
    empty, depth = render(NOTHING, 4, 4)
    assert empty[..., 3].max() == 0
    assert (depth == -np.inf).all()


def test_a_finer_image_shows_the_same():
    painting = Painting.of(
        [rectangle(3, 4, 13, 11, 2.0, RED)], [Lines(np.ones((1, 2, 3)), np.array([BLUE]), np.ones(1))]
    )
    image, depth = shown(painting.enlarged(3), 60, 60)
    assert image[..., 3].sum() == pytest.approx(9 * 70, abs=12)
    assert depth[20, 20] == pytest.approx(6, abs=1e-3)


def test_the_camera_looks_as_it_says():
    right, up, towards = Camera(0.0, -90.0).axes
    np.testing.assert_allclose([right, up, towards], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-12)
    A = Camera(33.0, 71.0).axes
    np.testing.assert_allclose(A @ A.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(A) == pytest.approx(1)


def test_a_fitted_view_fills_its_area():
    points = np.random.default_rng(1).normal(size=(50, 3))
    view = View.fitting(Camera(20.0, 30.0), points, np.array([10.0, 20.0]), np.array([110.0, 60.0]))
    x = view.pixels(points)[:, :2]
    np.testing.assert_allclose(x.min(axis=0) + x.max(axis=0), [120, 80])
    assert (np.ptp(x, axis=0) / [100, 40]).max() == pytest.approx(1)


def test_the_outlines_of_a_box_are_its_nine_visible_edges():
    mesh = box(np.ones(3), 0.25)
    unit = normals(mesh.points, mesh.faces)
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    ends, _, sharp = outlines(mesh.faces, unit, unit @ Camera(30.0, 40.0).axes[2] > 0)
    length = np.linalg.norm(mesh.points[ends[:, 0]] - mesh.points[ends[:, 1]], axis=1)
    assert length.sum() == pytest.approx(9)
    assert sharp.all()


def test_faces_turned_away_are_not_painted():
    mesh = box(np.ones(3), 1.0)
    view = View(Camera(30.0, 40.0), 10.0, np.zeros(2))
    triangles, lines = painted(view, mesh.points, mesh.faces, np.ones((6, 4, 3)), 1.0, 0.6)
    assert len(triangles.corners) == 6
    assert len(lines.ends) == 9


@pytest.mark.parametrize("elev", [8.0, 25.0, 60.0])
@pytest.mark.parametrize("azim", [-75.0, -52.0, -20.0])
def test_outlines_are_drawn_from_end_to_end(elev, azim):
    mesh = box(np.array([0.5, 0.4, 0.1]), 1.0)
    view = View.fitting(Camera(elev, azim), mesh.points, np.array([10.0, 10.0]), np.array([290.0, 190.0]))
    white = np.ones((len(mesh.faces), 4, 3))
    triangles, lines = painted(view, mesh.points, mesh.faces, white, 1.0, 1.0, ink=0.0)
    image, _ = shown(Painting.of([triangles], [lines]), 300, 200)
    over = np.where(image[..., 3] > 0, image[..., 0], 1.0)
    for one, other in lines.ends[..., :2]:
        share = np.linspace(0.02, 0.98, 400)[:, None]
        column, row = (one + share * (other - one)).astype(int).T
        darkest = np.min([over[row + i, column + j] for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)
        assert darkest.max() < 0.55
