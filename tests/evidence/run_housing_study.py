"""Compute modes and responses of the reference housing in several ways (housing_study.py), and record them.

``python tests/evidence/run_housing_study.py`` computes our side anew, about six minutes on one core, and keeps the
recorded tetrahedra; ``--tetrahedra`` computes these, about six more. Needs NGSolve (extra housing).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NGS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "housing"), str(HERE.parents[1])]

import housing_study as study  # noqa: E402


def made_by() -> dict[str, Any]:
    """Return the commit, whether the checkout differs from it, and versions."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    return {
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", *map(str, study.source_files()))),
        "versions": {"python": platform.python_version(), **{n: version(n) for n in ("numpy", "scipy", "ngsolve")}},
    }


def write(record: dict[str, Any]) -> None:
    study.RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def computed_tetrahedra(old: dict[str, Any]) -> dict[str, Any]:
    """Return the tetrahedra's side; cases that are in the record already, of the same sources, stay."""
    stamp, done = study.tetrahedra_sources(), []
    if old.get("tetrahedra", {}).get("sources_sha256") == stamp:
        done = old["tetrahedra"]["cases"]
    for case in study.TETRAHEDRA[len(done) :]:
        done.append(study.tetrahedra(case))
        print(f"tetrahedra {case}: {done[-1]['cpu_s']} s", flush=True)
        write(old | {"tetrahedra": {**made_by(), "sources_sha256": stamp, "cases": done}})
    return {**made_by(), "sources_sha256": stamp, "cases": done}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tetrahedra", action="store_true", help="compute the tetrahedra, and nothing else")
    arguments = parser.parse_args()
    import ngsolve

    ngsolve.SetNumThreads(1)
    old = study.record() if study.RECORD.exists() else {"schema": "tdacoustic-housing-study/1"}
    if arguments.tetrahedra:
        write(old | {"tetrahedra": computed_tetrahedra(old)})
        return
    before = study.sources()
    ours: dict[str, Any] = {"finest": study.grid_modes(*study.FINEST)}
    print(f"finest: {ours['finest']['cpu_s']} s", flush=True)
    ours["grids"] = []
    for factor, order in study.GRIDS:
        ours["grids"].append(study.grid_modes(factor, order))
        print(f"edges times {factor}, order {order}: {ours['grids'][-1]['cpu_s']} s", flush=True)
    ours["responses"] = study.responses()
    if study.sources() != before:
        sys.exit("the sources changed during the run: nothing is written")
    old = study.record() if study.RECORD.exists() else old
    write(old | {**made_by(), "sources_sha256": before, **ours})


if __name__ == "__main__":
    main()
