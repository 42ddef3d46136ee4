"""``[analysis]``: settings, every one with a default."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from tdacoustic.campaign.values import FrequencyBand
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
    """

    orders: Annotated[tuple[Positive, ...], AfterValidator(each_once)] = ()
    level_band_hz: FrequencyBand | None = None
    frequency_resolution_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.0
    overlap: Annotated[float, Field(ge=0.0, le=0.95)] = 0.5
    run_up_resolution_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 8.0
    line_prominence_db: Annotated[float, Field(gt=0.0, le=100.0)] = 4.0
    speed_tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.03
    mains_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 50.0
