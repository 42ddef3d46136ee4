"""How each number came about: inputs, settings, steps, versions, assumptions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Final

from tdacoustic.campaign import Campaign
from tdacoustic.reporting.document import Block, Column, Details, Facts, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.method import method_of_measurement
from tdacoustic.results import Analysis, CampaignResult, FleetPrediction, LogInput
from tdacoustic.steps.record import Record

__all__ = [
    "ASSUMPTIONS",
    "assumptions_said",
    "inputs_of",
    "provenance",
    "settings_of",
    "stated_by",
    "steps_of",
    "versions_of",
]

MOST_OF_A_STEP: Final = 200
"""Rows of one step in the page."""

ASSUMPTIONS = (
    mark("The channels' components, directions, distances and sensitivities are taken from the campaign file."),
    mark("Several logs of one run are taken to start together."),
    mark("A run is steady where the 5th and 95th percentile of its speed differ by no more than the tolerance set."),
    mark("The limits of the quality checks are assumed; they are named in the finding they lead to."),
)
"""On the recordings."""


def assumptions_said() -> Sentences:
    """Return what is assumed of the recordings."""
    return Sentences([say(assumption) for assumption in ASSUMPTIONS])


def provenance(analysis: Analysis, behind: Sequence[Block] = ()) -> Section:
    """Return the section on provenance; `behind` are its subsections on single sections of the report."""
    blocks = [
        *inputs_of(analysis.inputs),
        settings_of(analysis.settings, stated_by(analysis.campaign)),
        *method_of_measurement(analysis),
        Section("assumptions", say("Assumptions"), [assumptions_said()]),
        *behind,
        *steps_of(analysis),
        versions_of(analysis.versions, analysis.records),
    ]
    return Section("provenance", say("How the numbers came about"), blocks)


def inputs_of(files: Sequence[LogInput]) -> list[Block]:
    """Return the table of the files that went in; nothing of none."""
    columns = (Column("file", say("File")), Column("format", say("Format")), Column("sha256", "SHA-256"))
    rows = [(file.written, file.format, file.sha256) for file in files]
    return [Table("inputs", say("Inputs"), columns, rows)] if rows else []


def settings_of(settings: Mapping[str, object], stated: Collection[str] = ()) -> Section:
    """Return the section on settings, by key; those `stated` are told from defaults."""
    columns = (
        Column("setting", say("Setting")),
        Column("value", say("Value")),
        Column("stated", say("Set by")),
    )
    rows = [
        (key, _shown(value), say("the campaign") if key in stated else say("default"))
        for key, value in settings.items()
    ]
    return Section("settings", say("Settings"), [Table("settings", say("Settings in force"), columns, rows)])


def stated_by(campaign: Campaign) -> frozenset[str]:
    """Return the keys of the settings that a campaign's file states, ``"analysis.overlap"``."""
    tables = {"analysis": campaign.analysis, "calibration": campaign.calibration, "railway": campaign.railway}
    return frozenset(
        f"{name}.{key}" for name, table in tables.items() if table is not None for key in table.model_fields_set
    )


def versions_of(versions: Mapping[str, str], records: Sequence[tuple[str, Record]] = ()) -> Section:
    """Return the section on the versions of what made the numbers, and which steps were made with others.

    Parameters
    ----------
    versions : mapping of str to str
    records : sequence of (str, Record)
        Key and record of the steps; one that the store has kept may come of an earlier version.
    """
    held = {name: Counter[str]() for name in versions}
    for record in dict(records).values():
        for name, version in record.libraries:
            held.setdefault(name, Counter())[version] += 1
    told = {name: _version_words(versions.get(name), found) for name, found in held.items()}
    blocks: list[Block] = [Facts(list(told.items()))]
    if told != dict(versions):
        blocks.append(
            Paragraph(
                say("Some steps were computed earlier with other versions, and kept in the store; how many is said.")
            )
        )
    return Section("versions", say("Versions"), blocks)


def _version_words(version: str | None, found: Counter[str]) -> str:
    """The version of a library; where steps were made with another one, each with the number of its steps."""
    known = {*found, *([] if version is None else [version])}
    if len(known) == 1:
        return known.pop()
    parts = [
        say_count("{version} in {count} step", "{version} in {count} steps", count, version=other)
        for other, count in found.most_common()
    ]
    return "; ".join(parts if version is None or version in found else [say("{version} now", version=version), *parts])


def _shown(value: object) -> str:
    if value is None:
        return say("not set")
    if isinstance(value, bool):
        return say("yes") if value else say("no")
    if isinstance(value, tuple | list):
        return ", ".join(_shown(item) for item in value) or say("none")
    if isinstance(value, Mapping):
        return " ".join(f"{key} = {_shown(item)}" for key, item in value.items())
    return f"{value:g}" if isinstance(value, float) else str(value)


def steps_of(result: Analysis | FleetPrediction | CampaignResult) -> list[Block]:
    """Return the steps of a result, folded away; nothing of none.

    Of a step that was done very often, as for the batches of a study, the first ones are named.
    """
    often = Counter(record.step for _, record in result.records)
    named: Counter[str] = Counter()
    rows: list[tuple[str, str, str, int, str, str]] = []
    for key, record in result.records:
        named[record.step] += 1
        made_from = ", ".join(v[:23] if v.startswith("sha256:") else v[:16] for _, v in record.inputs)
        if named[record.step] <= MOST_OF_A_STEP:
            rows.append((record.label, record.title, record.step, record.version, key[:16], made_from))
        elif named[record.step] == often[record.step]:
            more = say("{count} more of this step", count=often[record.step] - MOST_OF_A_STEP)
            rows.append((more, record.title, record.step, record.version, "", ""))
    columns = (
        Column("label", say("Of")),
        Column("title", say("Step")),
        Column("step", say("Name")),
        Column("version", say("Version"), "", 0, "number"),
        Column("key", say("Key")),
        Column("inputs", say("Made from")),
    )
    table = Table("steps", say("Steps and what they were made from"), columns, rows)
    return [Details(say_count("{count} step", "{count} steps", len(result.records)), [table])] if rows else []
