"""From a figure or table back to what it came of: steps with their versions and settings, and the files they read.

Each section of a report is fed by some steps. What these rest on is told by the records that the store keeps of every
result; nothing here is written by hand but which steps feed which section.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, TypeAlias

from tdacoustic.reporting.document import Block, Column, Details, Facts, Paragraph, Section, Table, walk
from tdacoustic.reporting.language import mark, say, say_count
from tdacoustic.reporting.sections.folding import few
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import CampaignCalibration, LogInput
from tdacoustic.steps.record import Record

__all__ = ["FED_BY", "behind_a_fit", "lineage_sections", "resting_on", "settings_words"]

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
MOST_SIGNS: Final = 600
"""Signs of the settings of a step."""
LONG_TEXT: Final = 80
"""Signs from which on a setting that is a text is told by its length."""
DEEPEST: Final = 2
"""Objects within objects that are told field by field; those further inside by their kind."""

STATED: Final = ("campaign", "fleet", "TOML")
"""Formats of the files that settings and parameters are stated in."""

WHERE_THE_REST_IS: Final[Mapping[str, str]] = {
    "settings": mark("what the campaign sets in “Settings”"),
    "method": mark("windows, frames and averages in “What was done to the recordings”"),
    "kinematics": mark("what turns how fast, and who says so, in “Speeds and mesh frequencies”"),
    "model-parameters": mark("parameters of the model and their origins in “What the model rests on”"),
    "versions": mark("versions of the software in “Versions”"),
}
"""What no subsection repeats, by the section's id."""


def lineage_sections(
    sections: Sequence[Section],
    records: Records,
    inputs: Sequence[LogInput],
    of_model: Mapping[str, Records] | None = None,
    beside: Iterable[str] = (),
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
        Records of sections of the model, by their id; these rest on the files of the campaign and the fleet too.
    beside : sequence of str, optional
        Ids of the sections on provenance that stand beside these.

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
            stated = [file for file in inputs if file.format in STATED] if id_ in (of_model or {}) else []
            behind.append(_lineage(id_, title, fed[id_], files, stated))
    if not behind:
        return [], anchors
    there = {*titles, *beside}
    rest = [say(words) for id_, words in WHERE_THE_REST_IS.items() if id_ in there]
    opening = [Paragraph(say("Not repeated below: {places}.", places="; ".join(rest)))] if rest else []
    return [Section("behind", say("What stands behind each section"), [*opening, *behind])], anchors


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


def behind_a_fit(found: CampaignCalibration | None) -> Records:
    """Return the records that a fit rests on: those of the levels that were recorded, then the model's; none without.

    Parameters
    ----------
    found : CampaignCalibration or None
    """
    if found is None:
        return ()
    recorded = () if found.analysis is None else resting_on(found.analysis.records, ("measurement",))
    return (*recorded, *found.records)


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
    return _short(_told(_fields(settings)))


def _told(fields: Mapping[str, str]) -> str:
    """Settings with their keys, one after the other."""
    return "; ".join(f"{key} {words}".strip() for key, words in fields.items())


def _short(text: str) -> str:
    return text if len(text) <= MOST_SIGNS else text[:MOST_SIGNS].rsplit(" ", 1)[0] + " ..."


def _fields(settings: str) -> dict[str, str]:
    """Settings in words, by their key; of settings that are no object the key is empty."""
    tree = json.loads(settings)
    fields = tree.get("fields") if isinstance(tree, dict) else None
    if not isinstance(fields, dict):
        return {"": _shown(tree)}
    return {key: _shown(value) for key, value in fields.items()}


def _shown(value: Any, depth: int = 0) -> str:
    if value is None:
        return say("none")
    if isinstance(value, bool):
        return say("yes") if value else say("no")
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return _object_words(value, depth)
    if isinstance(value, list):
        return _items_words(value, depth)
    text = str(value)
    return text if len(text) <= LONG_TEXT else say("a text of {count} characters", count=len(text))


def _object_words(value: Mapping[str, Any], depth: int) -> str:
    if "$tuple" in value:
        return _items_words(value["$tuple"], depth)
    fields = value.get("fields")
    if not isinstance(fields, dict):
        return say("a table")
    if isinstance(fields.get("name"), str):
        return str(fields["name"])
    if depth >= DEEPEST:
        return str(value.get("$type", "")).rsplit(":", 1)[-1]
    return f"({', '.join(f'{key} {_inside(held, depth + 1)}' for key, held in fields.items())})"


def _items_words(items: Sequence[Any], depth: int) -> str:
    return few([_inside(value, depth) for value in items], MOST_ITEMS) if items else say("none")


def _inside(value: Any, depth: int) -> str:
    """A value within others: several in brackets."""
    several = value["$tuple"] if isinstance(value, dict) and "$tuple" in value else value
    return f"({_shown(value, depth)})" if isinstance(several, list) and several else _shown(value, depth)


def _lineage(
    id_: str, title: str, records: Records, files: Mapping[str, LogInput], stated: Sequence[LogInput]
) -> Section:
    done = {key: record.title for key, record in records}
    alike: dict[tuple[str, str, str], list[str]] = {}
    read: dict[str, None] = {}
    for _, record in records:
        keys = [key for _, key in record.inputs]
        read |= dict.fromkeys(key for key in keys if key in files)
        made_from = dict.fromkeys(
            say("the logs") if key in files else done.get(key, say("other files")) for key in keys
        )
        step = say("{step}, version {version}", step=record.step, version=record.version)
        alike.setdefault((record.title, step, ", ".join(made_from)), []).append(record.label)
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
    told = _settings_told([record for _, record in records])
    folded = say_count("Settings of these steps, {count} entry", "Settings of these steps, {count} entries", len(told))
    blocks: list[Block] = [
        _files_words([files[key] for key in read], stated),
        table,
        *([Details(folded, [Facts(told)])] if told else []),
    ]
    return Section(f"from-{id_}", say("Behind “{title}”", title=title), blocks)


def _settings_told(records: Sequence[Record]) -> list[tuple[str, str]]:
    """Settings step by step: what all of a step share, then where they differ."""
    by_step: dict[str, list[tuple[str, dict[str, str]]]] = {}
    for record in records:
        by_step.setdefault(record.title, []).append((record.label, _fields(record.settings)))
    told: list[tuple[str, str]] = []
    for step, each in by_step.items():
        first = each[0][1]
        shared = {key: words for key, words in first.items() if all(held.get(key) == words for _, held in each)}
        differing: dict[str, list[str]] = {}
        for label, held in each:
            own = _told({key: words for key, words in held.items() if key not in shared})
            differing.setdefault(own, []).append(label)
        common = _told(shared)
        entries = [(common, [label for label, _ in each]), *differing.items()]
        told += [(f"{step}, {_labels(labels)}", _short(words)) for words, labels in entries if words]
    return told


def _labels(labels: Sequence[str]) -> str:
    each = list(dict.fromkeys(labels))
    return few(each, MOST_LABELS if len(each) <= MOST_LABELS else MOST_LABELS - 1)


def _files_words(logs: Sequence[LogInput], stated: Sequence[LogInput]) -> Paragraph:
    """What was read; `stated` are the files of the campaign and the fleet."""
    whole = say("Whole SHA-256 in the table of inputs.")
    told = [say("Read from {files}.", files=_named(logs))] if logs else []
    told += [say("Stated in {files}.", files=_named(stated))] if stated else []
    told += [] if logs else [say("No log was read for it.")]
    return Paragraph(" ".join([*told, whole] if logs or stated else told))


def _named(files: Sequence[LogInput]) -> str:
    named = [f"{file.written} (SHA-256 {file.sha256[:16]})" for file in files[:MOST_FILES]]
    named += [say("{count} more", count=len(files) - MOST_FILES)] if len(files) > MOST_FILES else []
    return joined(named)
