"""The angle of a shaft over time: what orders are counted along."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.edge_smoothing import smooth_turns
from tdacoustic.speed.profile import STANDSTILL, SpeedProfile

__all__ = ["ShaftAngle"]

Array = NDArray[np.float64]

BREAK_ABOVE: Final = 4.0
"""An interval longer than this multiple of both its neighbours is a break (assumed). The first of a run-up from
standstill, 2.4 times its neighbour, is none."""
NEWTON_STEPS: Final = 60


@dataclass(frozen=True)
class ShaftAngle:
    """Turns of a shaft over time, a piecewise cubic through nodes; not known outside of them and in breaks.

    Between nodes it is the cubic of Hermite with the slopes of the parabola through three neighbouring nodes, held
    monotone (F. N. Fritsch, R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238). It is exact for a constant
    acceleration. A jerk J (turns/s³) leaves an error of at most 0.016 J h³ turns over node intervals h. Scatter of the
    nodes stays where it is: independent errors of rms e give at most e in the angle (0.80 e between nodes), and
    0.71 e/h to 1.95 e/h in the speed.

    Parameters
    ----------
    times_s : ndarray, shape (n,)
        Nodes on the run's time axis, increasing; at least 3.
    turns : ndarray, shape (n,)
        Angle at the nodes in turns, increasing; 0 is the first pulse of a tacho, or the start of a profile.
    shaft : str or None
        ``motor``, ``wheelset``, ...
    speeds_hz : ndarray, shape (n,), or None
        Turns per second at the nodes where they are known; else they are taken from the angle.
    breaks : tuple of (float, float)
        From node to node in s: the angle is not known between (standstill, reversal, a silent tacho). The count of
        turns over a break is nominal, so a phase is comparable within one stretch alone.
    notes : tuple of str
        What is odd about it, one sentence each.
    channel : str
        Where it comes from.

    Raises
    ------
    AnalysisError
        Fewer than 3 nodes, or nodes that do not increase.

    Examples
    --------
    >>> angle = ShaftAngle.from_edges([0.0, 0.1, 0.2, 0.3], pulses_per_rev=2)
    >>> angle.turns_at([0.05, 0.5]), float(angle.times_at(1.25))
    (array([0.25,  nan]), 0.25)
    """

    times_s: Array
    turns: Array
    shaft: str | None = None
    speeds_hz: Array | None = None
    breaks: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = ()
    channel: str = ""

    def __post_init__(self) -> None:
        times, turns = (np.array(values, dtype=np.float64) for values in (self.times_s, self.turns))
        name = f"the angle of {self.shaft or 'a shaft'}"
        if times.ndim != 1 or times.shape != turns.shape or times.size < 3:
            raise AnalysisError(f"{name} needs at least 3 nodes of time and turns, got {times.shape}, {turns.shape}")
        if not (np.isfinite(times).all() and np.isfinite(turns).all()):
            raise AnalysisError(f"{name} has nodes that are no numbers")
        broken = np.zeros(times.size - 1, dtype=bool)
        for first, last in self.breaks:
            broken |= (times[:-1] >= first - 1e-12) & (times[1:] <= last + 1e-12)
        still = (np.diff(times) <= 0.0) | ((np.diff(turns) <= 0.0) & ~broken)
        if still.any():
            at = int(np.flatnonzero(still)[0])
            raise AnalysisError(
                f"{name} must increase: turns {turns[at]:.6g} at {times[at]:.6g} s, "
                f"then {turns[at + 1]:.6g} at {times[at + 1]:.6g} s"
            )
        speeds = None if self.speeds_hz is None else np.array(self.speeds_hz, dtype=np.float64)
        if speeds is not None and (speeds.shape != times.shape or not np.isfinite(speeds).all()):
            raise AnalysisError(f"{name} needs one finite speed a node, got {speeds.shape} for {times.size} nodes")
        slopes = _slopes(times, turns, broken, speeds)
        for field, values in (("times_s", times), ("turns", turns), ("speeds_hz", slopes)):
            values.setflags(write=False)
            object.__setattr__(self, field, values)

    @classmethod
    def from_edges(
        cls,
        edges_s: ArrayLike,
        pulses_per_rev: float,
        shaft: str | None = None,
        edge_scatter_s: float = 0.0,
    ) -> ShaftAngle:
        """Return the angle from the instants of tacho edges, 1 / `pulses_per_rev` of a turn apart.

        Parameters
        ----------
        edges_s : array_like, shape (n,)
            Increasing; clean of double and missing edges.
        pulses_per_rev : float
        shaft : str or None
        edge_scatter_s : float
            Standard deviation of an edge's instant where it is known: the angle is then smoothed until it passes the
            edges by that much (see `smooth_turns`). 0 takes each edge for true.

        Raises
        ------
        AnalysisError
            Fewer than 3 edges, or edges that do not increase.
        """
        edges = np.asarray(edges_s, dtype=np.float64)
        if not pulses_per_rev > 0.0:
            raise AnalysisError(f"pulses_per_rev must be > 0, got {pulses_per_rev}")
        if edges.ndim != 1 or edges.size < 3:
            raise AnalysisError(f"{edges.size} tacho edges are too few for an angle; it takes at least 3")
        turns = np.arange(edges.size) / pulses_per_rev
        gaps = _gaps(edges)
        breaks = tuple((float(edges[gap]), float(edges[gap + 1])) for gap in gaps)
        notes = tuple(f"no tacho edge from {first:.3f} s to {last:.3f} s" for first, last in breaks)
        if edge_scatter_s > 0.0:
            pieces = np.split(np.arange(edges.size), gaps + 1)
            turns = np.concatenate([smooth_turns(edges[piece], turns[piece], edge_scatter_s) for piece in pieces])
            notes = (*notes, f"edges smoothed by their scatter of {edge_scatter_s:.3g} s")
        return cls(edges, turns, shaft, None, breaks, notes)

    @classmethod
    def from_profile(
        cls,
        profile: SpeedProfile,
        turns_per_unit: float = 1.0,
        shaft: str | None = None,
        lowest_hz: float = STANDSTILL["1/s"],
    ) -> ShaftAngle:
        """Return the angle as the integral of a speed that is linear between its instants.

        Stretches that turn more slowly than `lowest_hz`, or whose speed is not known, are breaks; those that turn
        backwards are counted upwards, and a note says so. The count starts at 0: it has no mark on the shaft, and
        phases are relative.

        Parameters
        ----------
        profile : SpeedProfile
        turns_per_unit : float
            Turns of the shaft per turn (or metre) of the profile: a ratio, or 1/(π D) for a train speed.
        shaft : str or None
            The profile's where None.
        lowest_hz : float
            Of the shaft (default: `STANDSTILL`, assumed).

        Raises
        ------
        AnalysisError
            Nowhere as fast, or fewer than 3 instants.
        """
        times = np.asarray(profile.times_s, dtype=np.float64)
        speed = np.asarray(profile.speed, dtype=np.float64) * turns_per_unit
        if times.size < 3:
            raise AnalysisError(f"channel {profile.channel!r}: {times.size} speeds are too few for an angle")
        if profile.si_symbol != "1/s" and turns_per_unit == 1.0:
            raise AnalysisError(
                f"channel {profile.channel!r} is a speed in {profile.si_symbol}; an angle needs turns_per_unit"
            )
        stretches = [piece for piece in _turning(speed, lowest_hz, _after_unknown(profile)) if piece.size >= 2]
        if not stretches:
            raise AnalysisError(f"channel {profile.channel!r}: the shaft never turns by {lowest_hz:g} Hz or more")
        backwards = [piece for piece in stretches if speed[piece[0]] < 0.0]
        kept = np.concatenate(stretches)
        times, speed = times[kept], np.abs(speed[kept])
        turns = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(times))))
        ends = np.cumsum([piece.size for piece in stretches])[:-1]
        breaks = tuple((float(times[end - 1]), float(times[end])) for end in ends)
        notes = tuple(
            f"below {lowest_hz:g} Hz, turning round or not known from {first:.3f} s to {last:.3f} s"
            for first, last in breaks
        ) + tuple(
            f"turns backwards from {profile.times_s[piece[0]]:.3f} s to {profile.times_s[piece[-1]]:.3f} s"
            for piece in backwards
        )
        return cls(times, turns, shaft or profile.shaft, speed, breaks, (*profile.notes, *notes), profile.channel)

    @property
    def first_s(self) -> float:
        """Instant from which on the angle is known."""
        return float(self.times_s[0])

    @property
    def last_s(self) -> float:
        """Instant up to which the angle is known."""
        return float(self.times_s[-1])

    @property
    def slopes_hz(self) -> Array:
        """Speed at the nodes, shape (n,)."""
        assert self.speeds_hz is not None  # set on construction
        return self.speeds_hz

    def at_ratio(self, ratio: float, shaft: str | None = None) -> ShaftAngle:
        """Return the angle of a shaft that turns `ratio` times for one turn of this one.

        Its angle zero is this shaft's: a ratio does not know how the other shaft stood.

        Raises
        ------
        AnalysisError
            A ratio that is not above zero.
        """
        if not ratio > 0.0:
            raise AnalysisError(f"the ratio of a shaft must be > 0, got {ratio}")
        return replace(self, turns=self.turns * ratio, speeds_hz=self.slopes_hz * ratio, shaft=shaft)

    def turns_at(self, times_s: ArrayLike) -> Array:
        """Return the turns at instants, any shape; NaN where they are not known."""
        times = np.asarray(times_s, dtype=np.float64)
        node, step, share = self._located(times)
        return self._masked(times, self._turns(node, step, share))

    def speed_hz_at(self, times_s: ArrayLike) -> Array:
        """Return the turns per second at instants, any shape; NaN where they are not known."""
        times = np.asarray(times_s, dtype=np.float64)
        node, step, share = self._located(times)
        return self._masked(times, self._slope(node, step, share))

    def times_at(self, turns: ArrayLike) -> Array:
        """Return the instants at which the angle is reached, any shape; NaN where that is not known."""
        wanted = np.asarray(turns, dtype=np.float64)
        node = np.clip(np.searchsorted(self.turns, wanted, side="right") - 1, 0, self.turns.size - 2)
        step = self.times_s[node + 1] - self.times_s[node]
        low, high = np.zeros(wanted.shape), np.ones(wanted.shape)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = (wanted - self.turns[node]) / (self.turns[node + 1] - self.turns[node])
            for _ in range(NEWTON_STEPS):  # Newton's steps, halving where one would leave what encloses the root
                over = self._turns(node, step, share) - wanted
                high, low = np.where(over > 0.0, share, high), np.where(over > 0.0, low, share)
                moved = share - over / (self._slope(node, step, share) * step)
                moved = np.where((moved >= low) & (moved <= high), moved, 0.5 * (low + high))
                done = bool(np.all((np.abs(moved - share) <= 1e-13) | ~np.isfinite(moved)))
                share = moved
                if done:
                    break
        times = self.times_s[node] + share * step
        known = (wanted >= self.turns[0]) & (wanted <= self.turns[-1])
        return self._masked(np.where(known, times, np.nan), times)

    def stretches(self) -> tuple[ShaftAngle, ...]:
        """Return the pieces between breaks that have at least 3 nodes, each without a break."""
        ends = [0, *(int(np.searchsorted(self.times_s, last - 1e-12)) for _, last in self.breaks), self.times_s.size]
        return tuple(
            replace(
                self,
                times_s=self.times_s[start:stop],
                turns=self.turns[start:stop],
                speeds_hz=self.slopes_hz[start:stop],
                breaks=(),
            )
            for start, stop in pairwise(ends)
            if stop - start >= 3
        )

    def _located(self, times: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Interval of each instant, its length, and the share of it that has passed."""
        node = np.clip(np.searchsorted(self.times_s, times, side="right") - 1, 0, self.times_s.size - 2)
        step = self.times_s[node + 1] - self.times_s[node]
        return node, step, (times - self.times_s[node]) / step

    def _turns(self, node: NDArray[np.intp], step: Array, share: Array) -> Array:
        start, rest = self.turns[node], 1.0 - share
        rise, slopes = self.turns[node + 1] - start, self.slopes_hz
        bent = share * rest * (rest * slopes[node] - share * slopes[node + 1]) * step
        return np.asarray(start + rise * share * share * (3.0 - 2.0 * share) + bent)

    def _slope(self, node: NDArray[np.intp], step: Array, share: Array) -> Array:
        rise, slopes, rest = (self.turns[node + 1] - self.turns[node]) / step, self.slopes_hz, 1.0 - share
        ends = slopes[node] * rest * (1.0 - 3.0 * share) + slopes[node + 1] * share * (3.0 * share - 2.0)
        return np.asarray(6.0 * rise * share * rest + ends)

    def _masked(self, times: Array, values: Array) -> Array:
        known = (times >= self.times_s[0]) & (times <= self.times_s[-1])
        for first, last in self.breaks:
            known &= (times <= first) | (times >= last)
        return np.where(known, values, np.nan)


def _slopes(times: Array, turns: Array, broken: NDArray[np.bool_], speeds: Array | None) -> Array:
    """Slope at each node: as given, or of the parabola through it and its neighbours; held so that all is monotone."""
    result = np.empty(times.size) if speeds is None else speeds.copy()
    ends = np.concatenate(([0], np.flatnonzero(broken) + 1, [times.size]))
    for start, stop in pairwise(ends):
        piece = slice(start, stop)
        if stop - start == 1:  # alone between two breaks
            result[piece] = 0.0 if speeds is None else speeds[piece]
            continue
        step, rise = np.diff(times[piece]), np.diff(turns[piece]) / np.diff(times[piece])
        if speeds is None:
            result[piece] = _parabolic(step, rise)
        least = np.minimum(np.concatenate((rise[:1], rise)), np.concatenate((rise, rise[-1:])))
        result[piece] = np.clip(result[piece], 0.0, 3.0 * least)
    return result


def _parabolic(step: Array, rise: Array) -> Array:
    if rise.size == 1:
        return np.repeat(rise, 2)
    inner = (step[1:] * rise[:-1] + step[:-1] * rise[1:]) / (step[1:] + step[:-1])
    first = rise[0] + (rise[0] - rise[1]) * step[0] / (step[0] + step[1])
    last = rise[-1] + (rise[-1] - rise[-2]) * step[-1] / (step[-1] + step[-2])
    return np.concatenate(([first], inner, [last]))


def _gaps(edges: Array) -> NDArray[np.intp]:
    """Intervals that are far longer than those on both sides."""
    step = np.diff(edges)
    if step.size < 3:
        return np.zeros(0, dtype=np.intp)
    left, right = np.concatenate((step[1:2], step[:-1])), np.concatenate((step[1:], step[-2:-1]))
    return np.flatnonzero(step > BREAK_ABOVE * np.maximum(left, right))


def _after_unknown(profile: SpeedProfile) -> NDArray[np.intp]:
    """Places of the first values after spans in which the speed is not known."""
    ends = np.array([last for _, last, _ in profile.unknown])
    return np.searchsorted(profile.times_s, ends - 1e-12).astype(np.intp)


def _turning(speed: Array, lowest_hz: float, after: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Indices of the stretches that turn one way at `lowest_hz` or more, cut at places besides."""
    way = np.where(np.abs(speed) >= lowest_hz, np.sign(speed), 0.0)
    cuts = np.unique(np.concatenate((np.flatnonzero(np.diff(way)) + 1, after[(after > 0) & (after < speed.size)])))
    return [piece for piece in np.split(np.arange(speed.size), cuts) if way[piece[0]] != 0.0]
