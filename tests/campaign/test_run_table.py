from dataclasses import replace

import pytest

from tdacoustic.campaign import SCHEMA, load_campaign
from tdacoustic.errors import CampaignError, MissingFileError

HEAD = f'schema = "{SCHEMA}"\norigin = "measured"\n'
CHANNEL = 'runs = "runs.csv"\n[[channel]]\nname = "mic_1"\nunit = "Pa"\n'
TABLE = "name,condition,train_speed_km_h,logs,valid,reject_reason,sample_rate_hz\n"


@pytest.fixture
def load(tmp_path):
    def loaded(text, head=HEAD, runs_csv=None):
        if runs_csv is not None:
            (tmp_path / "runs.csv").write_bytes(runs_csv if isinstance(runs_csv, bytes) else runs_csv.encode())
        (tmp_path / "campaign.toml").write_text(head + text, encoding="utf-8")
        return load_campaign(tmp_path / "campaign.toml")

    return loaded


def test_rows_are_runs(load, tmp_path):
    table = TABLE + "\n1a,1,20.5,a.h5|sub/b.h5,,,8192\n,1,,c.h5,FALSE,rain,\n"
    first, second = load(CHANNEL, runs_csv=table).runs
    assert (first.name, first.condition, first.train_speed_km_h) == ("1a", "1", 20.5)
    assert [log.path for log in first.logs] == [tmp_path / "a.h5", tmp_path / "sub" / "b.h5"]
    assert (first.valid, first.sample_rate_hz) == (True, 8192.0)
    assert (second.name, second.valid, second.reject_reason) == ("1#2", False, "rain")


def test_semicolons_byte_order_mark_crlf_and_quoted_logs(load):
    table = b'\xef\xbb\xbfcondition;logs\r\nL\xc3\xb6schlauf;"a.h5;b.h5"\r\n'
    (run,) = load(CHANNEL, runs_csv=table).runs
    assert run.condition == "Löschlauf"
    assert [log.text for log in run.logs] == ["a.h5", "b.h5"]


def test_the_same_runs_as_in_toml(load):
    by_table = load(CHANNEL, runs_csv="condition,logs,end_s\n1,a.h5,10\n")
    by_toml = load('[[channel]]\nname = "mic_1"\nunit = "Pa"\n[[run]]\ncondition = "1"\nlogs = ["a.h5"]\nend_s = 10\n')
    assert by_table.run_table is not None
    assert replace(by_table, run_table=None) == by_toml


@pytest.mark.parametrize(
    ("table", "match"),
    [
        (
            "condition,log\n1,a\n",
            r"runs\.csv: column 2: unknown key 'log' in \[\[run\]\]; it belongs in \[\[channel\]\]",
        ),
        ("condition,speed_km_h,logs\n1,2,a\n", r"the nearest known key is 'train_speed_km_h'"),
        ("condition,logs,logs\n1,a,b\n", r"column 'logs' stands twice"),
        ("condition,,logs\n1,a,b\n", r"column 2 has no name in line 1"),
        ("condition\n1\n", r"column 'logs' is missing; there are condition"),
        ("condition,logs\n1,a,b\n", r"line 2 has 3 cells, the header 2"),
        ("condition,logs\n", r"runs\.csv: no run in it"),
        ("", r"runs\.csv: no run in it"),
        ("condition,logs\n1,\n", r"campaign\.toml: runs\.csv line 2: logs is missing"),
        ("name,condition,logs,end_s\nx,1,a,ten\n", r"runs\.csv line 2 \(run 'x'\): end_s must be a number, got 'ten'"),
        ("condition,logs,end_s\n1,a,nan\n", r"runs\.csv line 2: end_s must be a finite number, got nan"),
        ("condition,logs,valid\n1,a,no\n", r"valid must be true or false, got 'no'"),
        ('condition,logs\n1,"a\n', r"runs\.csv: line 2: "),
        (b"condition,logs\n\xff,a\n", r"runs\.csv: is not UTF-8 \(byte 15\)"),
    ],
)
def test_faults_say_where(load, table, match):
    with pytest.raises(CampaignError, match=match):
        load(CHANNEL, runs_csv=table)


def test_a_missing_table_and_both_kinds_of_runs(load):
    with pytest.raises(MissingFileError, match=r"runs\.csv: no such file \(runs = "):
        load(CHANNEL)
    with pytest.raises(CampaignError, match=r"runs = 'runs\.csv' and \[\[run\]\] both stand in the file"):
        load(CHANNEL + '[[run]]\ncondition = "1"\nlogs = ["a"]\n', runs_csv="condition,logs\n1,a\n")
