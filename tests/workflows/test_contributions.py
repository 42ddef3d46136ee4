"""Contributions from logs to tables and report: drives whose truth is known, rigs that must be refused, bad input."""

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "contributions"))

from drive_campaigns import GEARBOX, HEAD, MIC, MOTOR, UNITS, decimated, drive, table, write_campaign, write_log
from simulated_drive import RATE, record

from tdacoustic import analyze
from tdacoustic.reporting.document import Paragraph, Sentences, walk
from tdacoustic.reporting.measured_report import measured_report
from tdacoustic.reporting.sections.answer import answer
from tdacoustic.reporting.sections.contributions import contributions
from tdacoustic.reporting.sections.modes import modes

POWERS = np.array([[4.0, 1.0], [1.0, 1.0], [0.5, 3.0]])
TONES = ([(0, 300.0, 3.0)], [(0, 300.0, 3.0), (1, 500.0, 3.0)], [(1, 500.0, 4.0)])
NUMBERS = {"motor": 0, "gearbox": 1}


def level_db(power):
    return 10.0 * np.log10(power / 4e-10)


def said(blocks):
    words = [block.text for block in walk(blocks) if isinstance(block, Paragraph)]
    return " ".join([*words, *(item for block in walk(blocks) if isinstance(block, Sentences) for item in block.items)])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drive")
    path, records = write_campaign(folder, POWERS, tones=TONES, seconds=24.0)
    return path, records, folder


@pytest.fixture(scope="module")
def found(made):
    path, _, folder = made
    return analyze(path, folder / "store", jobs=1)


# ---------------------------------------------------------------- a drive with known contributions


def test_known_contributions_come_back_in_bands(found, made, conformance):
    """Two thirds of the bands are told; of these errors as in tests/evidence: 95 % within 1 dB, none above 3."""
    _, records, _ = made
    table = found.tables["contributions"]
    table = table[(table["kind"] == "band") & table["part"].isin(NUMBERS)]
    known = table[table["verdict"] == "ok"]
    assert len(known) > 0.5 * len(table)
    true = [
        level_db(records[row.condition].true_power(NUMBERS[row.part], row.low_hz, row.high_hz))
        for row in known.itertuples()
    ]
    error = np.abs(known["level_db"].to_numpy() - true)
    conformance(
        "contributions of bands, 95 % of the errors",
        0.0,
        float(np.percentile(error, 95)),
        1.0,
        "dB",
        "known input: simulated drive of known contributions",
        "a statistical estimate from short records, and stated with its interval",
    )
    assert error.max() < 3.0
    inside = (known["low_db"] <= true) & (true <= known["high_db"])
    assert inside.mean() > 0.85


def test_tones_are_given_to_the_source_that_makes_them(found, made):
    _, records, _ = made
    table = found.tables["contributions"].set_index(["condition", "span", "part"])
    for condition, span, part in (("20", "tone 300 Hz", "motor"), ("40", "tone 500 Hz", "gearbox")):
        row = table.loc[(condition, span, part)]
        assert (row["kind"], row["verdict"]) == ("tone", "ok")
        true = level_db(records[condition].true_power(NUMBERS[part], row["low_hz"], row["high_hz"]))
        assert row["level_db"] == pytest.approx(true, abs=1.0)
        assert row["probability_largest"] > 0.9
    assert set(table.loc["20"].index.get_level_values(0)) >= {"total", "tones", "broadband"}


def test_dominance_carries_the_kinds_of_evidence(found):
    held = found.tables["dominance"].set_index("condition")
    assert held.loc["20", "contribution_dominant"] == "motor"
    assert held.loc["40", "contribution_dominant"] == "gearbox"
    assert held.loc["20", "sensor_dominant"] == "motor"
    assert held.loc["20", "evidence_agreement"] == "agree"
    assert held.loc["20", "evidence_source"] == "motor" and held.loc["20", "evidence_joint"] > 0.9
    assert pd.isna(held.loc["20", "order_dominant"])  # without a fleet no order is known
    assert (held["dominant"] == "undecided").all()  # as before


def test_the_answer_says_that_the_evidence_agrees(found):
    words = said(answer(found))
    assert "The kinds of evidence agree: sensors and contributions say motor; orders name no source." in words


def test_the_report_says_what_comes_from_where(found):
    section = contributions(found)
    words = said([section])
    assert "by the paths of 3 operating states together" in words
    assert "Condition 20 (20 km/h): of the tones'" in words
    names = [block.id for block in measured_report(found).sections]
    assert "contributions" in names


def test_every_empty_number_has_its_reason(found):
    table = found.tables["contributions"]
    empty = table[table["level_db"].isna() | table["low_db"].isna()]
    assert (empty["reason"].fillna("") != "").all()
    coherence = found.tables["coherence"]
    assert (coherence[coherence["value"].isna()]["reason"].fillna("") != "").all()
    assert coherence[["low", "high", "averages"]].notna().all(axis=None)
    assert set(coherence["kind"]) == {"ordinary", "multiple", "partial", "references"}


def test_coherence_of_the_sensors_is_that_of_the_cross_talk(found):
    """At the motor's tone the gearbox's sensor hears the motor and next to nothing else."""
    table = found.tables["coherence"]
    row = table[(table["run"] == "20") & (table["kind"] == "references") & (table["frequency_hz"] == 300.0)].iloc[0]
    assert row["span"] == "tone 300 Hz"
    assert row["low"] <= row["corrected"] <= row["high"]
    assert row["corrected"] > 0.8


def test_a_renamed_component_measures_nothing_again(made, tmp_path):
    path, _, folder = made
    text = path.read_text(encoding="utf-8").replace('component = "gearbox"', 'component = "wheelset"')
    path.with_name("other.toml").write_text(text, encoding="utf-8")
    steps = []
    analyze(path.with_name("other.toml"), folder / "store", jobs=1, progress=lambda what, *_: steps.append(what))
    assert any("Contributions of components" in step for step in steps)
    assert not any("Cross spectra" in step for step in steps)


def test_the_command_writes_the_tables(made, tmp_path):
    path, _, folder = made
    command = [sys.executable, "-m", "tdacoustic", "analyze", str(path), "-o", str(tmp_path / "out"), "--quiet"]
    subprocess.run([*command, "--store", str(folder / "store")], check=True, cwd=Path(__file__).parents[2])
    contributions_csv = pd.read_csv(tmp_path / "out" / "contributions.csv")
    assert {"motor", "gearbox", "residual", "total"} == set(contributions_csv["part"])
    assert (tmp_path / "out" / "coherence.csv").is_file()
    assert not (tmp_path / "out" / "modes.csv").exists()  # no runs to be compared
    assert "How many decibels come from where" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


# ---------------------------------------------------------------- what must not be claimed


def test_a_rig_with_one_source_is_refused_in_table_and_report(tmp_path):
    """Both sensors feel one source, at different noise; three runs of different power."""
    rig = drive(gains=np.array([[1.0], [0.6]]), sensor_noise=1e-3)
    path, _ = write_campaign(tmp_path, [[4.0], [1.0], [2.0]], made_by=rig)
    got = analyze(path, tmp_path / "store", jobs=1)
    table = got.tables["contributions"]
    parts = table[table["part"].isin(NUMBERS)]
    assert (parts["verdict"] != "ok").all()
    assert (parts["verdict"] == "refused").mean() > 0.8
    refused = parts[parts["verdict"] == "refused"]
    assert refused["level_db"].isna().all() and refused["high_db"].notna().all()
    assert (refused["reason"] != "").all()
    assert "refused, at most" in said([contributions(got)])
    assert got.tables["dominance"]["contribution_dominant"].isna().all()
    coherent = got.contributions.coherent(got.contributions.states[0].name)
    assert coherent.coherence > 0.95


def test_one_run_is_flagged_and_the_answer_says_so(tmp_path):
    path, _ = write_campaign(tmp_path, POWERS[:1], tones=TONES[:1])
    got = analyze(path, tmp_path / "store", jobs=1)
    table = got.tables["contributions"]
    parts = table[table["part"].isin(NUMBERS)]
    assert (parts["verdict"] != "ok").all() and (parts["n_states"] == 1).all()
    words = said(answer(got))
    assert (
        "ontributions name no source: from a single operating state the loudest part cannot be told from cross-talk "
        "with the gearbox, so it may be" in words
    )
    assert "(the sensors of the two are coherent by 0." in words
    assert "from a single operating state, which cannot tell cross-talk" in said([contributions(got)])


def test_paths_that_change_between_runs_are_flagged(tmp_path):
    """The microphone of one run is connected the wrong way round at half the gain."""
    path, _ = write_campaign(tmp_path, POWERS, tones=TONES)
    with h5py.File(tmp_path / "30.h5", "r+") as file:
        file["mic"][...] = -0.5 * file["mic"][...]
    got = analyze(path, tmp_path / "store", jobs=1)
    table = got.tables["contributions"]
    rows = table[(table["run"] == "30") & (table["kind"] == "band") & table["part"].isin(NUMBERS)]
    assert not (rows["verdict"] == "ok").any()
    assert rows["reason"].str.startswith("paths differ from state to state").any()


def test_one_component_alone_is_flagged(tmp_path):
    path, _ = write_campaign(tmp_path, POWERS, channels=MOTOR + MIC)
    got = analyze(path, tmp_path / "store", jobs=1)
    table = got.tables["contributions"]
    motor = table[table["part"] == "motor"]
    assert not (motor["verdict"] == "ok").any()
    assert motor["reason"].str.contains("has sensors alone").any()
    assert "One component alone has sensors" in said([contributions(got)])


# ---------------------------------------------------------------- what is missing


def test_without_component_names_there_is_nothing_and_it_is_said(tmp_path):
    plain = table("channel", name="motor_z", quantity="acceleration") + table(
        "channel", name="gearbox_z", quantity="acceleration"
    )
    path, _ = write_campaign(tmp_path, POWERS[:2], channels=plain + MIC, seconds=4.0)
    got = analyze(path, tmp_path / "store", jobs=1)
    assert not {"contributions", "coherence"} & set(got.tables)
    assert contributions(got) is None
    assert "no contributions of components: no accelerometer names the component it sits on" in got.problems


def test_without_microphones_there_is_nothing(tmp_path):
    path, _ = write_campaign(tmp_path, POWERS[:2], channels=MOTOR + GEARBOX, seconds=4.0)
    got = analyze(path, tmp_path / "store", jobs=1)
    assert not {"contributions", "coherence"} & set(got.tables)
    assert not any("contributions" in problem for problem in got.problems)


def test_without_accelerometers_there_is_nothing(tmp_path):
    path, _ = write_campaign(tmp_path, POWERS[:2], channels=MIC, seconds=4.0)
    got = analyze(path, tmp_path / "store", jobs=1)
    assert not {"contributions", "coherence"} & set(got.tables)
    assert not any("contributions" in problem for problem in got.problems)


def test_a_run_at_another_rate_is_taken_in(tmp_path):
    path, records = write_campaign(tmp_path, POWERS)
    halved = {name: (decimated(row), UNITS[name]) for name, row in zip(UNITS, records["30"].samples, strict=True)}
    write_log(tmp_path / "30.h5", halved, rates=dict.fromkeys(UNITS, RATE / 2))
    got = analyze(path, tmp_path / "store", jobs=1)
    assert {state.run for state in got.contributions.states} == {"20", "30", "40"}
    table = got.tables["contributions"]
    assert table["high_hz"].max() <= 0.4 * RATE / 2 + 4.0  # of the lowest rate
    known = table[(table["run"] == "30") & (table["kind"] == "band") & (table["verdict"] == "ok")]
    known = known[known["part"].isin(NUMBERS)]
    assert len(known)
    for row in known.itertuples():
        true = level_db(records["30"].true_power(NUMBERS[row.part], row.low_hz, row.high_hz))
        assert row.level_db == pytest.approx(true, abs=3.0)


def test_a_sensor_on_another_raster_is_left_out_and_named(tmp_path):
    path, records = write_campaign(tmp_path, POWERS)
    for name, made_of in records.items():
        rows = dict(zip(UNITS, made_of.samples, strict=True))
        logged = {channel: (row, UNITS[channel]) for channel, row in rows.items() if channel != "gearbox_z"}
        logged["gearbox_z"] = decimated(rows["gearbox_z"]), "m/s^2"
        write_log(tmp_path / f"{name}.h5", logged, rates={"gearbox_z": RATE / 2})
    got = analyze(path, tmp_path / "store", jobs=1)
    assert got.contributions.components == ("motor",)
    (note,) = got.contributions.notes
    assert note.startswith("gearbox_z: another log, rate or start than mic")
    assert "Left out: gearbox_z" in said([contributions(got)])


def test_a_run_that_fails_stops_no_other(tmp_path):
    path, _ = write_campaign(tmp_path, POWERS)
    (tmp_path / "30.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(64))
    got = analyze(path, tmp_path / "store", jobs=1)
    assert {state.run for state in got.contributions.states} == {"20", "40"}
    assert set(got.tables["contributions"]["run"]) == {"20", "40"}
    assert any("'30'" in problem for problem in got.problems)


def test_a_dead_sensor_of_one_run_leaves_that_run_out(tmp_path):
    path, _ = write_campaign(tmp_path, POWERS)
    with h5py.File(tmp_path / "30.h5", "r+") as file:
        file["gearbox_z"][...] = 0.0
    got = analyze(path, tmp_path / "store", jobs=1)
    assert {state.run for state in got.contributions.states} == {"20", "40"}
    notes = " ".join(got.contributions.notes)
    assert "run 30: without gearbox_z, which most runs have" in notes
    assert "gearbox_z: its quality is bad" in notes


def test_records_too_short_are_a_line_each(tmp_path):
    """Fewer averages than anything can be told from: no traceback, no number."""
    path, _ = write_campaign(tmp_path, POWERS[:2], seconds=0.3)
    got = analyze(path, tmp_path / "store", jobs=1)
    assert "contributions" not in got.tables or not (got.tables["contributions"]["verdict"] == "ok").all()


# ---------------------------------------------------------------- run-ups


def test_a_run_up_is_one_state_a_speed(tmp_path):
    """The sources' mix changes with the speed, so that the run-up alone tells them."""
    speeds = np.linspace(20.0, 60.0, 30)
    rows = []
    rng = np.random.default_rng(5)
    for speed in speeds:
        power = [10.0 ** (0.6 * (40.0 - speed) / 20.0), 10.0 ** (0.6 * (speed - 40.0) / 20.0)]
        rows.append(record(drive(), power, 2.0, rng).samples)
    samples = np.concatenate(rows, axis=1)
    time = np.arange(samples.shape[1]) / RATE
    speed = np.interp(time, [0.0, time[-1]], [20.0, 60.0])
    logged = {name: (row, UNITS[name]) for name, row in zip(UNITS, samples, strict=True)}
    write_log(tmp_path / "up.h5", {**logged, "v": (speed, "km/h")})
    channels = MOTOR + GEARBOX + MIC + table("channel", name="v", quantity="speed", unit="km/h")
    path = tmp_path / "campaign.toml"
    path.write_text(HEAD + channels + table("run", condition="up", logs=["up.h5"]), encoding="utf-8")
    got = analyze(path, tmp_path / "store", jobs=1)
    states = got.contributions.states
    assert len(states) == 6 and all(not state.steady for state in states)
    assert [state.train_speed_km_h for state in states] == sorted(state.train_speed_km_h for state in states)
    table_ = got.tables["contributions"]
    whole = table_[(table_["kind"] == "band") & (table_["span"] == "250 Hz")]
    motor = whole[(whole["part"] == "motor")]["level_db"].to_numpy()
    gearbox = whole[(whole["part"] == "gearbox")]["level_db"].to_numpy()
    assert motor[0] - motor[-1] > 6.0 and gearbox[-1] - gearbox[0] > 6.0  # 12 dB were put in, less within the ends
    assert "a run-up from 2" in said([contributions(got)])


# ---------------------------------------------------------------- modes


TORQUE = {"traction": 3.0, "coast": 1.0, "brake": 2.0}
"""Power of the motor's sound by mode: two thirds, none, half of it is torque's."""


def mode_campaign(folder, torques=(2000.0, 0.0, -2000.0), speeds=(40.0, 40.0, 40.0), repeats=2):
    """White sound of a known power by mode."""
    rng = np.random.default_rng(3)
    runs = ""
    folder.mkdir(parents=True, exist_ok=True)
    for (mode, power), torque, speed in zip(TORQUE.items(), torques, speeds, strict=True):
        for number in range(repeats):
            name = f"{mode}_{number}"
            sound = np.sqrt(power) * rng.standard_normal(int(12 * RATE))
            write_log(folder / f"{name}.h5", {"mic": (sound, "Pa")})
            keys = {"name": name, "mode": mode, "torque_n_m": torque, "train_speed_km_h": speed}
            runs += table("run", condition=mode, logs=[f"{name}.h5"], **keys)
    path = folder / "campaign.toml"
    path.write_text(HEAD + MIC + runs, encoding="utf-8")
    return path


def test_what_comes_with_the_torque_is_told(tmp_path):
    got = analyze(mode_campaign(tmp_path), tmp_path / "store", jobs=1)
    table = got.tables["modes"]
    total = table[table["band"] == "total"].set_index("mode")
    assert total.loc["traction", "torque_share"] == pytest.approx(2 / 3, abs=0.03)
    assert total.loc["brake", "torque_share"] == pytest.approx(0.5, abs=0.04)
    assert total.loc["traction", "depends_on"] == "torque"
    assert total.loc["traction", "low"] < 2 / 3 < total.loc["traction", "high"]
    assert (table["train_speed_km_h"] == 40.0).all()
    words = said([modes(got)])
    assert "40 km/h at mic: traction" in words and "most of it comes and goes with the torque" in words
    assert "contributions" not in got.tables  # no accelerometer


def test_one_run_a_mode_assumes_their_scatter(tmp_path):
    got = analyze(mode_campaign(tmp_path, repeats=1), tmp_path / "store", jobs=1)
    assert got.tables["modes"]["scatter_assumed"].all()
    assert "1 dB between runs is assumed" in said([modes(got)])


def test_modes_at_different_speeds_are_not_compared(tmp_path):
    got = analyze(mode_campaign(tmp_path, speeds=(40.0, 60.0, 40.0), repeats=1), tmp_path / "store", jobs=1)
    assert got.tables["modes"].empty and "torque_share" in got.tables["modes"]
    assert modes(got).blocks[0].text.startswith("The campaign has loaded runs")


def test_coasting_with_torque_is_refused_with_its_reason(tmp_path):
    got = analyze(mode_campaign(tmp_path, torques=(2000.0, 1500.0, -2000.0), repeats=1), tmp_path / "store", jobs=1)
    table = got.tables["modes"]
    assert table["words"].str.contains("is coast with a torque of 1500 N m").all()
    assert table["level_db"].isna().all()


def test_a_run_up_is_compared_with_a_coast_down(tmp_path):
    rng = np.random.default_rng(4)
    n = int(30 * RATE)
    speed = np.linspace(20.0, 60.0, n)
    runs = ""
    for mode, power, over_time in (("traction", 2.0, speed), ("coast", 1.0, speed[::-1])):
        sound = np.sqrt(power) * rng.standard_normal(n)
        write_log(tmp_path / f"{mode}.h5", {"mic": (sound, "Pa"), "v": (over_time, "km/h")})
        runs += table("run", condition=mode, mode=mode, logs=[f"{mode}.h5"])
    channels = MIC + table("channel", name="v", quantity="speed", unit="km/h")
    (tmp_path / "campaign.toml").write_text(HEAD + channels + runs, encoding="utf-8")
    got = analyze(tmp_path / "campaign.toml", tmp_path / "store", jobs=1)
    total = got.tables["modes"][got.tables["modes"]["band"] == "total"]
    assert len(total) >= 4 and total["train_speed_km_h"].is_monotonic_increasing
    assert total["torque_share"].mean() == pytest.approx(0.5, abs=0.08)
    assert ((total["low"] <= 0.5) & (total["high"] >= 0.5)).all()


def test_a_run_up_too_short_for_any_state_is_said(tmp_path):
    """One second: not three segments at any speed."""
    path, records = write_campaign(tmp_path, POWERS[:1], seconds=1.0, run_keys={"20": {"train_speed_km_h": None}})
    path.write_text(path.read_text().replace("train_speed_km_h = null\n", ""))
    path.write_text(path.read_text() + table("channel", name="v", quantity="speed", unit="km/h"))
    samples = {name: (row, UNITS[name]) for name, row in zip(UNITS, records["20"].samples, strict=True)}
    rising = np.linspace(20.0, 60.0, records["20"].samples.shape[1])
    write_log(tmp_path / "20.h5", {**samples, "v": (rising, "km/h")})
    analysis = analyze(path, tmp_path / "store", jobs=1)
    (problem,) = (text for text in analysis.problems if "contributions" in text)
    assert "run 20: it has at no speed the 3 segments that a state takes" in problem and analysis.contributions is None
