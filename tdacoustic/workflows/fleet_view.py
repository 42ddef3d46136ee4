"""The fleet view: the results of many campaigns as one dataset and one page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import GatheringError
from tdacoustic.steps.record import versions
from tdacoustic.workflows.output import OutputFolder
from tdacoustic.workflows.write import ReportTemplate, check_pdf, write_report

if TYPE_CHECKING:
    import pandas as pd

    from tdacoustic.gathering import GatheredResult, Gathering, LeftOut, ResultFolder

__all__ = ["OVERVIEW", "fleet_view"]

OVERVIEW: Final = "results.csv"

_IN_MANIFEST: Final = 10_000
"""Results that the manifest names; the dataset names them all."""


def fleet_view(
    folders: Iterable[str | Path],
    out: str | Path,
    overwrite: bool = False,
    train_key: str | None = None,
    date_key: str | None = None,
    check_all: bool = False,
    progress: Callable[[str, float, int], None] | None = None,
    pdf: bool = False,
    template: ReportTemplate | None = None,
) -> Gathering:
    """Gather the results of campaigns in these folders and below into an output folder.

    There are ``dataset/*.parquet``, a table each (see `tdacoustic.gathering.contracts`), ``results.csv``, a row a
    campaign, ``report.html`` and ``manifest.json``. All results are read each time: that takes a few milliseconds each,
    and memory that does not grow with their tables.

    Parameters
    ----------
    folders : iterable of str or Path
        Result folders, folders with result folders below at any depth, or patterns of these.
    out : str or Path
    overwrite : bool
        Write over whatever is in `out`.
    train_key, date_key : str, optional
        Keys of a campaign's ``[meta]`` that say its train and its date, instead of the known ones.
    check_all : bool
        Whether files that are not gathered (a result's report and arrays) are held against their sha256 too.
    progress : callable, optional
        Called with what is done, how much of it and of how much.
    pdf : bool
        Whether ``report.pdf`` is written too.
    template : ReportTemplate, optional
        How a company wants the page.

    Returns
    -------
    Gathering
        What was left out, and why, is in it.

    Raises
    ------
    MissingPackageError
        pyarrow is not installed, or for a PDF reportlab.
    MissingFileError
        A folder is not there.
    GatheringError
        There is no usable result.
    OutputError
        The output folder cannot be written, or something else is in it.
    """
    from tdacoustic.gathering import LeftOut, check_pyarrow, common_folder, find_folders, named_folders
    from tdacoustic.gathering.texts import shown_text

    check_pyarrow()
    check_pdf(pdf)
    named = named_folders(folders)
    target = Path(out)
    output = OutputFolder(target, common_folder(named), overwrite)
    found, unread = find_folders(named)
    usable, left_out = _opened(found, check_all, progress)
    left_out = [*(LeftOut(shown_text(path), reason) for path, reason in unread), *left_out]
    words = "; ".join(_shown(folder) for folder in named[:5]) + ("; ..." if len(named) > 5 else "")
    if not usable:
        raise GatheringError(f"{words}: {_nothing(found, left_out)}")
    with output:
        gathering = _gathered(usable, left_out, output, (train_key, date_key), progress)
        if not gathering.results:
            raise GatheringError(f"{words}: {_nothing(found, gathering.left_out)}")
        _write(gathering, output, named, pdf, template)
    return gathering


def _nothing(found: Sequence[Path], left_out: Sequence[LeftOut]) -> str:
    """Why there is nothing to gather."""
    if not left_out:
        return "no result of a campaign in it or below"
    first = left_out[0]
    return f"none of {len(found)} folders with a manifest can be used; {first.folder}: {first.reason}"


def _opened(
    found: Sequence[Path], check_all: bool, progress: Callable[[str, float, int], None] | None
) -> tuple[list[ResultFolder], list[LeftOut]]:
    """The results by their manifests, each campaign once."""
    from tdacoustic.gathering import LeftOut, NoCampaignError, open_result, repeated

    held: list[ResultFolder] = []
    left_out: list[LeftOut] = []
    for number, folder in enumerate(found):
        if progress is not None:
            progress("looking at results", number, len(found))
        try:
            result = open_result(folder)
            for name in result.files if check_all else ():
                result.check(name)
        except NoCampaignError:
            continue
        except GatheringError as error:
            left_out.append(LeftOut(_shown(folder), str(error)))
        else:
            held.append(result)
    again = repeated(held)
    for index, stays in again.items():
        same = "the same result as" if held[index].result == held[stays].result else "of the same recordings as"
        left_out.append(LeftOut(_shown(held[index].path), f"{same} {_shown(held[stays].path)}"))
    return [result for index, result in enumerate(held) if index not in again], left_out


def _gathered(
    usable: Sequence[ResultFolder],
    left_out: list[LeftOut],
    output: OutputFolder,
    keys: tuple[str | None, str | None],
    progress: Callable[[str, float, int], None] | None,
) -> Gathering:
    """Read the results one by one into the dataset."""
    from tdacoustic.gathering import DatasetWriter, Gathering, LeftOut, compared, read_result, relative_link

    results: list[GatheredResult] = []
    links: dict[str, str] = {}
    with DatasetWriter(output.staging / "dataset", dict(versions()).get("tdacoustic", "")) as dataset:
        for number, folder in enumerate(usable):
            if progress is not None:
                progress("gathering", number, len(usable))
            try:
                read = read_result(folder, *keys)
            except GatheringError as error:
                left_out.append(LeftOut(_shown(folder.path), str(error)))
                continue
            dataset.add(read, _shown(folder.path))
            results.append(read.kept)
            link = relative_link(folder.path / "report.html", output.path) if read.kept.has_report else None
            if link is not None:
                links[folder.result] = link
    return Gathering(tuple(results), tuple(left_out), compared(results), dataset.rows, links)


def _write(
    gathering: Gathering, output: OutputFolder, named: Sequence[Path], pdf: bool, template: ReportTemplate | None
) -> None:
    from tdacoustic.reporting.fleet_report import fleet_report
    from tdacoustic.tables import csv_text

    output.write_text(OVERVIEW, csv_text(_overview(gathering)))
    write_report(output, partial(fleet_report, gathering), pdf, template)
    left_out = [{"folder": each.folder, "reason": each.reason} for each in gathering.left_out]
    output.manifest = {
        "command": "fleet",
        "folders": [_shown(folder) for folder in named[:_IN_MANIFEST]],
        "results": [result.result for result in gathering.results[:_IN_MANIFEST]],
        "n_results": len(gathering.results),
        "left_out": left_out[:_IN_MANIFEST],
        "rows": dict(gathering.rows),
        "versions": {**dict(versions()), "pyarrow": metadata.version("pyarrow")},
        "problems": [f"{each.folder}: {each.reason}" for each in gathering.left_out[:_IN_MANIFEST]],
    }


def _shown(path: Path) -> str:
    """A path as it is written, in signs that every file and terminal takes."""
    from tdacoustic.gathering.texts import shown_text

    return shown_text(path.as_posix())


def _overview(gathering: Gathering) -> pd.DataFrame:
    """A row a campaign."""
    import pandas as pd

    counts: dict[int, int] = {}
    for each in gathering.comparison.outliers:
        counts[id(each.result)] = counts.get(id(each.result), 0) + 1
    rows = []
    for result in gathering.results:
        loudest = result.loudest
        rows.append(
            {
                **result.whose(),
                **result.row(_shown(result.path)),
                "loudest_4m_db": None if loudest is None else loudest.level_4m_db,
                "loudest_at_km_h": None if loudest is None else loudest.train_speed_km_h,
                "stands_out": counts.get(id(result), 0),
            }
        )
    frame = pd.DataFrame(rows).drop(columns="started")
    return frame.astype({"year": "Int64"})
