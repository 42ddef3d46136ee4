"""What is computed once a campaign's runs are measured: what asks for their speed, their verdicts, or each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.steps import execute, lineage, result_of

if TYPE_CHECKING:
    from tdacoustic.attribution import RunKinematics
    from tdacoustic.campaign import Campaign
    from tdacoustic.fleet import Fleet, Kinematics
    from tdacoustic.measured.runs import MeasuredRun
    from tdacoustic.steps import Jobs, Progress, Record, Store, Task
    from tdacoustic.workflows.runs import PreparedRun

__all__ = ["FirstPass", "SecondPass", "second_pass"]


@dataclass(frozen=True)
class FirstPass:
    """What is known of a campaign before its second pass.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet or None
    prepared : mapping of str to PreparedRun
        By run: its recording and its tasks, that of the speed among them.
    runs : tuple of MeasuredRun
        All of the campaign.
    kinematics : mapping of str to RunKinematics
        By steady run; empty without a fleet.
    """

    campaign: Campaign
    fleet: Fleet | None
    prepared: Mapping[str, PreparedRun]
    runs: tuple[MeasuredRun, ...]
    kinematics: Mapping[str, RunKinematics]

    @property
    def measured(self) -> tuple[MeasuredRun, ...]:
        """Test runs that could be measured."""
        return tuple(run for run in self.runs if run.run.kind == "test" and run.measurement is not None)

    def drive(self, run: MeasuredRun) -> Kinematics | None:
        """Return the kinematics of a run's drive, its wheels as worn as the run states; None without a fleet."""
        if self.fleet is None:
            return None
        from tdacoustic.fleet import Kinematics

        return Kinematics.of(self.fleet, run.run.wheel_diameter_mm)


@dataclass(frozen=True)
class SecondPass:
    """What the second pass found.

    Parameters
    ----------
    results : mapping of str to mapping
        By kind, then by run.
    problems : tuple of str
    records : mapping of str to Record
        By key.
    whole : mapping of str to result
        Of the whole campaign, by kind.
    done : mapping of str to tuple of str
        By kind, the runs whose task could be computed.
    made : bool
        Whether there was a second pass at all.
    """

    results: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    problems: tuple[str, ...] = ()
    records: Mapping[str, Record] = field(default_factory=dict)
    whole: Mapping[str, Any] = field(default_factory=dict)
    done: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    made: bool = False

    def of_kind(self, kind: str) -> Mapping[str, Any]:
        """Return the results of a kind by run; empty where there are none."""
        return self.results.get(kind, {})


RunTasks = Mapping[str, "Task"]
"""By run."""


def _orders(first: FirstPass) -> RunTasks:
    from tdacoustic.workflows.order_tracking import order_tasks

    return order_tasks(first)


def _tones(first: FirstPass) -> RunTasks:
    from tdacoustic.workflows.tonality import hearing_tasks

    return hearing_tasks(first)


def _cross_spectra(first: FirstPass) -> RunTasks:
    from tdacoustic.workflows.contributions import cross_spectra_tasks

    return cross_spectra_tasks(first)


def _bands_of_modes(first: FirstPass) -> RunTasks:
    from tdacoustic.workflows.modes import mode_tasks

    return mode_tasks(first)


def _contributions(first: FirstPass, done: Mapping[str, RunTasks]) -> Task | None:
    from tdacoustic.workflows.contributions import contribution_task

    return contribution_task(first, done["cross spectra"])


KINDS: Final[Mapping[str, Callable[[FirstPass], RunTasks]]] = {
    "orders": _orders,
    "tones": _tones,
    "cross spectra": _cross_spectra,
    "bands of the modes": _bands_of_modes,
}
"""What makes the tasks of each kind."""

KEPT_IN_THE_STORE: Final = frozenset({"cross spectra"})
"""Kinds of which only tasks of the whole campaign need the results, which are large."""

WHOLE_KINDS: Final[Mapping[str, Callable[[FirstPass, Mapping[str, RunTasks]], Task | None]]] = {
    "contributions": _contributions
}
"""What makes the task of the whole campaign of each kind, of the tasks of its runs, by kind, that could be computed."""


def second_pass(first: FirstPass, store: Store, jobs: Jobs, progress: Progress | None) -> SecondPass:
    """Compute what rests on the runs' measurements; what fails of one run stops nothing else.

    Parameters
    ----------
    first : FirstPass
    store : Store
    jobs : int or Executor
    progress : callable or None
    """
    tasks = {kind: make(first) for kind, make in KINDS.items()}
    every = [task for of_kind in tasks.values() for task in of_kind.values()]
    outcome = execute(every, store, jobs, progress) if every else None
    failed = {} if outcome is None else outcome.failed
    results: dict[str, dict[str, Any]] = {}
    done: dict[str, dict[str, Task]] = {kind: {} for kind in tasks}
    problems: list[str] = []
    records: dict[str, Record] = {}
    for kind, of_kind in tasks.items():
        for run, task in of_kind.items():
            if task.key in failed:
                problems.append(f"run {run!r}: no {kind}: {failed[task.key]}")
                continue
            done[kind][run] = task
            records.update(lineage(task, store))
            if kind not in KEPT_IN_THE_STORE:
                results.setdefault(kind, {})[run] = result_of(task, store)
    whole: dict[str, Any] = {}
    for kind, make_whole in WHOLE_KINDS.items():
        of_campaign = make_whole(first, done)
        if of_campaign is None:
            continue
        failed = execute([of_campaign], store, jobs, progress).failed
        if of_campaign.key in failed:
            problems.append(f"no {kind}: {failed[of_campaign.key]}")
        else:
            whole[kind] = result_of(of_campaign, store)
            records.update(lineage(of_campaign, store))
    ran = {kind: tuple(of_kind) for kind, of_kind in done.items()}
    return SecondPass(results, tuple(problems), records, whole, ran, made=True)
