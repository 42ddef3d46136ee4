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
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.calibration_figures import (
    conditions_of,
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
        sentences.append(say("Each condition predicted from the others alone is off by {rms:.1f} dB rms.", rms=rms))
    sentences += _next_words(found)
    return [Sentences(sentences), *(Notice("warning", _sentence(doubt)) for doubt in found.doubts)]


def _sentence(doubt: str) -> str:
    """A doubt as a sentence; a parameter's key keeps its small letter."""
    starts_with_key = "." in doubt.split(" ", 1)[0]
    return f"{doubt if starts_with_key else doubt[:1].upper() + doubt[1:]}."


def _value_words(parameter: FittedParameter, fleet: Fleet) -> str:
    return pretty_signs(sentence(_of_parameter(parameter, fleet)))


def _of_parameter(parameter: FittedParameter, fleet: Fleet) -> str:
    values = {
        "parameter": keyed_words(parameter.key, fleet),
        "quantity": quantity_of(parameter.key, parameter.value, parameter.stderr),
        "initial": parameter.initial,
    }
    if parameter.expression is not None:
        return say(
            "{parameter} is {quantity} (it was {initial:.4g}), by {expression}.",
            expression=parameter.expression,
            **values,
        )
    now = say("{parameter} is {quantity} (it was {initial:.4g})", **values)
    return f"{now}; {_interval_words(parameter)}."


def _interval_words(parameter: FittedParameter) -> str:
    """What the data say of a parameter's interval, as a clause."""
    if parameter.ci95 is None:
        return say("the data give no interval")
    if parameter.ci95 == (None, None):
        return say(
            "its 95 % interval reaches from bound to bound, {low:g} to {high:g}", low=parameter.low, high=parameter.high
        )
    low, high = (say("open") if end is None else f"{end:.3g}" for end in parameter.ci95)
    return say("95 % interval {low} to {high}", low=low, high=high)


def _rms(errors: list[float]) -> float:
    return math.sqrt(sum(error**2 for error in errors) / len(errors))


def _misfit_words(result: CampaignCalibration) -> str:
    found = result.calibration
    before = _rms([level.before_db - level.datum.level_db for level in found.levels])
    after = [level.error_db for level in found.levels]
    worst = max(found.levels, key=lambda level: abs(level.error_db))
    clauses = [
        say(
            "The levels are off by {before:.1f} dB rms before and by {after:.1f} dB rms after the "
            "calibration, at most by {largest:.1f} dB (condition {condition})",
            before=before,
            after=_rms(after),
            largest=abs(worst.error_db),
            condition=worst.datum.condition.name,
        )
    ]
    if _beside_the_paper(result):
        clauses.append(say("the paper states a largest error of {error:g} dB of its model", error=LARGEST_ERROR_DB))
    return f"{'; '.join(clauses)}."


def _beside_the_paper(result: CampaignCalibration) -> bool:
    """Whether the paper's levels belong beside these: its drive, and no recordings of another one."""
    return is_of_the_paper(result.fleet) and result.campaign.origin != "measured"


def _next_words(found: Calibration) -> list[str]:
    if not found.next_measurements:
        return []
    best = found.next_measurements[0]
    if best.mean_remaining > HARDLY_SHORTER:
        return [say("No single further level is expected to shorten the intervals by more than some per cent.")]
    parts = [f"{key_words(name, found.fleet)} {100.0 * part:.0f} %" for name, part in best.remaining.items()]
    return [
        say(
            "What would tell most next is a level at {speed:.3g} km/h and "
            "{torque:.4g} N m, {receiver}: of the intervals it would leave {parts}.",
            speed=best.condition.train_speed_km_h,
            torque=best.condition.torque_n_m,
            receiver=best.receiver.name,
            parts=", ".join(parts),
        )
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
    blocks.append(Details(say("Levels and model by condition"), [levels]) if len(levels.rows) > MANY_LEVELS else levels)
    blocks.append(Details(say("Where the levels and their standard deviations come from"), [sources_table(result)]))
    blocks.append(Details(say("Contributions at each receiver, before and after"), [contributions_table(found)]))
    blocks.append(Section("calibration-told", say("What the data tell"), _told(found)))
    return Section("calibration", say("Calibration"), blocks)


def _method_words(found: Calibration) -> str:
    scatter = (
        say("{sigma:.2g} dB, taken from the misfit", sigma=found.model_sigma_db)
        if found.model_sigma_is_fitted
        else say("{sigma:g} dB, by [calibration] model_sigma_db", sigma=found.model_sigma_db)
    )
    settings = found.settings
    said = [
        say_count(
            "The levels are fitted by weighted least squares from {count} start (lmfit).",
            "The levels are fitted by weighted least squares from {count} starts (lmfit).",
            settings.starts,
        )
        if settings.loss == "linear"
        else say_count(
            "The levels are fitted by weighted least squares with the robust loss {loss} from {count} start (lmfit).",
            "The levels are fitted by weighted least squares with the robust loss {loss} from {count} starts (lmfit).",
            settings.starts,
            loss=settings.loss,
        ),
        say(
            "A datum's standard deviation is that of the measurement and of the model together "
            "({scatter}): the model's is what its lines on unknown modes scatter by, and the "
            "receivers of a condition share it. Intervals are by profile likelihood; an end that a "
            "bound comes before is left open.",
            scatter=scatter,
        ),
    ]
    if found.interpolated_db is not None:
        said.append(
            say(
                "The search went over levels interpolated between computed ones (largest "
                "difference at checked places {difference:.2g} dB); the levels after it are "
                "computed.",
                difference=found.interpolated_db,
            )
        )
    return " ".join(said)


def _printed_words(result: CampaignCalibration) -> str:
    """Our level beside each one that the paper prints of its own model; empty of another drive."""
    ours = {item.condition: item.after_db for item in result.over_speed}
    parts = [
        say(
            "{ours:.1f} against {printed:g} dB in condition {condition}",
            ours=ours[row.conditions[0]],
            printed=row.level_db,
            condition=row.conditions[0],
        )
        for row in MODEL_4M
        if len(row.conditions) == 1 and not math.isnan(ours.get(row.conditions[0], math.nan))
    ]
    if not _beside_the_paper(result) or not parts:
        return ""
    open_row = next(row for row in MODEL_4M if len(row.conditions) > 1)
    said = [
        say(
            "The calibrated model beside the paper's own, as printed with its Fig. 16: {levels}; {printed:g} dB is "
            "printed of condition {conditions}.",
            levels=", ".join(parts),
            printed=open_row.level_db,
            conditions=conditions_of(open_row),
        )
    ]
    fast = [ours.get(name, math.nan) for name in ("5", "6")]
    if fast[1] >= fast[0]:
        said.append(
            say(
                "The paper's level falls from condition 5 to 6; the calibrated model has {fifth:.1f} "
                "and {sixth:.1f} dB there.",
                fifth=fast[0],
                sixth=fast[1],
            )
        )
    return " ".join(said)


def _told(found: Calibration) -> list[Block]:
    directions = {"rank": found.rank, "moved": len(found.moved)}
    seen = (
        say("The levels see {rank} of {moved} directions among the parameters.", **directions)
        if found.condition_number is None
        else say(
            "The levels see {rank} of {moved} directions among the parameters (condition number of the Jacobian, "
            "columns of length one: {condition_number:.3g}).",
            condition_number=found.condition_number,
            **directions,
        )
    )
    fit = say_count(
        "Chi square is {chi_square:.3g} with {count} degree of freedom.",
        "Chi square is {chi_square:.3g} with {count} degrees of freedom.",
        found.degrees_of_freedom,
        chi_square=found.chi_square,
    )
    blocks: list[Block] = [Paragraph(f"{seen} {fit}")]
    tables: list[Table | None] = [correlation_table(found), transfer_table(found), posterior_table(found)]
    blocks += [table for table in tables if table is not None]
    following = next_measurement_table(found)
    if following is not None:
        text = say(
            "To first order, one more level at a speed, torque and receiver would leave this part of each interval; of "
            "a parameter that the data do not determine the bounds are taken as what is known."
        )
        blocks += [Paragraph(text), following]
    return blocks
