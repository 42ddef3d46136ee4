"""From a figure or table back to what it came of: steps with their versions and settings, and the files they read.

Each section of a report is fed by some steps. What these rest on is told by the records that the store keeps of every
result; nothing here is written by hand but which steps feed which section.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, TypeAlias

from tdacoustic.reporting.document import Block, Column, Details, Facts, Paragraph, Section, Table, walk
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.folding import few
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import LogInput
from tdacoustic.steps.record import Record

__all__ = ["FED_BY", "lineage_sections", "resting_on", "settings_words"]

Records: TypeAlias = Sequence[tuple[str, Record]]

FED_BY: Final[Mapping[str, tuple[str, ...]]] = {
    "summary": ("evidence", "contributions", "orders", "responses"),
    "listening": ("listening", "evidence"),
    "side-by-side": ("measurement", "evidence"),
    "sources": ("evidence",),
    "contributions": ("contributions",),
    "modes": ("measurement", "receiver bands"),
    "orders": ("orders",),
    "tones": ("hearing",),
    "railway": ("measurement", "hearing"),
    "kinematics": ("speed", "line_speed"),
    "speed": ("speed", "line_speed"),
    "measured": ("survey",),
    "sensors": ("calibrator",),
    "clocks": ("clock",),
    "quality": ("survey", "measurement"),
    "levels": ("measurement",),
    "spectra": ("measurement",),
}
"""Steps whose results a section shows, by the section's id."""

MOST_FILES: Final = 12
"""Files named one by one; all are in the table of inputs."""
MOST_LABELS: Final = 6
"""Runs named one by one."""
MOST_ITEMS: Final = 6
"""Items of a setting named one by one."""
MOST_SIGNS: Final = 400
"""Signs of the settings of a step."""


def lineage_sections(
    sections: Sequence[Section],
    records: Records,
    inputs: Sequence[LogInput],
    of_model: Mapping[str, Records] | None = None,
) -> tuple[list[Block], dict[str, str]]:
    """Return a section with a subsection for each one that steps feed, and which section leads to which subsection.

    Parameters
    ----------
    sections : sequence of Section
        Of the report, without its summary.
    records : sequence of (str, Record)
        Key and record of every step of a result.
    inputs : sequence of LogInput
        Files that went in.
    of_model : mapping of str to sequence of (str, Record), optional
        Records of sections of the model, by their id.

    Returns
    -------
    behind : list of blocks
        To stand in the section on how the numbers came about.
    lineage : dict of str to str
        Anchor by section id.
    """
    files = {f"sha256:{file.sha256}": file for file in inputs}
    behind: list[Block] = []
    anchors: dict[str, str] = {}
    fed: dict[str, Records] = {id_: resting_on(records, steps) for id_, steps in FED_BY.items()}
    fed |= {id_: tuple(held) for id_, held in (of_model or {}).items()}
    titles = {"summary": say("Summary")} | {
        block.id: block.title for block in walk(sections) if isinstance(block, Section)
    }
    for id_, title in titles.items():
        if fed.get(id_):
            anchors[id_] = f"from-{id_}"
            behind.append(_lineage(id_, title, fed[id_], files))
    return [Section("behind", say("What stands behind each section"), behind)] if behind else [], anchors


def resting_on(records: Records, steps: Iterable[str]) -> Records:
    """Return the records of some steps and of all that they rest on, upstream first.

    Examples
    --------
    >>> def record(step, **inputs):
    ...     return Record(step, 1, step, "run 1", "{}", tuple(inputs.items()), (), 0.0)
    >>> chain = [("a", record("read", logs="sha256:0")), ("b", record("level", signal="a")), ("c", record("other"))]
    >>> [key for key, _ in resting_on(chain, ["level"])]
    ['a', 'b']
    """
    by_key = dict(records)
    wanted = {key for key, record in records if record.step in set(steps)}
    waiting = list(wanted)
    while waiting:
        for _, key in by_key[waiting.pop()].inputs:
            if key in by_key and key not in wanted:
                wanted.add(key)
                waiting.append(key)
    return tuple((key, record) for key, record in records if key in wanted)


def settings_words(settings: str) -> str:
    """Return a record's settings as words; the names of channels and other objects stand for these.

    Parameters
    ----------
    settings : str
        Canonical JSON of a `Record`.

    Examples
    --------
    >>> settings_words('{"$type":"a:B","fields":{"overlap":0.5,"orders":{"$tuple":[1.0,31.0]},"mains_hz":null}}')
    'overlap 0.5; orders 1, 31; mains_hz none'
    """
    tree = json.loads(settings)
    fields = tree.get("fields") if isinstance(tree, dict) else None
    if not isinstance(fields, dict):
        return _shown(tree)
    text = "; ".join(f"{key} {_shown(value)}" for key, value in fields.items())
    return text if len(text) <= MOST_SIGNS else text[:MOST_SIGNS].rsplit(" ", 1)[0] + " ..."


def _shown(value: Any) -> str:
    if value is None:
        return say("none")
    if isinstance(value, bool):
        return say("yes") if value else say("no")
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return _object_words(value)
    if isinstance(value, list):
        return _items_words(value)
    return str(value)


def _object_words(value: Mapping[str, Any]) -> str:
    if "$tuple" in value:
        return _items_words(value["$tuple"])
    fields = value.get("fields", value)
    if isinstance(fields, dict) and isinstance(fields.get("name"), str):
        return str(fields["name"])
    return str(value["$type"]).rsplit(":", 1)[-1] if "$type" in value else say("a table")


def _items_words(items: Sequence[Any]) -> str:
    return few([_shown(item) for item in items], MOST_ITEMS) if items else say("none")


def _lineage(id_: str, title: str, records: Records, files: Mapping[str, LogInput]) -> Section:
    done = {key: record.title for key, record in records}
    alike: dict[tuple[str, str, str], list[str]] = {}
    settings: dict[tuple[str, str], list[str]] = {}
    read: dict[str, None] = {}
    for _, record in records:
        keys = [key for _, key in record.inputs]
        read |= dict.fromkeys(key for key in keys if key in files)
        made_from = dict.fromkeys(
            say("the logs") if key in files else done.get(key, say("other files")) for key in keys
        )
        step = say("{step}, version {version}", step=record.step, version=record.version)
        alike.setdefault((record.title, step, ", ".join(made_from)), []).append(record.label)
        settings.setdefault((record.title, settings_words(record.settings)), []).append(record.label)
    columns = (
        Column("title", say("Step")),
        Column("step", say("Name and version")),
        Column("label", say("Of")),
        Column("inputs", say("Made from")),
    )
    rows = [(step, name, _labels(labels), made_from) for (step, name, made_from), labels in alike.items()]
    table = Table(
        f"lineage-{id_}",
        say("Steps behind “{title}”; their keys are in the table of steps.", title=title),
        columns,
        rows,
    )
    told = [(f"{step}, {_labels(labels)}", words) for (step, words), labels in settings.items() if words]
    folded = say_count("Settings of these steps, {count} entry", "Settings of these steps, {count} entries", len(told))
    blocks: list[Block] = [
        _files_words([files[key] for key in read]),
        table,
        *([Details(folded, [Facts(told)])] if told else []),
    ]
    return Section(f"from-{id_}", say("Behind “{title}”", title=title), blocks)


def _labels(labels: Sequence[str]) -> str:
    each = list(dict.fromkeys(labels))
    return few(each, MOST_LABELS if len(each) <= MOST_LABELS else MOST_LABELS - 1)


def _files_words(files: Sequence[LogInput]) -> Paragraph:
    if not files:
        return Paragraph(say("Computed from the campaign and the fleet without reading a log."))
    named = [f"{file.written} (SHA-256 {file.sha256[:16]})" for file in files[:MOST_FILES]]
    named += [say("{count} more", count=len(files) - MOST_FILES)] if len(files) > MOST_FILES else []
    return Paragraph(say("Read from {files}; whole SHA-256 in the table of inputs.", files=joined(named)))
