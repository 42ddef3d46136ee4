"""From a log to a plotted spectrum, for notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tdacoustic.lines import Line
    from tdacoustic.recording import Recording
    from tdacoustic.spectra import Spectrum

__all__ = ["plot", "read", "spectrum"]


def read(
    path: str | Path, units: Mapping[str, Mapping[str, str]] | None = None, sample_rate_hz: float | None = None
) -> Recording:
    """Read a log's headers; its channels come in SI where the log states their units.

    Parameters
    ----------
    path : str or Path
    units : mapping, optional
        By channel, what the log does not say:
        ``{"ch1": {"quantity": "sound_pressure", "full_scale": "20 Pa"}}``.
    sample_rate_hz : float, optional
        Where the log does not say it.

    Returns
    -------
    Recording
        ``recording.samples(name)`` gives a channel's values.

    Raises
    ------
    TdacousticError
        The log cannot be read, or a scale does not fit.
    """
    from tdacoustic.formats import scan
    from tdacoustic.ingest import bind_log

    return bind_log(scan(path), units, sample_rate_hz)


def spectrum(recording: Recording, channel: str, resolution_hz: float = 1.0, overlap: float = 0.5) -> Spectrum:
    """Return the averaged spectrum of a channel (Hann window, Welch's method).

    Parameters
    ----------
    recording : Recording
    channel : str
    resolution_hz : float
        Line spacing.
    overlap : float

    Raises
    ------
    AnalysisError
        No such channel, or too short a record.
    """
    from tdacoustic.errors import AnalysisError
    from tdacoustic.measured import survey_recording
    from tdacoustic.spectra import average_spectrum

    raster, index = survey_recording(recording.only([channel]), resolution_hz, overlap, bands=False).of_channel(channel)
    if raster.powers is None:
        raise AnalysisError(f"channel {channel!r}: {raster.statistics.n_samples} samples are too short for a spectrum")
    held = recording[channel]
    return average_spectrum(raster.powers, index, held.quantity, held.si_symbol, channel)


def plot(spectrum: Spectrum, lines: Sequence[Line] = (), path: str | Path | None = None) -> Figure:
    """Plot a spectrum with its lines.

    Parameters
    ----------
    spectrum : Spectrum
    lines : sequence of Line
        From `tdacoustic.find_lines`.
    path : str or Path, optional
        Where to save it too.

    Returns
    -------
    matplotlib.figure.Figure
        Notebooks show it.
    """
    from tdacoustic.reporting import plot as draw
    from tdacoustic.reporting.sections.spectra import single_spectrum_figure

    return draw(single_spectrum_figure(spectrum, lines), path)
