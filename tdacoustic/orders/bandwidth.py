"""Which bandwidth a Vold-Kalman filter should have, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from tdacoustic.errors import AnalysisError
from tdacoustic.orders.envelope_splines import HALF_POWER
from tdacoustic.speed.angle import ShaftAngle

__all__ = ["BandwidthAdvice", "advise_bandwidth"]

LOSS_FACTOR: Final = 0.02
"""Of the narrowest resonance whose passing is to be followed (assumed: steel and cast housings have 0.01 to 0.05)."""
FOLLOWING: Final = 1.5
"""Bandwidth over the inverse of the time in a resonance's half-power width: its peak is then 0.2 dB low by 2 poles."""
REJECTION: Final = 100.0
"""By which an order that is not tracked jointly is to be kept out: 40 dB."""
JOINT_SPACING: Final = 2.0
"""Spacing over bandwidth from which on jointly tracked orders do not disturb each other."""
CROSSING_SHARE: Final = 0.1
"""Part of the time for which orders may be nearer than that; then they cross, and the joint solution separates them."""
INDEPENDENT: Final = 4.0
"""Independent values that a record should give at least."""


@dataclass(frozen=True)
class BandwidthAdvice:
    """An advised bandwidth and what bounds it.

    Parameters
    ----------
    bandwidth_hz : float
    following_hz : float
        What following a resonance at this sweep rate takes.
    separating_hz : float
        What keeps the nearest other order out; infinite without one.
    shortest_hz : float
        What the length of the record allows.
    notes : tuple of str
        Where not all can be had.
    """

    bandwidth_hz: float
    following_hz: float
    separating_hz: float
    shortest_hz: float
    notes: tuple[str, ...]


def advise_bandwidth(
    angle: ShaftAngle,
    order: float,
    others: Sequence[tuple[ShaftAngle, float]] = (),
    poles: int = 2,
    joint: bool = True,
    loss_factor: float = LOSS_FACTOR,
) -> BandwidthAdvice:
    """Return the bandwidth for one order.

    It is as wide as following asks for, within what separation and the length of the record allow:

    - following: a resonance of half-power width η f is passed in η n / (dn/dt) seconds at speed n, whichever the order;
      1.5 over that (the 95th percentile of |dn/dt| / n counts);
    - separation: the spacing to the nearest other order (its 10th percentile over time, so that a crossing does not
      count) over 2 where all are tracked jointly, or over what keeps it 40 dB down where it is not tracked: 15.5, 3.9
      and 2.5 for 1, 2 and 3 poles;
    - length: four independent values at least.

    Parameters
    ----------
    angle : ShaftAngle
    order : float
    others : sequence of (ShaftAngle, float)
        Orders that may come near.
    poles : {1, 2, 3}
    joint : bool
        Whether the others are tracked jointly with this one.
    loss_factor : float
        Of the narrowest resonance to be followed.

    Raises
    ------
    AnalysisError
        A loss factor that is not above zero.

    Examples
    --------
    >>> times = np.linspace(0.0, 60.0, 601)
    >>> run_up = ShaftAngle(times, 10.0 * times + 0.25 * times**2)
    >>> advice = advise_bandwidth(run_up, 20.0, [(run_up, 21.0)])
    >>> round(advice.following_hz, 2), round(advice.separating_hz, 2), round(advice.bandwidth_hz, 2)
    (3.26, 6.5, 3.26)
    """
    if not loss_factor > 0.0:
        raise AnalysisError(f"loss_factor must be > 0, got {loss_factor}")
    times = np.linspace(angle.first_s, angle.last_s, 1001)
    speed = angle.speed_hz_at(times)
    moving = np.isfinite(speed) & (speed > 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = np.abs(np.gradient(speed, times)) / speed
    rate = rate[moving & np.isfinite(rate)]
    following = FOLLOWING * float(np.percentile(rate, 95.0)) / loss_factor if rate.size else 0.0
    factor = JOINT_SPACING if joint else (REJECTION / HALF_POWER) ** (0.5 / poles)
    spacing = math.inf
    notes = []
    for other_angle, other in others:
        apart = np.abs(other * other_angle.speed_hz_at(times) - order * speed)
        apart = apart[np.isfinite(apart)]
        if not apart.size:
            continue
        near = float(np.percentile(apart, 100.0 * CROSSING_SHARE))
        spacing = min(spacing, near)
        if float(np.min(apart)) < 0.5 * near:
            notes.append(f"crosses order {other:g} of {other_angle.shaft or 'another shaft'}: track them jointly")
    separating = spacing / factor
    shortest = INDEPENDENT / (angle.last_s - angle.first_s)
    bandwidth = min(max(following, shortest), separating)
    if following > separating:
        notes.append(
            f"a resonance of loss factor {loss_factor:g} asks for {following:.3g} Hz, the nearest order allows "
            f"{separating:.3g} Hz: peaks are rounded"
        )
    if separating < shortest:
        notes.append(
            f"the record is too short to keep the nearest order out: {INDEPENDENT / separating:.3g} s would do"
        )
    return BandwidthAdvice(bandwidth, following, separating, shortest, tuple(notes))
