"""The cache of arrays: equal content is found again, everything else is computed."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from flexura.errors import OptionError
from flexura.fem import cache
from flexura.fem.cache import cache_folder, content_key, remembered
from helpers.solid_boxes import box


class Counter:
    """A computation that counts how often it is asked for."""

    def __init__(self):
        self.count = 0

    def __call__(self):
        self.count += 1
        return {"a": np.arange(5.0), "names": np.array(["x", "yy"])}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("FLEXURA_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_computes_once_and_reads_back_the_same(folder):
    compute = Counter()
    first = remembered("matrices", [1, "a"], compute)
    second = remembered("matrices", [1, "a"], compute)
    assert compute.count == 1
    assert {*first} == {*second} == {"a", "names"}
    assert all(np.array_equal(first[k], second[k]) and first[k].dtype == second[k].dtype for k in first)
    assert [path.suffix for path in folder.iterdir()] == [".npz"]


@pytest.mark.parametrize("damage", [b"", b"no archive at all", None])
def test_damaged_files_are_computed_again_and_mended(folder, damage):
    compute = Counter()
    remembered("matrices", 1, compute)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    assert np.array_equal(remembered("matrices", 1, compute)["a"], np.arange(5.0))
    assert compute.count == 2
    remembered("matrices", 1, compute)
    assert compute.count == 2


def test_flipped_bytes_are_noticed(folder):
    compute = Counter()
    remembered("matrices", 1, compute)
    (path,) = folder.iterdir()
    raw = bytearray(path.read_bytes())
    at = raw.find(np.arange(5.0).tobytes())
    raw[at + 12] ^= 0x55
    path.write_bytes(bytes(raw))
    assert np.array_equal(remembered("matrices", 1, compute)["a"], np.arange(5.0))
    assert compute.count == 2


def test_a_file_of_another_content_is_not_taken(folder):
    compute = Counter()
    remembered("matrices", 1, compute)
    (path,) = folder.iterdir()
    other = folder / path.name.replace(path.stem.split("-")[1], content_key("matrices", 2)[:40])
    path.rename(other)
    remembered("matrices", 2, compute)
    assert compute.count == 2


def test_off_keeps_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("FLEXURA_CACHE", "off")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    compute = Counter()
    for _ in range(2):
        remembered("matrices", 1, compute)
    assert compute.count == 2 and not [*tmp_path.iterdir()] and cache_folder() is None


def test_folder_follows_the_environment(tmp_path, monkeypatch):
    monkeypatch.delenv("FLEXURA_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "flexura"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "flexura"


def test_a_folder_that_cannot_be_made_costs_only_time(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("FLEXURA_CACHE", str(tmp_path / "file" / "below"))
    assert np.array_equal(remembered("matrices", 1, Counter())["a"], np.arange(5.0))


def test_interrupted_writing_leaves_nothing(folder, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(cache.np, "savez", interrupt)
    with pytest.raises(KeyboardInterrupt):
        remembered("matrices", 1, Counter())
    assert not [*folder.iterdir()]


def test_objects_are_refused(folder):
    with pytest.raises(OptionError, match="numbers and texts"):
        remembered("matrices", 1, lambda: {"a": np.array([object()])})
    with pytest.raises(OptionError, match="content key"):
        remembered("matrices", object(), Counter())


def test_keys_tell_contents_apart():
    different = [
        *(1, 1.0, True, "1", b"1", None, (), ((), ()), {}, {"a": 1}, {"a": 2}, {"b": 1}, ("ab", "c"), ("a", "bc")),
        *(np.arange(4), np.arange(4.0), np.arange(4).reshape(2, 2), np.arange(4)[::-1], np.float64(1.0)),
        *(sp.eye_array(3), sp.eye_array(4), box("tetra10", (1, 1, 1), (1, 1, 1)), box("tetra10", (1, 1, 2), (1, 1, 1))),
    ]
    assert len({content_key(value) for value in different}) == len(different)


def test_keys_do_not_see_what_does_not_matter():
    a = np.arange(12.0).reshape(3, 4)
    assert content_key({"a": 1, "b": 2}) == content_key({"b": 2, "a": 1})
    assert content_key(a[:, ::2]) == content_key(a[:, ::2].copy())
    assert content_key(sp.csr_matrix(a)) == content_key(sp.coo_matrix(a))
    assert content_key(box("tetra10", (1, 1, 1), (1, 1, 1))) == content_key(box("tetra10", (1, 1, 1), (1, 1, 1)))


def test_another_version_has_other_keys(monkeypatch):
    before = content_key(1)
    monkeypatch.setattr(cache, "__version__", "0.0.0.other")
    assert content_key(1) != before


def test_what_was_not_used_for_longest_goes_first(folder, monkeypatch):
    for number in range(3):
        remembered("matrices", number, Counter())
    paths = {number: folder / f"matrices-{content_key('matrices', number)[:40]}.npz" for number in range(4)}
    for age, number in enumerate((0, 2, 1)):
        os.utime(paths[number], ns=(0, 10**9 * (100 - age)))
    monkeypatch.setattr(cache, "MOST_BYTES", 2.5 * paths[0].stat().st_size)
    remembered("matrices", 1, Counter())
    remembered("matrices", 3, Counter())
    assert [number for number in range(4) if paths[number].exists()] == [1, 3]


def test_what_is_not_enough_is_computed_anew(folder):
    compute = Counter()
    for least, count in ((0, 1), (3, 1), (9, 2)):
        remembered("matrices", 1, compute, lambda found, least=least: len(found["a"]) > least)
        assert compute.count == count
