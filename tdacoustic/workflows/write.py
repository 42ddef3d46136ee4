"""Results as files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdacoustic.reporting.template import ReportTemplate, load_template
from tdacoustic.workflows.named import named
from tdacoustic.workflows.output import OutputFolder

if TYPE_CHECKING:
    import pandas as pd

    from tdacoustic.campaign import Campaign
    from tdacoustic.reporting.document import Document
    from tdacoustic.results import Analysis, CampaignCalibration, CampaignResult, FleetPrediction, LogInput
    from tdacoustic.steps import Record
    from tdacoustic.tables.prediction_file import ModelArrays
    from tdacoustic.workflows.made_from import FilesRead

__all__ = [
    "PDF",
    "ReportTemplate",
    "check_pdf",
    "load_template",
    "write_analysis",
    "write_calibration",
    "write_check",
    "write_prediction",
    "write_report",
    "write_run",
]

ARRAYS = "result.h5"
PDF = "report.pdf"


def check_pdf(wanted: bool) -> None:
    """Raise `MissingPackageError`, before anything is computed, where a PDF is wanted and its library is missing."""
    if wanted:
        from tdacoustic.reporting.pdf import check_reportlab

        check_reportlab()


def write_analysis(analysis: Analysis, folder: OutputFolder, command: str, pdf: bool = False) -> None:
    """Write tables, ``result.h5`` and ``report.html`` of an analysis into an output folder.

    Parameters
    ----------
    analysis : Analysis
    folder : OutputFolder
        Not entered yet.
    command : str
        For the manifest.
    pdf : bool
        Whether ``report.pdf`` is written too.
    """
    from tdacoustic.reporting.measured_report import measured_report

    with folder:
        _write_tables(folder, analysis.tables)
        _write_arrays(folder, analysis.campaign, analysis)
        write_report(folder, partial(measured_report, analysis), pdf, _template_of(analysis.campaign))
        folder.manifest = _manifest(analysis, command)


def write_check(analysis: Analysis, out: Path, subject: Path, overwrite: bool) -> None:
    """Write ``quality.csv`` into an output folder, beside what a whole run has left there."""
    with OutputFolder(out, subject, overwrite, keep=True) as folder:
        _write_tables(folder, {"quality": analysis.tables["quality"]})
        folder.manifest = _manifest(analysis, "check")


def write_prediction(
    result: FleetPrediction, folder: OutputFolder, pdf: bool = False, template: ReportTemplate | None = None
) -> None:
    """Write tables, ``result.h5`` and ``report.html`` of a prediction into an output folder.

    Parameters
    ----------
    result : FleetPrediction
    folder : OutputFolder
        Not entered yet.
    pdf : bool
        Whether ``report.pdf`` is written too.
    template : ReportTemplate, optional
        How a company wants the report.
    """
    from tdacoustic.reporting.predicted_report import predicted_report
    from tdacoustic.tables.prediction_file import write_prediction_file

    with folder:
        _write_tables(folder, result.tables)
        write_prediction_file(folder.staging / ARRAYS, _model_arrays(result))
        write_report(folder, partial(predicted_report, result), pdf, template)
        folder.manifest = {
            "command": "predict",
            "fleet": {"name": result.fleet.name},
            "inputs": _inputs(result.inputs),
            "steps": _steps(result.records),
            "versions": result.versions,
            "problems": list(result.prediction.doubts),
        }


def write_calibration(result: CampaignCalibration, folder: OutputFolder, pdf: bool = False) -> None:
    """Write ``calibration.json``, ``fleet.calibrated.toml``, ``result.h5`` and ``report.html`` into an output folder.

    Parameters
    ----------
    result : CampaignCalibration
    folder : OutputFolder
        Not entered yet.
    pdf : bool
        Whether ``report.pdf`` is written too.
    """
    from tdacoustic.reporting.calibration_report import calibration_report

    with folder:
        _write_fit(folder, result)
        _write_tables(folder, _asked(result))
        _write_arrays(folder, result.campaign, result.analysis)
        write_report(folder, partial(calibration_report, result), pdf, _template_of(result.campaign))
        folder.manifest = {
            "command": "calibrate",
            "campaign": named(result.campaign, result.analysis),
            "fleet": {"name": result.fleet.name},
            "inputs": _inputs(result.inputs),
            "versions": result.versions,
            "problems": list(result.calibration.doubts),
        }


def write_run(result: CampaignResult, folder: OutputFolder, read: FilesRead | None = None, pdf: bool = False) -> None:
    """Write the files of analysis, calibration and prediction into one output folder, with one report.

    Parameters
    ----------
    result : CampaignResult
    folder : OutputFolder
        Not entered yet.
    read : FilesRead, optional
        Which files the run read; the manifest then tells a later run whether the result still holds.
    pdf : bool
        Whether ``report.pdf`` is written too.
    """
    from tdacoustic.reporting.run_report import run_report
    from tdacoustic.workflows.made_from import counts_of

    analysis, prediction = result.analysis, result.prediction
    with folder:
        _write_tables(folder, analysis.tables)
        if result.calibration is not None:
            _write_fit(folder, result.calibration)
            _write_tables(folder, _asked(result.calibration))
        if prediction is not None:
            _write_tables(folder, prediction.tables)
        _write_arrays(folder, result.campaign, analysis, prediction)
        write_report(folder, partial(run_report, result), pdf, _template_of(result.campaign))
        folder.manifest = {
            **_manifest(analysis, "run"),
            **({} if analysis.fleet is None else {"fleet": {"name": analysis.fleet.name}}),
            "inputs": _inputs(result.inputs),
            "settings": result.settings,
            "steps": _steps(result.records),
            "problems": [*result.problems, *result.doubts],
            "counts": counts_of(result.campaign),
            "made_from": None if read is None else read.made_from(result.inputs),
        }


def _write_tables(folder: OutputFolder, tables: Mapping[str, pd.DataFrame]) -> None:
    from tdacoustic.tables import csv_text

    for name, table in tables.items():
        folder.write_text(f"{name}.csv", csv_text(table))


def _write_fit(folder: OutputFolder, result: CampaignCalibration) -> None:
    from tdacoustic.fleet import fleet_toml
    from tdacoustic.workflows.calibration_file import calibration_json

    folder.write_text("calibration.json", calibration_json(result))
    folder.write_text("fleet.calibrated.toml", fleet_toml(result.calibration.fleet))


def _asked(result: CampaignCalibration) -> dict[str, pd.DataFrame]:
    """The table of what changes of the calibrated drive do, where there is one."""
    from tdacoustic.tables import what_if_table

    return {} if result.what_if is None else {"what_if": what_if_table(result.what_if)}


def _write_arrays(
    folder: OutputFolder, campaign: Campaign, analysis: Analysis | None, prediction: FleetPrediction | None = None
) -> None:
    from tdacoustic.tables.result_file import write_result_file

    model = None if prediction is None else _model_arrays(prediction)
    path, what = folder.staging / ARRAYS, (campaign.name, campaign.origin)
    if analysis is None:
        write_result_file(path, *what, (), model)
    else:
        heard = {} if analysis.tonality is None else analysis.tonality.hearing
        write_result_file(path, *what, analysis.runs, model, analysis.slips, analysis.orders, heard)


def _model_arrays(result: FleetPrediction) -> ModelArrays:
    from tdacoustic.tables.prediction_file import ModelArrays

    fleet = result.fleet
    return ModelArrays(fleet.name, result.prediction, fleet.radiation.max_frequency_hz.value)


def _template_of(campaign: Campaign) -> ReportTemplate | None:
    """How the campaign wants its reports."""
    return None if campaign.template is None else load_template(campaign.template.path)


def write_report(
    folder: OutputFolder, make: Callable[[], Document], pdf: bool, template: ReportTemplate | None = None
) -> None:
    """Write a report into an output folder that is entered: the page, and where it is wanted the PDF.

    Parameters
    ----------
    folder : OutputFolder
    make : callable
        Makes the report; it is called while the language of the template is spoken.
    pdf : bool
    template : ReportTemplate, optional
        How a company wants it.
    """
    from tdacoustic.reporting.html import render_html
    from tdacoustic.reporting.language import ENGLISH, speaking

    with speaking(ENGLISH if template is None else template.language):
        document = make() if template is None else template.applied(make())
        folder.write_text("report.html", render_html(document))
        if pdf:
            from tdacoustic.reporting.pdf import render_pdf

            (folder.staging / PDF).write_bytes(render_pdf(document))


def _manifest(analysis: Analysis, command: str) -> dict[str, Any]:
    """Return what the manifest says besides its files."""
    return {
        "command": command,
        "campaign": named(analysis.campaign, analysis),
        "inputs": _inputs(analysis.inputs),
        "settings": {key: list(v) if isinstance(v, tuple) else v for key, v in analysis.settings.items()},
        "steps": _steps(analysis.records),
        "versions": analysis.versions,
        "problems": list(analysis.problems),
    }


def _inputs(files: Sequence[LogInput]) -> list[dict[str, Any]]:
    return [
        {"file": file.written, "sha256": file.sha256, "bytes": file.n_bytes, "format": file.format} for file in files
    ]


def _steps(records: Sequence[tuple[str, Record]]) -> list[str]:
    return sorted({f"{record.step}/{record.version}" for _, record in records})
