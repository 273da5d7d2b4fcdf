"""Rotations, member frames, rigid arms."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from flexura.beam import block_rotation, member_frame, rigid_arm, skew
from flexura.mechanism.placement import rotation_matrix

RNG = np.random.default_rng(7)


def test_skew_is_the_cross_product():
    v, w = RNG.normal(size=(2, 5, 4, 3))
    assert_allclose((skew(v) @ w[..., None])[..., 0], np.cross(v, w), rtol=1e-14, atol=1e-15)
    assert_array_equal(skew(v), -np.swapaxes(skew(v), -1, -2))


def test_rigid_arm_moves_points_and_composes():
    d, e = RNG.normal(size=(2, 6, 3))
    t, r = RNG.normal(size=(2, 6, 3))
    moved = (rigid_arm(d) @ np.concatenate([t, r], axis=-1)[..., None])[..., 0]
    assert_allclose(moved[..., :3], t + np.cross(r, d), rtol=0, atol=1e-14)
    assert_allclose(moved[..., 3:], r, rtol=0, atol=1e-14)
    assert_allclose(rigid_arm(d) @ rigid_arm(e), rigid_arm(d + e), rtol=0, atol=1e-13)


def test_rigid_arm_is_the_small_rotation_limit():
    axis, d, angle = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.1, -0.2]), 1e-7
    displaced = rotation_matrix(axis, angle) @ d - d
    u = np.concatenate([np.zeros(3), angle * axis / np.linalg.norm(axis)])
    assert_allclose((rigid_arm(d) @ u)[:3], displaced, rtol=0, atol=1e-14)


def test_member_frame_is_right_handed_with_the_axes_as_rows():
    axis, reference = RNG.normal(size=(2, 8, 5, 3))
    R = member_frame(axis, reference)
    assert_allclose(R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), rtol=0, atol=1e-13)
    assert_allclose(np.linalg.det(R), 1.0, rtol=1e-13)
    length = np.linalg.norm(axis, axis=-1)
    local_axis = (R @ axis[..., None])[..., 0]
    assert_allclose(local_axis, np.stack([length, 0 * length, 0 * length], axis=-1), rtol=0, atol=1e-13)
    local_reference = (R @ reference[..., None])[..., 0]
    assert np.all(np.abs(local_reference[..., 1]) < 1e-13)
    assert np.all(local_reference[..., 2] > 0)


def test_member_frame_of_the_global_axes_is_the_identity():
    assert_array_equal(member_frame([2.0, 0, 0], [5.0, 0, 0.1]), np.eye(3))
    assert_array_equal(member_frame([0, 3.0, 0], [0, 0, 1.0]), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])


def test_degenerate_frames_are_nan_without_warning():
    assert np.isnan(member_frame(np.zeros(3), [0, 0, 1.0])).all()
    assert np.isnan(member_frame([1.0, 0, 0], [2.0, 0, 0])[1:]).all()


def test_member_frame_broadcasts():
    assert member_frame(RNG.normal(size=(4, 1, 3)), RNG.normal(size=(5, 3))).shape == (4, 5, 3, 3)


def test_block_rotation_rotates_both_halves():
    R = member_frame([1.0, 2.0, 3.0], [0, 0, 1.0])
    t, r = RNG.normal(size=(2, 3))
    assert_allclose(block_rotation(R) @ np.concatenate([t, r]), np.concatenate([R @ t, R @ r]), rtol=0, atol=1e-15)


def test_rotation_matrix_against_scipy():
    axis, angle = RNG.normal(size=(20, 3)), RNG.uniform(-6, 6, size=20)
    unit = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
    expected = Rotation.from_rotvec(angle[:, None] * unit).as_matrix()
    assert_allclose(rotation_matrix(axis, angle), expected, rtol=0, atol=1e-14)
    assert_allclose(rotation_matrix([0, 0, 2.0], np.pi / 2) @ [1.0, 0, 0], [0, 1, 0], rtol=0, atol=1e-15)
