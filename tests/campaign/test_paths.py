"""What a file that people write may name as a path; and that nothing is written where such a file says."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError, FleetError, MissingFileError, TdacousticError
from tdacoustic.fleet import load_fleet
from tdacoustic.toml_models import address_problem, is_address, path_problem

HEAD = 'schema = "tdacoustic-campaign/1"\norigin = "measured"\n'
MIC = '[[channel]]\nname = "mic"\ncomponent = "air"\n'
RUN = '[[run]]\ncondition = "1"\nlogs = [{}]\n'

FINE = [
    "run.wav", "../../calibration/crrc-freight/fleet.toml", "logs/Lauf 1 (Ölwanne).h5", "$HOME/a.wav", "%TEMP%/a.wav",
    "./~a.wav", "logs\\run.wav", "/data/run.wav", "D:/data/run.wav", "a..b/..c.wav", "बोगी.wav",
]  # fmt: skip
REFUSED = {
    "": "is empty", "   ": "is empty", "a\0b": "control characters", "a\nb.wav": "control characters",
    "\x1b[31m.wav": "control characters", "https://example.com/run.wav": "is an address",
    "file:///etc/passwd": "is an address", "s3://bucket/a": "is an address", "~/run.wav": "not expanded",
    "~root/run.wav": "not expanded", "//server/share/run.wav": "another machine",
    "\\\\server\\share\\run.wav": "another machine", "\\\\?\\C:\\run.wav": "another machine",
    "\\\\.\\PhysicalDrive0": "another machine", "x" * 1001: "1001 characters", "d/" + "x" * 256: "more than 255 bytes",
}  # fmt: skip


@pytest.mark.parametrize("text", FINE)
def test_a_path_of_this_machine_is_taken(text):
    assert path_problem(text, windows=False) is None
    assert path_problem(text, windows=True) is None


@pytest.mark.parametrize("text", list(REFUSED))
@pytest.mark.parametrize("windows", [False, True])
def test_what_is_no_path_is_refused(text, windows):
    assert REFUSED[text] in path_problem(text, windows)


@pytest.mark.parametrize("text", ["NUL", "logs/con.wav", "aux", "COM1.txt", "lpt9 .wav", "run.wav:stream", "C:run.wav"])
def test_devices_of_windows(text):
    assert path_problem(text, windows=True) is not None
    assert path_problem(text, windows=False) is None
    assert path_problem("console.wav", windows=True) is None


@pytest.mark.parametrize(
    "text", [text for text in REFUSED if "\0" not in text and "\n" not in text and "\x1b" not in text]
)
def test_every_path_of_a_campaign_keeps_the_rule(tmp_path, text):
    quoted = f"'{text}'"
    files = {
        "logs": HEAD + RUN.format(quoted),
        "fleet": HEAD + f"fleet = {quoted}\n" + RUN.format("'a.wav'"),
        "runs": HEAD + f"runs = {quoted}\n",
        "prior_fleet": HEAD + RUN.format("'a.wav'") + f"[calibration]\nprior_fleet = {quoted}\n",
        "with_campaigns": HEAD + RUN.format("'a.wav'") + f"[calibration]\nwith_campaigns = [{quoted}]\n",
    }
    if is_address(text):
        del files["logs"]  # a log may be named by one
    for key, content in files.items():
        (tmp_path / "campaign.toml").write_text(content, encoding="utf-8")
        with pytest.raises(CampaignError, match=rf"{key}.*must be a path"):
            load_campaign(tmp_path)
    if is_address(text):
        return
    (tmp_path / "campaign.toml").write_text(HEAD + "runs = 'runs.csv'\n", encoding="utf-8")
    (tmp_path / "runs.csv").write_text(f'condition,logs\n1,"{text}"\n', encoding="utf-8")
    with pytest.raises(CampaignError, match="logs"):
        load_campaign(tmp_path)


@pytest.mark.parametrize(
    "text", ["s3://bucket/a.h5", "https://example.com:8080/a.h5?version=2", "file:///data/a.h5", "sftp://me@host/a.h5"]
)
def test_a_log_may_be_named_by_an_address_and_is_not_opened(tmp_path, text):
    assert address_problem(text) is None
    (tmp_path / "campaign.toml").write_text(HEAD + MIC + RUN.format(f"'{text}', 'b.h5'"), encoding="utf-8")
    one, other = load_campaign(tmp_path).runs[0].logs
    assert (one.text, one.url, one.to_fetch) == (text, text, True)
    assert (other.url, other.to_fetch, other.path) == (None, False, tmp_path / "b.h5")
    (tmp_path / "campaign.toml").write_text(HEAD + "runs = 'runs.csv'\n" + MIC, encoding="utf-8")
    (tmp_path / "runs.csv").write_text(f'condition,logs\n1,"{text}|b.h5"\n', encoding="utf-8")
    assert load_campaign(tmp_path).runs[0].logs == (one, other)


@pytest.mark.parametrize(
    ("text", "problem"),
    {
        "https://me:secret@example.com/a.h5": "holds a password",
        "s3://:secret@bucket/a.h5": "holds a password",
        "zip://a.h5::https://example.com/a.zip": "'::'",
        "s3:\\\\bucket\\a.h5": "backslash",
        "s3://bucket/a b.h5": "a space",
        "s3://": "names no file",
        "s3://bucket/" + "x" * 1000: "1012 characters",
    }.items(),
)
def test_addresses_that_no_log_may_have(tmp_path, text, problem):
    (tmp_path / "campaign.toml").write_text(HEAD + RUN.format(f"'{text}'"), encoding="utf-8")
    with pytest.raises(CampaignError, match=r"logs.*must be a path") as caught:
        load_campaign(tmp_path)
    if is_address(text):
        assert problem in address_problem(text)
        assert problem in str(caught.value)


def test_an_address_stands_once(tmp_path):
    (tmp_path / "campaign.toml").write_text(HEAD + RUN.format("'s3://b/a.h5', 's3://b/a.h5'"), encoding="utf-8")
    with pytest.raises(CampaignError, match=r"logs names 's3:.*a\.h5' 2 times"):
        load_campaign(tmp_path)


def test_the_step_file_of_a_fleet_keeps_the_rule(tmp_path):
    fleet = 'schema = "tdacoustic-fleet/1"\nname = "a"\n[housing]\nstep_file = {}\n'
    for text in ('"//server/share/a.step"', '{ value = "https://example.com/a.step", origin = "mail" }', '"~/a.step"'):
        (tmp_path / "fleet.toml").write_text(fleet.format(text), encoding="utf-8")
        with pytest.raises(FleetError, match=r"step_file.*must be a path"):
            load_fleet(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize("name", ["campaign.toml", "runs.csv", "fleet.toml"])
def test_pipes_in_the_place_of_files_do_not_hang(tmp_path, name):
    (tmp_path / "campaign.toml").write_text(HEAD + "runs = 'runs.csv'\n", encoding="utf-8")
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    code = f"from tdacoustic.{'fleet' if name == 'fleet.toml' else 'campaign'} import *; import sys; "
    code += "load_fleet(sys.argv[1])" if name == "fleet.toml" else "load_campaign(sys.argv[1])"
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, timeout=30)
    assert "MissingFileError" in run.stderr or "CampaignError" in run.stderr


def test_files_without_end_and_without_bound_are_not_read(tmp_path):
    if Path("/dev/zero").exists():
        (tmp_path / "runs.csv").symlink_to("/dev/zero")
        (tmp_path / "campaign.toml").write_text(HEAD + "runs = 'runs.csv'\n", encoding="utf-8")
        with pytest.raises(MissingFileError, match=r"no such file|not a file"):
            load_campaign(tmp_path)
    with (tmp_path / "campaign.toml").open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(CampaignError, match="1099511627776 bytes, allowed are"):
        load_campaign(tmp_path)


@pytest.mark.parametrize("text", ["..", ".", "a/../../b", "../x", "a\\..\\b", "con", "-x", "a:b", "x" * 65])
def test_names_are_no_paths(tmp_path, text):
    """Names may have ``/``; they never become a file's, and what begins with a dot is none."""
    toml = HEAD + f"[[channel]]\nname = '{text}'\ncomponent = 'motor'\n" + RUN.format("'a.wav'")
    (tmp_path / "campaign.toml").write_text(toml, encoding="utf-8")
    if text in ("a/../../b", "con"):
        assert load_campaign(tmp_path).channels[0].name == text
    else:
        with pytest.raises(TdacousticError, match="name"):
            load_campaign(tmp_path)


@pytest.mark.parametrize("sign", ["\\u0000", "\\u001b", "\\u009b", "\\u202e", "\\u2066"])
@pytest.mark.parametrize("key", ["name = 'X'", "[meta]\nweather = 'X'", "[meta]\na = [['X']]", "[meta]\n'X' = 1"])
def test_no_text_steers_a_terminal_or_turns_the_writing(tmp_path, sign, key):
    (tmp_path / "campaign.toml").write_text(HEAD + key.replace("'X'", f'"a{sign}b"') + "\n", encoding="utf-8")
    with pytest.raises(CampaignError, match=r"campaign.toml: .* which no text here may have") as caught:
        load_campaign(tmp_path)
    assert str(caught.value).isprintable()


def test_a_table_of_runs_has_no_such_signs_either(tmp_path):
    (tmp_path / "campaign.toml").write_text(HEAD + "runs = 'runs.csv'\n", encoding="utf-8")
    (tmp_path / "runs.csv").write_text("condition,logs,direction\n1,a.wav,ok\n1,b.wav,\u202eto\n", encoding="utf-8")
    with pytest.raises(CampaignError, match=r"runs.csv: line 3 has the sign"):
        load_campaign(tmp_path)
