"""Run the study of README.md: `run_study.py --seeds 0:100 --jobs 2 -o tune.jsonl`; resumable, a JSON line a seed."""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).parent))

from scoring import score_seed, scores, table  # noqa: E402


def step_versions() -> dict[str, int]:
    """Return the versions of the steps that the scores rest on."""
    from tdacoustic.attribution import EVIDENCE
    from tdacoustic.measured.measurement_step import MEASUREMENT
    from tdacoustic.measured.speed_step import SPEED
    from tdacoustic.measured.survey_step import SURVEY

    return {step.name: step.version for step in (SPEED, SURVEY, MEASUREMENT, EVIDENCE)}


def settings() -> dict[str, Any]:
    """Return the constants of the tuned modules."""
    from tdacoustic.attribution import dominance, excitation, judgement, kinematic, radiator
    from tdacoustic.lines import detection, floor

    modules = (detection, floor, dominance, excitation, judgement, kinematic, radiator)
    return {
        module.__name__: {
            key: value
            for key, value in vars(module).items()
            if key.isupper() and isinstance(value, (int, float, tuple)) and not key.startswith("_")
        }
        for module in modules
    }


def one(seed: int, keep: str | None) -> dict[str, Any]:
    """Score a seed in a folder of its own, kept or thrown away."""
    folder = Path(keep) / str(seed) if keep else Path(tempfile.mkdtemp(prefix="evidence-"))
    try:
        return score_seed(seed, folder)
    finally:
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)


def run(seeds: range, jobs: int, out: Path | None, keep: str | None) -> list[dict[str, Any]]:
    """Score all seeds that the file does not hold yet, and return all."""
    done = {}
    if out is not None and out.exists():
        done = {row["seed"]: row for row in map(json.loads, out.read_text(encoding="utf-8").splitlines())}
    missing = [seed for seed in seeds if seed not in done]
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        futures = {pool.submit(one, seed, keep): seed for seed in missing}
        for future in concurrent.futures.as_completed(futures):
            row = future.result()
            done[row["seed"]] = row
            if out is not None:
                with out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    return [done[seed] for seed in seeds]


def record(path: Path, name: str, seeds: range, result: dict[str, Any]) -> None:
    """Put the scores into the record, with what they were made by."""
    import numpy
    import scipy

    def git(*words: str) -> str:
        return subprocess.run(
            ["git", *words], capture_output=True, text=True, check=True, cwd=path.parent
        ).stdout.strip()

    content = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    content["schema"] = "tdacoustic-evidence/1"
    content[name] = {
        "seeds": [seeds.start, seeds.stop - 1],
        "commit": git("rev-parse", "HEAD") + (" + dirty" if git("status", "--porcelain", "--", "../..") else ""),
        "versions": {"python": platform.python_version(), "numpy": numpy.__version__, "scipy": scipy.__version__},
        "steps": step_versions(),
        "settings": settings(),
        "scores": result,
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", required=True, help="A:B, B not included")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--out", type=Path, help="a JSON line a seed; those in it are not run again")
    parser.add_argument("--keep", help="folder for logs and stores of each seed; else thrown away")
    parser.add_argument("--record", type=Path)
    parser.add_argument("--as", dest="name", default="study")
    options = parser.parse_args()
    start, stop = (int(part) for part in options.seeds.split(":"))
    result = scores(run(range(start, stop), options.jobs, options.out, options.keep))
    print(table(result))
    if options.record is not None:
        record(options.record, options.name, range(start, stop), result)


if __name__ == "__main__":
    main()
