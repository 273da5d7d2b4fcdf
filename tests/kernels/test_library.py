"""The library of kernels: built where it stands, and not used when it is of other sources."""

from __future__ import annotations

import inspect
import shutil
import subprocess
import sys

import numpy as np
import pytest

from flexura.compilers import PLATFORMS, build_library, this_platform
from flexura.errors import OptionError
from flexura.kernels import Kernel, address, build, is_compiled, library, without
from helpers.kernels import compiled


@pytest.fixture
def fresh():
    """What is loaded is forgotten, before and after."""
    library._library.cache_clear()
    yield
    library._library.cache_clear()


@compiled
def test_there_is_one_of_these_sources():
    assert is_compiled()


@compiled
def test_one_of_other_sources_is_not_used(monkeypatch, fresh):
    monkeypatch.setattr(library, "digest", lambda: "of others")
    assert not is_compiled()


@compiled
def test_a_damaged_one_is_not_used(monkeypatch, fresh, tmp_path):
    (tmp_path / "kernels.so").write_bytes(b"\x7fELF nothing")
    monkeypatch.setattr(library, "library_path", lambda: tmp_path / "kernels.so")
    assert not is_compiled()


@compiled
def test_without_is_for_a_while():
    with without():
        assert not is_compiled()
        with without():
            pass
        assert not is_compiled()
    assert is_compiled()


@compiled
def test_arrays_that_lie_otherwise_are_refused():
    with pytest.raises(AssertionError):
        address(np.zeros((4, 4))[:, ::2])
    with pytest.raises(AssertionError):
        address(np.zeros(4, dtype=np.float32))


@compiled
def test_a_kernel_that_is_not_there_is_told():
    with pytest.raises(AttributeError, match="no_such_kernel"):
        Kernel("no_such_kernel", "n")(1)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_sources_that_do_not_compile_are_told(tmp_path):
    (tmp_path / "a.c").write_text("int f(void) { return }")
    with pytest.raises(OptionError, match="failed"):
        build_library(tmp_path, ["a.c"], this_platform())


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_sources_compile_without_warnings():
    sources = sorted(str(path) for path in build.SOURCES.glob("*.c"))
    command = ["cc", *build.FLAGS, "-Werror", "-fsyntax-only", *sources]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert not done.returncode and not done.stderr


def test_platforms_that_are_not_known_are_told(monkeypatch):
    monkeypatch.setattr(build, "this_platform", lambda: "riscv64-linux")
    with pytest.raises(OptionError, match="no platform 'riscv64-linux'"):
        build.build()
    assert not build.library_path().exists()


def test_installations_build_without_numpy():
    code = "import sys; sys.modules['numpy'] = None; import flexura.kernels.build as b; print(b.digest())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == build.digest()


def test_each_platform_has_a_place_of_its_own():
    places = [build.library_path(name) for name in PLATFORMS]
    assert len(set(places)) == len(PLATFORMS) and {path.suffix for path in places} == {".so", ".dll", ".dylib"}


def test_no_place_is_that_of_a_module():
    names = [inspect.getmodulename(str(build.library_path(name))) for name in PLATFORMS]
    assert all(name is None or "." in name for name in names)
