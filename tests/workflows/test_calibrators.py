"""Calibrators and the sensor database as their user gets them: the command, its tables, its report."""

import csv
import math
import re

import h5py
import numpy as np
import pytest
from calibrator_campaigns import GIVEN_PA, VOLTS_PER_PA, calibrated_campaign, calibrator
from small_campaigns import HEAD, RATE_HZ, signal, table, write_log

from tdacoustic.campaign import load_campaign
from tdacoustic.steps import Store
from tdacoustic.workflows.groundwork import lay_groundwork
from tdacoustic.workflows.runs import prepare_runs


@pytest.fixture
def tda(call_program, tmp_path, monkeypatch):
    monkeypatch.setenv("TDACOUSTIC_STORE", str(tmp_path / "store"))

    def run(command, folder):
        code, out, err = call_program(command, folder, "-o", tmp_path / "out")
        tables = {}
        for path in (tmp_path / "out").glob("*.csv"):
            with path.open(newline="", encoding="utf-8") as stream:
                tables[path.stem] = list(csv.DictReader(stream))
        return code, out, err, tables

    return run


PUT_IN = "known input: a calibrator of 94 dB and a sine of 1 Pa in a made-up campaign"
TRUE_DB = 20 * math.log10(math.hypot(1.0, 0.01) / 20e-6)
"""Of the drive's run: a sine of 1 Pa and a little noise."""


def level_db(tables):
    return float(tables["levels"][0]["level_db"])


def the(tables, **keys):
    """The one row of ``sensors.csv`` with these cells."""
    (row,) = [row for row in tables["sensors"] if all(row[key] == value for key, value in keys.items())]
    return row


def test_a_sensitivity_that_is_wrong_by_3_db_is_said_and_not_changed(tda, tmp_path, conformance):
    calibrated_campaign(tmp_path / "c", sensitivity=f"{1e3 * VOLTS_PER_PA * 10 ** (3 / 20):.6g} mV/Pa")
    code, _, err, tables = tda("analyze", tmp_path / "c")
    assert code == 0
    assert "channel 'mic': read -3.00 dB off the stated scale, more than 0.5 dB: a peak value taken for an rms" in err
    deviation_db = float(the(tables, kind="calibration")["deviation_db"])
    conformance(
        "reading of a calibrator where the sensitivity is stated 3 dB too high", -3.0, deviation_db, 0.002, "dB", PUT_IN
    )
    assert the(tables, run="cal before")["verdict"] == "warning"
    assert level_db(tables) == pytest.approx(TRUE_DB - 3.0, abs=0.005)
    assert tables["levels"][0]["calibration"] == "doubtful"
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Levels of mic are doubtful" in report and "Sensors and calibrators" in report


def test_a_missing_sensitivity_is_set_and_levels_are_right(tda, tmp_path, conformance):
    calibrated_campaign(tmp_path / "c")
    code, _, err, tables = tda("analyze", tmp_path / "c")
    assert (code, err) == (0, "")
    row = the(tables, kind="calibration")
    assert row["sensitivity_set"].startswith("47.3 mV/Pa by calibrator runs cal before, cal after (94 dB)")
    conformance("level by a sensitivity that a calibrator sets", TRUE_DB, level_db(tables), 0.005, "dB", PUT_IN)
    assert tables["levels"][0]["calibration"] == "ok"
    assert float(row["drift_db"]) == pytest.approx(0.0, abs=0.002)
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Calibrators set the sensitivity of mic" in report
    assert any(line["check"] == "calibration" and line["run"] == "a" for line in tables["quality"])


def test_a_drift_of_0_8_db_is_said_wherever_the_channel_is(tda, tmp_path, conformance):
    calibrated_campaign(tmp_path / "c", sensitivity=f"{1e3 * VOLTS_PER_PA:.6g} mV/Pa", drift_db=0.8)
    code, out, err, tables = tda("check", tmp_path / "c")
    words = "after the runs +0.80 dB against before, more than 0.5 dB: levels between the two are doubtful"
    assert code == 0 and words in out and words in err
    code, _, err, tables = tda("analyze", tmp_path / "c")
    assert code == 0 and words in err
    drift_db = float(the(tables, kind="calibration")["drift_db"])
    conformance("drift between two calibrations", 0.8, drift_db, 0.002, "dB", PUT_IN)
    assert tables["levels"][0]["calibration"] == "doubtful"
    assert level_db(tables) == pytest.approx(TRUE_DB, abs=0.005)  # checked, not changed
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "ISO 3095 and ISO 3381 ask for a check with a calibrator" in report


def test_a_calibrator_of_114_db_taken_for_94_is_named(tda, tmp_path):
    calibrated_campaign(tmp_path / "c", sensitivity=f"{1e3 * VOLTS_PER_PA:.6g} mV/Pa", gives="114 dB")
    _, _, err, tables = tda("analyze", tmp_path / "c")
    assert "a 94 dB calibrator taken for one of 114 dB" in err
    assert "a 94 dB calibrator taken for one of 114 dB" in the(tables, run="cal before")["reason"]


def test_and_without_a_sensitivity_by_what_sensors_have(tda, tmp_path):
    calibrated_campaign(tmp_path / "c", gives="114 dB")
    _, _, err, _ = tda("analyze", tmp_path / "c")
    assert "473 mV/Pa is more than sensors have; is the calibrator one of 20 dB more or less" in err


def test_set_overrides_a_stated_scale(tda, tmp_path):
    path = calibrated_campaign(tmp_path / "c", sensitivity="67 mV/Pa")
    path.write_text(path.read_text() + '[analysis]\ncalibrators = "set"\n')
    _, _, _, tables = tda("analyze", path)
    assert level_db(tables) == pytest.approx(TRUE_DB, abs=0.005)
    assert "by which it reads -3.02 dB off" in the(tables, kind="calibration")["reason"]


def test_without_a_stated_calibrator_nothing_is_set_and_the_error_says_so(tda, tmp_path):
    calibrated_campaign(tmp_path / "c", stated=None)
    code, _, err, _ = tda("analyze", tmp_path / "c")
    assert code == 1 and "needs a sensitivity" in err and "the run states no calibrator" in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("tone", "words"),
    [
        ({"on_s": (2.0, 3.5)}, r"keeps its level for less than 2 s: too short"),
        ({"hz": 500.0}, r"its tone is at 500 Hz, but 1000 or 250 Hz is usual"),
        ({"step": (6.0, 1.2)}, r"steady at 2 levels that differ by up to 1.6 dB"),
    ],
)
def test_readings_that_cannot_be_used(tda, tmp_path, tone, words):
    calibrated_campaign(tmp_path / "c", sensitivity="47.3 mV/Pa", **tone)
    code, _, err, tables = tda("analyze", tmp_path / "c")
    assert code == 0 and re.search(words, err)
    assert the(tables, run="cal before")["verdict"] == "bad"
    assert tables["levels"][0]["calibration"] == "doubtful"


def test_numbers_of_no_unit_and_fractions_of_full_scale_are_scaled_too(tda, tmp_path):
    import soundfile

    folder = tmp_path / "c"
    folder.mkdir()
    full_scale_pa = 12.5
    for name, values in {
        "cal": calibrator(GIVEN_PA["94 dB"] / full_scale_pa, floor=1e-6),
        "drive": signal(1, 8.0, 200.0, 1.0, 0.01) / full_scale_pa,
    }.items():
        soundfile.write(folder / f"{name}.wav", values, int(RATE_HZ), subtype="PCM_24")
    runs = table("run", name="cal", kind="calibration_before", logs=["cal.wav"], calibrator="94 dB")
    runs += table("run", condition="a", logs=["drive.wav"], train_speed_km_h=30.0)
    mic = table("channel", name="mic", source=1, quantity="sound_pressure", role="receiver", distance_m=4.0)
    (folder / "campaign.toml").write_text(HEAD + mic + runs)
    code, _, err, tables = tda("analyze", folder)
    assert (code, err) == (0, "")
    row = the(tables, kind="calibration")
    assert row["sensitivity_set"].startswith("full scale is 12.5 Pa by calibrator run cal")
    assert "only before the runs: drift is not known" in row["reason"]
    assert level_db(tables) == pytest.approx(TRUE_DB, abs=0.005)


def test_each_microphone_has_its_own_time_and_the_neighbour_only_hears_it(tda, tmp_path):
    folder = tmp_path / "c"
    folder.mkdir()
    given = GIVEN_PA["94 dB"]
    one, two = calibrator(0.05 * given, (2.0, 8.0), 24.0), calibrator(0.04 * given, (14.0, 20.0), 24.0, seed=1)
    heard = 10 ** (-35 / 20)  # over the air
    drive = signal(1, 8.0, 200.0, 1.0, 0.01)
    cal = {"one": (one + heard * two, "V"), "two": (two + heard * one, "V"), "z": (np.full(one.size, 0.1), "m/s^2")}
    write_log(folder / "cal.h5", cal)
    write_log(folder / "a.h5", {"one": (0.05 * drive, "V"), "two": (0.04 * drive, "V"), "z": (drive, "m/s^2")})
    channels = "".join(
        table("channel", name=name, role="receiver", quantity="sound_pressure") for name in ("one", "two")
    )
    channels += table("channel", name="z", component="motor")
    runs = table("run", name="cal", kind="calibration_before", logs=["cal.h5"], calibrator="94 dB")
    runs += table("run", condition="a", logs=["a.h5"], train_speed_km_h=30.0)
    (folder / "campaign.toml").write_text(HEAD + channels + runs)
    code, _, _, tables = tda("analyze", folder)
    levels = {row["channel"]: float(row["level_db"]) for row in tables["levels"]}
    assert code == 0
    assert levels["one"] == pytest.approx(TRUE_DB, abs=0.02) and levels["two"] == pytest.approx(TRUE_DB, abs=0.02)
    assert {row["channel"] for row in tables["sensors"]} == {"one", "two"}


def test_two_days_have_two_sensitivities(tda, tmp_path):
    folder = tmp_path / "c"
    folder.mkdir()
    runs = ""
    for day, sensitivity in ((1, 0.05), (2, 0.03)):
        write_log(folder / f"cal{day}.h5", {"mic": (calibrator(sensitivity * GIVEN_PA["94 dB"]), "V")})
        write_log(folder / f"run{day}.h5", {"mic": (sensitivity * signal(day, 8.0, 200.0, 1.0, 0.01), "V")})
        runs += table("run", kind="calibration_before", logs=[f"cal{day}.h5"], calibrator="94 dB")
        runs += table("run", condition=f"day {day}", logs=[f"run{day}.h5"], train_speed_km_h=30.0)
    mic = table("channel", name="mic", role="receiver", quantity="sound_pressure")
    (folder / "campaign.toml").write_text(HEAD + mic + runs)
    _, _, _, tables = tda("analyze", folder)
    assert [float(row["level_db"]) for row in tables["levels"]] == pytest.approx([TRUE_DB, TRUE_DB], abs=0.02)
    assert [row["series"] for row in tables["sensors"] if row["kind"] == "calibration"] == ["1", "2"]


def test_ten_and_a_hundred_millivolts_per_g(tda, tmp_path):
    folder = tmp_path / "c"
    folder.mkdir()
    volts_per_m_s2 = 0.1 / 9.80665
    shaken = calibrator(10.0 * volts_per_m_s2, hz=159.155)
    write_log(folder / "cal.h5", {"z": (shaken, "V")})
    write_log(folder / "a.h5", {"z": (volts_per_m_s2 * signal(1, 8.0, 200.0, 1.0, 0.01), "V")})
    runs = table("run", name="cal", kind="calibration_before", logs=["cal.h5"], calibrator="10 m/s^2")
    runs += table("run", condition="a", logs=["a.h5"], train_speed_km_h=30.0)
    text = HEAD + runs + table("channel", name="z", component="motor", sensitivity="10 mV/g")
    (folder / "campaign.toml").write_text(text)
    _, _, err, tables = tda("analyze", folder)
    assert "read +20.00 dB off the stated scale" in err and "10 and 100 mV/g" in err
    assert "reads 100 m/s^2 rms for 10 (+20.00 dB) at 159.1" in the(tables, run="cal")["reason"]
    (folder / "campaign.toml").write_text(text.replace("10 mV/g", "100 mV/g"))
    _, _, err, tables = tda("analyze", folder)
    assert err == "warning: no microphone among the channels: no noise level, no noise lines, no dominance\n"
    assert abs(float(the(tables, run="cal")["deviation_db"])) < 0.002


# ---------------------------------------------------------------- sensor database


def with_database(folder, rows, run="", **keys):
    path = calibrated_campaign(folder, text='sensors = "sensors.csv"\n', channel={"sensor": "SN 7"}, **keys)
    (path.parent / "sensors.csv").write_text("serial,sensitivity,date,due\n" + rows, encoding="utf-8")
    path.write_text(path.read_text().replace('condition = "a"\n', 'condition = "a"\n' + run))
    return path


def test_the_sensitivity_of_the_database_at_the_date_of_the_run(tda, tmp_path):
    rows = "7,20 mV/Pa,2023-01-01,2024-01-01\n7,47.3 mV/Pa,2025-01-01,2026-01-01\n7,99 mV/Pa,2027-01-01,\n"
    with_database(tmp_path / "c", rows, 'date = "2025-06-01"\n')
    code, _, _, tables = tda("analyze", tmp_path / "c")
    assert code == 0 and level_db(tables) == pytest.approx(TRUE_DB, abs=0.005)
    row = the(tables, kind="database", calibrated_on="2025-01-01")
    assert (row["run"], row["verdict"], row["scale_from"]) == ("a", "ok", "sensor database")
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "sensor SN 7 of sensors.csv, calibrated on 2025-01-01" in report


def test_an_overdue_calibration_and_a_contradiction_are_said(tda, tmp_path):
    path = with_database(tmp_path / "c", "7,47.3 mV/Pa,2023-01-01,2024-01-01\n", 'date = "2025-06-01"\n')
    _, out, _, _ = tda("check", path)
    assert "run a, mic, sensor: its calibration was due on 2024-01-01, before the run of 2025-06-01" in out
    path = with_database(tmp_path / "d", "7,47.3 mV/Pa,2023-01-01,\n", sensitivity="50 mV/Pa")
    (tmp_path / "out").rename(tmp_path / "old")
    _, out, _, _ = tda("check", path)
    assert "the campaign says 50 mV/Pa, the sensor database 47.3 mV/Pa, +0.48 dB apart; the campaign's is used" in out


def test_the_database_is_an_input_and_its_sensitivity_is_checked_by_calibrators(tda, tmp_path):
    with_database(tmp_path / "c", "7,40 mV/Pa,,\n")
    _, _, err, _ = tda("analyze", tmp_path / "c")
    assert "read +1.46 dB off the stated scale" in err  # 47.3 over 40
    manifest = (tmp_path / "out" / "manifest.json").read_text(encoding="utf-8")
    assert '"file": "sensors.csv"' in manifest


def test_the_date_is_that_of_the_log_where_the_campaign_says_none(tda, tmp_path):
    path = with_database(tmp_path / "c", "7,20 mV/Pa,2023-01-01,\n7,47.3 mV/Pa,2025-01-01,\n")
    with h5py.File(path.parent / "drive.h5", "a") as file:
        file.attrs["start_time"] = "2024-06-01T10:00:00+02:00"
    _, _, _, tables = tda("analyze", path)
    assert the(tables, kind="database", calibrated_on="2023-01-01")["run"] == "a"
    assert level_db(tables) == pytest.approx(TRUE_DB + 20 * math.log10(47.3 / 20.0), abs=0.005)


# ---------------------------------------------------------------- what must not change


def test_a_campaign_without_calibrators_computes_nothing_for_them(tmp_path):
    path = calibrated_campaign(tmp_path / "c", sensitivity="47.3 mV/Pa")
    text = path.read_text()
    runs = text.split("[[run]]")
    path.write_text(runs[0] + "[[run]]" + runs[2])
    campaign, store = load_campaign(path), Store(tmp_path / "store")
    ground = lay_groundwork(campaign, store)
    assert not ground.sensors.any and not ground.records
    (alone,) = prepare_runs(campaign, store)
    path.write_text(text)
    among = {item.run.name: item for item in prepare_runs(load_campaign(path), store)}
    assert among["a"].measurement.key == alone.measurement.key  # a check changes no number, so nothing is recomputed
