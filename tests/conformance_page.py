"""The comparisons with outside truths as a page to be read: CONFORMANCE.md, and the table of one run."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from conformance_rows import KINDS, Kept, Row

COMMAND = "python -m pytest --conformance-update"
OF_IT = "`of it` is the distance from the expected value as a part of the tolerance; 1 would just hold."
# Areas in the order of the data flow: folder of the tests, title.
AREAS = {
    "units": "Units and references of levels",
    "sensors": "Sensors and calibrators",
    "formats": "Files of other programs",
    "quality": "Quality of a recording",
    "clocks": "Clocks of several recorders",
    "spectra": "Spectra, third octaves, weightings, background",
    "lines": "Lines of a spectrum",
    "tones": "Tones: audibility, tone-to-noise and prominence ratio",
    "railway": "Quantities of railway noise",
    "speed": "Speed and angle of the shafts",
    "orders": "Orders and order tracking",
    "contributions": "Coherence and contributions",
    "attribution": "Sources of the noise lines",
    "measured": "Steps of the measured side",
    "synthesis": "Synthetic logs",
    "fleet": "Kinematics of the drive",
    "gears": "Gears: geometry, stiffness, dynamics, meshing noise",
    "motor": "Motor: frame and radiation",
    "housing": "Housing: mass, statics, modes",
    "cavity": "Air inside the housing",
    "radiation": "Radiation, propagation, air",
    "drive": "The modelled drive as a whole",
    "fitting": "Calibration: fit, intervals",
    "studies": "Sensitivity and sweeps",
    "gathering": "Many results together",
    "workflows": "Whole analyses",
}
# Areas of the studies in tests/evidence that are not named after their folder.
STUDIED = {"calibration": "fitting", "tacholess": "speed"}


def page(kept: Kept) -> str:
    """Return CONFORMANCE.md."""
    versions = ", ".join(f"{name} {version}" for name, version in kept.made_with.items())
    rows = kept.all()
    head = [
        "# Conformance",
        "",
        "What the software computes beside what others say it should be: standards, papers, closed forms, other",
        "programs, signals with a known content. Numbers that are held against the software's own output are not here.",
        "",
        *(
            []
            if kept.whole
            else ["**Not complete yet**: collected from parts of the suite, never from a whole run.", ""]
        ),
        *_summary(rows),
        "## How it was made",
        "",
        "Every row was recorded by a test. Where the number got is further from the expected one than the tolerance,",
        "the test fails, unless it states the deviation and its reason; such a test fails as soon as the row holds.",
        "A tolerance is wide beyond 0.5 dB, 2 %, a tenth of the expected value, or 0.01 of a plain number expected to",
        "be 0; a test without a reason for a wide one fails, and the reason stands beside the source. The rows lie in",
        "`tests/conformance.json`; this page is made of them by",
        "",
        "```",
        COMMAND,
        "```",
        "",
        "Each run of the whole test suite compares its rows with the committed ones and fails where a row is missing,",
        "is new, or has another expected value, tolerance, unit or source, or where the number got moved by more than",
        "a quarter of its tolerance. Tests that are skipped (a program or a recording that is not at hand) keep their",
        "rows. Digits that the tolerance makes meaningless are left out.",
        OF_IT,
        "",
        *([f"Made with {versions}.", ""] if versions else []),
    ]
    return "\n".join(head + _tables(rows)) + "\n"


def table_of_a_run(rows: Sequence[Row]) -> str:
    """Return the page of one run, whichever tests it had."""
    head = ["# Comparisons with outside truths, of one run", "", *_summary(rows), OF_IT, ""]
    return "\n".join(head + _tables([row.kept() for row in rows])) + "\n"


def area_of(test: str) -> str:
    """Return the title of the area of a test's node id; the folder's name where it has no title."""
    parts = Path(test.partition("::")[0]).parts
    stem = Path(parts[-1]).stem.removeprefix("test_")
    folder = parts[1] if len(parts) > 2 else stem
    if folder == "evidence":  # long studies, each of an area
        folder = STUDIED.get(stem.removesuffix("_evidence"), stem.removesuffix("_evidence"))
    return AREAS.get(folder, folder.replace("_", " ").capitalize())


def _summary(rows: Sequence[Row]) -> list[str]:
    """The counts, what does not hold, and what the kinds mean: what a reader wants before any table."""
    kinds = Counter(row.kind for row in rows)
    broken = [row for row in rows if not row.holds]
    present = [kind for kind in KINDS if kinds[kind]]
    lines = [
        f"**{_counted(len(rows), 'comparison')} by {_counted(len({row.test for row in rows}), 'test')}:"
        f" {len(rows) - len(broken)} hold, {len(broken)} do not.**",
        "",
        *_deviations([row.kept() for row in broken]),
        "## By area and kind of truth",
        "",
        f"| area | rows | do not hold | {' | '.join(present)} |",
        "|---|" + "---:|" * (len(present) + 2),
    ]
    for area, held in _by_area(rows):
        lines.append(_count_line(f"[{area}](#{_anchor(area)})", held, present))
    lines += [_count_line("**all**", rows, present), "", "| kind | the expected value was |", "|---|---|"]
    return [*lines, *(f"| {kind} | {KINDS[kind]} |" for kind in present), ""]


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")


def _count_line(name: str, rows: Sequence[Row], kinds: Sequence[str]) -> str:
    counts = Counter(row.kind for row in rows)
    numbers = (len(rows), sum(not row.holds for row in rows), *(counts[kind] for kind in kinds))
    return f"| {name} | " + " | ".join(str(n or "") for n in numbers) + " |"


def _deviations(rows: Sequence[Row]) -> list[str]:
    title = ["## What does not hold", ""]
    if not rows:
        return [*title, "Nothing.", ""]
    return [
        *title,
        "| what | expected | got | tolerance | unit | why | source | test |",
        "|---|---|---|---|---|---|---|---|",
        *("| " + " | ".join(map(_cell, _deviation_cells(row))) + " |" for row in _sorted(rows)),
        "",
    ]


def _deviation_cells(row: Row) -> tuple[str, ...]:
    return (*_numbers(row), row.note or "a failed test: not expected to deviate", _source(row), _test(row))


def _anchor(title: str) -> str:
    """Return the address that hosts of Markdown give a heading."""
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c == "-")


def _by_area(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    held: dict[str, list[Row]] = {area: [] for area in AREAS.values()}
    for row in rows:
        held.setdefault(area_of(row.test), []).append(row)
    return [(area, of_it) for area, of_it in held.items() if of_it]


def _sorted(rows: Iterable[Row]) -> list[Row]:
    """Like with like: by kind of truth, by source, by name with its numbers in the order of counting."""
    kinds = list(KINDS)
    return sorted(rows, key=lambda row: (kinds.index(row.kind), _natural(row.reference), _natural(row.what), row.test))


def _natural(text: str) -> list[tuple[int, float, str]]:
    pieces = re.split(r"(\d+(?:\.\d+)?)", text)
    return [(0, float(piece), "") if n % 2 else (1, 0.0, piece) for n, piece in enumerate(pieces)]


def _tables(rows: Sequence[Row]) -> list[str]:
    lines = []
    for area, held in _by_area(rows):
        lines += [
            f"## {area}",
            "",
            "| what | expected | got | tolerance | unit | of it | verdict | source | test |",
            "|---|---|---|---|---|---|---|---|---|",
            *("| " + " | ".join(map(_cell, _cells(row))) + " |" for row in _sorted(held)),
            "",
        ]
    return lines[:-1]


def _cells(row: Row) -> tuple[str, ...]:
    verdict = "holds" if row.holds else "**does not hold**"
    noted = f" (wide: {row.note})" if row.note and row.holds else ""
    return (*_numbers(row), f"{row.of_tolerance:.2f}", verdict, _source(row) + noted, _test(row))


def _numbers(row: Row) -> tuple[str, ...]:
    expected, got = (number(value, row.tolerance) for value in (row.expected, row.got))
    return row.what, expected, got, f"{row.tolerance:.3g}", row.unit


def _source(row: Row) -> str:
    return f"{row.kind}: {row.reference}"


def _test(row: Row) -> str:
    file, _, name = row.test.partition("::")
    return f"[{name.partition('[')[0]}]({file})"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


def number(value: float, tolerance: float) -> str:
    """Return a number with the digits that its tolerance leaves: one beyond the tolerance's first."""
    if not math.isfinite(value):
        return str(value)
    if value == 0.0:
        return "0"
    step = tolerance or 1e-9 * abs(value)
    if not 1e-4 <= abs(value) < 1e7:
        digits = min(max(math.ceil(math.log10(abs(value) / step)) + 1, 1), 14) if abs(value) > step else 1
        return f"{value:.{digits + 1}g}"
    decimals = max(1 - math.floor(math.log10(step)), 0)
    shown = f"{value:.{min(decimals, 14)}f}"
    shown = shown.rstrip("0").rstrip(".") if "." in shown else shown
    return "0" if shown in ("-0", "0") else shown
