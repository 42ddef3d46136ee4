"""The report of a calibration."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.reporting.document import Column, Document, Facts, Notice, Section, Table
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.calibration import calibration_answer, calibration_section
from tdacoustic.reporting.sections.lineage import lineage_sections
from tdacoustic.reporting.sections.what_if import what_if_section
from tdacoustic.results import CampaignCalibration

__all__ = ["calibration_report"]


def calibration_report(result: CampaignCalibration) -> Document:
    """Return the report on a calibration.

    Parameters
    ----------
    result : CampaignCalibration
    """
    campaign = result.campaign
    notices = []
    if campaign.origin == "synthetic":
        text = say("The levels come from signals made by a program. Nothing in this report was measured.")
        notices.append(Notice("synthetic", text))
    columns = (Column("file", say("File")), Column("sha256", "SHA-256"))
    fit = calibration_section(result)
    behind, lineage = lineage_sections([fit], (), result.inputs, {fit.id: result.records})
    provenance = Section(
        "provenance",
        say("How the numbers came about"),
        [
            Table("inputs", say("Inputs"), columns, [(file.written, file.sha256) for file in result.inputs]),
            *behind,
            Section("versions", say("Versions"), [Facts(list(result.versions.items()))]),
        ],
    )
    asked = None if result.what_if is None else what_if_section(result.what_if, result.calibration.fleet)
    return Document(
        title=campaign.name,
        subtitle=say("The model of {fleet}, calibrated to the campaign's levels", fleet=result.fleet.name),
        origin=campaign.origin,
        summary=calibration_answer(result),
        notices=notices,
        sections=[fit, *(() if asked is None else (asked,)), provenance],
        facts=[(say("Conditions"), ", ".join(campaign.conditions())), (say("Fleet"), result.fleet.name)],
        footer=[say("Made with tdacoustic {version}.", version=__version__), say("Levels re 20 µPa.")],
        lineage=dict.fromkeys(("summary", fit.id, "what-if"), "provenance") | lineage,
    )
