"""What the pages say of the code's layout is so: rooms and import rules, files that recipes name, what is published."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "flexura"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
CONFIG = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONTRACTS = CONFIG["tool"]["importlinter"]["contracts"]
NO_ROOMS = {"__init__", "__main__", "_version"}


def rows() -> dict[str, set[str]]:
    """Rooms of the table, in its order, with what they never import."""
    table = PAGE.split("| room |")[1].split("\n\n")[0]
    cells = [line.split("|")[1:-1] for line in table.splitlines()[2:]]
    return {row[0].strip(" `"): set(re.findall(r"`([^`]+)`", row[2])) for row in cells}


def short(module: str) -> str:
    return module.removeprefix("flexura.")


def test_every_room_is_named_and_exists() -> None:
    packages = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    modules = {path.stem for path in SOURCE.glob("*.py")} - NO_ROOMS
    assert set(rows()) == packages | modules


def test_order_is_that_of_the_import_contract() -> None:
    layers = next(c["layers"] for c in CONTRACTS if c["type"] == "layers" and "containers" not in c)
    assert list(rows()) == [short(layer) for layer in layers]


def test_what_is_never_imported_is_forbidden_by_contract() -> None:
    forbidden: dict[str, set[str]] = {}
    for contract in CONTRACTS:
        if contract["type"] == "forbidden":
            for room in contract["source_modules"]:
                forbidden.setdefault(short(room), set()).update(map(short, contract["forbidden_modules"]))
    said = {room: never for room, never in rows().items() if never}
    assert said == forbidden


def test_the_picture_has_every_room() -> None:
    picture = (ROOT / "docs" / "figures" / "rooms.svg").read_text(encoding="utf-8")
    assert set(re.findall(r'text-anchor="end"[^>]*>(\w+)<', picture)) == set(rows())


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.md", "docs/releasing.md"])
def test_files_that_a_page_names_exist(page) -> None:
    text = re.sub(r"^```python\n# file: .*$", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.MULTILINE)
    named = re.findall(r"(?<![\w/.])((?:src|tests|docs|benchmarks|tools)/[\w./-]*\w)", text)
    linked = [target.partition("#")[0] for target in re.findall(r"\]\(([^)#\s:]+)", text)]
    missing = [name for name in named if not (ROOT / name).exists()]
    missing += [name for name in linked if not ((ROOT / page).parent / name).exists()]
    assert len(named) >= 2 and not missing


def test_core_dependencies_have_a_least_version_that_can_be_tried() -> None:
    assert all(re.fullmatch(r"[\w.-]+>=[\d.]+", text) for text in CONFIG["project"]["dependencies"])
