"""What all tests share: the table of comparisons with outside truths, and the real recordings."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))  # for plain_fleets, made_up_modes, studies

# The same examples in every run, so that a run tells of the change and not of the dice; HYPOTHESIS_PROFILE=search
# looks for new ones.
settings.register_profile("same", derandomize=True)
settings.register_profile("search", max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

SHARED = Path(__file__).resolve().parents[2] / "shared"


@dataclass(frozen=True)
class Row:
    """One comparison with a truth that is not our own."""

    test: str
    what: str
    expected: float
    got: float
    tolerance: float
    unit: str
    source: str


_ROWS = pytest.StashKey[list[Row]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--conformance", metavar="FILE", help="write the comparisons with outside truths as a table")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_ROWS] = []


@pytest.fixture
def conformance(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Compare with an outside truth and record it: ``conformance(what, expected, got, tolerance, unit, source)``."""

    def compare(what: str, expected: float, got: float, tolerance: float, unit: str, source: str) -> None:
        row = Row(request.node.nodeid, what, float(expected), float(got), float(tolerance), unit, source)
        request.config.stash[_ROWS].append(row)
        assert math.isfinite(row.got), f"{what}: got {got}"
        assert abs(row.got - row.expected) <= row.tolerance, (
            f"{what}: expected {expected:.9g} ± {tolerance:.3g} {unit} ({source}), got {got:.9g}"
        )

    return compare


def pytest_sessionfinish(session: pytest.Session) -> None:
    target = session.config.getoption("--conformance")
    if not target:
        return
    rows = sorted(session.config.stash[_ROWS], key=lambda row: (row.source, row.test, row.what))
    lines = [
        "# Comparisons with outside truths",
        "",
        f"{len(rows)} comparisons, made by the tests. `of the tolerance`: distance from the expected value over the",
        "tolerance; 1 would just pass.",
        "",
        "| what | expected | got | tolerance | of the tolerance | unit | source | test |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        part = abs(row.got - row.expected) / row.tolerance if row.tolerance else 0.0
        cells = (row.what, f"{row.expected:.7g}", f"{row.got:.7g}", f"{row.tolerance:.3g}", f"{part:.2f}", row.unit)
        lines.append("| " + " | ".join((*cells, row.source, row.test.split("/")[-1])) + " |")
    path = Path(target)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.fixture
def call_program(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run the program in this process: ``call_program(*arguments)`` returns exit code, stdout, stderr."""

    def call(*arguments: object) -> tuple[int, str, str]:
        from tdacoustic.cli import main

        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return call


@pytest.fixture(scope="session")
def real_recordings() -> Path:
    """Folder of the real recordings beside the checkout; the test is skipped where it is absent."""
    folder = SHARED / "recordings"
    if not folder.is_dir():
        pytest.skip("the real recordings are not at hand")
    return folder
