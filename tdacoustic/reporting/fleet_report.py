"""The page of the fleet view, section by section."""

from __future__ import annotations

from tdacoustic import __version__
from tdacoustic.gathering.gathered import Gathering
from tdacoustic.reporting.document import Document, Fact, Notice, Section
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.measured_report import MEASURED_FOOTER
from tdacoustic.reporting.sections.campaigns_answer import campaigns_answer
from tdacoustic.reporting.sections.campaigns_dominance import campaigns_dominance
from tdacoustic.reporting.sections.campaigns_levels import campaigns_levels
from tdacoustic.reporting.sections.campaigns_lineage import FILES_OF, files_behind, results_behind
from tdacoustic.reporting.sections.campaigns_list import campaigns_list, campaigns_sources
from tdacoustic.reporting.sections.campaigns_outliers import campaigns_outliers
from tdacoustic.reporting.sections.campaigns_parameters import campaigns_parameters
from tdacoustic.reporting.sections.campaigns_quality import campaigns_quality
from tdacoustic.reporting.sections.campaigns_rows import years_words

__all__ = ["fleet_report"]


def fleet_report(gathering: Gathering) -> Document:
    """Return the page on many campaigns.

    Parameters
    ----------
    gathering : Gathering
        Of at least one result.
    """
    origins = gathering.origins
    notices = []
    made, held = len(gathering.of_origin("synthetic")), len(gathering.results)
    if made:
        notices.append(Notice("synthetic", _made_words(made, held)))
    found = (
        campaigns_dominance(gathering),
        campaigns_levels(gathering),
        campaigns_parameters(gathering),
        campaigns_outliers(gathering),
        campaigns_quality(gathering),
        campaigns_list(gathering),
    )
    sections = [section for section in found if section is not None]
    sources = campaigns_sources(gathering)
    behind = Section(sources.id, sources.title, [*files_behind(sections), results_behind(gathering), *sources.blocks])
    return Document(
        title=say("Fleet view"),
        subtitle=say("Noise and vibration of traction drives: what the results of many campaigns say together"),
        origin=origins[0] if len(origins) == 1 else "mixed",
        summary=campaigns_answer(gathering),
        notices=notices,
        sections=[*sections, behind],
        facts=_facts(gathering),
        lineage={section.id: behind.id for section in sections if section.id in FILES_OF},
        footer=[say("Made with tdacoustic {version}.", version=__version__), *map(say, MEASURED_FOOTER)],
    )


def _made_words(made: int, held: int) -> str:
    """How many campaigns a program made, at least one."""
    if made == held:
        return say("Every campaign here was made by a program; nothing in it was measured.")
    return say_count(
        "{count} of {held} campaigns here was made by a program; nothing in it was measured.",
        "{count} of {held} campaigns here were made by a program; nothing in them was measured.",
        made,
        held=held,
    )


def _facts(gathering: Gathering) -> list[Fact]:
    trains = {result.identity.train for result in gathering.results if result.identity.train}
    years = {result.identity.year for result in gathering.results if result.identity.year is not None}
    counts = [Fact(say("Campaigns"), str(len(gathering.of_origin(origin))), origin) for origin in gathering.origins]
    return [
        *counts,
        Fact(say("Trains"), str(len(trains)) if trains else say("not known")),
        Fact(say("Years"), years_words(years) or say("not known")),
        Fact(say("Left out"), str(len(gathering.left_out))),
    ]
