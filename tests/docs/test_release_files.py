"""Files by which flexura is built, installed and cited elsewhere say what pyproject.toml and .ci/run say."""

import importlib
import re
import subprocess
import tomllib

import pytest
from ruamel.yaml import YAML

from flexura import __version__
from helpers.doc_snippets import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PYTHONS = ["3.11", "3.12", "3.13", "3.14"]
MAKE = re.compile(r"^\s*make ([\w-]+)", re.MULTILINE)


def read(name: str):
    return YAML(typ="safe").load(ROOT / name)


def test_the_workflow_runs_what_ci_runs():
    jobs = read(".github/workflows/ci.yml")["jobs"]
    steps = [step["run"] for step in jobs["all"]["steps"] if "run" in step]
    own = [found for step in steps for found in MAKE.findall(step)]
    assert own == MAKE.findall((ROOT / ".ci" / "run").read_text())
    assert len(own) >= 3
    assert [step for step in steps if not MAKE.match(step)] == [
        'git config --global --add safe.directory "$GITHUB_WORKSPACE"'
    ]
    quick = [step["run"] for step in jobs["quick"]["steps"] if "run" in step]
    assert [found for step in quick for found in MAKE.findall(step)] == own


def test_the_night_runs_what_takes_long():
    (job,) = read(".github/workflows/night.yml")["jobs"].values()
    own = [found for step in job["steps"] for found in MAKE.findall(step.get("run", ""))]
    assert own == ["compiler", "test-long", "faults"]


def test_what_the_workflow_keeps_is_named_by_what_it_comes_from():
    text = (ROOT / ".github/workflows/ci.yml").read_text()
    named = [name for names in re.findall(r"hashFiles\(([^)]*)\)", text) for name in re.findall(r"'([^']+)'", names)]
    assert len(named) >= 3 and all((ROOT / name).exists() for name in named)


def test_what_is_done_at_a_commit_is_what_lint_does():
    hooks = [hook["entry"] for repo in read(".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]]
    assert [entry.split()[2] for entry in hooks] == ["ruff", "ruff"]


def test_the_workflow_has_three_systems_and_every_python():
    job = read(".github/workflows/ci.yml")["jobs"]["all"]
    matrix = job["strategy"]["matrix"]
    assert [name.partition("-")[0] for name in matrix["system"]] == ["ubuntu", "macos", "windows"]
    assert matrix["python"] == PYTHONS
    assert PROJECT["requires-python"] == f">={PYTHONS[0]}"
    named = {line.rpartition(" ")[2] for line in PROJECT["classifiers"] if " 3." in line}
    assert named <= set(PYTHONS)


@pytest.mark.parametrize(("system", "folder"), [("Linux", ".venv/bin"), ("Windows_NT", ".venv/Scripts")])
def test_targets_find_their_programs_on_every_system(system, folder):
    command = ["make", "-n", "-o", ".venv/.ready", "lint", f"OS={system}"]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    programs = [line.split()[0] for line in said.splitlines()]
    assert {name.rpartition("/")[0] for name in programs if "/" in name} == {folder}


def test_the_conda_recipe_needs_what_the_project_needs():
    recipe = read("recipe/recipe.yaml")
    wanted = [f"python {PROJECT['requires-python']}"]
    own = [text.replace("matplotlib", "matplotlib-base") for text in PROJECT["dependencies"]]
    wanted += [text.replace(">=", " >=") for text in own]
    assert recipe["requirements"]["run"] == wanted
    assert recipe["context"]["version"] == __version__
    (entry,) = recipe["build"]["python"]["entry_points"]
    assert entry == f"flexura = {PROJECT['scripts']['flexura']}"
    assert recipe["about"]["summary"] == PROJECT["description"]
    assert recipe["about"]["license"] == PROJECT["license"]
    assert recipe["about"]["license_file"] == PROJECT["license-files"]


def test_the_citation_is_of_this_version():
    cited = read("CITATION.cff")
    assert cited["version"] == __version__
    assert cited["license"] == PROJECT["license"].partition(" AND ")[0]
    assert cited["keywords"] == PROJECT["keywords"]


def test_the_image_has_the_programs_that_solids_are_checked_with():
    """The packages of the system that `make packages` installs, but the browser of tests."""
    make = re.search(r"^PACKAGES := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    image = (ROOT / "Dockerfile").read_text()
    assert make is not None
    assert set(make[1].split()) - {"chromium"} <= set(image.split())
    assert "ARG EXTRAS=[all]\n" in image


def test_the_release_check_tries_every_extra_and_its_page_names_every_trial(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "tools")
    check = importlib.import_module("release_check")
    listed = check.trials()
    page = (ROOT / "docs" / "releasing.md").read_text()
    kinds = {name.partition("-")[0] for name in listed}
    assert len(kinds) >= 6 and not [kind for kind in kinds if not re.search(f"`{kind}[-`]", page)]
    extras = PROJECT["optional-dependencies"].keys() - {"all", "bench", "dev", "docs"}
    assert {f"{kind}-{extra}" for kind in ("extra", "lowest") for extra in extras} <= listed.keys()
    assert f"$(BIN)/python {' '.join(check.SITE)}\n" in (ROOT / "Makefile").read_text()


@pytest.mark.parametrize(
    ("wanted", "least"),
    [
        ("numpy>=2.0", "numpy==2.0"),
        ("dask[distributed]>=2024.8", "dask==2024.8"),
        ("pypardiso>=0.4.6; platform_system == 'Linux'", "pypardiso==0.4.6; platform_system == 'Linux'"),
    ],
)
def test_requirements_are_pinned_to_their_least_versions(monkeypatch, wanted, least):
    monkeypatch.syspath_prepend(ROOT / "tools")
    assert importlib.import_module("release_check").least_versions([wanted]) == [least]
