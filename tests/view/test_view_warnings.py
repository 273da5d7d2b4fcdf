"""Pictures carry the warnings of what they show, in sight and on top of nothing."""

from dataclasses import replace

import pytest

from flexura.analysis import modes
from flexura.errors import Diagnostic
from flexura.view import save_modes
from helpers.pictures import assert_no_overlap, guide


def texts_of(result, folder, monkeypatch):
    """What each picture of modes says, by file."""
    said = {}

    def png(figure):
        assert_no_overlap(figure)
        said[len(said)] = "\n".join(t.get_text() for t in figure.texts)
        return b""

    monkeypatch.setattr("flexura.view.mechanisms.files._png", png)
    paths = save_modes(result, folder)
    return {path.name: said[k] for k, path in enumerate(paths)}


def test_pictures_of_modes_say_what_is_not_proven(tmp_path, monkeypatch):
    blind = modes(guide(), n=2, keep=0)
    hz = blind.modes[0].frequency_hz
    far = replace(blind.modes[0], missed=True, interval_hz=(0.5 * hz, hz))
    lost = replace(blind.modes[1], frequency_hz=0.0, interval_hz=(0.0, 1e-7))
    warnings = (
        Diagnostic("tolerance", "mode 1", 1.0, 1e-3, "1", "mode 1 is only within 100 % proven, " + "and so on " * 20),
        Diagnostic("proof", "mode 2", 1e-7, 0.0, "Hz", "mode 2 is indistinguishable from zero, " + "and so on " * 20),
        Diagnostic("proof", "", 9.0, 2.0, "1", "the model lacks 7 of the 9 modes"),
    )
    own = replace(blind, modes=(far, lost), warnings=warnings)
    said = texts_of(own, tmp_path, monkeypatch)
    assert "warning" not in said["mechanism.png"]
    assert "warning: mode 1 is only within 100 % proven" in said["mode_01.png"]
    assert "mode 2" not in said["mode_01.png"]
    assert "mode 2: below 1e-07 Hz" in said["mode_02.png"]
    for name in ("mode_01.png", "mode_02.png", "modes.png"):
        assert "warning: the model lacks 7 of the 9 modes" in said[name]
    assert "proven only within 100 %" in said["modes.png"] and "is indistinguishable from zero" in said["modes.png"]


def test_pictures_of_proven_modes_are_plain(tmp_path, monkeypatch):
    said = texts_of(modes(guide(), n=2, order="full"), tmp_path, monkeypatch)
    assert not any("warning" in text or "not proven" in text for text in said.values())


def test_pictures_of_modes_tell_both_margins_apart(tmp_path, monkeypatch):
    found = modes(guide(), n=2)
    said = {name: text.replace("\n", " ") for name, text in texts_of(found, tmp_path, monkeypatch).items()}
    for mode, error in zip(found.modes, found.model_errors.texts, strict=True):
        told = f"proven: {mode.proven_text}, model error: {error}; {mode.motion.summary}"
        assert told in said[f"mode_0{mode.number}.png"] and told in said["modes.png"]


@pytest.mark.slow
def test_pictures_of_rigid_motions_say_so(tmp_path, monkeypatch):
    said = texts_of(modes(guide().model_copy(update={"ground": {}}), n=7, order="full"), tmp_path, monkeypatch)
    assert "mode 6: 0 Hz, rigid motion" in said["mode_06.png"]
    assert "rigid" not in said["mode_07.png"]
