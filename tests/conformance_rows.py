"""Comparisons with truths that are not the program's own: what a row is, how rows are kept, when two are the same."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

# What a source begins with, before its colon, and what that says of the expected value.
KINDS = {
    "standard": "printed in a standard or a technical report of a standards body",
    "paper": "printed in the paper that the program follows, Appl. Sci. 2025, 15(19), 10597",
    "literature": "printed in a book or another paper, or computed from a formula or a method printed there",
    "certified": "certified by a metrology institute",
    "analytic": "a closed form of the same problem, evaluated in the test",
    "known input": "put into a signal or a case that the test makes with code of its own; it must come back",
    "program": "computed by another program in the test",
    "independent": "computed in the test by another method, with code that shares nothing with the program",
    "law": "a law of physics that any right answer keeps (energy, reciprocity)",
    "recording": "stated by a published recording or measured beside it",
}
COLUMNS = ("what", "expected", "got", "tolerance", "unit", "source", "note")
# Beyond these a tolerance says why: decibels, per cent, a share of what is expected, and of one where nothing is.
WIDE_DB = 0.5
WIDE_PERCENT = 2.0
WIDE_PART = 0.1
WIDE_OF_NOTHING = 0.01


@dataclass(frozen=True)
class Row:
    """One comparison; ``source`` is ``kind: where to look it up``.

    ``note`` says why the tolerance is wide, or, of a row that does not hold, why it need not.
    """

    test: str
    what: str
    expected: float
    got: float
    tolerance: float
    unit: str
    source: str
    note: str = ""

    def __post_init__(self) -> None:
        kind, _, reference = self.source.partition(": ")
        if kind not in KINDS or not reference.strip():
            raise ValueError(f"{self.what}: source {self.source!r} is no 'kind: reference', kinds: {', '.join(KINDS)}")
        if not (self.tolerance >= 0.0 and math.isfinite(self.tolerance) and math.isfinite(self.expected)):
            raise ValueError(f"{self.what}: expected {self.expected} ± {self.tolerance} is no statement")

    def values(self) -> list[str | float]:
        """Return what stands in ``COLUMNS``, without an empty note: ``Row(test, *values)`` is the row again."""
        values = [getattr(self, name) for name in COLUMNS]
        return values if self.note else values[:-1]

    @property
    def kind(self) -> str:
        return self.source.partition(": ")[0]

    @property
    def reference(self) -> str:
        return self.source.partition(": ")[2].strip()

    @property
    def holds(self) -> bool:
        return math.isfinite(self.got) and abs(self.got - self.expected) <= self.tolerance

    @property
    def of_tolerance(self) -> float:
        """Distance from the expected value over the tolerance; 0 for an exact hit."""
        away = abs(self.got - self.expected)
        return 0.0 if away == 0.0 else away / self.tolerance if self.tolerance else math.inf

    @property
    def wide(self) -> bool:
        """Whether a wrong number could pass for a right one, so that the tolerance needs its reason."""
        if self.unit.startswith("dB"):
            return self.tolerance > WIDE_DB
        if self.unit == "%":
            return self.tolerance > WIDE_PERCENT
        if self.expected:
            return self.tolerance > WIDE_PART * abs(self.expected)
        return (self.unit == "1" or self.unit.startswith("of ")) and self.tolerance > WIDE_OF_NOTHING

    def kept(self) -> Row:
        """Return the row as it is committed: no digit that the tolerance makes meaningless."""
        tolerance = float(f"{self.tolerance:.4g}")
        step = tolerance or 1e-9 * max(abs(self.expected), 1e-30)
        return Row(
            self.test,
            self.what,
            to_step(self.expected, 1e-3 * step),
            to_step(self.got, 0.02 * step),
            tolerance,
            self.unit,
            self.source,
            self.note,
        )


def to_step(value: float, step: float) -> float:
    """Round to the power of ten below ``step``, without digits that a double does not have."""
    if not math.isfinite(value) or step <= 0.0:
        return value
    decimals = -math.floor(math.log10(step))
    return float(f"{round(value, decimals) + 0.0:.15g}")


@dataclass(frozen=True)
class Kept:
    """The committed rows by test, the versions of what made them, and whether a whole run did: all tests' rows."""

    rows: Mapping[str, Sequence[Row]]
    made_with: Mapping[str, str]
    whole: bool = False

    def all(self) -> list[Row]:
        return [row for rows in self.rows.values() for row in rows]


def load(path: Path) -> Kept:
    if not path.is_file():
        return Kept({}, {})
    held = json.loads(path.read_text(encoding="utf-8"))
    rows = {test: [Row(test, *values) for values in entries] for test, entries in held["rows"].items()}
    return Kept(rows, held["made_with"], held["whole"])


def save(kept: Kept, path: Path) -> None:
    """Write one row a line, so that a change of a number is a change of one line."""
    tests = []
    for test in sorted(kept.rows):
        lines = [json.dumps(row.values(), ensure_ascii=False) for row in kept.rows[test]]
        tests.append(json.dumps(test, ensure_ascii=False) + ": [\n " + ",\n ".join(lines) + "\n]")
    made_with = json.dumps(dict(kept.made_with), ensure_ascii=False)
    columns = json.dumps(COLUMNS)
    text = (
        f'{{"made_with": {made_with},\n"whole": {json.dumps(kept.whole)},\n"columns": {columns},\n"rows": {{\n'
        + ",\n".join(tests)
        + "\n}}\n"
    )
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def differences(kept: Sequence[Row], recorded: Sequence[Row]) -> list[str]:
    """Return what is no longer so of one test's rows, a sentence each; nothing if the committed ones still hold.

    What is expected, the tolerance, the unit and the source must be the committed ones (computed ones to 1e-6). What
    was got may differ by a quarter of the tolerance: another processor and another version of a library round
    otherwise, and a number that moves further is another number.
    """
    old, new = numbered(kept), numbered(recorded)
    said = [f"{_named(old[key])}: no longer recorded" for key in old if key not in new]
    said += [f"{_named(new[key])}: not in the committed rows" for key in new if key not in old]
    for key, row in new.items():
        if key in old:
            said += [f"{_named(row)}: {change}" for change in _changes(old[key], row)]
    return said


def numbered(rows: Iterable[Row]) -> dict[tuple[str, int], Row]:
    """Return rows by name and by which of that name they are."""
    seen: dict[str, int] = {}
    found = {}
    for row in rows:
        seen[row.what] = seen.get(row.what, 0) + 1
        found[row.what, seen[row.what]] = row
    return found


def _named(row: Row) -> str:
    return f"{row.test}: {row.what}"


def _changes(old: Row, new: Row) -> list[str]:
    said = []
    if old.source != new.source:
        said.append(f"source is {new.source!r}, was {old.source!r}")
    if old.note != new.note:
        said.append(f"note is {new.note!r}, was {old.note!r}")
    if old.unit != new.unit:
        said.append(f"unit is {new.unit!r}, was {old.unit!r}")
    if abs(old.tolerance - new.tolerance) > 1e-3 * max(old.tolerance, new.tolerance):
        said.append(f"tolerance is {new.tolerance:.4g}, was {old.tolerance:.4g}")
    if abs(old.expected - new.expected) > 1e-6 * abs(new.expected) + 2e-3 * new.tolerance:
        said.append(f"expected is {new.expected:.9g}, was {old.expected:.9g}")
    if old.holds != new.holds:
        said.append(f"{'holds' if new.holds else 'does not hold'} now: got {new.got:.9g}, was {old.got:.9g}")
    elif abs(old.got - new.got) > max(0.25 * new.tolerance, 1e-9 * abs(new.got)):
        said.append(f"got {new.got:.9g}, was {old.got:.9g}")
    return said
