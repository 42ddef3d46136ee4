"""One campaign into its result folder: computed, and written with what a later run needs to leave it as it is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdacoustic.campaign import Campaign
from tdacoustic.steps import Record, Store, default_store_path
from tdacoustic.workflows.made_from import FilesRead
from tdacoustic.workflows.output import OutputFolder
from tdacoustic.workflows.run import run
from tdacoustic.workflows.write import check_pdf, write_run

if TYPE_CHECKING:
    from tdacoustic.results import CampaignResult
    from tdacoustic.steps import Jobs
    from tdacoustic.steps.execution import Progress

__all__ = ["WrittenRun", "run_into"]


@dataclass(frozen=True)
class WrittenRun:
    """A campaign's result, which is written.

    Parameters
    ----------
    result : CampaignResult
    n_computed : int
        Steps whose results were not in the store: computed here, or for this by other processes.
    n_found : int
        Further steps behind the result: what the store held already.
    """

    result: CampaignResult
    n_computed: int
    n_found: int


def run_into(
    campaign: Campaign,
    folder: OutputFolder,
    store: str | Path | Store | None = None,
    jobs: Jobs | None = None,
    progress: Progress | None = None,
    *,
    fetch_urls: bool = False,
    pdf: bool = False,
) -> WrittenRun:
    """Do all that can be done for a campaign (`tdacoustic.run`) and write it.

    Parameters
    ----------
    campaign : Campaign
    folder : OutputFolder
        Not entered yet.
    store, jobs, progress, fetch_urls
        As of `tdacoustic.run`.
    pdf : bool
        Whether ``report.pdf`` is written too.

    Raises
    ------
    TdacousticError
        As `tdacoustic.run`, or the folder cannot be written.
    """
    check_pdf(pdf)
    place = store.folder if isinstance(store, Store) else store or default_store_path()
    tally = _Tally(place)
    read = FilesRead(campaign, tally)
    result = run(campaign, tally, jobs, progress, fetch_urls=fetch_urls)
    write_run(result, folder, read, pdf)
    steps = {key for key, _ in result.records}
    computed = tally.saved | {key for key in tally.absent if key in tally}
    return WrittenRun(result, len(computed), len(steps - computed))


class _Tally(Store):
    """A store that remembers what this process saved in it, and what it was asked for and did not hold."""

    def __init__(self, folder: str | Path) -> None:
        super().__init__(folder)
        self.saved: set[str] = set()
        self.absent: set[str] = set()

    def __reduce__(self) -> tuple[type[Store], tuple[Path]]:
        """Be a plain store in other processes: they tell nothing back."""
        return Store, (self.folder,)

    def save(self, key: str, result: Any, record: Record) -> None:
        """Keep a result, and remember that."""
        super().save(key, result, record)
        self.saved.add(key)

    def is_whole(self, key: str) -> bool:
        """Say whether there is a whole result, and remember where there is none: somebody computes it then."""
        found = super().is_whole(key)
        if not found:
            self.absent.add(key)
        return found
