"""The program as users meet it: what it says, what it writes, how it ends.

Most tests call `main` in this process with a stand-in for the report's pages, which take seconds to draw;
those of the contracts, of pipes, terminals and equal bytes run the program itself.
"""

import csv
import hashlib
import json
import os
import shutil
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "workflows"))  # for small_campaigns: pytest's importlib mode adds no folder

from small_campaigns import (  # noqa: E402
    HEAD,
    MIC,
    MOTOR,
    RATE_HZ,
    files_of,
    run_table,
    signal,
    small_campaign,
    table,
    write_log,
)

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # a warning of numpy's would be a second message

CHECKER = ROOT.parent / "shared" / "check_outputs.py"
FIRST_RUN = ROOT / "recordings" / "first-run"
NO_FLEET = "warning: nothing is calibrated and nothing is predicted: there is no fleet\n"
"""What `run` says of every campaign here: none has a fleet (test_run.py has those with one)."""


@pytest.fixture(scope="module")
def shared_store(tmp_path_factory):
    return tmp_path_factory.mktemp("store")


@pytest.fixture
def tda(tmp_path, shared_store, call_program, monkeypatch):
    """Run the program in this process, in a folder of its own; returns exit code, stdout, stderr."""
    import tdacoustic.reporting.html as html

    real = html.render_html
    monkeypatch.setenv("TDACOUSTIC_STORE", str(shared_store))
    monkeypatch.chdir(tmp_path)

    def call(*arguments, report=False):
        page = real if report else lambda document: "<!doctype html><title>stand-in</title>"
        monkeypatch.setattr(html, "render_html", page)
        return call_program(*arguments)

    return call


def program(*arguments, cwd=ROOT, **options):
    """Run the program itself."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **options.pop("env", {})}
    command = [sys.executable, "-m", "tdacoustic", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, env=environment, check=False, **options)


def assert_one_message(err, *words, kind="error"):
    """Exactly one line on stderr, of that kind, with these words in it."""
    lines = err.splitlines()
    assert len(lines) == 1, err
    assert lines[0].startswith(f"{kind}: "), err
    for word in words:
        assert word in lines[0], f"{word!r} is not in: {lines[0]}"
    assert "Traceback" not in err


def assert_refused(tda, campaign, *words, command="run"):
    """Exit 1, one message, and no result, neither whole nor half."""
    out = Path(campaign).parent / "refused"
    code, said, err = tda(command, campaign, "-o", out)
    assert code == 1, err
    assert said == ""
    assert_one_message(err, *words)
    assert not out.exists()
    assert not [path for path in out.parent.iterdir() if path.name.startswith(".")]


def rows(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def changed(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def assert_contracts_hold(folder):
    if not CHECKER.is_file():
        pytest.skip("the checker of the contracts is not beside this checkout")
    found = subprocess.run([sys.executable, CHECKER, folder, "analyze"], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


# ---------------------------------------------------------------- a good campaign


def test_a_campaign_is_analysed_and_the_answer_is_said(tda, tmp_path):
    campaign = small_campaign(tmp_path / "night ride")
    code, out, err = tda("run", campaign)
    assert (code, err) == (0, NO_FLEET)
    assert [line.split(":")[0] for line in out.splitlines()[:3]] == [f"Condition {c} (30 km/h)" for c in "abc"]
    assert out.splitlines()[-1] == str(Path("reports/night ride/report.html"))
    assert {row["condition"] for row in rows(tmp_path / "reports/night ride/levels.csv")} == set("abc")


def test_the_folder_of_a_campaign_will_do(tda, tmp_path):
    small_campaign(tmp_path / "ride", conditions="a")
    code, _, err = tda("analyze", "ride", "-o", "by folder")
    assert (code, err) == (0, "")
    assert tda("analyze", "ride/campaign.toml", "-o", "by file")[0] == 0
    assert files_of(tmp_path / "by folder") == files_of(tmp_path / "by file")


def test_spaces_and_umlauts_in_every_name(tda, tmp_path):
    folder = tmp_path / "Prüfstand Süd (größer)"
    campaign = small_campaign(folder, conditions=("a",))
    (folder / "a.h5").rename(folder / "Lauf übung 1.h5")
    changed(campaign, '["a.h5"]', '["Lauf übung 1.h5"]')
    changed(campaign, 'condition = "a"', 'condition = "Übergang 1"')
    code, out, err = tda("run", campaign, "-o", tmp_path / "Ergebnis für Zürich")
    assert (code, err) == (0, NO_FLEET)
    assert out.startswith("Condition Übergang 1")
    assert rows(tmp_path / "Ergebnis für Zürich" / "levels.csv")[0]["condition"] == "Übergang 1"
    manifest = json.loads((tmp_path / "Ergebnis für Zürich" / "manifest.json").read_text(encoding="utf-8"))
    assert [entry["file"] for entry in manifest["inputs"]] == ["campaign.toml", "Lauf übung 1.h5"]


def test_quiet_says_nothing(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    for command in ("run", "analyze", "check"):
        assert tda(command, campaign, "--quiet", "-o", tmp_path / command) == (0, "", "")


def test_quiet_still_says_errors(tda, tmp_path):
    code, out, err = tda("run", tmp_path / "gone.toml", "--quiet")
    assert (code, out) == (1, "")
    assert_one_message(err, "gone.toml", "no such file")


def test_runs_as_a_table(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride")
    campaign.write_text(HEAD.replace("\n\n", '\nruns = "runs.csv"\n\n') + MIC, encoding="utf-8")
    (tmp_path / "ride" / "runs.csv").write_text(
        "condition;train_speed_km_h;logs;valid;reject_reason\na;30;a.h5;true;\nb;40;b.h5;;\nb;40;c.h5;false;rain\n"
    )
    code, _, err = tda("analyze", campaign, "-o", "out")
    assert (code, err) == (0, "")
    assert [(row["run"], row["train_speed_km_h"]) for row in rows(tmp_path / "out/levels.csv")] == [
        ("a", "30"),
        ("b#1", "40"),
    ]
    assert [row["detail"] for row in rows(tmp_path / "out/quality.csv") if row["run"] == "b#2"] == ["rejected: rain"]


def test_levels_are_corrected_for_background(tda, tmp_path):
    text = "".join(run_table(name, name=f"{name} quiet", kind="background", logs=[f"{name}q.h5"]) for name in "abc")
    campaign = small_campaign(tmp_path / "ride", text=text)
    for name, fraction in (("a", 0.01), ("b", 0.62), ("c", 0.97)):
        write_log(tmp_path / "ride" / f"{name}q.h5", {"mic": (fraction * signal(0, 2.0, 200.0, 0.2, 0.02), "Pa")})
    code, _, err = tda("analyze", campaign, "-o", "out")
    assert (code, err) == (0, "")
    found = {row["run"]: row for row in rows(tmp_path / "out/levels.csv") if row["channel"] == "mic"}
    assert {name: found[name]["correction"] for name in "abc"} == {"a": "applied", "b": "marginal", "c": "impossible"}
    assert float(found["a"]["background_db"]) == pytest.approx(80.05 - 40.0, abs=0.1)


def test_excluded_lines_are_gone_and_overrides_win(tda, tmp_path):
    text = table("exclude", condition="a", frequency_hz=[190.0, 210.0], reason="a pump")
    text += table("override", condition="b", frequency_hz=250.0, source="gearbox", reason="seen with the strobe")
    campaign = small_campaign(tmp_path / "ride", text=text)
    assert tda("analyze", campaign, "-o", "out")[0] == 0
    found = {(row["condition"], round(float(row["frequency_hz"]))): row for row in rows(tmp_path / "out/sources.csv")}
    assert ("a", 200) not in found
    assert found["b", 250]["source"] == "gearbox"
    assert found["b", 250]["evidence"] == "Override by the engineer: seen with the strobe"
    assert found["c", 300]["source"] == "unassigned"
    shares = {row["condition"]: row for row in rows(tmp_path / "out/dominance.csv")}
    assert float(shares["b"]["gearbox_share"]) == pytest.approx(1.0, abs=0.01)
    assert float(shares["c"]["unassigned_share"]) == pytest.approx(1.0, abs=0.01)


def test_names_that_differ_by_a_slash_alone(tda, tmp_path):
    import h5py

    campaign = small_campaign(tmp_path / "ride", conditions="ab")
    changed(campaign, 'condition = "a"', 'condition = "1/a"')
    changed(campaign, 'condition = "b"', 'condition = "1_a"')
    code, _, err = tda("analyze", campaign, "-o", "out")
    assert (code, err) == (0, "")
    with h5py.File(tmp_path / "out" / "result.h5") as file:
        assert {name: group.attrs["name"] for name, group in file.items()} == {"1_a": "1/a", "1_a_": "1_a"}


# ---------------------------------------------------------------- bad campaigns


def test_a_missing_campaign(tda, tmp_path):
    assert_refused(tda, tmp_path / "gone.toml", "gone.toml", "no such file")
    (tmp_path / "empty").mkdir()
    code, _, err = tda("run", tmp_path / "empty")
    assert code == 1
    assert_one_message(err, "empty", "campaign.toml")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("distance_m", "distance", ("distance", "distance_m", "mic")),
        ("train_speed_km_h", "train_speed_kmh", ("train_speed_kmh", "train_speed_km_h")),
        ("[[channel]]", "[[chanel]]", ("chanel", "channel")),
        ('"receiver"', '"reciever"', ("role", "reciever", "receiver")),
        ("4.0", "-4.0", ("distance_m", "-4")),
        ('"measured"', '"mesured"', ("origin", "mesured", "measured")),
        ("origin", "orig in", ("line 3",)),
        ("campaign/1", "campaign/7", ("schema", "tdacoustic-campaign/1", "tdacoustic-campaign/7")),
    ],
)
def test_a_wrong_word_in_the_campaign(tda, tmp_path, old, new, words):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    changed(campaign, old, new)
    assert_refused(tda, campaign, "campaign.toml", *words)


def test_a_channel_that_is_not_in_the_log(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    changed(campaign, 'name = "mic"', 'name = "mikrofon"')
    changed(campaign, 'component = "air"', 'source = "mix"\ncomponent = "air"')
    assert_refused(tda, campaign, "mikrofon", "'mix'", "a.h5", "'mic'")


def test_two_channels_of_one_name(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a", channels=MIC + MIC)
    assert_refused(tda, campaign, "campaign.toml", "'mic'", "twice")


def test_a_pressure_without_unit_or_sensitivity_names_the_key_to_add(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    write_log(tmp_path / "ride" / "a.h5", {"mic": (signal(0, 2.0, 200.0), None)})
    assert_refused(tda, campaign, "mic", "a.h5", "unit")
    write_log(tmp_path / "ride" / "a.h5", {"mic": (signal(0, 2.0, 200.0), "V")})
    assert_refused(tda, campaign, "mic", "a.h5", "sensitivity")


def test_a_source_in_two_logs(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    shutil.copy(tmp_path / "ride" / "a.h5", tmp_path / "ride" / "b.h5")
    changed(campaign, '["a.h5"]', '["a.h5", "b.h5"]')
    assert_refused(tda, campaign, "'mic'", "a.h5", "b.h5", "log = 1")


def wav_bytes():
    data = (8000 * np.sin(np.arange(8192))).astype("<i2").tobytes()
    head = b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, 1, 4096, 8192, 2, 16) + b"data" + struct.pack("<I", len(data))
    return b"RIFF" + struct.pack("<I", len(head + data)) + head + data


BAD_LOGS = {
    "truncated.wav": wav_bytes()[:9000],
    "headless.wav": wav_bytes()[:30],
    "no.uff": b"this is no UFF\n" * 20,
    "cut.uff": b"    -1\n    58\nNONE\n",
    "empty.csv": b"",
    "words.csv": b"a,b\nx,y\nz,w\n",
    "header.csv": b"time_s,mic\n",
    "empty.h5": b"",
    "text.h5": b"no HDF5 at all",
    "empty.flac": b"",
    "log.xyz": b"abc",
}


@pytest.mark.parametrize("name", BAD_LOGS)
@pytest.mark.parametrize("command", ["run", "check"])
def test_a_log_that_cannot_be_read(tda, tmp_path, name, command):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    (tmp_path / "ride" / name).write_bytes(BAD_LOGS[name])
    changed(campaign, '"a.h5"', json.dumps(name))
    assert_refused(tda, campaign, name, command=command)
    code, out, err = tda("info", tmp_path / "ride" / name)
    assert (code, out) == (1, "")
    assert_one_message(err, name)


def test_a_folder_as_a_log(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    (tmp_path / "ride" / "a.h5").unlink()
    (tmp_path / "ride" / "a.h5").mkdir()
    assert_refused(tda, campaign, "a.h5")


def test_the_only_log_is_missing(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    (tmp_path / "ride" / "a.h5").unlink()
    assert_refused(tda, campaign, "a.h5", "no such file")


def test_one_missing_log_of_three_and_the_rest_is_done(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride")
    (tmp_path / "ride" / "b.h5").unlink()
    code, out, err = tda("run", campaign, "-o", "out")
    assert code == 0
    assert_one_message(err.removesuffix(NO_FLEET), "run 'b' is left out", "b.h5: no such file", kind="warning")
    assert "Condition a" in out
    assert "Condition c" in out
    assert [row["run"] for row in rows(tmp_path / "out/levels.csv")] == ["a", "c"]
    (bad,) = [row for row in rows(tmp_path / "out/quality.csv") if row["verdict"] == "bad"]
    assert (bad["run"], bad["check"]) == ("b", "run")
    assert {row["condition"]: row["dominant"] for row in rows(tmp_path / "out/dominance.csv")} == dict.fromkeys(
        "abc", "undecided"
    )
    manifest = json.loads((tmp_path / "out/manifest.json").read_text(encoding="utf-8"))
    assert "b.h5" in manifest["problems"][0]
    code, _, err = tda("check", campaign)
    assert code == 1
    assert "run 'b': cannot be used" in err.splitlines()[-1]


def test_one_damaged_log_of_three_and_the_rest_is_done(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride")
    whole = (tmp_path / "ride" / "c.h5").read_bytes()
    (tmp_path / "ride" / "c.h5").write_bytes(whole[: len(whole) // 2])
    code, _, err = tda("run", campaign, "-o", "out")
    assert code == 0
    assert_one_message(err.removesuffix(NO_FLEET), "run 'c' is left out", "c.h5", kind="warning")


def test_few_samples_that_are_no_numbers_are_a_warning(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    values = signal(0, 8.0, 200.0, 0.2, 0.02)
    values[[1000, 1001, 9000]] = np.nan
    write_log(tmp_path / "ride" / "a.h5", {"mic": (values, "Pa")})
    code, out, _ = tda("check", campaign)
    assert code == 0
    assert [line for line in out.splitlines() if line.startswith("warning: run a, mic, missing values")]
    assert tda("run", campaign, "-o", "out")[0] == 0
    (level,) = rows(tmp_path / "out/levels.csv")
    assert float(level["level_db"]) == pytest.approx(80.05, abs=0.1)


def test_nothing_but_no_numbers_makes_the_run_unusable(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride")
    write_log(tmp_path / "ride" / "b.h5", {"mic": (np.full(8192, np.nan), "Pa")})
    code, out, err = tda("check", campaign, "-o", "checked")
    assert code == 1
    assert "bad: run b, mic, missing values" in out
    assert_one_message(err, "run 'b'", "cannot be used")
    assert {row["verdict"] for row in rows(tmp_path / "checked/quality.csv") if row["run"] == "b"} >= {"bad"}
    code, out, _ = tda("run", campaign, "-o", "out")
    assert code == 0
    assert "Condition a" in out
    assert "b" not in {row["run"] for row in rows(tmp_path / "out/lines.csv")}
    assert {row["condition"] for row in rows(tmp_path / "out/dominance.csv")} == set("abc")


def test_without_a_microphone_the_rest_is_done(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a", channels=MOTOR)
    code, _, err = tda("run", campaign, "-o", "out")
    assert code == 0
    assert_one_message(err.removesuffix(NO_FLEET), "no microphone", kind="warning")
    (level,) = rows(tmp_path / "out/levels.csv")
    assert (level["quantity"], level["reference"], level["laeq_db"]) == ("acceleration", "1 um/s^2", "")
    assert float(level["level_db"]) == pytest.approx(126.0, abs=0.1)


# ---------------------------------------------------------------- output folder and store


def test_a_foreign_output_folder_is_refused_before_any_work(tda, tmp_path, monkeypatch):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    monkeypatch.setattr("tdacoustic.steps.execute", lambda *_: pytest.fail("it worked first"))
    code, _, err = tda("run", campaign, "-o", "mine")
    assert code == 1
    assert_one_message(err, "mine", "--overwrite")
    assert set(files_of(tmp_path / "mine")) == {"thesis.tex"}


def test_results_of_another_campaign_are_refused(tda, tmp_path):
    for name in ("one", "two"):
        small_campaign(tmp_path / name, conditions="a")
    assert tda("analyze", "one", "-o", "out")[0] == 0
    before = files_of(tmp_path / "out")
    code, _, err = tda("analyze", "two", "-o", "out")
    assert code == 1
    assert_one_message(err, "one/campaign.toml", "two/campaign.toml", "--overwrite")
    assert files_of(tmp_path / "out") == before
    assert tda("analyze", "two", "-o", "out", "--overwrite")[0] == 0


def test_an_error_leaves_the_old_result_untouched(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    assert tda("analyze", campaign, "-o", "out")[0] == 0
    before = files_of(tmp_path / "out")
    (tmp_path / "ride" / "a.h5").write_bytes(b"x")
    assert tda("analyze", campaign, "-o", "out")[0] == 1
    assert files_of(tmp_path / "out") == before


@pytest.mark.parametrize("out", ["file", "file/below", "/proc/nowhere"])
def test_an_output_folder_that_cannot_be_made(tda, tmp_path, out):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    (tmp_path / "file").touch()
    code, said, err = tda("run", campaign, "-o", out)
    assert (code, said) == (1, "")
    assert_one_message(err, out)


def test_a_store_that_cannot_be_made(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    (tmp_path / "file").touch()
    code, _, err = tda("run", campaign, "--store", "file", "-o", "out")
    assert code == 1
    assert_one_message(err, "store", "file")


# ---------------------------------------------------------------- usage, info, init, synthesize


@pytest.mark.parametrize(
    "arguments",
    [
        "run",
        "nonsense",
        "analyze a b",
        "run a --nonsense",
        "run a --jobs 0",
        "run a --jobs x",
        "info",
        "init",
        "synthesize",
    ],
)
def test_wrong_usage_exits_2(tda, arguments):
    code, out, err = tda(*arguments.split())
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert "Usage:" in err


def test_help_and_version(tda):
    code, out, _ = tda("--help")
    assert code == 0
    for command in ("info", "init", "check", "analyze", "run", "synthesize"):
        assert f"  {command} " in out
    assert tda("--version")[1].startswith("tdacoustic ")


def test_info_as_json(tda, tmp_path):
    write_log(tmp_path / "a.h5", {"mic": (signal(0, 1.0, 200.0, 0.2, 0.0), "Pa"), "x": ([1.0, np.nan, 3.0], None)})
    code, out, err = tda("info", "a.h5", "--json")
    assert (code, err) == (0, "")
    (log,) = json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert set(log) == {"file", "format", "channels", "flags", "metadata", "companions"}
    assert (log["file"], log["format"]) == ("a.h5", "hdf5")
    mic, x = log["channels"]
    assert list(mic) == "name unit quantity sample_rate_hz n_samples start mean rms min max flags n_read".split()  # noqa: SIM905
    assert (mic["name"], mic["unit"], mic["quantity"], mic["n_samples"]) == ("mic", "Pa", "sound_pressure", 4096)
    assert mic["sample_rate_hz"] == RATE_HZ
    assert mic["rms"] == pytest.approx(0.2, rel=1e-6)
    assert (x["mean"], x["min"], x["max"], x["unit"]) == (2.0, 1.0, 3.0, None)
    assert any("1 of 3 samples" in flag for flag in x["flags"])


def test_info_of_several_logs_as_text(tda, tmp_path):
    small_campaign(tmp_path, conditions="ab")
    code, out, err = tda("info", "a.h5", "b.h5")
    assert (code, err) == (0, "")
    assert out.count("sound_pressure") == 2
    assert tda("info", "a.h5", "b.h5", "--all") == (0, out, "")


def test_init_then_run(tda, tmp_path):
    small_campaign(tmp_path / "logs", conditions="ab")
    (tmp_path / "logs" / "campaign.toml").unlink()
    code, out, err = tda("init", "logs/a.h5", "logs/b.h5", "-o", "logs")
    assert code == 0
    assert out.strip() == str(Path("logs/campaign.toml"))
    assert all(line.startswith("missing: ") for line in err.splitlines())
    assert tda("run", "logs", "-o", "out")[0] == 0
    code, _, err = tda("init", "logs/a.h5", "-o", "logs")
    assert code == 1
    assert_one_message(err, "campaign.toml", "--overwrite")


def test_a_recipe_twice_gives_equal_bytes(tda, tmp_path):
    for name in ("one", "two"):
        code, _, err = tda("synthesize", FIRST_RUN / "synthesis.toml", "-o", name)
        assert (code, err) == (0, "")
    assert files_of(tmp_path / "one") == files_of(tmp_path / "two")
    assert tda("synthesize", FIRST_RUN / "synthesis.toml", "-o", "other", "--seed", "2")[0] == 0
    assert files_of(tmp_path / "other") != files_of(tmp_path / "one")
    held = files_of(FIRST_RUN)
    assert files_of(tmp_path / "one") == {name: data for name, data in held.items() if name != "synthesis.toml"}


# ---------------------------------------------------------------- the program itself


def test_the_contracts_on_the_campaign_of_the_first_run(tda, tmp_path):
    code, _, err = tda("run", FIRST_RUN, "-o", "out", report=True)
    assert (code, err) == (0, NO_FLEET)
    assert_contracts_hold(tmp_path / "out")


def test_the_contracts_without_a_microphone(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a", channels=MOTOR)
    assert tda("run", campaign, "-o", "out", report=True)[0] == 0
    assert_contracts_hold(tmp_path / "out")


def test_the_contracts_on_levels_known_without_logs(tda, tmp_path):
    (tmp_path / "printed").mkdir()
    (tmp_path / "printed" / "campaign.toml").write_text(
        HEAD
        + "".join(table("level", condition=str(i), distance_m=4.0, level_db=80.0 + i, origin="paper") for i in range(3))
    )
    code, _, err = tda("run", "printed", "-o", "out", report=True)
    assert (code, err) == (0, NO_FLEET)
    assert_contracts_hold(tmp_path / "out")
    assert [row["level_db"] for row in rows(tmp_path / "out/levels.csv")] == ["80", "81", "82"]


def test_the_contracts_where_a_log_is_missing(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride")
    (tmp_path / "ride" / "a.h5").unlink()
    assert tda("run", campaign, "-o", "out", report=True)[0] == 0
    assert_contracts_hold(tmp_path / "out")


def test_twice_the_same_bytes_whatever_the_store_the_copy_and_the_working_directory(tmp_path):
    """Copies a second apart, a fresh store, another working directory, two processes, one log missing."""
    results = []
    for name, jobs in (("one", 1), ("two", 2)):
        home = tmp_path / name
        small_campaign(home / "ride", conditions="abc")
        (home / "ride" / "c.h5").unlink()
        arguments = {"one": ["run", "ride", "-o", "out"], "two": ["run", home / "ride", "-o", home / "out"]}[name]
        done = program(*arguments, "--store", home / "store", "--jobs", jobs, cwd=home if name == "one" else ROOT)
        assert done.returncode == 0, done.stderr
        results.append(files_of(home / "out"))
        time.sleep(1.1)
    assert set(results[0]) == set(results[1])
    for name, data in results[0].items():
        assert data == results[1][name], name
    manifest = json.loads(results[0]["manifest.json"])
    assert all(hashlib.sha256(results[0][name]).hexdigest() == sha for name, sha in manifest["files"].items())


def test_silence_in_a_pipe(tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    done = program("check", campaign, "--store", tmp_path / "store", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"\x1b" not in done.stdout
    assert b"\r" not in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
@pytest.mark.parametrize("options", [(), ("--quiet",)], ids=["bar", "quiet"])
def test_a_bar_on_a_terminal(tmp_path, options):
    import pty

    campaign = small_campaign(tmp_path / "ride", conditions="a")
    ours, theirs = pty.openpty()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "100"}
    command = [sys.executable, "-m", "tdacoustic", "check", str(campaign), "--store", str(tmp_path / "store"), *options]
    process = subprocess.Popen(command, stderr=theirs, stdout=subprocess.DEVNULL, env=environment, cwd=tmp_path)
    os.close(theirs)
    shown = b""
    while True:
        try:
            data = os.read(ours, 65536)
        except OSError:  # the other side is closed
            break
        if not data:
            break
        shown += data
    os.close(ours)
    assert process.wait() == 0
    if options:
        assert shown == b""
    else:
        assert b"%" in shown
        assert b"Block powers, bands and statistics: run a" in shown


def test_the_program_by_its_module_and_its_errors(tmp_path):
    done = program("run", tmp_path / "gone.toml")
    assert done.returncode == 1
    assert done.stdout == b""
    assert_one_message(done.stderr.decode(), "gone.toml", "no such file")


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit on file sizes")
def test_a_full_disk(tmp_path):
    import resource

    campaign = small_campaign(tmp_path / "ride", conditions="a")
    out = tmp_path / "out"

    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

    done = program("run", campaign, "-o", out, "--store", tmp_path / "store", preexec_fn=small_files)
    assert done.returncode == 1
    assert_one_message(done.stderr.decode(), "File too large")
    assert not out.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) in (["ride", "store"], ["ride"])
