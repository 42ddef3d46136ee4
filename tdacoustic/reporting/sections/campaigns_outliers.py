"""What stands out: levels and parameters far from those of the same fleet."""

from __future__ import annotations

from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.outliers import BAND_KM_H, LEVEL_FLOOR_DB, PARAMETER_FLOOR
from tdacoustic.gathering.robust import FALSE_ALARM, FEWEST, threshold
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.campaigns_rows import MOST_ROWS, name_cell, plural, when

__all__ = ["campaigns_outliers", "outlier_words"]

METHOD: Final = (
    f"Compared are values of one fleet and one origin: recorded levels at 4 m within bands of {BAND_KM_H:g} km/h and "
    "of one mode (one value a campaign), and determined parameters. A value stands out if it lies more than a "
    "threshold from the median, counted in scatters of 1.4826 times the median absolute deviation (at least "
    f"{LEVEL_FLOOR_DB:g} dB of levels, {100 * PARAMETER_FLOOR:g} % of a parameter, both assumed), and, of a parameter, "
    "if its own interval of 95 % does not hold that median. The threshold goes from "
    f"{threshold(FEWEST):g} scatters in a group of {FEWEST} over {threshold(10):g} of ten to {threshold(100):g} of a "
    f"hundred: so one group in {round(1 / FALSE_ALARM)} of normally scattered values has one by chance. In fewer than "
    f"{FEWEST} values nothing stands out."
)


def campaigns_outliers(gathering: Gathering) -> Section:
    """Return the section on values that stand out."""
    found = gathering.comparison
    counted = say("{plural} had fewer than {fewest} values", plural=plural(found.small_groups, "group"), fewest=FEWEST)
    if found.groups:
        counted = say(
            "{plural} in {plural_2} were compared; {counted}",
            plural=plural(found.values, "value"),
            plural_2=plural(found.groups, "group"),
            counted=counted,
        )
    if found.left_out_parameters:
        counted += say(
            "; {plural} on a bound or not determined did not count",
            plural=plural(found.left_out_parameters, "parameter"),
        )
    if found.without_fleet:
        counted += say(
            "; {plural} without a fleet {were} not compared",
            plural=plural(found.without_fleet, "campaign"),
            were=_were(found.without_fleet),
        )
    blocks: list[Block] = [Paragraph(f"{counted}. {outlier_words(gathering)}"), Paragraph(METHOD)]
    if found.outliers:
        blocks.append(_table(gathering))
    return Section("outliers", say("What stands out"), blocks)


def _were(count: int) -> str:
    return "was" if count == 1 else "were"


def outlier_words(gathering: Gathering) -> str:
    """Return in a sentence how much stands out, and what farthest."""
    found = gathering.comparison
    if not found.groups:
        return say(
            "No fleet has {fewest} campaigns with a level at one speed, or with a determined "
            "parameter: nothing can stand out.",
            fewest=FEWEST,
        )
    chance = found.groups * FALSE_ALARM
    if not found.outliers:
        return say("Nothing stands out.")
    first = found.outliers[0]
    what = say("level at {what}", what=first.group.what) if first.group.kind == "level" else first.group.what
    return say(
        "{plural} out, where chance alone would give about {chance:.2g} groups with one; the "
        "farthest is {train}, {what}: {value:.4g} against a median of {median:.4g}.",
        plural=plural(len(found.outliers), say("value stands"), say("values stand")),
        chance=chance,
        train=first.result.train,
        what=what,
        value=first.value,
        median=first.spread.median,
    )


def _table(gathering: Gathering) -> Table:
    columns = [
        Column("train", say("Train, else campaign")),
        Column("date", say("Date")),
        Column("origin", say("Origin"), kind="origin"),
        Column("fleet", say("Fleet")),
        Column("what", say("What")),
        Column("value", say("Value"), kind="number"),
        Column("median", say("Median"), kind="number"),
        Column("scatter", say("Scatter"), kind="number"),
        Column("distance", say("Distance"), "scatters", digits=1, kind="number"),
        Column("threshold", say("Threshold"), "scatters", digits=1, kind="number"),
        Column("n", say("Values"), kind="number", digits=0),
    ]
    rows: list[list[Cell]] = []
    for each in gathering.comparison.outliers[:MOST_ROWS]:
        what = say("level at {what}, dB", what=each.group.what) if each.group.kind == "level" else each.group.what
        whose: list[Cell] = [name_cell(gathering, [each.result]), when(each.result) or None]
        whose += [each.group.origin, each.group.fleet]
        spread = each.spread
        numbers = [_rounded(each.value), _rounded(spread.median), _rounded(spread.scatter)]
        counts: list[Cell] = [each.distance, threshold(spread.n), spread.n]
        mode = f", {each.group.mode}" if each.group.mode else ""
        rows.append([*whose, what + mode, *numbers, *counts])
    held = len(gathering.comparison.outliers)
    left_out = (
        "" if len(rows) == held else say(" Shown are the {n_rows} farthest of {held}.", n_rows=len(rows), held=held)
    )
    caption = say("Values that stand out, the farthest first.{left_out}", left_out=left_out).rstrip(".")
    return Table("outliers", caption, columns, rows)


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
