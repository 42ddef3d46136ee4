"""What all tests share: the table of comparisons with outside truths, and the real recordings."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))  # for plain_fleets, made_up_modes, studies, conformance_*

import conformance_plugin
from conformance_rows import Row

# The same examples in every run, so that a run tells of the change and not of the dice; HYPOTHESIS_PROFILE=search
# looks for new ones.
settings.register_profile("same", derandomize=True)
settings.register_profile("search", max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--conformance", metavar="FILE", help="write this run's comparisons with outside truths as a page")
    parser.addoption(
        "--conformance-update",
        action="store_true",
        help="write tests/conformance.json and CONFORMANCE.md with the rows of the tests that ran",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(conformance_plugin.plugin(config), conformance_plugin.PROPERTY)


@pytest.fixture
def conformance(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Compare with an outside truth and record it: ``conformance(what, expected, got, tolerance, unit, source)``.

    ``source`` is ``kind: where to look it up``, with a kind of ``conformance_rows.KINDS``.
    """

    def compare(what: str, expected: float, got: float, tolerance: float, unit: str, source: str) -> None:
        row = Row(request.node.nodeid, what, float(expected), float(got), float(tolerance), unit, source)
        conformance_plugin.record(request.node, row)
        assert row.holds, f"{what}: expected {row.expected:.9g} ± {tolerance:.3g} {unit} ({source}), got {row.got:.9g}"

    return compare


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


@pytest.fixture
def hears_ctrl_c() -> Iterator[None]:
    """Let the programs that a test starts hear Ctrl-C: a shell's background job is deaf to it and hands that on."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def real_recordings() -> Path:
    """Folder of the real recordings beside the checkout; the test is skipped where it is absent."""
    folder = SHARED / "recordings"
    if not folder.is_dir():
        pytest.skip("the real recordings are not at hand")
    return folder
