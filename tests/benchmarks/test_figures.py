"""The table of all performance figures: what it says of a figure, and that every benchmark is in it."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="module")
def figures() -> ModuleType:
    spec = importlib.util.spec_from_file_location("performance_figures", HERE / "figures.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def script(folder: Path, *lines: str) -> Path:
    path = folder / "bench_made_up.py"
    path.write_text(
        "\n".join((f"import sys; sys.path.insert(0, {str(HERE)!r})", "from figures import note", *lines)), "utf-8"
    )
    return path


def test_times_and_rates_are_better_in_opposite_directions(figures: ModuleType, tmp_path: Path) -> None:
    path = script(
        tmp_path,
        'note("a time", 2.0, "ms", "other", 8.0, budget=1.0)',
        'note("a rate", 80.0, "x real time", "other", 20.0, budget=50.0)',
        'note("rounds", 1.0, "s", "other", 3.0, [2.0, 5.0, 3.0])',
    )
    (time, rate, rounds), failed, _ = figures.run_benchmark(path, tmp_path / "log")
    assert not failed
    assert (time.ratio, time.kept) == (4.0, False)
    assert (rate.ratio, rate.kept) == (4.0, True)
    assert (rounds.ratio, rounds.lowest, rounds.highest, rounds.kept) == (3.0, 2.0, 5.0, None)
    assert time.row() == "| a time | 2 ms | other | 8 | 4 | 1 | **no** |"
    assert rounds.row() == "| rounds | 1 s | other | 3 | 3 (2 to 5) |  |  |"


def test_a_benchmark_that_fails_keeps_what_it_noted_and_says_why(figures: ModuleType, tmp_path: Path) -> None:
    path = script(tmp_path, 'note("first", 1.0, "s")', 'raise RuntimeError("the rival is absent")')
    found, failed, _ = figures.run_benchmark(path, tmp_path / "log")
    assert [figure.what for figure in found] == ["first"]
    assert failed == "RuntimeError: the rival is absent"


def test_alone_a_benchmark_notes_nothing(figures: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(figures.NOTES, raising=False)
    monkeypatch.chdir(tmp_path)
    figures.note("nobody listens", 1.0, "s")
    assert not list(tmp_path.iterdir())


def test_machine_and_versions_are_told(figures: ModuleType) -> None:
    lines = "\n".join(figures.machine())
    assert "cores" in lines and "numpy 2" in lines and "Python 3" in lines and "commit" in lines


@pytest.mark.parametrize("path", sorted(HERE.glob("bench_*.py")), ids=lambda path: path.stem)
def test_every_benchmark_notes_figures(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "from figures import note" in text
    assert "    note(" in text
