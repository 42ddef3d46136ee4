"""The speed of a shaft from the lines that its orders draw: settings, and the search for the path."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.speed.comb import Comb, CombOrder, distinct_orders
from tdacoustic.speed.comb_path import NEVER, CombPath, find_path, path_evidence
from tdacoustic.speed.comb_readings import Reading, best_reading
from tdacoustic.speed.comb_spectra import CombSpectra
from tdacoustic.speed.profile import SpeedProfile

__all__ = ["FoundPath", "RidgeSearch", "RidgeSettings", "refusal"]

Array = NDArray[np.float64]

FRAMES_S: Final = (0.2, 0.4, 0.8)
"""Lengths of frame that are tried: long ones for slow changes and faint lines, short ones for quick changes. The one
with the greatest evidence a frame is taken; where strange orders fit its lines too, the next: in long frames the loud
lines of a quick run-up smear."""
TOP_HZ: Final = 4000.0
"""Orders are looked for below [assumed: higher ones blur]."""
LOWEST_BINS: Final = 4.0
"""Bins from 0 Hz on that hold no lines."""
LEAST_MARGIN: Final = 20.0
"""Logarithmic evidence above that of strange orders, at least [tests/evidence, tuning seeds]."""
LEAST_A_FRAME: Final = 2.5
"""Logarithmic evidence a frame, at least [tests/evidence, tuning seeds]."""
LEAST_READING: Final = 0.7
"""Probability of a reading of the lines below which there is none [assumed]."""
CONSTANT: Final = 0.03
"""Relative width between the 5th and the 95th percentile of a path up to which it counts as constant [assumed]."""
SERIES: Final = 0.005
"""How near to whole multiples of the lowest the orders of a single series lie, relative [assumed]."""
LONGEST_SERIES: Final = 12.5
"""Highest multiple that a tone's harmonics are thought to reach [assumed]."""
BESIDE_A_SERIES: Final = 2
"""Orders beside a single series that lines which stand still in Hz must have, at least [assumed]."""
FARTHEST_START: Final = 4.0
"""Standard errors of a known start beyond which no speed starts."""
START_ERRORS: Final = 2.0
"""Standard errors of a known start within which a constant speed lies [assumed]."""
STRANGERS: Final = 6
"""Combs of strange orders that are tried for comparison."""
GOLDEN: Final = 0.618033988749895
"""Multiples of it spread evenly over the circle, so that strange orders stand in no simple ratio."""
DETUNED: Final = 0.12
"""By how much, at most, their orders lie beside the machine's [assumed]."""
REREAD_REACH: Final = 0.03
"""Half width, relative, around another reading within which its path is sought."""
MOST_SPEEDS: Final = 3000
GUIDE_FALL: Final = 8.0
"""How much less likely, ln, a speed beyond the reach of a stated one is, at twice the reach."""


@dataclass(frozen=True)
class RidgeSettings:
    """What is known before a speed is read from lines.

    Parameters
    ----------
    orders : tuple of CombOrder
        Of the shaft whose speed is sought; at least one.
    lowest_hz, highest_hz : float
        Range of its speed, turns per second.
    acceleration_hz_s : float
        Greatest change of its speed, turns per second squared; that of a slipping wheel, not the train's alone.
    shaft : str
    start_hz : float or None
        Speed at the first sample, where it is known.
    start_error : float
        Its relative standard error.
    guide : SpeedProfile or None
        A speed of the same shaft that is roughly known over time (from a train speed and its ratio).
    guide_reach : float
        Relative half width of what it allows: slip, wear of the wheel, its own error.

    Raises
    ------
    AnalysisError
        No order, or a range or limit that is not positive.
    """

    orders: tuple[CombOrder, ...]
    lowest_hz: float
    highest_hz: float
    acceleration_hz_s: float
    shaft: str = "motor"
    start_hz: float | None = None
    start_error: float = 0.03
    guide: SpeedProfile | None = None
    guide_reach: float = 0.1

    def __post_init__(self) -> None:
        if not self.orders:
            raise AnalysisError("a speed from lines needs at least one order")
        if not 0.0 < self.lowest_hz < self.highest_hz:
            raise AnalysisError(
                f"a speed from lines needs 0 < lowest_hz < highest_hz, got {self.lowest_hz} and {self.highest_hz}"
            )
        if not self.acceleration_hz_s > 0.0:
            raise AnalysisError(f"acceleration_hz_s must be > 0, got {self.acceleration_hz_s}")


@dataclass(frozen=True)
class FoundPath:
    """The path of one frame length.

    Parameters
    ----------
    times_s : ndarray, shape (n_frames,)
        After the first sample.
    path : CombPath
    reading : Reading
        Which orders its lines are, against other readings of the same lines.
    frame_s, step_hz : float
        Length of the frames; distance of the speeds that were tried.
    margin : float
        By how much the logarithmic evidence of the path is above that of the best of several combs of strange orders.
        Where the machine's orders fit no better than those, what they fit is not the machine.
    top_hz : float
        Up to which orders were looked for.
    constant : bool
        Whether it is of lines that stand at one frequency throughout; they count for little elsewhere.
    heard : tuple of CombOrder
        Orders that the machine has more likely than not.
    told_hz : (float, float) or None
        Range in which the speed lies as far as a start or a rough speed says.
    """

    times_s: Array
    path: CombPath
    reading: Reading
    frame_s: float
    step_hz: float
    margin: float
    top_hz: float
    constant: bool
    heard: tuple[CombOrder, ...]
    told_hz: tuple[float, float] | None

    @property
    def evidence_a_frame(self) -> float:
        """Logarithmic evidence of a comb a frame: how far lines stand out that are neither blurred nor too short."""
        return self.reading.log_evidence / self.times_s.size


class RidgeSearch:
    """Looks for the speed over time whose orders are the lines of several channels, block by block.

    Parameters
    ----------
    settings : RidgeSettings
    sample_rate_hz : float
    n_samples : int
        Of the record.
    n_channels : int
    frames_s : tuple of float
        Lengths of frame to try.

    Raises
    ------
    AnalysisError
        A record that is too short for any frame, or orders beyond half the sampling rate.
    """

    def __init__(
        self,
        settings: RidgeSettings,
        sample_rate_hz: float,
        n_samples: int,
        n_channels: int,
        frames_s: tuple[float, ...] = FRAMES_S,
    ) -> None:
        self._settings = settings = replace(settings, orders=distinct_orders(settings.orders))
        self._top_hz = min(TOP_HZ, 0.45 * sample_rate_hz, 1.05 * settings.highest_hz * _highest_order(settings))
        if min(item.order for item in settings.orders) * settings.lowest_hz > self._top_hz:
            raise AnalysisError(f"every order lies above {self._top_hz:.4g} Hz, where none can be heard")
        lengths = [length for length in frames_s if 4.0 * length * sample_rate_hz <= n_samples]
        if not lengths:
            raise AnalysisError(
                f"{n_samples / sample_rate_hz:.3g} s are too short for a speed from lines; "
                f"it takes {4.0 * min(frames_s):g} s"
            )
        self._spectra = [CombSpectra(s, sample_rate_hz, n_samples, n_channels, self._top_hz) for s in lengths]

    def take(self, values: Array) -> None:
        """Add samples, shape (n_channels, n), in order."""
        for spectra in self._spectra:
            spectra.take(values)

    def result(self, start_hz: float | None = None) -> FoundPath:
        """Return the path of the frame length with the greatest evidence a frame that strange orders do not share.

        Parameters
        ----------
        start_hz : float, optional
            Speed at the first sample, in place of that of the settings.
        """
        settings = self._settings if start_hz is None else replace(self._settings, start_hz=start_hz)
        moving = self._best(settings, constant=False)
        if refusal(moving) is None:
            return moving
        standing = self._best(settings, constant=True)
        return standing if refusal(standing) is None else moving

    def _best(self, settings: RidgeSettings, constant: bool) -> FoundPath:
        found = [(self._of(spectra, settings, constant), spectra) for spectra in self._spectra]
        found.sort(key=lambda item: -item[0].evidence_a_frame)
        tried = []
        for path, spectra in found:
            strangers = self._of_strangers(spectra, settings, constant)
            tried.append(replace(path, margin=path.path.log_evidence - strangers))
            if refusal(tried[-1]) is None:
                return tried[-1]
            if not _smears(tried[-1]):
                break
        return tried[0]

    def _of(self, spectra: CombSpectra, settings: RidgeSettings, constant: bool) -> FoundPath:
        times = spectra.times_s
        speeds, comb = self._comb(spectra, constant)
        scores = comb.scores(settings.orders, speeds)
        prior = _prior(settings, times, speeds)

        def prior_of(path: Array) -> float:
            places = np.clip(np.rint((path - speeds[0]) / (speeds[1] - speeds[0])), 0, speeds.size - 1)
            return float(prior[np.arange(times.size), places.astype(np.intp)].sum())

        path = find_path(scores, prior, speeds, spectra.hop_s, settings.acceleration_hz_s)
        limits = (settings.lowest_hz, settings.highest_hz)
        reading = best_reading(comb, settings.orders, path.speeds_hz, prior_of, limits)
        if not np.array_equal(reading.speeds_hz, path.speeds_hz):  # another reading of the same lines: its own path
            off = np.abs(speeds[None, :] / reading.speeds_hz[:, None] - 1.0) / REREAD_REACH
            beside = prior - GUIDE_FALL * np.maximum(off - 1.0, 0.0)
            again = find_path(scores, beside, speeds, spectra.hop_s, settings.acceleration_hz_s)
            path = replace(again, log_evidence=path.log_evidence)
        frame_s = spectra.length * spectra.hop_s / spectra.hop
        return FoundPath(
            times_s=times,
            path=path,
            reading=reading,
            frame_s=frame_s,
            step_hz=float(speeds[1] - speeds[0]),
            margin=float("nan"),
            top_hz=self._top_hz,
            constant=constant,
            heard=tuple(item for item, (_, part) in zip(settings.orders, reading.heard, strict=True) if part > 0.5),
            told_hz=_told(settings),
        )

    def _comb(self, spectra: CombSpectra, constant: bool) -> tuple[Array, Comb]:
        speeds = _speeds(self._settings, spectra.bin_hz, self._top_hz)
        step = float(speeds[1] - speeds[0])
        lowest_hz = LOWEST_BINS * spectra.bin_hz
        return speeds, Comb(spectra.over_floor(), spectra.bin_hz, lowest_hz, self._top_hz, step, constant)

    def _of_strangers(self, spectra: CombSpectra, settings: RidgeSettings, constant: bool) -> float:
        """Greatest evidence of combs whose orders are each moved by up to 12 %, always by the same parts."""
        speeds, comb = self._comb(spectra, constant)
        prior = _prior(settings, spectra.times_s, speeds)
        found = []
        for stranger in range(1, STRANGERS + 1):
            moved = tuple(
                replace(item, order=item.order * (1.0 + DETUNED * math.cos(math.tau * GOLDEN * place * stranger)))
                for place, item in enumerate(settings.orders, start=1)
            )
            scores = comb.scores(moved, speeds)
            found.append(path_evidence(scores, prior, speeds, spectra.hop_s, settings.acceleration_hz_s))
        return max(found)


def _smears(found: FoundPath) -> bool:
    """Whether nothing but strange orders speaks against a path: what shorter or longer frames may mend."""
    sure = len(found.heard) > 1 and found.reading.probability >= LEAST_READING
    return sure and found.evidence_a_frame >= LEAST_A_FRAME and found.margin < LEAST_MARGIN


def refusal(found: FoundPath) -> str | None:
    """Return why a path is none to follow, or None."""
    reading = found.reading
    if found.margin < LEAST_MARGIN or found.evidence_a_frame < LEAST_A_FRAME:
        return (
            "no speed in the lines: those of the expected orders stand out no better than strange orders do "
            f"(ln of the evidence {found.margin:+.0f} beside them, {found.evidence_a_frame:.1f} a frame)"
        )
    if len(found.heard) < 2:
        names = ", ".join(item.name for item in found.heard) or "no order"
        return f"no speed in the lines: {names} alone stands out, and one line fits any order"
    if found.constant and (reason := _not_constant(found)) is not None:
        return f"no speed in the lines: {reason}"
    if reading.probability < LEAST_READING:
        return (
            f"no speed in the lines: they fit {reading.rival_ratio:.3g} times the speed as well "
            f"(probabilities {reading.probability:.2f} and {reading.rival_probability:.2f})"
        )
    return None


def _not_constant(found: FoundPath) -> str | None:
    """Why lines that stand still in Hz are not those of a constant speed, or None."""
    low, middle, high = np.percentile(found.path.speeds_hz, [5.0, 50.0, 95.0])
    if high - low > CONSTANT * middle:
        return "some stand still in Hz, and the others do not fit them"
    if found.told_hz is None:
        if _beside_a_series(found.heard) < BESIDE_A_SERIES:
            return (
                "they stand still in Hz, and most are one harmonic series, as of an inverter's carrier; "
                "a start or a rough speed would tell"
            )
    elif not found.told_hz[0] <= middle <= found.told_hz[1]:
        return f"they stand still in Hz, at {middle:.4g} turns/s, which is not the speed that is known"
    return None


def _beside_a_series(orders: tuple[CombOrder, ...]) -> int:
    """Return how many orders are left beside the longest series of low multiples of one of them."""
    values = np.array([item.order for item in orders])
    ratios = values[:, None] / values[None, :]
    fits = (np.abs(ratios / np.maximum(np.rint(ratios), 1.0) - 1.0) <= SERIES) & (ratios < LONGEST_SERIES)
    return int(values.size - fits.sum(axis=0).max())


def _highest_order(settings: RidgeSettings) -> float:
    return max(item.order * (1.0 + item.reach) for item in settings.orders)


def _speeds(settings: RidgeSettings, bin_hz: float, top_hz: float) -> Array:
    """Speeds at which the highest order that is heard at a middling speed moves by a bin and a half."""
    middling = math.sqrt(settings.lowest_hz * settings.highest_hz)
    usable = [item.order for item in settings.orders if item.order * middling <= top_hz]
    highest = max(usable, default=min(item.order for item in settings.orders))
    count = math.ceil((settings.highest_hz - settings.lowest_hz) * highest / (1.5 * bin_hz)) + 1
    return np.linspace(settings.lowest_hz, settings.highest_hz, min(max(count, 16), MOST_SPEEDS))


def _told(settings: RidgeSettings) -> tuple[float, float] | None:
    """Range of a constant speed by what is known of it."""
    if settings.guide is not None and settings.guide.speed.size:
        middle, part = float(np.median(np.abs(settings.guide.speed))), settings.guide_reach
    elif settings.start_hz is not None:
        middle, part = settings.start_hz, START_ERRORS * settings.start_error
    else:
        return None
    return middle * (1.0 - part), middle * (1.0 + part)


def _prior(settings: RidgeSettings, times: Array, speeds: Array) -> Array:
    prior = np.zeros((times.size, speeds.size))
    if settings.start_hz is not None:
        moved = settings.acceleration_hz_s * times[0]
        spread = math.hypot(settings.start_error * settings.start_hz, moved, float(speeds[1] - speeds[0]))
        off = (speeds - settings.start_hz) / spread
        prior[0] = np.where(np.abs(off) <= FARTHEST_START, -0.5 * off**2, NEVER)
    if settings.guide is not None:
        stated = settings.guide.speed_at(times)
        known = np.isfinite(stated) & (stated > 0.0)
        off = np.abs(speeds[None, :] / np.where(known, stated, 1.0)[:, None] - 1.0) / settings.guide_reach
        prior -= np.where(known[:, None], GUIDE_FALL * np.maximum(off - 1.0, 0.0), 0.0)
    return prior
