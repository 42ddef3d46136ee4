"""Arguments and options that commands of the program share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "Campaign",
    "Campaigns",
    "FetchUrls",
    "Jobs",
    "Logs",
    "ManyOut",
    "Out",
    "Overwrite",
    "Pdf",
    "Quiet",
    "Scheduler",
    "StorePath",
    "Template",
]

Campaign = Annotated[Path, typer.Argument(help="campaign.toml, or the folder it is in.", show_default=False)]
Campaigns = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="CAMPAIGN...", help="campaign.toml, or the folder it is in; a glob of either.", show_default=False
    ),
]
Logs = Annotated[list[Path], typer.Argument(help="Logs, in any format that docs/formats.md names.", show_default=False)]
Out = Annotated[
    Path | None, typer.Option("-o", "--out", help="Output folder.", show_default="reports/<folder of the campaign>")
]
ManyOut = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--out",
        help="Output folder; of several campaigns, the folder of theirs.",
        show_default="reports/<folder of the campaign>",
    ),
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
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Compute on the workers of this dask.distributed scheduler, as tcp://host:8786; trust it.",
        show_default=False,
    ),
]
Pdf = Annotated[bool, typer.Option("--pdf", help="Write report.pdf too: the report for paper.")]
Template = Annotated[
    Path | None,
    typer.Option(
        "--template", help="The company's template of the report: template.toml, or its folder.", show_default=False
    ),
]
FetchUrls = Annotated[bool, typer.Option("--fetch-urls", help="Fetch logs that a campaign names by URL.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print errors alone.")]
