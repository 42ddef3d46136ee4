"""Step: what the sensors of a run show at the frequencies of its noise lines, segment by segment."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.lines import MAIN_LOBE, Line
from tdacoustic.measured import RunMeasurement, Survey
from tdacoustic.spectra import SegmentPowers, Spectrum
from tdacoustic.steps import Step

__all__ = ["EVIDENCE", "EvidenceSettings", "LineEvidence", "RunEvidence", "View"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EvidenceSettings:
    """Which channels are held against each other.

    Parameters
    ----------
    receivers : tuple of str
        Microphones whose lines are to be explained.
    sensors : tuple of (str, str)
        Accelerometers and the component each sits on.
    """

    receivers: tuple[str, ...]
    sensors: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class View:
    """A channel at the frequency of a line.

    Parameters
    ----------
    channel : str
    component : str
    segments : ndarray, shape (n_segments,)
        Mean square of the line's lobe in each segment, the floor taken off; may be negative.
    weights : ndarray, shape (n_segments,)
        Frames of each segment.
    floor_mean_square : float
        The floor in one noise bandwidth.
    """

    channel: str
    component: str
    segments: Array
    weights: Array
    floor_mean_square: float

    @property
    def mean_square(self) -> float:
        """Mean over the segments; 0 where the floor is not exceeded."""
        return max(0.0, float(self.weights @ self.segments / self.weights.sum()))

    @property
    def prominence_db(self) -> float:
        """Over the local floor in one noise bandwidth; minus infinity where nothing stands out."""
        ratio = self.mean_square / self.floor_mean_square
        return 10.0 * math.log10(ratio) if ratio > 0.0 else -math.inf


@dataclass(frozen=True)
class LineEvidence:
    """A noise line of a receiver and what every sensor shows at its frequency.

    Parameters
    ----------
    receiver : str
    line : Line
    at_receiver : View
    sensors : tuple of View
    """

    receiver: str
    line: Line
    at_receiver: View
    sensors: tuple[View, ...]


@dataclass(frozen=True)
class RunEvidence:
    """The evidence on all noise lines of a run."""

    lines: tuple[LineEvidence, ...]


def gather_evidence(settings: EvidenceSettings, survey: Survey, measurement: RunMeasurement) -> RunEvidence:
    """Step: gather what the sensors show at each noise line of a steady run."""
    if not measurement.steady:
        return RunEvidence(())
    scatter = measurement.speed.scatter
    channels = [*((name, "air") for name in settings.receivers), *settings.sensors]
    windows = {}
    for name, component in channels:
        result = measurement.channel(name)
        if result is not None and result.usable and result.spectrum is not None and result.floor is not None:
            raster, index = survey.of_channel(name)
            if raster.powers is not None:
                windows[name] = _Window(name, component, raster.powers, index, result.spectrum, result.floor)
    found = []
    for receiver in settings.receivers:
        result = measurement.channel(receiver)
        if result is None or receiver not in windows:
            continue
        for line in result.lines:
            sensors = tuple(windows[name].view(line, scatter) for name, _ in settings.sensors if name in windows)
            found.append(LineEvidence(receiver, line, windows[receiver].view(line, scatter), sensors))
    return RunEvidence(tuple(found))


class _Window:
    """One channel's segment powers and floor."""

    def __init__(
        self, name: str, component: str, powers: SegmentPowers, index: int, spectrum: Spectrum, floor: Array
    ) -> None:
        self._name, self._component = name, component
        used = powers.frames[index] > 0
        self._density = powers.density[index][used]
        self._weights = powers.frames[index][used].astype(np.float64)
        self._floor = floor
        self._spectrum = spectrum

    def view(self, line: Line, scatter: float) -> View:
        resolution_hz = self._spectrum.resolution_hz
        peak = round(line.frequency_hz / resolution_hz)
        # A steady line fills one lobe, one that the speed smears what the speed or, unknown, its own width says.
        moving_hz = max(scatter * line.frequency_hz, 0.0 if scatter > 0.0 else line.width_hz) if line.width_hz else 0.0
        reach = MAIN_LOBE + math.ceil(2.5 * moving_hz / resolution_hz)
        low, high = max(1, peak - reach), min(self._floor.size, peak + reach + 1)
        lobe = self._density[:, low:high].sum(axis=1, dtype=np.float64) - self._floor[low:high].sum()
        return View(
            self._name,
            self._component,
            lobe * resolution_hz,
            self._weights,
            float(self._floor[min(peak, self._floor.size - 1)]) * self._spectrum.noise_bandwidth_hz,
        )


EVIDENCE = Step("evidence", 2, gather_evidence, "Sensors at the noise lines")
