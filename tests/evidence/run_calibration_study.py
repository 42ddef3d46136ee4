"""Calibrate with levels of known parameters (calibration_study.py), and record what came back.

`python tests/evidence/run_calibration_study.py --rows rows.jsonl --record tests/evidence/calibration_record.json`; with
`--rows` it goes on where it was stopped, as long as the sources are the same.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import platform
import subprocess
import sys
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")
HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "gears")]  # the second for printed_equations

from calibration_study import (  # noqa: E402
    SEED,
    SEEDS,
    TRUTHS,
    Case,
    cases,
    levels_of,
    rows_of,
    scores,
    source_files,
    sources,
    table,
    truths,
)

Levels = dict[tuple[str | None, int], list[float]]


def true_levels(wanted: list[Case], jobs: int) -> Levels:
    """Levels of all true drives of some cases, each from the equations of motion."""
    misfits = {case.misfit for case in wanted}
    held = [truth for truth in truths() if truth.misfit in misfits]
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        return {(t.misfit, t.index): levels for t, levels in zip(held, pool.map(levels_of, held), strict=True)}


def run(wanted: list[Case], seeds: range, levels: Levels, jobs: int, out: Path | None) -> dict[str, list[Any]]:
    """Calibrate all seeds of the cases, those in the file left out; the rows of each case by their seeds."""
    done: dict[str, dict[int, Any]] = {case.name: {} for case in wanted}
    stamp = sources()
    if out is not None and out.exists():
        for row in map(json.loads, out.read_text(encoding="utf-8").splitlines()):
            if row["sources"] == stamp and row["case"] in done:
                done[row["case"]] |= {held["seed"]: held for held in row["rows"] if held["seed"] in seeds}
    tasks = []
    for case in wanted:
        for index in range(TRUTHS):
            missing = [seed for seed in seeds if seed % TRUTHS == index and seed not in done[case.name]]
            if missing:
                tasks.append((case, index, missing))
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        futures = {pool.submit(rows_of, *task, levels[task[0].misfit, task[1]]): task[0] for task in tasks}
        for future in concurrent.futures.as_completed(futures):
            case, rows = futures[future], future.result()
            done[case.name] |= {row["seed"]: row for row in rows}
            if out is not None:
                with out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"sources": stamp, "case": case.name, "rows": rows}) + "\n")
    return {name: [rows[seed] for seed in sorted(rows)] for name, rows in done.items()}


def made_by() -> dict[str, Any]:
    """Return the commit, whether the checkout differs from it, versions and settings."""
    from tdacoustic.fitting.settings import FitSettings

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    libraries = ("numpy", "scipy", "numba", "lmfit")
    return {
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", *map(str, source_files()))),
        "versions": {"python": platform.python_version(), **{name: version(name) for name in libraries}},
        "sources_sha256": sources(),
        "settings": asdict(FitSettings()),
        "seed": SEED,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path, help="JSON file to write; needs all cases and all seeds")
    parser.add_argument("--rows", type=Path, help="JSON lines with the rows of all seeds; those in it are kept")
    parser.add_argument("--seeds", default=f"0:{SEEDS}", help="A:B, B not included")
    parser.add_argument("--cases", default="", help="part of the names of the cases that are run")
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    seeds = range(*(int(part) for part in arguments.seeds.split(":")))
    wanted = [case for case in cases() if arguments.cases in case.name]
    if arguments.record is not None and (seeds != range(SEEDS) or len(wanted) < len(list(cases()))):
        sys.exit("--record needs all cases and all seeds")
    record: dict[str, Any] = {"schema": "tdacoustic-calibration-study/1", **made_by()}
    start = time.perf_counter()
    levels = true_levels(wanted, arguments.jobs)
    print(f"{len(levels)} true drives: {time.perf_counter() - start:.0f} s", flush=True)
    rows = run(wanted, seeds, levels, arguments.jobs, arguments.rows)
    results = {case.name: scores(case, rows[case.name]) for case in wanted}
    print(f"{sum(map(len, rows.values()))} calibrations: {time.perf_counter() - start:.0f} s\n{table(results)}")
    if sources() != record["sources_sha256"]:
        sys.exit("the sources changed during the run: nothing is written")
    if arguments.record is not None:
        record["truths"] = [{**asdict(truth), "levels_db": levels[truth.misfit, truth.index]} for truth in truths()]
        record["cases"] = results
        arguments.record.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
