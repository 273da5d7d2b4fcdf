"""Animations: they swing, loop without a seam, and are written whole or not at all."""

import shutil
import subprocess

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv
from PIL import Image

import flexura as fx
from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.view import Animation, animate_mode, animate_stroke, save_animation, save_modes, save_stroke
from helpers.pictures import guide
from helpers.shell import flexura


@pytest.fixture(scope="module")
def model():
    return assemble(guide())


@pytest.fixture(scope="module")
def sideways(model):
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:, 0] = np.clip(model.geometry.positions[:, 2] / 0.05, 0, 1)
    return u


@pytest.fixture(scope="module")
def film(model, sideways):
    return animate_mode(model, sideways, title="mode 1: 32.8 Hz", elev=10, azim=-80)


@pytest.fixture(scope="module")
def stroke():
    return fx.stroke(guide(), move={"stage.x": (-2e-3, 2e-3)}, steps=5, n=1)


def middle(image):
    """Where the colours of the picture are, across, pixels; text, ghost and colour bar are left out."""
    area = image[130:560, 20:680]
    coloured = (rgb_to_hsv(area / 255.0)[..., 1] > 0.4) & (np.arange(430) < 160)[:, None]
    assert coloured.sum() > 500
    return float(np.nonzero(coloured)[1].mean())


def test_a_mode_swings_to_both_sides_and_back(film):
    assert film.images.shape == (24, 600, 800, 3)
    at = np.array([middle(image) for image in film.images])
    swing = at - at[[6, 18]].mean()
    assert abs(swing[0]) > 10
    np.testing.assert_allclose(swing, swing[0] * np.cos(2 * np.pi * np.arange(24) / 24), atol=0.08 * abs(swing[0]))


def test_the_loop_has_no_seam(film):
    moved = np.abs(np.diff(film.images[[*range(24), 0]].astype(int), axis=0)).mean(axis=(1, 2, 3))
    assert moved[-1] == pytest.approx(moved[0])
    assert moved.max() < 1.6 * np.sort(moved)[-4]


def test_what_stands_still_stays(film):
    still = film.images[:, :90]
    assert (still == still[0]).all()
    assert still.min() < 60
    assert (film.images[:, -1, 0] == 255).all()


def test_a_gif_and_a_webp_loop_with_all_frames(film, tmp_path):
    for name, near in (("mode.gif", 12), ("mode.webp", 25)):
        path = save_animation(film, tmp_path / name)
        assert path.stat().st_size < 2e6
        with Image.open(path) as found:
            assert found.n_frames == 24 and found.size == (800, 600) and found.info["loop"] == 0
            for k in (0, 7, 12, 23):
                found.seek(k)
                off = np.abs(np.asarray(found.convert("RGB")).astype(int) - film.images[k])
                assert np.percentile(off, 99) < near, (name, k)
                assert found.info["duration"] == 50


@pytest.mark.skipif(shutil.which("ffprobe") is None, reason="needs ffmpeg")
def test_an_mp4_has_its_size_and_time(film, tmp_path):
    path = save_animation(film, tmp_path / "mode.mp4")
    shown = ["-show_entries", "stream=width,height,nb_frames,pix_fmt", "-of", "csv=p=0", str(path)]
    found = subprocess.run(["ffprobe", "-v", "error", *shown], capture_output=True, text=True, check=True).stdout
    assert found.strip() == "800,600,yuv420p,72"
    assert path.stat().st_size < 2e6


def test_without_ffmpeg_the_way_out_is_said(film, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(OptionError, match=r"needs the program ffmpeg.*apt-get install ffmpeg.*gif or webp"):
        save_animation(film, tmp_path / "mode.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["mode.avi", "mode", "mode.png"])
def test_other_files_are_refused(film, tmp_path, name):
    with pytest.raises(OptionError, match="gif, webp or mp4"):
        save_animation(film, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_what_is_no_animation_is_refused(tmp_path, model, sideways):
    with pytest.raises(OptionError, match="animate_mode"):
        save_animation("film", tmp_path / "film.gif")
    for frames in (3, 1000, 7.5):
        with pytest.raises(OptionError, match="frames"):
            animate_mode(model, sideways, title="m", frames=frames)
    assert "24 frames of 8 x 6 pixels, 1.2 s" in repr(Animation(np.zeros((24, 6, 8, 3), dtype=np.uint8)))


def test_a_stroke_goes_there_and_back(stroke):
    film = animate_stroke(stroke)
    assert len(film.images) == 8
    for k in (1, 2, 3):
        assert (film.images[k] == film.images[8 - k]).all()
    assert (film.images[0] != film.images[4]).any(axis=-1).mean() > 0.02
    assert (rgb_to_hsv(film.images[0][100:560, :680] / 255.0)[..., 1] > 0.6).mean() > 0.001
    assert len(animate_stroke(stroke, [0, 2, 4]).images) == 4
    with pytest.raises(OptionError, match="numbers from 0 to 4"):
        animate_stroke(stroke, [0, 9])


def test_modes_and_strokes_are_saved_in_motion_too(stroke, tmp_path):
    result = fx.modes(guide(), n=2)
    names = [path.name for path in save_modes(result, tmp_path / "a", animate="gif", magnify=2.0, dpi=60)]
    assert names == ["mechanism.png", "mode_01.png", "mode_02.png", "modes.png", "mode_01.gif", "mode_02.gif"]
    with Image.open(tmp_path / "a" / "mode_01.png") as found:
        assert found.size == (480, 360)
    names = [path.name for path in save_stroke(stroke, tmp_path / "b", animate="webp")]
    assert names == ["stroke.png", "poses.png", "stroke.webp"]
    with pytest.raises(OptionError, match="gif, webp or mp4"):
        save_modes(result, tmp_path / "c", animate="avi")
    with pytest.raises(OptionError, match="magnify"):
        save_modes(result, tmp_path / "c", magnify=np.nan)
    assert not (tmp_path / "c").exists()


def test_the_shell_writes_animations_where_it_plots(tmp_path):
    file = tmp_path / "guide.yaml"
    fx.save(guide(), file)
    done = flexura("modes", str(file), "-n", "1", "--plot", str(tmp_path / "out"), "--animate", "gif")
    assert done.returncode == 0 and (tmp_path / "out" / "mode_01.gif").exists()
    done = flexura("modes", str(file), "--animate", "gif")
    assert done.returncode != 0 and "belongs to --plot" in done.stderr
