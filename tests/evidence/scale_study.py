"""Many campaigns on one machine: how fast, in how much memory, nothing twice, nothing lost.

``python tests/evidence/scale_study.py --campaigns 200 --kills 50 --record`` (about 70 minutes on two cores, 8 GB in
``--folder``); needs Linux. What it compares are bytes of files and keys in stores, read from the file system.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).resolve().parents[2])]

from scale_campaigns import change_a_sample, has_plain_logs, logs_of, make_campaigns  # noqa: E402
from scale_processes import kill_at_random, watched  # noqa: E402
from scale_store import measured_book, measured_checks, measured_notes, measured_store, measured_sweep  # noqa: E402
from scale_words import put  # noqa: E402

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RECORD = HERE / "scale_record.json"
SCHEMA = "tdacoustic-scale/1"
SEED = 20261123
WORKERS = (1, 2)

SOURCES = ("steps/*.py", "workflows/run_many_workers.py", "workflows/memory.py", "workflows/output.py")
"""What the record is bound to: what keeps results, workers and their memory. That nothing is done twice and nothing is
lost is seen again with each run of the tests, on a few campaigns and of whatever sources.
"""


def sources() -> str:
    """Stamp of what the record is of."""
    digest = hashlib.sha256()
    for path in sorted({path for pattern in SOURCES for path in (ROOT / "tdacoustic").glob(pattern)}):
        digest.update(path.name.encode() + path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what is recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


def place(scratch: Path, name: str) -> Path:
    """Return a new folder in which ``campaigns`` are the same as in all others."""
    folder = scratch / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / "campaigns").symlink_to(scratch / "campaigns", target_is_directory=True)
    return folder


def rows_of(folder: Path) -> list[dict[str, str]]:
    """Return the table of the last call."""
    with (folder / "out" / "campaigns.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def files_of(folder: Path) -> dict[str, str]:
    """Return every file of the results by the sha256 of its content, but for the table of the last call."""
    found = {}
    for path in sorted((folder / "out").rglob("*")):
        name = path.relative_to(folder / "out").as_posix()
        if path.is_file() and name != "campaigns.csv":
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def keys_of(folder: Path) -> set[str]:
    """Return the keys of the store."""
    return {path.stem for path in (folder / "store" / "results").rglob("*.npz")}


def bytes_in(folder: Path) -> int:
    """Return what the files of a folder hold."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def bytes_by_step(store: Path) -> dict[str, int]:
    """Return what the results of each step hold, the largest first."""
    from tdacoustic.steps import Store

    found: Counter[str] = Counter()
    for path in (store / "results").rglob("*.npz"):
        found[Store(store).record(path.stem).step] += path.stat().st_size
    return dict(found.most_common())


def count(rows: list[dict[str, str]], key: str) -> int:
    """Return the sum of a column."""
    return sum(int(row[key] or 0) for row in rows)


# ---------------------------------------------------------------- parts


def timed(scratch: Path, n_workers: int) -> dict[str, Any]:
    """Run all campaigns with a new store, and once more; with the most workers a third time, assembling all of it."""
    folder = place(scratch, f"workers-{n_workers}")
    first = watched(folder, "--jobs", n_workers)
    rows = rows_of(folder)
    assert first.code == 0 and {row["status"] for row in rows} == {"done"}, first.said
    kept, held = keys_of(folder), files_of(folder)
    second = watched(folder, "--jobs", n_workers)
    stood = rows_of(folder)
    assembled = assembled_again(folder, n_workers) if n_workers == max(WORKERS) else {}
    return {
        "first_s": round(first.wall_s, 2),
        "campaigns_a_minute": round(60.0 * len(rows) / first.wall_s, 1),
        "runs_a_minute": round(60.0 * count(rows, "n_runs") / first.wall_s, 1),
        "second_s": round(second.wall_s, 3),
        "second_of_first": round(second.wall_s / first.wall_s, 5),
        **assembled,
        "steps_computed": count(rows, "steps_computed"),
        "steps_kept": len(kept),
        "unchanged": sum(row["status"] == "unchanged" for row in stood),
        "same_files_after": held == files_of(folder),
        "peak_mib": {kind: mib for kind, mib in first.peak_mib.items() if kind != "other"},
        "peak_mib_of_second": second.peak_mib.get("parent", []),
    }


def assembled_again(folder: Path, n_workers: int) -> dict[str, Any]:
    """Assemble all results and reports once more."""
    took = watched(folder, "--jobs", n_workers, "--again")
    return {"again_s": round(took.wall_s, 2), "again_computed": count(rows_of(folder), "steps_computed")}


def killed(scratch: Path, n_kills: int, reference: Path, mean_s: float) -> dict[str, Any]:
    """Kill the program and its workers at random moments; then let it end, and compare."""
    folder = place(scratch, "killed")
    told = kill_at_random(folder, n_kills, mean_s, max(WORKERS), SEED)
    last = watched(folder, "--jobs", max(WORKERS))
    assert last.code == 0, last.said
    settled = watched(folder, "--jobs", max(WORKERS))
    found, expected = files_of(folder), files_of(reference)
    return {
        **told,
        "mean_s_between": round(mean_s, 2),
        "files": len(expected),
        "files_that_differ": sorted(name for name in {*found, *expected} if found.get(name) != expected.get(name)),
        "keys_that_differ": len(keys_of(folder) ^ keys_of(reference)),
        "unchanged_at_the_end": sum(row["status"] == "unchanged" for row in rows_of(folder)),
        "code_at_the_end": settled.code,
        "temporary_files_left_in_the_store": sum(1 for _ in (folder / "store").rglob("*.tmp")),
    }


def changed(scratch: Path, folder: Path) -> dict[str, Any]:
    """Change one byte of one log that no other campaign has, and see which steps are new."""
    from tdacoustic.steps import Store

    copy = scratch / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(scratch / "campaigns", copy / "campaigns")
    apart = place(copy, "changed")  # as deep below as the folder: results name their campaign by its path from there
    for name in ("out", "store"):
        shutil.copytree(folder / name, apart / name)
    log = logs_of(next(filter(has_plain_logs, sorted((copy / "campaigns").iterdir()))))[0]
    before = hashlib.sha256(log.read_bytes()).hexdigest()
    store, old = Store(apart / "store"), keys_of(apart)
    resting = resting_on(store, old, before)
    change_a_sample(log)
    done = watched(apart, "--jobs", max(WORKERS))
    new = keys_of(apart) - old
    of_old = Counter((store.record(key).step, store.record(key).label) for key in resting)
    of_new = Counter((store.record(key).step, store.record(key).label) for key in new)
    rows = rows_of(apart)
    return {
        "code": done.code,
        "campaigns_done": sum(row["status"] == "done" for row in rows),
        "campaigns_unchanged": sum(row["status"] == "unchanged" for row in rows),
        "steps_that_rest_on_the_log": len(resting),
        "steps_computed": len(new),
        "the_same_steps": of_old == of_new,
        "steps_of_the_campaign": count([row for row in rows if row["status"] == "done"], "steps_found") + len(new),
    }


def resting_on(store: Any, keys: set[str], sha256: str) -> set[str]:
    """Return the keys whose records name a log, and those that name one of these."""
    inputs = {key: {name for _, name in store.record(key).inputs} for key in keys}
    found: set[str] = set()
    while True:
        more = {key for key, held in inputs.items() if held & {f"sha256:{sha256}", *found}} - found
        if not more:
            return found
        found |= more


def studied(scratch: Path, n_campaigns: int, n_kills: int, n_files: int) -> dict[str, Any]:
    """Do all parts, each of which takes away what the next ones do not need; return the record's results."""
    campaigns = make_campaigns(scratch / "campaigns", n_campaigns)
    by_workers, files = {}, []
    for n in WORKERS:
        by_workers[str(n)] = timed(scratch, n)
        files.append(files_of(scratch / f"workers-{n}"))
        if n != max(WORKERS):
            shutil.rmtree(scratch / f"workers-{n}")
    most = scratch / f"workers-{max(WORKERS)}"
    result = {
        "campaigns": n_campaigns,
        "runs": count(rows_of(most), "n_runs"),
        "log_bytes": sum(log.stat().st_size for campaign in campaigns for log in logs_of(campaign)),
        "workers": by_workers,
        "one_and_more_workers_differ_in": len(dict(files[0].items() ^ files[-1].items())),
        **sizes(most),
        "check_us": measured_checks(most),
    }
    result["changed"] = changed(scratch, most)
    shutil.rmtree(scratch / "copy")
    result["killed"] = killed(
        scratch, n_kills, most, max(1.0, 1.5 * by_workers[str(max(WORKERS))]["first_s"] / n_kills)
    )
    result["store"] = [measured_store(scratch / f"store-{n}", n) for n in (n_files // 10, n_files)]
    result["sweep"] = measured_sweep(scratch / "one-folder", 4000)
    result["notes"] = measured_notes(scratch / "notes", n_files)
    result["book"] = measured_book(n_files)
    return result


def sizes(folder: Path) -> dict[str, Any]:
    """Return what results and store hold on disk."""
    return {
        "bytes_of_results": bytes_in(folder / "out"),
        "bytes_of_reports": sum(path.stat().st_size for path in (folder / "out").glob("*/report.html")),
        "bytes_of_store": bytes_in(folder / "store"),
        "bytes_of_store_by_step": bytes_by_step(folder / "store"),
        "files_of_store": sum(1 for path in (folder / "store").rglob("*") if path.is_file()),
    }


# ---------------------------------------------------------------- record


def machine() -> dict[str, Any]:
    """Return what the figures were measured on."""
    cpus = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    about = re.search(r"^model name\s*:\s*(.+)$", cpus, re.M)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": about[1] if about else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(memory / 2**30, 1),
        "load_before": round(os.getloadavg()[0], 2),
    }


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=200)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--files", type=int, default=100_000, help="of the store whose look-ups are measured")
    parser.add_argument("--folder", type=Path, help="where to work; else a temporary folder that is thrown away")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    held = {"machine": machine()}
    scratch = Path(options.folder or tempfile.mkdtemp(prefix="scale-")).resolve()
    scratch.mkdir(parents=True, exist_ok=True)
    try:
        results = studied(scratch, options.campaigns, options.kills, options.files)
    finally:
        if options.folder is None:
            shutil.rmtree(scratch, ignore_errors=True)
    git = ["git", "-C", str(ROOT)]
    commit = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
    dirty = subprocess.run([*git, "status", "--porcelain", "tdacoustic"], capture_output=True, text=True).stdout
    document = {
        "schema": SCHEMA,
        "sources_sha256": sources(),
        "commit": commit + (" + dirty" if dirty else ""),
        "versions": {"python": platform.python_version(), **{name: version(name) for name in ("numpy", "scipy")}},
        **held,
        "results": results,
    }
    print(json.dumps(document, indent=1))
    if options.record:
        RECORD.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
        put(document)


if __name__ == "__main__":
    main()
