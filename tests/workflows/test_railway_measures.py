"""The railway standards through the command: known passages, what is missing, repetition, silence elsewhere."""

import math

import numpy as np
import pandas as pd
import pytest
from railway_campaigns import (
    FRONT_S,
    LENGTH_M,
    REAR_S,
    pass_by_campaign,
    pass_by_level_db,
    run,
    sine,
    wayside,
)
from small_campaigns import HEAD, MIC, RATE_HZ, small_campaign, table, write_log

from tdacoustic import analyze
from tdacoustic.reporting.document import Sentences, Table, walk
from tdacoustic.reporting.sections.railway import railway, railway_words
from tdacoustic.workflows.output import OutputFolder
from tdacoustic.workflows.write import write_analysis


def analysed(path):
    return analyze(path, store=path.parent / "store", jobs=1)


def rows(analysis, **match):
    frame = analysis.tables["railway"]
    for key, value in match.items():
        frame = frame[frame[key] == value]
    return frame


def said(analysis):
    section = railway(analysis)
    return [item for block in walk([section]) if isinstance(block, Sentences) for item in block.items]


@pytest.fixture(scope="module")
def passages(tmp_path_factory):
    settings = "\n[railway]\nstandards = ['ISO 3095:2013', 'ISO 3095:2025']\nreference_track = true\n"
    return analysed(pass_by_campaign(tmp_path_factory.mktemp("passages"), text=settings))


def test_the_summary_names_the_results_of_a_condition(passages):
    words = railway_words(passages, "80")
    assert words == "pass-by LpAeq,Tp = 93 dB at left (ISO 3095:2013 and ISO 3095:2025)"
    assert railway_words(passages, "no such condition") == ""


def test_the_levels_of_known_passages(passages, conformance):
    for name, (left, right) in (("p1", (1.0, 0.5)), ("p2", (1.1, 0.55)), ("p3", (0.95, 0.475))):
        for channel, rms in (("left", left), ("right", right)):
            (row,) = rows(passages, run=name, channel=channel, standard="ISO 3095:2013").to_dict("records")
            assert (row["test"], row["symbol"]) == ("pass-by", "LpAeq,Tp")
            assert (row["start_s"], row["end_s"]) == pytest.approx((FRONT_S, REAR_S))
            source = "known input: incoherent sources along a moving line"
            # Intervals of 10 ms at both ends, the filter at 1 kHz.
            what = f"LpAeq,Tp of run {name}, {channel}, by the command"
            conformance(what, pass_by_level_db(rms), row["level_db"], 0.03, "dB", source)


def test_what_is_known_and_what_is_not(passages):
    (row,) = rows(passages, run="p1", channel="left", standard="ISO 3095:2013").to_dict("records")
    assert row["state"] == "unknown"
    unknown = [part for part in row["findings"].split("; ") if part.startswith("unknown")]
    assert len(unknown) == 2  # the speed within the interval, the background
    assert "met: reference track" in row["findings"] and "met: microphone 7.5 m" in row["findings"]
    assert "met: record begins at least 10 dB below the unit's front" in row["findings"]
    (newer,) = rows(passages, run="p1", channel="left", standard="ISO 3095:2025").to_dict("records")
    assert newer["level_db"] == row["level_db"]
    assert "taken over from 2013 [not verified against the standard's text]" in newer["findings"]


def test_repetition_and_the_decisive_position(passages):
    held = rows(passages, run="", standard="ISO 3095:2013").set_index("channel")
    mean = np.mean([pass_by_level_db(rms) for rms in (1.0, 1.1, 0.95)])
    assert held.loc["left", "level_db"] == pytest.approx(mean, abs=0.03)
    assert held.loc["left", "n_runs"] == 3 and held.loc["left", "reported_db"] == math.floor(mean + 0.5)
    assert held.loc["left", "spread_db"] == pytest.approx(20.0 * math.log10(1.1 / 0.95), abs=0.02)
    assert bool(held.loc["left", "decisive"]) and not bool(held.loc["right", "decisive"])
    assert any(
        f"LpAeq,Tp = {math.floor(mean + 0.5)} dB at left, the loudest of 2 positions" in words
        for words in said(passages)
    )


def test_the_exposure_level_is_of_the_edition_that_had_it(passages):
    held = rows(passages, run="p1", channel="left", symbol="TEL").to_dict("records")
    assert [row["standard"] for row in held] == ["ISO 3095:2005"]
    # Its energy over the whole record is that of the line: the level of the sources themselves.
    assert held[0]["level_db"] == pytest.approx(20.0 * math.log10(1.0 / 20e-6), abs=0.25)


def test_a_campaign_without_these_keys_has_no_table_and_no_section(tmp_path):
    found = analysed(small_campaign(tmp_path, conditions=("a",)))
    assert "railway" not in found.tables and found.railway is None and railway(found) is None
    assert not any(key.startswith("railway") for key in found.campaign.settings)


def test_runs_too_far_apart_have_no_result(tmp_path):
    found = analysed(pass_by_campaign(tmp_path, rms=((1.0, 0.5), (1.5, 0.5), (1.0, 0.5))))
    left = rows(found, run="", channel="left").to_dict("records")[0]
    assert pd.isna(left["reported_db"]) and "runs lie 3.5 dB apart, 3 dB are allowed" in left["reason"]
    right = rows(found, run="", channel="right").to_dict("records")[0]
    assert right["reported_db"] == math.floor(pass_by_level_db(0.5) + 0.5) and bool(right["decisive"])


def test_one_instant_with_length_and_speed_is_enough_and_a_cut_moves_nothing(tmp_path):
    path = pass_by_campaign(tmp_path, rms=((1.0, 0.5),), text=f"\n[railway]\nunit_length_m = {LENGTH_M}\n")
    text = path.read_text(encoding="utf-8").replace(f"rear_s = {REAR_S}\n", "start_s = 2.0\n")
    path.write_text(text, encoding="utf-8")
    (row,) = rows(analysed(path), run="p1", channel="left", symbol="LpAeq,Tp").to_dict("records")
    assert (row["start_s"], row["end_s"]) == pytest.approx((FRONT_S, REAR_S), abs=1e-6)
    assert row["level_db"] == pytest.approx(pass_by_level_db(1.0), abs=0.03)


def test_without_the_instants_it_is_said_why_there_is_no_level(tmp_path):
    path = pass_by_campaign(tmp_path, rms=((1.0, 0.5),))
    text = path.read_text(encoding="utf-8").replace(f"rear_s = {REAR_S}\n", "")
    path.write_text(text, encoding="utf-8")
    found = analysed(path)
    held = rows(found, symbol="LpAeq,Tp")
    assert held["level_db"].isna().all() and (held["run"] != "").all()
    assert held["reason"].str.startswith("nothing says when the unit's front and rear pass").all()
    assert any("no LpAeq,Tp (left in run p1; right in run p1): nothing says when" in words for words in said(found))


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    """Two positions of a standing unit, an inner microphone, a start; one microphone is cut off at its range."""
    folder = tmp_path_factory.mktemp("standing")
    channels = (
        wayside("a", stands_for_m=10.0) + wayside("b", stands_for_m=30.0) + wayside("loud", stands_for_m=10.0)
        + table("channel", name="seat", quantity="sound_pressure", place="interior", height_above_floor_m=1.2)
        + table("channel", name="train", quantity="speed", unit="km/h")
    )  # fmt: skip
    runs, t = [], np.arange(round(22.0 * RATE_HZ)) / RATE_HZ
    for number in (1, 2, 3):
        name = f"s{number}"
        clipped = np.clip(sine(22.0, 1.0, number), -0.4, 0.4)
        write_log(
            folder / f"{name}.h5",
            {
                "a": (sine(22.0, 0.1, number), "Pa"),
                "b": (sine(22.0, 0.2, number), "Pa"),
                "loud": (clipped, "Pa"),
                "seat": (sine(22.0, 0.05, number), "Pa"),
                "train": (0.01 * np.ones_like(t), "km/h"),
            },
        )
        runs.append(run(name, "still", test="stationary"))
    up = np.concatenate((np.full(t.size // 2, 0.05), np.full(t.size - t.size // 2, 0.2)))
    start = {name: (sine(22.0, 1.0, 7) * up, "Pa") for name in ("a", "b", "loud", "seat")}
    start["train"] = (np.maximum(0.0, 2.0 * (t - 5.0)), "km/h")
    write_log(folder / "go.h5", start)
    runs.append(run("go", "start", test="starting"))
    write_log(folder / "quiet.h5", {name: (sine(5.0, 0.03, 9), "Pa") for name in ("a", "b", "loud", "seat")})
    runs.append(table("run", name="quiet", kind="background", logs=["quiet.h5"]))
    (folder / "campaign.toml").write_text(HEAD + channels + "".join(runs), encoding="utf-8")
    return analysed(folder / "campaign.toml")


def test_a_standing_unit_by_its_positions(standing, conformance):
    first = rows(standing, run="s1", channel="a").to_dict("records")[0]
    assert first["level_db"] == pytest.approx(20.0 * math.log10(0.1 / 20e-6), abs=0.02)
    # The background of 63.5 dB lies 10.5 dB below at a: far enough. At the seat 4.4 dB: broken, and corrected beside.
    assert "met: background" in first["findings"] and "met: vehicle at standstill" in first["findings"]
    seat = rows(standing, run="s1", channel="seat").to_dict("records")[0]
    assert seat["standard"] == "ISO 3381:2021" and seat["state"] == "broken"
    energy = 0.05**2 - 0.03**2
    assert seat["corrected_db"] == pytest.approx(10.0 * math.log10(energy / 20e-6**2), abs=0.1)
    assert pd.isna(first["corrected_db"])


def test_a_clipped_microphone_has_no_level_and_leaves_the_unit_without_one(standing):
    held = rows(standing, channel="loud", test="stationary")
    assert held["level_db"].isna().all() and held["reason"].str.startswith("the channel cannot be used").all()
    assert held["reason"].str.contains(r"samples \(8\d", regex=True).all()  # how many lie at the limit
    unit = rows(standing, symbol="LpAeq,T,unit").to_dict("records")[0]
    assert pd.isna(unit["level_db"]) and unit["reason"] == "no level at loud"


def test_the_start_has_its_maximum(standing):
    row = rows(standing, run="go", channel="b").to_dict("records")[0]
    assert (row["test"], row["symbol"]) == ("starting", "LpAFmax")
    assert row["level_db"] == pytest.approx(20.0 * math.log10(0.2 / 20e-6), abs=0.1)


def test_the_unit_by_length(tmp_path, conformance):
    folder = tmp_path
    runs = []
    for number in (1, 2, 3):
        levels = {"a": (sine(21.0, 0.1, number), "Pa"), "b": (sine(21.0, 0.2, number), "Pa")}
        write_log(folder / f"s{number}.h5", levels)
        runs.append(run(f"s{number}", "still", test="stationary", train_speed_km_h=0))
    channels = wayside("a", stands_for_m=10.0) + wayside("b", stands_for_m=30.0)
    (folder / "campaign.toml").write_text(HEAD + channels + "".join(runs), encoding="utf-8")
    found = analysed(folder / "campaign.toml")
    (unit,) = rows(found, symbol="LpAeq,T,unit").to_dict("records")
    energy = (10.0 * 0.1**2 + 30.0 * 0.2**2) / 40.0
    source = "standard: ISO 3095:2013, 5.7, formulas (1) and (2), as quoted by the program phonometry"
    level = 10.0 * math.log10(energy / 20e-6**2)
    conformance(
        "level of a standing unit of two positions, by the command", level, unit["level_db"], 0.02, "dB", source
    )
    assert unit["reported_db"] == math.floor(level + 0.5)
    assert "met: vehicle at standstill" in rows(found, run="s1", channel="a").to_dict("records")[0]["findings"]


def test_a_rate_that_holds_no_a_weighting_is_refused_with_the_reason(tmp_path):
    import h5py

    with h5py.File(tmp_path / "slow.h5", "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        values = np.random.default_rng(1).standard_normal(20000).astype(np.float32)
        held = file.create_dataset("left", data=values, track_times=False)
        held.attrs["sample_rate_hz"], held.attrs["unit"] = 1000.0, "Pa"
    text = HEAD + wayside("left") + run("slow", "1", test="stationary")
    (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
    found = analysed(tmp_path / "campaign.toml")
    (row,) = rows(found, run="slow").to_dict("records")
    assert pd.isna(row["level_db"]) and row["reason"] == (
        "A-weighted levels over time take a rate of at least 2000 Hz, got 1000"
    )


def test_what_a_standard_does_not_rate_is_said(tmp_path):
    seat = table("channel", name="seat", quantity="sound_pressure", place="interior", height_above_floor_m=1.2)
    write_log(tmp_path / "p.h5", {"left": (sine(4.0, 0.1), "Pa"), "seat": (sine(4.0, 0.1), "Pa")})
    runs = run("p", "1", test="constant-speed", train_speed_km_h=80)
    (tmp_path / "campaign.toml").write_text(HEAD + wayside("left") + seat + runs, encoding="utf-8")
    found = analysed(tmp_path / "campaign.toml")
    left = rows(found, run="p", channel="left").to_dict("records")[0]
    assert left["reason"] == "ISO 3095:2013 rates constant speed by the pass-by of a microphone beside the track"
    inner = rows(found, run="p", channel="seat").to_dict("records")[0]
    assert inner["level_db"] == pytest.approx(20.0 * math.log10(0.1 / 20e-6), abs=0.02)
    assert "broken: at least 20 s (4.0 s" in inner["findings"]


def test_a_place_without_a_test_is_a_problem_in_words(tmp_path):
    path = small_campaign(
        tmp_path, conditions=("a",), channels=MIC.replace("[[channel]]\n", '[[channel]]\nplace = "wayside"\n')
    )
    found = analysed(path)
    assert any(
        problem.startswith("railway: no run that could be measured states its test") for problem in found.problems
    )
    assert len(found.tables["railway"]) == 0


def test_the_files_hold_the_table_and_the_levels_over_time(passages, tmp_path):
    import h5py

    folder = OutputFolder(tmp_path / "out", passages.campaign.path)
    write_analysis(passages, folder, "analyze")
    frame = pd.read_csv(tmp_path / "out" / "railway.csv", dtype={"run": str})
    assert len(frame) == len(passages.tables["railway"])
    with h5py.File(tmp_path / "out" / "result.h5") as file:
        group = file["p1/hearing/left"]
        times, fast = group["level_time_s"][:], group["fast"][:]
        assert times[-1] == pytest.approx(17.0) and fast.shape == times.shape
        middle = 0.5 * (FRONT_S + REAR_S)
        assert times[np.argmax(fast)] == pytest.approx(middle, abs=2.5)
        assert "ISO_TS 20065:2022" in group
    html = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "By the railway standards" in html and "not verified against the standard" in html


def test_the_report_shows_front_and_rear_and_each_requirement(passages):
    from tdacoustic.reporting.document import FigureBlock
    from tdacoustic.reporting.figure import Line, Rule

    section = railway(passages)
    figures = [block.figure for block in walk([section]) if isinstance(block, FigureBlock)]
    assert len(figures) == 1 and [e.name for e in figures[0].elements if isinstance(e, Line)] == [
        "run p1",
        "run p2",
        "run p3",
    ]
    rules = {element.label: element.x for element in figures[0].elements if isinstance(element, Rule)}
    rear = REAR_S - FRONT_S
    assert rules == pytest.approx({"front": 0.0, "rear, p1": rear, "rear, p2": rear, "rear, p3": rear})
    tables = {block.name: block for block in walk([section]) if isinstance(block, Table)}
    assert {"railway", "railway-repetition", "railway-findings"} <= set(tables)
    states = [row[3] for row in tables["railway-findings"].rows]
    assert states == sorted(states, key=["broken", "unknown", "met"].index)


def test_run_table_knows_the_keys(tmp_path):
    write_log(tmp_path / "p.h5", {"mic": (sine(3.0, 0.1), "Pa")})
    (tmp_path / "runs.csv").write_text(
        "condition,logs,test,front_s,rear_s,train_speed_km_h\n1,p.h5,pass-by,1.0,2.0,80\n"
    )
    (tmp_path / "campaign.toml").write_text(HEAD.replace("\n\n", '\nruns = "runs.csv"\n\n', 1) + MIC, encoding="utf-8")
    from tdacoustic.campaign import load_campaign

    (held,) = load_campaign(tmp_path / "campaign.toml").runs
    assert (held.test, held.front_s, held.rear_s) == ("pass-by", 1.0, 2.0)
