"""The record of the study of scale as tables: what was measured, and what 100 000 runs would cost."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
MANY_RUNS = 100_000
MB = 1e6

PLACES = {
    "measured": (ROOT / "tests/evidence/README.md", ROOT / "docs/scale.md"),
    "extrapolated": (ROOT / "docs/scale.md",),
}


def lines_of(rows: Iterator[tuple[str, str]], head: tuple[str, str]) -> str:
    """Return rows as a table in Markdown."""
    return "\n".join(f"| {left} | {right} |" for left, right in (head, ("---", "---"), *rows))


def measured(record: dict[str, Any]) -> str:
    """Return what was measured, as a table."""
    return lines_of(_measured_rows(record), ("what", "measured"))


def _measured_rows(record: dict[str, Any]) -> Iterator[tuple[str, str]]:
    found, where = record["results"], record["machine"]
    yield "machine", f"{where['processor']}, {where['cores']} cores, {where['memory_gib']:g} GiB"
    yield "campaigns, runs, logs", f"{found['campaigns']}, {found['runs']}, {found['log_bytes'] / MB:.0f} MB"
    for n, part in found["workers"].items():
        words = f"{n} worker{'s' if n != '1' else ''}"
        speed = f"{part['campaigns_a_minute']:g} campaigns or {part['runs_a_minute']:g} runs a minute"
        yield f"all of them, {words}", f"{part['first_s']:.1f} s: {speed}"
        yield f"a second call, {words}", f"{part['second_s']:.2f} s, {100 * part['second_of_first']:.2f} % of the first"
        if "again_s" in part:
            yield f"assembled again from the store, {words}", f"{part['again_s']:.1f} s"
        peak = part["peak_mib"]
        worker, parent = max(peak.get("worker", [0])), max(peak.get("parent", [0]))
        yield f"most memory, {words}", f"a worker {worker} MiB, the parent {parent} MiB"
    most = list(found["workers"].values())[-1]
    twice = most["steps_computed"] - most["steps_kept"]
    yield "steps computed, of them by two workers at one time", f"{most['steps_computed']}, {twice}"
    told = found["killed"]
    victims = f"{told['parent']} of the parent, {told['worker']} of a worker"
    yield f"{told['parent'] + told['worker']} SIGKILLs", victims
    differ = f"{len(told['files_that_differ'])} of {told['files']} files, {told['keys_that_differ']} keys of the store"
    yield "after them, different from an undisturbed call", differ
    byte = found["changed"]
    yield (
        "one byte of one log changed",
        f"{byte['steps_computed']} steps computed, {byte['steps_that_rest_on_the_log']} rest on that log; "
        f"{byte['campaigns_unchanged']} campaigns unchanged",
    )
    yield "results on disk", f"{found['bytes_of_results'] / MB:.0f} MB, {found['bytes_of_reports'] / MB:.0f} MB reports"
    yield "store on disk", f"{found['bytes_of_store'] / MB:.0f} MB in {found['files_of_store']} files"
    step, most_bytes = next(iter(found["bytes_of_store_by_step"].items()))
    yield "its largest part", f"step '{step}', {100 * most_bytes / found['bytes_of_store']:.0f} %"
    for part in found["store"]:
        yield (
            f"a store of {part['files']} results",
            f"is it there: {part['is_there_us']:g} us; its record: {part['record_us']:g} us; "
            f"keep one: {part['save_us']:g} us; list all: {part['list_all_s']:g} s",
        )
    sweep = found["sweep"]
    yield f"looking through one folder of {sweep['names']} results", f"{sweep['sweep_us'] / 1000:.1f} ms"
    yield "finding one result up to date", f"{found['check_us'] / 1000:.1f} ms"
    notes = found["notes"]
    yield (
        f"{notes['notes']} remembered hashes of logs",
        f"keep: {notes['remember_us']:g} us; ask: {notes['look_up_us']:g} us",
    )


def extrapolated(record: dict[str, Any]) -> str:
    """Return what 100 000 runs would cost, each row in proportion to what was measured."""
    return lines_of(_extrapolated_rows(record), (f"{MANY_RUNS:,} runs".replace(",", " "), "in proportion"))


def _extrapolated_rows(record: dict[str, Any]) -> Iterator[tuple[str, str]]:
    found = record["results"]
    times = MANY_RUNS / found["runs"]
    n_campaigns = found["campaigns"] * times
    n, part = list(found["workers"].items())[-1]
    yield "campaigns", f"{n_campaigns:.0f}"
    yield f"first call, {n} workers", f"{times * part['first_s'] / 3600:.1f} h"
    yield "of it, assembling results and reports", f"{100 * part['again_s'] / part['first_s']:.0f} %"
    yield "second call, nothing changed", f"{n_campaigns * found['check_us'] / 60e6:.1f} min"
    yield "results on disk", f"{times * found['bytes_of_results'] / 1e9:.0f} GB"
    yield "of it reports", f"{100 * found['bytes_of_reports'] / found['bytes_of_results']:.0f} %"
    yield "store on disk", f"{times * found['bytes_of_store'] / 1e9:.0f} GB"
    n_files = times * part["steps_kept"]
    yield "results in the store", f"{n_files:.2g} files, {n_files / 256:.0f} in each of its 256 folders"
    sweep = found["sweep"]
    sweep_ms = sweep["sweep_us"] / 1000 * n_files / 256 / sweep["names"]
    yield "looking through one of these, once a process and folder", f"{sweep_ms:.1f} ms"
    parent = max(part["peak_mib_of_second"] or [0]) + n_campaigns * found["book"]["bytes_of_one"] / 2**20
    yield "memory of the parent", f"{parent:.0f} MiB, {found['book']['bytes_of_one']} bytes a campaign"


def put(record: dict[str, Any]) -> None:
    """Write the tables into the documents, between their marks."""
    for name, paths in PLACES.items():
        for path in paths:
            path.write_text(with_table(path.read_text(encoding="utf-8"), name, record), encoding="utf-8")


def with_table(text: str, name: str, record: dict[str, Any]) -> str:
    """Return a document with a table between its marks."""
    table = {"measured": measured, "extrapolated": extrapolated}[name](record)
    begin, end = f"<!-- scale_study: {name} -->\n", "<!-- end -->"
    assert text.count(begin) == 1, f"no place for {name}"
    return re.sub(re.escape(begin) + ".*?" + re.escape(end), lambda _: f"{begin}{table}\n{end}", text, flags=re.S)
