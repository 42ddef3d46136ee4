"""The model held against the measured levels: values, residuals, what the data can tell."""

from __future__ import annotations

import math

import numpy as np

from tdacoustic.fitting.calibration import Calibration, FittedParameter
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Notice,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Figure, Line, Markers
from tdacoustic.results import CampaignCalibration

__all__ = ["calibration_answer", "calibration_section"]


def calibration_answer(result: CampaignCalibration) -> list[Block]:
    """Return what the calibration found in sentences, then its doubts."""
    found = result.calibration
    sentences = [_value_words(parameter) for parameter in found.parameters]
    sentences.append(_misfit_words(found))
    left = [item.error_db for item in found.left_out if item.error_db is not None]
    if left:
        rms = math.sqrt(sum(error**2 for error in left) / len(left))
        sentences.append(f"Each condition predicted from the others alone is off by {rms:.1f} dB rms.")
    return [Sentences(sentences), *(Notice("warning", _sentence(doubt)) for doubt in found.doubts)]


def _sentence(doubt: str) -> str:
    """A doubt as a sentence; a parameter's key keeps its small letter."""
    starts_with_key = "." in doubt.split(" ", 1)[0]
    return f"{doubt if starts_with_key else doubt[:1].upper() + doubt[1:]}."


def calibration_section(result: CampaignCalibration) -> Section:
    """Return the section on the calibration."""
    found = result.calibration
    text = (
        "The levels are fitted by weighted least squares from several starts (lmfit). A datum's standard deviation is "
        f"that of the measurement and of the model together ({result.campaign.calibration.model_sigma_db:g} dB, by "
        "[calibration] model_sigma_db): the model's is what its lines on unknown modes scatter by. Intervals are by "
        "profile likelihood; an end that a bound comes before is left open."
    )
    blocks: list[Block] = [Paragraph(text), _parameters(found), FigureBlock(_figure(result), None), _levels(result)]
    return Section("calibration", "Calibration", blocks)


def _value_words(parameter: FittedParameter) -> str:
    text = f"{parameter.key} is {parameter.value:.4g} (it was {parameter.initial:.4g})"
    if parameter.ci95 is not None:
        low, high = ("open" if end is None else f"{end:.4g}" for end in parameter.ci95)
        return f"{text}; 95 % interval {low} to {high}."
    return f"{text}; the data give no interval."


def _misfit_words(found: Calibration) -> str:
    def rms(errors: list[float]) -> float:
        return math.sqrt(sum(error**2 for error in errors) / len(errors))

    before = rms([level.before_db - level.datum.level_db for level in found.levels])
    after = rms([level.error_db for level in found.levels])
    return f"The levels are off by {before:.1f} dB rms before and by {after:.1f} dB rms after the calibration."


def _parameters(found: Calibration) -> Table:
    columns = (
        Column("parameter", "Parameter"),
        Column("initial", "Before", kind="number"),
        Column("value", "After", kind="number"),
        Column("stderr", "±", "1 σ", kind="number"),
        Column("low", "95 % from", kind="number"),
        Column("high", "95 % to", kind="number"),
        Column("bounds", "Bounds"),
    )
    rows: list[list[Cell]] = []
    for p in found.parameters:
        low, high = (None, None) if p.ci95 is None else p.ci95
        rows.append([p.key, p.initial, p.value, p.stderr, low, high, f"{p.low:g} to {p.high:g}"])
    return Table("calibrated-parameters", "Fitted parameters", columns, rows, origin="calculated")


def _levels(result: CampaignCalibration) -> Table:
    found = result.calibration
    left = {item.condition: item.error_db for item in found.left_out}
    columns = (
        Column("condition", "Condition"),
        Column("train_speed_km_h", "Speed", "km/h", 1, "number"),
        Column("receiver", "At"),
        Column("origin", "Standing", kind="origin"),
        Column("measured_db", "Level", "dB", 1, "number"),
        Column("before_db", "Before", "dB", 1, "number"),
        Column("predicted_db", "After", "dB", 1, "number"),
        Column("error_db", "After less level", "dB", 1, "number"),
        Column("sigma_db", "σ", "dB", 1, "number"),
        Column("left_out_db", "Left out", "predicted less level, dB", 1, "number"),
    )
    rows: list[list[Cell]] = [
        [
            level.datum.condition.name,
            level.datum.condition.train_speed_km_h,
            level.datum.receiver.name,
            level.datum.origin,
            level.datum.level_db,
            level.before_db,
            level.predicted_db,
            level.error_db,
            level.sigma_db,
            left.get(level.datum.condition.name),
        ]
        for level in found.levels
    ]
    return Table("calibration-levels", "Levels and model by condition", columns, rows)


def _figure(result: CampaignCalibration) -> Figure:
    found = result.calibration
    levels = sorted(found.levels, key=lambda level: level.datum.condition.train_speed_km_h)
    speeds = np.array([level.datum.condition.train_speed_km_h for level in levels])
    elements: list[Line | Markers] = []
    for slot, origin in enumerate(dict.fromkeys(level.datum.origin for level in levels)):
        held = np.array([level.datum.level_db if level.datum.origin == origin else math.nan for level in levels])
        elements.append(Markers(speeds, held, f"level, {origin}", color=slot, symbol="diamond"))
    before = np.array([level.before_db for level in levels])
    after = np.array([level.predicted_db for level in levels])
    elements.append(Line(speeds, before, "model before", color=7, style="dotted", points=True))
    elements.append(Line(speeds, after, "model after", color=2, points=True))
    return Figure(
        "calibration-over-speed",
        "Levels and model over the train's speed, before and after the calibration",
        "One dot a condition; the lines between them only lead the eye.",
        Axis("Train speed", "km/h"),
        Axis("Sound pressure level", "dB", reference="20 µPa"),
        elements,
    )
