"""How each number came about: inputs, settings, steps, versions, assumptions."""

from __future__ import annotations

from tdacoustic.reporting.document import Block, Column, Details, Facts, Section, Sentences, Table
from tdacoustic.results import Analysis, FleetPrediction

__all__ = ["ASSUMPTIONS", "provenance", "steps_of"]

ASSUMPTIONS = (
    "The channels' components, directions, distances and sensitivities are taken from the campaign file.",
    "Several logs of one run are taken to start together.",
    "A run is steady where the 5th and 95th percentile of its speed differ by no more than the tolerance set.",
    "The limits of the quality checks are assumed; they are named in the finding they lead to.",
)


def provenance(analysis: Analysis) -> Section:
    """Return the section on provenance."""
    blocks: list[Block] = []
    inputs = [(log.written, log.format, log.sha256) for log in analysis.inputs]
    if inputs:
        input_columns = (
            Column("file", "Log"),
            Column("format", "Format"),
            Column("sha256", "SHA-256"),
        )
        blocks.append(Table("inputs", "Inputs", input_columns, inputs))
    settings = [(key, _shown(value)) for key, value in analysis.settings.items()]
    columns = (Column("setting", "Setting"), Column("value", "Value"))
    blocks.append(Section("settings", "Settings", [Table("settings", "Settings in force", columns, settings)]))
    blocks.append(Section("assumptions", "Assumptions", [Sentences(ASSUMPTIONS)]))
    if analysis.records:
        blocks.append(steps_of(analysis))
    blocks.append(Section("versions", "Versions", [Facts(list(analysis.versions.items()))]))
    return Section("provenance", "How the numbers came about", blocks)


def _shown(value: object) -> str:
    if value is None:
        return "default"
    if isinstance(value, tuple):
        return ", ".join(f"{item:g}" if isinstance(item, float) else str(item) for item in value) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


def steps_of(result: Analysis | FleetPrediction) -> Details:
    """Return the steps of a result, folded away."""
    rows = [
        (record.label, record.title, record.step, record.version, key[:16], ", ".join(v[:23] for _, v in record.inputs))
        for key, record in result.records
    ]
    columns = (
        Column("label", "Of"),
        Column("title", "Step"),
        Column("step", "Name"),
        Column("version", "Version", "", 0, "number"),
        Column("key", "Key"),
        Column("inputs", "Made from"),
    )
    return Details(f"{len(rows)} steps", [Table("steps", "Steps and what they were made from", columns, rows)])
