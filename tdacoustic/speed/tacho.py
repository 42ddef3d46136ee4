"""Speed and angle of a shaft from the edges of its tacho, with what is wrong with them found, mended and said."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.angle import ShaftAngle
from tdacoustic.speed.edge_smoothing import smooth_turns
from tdacoustic.speed.jitter import bandwidth_for, smoothed_speed, smoothed_speed_error, speed_error
from tdacoustic.speed.profile import SpeedProfile
from tdacoustic.speed.stretches import Break
from tdacoustic.speed.tacho_edges import UNEVEN, MendedEdges, fits_wheel, is_better, mend_edges
from tdacoustic.speed.teeth import GapWheel, ToothPattern

__all__ = ["TachoReading", "read_tacho", "speed_from_edges"]

Array = NDArray[np.float64]

FEWEST_SAMPLES: Final = 4.0
"""Samples a pulse below which a tacho is refused [assumed]: with two a pulse its count is no longer sure."""
MENDED_LIMIT: Final = 0.2
"""Part of a tacho's pulses that may be mended before it is said to give no speed [assumed]."""
WANTED_ERROR: Final = 5e-4
"""Relative standard error beyond which the speed is smoothed [assumed]; a steady run may vary by sixty times as
much."""
LEAST_BANDWIDTH_HZ: Final = 2.0
"""What a train's speed does is slower [assumed]; torsion is faster, and lost where the speed is smoothed so far."""
GRID_S: Final = 0.05
GRID_PULSES: Final = 4.0
MOST_VALUES: Final = 20000.0
MOST_NODES: Final = 1_000_000
"""Edges of an angle that are kept; more would fill the store, and no order needs them."""
SMOOTHED_AT_ONCE, OVERLAP = 200_000, 1000
"""Edges; the overlap is five times the longest period that smoothing takes away."""


@dataclass(frozen=True)
class TachoReading:
    """What the edges of one tacho say.

    Times are in s after the tacho's first sample.

    Parameters
    ----------
    times_s, speed : ndarray, shape (n,)
        Revolutions per second; each the mean over an interval around its instant, or smoothed to `bandwidth_hz`.
    error : ndarray, shape (n,)
        Standard error of the speed, from the jitter.
    edges_s, turns : ndarray, shape (m,)
        Edges that were really there, and the angle of the shaft at each; the nodes of a `ShaftAngle`. Over a break the
        count goes on by one pulse.
    breaks : tuple of Break
    direction : str
        ``"rising"`` or ``"falling"``: the edges that were taken.
    jitter_s : float
        Standard deviation of an edge's instant; NaN where there are too few.
    bandwidth_hz : float or None
        Half-power bandwidth of the speed; None where it is not smoothed.
    missing, double : int
        Edges put in and taken out, without those of a wheel's own gap.
    pulses_per_rev : float
        Positions of the wheel that a turn has, missing teeth counted.
    wheel : GapWheel or None
    pattern : ToothPattern or None
        Where it was taken off.
    notes : tuple of str
    faults : tuple of str
        Those of the notes that say that something is wrong.
    doubtful : bool
    """

    times_s: Array
    speed: Array
    error: Array
    edges_s: Array
    turns: Array
    breaks: tuple[Break, ...]
    direction: Literal["rising", "falling"]
    jitter_s: float
    bandwidth_hz: float | None
    missing: int
    double: int
    pulses_per_rev: float
    wheel: GapWheel | None
    pattern: ToothPattern | None
    notes: tuple[str, ...]
    faults: tuple[str, ...]
    doubtful: bool

    def profile(self, name: str, shaft: str | None, start_s: float = 0.0) -> SpeedProfile:
        """Return the speed on the run's time axis, on which the tacho's first sample is at `start_s`."""
        return SpeedProfile(
            name,
            shaft,
            "1/s",
            start_s + self.times_s,
            self.speed,
            self.notes,
            self.doubtful,
            error=self.error,
            unknown=tuple((start_s + first, start_s + last, why) for first, last, why in self.unknown),
            source="tacho",
            faults=self.faults,
        )

    def angle(self, shaft: str | None, start_s: float = 0.0, name: str = "") -> ShaftAngle:
        """Return the angle on the run's time axis: through the edges, or as smooth as their scatter allows.

        Uneven teeth are taken off; it is not known where pulses break off. It is smoothed where the speed is.
        """
        breaks = tuple((item.first_s, item.last_s) for item in self.breaks if item.at == "inside")
        cuts = [int(np.searchsorted(self.edges_s, last - 1e-12)) for _, last in breaks]
        pieces = np.split(np.arange(self.edges_s.size), cuts)
        turns = self.turns
        if self.bandwidth_hz is not None and np.isfinite(self.jitter_s):
            turns = np.concatenate([_smoothed(self.edges_s[at], turns[at], self.jitter_s) for at in pieces])
        step = math.ceil(self.edges_s.size / MOST_NODES)
        kept = np.unique(np.concatenate([np.append(at[::step], at[-1:]) for at in pieces]))
        notes = self.notes if step == 1 else (*self.notes, f"every edge in {step} is kept for the angle")
        moved = tuple((start_s + first, start_s + last) for first, last in breaks)
        return ShaftAngle(start_s + self.edges_s[kept], turns[kept], shaft, None, moved, notes, name)

    @property
    def unknown(self) -> tuple[tuple[float, float, str], ...]:
        """Spans within which the speed is not known, and why."""
        return tuple((item.first_s, item.last_s, item.words) for item in self.breaks if item.kind == "lost")


def read_tacho(
    name: str,
    rising: Array,
    falling: Array | None,
    pulses_per_rev: float,
    sample_rate_hz: float,
    duration_s: float,
    bandwidth_hz: float | None = None,
) -> TachoReading:
    """Return the speed and the angle of a shaft from the edges of its tacho.

    Double edges are taken out and missing ones put in; where pulses stop, a shaft that comes to rest is told from a
    signal that is lost. Of rising and falling edges those that scatter less are taken. A wheel with a gap (60-2) is
    recognised, and uneven teeth are taken off, where `pulses_per_rev` is whole. The speed is smoothed only as far as
    its jitter asks for, or to the bandwidth that is given.

    Parameters
    ----------
    name : str
        Of the channel, for messages.
    rising, falling : ndarray
        Instants after the first sample, in s; falling None where only rising ones are known.
    pulses_per_rev : float
    sample_rate_hz : float
    duration_s : float
    bandwidth_hz : float, optional
        Smooth to this half-power bandwidth.

    Raises
    ------
    AnalysisError
        Fewer than five edges in any stretch, too much to mend, or pulses that come as fast as the samples.
    """
    if falling is not None and falling.size:
        falling = falling[falling > rising[0]] if rising.size else falling
    mended = mend_edges(rising, pulses_per_rev, duration_s)
    direction: Literal["rising", "falling"] = "rising"
    notes: list[str] = []
    if falling is not None and falling.size >= 5:
        other = mend_edges(falling, pulses_per_rev, duration_s)
        if is_better(other, mended, sample_rate_hz):
            notes.append(
                f"falling edges taken: they scatter by {_si(other.jitter_s)}, the rising ones by {_si(mended.jitter_s)}"
            )
            mended, direction = other, "falling"
    _refuse(name, mended, sample_rate_hz)
    times, speed, error, bandwidth = _speed(mended, duration_s, bandwidth_hz)
    smoothing = _smoothing(mended, error, speed, bandwidth)
    kept = [~mask for mask in mended.put_in]
    angles = _joined(mended)
    return TachoReading(
        times_s=times,
        speed=speed,
        error=error,
        edges_s=np.concatenate([piece[keep] for piece, keep in zip(mended.pieces, kept, strict=True)]),
        turns=np.concatenate([angle[keep] for angle, keep in zip(angles, kept, strict=True)]),
        breaks=mended.breaks,
        direction=direction,
        jitter_s=mended.jitter_s,
        bandwidth_hz=bandwidth,
        missing=mended.missing,
        double=mended.double,
        pulses_per_rev=mended.pulses_per_rev,
        wheel=mended.wheel,
        pattern=mended.pattern,
        notes=(_counted(mended), *notes, *mended.notes, *smoothing),
        faults=(*_faults(mended), *smoothing),
        doubtful=mended.missing + mended.double > 0
        or any(item.kind == "lost" for item in mended.breaks)
        or (mended.wheel is not None and not fits_wheel(mended.wheel, mended.pulses_per_rev)),
    )


def _smoothed(edges: Array, turns: Array, scatter_s: float) -> Array:
    """Angle of a stretch, smoothed in pieces that overlap: a long record's matrices would not fit."""
    found = np.empty(turns.size)
    for first in range(0, turns.size, SMOOTHED_AT_ONCE):
        low, high = max(0, first - OVERLAP), min(turns.size, first + SMOOTHED_AT_ONCE + OVERLAP)
        last = min(turns.size, first + SMOOTHED_AT_ONCE)
        found[first:last] = smooth_turns(edges[low:high], turns[low:high], scatter_s)[first - low : last - low]
    return found


def _refuse(name: str, mended: MendedEdges, sample_rate_hz: float) -> None:
    count = sum(piece.size for piece in mended.pieces)
    longest = max(piece.size for piece in mended.pieces)
    if longest < 5:
        raise AnalysisError(f"tacho {name!r}: {longest} tacho pulses are too few for a speed; it takes at least 5")
    if mended.missing + mended.double > MENDED_LIMIT * count:
        raise AnalysisError(
            f"tacho {name!r}: {mended.missing} pulses missing and {mended.double} double "
            f"of {count}; no speed can be had from it"
        )
    shortest = float(np.percentile(np.concatenate([np.diff(piece) for piece in mended.pieces]), 1.0))
    samples = shortest * sample_rate_hz
    if samples < FEWEST_SAMPLES:
        raise AnalysisError(
            f"tacho {name!r}: {samples:.1f} samples a pulse at {1.0 / (shortest * mended.pulses_per_rev):.4g} turns/s; "
            f"it takes at least {FEWEST_SAMPLES:g}, that is a sampling rate of {FEWEST_SAMPLES / shortest:.0f} Hz "
            f"instead of {sample_rate_hz:g} Hz, or fewer pulses a turn"
        )


def _joined(mended: MendedEdges) -> list[Array]:
    """Angles of the stretches one after the other, one pulse apart."""
    joined, start = [], 0.0
    for angle in mended.turns:
        joined.append(angle - angle[0] + start if angle.size else angle)
        start = float(joined[-1][-1]) + 1.0 / mended.pulses_per_rev if angle.size else start
    return joined


def _speed(
    mended: MendedEdges, duration_s: float, bandwidth_hz: float | None
) -> tuple[Array, Array, Array, float | None]:
    """Times, speed, its standard error, and the bandwidth where it was smoothed."""
    steps = np.concatenate([np.diff(piece) for piece in mended.pieces])
    typical = float(np.median(steps))
    interval = _interval(typical, duration_s)
    jitter = mended.jitter_s if np.isfinite(mended.jitter_s) else 0.0
    bandwidth = bandwidth_hz
    if bandwidth is None and speed_error(jitter, interval) > WANTED_ERROR:
        bandwidth = max(LEAST_BANDWIDTH_HZ, bandwidth_for(jitter, typical, WANTED_ERROR))
    # No more can be passed than a mean over the interval leaves.
    if bandwidth is not None and bandwidth_hz is None and bandwidth > 0.443 / interval:
        bandwidth = 0.443 / interval
    rows = []
    for edges, turns, mask in zip(mended.pieces, mended.turns, mended.put_in, strict=True):
        if edges.size < 2:
            continue
        kept = ~mask if mended.pattern is not None else np.ones(edges.size, dtype=bool)
        times, speed = _means(edges[kept], turns[kept], interval)
        error = np.asarray(speed * speed_error(jitter, np.full(times.size, interval)))
        if bandwidth is not None and edges.size >= 5:
            speed = smoothed_speed(edges[kept], turns[kept], bandwidth, times)
            error = speed * smoothed_speed_error(jitter, typical, bandwidth)
        rows.append((times, speed, error))
    rows += [_at_rest(item, interval, 1.0 / mended.pulses_per_rev) for item in mended.breaks if item.kind == "stands"]
    times, speed, error = (np.concatenate([row[index] for row in rows]) for index in range(3))
    order = np.argsort(times, kind="stable")
    return times[order], speed[order], error[order], bandwidth


def _at_rest(item: Break, interval: float, tooth: float) -> tuple[Array, Array, Array]:
    """Zero within a standstill, known but for less than a tooth."""
    length = item.last_s - item.first_s
    count = max(1, int(length / interval))
    times = item.first_s + (np.arange(count) + 0.5) * length / count
    return times, np.zeros(count), np.full(count, tooth / length)


def _interval(typical_s: float, duration_s: float) -> float:
    return max(GRID_S, GRID_PULSES * typical_s, duration_s / MOST_VALUES)


def _means(edges: Array, turns: Array, interval: float) -> tuple[Array, Array]:
    count = max(1, int((edges[-1] - edges[0]) / interval))
    grid = np.linspace(edges[0], edges[-1], count + 1)
    return 0.5 * (grid[1:] + grid[:-1]), np.diff(np.interp(grid, edges, turns)) / np.diff(grid)


def _counted(mended: MendedEdges) -> str:
    words = f"{sum(piece.size for piece in mended.pieces)} pulses, {mended.pulses_per_rev:g} per revolution"
    if mended.missing + mended.double:
        words += f"; {mended.missing} missing put in, {mended.double} double taken out"
    return words


def _faults(mended: MendedEdges) -> list[str]:
    """Notes that say that something is wrong."""
    found = [_counted(mended)] if mended.missing + mended.double else []
    lost = {item.words for item in mended.breaks if item.kind == "lost"}
    misfit = mended.wheel is not None and not fits_wheel(mended.wheel, mended.pulses_per_rev)
    return found + [
        note
        for note in mended.notes
        if note in lost or note.startswith(UNEVEN) or (misfit and "missing by design" in note)
    ]


def _smoothing(mended: MendedEdges, error: Array, speed: Array, bandwidth: float | None) -> list[str]:
    if bandwidth is None:
        return []
    turning = speed > 0.0
    part = float(np.median(error[turning] / speed[turning])) if turning.any() else float("nan")
    return [
        f"edges scatter by {_si(mended.jitter_s)}; the speed is smoothed to {bandwidth:.2g} Hz (half power), "
        f"its standard error is {100.0 * part:.2g} %"
    ]


def _si(seconds: float) -> str:
    return f"{1e6 * seconds:.3g} us"


def speed_from_edges(edges: Array, pulses_per_rev: float, duration_s: float) -> tuple[Array, Array]:
    """Return the speed of a shaft over time.

    The angle between edges is interpolated on a grid of at least four pulses
    (and 50 ms) and differentiated, so that a value is the mean over its interval.

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Instants in s.
    pulses_per_rev : float
    duration_s : float
        Length of the record; bounds the number of values.

    Returns
    -------
    times_s, speed : ndarray
        Middle of each interval, and revolutions per second.

    Raises
    ------
    AnalysisError
        Fewer than five edges.
    """
    if edges.size < 5:
        raise AnalysisError(f"{edges.size} tacho pulses are too few for a speed; it takes at least 5")
    interval = _interval(float(np.median(np.diff(edges))), duration_s)
    return _means(edges, np.arange(edges.size) / pulses_per_rev, interval)
