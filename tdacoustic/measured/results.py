"""What the steps of the measured side return; frozen, so that the store can keep it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError
from tdacoustic.lines import Family, Line
from tdacoustic.quality import Statistics, Verdict
from tdacoustic.spectra import BandPowers, SegmentPowers, Spectrum
from tdacoustic.speed import ShaftAngle, SpeedProfile

__all__ = ["Band", "ChannelResult", "LineReading", "RasterSurvey", "RunMeasurement", "RunSpeed", "SegmentMap", "Survey"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LineReading:
    """How a speed was sought in the lines of vibration.

    Parameters
    ----------
    channels : tuple of str
        Whose lines were looked at.
    reason : str or None
        Why there is no speed; None where there is one.
    heard : tuple of (str, float)
        Each order that was expected, and the probability that the machine has it.
    rival_ratio, rival_probability : float
        The next likely reading of the same lines: its speed over this one's. NaN and 0 without one.
    """

    channels: tuple[str, ...]
    reason: str | None
    heard: tuple[tuple[str, float], ...] = ()
    rival_ratio: float = float("nan")
    rival_probability: float = 0.0


@dataclass(frozen=True)
class RunSpeed:
    """Speeds of a run.

    Parameters
    ----------
    profiles : tuple of SpeedProfile
    problems : tuple of (str, str)
        Channels from which no speed could be had, and why.
    angles : tuple of ShaftAngle
        Of the shafts whose speed is known, on the run's time axis; `ShaftAngle.channel` says whence. Not in the
        measurement of a run, only in what the steps of the speed return: they are long.
    lines : LineReading or None
        Where the speed was sought in lines too.
    """

    profiles: tuple[SpeedProfile, ...]
    problems: tuple[tuple[str, str], ...] = ()
    angles: tuple[ShaftAngle, ...] = ()
    lines: LineReading | None = None

    @property
    def leading(self) -> SpeedProfile | None:
        """The profile that decides: of the motor's shaft, else the wheelset's, else any."""
        rank = {"motor": 0, "wheelset": 1}
        return min(self.profiles, key=lambda profile: rank.get(profile.shaft or "", 2), default=None)

    @property
    def scatter(self) -> float:
        """Relative standard deviation of the leading speed; 0 where none is known or nothing moves."""
        leading = self.leading
        if leading is None or leading.stands or not leading.mean:
            return 0.0
        return float(np.std(leading.speed)) / abs(leading.mean)

    def is_steady(self, tolerance: float) -> bool:
        """Whether the leading speed varies by no more than a relative tolerance, or nothing says that it does."""
        return self.leading is None or self.leading.is_constant(tolerance)

    def of_shaft(self, shaft: str) -> SpeedProfile | None:
        """Return the first profile of a shaft (``motor``, ``wheelset``), or None."""
        return next((profile for profile in self.profiles if profile.shaft == shaft), None)

    def angle_of(self, shaft: str) -> ShaftAngle | None:
        """Return the first angle of a shaft, or None."""
        return next((angle for angle in self.angles if angle.shaft == shaft), None)


@dataclass(frozen=True)
class RasterSurvey:
    """What one pass over the channels of one raster gathered.

    Parameters
    ----------
    channels : tuple of str
    statistics : Statistics
    powers : SegmentPowers or None
        None where the record is too short for any spectrum.
    band_channels : tuple of str
        Those of `bands`.
    bands : BandPowers or None
    """

    channels: tuple[str, ...]
    statistics: Statistics
    powers: SegmentPowers | None
    band_channels: tuple[str, ...]
    bands: BandPowers | None


@dataclass(frozen=True)
class Survey:
    """The survey of a run, raster by raster."""

    rasters: tuple[RasterSurvey, ...]

    def of_channel(self, name: str) -> tuple[RasterSurvey, int]:
        """Return the raster that holds a channel, and its place there."""
        for raster in self.rasters:
            if name in raster.channels:
                return raster, raster.channels.index(name)
        raise AnalysisError(f"no channel {name!r} in the survey")


@dataclass(frozen=True)
class SegmentMap:
    """Density over time and frequency, thinned for drawing: each cell is the highest of what it covers.

    Parameters
    ----------
    times_s : ndarray, shape (n_times,)
    frequencies_hz : ndarray, shape (n_frequencies,)
    density : ndarray, shape (n_frequencies, n_times)
        unit²/Hz.
    """

    times_s: Array
    frequencies_hz: Array
    density: Array


@dataclass(frozen=True)
class Band:
    """One third octave: nominal centre, mean square in SI, and whether a strong line next to it decides its level."""

    nominal_hz: float
    mean_square: float
    filter_dependent: bool


@dataclass(frozen=True)
class ChannelResult:
    """Spectrum, levels and lines of one channel of one run.

    Parameters
    ----------
    channel : str
    usable : bool
        False where a check says ``bad``; the figures below are then kept for the
        record but enter no table.
    rms : float
        SI, mean removed.
    laeq_db : float or None
        A-weighted level, of a sound pressure.
    band_rms : float or None
        Within `level_band_hz`.
    level_band_hz : (float, float)
    spectrum : Spectrum or None
        None for a run-up (its speed is not constant) or where there is none.
    floor : ndarray or None
        Density of the floor under the lines.
    lines : tuple of Line
    families : tuple of Family
    map : SegmentMap or None
        For a run-up.
    bands : tuple of Band
    """

    channel: str
    usable: bool
    rms: float
    laeq_db: float | None
    band_rms: float | None
    level_band_hz: tuple[float, float]
    spectrum: Spectrum | None
    floor: Array | None
    lines: tuple[Line, ...]
    families: tuple[Family, ...]
    map: SegmentMap | None
    bands: tuple[Band, ...]


@dataclass(frozen=True)
class RunMeasurement:
    """All that the measured side says of one run.

    Parameters
    ----------
    speed : RunSpeed
    steady : bool
        Whether the speed is constant (or nothing says otherwise).
    channels : tuple of ChannelResult
    verdicts : tuple of Verdict
    """

    speed: RunSpeed
    steady: bool
    channels: tuple[ChannelResult, ...]
    verdicts: tuple[Verdict, ...]

    def channel(self, name: str) -> ChannelResult | None:
        """Return the result of a channel, or None where the run has none."""
        return next((result for result in self.channels if result.channel == name), None)
