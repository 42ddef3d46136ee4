"""What the sections of the report say of a small campaign whose sources are known."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pandas as pd
import pytest

from tdacoustic.reporting.document import Details, FigureBlock, Notice, Paragraph, Section, Sentences, Table, walk
from tdacoustic.reporting.figure import Bars, Markers, Rule
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.language import Language, speaking
from tdacoustic.reporting.measured_report import measured_report
from tdacoustic.reporting.sections.answer import _rest_words, answer
from tdacoustic.reporting.sections.kinematics import kinematics
from tdacoustic.reporting.sections.levels import levels
from tdacoustic.reporting.sections.side_by_side import side_by_side
from tdacoustic.reporting.sections.sources import sources
from tdacoustic.reporting.sections.spectra import spectra
from tdacoustic.reporting.sections.words import joined, pretty_signs, probability_words
from tdacoustic.workflows.analyze import analyze
from tdacoustic.workflows.summary import summary_lines

RATE_HZ = 4096.0
SECONDS = 8.0

FLEET = """
schema = "tdacoustic-fleet/1"
name = "Small drive"
[train]
wheel_diameter_mm = { value = 1000, origin = "drawing 12" }
[[gear_pair]]
teeth = [20, 60]
[motor]
carrier_hz = 400
"""
# Mesh at 30 km/h: 20 x 3 x 30/3.6/pi = 159.15 Hz; at 60 km/h 318.31 Hz.
MESH_30_HZ, MESH_60_HZ = 159.155, 318.310

HEAD = """
schema = "tdacoustic-campaign/1"
name = "Small"
origin = "synthetic"
"""
MICROPHONES = """
[[channel]]
name = "mic_1"
component = "air"
role = "receiver"
quantity = "sound_pressure"
distance_m = 4.0
[[channel]]
name = "mic_2"
component = "air"
role = "receiver"
quantity = "sound_pressure"
distance_m = 4.0
"""
SENSORS = """
[[channel]]
name = "motor"
component = "motor"
quantity = "acceleration"
[[channel]]
name = "gearbox"
component = "gearbox"
quantity = "acceleration"
"""
RUNS = """
[[run]]
condition = "slow"
mode = "hauled"
train_speed_km_h = 30
logs = ["slow.h5"]
[[run]]
condition = "fast"
mode = "hauled"
train_speed_km_h = 60
logs = ["fast.h5"]
"""
JUDGEMENTS = """
[[exclude]]
condition = "fast"
frequency_hz = [1200, 1300]
reason = "a fan of the workshop"
[[exclude]]
condition = "slow"
frequency_hz = [30, 40]
reason = "mains hum"
[[override]]
condition = "fast"
frequency_hz = 900
source = "gearbox"
reason = "seen on the bench"
[[override]]
condition = "slow"
frequency_hz = 1500
source = "motor"
reason = "expected there"
"""
# Lines: Hz, which channels show them. The third of "slow" is the mesh's by order and the motor's by sensor.
LINES = {
    "slow": [(800.0, "motor"), (400.0, "motor"), (2 * MESH_30_HZ, "motor")],
    "fast": [(1.01 * MESH_60_HZ, "gearbox"), (900.0, ""), (1250.0, "")],
}
UNITS = {"mic_1": "Pa", "mic_2": "Pa", "motor": "m/s^2", "gearbox": "m/s^2"}


def write_logs(folder):
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    for seed, (condition, lines) in enumerate(LINES.items()):
        rng = np.random.default_rng(seed)
        with h5py.File(folder / f"{condition}.h5", "w") as file:
            file.attrs["schema"] = "tdacoustic-log/1"
            for name, unit in UNITS.items():
                values = rng.standard_normal(t.size)
                for number, (hz, shown) in enumerate(lines):
                    if unit == "Pa" or name == shown:
                        values = values + (1.0 - 0.2 * number) * np.sin(2 * np.pi * hz * t + number)
                dataset = file.create_dataset(name, data=values.astype(np.float32), track_times=False)
                dataset.attrs["sample_rate_hz"] = RATE_HZ
                dataset.attrs["unit"] = unit


def made(folder, text):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_logs(folder)
    (folder / "fleet.toml").write_text(FLEET, encoding="utf-8")
    (folder / "campaign.toml").write_text(HEAD + text, encoding="utf-8")
    return analyze(folder / "campaign.toml", store=folder / "store", jobs=1)


WITH_FLEET = 'fleet = "fleet.toml"\n'


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    return made(tmp_path_factory.mktemp("judged"), WITH_FLEET + MICROPHONES + SENSORS + RUNS + JUDGEMENTS)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return made(tmp_path_factory.mktemp("plain"), WITH_FLEET + MICROPHONES + SENSORS + RUNS)


def tables(section):
    return {block.name: block for block in walk([section]) if isinstance(block, Table)}


def rows(table):
    return [dict(zip((column.key for column in table.columns), row, strict=True)) for row in table.rows]


def said(section):
    return [item for block in walk([section]) if isinstance(block, Sentences) for item in block.items]


def figures(section):
    return [block.figure for block in walk([section]) if isinstance(block, FigureBlock)]


# ---------------------------------------------------------------- the answer


def test_the_answer_names_the_verdict_its_probability_and_the_part_of_the_sound(plain):
    slow = summary_lines(plain)[0]
    verdict = next(v for v in plain.dominance if v.condition == "slow")
    assert verdict.dominant == "motor"
    assert "the motor dominates the noise lines with probability" in slow
    assert f"{100 * verdict.line_fraction:.0f} % of the sound energy" in slow
    assert ("but the lines are only" in slow) == (verdict.line_fraction < 0.5)
    assert "strongest noise lines 800 Hz" in slow


def test_the_answer_says_what_speaks_against_it(plain):
    slow = summary_lines(plain)[0]
    assert "conflict at 318 Hz (mesh x2), whose order does not belong to the motor" in slow


def test_an_undecided_verdict_names_who_leads_and_what_is_asked_for(plain):
    fast = summary_lines(plain)[1]
    verdict = next(v for v in plain.dominance if v.condition == "fast")
    assert verdict.dominant == "undecided"
    assert "dominates" not in fast and "Against it" not in fast
    assert fast.startswith("Condition fast (60 km/h): undecided")
    assert "(0.9 is asked for)" in fast or "no known source (probability" in fast
    assert "belongs to no known source" in fast


def test_the_answer_keeps_what_the_engineer_set_apart(judged):
    slow, fast = summary_lines(judged)
    assert "Set by the engineer: the source at 900 Hz; 1200 to 1300 Hz left out." in fast
    assert "Set by the engineer: 30 to 40 Hz left out." in slow


def test_the_table_of_the_answer_repeats_dominance_csv(judged):
    (table,) = [block for block in answer(judged) if isinstance(block, Table)]
    held = judged.tables["dominance"].to_dict("records")
    for row, kept in zip(rows(table), held, strict=True):
        assert (row["condition"], row["dominant"]) == (kept["condition"], kept["dominant"])
        for name in ("motor", "gearbox", "ambiguous", "unassigned"):
            assert row[f"{name}_percent"] == pytest.approx(100 * kept[f"{name}_share"], abs=1e-9)
        assert row["line_percent"] == pytest.approx(100 * kept["line_fraction"], abs=1e-9)


def test_the_bars_fill_up_to_all_of_the_lines(judged):
    (figure,) = [block.figure for block in answer(judged) if isinstance(block, FigureBlock)]
    assert figure.bar_mode == "stack"
    np.testing.assert_allclose(sum(bar.values for bar in figure.elements if isinstance(bar, Bars)), 100.0, atol=1e-9)
    verdicts = {verdict.condition: verdict.dominant for verdict in judged.dominance}
    assert figure.categories == tuple(f"{name}: {verdict}" for name, verdict in verdicts.items())


def test_bars_differ_without_their_colours(judged):
    (figure,) = [block.figure for block in answer(judged) if isinstance(block, FigureBlock)]
    hatches = [bar.hatch for bar in figure.elements if isinstance(bar, Bars)]
    assert len(hatches) > 1 and len(set(hatches)) == len(hatches)


def test_a_single_run_a_condition_is_said(plain):
    assert any("rests on a single run" in getattr(block, "text", "") for block in answer(plain))


# ---------------------------------------------------------------- sources


def test_every_noise_line_of_sources_csv_stands_in_a_table(judged):
    section = sources(judged)
    shown = sorted(
        (name.removeprefix("sources-"), row["channel"], row["frequency_hz"], row["level_db"], row["source"])
        for name, table in tables(section).items()
        if name.startswith("sources-")
        for row in rows(table)
    )
    kept = sorted(
        (row["condition"], row["channel"], row["frequency_hz"], row["level_db"], row["source"])
        for row in judged.tables["sources"].to_dict("records")
    )
    assert len(kept) == 10  # five lines that are not excluded, at two microphones
    for (*place, hz, level, source), (*kept_place, kept_hz, kept_level, kept_source) in zip(shown, kept, strict=True):
        assert (place, source) == (kept_place, kept_source)
        assert (hz, level) == pytest.approx((kept_hz, kept_level), abs=1e-6)


def test_conflicts_and_overrides_are_marked(judged):
    held = tables(sources(judged))
    slow = {round(row["frequency_hz"]): row for row in rows(held["sources-slow"])}
    fast = {round(row["frequency_hz"]): row for row in rows(held["sources-fast"])}
    assert slow[318]["mark"] == "conflict"
    assert (slow[318]["source"], slow[318]["excitation"]) == ("motor", "mesh x2")
    assert (fast[900]["mark"], fast[900]["source"], fast[900]["confidence"].text) == ("override", "gearbox", "set")
    assert any("seen on the bench" in words and "Without it: unassigned" in words for words in said(sources(judged)))


def test_overrides_say_which_lines_they_struck(judged):
    struck, missed = rows(tables(sources(judged))["overrides"])
    assert "900.0 Hz at mic_1" in struck["lines"] and "at mic_2" in struck["lines"]
    assert missed["lines"] == "no such noise line was found"
    assert missed["reason"] == "expected there"


def test_exclusions_are_listed_with_reason_and_lines(judged):
    fan, hum = rows(tables(sources(judged))["exclusions"])
    assert fan["reason"] == "a fan of the workshop"
    assert "1250.0 Hz at mic_1" in fan["lines"] and "1250.0 Hz at mic_2" in fan["lines"]
    assert hum["lines"] == "no noise line lies in it"


def test_each_line_has_its_evidence(judged):
    words = " ".join(said(sources(judged)))
    for row in judged.tables["sources"].to_dict("records"):
        assert f"{row['frequency_hz']:.1f} Hz at mic_1 and mic_2" in words or f"at {row['channel']}:" in words
    assert "(+0.0 Hz)" not in words


# ---------------------------------------------------------------- side by side


def test_a_condition_has_motor_gearbox_and_noise_over_the_same_frequencies(judged):
    section = side_by_side(judged)
    held = [block for block in section.blocks if isinstance(block, Section)]
    assert [block.id for block in held] == ["beside-slow", "beside-fast"]
    for block in held:
        of = figures(block)
        assert [figure.name.rsplit("-", 1)[1] for figure in of] == ["motor", "gearbox", "noise"]
        assert len({figure.x_axis.limits for figure in of}) == 1
        assert of[0].x_axis.limits[0] == 20.0


def test_every_noise_line_is_marked_and_named(judged):
    for condition, names in {
        "slow": {"800 Hz carrier x2", "400 Hz carrier x1", "318 Hz mesh x2"},
        "fast": {"321 Hz mesh x1", "900 Hz ?", "1250 Hz left out"},
    }.items():
        (noise,) = [figure for figure in figures(side_by_side(judged)) if figure.name == f"beside-{condition}-noise"]
        labels = {label for element in noise.elements if isinstance(element, Markers) for label in element.labels}
        assert names <= labels


def test_the_calculated_mesh_stands_where_the_stated_speed_puts_it(judged):
    for figure in figures(side_by_side(judged)):
        first = MESH_30_HZ if "-slow-" in figure.name else MESH_60_HZ
        rules = [element.x for element in figure.elements if isinstance(element, Rule)]
        assert rules and rules == pytest.approx([first * n for n in range(1, len(rules) + 1)], rel=1e-4)
        assert len(rules) <= 4


def test_noise_lines_that_a_sensor_does_not_show_are_said(judged):
    captions = {figure.name: figure.caption for figure in figures(side_by_side(judged))}
    assert "No line is found here at the noise lines 321 Hz and 900 Hz." in captions["beside-fast-motor"]


# ---------------------------------------------------------------- kinematics


def test_kinematics_shows_the_observed_mesh_and_its_rival_causes(judged):
    section = kinematics(judged)
    slow, fast = rows(tables(section)["kinematics"])
    assert fast["mesh_calculated_hz"] == pytest.approx(MESH_60_HZ, abs=0.01)
    assert fast["mesh_observed_hz"] == pytest.approx(1.01 * MESH_60_HZ, abs=0.2)
    assert fast["excess_percent"] == pytest.approx(1.0, abs=0.06)
    assert fast["motor_measured_rpm"] is None
    assert slow["mesh_observed_hz"] is None
    words = next(item for item in said(section) if item.startswith("Run fast"))
    assert "% against the calculated 318.3 Hz" in words
    assert "it may come from a wheel diameter of" in words and "or a speed reading low" in words
    assert "it is not creep" in words


def test_assumed_and_given_parameters_are_told_apart(judged):
    held = {row["parameter"]: row for row in rows(tables(kinematics(judged))["kinematics-parameters"])}
    assert (held["Wheel diameter"]["value"], held["Wheel diameter"]["standing"]) == ("1000 mm", None)
    assert held["Wheel diameter"]["origin"] == "drawing 12"
    assert held["Teeth of pinion and wheel"]["value"] == "20 : 60"
    assert held["Carrier of the inverter"]["standing"] == "assumed"


# ---------------------------------------------------------------- levels and lines


def test_what_a_level_is_uncertain_by_is_said(plain):
    text = " ".join(block.text for block in levels(plain).blocks if isinstance(block, Paragraph))
    assert "assumed to leave ± 0.3 dB (1 σ)" in text and "No condition was run twice" in text
    (table,) = [block for block in levels(plain).blocks if isinstance(block, Table)]
    assert "spread_db" not in [column.key for column in table.columns]


def test_how_far_runs_of_a_condition_lie_apart_stands_in_the_table(plain):
    frame = plain.tables["levels"]
    again = frame.assign(run=frame["run"] + " again", level_db=frame["level_db"] + 1.5)
    found = dataclasses.replace(plain, tables={**plain.tables, "levels": pd.concat([frame, again])})
    (table,) = [block for block in levels(found).blocks if isinstance(block, Table)]
    spreads = [row["spread_db"] for row in rows(table) if row["level_db"] is not None]
    assert len(spreads) == 2 * len(frame) and spreads == pytest.approx([1.5] * len(spreads))


def test_figures_of_several_channels_name_run_and_channels(judged):
    titles = [figure.title for figure in figures(spectra(judged)) if figure.name.startswith("spectrum-")]
    assert titles and not any(re.search(r"run \S+-\d+$", title) for title in titles)


# ---------------------------------------------------------------- the whole report


def test_no_table_of_recordings_lacks_its_origin_or_says_that_they_were_measured(judged):
    document = measured_report(judged)
    held = [b for b in walk(document.sections) if isinstance(b, Table) and b.name in ("quality", "quality-findings")]
    assert held and all(table.origin == "synthetic" for table in held)
    titles = [block.title for block in walk(document.sections) if isinstance(block, Section)]
    assert "What was recorded" in titles and not any("measured" in title for title in titles)


def test_the_report_begins_with_the_answer_and_folds_the_runs(judged):
    document = measured_report(judged)
    names = [section.id for section in document.sections]
    assert names[:3] == ["side-by-side", "listening", "sources"]
    spectra = document.sections[names.index("spectra")]
    assert sum(isinstance(block, Details) for block in spectra.blocks) == 2
    assert not any(isinstance(block, Section) for block in spectra.blocks)
    assert all(block.origin == "synthetic" for block in walk(document.sections) if isinstance(block, FigureBlock))


def test_the_same_analysis_gives_the_same_page(judged):
    again = analyze(judged.campaign, store=Path(judged.campaign.path).parent / "store", jobs=1)
    assert render_html(measured_report(again)) == render_html(measured_report(judged))


def test_without_a_fleet_nothing_is_ascribed_and_the_report_says_why(tmp_path):
    found = made(tmp_path, MICROPHONES + SENSORS + RUNS)
    assert all("dominant source undecided." in line for line in summary_lines(found))
    assert any(isinstance(block, Notice) and "No fleet file" in block.text for block in answer(found))
    names = [section.id for section in measured_report(found).sections]
    assert not {"side-by-side", "sources", "kinematics"} & set(names)


def test_without_a_fleet_overrides_and_exclusions_are_still_shown(tmp_path):
    found = made(tmp_path, MICROPHONES + SENSORS + RUNS + JUDGEMENTS)
    held = tables(sources(found))
    assert {"overrides", "exclusions"} <= set(held)
    assert {row["source"] for row in rows(held["sources-fast"])} == {"gearbox", "unassigned"}


def test_without_a_microphone_the_kinematics_remains(tmp_path):
    found = made(tmp_path, WITH_FLEET + SENSORS + RUNS)
    assert all("no noise level" in line for line in summary_lines(found))
    names = [section.id for section in measured_report(found).sections]
    assert "kinematics" in names and not {"side-by-side", "sources"} & set(names)
    assert rows(tables(kinematics(found))["kinematics"])[1]["excess_percent"] == pytest.approx(1.0, abs=0.06)


def test_levels_alone_are_said_to_be_stated(tmp_path):
    level = '[[level]]\ncondition = "3"\ndistance_m = 4.0\nlevel_db = 88.3\norigin = "paper, section 5.1"\n'
    found = made(tmp_path, WITH_FLEET + level)
    (words,) = summary_lines(found)
    assert words.startswith("Condition 3: 88.3 dB re 20 µPa at 4 m (paper, section 5.1), stated and not recorded")
    names = [section.id for section in measured_report(found).sections]
    assert not {"side-by-side", "sources", "kinematics"} & set(names)


@pytest.mark.parametrize(
    ("probability", "words"), [(1.0, "> 0.99"), (0.993, "0.99"), (0.5, "0.50"), (0.0, "< 0.01"), (None, "")]
)
def test_a_resampled_probability_is_never_certain(probability, words):
    assert probability_words(probability) == words


def test_signs_become_minus_and_words_keep_their_hyphens():
    assert pretty_signs("cross-talk -3 dB, mic-2 (-0.3 %)") == "cross-talk \u22123 dB, mic-2 (\u22120.3 %)"


def test_a_spread_between_runs_is_said_and_stands_in_the_table(plain):
    wide = [dataclasses.replace(verdict, n_runs=3, spread_db=2.34) for verdict in plain.dominance]
    found = dataclasses.replace(plain, dominance=tuple(wide))
    assert "the level of the 3 runs differs by up to 2.3 dB" in summary_lines(found)[0]
    (table,) = [block for block in answer(found) if isinstance(block, Table)]
    assert [(row["n_runs"], row["spread_db"]) for row in rows(table)] == [(3, 2.34)] * 2
    assert not any("rests on a single run" in getattr(block, "text", "") for block in answer(found))


def test_a_list_is_joined_in_the_language_that_is_spoken():
    with speaking(Language("de", {"{first} and {last}": "{first} und {last}"})):
        assert joined(["a", "b", "c"]) == "a, b und c"


@pytest.mark.parametrize("texts", [{}, {"speed not known": "Drehzahl unbekannt"}])
def test_lines_of_a_speed_that_is_not_known_may_move_in_every_language(texts):
    measurement = SimpleNamespace(speed=SimpleNamespace(leading=None))
    run = SimpleNamespace(
        run=SimpleNamespace(kind="test", condition="slow"),
        train_speed_km_h=None,
        motor_speed_hz=None,
        measurement=measurement,
    )
    analysis = SimpleNamespace(campaign=SimpleNamespace(excludes=()), runs=[run])
    with speaking(Language("de", texts)):
        assert _rest_words(analysis, "slow") == "the rest is broadband, or moves with a speed that is not known"
