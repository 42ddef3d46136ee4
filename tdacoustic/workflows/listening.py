"""What of a campaign can be listened to: which run, which microphone, which seconds, and which order to listen for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from tdacoustic.measured.listening import ConditionSound, Listening, MarkedOrder
from tdacoustic.measured.listening_step import LISTENING, ListeningSettings, OrderToTrack, margin_s
from tdacoustic.measured.runs import receivers
from tdacoustic.measured.tasks import as_read
from tdacoustic.steps import execute, lineage, result_of
from tdacoustic.workflows.listening_stretch import line_of, order_of, sweeping_stretch, typical_stretch

if TYPE_CHECKING:
    from tdacoustic.attribution import Dominance, SourceLine
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.recording import Channel
    from tdacoustic.results import Analysis
    from tdacoustic.steps import Jobs, Progress, Store, Task
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = ["MOST_CONDITIONS", "with_sound"]

STEADY_S: Final = 6.0
"""Length of an excerpt at constant speed."""
SWEEP_S: Final = 10.0
"""Length of one whose speed changes."""
SHORTEST_S: Final = 0.5
"""Below, there is nothing to listen to [assumed]."""
MOST_CONDITIONS: Final = 12
"""Conditions with an excerpt; more would make the report too large to send."""


@dataclass(frozen=True)
class _Plan:
    """What is cut of a condition."""

    condition: str
    run: MeasuredRun
    task: Task
    marked: MarkedOrder | None
    choice: tuple[str, ...]


@dataclass(frozen=True)
class _Chosen:
    """A microphone of a run, and the line that led to it."""

    run: MeasuredRun
    channel: Channel
    source: SourceLine | None
    why: str


def with_sound(
    analysis: Analysis, first: FirstPass, second: SecondPass, store: Store, jobs: Jobs, progress: Progress | None
) -> Analysis:
    """Return an analysis with an excerpt of each condition's sound.

    Parameters
    ----------
    analysis : Analysis
    first : FirstPass
    second : SecondPass
    store : Store
    jobs : int or Executor
    progress : callable or None
    """
    plans, left_out = _plans(analysis, first, second)
    outcome = execute([plan.task for plan in plans], store, jobs, progress) if plans else None
    failed: Mapping[str, Any] = {} if outcome is None else outcome.failed
    sounds, records = [], dict(analysis.records)
    for plan in plans:
        if plan.task.key in failed:
            left_out.append((plan.condition, str(failed[plan.task.key])))
            continue
        records.update(lineage(plan.task, store))
        steady = plan.run.measurement is not None and plan.run.measurement.steady
        excerpt = result_of(plan.task, store)
        doubts = _doubts(plan.run, excerpt.channel)
        sounds.append(
            ConditionSound(plan.condition, plan.run.name, excerpt, plan.marked, not steady, plan.choice, doubts)
        )
    found = Listening(tuple(sounds), tuple(left_out))
    return replace(analysis, listening=found, records=tuple(records.items()))


def _plans(analysis: Analysis, first: FirstPass, second: SecondPass) -> tuple[list[_Plan], list[tuple[str, str]]]:
    """What is cut of each condition, and why of others nothing."""
    plans: list[_Plan] = []
    left_out: list[tuple[str, str]] = []
    for condition in analysis.campaign.conditions():
        chosen = _chosen(analysis, condition)
        if isinstance(chosen, str):
            left_out.append((condition, chosen))
            continue
        plan = _plan(condition, chosen, first, second)
        if isinstance(plan, str):
            left_out.append((condition, plan))
        else:
            plans.append(plan)
    if len(plans) <= MOST_CONDITIONS:
        return plans, left_out
    kept = {round(place) for place in np.linspace(0, len(plans) - 1, MOST_CONDITIONS)}
    why = f"the report holds the sound of {MOST_CONDITIONS} conditions, taken evenly from all"
    left_out += [(plan.condition, why) for index, plan in enumerate(plans) if index not in kept]
    return [plan for index, plan in enumerate(plans) if index in kept], left_out


# ---------------------------------------------------------------- which run, which microphone


def _chosen(analysis: Analysis, condition: str) -> _Chosen | str:
    """The microphone that the answer rests on, else the loudest in order; or why there is none."""
    runs = [run for run in analysis.runs if run.run.condition == condition and run.run.kind == "test"]
    measured = [run for run in runs if run.measurement is not None and run.recording is not None]
    if not measured:
        return "no recording of it could be used" if runs else "no recording"
    of_line = _of_line(analysis, condition, measured)
    if of_line is not None:
        return of_line
    wanted = receivers(analysis.runs)
    held = [(run, name) for run in measured for name in _microphones(run)]
    if not held:
        return "no microphone is in order"
    answering = [(run, name) for run, name in held if name in wanted]
    candidates = answering or held
    steady = [pair for pair in candidates if pair[0].measurement is not None and pair[0].measurement.steady]
    run, name = max(steady or candidates, key=lambda pair: _rms(*pair))
    assert run.recording is not None
    kind = "receiver" if answering else "microphone"
    return _Chosen(run, run.recording[name], None, f"the loudest {kind} in order")


def _of_line(analysis: Analysis, condition: str, measured: Sequence[MeasuredRun]) -> _Chosen | None:
    """The receiver of the dominating source's strongest noise line, in the run whose level is nearest to its mean."""
    verdict = next((item for item in analysis.dominance if item.condition == condition), None)
    sources = [source for source in analysis.sources if source.line.condition == condition]
    source = _leading(sources, verdict)
    by_name = {run.name: run for run in measured}
    if source is None:
        return None
    name = source.line.channel
    members = [(by_name[run], item) for run, item in source.line.members if run in by_name]
    members = [(run, item) for run, item in members if name in _microphones(run)]
    if not members:
        return None
    run, _ = min(members, key=lambda pair: abs(pair[1].line.rms ** 2 - source.line.mean_square))
    assert run.recording is not None
    return _Chosen(run, run.recording[name], source, "the receiver that shows the strongest line of the answer")


def _leading(sources: Sequence[SourceLine], verdict: Dominance | None) -> SourceLine | None:
    """The strongest line of the dominating source; of any source where none dominates."""
    named = [source for source in sources if verdict is not None and source.source == verdict.dominant]
    return max(named or sources, key=lambda source: source.line.mean_square, default=None)


def _microphones(run: MeasuredRun) -> list[str]:
    assert run.recording is not None
    return [name for name in run.usable_channels if run.recording[name].quantity == "sound_pressure"]


def _rms(run: MeasuredRun, name: str) -> float:
    assert run.measurement is not None
    result = run.measurement.channel(name)
    return 0.0 if result is None or not math.isfinite(result.rms) else result.rms


def _doubts(run: MeasuredRun, channel: str) -> tuple[str, ...]:
    """What the checks say of a channel that is no ok."""
    return tuple(
        f"{verdict.check}: {verdict.detail}"
        for verdict in run.all_verdicts
        if verdict.channel == channel and verdict.verdict != "ok"
    )


def _plan(condition: str, chosen: _Chosen, first: FirstPass, second: SecondPass) -> _Plan | str:
    run, channel = chosen.run, chosen.channel
    assert run.measurement is not None
    prepared = first.prepared[run.name]
    assert prepared.measurement is not None
    steady = run.measurement.steady
    wanted = STEADY_S if steady else SWEEP_S
    length = min(wanted, channel.duration_s)
    if length < SHORTEST_S:
        return f"{channel.duration_s:.2g} s of {channel.name} are too short to listen to"
    if steady:
        marked, order = line_of(run, channel, chosen.source)
        begin, how = typical_stretch(channel, length, second.of_kind("tones").get(run.name))
    else:
        marked, order, track = order_of(run, channel, first, second)
        begin, how = sweeping_stretch(run, channel, length, track)
    settings = _settings(channel, begin, length, order)
    task = LISTENING.task(f"run {run.name}", settings, logs=prepared.logs, speed=prepared.measurement.inputs["speed"])
    return _Plan(condition, run, task, marked, (f"{channel.name}: {chosen.why}", how))


def _settings(channel: Channel, begin_s: float, length_s: float, order: OrderToTrack | None) -> ListeningSettings:
    """The excerpt on whole samples, with what the filters need before and after as far as the log has it."""
    rate = channel.sample_rate_hz
    margin = math.ceil(margin_s(None if order is None else order.bandwidth_hz) * rate)
    start = round(begin_s * rate)
    stop = min(channel.n_samples, start + math.floor(length_s * rate))
    low, high = max(0, start - margin), min(channel.n_samples, stop + margin)
    cut = replace(
        as_read(channel),
        start_sample=channel.start_sample + low,
        n_samples=high - low,
        start_s=channel.start_s + low / rate,
    )
    return ListeningSettings(cut, channel.start_s + start / rate, channel.start_s + stop / rate, order)
