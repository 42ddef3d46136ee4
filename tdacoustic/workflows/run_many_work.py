"""What a worker process does with one of many campaigns. Nothing heavy is imported before it does."""

from __future__ import annotations

import os
import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tdacoustic.errors import TdacousticError
from tdacoustic.workflows.memory import peak_memory_bytes, used_memory_bytes

if TYPE_CHECKING:
    from tdacoustic.steps import Jobs

__all__ = ["CampaignJob", "CampaignReport", "Status", "Told", "failed_by_defect", "one_line", "work"]

Status = Literal["done", "unchanged", "failed", "open"]
"""``open``: not reached when the work was interrupted."""


@dataclass(frozen=True)
class CampaignJob:
    """A campaign that needs work.

    Parameters
    ----------
    index : int
        Its place among all campaigns.
    given : str
        Its path as the user wrote it.
    file, out : Path
        Campaign file and result folder.
    store : Path
    jobs : int or Executor or None
        As of `tdacoustic.run`.
    overwrite, fetch_urls, pdf : bool
    """

    index: int
    given: str
    file: Path
    out: Path
    store: Path
    jobs: Jobs | None = 1
    overwrite: bool = False
    fetch_urls: bool = False
    pdf: bool = False


@dataclass(frozen=True)
class Told:
    """What became of one campaign.

    Parameters
    ----------
    status : str
        ``done``, ``unchanged``, ``failed``, or ``open`` where the work was interrupted before.
    name : str
        What the campaign's file calls it; empty where that is not known.
    n_runs, n_conditions, n_problems : int or None
        None where nothing is known.
    steps_computed, steps_found : int or None
        Steps computed now, and steps whose results the store held; an unchanged campaign asks for none.
    error : str
        Why it failed, one line.
    wall_s : float or None
        Time it took.
    """

    status: Status = "open"
    name: str = ""
    n_runs: int | None = None
    n_conditions: int | None = None
    n_problems: int | None = None
    steps_computed: int | None = None
    steps_found: int | None = None
    error: str = ""
    wall_s: float | None = None


@dataclass(frozen=True)
class CampaignReport:
    """What became of a campaign, and what its worker holds.

    Parameters
    ----------
    told : Told
    pid : int
    rss_bytes, peak_bytes : int
        What the worker holds now, and held at most; 0 where the system does not tell.
    """

    told: Told
    pid: int = 0
    rss_bytes: int = 0
    peak_bytes: int = 0


def work(job: CampaignJob) -> CampaignReport:
    """Run one campaign into its folder; whatever goes wrong is told, and the worker goes on with the next."""
    start = time.perf_counter()
    try:
        told = _done(job)
    except TdacousticError as error:
        told = Told("failed", error=one_line(str(error)))
    except Exception as error:  # a defect: it must not stop the other campaigns
        told = failed_by_defect(error)
    told = replace(told, wall_s=time.perf_counter() - start)
    return CampaignReport(told, os.getpid(), used_memory_bytes(), peak_memory_bytes())


def _done(job: CampaignJob) -> Told:
    from threadpoolctl import threadpool_limits

    from tdacoustic.campaign import load_campaign
    from tdacoustic.workflows.output import OutputFolder
    from tdacoustic.workflows.run_one import run_into

    campaign = load_campaign(job.file)
    folder = OutputFolder(job.out, job.file, job.overwrite)
    with threadpool_limits(limits=1):
        written = run_into(campaign, folder, job.store, job.jobs, fetch_urls=job.fetch_urls, pdf=job.pdf)
    result = written.result
    return Told(
        status="done",
        name=campaign.name,
        n_runs=len(campaign.runs),
        n_conditions=len(campaign.conditions()),
        n_problems=len(result.problems) + len(result.doubts),
        steps_computed=written.n_computed,
        steps_found=written.n_found,
    )


def failed_by_defect(error: Exception) -> Told:
    """Return what is told of an error that nobody raised on purpose."""
    trace = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(trace[-1].filename).name}, line {trace[-1].lineno})" if trace else ""
    return Told("failed", error=one_line(f"a defect: {type(error).__name__}: {error}{where}"))


def one_line(text: str) -> str:
    """Return an error as one line."""
    return " ".join(text.split())
