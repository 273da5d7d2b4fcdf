"""Every example runs, is clean of missing modes where it says so, and does what its description promises."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura
from flexura.mechanism import with_rigid_roots

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(EXAMPLES.glob("*/*.yaml"))


def load(name: str) -> flexura.Mechanism:
    return flexura.load(EXAMPLES / name / f"{name}.yaml")


def test_there_are_at_least_five_kinds() -> None:
    assert len(FILES) >= 6


@pytest.mark.parametrize("file", FILES, ids=lambda p: p.stem)
def test_example_has_modes_with_evidence(file: Path) -> None:
    result = flexura.modes(flexura.load(file), n=6)
    evidence = result.evidence
    assert (np.diff(result.frequency_hz) >= 0).all()
    assert evidence.mass_error < 1e-12
    assert evidence.inertia_error < 1e-9
    assert evidence.rigid_body_residual < 1e-13
    assert evidence.full_residual < 1e-6
    assert evidence.rigid_body_modes == 0
    assert evidence.sturm_count == len(evidence.missed) + evidence.more_missed + sum(
        mode.full_frequency_hz is not None and mode.full_frequency_hz <= evidence.sturm_below_hz
        for mode in result.modes
    )


@pytest.mark.parametrize("file", FILES, ids=lambda p: p.stem)
def test_example_survives_being_written_and_read(file: Path) -> None:
    mechanism = flexura.load(file)
    assert flexura.loads(flexura.dumps(mechanism)) == mechanism


def test_rpr_has_the_order_and_the_pattern_of_the_paper() -> None:
    """Order 54; three parasitic modes of the platform before two rotations and the lift."""
    result = flexura.modes(load("rpr"), n=6)
    assert (result.order, result.full_order) == (54, 1062)
    kinds = []
    for mode in result.modes:
        body = mode.motion.bodies[0]
        vector = body.rotation if body.kind == "rotation" else body.translation
        kinds.append(body.kind[0] + "xyz"[int(np.argmax(np.abs(vector)))])
    assert set(kinds[:3]) == {"tx", "ty", "rz"}
    assert set(kinds[3:]) == {"rx", "ry", "tz"}
    assert max(mode.relative_error or 0.0 for mode in result.modes) < 1e-3


def test_rpr_reduction_is_blind_to_the_amplifiers_own_modes_and_says_so() -> None:
    mechanism = load("rpr")
    blind = flexura.modes(mechanism, n=12)
    assert not blind.evidence.complete
    assert all("half_ring" in missed.summary for missed in blind.evidence.missed)
    seeing = flexura.modes(mechanism, n=12, keep=3)
    assert seeing.evidence.complete
    assert max(abs(mode.relative_error or 1.0) for mode in seeing.modes) < 3e-3


def test_guide_follows_the_closed_form() -> None:
    """f = sqrt(24 E I / L^3 / m) / 2 pi, with the carriage and 13/35 of each leaf's mass moving (Rayleigh).

    Between rigid ends that hold it flat the wide leaf is stiffer, by less than 1/(1 - nu^2).
    """
    result = flexura.modes(load("guide").model_copy(update={"corrections": "none"}), n=1)
    E, width, t, L = 206e9, 20e-3, 0.5e-3, 60e-3
    carriage, leaf = 2700 * 70e-3 * 20e-3 * 10e-3, 7850 * width * t * L
    k = 24 * E * width * t**3 / 12 / L**3
    expected = np.sqrt(k / (carriage + 2 * leaf * 13 / 35)) / (2 * np.pi)
    assert result.frequency_hz[0] == pytest.approx(expected, rel=2e-4)
    nu = 206 / (2 * 79.5) - 1
    held = flexura.modes(with_rigid_roots(load("guide")), n=1).frequency_hz[0]
    assert 1.01 < held / expected < np.sqrt(1 / (1 - nu**2))


def test_pivot_turns_first_and_far_below_the_rest() -> None:
    """The stiffness of a cross pivot of two leaves crossing at their middles is 2 E I / L for pure moments."""
    mechanism = load("pivot").model_copy(update={"corrections": "none"})
    result = flexura.modes(mechanism, n=2)
    E, Iy, L = 206e9, 10e-3 * (0.3e-3) ** 3 / 12, 40e-3
    # Haringx (1949): K = 2 E I / L for a symmetric 90 degree cross pivot; the arm turns about the crossing
    half = L / 2 * np.cos(np.pi / 4)
    sides = np.array([2 * half + 10e-3, 20e-3])
    mass = 7810 * sides[0] * sides[1] * 20e-3
    inertia = mass * (sides**2).sum() / 12 + mass * (half + 10e-3) ** 2
    assert result.frequency_hz[0] == pytest.approx(np.sqrt(2 * E * Iy / L / inertia) / (2 * np.pi), rel=0.005)
    assert result.frequency_hz[1] > 10 * result.frequency_hz[0]


def test_symmetric_stages_have_equal_pairs() -> None:
    for name, pairs in (("tip_tilt", [(1, 2), (3, 4)]), ("xy_stage", [(1, 2), (3, 4)])):
        hz = flexura.modes(load(name), n=6).frequency_hz
        for a, b in pairs:
            assert hz[a] == pytest.approx(hz[b], rel=1e-6)


def test_mounted_stacks_stiffen_the_rpr_mechanism():
    """Section 5 of the paper: mounted actuators suppress out-of-plane motions of the amplifiers, the first modes.

    Bonded stacks raise both sideways modes by more than half, over the turn about z, a twist of leaves and hinges
    that hardly feels them, and double the working ones.
    """
    bare = flexura.modes(flexura.load(EXAMPLES / "rpr" / "rpr.yaml"), n=6).frequency_hz
    mounted = flexura.load(EXAMPLES / "rpr" / "rpr_piezo.yaml")
    stiff = flexura.modes(mounted, n=6)
    assert "turns about z" in stiff.modes[0].motion.summary
    turn, *sideways = stiff.frequency_hz[:3]
    assert (sideways > 1.5 * bare[:2]).all() and (stiff.frequency_hz[3:] > 1.8 * bare[3:]).all()
    assert 1.0 < turn / bare[2] < 1.03
    tips = dict.fromkeys(("piezo_stiffness",), 1e-3)
    soft = flexura.modes(mounted, {**tips, "piezo_mass": 0.0}, n=6).frequency_hz
    assert abs(soft / bare - 1).max() < 0.02
