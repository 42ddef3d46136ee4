"""What the kinematics expects of a run, moved to what its sensors really show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tdacoustic.attribution.excitation import Expected, Scale, observed_scale, refined
from tdacoustic.fleet import Kinematics
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.speed import relative_excess

__all__ = ["RunKinematics", "run_kinematics"]

TACHO_ERROR = 1e-4
"""Relative error of a mean speed from a tacho, without its scatter [assumed: pulses are counted]."""
MEASURED_ERROR = 1e-3
"""The same from a speed channel [assumed: its scale]."""
SCATTER_PART = 0.15
"""Part of the speed's scatter by which the mean over a line's frames may miss the mean speed [tests/evidence: 0.11]."""
LINES_ERROR = 2.5e-4
"""The same from lines, at least [tests/evidence/tacholess_record.json: median of the rms errors of run-ups]."""
_OWN_ERRORS = {"tacho": TACHO_ERROR, "channel": MEASURED_ERROR, "lines": LINES_ERROR}
STATED_ERROR = 5e-3
"""The same of a stated train speed [assumed: the paper's mesh lines lie 0 to 1.4 % beside the calculated ones]."""
MESH_REACH = 0.016
"""How far an observed mesh is sought beside that of a stated speed [assumed, as above]."""
CARRIER_ERROR = 3e-3
CARRIER_REACH = 0.011
"""How far an inverter's carrier is sought beside the fleet's, and its error where it is not found [assumed]."""
MESH_HARMONICS = 12
"""Harmonics of a mesh that are looked for."""


@dataclass(frozen=True)
class RunKinematics:
    """Speed and mesh of a run as stated, as measured and as observed.

    Parameters
    ----------
    run : str
    motor_hz : float
        Turns of the motor per second that orders refer to.
    motor_hz_stated : float or None
        From the stated train speed and the wheel diameter.
    speed_source : str
        Where `motor_hz` comes from, in words.
    mesh_hz : float
        Mesh frequency of the first pair at the stated speed (at `motor_hz` where none is stated).
    observed_mesh_hz : float or None
        From the lines of the gearbox's sensors.
    observed_error_hz : float or None
    carrier : Scale or None
        Observed over named carrier.
    expected : tuple of Expected
    causes : str
        What an excess of the observed mesh may come from.
    train_speed_km_h : float
        That belongs to `motor_hz`.
    """

    run: str
    motor_hz: float
    motor_hz_stated: float | None
    speed_source: str
    mesh_hz: float
    observed_mesh_hz: float | None
    observed_error_hz: float | None
    carrier: Scale | None
    expected: tuple[Expected, ...]
    causes: str
    train_speed_km_h: float

    @property
    def excess(self) -> float | None:
        """Observed over calculated mesh, minus one."""
        return None if self.observed_mesh_hz is None else relative_excess(self.observed_mesh_hz, self.mesh_hz)


def run_kinematics(run: MeasuredRun, drive: Kinematics) -> RunKinematics | None:
    """Return the kinematics of a steady run, or None where its speed is not known.

    Parameters
    ----------
    run : MeasuredRun
    drive : Kinematics
        With the run's own wheel diameter where it states one.
    """
    if run.measurement is None or not run.measurement.steady or run.recording is None:
        return None
    measured, source = _measured_motor_hz(run, drive)
    stated = None if run.run.train_speed_km_h is None else drive.motor_hz_at_km_h(run.run.train_speed_km_h)
    if stated is None and run.run.motor_speed_rpm is not None:
        stated = run.run.motor_speed_rpm / 60.0
    motor_hz = measured if measured is not None else stated
    if not motor_hz:
        return None
    error = STATED_ERROR if measured is None else _measured_error(run)
    highest = max((0.5 * channel.sample_rate_hz for channel in run.recording.channels), default=1.0)
    expected = _expected(drive, motor_hz, error, highest)
    first = drive.stages[0].name
    gearbox, everywhere = _lines(run, {"gearbox"}), _lines(run, None)
    mesh_base = f"mesh {first}"
    calculated = drive.mesh_hz(stated if stated is not None else motor_hz)[first]
    at_calculated = tuple(
        item for item in _expected(drive, stated or motor_hz, STATED_ERROR, highest) if item.base == mesh_base
    )
    observed = observed_scale(*gearbox, at_calculated, MESH_REACH)
    if measured is None:
        for base in dict.fromkeys(item.base for item in expected if item.kind == "mesh"):
            expected = _moved(expected, base, gearbox, MESH_REACH)
    carrier = observed_scale(*everywhere, [item for item in expected if item.base == "carrier"], CARRIER_REACH)
    if carrier is not None:
        expected = tuple(refined([item], carrier)[0] if item.base == "carrier" else item for item in expected)
    return RunKinematics(
        run=run.name,
        motor_hz=motor_hz,
        motor_hz_stated=stated,
        speed_source=source if measured is not None else "stated speed",
        mesh_hz=calculated,
        observed_mesh_hz=None if observed is None else calculated * observed.value,
        observed_error_hz=None if observed is None else calculated * observed.value * observed.error,
        carrier=carrier,
        expected=expected,
        causes=_causes(run, observed, stated, measured),
        train_speed_km_h=drive.train_speed_km_h(motor_hz),
    )


def _measured_error(run: MeasuredRun) -> float:
    """Relative error of a measured mean speed, a part of its scatter included."""
    assert run.measurement is not None
    profile = run.measurement.speed.leading
    own = MEASURED_ERROR if profile is None else _OWN_ERRORS[profile.source]
    if profile is not None and profile.source == "lines" and profile.error is not None and profile.mean:
        # Values of neighbouring frames are not independent: what is theirs is the mean's.
        own = max(own, float(np.median(profile.error)) / abs(profile.mean))
    return own + SCATTER_PART * run.measurement.speed.scatter


def _measured_motor_hz(run: MeasuredRun, drive: Kinematics) -> tuple[float | None, str]:
    assert run.measurement is not None
    profile = run.measurement.speed.leading
    if profile is None:
        return None, ""
    mean = abs(profile.mean)  # a shaft that turns backwards has the same orders
    if profile.si_symbol == "m/s":
        return drive.motor_hz(mean), f"train speed, channel {profile.channel}"
    if profile.source == "lines":
        sure = "" if profile.confidence is None else f", confidence {float(np.median(profile.confidence)):.2f}"
        return mean, f"{profile.channel}{sure}"
    if profile.shaft == "motor":
        return mean, f"motor shaft, channel {profile.channel}"
    if profile.shaft == "wheelset":
        return drive.motor_hz_of_wheel(mean), f"wheelset, channel {profile.channel}"
    return None, ""


def _expected(drive: Kinematics, motor_hz: float, error: float, highest_hz: float) -> tuple[Expected, ...]:
    found = []
    for item in drive.excitations(motor_hz, highest_hz):
        if item.pair is not None and item.harmonic > MESH_HARMONICS:
            continue
        follows = abs(item.hz_per_motor_hz) * motor_hz * error
        stands = abs(item.frequency_hz - item.hz_per_motor_hz * motor_hz) * CARRIER_ERROR
        base = f"mesh {item.pair}" if item.pair is not None else "carrier" if item.order is None else item.kind
        found.append(Expected(item.name, item.kind, item.frequency_hz, follows + stands, base, float(item.harmonic)))
    return tuple(found)


def _lines(run: MeasuredRun, components: set[str] | None) -> tuple[list[float], list[float], list[float]]:
    """Frequencies, errors and weights of the lines of a run's sensors, of some components or all."""
    assert run.measurement is not None and run.recording is not None
    frequencies: list[float] = []
    errors: list[float] = []
    weights: list[float] = []
    for result in run.measurement.channels:
        channel = run.recording[result.channel]
        if channel.quantity not in ("acceleration", "sound_pressure") or not result.usable:
            continue
        if components is not None and channel.component not in components:
            continue
        for line in result.lines:
            frequencies.append(line.frequency_hz)
            errors.append(line.frequency_error_hz)
            weights.append(min(line.prominence_db, 20.0))
    return frequencies, errors, weights


def _moved(
    expected: Sequence[Expected], base: str, lines: tuple[list[float], list[float], list[float]], reach: float
) -> tuple[Expected, ...]:
    scale = observed_scale(*lines, [item for item in expected if item.base == base], reach)
    if scale is None:
        return tuple(expected)
    return tuple(refined([item], scale)[0] if item.base == base else item for item in expected)


def _causes(run: MeasuredRun, observed: Scale | None, stated: float | None, measured: float | None) -> str:
    """Name what may move the observed mesh from the calculated one."""
    if observed is None:
        return "no mesh line in the gearbox's sensors"
    excess = observed.value - 1.0
    if abs(excess) <= 3.0 * observed.error:
        return "as calculated, within its uncertainty"
    if stated is None or measured is None:
        by_speed = ""
    else:
        shaft = measured / stated - 1.0
        if abs(shaft - excess) <= 3.0 * observed.error + _measured_error(run):
            by_speed = f"the measured speed shows the same {100 * shaft:+.2f} %; "
        else:
            by_speed = f"the measured speed shows {100 * shaft:+.2f} % instead; "
    worn = f"a wheel diameter of {100 / observed.value:.2f} % of the stated one" if excess > 0 else "a larger wheel"
    rivals = [worn, f"a speed reading {'low' if excess > 0 else 'high'} by {100 * abs(excess):.1f} %"]
    if run.run.mode in ("traction", None) and excess > 0:
        rivals.append("creep of the driven wheel")
    elif run.run.mode in ("brake", None) and excess < 0:
        rivals.append("creep of the braked wheel")
    elif run.run.mode in ("hauled", "coast"):
        rivals.append("not creep: a hauled wheel does not run ahead")
    if abs(excess) > 0.03:
        rivals.append("another order altogether")
    return by_speed + "; ".join(rivals)
