"""The report of the main job: what the recordings show, the model held against them, what the model predicts."""

from __future__ import annotations

from collections.abc import Sequence

from tdacoustic import __version__
from tdacoustic.reporting.document import Block, Document, Fact, Notice, Section
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.measured_report import MEASURED_FOOTER, measured_facts, measured_sections
from tdacoustic.reporting.predicted_report import PREDICTED_FOOTER, predicted_sections
from tdacoustic.reporting.sections.calibration import calibration_section
from tdacoustic.reporting.sections.gear_answer import gear_overview
from tdacoustic.reporting.sections.gear_method import method_sections
from tdacoustic.reporting.sections.lineage import FED_BY, behind_a_fit, lineage_sections, resting_on
from tdacoustic.reporting.sections.method import method_of_measurement
from tdacoustic.reporting.sections.provenance import (
    assumptions_said,
    inputs_of,
    settings_of,
    stated_by,
    steps_of,
    versions_of,
)
from tdacoustic.reporting.sections.run_answer import run_answer
from tdacoustic.results import CampaignResult
from tdacoustic.results.campaign_calibration import settings_in_force

__all__ = ["run_report"]

SYNTHETIC = mark("The recordings were made by a program. Nothing in this report was measured.")


def run_report(result: CampaignResult) -> Document:
    """Return the report on all that was done for a campaign.

    Parameters
    ----------
    result : CampaignResult
    """
    campaign, analysis = result.campaign, result.analysis
    fleet = [] if analysis.fleet is None else [Fact(say("Fleet"), analysis.fleet.name)]
    modelled = result.calibration is not None or result.prediction is not None
    parts = _parts(result)
    behind, lineage = _lineage(result, parts)
    return Document(
        title=campaign.name,
        subtitle=say("Noise and vibration of a traction drive: {scope}", scope=_scope(result)),
        origin=campaign.origin,
        summary=run_answer(result),
        notices=[Notice("synthetic", say(SYNTHETIC))] if campaign.origin == "synthetic" else [],
        sections=[*parts, _provenance(result, behind)],
        facts=[*measured_facts(analysis), *fleet],
        footer=[
            say("Made with tdacoustic {version}.", version=__version__),
            *map(say, MEASURED_FOOTER),
            *map(say, PREDICTED_FOOTER if modelled else ()),
        ],
        lineage=lineage,
    )


def _scope(result: CampaignResult) -> str:
    parts = [say("what the recordings show") if result.campaign.runs else say("the levels that are known")]
    parts += [say("the model held against them")] if result.calibration is not None else []
    parts += [say("what it predicts")] if result.prediction is not None else []
    return ", ".join(parts)


def _parts(result: CampaignResult) -> list[Section]:
    """The body: a part each for recordings, calibration and prediction."""
    heading = say("What the recordings show") if result.campaign.runs else say("The levels that are known")
    parts = [Section("recordings", heading, measured_sections(result.analysis))]
    if result.calibration is not None:
        held = calibration_section(result.calibration)
        parts.append(Section(held.id, say("The model held against them"), held.blocks))
    if result.prediction is not None:
        modelled = [gear_overview(result.prediction), *predicted_sections(result.prediction)]
        parts.append(Section("prediction", say("What the model predicts"), modelled))
    return parts


def _lineage(result: CampaignResult, parts: Sequence[Section]) -> tuple[list[Block], dict[str, str]]:
    """What stands behind each part; parts of the model without steps lead to the whole.

    A model that was fitted to recordings rests on their levels, and so does what it predicts.
    """
    fit = behind_a_fit(result.calibration)
    of_model = {
        "calibration": fit,
        "prediction": () if result.prediction is None else (*fit, *result.prediction.records),
    }
    if fit or result.prediction is not None:
        of_model["summary"] = (*resting_on(result.records, FED_BY["summary"]), *of_model["prediction"], *fit)
    of_model = {id_: tuple(dict(records).items()) for id_, records in of_model.items()}
    beside = ("settings", "method", "versions")
    behind, lineage = lineage_sections(parts, result.records, result.inputs, of_model, beside)
    return behind, {part.id: "provenance" for part in parts} | lineage


def _provenance(result: CampaignResult, behind: Sequence[Block]) -> Section:
    """Inputs, settings, assumptions, methods, steps and versions, of all parts together."""
    blocks: list[Block] = [
        *inputs_of(result.inputs),
        settings_of(settings_in_force(result.campaign, result.calibration), stated_by(result.campaign)),
        *method_of_measurement(result.analysis),
        Section("assumptions", say("Assumptions on the recordings"), [assumptions_said()]),
        *(method_sections(result.prediction) if result.prediction is not None else ()),
        *behind,
        *steps_of(result),
        versions_of(result.analysis.versions, result.records),
    ]
    return Section("provenance", say("How the numbers came about"), blocks)
