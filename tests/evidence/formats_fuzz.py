"""Fuzz every format's reader guided by its coverage, and record how often, for how long, and what was found.

``python tests/evidence/formats_fuzz.py --seconds 120 [--only tdms]``; needs atheris (Linux). Each format starts from
the small whole logs that the tests make. What ends a run: an exception that is no `TdacousticError`, an assertion of
`tests/formats/fuzz_worker.py` (one clear message, a rate that is a number, no more samples than asked for, texts that
steer nothing), more than 10 s or 2 GB for one input, a signal.
"""

import argparse
import hashlib
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from shutil import copy, copytree
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RECORD = HERE / "formats_fuzz_record.json"
SCHEMA = "tdacoustic-formats-fuzz/1"
MOST_S, MOST_MB, MOST_BYTES, MOST_RESTARTS = 10, 2048, 1 << 17, 25

LIBRARIES = ("atheris", "numpy", "h5py", "soundfile", "pandas", "scipy", "npTDMS", "asammdf", "defusedxml", "pyuff")

FIXED: tuple[tuple[str, str, str], ...] = (
    ("delimited", "500 000 columns took minutes", "layout: more than 10 000 columns are refused"),
    ("delimited", "a quote never closed in one column: time over the whole file", "rows: the line is named"),
    ("audio", "bytes a sample that contradict channels and bits were read as the library likes", "reader: refused"),
    (
        "hdf5",
        "10^12 samples of fill values, chunks of gigabytes, programs from a plugin folder",
        "tree: left out, said",
    ),
    ("hdf5", "twelve thousand datasets took minutes to pair with time vectors", "reader: one pass"),
    ("audio", "an MP3 in WAV of other channels than its header says: an index beyond the array", "reader: refused"),
    ("audio", "cut in ds64, or 2^63 bytes in it: an error of Python's as the reason", "riff: refused in words"),
    ("hdf5", "names of what was left out broke the line of the message", "bounds: one clear line for all formats"),
    ("hdf5", "an attribute whose name is not UTF-8: an error of Python's as the reason", "attributes: passed over"),
    ("mdf4", "long names made messages of thousands of letters", "bounds: the middle is left out"),
    ("delimited", "a CR between quoted cells: an error of the csv module", "layout: the line is named"),
)
"""What damage found while these tests were written, and what became of it: (format, defect, mended in)."""


def sources_of(name: str) -> str:
    """Stamp of a format's sources and of what all readers share."""
    formats = ROOT / "tdacoustic" / "formats"
    paths = [
        *sorted((formats / name).glob("*.py")),
        *(path for path in sorted(formats.glob("*.py")) if path.stem not in ("__init__", "table", "closed")),
    ]
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what is recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


def seeds() -> dict[str, list[Callable[[Path], Any]]]:
    """Makers of small logs, by the format that reads them."""
    sys.path[:0] = [str(HERE.parent / "formats"), str(ROOT)]
    from log_makers import all_makers

    from tdacoustic.formats import scan

    found: dict[str, list[Callable[[Path], Any]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for number, maker in enumerate(all_makers()):
            place = Path(folder, str(number))
            place.mkdir()
            found.setdefault(scan(maker(place).path).format, []).append(maker)
    return found


def _last(pattern: str, text: str) -> int:
    held = re.findall(pattern, text)
    return int(held[-1]) if held else 0


def _ending(text: str) -> str | None:
    """Why a run ended before its time: the exception and its place, or what libFuzzer says; None where it did not."""
    if "Uncaught Python exception" in text:
        words = text.split("Uncaught Python exception: ===", 1)[1].strip().splitlines()
        lines = [line.strip() for line in words if line.strip().startswith("File")]
        where = re.sub(r'File ".*/([\w.]+)", line (\d+).*', r"\1:\2", lines[-1]) if lines else "?"
        return f"{words[0][:160]} at {where}"
    for sign in ("libFuzzer: timeout", "libFuzzer: out-of-memory", "libFuzzer: deadly signal", "Segmentation fault"):
        if sign in text:
            frames = [line.strip() for line in text.splitlines() if line.strip().startswith("File ")]
            return f"{sign}: {frames[0][-120:] if frames else 'no Python frame'}"
    return None


def fuzz(name: str, makers: list[Callable[[Path], Any]], seconds: float, keep: Path | None = None) -> dict[str, Any]:
    """Fuzz one format for a time; a run that ends early is recorded and begun anew with its corpus."""
    executions, endings, text = 0, {}, ""
    best = {"coverage": 0, "features": 0, "corpus": 0, "peak_rss_mb": 0, "slowest_unit_s": 0}
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        corpus, scratch, made = Path(folder, "corpus"), Path(folder, "scratch"), Path(folder, "made")
        corpus.mkdir()
        scratch.mkdir()
        suffix = ""
        for number, maker in enumerate(makers):
            place = made / str(number)
            place.mkdir(parents=True)
            path = maker(place).path
            suffix = suffix or path.suffix
            (corpus / f"{number}").write_bytes(path.read_bytes())
            for beside in place.iterdir():  # the further files of a log stay whole
                if beside != path and not (scratch / beside.name).exists():
                    (copytree if beside.is_dir() else copy)(beside, scratch / beside.name)
        for _ in range(MOST_RESTARTS):
            left = int(seconds - (time.monotonic() - began))
            if left < 2:
                break
            run = subprocess.run(
                [sys.executable, str(HERE / "formats_fuzz_target.py"), str(scratch), suffix, f"-max_total_time={left}",
                 f"-timeout={MOST_S}", f"-rss_limit_mb={MOST_MB}", f"-max_len={MOST_BYTES}", "-print_final_stats=1",
                 "-len_control=0", f"-artifact_prefix={scratch}/", str(corpus)],
                capture_output=True, env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )  # fmt: skip
            text = run.stderr.decode(errors="replace") + run.stdout.decode(errors="replace")
            executions += max(_last(r"stat::number_of_executed_units: (\d+)", text), _last(r"#(\d+)\s", text))
            for key, pattern in {
                "coverage": r"cov: (\d+)", "features": r"ft: (\d+)", "corpus": r"corp: (\d+)",
                "peak_rss_mb": r"peak_rss_mb:\s*(\d+)", "slowest_unit_s": r"slowest_unit_time_sec:\s*(\d+)",
            }.items():  # fmt: skip
                best[key] = max(best[key], _last(pattern, text))
            ending = _ending(text)
            if ending is None:
                break
            endings[ending] = endings.get(ending, 0) + 1
            if keep is not None:
                for found in scratch.glob("*-*"):
                    found.replace(keep / f"{name}-{found.name}{suffix}")
    if not executions:
        raise RuntimeError(f"{name}: nothing was executed:\n{text[-3000:]}")
    return {
        "seeds": len(makers),
        "seconds": round(time.monotonic() - began),
        "executions": executions,
        **best,
        "endings": endings,
        "sources_sha256": sources_of(name),
    }


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries behind the readers."""
    held = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            held[name] = version(name)
        except PackageNotFoundError:
            held[name] = "absent"
    return held


def table(found: dict[str, Any]) -> str:
    """Return the record as a table for README.md."""
    lines = [
        "| format | seeds | executions | seconds | coverage | corpus | peak MB | ended early |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, row in found["formats"].items():
        ended = "; ".join(f"{count} x {words}" for words, count in row["endings"].items()) or "never"
        lines.append(
            f"| {name} | {row['seeds']} | {row['executions']} | {row['seconds']} | {row['coverage']} | "
            f"{row['corpus']} | {row['peak_rss_mb']} | {ended} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Fuzz and write the record; formats that are not asked for keep their rows."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--only", nargs="*", default=None)
    parser.add_argument("--keep", type=Path, default=None, help="folder for the inputs that ended a run")
    asked = parser.parse_args()
    rows = record()["formats"] if RECORD.exists() else {}
    for name, makers in seeds().items():
        if asked.only is not None and name not in asked.only:
            continue
        rows[name] = fuzz(name, makers, asked.seconds, asked.keep)
        print(name, rows[name], flush=True)
    found = {
        "schema": SCHEMA,
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", "../../tdacoustic/formats")),
        "versions": versions(),
        "bounds": {"seconds": MOST_S, "megabytes": MOST_MB, "input_bytes": MOST_BYTES},
        "fixed": [dict(zip(("format", "defect", "mended"), row, strict=True)) for row in FIXED],
        "formats": dict(sorted(rows.items())),
    }
    RECORD.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(table(found))


if __name__ == "__main__":
    main()
