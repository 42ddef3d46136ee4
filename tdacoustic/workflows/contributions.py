"""Contributions of a campaign: which runs, channels, states and spans, and the tasks that find them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from tdacoustic.attribution import run_speeds, steady_speeds
from tdacoustic.attribution.contribution_spans import NamedSpan, Stretch, orders_between, spans, steady_tones
from tdacoustic.attribution.contribution_step import CONTRIBUTIONS, Contributions, ContributionSettings, RunState
from tdacoustic.attribution.contributions import CampaignContributions, ContributionState
from tdacoustic.contributions import PathSettings
from tdacoustic.errors import AnalysisError
from tdacoustic.measured.cross_spectra_step import (
    CROSS_SPECTRA,
    CrossChannels,
    CrossSpectraSettings,
    cross_channels,
    cross_spectra_settings,
)
from tdacoustic.measured.runs import MeasuredRun, receivers
from tdacoustic.measured.tasks import as_read
from tdacoustic.steps import Task

if TYPE_CHECKING:
    from tdacoustic.workflows.second_pass import FirstPass, SecondPass

__all__ = [
    "ContributionPlan",
    "campaign_contributions",
    "contribution_plan",
    "contribution_task",
    "cross_spectra_tasks",
]

RUN_KIND: Final = "cross spectra"
WHOLE_KIND: Final = "contributions"
"""Kinds of the second pass."""
DRAWS: Final = 60
"""Resamplings of the segments."""
CLASSES: Final = 6
"""Operating states of a run-up, at most."""
CLASS_RATIO: Final = 1.1
"""Highest over lowest speed of such a state, at least [assumed]."""
CLASS_SEGMENTS: Final = 3
"""Segments of such a state, at least."""
STANDS: Final = 0.05
"""Part of a run-up's highest speed below which it stands [assumed]."""
MOST_STATES: Final = 32
"""More take memory and time, and tell little more."""
LOWEST_HZ: Final = 20.0
FIRST: Final = ("motor", "gearbox")
"""Components that are named first."""


@dataclass(frozen=True)
class ContributionPlan:
    """What is asked of the runs' cross spectra.

    Parameters
    ----------
    settings : ContributionSettings
    sources : mapping of str to str
        Name of an input of the step -> run.
    states : tuple of ContributionState
    spans : tuple of NamedSpan
    notes : tuple of str
        Runs and channels left out, and why.
    """

    settings: ContributionSettings
    sources: Mapping[str, str]
    states: tuple[ContributionState, ...]
    spans: tuple[NamedSpan, ...]
    notes: tuple[str, ...]


def cross_spectra_tasks(first: FirstPass) -> dict[str, Task]:
    """Return the task of each run that has references and receivers on one raster."""
    tasks = {}
    for run in first.measured:
        settings = _cross_settings(first, run)
        if settings is not None:
            prepared = first.prepared[run.name]
            tasks[run.name] = CROSS_SPECTRA.task(f"run {run.name}", settings, logs=prepared.logs)
    return tasks


def _channels(first: FirstPass, run: MeasuredRun) -> CrossChannels:
    if run.recording is None:
        return CrossChannels((), ())
    return cross_channels(run.recording, receivers(first.runs), run.usable_channels)


def _cross_settings(first: FirstPass, run: MeasuredRun) -> CrossSpectraSettings | None:
    """Settings of a run's cross spectra; None where it has none, or too short a record."""
    chosen = _channels(first, run)
    if not chosen.references or run.recording is None or run.measurement is None:
        return None
    channels = [as_read(run.recording[name]) for name in (*chosen.references, *chosen.receivers)]
    try:
        return cross_spectra_settings(channels, len(chosen.references), run.measurement.steady)
    except AnalysisError:
        return None


def contribution_task(first: FirstPass, done: Mapping[str, Task]) -> Task | None:
    """Return the task of the whole campaign, or None where no run has cross spectra or is an operating state.

    Parameters
    ----------
    first : FirstPass
    done : mapping of str to Task
        By run, the cross spectra that could be computed.
    """
    plan = contribution_plan(first, done)
    if plan is None or not plan.states:
        return None
    label = f"{len(plan.states)} operating state{'s' if len(plan.states) != 1 else ''}"
    return CONTRIBUTIONS.task(label, plan.settings, **{name: done[run] for name, run in plan.sources.items()})


def campaign_contributions(first: FirstPass, second: SecondPass) -> CampaignContributions | None:
    """Return what was found with the runs and spans it is of; None where the step was not made or failed.

    Parameters
    ----------
    first : FirstPass
    second : SecondPass
    """
    result: Contributions | None = second.whole.get(WHOLE_KIND)
    plan = None if result is None else contribution_plan(first, second.done.get(RUN_KIND, ()))
    if plan is None or result is None:
        return None
    states = {state.name: state for state in plan.states}
    left_out = [f"run {states[name].run}{_at_speed(states[name])}: {why}" for name, why in result.left_out]
    gone = {name for name, _ in result.left_out}
    kept = tuple(state for state in plan.states if state.name not in gone)
    return CampaignContributions(plan.settings.groups, kept, plan.spans, result, (*plan.notes, *left_out))


def _at_speed(state: ContributionState) -> str:
    return "" if state.steady or state.train_speed_km_h is None else f" at {state.train_speed_km_h:.3g} km/h"


def contribution_plan(first: FirstPass, runs: Collection[str]) -> ContributionPlan | None:
    """Return states, groups and spans; None where there is nothing to hold against each other.

    Parameters
    ----------
    first : FirstPass
    runs : collection of str
        Whose cross spectra could be computed.
    """
    held = {run.name: (run, _channels(first, run)) for run in first.measured}
    notes = _left_out([chosen for _, chosen in held.values() if chosen.references])
    chosen = {name: item for name, item in held.items() if name in runs}
    if not chosen:
        return None
    references = _common_references([item.references for _, item in chosen.values()], notes)
    kept: dict[str, MeasuredRun] = {}
    for name, (run, item) in chosen.items():
        missing = [reference for reference in references if reference not in item.references]
        if missing:
            notes.append(f"run {name}: without {', '.join(missing)}, which most runs have")
        else:
            kept[name] = run
    if not kept:
        return None
    heard = [name for name in receivers(first.runs) if any(name in chosen[run][1].receivers for run in kept)]
    return _plan(first, kept, references, heard, notes)


def _plan(
    first: FirstPass, runs: Mapping[str, MeasuredRun], references: Sequence[str], heard: Sequence[str], notes: list[str]
) -> ContributionPlan:
    sources: dict[str, str] = {}
    states: list[ContributionState] = []
    asked: list[RunState] = []
    tones: dict[str, Sequence[Stretch]] = {}
    steps, ends = [], []
    for number, (name, run) in enumerate(runs.items()):
        settings = _cross_settings(first, run)
        assert settings is not None
        of_run = _states_of(first, run, settings, str(number), heard)
        if not of_run:
            notes.append(f"run {name}: {_why_no_state(first, run)}, so it is no operating state")
            continue
        if len(states) + len(of_run) > MOST_STATES:
            notes.append(f"run {name}: {MOST_STATES} operating states are taken at most")
            continue
        sources[f"run_{number}"] = name
        steps.append(settings.plan.frames.resolution_hz)
        ends.append(float(settings.plan.frequencies_hz[-1]))
        for state, segments, stretches in of_run:
            states.append(state)
            tones[state.name] = stretches
            lines = tuple(0.5 * (s.low_hz + s.high_hz) for s in stretches if state.steady and s.mean_square > 0.0)
            asked.append(RunState(state.name, f"run_{number}", segments, lines))
    excluded = {
        state.name: [item.frequency_hz for item in first.campaign.excludes if item.condition == state.condition]
        for state in states
    }
    low_hz, high_hz = first.campaign.analysis.level_band_hz or (LOWEST_HZ, np.inf)
    named = spans(tones, excluded, low_hz, min(high_hz, *ends), max(steps)) if states else ()
    owner = _owners(first, runs.values())
    groups = {component: tuple(r for r in references if owner[r] == component) for component in owner.values()}
    order = [*(name for name in FIRST if name in groups), *(name for name in groups if name not in FIRST)]
    asked_of = ContributionSettings(
        tuple(asked),
        tuple((name, groups[name]) for name in order if groups[name]),
        tuple(heard),
        tuple(item.span for item in named if item.kind in ("total", "broadband", "band")),
        tuple(item.span for item in named if item.kind in ("tones", "order", "tone")),
        PathSettings(draws=DRAWS),
    )
    return ContributionPlan(asked_of, sources, tuple(states), named, tuple(notes))


def _left_out(chosen: Sequence[CrossChannels]) -> list[str]:
    """Channels left out of any run, those of one reason together."""
    reasons: dict[str, dict[str, None]] = {}
    for item in chosen:
        for name, why in item.left_out:
            reasons.setdefault(why, {})[name] = None
    return [f"{', '.join(names)}: {why}" for why, names in reasons.items()]


def _common_references(of_runs: Sequence[Sequence[str]], notes: list[str]) -> tuple[str, ...]:
    """References that half of the runs have, at least; paths take the same ones in all."""
    counts = Counter(name for references in of_runs for name in references)
    rare = [name for name, count in counts.items() if 2 * count < len(of_runs)]
    if rare:
        notes.append(f"{', '.join(rare)}: usable in fewer than half of the runs")
    return tuple(name for name in counts if name not in rare)


def _owners(first: FirstPass, runs: Collection[MeasuredRun]) -> dict[str, str]:
    """Component of each channel."""
    channels = [channel for run in runs if run.recording is not None for channel in run.recording.channels]
    return {channel.name: channel.component for channel in channels if channel.component is not None}


# ---------------------------------------------------------------- states

StateOfRun = tuple[ContributionState, tuple[int, ...] | None, tuple[Stretch, ...]]
"""A state, its segments, its tones and orders."""


def _states_of(
    first: FirstPass, run: MeasuredRun, settings: CrossSpectraSettings, number: str, heard: Sequence[str]
) -> list[StateOfRun]:
    """The operating states of a run: itself, or of a run-up its segments by speed."""
    assert run.measurement is not None
    drive, condition = first.drive(run), run.run.condition or ""
    step_hz = settings.plan.frames.resolution_hz
    if run.measurement.steady:
        kinematics = first.kinematics.get(run.name)
        motor_hz, km_h = steady_speeds(run, drive)
        if kinematics is not None:
            motor_hz, km_h = kinematics.motor_hz, km_h or kinematics.train_speed_km_h
        tones = steady_tones(run, heard, kinematics, first.campaign.excludes, step_hz)
        return [(ContributionState(number, run.name, condition, km_h, motor_hz, True), None, tones)]
    found: list[StateOfRun] = []
    times = settings.channels[0].start_s + settings.plan.segment_times_s
    speeds = run_speeds(run, drive, times)
    for place, segments in enumerate([] if speeds is None else _classes(speeds.leading)):
        assert speeds is not None
        at = list(segments)
        motor = None if speeds.motor_hz is None else speeds.motor_hz[at]
        km_h = None if speeds.train_km_h is None else float(speeds.train_km_h[at].mean())
        orders: tuple[Stretch, ...] = ()
        if drive is not None and motor is not None:
            highest_hz = float(settings.plan.frequencies_hz[-1])
            orders = orders_between(drive, float(motor.min()), float(motor.max()), highest_hz, step_hz)
        state = ContributionState(
            f"{number}.{place}", run.name, condition, km_h, None if motor is None else float(motor.mean()), False
        )
        found.append((state, segments, orders))
    return found


def _why_no_state(first: FirstPass, run: MeasuredRun) -> str:
    if run_speeds(run, first.drive(run), np.zeros(0)) is None:
        return "its speed is not known over time"
    return f"it has at no speed the {CLASS_SEGMENTS} segments that a state takes"


def _classes(speed: np.ndarray) -> list[tuple[int, ...]]:
    """Segments of a run-up by speed, slow ones first; those where it stands or is not known belong to none."""
    known = np.isfinite(speed) & (np.nan_to_num(speed) > STANDS * np.nanmax(speed, initial=0.0))
    if known.sum() < CLASS_SEGMENTS:
        return []
    low, high = float(speed[known].min()), float(speed[known].max())
    count = int(np.clip(np.log(high / low) / np.log(CLASS_RATIO), 1, CLASSES))
    place = np.full(speed.shape, -1)
    place[known] = np.minimum(count * np.log(speed[known] / low) / max(np.log(high / low), 1e-12), count - 1).astype(
        int
    )
    members = [tuple(int(k) for k in np.flatnonzero(place == number)) for number in range(count)]
    return [segments for segments in members if len(segments) >= CLASS_SEGMENTS]


def missing_components(first: FirstPass, second: SecondPass) -> list[str]:
    """Return what keeps a campaign with sensors and microphones from contributions, one line.

    Parameters
    ----------
    first : FirstPass
    second : SecondPass
    """
    recordings = [run.recording for run in first.measured if run.recording is not None]
    sensors = {c.name for recording in recordings for c in recording.channels if c.quantity == "acceleration"}
    if not sensors or not receivers(first.runs):
        return []
    if any(_channels(first, run).references for run in first.measured):
        plan = contribution_plan(first, second.done.get(RUN_KIND, ()))
        if plan is None or plan.states:
            return []
        return [f"no contributions of components: {'; '.join(plan.notes)}"]
    named = {c.name for recording in recordings for c in recording.channels if c.component is not None}
    why = "is in order and of the same clock as a microphone" if sensors & named else "names the component it sits on"
    return [f"no contributions of components: no accelerometer {why}"]
