"""The `verify` fixture: compare a number with its reference, record it, and hold `docs/verification.csv` to it.

Files of many slow tests come first, so that short ones are left for the process that is done first. Hypothesis draws
the same on every run, new examples with FLEXURA_DRAWS=new.
"""

from __future__ import annotations

import os
import pickle
import signal
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

import helpers.verification_report as page

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "verification.md"
FOLDERS = (HERE / "literature", HERE / "opensees")
OPTION = "--verification-page"

settings.register_profile("same", derandomize=True, database=None, deadline=None)
settings.register_profile("new", print_blob=True, deadline=None)
settings.load_profile(os.environ.get("FLEXURA_DRAWS", "same"))

Verify = Callable[..., None]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes the page."""
    parser.addoption(OPTION, metavar="FILE", help="write what the verification tests measure to FILE")


def pytest_configure(config: pytest.Config) -> None:
    """Start an empty record, and let processes of tests be interrupted where the suite, a background job, is not."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # which they would inherit
        signal.signal(signal.SIGINT, signal.default_int_handler)
    config.pluginmanager.register(Record(config), "verification")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Order files by their slow tests, then by all that they have."""
    tests = Counter(item.path for item in items)
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: (-slow[item.path], -tests[item.path], item.path))


@pytest.fixture
def verify(pytestconfig: pytest.Config) -> Verify:
    """Return `verify(case, quantity, computed, reference, tolerance, unit="Hz")`.

    Numbers may be sequences, which become numbered rows. Every row must lie within its relative tolerance and, unless
    the page is being written, stand in the table.
    """
    return pytestconfig.pluginmanager.get_plugin("verification").verify


class Record:
    """What the tests of a run measured, and whether that was everything."""

    def __init__(self, config: pytest.Config) -> None:
        self.target = config.getoption(OPTION)
        self.printed = {} if self.target else page.read(PAGE)
        self.measured: dict[tuple[str, str], page.Measurement] = {}
        self.files: set[Path] = set()
        self.messages: list[str] = []
        self.complete = True

    def verify(
        self,
        case: page.Case,
        quantity: str,
        computed: float | Sequence[float],
        reference: float | Sequence[float],
        tolerance: float | Sequence[float],
        unit: str = "Hz",
    ) -> None:
        """Record and check measurements."""
        rows = page.measurements(case, quantity, computed, reference, tolerance, unit)
        for row in rows:
            assert row.key not in self.measured, f"{row.key} was measured twice"
            self.measured[row.key] = row
        for row in rows:
            row.check()
        if not self.target:
            stale = [r.quantity for r in rows if r.key not in self.printed or self.printed[r.key].differs_from(r)]
            assert not stale, f"{PAGE.stem}.csv, {case.name}: {stale} not as measured; run `make verification`"

    def pytest_deselected(self, items: Sequence[pytest.Item]) -> None:
        """Tests were left out."""
        self.complete &= not any(item.path.is_relative_to(folder) for item in items for folder in FOLDERS)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A file that is skipped or fails leaves the record incomplete."""
        self.pytest_runtest_logreport(report)

    def pytest_runtest_logreport(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        """So does a test."""
        if not report.passed and any(folder.name in Path(report.nodeid.split("::")[0]).parts for folder in FOLDERS):
            self.complete = False

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Take over what a process of `pytest -n` measured."""
        own = pickle.loads(node.workeroutput["verification"])
        self.measured |= own["measured"]
        self.files |= own["files"]
        self.complete &= own["complete"]

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the page, or look for rows of it that nothing measures any more; after a complete run only."""
        self.files |= {item.path for item in getattr(session, "items", ())}
        if hasattr(session.config, "workeroutput"):  # a process of `pytest -n`
            own = {"measured": self.measured, "files": self.files, "complete": self.complete}
            session.config.workeroutput["verification"] = pickle.dumps(own)
            return
        files = {path for folder in FOLDERS for path in folder.glob("test_*.py")}
        complete = self.complete and files <= self.files and not any("::" in text for text in session.config.args)
        surplus = sorted(set(self.printed) - set(self.measured))
        if self.target and complete:
            page.write(Path(self.target), self.measured.values())
            self.messages.append(f"verification page written to {self.target}")
        elif self.target:
            self._fail(session, "verification page not written: a test failed, was skipped or was left out")
        elif complete and surplus:
            self._fail(session, f"{PAGE.stem}.csv has rows that nothing measures, run `make verification`: {surplus}")

    def _fail(self, session: pytest.Session, message: str) -> None:
        self.messages.append(message)
        session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say what became of the page."""
        for message in self.messages:
            terminalreporter.line(message)
