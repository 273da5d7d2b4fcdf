"""What is defined is used: by the package, its pages, examples or benchmarks, and not by tests alone."""

import ast
import re
from collections import Counter
from collections.abc import Iterator

from helpers.doc_snippets import PAGES, ROOT

SOURCE = ROOT / "src" / "flexura"
CALLED_BY_OTHERS = {
    "_repr_html_",
    "list_commands",
    "_repr_png_",
    "execute",
    "to_frame",
    "make_image",
    "model_config",
    "model_validate_json",
    "print_png",
    "resolve_command",
    "severity",
}
"""By notebooks, Matplotlib, pydantic, typer, and the script of pages."""
REGISTERED = {"model_validator"}
"""Decorators under which a function is known to others than by its name."""

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Assign | ast.AnnAssign


def definitions(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Names at the top of a module and in its classes, with their statements."""
    todo: list[ast.stmt] = list(tree.body)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.ClassDef):
            todo += node.body
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not registered(node):
            yield node.name, node
        elif isinstance(node, ast.Assign):
            yield from ((target.id, node) for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id, node


def registered(node: ast.ClassDef | ast.FunctionDef) -> bool:
    return any(set(re.findall(r"\w+", ast.unparse(item))) & REGISTERED for item in node.decorator_list)


def named(tree: ast.AST) -> Counter[str]:
    """How often names are read, as variables, attributes, keywords and words of strings, without docstrings."""
    texts = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    found: Counter[str] = Counter()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            found[node.id] += 1
        elif isinstance(node, ast.Attribute):
            found[node.attr] += 1
        elif isinstance(node, ast.keyword) and node.arg:
            found[node.arg] += 1
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in texts:
            found.update(re.findall(r"\w+", node.value))
    return found


def unused(trees: dict[str, ast.Module], known: set[str]) -> list[str]:
    """Definitions that nothing names but they themselves, and that are not known otherwise."""
    everywhere = sum((named(tree) for tree in trees.values()), Counter())
    return sorted(
        f"{place}: {name}"
        for place, tree in trees.items()
        for name, node in definitions(tree)
        if not name.startswith("__") and name not in known and everywhere[name] == named(node)[name]
    )


def test_nothing_is_there_for_tests_alone() -> None:
    trees = {
        path.relative_to(SOURCE).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in SOURCE.rglob("*.py")
    }
    code = [*ROOT.glob("benchmarks/*.py"), *ROOT.glob("examples/**/*.py"), *ROOT.glob("docs/figures/*.py")]
    pages = [*PAGES, *ROOT.glob("docs/theory/*.md"), *ROOT.glob("examples/**/*.md")]
    known = set(CALLED_BY_OTHERS)
    for path in code:
        known |= set(named(ast.parse(path.read_text(encoding="utf-8"))))
    for path in pages:
        known |= set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    known |= set(re.findall(r" as (\w+)$", (SOURCE / "__init__.pyi").read_text(encoding="utf-8"), re.MULTILINE))
    assert unused(trees, known) == []


def test_what_names_itself_alone_is_seen() -> None:
    trees = {
        "a.py": ast.parse("X = 1\ndef f(n):\n    return f(n - 1)\nclass A:\n    def go(self):\n        return A\n")
    }
    assert unused(trees, set()) == ["a.py: A", "a.py: X", "a.py: f", "a.py: go"]
    assert unused(trees | {"b.py": ast.parse("A().go()\nf(X)")}, set()) == []
