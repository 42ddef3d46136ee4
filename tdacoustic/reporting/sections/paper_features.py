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
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.printed import is_of_the_paper
from tdacoustic.results import FleetPrediction
from tdacoustic.studies import QUANTITIES, FeatureCheck, ReferenceCheck
from tdacoustic.studies.responses import SCAN_DB, SCAN_FACTORS
from tdacoustic.studies.words import difference_words, feature_words, margin_words, quantity_words, reference_words

__all__ = ["features_words", "judged_words", "paper_features"]

QUOTES: Final = ("\N{LEFT DOUBLE QUOTATION MARK}", "\N{RIGHT DOUBLE QUOTATION MARK}")
_UNITS: Final = {"db": "dB", "um": "µm", "n": "N", "hz": "Hz", "deg": "°"}


def paper_features(result: FleetPrediction) -> Section | None:
    """Return the section on another source's numbers and features; None where the fleet states none."""
    references, features = result.studies.references, result.studies.features
    if not references and not features:
        return None
    blocks: list[Block] = [Paragraph(_method(result))]
    if features:
        blocks.append(
            Paragraph(say("Of {n_features} features {count}.", n_features=len(features), count=_count(features)))
        )
        words = [feature_words(check, result.fleet) for check in features]
        blocks.append(Sentences([one.statement for one in words]))
        told = [one.dependence for one in words if one.dependence]
        inside: list[Block] = [_feature_table(result), Sentences(told)]
        blocks.append(Details(say("Margins of the features, and what they depend on"), inside))
    if references:
        blocks.append(
            Paragraph(say("Of {n_references} numbers {count}.", n_references=len(references), count=_count(references)))
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
    of_whom = say("of the paper") if is_of_the_paper(result.fleet) else say("of another source")
    parts = [
        say(
            "of {n_features} features {of_whom} {count}",
            n_features=len(features),
            of_whom=of_whom,
            count=_count(features),
        )
    ]
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
    section = f"{QUOTES[0]}{_title(result)}{QUOTES[1]}"
    return say(
        "features of another source, as judged in the section {section}: {parts}",
        section=section,
        parts="; ".join(parts),
    )


def _method(result: FleetPrediction) -> str:
    low, high = SCAN_FACTORS[0], SCAN_FACTORS[-1]
    vectors = say(" of those that need no new transfer vectors") if result.prediction.housing is not None else ""
    return say(
        "Numbers and features that the fleet file states of another source. A margin is by how "
        "much a feature is there (below zero: by how much it is missing), in dB, in degrees of a "
        "direction, or in correlation; amplitudes count as 20 lg. Up to a feature's tolerance "
        "(0.5 dB of a shape where the file says nothing) values count as level: a rise or fall "
        "with a larger dip in it is none. A number is reproduced where the model is within the "
        "tolerance. What a margin or a difference depends on is its slope, told for 10 % more of "
        "an assumed parameter, or 1 dB more of a level. Each assumed parameter alone{vectors} "
        "was also moved to {n_scan_factors} values from {low:.2g} to {high:g} times its own "
        "(±{scan_db:g} dB of a level), to see whether it alone could turn the verdict; between "
        "two such values the place is interpolated.",
        vectors="," + vectors + "," if vectors else "",
        n_scan_factors=len(SCAN_FACTORS),
        low=low,
        high=high,
        scan_db=SCAN_DB[-1],
    )


def _count(checks: tuple[FeatureCheck, ...] | tuple[ReferenceCheck, ...]) -> str:
    verdicts = [check.holds for check in checks]
    there, missing, open_ = verdicts.count(True), verdicts.count(False), verdicts.count(None)
    text = say(
        "{there} {value} reproduced, {missing} {value_2} not",
        there=there,
        value="is" if there == 1 else "are",
        missing=missing,
        value_2="is" if missing == 1 else "are",
    )
    return text + (say(", and {open} cannot be said", open=open_) if open_ else "")


def _verdict(holds: bool | None) -> str:
    return say("not determined") if holds is None else "reproduced" if holds else say("not reproduced")


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
        names = held.condition or ()
        where = (
            say("condition {names}", names=" or ".join(names))
            if names
            else say("helix angle {helix_angle_deg:g}°", helix_angle_deg=held.helix_angle_deg)
        )
        if len(names) > 1 and check.case is not None:
            where += say(" (here {name})", name=check.case.name)
        quantity = quantity_words(held.quantity, result.fleet)
        number = f"{quantity[:1].upper()}{quantity[1:]}, {where}{', measured' if held.kind == 'measured' else ''}"
        unit = _UNITS[held.quantity.rpartition("_")[2]]
        value = None if math.isnan(check.value) else float(f"{check.value:.4g}")
        off = difference_words(check)
        rows.append([number, unit, held.value, value, off, _verdict(check.holds), held.origin])
    return Table("reference-numbers", say("Numbers of another source and the model's"), columns, rows)


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
    label = f"{words[:1].upper()}{words[1:]}"
    reference = "20 µPa" if quantity.endswith("_db") and quantity != "range_12m_db" else None
    name = f"reference-{quantity.replace('_', '-')}"
    caption = say("Points are numbers of another source, the line is this model.")
    axis = Axis(label, unit, reference=reference)
    return Figure(
        name,
        say("{label}, printed and of this model", label=label),
        caption,
        Axis(say("Train speed"), "km/h"),
        axis,
        elements,
    )
