"""Is it tonal, through the command: labels of steady runs and run-ups, what cannot be rated, tables, the report."""

import math

import numpy as np
import pandas as pd
import pytest
from small_campaigns import HEAD, RATE_HZ, run_table, table, write_log

from tdacoustic import analyze
from tdacoustic.reporting.document import FigureBlock, Paragraph, Sentences, Shown, Table, walk
from tdacoustic.reporting.figure import Line, Markers
from tdacoustic.reporting.sections.tones import tones
from tdacoustic.workflows.output import OutputFolder
from tdacoustic.workflows.tonality import ECMA, PROMINENCE, RATIO
from tdacoustic.workflows.write import write_analysis

ISO, DIN = "ISO/TS 20065:2022", "DIN 45681:2005-03"
FLEET = """
schema = "tdacoustic-fleet/1"
name = "Small drive"
[train]
wheel_diameter_mm = 1000
[[gear_pair]]
teeth = [20, 60]
[motor]
carrier_hz = 400
"""
MESH_30_HZ = 20.0 * 3.0 * (30.0 / 3.6) / math.pi  # 159.15
FLOOR_PA = 0.02
DENSITY = FLOOR_PA**2 / (0.5 * RATE_HZ)


def width_hz(frequency_hz):
    return 25.0 + 75.0 * (1.0 + 1.4e-6 * frequency_hz**2) ** 0.69


def amplitude(frequency_hz, ratio_db):
    """Of a sine so far over the noise of its critical band."""
    return math.sqrt(2.0 * DENSITY * width_hz(frequency_hz) * 10.0 ** (0.1 * ratio_db))


def noise(seconds, seed):
    return FLOOR_PA * np.random.default_rng(seed).standard_normal(round(seconds * RATE_HZ))


def sines(seconds, *parts, seed=0):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    x = noise(seconds, seed)
    for number, (frequency, ratio_db) in enumerate(parts):
        x = x + amplitude(frequency, ratio_db) * np.sin(2.0 * np.pi * frequency * t + number)
    return x


def mic(name, **keys):
    return table("channel", name=name, quantity="sound_pressure", **{"role": "receiver", "distance_m": 4.0, **keys})


def analysed(folder, channels, runs, fleet=True, text=""):
    (folder / "fleet.toml").write_text(FLEET, encoding="utf-8")
    head = HEAD + ('fleet = "fleet.toml"\n' if fleet else "")
    (folder / "campaign.toml").write_text(head + channels + "".join(runs) + text, encoding="utf-8")
    return analyze(folder / "campaign.toml", store=folder / "store", jobs=1)


def near(frame, frequency, **match):
    for key, value in match.items():
        frame = frame[frame[key] == value]
    return frame[(frame["frequency_hz"] - frequency).abs() < 3.0].to_dict("records")


SENSOR = table("channel", name="gear", component="gearbox", quantity="acceleration")


@pytest.fixture(scope="module")
def steady(tmp_path_factory):
    """Mesh x2, a tone of the carrier and one of nobody, 13, 6 and -4 dB over the noise of their critical bands."""
    folder = tmp_path_factory.mktemp("steady")
    for number, condition in enumerate(("a", "b")):
        parts = ((2.0 * MESH_30_HZ, 13.0), (800.0, 6.0), (1034.0, -4.0)) if condition == "a" else ()
        write_log(
            folder / f"{condition}.h5",
            {
                "left": (sines(40.0, *parts, seed=number), "Pa"),
                "near": (sines(40.0, *parts, seed=number + 5), "Pa"),
                "gear": (noise(40.0, number + 7) + sines(40.0, (2.0 * MESH_30_HZ, 20.0), seed=number + 9), "m/s^2"),
            },
        )
    channels = mic("left") + mic("near", role="near_field", distance_m=0.5) + SENSOR
    return analysed(folder, channels, [run_table("a"), run_table("b")])


@pytest.mark.parametrize("channel", ["left", "near"])
def test_each_tone_has_its_value_order_and_owner(steady, channel, conformance):
    frame = steady.tables["tones"]
    for frequency, ratio, excitation, owner in (
        (2.0 * MESH_30_HZ, 13.0, "mesh x2", "gearbox"),
        (800.0, 6.0, "carrier x2", "motor"),
        (1034.0, -4.0, "unknown", "unassigned"),
    ):
        (row,) = near(frame, frequency, run="a", channel=channel, method=RATIO)
        assert (row["excitation"], row["owner"]) == (excitation, owner), frequency
        assert row["order"] == pytest.approx(frequency / (30.0 / 3.6 / math.pi * 3.0), rel=1e-4)
        what = f"tone-to-noise ratio at {frequency:.0f} Hz, {channel}, by the command"
        # Noise of a band of 100 Hz and more over 40 s: 0.1 dB; the weak tone itself scatters by 0.3 dB.
        tolerance = 0.4 if ratio > 0.0 else 0.9
        note = "the weak tone beats with the noise of its own line" if ratio < 0.0 else ""
        conformance(what, ratio, row["value_db"], tolerance, "dB", "known input: sine in white noise", note)
        assert row["prominent"] is (ratio >= row["criterion_db"])
        (same,) = near(frame, frequency, run="a", channel=channel, method=PROMINENCE)
        assert same["owner"] == owner and same["criterion_db"] > row["criterion_db"]
    (mesh,) = near(frame, 2.0 * MESH_30_HZ, run="a", channel=channel, method=ISO)
    assert mesh["excitation"] == "mesh x2" and mesh["weighting"] == "A" and bool(mesh["audible"])
    index = -2.0 - math.log10(1.0 + (2.0 * MESH_30_HZ / 502.0) ** 2.5)
    # White noise rises with the A curve within the band: 0.5 dB.
    assert mesh["value_db"] == pytest.approx(13.0 - index, abs=0.9)


def test_the_rating_of_each_microphone(steady):
    frame = steady.tables["tonality"].set_index(["run", "channel", "method"])
    tonal, quiet = frame.loc[("a", "left", ISO)], frame.loc[("b", "left", ISO)]
    assert tonal["mean_audibility_db"] == pytest.approx(15.2, abs=0.9)
    assert quiet["mean_audibility_db"] < -8.0
    assert frame.loc[("a", "left", DIN), "adjustment_db"] == 6.0
    assert pd.isna(frame.loc[("a", "left", ISO), "adjustment_db"])
    assert tonal["n_spectra"] == 13 and "fewer than 12" not in tonal["notes"]
    assert tonal["notes"] == "sampled at 4096 Hz: tones above 1900 Hz cannot be rated"
    assert frame.loc[("a", "left", ECMA), "notes"].startswith("it gives no mean audibility; prominent tones: 1 of 3")
    assert frame["speed_from"].isna().all()
    assert frame.notna()["notes"].all()


def test_the_reports_table_has_a_dash_where_no_tone_is_audible(tmp_path):
    logs = {"left": (sines(12.0, (800.0, 10.0)), "Pa"), "right": (noise(12.0, 3), "Pa")}
    write_log(tmp_path / "a.h5", logs)
    found = analysed(tmp_path, mic("left") + mic("right"), [run_table("a")], fleet=False)
    loud = {rating.channel: rating.mean_audibility_db for rating in found.tonality.ratings if rating.method == ISO}
    rated = next(b for b in walk([tones(found)]) if isinstance(b, Table) and b.name == "tonality")
    keys = [column.key for column in rated.columns]
    cells = {row[keys.index("channel")]: row[keys.index("mean_audibility_db")] for row in rated.rows}
    for channel, mean in loud.items():
        if mean == pytest.approx(-10.0):  # what ISO/TS 20065 sets for no audible tone
            assert cells[channel] == Shown("\N{EN DASH}", mean) and "A dash in the audibility" in rated.caption
        else:
            assert cells[channel] == mean
    assert loud["left"] > 0.0 and loud["right"] == pytest.approx(-10.0)


def test_an_override_is_the_owner_of_the_tone_too(tmp_path):
    write_log(tmp_path / "a.h5", {"left": (sines(12.0, (800.0, 10.0)), "Pa"), "gear": (noise(12.0, 3), "m/s^2")})
    word = table("override", condition="a", frequency_hz=800, source="gearbox", reason="seen on the bench")
    found = analysed(tmp_path, mic("left") + SENSOR, [run_table("a")], text=word)
    for method in (ISO, DIN, RATIO, PROMINENCE):
        (row,) = near(found.tables["tones"], 800.0, method=method)
        assert row["owner"] == "gearbox", method


def test_without_a_fleet_the_tones_are_there_and_nobodys(tmp_path):
    write_log(tmp_path / "a.h5", {"left": (sines(12.0, (800.0, 10.0)), "Pa")})
    found = analysed(tmp_path, mic("left"), [run_table("a")], fleet=False)
    (row,) = near(found.tables["tones"], 800.0, method=ISO)
    assert (row["owner"], row["excitation"]) == ("unassigned", "unknown") and pd.isna(row["order"])


# ---------------------------------------------------------------- run-ups


@pytest.fixture(scope="module")
def run_up(tmp_path_factory):
    """30 s of a slow run-up, 1 % in 3 s: a mesh harmonic that climbs and a tone that stands."""
    folder = tmp_path_factory.mktemp("run-up")
    t = np.arange(round(30.0 * RATE_HZ)) / RATE_HZ
    turns = 8.0 * t + 0.5 * 0.026 * t**2  # 8 to 8.78 turns of the motor a second
    x = noise(30.0, 1) + amplitude(165.0, 14.0) * np.sin(2.0 * np.pi * 20.0 * turns)
    x += amplitude(745.0, 8.0) * np.sin(2.0 * np.pi * 745.0 * t)
    write_log(folder / "up.h5", {"left": (x, "Pa"), "rpm": (60.0 * (8.0 + 0.026 * t), "rpm")})
    speed = table("channel", name="rpm", quantity="speed", unit="rpm", shaft="motor")
    run = table("run", name="up", condition="up", logs=["up.h5"])
    return analysed(folder, mic("left") + speed, [run])


def test_tones_of_a_run_up_are_rated_and_named_by_speed_class(run_up):
    frame = run_up.tables["tones"]
    frame = frame[frame["method"] == ISO]
    mesh = frame[frame["excitation"] == "mesh x1"].sort_values("speed_from")
    assert len(mesh) == 10 and set(mesh["owner"]) == {"gearbox"} and set(mesh["speed_unit"]) == {"km/h"}
    assert np.all(np.diff(mesh["frequency_hz"]) > 0.0)
    assert np.allclose(mesh["order"], 20.0, rtol=5e-3)
    km_h = 8.39 / 3.0 * math.pi * 3.6  # the middle of the run
    assert mesh["speed_from"].min() < km_h < mesh["speed_to"].max()
    still = frame[(frame["frequency_hz"] - 745.0).abs() < 1.0]
    assert len(still) == 10 and set(still["owner"]) == {"unassigned"} and set(still["excitation"]) == {"unknown"}


def test_a_run_up_has_its_classes_and_no_verdict(run_up):
    frame = run_up.tables["tonality"]
    iso = frame[frame["method"] == ISO]
    assert len(iso) == 11 and iso["speed_from"].isna().sum() == 1
    whole = iso[iso["speed_from"].isna()].to_dict("records")[0]
    assert "a run-up: the mean is over unlike sounds" in whole["notes"] and pd.isna(whole["adjustment_db"])
    assert "the speed changes by up to 0.96 % within a spectrum of 3 s" in whole["notes"]
    (ecma,) = frame[frame["method"] == ECMA].to_dict("records")
    assert ecma["notes"] == "not rated: the speed changes, there is no averaged spectrum"
    section = tones(run_up)
    (answer, *_) = [block.text for block in section.blocks if isinstance(block, Paragraph)]
    assert "condition up: rated spectrum by spectrum, for the speed changes" in answer and "tonal at" not in answer
    names = [block.figure.name for block in walk([section]) if isinstance(block, FigureBlock)]
    assert names == ["audibility-up", "tones-over-speed-up"]


# ---------------------------------------------------------------- what cannot be rated


def test_what_cannot_be_used_has_a_row_with_the_reason(tmp_path):
    cut_off = np.clip(sines(12.0, (800.0, 10.0)), -0.01, 0.01)
    held = {"left": (sines(12.0, (800.0, 10.0)), "Pa"), "clipped": (cut_off, "Pa")}
    write_log(tmp_path / "a.h5", {**held, "raw": (noise(12.0, 2), None)})  # in which unit nobody says
    write_log(tmp_path / "b.h5", {**held, "raw": (noise(12.0, 2), "Pa")})
    channels = mic("left") + mic("clipped") + mic("raw")
    found = analysed(tmp_path, channels, [run_table("a"), run_table("b", train_speed_km_h=60.0)])
    frame = found.tables["tonality"].set_index(["run", "channel", "method"])
    for channel, words in (("clipped", "samples"), ("raw", "the log states no unit")):
        for method in (ISO, DIN, ECMA):
            row = frame.loc[("a", channel, method)]
            assert pd.isna(row["mean_audibility_db"]) and row["n_spectra"] == 0
            assert row["notes"].startswith("not rated, the channel cannot be used: ") and words in row["notes"]
    assert frame.loc[("b", "raw", ISO), "n_spectra"] == 4
    assert set(found.tables["tones"]["channel"]) == {"left"}
    said = [item for block in walk([tones(found)]) if isinstance(block, Sentences) for item in block.items]
    assert any(item.startswith("Condition a (30 km/h), clipped: not rated, the channel cannot") for item in said)


def test_a_record_too_short_is_said_and_the_rest_goes_on(tmp_path):
    write_log(tmp_path / "a.h5", {"left": (sines(12.0, (800.0, 10.0)), "Pa")})
    write_log(tmp_path / "b.h5", {"left": (sines(0.2, (800.0, 10.0)), "Pa")})
    found = analysed(tmp_path, mic("left"), [run_table("a"), run_table("b")])
    frame = found.tables["tonality"].set_index(["run", "method"])
    assert frame.loc[("a", ISO), "mean_audibility_db"] > 0.0
    assert "819 samples at 4096 Hz give" in frame.loc[("b", ISO), "notes"]
    assert not any("no tones" in problem for problem in found.problems)


def test_no_microphone_no_table(tmp_path):
    write_log(tmp_path / "a.h5", {"gear": (sines(6.0, (300.0, 10.0)), "m/s^2")})
    found = analysed(tmp_path, SENSOR, [run_table("a")])
    assert not {"tones", "tonality"} & set(found.tables) and tones(found) is None


def test_check_and_calibrate_do_not_hear(tmp_path):
    write_log(tmp_path / "a.h5", {"left": (sines(6.0, (300.0, 10.0)), "Pa")})
    (tmp_path / "campaign.toml").write_text(HEAD + mic("left") + run_table("a"), encoding="utf-8")
    found = analyze(tmp_path / "campaign.toml", store=tmp_path / "store", jobs=1, deeper=False)
    assert found.tonality is None and "tones" not in found.tables


def test_a_renamed_label_does_not_hear_again(tmp_path):
    write_log(tmp_path / "a.h5", {"left": (sines(6.0, (300.0, 10.0)), "Pa")})
    keys = set()
    for side in ("left", "right"):
        text = HEAD + mic("left", side=side, distance_m=4.0 if side == "left" else 7.5) + run_table("a")
        (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
        found = analyze(tmp_path / "campaign.toml", store=tmp_path / "store", jobs=1)
        keys |= {key for key, record in found.records if record.step == "hearing"}
    assert len(keys) == 1


# ---------------------------------------------------------------- the report


def test_the_report_answers_first_and_says_what_is_not_known(steady):
    section = tones(steady)
    (answer, *_) = [block.text for block in section.blocks if isinstance(block, Paragraph)]
    assert "condition a: tonal at a receiver at least; condition b: not tonal" in answer
    assert answer.endswith(f"By {ECMA} a tone is prominent in condition a.")
    said = [item for block in walk([section]) if isinstance(block, Sentences) for item in block.items]
    (first,) = [item for item in said if item.startswith("Condition a (30 km/h)")]
    assert "318 Hz (mesh x2, gearbox)" in first and "800 Hz (carrier x2, motor)" in first
    assert "tone adjustment 6 dB (DIN 45681)" in first and "prominent by ECMA-418-1: 318 Hz" in first
    assert any("[not verified against the standard's text]" in item for item in said)
    assert any("Tones above 15500 Hz are not rated" in item for item in said)


def test_the_figure_has_both_curves_and_each_owner(steady):
    figures = [block.figure for block in walk([tones(steady)]) if isinstance(block, FigureBlock)]
    spectrum = next(figure for figure in figures if figure.name.startswith("tones-a"))
    lines = {element.name: element for element in spectrum.elements if isinstance(element, Line)}
    assert {"left", "prominent from here", "audible from here"} <= set(lines)
    markers = {element.name: element for element in spectrum.elements if isinstance(element, Markers)}
    assert {"owner gearbox", "owner motor", "owner unknown"} <= set(markers)
    assert any("318 Hz mesh x2" in label for label in markers["owner gearbox"].labels)
    for name, is_prominent, is_audible in (
        ("owner gearbox", True, True),
        ("owner motor", False, True),
        ("owner unknown", False, False),
    ):
        for curve, over in (("prominent from here", is_prominent), ("audible from here", is_audible)):
            known = np.isfinite(lines[curve].y)
            from_here = np.interp(markers[name].x[0], lines[curve].x[known], lines[curve].y[known])
            assert bool(markers[name].y[0] > from_here) is over, (name, curve)


def test_every_tone_of_the_table_stands_in_the_report(steady):
    held = {block.name: block for block in walk([tones(steady)]) if isinstance(block, Table)}
    assert len(held["tones"].rows) == len(steady.tables["tones"])
    assert len(held["tonality"].rows) == 4


def test_the_files_hold_both_tables(steady, tmp_path):
    folder = OutputFolder(tmp_path / "out", steady.campaign.path)
    write_analysis(steady, folder, "analyze")
    for name in ("tones", "tonality"):
        frame = pd.read_csv(tmp_path / "out" / f"{name}.csv")
        assert list(frame.columns) == list(steady.tables[name].columns) and len(frame) == len(steady.tables[name])
    text = (tmp_path / "out" / "tones.csv").read_text(encoding="utf-8")
    assert ",true," in text and ",false," in text and "nan" not in text.lower()
    assert "Is it tonal?" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
