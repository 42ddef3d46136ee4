"""What stands out: levels and parameters far from those of the same fleet."""

from __future__ import annotations

from typing import Final

from tdacoustic.gathering.gathered import Gathering
from tdacoustic.gathering.outliers import BAND_KM_H, LEVEL_FLOOR_DB, PARAMETER_FLOOR, Comparison
from tdacoustic.gathering.robust import FALSE_ALARM, FEWEST, threshold
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Table
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.campaigns_rows import MOST_ROWS, captioned, name_cell, when

__all__ = ["campaigns_outliers", "outlier_words"]

METHOD: Final = mark(
    "Compared are values of one fleet and one origin: recorded levels at 4 m within bands of {band:g} km/h and "
    "of one mode (one value a campaign), and determined parameters. A value stands out if it lies more than a "
    "threshold from the median, counted in scatters of 1.4826 times the median absolute deviation (at least "
    "{level_floor:g} dB of levels, {parameter_floor:g} % of a parameter, both assumed), and, of a parameter, "
    "if its own interval of 95 % does not hold that median. The threshold goes from "
    "{threshold_of_fewest:g} scatters in a group of {fewest} over {threshold_of_ten:g} of ten to "
    "{threshold_of_hundred:g} of a hundred: so one group in {groups} of normally scattered values has one by chance. "
    "In fewer than {fewest} values nothing stands out."
)


def campaigns_outliers(gathering: Gathering) -> Section:
    """Return the section on values that stand out."""
    found = gathering.comparison
    blocks: list[Block] = [
        Paragraph(f"{'; '.join(_compared_words(found))}. {outlier_words(gathering)}"),
        Paragraph(_method_words()),
    ]
    if found.outliers:
        blocks.append(_table(gathering))
    return Section("outliers", say("What stands out"), blocks)


def _method_words() -> str:
    return say(
        METHOD,
        band=BAND_KM_H,
        level_floor=LEVEL_FLOOR_DB,
        parameter_floor=100 * PARAMETER_FLOOR,
        threshold_of_fewest=threshold(FEWEST),
        fewest=FEWEST,
        threshold_of_ten=threshold(10),
        threshold_of_hundred=threshold(100),
        groups=round(1 / FALSE_ALARM),
    )


def _compared_words(found: Comparison) -> list[str]:
    """What was compared and what was not, clause by clause."""
    said = []
    if found.groups:
        groups = say_count("{count} group", "{count} groups", found.groups)
        said.append(
            say_count(
                "{count} value in {groups} was compared",
                "{count} values in {groups} were compared",
                found.values,
                groups=groups,
            )
        )
    said.append(
        say_count(
            "{count} group had fewer than {fewest} values",
            "{count} groups had fewer than {fewest} values",
            found.small_groups,
            fewest=FEWEST,
        )
    )
    if found.left_out_parameters:
        said.append(
            say_count(
                "{count} parameter on a bound or not determined did not count",
                "{count} parameters on a bound or not determined did not count",
                found.left_out_parameters,
            )
        )
    if found.without_fleet:
        said.append(
            say_count(
                "{count} campaign without a fleet was not compared",
                "{count} campaigns without a fleet were not compared",
                found.without_fleet,
            )
        )
    return said


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
    what = say("level at {speed}", speed=first.group.what) if first.group.kind == "level" else first.group.what
    return say_count(
        "{count} value stands out, where chance alone would give about {chance:.2g} groups with one; the "
        "farthest is {train}, {what}: {value:.4g} against a median of {median:.4g}.",
        "{count} values stand out, where chance alone would give about {chance:.2g} groups with one; the "
        "farthest is {train}, {what}: {value:.4g} against a median of {median:.4g}.",
        len(found.outliers),
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
        Column("distance", say("Distance"), say("scatters"), digits=1, kind="number"),
        Column("threshold", say("Threshold"), say("scatters"), digits=1, kind="number"),
        Column("n", say("Values"), kind="number", digits=0),
    ]
    rows: list[list[Cell]] = []
    for each in gathering.comparison.outliers[:MOST_ROWS]:
        what = say("level at {speed}, dB", speed=each.group.what) if each.group.kind == "level" else each.group.what
        whose: list[Cell] = [name_cell(gathering, [each.result]), when(each.result) or None]
        whose += [each.group.origin, each.group.fleet]
        spread = each.spread
        numbers = [_rounded(each.value), _rounded(spread.median), _rounded(spread.scatter)]
        counts: list[Cell] = [each.distance, threshold(spread.n), spread.n]
        mode = f", {each.group.mode}" if each.group.mode else ""
        rows.append([*whose, what + mode, *numbers, *counts])
    held = len(gathering.comparison.outliers)
    left_out = "" if len(rows) == held else say("Shown are the {shown} farthest of {held}.", shown=len(rows), held=held)
    caption = captioned(say("Values that stand out, the farthest first"), left_out)
    return Table("outliers", caption, columns, rows)


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
