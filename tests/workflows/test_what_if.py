"""What changes would do, as its user gets it: from a fleet alone, from a calibration, from the main job."""

import json

import pandas as pd
import pytest
from made_up_modes import fleet_text
from plain_fleets import plain_fleet

import tdacoustic as td
from tdacoustic.tables import COLUMNS

MOTOR = '[[motor.excitation]]\nname = "tone"\nfixed_hz = 600\nsound_power_level_db = 105\n'
CASES = """
[[what_if]]
name = "quiet motor"
motor_db = -10
[[what_if]]
name = "damped"
parameters = { "gear_dynamics.mesh_damping_ratio" = 0.2 }
conditions = ["3", "5"]
"""
HEAD = 'schema = "tdacoustic-campaign/1"\nname = "<b>Made</b>"\norigin = "printed"\nfleet = "fleet.toml"\n'
MICROPHONE = """
[[channel]]
name = "near (x)"
role = "receiver"
quantity = "sound_pressure"
position_m = [0.0, 2.0, 0.5]
"""
LEVELS = "".join(
    f'[[level]]\ncondition = "{name}"\ndistance_m = 4.0\nlevel_db = {level}\nsigma_db = 0.5\n'
    for name, level in (("2", 84.0), ("4", 88.0), ("6", 97.0))
)
SETTINGS = '[calibration]\nfree = ["masuda.constant_db"]\nmodel_sigma_db = {}\n'


@pytest.fixture
def tda(tmp_path, call_program, monkeypatch):
    """Run the program in this process, in a folder of its own; returns exit code, stdout, stderr."""
    monkeypatch.setenv("TDACOUSTIC_STORE", str(tmp_path / "store"))
    monkeypatch.chdir(tmp_path)
    return call_program


def fleet_file(folder, cases=CASES):
    text = plain_fleet("reference-drive").read_text(encoding="utf-8")
    start = text.index("[housing]")
    folder.mkdir(exist_ok=True)
    (folder / "fleet.toml").write_text(f"{text[:start]}{MOTOR}\n{text[start:]}\n{cases}", encoding="utf-8")
    return folder / "fleet.toml"


def campaign_file(folder, cases=CASES, sigma_db=4.0, more=""):
    fleet_file(folder, cases)
    path = folder / "campaign.toml"
    path.write_text(HEAD + MICROPHONE + LEVELS + SETTINGS.format(sigma_db) + more, encoding="utf-8")
    return path


def table_in(folder):
    frame = pd.read_csv(folder / "what_if.csv", dtype={"condition": str})
    assert list(frame.columns) == COLUMNS["what_if"].split()
    return frame


def one(frame, **where):
    held = frame
    for column, value in where.items():
        held = held[held[column] == value]
    assert len(held) == 1, where
    return held.iloc[0]


def test_of_a_fleet_alone_there_are_changes_and_no_intervals(tda, tmp_path):
    assert tda("predict", fleet_file(tmp_path / "f"), "-o", "out", "--quiet")[0] == 0
    frame = table_in(tmp_path / "out")
    assert set(frame["case"]) == {"quiet motor", "damped"}
    assert set(frame[frame["case"] == "damped"]["condition"]) == {"3", "5"}
    assert frame[[c for c in frame.columns if "low" in c or "high" in c]].isna().all(axis=None)
    assert json.loads((tmp_path / "out" / "manifest.json").read_text(encoding="utf-8"))["files"]
    # a changed parameter is the prediction of the changed fleet
    text = (tmp_path / "f" / "fleet.toml").read_text(encoding="utf-8")
    (tmp_path / "g").mkdir()
    changed = text[: text.index("[[what_if]]")].replace("mesh_damping_ratio = 0.05", "mesh_damping_ratio = 0.2")
    assert changed != text[: text.index("[[what_if]]")]
    (tmp_path / "g" / "fleet.toml").write_text(changed, encoding="utf-8")
    assert tda("predict", tmp_path / "g", "-o", "other", "--quiet")[0] == 0
    levels = pd.read_csv(tmp_path / "other" / "predictions.csv", dtype={"condition": str})
    for name in ("3", "5"):
        expected = one(levels, condition=name, receiver="4 m", path="total", weighting="Z")["level_db"]
        got = one(frame, condition=name, receiver="4 m", weighting="Z", case="damped")["level_db"]
        assert got == pytest.approx(expected, abs=1e-6)


def test_without_cases_each_source_of_the_total_is_asked_for(tda, tmp_path):
    assert tda("predict", fleet_file(tmp_path / "f", ""), "-o", "out", "--quiet")[0] == 0
    frame = table_in(tmp_path / "out")
    steps = ["10 dB less", "3 dB less", "off"]
    assert list(frame["case"].unique()) == [f"{path} {step}" for path in ("motor", "mesh") for step in steps]


def test_a_calibration_has_intervals_at_the_surface_and_each_microphone(tda, tmp_path):
    assert tda("calibrate", campaign_file(tmp_path / "c"), "-o", "out", "--quiet")[0] == 0
    frame = table_in(tmp_path / "out")
    assert set(frame["receiver"]) == {"4 m", "near (x)"}
    assert list(frame["condition"].unique()) == ["2", "4", "6", "1", "3", "5"]  # the campaign's first
    assert frame[["change_low_db", "change_high_db", "level_low_db", "level_high_db"]].notna().all(axis=None)
    assert (frame["change_low_db"] <= frame["fit_change_low_db"]).all()
    assert (frame["fit_change_high_db"] <= frame["change_high_db"]).all()
    assert "What it brings to quieten a source" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<b>Made" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_the_main_job_has_the_intervals_of_the_calibration(tda, tmp_path):
    campaign = campaign_file(tmp_path / "c")
    assert tda("calibrate", campaign, "-o", "fit", "--quiet")[0] == 0
    assert tda("run", campaign, "-o", "out", "--quiet")[0] == 0
    assert (tmp_path / "out" / "what_if.csv").read_bytes() == (tmp_path / "fit" / "what_if.csv").read_bytes()
    levels = pd.read_csv(tmp_path / "out" / "predictions.csv", dtype={"condition": str})
    frame = table_in(tmp_path / "out")
    for _, row in frame.iterrows():
        where = {name: row[name] for name in ("condition", "receiver", "weighting")}
        assert row["before_db"] == pytest.approx(one(levels, path="total", **where)["level_db"], abs=1e-6)
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "What if (the model's level at 4 m): at 20 km/h" in report.replace("&#39;", "'")


def test_the_calibrated_fleet_keeps_the_cases(tda, tmp_path):
    assert tda("calibrate", campaign_file(tmp_path / "c"), "-o", "out", "--quiet")[0] == 0
    made = td.load_fleet(tmp_path / "out" / "fleet.calibrated.toml")
    assert made.what_if == td.load_fleet(tmp_path / "c" / "fleet.toml").what_if


def test_a_wrong_condition_is_said_before_anything_is_computed(tda, tmp_path):
    path = fleet_file(tmp_path / "f", '[[what_if]]\nname = "a"\nmotor_db = -3\nconditions = ["99"]\n')
    code, out, err = tda("predict", path, "-o", "out")
    assert (code, out) == (1, "")
    assert "[[what_if]] 'a': conditions names '99', which is no condition; there are 1, 2, 3, 4, 5, 6" in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("command", ["calibrate", "run"])
def test_a_wrong_condition_is_said_before_a_campaign_is_read(tda, tmp_path, monkeypatch, command):
    wrong = '[[what_if]]\nname = "a"\nmotor_db = -3\nconditions = ["2", "7", "99"]\n'
    path = campaign_file(tmp_path / "f", wrong)
    monkeypatch.setattr("tdacoustic.workflows.joint_levels.joint_levels", lambda *_: pytest.fail("too late"))
    monkeypatch.setattr("tdacoustic.workflows.analyze.analyze", lambda *_, **__: pytest.fail("too late"))
    code, out, err = tda(command, path, "-o", "out")
    assert (code, out) == (1, "")
    assert "[[what_if]] 'a': conditions names '7', '99', which are no conditions; there are 2, 4, 6, 1, 3, 5" in err
    assert len(err.splitlines()) == 1


def test_the_main_job_computes_changes_once(tda, tmp_path, monkeypatch):
    monkeypatch.setattr("tdacoustic.workflows.what_if.predicted_what_if", lambda *_, **__: pytest.fail("twice"))
    assert tda("run", campaign_file(tmp_path / "c"), "-o", "out", "--quiet")[0] == 0
    assert table_in(tmp_path / "out")["change_low_db"].notna().any()


def test_a_change_without_effect_is_a_warning_of_the_result(tda, tmp_path):
    path = fleet_file(tmp_path / "f", '[[what_if]]\nname = "a"\nstructure_db = -3\n')
    code, _, err = tda("predict", path, "-o", "out")
    assert code == 0
    said = "[[what_if]] 'a' changes the path structure, which does nothing here: the total does not add it"
    assert f"warning: {said}" in err
    assert said in json.loads((tmp_path / "out" / "manifest.json").read_text(encoding="utf-8"))["problems"]


def test_from_a_notebook(tmp_path):
    found = td.predict(fleet_file(tmp_path / "f"), tmp_path / "store")
    level = found.what_if.level("3", "quiet motor", "4 m")
    assert level.change_db < 0.0
    assert found.tables["what_if"].shape[0] == len(found.what_if.levels)


# ---------------------------------------------------------------- the housing

OF_THE_HOUSING = """
[[what_if]]
name = "damped walls"
parameters = { "housing.loss_factor" = 0.1 }
[[what_if]]
name = "thicker"
parameters = { "housing.wall_mm" = 7 }
[[what_if]]
name = "better structure"
structure_db = -6
"""


def small_housing(folder, cases="", **replacements):
    text = fleet_text("", 300).replace("[20, 30, 40, 50, 60, 114.455]", "[20]").replace('"masuda"', '"structure"')
    assert 'gear_path = "structure"' in text
    for old, new in replacements.items():
        assert old in text
        text = text.replace(old, new, 1)
    folder.mkdir()
    (folder / "fleet.toml").write_text(f"{text}\n{cases}", encoding="utf-8")
    return folder / "fleet.toml"


def test_another_housing_has_transfer_vectors_of_its_own(tmp_path):
    pytest.importorskip("ngsolve")
    store = tmp_path / "store"
    found = td.predict(small_housing(tmp_path / "f", OF_THE_HOUSING), store, jobs=1)
    steps = [record.step for _, record in found.records]
    assert steps.count("housing-modes") == 2  # as it is and thicker; the loss factor asks for none
    for name, change in (
        ("damped walls", {"loss_factor = 0.03": "loss_factor = 0.1"}),
        ("thicker", {"\nwall_mm = 6": "\nwall_mm = 7"}),
    ):
        other = td.predict(small_housing(tmp_path / name, **change), store, jobs=1)
        for weighting in ("Z", "A"):
            level = found.what_if.level("1", name, "4 m", weighting)
            assert level.level_db == other.prediction.sound_of("1").level_db("4 m", "total", weighting)
    assert found.what_if.level("1", "better structure", "4 m").change_db == pytest.approx(-6.0, abs=1e-9)
