"""The program ``tdacoustic``: a thin layer over `tdacoustic.workflows`.

Nothing heavy is imported here; each command imports what it needs.
"""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tdacoustic import __version__
from tdacoustic.cli_options import (
    Campaign,
    Campaigns,
    FetchUrls,
    Jobs,
    Logs,
    ManyOut,
    Out,
    Overwrite,
    Pdf,
    Quiet,
    Scheduler,
    StorePath,
    Template,
)
from tdacoustic.errors import TdacousticError

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign as LoadedCampaign
    from tdacoustic.results import Analysis
    from tdacoustic.steps import Cluster
    from tdacoustic.steps import Jobs as StepJobs
    from tdacoustic.workflows.campaign_list import ListedCampaign
    from tdacoustic.workflows.output import OutputFolder
    from tdacoustic.workflows.run_many import ManyRuns
    from tdacoustic.workflows.write import ReportTemplate

__all__ = ["app", "main"]

app = typer.Typer(
    name="tdacoustic",
    help="From the logs of a locomotive's field test to a report on the noise of its traction drive.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _say(text: str) -> None:
    """Print a line on stderr."""
    print(_inert(text), file=sys.stderr)


def _inert(text: str) -> str:
    """A text without what steers a terminal or turns the direction of writing: names of files come from outside."""
    return re.sub("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", "\ufffd", text)


@contextmanager
def _progress(quiet: bool) -> Iterator[Callable[[str, float, int], None] | None]:
    """Show a progress bar on a terminal; nothing in a pipe."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=None)
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)


def _cluster(scheduler: str | None, quiet: bool) -> Cluster | None:
    """The cluster that a scheduler stands for; one that cannot be used is said before anything is computed."""
    if scheduler is None:
        return None
    from tdacoustic.steps import Cluster

    cluster = Cluster(scheduler)
    _warn(cluster.doubts, quiet)
    return cluster


def _executor(jobs: int | None, scheduler: str | None, quiet: bool) -> StepJobs | None:
    """Where steps are computed, as options say it."""
    if jobs is not None and scheduler is not None:
        raise typer.BadParameter("--jobs is of this machine, --scheduler names other ones; leave one out")
    return jobs if scheduler is None else _cluster(scheduler, quiet)


def _analysed(
    campaign: Path | LoadedCampaign,
    store: Path | None,
    jobs: StepJobs | None,
    quiet: bool,
    fetch_urls: bool,
    *,
    deeper: bool = True,
) -> Analysis:
    from tdacoustic.workflows.analyze import analyze

    with _progress(quiet) as progress:
        return analyze(campaign, store, jobs, progress, deeper=deeper, fetch_urls=fetch_urls)


def _toml(campaign: Path) -> Path:
    return campaign / "campaign.toml" if campaign.is_dir() else campaign


def _opened(campaign: Path, out: Path | None, overwrite: bool) -> tuple[LoadedCampaign, Path, OutputFolder]:
    """A campaign and its output folder: a wrong one, or something in the way, is said before anything is computed."""
    from tdacoustic.campaign import load_campaign
    from tdacoustic.workflows.output import OutputFolder, default_output

    loaded = load_campaign(campaign)
    target = out or default_output(_toml(campaign))
    return loaded, target, OutputFolder(target, _toml(campaign), overwrite)


def _check_pdf(wanted: bool) -> None:
    """Say before anything is computed that a PDF cannot be written."""
    from tdacoustic.workflows.write import check_pdf

    check_pdf(wanted)


def _template(path: Path | None) -> ReportTemplate | None:
    """The template that an option names; what is wrong with it is said before anything is computed."""
    if path is None:
        return None
    from tdacoustic.workflows.write import load_template

    return load_template(path)


def _warn(problems: Iterable[str], quiet: bool) -> None:
    for problem in () if quiet else problems:
        _say(f"warning: {problem}")


@app.command()
def info(
    logs: Logs,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    every_sample: Annotated[bool, typer.Option("--all", help="Read every sample of a large log too.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Show no progress.")] = False,
) -> None:
    """Say what is in a log, in its own units; a large log is read in short stretches."""
    from tdacoustic.workflows.info import describe_log, info_text

    found = []
    for log in logs:
        with _progress(quiet) as progress:
            part: Any = None if progress is None else (lambda done, log=log: progress(f"reading {log.name}", done, 1))
            found.append(describe_log(log, part, every_sample=every_sample))
    if as_json:
        import json

        print(json.dumps([log.as_json() for log in found], indent=2, ensure_ascii=False, allow_nan=False))
        return
    print(_inert("\n\n".join(info_text(log) for log in found)))


@app.command()
def init(
    logs: Logs,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder.", show_default="the working directory")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Write over a campaign.toml that is there.")] = False,
    quiet: Quiet = False,
) -> None:
    """Make a first campaign.toml from what logs say, with what is missing marked."""
    from tdacoustic.workflows.init import write_campaign

    path, missing = write_campaign(logs, out, overwrite)
    if not quiet:
        print(path)
        for line in missing:
            _say(f"missing: {line}")


@app.command()
def check(
    campaign: Campaign,
    out: Out = None,
    overwrite: Overwrite = False,
    store: StorePath = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    fetch_urls: FetchUrls = False,
    quiet: Quiet = False,
) -> None:
    """Check the recordings of a campaign; exit 1 if a run cannot be used."""
    from tdacoustic.workflows.check import unusable_runs
    from tdacoustic.workflows.output import default_output
    from tdacoustic.workflows.write import write_check

    analysis = _analysed(campaign, store, _executor(jobs, scheduler, quiet), quiet, fetch_urls, deeper=False)
    write_check(analysis, out or default_output(_toml(campaign)), _toml(campaign), overwrite)
    table = analysis.tables["quality"]
    if not quiet:
        for row in table[table["verdict"] != "ok"].to_dict("records"):
            print(
                f"{row['verdict']}: run {row['run']}, {row['channel'] or 'whole run'}, {row['check']}: {row['detail']}"
            )
        counts = table["verdict"].value_counts()
        print(", ".join(f"{counts.get(word, 0)} {word}" for word in ("ok", "warning", "bad")))
    _warn(analysis.problems, quiet)
    unusable = unusable_runs(analysis)
    if unusable:
        raise TdacousticError("\n".join(unusable))


@app.command()
def analyze(
    campaign: Campaign,
    out: Out = None,
    overwrite: Overwrite = False,
    store: StorePath = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    fetch_urls: FetchUrls = False,
    pdf: Pdf = False,
    quiet: Quiet = False,
) -> None:
    """Analyse the logs of a campaign: levels, spectra, lines."""
    from tdacoustic.workflows.write import write_analysis

    _check_pdf(pdf)
    loaded, target, folder = _opened(campaign, out, overwrite)
    analysis = _analysed(loaded, store, _executor(jobs, scheduler, quiet), quiet, fetch_urls)
    write_analysis(analysis, folder, "analyze", pdf)
    _warn(analysis.problems, quiet)
    if not quiet:
        print(target / "report.html")


@app.command()
def predict(
    fleet: Annotated[Path, typer.Argument(help="fleet.toml, or the folder it is in.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Output folder.", show_default="reports/<folder of the fleet>")
    ] = None,
    overwrite: Overwrite = False,
    store: StorePath = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    pdf: Pdf = False,
    template: Template = None,
    quiet: Quiet = False,
) -> None:
    """Compute the model of a fleet: gear dynamics, bearing forces, meshing noise, the housing and its sound."""
    from tdacoustic.fleet import load_fleet
    from tdacoustic.workflows.output import OutputFolder, default_output
    from tdacoustic.workflows.predict import predict as compute
    from tdacoustic.workflows.write import write_prediction

    _check_pdf(pdf)
    layout = _template(template)
    loaded = load_fleet(fleet)  # a wrong fleet is said before anything else
    target = out or default_output(loaded.path)
    folder = OutputFolder(target, loaded.path, overwrite)
    executor = _executor(jobs, scheduler, quiet)
    with _progress(quiet) as progress:
        result = compute(loaded, store, progress, jobs=executor)
    write_prediction(result, folder, pdf, layout)
    _warn(result.prediction.doubts, quiet)
    if not quiet:
        print(target / "report.html")


@app.command()
def calibrate(
    campaign: Campaign,
    out: Out = None,
    overwrite: Overwrite = False,
    store: StorePath = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    fetch_urls: FetchUrls = False,
    pdf: Pdf = False,
    quiet: Quiet = False,
) -> None:
    """Fit the model of a campaign's fleet to its measured levels."""
    from tdacoustic.workflows.calibrate import calibrate as compute
    from tdacoustic.workflows.write import write_calibration

    _check_pdf(pdf)
    loaded, target, folder = _opened(campaign, out, overwrite)
    executor = _executor(jobs, scheduler, quiet)
    with _progress(quiet) as progress:
        result = compute(loaded, store, executor, progress, fetch_urls=fetch_urls)
    write_calibration(result, folder, pdf)
    _warn(result.calibration.doubts, quiet)
    if not quiet:
        print(target / "report.html")


@app.command()
def run(
    campaigns: Campaigns = None,
    out: ManyOut = None,
    overwrite: Overwrite = False,
    store: StorePath = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    fetch_urls: FetchUrls = False,
    pdf: Pdf = False,
    quiet: Quiet = False,
    list_file: Annotated[
        Path | None, typer.Option("--list", help="Campaigns too: a path or glob a line.", show_default=False)
    ] = None,
    again: Annotated[
        bool, typer.Option("--again", help="Of several: assemble results that are up to date too.")
    ] = False,
) -> None:
    """Do all that can be done for a campaign and write one report: the main job. Several go side by side."""
    from tdacoustic.workflows.campaign_list import listed_campaigns

    if not campaigns and list_file is None:
        raise typer.BadParameter("name a campaign, or a --list of them")
    _check_pdf(pdf)
    listed = listed_campaigns(campaigns or (), list_file)
    if len(listed) == 1 and list_file is None:
        _run_one(listed[0].file, out, overwrite, store, jobs, quiet, scheduler, fetch_urls, pdf)
    else:
        _run_many(listed, out, overwrite, store, jobs, quiet, again, scheduler, fetch_urls, pdf)


def _run_one(
    campaign: Path,
    out: Path | None,
    overwrite: bool,
    store: Path | None,
    jobs: int | None,
    quiet: bool,
    scheduler: str | None,
    fetch_urls: bool,
    pdf: bool,
) -> None:
    from tdacoustic.workflows.run_one import run_into
    from tdacoustic.workflows.summary import run_lines

    loaded, target, folder = _opened(campaign, out, overwrite)
    executor = _executor(jobs, scheduler, quiet)
    with _progress(quiet) as progress:
        result = run_into(loaded, folder, store, executor, progress, fetch_urls=fetch_urls, pdf=pdf).result
    _warn((*result.problems, *result.doubts), quiet)
    if not quiet:
        for line in run_lines(result):
            print(line)
        print(target / "report.html")


def _run_many(
    listed: Sequence[ListedCampaign],
    out: Path | None,
    overwrite: bool,
    store: Path | None,
    jobs: int | None,
    quiet: bool,
    again: bool,
    scheduler: str | None,
    fetch_urls: bool,
    pdf: bool,
) -> None:
    from tdacoustic.workflows.run_many import run_many

    start = time.monotonic()
    how: dict[str, Any] = {"overwrite": overwrite, "again": again, "fetch_urls": fetch_urls, "pdf": pdf}
    how["inner"] = _cluster(scheduler, quiet)
    try:
        with _progress(quiet) as progress:
            done = run_many(listed, out or "reports", store, jobs, progress, **how)
    except KeyboardInterrupt as stopped:
        _say(f"stopped; {stopped}; run again to go on")
        raise typer.Exit(1) from None
    if not quiet:
        _show_many(done, time.monotonic() - start)
    for row in done.failed:
        _say(f"error: {row.campaign}: {row.told.error}")
    if done.failed:
        raise typer.Exit(1)


def _show_many(done: ManyRuns, took_s: float) -> None:
    """Print what became of many campaigns: a table on a terminal, aligned lines in a pipe, and how they add up."""
    from tdacoustic.workflows.run_many_table import plain_lines, rich_table

    if sys.stdout.isatty():
        from rich.console import Console

        Console().print(rich_table(done.rows, _inert))
    else:
        print(_inert("\n".join(plain_lines(done.rows))))
    if done.note is not None:
        print(_inert(done.note))
    print(_inert(done.in_words(took_s)))
    print(_inert(str(done.table)))


@app.command()
def fleet(
    folders: Annotated[
        list[str],
        typer.Argument(
            metavar="DIR...", help="Result folders, folders with such below, or patterns.", show_default=False
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Output folder.")] = Path("reports/fleet"),
    overwrite: Overwrite = False,
    train_key: Annotated[
        str | None,
        typer.Option("--train-key", help="Key of [meta] that says the train.", show_default="train, vehicle, ..."),
    ] = None,
    date_key: Annotated[
        str | None, typer.Option("--date-key", help="Key of [meta] that says the date.", show_default="date, year")
    ] = None,
    check_all: Annotated[
        bool, typer.Option("--check-all", help="Check every file of a result, its report and arrays too.")
    ] = False,
    pdf: Pdf = False,
    template: Template = None,
    quiet: Quiet = False,
) -> None:
    """Gather the results of many campaigns: one dataset, one page, and what stands out."""
    from tdacoustic.workflows.fleet_view import fleet_view

    layout = _template(template)
    with _progress(quiet) as progress:
        found = fleet_view(folders, out, overwrite, train_key, date_key, check_all, progress, pdf, layout)
    left_out = [f"{each.folder} is left out: {each.reason}" for each in found.left_out]
    shown = left_out[:20]
    if len(left_out) > len(shown):
        shown.append(f"{len(left_out) - len(shown)} more are left out: see {out / 'manifest.json'}")
    _warn(shown, quiet)
    if not quiet:
        print(out / "report.html")


@app.command()
def synthesize(
    recipe: Annotated[Path, typer.Argument(help="synthesis.toml", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder.", show_default="the folder of the recipe")
    ] = None,
    overwrite: Overwrite = False,
    seed: Annotated[int | None, typer.Option("--seed", help="Instead of the recipe's.")] = None,
    quiet: Quiet = False,
) -> None:
    """Make a synthetic campaign from a recipe, labelled so."""
    from tdacoustic.synthesis import synthesize as make

    with _progress(quiet) as progress:
        hear: Any = None if progress is None else (lambda name: progress(f"run {name}", 0, 1))
        result = make(recipe, out or recipe.parent, seed, overwrite=overwrite, on_run=hear)
    _warn(result.doubts, quiet)
    if not quiet:
        print(result.campaign)


def _version(value: bool) -> None:
    if value:
        print(f"tdacoustic {__version__}")
        raise typer.Exit()


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def main(arguments: list[str] | None = None) -> None:
    """Run the program; errors are one message on stderr and exit 1, wrong usage exits 2."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a console that cannot show a character still shows the rest
    try:
        app(arguments)
    except TdacousticError as error:
        _say(f"error: {error}")
        sys.exit(1)
    except KeyboardInterrupt:
        _say("stopped; run again to go on")
        sys.exit(1)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - nobody reads on; do not complain at exit
        sys.exit(1)


if __name__ == "__main__":
    main()
