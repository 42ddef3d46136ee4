"""Figures of a calibration: levels over speed before and after it, and the contributions to them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np

from tdacoustic.drive import DriveSound
from tdacoustic.fitting.calibration import FittedLevel
from tdacoustic.reporting.figure import Axis, Band, Figure, Line, LineStyle, Markers, Symbol
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.printed import (
    LARGEST_ERROR_DB,
    MEASURED_4M,
    MODEL_4M,
    PrintedLevel,
    is_of_the_paper,
)
from tdacoustic.reporting.sections.sound_paths import heard_paths, total_words
from tdacoustic.reporting.sections.words import joined
from tdacoustic.reporting.shown import ORIGIN_WORDS
from tdacoustic.results import CampaignCalibration

__all__ = ["conditions_of", "contributions_figure", "levels_figure", "residuals_figure"]

SYMBOLS: Final[dict[str, Symbol]] = {"measured": "circle", "synthetic": "diamond", "printed": "square"}
_OVERALL: Final = "overall"
_NEAR: Final = 0.05


def _surface_levels(result: CampaignCalibration) -> list[FittedLevel]:
    """Unweighted overall levels at the distance of the surface, by speed."""
    radius_m = result.fleet.radiation.sphere_radius_m.value
    held = [
        level
        for level in result.calibration.levels
        if level.datum.what == _OVERALL
        and level.datum.weighting == "Z"
        and abs(level.datum.receiver.distance_m - radius_m) <= _NEAR * radius_m
    ]
    return sorted(held, key=lambda level: level.datum.condition.train_speed_km_h)


def levels_figure(result: CampaignCalibration) -> Figure | None:
    """Return levels over speed: measured, uncalibrated, calibrated; of the paper's drive its printed ones too.

    None where there is nothing at the distance of the surface.
    """
    found = result.calibration
    held = _surface_levels(result)
    elements: list[Line | Markers | Band] = []
    if found.model_sigma_db > 0.0 and result.over_speed:
        after = np.array([item.after_db for item in result.over_speed])
        speeds = np.array([item.train_speed_km_h for item in result.over_speed])
        sigma = found.model_sigma_db
        elements.append(
            Band(speeds, after - sigma, after + sigma, say("calibrated model ± {sigma:.2g} dB (1 σ)", sigma=sigma), 2)
        )
    if result.over_speed:
        speeds = np.array([item.train_speed_km_h for item in result.over_speed])
        before = np.array([item.before_db for item in result.over_speed])
        after = np.array([item.after_db for item in result.over_speed])
        name = say("model before: assumed parameters")
        elements.append(Line(speeds, before, name, color=7, style="dotted", points=True))
        elements.append(Line(speeds, after, say("model after: calibrated"), color=2, points=True))
    for slot, origin in enumerate(dict.fromkeys(level.datum.origin for level in held)):
        of_origin = [level for level in held if level.datum.origin == origin]
        elements.append(
            _levels(
                of_origin,
                say("level, {origin} (± 1 σ)", origin=say(ORIGIN_WORDS[origin])),
                SYMBOLS.get(origin, "circle"),
                slot,
            )
        )
    if is_of_the_paper(result.fleet) and result.campaign.origin != "measured":
        elements += _of_paper(result)
    if not elements:
        return None
    return Figure(
        "calibration-over-speed",
        say(
            "Levels at {distance:g} m over the train's speed, and the model before and after the calibration",
            distance=result.fleet.radiation.sphere_radius_m.value,
        ),
        say(
            "One dot a condition; the lines between them only lead the eye. Conditions without a level are the model's "
            "alone."
        ),
        Axis(say("Train speed"), "km/h"),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        elements,
        height=480,
    )


def _levels(held: list[FittedLevel], name: str, symbol: Symbol, slot: int) -> Markers:
    return Markers(
        np.array([level.datum.condition.train_speed_km_h for level in held]),
        np.array([level.datum.level_db for level in held]),
        name,
        texts=[
            say(
                "condition {condition}, {receiver}",
                condition=level.datum.condition.name,
                receiver=level.datum.receiver.name,
            )
            for level in held
        ],
        symbol=symbol,
        errors=np.array([level.datum.sigma_db for level in held]),
        color=slot,
    )


def _of_paper(result: CampaignCalibration) -> list[Markers]:
    """The paper's model with its largest error, and the level that it prints as measured."""
    speeds = {item.condition: item.train_speed_km_h for item in result.over_speed}
    model = [
        (sum(speeds[name] for name in row.conditions) / len(row.conditions), row)
        for row in MODEL_4M
        if all(name in speeds for name in row.conditions)
    ]
    found = []
    if model:
        found.append(
            Markers(
                np.array([speed for speed, _ in model]),
                np.array([row.level_db for _, row in model]),
                say(
                    "the paper's model, printed, ± its largest error of {error:g} dB",
                    error=LARGEST_ERROR_DB,
                ),
                texts=[say("condition {condition}", condition=conditions_of(row)) for _, row in model],
                symbol="triangle",
                errors=np.full(len(model), LARGEST_ERROR_DB),
                color=3,
            )
        )
    measured = [(speeds[row.conditions[0]], row) for row in MEASURED_4M if row.conditions[0] in speeds]
    known = {level.datum.condition.name for level in result.calibration.levels if level.datum.origin == "printed"}
    measured = [(speed, row) for speed, row in measured if row.conditions[0] not in known]
    if measured:
        found.append(
            Markers(
                np.array([speed for speed, _ in measured]),
                np.array([row.level_db for _, row in measured]),
                say("the paper's measurement, printed"),
                texts=[say("condition {condition}", condition=row.conditions[0]) for _, row in measured],
                symbol="x",
                color=1,
            )
        )
    return found


def conditions_of(row: PrintedLevel) -> str:
    """Return the condition that the paper prints a level of; both where it leaves open which of two."""
    if len(row.conditions) == 1:
        return row.conditions[0]
    first, second = row.conditions
    return say("{first} or {second}", first=first, second=second)


def contributions_figure(result: CampaignCalibration) -> Figure | None:
    """Return the level of each path over speed, before and after; None where there are none."""
    held = _surface_levels(result)
    if not held:
        return None
    receiver = held[0].datum.receiver.name
    speeds = {level.datum.condition.name: level.datum.condition.train_speed_km_h for level in held}
    elements: list[Line] = []
    sides: tuple[tuple[Iterable[DriveSound], str, LineStyle], ...] = (
        (result.calibration.before, mark("{path}, before"), "dotted"),
        (result.calibration.after, mark("{path}, after"), "solid"),
    )
    drawn = []
    for path in heard_paths((*result.calibration.before, *result.calibration.after)):
        for sounds, words, style in sides:
            x, y = _over_speed(sounds, speeds, receiver, path.key)
            if y.size and not np.isnan(y).all():
                elements.append(Line(x, y, say(words, path=say(path.name)), style=style, color=path.slot, points=True))
                drawn.append(path)
    if not elements:
        return None
    return Figure(
        "calibration-contributions",
        say(
            "What {paths} contribute at {receiver}, before and after the calibration",
            paths=joined([say(path.name) for path in dict.fromkeys(drawn)]),
            receiver=receiver,
        ),
        " ".join([say("Unweighted levels of each path alone."), total_words(result.fleet, dict.fromkeys(drawn))]),
        Axis(say("Train speed"), "km/h"),
        Axis(say("Sound pressure level"), "dB", reference="20 µPa"),
        elements,
    )


def _over_speed(
    sounds: Iterable[DriveSound], speeds: dict[str, float], receiver: str, path: str
) -> tuple[np.ndarray, np.ndarray]:
    rows = sorted(
        (speeds[sound.condition], math.nan if (level := sound.level_db(receiver, path)) is None else level)
        for sound in sounds
        if sound.condition in speeds
    )
    return np.array([speed for speed, _ in rows]), np.array([level for _, level in rows])


def residuals_figure(result: CampaignCalibration) -> Figure | None:
    """Return model less level by datum; None where no more than the overall levels are there, which a table holds."""
    held = [level for level in result.calibration.levels if level.datum.what != _OVERALL]
    if not held:
        return None
    elements = []
    for slot, condition in enumerate(dict.fromkeys(level.datum.group for level in held)):
        of = [level for level in held if level.datum.group == condition]
        places = np.array([math.sqrt(lo * hi) for level in of for lo, hi in [level.datum.band_hz or (1.0, 1.0)]])
        elements.append(
            Markers(
                places,
                np.array([level.error_db for level in of]),
                say("condition {condition}", condition=condition),
                texts=[f"{level.datum.what}, {level.datum.condition.name}" for level in of],
                color=slot % 7,
            )
        )
    return Figure(
        "calibration-residuals",
        say("Calibrated model less level, by band or order"),
        say("At the centre of each band."),
        Axis(say("Frequency"), "Hz", scale="log"),
        Axis(say("Model less level"), "dB"),
        elements,
    )
