"""Build flexura as it would be released and try it where nothing else is installed.

    python tools/release_check.py [--only NAMES] [--list] [--keep FOLDER]

The sdist is built of a clean checkout of the commit, and from it the wheel. Each trial has a new environment:

    clean-PYTHON     core dependencies alone: every module is imported, every command works or names its extra
    extra-NAME       one extra: what it is for works
    all-PYTHON       every extra at once
    lowest-core      the least versions that pyproject.toml allows: the same commands, and tests
    lowest-NAME      one extra at its least versions, and those of what is always needed
    installer-NAME   the ways of the page on installing: pip, pipx, uvx
    types            pyright knows the type of every public name of the wheel
    docs-site        the site is built by the extra docs
    docs-snippets    every command and snippet of README.md and docs prints what its page says

NAMES are trials or the words before their dashes, separated by commas. What fails is told at once and in the end, where
the status is 1; the others go on. With a folder that is kept, what has passed is not tried again for the same commit.
What is run stands in release_tries.py.
"""  # fmt: skip

from __future__ import annotations

import argparse
import json
import re
import shlex
import shutil
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from release_places import PYTHONS, ROOT, Place, build, built_before, commit, last_line, pythons, run
from release_tries import CODE, CORE, EXTRA, IMPORT_ALL, NAMED, SITE, TESTS, WITH

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL: dict[str, list[str]] = PROJECT["optional-dependencies"]
SCRIPTS = re.compile(r"^(?:\$ )?python (examples/.*)$", re.MULTILINE)
"""Scripts of examples that pages call."""
DEMO = "examples/rpr/demo.py"
"""What `make demo` runs."""
EXTRAS = sorted(OPTIONAL.keys() - {"all", "bench", "dev", "docs"})


class Trial(NamedTuple):
    """What is tried in an environment of one Python; it gives what is told of it."""

    python: Path
    attempt: Callable[[Place], str]


def clean(place: Place) -> str:
    """Every module and every command with core dependencies alone."""
    place.install(place.built.wheel)
    run([place.python, "-W", "error::DeprecationWarning:flexura", "-c", IMPORT_ALL], place.folder)
    lines = [*CORE, *(line for lines in EXTRA.values() for line in lines), *NAMED.values()]
    listed = place.execute("import flexura.cli.app as own; print(*own.COMMANDS)")
    if untried := set(listed.split()) - {shlex.split(line)[0] for line in lines}:
        raise RuntimeError(f"commands that are not tried: {sorted(untried)}")
    for line in CORE:
        place.flexura(line)
    without = {extra: partial(place.flexura, lines[0]) for extra, lines in EXTRA.items()}
    without |= {extra: partial(place.flexura, line) for extra, line in NAMED.items()}
    without |= {extra: partial(place.execute, code) for extra, code in CODE.items()}
    for extra, attempt in without.items():
        try:
            attempt()
        except RuntimeError as error:
            if f"flexura[{extra}]" not in str(error):
                raise RuntimeError(f"without the extra {extra}, which is not named: {error}") from None
        else:
            raise RuntimeError(f"what the extra {extra} is for works without it")
    return f"{len(CORE)} command lines; extras named where they are missing: {len(without)}"


def with_extras(place: Place, extras: list[str], *pins: object) -> str:
    """Extras in one environment: what they are for works."""
    place.install(f"{place.built.wheel}[{','.join(extras)}]", *pins)
    for extra in extras:
        for line in EXTRA.get(extra, ()):
            place.flexura(line)
        for code in (own[extra] for own in (CODE, WITH) if extra in own):
            place.execute(code)
    listed = place.flexura("doctor").splitlines()
    if lacking := [extra for extra in extras if not any(line.split()[:2] == [extra, "yes"] for line in listed)]:
        raise RuntimeError(f"doctor misses {lacking}")
    return "works"


def least_versions(wanted: list[str]) -> list[str]:
    """Requirements pinned to the least versions that they allow."""
    parts = [re.fullmatch(r"([\w.-]+)(?:\[[\w,]+\])?>=([\d.]+)(;.*)?", text) for text in wanted]
    if unbounded := [text for text, part in zip(wanted, parts, strict=True) if part is None]:
        raise RuntimeError(f"no lower bound alone: {unbounded}")
    return [f"{part[1]}=={part[2]}{part[3] or ''}" for part in parts if part is not None]


def pinned(place: Place, extra: str = "") -> list[object]:
    """Words of pip that pin what is always needed, and what an extra needs, to the least versions."""
    file = place.folder / "least.txt"
    pins = least_versions([*PROJECT["dependencies"], *OPTIONAL.get(extra, ())])
    file.write_text("\n".join(pins) + "\n", encoding="utf-8")
    return ["--constraint", file]


def lowest_core(place: Place) -> str:
    """Commands and tests with the least versions of core dependencies."""
    place.install(place.built.wheel, "pytest", "hypothesis", "mpmath", *pinned(place))
    for line in CORE:
        place.flexura(line)
    own = place.unpacked("src")  # the tests of the sdist, on the wheel
    options = ["-p", "no:cacheprovider", "-W", "default"]  # libraries of then warn of their own ways
    return last_line(run([place.python, "-m", "pytest", *options, *TESTS], own))


def lowest_extra(extra: str, place: Place) -> str:
    """What an extra is for, with the least versions of what it needs."""
    return with_extras(place, [extra], *pinned(place, extra))


def by_pip(place: Place) -> str:
    """Installed from a copy of the repository."""
    place.install(place.built.source)
    return last_line(place.flexura("--version"))


def by_pipx(place: Place) -> str:
    """As a command alone, installed and only run."""
    place.install("pipx")
    own = {"PIPX_HOME": place.folder / "pipx", "PIPX_BIN_DIR": place.folder / "bin", "PIPX_MAN_DIR": place.folder}
    pipx = place.python.with_name("pipx")
    run([pipx, "run", "--spec", place.built.wheel, "flexura", "doctor"], place.folder, **own)
    run([pipx, "install", place.built.source], place.folder, **own)
    return last_line(run([place.folder / "bin" / "flexura", "--version"], place.folder))


def by_uvx(place: Place) -> str:
    """Without installing it, by uv."""
    place.install("uv")
    own = {"UV_CACHE_DIR": place.folder / "cache", "UV_PYTHON_DOWNLOADS": "never", "UV_PYTHON": place.python}
    uvx = place.python.with_name("uvx")
    for origin in (place.built.wheel, place.built.source):
        run([uvx, "--from", origin, "flexura", "modes", "examples/guide/guide.yaml"], place.folder, **own)
    return last_line(run([uvx, "--from", place.built.wheel, "flexura", "--version"], place.folder, **own))


def types(place: Place) -> str:
    """What a type checker knows of the wheel."""
    place.install(place.built.wheel, "pyright[nodejs]")
    return last_line(run([place.python, ROOT / "tools" / "public_types.py"], place.folder))


def site(place: Place) -> str:
    """The site, with warnings as errors, of the sdist's pages and the wheel."""
    place.install(f"{place.built.wheel}[docs]")
    own = place.unpacked()
    run([place.python, *SITE], own, FLEXURA_REPORTS="parallelogram")
    return f"{len(list((own / 'docs/_build/html').rglob('*.html')))} pages"


def snippets(place: Place) -> str:
    """What README.md and docs say is typed, with everything optional, and the wheel in place of the source."""
    place.install(f"{place.built.wheel}[all]", "pytest", "hypothesis")
    own = place.unpacked("src")
    words = [place.python, "-m", "pytest", "-p", "no:cacheprovider", "-m", "", "tests/docs/test_doc_snippets.py"]
    said = last_line(run(words, own))
    scripts = {line for page in own.glob("docs/**/*.md") for line in SCRIPTS.findall(page.read_text(encoding="utf-8"))}
    if not scripts:
        raise RuntimeError("no scripts in docs were found")
    for line in sorted({*scripts, DEMO}):
        run([place.python, *shlex.split(line)], own)
    return f"{said}; {len(scripts)} scripts, and make demo"


def trials() -> dict[str, Trial]:
    """All trials by their names, in their order."""
    if untried := set(EXTRAS) - {*EXTRA, *CODE, *WITH}:
        raise RuntimeError(f"extras that are not tried: {sorted(untried)}")
    found, own = pythons(), Path(sys.executable)
    least, newest = (found[version] for version in (min(found, key=PYTHONS.index), max(found, key=PYTHONS.index)))
    listed = {f"clean-{version}": Trial(python, clean) for version, python in found.items()}
    listed |= {f"extra-{extra}": Trial(own, partial(with_extras, extras=[extra])) for extra in EXTRAS}
    listed |= {
        f"all-{version}": Trial(python, partial(with_extras, extras=EXTRAS)) for version, python in found.items()
    }
    listed["lowest-core"] = Trial(least, lowest_core)
    listed |= {f"lowest-{extra}": Trial(least, partial(lowest_extra, extra)) for extra in EXTRAS}
    installers = {"pip": by_pip, "pipx": by_pipx, "uvx": by_uvx}
    listed |= {f"installer-{name}": Trial(own, attempt) for name, attempt in installers.items()}
    listed["types"] = Trial(own, types)
    return listed | {"docs-site": Trial(own, site), "docs-snippets": Trial(newest, snippets)}


def chosen(words: str) -> dict[str, Trial]:
    """Trials of these names, or whose names begin so; all without any."""
    listed = trials()
    asked = [word for word in words.split(",") if word]
    if none := [word for word in asked if not any(begins(name, word) for name in listed)]:
        raise RuntimeError(f"no trial is called {none}; there are {', '.join(listed)}")
    return {name: own for name, own in listed.items() if not asked or any(begins(name, word) for word in asked)}


def begins(name: str, word: str) -> bool:
    """Whether a trial is called so, or its name before a dash is."""
    return name == word or name.startswith(f"{word}-")


class Record:
    """What has passed, in a file of the folder; of another commit nothing has."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "passed.json"
        self.commit = commit()
        kept = json.loads(self.path.read_text(encoding="utf-8")) if self.path.exists() else {}
        self.is_same = kept.get("commit") == self.commit
        self.passed: list[str] = kept["passed"] if self.is_same else []

    def add(self, name: str) -> None:
        """Something more has passed."""
        self.passed.append(name)
        self.path.write_text(json.dumps({"commit": self.commit, "passed": self.passed}), encoding="utf-8")


def attempt_all(asked: dict[str, Trial], folder: Path) -> list[str]:
    """Build, and try everything that was not tried of this commit; the names of what failed."""
    record = Record(folder)
    print(f"sdist and wheel of {record.commit[:9]}", flush=True)
    if not record.is_same:
        built = build(folder)
        record.add("build")
    built = built_before(folder)
    failed: list[str] = []
    for number, (name, trial) in enumerate(asked.items(), start=1):
        print(f"{number:3} of {len(asked)} {name}: ", end="", flush=True)
        if name in record.passed:
            print("passed before")
            continue
        start = time.monotonic()
        try:
            said = trial.attempt(Place.new(folder / name, trial.python, built))
        except RuntimeError as error:
            print(f"FAILED: {error}", flush=True)
            failed.append(name)
        else:
            print(f"{said} ({time.monotonic() - start:.0f} s)", flush=True)
            record.add(name)
            shutil.rmtree(folder / name)
    return failed


def main() -> None:
    """Run from the shell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="NAMES", help="trials, or what their names begin with")
    parser.add_argument("--list", action="store_true", help="the names of all trials")
    parser.add_argument(
        "--keep", type=Path, metavar="FOLDER", help="for what is built and what fails; or a temporary one"
    )
    given = parser.parse_args()
    found = pythons()
    absent = [version for version in PYTHONS if version not in found]
    told = f"; not here, and so not tried: {', '.join(absent)}" if absent else ""
    print(f"Pythons found: {', '.join(found)}{told}", flush=True)
    try:
        asked = chosen(given.only)
        if given.list:
            print("\n".join(asked))
            return
        with tempfile.TemporaryDirectory(prefix="flexura-release-") as temporary:
            folder = (given.keep or Path(temporary)).resolve()
            folder.mkdir(parents=True, exist_ok=True)
            failed = attempt_all(asked, folder)
    except RuntimeError as error:
        sys.exit(f"release check FAILED: {error}")
    except KeyboardInterrupt:
        sys.exit("interrupted; the next check of the same commit with the same --keep goes on from here")
    if failed:
        sys.exit(f"release check FAILED: {', '.join(failed)}")
    print(f"release check passed{told}")


if __name__ == "__main__":
    main()
