"""Another source's numbers and features beside the model's: what is reproduced, and what it depends on."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, Markers
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.gear_words import begun_large
from tdacoustic.reporting.sections.printed import is_of_the_paper
from tdacoustic.results import FleetPrediction
from tdacoustic.studies import QUANTITIES, FeatureCheck, ReferenceCheck
from tdacoustic.studies.responses import SCAN_DB, SCAN_FACTORS
from tdacoustic.studies.words import difference_words, feature_words, margin_words, quantity_words, reference_words

__all__ = ["features_words", "judged_words", "paper_features"]

METHOD: Final = mark(
    "Numbers and features that the fleet file states of another source. A margin is by how much a feature is there "
    "(below zero: by how much it is missing), in dB, in degrees of a direction, or in correlation; amplitudes count as "
    "20 lg. Up to a feature's tolerance (0.5 dB of a shape where the file says nothing) values count as level: a rise "
    "or fall with a larger dip in it is none. A number is reproduced where the model is within the tolerance. What a "
    "margin or a difference depends on is its slope, told for 10 % more of an assumed parameter, or 1 dB more of a "
    "level."
)
MOVED: Final = mark(
    "Each assumed parameter alone was also moved to {count} values from {low:.2g} to {high:g} times its own "
    "(±{level:g} dB of a level), to see whether it alone could turn the verdict; between two such values the place is "
    "interpolated."
)
MOVED_WITH_HOUSING: Final = mark(
    "Each assumed parameter alone, of those that need no new transfer vectors, was also moved to {count} values from "
    "{low:.2g} to {high:g} times its own (±{level:g} dB of a level), to see whether it alone could turn the verdict; "
    "between two such values the place is interpolated."
)
_UNITS: Final = {"db": "dB", "um": "µm", "n": "N", "hz": "Hz", "deg": "°"}


def paper_features(result: FleetPrediction) -> Section | None:
    """Return the section on another source's numbers and features; None where the fleet states none."""
    references, features = result.studies.references, result.studies.features
    if not references and not features:
        return None
    blocks: list[Block] = [Paragraph(_method(result))]
    if features:
        blocks.append(
            Paragraph(say("Of {count} features {verdicts}.", count=len(features), verdicts=_counted(features)))
        )
        words = [feature_words(check, result.fleet) for check in features]
        blocks.append(Sentences([one.statement for one in words]))
        told = [one.dependence for one in words if one.dependence]
        inside: list[Block] = [_feature_table(result), Sentences(told)]
        blocks.append(Details(say("Margins of the features, and what they depend on"), inside))
    if references:
        blocks.append(
            Paragraph(say("Of {count} numbers {verdicts}.", count=len(references), verdicts=_counted(references)))
        )
        blocks += [FigureBlock(figure, "calculated") for figure in _figures(result)]
        blocks.append(_reference_table(result))
        words = [reference_words(check, result.fleet) for check in references]
        told = [one.dependence for one in words if one.dependence]
        blocks += [Details(say("What the numbers depend on"), [Sentences(told)])] if told else []
    return Section("references", _title(result), blocks)


def _title(result: FleetPrediction) -> str:
    of_paper = is_of_the_paper(result.fleet)
    return (
        say("Printed numbers and features beside the model's") if of_paper else say("Other numbers beside the model's")
    )


def features_words(result: FleetPrediction) -> str:
    """Return how many of another source's features the model has, and which not, in a sentence; empty of none."""
    features = result.studies.features
    if not features:
        return ""
    count, verdicts = len(features), _counted(features)
    if is_of_the_paper(result.fleet):
        parts = [say("of {count} features of the paper {verdicts}", count=count, verdicts=verdicts)]
    else:
        parts = [say("of {count} features of another source {verdicts}", count=count, verdicts=verdicts)]
    for holds, lead in ((False, say("not reproduced")), (None, say("not determined"))):
        names = [check.feature.label for check in features if check.holds is holds]
        parts += [f"{lead}: {', '.join(names)}"] if names else []
    return "; ".join(parts)


def judged_words(result: FleetPrediction, quantities: tuple[str, ...]) -> str:
    """Return the verdicts on features of some quantities, and where they are reached; empty of none.

    Parameters
    ----------
    result : FleetPrediction
    quantities : tuple of str
        Parts of the quantities' names.
    """
    held = [check for check in result.studies.features if any(part in check.feature.quantity for part in quantities)]
    if not held:
        return ""
    named: dict[str, list[str]] = {}
    for check in held:
        named.setdefault(_verdict(check.holds), []).append(check.feature.label)
    parts = [f"{verdict}: {', '.join(labels)}" for verdict, labels in named.items()]
    return say(
        "features of another source, as judged in the section "
        "\N{LEFT DOUBLE QUOTATION MARK}{section}\N{RIGHT DOUBLE QUOTATION MARK}: {verdicts}",
        section=_title(result),
        verdicts="; ".join(parts),
    )


def _method(result: FleetPrediction) -> str:
    low, high = SCAN_FACTORS[0], SCAN_FACTORS[-1]
    moved = say(
        MOVED if result.prediction.housing is None else MOVED_WITH_HOUSING,
        count=len(SCAN_FACTORS),
        low=low,
        high=high,
        level=SCAN_DB[-1],
    )
    return f"{say(METHOD)} {moved}"


def _counted(checks: tuple[FeatureCheck, ...] | tuple[ReferenceCheck, ...]) -> str:
    """How many are reproduced and how many not."""
    verdicts = [check.holds for check in checks]
    parts = [
        say_count("{count} is reproduced", "{count} are reproduced", verdicts.count(True)),
        say_count("{count} is not", "{count} are not", verdicts.count(False)),
    ]
    if None in verdicts:
        parts.append(say("and {count} cannot be said", count=verdicts.count(None)))
    return ", ".join(parts)


def _verdict(holds: bool | None) -> str:
    return say("not determined") if holds is None else say("reproduced") if holds else say("not reproduced")


def _feature_table(result: FleetPrediction) -> Table:
    columns = (
        Column("feature", say("Feature")),
        Column("verdict", say("Verdict"), kind="verdict"),
        Column("margin", say("Margin"), align="right"),
        Column("origin", say("Where it comes from")),
    )
    rows: list[list[Cell]] = []
    for check in result.studies.features:
        rows.append([check.feature.label, _verdict(check.holds), margin_words(check), check.feature.origin])
    return Table("features", say("Features of another source in the model"), columns, rows, origin="calculated")


def _reference_table(result: FleetPrediction) -> Table:
    columns = (
        Column("number", say("Number")),
        Column("unit", say("Unit")),
        Column("reference_value", say("Printed"), "", None, "number"),
        Column("model_value", say("Model"), "", None, "number"),
        Column("difference", say("Difference"), align="right"),
        Column("verdict", say("Verdict"), kind="verdict"),
        Column("origin", say("Where it comes from")),
    )
    rows: list[list[Cell]] = []
    for check in result.studies.references:
        held = check.reference
        number = [begun_large(quantity_words(held.quantity, result.fleet)), _where(check)]
        if held.kind == "measured":
            number.append(say("measured"))
        unit = _UNITS[held.quantity.rpartition("_")[2]]
        value = None if math.isnan(check.value) else float(f"{check.value:.4g}")
        off = difference_words(check)
        rows.append([", ".join(number), unit, held.value, value, off, _verdict(check.holds), held.origin])
    return Table("reference-numbers", say("Numbers of another source and the model's"), columns, rows)


def _where(check: ReferenceCheck) -> str:
    """The condition or the helix angle that a number is of."""
    names = check.reference.condition
    if not names:
        return say("helix angle {angle:g}°", angle=check.reference.helix_angle_deg)
    either = names[0]
    for name in names[1:]:
        either = say("{one} or {other}", one=either, other=name)
    if len(names) > 1 and check.case is not None:
        return say("condition {names} (here {name})", names=either, name=check.case.name)
    return say("condition {names}", names=either)


def _figures(result: FleetPrediction) -> list[Figure]:
    """Quantities with numbers of several conditions, over speed."""
    found = []
    for quantity in dict.fromkeys(check.reference.quantity for check in result.studies.references):
        checks = [
            check
            for check in result.studies.references
            if check.reference.quantity == quantity and check.case is not None and check.case.over == "conditions"
        ]
        if len({check.case.name for check in checks if check.case is not None}) > 1:
            found.append(_figure(result, quantity, checks))
    return found


def _figure(result: FleetPrediction, quantity: str, checks: list[ReferenceCheck]) -> Figure:
    responses = result.studies.responses
    assert responses is not None  # there are checks
    held = [place for place, case in enumerate(responses.cases) if case.over == "conditions"]
    held.sort(key=lambda place: responses.cases[place].value)
    speeds = np.array([responses.cases[place].value for place in held])
    own = responses.base[held, QUANTITIES.index(quantity)]
    elements: list[Element] = [Line(speeds, own, say("this model"), color=7, points=True)]
    for kind, name, slot in (("model", say("printed, of a model"), 1), ("measured", say("printed, measured"), 0)):
        of_kind = [check for check in checks if check.reference.kind == kind]
        if of_kind:
            at = [check.case.value for check in of_kind if check.case is not None]
            values = [check.reference.value for check in of_kind]
            texts = [check.reference.origin for check in of_kind]
            symbol = "diamond" if kind == "model" else "square"
            elements.append(Markers(at, values, name, texts=texts, symbol=symbol, color=slot))  # type: ignore[arg-type]
    words, unit = quantity_words(quantity, result.fleet), _UNITS[quantity.rpartition("_")[2]]
    label = begun_large(words)
    reference = "20 µPa" if quantity.endswith("_db") and quantity != "range_12m_db" else None
    name = f"reference-{quantity.replace('_', '-')}"
    caption = say("Points are numbers of another source, the line is this model.")
    axis = Axis(label, unit, reference=reference)
    return Figure(
        name,
        say("{quantity}, printed and of this model", quantity=label),
        caption,
        Axis(say("Train speed"), "km/h"),
        axis,
        elements,
    )
