"""What a store and a table of very many campaigns cost, measured on folders of that size."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np


def each_us(what: Callable[[Any], object], over: Sequence[Any]) -> float:
    """Return the time of one call, us."""
    began = time.perf_counter()
    for item in over:
        what(item)
    return round(1e6 * (time.perf_counter() - began) / len(over), 1)


def key_of(number: int) -> str:
    return hashlib.sha256(str(number).encode()).hexdigest()


def measured_store(folder: Path, n_files: int, n_asked: int = 500) -> dict[str, Any]:
    """Fill a store with small results and measure what is asked of it; the files are links to one content."""
    from tdacoustic.recording import Raster
    from tdacoustic.steps import Record, Store

    store = Store(folder)
    record = Record("a-step", 1, "A step", "run 1", "{}", (("log", "sha256:0"),), (("numpy", np.__version__),), 0.1)
    result = Raster(8192.0, 0.0, 40960)
    store.save("0" * 64, result, record)
    content = store._path("0" * 64).read_bytes()
    keys = [key_of(number) for number in range(n_files)]
    began = time.perf_counter()
    for key in keys:
        path = store._path(key)
        if not path.parent.is_dir():
            path.parent.mkdir()
        path.write_bytes(content)
    filled_s = time.perf_counter() - began
    asked = keys[:: max(1, n_files // n_asked)]
    absent = [key_of(-number - 1) for number in range(n_asked)]
    return {
        "files": n_files,
        "files_in_one_folder": n_files // 256,
        "bytes_of_one": len(content),
        "fill_us": round(1e6 * filled_s / n_files, 1),
        "is_there_us": each_us(store.__contains__, asked),
        "is_not_there_us": each_us(store.__contains__, absent),
        "record_us": each_us(store.record, asked),
        "load_us": each_us(store.load, asked),
        "save_us": each_us(lambda key: store.save(key, result, record), absent),
        "list_all_s": round(_listed_s(store.folder / "results"), 3),
    }


def _listed_s(folder: Path) -> float:
    began = time.perf_counter()
    for _, _, names in os.walk(folder):
        len(names)
    return time.perf_counter() - began


def measured_sweep(folder: Path, n_names: int, n_asked: int = 50) -> dict[str, Any]:
    """Measure the look for left-overs in one folder of so many results, which each process does once a folder."""
    from tdacoustic.steps.store import _sweep

    folder.mkdir()
    for number in range(n_names):
        (folder / f"{key_of(number)}.npz").touch()
    return {"names": n_names, "sweep_us": each_us(lambda _: _sweep.__wrapped__(folder), range(n_asked))}


def measured_checks(folder: Path) -> float:
    """Return the time in which one result is found to be up to date, us."""
    from tdacoustic.steps import Store
    from tdacoustic.workflows.up_to_date import software, standing

    software()  # once a process
    store = Store(folder / "store")
    held = sorted(path.parent for path in (folder / "out").glob("*/manifest.json"))
    stands = []
    took_us = each_us(
        lambda out: stands.append(standing(out, folder / "campaigns" / out.name / "campaign.toml", store)), held
    )
    assert all(stands)
    return took_us


def measured_notes(folder: Path, n_notes: int, n_asked: int = 500) -> dict[str, Any]:
    """Measure the remembered hashes of logs: one small file a log, all in one folder."""
    from tdacoustic.steps import Store

    store = Store(folder)
    logs = [folder / f"log-{number}.h5" for number in range(n_notes)]
    note = '{"size": 1, "mtime_ns": 1, "ctime_ns": 1, "sha256": "' + "0" * 64 + '"}'
    kept_us = each_us(lambda log: store.remember_hash(log, note), logs)
    asked = logs[:: max(1, n_notes // n_asked)]
    return {"notes": n_notes, "remember_us": kept_us, "look_up_us": each_us(store.remembered_hash, asked)}


def measured_book(n_campaigns: int) -> dict[str, Any]:
    """Measure what the parent holds of campaigns: their list, their rows and the work that waits."""
    import tracemalloc

    from tdacoustic.workflows.campaign_list import ListedCampaign
    from tdacoustic.workflows.run_many_table import CampaignRow
    from tdacoustic.workflows.run_many_work import CampaignJob

    tracemalloc.start()
    held = []
    for number in range(n_campaigns):
        given = f"campaigns/c{number:05d}"
        listed = ListedCampaign(given, Path(given, "campaign.toml"))
        out = Path("out", f"c{number:05d}")
        held.append((listed, CampaignRow(given, out), CampaignJob(number, given, listed.file, out, Path("store"))))
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return {"campaigns": len(held), "bytes_of_one": round(size / n_campaigns)}
