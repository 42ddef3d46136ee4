"""Compare the two ways to a steady state on random conditions (gear_motions.py), and record what came out.

`python tests/evidence/run_gear_study.py --record tests/evidence/gear_record.json --jobs 2`, about six minutes.
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
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "gears")]  # the second for reference_drive

from gear_motions import SEED, Condition, row_of, scores, sources  # noqa: E402

CONDITIONS = {"all loads": 400, "light loads": 200}


def run(group: str, jobs: int) -> list[dict[str, Any]]:
    """Compare all conditions of a group."""
    conditions = [Condition.draw(group, index) for index in range(CONDITIONS[group])]
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(row_of, conditions, chunksize=4))


def made_by() -> dict[str, Any]:
    """Return the commit, whether the checkout differs from it, and the versions."""
    import numba
    import numpy
    import scipy

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    versions = {"numpy": numpy.__version__, "scipy": scipy.__version__, "numba": numba.__version__}
    return {
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", "../../tdacoustic/gears")),
        "versions": {"python": platform.python_version(), **versions},
        "sources_sha256": sources(),
        "seed": SEED,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path, help="JSON file to write")
    parser.add_argument("--rows", type=Path, help="JSON file for the rows of all conditions")
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    record: dict[str, Any] = {"schema": "tdacoustic-gear-study/1", **made_by()}
    rows = {}
    for group in CONDITIONS:
        start = time.perf_counter()
        rows[group] = run(group, arguments.jobs)
        record[group] = scores(rows[group])
        print(f"{group}: {time.perf_counter() - start:.0f} s\n{json.dumps(record[group], indent=1)}")
    if sources() != record["sources_sha256"]:
        sys.exit("the sources changed during the run: nothing is written")
    for path, content in ((arguments.record, record), (arguments.rows, rows)):
        if path is not None:
            path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
