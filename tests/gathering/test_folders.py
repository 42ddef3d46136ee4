"""Where results are found, and what is a result: hostile, damaged and repeated ones are told and left out."""

import json
import os
import shutil

import pytest
from made_up_results import (
    calibration,
    fitted,
    hashed_again,
    level,
    made_result,
    manifest_of,
    quality,
    sha,
    verdict,
    write_manifest,
)

from tdacoustic.errors import GatheringError, MissingFileError
from tdacoustic.gathering import common_folder, find_folders, named_folders, open_result, read_result, relative_link
from tdacoustic.gathering.manifest import NoCampaignError

pytest.importorskip("pyarrow", reason="tables of results are read with pyarrow")


@pytest.fixture
def result(tmp_path):
    rows = {"levels": [level("a", 30.0, 85.0)], "dominance": [verdict("a", 30.0)], "quality": [quality("a")]}
    files = {"calibration.json": calibration({"masuda.constant_db": fitted(20.0, 19.0, 21.0)})}
    return made_result(tmp_path / "result", files=files, **rows)


def refusal(folder):
    with pytest.raises(GatheringError) as caught:
        read_result(open_result(folder))
    return str(caught.value)


# ---------------------------------------------------------------- finding


def test_results_are_found_at_any_depth_in_natural_order_and_hidden_or_half_written_ones_are_not(tmp_path):
    for name in ("b/campaign-10", "b/campaign-9", "a", "b/campaign-9/inner", ".hidden/x", "b/.x.1-2-3.partial"):
        made_result(tmp_path / name, name=name)
    (tmp_path / "notes").mkdir()
    found, unread = find_folders([tmp_path])
    assert [path.relative_to(tmp_path).as_posix() for path in found] == [
        "a",
        "b/campaign-9",
        "b/campaign-9/inner",
        "b/campaign-10",
    ]
    assert unread == []


def test_a_folder_that_two_names_lead_to_is_found_once_and_links_in_a_circle_end(tmp_path):
    made_result(tmp_path / "reports/a")
    try:
        (tmp_path / "reports/a/back").symlink_to(tmp_path / "reports", target_is_directory=True)
        (tmp_path / "other").symlink_to(tmp_path / "reports/a", target_is_directory=True)
    except OSError:
        pytest.skip("this system makes no links")
    found, _ = find_folders([tmp_path / "reports", tmp_path / "reports/a", tmp_path / "other"])
    assert found == [tmp_path / "reports/a"]


def test_patterns_stand_for_folders_and_what_is_not_there_is_named(tmp_path):
    for name in ("x-1", "x-2", "y"):
        (tmp_path / name).mkdir()
    (tmp_path / "x-3").touch()
    (tmp_path / "[z]").mkdir()
    assert named_folders([tmp_path / "x-*"]) == [tmp_path / "x-1", tmp_path / "x-2"]
    assert named_folders([tmp_path / "[z]"]) == [tmp_path / "[z]"]
    for wrong, said in (("nowhere", "no such folder"), ("q*", "no such folder"), ("x-3", "is no folder")):
        with pytest.raises(MissingFileError, match=f"{wrong.replace('*', '.')}: {said}"):
            named_folders([tmp_path / wrong])


def test_what_a_view_is_of_stays_the_same_when_results_are_added(tmp_path):
    names = [tmp_path / name for name in ("a", "b", "c")]
    assert common_folder(names[:2]) == common_folder(names) == tmp_path.resolve()
    assert common_folder([tmp_path]) == tmp_path.resolve()


@pytest.mark.parametrize("name", ["a b", "50% #1?", "javascript:alert(1)", "Zürich", '"><script>'])
def test_links_are_relative_paths_in_the_signs_of_urls(tmp_path, name):
    from urllib.parse import unquote

    link = relative_link(tmp_path / name / "report.html", tmp_path / "fleet")
    assert not set(link) & set(':?#"<> ')
    assert unquote(link) == f"../{name}/report.html"


# ---------------------------------------------------------------- the manifest


def test_a_result_is_read_with_its_identity(tmp_path):
    meta = {"Train number": "185 042", "date": "2024-05-01"}
    folder = made_result(tmp_path / "r", meta=meta, inputs=[sha("log")], started="2024-05-02T08:00:00+02:00")
    found = open_result(folder)
    assert (found.campaign, found.origin, found.fleet, found.command) == ("Campaign", "measured", "Fleet A", "run")
    assert found.recordings == {sha("log")}
    assert len(found.result) == 12
    shutil.copytree(folder, tmp_path / "elsewhere")
    assert open_result(tmp_path / "elsewhere").result == found.result


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "tdacoustic-manifest/9"}, "none of tdacoustic"),
        ({"complete": False}, "incomplete"),
        ({"complete": "yes"}, "incomplete"),
        ({"campaign": None}, "holds no campaign's results"),
        ({"campaign": {"name": "x", "origin": "guessed"}}, "origin must be one of"),
        ({"campaign": {"name": 5, "origin": "measured"}}, "name of the campaign is no text"),
        ({"campaign": {"name": "a\x1b[2Jb", "origin": "measured"}}, "control character"),
        ({"campaign": {"name": "a" * 5000, "origin": "measured"}}, "5000 characters"),
        ({"campaign": {"name": "x", "origin": "measured", "meta": []}}, "meta of the manifest is no table"),
        ({"files": {}}, "names no files"),
        ({"files": []}, "names no files"),
        ({"inputs": [{"sha256": 1, "bytes": 2}]}, "lacks its sha256"),
        ({"inputs": [{"sha256": "a", "bytes": -1}]}, "lacks its sha256"),
        ({"problems": "none"}, "problems of the manifest"),
    ],
)
def test_a_wrong_manifest_is_refused_in_a_line(result, change, said):
    write_manifest(result, {**manifest_of(result), **change})
    words = refusal(result)
    assert said in words
    assert "\n" not in words and words.isprintable()


@pytest.mark.parametrize(
    "text", ["", "[]", "{", "null", '{"schema": NaN}', "[" * 100_000, '{"a": ' * 100_000, "\xff\xfe", "1" * 10_000]
)
def test_a_manifest_that_is_no_json_is_refused(result, text):
    (result / "manifest.json").write_bytes(text.encode("latin-1"))
    assert "manifest.json" in refusal(result)


@pytest.mark.parametrize(
    "name",
    ["../outside.csv", "/etc/hostname", "sub/../../outside.csv", "..\\outside.csv", "C:\\x", "C:x", "a\x00b", "", "."],
)
def test_a_manifest_that_points_out_of_its_folder_is_refused(result, name):
    (result.parent / "outside.csv").write_text("secret")
    held = manifest_of(result)
    held["files"][name] = sha("secret")
    write_manifest(result, held)
    assert "not within its folder" in refusal(result) or "is not there" in refusal(result)


def test_a_link_out_of_the_folder_is_refused(result):
    secret = result.parent / "secret.csv"
    secret.write_text("x")
    (result / "levels.csv").unlink()
    try:
        (result / "levels.csv").symlink_to(secret)
    except OSError:
        pytest.skip("this system makes no links")
    hashed_again(result)
    assert "not within its folder" in refusal(result)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes")
def test_a_pipe_is_not_waited_for(result):
    (result / "levels.csv").unlink()
    os.mkfifo(result / "levels.csv")
    assert "levels.csv" in refusal(result)


def test_a_view_of_results_is_none_itself(result):
    write_manifest(result, {**manifest_of(result), "command": "fleet", "campaign": None})
    with pytest.raises(NoCampaignError):
        open_result(result)


# ---------------------------------------------------------------- files


@pytest.mark.parametrize("name", ["levels.csv", "dominance.csv", "quality.csv", "calibration.json"])
def test_one_changed_byte_of_a_file_that_is_read_is_found(result, name):
    data = bytearray((result / name).read_bytes())
    data[-2] ^= 1
    (result / name).write_bytes(data)
    assert refusal(result) == f"{name} is not what the manifest says (sha256)"


def test_a_file_that_is_gone_is_named(result):
    (result / "report.html").unlink()
    assert refusal(result) == "report.html is not there"


def test_other_files_are_checked_when_asked(result):
    found = open_result(result)
    found.check("report.html")
    (result / "report.html").write_text("changed")
    read_result(open_result(result))
    with pytest.raises(GatheringError, match=r"report\.html is not what the manifest says"):
        open_result(result).check("report.html")


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("levels.csv", "run,condition", "condition,run", "column 1 is 'condition', expected 'run'"),
        ("levels.csv", "run,condition", "run,run", "no header"),
        ("levels.csv", ",85,", ",loud,", "level_db, line 2: double: invalid value 'loud'"),
        ("levels.csv", ",85,", ",inf,", "level_db has a value that is not finite"),
        ("levels.csv", ",85,", ",nan,", "level_db has a value that is not finite"),
        ("levels.csv", ",85,", ",1e300,", "level_db has a value above 1e+15"),
        ("calibration.json", '"value": 20.0', '"value": -1e300', "-1e+300, which nothing measured is"),
        ("levels.csv", "\na,", "\na,more,", "Expected 19 columns, got 20"),
        ("levels.csv", ",mic,", ",mi\x1bc,", "channel has a control character"),
        ("levels.csv", ",mic,", ",mi\u202ec,", "channel has a control character"),
        ("levels.csv", ",mic,", f",{'m' * 10_001},", "channel has a text of more than 10000 characters"),
        ("quality.csv", ",ok,", ",fine,", "verdict 'fine' is none of ok, warning, bad"),
        ("calibration.json", '"value": 20.0', '"value": "20"', "value of masuda.constant_db is no number"),
        ("calibration.json", '"value": 20.0', '"value": 1e999', "not finite"),
        ("calibration.json", '"value": 20.0', f'"value": {"9" * 400}', "not finite"),
        ("calibration.json", '"value": 20.0', '"value": NaN', "calibration.json is no valid JSON"),
        ("calibration.json", "tdacoustic-calibration/1", "other/1", "schema must be"),
        ("calibration.json", '"ci95": [19.0, 21.0]', '"ci95": [19.0]', "ci95 of masuda.constant_db is no pair"),
    ],
)
def test_a_table_that_breaks_its_contract_is_refused_though_its_sha256_is_right(result, file, old, new, said):
    text = (result / file).read_text(encoding="utf-8")
    assert old in text
    (result / file).write_text(text.replace(old, new), encoding="utf-8")
    hashed_again(result)
    words = refusal(result)
    assert said in words
    assert words.startswith(file) and words.isprintable() and len(words) < 400


def test_bytes_that_are_no_utf8_are_refused(result):
    (result / "levels.csv").write_bytes((result / "levels.csv").read_bytes().replace(b",mic,", b",mi\xffc,"))
    hashed_again(result)
    assert refusal(result).startswith("levels.csv: ")


def test_an_older_result_lacks_the_last_columns_and_a_newer_one_has_more(tmp_path):
    old = "run,condition,train_speed_km_h,channel,component,quantity,rms,level_db\na,a,30,mic,air,sound_pressure,1,85\n"
    older = made_result(tmp_path / "old", files={"levels.csv": old})
    table = read_result(open_result(older)).tables["levels"]
    assert table.column("level_db").to_pylist() == [85.0]
    assert table.column("distance_m").to_pylist() == [None]
    newer = made_result(tmp_path / "new", levels=[level("a", 30.0, 85.0)])
    text = (newer / "levels.csv").read_text().replace("role\n", "role,more\n", 1)
    (newer / "levels.csv").write_text(text.removesuffix("\n") + ",5\n")
    hashed_again(newer)
    table = read_result(open_result(newer)).tables["levels"]
    assert table.column_names[-1] == "role"
    assert table.column("role").to_pylist() == ["receiver"]


def test_tables_without_rows_are_tables(tmp_path):
    found = read_result(open_result(made_result(tmp_path / "r")))
    assert {name: table.num_rows for name, table in found.tables.items()}["levels"] == 0
    assert found.kept.conditions == ()


def test_a_file_without_a_header_is_refused(result):
    (result / "bands.csv").write_bytes(b"")
    hashed_again(result)
    assert refusal(result) == "bands.csv: its first line is no header"


def test_a_real_result_of_the_program_is_read(tmp_path, monkeypatch):
    """What `write` makes and what is read here agree, on a campaign whose numbers are stated in its own file."""
    from tdacoustic.workflows.output import OutputFolder
    from tdacoustic.workflows.run import run
    from tdacoustic.workflows.write import write_run

    path = tmp_path / "campaign" / "campaign.toml"
    path.parent.mkdir()
    text = 'schema = "tdacoustic-campaign/1"\nname = "Stated"\norigin = "printed"\n'
    text += '[meta]\nTrain = "185 042"\nyear = 2019\n'
    text += '[[level]]\ncondition = "60"\ndistance_m = 4.0\nlevel_db = 88.3\norigin = "a paper"\n'
    path.write_text(text, encoding="utf-8")
    monkeypatch.setattr("tdacoustic.reporting.html.render_html", lambda document: "<!doctype html>")
    write_run(run(path, tmp_path / "store"), OutputFolder(tmp_path / "out", path))
    manifest = json.loads((tmp_path / "out/manifest.json").read_text(encoding="utf-8"))
    assert manifest["campaign"]["meta"] == {"Train": "185 042", "year": "2019"}
    kept = read_result(open_result(tmp_path / "out")).kept
    assert (kept.train, kept.identity.year, kept.origin) == ("185 042", 2019, "printed")
    (row,) = kept.conditions
    assert (row.condition, row.level_4m_db, row.level_from, row.level_origin) == ("60", 88.3, "stated", "printed")
