"""Pictures as files: whole or not at all, and errors that say what is wrong."""

import errno
import struct
from pathlib import Path

import numpy as np
import pytest

from flexura.errors import FlexuraError, OptionError
from flexura.full_order import assemble
from flexura.mechanism import Circle, Link, Mechanism
from flexura.view import save_pictures
from flexura.view.mechanisms import files as view_files


@pytest.fixture(scope="module")
def model():
    bar = Link(nodes=("a", "b"), material="Al-7075-T6", section=Circle(diameter=0.01))
    return assemble(Mechanism(nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)}, links={"bar": bar}, ground={"a": "clamped"}))


@pytest.fixture(scope="module")
def shapes(model):
    x = model.geometry.positions[:, 0]
    u = np.zeros((len(x), 6, 1))
    u[:, 2, 0] = x**2
    return u


def size_of(path: Path) -> tuple[int, int]:
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-8:-4] == b"IEND"
    width, height = struct.unpack(">II", data[16:24])
    return width, height


def test_all_pictures_are_written_and_nothing_else(model, shapes, tmp_path):
    folder = tmp_path / "new" / "pictures"
    paths = save_pictures(model, folder, shapes=shapes, titles=["mode 1: 75.4 Hz"], subtitles=["bar bends"])
    assert paths == [folder / name for name in ("mechanism.png", "mode_01.png", "modes.png")]
    assert sorted(folder.iterdir()) == sorted(paths)
    assert [size_of(p) for p in paths] == [(1200, 900), (1200, 900), (1800, 660)]
    assert oct(paths[0].stat().st_mode)[-3:-1] == oct(probe_mode(tmp_path))[-3:-1]


def probe_mode(folder: Path) -> int:
    probe = folder / "probe"
    probe.write_bytes(b"")
    return probe.stat().st_mode


def test_the_mechanism_alone_replaces_an_old_picture(model, tmp_path):
    (tmp_path / "mechanism.png").write_bytes(b"old")
    assert save_pictures(model, str(tmp_path)) == [tmp_path / "mechanism.png"]
    assert size_of(tmp_path / "mechanism.png") == (1200, 900)
    assert len(list(tmp_path.iterdir())) == 1


def test_a_folder_that_is_a_file_is_refused_before_anything_is_drawn(model, tmp_path, monkeypatch):
    monkeypatch.setattr(view_files, "draw_mechanism", lambda *_, **__: pytest.fail("drawn in vain"))
    (tmp_path / "file").write_text("x")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(OptionError, match="file"):
            save_pictures(model, folder)
    assert (tmp_path / "file").read_text() == "x"


def test_a_folder_that_cannot_be_written_is_refused(model, tmp_path, monkeypatch):
    monkeypatch.setattr(view_files.os, "access", lambda *_: False)
    with pytest.raises(OptionError, match="permission denied"):
        save_pictures(model, tmp_path)


def test_a_full_disk_leaves_the_old_files_and_no_rubbish(tmp_path, monkeypatch):
    (tmp_path / "a.png").write_bytes(b"old")
    write = Path.write_bytes

    def full(self, data):
        if self.name == "b.png":
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(self, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(FlexuraError, match="No space left"):
        view_files.write_files({"a.png": b"new", "b.png": b"new"}, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]
    assert (tmp_path / "a.png").read_bytes() == b"old"


def test_a_picture_that_fails_leaves_nothing_behind(model, shapes, tmp_path, monkeypatch):
    def broken(*_, **__):
        raise OptionError("broken")

    monkeypatch.setattr(view_files, "draw_mode", broken)
    with pytest.raises(OptionError, match="broken"):
        save_pictures(model, tmp_path, shapes=shapes, titles=["m"], subtitles=[""])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("titles", "subtitles"), [([], []), (["a", "b"], ["", ""]), (["a"], [])])
def test_titles_that_do_not_match_the_shapes_are_refused(model, shapes, titles, subtitles, tmp_path):
    with pytest.raises(OptionError, match="titles"):
        save_pictures(model, tmp_path / "none", shapes=shapes, titles=titles, subtitles=subtitles)
    assert not (tmp_path / "none").exists()
