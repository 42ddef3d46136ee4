"""The speed of a run at instants, as motor speed and as train speed, as far as either is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.fleet import Kinematics
from tdacoustic.measured.runs import MeasuredRun

__all__ = ["RunSpeeds", "run_speeds", "steady_speeds"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RunSpeeds:
    """Speeds of a run at instants; magnitudes, NaN where not known.

    Parameters
    ----------
    leading : ndarray, shape (n,)
        Of the profile that decides, in its own unit.
    motor_hz, train_km_h : ndarray or None
        None where nothing tells it.
    """

    leading: Array
    motor_hz: Array | None
    train_km_h: Array | None


def run_speeds(run: MeasuredRun, drive: Kinematics | None, times_s: Array) -> RunSpeeds | None:
    """Return the speeds of a run over time; None where no channel tells one.

    Parameters
    ----------
    run : MeasuredRun
    drive : Kinematics or None
    times_s : ndarray, shape (n,)
        On the run's time axis.
    """
    profile = None if run.measurement is None else run.measurement.speed.leading
    if profile is None:
        return None
    speed = np.abs(profile.speed_at(times_s))
    motor_hz = km_h = None
    if profile.si_symbol == "m/s":
        km_h = 3.6 * speed
        motor_hz = None if drive is None else speed * drive.motor_hz(1.0)
    elif profile.shaft == "motor":
        motor_hz = speed
    elif profile.shaft == "wheelset" and drive is not None:
        motor_hz = speed * drive.ratio
    if km_h is None and motor_hz is not None and drive is not None:
        km_h = motor_hz * drive.train_speed_km_h(1.0)
    return RunSpeeds(speed, motor_hz, km_h)


def steady_speeds(run: MeasuredRun, drive: Kinematics | None) -> tuple[float | None, float | None]:
    """Return motor speed in 1/s and train speed in km/h of a steady run, stated or measured; None where not known.

    Parameters
    ----------
    run : MeasuredRun
    drive : Kinematics or None
    """
    motor_hz, km_h = run.motor_speed_hz, run.train_speed_km_h
    profile = None if run.measurement is None else run.measurement.speed.leading
    if motor_hz is None and km_h is None and profile is not None:
        found = run_speeds(run, drive, profile.times_s)
        known = None if found is None or found.motor_hz is None else found.motor_hz[np.isfinite(found.motor_hz)]
        motor_hz = float(known.mean()) if known is not None and known.size else None
    if drive is not None:
        motor_hz = drive.motor_hz_at_km_h(km_h) if motor_hz is None and km_h is not None else motor_hz
        km_h = drive.train_speed_km_h(motor_hz) if km_h is None and motor_hz is not None else km_h
    return motor_hz, km_h
