"""The report of the main job: what the recordings show, the model held against them, what the model predicts."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.reporting.document import Block, Document, Fact, Notice, Section, Sentences
from tdacoustic.reporting.measured_report import MEASURED_FOOTER, measured_facts, measured_sections
from tdacoustic.reporting.predicted_report import PREDICTED_FOOTER, predicted_sections
from tdacoustic.reporting.sections.calibration import calibration_section
from tdacoustic.reporting.sections.gear_answer import gear_overview
from tdacoustic.reporting.sections.gear_method import method_sections
from tdacoustic.reporting.sections.provenance import ASSUMPTIONS, inputs_of, settings_of, steps_of, versions_of
from tdacoustic.reporting.sections.run_answer import run_answer
from tdacoustic.results import CampaignResult

__all__ = ["run_report"]

SYNTHETIC = "The recordings were made by a program. Nothing in this report was measured."


def run_report(result: CampaignResult) -> Document:
    """Return the report on all that was done for a campaign.

    Parameters
    ----------
    result : CampaignResult
    """
    campaign, analysis = result.campaign, result.analysis
    fleet = [] if analysis.fleet is None else [Fact("Fleet", analysis.fleet.name)]
    modelled = result.calibration is not None or result.prediction is not None
    return Document(
        title=campaign.name,
        subtitle=f"Noise and vibration of a traction drive: {_scope(result)}",
        origin=campaign.origin,
        summary=run_answer(result),
        notices=[Notice("synthetic", SYNTHETIC)] if campaign.origin == "synthetic" else [],
        sections=_parts(result),
        facts=[*measured_facts(analysis), *fleet],
        footer=[f"Made with tdacoustic {__version__}.", *MEASURED_FOOTER, *(PREDICTED_FOOTER if modelled else ())],
    )


def _scope(result: CampaignResult) -> str:
    parts = ["what the recordings show" if result.campaign.runs else "the levels that are known"]
    parts += ["the model held against them"] if result.calibration is not None else []
    parts += ["what it predicts"] if result.prediction is not None else []
    return ", ".join(parts)


def _parts(result: CampaignResult) -> list[Section]:
    """The body: a part each for recordings, calibration and prediction, and one on how the numbers came about."""
    heading = "What the recordings show" if result.campaign.runs else "The levels that are known"
    parts = [Section("recordings", heading, measured_sections(result.analysis))]
    if result.calibration is not None:
        held = calibration_section(result.calibration)
        parts.append(Section(held.id, "The model held against them", held.blocks))
    if result.prediction is not None:
        modelled = [gear_overview(result.prediction), *predicted_sections(result.prediction)]
        parts.append(Section("prediction", "What the model predicts", modelled))
    return [*parts, _provenance(result)]


def _provenance(result: CampaignResult) -> Section:
    """Inputs, settings, assumptions, methods, steps and versions, of all parts together."""
    blocks: list[Block] = [
        *inputs_of(result.inputs),
        settings_of(result.settings),
        Section("assumptions", "Assumptions on the recordings", [Sentences(ASSUMPTIONS)]),
        *(method_sections(result.prediction) if result.prediction is not None else ()),
        *steps_of(result),
        versions_of(result.analysis.versions),
    ]
    return Section("provenance", "How the numbers came about", blocks)
