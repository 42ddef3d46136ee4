"""From a figure back to its files: who rests on what is told by hand here, of records made by hand."""

import json
import re
from types import SimpleNamespace

import pytest
from report_figures import spectrum

from tdacoustic.reporting import Document, Facts, FigureBlock, Paragraph, ReportError, Section
from tdacoustic.reporting.document import Table, walk
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.sections.lineage import (
    FED_BY,
    MOST_SIGNS,
    behind_a_fit,
    lineage_sections,
    resting_on,
    settings_words,
)
from tdacoustic.results import LogInput
from tdacoustic.steps.record import Record

LOGS = [LogInput(f"{name}.h5", digit * 64, 10, "hdf5") for name, digit in (("one", "1"), ("two", "2"))]
TOML = LogInput("campaign.toml", "3" * 64, 10, "campaign")


def record(step, run, settings=None, **inputs):
    written = json.dumps({"$type": "a:Settings", "fields": settings or {}})
    return Record(step, 2, step.title(), run, written, tuple(inputs.items()), (), 0.1)


CHAIN = (
    ("s1", record("survey", "run 1", logs=f"sha256:{'1' * 64}")),
    ("m1", record("measurement", "run 1", {"overlap": 0.5}, survey="s1")),
    ("s2", record("survey", "run 2", logs=f"sha256:{'2' * 64}")),
    ("m2", record("measurement", "run 2", {"overlap": 0.5}, survey="s2")),
    ("h1", record("hearing", "run 1", logs=f"sha256:{'1' * 64}")),
)
SECTIONS = [
    Section("recordings", "What the recordings show", [
        Section("levels", "Levels", [Paragraph("a")]),
        Section("tones", "Tones", [Paragraph("a")]),
        Section("orders", "Orders", [Paragraph("a")]),
    ])
]  # fmt: skip


def behind(id_):
    blocks, anchors = lineage_sections(SECTIONS, CHAIN, [*LOGS, TOML])
    assert set(anchors) == {"levels", "tones"}  # nothing fed the orders, and the summary rests on no step here
    section = next(block for block in walk(blocks) if isinstance(block, Section) and block.id == anchors[id_])
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    (words,) = [block.text for block in section.blocks if isinstance(block, Paragraph)]
    return table, words


def test_a_section_leads_to_its_steps_and_these_to_their_logs():
    table, words = behind("levels")
    assert table.rows == (
        ("Survey", "survey, version 2", "run 1, run 2", "the logs"),
        ("Measurement", "measurement, version 2", "run 1, run 2", "Survey"),
    )
    assert "one.h5 (SHA-256 1111111111111111)" in words and "two.h5" in words
    assert "campaign.toml" not in words


def test_the_settings_are_told_once_for_all_that_was_done_alike():
    blocks, _ = lineage_sections(SECTIONS, CHAIN, LOGS)
    facts = [fact for block in walk(blocks) if isinstance(block, Facts) for fact in block.pairs]
    assert [(fact.key, fact.value) for fact in facts] == [("Measurement, run 1, run 2", "overlap 0.5")]


def test_another_section_leads_to_its_own():
    table, words = behind("tones")
    assert [row[0] for row in table.rows] == ["Hearing"]
    assert "one.h5" in words and "two.h5" not in words


def test_all_that_a_step_rests_on_comes_along():
    assert [key for key, _ in resting_on(CHAIN, ["measurement"])] == ["s1", "m1", "s2", "m2"]
    assert resting_on(CHAIN, ["orders"]) == ()


def test_settings_are_words():
    channel = {"$type": "tdacoustic.recording.recording:Channel", "fields": {"name": "mic_1", "gain": 1.0}}
    settings = {"channels": {"$tuple": [channel, channel]}, "band_hz": None, "fast": True, "orders": {"$tuple": []}}
    words = settings_words(json.dumps({"$type": "a:B", "fields": settings}))
    assert words == "channels mic_1, mic_1; band_hz none; fast yes; orders none"
    long = settings_words(json.dumps({"$type": "a:B", "fields": {f"key{i}": "x" * 30 for i in range(99)}}))
    assert len(long) < MOST_SIGNS + 20 and long.endswith(" ...")


def test_objects_are_told_field_by_field():
    frames = {"$type": "a:Frames", "fields": {"overlap": 0.5, "band_hz": {"$tuple": [20.0, 500.0]}}}
    settings = {"frames": frames, "sensors": {"$tuple": [{"$tuple": ["m1", "motor"]}]}, "table": {"$array": 3}}
    words = settings_words(json.dumps({"$type": "a:B", "fields": settings}))
    assert words == "frames (overlap 0.5, band_hz (20, 500)); sensors (m1, motor); table a table"
    deep = {"$type": "a:One", "fields": {"two": {"$type": "a:Two", "fields": {"three": frames}}}}
    assert settings_words(json.dumps({"$type": "a:B", "fields": {"one": deep}})) == "one (two (three Frames))"
    fleet = settings_words(json.dumps({"$type": "a:B", "fields": {"fleet": "y" * 300}}))
    assert fleet == "fleet a text of 300 characters"


def test_what_runs_share_is_told_once_and_what_differs_beside_it():
    chain = [(run, record("survey", run, {"overlap": 0.5, "speed": speed})) for run, speed in (("a", 1.0), ("b", 2.0))]
    blocks, _ = lineage_sections([Section("measured", "Measured", [])], chain, [])
    facts = [(fact.key, fact.value) for block in walk(blocks) if isinstance(block, Facts) for fact in block.pairs]
    assert facts == [("Survey, a, b", "overlap 0.5"), ("Survey, a", "speed 1"), ("Survey, b", "speed 2")]


def words_behind(records, inputs):
    model = [Section("prediction", "Prediction", [])]
    blocks, _ = lineage_sections(model, CHAIN, inputs, {"prediction": records}, ("settings",))
    texts = [block.text for block in walk(blocks) if isinstance(block, Paragraph)]
    assert texts[0] == "Not repeated below: what the campaign sets in “Settings”."
    return texts[-1]


def test_a_model_names_the_files_that_it_is_stated_in():
    words = words_behind([("x", record("responses", "6 conditions"))], [*LOGS, TOML])
    assert words == (
        "Stated in campaign.toml (SHA-256 3333333333333333). No log was read for it. "
        "Whole SHA-256 in the table of inputs."
    )


def test_a_model_that_was_fitted_to_recordings_rests_on_their_logs():
    analysis = SimpleNamespace(records=CHAIN)
    model = ("x", record("responses", "6 conditions"))
    fit = behind_a_fit(SimpleNamespace(analysis=analysis, records=(model,)))
    assert [key for key, _ in fit] == ["s1", "m1", "s2", "m2", "x"]
    words = words_behind(fit, [*LOGS, TOML])
    assert words.startswith("Read from one.h5 (SHA-256 1111111111111111) and two.h5")
    assert "Stated in campaign.toml" in words and "No log" not in words
    assert behind_a_fit(None) == () and behind_a_fit(SimpleNamespace(analysis=None, records=(model,))) == (model,)


def test_the_page_links_figures_to_what_stands_behind_their_section():
    figure = FigureBlock(spectrum("mic-1", "one"), "measured")
    sections = [
        Section("levels", "Levels", [Section("deep", "Deep", [figure])]),
        Section("other", "Other", [FigureBlock(spectrum("mic-2", "two"))]),
        Section("from-levels", "Behind", [Paragraph("steps")]),
    ]
    text = render_html(Document("R", "", "measured", sections=sections, lineage={"levels": "from-levels"}))
    assert text.count('href="#from-levels">How it came about<') == 1
    assert re.search(r'id="fig-mic-1".*?href="#from-levels"', text, re.S)
    assert 'id="from-levels"' in text


def test_a_lineage_that_leads_nowhere_is_refused():
    with pytest.raises(ReportError, match="no section lost to tell how numbers came about"):
        Document("R", "", "measured", sections=[Section("a", "A", [])], lineage={"a": "lost"})


def test_the_steps_named_here_are_steps():
    from pathlib import Path

    import tdacoustic

    root = Path(tdacoustic.__file__).parent
    text = "".join(path.read_text(encoding="utf-8") for path in root.rglob("*.py"))
    known = set(re.findall(r'Step\(\s*"([^"]+)"', text))
    assert {step for steps in FED_BY.values() for step in steps} <= known
