"""The fleet view from the command line: what is gathered, what is left out, what is refused, what is refreshed."""

import csv as csv_module
import io
import json
import os
import shutil
from pathlib import Path

import h5py
import pytest
from made_up_results import level, made_result, manifest_of, many_results, quality, sha, verdict, write_manifest
from small_campaigns import files_of, small_campaign

pq = pytest.importorskip("pyarrow.parquet", reason="the fleet view needs pyarrow")

ONE = {"levels": [level("a", 40.0, 85.0)], "dominance": [verdict("a", 40.0)], "quality": [quality("a")]}


@pytest.fixture
def tda(tmp_path, call_program, monkeypatch):
    """Run the program in this process with a stand-in for the page, which takes seconds to draw."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TDACOUSTIC_STORE", str(tmp_path / ".store"))
    monkeypatch.setattr("tdacoustic.reporting.html.render_html", lambda document: "<!doctype html>" + document.title)
    return call_program


def campaigns_of(folder, table="results"):
    return [row["campaign"] for row in pq.read_table(folder / f"dataset/{table}.parquet").to_pylist()]


def test_results_of_the_program_itself_are_gathered(tda, tmp_path):
    """Two small campaigns analysed by the program, one of a known train: nothing here is made up."""
    for number, meta in enumerate(('[meta]\nTrain = "185 042"\ndate = 2024-05-01\n', "")):
        path = small_campaign(tmp_path / f"campaign-{number}", conditions=("a", "b"))
        text = path.read_text(encoding="utf-8").replace('"Small"', f'"Small {number}"')
        text = text.replace('origin = "measured"\n', f'origin = "measured"\n\n{meta}')
        path.write_text(text, encoding="utf-8")
        code, _, _ = tda("analyze", path, "-o", tmp_path / "reports" / f"{number}", "--quiet")
        assert code == 0
    code, out, err = tda("fleet", "reports", "-o", "view")
    assert (code, out.strip(), err) == (0, str(Path("view") / "report.html"), "")
    held = pq.read_table(tmp_path / "view/dataset/overview.parquet").to_pylist()
    assert [(row["campaign"], row["train"], row["year"], row["condition"]) for row in held] == [
        ("Small 0", "185 042", 2024, "a"),
        ("Small 0", "185 042", 2024, "b"),
        ("Small 1", None, None, "a"),
        ("Small 1", None, None, "b"),
    ]
    # the microphone of small_campaigns: a tone of 0.2 Pa and noise of 0.02 Pa rms, at 4 m
    assert [row["level_4m_db"] for row in held] == pytest.approx([80.04] * 4, abs=0.05)
    assert [row["train_speed_km_h"] for row in held] == [30.0] * 4
    lines = pq.read_table(tmp_path / "view/dataset/lines.parquet").to_pylist()
    assert {round(row["frequency_hz"]) for row in lines if row["channel"] == "mic"} >= {200, 250}


def test_where_no_meta_says_the_date_the_earliest_log_does(tda, tmp_path):
    """Of three conditions, recorded at 09:30, 10:00 and 08:00 in UTC; the log that was first is in local time."""
    path = small_campaign(tmp_path / "campaign", seconds=1.0)
    for name, start in (
        ("a", "2024-05-01T11:30:00+02:00"),
        ("b", "2024-05-01T10:00:00Z"),
        ("c", "2024-04-30T22:00:00-10:00"),
    ):
        with h5py.File(path.parent / f"{name}.h5", "r+") as file:
            file.attrs["start_time"] = start
    assert tda("analyze", path, "-o", "reports/a", "--quiet")[0] == 0
    named = json.loads((tmp_path / "reports/a/manifest.json").read_text(encoding="utf-8"))["campaign"]
    assert named == {"name": "Small", "origin": "measured", "started": "2024-04-30T22:00:00-10:00"}
    assert tda("fleet", "reports", "-o", "view")[0] == 0
    (row,) = pq.read_table(tmp_path / "view/dataset/results.parquet").to_pylist()
    assert (str(row["date"]), row["year"], row["date_from"]) == ("2024-04-30", 2024, "log")
    assert row["started"].isoformat() == "2024-05-01T08:00:00+00:00"


def test_what_is_damaged_incomplete_or_twice_is_told_and_left_out_and_the_rest_is_there(tda, tmp_path):
    root = tmp_path / "reports"
    made_result(root / "good", name="good", inputs=[sha("one")], **ONE)
    made_result(root / "damaged", name="damaged", **ONE)
    (root / "damaged/levels.csv").write_text("run\n")
    incomplete = made_result(root / "incomplete", name="incomplete", **ONE)
    write_manifest(incomplete, {**manifest_of(incomplete), "complete": False})
    shutil.copytree(root / "good", root / "copy")
    os.utime(root / "copy/manifest.json", (1e9, 1e9))  # of equal ones the one that was written last stays
    made_result(root / "less", name="good", command="analyze", inputs=[sha("one")], **ONE)
    made_result(root / "same-name", name="good", inputs=[sha("other")], **ONE)
    (root / "page").mkdir()
    (root / "page/manifest.json").write_text('{"name": "a web page"}')
    code, _, err = tda("fleet", "reports", "-o", "view")
    assert code == 0
    assert sorted(err.splitlines()) == [
        "warning: reports/copy is left out: the same result as reports/good",
        "warning: reports/damaged is left out: levels.csv is not what the manifest says (sha256)",
        "warning: reports/incomplete is left out: the result is incomplete: it was being written, and its run has not "
        "ended well",
        "warning: reports/less is left out: of the same recordings as reports/good",
        "warning: reports/page is left out: manifest.json is none of tdacoustic (schema is not "
        "'tdacoustic-manifest/1')",
    ]
    assert campaigns_of(tmp_path / "view") == ["good", "good"]
    manifest = json.loads((tmp_path / "view/manifest.json").read_text(encoding="utf-8"))
    assert (manifest["command"], manifest["n_results"], len(manifest["left_out"])) == ("fleet", 2, 5)


def test_nothing_usable_is_an_error_in_one_line_and_leaves_no_folder(tda, tmp_path):
    (tmp_path / "empty").mkdir()
    damaged = made_result(tmp_path / "bad/one", **ONE)
    (damaged / "levels.csv").write_text("run\n")
    for arguments, said in [
        (["empty"], "error: empty: no result of a campaign in it or below\n"),
        (["nowhere"], "error: nowhere: no such folder\n"),
        (["bad"], "error: bad: none of 1 folders with a manifest can be used; bad/one: levels.csv is not what"),
    ]:
        code, out, err = tda("fleet", *arguments, "-o", "view")
        assert (code, out) == (1, "")
        assert err.startswith(said) and err.count("\n") == 1
        assert not (tmp_path / "view").exists()
    assert [path.name for path in tmp_path.iterdir() if path.name.endswith(".partial")] == []
    assert tda("fleet")[0] == 2


def test_a_view_is_refreshed_in_place_and_something_else_is_refused(tda, tmp_path):
    made_result(tmp_path / "reports/a", name="a", **ONE)
    made_result(tmp_path / "reports/b", name="b", **ONE)
    assert tda("fleet", "reports/a", "reports/b")[0] == 0  # into reports/fleet, beside what it is of
    before = files_of(tmp_path / "reports/fleet")
    assert tda("fleet", "reports/a", "reports/b")[0] == 0
    assert files_of(tmp_path / "reports/fleet") == before
    made_result(tmp_path / "reports/c", name="c", **ONE)
    assert tda("fleet", "reports/*")[0] == 0  # a pattern, whose folders are more by and by, and one is the view itself
    assert campaigns_of(tmp_path / "reports/fleet") == ["a", "b", "c"]
    made_result(tmp_path / "others/d", name="d", **ONE)
    code, _, err = tda("fleet", "others")
    assert code == 1
    assert err.startswith("error: reports/fleet: the folder holds results of '..', not of '../../others'")
    assert tda("fleet", "others", "--overwrite")[0] == 0
    code, _, err = tda("fleet", "reports", "-o", "reports/a")
    assert code == 1 and "holds results of '../campaign.toml'" in err


def test_keys_of_meta_can_be_named(tda, tmp_path):
    made_result(tmp_path / "r", meta={"Zug": "4711", "train": "x", "Tag": "2020-02-03", "date": "1999-01-01"}, **ONE)
    assert tda("fleet", "r", "-o", "view", "--train-key", "Zug", "--date-key", "Tag")[0] == 0
    (row,) = pq.read_table(tmp_path / "view/dataset/results.parquet").to_pylist()
    assert (row["train"], str(row["date"]), row["date_from"]) == ("4711", "2020-02-03", "meta")


def test_hostile_names_stay_names(tda, tmp_path):
    name = '=cmd()|"<script>alert(1)</script>'
    made_result(tmp_path / "r" / "a b%2F#x", name=name, meta={"train": "@SUM(A1)"}, **ONE)
    assert tda("fleet", "r", "-o", "view")[0] == 0
    (row,) = csv_module.DictReader(io.StringIO((tmp_path / "view/results.csv").read_text(encoding="utf-8")))
    assert (row["campaign"], row["train"]) == (f"'{name}", "'@SUM(A1)")
    (held,) = pq.read_table(tmp_path / "view/dataset/results.parquet").to_pylist()
    assert (held["campaign"], held["train"], held["folder"]) == (name, "@SUM(A1)", "r/a b%2F#x")


def test_every_file_can_be_checked(tda, tmp_path):
    made_result(tmp_path / "r/a", name="a", **ONE)
    made_result(tmp_path / "r/b", name="b", **ONE)
    (tmp_path / "r/b/report.html").write_text("changed")
    assert tda("fleet", "r", "-o", "view")[0] == 0
    assert campaigns_of(tmp_path / "view") == ["a", "b"]
    _, _, err = tda("fleet", "r", "-o", "view", "--check-all")
    assert err == "warning: r/b is left out: report.html is not what the manifest says (sha256)\n"
    assert campaigns_of(tmp_path / "view") == ["a"]


def test_many_that_are_left_out_are_counted(tda, tmp_path):
    made_result(tmp_path / "r/good", name="good", **ONE)
    for number in range(30):
        (tmp_path / f"r/{number}").mkdir()
        (tmp_path / f"r/{number}/manifest.json").write_text("{")
    code, _, err = tda("fleet", "r", "-o", "view")
    assert code == 0
    assert len(err.splitlines()) == 21
    assert err.splitlines()[-1] == f"warning: 10 more are left out: see {Path('view') / 'manifest.json'}"


def test_without_pyarrow_the_package_is_named(tda, tmp_path, monkeypatch):
    import builtins

    made_result(tmp_path / "r", **ONE)
    known = builtins.__import__

    def without(name, *arguments, **keys):
        if name.partition(".")[0] == "pyarrow":
            raise ImportError(name)
        return known(name, *arguments, **keys)

    monkeypatch.setattr(builtins, "__import__", without)
    code, _, err = tda("fleet", "r", "-o", "view")
    assert (code, err.count("\n")) == (1, 1)
    assert 'pip install "tdacoustic[fleet]"' in err


def test_the_overview_has_a_row_a_campaign(tda, tmp_path):
    many_results(tmp_path / "r", 30, lines=0)
    assert tda("fleet", "r", "-o", "view", "--quiet")[0] == 0
    rows = list(csv_module.DictReader(io.StringIO((tmp_path / "view/results.csv").read_text(encoding="utf-8"))))
    assert len(rows) == len({row["result"] for row in rows}) == 30
    levels = pq.read_table(tmp_path / "view/dataset/overview.parquet").to_pylist()
    for row in rows:
        loudest = max(level["level_4m_db"] or 0.0 for level in levels if level["result"] == row["result"])
        assert float(row["loudest_4m_db"]) == pytest.approx(loudest, rel=1e-8)
        assert 0 <= int(row["runs_bad"]) <= int(row["runs"]) == 10
