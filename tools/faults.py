"""Plant faults in the code of the numerical rooms, one at a time, and see that tests catch them.

    python tools/faults.py choose 200                 draw faults anew into tools/faults.jsonl
    python tools/faults.py watch RECORD [PYTEST ...]  run tests; write their processor time and the faults they pass
    python tools/faults.py catch RECORD ...           find a test for every fault that has none, the cheapest first
    python tools/faults.py check                      every fault that was caught is caught by its test

A fault is an operator, a comparison, a sign, a number, or the order of two arguments or indices, changed in one place.
It is known by module, function and text, never by a line, and found again where a function moves to another module. All
faults are compiled into the code when it is imported, each behind a switch; tests run in forks of one process, each
with its switch on.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import resource
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder, SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"
LIST = ROOT / "tools" / "faults.jsonl"
ROOMS = [
    "beam", "linalg", "duals", "structure", "reduction", "motion", "systems", "modal", "methods", "derivatives",
    "analysis", "fem", "testing/identification",
]  # fmt: skip
SECONDS = 200
PROCESSOR_SECONDS = 20
"""Times in which tests are to catch a fault."""

CANDIDATES = 40
CANDIDATE_SECONDS = 10.0
"""How many tests of a fault are tried, and how long they take without it."""

OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult}
COMPARISONS = {ast.Lt: ast.Gt, ast.LtE: ast.Gt, ast.Gt: ast.Lt, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
CALLS = {"sin": "cos", "cos": "sin", "minimum": "maximum", "maximum": "minimum", "min": "max", "max": "min"}


@dataclass
class Fault:
    """What is changed where, and the test that catches it."""

    module: str
    function: str
    was: str
    becomes: str
    occurrence: int = 0
    test: str | None = None

    @property
    def swaps(self) -> bool:
        """Whether arguments or indices change places."""
        return sorted(self.was) == sorted(self.becomes)


# --- what may be changed


def changed(node: ast.AST) -> ast.expr | None:
    """What an expression becomes by a fault, None where there is none to plant."""
    match node:
        case ast.BinOp(ast.Constant(value), op, right) if type(value) is int and value >= 2:
            return ast.BinOp(ast.Constant(value + 1), op, right)
        case ast.BinOp(left, op, ast.Constant(value)) if type(value) is int and value >= 2 and not is_tuple(left):
            return ast.BinOp(left, op, ast.Constant(value + 1))
        case ast.BinOp(left, op, right) if type(op) in OPERATORS and not any(map(is_text, (left, right))):
            return ast.BinOp(left, OPERATORS[type(op)](), right) if not is_tuple(left) and not is_tuple(right) else None
        case ast.Compare(left, [op], right) if type(op) in COMPARISONS:
            return ast.Compare(left, [COMPARISONS[type(op)]()], right)
        case ast.UnaryOp(ast.USub(), operand) if not isinstance(operand, ast.Constant):
            return operand
        case ast.Constant(value) if type(value) is float and abs(value) >= 1e-3:
            return ast.Constant(1.25 * value)
        case ast.Subscript(value, ast.Tuple([*first, a, b]), ast.Load()) if ast.dump(a) != ast.dump(b):
            return ast.Subscript(value, ast.Tuple([*first, b, a], ast.Load()), ast.Load())
        case ast.Call(ast.Attribute(value, name), args, keywords) if name in CALLS and args:
            return ast.Call(ast.Attribute(value, CALLS[name], ast.Load()), args, keywords)
        case ast.Call(func, [a, b, *more], keywords) if (
            not isinstance(a, ast.Starred) and swappable(a) and swappable(b)
        ):
            return ast.Call(func, [b, a, *more], keywords) if ast.dump(a) != ast.dump(b) else None
    return None


def swappable(node: ast.expr) -> bool:
    return isinstance(node, ast.Name | ast.Attribute | ast.Subscript | ast.BinOp)


def is_tuple(node: ast.AST) -> bool:
    return isinstance(node, ast.Tuple | ast.List)


def is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


class Planter(ast.NodeTransformer):
    """Visits every place of a module at which a fault can be planted, and puts there what `plant` returns."""

    def __init__(self, plant: Callable[[str, ast.expr, ast.expr], ast.expr]) -> None:
        self.plant, self.names = plant, []

    def enter(self, node: Any) -> Any:
        self.names.append(node.name)
        node.body = [self.visit(child) for child in node.body]
        self.names.pop()
        return node

    visit_ClassDef = visit_FunctionDef = visit_AsyncFunctionDef = enter

    def leave_alone(self, node: Any) -> Any:
        return node

    visit_Raise = visit_Assert = visit_JoinedStr = leave_alone
    visit_Import = visit_ImportFrom = leave_alone

    def visit_Expr(self, node: ast.Expr) -> ast.Expr:
        return node if is_text(node.value) else self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AnnAssign:
        if node.value is not None:
            node.value = self.visit(node.value)
        return node

    def visit_match_case(self, node: ast.match_case) -> ast.match_case:
        node.body = [self.visit(child) for child in node.body]
        return node

    def visit(self, node: ast.AST) -> Any:
        within = bool(self.names) and isinstance(node, ast.expr)
        fault = changed(node) if within else None
        before = ast.unparse(node) if fault is not None else ""
        after = ast.unparse(fault) if fault is not None else ""
        result = super().visit(node)
        if fault is None or len(before) > 160:
            return result
        # made of the children as they are now, which may hold faults of their own
        return self.plant(".".join(self.names), (before, after), result)


def places(module: str, text: str) -> list[Fault]:
    """All faults that can be planted in a module."""
    counts: dict[tuple[str, str, str], int] = defaultdict(int)
    listed = []

    def note(function: str, texts: tuple[str, str], node: ast.expr) -> ast.expr:
        key = (function, *texts)
        listed.append(Fault(module, *key, counts[key]))
        counts[key] += 1
        return node

    Planter(note).visit(ast.parse(text))
    return listed


def planted(tree: ast.Module, faults: dict[tuple[str, str, str, int], int]) -> ast.Module:
    """The module with switches for faults, by function, text, text and occurrence."""
    counts: dict[tuple[str, str, str], int] = defaultdict(int)

    def plant(function: str, texts: tuple[str, str], node: ast.expr) -> ast.expr:
        key = (function, *texts)
        number = faults.get((*key, counts[key]))
        counts[key] += 1
        if number is None:
            return node
        switch = ast.parse(f"__faults__({number})", mode="eval").body
        return ast.IfExp(switch, ast.parse(texts[1], mode="eval").body, node)

    tree = Planter(plant).visit(tree)
    at = next((i for i, s in enumerate(tree.body) if not is_docstring(s) and not is_future(s)), 0)
    tree.body.insert(at, ast.parse("from builtins import __faults__").body[0])
    return ast.fix_missing_locations(tree)


def is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and is_text(node.value)


def is_future(node: ast.stmt) -> bool:
    return isinstance(node, ast.ImportFrom) and node.module == "__future__"


# --- the list of faults


def modules(rooms: list[str]) -> Iterator[tuple[str, str]]:
    """Name and text of modules of rooms, sorted."""
    for room in rooms:
        folder = SOURCE / "flexura" / room
        for path in sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]:
            yield name_of(path), path.read_text()


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")


def choose(number: int, seed: int) -> list[Fault]:
    """Faults of all rooms, of each by the root of what could be planted there; one a function if there are enough."""
    draw = random.Random(seed)
    # what is swapped mostly ends in an error at once: one of four
    rooms = {
        room: [
            f for name, text in modules([room]) for f in places(name, text) if draw.random() < (0.25 if f.swaps else 1)
        ]
        for room in ROOMS
    }
    total = sum(len(found) ** 0.5 for found in rooms.values())
    chosen = []
    for found in rooms.values():
        draw.shuffle(found)
        rounds, seen = defaultdict(list), defaultdict(int)
        for fault in found:
            rounds[seen[fault.module, fault.function]].append(fault)
            seen[fault.module, fault.function] += 1
        ordered = [fault for i in sorted(rounds) for fault in rounds[i]]
        chosen += ordered[: round(number * len(found) ** 0.5 / total)]
    return chosen


def read() -> list[Fault]:
    return [Fault(**json.loads(line)) for line in LIST.read_text().splitlines()]


def write(faults: list[Fault]) -> None:
    LIST.write_text("".join(json.dumps(asdict(fault), ensure_ascii=False) + "\n" for fault in faults))


def moved(faults: list[Fault]) -> list[Fault]:
    """The faults where they stand today; those whose function or text is nowhere any more are told and left out."""
    today = [f for path in sorted(SOURCE.rglob("*.py")) for f in places(name_of(path), path.read_text())]
    exact = {(f.module, f.function, f.was, f.becomes, f.occurrence): f for f in today}
    by_text = {(f.function.split(".")[-1], f.was, f.becomes, f.occurrence): f for f in today}
    there = []
    for fault in faults:
        key = (fault.function.split(".")[-1], fault.was, fault.becomes, fault.occurrence)
        now = exact.get((fault.module, fault.function, *key[1:])) or by_text.get(key)
        if now is None:
            print(f"no more: {fault.module}.{fault.function}: {fault.was} -> {fault.becomes}")
        else:
            fault.module, fault.function = now.module, now.function
            there.append(fault)
    return there


# --- the code with faults


class Switch:
    """Which fault is on, and which were passed since the last look."""

    def __init__(self) -> None:
        self.on, self.passed = -1, set()

    def __call__(self, number: int) -> bool:
        self.passed.add(number)
        return number == self.on


class Finder(MetaPathFinder):
    """Imports modules with the faults planted in them."""

    def __init__(self, faults: list[Fault]) -> None:
        self.by_module = defaultdict(dict)
        for number, f in enumerate(faults):
            self.by_module[f.module][f.function, f.was, f.becomes, f.occurrence] = number

    def find_spec(self, fullname: str, path: Any, target: ModuleType | None = None) -> Any:
        if fullname not in self.by_module:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        assert spec and spec.origin
        spec.loader = Loader(fullname, spec.origin)
        spec.loader.faults = self.by_module[fullname]  # pyright: ignore
        return spec


class Loader(SourceFileLoader):
    """Compiles a module with its faults."""

    faults: dict[tuple[str, str, str, int], int]

    def get_code(self, fullname: str) -> Any:
        path = self.get_filename(fullname)
        return compile(planted(ast.parse(self.get_data(path)), self.faults), path, "exec")


def plant(faults: list[Fault]) -> Switch:
    """Plant faults in all that is imported from now on."""
    import builtins

    switch = Switch()
    builtins.__faults__ = switch  # pyright: ignore
    sys.meta_path.insert(0, Finder(faults))
    return switch


# --- tests


def processor_seconds() -> float:
    return sum(os.times()[:4])


class Watcher:
    """Writes of every test its processor time, with that of its children, and the faults that it passes."""

    def __init__(self, switch: Switch, record: Path) -> None:
        self.switch, self.file = switch, record.open("a")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Any:
        self.switch.passed.clear()
        started = processor_seconds()
        result = yield
        line = {"test": item.nodeid, "seconds": round(processor_seconds() - started, 3)}
        self.file.write(json.dumps(line | {"faults": sorted(self.switch.passed)}) + "\n")
        self.file.flush()
        return result


class Catcher:
    """Runs in place of the suite, for every fault, its tests, in forks of this process."""

    def __init__(self, switch: Switch, faults: list[Fault], tests: dict[int, list[str]], jobs: int) -> None:
        self.switch, self.faults, self.tests, self.jobs = switch, faults, tests, jobs
        self.caught: dict[int, str] = {}
        self.sound: dict[str, bool] = {}
        self.failed = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.failed |= report.failed

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        items = {item.nodeid: item for item in session.items}
        by_function = defaultdict(list)
        for item in session.items:
            by_function[item.nodeid.split("[")[0]].append(item)
        waiting = [
            (
                number,
                [
                    own
                    for name in names
                    for own in ([items[name]] if name in items else by_function[name.split("[")[0]])
                ],
            )
            for number, names in self.tests.items()
        ]
        running: list[Fork] = []
        while waiting or running:
            while waiting and len(running) < self.jobs:
                number, there = waiting.pop(0)
                running.append(Fork(number, len(there), *self.fork(number, there)))
            time.sleep(0.02)
            for fork in [own for own in running if own.is_done()]:
                running.remove(fork)
                self.tell(fork, items)
        return True

    def tell(self, fork: Fork, items: dict[str, pytest.Item]) -> None:
        """Print what caught a fault, which is no test that fails without one."""
        test, fault = fork.test(), self.faults[fork.number]
        if test and self.passes(test, items[test]):
            self.caught[fork.number] = test
        told = f"{fault.module}.{fault.function}: {fault.was} -> {fault.becomes}"
        found = self.caught.get(fork.number) or f"NOT CAUGHT by {fork.tests} tests"
        print(
            f"{fork.number:4d} {time.monotonic() - fork.began:5.1f} s  {told}: {found}", file=sys.__stdout__, flush=True
        )

    def passes(self, test: str, item: pytest.Item) -> bool:
        """Whether a test passes without a fault, asked once."""
        if test not in self.sound:
            alone = Fork(-1, 1, *self.fork(-1, [item]))
            while not alone.is_done():
                time.sleep(0.02)
            self.sound[test] = alone.test() is None
            if not self.sound[test]:
                print(f"{test} fails without a fault", file=sys.__stdout__, flush=True)
        return self.sound[test]

    def fork(self, number: int, items: list[pytest.Item]) -> tuple[int, int]:
        """A process that runs tests until one fails by a fault, and where it says which it runs."""
        reading, writing = os.pipe()
        child = os.fork()
        if child:
            os.close(writing)
            return child, reading
        os.setpgid(0, 0)
        resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_SECONDS, PROCESSOR_SECONDS))
        self.switch.on = number
        quiet = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(quiet, stream)
        for item, following in zip(items, [*items[1:], None], strict=False):
            os.write(writing, f"{item.nodeid}\n".encode())
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if self.failed:
                os.write(writing, b"FAILED\n")
                break
        os._exit(0)


@dataclass
class Fork:
    """A process that runs tests on one fault."""

    number: int
    tests: int
    child: int
    reading: int

    def __post_init__(self) -> None:
        self.began = time.monotonic()

    def is_done(self) -> bool:
        """Whether it has ended, by itself or because its time is up."""
        if os.waitpid(self.child, os.WNOHANG)[0]:
            return True
        if time.monotonic() < self.began + SECONDS:
            return False
        os.killpg(self.child, signal.SIGKILL)
        os.waitpid(self.child, 0)
        return True

    def test(self) -> str | None:
        """The test that failed."""
        with os.fdopen(self.reading) as stream:
            lines = stream.read().splitlines()
        return lines[-2] if lines and lines[-1] == "FAILED" else None


def run(words: list[str], plugin: object) -> None:
    pytest.main(["-n", "0", "-q", "-p", "no:cacheprovider", "--capture=sys", *words], plugins=[plugin])


def catch(faults: list[Fault], tests: dict[int, list[str]], words: list[str], jobs: int) -> dict[int, str]:
    """Tests that catch faults, by number; of each the tests of which one may."""
    catcher = Catcher(plant(faults), faults, tests, jobs)
    files = sorted({name.split("::")[0] for names in tests.values() for name in names})
    gone = [file for file in files if not (ROOT / file).exists()]
    print("".join(f"no more: {file}\n" for file in gone), end="")
    files = [file for file in files if file not in gone]
    run([*words, *files], catcher)
    return catcher.caught


def candidates(fault: Fault, passing: list[tuple[str, float]]) -> list[str]:
    """Tests that may catch a fault: those of its room first, the cheapest of every file by turns."""
    room, rank = fault.module.split(".")[1], defaultdict(int)
    keys = {}
    for test, seconds in sorted(passing, key=lambda own: own[1]):
        file = test.split("::")[0]
        keys[test] = (rank[file] // 3, f"tests/{room}/" not in file, seconds)
        rank[file] += 1
    cost, chosen = dict(passing), list[str]()
    for test in sorted(keys, key=keys.__getitem__)[:CANDIDATES]:
        if not chosen or sum(cost[own] for own in chosen) + cost[test] < CANDIDATE_SECONDS:
            chosen.append(test)
    return chosen


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["choose", "watch", "catch", "check"])
    parser.add_argument("words", nargs="*")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    given, more = parser.parse_known_args()
    if given.what == "choose":
        write(choose(int(given.words[0]), given.seed))
        return 0
    faults = moved(read())
    if given.what == "watch":
        run([*given.words[1:], *more], Watcher(plant(faults), Path(given.words[0])))
        return 0
    if given.what == "catch":
        passing: dict[int, list[tuple[str, float]]] = defaultdict(list)
        for record in given.words:
            for line in map(json.loads, Path(record).read_text().splitlines()):
                for number in line["faults"]:
                    passing[number].append((line["test"], line["seconds"]))
        tests = {i: candidates(f, passing[i]) for i, f in enumerate(faults) if f.test is None and passing[i]}
        caught = catch(faults, tests, more, given.jobs)
    else:
        # every case of a test that has others now
        caught = catch(faults, {i: [f.test] for i, f in enumerate(faults) if f.test}, more, given.jobs)
    print(f"{len(caught)} of {len(faults)} faults caught")
    if given.what == "catch":
        for number, test in caught.items():
            faults[number].test = test
        write(faults)
        return 0
    return int(any(f.test and i not in caught for i, f in enumerate(faults)))


if __name__ == "__main__":
    sys.exit(main())
