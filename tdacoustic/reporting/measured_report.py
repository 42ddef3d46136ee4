"""The report of the measured side, section by section."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.reporting.document import Document, Fact, Notice, Section
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.answer import answer
from tdacoustic.reporting.sections.clocks import clocks
from tdacoustic.reporting.sections.contributions import contributions
from tdacoustic.reporting.sections.kinematics import kinematics
from tdacoustic.reporting.sections.levels import levels
from tdacoustic.reporting.sections.lineage import lineage_sections
from tdacoustic.reporting.sections.listening import listening
from tdacoustic.reporting.sections.measured import measured
from tdacoustic.reporting.sections.modes import modes
from tdacoustic.reporting.sections.orders import orders
from tdacoustic.reporting.sections.provenance import provenance
from tdacoustic.reporting.sections.quality import quality
from tdacoustic.reporting.sections.railway import railway
from tdacoustic.reporting.sections.sensors import sensors
from tdacoustic.reporting.sections.side_by_side import side_by_side
from tdacoustic.reporting.sections.sources import sources
from tdacoustic.reporting.sections.spectra import spectra
from tdacoustic.reporting.sections.speed import speed
from tdacoustic.reporting.sections.tones import tones
from tdacoustic.results import Analysis

__all__ = ["MEASURED_FOOTER", "measured_facts", "measured_report", "measured_sections"]

MEASURED_FOOTER = (mark("Levels of sound pressure re 20 µPa, of acceleration re 1 µm/s²."),)


def measured_report(analysis: Analysis) -> Document:
    """Return the report on a campaign's measured side.

    Parameters
    ----------
    analysis : Analysis
    """
    campaign = analysis.campaign
    notices = []
    if campaign.origin == "synthetic":
        text = say("Every number of this report comes from signals made by a program. Nothing in it was measured.")
        notices.append(Notice("synthetic", text))
    sections = measured_sections(analysis)
    behind, lineage = lineage_sections(
        sections, analysis.records, analysis.inputs, beside=("settings", "method", "versions")
    )
    return Document(
        title=campaign.name,
        subtitle=say("Noise and vibration of a traction drive: what the recordings show"),
        origin=campaign.origin,
        summary=answer(analysis),
        notices=notices,
        sections=[*sections, provenance(analysis, behind)],
        facts=measured_facts(analysis),
        footer=[say("Made with tdacoustic {version}.", version=__version__), *map(say, MEASURED_FOOTER)],
        lineage=lineage,
    )


def measured_facts(analysis: Analysis) -> list[Fact]:
    """Return what stands below the title: how much was analysed.

    Parameters
    ----------
    analysis : Analysis
    """
    campaign = analysis.campaign
    n_runs = sum(run.measurement is not None for run in analysis.runs)
    return [
        Fact(say("Conditions"), ", ".join(campaign.conditions()) or say("none")),
        Fact(say("Runs analysed"), say("{count} of {all}", count=n_runs, all=len(analysis.runs))),
        Fact(say("Channels"), str(len(campaign.channels))),
    ]


def measured_sections(analysis: Analysis) -> list[Section]:
    """Return the sections on the recordings; not that on provenance.

    Parameters
    ----------
    analysis : Analysis
    """
    beside = side_by_side(analysis)
    found = [
        beside,
        listening(analysis),
        sources(analysis),
        contributions(analysis),
        modes(analysis),
        orders(analysis),
        tones(analysis),
        railway(analysis),
        kinematics(analysis),
        speed(analysis),
        measured(analysis),
        sensors(analysis),
        clocks(analysis),
        quality(analysis),
    ]
    if len(analysis.tables["levels"]):
        found.append(levels(analysis))
    if any(run.measurement is not None for run in analysis.runs):
        found.append(spectra(analysis, fold=beside is not None))
    return [section for section in found if section is not None]
