"""Leaves of few elements at low order: against the full order, at rest, over a stroke and over time."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.motion import MovingModel, TurningModel, against_full, kept_frames
from flexura.motion.leaves import beams_of
from flexura.motion.substructures import partition
from helpers.large_motion import Moved

GUIDE = (Path(__file__).parents[2] / "examples/guide/guide.yaml").read_text()
LEAF = "profile: {type: leaf, width: width, thickness: thickness}"
LENGTH = 0.06


@cache
def guide(elements: int, corrections: str = "auto") -> fx.Mechanism:
    """Two leaves 60 x 20 x 0.5 mm in so many elements."""
    text = GUIDE.replace(LEAF, f"{LEAF}\n        elements: {elements}")
    return fx.loads(text.replace("flexura: 1", f"flexura: 1\ncorrections: {corrections}"))


def low_order(full: MovingModel, pieces: int) -> TurningModel:
    """Its leaves in so many pieces."""
    kept = kept_frames(full)
    names = [own.name for kind in partition(full, kept) for own in kind]
    return TurningModel.of(full, kept, pieces=dict.fromkeys(names, pieces))


@pytest.mark.parametrize("pieces", [2, 3, 4])
def test_stiffness_at_rest_is_that_of_the_full_order(pieces: int) -> None:
    """Pieces that cut elements have their compliances summed over parts of these; the rest is that of uniform beams."""
    full = MovingModel.of(fx.assemble(guide(10)).design)
    turning = low_order(full, pieces)
    (leaf, _) = turning.leaves[0]
    none = np.zeros((1, 6))
    few, exact = (own.condensed(none).tangent[0] for own in (turning.as_substructure(leaf), leaf.of))
    size = np.sqrt(np.diag(exact))
    assert np.abs((few - exact) / size / size[:, None]).max() < 1e-3
    bending = [0, 1, 2, 4, 5]
    assert few[bending, bending] == pytest.approx(exact[bending, bending], rel=1e-9 if pieces == 2 else 2e-4)


def test_errors_fall_with_the_length_of_pieces_and_are_told() -> None:
    """The guide of plain beams at a fifth of its length: 16 elements a leaf are off by 1e-6 themselves."""
    full = Moved(guide(16, "none"), "carriage.x")
    targets = [[0.1 * LENGTH], [0.2 * LENGTH]]
    exact = [pose.state for pose in full.through(targets)]
    off, told = [], []
    for pieces in (2, 4):
        turning = low_order(full.model, pieces)
        low = full.at_low_order(turning.low)
        states = [pose.state for pose in low.through(targets)]
        off.append(max(abs(own.drive[0] / other.drive[0] - 1) for own, other in zip(states, exact, strict=True)))
        told.append(against_full(turning, low.equations, full.equations, states).error.max())
    assert turning.low.n_dof <= 60
    assert off[1] < 2e-4
    assert off[0] / off[1] > 8
    for own, estimate in zip(off, told, strict=True):
        assert own / 5 < estimate < 5 * own


def test_a_stroke_takes_as_many_pieces_as_it_needs() -> None:
    move = {"carriage.x": (0.0, 0.2 * LENGTH)}
    short, far = (
        fx.stroke(guide(10), move={"carriage.x": (0.0, end)}, steps=2, n=1, order="low") for end in (1e-4, 0.2 * LENGTH)
    )
    assert short.low_order is not None and far.low_order is not None
    assert not short.low_order.leaves
    assert set(far.low_order.leaves.values()) <= {3, 4}
    assert far.low_order.coordinates <= 42 < far.low_order.full
    assert "elements of leaves" in far.low_order.note
    full = fx.stroke(guide(10), move=move, steps=2, n=1)
    assert far.poses[-1].reaction["carriage.x"] == pytest.approx(full.poses[-1].reaction["carriage.x"], rel=1e-3)


@pytest.mark.parametrize(("modulus", "own"), [("69 GPa", 0), ("0.1 GPa", 6)])
def test_bodies_bend_by_themselves_where_that_matters(modulus: str, own: int) -> None:
    """A carriage of aluminium, and one of rubber whose bending is among the first three modes: 18 coordinates of the
    carriage and of the joints of two leaves, those of modes of leaves, and six of how the carriage bends."""
    soft = f"materials: {{soft: {{E: {modulus}, nu: 0.33, rho: 2700 kg/m^3}}}}\nsubstructures:"
    mechanism = fx.loads(GUIDE.replace("Al-6061-T6", "soft").replace("substructures:", soft))
    move = {"carriage.x": (0.0, 1e-4)}
    low, full = (fx.stroke(mechanism, move=move, steps=2, n=3, order=order) for order in ("low", "full"))
    assert low.low_order is not None
    assert low.low_order.coordinates == 18 + 2 + own
    for one, other in zip(low.poses, full.poses, strict=True):
        assert one.frequency_hz == pytest.approx(other.frequency_hz, rel=1e-3)


def test_forces_that_are_round_off_ask_for_no_finer_leaves() -> None:
    """A pivot that its weight all but balances stands under its weight first, where nothing is driven yet."""
    mechanism = fx.load(Path(fx.__file__).parent / "gallery/zero_stiffness.yaml")
    low, full = (fx.stroke(mechanism, move={"beam.ry": (0.0, 0.2)}, steps=3, n=1, order=own) for own in ("low", "full"))
    assert low.low_order is not None
    assert low.low_order.coordinates == 24 and set(low.low_order.leaves.values()) == {2}
    assert low.poses[-1].reaction["beam.ry"] == pytest.approx(full.poses[-1].reaction["beam.ry"], rel=1e-4)


def test_a_leaf_is_a_whole_member() -> None:
    full = MovingModel.of(fx.assemble(guide(10)).design)
    kept = kept_frames(full)
    (leaf, _), *_ = partition(full, kept)
    assert beams_of(leaf) is not None
    kept[leaf.frames[5]] = True
    assert all(beams_of(own) is None for kind in partition(full, kept) for own in kind if own.name == leaf.name)


def test_free_motion_of_a_guide_of_long_leaves() -> None:
    """Leaves 100 x 30 x 0.5 mm let go from 15 mm: positions and the time to the first zero at no more than 60
    coordinates are those of 16 elements a leaf."""
    text = GUIDE.replace(LEAF, f"{LEAF}\n        elements: 16")
    mechanism = fx.loads(text.replace("value: 60 mm", "value: 100 mm").replace("value: 20 mm", "value: 30 mm"))
    found = [
        fx.time_response(
            mechanism,
            start={"carriage.tx": 25.0},
            outputs=["carriage.tx", "carriage.tz"],
            dt=4e-4,
            duration=0.016,
            motion="large",
            order=order,
            rho_infinity=0.6,
        )
        for order in ("low", "full")
    ]
    low, full = (own.response for own in found)
    assert abs(full[0, 0]) > 0.014
    size = np.abs(full).max(axis=1)
    assert (np.abs(low - full).max(axis=1) / size < [2e-3, 1e-2]).all()
    zeros = [np.interp(0.0, -own[0], found[0].time) for own in (low, full)]
    assert zeros[0] == pytest.approx(zeros[1], rel=1e-3)
    note = next(note for note in found[0].notes if "coordinates" in note)
    assert int(note.split(" coordinates")[0].rsplit(" ", 1)[1]) <= 60
