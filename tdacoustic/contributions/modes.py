"""Traction, braking and coasting at one speed: what of the noise changes with torque, and what with speed alone.

At one speed, wheel/rail, fans on the shaft, bearings and windage go on while the drive coasts; the motor's
electromagnetic forces, the inverter's lines and the teeth's load do not. So with energies E:

- *speed-dependent part* = E(coasting), or hauled by another locomotive;
- *torque-dependent part* of traction = E(traction) - E(coasting), of braking = E(braking) - E(coasting).

Assumed: the parts are not coherent with each other, so that energies add. Neglected: what coasting adds by itself
(teeth without load may rattle; then it is louder, and the verdict says so); blowers and pumps that follow the load,
which count as torque; friction brakes, which count as torque in ``brake`` runs that use them; speeds that differ within
3 %.

Where traction and braking at like torque differ, it is the flank (teeth drive on the other side) or the motor's mode.

Scatter: segments are resampled within each run; runs of one mode scatter with a standard deviation in decibels pooled
over modes and bands, by Student's law of its degrees of freedom; where no mode was run twice, it is `RUN_SCATTER_DB`
[assumed].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import AnalysisError

__all__ = ["ModeComparison", "ModePart", "ModeRun", "compare_modes"]

Array = NDArray[np.float64]
Dependence = Literal["torque", "speed", "undecided"]

SPEED_REACH: Final = 0.03
"""Relative difference up to which speeds are one: 30 lg of it is 0.4 dB of rolling noise."""
RUN_SCATTER_DB: Final = 1.0
"""Of a run about the mean of like runs, where no run was repeated [assumed]."""
FREE: Final = ("coast", "hauled")
LOADED: Final = ("traction", "brake")
NO_TORQUE: Final = 0.05
"""Torque of a coasting run over the largest one, at most."""
HALF: Final = 0.5


@dataclass(frozen=True)
class ModeRun:
    """One run at the speed in question.

    Parameters
    ----------
    name : str
    mode : str
        ``traction``, ``brake``, ``coast`` or ``hauled``.
    speed : float
        Of any shaft or the train; the same in all runs.
    mean_square : ndarray, shape (n_segments, n_bands)
        Of a receiver, unit², in bands or at tones.
    weights : ndarray, shape (n_segments,)
        Frames of each segment.
    torque_n_m : float or None
    """

    name: str
    mode: str
    speed: float
    mean_square: Array
    weights: Array
    torque_n_m: float | None = None


@dataclass(frozen=True)
class ModePart:
    """What a loaded mode adds to coasting in one band.

    Parameters
    ----------
    mode : str
        ``traction`` or ``brake``.
    band : str
        ``total`` for the sum of all bands.
    mean_square : float
        Of the mode.
    speed_part, torque_part : float
        unit²; the second below 0 where coasting is louder.
    torque_share, share_low, share_high : float
        Torque-dependent part over the whole, with its interval, 0 to 1.
    depends_on : str
        ``torque`` or ``speed``: the part that is more than half for certain; else ``undecided``.
    words : str
        One sentence.
    """

    mode: str
    band: str
    mean_square: float
    speed_part: float
    torque_part: float
    torque_share: float
    share_low: float
    share_high: float
    depends_on: Dependence
    words: str


@dataclass(frozen=True)
class ModeComparison:
    """All modes and bands of one speed.

    Parameters
    ----------
    parts : tuple of ModePart
        Band by band and for the sum, of each loaded mode.
    brake_over_traction_db : tuple of (str, float, float, float)
        Band, torque-dependent part of braking over that of traction, and its interval; where both are above 0.
    run_scatter_db : float
    scatter_assumed : bool
        Whether it is the assumed one.
    doubts : tuple of str
    """

    parts: tuple[ModePart, ...]
    brake_over_traction_db: tuple[tuple[str, float, float, float], ...]
    run_scatter_db: float
    scatter_assumed: bool
    doubts: tuple[str, ...]


def compare_modes(
    runs: Sequence[ModeRun], bands: Sequence[str], draws: int = 1000, probability: float = 0.95, seed: int = 0
) -> ModeComparison:
    """Separate what depends on torque from what depends on speed.

    Parameters
    ----------
    runs : sequence of ModeRun
        At one speed; a coasting or hauled one and a loaded one at least.
    bands : sequence of str
    draws : int
    probability : float
        Of the intervals.
    seed : int

    Raises
    ------
    AnalysisError
        No coasting or no loaded run, speeds that differ by more than 3 %, a coasting run with torque, an unknown mode,
        values that are no powers.
    """
    _check(runs, bands)
    generator = np.random.default_rng(seed)
    means = [_mean(run) for run in runs]
    scatter_db, freedom = _run_scatter(runs, means)
    resampled = [_resampled(generator, run, draws, scatter_db, freedom) for run in runs]

    def of_modes(modes: Sequence[str]) -> tuple[Array, Array] | None:
        chosen = [index for index, run in enumerate(runs) if run.mode in modes]
        if not chosen:
            return None
        value = np.mean([means[index] for index in chosen], axis=0)
        drawn = np.mean([resampled[index] for index in chosen], axis=0)
        return np.append(value, value.sum()), np.column_stack((drawn, drawn.sum(axis=1)))

    free = of_modes(FREE)
    assert free is not None  # checked
    names = [*bands, "total"]
    parts: list[ModePart] = []
    loaded = {}
    for mode in LOADED:
        held = of_modes((mode,))
        if held is not None:
            loaded[mode] = held
            parts += [_part(mode, names[k], held, free, k, probability) for k in range(len(names))]
    ratios: tuple[tuple[str, float, float, float], ...] = ()
    if len(loaded) == 2:
        ratios = tuple(
            row for k in range(len(names)) if (row := _ratio(names[k], loaded, free, k, probability)) is not None
        )
    doubts = []
    if freedom == 0:
        doubts.append(f"no mode was run twice: {RUN_SCATTER_DB:g} dB between runs is assumed")
    torques = {run.mode: abs(run.torque_n_m) for run in runs if run.torque_n_m is not None and run.mode in LOADED}
    if len(torques) == 2 and max(torques.values()) > 1.1 * min(torques.values()):
        doubts.append(
            "torque of braking and traction differ by more than 10 %: their parts cannot be held against each other"
        )
    if any(run.mode == "brake" for run in runs):
        doubts.append("braking counts as torque in full: a friction brake would too")
    return ModeComparison(tuple(parts), ratios, scatter_db, freedom == 0, tuple(doubts))


def _check(runs: Sequence[ModeRun], bands: Sequence[str]) -> None:
    for run in runs:
        if run.mode not in (*FREE, *LOADED):
            raise AnalysisError(
                f"run {run.name!r}: mode must be one of {', '.join((*FREE, *LOADED))}, got {run.mode!r}"
            )
        if run.mean_square.shape != (len(run.weights), len(bands)):
            raise AnalysisError(
                f"run {run.name!r}: mean_square must have shape {(len(run.weights), len(bands))}, "
                f"got {run.mean_square.shape}"
            )
        live = run.weights > 0.0
        if not live.any() or not np.isfinite(run.mean_square[live]).all() or (run.mean_square[live] < 0.0).any():
            raise AnalysisError(f"run {run.name!r}: mean_square must hold powers, at least of one segment with frames")
    for modes, what in ((FREE, "a coasting or hauled run"), (LOADED, "a run in traction or braking")):
        if not any(run.mode in modes for run in runs):
            held = ", ".join(sorted({run.mode for run in runs})) or "none"
            raise AnalysisError(f"the comparison of modes takes {what}; there are {held}")
    lowest, highest = min(runs, key=lambda run: run.speed), max(runs, key=lambda run: run.speed)
    if not lowest.speed > 0.0 or highest.speed - lowest.speed > SPEED_REACH * highest.speed:
        raise AnalysisError(
            f"runs {lowest.name!r} and {highest.name!r} are at speeds {lowest.speed:g} and {highest.speed:g}; modes "
            f"are compared at one speed above 0, within {100.0 * SPEED_REACH:g} %"
        )
    largest = max((abs(run.torque_n_m) for run in runs if run.torque_n_m is not None), default=0.0)
    for run in runs:
        if run.mode in FREE and run.torque_n_m is not None and abs(run.torque_n_m) > NO_TORQUE * largest > 0.0:
            raise AnalysisError(f"run {run.name!r} is {run.mode} with a torque of {run.torque_n_m:g} N m")


def _mean(run: ModeRun) -> Array:
    live = run.weights > 0.0
    return np.asarray(run.weights[live] @ run.mean_square[live] / run.weights[live].sum())


def _run_scatter(runs: Sequence[ModeRun], means: Sequence[Array]) -> tuple[float, int]:
    """Standard deviation between like runs in dB, pooled, and its degrees of freedom; the assumed one and 0 without."""
    square, freedom = 0.0, 0
    for mode in (*FREE, *LOADED):
        held = np.array([mean for run, mean in zip(runs, means, strict=True) if run.mode == mode])
        if len(held) > 1:
            sounding = (held > 0.0).all(axis=0)
            if sounding.any():
                levels = 10.0 * np.log10(held[:, sounding])
                square += float(((levels - levels.mean(axis=0)) ** 2).sum(axis=0).mean())
                freedom += len(held) - 1
    return (float(np.sqrt(square / freedom)), freedom) if freedom else (RUN_SCATTER_DB, 0)


def _resampled(generator: np.random.Generator, run: ModeRun, draws: int, scatter_db: float, freedom: int) -> Array:
    """Means of a run, shape (draws, n_bands), segments and run resampled."""
    live = np.flatnonzero(run.weights > 0.0)
    counts = generator.multinomial(len(live), np.full(len(live), 1.0 / len(live)), size=draws) * run.weights[live]
    drawn = counts @ run.mean_square[live] / counts.sum(axis=1, keepdims=True)
    moved = generator.standard_t(freedom, size=draws) if freedom else generator.standard_normal(draws)
    return np.asarray(drawn * 10.0 ** (0.1 * scatter_db * moved)[:, None])


def _bounds(drawn: Array, probability: float) -> tuple[float, float]:
    low, high = np.percentile(drawn, (50.0 * (1.0 - probability), 50.0 * (1.0 + probability)))
    return float(low), float(high)


def _part(
    mode: str, band: str, held: tuple[Array, Array], free: tuple[Array, Array], k: int, probability: float
) -> ModePart:
    whole, rest = float(held[0][k]), float(free[0][k])
    drawn = 1.0 - free[1][:, k] / np.maximum(held[1][:, k], np.finfo(float).tiny)
    low, high = _bounds(drawn, probability)
    share = 1.0 - rest / whole if whole > 0.0 else 0.0
    depends: Dependence = "torque" if low > HALF else "speed" if high < HALF else "undecided"
    within = (
        f"{100.0 * max(0.0, share):.0f} % ({100.0 * max(0.0, low):.0f} to {100.0 * min(1.0, max(0.0, high)):.0f} %)"
    )
    if whole <= 0.0:
        depends, words = "undecided", f"no power in {mode}"
    elif high < 0.0:
        words = f"coasting is louder than {mode}: nothing comes with the torque, and coasting adds something of its own"
    elif depends == "torque":
        words = f"most of it comes and goes with the torque: {within}"
    elif depends == "speed":
        words = f"most of it is there without torque: {within} comes with the torque"
    else:
        words = f"not decided: {within} comes with the torque"
    return ModePart(
        mode,
        band,
        whole,
        rest,
        whole - rest,
        min(1.0, max(0.0, share)),
        max(0.0, low),
        min(1.0, max(0.0, high)),
        depends,
        words,
    )


def _ratio(
    band: str, loaded: dict[str, tuple[Array, Array]], free: tuple[Array, Array], k: int, probability: float
) -> tuple[str, float, float, float] | None:
    """Torque-dependent part of braking over that of traction, in dB; None where one of them may be nothing."""
    parts = {mode: (held[0][k] - free[0][k], held[1][:, k] - free[1][:, k]) for mode, held in loaded.items()}
    for _, drawn in parts.values():
        if _bounds(drawn, probability)[0] <= 0.0:
            return None
    ratio = 10.0 * np.log10(np.maximum(parts["brake"][1], 1e-300) / np.maximum(parts["traction"][1], 1e-300))
    low, high = _bounds(ratio, probability)
    return band, float(10.0 * np.log10(parts["brake"][0] / parts["traction"][0])), low, high
