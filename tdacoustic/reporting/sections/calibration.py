"""The model held against the measured levels: values, residuals, what the data can tell."""

from __future__ import annotations

import math

from tdacoustic.fitting.calibration import Calibration, FittedParameter
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import (
    Block,
    Details,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.sections.calibration_figures import (
    contributions_figure,
    levels_figure,
    residuals_figure,
)
from tdacoustic.reporting.sections.calibration_tables import (
    contributions_table,
    correlation_table,
    levels_table,
    next_measurement_table,
    parameters_table,
    posterior_table,
    sources_table,
    transfer_table,
)
from tdacoustic.reporting.sections.gear_words import sentence
from tdacoustic.reporting.sections.parameters import key_words, keyed_words, quantity_of
from tdacoustic.reporting.sections.printed import LARGEST_ERROR_DB, MODEL_4M, is_of_the_paper
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import CampaignCalibration

__all__ = ["calibration_answer", "calibration_section"]

HARDLY_SHORTER = 0.95
"""Part of the intervals that the most telling measurement leaves from which it is not named."""

MANY_LEVELS = 24
"""Levels beyond which their table is folded away."""


def calibration_answer(result: CampaignCalibration) -> list[Block]:
    """Return what the calibration found in sentences, then its doubts."""
    found = result.calibration
    sentences = [_value_words(parameter, found.fleet) for parameter in found.parameters]
    sentences.append(_misfit_words(result))
    left = [item.error_db for item in found.left_out if item.error_db is not None]
    if left:
        rms = math.sqrt(sum(error**2 for error in left) / len(left))
        sentences.append(f"Each condition predicted from the others alone is off by {rms:.1f} dB rms.")
    sentences += _next_words(found)
    return [Sentences(sentences), *(Notice("warning", _sentence(doubt)) for doubt in found.doubts)]


def _sentence(doubt: str) -> str:
    """A doubt as a sentence; a parameter's key keeps its small letter."""
    starts_with_key = "." in doubt.split(" ", 1)[0]
    return f"{doubt if starts_with_key else doubt[:1].upper() + doubt[1:]}."


def _value_words(parameter: FittedParameter, fleet: Fleet) -> str:
    return pretty_signs(sentence(_of_parameter(parameter, fleet)))


def _of_parameter(parameter: FittedParameter, fleet: Fleet) -> str:
    key = parameter.key
    text = f"{keyed_words(key, fleet)} is {quantity_of(key, parameter.value)} (it was {parameter.initial:.4g})"
    if parameter.expression is not None:
        return f"{text}, by {parameter.expression}."
    if parameter.ci95 is None:
        return f"{text}; the data give no interval."
    if parameter.ci95 == (None, None):
        return f"{text}; its 95 % interval reaches from bound to bound, {parameter.low:g} to {parameter.high:g}."
    low, high = ("open" if end is None else f"{end:.4g}" for end in parameter.ci95)
    return f"{text}; 95 % interval {low} to {high}."


def _rms(errors: list[float]) -> float:
    return math.sqrt(sum(error**2 for error in errors) / len(errors))


def _misfit_words(result: CampaignCalibration) -> str:
    found = result.calibration
    before = _rms([level.before_db - level.datum.level_db for level in found.levels])
    after = [level.error_db for level in found.levels]
    worst = max(found.levels, key=lambda level: abs(level.error_db))
    text = (
        f"The levels are off by {before:.1f} dB rms before and by {_rms(after):.1f} dB rms after the calibration, at "
        f"most by {abs(worst.error_db):.1f} dB (condition {worst.datum.condition.name})"
    )
    if _beside_the_paper(result):
        text += f"; the paper states a largest error of {LARGEST_ERROR_DB:g} dB of its model"
    return f"{text}."


def _beside_the_paper(result: CampaignCalibration) -> bool:
    """Whether the paper's levels belong beside these: its drive, and no recordings of another one."""
    return is_of_the_paper(result.fleet) and result.campaign.origin != "measured"


def _next_words(found: Calibration) -> list[str]:
    if not found.next_measurements:
        return []
    best = found.next_measurements[0]
    if best.mean_remaining > HARDLY_SHORTER:
        return ["No single further level is expected to shorten the intervals by more than some per cent."]
    parts = [f"{key_words(name, found.fleet)} {100.0 * part:.0f} %" for name, part in best.remaining.items()]
    return [
        f"What would tell most next is a level at {best.condition.train_speed_km_h:.3g} km/h and "
        f"{best.condition.torque_n_m:.4g} N m, {best.receiver.name}: of the intervals it would leave "
        f"{', '.join(parts)}."
    ]


def calibration_section(result: CampaignCalibration) -> Section:
    """Return the section on the calibration."""
    found = result.calibration
    blocks: list[Block] = [Paragraph(_method_words(found)), parameters_table(found)]
    printed = _printed_words(result)
    blocks += [Paragraph(printed)] if printed else []
    figures = [levels_figure(result), contributions_figure(result), residuals_figure(result)]
    blocks += [FigureBlock(figure, None) for figure in figures if figure is not None]
    levels = levels_table(result)
    blocks.append(Details("Levels and model by condition", [levels]) if len(levels.rows) > MANY_LEVELS else levels)
    blocks.append(Details("Where the levels and their standard deviations come from", [sources_table(result)]))
    blocks.append(Details("Contributions at each receiver, before and after", [contributions_table(found)]))
    blocks.append(Section("calibration-told", "What the data tell", _told(found)))
    return Section("calibration", "Calibration", blocks)


def _method_words(found: Calibration) -> str:
    scatter = (
        f"{found.model_sigma_db:.2g} dB, taken from the misfit"
        if found.model_sigma_is_fitted
        else f"{found.model_sigma_db:g} dB, by [calibration] model_sigma_db"
    )
    loss = "" if found.settings.loss == "linear" else f" with the robust loss {found.settings.loss}"
    interpolated = (
        ""
        if found.interpolated_db is None
        else " The search went over levels interpolated between computed ones (largest difference at checked places "
        f"{found.interpolated_db:.2g} dB); the levels after it are computed."
    )
    return (
        f"The levels are fitted by weighted least squares{loss} from {found.settings.starts} starts (lmfit). A datum's "
        f"standard deviation is that of the measurement and of the model together ({scatter}): the model's is what its "
        "lines on unknown modes scatter by, and the receivers of a condition share it. Intervals are by profile "
        f"likelihood; an end that a bound comes before is left open.{interpolated}"
    )


def _printed_words(result: CampaignCalibration) -> str:
    """Our level beside each one that the paper prints of its own model; empty of another drive."""
    ours = {item.condition: item.after_db for item in result.over_speed}
    parts = [
        f"{ours[row.conditions[0]]:.1f} against {row.level_db:g} dB in condition {row.conditions[0]}"
        for row in MODEL_4M
        if len(row.conditions) == 1 and not math.isnan(ours.get(row.conditions[0], math.nan))
    ]
    if not _beside_the_paper(result) or not parts:
        return ""
    open_row = next(row for row in MODEL_4M if len(row.conditions) > 1)
    text = f"The calibrated model beside the paper's own, as printed with its Fig. 16: {', '.join(parts)}"
    text += f"; {open_row.level_db:g} dB is printed of condition {' or '.join(open_row.conditions)}."
    fast = [ours.get(name, math.nan) for name in ("5", "6")]
    if fast[1] >= fast[0]:
        text += (
            f" The paper's level falls from condition 5 to 6; the calibrated model has {fast[0]:.1f} and {fast[1]:.1f} "
            "dB there."
        )
    return text


def _told(found: Calibration) -> list[Block]:
    number = found.condition_number
    seen = (
        f"The levels see {found.rank} of {len(found.moved)} directions among the parameters"
        + ("" if number is None else f" (condition number of the Jacobian, columns of length one: {number:.3g})")
        + f". Chi square is {found.chi_square:.3g} with {found.degrees_of_freedom} degrees of freedom."
    )
    blocks: list[Block] = [Paragraph(seen)]
    tables: list[Table | None] = [correlation_table(found), transfer_table(found), posterior_table(found)]
    blocks += [table for table in tables if table is not None]
    following = next_measurement_table(found)
    if following is not None:
        text = (
            "To first order, one more level at a speed, torque and receiver would leave this part of each interval; of "
            "a parameter that the data do not determine the bounds are taken as what is known."
        )
        blocks += [Paragraph(text), following]
    return blocks
