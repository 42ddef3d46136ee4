"""The report of the measured side, section by section."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.reporting.document import Document, Notice
from tdacoustic.reporting.sections.answer import answer
from tdacoustic.reporting.sections.kinematics import kinematics
from tdacoustic.reporting.sections.levels import levels
from tdacoustic.reporting.sections.measured import measured
from tdacoustic.reporting.sections.provenance import provenance
from tdacoustic.reporting.sections.quality import quality
from tdacoustic.reporting.sections.side_by_side import side_by_side
from tdacoustic.reporting.sections.sources import sources
from tdacoustic.reporting.sections.spectra import spectra
from tdacoustic.reporting.sections.speed import speed
from tdacoustic.results import Analysis

__all__ = ["measured_report"]


def measured_report(analysis: Analysis) -> Document:
    """Return the report on a campaign's measured side.

    Parameters
    ----------
    analysis : Analysis
    """
    campaign = analysis.campaign
    notices = []
    if campaign.origin == "synthetic":
        text = "Every number of this report comes from signals made by a program. Nothing in it was measured."
        notices.append(Notice("synthetic", text))
    found = (side_by_side(analysis), sources(analysis), kinematics(analysis))
    beside = found[0] is not None
    sections = [section for section in found if section is not None]
    sections += [measured(analysis), quality(analysis)]
    if len(analysis.tables["levels"]):
        sections.append(levels(analysis))
    if any(run.measurement is not None for run in analysis.runs):
        sections.append(spectra(analysis, fold=beside))
    sections += [section for section in (speed(analysis), provenance(analysis)) if section is not None]
    n_runs = sum(run.measurement is not None for run in analysis.runs)
    return Document(
        title=campaign.name,
        subtitle="Noise and vibration of a traction drive: what the recordings show",
        origin=campaign.origin,
        summary=answer(analysis),
        notices=notices,
        sections=sections,
        facts=[
            ("Conditions", ", ".join(campaign.conditions()) or "none"),
            ("Runs analysed", f"{n_runs} of {len(analysis.runs)}"),
            ("Channels", str(len(campaign.channels))),
        ],
        footer=[
            f"Made with tdacoustic {__version__}.",
            "Levels of sound pressure re 20 µPa, of acceleration re 1 µm/s².",
        ],
    )
