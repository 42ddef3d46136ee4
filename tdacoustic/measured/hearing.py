"""What a microphone's samples say to the ear: audible tones over time, and levels over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.spectra import LevelHistory
from tdacoustic.tones import Audibility, RatedTone

__all__ = ["ChannelAudibility", "Hearing", "RasterHearing", "ToneSightings"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class ToneSightings:
    """Audible tones of single spectra, one entry each, by spectrum and frequency.

    Parameters
    ----------
    spectrum : ndarray of int, shape (n,)
        Index of the spectrum.
    frequency_hz, frequency_error_hz : ndarray, shape (n,)
        One standard deviation.
    level_db : ndarray, shape (n,)
        A-weighted, re 20 uPa.
    audibility_db : ndarray, shape (n,)
    """

    spectrum: Indices
    frequency_hz: Array
    frequency_error_hz: Array
    level_db: Array
    audibility_db: Array


@dataclass(frozen=True)
class ChannelAudibility:
    """Tonal audibility of a channel by one method: `tones.Audibility` without what nobody asks for later.

    Parameters
    ----------
    channel, method : str
    line_spacing_hz, averaging_s : float
        Of the short-time spectra.
    starts_s : ndarray, shape (n_spectra,)
        Start of each after the channel's first sample.
    decisive_db, decisive_uncertainty_db, decisive_hz : ndarray, shape (n_spectra,)
        Largest audibility of each, half of its 90 % interval, and the tone it is of; NaN Hz where nothing is audible.
    mean_db, uncertainty_db : float or None
        Over all spectra; None without any.
    adjustment_db : int or None
    tones : tuple of RatedTone
        Each tone over all spectra.
    seen : ToneSightings
        Each tone in each spectrum.
    excluded : tuple of (float, str)
        Tones that the method does not rate, and why.
    notes : tuple of str
    """

    channel: str
    method: str
    line_spacing_hz: float
    averaging_s: float
    starts_s: Array
    decisive_db: Array
    decisive_uncertainty_db: Array
    decisive_hz: Array
    mean_db: float | None
    uncertainty_db: float | None
    adjustment_db: int | None
    tones: tuple[RatedTone, ...]
    seen: ToneSightings
    excluded: tuple[tuple[float, str], ...]
    notes: tuple[str, ...]

    @classmethod
    def of(cls, rated: Audibility, notes: tuple[str, ...] = ()) -> ChannelAudibility:
        """Keep what later steps need of a rating; `notes` come after its own."""
        seen = [(index, tone) for index, tones in enumerate(rated.spectra) for tone in tones.tones]
        held = [tone for _, tone in seen]
        decisive = [np.nan if tones.decisive_hz is None else tones.decisive_hz for tones in rated.spectra]
        return cls(
            channel=rated.channel,
            method=rated.method.name,
            line_spacing_hz=rated.line_spacing_hz,
            averaging_s=rated.averaging_s,
            starts_s=np.array(rated.starts_s, dtype=np.float64),
            decisive_db=np.array([tones.decisive_db for tones in rated.spectra], dtype=np.float64),
            decisive_uncertainty_db=np.array([tones.decisive_uncertainty_db for tones in rated.spectra]),
            decisive_hz=np.array(decisive, dtype=np.float64),
            mean_db=rated.mean_db,
            uncertainty_db=rated.uncertainty_db,
            adjustment_db=rated.adjustment_db,
            tones=rated.tones,
            seen=ToneSightings(
                np.array([index for index, _ in seen], dtype=np.int64),
                np.array([tone.frequency_hz for tone in held], dtype=np.float64),
                np.array([tone.frequency_error_hz for tone in held], dtype=np.float64),
                np.array([tone.level_db for tone in held], dtype=np.float64),
                np.array([tone.audibility_db for tone in held], dtype=np.float64),
            ),
            excluded=rated.excluded,
            notes=(*rated.notes, *notes),
        )


@dataclass(frozen=True)
class RasterHearing:
    """What was heard on the microphones of one raster.

    Parameters
    ----------
    channels : tuple of str
    start_s : float
        Instant of their first sample on the run's time axis.
    audibility : tuple of ChannelAudibility
        Method by method, channel by channel; empty where refused.
    levels : LevelHistory or None
        A-weighted levels over time, in the order of the channels; None where refused.
    """

    channels: tuple[str, ...]
    start_s: float
    audibility: tuple[ChannelAudibility, ...]
    levels: LevelHistory | None


@dataclass(frozen=True)
class Hearing:
    """What was heard in a run.

    Parameters
    ----------
    rasters : tuple of RasterHearing
    refused : tuple of (str, str, str)
        Channel, ``audibility`` or ``levels``, and why it cannot be had.
    """

    rasters: tuple[RasterHearing, ...]
    refused: tuple[tuple[str, str, str], ...] = ()

    @property
    def audibility(self) -> tuple[ChannelAudibility, ...]:
        """All ratings."""
        return tuple(rated for raster in self.rasters for rated in raster.audibility)

    def rated(self, channel: str, method: str) -> ChannelAudibility | None:
        """Return a channel's rating by a method, or None where there is none."""
        return next((rated for rated in self.audibility if (rated.channel, rated.method) == (channel, method)), None)

    def levels(self, channel: str) -> tuple[LevelHistory, int, float] | None:
        """Return the history that holds a channel, its place there and the instant it begins; None without one."""
        for raster in self.rasters:
            if channel in raster.channels and raster.levels is not None:
                return raster.levels, raster.channels.index(channel), raster.start_s
        return None

    def reason(self, channel: str, what: str) -> str | None:
        """Return why ``audibility`` or ``levels`` of a channel cannot be had."""
        return next((why for name, kind, why in self.refused if (name, kind) == (channel, what)), None)
