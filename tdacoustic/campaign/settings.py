"""``[analysis]``: settings, every one with a default."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from tdacoustic.campaign.values import FrequencyBand, ascending
from tdacoustic.toml_models import Positive, Table, each_once

__all__ = ["AnalysisSettings"]


class AnalysisSettings(Table):
    """``[analysis]``.

    Parameters
    ----------
    orders : tuple of float
        Orders of the motor shaft to cut besides those the fleet names.
    level_band_hz : (float, float) or None
        Default: 20 Hz to the model's upper limit, else to 0.4 of the rate.
    frequency_resolution_hz : float
        Line spacing of spectra.
    overlap : float
        Of consecutive frames, 0 to 0.95.
    run_up_resolution_hz : float
        Line spacing of a run-up, where long frames would smear its lines.
    line_prominence_db : float
        How far a line has to stand above the local floor.
    speed_tolerance : float
        A run whose speed varies by more, relative, is a run-up.
    mains_hz : float
        Of the supply whose hum is looked for.
    order_bandwidth : float
        Of a cut along an order, in orders of the order's own shaft.
    highest_order : float or None
        Of the motor shaft, up to which orders are mapped and cut. Default: half a harmonic beyond ten of the mesh, 300
        without a fleet, no more than the sampling rate holds at the run's middle speed.
    vold_kalman : bool or tuple of float
        Whether a Vold-Kalman filter tracks the strongest orders of a run-up, up to four, or the orders that it tracks.
    speed_from : str
        ``"auto"``: from speed and tacho channels; where none tells a shaft's speed and the run states none, from the
        lines that the drive's orders draw in vibration. ``"channels"``: never from lines. ``"lines"``: from lines too
        where channels tell it, for comparison.
    motor_speed_range_rpm : (float, float) or None
        Within which lines are searched for the motor's speed. Default: the fleet's speeds with a margin, else 60 to
        6000 rpm.
    motor_speed_change_rpm_s : float or None
        By how much the motor's speed changes in a second at most. Default: that of 2.5 m/s² of the train, else 480.
    calibrators : str
        ``"check"``: calibrator runs set the scale of channels of which nobody states one, and check it elsewhere.
        ``"set"``: they set it everywhere.
    sound_excerpts : bool
        Whether the report holds a few seconds of a microphone's sound for each condition. Whoever spoke near it is
        heard there.
    """

    orders: Annotated[tuple[Positive, ...], AfterValidator(each_once)] = ()
    level_band_hz: FrequencyBand | None = None
    frequency_resolution_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.0
    overlap: Annotated[float, Field(ge=0.0, le=0.95)] = 0.5
    run_up_resolution_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 8.0
    line_prominence_db: Annotated[float, Field(gt=0.0, le=100.0)] = 4.0
    speed_tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.03
    mains_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 50.0
    order_bandwidth: Annotated[float, Field(gt=0.0, le=10.0)] = 0.5
    highest_order: Annotated[float, Field(gt=1.0, le=20000.0)] | None = None
    vold_kalman: bool | Annotated[tuple[Positive, ...], AfterValidator(each_once)] = True
    speed_from: Literal["auto", "channels", "lines"] = "auto"
    motor_speed_range_rpm: Annotated[tuple[Positive, Positive], AfterValidator(ascending)] | None = None
    motor_speed_change_rpm_s: Positive | None = None
    calibrators: Literal["check", "set"] = "check"
    sound_excerpts: bool = True
