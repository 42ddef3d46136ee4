"""The comparisons with outside truths as a page to be read: CONFORMANCE.md, and the table of one run."""

from __future__ import annotations

import math
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
    "evidence": "Studies over many cases",
}


def page(kept: Kept) -> str:
    """Return CONFORMANCE.md."""
    versions = ", ".join(f"{name} {version}" for name, version in kept.made_with.items())
    head = [
        "# Conformance",
        "",
        "What the software computes beside what others say it should be: standards, papers, closed forms, other",
        "programs, signals with a known content. Numbers that are held against the software's own output are not here.",
        "",
        "**How it was made.** Every row was recorded by a test that fails where the number got is further from the",
        "expected one than the tolerance. The rows lie in `tests/conformance.json`; this page is made of them by",
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
        f"**Made with** {versions}." if versions else "",
        *(
            []
            if kept.whole
            else ["", "**Not complete yet**: collected from parts of the suite, never from a whole run."]
        ),
        "",
        *_summary(kept.all()),
    ]
    return "\n".join(head + _tables(kept.all())) + "\n"


def table_of_a_run(rows: Sequence[Row]) -> str:
    """Return the page of one run, whichever tests it had."""
    broken = sum(not row.holds for row in rows)
    head = [
        "# Comparisons with outside truths, of one run",
        "",
        f"{len(rows)} comparisons by {len({row.test for row in rows})} tests, {broken} of them do not hold.",
        OF_IT,
        "",
        *_summary(rows),
    ]
    return "\n".join(head + _tables([row.kept() for row in rows])) + "\n"


def area_of(test: str) -> str:
    """Return the title of the area of a test's node id; the folder's name where it has no title."""
    parts = Path(test.partition("::")[0]).parts
    folder = parts[1] if len(parts) > 2 else Path(parts[-1]).stem.removeprefix("test_")
    return AREAS.get(folder, folder.replace("_", " ").capitalize())


def _summary(rows: Sequence[Row]) -> list[str]:
    kinds = Counter(row.kind for row in rows)
    broken = sum(not row.holds for row in rows)
    lines = [
        f"{len(rows)} rows of {len({row.test for row in rows})} tests; {len(rows) - broken} hold, {broken} do not.",
        "",
        "| kind | the expected value was | rows |",
        "|---|---|---|",
    ]
    lines += [f"| {kind} | {told} | {kinds[kind]} |" for kind, told in KINDS.items() if kinds[kind]]
    lines += ["", "| area | rows |", "|---|---|"]
    lines += [f"| [{area}](#{_anchor(area)}) | {len(held)} |" for area, held in _by_area(rows)]
    return [*lines, ""]


def _anchor(title: str) -> str:
    """Return the address that hosts of Markdown give a heading."""
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c == "-")


def _by_area(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    held: dict[str, list[Row]] = {area: [] for area in AREAS.values()}
    for row in rows:
        held.setdefault(area_of(row.test), []).append(row)
    return [(area, of_it) for area, of_it in held.items() if of_it]


def _tables(rows: Sequence[Row]) -> list[str]:
    lines = []
    for area, held in _by_area(rows):
        lines += [
            f"## {area}",
            "",
            "| what | expected | got | tolerance | unit | of it | verdict | kind | source | test |",
            "|---|---|---|---|---|---|---|---|---|---|",
            *("| " + " | ".join(map(_cell, _cells(row))) + " |" for row in held),
            "",
        ]
    return lines[:-1]


def _cells(row: Row) -> tuple[str, ...]:
    file, _, name = row.test.partition("::")
    return (
        row.what,
        number(row.expected, row.tolerance),
        number(row.got, row.tolerance),
        f"{row.tolerance:.3g}",
        row.unit or "1",
        f"{row.of_tolerance:.2f}",
        "holds" if row.holds else "**does not hold**",
        row.kind,
        row.reference,
        f"[{name.partition('[')[0]}]({file})",
    )


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
