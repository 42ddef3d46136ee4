"""One run: motion, broadband, lines, cross-talk and tacho put together, with the truth about each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RecipeError
from tdacoustic.synthesis.chance import generator
from tdacoustic.synthesis.floors import coloured_noise, delayed, floor_density, resonance_gain, resonant
from tdacoustic.synthesis.lines import LinePart, PlacedLine, place_line, waveform
from tdacoustic.synthesis.motion import Motion
from tdacoustic.synthesis.pulses import TachoPulses, tacho_pulses
from tdacoustic.synthesis.recipe import ChannelRecipe, ConditionRecipe, LineRecipe, Recipe

__all__ = ["ChannelSignal", "LineInChannel", "RunPlan", "SyntheticRun", "make_run", "plan_runs"]


@dataclass(frozen=True)
class RunPlan:
    """What one run is to be, before anything of it is drawn."""

    name: str
    condition: ConditionRecipe
    kind: str
    index: int
    lines: tuple[LineRecipe, ...]
    floor_gain_db: Mapping[str, float]


@dataclass(frozen=True)
class LineInChannel:
    """What a channel holds of a line: rms in SI, whether it came by a path, and where from."""

    line: str
    rms: float
    via: str


@dataclass(frozen=True)
class ChannelSignal:
    """One channel of vibration or sound of one run.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        In SI, before quantisation.
    lines : tuple of LineInChannel
    broadband_rms, lines_rms, overall_rms : float
        Within the band of the overall levels.
    floor_gain : float
        Factor on the amplitude of the recipe's own floor.
    path_floors : tuple of (str, float)
        Channel whose floor arrives by a path, and the factor on its amplitude.
    """

    signal: NDArray[np.float64]
    lines: tuple[LineInChannel, ...]
    broadband_rms: float
    lines_rms: float
    overall_rms: float
    floor_gain: float
    path_floors: tuple[tuple[str, float], ...]

    def density(self, recipe: Recipe, channel: ChannelRecipe, frequency_hz: NDArray) -> NDArray[np.float64]:
        """Return the expected one-sided density of the channel's broadband (own and by paths), SI unit² per Hz."""
        total = self.floor_gain**2 * floor_density(channel, frequency_hz)
        by_name = {other.name: other for other in recipe.signal_channels}
        for name, factor in self.path_floors:
            led = np.abs(resonance_gain(by_name[name].resonance, np.asarray(frequency_hz))) ** 2
            total = total + factor**2 * led * floor_density(by_name[name], frequency_hz)
        return np.asarray(total * np.abs(resonance_gain(channel.resonance, np.asarray(frequency_hz))) ** 2)


@dataclass(frozen=True)
class SyntheticRun:
    """One run in memory, exact, before quantisation."""

    plan: RunPlan
    motion: Motion
    lines: tuple[PlacedLine, ...]
    channels: dict[str, ChannelSignal]
    tachos: dict[str, TachoPulses] = field(default_factory=dict)

    def samples(self, recipe: Recipe, channel: ChannelRecipe) -> NDArray[np.float64]:
        """Return a channel's samples in the unit that the log states (m/s², Pa, V, rpm)."""
        if channel.is_signal:
            return self.channels[channel.name].signal
        if channel.quantity == "tacho":
            return self.tachos[channel.name].voltage_v
        if channel.shaft == "train":
            return self.motion.nominal_km_h[:: channel.decimation]
        speed = 60.0 * self.motion.motor_speed_hz * self.motion.shaft_ratio(channel.shaft)
        return speed[:: channel.decimation]


def plan_runs(recipe: Recipe) -> tuple[RunPlan, ...]:
    """List the runs of a recipe, in its order: every condition's runs, then the background."""
    plans = []
    for condition in recipe.condition:
        for index in range(condition.runs):
            name = condition.name if condition.runs == 1 else f"{condition.name}#{index + 1}"
            gains = recipe.per_channel(condition.floor_gain_db)
            plans.append(RunPlan(name, condition, "test", index, (*recipe.line, *condition.line), gains))
    if recipe.background is not None:
        rest = recipe.background
        gain = rest.floor_gain_db
        gains = recipe.per_channel(gain if isinstance(gain, dict) else {c.name: gain for c in recipe.signal_channels})
        condition = ConditionRecipe(name=rest.name, train_speed_km_h=0.0, duration_s=rest.duration_s)
        mains = tuple(line for line in recipe.line if line.source == "mains")
        plans.append(RunPlan(rest.name, condition, "background", 0, (*mains, *rest.line), gains))
    names = [plan.name for plan in plans]
    for name in names:
        if names.count(name) > 1:
            raise RecipeError(f"two runs would be called {name!r}; rename the condition")
    return tuple(plans)


def make_run(recipe: Recipe, plan: RunPlan, seed: int) -> SyntheticRun:
    """Make one run in memory.

    Parameters
    ----------
    recipe : Recipe
    plan : RunPlan
        One of `plan_runs`.
    seed : int
        Everything random in the run follows from it and from the names of run, channel and line.

    Returns
    -------
    SyntheticRun

    Raises
    ------
    RecipeError
        A line leaves the band, pulses do not fit the rate, or a prescribed level cannot be reached.

    Notes
    -----
    The drive is linear here: a channel is the sum of its own floor, of what the paths bring of other channels' floors,
    and of its lines. Neglected: modulation of lines, structure between neighbouring channels of one component beyond
    common lines, and any change of the floor within a run. A channel's resonances filter the whole run.
    """
    condition = plan.condition
    n_samples = round((condition.duration_s or recipe.duration_s) * recipe.sample_rate_hz)
    if n_samples < 16:
        raise RecipeError(f"run {plan.name!r} has {n_samples} samples; duration_s is too short")
    excess = condition.mesh_excess if condition.mesh_excess is not None else recipe.kinematics.mesh_excess
    motion = Motion.build(
        recipe.kinematics,
        n_samples=n_samples,
        sample_rate_hz=recipe.sample_rate_hz,
        start_km_h=condition.train_speed_km_h,
        end_km_h=condition.train_speed_end_km_h,
        profile=condition.speed_profile,
        mesh_excess=excess,
        slip=condition.slip,
        rng=generator(seed, plan.name, "wander"),
    )
    placed = tuple(
        place_line(
            recipe,
            line,
            name,
            motion,
            run=plan.name,
            seed=seed,
            carrier_hz=condition.carrier_hz,
            floor_gain_db=plan.floor_gain_db,
            offset_db=_scatter_db(seed, plan, f"line {name}"),
        )
        for name, line in _named(plan.lines)
    )
    own_floors = {
        channel.name: _own_floor(recipe, channel, plan, n_samples, seed) for channel in recipe.signal_channels
    }
    mixers = {channel.name: _Mixer(recipe, channel, plan, own_floors, seed) for channel in recipe.signal_channels}
    for line in placed:
        phasor = np.exp(2j * np.pi * line.turns)
        for part in line.parts:
            key = (seed, plan.name, line.name, part.channel, part.path.source if part.path else "", "rest")
            mixers[part.channel].add(line.name, waveform(line, part, phasor, recipe.sample_rate_hz, key), part)
    tachos = {
        channel.name: tacho_pulses(
            channel, motion, recipe.sample_rate_hz, generator(seed, plan.name, channel.name, "pulses")
        )
        for channel in recipe.channel
        if channel.quantity == "tacho"
    }
    return SyntheticRun(plan, motion, placed, {name: mixer.finish() for name, mixer in mixers.items()}, tachos)


def _named(lines: tuple[LineRecipe, ...]) -> list[tuple[str, LineRecipe]]:
    """Give every line a name that says what it follows and is unique within the run."""
    named: list[tuple[str, LineRecipe]] = []
    for line in lines:
        follows = {"mesh": line.mesh, "order": line.order, "carrier": line.carrier, "Hz": line.frequency_hz}
        text = line.name or f"{line.source} " + " + ".join(f"{k} {v:g}" for k, v in follows.items() if v is not None)
        taken = {name for name, _ in named}
        name, count = text, 2
        while name in taken:
            name, count = f"{text} ({count})", count + 1
        named.append((name, line))
    return named


def _scatter_db(seed: int, plan: RunPlan, what: str) -> float:
    """Scatter of this run's level among the runs of its condition; their energy mean is kept."""
    sigma = plan.condition.repeat_sigma_db
    if sigma == 0.0 or plan.condition.runs == 1:
        return 0.0
    offsets = sigma * generator(seed, plan.condition.name, what, "repeat").standard_normal(plan.condition.runs)
    return float(offsets[plan.index] - 10.0 * np.log10(np.mean(10.0 ** (offsets / 10.0))))


def _own_floor(recipe: Recipe, channel: ChannelRecipe, plan: RunPlan, n_samples: int, seed: int) -> NDArray:
    """Without the channel's own resonances."""
    return coloured_noise(generator(seed, plan.name, channel.name, "floor"), channel, n_samples, recipe.sample_rate_hz)


class _Mixer:
    """Collects what one channel holds and scales it to what is prescribed."""

    def __init__(
        self, recipe: Recipe, channel: ChannelRecipe, plan: RunPlan, own_floors: dict[str, NDArray], seed: int
    ) -> None:
        self._recipe, self._channel, self._plan, self._seed = recipe, channel, plan, seed
        scatter_db = _scatter_db(seed, plan, f"floor {channel.name}")
        if channel.name in recipe.per_channel(plan.condition.level_db):
            scatter_db = 0.0
        self._floor_gain = 10.0 ** ((plan.floor_gain_db.get(channel.name, 0.0) + scatter_db) / 20.0)
        self._floor = self._floor_gain * own_floors[channel.name]
        self._path_floors: list[tuple[str, float]] = []
        for path in recipe.path:
            source = recipe.targets(path.source)[0]
            if path.broadband_gain_db is None or channel not in recipe.targets(path.to):
                continue
            if channel in recipe.targets(path.source):
                continue
            gain = 10.0 ** ((path.broadband_gain_db + plan.floor_gain_db.get(source.name, 0.0)) / 20.0)
            gain *= channel.reference / source.reference
            rng = generator(seed, plan.name, channel.name, path.source, "floor by path")
            rest = coloured_noise(rng, source, self._floor.size, recipe.sample_rate_hz)
            rest = resonant(rest, source.resonance, recipe.sample_rate_hz)
            led = resonant(own_floors[source.name], source.resonance, recipe.sample_rate_hz)
            common = delayed(led, recipe.sample_rate_hz, path.delay_s)
            self._floor = self._floor + gain * (np.sqrt(path.coherence) * common + np.sqrt(1.0 - path.coherence) * rest)
            self._path_floors.append((source.name, gain))
        self._floor = resonant(self._floor, channel.resonance, recipe.sample_rate_hz)
        self._with_floor = np.zeros_like(self._floor)
        self._lines = np.zeros_like(self._floor)
        self._parts: dict[str, tuple[NDArray, bool, list[str]]] = {}

    def add(self, name: str, wave: NDArray, part: LinePart) -> None:
        """Add one line's part."""
        shapes = list(self._channel.resonance)
        if part.path is not None:
            shapes += self._recipe.targets(part.path.source)[0].resonance
        wave = resonant(wave, shapes, self._recipe.sample_rate_hz)
        via = "recipe" if part.path is None else f"path from {part.path.source}"
        before, _, ways = self._parts.get(name, (np.zeros_like(wave), part.follows_floor, []))
        self._parts[name] = (before + wave, part.follows_floor, [*ways, via])
        if part.follows_floor:
            self._with_floor += wave
        else:
            self._lines += wave

    def finish(self) -> ChannelSignal:
        """Scale to the prescribed level, apply the sensor's gain, and say what the channel holds."""
        floor_factor, line_factor = self._factors()
        follow_factor = floor_factor if self._fraction() is None else line_factor
        floor = floor_factor * self._floor
        lines = line_factor * self._lines + follow_factor * self._with_floor
        held = []
        for name, (wave, follows_floor, ways) in self._parts.items():
            factor = follow_factor if follows_floor else line_factor
            held.append(LineInChannel(name, float(factor * np.sqrt(np.mean(wave**2))), ", ".join(ways)))
        return ChannelSignal(
            signal=floor + lines,
            lines=tuple(held),
            broadband_rms=float(np.sqrt(self._power(floor, floor))),
            lines_rms=float(np.sqrt(self._power(lines, lines))),
            overall_rms=float(np.sqrt(self._power(floor + lines, floor + lines))),
            floor_gain=floor_factor * self._floor_gain,
            path_floors=tuple((name, floor_factor * gain) for name, gain in self._path_floors),
        )

    def _fraction(self) -> float | None:
        return self._recipe.per_channel(self._plan.condition.line_fraction).get(self._channel.name)

    def _factors(self) -> tuple[float, float]:
        """Return the factors on the broadband and on the lines that give the prescribed overall level."""
        gain = 10.0 ** (self._channel.gain_db / 20.0)
        target_db = self._recipe.per_channel(self._plan.condition.level_db).get(self._channel.name)
        if target_db is None:
            return gain, gain
        target_db += _scatter_db(self._seed, self._plan, f"level {self._channel.name}")
        target = (self._channel.reference * 10.0 ** (target_db / 20.0)) ** 2
        fraction = self._fraction()
        scaled, fixed, line_factor = self._floor + self._with_floor, self._lines, 1.0
        if fraction is not None:
            lines = self._lines + self._with_floor
            power = self._power(lines, lines)
            if power == 0.0:
                raise RecipeError(f"line_fraction of {self._channel.name!r}: run {self._plan.name!r} has no line there")
            line_factor = float(np.sqrt(fraction * target / power))
            scaled, fixed = self._floor, line_factor * lines
        # |a scaled + fixed|² = target, the positive root
        square, cross = self._power(scaled, scaled), self._power(scaled, fixed)
        rest = self._power(fixed, fixed) - target
        if rest >= 0.0:
            raise RecipeError(
                f"level_db = {target_db:.2f} of channel {self._channel.name!r} in run {self._plan.name!r} cannot be "
                f"reached: its lines alone give {10 * np.log10((rest + target) / self._channel.reference**2):.2f} dB"
            )
        floor_factor = float((-cross + np.sqrt(cross**2 - square * rest)) / square)
        return floor_factor, line_factor

    def _power(self, one: NDArray, other: NDArray) -> float:
        """Mean product of two signals within the band of the overall levels (Parseval)."""
        low, high = self._recipe.band_hz
        frequency = np.fft.rfftfreq(one.size, 1.0 / self._recipe.sample_rate_hz)
        inside = (frequency >= low) & (frequency <= high)
        weight = np.where((frequency == 0.0) | (2.0 * frequency == self._recipe.sample_rate_hz), 1.0, 2.0) * inside
        product = np.fft.rfft(one) * np.conj(np.fft.rfft(other))
        return float(np.sum(weight * product.real) / one.size**2)
