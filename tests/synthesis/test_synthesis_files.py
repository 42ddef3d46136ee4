"""The folder that `synthesize` makes: equal bytes, integers that mean what they say, truth, safety of what is there."""

import hashlib
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest

from tdacoustic.errors import OutputError
from tdacoustic.synthesis import load_recipe, make_run, plan_runs, synthesize

RECIPE = """
schema = "tdacoustic-synthesis/1"
name = "Prüfung"
seed = 3
sample_rate_hz = 4096
duration_s = 2.0
bits = 12
start_time = 2025-01-01T09:00:00+00:00
[meta]
rail = "dry"
[kinematics]
wheel_diameter_mm = 1051.12
gear_pair = [{ teeth = [31, 104] }]
[[channel]]
name = "motor_z"
quantity = "acceleration"
component = "motor"
floor = [[100, 70]]
[[channel]]
name = "Mikrofon links"
quantity = "sound_pressure"
component = "air"
role = "receiver"
distance_m = 4.0
floor = [[100, 45]]
[[channel]]
name = "tacho"
quantity = "tacho"
component = "shaft"
pulses_per_rev = 6
[[condition]]
name = "A/1"
train_speed_km_h = 30
level_db = { receiver = 85 }
[[condition.line]]
source = "motor"
order = 4
level_db = { motor = 120, receiver = 70 }
[[condition]]
name = "auf"
train_speed_km_h = 20
train_speed_end_km_h = 40
runs = 2
[background]
duration_s = 1.0
"""


@pytest.fixture
def recipe_path(tmp_path):
    path = tmp_path / "synthesis.toml"
    path.write_text(RECIPE, encoding="utf-8")
    return path


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def test_equal_recipe_and_seed_give_equal_bytes_in_another_process(recipe_path, tmp_path):
    synthesize(recipe_path, tmp_path / "a")
    code = "import sys; from tdacoustic.synthesis import synthesize; synthesize(sys.argv[1], sys.argv[2])"
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", code, recipe_path, tmp_path / "b"], check=True, cwd=root)
    assert digests(tmp_path / "a") == digests(tmp_path / "b")
    synthesize(recipe_path, tmp_path / "c", seed=4)
    assert digests(tmp_path / "a")["condition-A-1.h5"] != digests(tmp_path / "c")["condition-A-1.h5"]


def test_logs_hold_integers_that_times_scale_are_the_signal(recipe_path, tmp_path):
    result = synthesize(recipe_path, tmp_path / "out")
    recipe = load_recipe(recipe_path)
    run = make_run(recipe, plan_runs(recipe)[0], 3)
    with h5py.File(tmp_path / "out" / "condition-A-1.h5") as log:
        assert log.attrs["schema"] == "tdacoustic-log/1"
        assert log.attrs["origin"] == "synthetic"
        assert log.attrs["start_time"] == "2025-01-01T09:00:00+00:00"
        for name, unit, quantity in [
            ("motor_z", "m/s^2", "acceleration"),
            ("Mikrofon links", "Pa", "sound_pressure"),
            ("tacho", "V", "tacho"),
        ]:
            stored, attributes = log[name][:], log[name].attrs
            assert (attributes["unit"], attributes["quantity"]) == (unit, quantity)
            assert (attributes["sample_rate_hz"], attributes["start_s"]) == (4096.0, 0.0)
            channel = next(channel for channel in recipe.channel if channel.name == name)
            exact = run.samples(recipe, channel)
            assert stored.dtype.kind == "i"
            assert np.abs(stored.astype(int)).max() < (2**7 if name == "tacho" else 2**11) * 0.95
            np.testing.assert_allclose(stored * attributes["scale"], exact, atol=0.51 * attributes["scale"])
    assert result.files[-1].name == "truth.json"


def test_campaign_and_truth_say_what_was_made(recipe_path, tmp_path):
    result = synthesize(recipe_path, tmp_path / "out")
    campaign = tomllib.loads(result.campaign.read_text(encoding="utf-8"))
    assert campaign["schema"] == "tdacoustic-campaign/1"
    assert (campaign["name"], campaign["origin"]) == ("Prüfung", "synthetic")
    assert campaign["meta"]["rail"] == "dry"
    runs = campaign["run"]
    assert [(run["condition"], run.get("name"), run.get("kind")) for run in runs] == [
        ("A/1", None, None),
        ("auf", "auf#1", None),
        ("auf", "auf#2", None),
        ("background", None, "background"),
    ]
    assert [run.get("train_speed_km_h") for run in runs] == [30.0, None, None, None]
    assert all((tmp_path / "out" / log).exists() for run in runs for log in run["logs"])
    assert campaign["channel"][2]["pulses_per_rev"] == 6

    truth = json.loads((tmp_path / "out" / "truth.json").read_text(encoding="utf-8"))
    assert truth["schema"] == "tdacoustic-synthesis-truth/1"
    assert truth["origin"] == "synthetic"
    files = digests(tmp_path / "out")
    assert {name: digest for name, digest in files.items() if name != "truth.json"} == truth["files"]
    first = truth["runs"][0]
    microphone = first["channels"]["Mikrofon links"]
    assert microphone["level_db"] == pytest.approx(85.0, abs=1e-6)
    (line,) = microphone["lines"]
    assert (line["source"], line["via"]) == ("motor", "recipe")
    assert line["level_db"] == pytest.approx(70.0, abs=0.05)  # 68 periods: the rms over a part of one more
    assert line["frequency_hz"] == pytest.approx(4 * 507.97 / 60, abs=0.01)  # paper, Table 1
    assert first["tachos"]["tacho"]["pulses"] == pytest.approx(2 * 6 * 507.97 / 60, abs=1)


def test_a_folder_of_its_own_is_refreshed_and_another_is_left_alone(recipe_path, tmp_path):
    out = tmp_path / "out"
    synthesize(recipe_path, out)
    recipe_path.write_text(RECIPE.replace("runs = 2", "runs = 1"), encoding="utf-8")
    (out / ".truth.json.x1.part").write_text("left by a killed run")
    synthesize(recipe_path, out)
    assert sorted(path.name for path in out.iterdir()) == [
        "background.h5",
        "campaign.toml",
        "condition-A-1.h5",
        "condition-auf.h5",
        "truth.json",
    ]
    recipe_path.write_text(RECIPE.replace("Prüfung", "another"), encoding="utf-8")
    before = digests(out)
    with pytest.raises(OutputError, match=r"already holds condition-A-1\.h5.*--overwrite"):
        synthesize(recipe_path, out)
    assert digests(out) == before
    synthesize(recipe_path, out, overwrite=True)
    assert digests(out) != before


def test_too_few_bits_are_said(recipe_path, tmp_path):
    recipe_path.write_text(
        RECIPE.replace("bits = 12", "bits = 6").replace("[[100, 45]]", "[[100, 45], [1600, 5]]"), encoding="utf-8"
    )
    result = synthesize(recipe_path, tmp_path / "out")
    assert any("raise bits" in doubt and "Mikrofon links" in doubt for doubt in result.doubts)
    assert not any("motor_z" in doubt for doubt in result.doubts)


@pytest.mark.parametrize("campaign", ["first-run", "crrc-freight"])
def test_the_recipes_of_the_recordings_are_whole(campaign, tmp_path):
    folder = Path(__file__).parents[2] / "recordings" / campaign
    result = synthesize(folder / "synthesis.toml", tmp_path)
    assert not result.doubts
    assert sum(path.stat().st_size for path in result.files) < {"first-run": 700e3, "crrc-freight": 7e6}[campaign]
    if (folder / "campaign.toml").exists():
        # logs compared by content of the truth, not by bytes: compression differs between builds of zlib
        assert (folder / "campaign.toml").read_bytes() == (tmp_path / "campaign.toml").read_bytes()
        committed = json.loads((folder / "truth.json").read_bytes())
        assert committed["recipe"] == result.truth["recipe"]
        assert [run["name"] for run in committed["runs"]] == [run["name"] for run in result.truth["runs"]]


def test_the_demonstration_holds_the_lines_of_table_2(tmp_path):
    # paper, Table 2, noise lines; 2 Hz is what issue 3 asks of the analysis, so the recipe itself stays within 1 Hz
    noise_hz = {
        "1": [926, 1852, 2778],
        "2": [933, 1857, 2780],
        "3": [1207, 2453],
        "4": [463, 918, 1132, 1387],
        "5": [527, 1032, 1594, 2112],
    }
    levels_db = {"3": 88.3, "5": 88.0}  # paper, sections 5.1 and 4.3
    recipe = load_recipe(Path(__file__).parents[2] / "recordings" / "crrc-freight" / "synthesis.toml")
    for plan in plan_runs(recipe):
        run = make_run(recipe, plan, recipe.seed)
        frequencies = {line.name: line.frequency_hz.mean() for line in run.lines}
        for microphone in ("mic_left", "mic_right"):
            channel = run.channels[microphone]
            found = sorted(frequencies[line.line] for line in channel.lines)
            np.testing.assert_allclose(found, noise_hz[plan.name], atol=1.0)
            if plan.name in levels_db:
                level_db = 20 * np.log10(channel.overall_rms / 20e-6)
                assert level_db == pytest.approx(levels_db[plan.name], abs=1e-6)
