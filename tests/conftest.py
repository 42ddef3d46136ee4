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

from conformance_plugin import conformance, pytest_addoption, pytest_configure

__all__ = ["conformance", "pytest_addoption", "pytest_configure"]

# The same examples in every run, so that a run tells of the change and not of the dice; HYPOTHESIS_PROFILE=search
# looks for new ones.
settings.register_profile("same", derandomize=True)
settings.register_profile("search", max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

SHARED = Path(__file__).resolve().parents[2] / "shared"


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
