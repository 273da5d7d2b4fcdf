"""Imports stand at the top of a module, and those of another package are of its face.

Late ones are allowed where they would cost time, or need a package that is not installed.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "flexura"
FILES = sorted(SOURCE.rglob("*.py"))
LATE = {"cli", "__main__"}
"""Rooms that import what one verb alone needs when it is asked for."""
SLOW = {"importlib", "numpy", "pandas", "pint", "pydantic_core", "ruamel", "scipy"}
OPTIONAL = {"control", "fcntl", "pypardiso", "resource", "starlette"}
BY_NAME = {"lazy.py", "errors.py", "cli/app.py"}
"""Modules that import others whose names are data: faces, optional packages, commands."""


GROUPS = {"flexura", "flexura.testing", "flexura.solid", "flexura.study", "flexura.pages"}
"""Packages of packages, whose faces are for users alone: rooms import from the packages inside."""
PACKAGES = {".".join(path.parent.relative_to(SOURCE.parent).parts) for path in SOURCE.rglob("__init__.py")}


def place(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


def room(path: Path) -> str:
    return place(path).removesuffix(".py").split("/")[0]


def late(tree: ast.AST) -> Iterator[str]:
    """Modules that are imported in functions or for type checkers alone."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or (
            isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        ):
            for inner in ast.walk(node):
                if isinstance(inner, ast.Import):
                    yield from (alias.name for alias in inner.names)
                elif isinstance(inner, ast.ImportFrom):
                    yield inner.module or "."


def refused(text: str) -> set[str]:
    return {name for name in late(ast.parse(text)) if name.split(".")[0] not in SLOW | OPTIONAL}


def test_imports_inside_functions_are_of_slow_and_optional_packages() -> None:
    files = [path for path in FILES if room(path) not in LATE]
    found = {place(path): refused(path.read_text(encoding="utf-8")) for path in files}
    assert {path: names for path, names in found.items() if names} == {}


def test_no_module_is_imported_by_a_name_that_no_rule_sees() -> None:
    files = {place(path): path.read_text(encoding="utf-8") for path in FILES}
    assert {path for path, text in files.items() if "import_module" in text or "__import__" in text} == BY_NAME


def imports(tree: ast.AST) -> Iterator[tuple[str, str]]:
    """Modules and names that are imported from them anywhere."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module or ".", alias.name) for alias in node.names)


def within(module: str, package: str) -> bool:
    return module == package or module.startswith(f"{package}.")


def beside_the_face(user: str, text: str, faces: dict[str, set[str]]) -> list[str]:
    """Imports of a module that pass by the face of a package it is not in, or that go through that of its own."""
    found = []
    for module, name in imports(ast.parse(text)):
        around = [p for p in faces if within(module, p)]
        outer = next((p for p in sorted(around, key=len) if not within(user, p)), None)
        if (outer is not None and (module != outer or name not in faces[outer])) or (
            outer is None and user != module and module in faces and name in faces[module]
        ):
            found.append(f"from {module} import {name}")
    return found


def faces_of_packages() -> dict[str, set[str]]:
    stubs = {package: SOURCE.parent.joinpath(*package.split("."), "__init__.pyi") for package in PACKAGES - GROUPS}
    return {
        package: {name for _, name in imports(ast.parse(stub.read_text(encoding="utf-8")))} if stub.exists() else set()
        for package, stub in stubs.items()
    }


def test_packages_import_from_faces_of_others_and_not_from_their_own() -> None:
    faces, found = faces_of_packages(), {}
    for path in [*FILES, SOURCE / "__init__.pyi"]:
        user = ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
        wrong = beside_the_face(user, path.read_text(encoding="utf-8"), faces)
        if wrong and path.name != "__init__.py":
            found[place(path)] = wrong
    assert found == {}


@pytest.mark.parametrize(
    ("user", "text", "is_wrong"),
    [
        ("flexura.b.x", "from flexura.a import f", False),
        ("flexura.b.x", "from flexura.a.inner import f", True),
        ("flexura.b.x", "from flexura.a import inner", True),
        ("flexura.b.x", "import flexura.a.inner", True),
        ("flexura.b.x", "def g():\n    from flexura.a.inner import f", True),
        ("flexura.a.x", "from flexura.a.inner import f", False),
        ("flexura.a.x", "from flexura.a import f", True),
        ("flexura.a.x", "from flexura.a.deep.inner import h", True),
        ("flexura.a.deep.x", "from flexura.a.inner import f", False),
        ("flexura.b.x", "from flexura.a.deep import h", True),
    ],
)
def test_an_import_beside_the_face_is_seen(user, text, is_wrong) -> None:
    faces = {"flexura.a": {"f"}, "flexura.b": set(), "flexura.a.deep": {"h"}}
    assert bool(beside_the_face(user, text, faces)) == is_wrong


@pytest.mark.parametrize(
    "hidden",
    [
        "def f():\n    from flexura.a import x",
        "class A:\n    def f(self):\n        import flexura.a",
        "if TYPE_CHECKING:\n    from flexura.a import x",
        "import typing\nif typing.TYPE_CHECKING:\n    from flexura.a import x",
    ],
)
def test_a_hidden_import_is_seen(hidden) -> None:
    assert refused(hidden) == {"flexura.a"}
    assert not refused(hidden.replace("flexura", "scipy"))
