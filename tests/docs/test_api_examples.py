"""Every verb and every part of a description has an example, run with its page and shown beside its docstring."""

import importlib
import inspect

import pytest

from helpers.doc_snippets import ROOT
from helpers.over import over
from helpers.public_names import public_names

NAMES = {name: own for name, own in public_names().items() if callable(own)}
SHOWN = sorted(name for name, own in NAMES.items() if name.startswith("describe.") or not inspect.isclass(own))
NOT_RUN = {"live", "solid.read_ansys"}
"""It serves until it is ended; it needs a package that few have."""


@pytest.fixture(scope="module")
def examples():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "docs" / "_ext"))
        yield importlib.import_module("api_examples")


@over("name", SHOWN)
def test_it_has_an_example(examples, name):
    found = examples.example(name)
    assert found is not None, f"an example of fx.{name} in docs/_examples is missing"
    assert f"fx.{name}" in found.code
    assert found.is_run is (name not in NOT_RUN)


def test_of_long_blocks_only_what_calls_the_name_is_shown(examples):
    assert examples.example("view.draw_virtual_test").code.count("\n") < 4
