"""Every performance figure of the project as one table: what, against whom, how many times, with machine and versions.

    python tests/benchmarks/figures.py [name ...] [-o FILE] [--log DIR]

Runs the benchmarks beside this file (all, or those named: ``gears``, ``orders``, ...), each in a process of its own on
one core, one after the other, and prints what they `note` as a Markdown table. About an hour for all; a benchmark whose
rival is not installed says so and the others go on. Run it on an otherwise idle machine: the load at the start and at
the end is printed, so that a reader can tell whether it was.

A figure is measured beside its rival in one run; where there is no rival it stands beside its budget alone.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

__all__ = ["Figure", "note", "processor"]

HERE = Path(__file__).resolve().parent
NOTES = "TDACOUSTIC_FIGURES"
"""Names the file that figures are noted in; without it a benchmark only prints its own tables."""
LIBRARIES = ("tdacoustic", "numpy", "scipy", "numba", "pandas", "h5py", "soundfile", "lmfit", "PyOctaveBand")
RIVALS = ("rota-order", "librosa", "bempp-cl", "ngsolve", "npTDMS", "asammdf", "pyuff", "exudyn", "distributed")


@dataclass(frozen=True)
class Figure:
    """One figure of performance.

    Parameters
    ----------
    what : str
    ours : float
    unit : str
        Of `ours`: a time as ``s``, ``ms``, or a rate as ``MB/s``, ``x real time``.
    against : str
        Whom or what it is held against; empty where there is nobody.
    theirs : float or None
        In the same unit.
    ratio : float or None
        How many times better we are than they: above 1 we are ahead.
    lowest, highest : float or None
        Of the ratio over the rounds.
    budget : float or None
        In the same unit.
    """

    what: str
    ours: float
    unit: str
    against: str = ""
    theirs: float | None = None
    ratio: float | None = None
    lowest: float | None = None
    highest: float | None = None
    budget: float | None = None

    @property
    def is_rate(self) -> bool:
        """Whether more is better."""
        return self.unit.endswith("/s") or self.unit == "x real time" or self.unit == "times"

    @property
    def kept(self) -> bool | None:
        """Whether the budget is kept."""
        if self.budget is None:
            return None
        return self.ours >= self.budget if self.is_rate else self.ours <= self.budget

    def row(self) -> str:
        """Return it as a row of a Markdown table."""
        spread = "" if self.lowest is None or self.highest is None else f" ({self.lowest:.3g} to {self.highest:.3g})"
        ratio = "" if self.ratio is None else f"{self.ratio:.3g}{spread}"
        theirs = "" if self.theirs is None else f"{self.theirs:.3g}"
        kept = {None: "", True: "yes", False: "**no**"}[self.kept]
        budget = "" if self.budget is None else f"{self.budget:g}"
        ours = f"{self.ours:.3g} {self.unit}"
        return f"| {self.what} | {ours} | {self.against} | {theirs} | {ratio} | {budget} | {kept} |"


def note(
    what: str,
    ours: float,
    unit: str,
    against: str = "",
    theirs: float | None = None,
    ratios: Sequence[float] = (),
    budget: float | None = None,
) -> None:
    """Note a figure for the table of all, where somebody makes one.

    Parameters
    ----------
    what, ours, unit, against, theirs, budget
        As of `Figure`.
    ratios : sequence of float
        How many times better we were in each round; default the one of `ours` and `theirs`.
    """
    path = os.environ.get(NOTES)
    if path is None:
        return
    figure = Figure(what, ours, unit, against, theirs, budget=budget)
    held = sorted(ratios)
    if held:
        figure = replace(figure, ratio=held[len(held) // 2], lowest=held[0], highest=held[-1])
    elif theirs is not None:
        figure = replace(figure, ratio=ours / theirs if figure.is_rate else theirs / ours)
    with Path(path).open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(asdict(figure), ensure_ascii=False) + "\n")


def run_benchmark(script: Path, log: Path) -> tuple[list[Figure], str, float]:
    """Run a benchmark on one core; return its figures, why it failed (or nothing), and the seconds it took."""
    with tempfile.TemporaryDirectory() as folder:
        notes = Path(folder) / "figures.jsonl"
        root = str(HERE.parents[1])
        paths = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = {**os.environ, NOTES: str(notes), "PYTHONPATH": paths}
        start = time.perf_counter()
        with log.open("w", encoding="utf-8") as stream:
            found = subprocess.run([sys.executable, str(script)], env=environment, stdout=stream, stderr=stream)
        took = time.perf_counter() - start
        lines = notes.read_text(encoding="utf-8").splitlines() if notes.exists() else []
    failed = ""
    if found.returncode:
        said = log.read_text(encoding="utf-8").strip().splitlines()
        failed = said[-1] if said else f"exit {found.returncode}"
    return [Figure(**json.loads(line)) for line in lines], failed, took


def processor() -> str:
    """Return the name of the processor, empty where the system does not tell."""
    return next((line.split(":")[1].strip() for line in _lines("/proc/cpuinfo") if "model name" in line), "")


def machine() -> list[str]:
    """Return lines on machine and versions."""
    memory = next((int(line.split()[1]) / 2**20 for line in _lines("/proc/meminfo") if "MemTotal" in line), None)
    held = f"{memory:.0f} GiB" if memory else "memory unknown"
    return [
        f"{platform.system()} {platform.machine()} {processor()}, {os.cpu_count()} cores, {held}; commit {_commit()}",
        f"Python {platform.python_version()}, {_versions(LIBRARIES)}",
        f"beside: {_versions(RIVALS)}",
    ]


def _versions(names: Iterable[str]) -> str:
    found = []
    for name in names:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} absent")
    return ", ".join(found)


def _commit() -> str:
    try:
        found = subprocess.run(
            ["git", "-C", str(HERE), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
        )
        changed = subprocess.run(["git", "-C", str(HERE), "status", "--porcelain"], capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return found.stdout.strip() + (" with changes" if changed.stdout.strip() else "")


def _lines(path: str) -> list[str]:
    return Path(path).read_text(encoding="utf-8").splitlines() if Path(path).exists() else []


def _load() -> str:
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def main() -> None:
    """Run the benchmarks and print the table."""
    asked = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    known = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
    asked.add_argument("names", nargs="*", metavar="name", help=", ".join(known))
    asked.add_argument("-o", "--out", type=Path, help="write the table to a file too")
    asked.add_argument("--log", type=Path, help="folder for what the benchmarks print themselves")
    options = asked.parse_args()
    wrong = sorted(set(options.names) - set(known))
    if wrong:
        asked.error(f"no benchmark {', '.join(wrong)}; there are {', '.join(known)}")
    logs = options.log or Path(tempfile.mkdtemp(prefix="figures-"))
    logs.mkdir(parents=True, exist_ok=True)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    head = [*machine(), f"one core; load at the start {_load()}"]
    rows, notes = [], []
    for name in options.names or known:
        print(f"{name} ...", file=sys.stderr, flush=True)
        figures, failed, took = run_benchmark(known[name], logs / f"{name}.log")
        rows += [figure.row() for figure in figures]
        notes.append(f"{name}: {took:.0f} s" + (f", **failed**: {failed}" if failed else ""))
    text = "\n".join(
        [
            *(f"{line}  " for line in head),
            f"load at the end {_load()}; what each took: {'; '.join(notes)}",
            "",
            "| what | ours | against | theirs | times better (over the rounds) | budget | kept |",
            "|---|---|---|---|---|---|---|",
            *rows,
        ]
    )
    print(text)
    print(f"what the benchmarks printed: {logs}", file=sys.stderr)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")
    if not rows:
        sys.exit("no figure was measured")


if __name__ == "__main__":
    main()
