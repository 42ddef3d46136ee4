"""Compare our boundary elements with bempp-cl and ngsolve.bem, with themselves on finer grids, and their energies.

``python tests/evidence/run_radiation_study.py``, half a minute, computes our side anew and keeps the recorded fields of
the other codes. With ``--fields`` these are computed too, in an environment with bempp-cl and ngsolve: ten minutes on
two cores, a third of it their compilation.
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

os.environ.setdefault("OMP_NUM_THREADS", "1")
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import radiation_study as study  # noqa: E402


def made_by(*libraries: str) -> dict[str, Any]:
    """Return the commit, whether the checkout differs from it, and versions."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    parts = ["../../tdacoustic/radiation", "."]
    return {
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", *parts)),
        "versions": {"python": platform.python_version(), **{name: version(name) for name in libraries}},
    }


def others() -> dict[str, Any]:
    """Return the fields of the other codes, computed."""
    import radiation_fields

    made = made_by("bempp-cl", "ngsolve", "numpy", "scipy", "numba")
    return {**made, "sources_sha256": study.fields_sources(), "cases": radiation_fields.computed()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path, default=study.RECORD, help="JSON file to write")
    parser.add_argument("--fields", action="store_true", help="compute the other codes' side too")
    arguments = parser.parse_args()
    before = study.sources()
    fields = others() if arguments.fields else study.record()["fields"]
    rows = study.ours(fields["cases"])
    if study.sources() != before or study.fields_sources() != fields["sources_sha256"]:
        sys.exit("the sources changed since the fields or the rows were computed: nothing is written")
    record = {"schema": "tdacoustic-radiation-study/1", **made_by("numpy", "scipy", "numba")}
    record.update(sources_sha256=before, **rows, fields=fields)
    arguments.record.write_text(_text(record), encoding="utf-8")


def _text(record: dict[str, Any]) -> str:
    """Return the record as JSON, one line a row and a field."""
    lines = json.dumps(record, indent=1).splitlines()
    text = "\n".join(lines)
    for row in ("pressures_pa", "off_db"):
        text = _joined(text, row)
    return text + "\n"


def _joined(text: str, key: str) -> str:
    """Return JSON with the values of a key on one line each."""
    parts = text.split(f'"{key}": ')
    for index, part in enumerate(parts[1:], start=1):
        value, end = json.JSONDecoder().raw_decode(part)
        parts[index] = json.dumps(value) + part[end:]
    return f'"{key}": '.join(parts)


if __name__ == "__main__":
    main()
