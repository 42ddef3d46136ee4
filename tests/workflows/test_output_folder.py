"""The output folder: what is refused, what is refreshed, and that it is never half written."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_campaigns import files_of

from tdacoustic.errors import OutputError
from tdacoustic.workflows.output import OutputFolder, default_output

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def subject(tmp_path):
    path = tmp_path / "campaign" / "campaign.toml"
    path.parent.mkdir()
    path.touch()
    return path


def write(path, subject, files, overwrite=False):
    with OutputFolder(path, subject, overwrite) as folder:
        for name, text in files.items():
            folder.write_text(name, text)


def manifest_of(path):
    return json.loads((path / "manifest.json").read_text(encoding="utf-8"))


def test_a_new_folder_holds_the_files_and_a_true_manifest(tmp_path, subject):
    out = tmp_path / "deep" / "out"
    write(out, subject, {"a.csv": "a\n", "sub/b.txt": "ö"})
    held = files_of(out)
    assert set(held) == {"a.csv", "sub/b.txt", "manifest.json"}
    manifest = manifest_of(out)
    assert (manifest["schema"], manifest["complete"]) == ("tdacoustic-manifest/1", True)
    assert manifest["subject"] == "../../campaign/campaign.toml"
    assert manifest["files"] == {name: hashlib.sha256(held[name]).hexdigest() for name in ("a.csv", "sub/b.txt")}
    assert sorted(path.name for path in out.parent.iterdir()) == ["out"]


def test_a_refresh_in_place_takes_stale_files_away_and_leaves_foreign_ones(tmp_path, subject):
    out = tmp_path / "out"
    write(out, subject, {"a.csv": "1", "stale.csv": "1"})
    (out / "note of mine.txt").write_text("keep")
    write(out, subject, {"a.csv": "2", "new.csv": "2"})
    held = files_of(out)
    assert set(held) == {"a.csv", "new.csv", "note of mine.txt", "manifest.json"}
    assert held["a.csv"] == b"2"
    assert set(manifest_of(out)["files"]) == {"a.csv", "new.csv"}


def test_an_empty_folder_is_no_obstacle(tmp_path, subject):
    (tmp_path / "out").mkdir()
    write(tmp_path / "out", subject, {"a.csv": "1"})
    assert manifest_of(tmp_path / "out")["complete"]


@pytest.mark.parametrize(
    ("held", "said"),
    [
        ({"thesis.tex": "x"}, "not empty and not a result of tdacoustic"),
        ({"manifest.json": "{}"}, "not empty and not a result of tdacoustic"),
        ({"manifest.json": "[]"}, "not empty and not a result of tdacoustic"),
        ({"manifest.json": "{"}, "not empty and not a result of tdacoustic"),
        ({"manifest.json": "\xff"}, "not empty and not a result of tdacoustic"),
        (
            {"manifest.json": '{"schema": "tdacoustic-manifest/1", "subject": "../b/campaign.toml"}'},
            r"results of '\.\./b/campaign\.toml', not of '\.\./campaign/campaign\.toml'",
        ),
    ],
    ids=["foreign", "other manifest", "list", "broken", "not UTF-8", "other campaign"],
)
def test_what_is_not_ours_is_refused_and_written_over_when_told(tmp_path, subject, held, said):
    out = tmp_path / "out"
    out.mkdir()
    for name, text in held.items():
        (out / name).write_text(text, encoding="latin-1")
    before = files_of(out)
    with pytest.raises(OutputError, match=said):
        write(out, subject, {"a.csv": "1"})
    assert files_of(out) == before
    write(out, subject, {"a.csv": "1"}, overwrite=True)
    assert manifest_of(out)["complete"]
    assert set(files_of(out)) == {*before, "a.csv", "manifest.json"}


def test_a_file_in_the_way_is_named(tmp_path, subject):
    (tmp_path / "out").touch()
    with pytest.raises(OutputError, match="out: a file is in the way"):
        write(tmp_path / "out", subject, {"a.csv": "1"}, overwrite=True)


@pytest.mark.parametrize("error", [ValueError("x"), KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_an_error_leaves_the_old_result_untouched(tmp_path, subject, error):
    out = tmp_path / "out"
    write(out, subject, {"a.csv": "1"})
    before = files_of(out)
    expected = OutputError if isinstance(error, OSError) else type(error)
    with pytest.raises(expected), OutputFolder(out, subject) as folder:
        folder.write_text("a.csv", "half")
        raise error
    assert files_of(out) == before
    assert not folder.staging.exists()


def test_a_full_disk_is_one_clear_message(tmp_path, subject):
    with pytest.raises(OutputError, match=r"out: cannot be written \(\[Errno 28\] No space left"):  # noqa: SIM117
        with OutputFolder(tmp_path / "out", subject):
            raise OSError(28, "No space left on device")
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_made_is_named(tmp_path, subject):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="out: cannot be written"):
        write(tmp_path / "file" / "out", subject, {"a.csv": "1"})


@pytest.mark.parametrize("spelling", [".", "sub/..", "", "../here"])
def test_the_working_directory_may_be_the_output_folder(tmp_path, subject, spelling, monkeypatch):
    here = tmp_path / "here"
    (here / "sub").mkdir(parents=True)
    (here / "sub").rmdir() if spelling != "sub/.." else None
    monkeypatch.chdir(here)
    write(Path(spelling), subject, {"a.csv": "1"}, overwrite=True)
    assert set(files_of(here)) == {"a.csv", "manifest.json"}
    write(Path(spelling), subject, {"b.csv": "1"})
    assert set(files_of(here)) == {"b.csv", "manifest.json"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["campaign", "here"]


def test_a_manifest_that_points_out_of_its_folder_takes_nothing_away_there(tmp_path, subject):
    out = tmp_path / "out"
    write(out, subject, {"a.csv": "1"})
    victim = tmp_path / "victim.txt"
    victim.touch()
    manifest = manifest_of(out)
    manifest["files"] |= {"../victim.txt": None, str(victim): None, "../campaign/campaign.toml": None}
    (out / "manifest.json").write_text(json.dumps(manifest))
    write(out, subject, {"a.csv": "2"})
    assert victim.exists()
    assert subject.exists()


KILLED_AT = """
import os, pathlib, sys
from tdacoustic.workflows.output import OutputFolder
count, limit = 0, int(sys.argv[3])
replace, unlink = pathlib.Path.replace, pathlib.Path.unlink
def counted(act):
    def counting(*arguments, **options):
        global count
        if count == limit:
            os._exit(9)
        count += 1
        return act(*arguments, **options)
    return counting
pathlib.Path.replace, pathlib.Path.unlink = counted(replace), counted(unlink)
with OutputFolder(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])) as folder:
    for name in ("a.csv", "b.csv", "new.csv"):
        folder.write_text(name, "2")
"""


def test_a_refresh_killed_between_any_two_acts_is_recognised_and_can_be_run_again(tmp_path, subject):
    """Its acts: the mark, three files moved in, a stale one taken away, the manifest."""
    out = tmp_path / "out"
    states = []
    for limit in range(7):
        shutil.rmtree(out, ignore_errors=True)
        write(out, subject, {"a.csv": "1", "b.csv": "1", "stale.csv": "1"})
        before = files_of(out)
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        arguments = [sys.executable, "-c", KILLED_AT, str(out), str(subject), str(limit)]
        code = subprocess.run(arguments, env=environment, check=False).returncode
        assert code == (0 if limit == 6 else 9)
        states.append(manifest_of(out)["complete"])
        if limit == 0:
            assert files_of(out) == before
        write(out, subject, {"a.csv": "2", "b.csv": "2", "new.csv": "2"})
        assert manifest_of(out)["complete"]
        assert {name: text for name, text in files_of(out).items() if name != "manifest.json"} == {
            "a.csv": b"2",
            "b.csv": b"2",
            "new.csv": b"2",
        }
    assert states == [True, False, False, False, False, False, True]


def test_left_overs_of_kills_are_swept_when_they_are_old(tmp_path, subject):
    fresh, stale, other = (
        tmp_path / f".{name}.partial" for name in ("out[1].aaaaaaaa", "out[1].bbbbbbbb", "x.bbbbbbbb")
    )
    for folder in (fresh, stale, other):
        folder.mkdir()
        (folder / "half").touch()
    for folder in (stale, other):
        os.utime(folder, (time.time() - 1e5,) * 2)
    write(tmp_path / "out[1]", subject, {"a.csv": "1"})
    assert sorted(path.name for path in tmp_path.glob(".*")) == sorted([fresh.name, other.name])


@pytest.mark.skipif(os.name != "posix", reason="only there a process can be asked for without harm")
def test_what_a_killed_run_left_is_swept_by_the_next(tmp_path, subject):
    out = tmp_path / "out"
    script = (
        "import os, signal, sys; from pathlib import Path; from tdacoustic.workflows.output import OutputFolder\n"
        "with OutputFolder(Path(sys.argv[1]), Path(sys.argv[2])) as folder:\n"
        "    folder.write_text('a.csv', '1'); os.kill(os.getpid(), signal.SIGKILL)"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run([sys.executable, "-c", script, str(out), str(subject)], env=environment, check=False)
    assert len(list(tmp_path.glob(".out.*.partial"))) == 1
    with OutputFolder(out, subject) as running:  # alive: not swept by another
        write(out, subject, {"a.csv": "2"})
        assert running.staging.is_dir()
        assert len(list(tmp_path.glob(".out.*.partial"))) == 1
        running.write_text("a.csv", "3")
    assert not list(tmp_path.glob(".out.*.partial"))


def test_runs_at_the_same_time_give_one_whole_result(tmp_path, subject):
    out = tmp_path / "out"
    with OutputFolder(out, subject) as one:
        one.write_text("a.csv", "1")
        with OutputFolder(out, subject) as two:
            two.write_text("a.csv", "2")
            two.write_text("b.csv", "2")
        one.write_text("c.csv", "1")
    held = files_of(out)
    assert set(held) == {"a.csv", "c.csv", "manifest.json"}
    assert manifest_of(out)["files"]["a.csv"] == hashlib.sha256(b"1").hexdigest()


def test_another_campaign_that_was_quicker_is_not_written_over(tmp_path, subject):
    with (
        pytest.raises(OutputError, match="the folder holds results of"),
        OutputFolder(tmp_path / "out", subject) as one,
    ):
        one.write_text("a.csv", "1")
        write(tmp_path / "out", subject.with_name("other.toml"), {"a.csv": "2"})
    assert files_of(tmp_path / "out")["a.csv"] == b"2"


def test_the_default_is_named_after_the_folder_of_the_file(tmp_path, monkeypatch):
    (tmp_path / "night ride").mkdir()
    monkeypatch.chdir(tmp_path / "night ride")
    assert default_output(Path("campaign.toml")) == Path("reports/night ride")
