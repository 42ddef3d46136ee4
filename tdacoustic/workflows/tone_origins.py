"""Whose tone is it: known noise lines first, then what the kinematics expects, else nobody's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tdacoustic.attribution import RunKinematics, SourceLine
    from tdacoustic.fleet import Kinematics
    from tdacoustic.measured.tonality import SpeedSpan
    from tdacoustic.speed import SpeedProfile
    from tdacoustic.tones import ExpectedTone, ToneLabel
    from tdacoustic.tones.label import ToneLike

__all__ = [
    "NOBODY",
    "SpeedOverTime",
    "Stretch",
    "ToneOrigin",
    "expected_at",
    "expected_in_run",
    "known_origin",
    "origin",
]

SIGMAS: Final = 3.0
"""Standard deviations of both within which a tone is a known noise line."""
CARRIER_ERROR: Final = 3e-3
MEASURED_ERROR: Final = 1e-3
"""Relative errors of a carrier and of a measured speed [assumed; as `attribution.kinematic`]."""
KNOWN_SHARE: Final = 0.8
"""Part of a spectrum's time over which the speed must be known for the spectrum to have one [assumed]."""
MESH_HARMONICS: Final = 12
"""Harmonics of a mesh that are named; as `attribution.kinematic`."""


@dataclass(frozen=True)
class ToneOrigin:
    """Excitation and owner of a tone, in the words of ``sources.csv``, and what is doubtful about them."""

    excitation: str
    owner: str
    notes: tuple[str, ...] = ()


NOBODY: Final = ToneOrigin("unknown", "unassigned")


# ---------------------------------------------------------------- steady runs


def known_origin(
    tone: ToneLike, channel: str, run: str, sources: Sequence[SourceLine], spacing_hz: float
) -> ToneOrigin | None:
    """Return the origin of a tone that is a noise line whose source was judged, or None.

    The channel's own lines go first; those of the run's other receivers speak where they agree.

    Parameters
    ----------
    tone : ToneLike
    channel, run : str
    sources : sequence of SourceLine
        Of the run's condition.
    spacing_hz : float
        Distance of the lines of the spectrum that shows the tone: a line within half of it is the same.
    """
    found: list[tuple[float, SourceLine]] = []
    for source in sources:
        for name, evidence in source.line.members:
            line = evidence.line
            error_hz = math.hypot(line.frequency_error_hz, tone.frequency_error_hz)
            distance = abs(line.frequency_hz - tone.frequency_hz)
            if name == run and distance <= max(0.5 * spacing_hz, SIGMAS * error_hz):
                found.append((distance, source))
    own = sorted((entry for entry in found if entry[1].line.channel == channel), key=lambda entry: entry[0])
    if own:
        return _of_source(own[0][1])
    others = {(_of_source(source).excitation, source.source) for _, source in found}
    return _of_source(found[0][1]) if len(others) == 1 else None


def _of_source(source: SourceLine) -> ToneOrigin:
    notes = ("sensor and order disagree",) if source.conflict else ()
    return ToneOrigin(source.excitation_name or source.excitation, source.source, notes)


def expected_in_run(kinematics: RunKinematics | None) -> tuple[ExpectedTone, ...]:
    """Return what is expected of a steady run, moved to what its sensors show."""
    from tdacoustic.tones import ExpectedTone

    if kinematics is None:
        return ()
    return tuple(
        ExpectedTone(item.name, item.kind, item.frequency_hz, item.error_hz, item.harmonic)
        for item in kinematics.expected
    )


def origin(label: ToneLabel) -> ToneOrigin:
    """Return the origin that a label says, in the words of ``sources.csv``."""
    if label.excitation is None:
        return NOBODY
    if label.ambiguous:
        return ToneOrigin(label.excitation, "ambiguous", (f"or {', '.join(label.also)}",))
    return ToneOrigin(label.excitation, label.owner or "unassigned")


# ---------------------------------------------------------------- run-ups


@dataclass(frozen=True)
class Stretch:
    """Speed within the time of one short-time spectrum.

    Parameters
    ----------
    low, high : float
        In the unit of `SpeedOverTime.unit`.
    motor_hz, motor_hz_error : float or None
        Mean turns of the motor per second, and one standard deviation of it and within the stretch; None where the
        motor's speed does not follow from the channel.
    """

    low: float
    high: float
    motor_hz: float | None
    motor_hz_error: float | None

    @property
    def mean(self) -> float:
        """Middle of the stretch's speeds."""
        return 0.5 * (self.low + self.high)

    @property
    def change(self) -> float:
        """Relative change of the speed within the stretch."""
        return (self.high - self.low) / self.mean if self.mean > 0.0 else 0.0


class SpeedOverTime:
    """The speed of a run-up as its tones are told by: train speed where a fleet knows it, else the shaft's.

    Parameters
    ----------
    profile : SpeedProfile
        The leading one.
    drive : Kinematics or None
    """

    def __init__(self, profile: SpeedProfile, drive: Kinematics | None) -> None:
        self._profile = profile
        self._drive = drive
        by_train = profile.si_symbol == "m/s" or (drive is not None and self._motor(1.0) is not None)
        self.unit = "km/h" if by_train else "rpm"

    def _motor(self, speed: float) -> float | None:
        """Turns of the motor per second at a speed of the profile."""
        shaft, drive = self._profile.shaft, self._drive
        if self._profile.si_symbol == "1/s" and shaft == "motor":
            return speed
        if drive is None:
            return None
        if self._profile.si_symbol == "m/s":
            return drive.motor_hz(speed)
        return drive.motor_hz_of_wheel(speed) if shaft == "wheelset" else None

    def _shown(self, speed: float) -> float:
        if self._profile.si_symbol == "m/s":
            return 3.6 * speed
        motor_hz = self._motor(speed)
        if self.unit == "km/h" and self._drive is not None and motor_hz is not None:
            return self._drive.train_speed_km_h(motor_hz)
        return 60.0 * speed

    def stretch(self, start_s: float, end_s: float) -> Stretch | None:
        """Return the speed between two instants of the run; None where too little of it is known."""
        told = np.abs(self._profile.speed_at(np.linspace(start_s, end_s, 61)))
        speeds: NDArray[np.float64] = told[np.isfinite(told)]
        if speeds.size < KNOWN_SHARE * told.size:
            return None
        low, high, mean = float(speeds.min()), float(speeds.max()), float(speeds.mean())
        motor_hz = self._motor(mean)
        error = None
        if motor_hz is not None and mean > 0.0:
            error = motor_hz * math.hypot(float(speeds.std()) / mean, MEASURED_ERROR)
        return Stretch(self._shown(low), self._shown(high), motor_hz, error)

    def span(self, stretches: Sequence[Stretch]) -> SpeedSpan:
        """Return the speeds between which stretches lie."""
        from tdacoustic.measured.tonality import SpeedSpan

        return SpeedSpan(min(s.low for s in stretches), max(s.high for s in stretches), self.unit)


def expected_at(drive: Kinematics | None, stretch: Stretch, highest_hz: float) -> tuple[ExpectedTone, ...]:
    """Return what is expected within a stretch of a run-up; nothing without a fleet or a motor's speed."""
    from tdacoustic.tones import expected_tones

    if drive is None or not stretch.motor_hz or stretch.motor_hz_error is None:
        return ()
    held = drive.excitations(stretch.motor_hz, highest_hz)
    named = [item for item in held if item.pair is None or item.harmonic <= MESH_HARMONICS]
    return expected_tones(named, stretch.motor_hz, stretch.motor_hz_error, CARRIER_ERROR)
