"""Drafts stand on posts that bend, and come with STEP and DXF files of their volume."""

from itertools import product

import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.fem import as_beams, body_solids, filleted, solids
from flexura.full_order import assemble, plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.modelfile import save
from flexura.outlines import read_dxf
from flexura.study.questions import questions
from flexura.synthesis import Candidate, Candidates, WishFile, making, room_of, topologies
from flexura.synthesis.drafts import draft
from flexura.synthesis.making import made
from synthesis.test_classics import wish

RHO = 2810.0
WIRE = 0.15e-3


def first(name: str, shape: str = "box"):
    """The mechanism of the first topology whose name has some words."""
    own = wish(["x"], (0.0, 0.0, 0.0), process="wire-cut")
    box = own.platform.model_copy(update={"shape": shape})
    own = own.model_copy(update={"envelope": (0.06, 0.06, 0.04), "platform": box})
    room = room_of(own)
    topology = next(each for each in topologies(room, "wire-cut", 3e-4) if name in each.name)
    return draft(topology, WishFile(wish=own), room, name)


@pytest.fixture(scope="module")
def leaves():
    """Two upright leaves, cut by a wire."""
    return first("2 upright leaves below")


def candidates(folder, *mechanisms):
    """Candidates with their files in a folder."""
    found = []
    for k, mechanism in enumerate(mechanisms, 1):
        save(mechanism, folder / f"candidate-0{k}.yaml")
        found.append(Candidate(f"candidate-0{k}.yaml", mechanism.name, "1T", 2, 1, 20.0, 10.0, 100.0, 0.03, ()))
    return Candidates("guide", "1T", 1, 1, 1, tuple(found), {})


@pytest.mark.parametrize("name", ["2 tangential leaves", "1 upright folded guide", "2 upright leaves below"])
def test_feet_are_on_blocks_that_are_held_at_the_base_and_bend(name):
    mechanism = first(name)
    assert not mechanism.ground
    blocks = [own for own in body_solids(assemble(with_rigid_bodies(mechanism))) if ".base" in own.name]
    part = next(iter(mechanism.substructures.values()))
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    for own in blocks:
        corners = own.centre + signs * own.half @ own.axes
        assert (np.abs(corners - [0.0, 0.0, 0.02]).max(axis=0) < np.array([0.03, 0.03, 0.02]) + 1e-9).all()
        if part.bodies[own.name.split(".")[-1]].held is not None:
            assert corners[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert any(own.held is not None for own in part.bodies.values())
    stiff, bending = (
        float(questions(plan_of(own), "compliance(platform.y)").values({}).value[0, 0])
        for own in (with_rigid_bodies(mechanism), mechanism)
    )
    assert bending > 1.001 * stiff


def test_step_and_dxf_have_the_volume_of_the_candidate(leaves, tmp_path):
    occ = pytest.importorskip("netgen.occ")
    pytest.importorskip("ezdxf")
    (found,) = made(candidates(tmp_path, leaves), tmp_path, False, lambda _: None)
    assert found.candidates[0].made == ("candidate-01.step", "candidate-01.dxf")
    assert not found.candidates[0].not_made
    shape = occ.OCCGeometry(str(tmp_path / "candidate-01.step")).shape
    model = assemble(with_rigid_bodies(as_beams(leaves, "auto")))
    width = float(leaves.parameters["a_width"].value)
    mass = float(questions(model.plan, "mass").values({}).value[0, 0])
    fillets = 8 * (1 - np.pi / 4) * WIRE**2 * width
    assert shape.mass * 1e-9 == pytest.approx(mass / RHO + fillets, rel=1e-6)
    outline = read_dxf(tmp_path / "candidate-01.dxf")
    assert not outline.notes
    assert {round(own.radius, 9) for own in outline.segments if not own.is_line} == {WIRE}
    members, bodies = filleted(model, solids(model)), body_solids(model)
    along = members[0].axes[1]
    area = sum(own.volume / (2 * float(own.outline.y[0])) for own in members)
    area += sum(own.volume / (2 * float(np.abs(own.axes @ along) @ own.half)) for own in bodies)
    assert outline.area == pytest.approx(area, rel=1e-6)
    assert len(outline.loops) == 1


def test_what_is_cut_from_several_sides_has_no_dxf_and_is_told(tmp_path):
    pytest.importorskip("netgen.occ")
    (found,) = made(candidates(tmp_path, first("2 upright leaves below", "cylinder")), tmp_path, False, lambda _: None)
    own = found.candidates[0]
    assert own.made == ("candidate-01.step",)
    assert "platform is a cylinder across the line of the cut" in own.not_made[0]
    assert not (tmp_path / "candidate-01.dxf").exists()


def test_what_is_made_is_kept_and_what_cannot_be_made_is_told(leaves, tmp_path, monkeypatch):
    asked = []

    def refused(*_, **__):
        asked.append(1)
        raise OptionError("netgen is not installed")

    for name in ("write_step", "cut_profile", "verify"):
        monkeypatch.setattr(making, name, refused)
    own = candidates(tmp_path, leaves)
    for _ in range(2):
        *_, found = made(own, tmp_path, True, lambda _: None)
        assert found.candidates[0].made == ()
        assert found.candidates[0].not_made == ("no STEP: netgen is not installed", "no DXF: netgen is not installed")
        assert found.whole is not None
        assert "not verified whole: netgen is not installed" in found.whole.said
    assert len(asked) == 3
    save(fx.load(tmp_path / "candidate-01.yaml").replaced({"name": "another"}), tmp_path / "candidate-01.yaml")
    list(made(own, tmp_path, False, lambda _: None))
    assert len(asked) == 5


def test_the_winner_is_beside_its_solid(leaves, tmp_path, monkeypatch):
    described = fx.modes(leaves.replaced({}), n=6).frequency_hz

    class Mode:
        def __init__(self, hz, described):
            self.frequency_hz, self.described_hz, self.uncertainty = hz, described, 1e-3
            self.difference = described / hz - 1

    class Solved:
        modes = (Mode(0.999 * described[0], described[0]), Mode(0.5 * described[1], described[1]))
        seconds, notes = 2.0, ("held",)

    monkeypatch.setattr(making, "verify", lambda *_, **__: Solved())
    monkeypatch.setattr(making, "without_fillets", lambda own: own)
    monkeypatch.setattr(making, "_files", lambda *_: ([], []))
    *_, found = made(candidates(tmp_path, leaves), tmp_path, True, lambda _: None)
    assert found.whole is not None
    assert [own.is_within for own in found.whole.modes] == [True, False]
    assert "1 of 2 modes within the model error" in found.whole.said
    assert found.to_dict()["whole"]["modes"][1]["difference"] == pytest.approx(1.0)
