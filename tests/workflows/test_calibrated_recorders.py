"""Calibrators on several recorders, as their user gets them: whose readings, on which time, in which series."""

import math

import h5py
import numpy as np
import pytest
from small_campaigns import HEAD, RATE_HZ, files_of, table
from two_recorders_calibrated import GIVEN_PA, VOLTS_PER_PA, calibrator_run, campaign, drive, tone, write

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError
from tdacoustic.formats import scan
from tdacoustic.steps import Store
from tdacoustic.workflows.analyze import analyze
from tdacoustic.workflows.groundwork import lay_groundwork

TRUE_DB = 20 * math.log10(1.0 / 20e-6)
"""Of the drive's run: a sine of 1 Pa."""
LEFT, RIGHT = (GIVEN_PA * VOLTS_PER_PA[side] for side in ("left", "right"))
"""Volts that the calibrator makes of each microphone."""


def found_in(folder, runs, **keys):
    return analyze(campaign(folder, runs, **keys), folder / "store", deeper=False)


def levels(found):
    rows = found.tables["levels"]
    rows = rows[rows["run"] == "a"]
    return dict(zip(rows["channel"], rows["level_db"], strict=True))


def set_mv(found):
    """The sensitivities in mV/Pa that calibrators set."""
    rows = found.tables["sensors"]
    rows = rows[(rows["kind"] == "calibration") & rows["sensitivity_set"].notna()]
    words = zip(rows["channel"], rows["sensitivity_set"], strict=True)
    return {channel: float(text.split()[0]) for channel, text in words}


RIGHT_SET = {"left": 50.0, "right": 11.0}


def each_alone(folder, left_keys=(), right_keys=()):
    write(folder / "cal_left.h5", tone(LEFT, [(2.0, 10.0)], 12.0))
    write(folder / "cal_right.h5", tone(RIGHT, [(2.0, 10.0)], 12.0))
    return [
        calibrator_run("cal left", ["cal_left.h5"], **dict(left_keys)),
        calibrator_run("cal right", ["cal_right.h5"], **dict(right_keys)),
    ]


# ---------------------------------------------------------------- one recorder alone


def test_a_recorder_alone_calibrates_the_channels_that_the_run_names(tmp_path):
    runs = each_alone(tmp_path, {"calibrated": ["left"]}, {"calibrated": ["right"]})
    found = found_in(tmp_path, runs)
    assert set_mv(found) == pytest.approx(RIGHT_SET, rel=1e-3)
    assert levels(found) == pytest.approx({"left": TRUE_DB, "right": TRUE_DB}, abs=0.005)
    assert found.problems == ()
    bound = {run.name: [channel.name for channel in run.recording.channels] for run in found.runs}
    assert (bound["cal left"], bound["cal right"]) == (["left"], ["right"])


def test_whose_recorder_it_is_may_be_told_by_the_names_in_its_log(tmp_path):
    write(tmp_path / "cal_right.h5", tone(RIGHT, [(2.0, 10.0)], 12.0), channel="ch8")
    write(tmp_path / "cal_left.h5", tone(LEFT, [(2.0, 10.0)], 12.0), channel="ch1")
    runs = [calibrator_run(f"cal {side}", [f"cal_{side}.h5"]) for side in ("left", "right")]
    found = found_in(tmp_path, runs, names=("ch1", "ch8"))
    assert set_mv(found) == pytest.approx(RIGHT_SET, rel=1e-3)
    assert found.problems == ()
    # and no run says that the other recorder's channels are not in its log
    quality = found.tables["quality"]
    assert not quality["detail"].str.contains("is not in|the run has 1 log").any()


def test_nothing_is_set_where_neither_tells_it(tmp_path):
    path = campaign(tmp_path, each_alone(tmp_path), sensitivity="50 mV/Pa")
    found = analyze(path, tmp_path / "store", deeper=False)
    said = "calibrator run 'cal right' holds 1 of 2 logs (cal_right.h5), and whether of log 1 or 2 cannot be told: name"
    assert [problem.startswith(said) for problem in found.problems] == [False, True]  # once for each run
    assert not (found.tables["sensors"]["kind"] == "calibration").any()
    path.write_text(path.read_text().replace('sensitivity = "50 mV/Pa"\n', ""))
    with pytest.raises(CampaignError, match=r"needs a sensitivity(.|\n)*calibrated = \[\.\.\.\]"):
        analyze(path, tmp_path / "store")


def test_two_of_three_recorders(tmp_path):
    write(tmp_path / "b" / "log.h5", tone(LEFT, [(2.0, 10.0)], 12.0))
    write(tmp_path / "c" / "log.h5", tone(RIGHT, [(14.0, 20.0)], 24.0))
    path = campaign(tmp_path, [calibrator_run("cal", ["b/log.h5", "c/log.h5"], calibrated=["left", "right"])])
    text = path.read_text().replace("log = 2", "log = 3").replace("log = 1", "log = 2")
    text = text.replace('["left.h5", "right.h5"]', '["first.h5", "left.h5", "right.h5"]')
    write(tmp_path / "first.h5", drive(5, 0.02))
    path.write_text(text)
    found = analyze(path, tmp_path / "store", deeper=False)
    assert set_mv(found) == pytest.approx(RIGHT_SET, rel=1e-3)


def test_a_name_that_the_log_does_not_hold_is_said(tmp_path):
    write(tmp_path / "cal_left.h5", tone(LEFT, [(2.0, 10.0)], 12.0), channel="ch1")
    runs = [calibrator_run("cal left", ["cal_left.h5"], calibrated=["left", "right"])]
    found = found_in(tmp_path, runs, names=("ch1", "ch8"), sensitivity="50 mV/Pa")
    (said,) = [problem for problem in found.problems if "calibrated names" in problem]
    assert said.startswith("calibrator run 'cal left': calibrated names 'right': source 'ch8' is not in cal_left.h5")
    runs = [calibrator_run("cal left", ["cal_left.h5"], calibrated=["left", "right"])]
    found = found_in(tmp_path, runs, names=("ch1", "ch1"), sensitivity="50 mV/Pa")
    assert sum("another channel of the same source in cal_left.h5" in problem for problem in found.problems) == 2
    assert found.sensors.calibrations == ()


def test_a_channel_that_no_log_holds_is_still_refused(tmp_path):
    path = campaign(tmp_path, each_alone(tmp_path, {"calibrated": ["left"]}, {"calibrated": ["right"]}))
    channel = table("channel", name="third", source="ai9", log=1, quantity="sound_pressure")
    path.write_text(path.read_text().replace("[[run]]", channel + "[[run]]", 1))
    with pytest.raises(CampaignError, match=r"channel 'third' \(run a, left\.h5, right\.h5\): source 'ai9' is not in"):
        analyze(path, tmp_path / "store")


def with_a_motor(folder, name_in_calibration):
    """A microphone and an accelerometer; the calibrator's log holds the microphone alone, under that name."""
    write(folder / "cal.h5", tone(LEFT, [(2.0, 10.0)], 12.0), channel=name_in_calibration)
    write(folder / "run.h5", drive(1, 0.05), channel="mic", z=drive(2, 0.01))
    mic = table("channel", name="mic", quantity="sound_pressure", role="receiver", sensitivity="50 mV/Pa")
    motor = table("channel", name="motor", source="z", component="motor", sensitivity="10 mV/g")
    runs = calibrator_run("cal", ["cal.h5"])
    runs += table("run", condition="a", logs=["run.h5"], train_speed_km_h=30.0)
    (folder / "campaign.toml").write_text(HEAD + mic + motor + runs, encoding="utf-8")
    return analyze(folder, folder / "store", deeper=False)


def test_a_calibrator_run_says_nothing_of_channels_that_its_log_lacks(tmp_path):
    found = with_a_motor(tmp_path, "mic")
    assert [problem for problem in found.problems if "motor" in problem] == []
    quality = found.tables["quality"]
    assert not ((quality["run"] == "cal") & (quality["channel"] == "motor")).any()
    assert [item.channel for item in found.sensors.calibrations] == ["mic"]
    assert [channel.name for channel in found.runs[1].recording.channels] == ["mic", "motor"]


def test_but_that_it_holds_none_of_them(tmp_path):
    found = with_a_motor(tmp_path, "mic_7")
    assert "calibrator run 'cal': none of its channels can have been calibrated" in found.problems
    assert not any("is not in" in problem for problem in found.problems)
    assert [channel.name for channel in found.runs[1].recording.channels] == ["mic", "motor"]


# ---------------------------------------------------------------- several recorders in one run

SYNC = np.random.default_rng(3).standard_normal(round(60.0 * RATE_HZ))


def in_turn(folder, late_s=4.0, first=(2.0, 8.0), second=(14.0, 20.0)):
    """Both recorders on, one shared noise, the calibrator on the left and then on the right, in the left one's time."""
    n, late = round(30.0 * RATE_HZ), round(late_s * RATE_HZ)
    own = [(start - late_s, end - late_s) for start, end in (second,)]
    write(folder / "cal_l.h5", tone(LEFT, [first], 30.0), sync=SYNC[:n])
    write(folder / "cal_r.h5", tone(RIGHT, own, 26.0, seed=1), sync=0.3 * SYNC[late : late + round(26.0 * RATE_HZ)])
    return ["cal_l.h5", "cal_r.h5"]


def readings(found):
    rows = found.tables["sensors"]
    rows = rows[rows["kind"] == "calibration_before"]
    return {row["channel"]: (row["from_s"], row["to_s"]) for row in rows.to_dict("records")}


def test_a_calibrator_run_is_read_on_the_time_axis_of_all_its_logs(tmp_path):
    logs = in_turn(tmp_path)
    found = found_in(tmp_path, [calibrator_run("cal", logs, align_on=["sync"])])
    assert set_mv(found) == pytest.approx(RIGHT_SET, rel=1e-3)
    on = readings(found)
    assert on["left"] == pytest.approx((2.0, 8.0), abs=0.5)
    assert on["right"] == pytest.approx((14.0, 20.0), abs=0.5)  # on the left recorder's axis, 4 s later than its own


def test_and_so_is_its_cut(tmp_path):
    # in its own time the right recorder has the tone from 10 to 16 s: a cut at 13 s of it would leave 3 s
    logs = in_turn(tmp_path)
    cut = {"align_on": ["sync"], "start_s": 13.0, "end_s": 21.0, "calibrated": ["right"]}
    found = found_in(tmp_path, [calibrator_run("cal", logs, **cut)], sensitivity="50 mV/Pa")
    start, end = readings(found)["right"]
    assert (start, end) == pytest.approx((14.0, 20.0), abs=0.5)
    assert end - start > 5.0


def test_a_cut_is_on_the_axis_of_the_run_also_in_a_single_log(tmp_path):
    write(tmp_path / "cal.h5", tone(LEFT, [(12.0, 18.0)], 24.0))
    cut = {"start_s": 10.0, "end_s": 20.0, "calibrated": ["left"]}
    found = found_in(tmp_path, [calibrator_run("cal", ["cal.h5"], **cut)], sensitivity="50 mV/Pa")
    assert readings(found)["left"] == pytest.approx((12.0, 18.0), abs=0.5)


@pytest.mark.parametrize("starts", [("10:00:00.000", "10:20:00.500"), ("10:00:00", "10:20:00")])
def test_recorders_calibrated_one_after_the_other_need_not_overlap(tmp_path, starts):
    for side, rms, start in (("left", LEFT, starts[0]), ("right", RIGHT, starts[1])):
        write(tmp_path / f"cal_{side}.h5", tone(rms, [(2.0, 10.0)], 12.0), start_time=f"2026-05-01T{start}Z")
    found = found_in(tmp_path, [calibrator_run("cal", ["cal_left.h5", "cal_right.h5"])])
    # at the same time by their own clocks and 13 dB apart: not taken for one that hears the other
    assert set_mv(found) == pytest.approx(RIGHT_SET, rel=1e-3)
    assert levels(found) == pytest.approx({"left": TRUE_DB, "right": TRUE_DB}, abs=0.005)
    assert found.problems == ()
    assert readings(found)["right"][0] > 1200.0
    quality = found.tables["quality"]
    assert set(quality[quality["check"] == "clock"]["verdict"]) == {"ok"}


def without_a_shared_signal(folder):
    for number, (side, rms) in enumerate((("left", LEFT), ("right", RIGHT))):
        noise = np.random.default_rng(20 + number).standard_normal(round(24.0 * RATE_HZ))
        on = [(2.0, 8.0)] if side == "left" else [(14.0, 20.0)]
        write(folder / f"cal_{side}.h5", tone(rms, on, 24.0), sync=noise)
    return ["cal_left.h5", "cal_right.h5"]


def test_logs_that_cannot_be_aligned_calibrate_all_the_same_and_are_inputs(tmp_path):
    found = found_in(tmp_path, [calibrator_run("cal", without_a_shared_signal(tmp_path), align_on=["sync"])])
    assert any("'cal' is left out" in problem and "is not aligned" in problem for problem in found.problems)
    assert "calibrator run 'cal' is read with its logs taken as started together" in found.problems
    assert set_mv(found) == pytest.approx(RIGHT_SET, rel=1e-3)
    assert levels(found) == pytest.approx({"left": TRUE_DB, "right": TRUE_DB}, abs=0.005)
    inputs = {item.written: item for item in found.inputs}
    assert {"cal_left.h5", "cal_right.h5"} < set(inputs)
    assert inputs["cal_right.h5"].n_bytes == (tmp_path / "cal_right.h5").stat().st_size


def test_but_not_where_a_cut_counts_on_the_axis_that_is_not_known(tmp_path):
    logs = without_a_shared_signal(tmp_path)
    run = calibrator_run("cal", logs, align_on=["sync"], start_s=1.0, end_s=23.0)
    found = found_in(tmp_path, [run], sensitivity="50 mV/Pa")
    assert any("'cal' is not read: start_s and end_s count on the axis" in problem for problem in found.problems)
    assert "sensors" in found.tables and len(found.tables["sensors"]) == 0


# ---------------------------------------------------------------- names, series, scans


def of_one_name(folder, *starts):
    """A run of one/log.h5 and two/log.h5."""
    for name, start in zip(("one", "two"), starts, strict=True):
        write(folder / name / "log.h5", drive(3, 0.05), start_time=f"2026-05-01T{start}Z")
    path = campaign(folder, [], sensitivity="50 mV/Pa")
    path.write_text(path.read_text().replace('["left.h5", "right.h5"]', '["one/log.h5", "two/log.h5"]'))
    return path


def test_logs_of_one_file_name_are_told_apart_by_their_paths(tmp_path):
    path = of_one_name(tmp_path, "10:00:00.000", "10:00:00.250")
    found = analyze(path, tmp_path / "store", deeper=False)
    (row,) = found.tables["clocks"].to_dict("records")
    assert (row["log"], row["reference_log"]) == ("two/log.h5", "one/log.h5")
    assert "one/log.h5" in found.runs[0].recording["right"].scaling
    path.write_text(path.read_text().replace('source = "ai0"\nlog = 2', 'source = "ai7"\nlog = 2'))
    with pytest.raises(CampaignError, match=r"\(run a, one/log\.h5, two/log\.h5\): source 'ai7' is not in two/log\.h5"):
        analyze(path, tmp_path / "store")
    path.write_text(path.read_text().replace("log = 2", "").replace('"ai7"', '"ai0"'))
    with pytest.raises(CampaignError, match=r"source 'ai0' is in one/log\.h5 and in two/log\.h5"):
        analyze(path, tmp_path / "store")


def test_coarse_starts_of_logs_of_one_name_are_both_said(tmp_path):
    path = of_one_name(tmp_path, "10:00:00", "10:00:02")
    found = analyze(path, tmp_path / "store", deeper=False)
    quality = found.tables["quality"]
    assert quality["detail"].str.contains("one/log.h5 at 2026-05-01T10:00:00Z, two/log.h5 at").any()


def day(folder, number, sensitivity, **keys):
    write(folder / f"cal{number}.h5", tone(sensitivity * GIVEN_PA, [(2.0, 10.0)], 12.0))
    write(folder / f"run{number}.h5", drive(number, sensitivity))
    cal = calibrator_run(f"cal {number}", [f"cal{number}.h5"], **keys)
    return cal + table("run", condition=f"day {number}", logs=[f"run{number}.h5"], train_speed_km_h=30.0)


def series_of_days(folder, change):
    """Two days with a calibrator run each, and a third one between them with which something is wrong."""
    folder.mkdir(parents=True, exist_ok=True)
    between = day(folder, 9, 0.02, **({} if change != "rejected" else {"valid": False, "reject_reason": "loose"}))
    if change == "unreadable":
        (folder / "cal9.h5").write_bytes(b"no log")
    mic = table("channel", name="mic", source="ai0", role="receiver", quantity="sound_pressure")
    runs = day(folder, 1, 0.05) + between + day(folder, 2, 0.03)
    head = 'schema = "tdacoustic-campaign/1"\nname = "Days"\norigin = "measured"\n\n'
    (folder / "campaign.toml").write_text(head + mic + runs, encoding="utf-8")
    campaign_of_days, store = load_campaign(folder), Store(folder / "store")
    return lay_groundwork(campaign_of_days, store).sensors


def test_series_count_over_all_valid_runs(tmp_path):
    # a rejected calibrator run begins no series: what was driven behind it belongs to the one before
    rejected = series_of_days(tmp_path / "r", "rejected")
    assert [item.series for item in rejected.calibrations] == [1, 2]
    scales = {run: held["mic"].words.split()[0] for run, held in rejected.scales.items()}
    assert (scales["day 1"], scales["day 9"], scales["day 2"]) == ("50", "50", "30")
    # one that cannot be read does begin one: nobody knows what was changed between the days
    broken = series_of_days(tmp_path / "u", "unreadable")
    assert [item.series for item in broken.calibrations] == [1, 3]
    assert "day 9" not in broken.scales


def test_each_log_is_scanned_once_by_a_command(tmp_path, monkeypatch):
    logs = in_turn(tmp_path)
    path = campaign(tmp_path, [calibrator_run("cal", logs, align_on=["sync"])])
    analyze(path, tmp_path / "store", deeper=False)
    opened, whole = [], h5py.File

    class Counted(whole):
        def __init__(self, name, *args, **keys):
            opened.append(str(getattr(name, "name", name)).replace("\\", "/").rsplit("/", 1)[-1])
            super().__init__(name, *args, **keys)

    monkeypatch.setattr(h5py, "File", Counted)
    for name in (*logs, "left.h5", "right.h5"):
        scan(tmp_path / name)
    once = sorted(name for name in opened if name in files_of(tmp_path))
    opened.clear()
    again = analyze(path, tmp_path / "store", deeper=False)  # what reads samples is in the store
    assert sorted(name for name in opened if name in files_of(tmp_path)) == once
    assert len(once) >= 4
    assert set_mv(again) == pytest.approx(RIGHT_SET, rel=1e-3)


def test_a_calibrator_that_disagrees_with_the_stated_scale_is_a_doubt_also_where_it_sets_it(tmp_path):
    runs = each_alone(tmp_path, {"calibrated": ["left"]}, {"calibrated": ["right"]})
    found = found_in(tmp_path, runs, sensitivity="50 mV/Pa", text='[analysis]\ncalibrators = "set"\n')
    by_channel = {item.channel: item for item in found.sensors.calibrations}
    assert [by_channel[name].verdict for name in ("left", "right")] == ["ok", "warning"]
    off_db = 20 * math.log10(11.0 / 50.0)
    assert f"instead of the stated scale, by which it reads {off_db:+.2f} dB off, more" in by_channel["right"].reason
    assert any("channel 'right'" in problem for problem in found.problems)
    assert levels(found) == pytest.approx({"left": TRUE_DB, "right": TRUE_DB}, abs=0.005)
