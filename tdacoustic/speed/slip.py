"""How far the wheels run ahead of the train or behind it, over time, and what a wrong tooth count looks like."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, overload

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.profile import SpeedProfile

__all__ = ["SlipEvent", "WheelSlip", "pulses_doubt", "relative_excess", "wheel_slip"]

Array = NDArray[np.float64]

LEAST_M_S: Final = 1.0
"""Train speed below which a relative slip means nothing [assumed]."""
EVENT: Final = 0.02
"""Slip beside the run's usual one from which adhesion is lost [assumed: creep of a wheel that holds stays below 1 to 2
%]."""
SHORTEST_S: Final = 0.3
"""Shortest loss of adhesion [assumed]."""
SPEED_TOLERANCE: Final = 0.05
"""Relative distance of two speeds of one shaft from which a wrong tooth count is thought of; as in
quality/run_checks."""
PULSES_TOLERANCE: Final = 0.02
"""How near to a whole number of pulses it must then come [assumed: slip and wear]."""
FEW_PULSES: Final = 25.0
"""Up to here whole numbers lie further apart than that tolerance."""


@overload
def relative_excess(observed: float, calculated: float) -> float: ...
@overload
def relative_excess(observed: Array, calculated: Array) -> Array: ...
def relative_excess(observed: float | Array, calculated: float | Array) -> float | Array:
    """Return observed over calculated, minus one: the mesh excess of frequencies, the slip of speeds.

    The mesh that is calculated from a train speed V has the frequency that belongs to a wheel that rolls at V; the one
    observed belongs to the wheel as it turns. So the excess of a steady run's mesh is the mean of the slip (v_wheel -
    V)/V over the run, as long as wheel diameter and V are right; where they are not, both are off by the same part.

    Examples
    --------
    >>> round(relative_excess(176.72, 174.97), 4)
    0.01
    """
    return observed / calculated - 1.0


@dataclass(frozen=True)
class SlipEvent:
    """A loss of adhesion.

    Parameters
    ----------
    kind : str
        ``"slip"``: the wheel runs ahead; ``"slide"``: it falls behind.
    first_s, last_s : float
    peak : float
        Largest slip beside the usual one, with its sign.
    """

    kind: Literal["slip", "slide"]
    first_s: float
    last_s: float
    peak: float


@dataclass(frozen=True)
class WheelSlip:
    """Slip over time, where it is known.

    Parameters
    ----------
    times_s, slip : ndarray, shape (n,)
        (v_wheel - v_train) / v_train at the instants of the shaft's speed at which both are known and the train moves.
    error : ndarray, shape (n,), or None
        Its standard error from those of the two speeds; None where neither is known.
    usual : float
        Median of the slip. A worn wheel, a scale of either speed and creep look alike in it.
    events : tuple of SlipEvent
    like_delay_s : float
        Delay of the train speed that would explain what of the slip follows the acceleration; creep does so too. NaN
        where the train does not accelerate.
    notes : tuple of str
    """

    times_s: Array
    slip: Array
    error: Array | None
    usual: float
    events: tuple[SlipEvent, ...]
    like_delay_s: float
    notes: tuple[str, ...]


def wheel_slip(train: SpeedProfile, shaft: SpeedProfile, metres_per_turn: float) -> WheelSlip:
    """Return the slip of a wheelset against the train.

    Parameters
    ----------
    train : SpeedProfile
        In m/s (GPS, radar, an axle that is neither driven nor braked).
    shaft : SpeedProfile
        In turns/s, of the wheelset or of the motor that drives it.
    metres_per_turn : float
        Way of a rolling wheel for one turn of that shaft: π D, over the ratio for the motor.

    Raises
    ------
    AnalysisError
        Units other than these, or no instant at which both speeds are known and the train moves.
    """
    if train.si_symbol != "m/s" or shaft.si_symbol != "1/s":
        raise AnalysisError(
            f"slip needs a train speed in m/s and a shaft's in 1/s, got {train.channel!r} in {train.si_symbol} "
            f"and {shaft.channel!r} in {shaft.si_symbol}"
        )
    rolling = np.abs(train.speed_at(shaft.times_s))
    moves = np.isfinite(rolling) & (rolling >= LEAST_M_S)
    if not moves.any():
        raise AnalysisError(
            f"no slip between {train.channel!r} and {shaft.channel!r}: at no instant are both known and the train "
            f"faster than {LEAST_M_S:g} m/s"
        )
    times, rolling = shaft.times_s[moves], rolling[moves]
    slip = relative_excess(np.abs(shaft.speed[moves]) * metres_per_turn, rolling)
    usual = float(np.median(slip))
    left_out = float(np.mean(~moves))
    notes = []
    if left_out > 0.0:
        notes.append(
            f"{100.0 * left_out:.2g} % of the values left out: the train slower than {LEAST_M_S:g} m/s, or not known"
        )
    step = float(np.median(np.diff(train.times_s))) if train.times_s.size > 1 else 0.0
    if step > SHORTEST_S:
        notes.append(f"the train speed has a value each {step:.2g} s; what is shorter does not show")
    return WheelSlip(
        times_s=times,
        slip=slip,
        error=_error(train, shaft, times, rolling, moves, metres_per_turn),
        usual=usual,
        events=_events(times, slip - usual),
        like_delay_s=_like_delay(times, slip - usual, rolling),
        notes=tuple(notes),
    )


def _error(
    train: SpeedProfile,
    shaft: SpeedProfile,
    times: Array,
    rolling: Array,
    moves: NDArray[np.bool_],
    metres_per_turn: float,
) -> Array | None:
    if train.error is None and shaft.error is None:
        return None
    total = np.zeros(times.size)
    if train.error is not None:
        total = total + np.interp(times, train.times_s, train.error) ** 2
    if shaft.error is not None:
        total = total + (shaft.error[moves] * metres_per_turn) ** 2
    return np.asarray(np.sqrt(total) / rolling)


def _events(times: Array, beside: Array) -> tuple[SlipEvent, ...]:
    """Spans in which the slip keeps away from the usual one for long enough."""
    found = []
    for way, kind in ((1.0, "slip"), (-1.0, "slide")):
        labels, count = ndimage.label(way * beside > EVENT)
        for index in range(1, count + 1):
            inside = np.flatnonzero(labels == index)
            first, last = float(times[inside[0]]), float(times[inside[-1]])
            if last - first >= SHORTEST_S:
                peak = float(way * np.max(way * beside[inside]))
                found.append(SlipEvent("slip" if kind == "slip" else "slide", first, last, peak))
    return tuple(sorted(found, key=lambda event: event.first_s))


def _like_delay(times: Array, beside: Array, rolling: Array) -> float:
    """A speed that is read a time τ late is low by a τ, and the slip high by a τ / v; τ by least squares."""
    if times.size < 10:
        return math.nan
    push = np.gradient(rolling, times) / rolling
    calm = np.abs(beside) <= EVENT
    power = float(np.sum(push[calm] ** 2))
    if not math.sqrt(power / max(int(calm.sum()), 1)) > 1e-3:
        return math.nan
    return float(np.sum(push[calm] * beside[calm]) / power)


def pulses_doubt(measured: float, expected: float, pulses_per_rev: float) -> str | None:
    """Return a sentence where a tacho's speed and another one suggest a wrong number of pulses, else None.

    Parameters
    ----------
    measured : float
        Speed by the tacho.
    expected : float
        Of the same shaft, from the train speed or the campaign; same unit.
    pulses_per_rev : float
        That the tacho was read with.

    Examples
    --------
    >>> pulses_doubt(40.1, 20.0, 60)
    'reads 2 times the speed that is expected: pulses_per_rev = 120 would fit, not 60'
    >>> pulses_doubt(20.4, 20.0, 60) is None
    True
    """
    if not (measured > 0.0 and expected > 0.0) or abs(measured / expected - 1.0) <= SPEED_TOLERANCE:
        return None
    ratio = measured / expected
    fits = [pulses_per_rev * factor for k in (2, 3, 4, 5) for factor in (float(k), 1.0 / k)]
    if pulses_per_rev * ratio <= FEW_PULSES:
        fits.append(float(max(1, round(pulses_per_rev * ratio))))
    near = [count for count in fits if abs(pulses_per_rev * ratio / count - 1.0) <= PULSES_TOLERANCE]
    words = f"reads {ratio:.3g} times the speed that is expected"
    if not near:
        return f"{words}; no number of pulses near {pulses_per_rev:g} explains it"
    best = min(near, key=lambda count: abs(pulses_per_rev * ratio / count - 1.0))
    return f"{words}: pulses_per_rev = {best:g} would fit, not {pulses_per_rev:g}"
