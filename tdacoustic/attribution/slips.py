"""Several speeds of one run against each other: slip of the wheels, and tachos that count wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.fleet import Kinematics
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.quality import Verdict
from tdacoustic.speed import SpeedProfile, WheelSlip, pulses_doubt, wheel_slip

__all__ = ["RunSlip", "beside_leading", "check_tachos", "run_slips"]

Array = NDArray[np.float64]

DIFFERENT: Final = 0.05
"""Relative distance of two speeds of one shaft that is said; as in quality/run_checks."""
FEWEST: Final = 3


@dataclass(frozen=True)
class RunSlip:
    """Slip of a wheelset against the train in one run.

    Parameters
    ----------
    train_channel, shaft_channel, shaft : str
    slip : WheelSlip or None
    reason : str or None
        Why there is none.
    """

    train_channel: str
    shaft_channel: str
    shaft: str
    slip: WheelSlip | None
    reason: str | None = None


def run_slips(run: MeasuredRun, drive: Kinematics | None) -> tuple[RunSlip, ...]:
    """Return the slip between each train speed of a run and each shaft's speed that turns its wheels.

    Parameters
    ----------
    run : MeasuredRun
    drive : Kinematics or None
        With the run's own wheel diameter; without it there is no slip.
    """
    profiles = _profiles(run)
    found = []
    for train in (profile for profile in profiles if profile.si_symbol == "m/s"):
        for shaft in (profile for profile in profiles if profile.si_symbol == "1/s"):
            if drive is None or shaft.shaft not in ("motor", "wheelset"):
                continue
            turns = drive.ratio if shaft.shaft == "motor" else 1.0
            try:
                slip = wheel_slip(train, shaft, math.pi * drive.wheel_diameter_m / turns)
                found.append(RunSlip(train.channel, shaft.channel, shaft.shaft, slip))
            except AnalysisError as error:
                found.append(RunSlip(train.channel, shaft.channel, shaft.shaft, None, str(error)))
    return tuple(found)


def check_tachos(run: MeasuredRun, drive: Kinematics | None) -> tuple[Verdict, ...]:
    """Return a verdict for each channel whose speed another one, or the campaign, contradicts.

    Parameters
    ----------
    run : MeasuredRun
    drive : Kinematics or None
        By which speeds of other shafts and of the train are converted.
    """
    found = []
    for profile in _profiles(run):
        for expected, words in _expected(run, profile, drive) if profile.source != "lines" else ():
            measured, other = expected
            pulses = None if run.recording is None else run.recording[profile.channel].pulses_per_rev
            doubt = _doubt(measured, other, pulses)
            if doubt is not None:
                found.append(Verdict(profile.channel, profile.source, "warning", f"{doubt} ({words})"))
                break
    return tuple(found)


def beside_leading(run: MeasuredRun, profile: SpeedProfile, drive: Kinematics | None) -> float | None:
    """Return by how much a speed lies above the run's leading one, relative, where both are known; None else.

    Speeds of two shafts are compared by the drive's ratio, and a train's by the wheel.
    """
    leading = None if run.measurement is None else run.measurement.speed.leading
    if leading is None or leading is profile:
        return None
    both = _at_once(profile, leading, drive)
    return None if both is None or not both[1] else both[0] / both[1] - 1.0


def _profiles(run: MeasuredRun) -> tuple[SpeedProfile, ...]:
    return () if run.measurement is None else run.measurement.speed.profiles


def _expected(
    run: MeasuredRun, profile: SpeedProfile, drive: Kinematics | None
) -> Iterator[tuple[tuple[float, float], str]]:
    """Speed of a channel, the same by another source, and that source in words."""
    for rpm in (run.run.motor_speed_rpm,):
        factor = _motor_turns(profile, drive)
        if rpm and factor is not None:
            yield (_middle(profile.speed) * factor, rpm / 60.0), f"stated motor speed {rpm:g} rpm"
    km_h = run.run.train_speed_km_h
    if km_h:
        factor = _metres(profile, drive)
        if factor is not None:
            yield (_middle(profile.speed) * factor, km_h / 3.6), f"stated train speed {km_h:g} km/h"
    for other in _profiles(run):
        both = None if other is profile else _at_once(profile, other, drive)
        if both is not None:
            yield both, f"by {other.channel}"


def _middle(speed: Array) -> float:
    return float(np.median(np.abs(speed)))


def _at_once(profile: SpeedProfile, other: SpeedProfile, drive: Kinematics | None) -> tuple[float, float] | None:
    """Mean magnitudes of two speeds over the instants at which both are known, in the first one's unit."""
    factor = _between(other, profile, drive)
    if factor is None:
        return None
    beside = np.abs(other.speed_at(profile.times_s))
    both = np.isfinite(beside)
    if both.sum() < FEWEST:
        return None
    return float(np.mean(np.abs(profile.speed[both]))), float(np.mean(beside[both])) * factor


def _between(source: SpeedProfile, target: SpeedProfile, drive: Kinematics | None) -> float | None:
    """What turns the speed of one profile into that of the other's shaft; None where nobody knows."""
    if source.si_symbol == target.si_symbol and source.shaft == target.shaft:
        return 1.0
    first, second = _metres(source, drive), _metres(target, drive)
    return None if first is None or second is None else first / second


def _metres(profile: SpeedProfile, drive: Kinematics | None) -> float | None:
    """Metres of a rolling wheel per unit of a profile."""
    if profile.si_symbol == "m/s":
        return 1.0
    if drive is None or profile.shaft not in ("motor", "wheelset"):
        return None
    return math.pi * drive.wheel_diameter_m / (drive.ratio if profile.shaft == "motor" else 1.0)


def _motor_turns(profile: SpeedProfile, drive: Kinematics | None) -> float | None:
    """Turns of the motor per unit of a profile."""
    if profile.shaft == "motor":
        return 1.0
    metres = _metres(profile, drive)
    return None if metres is None or drive is None else metres * drive.motor_hz(1.0)


def _doubt(measured: float, expected: float, pulses_per_rev: float | None) -> str | None:
    if pulses_per_rev:
        return pulses_doubt(measured, expected, pulses_per_rev)
    if measured > 0.0 and expected > 0.0 and abs(measured / expected - 1.0) > DIFFERENT:
        return f"reads {measured / expected:.3g} times the speed that is expected"
    return None
