"""The pytest side of the comparisons with outside truths: gathers rows, writes the pages, holds the committed ones.

A test's rows travel in its reports, so that they arrive from the worker processes of pytest-xdist as well. One process
judges and writes: the one that was started. The workers collect, and tell it what they left out.
"""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conformance_page import COMMAND, page, table_of_a_run
from conformance_rows import Kept, Row, differences, load, save

# What makes the numbers, and the programs that some are held against.
PROGRAMS = ("numpy", "scipy", "pandas", "PyOctaveBand", "ngsolve", "lmfit", "emcee", "exudyn", "bempp-cl", "rota-order")
PROGRAMS += ("librosa", "mpmath", "npTDMS", "asammdf", "pyuff", "soundfile")
MOST_SAID = 30


PROPERTY = "conformance"  # of a test's report, of what a worker returns, and of this plugin


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--conformance", metavar="FILE", help="write this run's comparisons with outside truths as a page")
    parser.addoption(
        "--conformance-update",
        action="store_true",
        help="write tests/conformance.json and CONFORMANCE.md with the rows of the tests that ran",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the plugin of this process: one that judges, or a worker's."""
    worker = hasattr(config, "workerinput")
    config.pluginmanager.register(Worker(config) if worker else Conformance(config), PROPERTY)


@pytest.fixture
def conformance(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Compare with an outside truth and record it: ``conformance(what, expected, got, tolerance, unit, source)``.

    ``source`` is ``kind: where to look it up``, with a kind of ``conformance_rows.KINDS``. A wide tolerance has its
    reason in ``note``. ``deviates=True`` states openly that the row does not hold, with the reason in ``note``: the
    page shows it first, and the test fails as soon as it does hold.
    """

    def compare(
        what: str,
        expected: float,
        got: float,
        tolerance: float,
        unit: str,
        source: str,
        note: str = "",
        *,
        deviates: bool = False,
    ) -> None:
        row = Row(request.node.nodeid, what, float(expected), float(got), float(tolerance), unit, source, note)
        assert unit, f"{what}: the unit is missing; of a plain number it is '1'"
        assert note or not deviates, f"{what}: a deviation needs a note that says why"
        assert note or not row.wide, f"{what}: ± {tolerance:.3g} {unit} is wide and needs a note that says why"
        request.node.user_properties.append((PROPERTY, row.values()))  # travels in the reports of the test
        if deviates:
            assert not row.holds, f"{what}: stated as a deviation, but it holds: got {row.got:.9g}"
            return
        assert row.holds, f"{what}: expected {row.expected:.9g} ± {tolerance:.3g} {unit} ({source}), got {row.got:.9g}"

    return compare


class Collecting:
    """What a process that collects tests leaves out."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.skipped_files: set[str] = set()
        self.cut = False

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.skipped:
            self.skipped_files.add(report.nodeid)

    def pytest_deselected(self, items: list[pytest.Item]) -> None:
        self.cut = self.cut or bool(items)


class Worker(Collecting):
    """One of the processes that pytest-xdist shares the tests among."""

    def pytest_sessionfinish(self) -> None:
        self.config.workeroutput[PROPERTY] = {"cut": self.cut, "skipped_files": sorted(self.skipped_files)}


class Conformance(Collecting):
    """Rows of one run, and what became of each test."""

    def __init__(self, config: pytest.Config) -> None:
        super().__init__(config)
        self.rows_file = config.rootpath / "tests" / "conformance.json"
        self.page_file = config.rootpath / "CONFORMANCE.md"
        self.rows: dict[str, list[Row]] = {}
        self.outcomes: dict[str, str] = {}
        self.collected: set[str] = set()
        self.said: list[str] = []
        self.written = ""

    # ---- what pytest tells

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.collected.update(item.nodeid for item in session.items)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_node_collection_finished(self, ids: list[str]) -> None:
        self.collected.update(ids)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        told = getattr(node, "workeroutput", {}).get(PROPERTY)  # nothing where the worker crashed
        if told:
            self.cut = self.cut or told["cut"]
            self.skipped_files.update(told["skipped_files"])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        before = self.outcomes.get(report.nodeid, "passed")
        self.outcomes[report.nodeid] = before if before != "passed" else report.outcome
        # Each report of a test has all rows so far: the last one's hold.
        rows = [Row(report.nodeid, *values) for name, values in report.user_properties if name == PROPERTY]
        if rows:
            self.rows[report.nodeid] = rows

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        target = self.config.getoption("--conformance")
        if target:
            _write(Path(target), table_of_a_run([row for test in sorted(self.rows) for row in self.rows[test]]))
        if self.config.getoption("--conformance-update"):
            kept = self.updated(load(self.rows_file))
            save(kept, self.rows_file)
            _write(self.page_file, page(kept))
            self.written = (
                f"CONFORMANCE.md and tests/conformance.json: {len(kept.all())} rows of {len(kept.rows)} tests"
            )
        elif self.whole():
            self.said = self.stale(load(self.rows_file))
            if self.said and session.exitstatus == pytest.ExitCode.OK:
                session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self.written:
            terminalreporter.line(self.written)
        if not self.said:
            return
        terminalreporter.section("CONFORMANCE.md is not what this run found", sep="=", red=True)
        for line in self.said[:MOST_SAID]:
            terminalreporter.line(line)
        if len(self.said) > MOST_SAID:
            terminalreporter.line(f"... and {len(self.said) - MOST_SAID} more")
        terminalreporter.line(
            f"Where the change is meant: `{COMMAND}` writes tests/conformance.json and CONFORMANCE.md anew "
            "(with the paths of some tests: their rows alone); look at the difference and commit both."
        )

    # ---- what follows

    def whole(self) -> bool:
        """Return whether this run had the whole suite: every test was wanted, and each has ended."""
        config = self.config
        wanted = [(config.invocation_params.dir / argument).resolve() for argument in config.args]
        left_out = self.cut or any(config.getoption(name, None) for name in ("ignore", "ignore_glob", "lf"))
        ended = self.collected and self.collected == set(self.outcomes)
        return wanted == [(config.rootpath / "tests").resolve()] and not left_out and bool(ended)

    def stale(self, kept: Kept) -> list[str]:
        """Return what of the committed rows is not what this whole run found, a sentence each."""
        said = []
        for test in sorted(set(kept.rows) | set(self.rows)):
            if test not in kept.rows and not kept.whole:
                continue  # nobody has collected all rows yet
            if self.outcomes.get(test) == "passed":
                said += differences(kept.rows.get(test, ()), self.rows.get(test, ()))
            elif test in kept.rows and self._is_gone(test):
                said.append(f"{test}: there is no such test any more, but rows of it")
        return said

    def updated(self, kept: Kept) -> Kept:
        """Return the rows with those of the tests that passed; rows of tests that did not run here stay."""
        whole = self.whole()
        rows = {
            test: held
            for test, held in kept.rows.items()
            if self.outcomes.get(test) != "passed" and not (whole and self._is_gone(test))
        }
        for test, found in self.rows.items():
            if self.outcomes.get(test) == "passed":
                rows[test] = [row.kept() for row in found]
        complete = whole and set(self.outcomes.values()) <= {"passed", "skipped"}
        return Kept(dict(sorted(rows.items())), _versions(), kept.whole or complete)

    def _is_gone(self, test: str) -> bool:
        """Return whether a test is not there, as opposed to one that could not run here."""
        file, _, name = test.partition("::")
        if test in self.outcomes or file in self.skipped_files:
            return False
        function = f"{file}::{name.partition('[')[0]}"
        cases = [other for other in self.outcomes if other.partition("[")[0] == function]
        return not (cases and all(self.outcomes[other] == "skipped" for other in cases))


def _versions() -> dict[str, str]:
    found = {"Python": platform.python_version()}
    for name in PROGRAMS:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
