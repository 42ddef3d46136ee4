"""The program ``tdacoustic``: a thin layer over `tdacoustic.workflows`.

Nothing heavy is imported here; each command imports what it needs.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tdacoustic import __version__
from tdacoustic.errors import TdacousticError

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign as LoadedCampaign
    from tdacoustic.results import Analysis
    from tdacoustic.workflows.output import OutputFolder

__all__ = ["app", "main"]

app = typer.Typer(
    name="tdacoustic",
    help="From the logs of a locomotive's field test to a report on the noise of its traction drive.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Campaign = Annotated[Path, typer.Argument(help="campaign.toml, or the folder it is in.", show_default=False)]
Logs = Annotated[list[Path], typer.Argument(help="Logs: WAV, FLAC, HDF5, CSV, UFF 58.", show_default=False)]
Out = Annotated[
    Path | None, typer.Option("-o", "--out", help="Output folder.", show_default="reports/<folder of the campaign>")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Write over whatever is in the output folder.")]
StorePath = Annotated[
    Path | None,
    typer.Option(
        "--store", help="Where intermediate results are kept.", show_default="$TDACOUSTIC_STORE or the user cache"
    ),
]
Jobs = Annotated[
    int | None, typer.Option("--jobs", min=1, help="Processes.", show_default="one a core for large logs and housings")
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print errors alone.")]


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


def _analysed(
    campaign: Path | LoadedCampaign, store: Path | None, jobs: int | None, quiet: bool, *, deeper: bool = True
) -> Analysis:
    from tdacoustic.workflows.analyze import analyze

    with _progress(quiet) as progress:
        return analyze(campaign, store, jobs, progress, deeper=deeper)


def _toml(campaign: Path) -> Path:
    return campaign / "campaign.toml" if campaign.is_dir() else campaign


def _opened(campaign: Path, out: Path | None, overwrite: bool) -> tuple[LoadedCampaign, Path, OutputFolder]:
    """A campaign and its output folder: a wrong one, or something in the way, is said before anything is computed."""
    from tdacoustic.campaign import load_campaign
    from tdacoustic.workflows.output import OutputFolder, default_output

    loaded = load_campaign(campaign)
    target = out or default_output(_toml(campaign))
    return loaded, target, OutputFolder(target, _toml(campaign), overwrite)


def _warn(problems: Iterable[str], quiet: bool) -> None:
    for problem in () if quiet else problems:
        _say(f"warning: {problem}")


@app.command()
def info(
    logs: Logs,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    every_sample: Annotated[bool, typer.Option("--all", help="Read every sample of a large log too.")] = False,
    quiet: Quiet = False,
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
    quiet: Quiet = False,
) -> None:
    """Check the recordings of a campaign; exit 1 if a run cannot be used."""
    from tdacoustic.workflows.check import unusable_runs
    from tdacoustic.workflows.output import default_output
    from tdacoustic.workflows.write import write_check

    analysis = _analysed(campaign, store, jobs, quiet, deeper=False)
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
    quiet: Quiet = False,
) -> None:
    """Analyse the logs of a campaign: levels, spectra, lines."""
    from tdacoustic.workflows.write import write_analysis

    loaded, target, folder = _opened(campaign, out, overwrite)
    analysis = _analysed(loaded, store, jobs, quiet)
    write_analysis(analysis, folder, "analyze")
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
    quiet: Quiet = False,
) -> None:
    """Compute the model of a fleet: gear dynamics, bearing forces, meshing noise, the housing and its sound."""
    from tdacoustic.fleet import load_fleet
    from tdacoustic.workflows.output import OutputFolder, default_output
    from tdacoustic.workflows.predict import predict as compute
    from tdacoustic.workflows.write import write_prediction

    loaded = load_fleet(fleet)  # a wrong fleet is said before anything else
    target = out or default_output(loaded.path)
    folder = OutputFolder(target, loaded.path, overwrite)
    with _progress(quiet) as progress:
        result = compute(loaded, store, progress, jobs=jobs)
    write_prediction(result, folder)
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
    quiet: Quiet = False,
) -> None:
    """Fit the model of a campaign's fleet to its measured levels."""
    from tdacoustic.workflows.calibrate import calibrate as compute
    from tdacoustic.workflows.write import write_calibration

    loaded, target, folder = _opened(campaign, out, overwrite)
    with _progress(quiet) as progress:
        result = compute(loaded, store, jobs, progress)
    write_calibration(result, folder)
    _warn(result.calibration.doubts, quiet)
    if not quiet:
        print(target / "report.html")


@app.command()
def run(
    campaign: Campaign,
    out: Out = None,
    overwrite: Overwrite = False,
    store: StorePath = None,
    jobs: Jobs = None,
    quiet: Quiet = False,
) -> None:
    """Do all that can be done for a campaign and write one report: the main job."""
    from tdacoustic.workflows.run import run as compute
    from tdacoustic.workflows.summary import run_lines
    from tdacoustic.workflows.write import write_run

    loaded, target, folder = _opened(campaign, out, overwrite)
    with _progress(quiet) as progress:
        result = compute(loaded, store, jobs, progress)
    write_run(result, folder)
    _warn((*result.problems, *result.doubts), quiet)
    if not quiet:
        for line in run_lines(result):
            print(line)
        print(target / "report.html")


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
