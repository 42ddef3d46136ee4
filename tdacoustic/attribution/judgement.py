"""The source of each noise line of a condition, and how sure the data make it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.attribution.evidence import LineEvidence, View
from tdacoustic.attribution.excitation import Match
from tdacoustic.attribution.radiator import MARGIN_DB, SHOWN_DB, radiator_of, strongest_view

__all__ = ["ConditionLine", "JudgedLine", "judge", "source_by_rule"]

Array = NDArray[np.float64]

COMPONENT_OF_KIND = {"mesh": "gearbox", "motor": "motor", "inverter": "motor", "wheelset": "wheelset"}
"""Which component an excitation speaks for, where the sensors do not decide."""


@dataclass(frozen=True)
class ConditionLine:
    """A line of a receiver in a condition, gathered over its runs.

    Parameters
    ----------
    condition, channel : str
    frequency_hz, frequency_error_hz : float
        Mean over the runs that show it, and one standard deviation.
    members : tuple of (str, LineEvidence)
        Run and evidence.
    n_runs : int
        Steady runs of the condition; a run that does not show the line counts as none of its energy.
    """

    condition: str
    channel: str
    frequency_hz: float
    frequency_error_hz: float
    members: tuple[tuple[str, LineEvidence], ...]
    n_runs: int

    @property
    def mean_square(self) -> float:
        """Energy mean over the runs, Pa²."""
        return sum(evidence.line.rms**2 for _, evidence in self.members) / self.n_runs

    @property
    def prominence_db(self) -> float:
        """The highest of the runs."""
        return max(evidence.line.prominence_db for _, evidence in self.members)

    def views(self) -> tuple[View, ...]:
        """All sensors' views, of all runs."""
        return tuple(view for _, evidence in self.members for view in evidence.sensors)

    def component_prominence_db(self) -> dict[str, float]:
        """Prominence of each component: its best sensor, energy mean over the runs."""
        ratios: dict[str, dict[str, list[float]]] = {}
        for view in self.views():
            ratios.setdefault(view.component, {}).setdefault(view.channel, []).append(
                view.mean_square / view.floor_mean_square
            )
        found = {}
        for component, sensors in ratios.items():
            best = max(sum(values) / len(values) for values in sensors.values())
            found[component] = 10.0 * math.log10(best) if best > 0.0 else -math.inf
        return found


@dataclass(frozen=True)
class JudgedLine:
    """A line with its radiator, excitation and source.

    Parameters
    ----------
    line : ConditionLine
    radiator : str
        ``neither``, ``both`` or a component; empty where no sensor was there to ask.
    match, rival : Match or None
        The excitation that owns it, and the nearest of another kind.
    source : str
        A component, ``ambiguous`` or ``unassigned``.
    conflict : bool
        One component's sensors show it, and the order is another's.
    """

    line: ConditionLine
    radiator: str
    match: Match | None
    rival: Match | None
    source: str
    conflict: bool

    @property
    def excitation(self) -> str:
        """Kind of the excitation that owns it, ``unknown`` without one."""
        return "unknown" if self.match is None else self.match.expected.kind


def source_by_rule(radiator: str, kind: str | None) -> tuple[str, bool]:
    """Return source and conflict: one component's sensors decide; else the order; else nobody.

    Examples
    --------
    >>> source_by_rule("gearbox", "inverter"), source_by_rule("both", "mesh"), source_by_rule("neither", None)
    (('gearbox', True), ('gearbox', False), ('unassigned', False))
    """
    by_order = None if kind is None else COMPONENT_OF_KIND.get(kind)
    if radiator not in ("both", "neither", ""):
        return radiator, by_order is not None and by_order != radiator
    if by_order is not None:
        return by_order, False
    return ("ambiguous" if radiator == "both" else "unassigned"), False


def judge(line: ConditionLine, match: Match | None, rival: Match | None) -> JudgedLine:
    """Judge a line by its sensors and its order."""
    prominence = line.component_prominence_db()
    radiator = radiator_of(prominence) if prominence else ""
    source, conflict = source_by_rule(radiator, None if match is None else match.expected.kind)
    return JudgedLine(line, radiator, match, rival, source, conflict)


def evidence_words(judged: JudgedLine) -> str:
    """Return the evidence on a line as one sentence."""
    parts = []
    line = judged.line
    prominence = line.component_prominence_db()
    for component, level in sorted(prominence.items(), key=lambda item: -item[1]):
        view = strongest_view(line.views(), component)
        shown = (
            f"{level:.0f} dB over the floor of {view.channel}" if view is not None and level > -math.inf else "no trace"
        )
        parts.append(f"{component} {shown}")
    words = {
        "both": f"both show it within {MARGIN_DB:g} dB",
        "neither": f"no component's sensors show it ({SHOWN_DB:g} dB needed)",
        "": "no sensor on any component",
    }.get(judged.radiator, f"radiated by the {judged.radiator}")
    sentence = f"{'; '.join(parts)}: {words}" if parts else words
    if judged.match is not None:
        expected = judged.match.expected
        sentence += f"; {expected.name} at {expected.frequency_hz:.1f} Hz owns it ({judged.match.distance_hz:+.1f} Hz)"
    else:
        sentence += "; no known order within its uncertainty"
    if judged.conflict:
        sentence += f"; conflict: the order speaks for the {COMPONENT_OF_KIND[judged.excitation]}"
    rival = judged.rival
    if rival is not None and (judged.conflict or judged.match is None):
        off = 100.0 * rival.distance_hz / rival.expected.frequency_hz
        sentence += (
            f", nearest other order {rival.expected.name} at {rival.expected.frequency_hz:.1f} Hz ({off:+.1f} %)"
        )
    return sentence[0].upper() + sentence[1:] + "."


@dataclass(frozen=True)
class Draws:
    """Resampled judgements of the lines of a condition.

    Parameters
    ----------
    sources : tuple of str
        Names that `source` counts.
    source : ndarray of int, shape (n_lines, n_draws)
    energy : ndarray, shape (n_lines, n_draws)
        Mean square at the receiver.
    """

    sources: tuple[str, ...]
    source: NDArray[np.int64]
    energy: Array

    def agreement(self, line: int, source: str) -> float:
        """How often a line has a source; an ambiguous one is as sure as its likelier half."""
        if source in self.sources:
            return float(np.mean(self.source[line] == self.sources.index(source)))
        return float(np.bincount(self.source[line]).max() / self.source.shape[1])

    def overridden(self, line: int, source: str) -> Draws:
        """Return the draws with one line given to a source for good."""
        sources = self.sources if source in self.sources else (*self.sources, source)
        given = self.source.copy()
        given[line] = sources.index(source)
        return Draws(sources, given, self.energy)


DRAWS = 1000
MARGIN_SCATTER_DB = 3.0
"""Standard deviation of what is not known of floors and paths: it moves all lines' margins of a condition together."""
LINE_SCATTER_DB = 2.0
"""The same, for each line by itself."""
RECEIVER_SCATTER_DB = 1.0
"""Standard deviation of a line's level at one receiver against the same source a step aside: interference of paths,
ground, position. Without it two equal sources would be told apart by a hundredth of a decibel."""
CONFLICT_DOUBT = 0.15
"""How often the order is right where one component's sensors contradict it [assumed; on seeds 0-99 of the evidence the
sensors were right in 7 of 7]."""


def draw(lines: Sequence[JudgedLine], components: Sequence[str], seed: int) -> Draws:
    """Judge the lines again and again on resampled segments, with cross-talk and floors in doubt.

    Segments of a run are resampled together over all its channels. Each draw
    shifts the prominence of one component against the others by what is not
    known of floors and paths. An ambiguous line goes to the component that then
    shows it better: equal prominence gives either in turn; a line in conflict
    follows its order now and then.

    Parameters
    ----------
    lines : sequence of JudgedLine
        Of one condition.
    components : sequence of str
        Those with sensors.
    seed : int
    """
    rng = np.random.default_rng(seed)
    names = tuple(dict.fromkeys([*components, "motor", "gearbox", "wheelset", "unassigned"]))
    weights = _segment_draws(lines, rng)
    shift = {component: rng.normal(0.0, MARGIN_SCATTER_DB / math.sqrt(2.0), DRAWS) for component in components}
    source = np.zeros((len(lines), DRAWS), dtype=np.int64)
    energy = np.zeros((len(lines), DRAWS))
    for index, judged in enumerate(lines):
        prominence = {}
        for component in components:
            level = _component_draws(judged.line, component, weights)
            if level is not None:
                own = rng.normal(0.0, LINE_SCATTER_DB / math.sqrt(2.0), DRAWS)
                prominence[component] = level + shift[component] + own
        path_db = rng.normal(0.0, RECEIVER_SCATTER_DB, DRAWS)
        energy[index] = _energy_draws(judged.line, weights) * 10.0 ** (0.1 * path_db)
        source[index] = _source_draws(judged, prominence, names, rng.random(DRAWS))
    return Draws(names, source, energy)


def _segment_draws(lines: Sequence[JudgedLine], rng: np.random.Generator) -> dict[str, Array]:
    """Weights of the segments in each draw, by run, shape (n_draws, n_segments)."""
    found: dict[str, Array] = {}
    for judged in lines:
        for run, evidence in judged.line.members:
            if run not in found:
                frames = evidence.at_receiver.weights
                counts = rng.multinomial(frames.size, np.full(frames.size, 1.0 / frames.size), DRAWS)
                drawn = counts * frames
                found[run] = drawn / drawn.sum(axis=1, keepdims=True)
    return found


def _component_draws(line: ConditionLine, component: str, weights: dict[str, Array]) -> Array | None:
    sensors: dict[str, list[Array]] = {}
    for run, evidence in line.members:
        for view in evidence.sensors:
            if view.component == component:
                drawn = weights[run]
                if drawn.shape[1] != view.segments.size:
                    continue
                sensors.setdefault(view.channel, []).append(drawn @ view.segments / view.floor_mean_square)
    if not sensors:
        return None
    best = np.max([np.mean(values, axis=0) for values in sensors.values()], axis=0)
    return np.asarray(10.0 * np.log10(np.maximum(best, 1e-6)))


def _energy_draws(line: ConditionLine, weights: dict[str, Array]) -> Array:
    total = np.zeros(DRAWS)
    for run, evidence in line.members:
        total += np.maximum(weights[run] @ evidence.at_receiver.segments, 0.0)
    return total / line.n_runs


def _source_draws(
    judged: JudgedLine, prominence: dict[str, Array], names: tuple[str, ...], doubt: Array
) -> NDArray[np.int64]:
    kind = None if judged.match is None else judged.match.expected.kind
    found = np.empty(DRAWS, dtype=np.int64)
    for at in range(DRAWS):
        levels = {component: float(level[at]) for component, level in prominence.items()}
        radiator = radiator_of(levels) if levels else ""
        source, conflict = source_by_rule(radiator, kind)
        if conflict and doubt[at] < CONFLICT_DOUBT and kind is not None:
            source = COMPONENT_OF_KIND[kind]
        if source == "ambiguous":
            source = max(levels, key=lambda component: levels[component])
        found[at] = names.index(source) if source in names else names.index("unassigned")
    return found
