"""Results as files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdacoustic.workflows.output import OutputFolder

if TYPE_CHECKING:
    from tdacoustic.results import Analysis, CampaignCalibration, FleetPrediction, LogInput
    from tdacoustic.steps import Record

__all__ = ["write_analysis", "write_calibration", "write_check", "write_prediction"]


def write_analysis(analysis: Analysis, folder: OutputFolder, command: str) -> None:
    """Write tables, ``result.h5`` and ``report.html`` of an analysis into an output folder.

    Parameters
    ----------
    analysis : Analysis
    folder : OutputFolder
        Not entered yet.
    command : str
        For the manifest.
    """
    from tdacoustic.reporting.html import render_html
    from tdacoustic.reporting.measured_report import measured_report
    from tdacoustic.tables import csv_text
    from tdacoustic.tables.result_file import write_result_file

    campaign = analysis.campaign
    with folder:
        for name, table in analysis.tables.items():
            folder.write_text(f"{name}.csv", csv_text(table))
        write_result_file(folder.staging / "result.h5", campaign.name, campaign.origin, analysis.runs)
        folder.write_text("report.html", render_html(measured_report(analysis)))
        folder.manifest = _manifest(analysis, command)


def write_check(analysis: Analysis, out: Path, subject: Path, overwrite: bool) -> None:
    """Write ``quality.csv`` into an output folder, beside what a whole run has left there."""
    from tdacoustic.tables import csv_text

    with OutputFolder(out, subject, overwrite, keep=True) as folder:
        folder.write_text("quality.csv", csv_text(analysis.tables["quality"]))
        folder.manifest = _manifest(analysis, "check")


def _manifest(analysis: Analysis, command: str) -> dict[str, Any]:
    """Return what the manifest says besides its files."""
    campaign = analysis.campaign
    return {
        "command": command,
        "campaign": {"name": campaign.name, "origin": campaign.origin},
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


def write_prediction(result: FleetPrediction, folder: OutputFolder) -> None:
    """Write tables, ``result.h5`` and ``report.html`` of a prediction into an output folder.

    Parameters
    ----------
    result : FleetPrediction
    folder : OutputFolder
        Not entered yet.
    """
    from tdacoustic.reporting.html import render_html
    from tdacoustic.reporting.predicted_report import predicted_report
    from tdacoustic.tables import csv_text
    from tdacoustic.tables.prediction_file import write_prediction_file

    fleet = result.fleet
    with folder:
        for name, table in result.tables.items():
            folder.write_text(f"{name}.csv", csv_text(table))
        highest_hz = fleet.radiation.max_frequency_hz.value
        write_prediction_file(folder.staging / "result.h5", fleet.name, result.prediction, highest_hz)
        folder.write_text("report.html", render_html(predicted_report(result)))
        folder.manifest = {
            "command": "predict",
            "fleet": {"name": fleet.name},
            "inputs": _inputs(result.inputs),
            "steps": _steps(result.records),
            "versions": result.versions,
            "problems": list(result.prediction.doubts),
        }


def write_calibration(result: CampaignCalibration, folder: OutputFolder) -> None:
    """Write ``calibration.json``, ``fleet.calibrated.toml``, ``result.h5`` and ``report.html`` into an output folder.

    Parameters
    ----------
    result : CampaignCalibration
    folder : OutputFolder
        Not entered yet.
    """
    from tdacoustic.fleet import fleet_toml
    from tdacoustic.reporting.calibration_report import calibration_report
    from tdacoustic.reporting.html import render_html
    from tdacoustic.tables.result_file import write_result_file
    from tdacoustic.workflows.calibrate import calibration_json

    campaign, found = result.campaign, result.calibration
    with folder:
        folder.write_text("calibration.json", calibration_json(result))
        folder.write_text("fleet.calibrated.toml", fleet_toml(found.fleet))
        runs = () if result.analysis is None else result.analysis.runs
        write_result_file(folder.staging / "result.h5", campaign.name, campaign.origin, runs)
        folder.write_text("report.html", render_html(calibration_report(result)))
        folder.manifest = {
            "command": "calibrate",
            "campaign": {"name": campaign.name, "origin": campaign.origin},
            "fleet": {"name": result.fleet.name},
            "inputs": _inputs(result.inputs),
            "versions": result.versions,
            "problems": list(found.doubts),
        }
