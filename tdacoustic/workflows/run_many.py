"""Many campaigns: what is up to date stays, the others are worked through in processes, and a table tells of all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import AnalysisError
from tdacoustic.steps import Store, default_store_path
from tdacoustic.workflows.campaign_list import ListedCampaign, output_folders
from tdacoustic.workflows.output import sweep_left_overs
from tdacoustic.workflows.run_many_table import TABLE, CampaignRow, check_table, write_table
from tdacoustic.workflows.run_many_work import CampaignJob, Told
from tdacoustic.workflows.run_many_workers import n_workers, work_through
from tdacoustic.workflows.up_to_date import standing
from tdacoustic.workflows.write import PDF, check_pdf

if TYPE_CHECKING:
    from tdacoustic.steps import Jobs

__all__ = ["ManyRuns", "run_many"]

_SHOWN_LENGTH: Final = 60
"""Of the names that a progress bar has beside it."""

Progress = Callable[[str, float, int], None]
"""Called with what is being worked on, how many campaigns are done, and how many there are."""


@dataclass(frozen=True)
class ManyRuns:
    """What became of many campaigns.

    Parameters
    ----------
    rows : tuple of CampaignRow
        In the order of the campaigns.
    table : Path
        The CSV.
    note : str or None
        Why results do not simply go by the names of their folders.
    n_workers : int
        Processes that worked.
    peak_bytes : int
        What one of them held at most; 0 where nobody worked, or the system does not tell.
    """

    rows: tuple[CampaignRow, ...]
    table: Path
    note: str | None
    n_workers: int
    peak_bytes: int

    def in_words(self, took_s: float) -> str:
        """Return how the campaigns add up, in one line."""
        words = ("done", "unchanged", "failed")
        counts = {word: sum(row.told.status == word for row in self.rows) for word in words}
        parts = [f"{n} {word}" for word, n in counts.items() if n]
        workers = f" by {self.n_workers} worker{'s' if self.n_workers > 1 else ''}" if self.n_workers else ""
        memory = f", at most {self.peak_bytes >> 20} MiB each" if self.peak_bytes else ""
        return f"{', '.join(parts)}: {took_s:.1f} s{workers}{memory}"

    @property
    def failed(self) -> tuple[CampaignRow, ...]:
        """The campaigns that failed."""
        return tuple(row for row in self.rows if row.told.status == "failed")


class _Book:
    """The rows as they fill, written when all is done and when the work is interrupted."""

    def __init__(self, campaigns: Sequence[ListedCampaign], folders: Sequence[Path], root: Path) -> None:
        self.rows = [CampaignRow(item.given, out) for item, out in zip(campaigns, folders, strict=True)]
        self.root = root
        self.peak_bytes = 0

    @property
    def n_settled(self) -> int:
        return sum(row.told.status != "open" for row in self.rows)

    def settle(self, index: int, told: Told) -> None:
        self.rows[index] = replace(self.rows[index], told=told)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Write the table in any case; say how far the work came where it is interrupted."""
        try:
            yield
        except KeyboardInterrupt:
            write_table(self.root, self.rows)
            raise KeyboardInterrupt(f"{self.n_settled} of {len(self.rows)} campaigns are settled") from None
        write_table(self.root, self.rows)


def run_many(
    campaigns: Sequence[ListedCampaign],
    root: str | Path = "reports",
    store: str | Path | Store | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    *,
    overwrite: bool = False,
    again: bool = False,
    inner: Jobs | None = None,
    fetch_urls: bool = False,
    pdf: bool = False,
) -> ManyRuns:
    """Run campaigns (`tdacoustic.run`), each into a folder of its own below a root.

    A campaign whose result is up to date is left as it is: software, and all files that were read and written, are as
    the manifest says. Every other one goes through the store, so that only what changed is computed.

    Parameters
    ----------
    campaigns : sequence of ListedCampaign
        As of `tdacoustic.workflows.campaign_list.listed_campaigns`.
    root : path
    store : path or Store, optional
        One for all; default `tdacoustic.steps.default_store_path`.
    jobs : int, optional
        Worker processes; default as many as pay (`tdacoustic.workflows.run_many_workers.n_workers`). Where one campaign
        alone needs work, processes within it, as of `tdacoustic.run`.
    progress : callable, optional
    overwrite : bool
        Write over whatever is in the folders.
    again : bool
        Assemble results that are up to date too.
    inner : Executor, optional
        What computes the steps of each campaign, instead of its worker.
    fetch_urls : bool
        As of `tdacoustic.run`.
    pdf : bool
        Whether each result has ``report.pdf`` too; one without is not up to date.

    Returns
    -------
    ManyRuns
        A campaign that fails does not stop the others.

    Raises
    ------
    OutputError
        Before anything is computed: results would lie in each other, or something else is in the way of the table.
    MissingPackageError
        A PDF is wanted, and reportlab is not installed.
    """
    check_pdf(pdf)
    root = Path(root)
    store = store if isinstance(store, Store) else Store(store or default_store_path())
    if not campaigns:
        raise AnalysisError("there is no campaign to run")
    folders, note = output_folders(campaigns, root)
    check_table(root, overwrite)
    book = _Book(campaigns, folders, root)
    _sweep((*folders, root / TABLE))
    with book.kept():
        open_ones = _left(campaigns, folders, store, book, again, progress, pdf)
        n = n_workers(len(open_ones), jobs) if open_ones else 0
        within = inner if inner is not None else jobs if len(open_ones) == 1 else 1
        work = [
            CampaignJob(
                i,
                campaigns[i].given,
                campaigns[i].file,
                folders[i],
                _absolute(store),
                within,
                overwrite,
                fetch_urls,
                pdf,
            )
            for i in open_ones
        ]
        _work(work, n, book, progress)
    return ManyRuns(tuple(book.rows), root / TABLE, note, n, book.peak_bytes)


def _sweep(results: Iterable[Path]) -> None:
    """Take away what killed runs left beside results, also beside those that are up to date."""
    names: dict[Path, set[str]] = {}
    for path in results:
        names.setdefault(path.parent, set()).add(path.name)
    for parent, held in names.items():
        sweep_left_overs(parent, held)


def _absolute(store: Store) -> Path:
    return Path(os.path.abspath(store.folder))  # noqa: PTH100 - as it is written, links and all


def _left(
    campaigns: Sequence[ListedCampaign],
    folders: Sequence[Path],
    store: Store,
    book: _Book,
    again: bool,
    progress: Progress | None,
    pdf: bool,
) -> list[int]:
    """Settle what is up to date; return the places of the others."""
    left = []
    for index, (campaign, folder) in enumerate(zip(campaigns, folders, strict=True)):
        if progress is not None:
            progress("looking what is up to date", book.n_settled, len(campaigns))
        held = None if again else standing(folder, campaign.file, store, (PDF,) if pdf else ())
        if held is None:
            left.append(index)
        else:
            book.settle(index, Told("unchanged", **asdict(held), steps_computed=0, steps_found=0))
    return left


def _work(jobs: Sequence[CampaignJob], n: int, book: _Book, progress: Progress | None) -> None:
    def tell(current: Iterable[CampaignJob]) -> None:
        if progress is not None:
            progress(_shortened(", ".join(job.given for job in current)), book.n_settled, len(book.rows))

    with closing(work_through(jobs, n, tell)) as reports:
        for job, report in reports:
            book.settle(job.index, report.told)
            book.peak_bytes = max(book.peak_bytes, report.peak_bytes)


def _shortened(text: str) -> str:
    return text if len(text) <= _SHOWN_LENGTH else f"{text[: _SHOWN_LENGTH - 1]}…"
