"""Operating states: checked against each other, with the weights that resample their segments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.contributions.cross_spectra import CrossSpectra
from tdacoustic.contributions.transfer import Rule, Weighting
from tdacoustic.errors import AnalysisError

__all__ = ["HeldStates", "OperatingState", "PathSettings", "Span"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class OperatingState:
    """One operating state: a steady run, or the segments of a run-up about one speed.

    Parameters
    ----------
    name : str
    spectra : CrossSpectra
    """

    name: str
    spectra: CrossSpectra


@dataclass(frozen=True)
class Span:
    """A stretch of frequency whose power is summed: a band, or the lobe of a tone.

    Parameters
    ----------
    name : str
        ``"500 Hz"``, ``"mesh x1"``.
    low_hz, high_hz : float
        Lines at the edges count by their part inside.
    states : tuple of str or None
        States that it is of (a tone lies elsewhere at another speed); None for all.
    left_out_hz : tuple of (float, float)
        Stretches inside that do not count, apart from each other: of what is broadband, the lobes of the tones.
    """

    name: str
    low_hz: float
    high_hz: float
    states: tuple[str, ...] | None = None
    left_out_hz: tuple[tuple[float, float], ...] = ()

    def width_hz(self, frequencies_hz: Array, step_hz: float) -> Array:
        """Return how much of each line lies inside, in Hz, shape of `frequencies_hz`."""

        def inside(low_hz: float, high_hz: float) -> Array:
            upper = np.minimum(frequencies_hz + 0.5 * step_hz, high_hz)
            return np.maximum(upper - np.maximum(frequencies_hz - 0.5 * step_hz, low_hz), 0.0)

        width = inside(self.low_hz, self.high_hz)
        for low_hz, high_hz in self.left_out_hz:
            width -= inside(max(low_hz, self.low_hz), min(high_hz, self.high_hz))
        return np.where(width > 1e-9 * step_hz, width, 0.0)


@dataclass(frozen=True)
class PathSettings:
    """How contributions are computed.

    Parameters
    ----------
    rule : str
        Which components of the references are kept, see `tdacoustic.contributions.transfer`.
    weighting : str
        How states count, see there.
    draws : int
        Resamplings of the segments for the intervals.
    probability : float
        Of the intervals.
    seed : int
    """

    rule: Rule = "significance"
    weighting: Weighting = "equal"
    draws: int = 100
    probability: float = 0.95
    seed: int = 0


class HeldStates:
    """States checked against each other, the references in use, and resampling weights.

    Parameters
    ----------
    states, groups, settings, noise_density
        As of `tdacoustic.contributions.paths.path_contributions`, which says what raises.
    """

    def __init__(
        self,
        states: Sequence[OperatingState],
        groups: Mapping[str, Sequence[str]],
        settings: PathSettings,
        noise_density: Mapping[str, Array | float] | None,
    ) -> None:
        if not states:
            raise AnalysisError("contributions take an operating state, got none")
        first = states[0].spectra
        for state in states[1:]:
            other = state.spectra
            if (other.references, other.receivers) != (first.references, first.receivers):
                raise AnalysisError(f"states {states[0].name!r} and {state.name!r} differ in their channels")
            if not np.array_equal(other.frequencies_hz, first.frequencies_hz):
                raise AnalysisError(
                    f"states {states[0].name!r} and {state.name!r} differ in their lines "
                    f"({len(first.frequencies_hz)} of {first.plan.frames.resolution_hz:g} Hz, "
                    f"{len(other.frequencies_hz)} of {other.plan.frames.resolution_hz:g} Hz); take one resolution"
                )
        self.states, self.settings, self.receivers = states, settings, first.receivers
        dead = dict.fromkeys(name for state in states for name in state.spectra.dead)
        for name in self.receivers:
            if name in dead:
                raise AnalysisError(f"receiver {name!r} is a constant: there is nothing to explain")
        self.left_out = tuple(name for name in dead if name in first.references)
        self.groups: list[str] = []
        self.members: list[list[int]] = []
        self.used: list[int] = []
        self._take_groups(groups, first.references)
        self.frequencies_hz, self.resolution_hz = first.frequencies_hz, first.plan.frames.resolution_hz
        self.averages = np.array([state.spectra.averages for state in states])
        self.noise = self._noise(noise_density, first.references)
        generator = np.random.default_rng(settings.seed)
        self.draws = [_draw(generator, state.spectra.frames, settings.draws) for state in states]

    def _take_groups(self, groups: Mapping[str, Sequence[str]], references: tuple[str, ...]) -> None:
        for group, names in groups.items():
            unknown = [name for name in names if name not in references]
            if unknown:
                raise AnalysisError(f"group {group!r}: no reference {unknown[0]!r}; there are {', '.join(references)}")
            living = [references.index(name) for name in names if name not in self.left_out]
            if not living:
                raise AnalysisError(f"group {group!r} has no living reference: {', '.join(names) or 'none named'}")
            twice = [references[index] for index in living if index in self.used]
            if twice:
                raise AnalysisError(f"reference {twice[0]!r} is in two groups")
            self.groups.append(group)
            self.members.append(list(range(len(self.used), len(self.used) + len(living))))
            self.used += living
        if not self.groups:
            raise AnalysisError("contributions take a group of references, got none")

    def _noise(self, given: Mapping[str, Array | float] | None, references: tuple[str, ...]) -> Array | None:
        if self.settings.rule != "noise_floor":
            return None
        missing = [references[index] for index in self.used if given is None or references[index] not in given]
        if missing or given is None:
            raise AnalysisError(f"rule 'noise_floor' takes the noise density of reference {missing[0]!r}, got none")
        rows = [np.broadcast_to(given[references[index]], self.frequencies_hz.shape) for index in self.used]
        return np.stack(rows, axis=-1)

    def matrices(self, state: int, lines: NDArray[np.intp]) -> tuple[Complex, Complex, Array]:
        """Resampled means of a state: (n_draws + 1, n_lines, ...), the first without resampling."""
        spectra, weights = self.states[state].spectra, self.draws[state]
        block = spectra.density[..., lines][:, self.used]
        columns = [*self.used, *range(len(spectra.references), block.shape[2])]
        block = block[:, :, columns]
        flat = (weights.astype(np.float32) @ block.reshape(len(block), -1)).reshape(-1, *block.shape[1:])
        rows: Complex = np.asarray(np.moveaxis(flat, -1, 1), dtype=np.complex128)
        autos: Array = np.einsum("ds,spf->dfp", weights, spectra.receiver_density[..., lines].astype(np.float64))
        q = len(self.used)
        if self.noise is not None:
            place = np.arange(q)
            rows[..., place, place] -= self.noise[lines]
        return rows[..., :q], rows[..., q:], autos


def _draw(generator: np.random.Generator, frames: NDArray[np.int64], draws: int) -> Array:
    """Weights of the segments: one row by their frames, then resampled ones. A lone segment does not scatter."""
    live = np.flatnonzero(frames)
    counts = generator.multinomial(len(live), np.full(len(live), 1.0 / len(live)), size=draws)
    weights = np.zeros((draws + 1, len(frames)))
    weights[0, live] = frames[live]
    weights[1:, live] = counts * frames[live]
    return weights / weights.sum(axis=1, keepdims=True)
