"""Levels that a model is held against."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Final, Literal

from tdacoustic.drive import Condition, Receiver
from tdacoustic.errors import FittingError

__all__ = ["LEVELS_OF_CALIBRATION", "OFFSET", "MeasuredLevel", "fingerprint", "offset_name"]

LEVELS_OF_CALIBRATION: Final = "levels_of_calibration"
"""Key in ``[meta]`` of a calibrated fleet: fingerprints of the levels that it was calibrated to."""

OFFSET: Final = "level_offset_db"
SMALLEST_SIGMA_DB: Final = 1e-3


def fingerprint(datum: MeasuredLevel) -> str:
    """Return a short hash of what was measured, where and at which speed and torque; names do not count."""
    state = f"{datum.condition.motor_hz:.6g} {datum.condition.torque_n_m:.6g}"
    place = f"{datum.receiver.distance_m:.6g} {datum.receiver.position_m}"
    text = f"{state} {place} {datum.what} {datum.weighting} {datum.level_db:.6g}"
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def offset_name(campaign: str) -> str:
    """Return the name of the parameter that adds to all levels of a campaign."""
    return f"{OFFSET}[{campaign}]"


@dataclass(frozen=True)
class MeasuredLevel:
    """A level that the model is held against.

    Parameters
    ----------
    condition : Condition
    receiver : Receiver
    level_db : float
    sigma_db : float
        One standard deviation of the measurement, at least 0.001.
    weighting : {"Z", "A"}
    origin : {"measured", "synthetic", "printed"}
    source : str
        Where it comes from, in words.
    what : str
        ``"overall"``, or the part of the sound it is of, in words: ``"1/3 octave 1000 Hz"``.
    band_hz : (float, float), optional
        Only lines of the model in this band count.
    group : str
        Condition of the campaign that it is left out with. Default: the condition's name.
    campaign : str
        Where several are fitted together.

    Raises
    ------
    FittingError
        A level that is no number, or a standard deviation that is not above zero.
    """

    condition: Condition
    receiver: Receiver
    level_db: float
    sigma_db: float
    weighting: Literal["Z", "A"]
    origin: str
    source: str
    what: str = "overall"
    band_hz: tuple[float, float] | None = None
    group: str = ""
    campaign: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sigma_db) and self.sigma_db >= SMALLEST_SIGMA_DB):
            raise FittingError(
                f"condition {self.condition.name}: the level's standard deviation must be > 0 dB "
                f"(at least {SMALLEST_SIGMA_DB:g}), got {self.sigma_db!r}"
            )
        if not math.isfinite(self.level_db):
            raise FittingError(f"condition {self.condition.name}: the level must be a number, got {self.level_db!r}")
        object.__setattr__(self, "group", self.group or self.condition.name)

    @property
    def place(self) -> tuple[object, ...]:
        """What the model needs to know of it."""
        return self.condition, self.receiver, self.weighting, self.band_hz, self.campaign

    def hears(self, frequency_hz: float) -> bool:
        """Whether a line of this frequency is part of it."""
        return self.band_hz is None or self.band_hz[0] <= frequency_hz < self.band_hz[1]
