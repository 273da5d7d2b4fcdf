"""No modules of a room import each other in a circle: not for types alone, and not inside functions."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src"
ROOMS = sorted({p.parent.name for p in (SOURCE / "flexura").glob("*/__init__.py")})


def modules(room: str) -> dict[str, ast.Module]:
    files = sorted((SOURCE / "flexura" / room).rglob("*.py"))
    names = {p: ".".join(p.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__") for p in files}
    return {name: ast.parse(p.read_text()) for p, name in names.items()}


def imported(tree: ast.Module, known: set[str]) -> set[str]:
    """Modules of `known` that are imported anywhere in a module."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            within = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (within & known) if within <= known else {node.module, *(within & known)}
    return found & known


def circle(trees: dict[str, ast.Module]) -> list[str]:
    """The first circle of imports that is found; empty without any."""
    try:
        TopologicalSorter({name: imported(tree, set(trees)) - {name} for name, tree in trees.items()}).prepare()
    except CycleError as error:
        return error.args[1]
    return []


@pytest.mark.parametrize("room", ROOMS)
def test_no_module_needs_one_that_needs_it(room) -> None:
    assert circle(modules(room)) == []


@pytest.mark.parametrize(
    "back",
    [
        "import flexura.a",
        "from flexura.a import x",
        "from flexura import a",
        "if TYPE_CHECKING:\n    from flexura.a import x",
        "def f():\n    from flexura.a import x",
    ],
)
def test_a_circle_of_any_kind_is_seen(back) -> None:
    trees = {"flexura.a": "from flexura.b import y", "flexura.b": "from flexura.c import z", "flexura.c": back}
    found = circle({name: ast.parse(text) for name, text in trees.items()})
    assert set(found) == set(trees)
