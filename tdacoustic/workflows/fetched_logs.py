"""The logs of a run as inputs of steps: fetched where the campaign names a URL, known by their content."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from tdacoustic.campaign import Campaign, CampaignRun, WrittenPath
from tdacoustic.errors import CampaignError, TdacousticError

if TYPE_CHECKING:
    from tdacoustic.recording import Log
    from tdacoustic.steps import LogFile, Progress, Store

__all__ = ["hashed_logs", "with_fetched_logs"]


def with_fetched_logs(
    campaign: Campaign, store: Store, fetch_urls: bool, progress: Progress | None = None
) -> tuple[Campaign, dict[str, TdacousticError]]:
    """Return a campaign whose logs are all files, and by run what could not be fetched.

    Parameters
    ----------
    campaign : Campaign
    store : Store
        Keeps what is fetched, in its folder ``fetched``.
    fetch_urls : bool
        Whether the user allows it: what a campaign names may be anywhere.
    progress : callable, optional

    Raises
    ------
    CampaignError
        A log of a valid run is named by a URL that may not be fetched.
    """
    wanted = {log.text: run for run in campaign.runs if run.valid for log in run.logs if log.to_fetch}
    if not wanted:
        return campaign, {}
    if not fetch_urls:
        url, run = next(iter(wanted.items()))
        raise CampaignError(
            f"{campaign.path}: run {run.name!r}: logs names {url!r}, which is fetched only where that is allowed: "
            "give --fetch-urls (fetch_urls=True), or name a file"
        )
    here, errors = _fetched(list(wanted), store, progress)
    runs = tuple(
        run.model_copy(update={"logs": tuple(here.get(log.text, log) for log in run.logs)}) for run in campaign.runs
    )
    failed = {}
    for run in runs:
        error = next((errors[log.text] for log in run.logs if log.text in errors), None)
        if run.valid and error is not None:
            failed[run.name] = error
    return replace(campaign, runs=runs), failed


def _fetched(
    urls: Sequence[str], store: Store, progress: Progress | None
) -> tuple[dict[str, WrittenPath], dict[str, TdacousticError]]:
    """Where each URL was fetched to, or why not."""
    from tdacoustic.steps.fetched import fetch

    here: dict[str, WrittenPath] = {}
    errors: dict[str, TdacousticError] = {}
    for number, url in enumerate(urls):

        def tell(part: float, number: int = number, url: str = url) -> None:
            if progress is not None:
                progress(f"fetching {url}", number + part, len(urls))

        tell(0.0)
        try:
            here[url] = WrittenPath(url, fetch(url, store.folder / "fetched", tell).absolute())
        except TdacousticError as error:
            errors[url] = error
    return here, errors


def hashed_logs(run: CampaignRun, scanned: Sequence[Log], store: Store) -> tuple[LogFile, ...]:
    """Return the logs of a run as inputs of a step.

    Parameters
    ----------
    run : CampaignRun
    scanned : sequence of Log
        All of the run's.
    store : Store
        Remembers hashes.
    """
    from tdacoustic.steps import log_file

    return tuple(
        log_file(log.path, store, log.companions, written.url) for log, written in zip(scanned, run.logs, strict=True)
    )
