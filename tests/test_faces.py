"""Faces of packages: one list of names, in the stub, which type checkers and the package itself read."""

import pickle
import re
import subprocess
import sys
from collections import Counter
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import flexura
from flexura.lazy import listed
from helpers.over import over
from helpers.public_names import IN_TWO_PLACES, NAMESPACES, public_names

STUBS = sorted(Path(flexura.__file__).parent.rglob("__init__.pyi"))
FACES = [".".join(stub.parent.relative_to(Path(flexura.__file__).parents[1]).parts) for stub in STUBS]
MODULES = {
    *("dimension", "element", "notch", "ring_plate", "occ", "profile", "section", "signals"),
    *NAMESPACES,
}
"""Faces show these as they are: families of functions and constants, and the namespaces of the package."""


@over("stub", STUBS)
def test_every_line_of_a_stub_lists_one_name(stub):
    lines = stub.read_text(encoding="utf-8").splitlines()
    assert len(lines) == len(listed("\n".join(lines)))


@over("name", FACES)
def test_a_face_gives_every_name_and_no_module_in_the_place_of_a_function(name):
    package = import_module(name)
    for public in package.__all__:
        value = getattr(package, public)
        assert not isinstance(value, ModuleType) or public in MODULES
    assert dir(package) == sorted(package.__all__)


@pytest.mark.parametrize("module", ["flexura.analysis.natural_modes.modes", "flexura.systems.state_space"])
def test_a_module_does_not_hide_the_function_of_its_name(module):
    """In a process of its own, where the module is imported before its package is asked for the name."""
    package, _, name = module.rpartition(".")
    code = f"import sys, {module}\nassert '{module}' in sys.modules\nprint(type({package}.{name}).__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "function"


def test_a_name_that_a_face_lacks_is_an_attribute_error():
    with pytest.raises(AttributeError, match=re.escape("module 'flexura.analysis' has no attribute 'mode'")):
        import_module("flexura.analysis").mode  # noqa: B018


@pytest.mark.parametrize(
    ("package", "former", "now"),
    [
        ("flexura", "Exceeded", "Diagnostic"),
        ("flexura", "Doubt", "Diagnostic"),
        ("flexura.analysis", "Doubt", "Diagnostic"),
        ("flexura.view", "draw_doubts", "draw_warnings"),
    ],
)
def test_an_older_name_warns_and_gives_what_has_the_name_now(package, former, now):
    with pytest.warns(DeprecationWarning, match=f"{former} is called {now}"):
        assert getattr(import_module(package), former) is getattr(import_module(package), now)


def test_a_public_name_is_in_one_namespace_alone():
    names = Counter(place.rpartition(".")[2] for place in public_names())
    assert [name for name, count in names.items() if count > 1] == []
    assert getattr(flexura, IN_TWO_PLACES) is getattr(flexura.describe, IN_TWO_PLACES)


def test_the_top_has_verbs_and_results_alone():
    """What describes a mechanism, and pictures, have namespaces of their own."""
    described = {name for name in dir(flexura.describe) if name != IN_TWO_PLACES}
    assert not described & set(dir(flexura))
    assert not [name for name in dir(flexura) if name.startswith("draw_")]


def test_namespaces_need_no_import_of_their_own():
    """In a process of its own, where nothing else has imported them."""
    names = ["describe.Leaf", "modal.mac", "solid.imported", "testing.Recording", "view.draw_bode"]
    printed = "\n".join(f"print(flexura.{name}.__name__)" for name in names)
    code = f"import flexura, sys\nassert 'numpy' not in sys.modules\n{printed}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [name.rpartition(".")[2] for name in names]


def test_packages_are_pickled_by_their_names():
    cloudpickle = pytest.importorskip("cloudpickle")
    assert pickle.loads(cloudpickle.dumps(flexura)) is flexura
