"""The report of a calibration."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.reporting.document import Document, Notice, Section
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.calibration import calibration_answer, calibration_section
from tdacoustic.reporting.sections.lineage import behind_a_fit, lineage_sections
from tdacoustic.reporting.sections.provenance import inputs_of, settings_of, stated_by, versions_of
from tdacoustic.reporting.sections.what_if import what_if_section
from tdacoustic.results import CampaignCalibration
from tdacoustic.results.campaign_calibration import settings_in_force

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
    in_force = settings_in_force(campaign, result)
    asked_of_fit = {key: value for key, value in in_force.items() if key.startswith("calibration.")}
    fit = calibration_section(result)
    behind, lineage = lineage_sections(
        [fit], (), result.inputs, {fit.id: behind_a_fit(result)}, ("settings", "versions")
    )
    provenance = Section(
        "provenance",
        say("How the numbers came about"),
        [
            *inputs_of(result.inputs),
            settings_of(asked_of_fit, stated_by(campaign)),
            *behind,
            versions_of(result.versions, result.records),
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
