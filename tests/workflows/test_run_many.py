"""Several campaigns in one call: each into its folder, none stopped by another, none done twice, none left behind."""

import csv
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import odd_work
import pytest
from small_campaigns import files_of, small_campaign
from test_killed import alive_in_session, assert_whole

from tdacoustic.workflows import memory, run_many_workers
from tdacoustic.workflows.output import partial_name
from tdacoustic.workflows.run_many_work import CampaignJob
from tdacoustic.workflows.run_many_workers import LOST, WORKER_BYTES, n_workers, work_through

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("one", "two", "three")
NEEDS_PROC = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes through /proc")


def program(*arguments, **keys):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tdacoustic", "run", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, start_new_session=True, **keys
    )


def called(*arguments, cwd):
    process = program(*arguments, cwd=cwd)
    out, err = process.communicate(timeout=300)
    return process.returncode, out.decode(), err.decode()


def table(folder):
    with (folder / "campaigns.csv").open(encoding="utf-8", newline="") as stream:
        return {row["campaign"]: row for row in csv.DictReader(stream)}


def column(folder, key):
    return [row[key] for row in table(folder).values()]


def keys_in(store):
    return {path.stem for path in (store / "results").rglob("*.npz")}


def campaigns(root):
    """Three campaigns, two of which share a log."""
    for number, name in enumerate(NAMES):
        small_campaign(root / name, seconds=2.0 + 0.25 * number, conditions=("a", "b") if number else ("a",))
    shutil.copy(root / "one" / "a.h5", root / "two" / "a.h5")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Three campaigns, one that is none, and what one call over all of them left."""
    root = tmp_path_factory.mktemp("many")
    campaigns(root / "c")
    (root / "c" / "wrong").mkdir()
    (root / "c" / "wrong" / "campaign.toml").write_text('schema = "tdacoustic-campaign/1"\norigin = "guessed"\n')
    said = called("c/*", "-o", "out", "--store", "store", "--jobs", "2", cwd=root)
    return root, said


@pytest.fixture
def copy(made, tmp_path):
    shutil.copytree(made[0], tmp_path / "copy")
    shutil.rmtree(tmp_path / "copy" / "c" / "wrong")
    return tmp_path / "copy"


def test_a_failing_campaign_is_told_at_the_end_and_stops_no_other(made):
    root, (code, out, err) = made
    assert code == 1
    assert err.count("\n") == 1 and err.startswith("error: c/wrong: ") and "origin" in err
    assert column(root / "out", "status") == ["done", "done", "done", "failed"]
    assert {row["campaign"]: row["n_runs"] for row in table(root / "out").values()} == {
        "c/one": "1", "c/two": "2", "c/three": "2", "c/wrong": "",
    }  # fmt: skip
    assert [line.split()[:2] for line in out.splitlines()[1:5]] == [
        ["c/one", "done"], ["c/three", "done"], ["c/two", "done"], ["c/wrong", "failed"],
    ]  # fmt: skip
    assert "3 done, 1 failed" in out and "2 workers" in out
    for name in NAMES:
        assert_whole(root / "out" / name)
    assert not (root / "out" / "wrong").exists()


def test_the_steps_are_counted_and_shared_logs_are_analysed_for_both(made):
    root, _ = made
    counts = [(int(row["steps_computed"]), int(row["steps_found"])) for row in table(root / "out").values()
              if row["status"] == "done"]  # fmt: skip
    kept = len(keys_in(root / "store"))
    assert all(computed + found > 0 for computed, found in counts)
    assert sum(computed for computed, _ in counts) >= kept  # two workers may have computed one key at one time


@pytest.mark.parametrize("name", NAMES)
def test_each_result_is_that_of_a_run_of_its_own(made, tmp_path, name):
    root, _ = made
    shutil.copytree(root / "c", tmp_path / "c")
    code, _, err = called(f"c/{name}", "-o", f"out/{name}", "--store", "store", cwd=tmp_path)
    assert code == 0, err
    assert files_of(tmp_path / "out" / name) == files_of(root / "out" / name)


def test_a_second_call_assembles_nothing_and_says_so(copy):
    before, kept = files_of(copy / "out"), keys_in(copy / "store")
    before.pop("campaigns.csv")
    times = {path: path.stat().st_mtime_ns for path in (copy / "out").rglob("*/*")}
    code, out, err = called("c/*", "-o", "out", "--store", "store", cwd=copy)
    assert (code, err) == (0, "") and "3 unchanged" in out
    assert column(copy / "out", "status") == ["unchanged"] * 3
    assert column(copy / "out", "steps_computed") == ["0"] * 3
    after = files_of(copy / "out")
    after.pop("campaigns.csv")
    assert after == before and keys_in(copy / "store") == kept
    assert {path: path.stat().st_mtime_ns for path in (copy / "out").rglob("*/*")} == times


def test_what_killed_runs_left_is_taken_away(copy):
    dead = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    machine = partial_name("x").split(".")[2].split("-")[0]
    mark = f"{machine}-{int(dead.stdout)}-abcdef.partial"
    for name in (f".one.{mark}", f".one.{machine}-{os.getpid()}-abcdef.partial", f".mine.{mark}"):
        (copy / "out" / name).mkdir()
    (copy / "out" / f".campaigns.csv.{mark}").touch()
    assert called("c/*", "-o", "out", "--store", "store", cwd=copy)[0] == 0
    assert {path.name for path in (copy / "out").glob(".*")} == {
        f".one.{machine}-{os.getpid()}-abcdef.partial", f".mine.{mark}",
    }  # fmt: skip


def test_again_assembles_from_the_store_alone(copy):
    before = files_of(copy / "out" / "one")
    code, _, _ = called("c/one", "c/two", "-o", "out", "--store", "store", "--again", "--quiet", cwd=copy)
    assert code == 0
    assert column(copy / "out", "status") == ["done"] * 2
    assert column(copy / "out", "steps_computed") == ["0"] * 2
    assert files_of(copy / "out" / "one") == before


def test_one_byte_of_one_log_and_its_steps_alone_are_computed_again(copy):
    log = copy / "c" / "three" / "b.h5"
    content = bytearray(log.read_bytes())
    content[-5] ^= 1  # within the samples, at the end of the file
    log.write_bytes(content)
    kept = keys_in(copy / "store")
    code, _, err = called("c/*", "-o", "out", "--store", "store", cwd=copy)
    assert code == 0, err
    rows = table(copy / "out")
    assert {name: row["status"] for name, row in rows.items()} == {
        "c/one": "unchanged", "c/two": "unchanged", "c/three": "done",
    }  # fmt: skip
    new = keys_in(copy / "store") - kept
    alone = copy / "alone"  # the steps of the changed run by itself, in a store of its own
    text = (copy / "c" / "three" / "campaign.toml").read_text(encoding="utf-8")
    shutil.copytree(copy / "c" / "three", alone / "three")
    head, first, second = text.split("[[run]]")
    assert "b.h5" in second and "b.h5" not in first
    (alone / "three" / "campaign.toml").write_text(f"{head}[[run]]{second}", encoding="utf-8")
    assert called("three", "-o", "out", "--store", "store", "--quiet", cwd=alone)[0] == 0
    assert int(rows["c/three"]["steps_computed"]) == len(new)
    assert new == keys_in(alone / "store")
    assert int(rows["c/three"]["steps_found"]) > 0


def test_a_list_with_one_campaign_is_a_list(copy):
    (copy / "c" / "list.txt").write_text("# one\none\n")
    code, out, _ = called("--list", "c/list.txt", "-o", "listed", "--store", "store", cwd=copy)
    assert code == 0 and "1 done" in out
    assert column(copy / "listed", "out") == ["listed/one"]
    assert_whole(copy / "listed" / "one")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ([], 2, "name a campaign"),
        (["c/one", "c/none"], 1, "c/none: no such file or folder"),
        (["c", "c/one"], 1, "there are campaigns below it"),
        (["c/one", "c/two", "-o", "mine"], 1, "campaigns.csv: is in the way"),
        (["c/one", "c/two", "-o", "file"], 1, "a file is in the way"),
    ],
)
def test_what_is_wrong_is_said_before_anything_is_computed(copy, arguments, code, words):
    (copy / "mine").mkdir()
    (copy / "mine" / "campaigns.csv").write_text("mine,alone\n")
    (copy / "file").touch()
    shutil.rmtree(copy / "store")
    found, out, err = called(*arguments, "--store", "store", cwd=copy)
    assert (found, out) == (code, "") and words in err
    assert not (copy / "store").exists() and not (copy / "reports").exists()


def test_a_foreign_folder_fails_its_campaign_alone(copy):
    (copy / "new" / "one").mkdir(parents=True)
    (copy / "new" / "one" / "thesis.tex").touch()
    code, _, err = called("c/*", "-o", "new", "--store", "store", "--quiet", cwd=copy)
    assert code == 1 and err.startswith("error: c/one: ") and err.count("\n") == 1
    assert sorted(column(copy / "new", "status")) == ["done", "done", "failed"]
    assert set(files_of(copy / "new" / "one")) == {"thesis.tex"}


# ---------------------------------------------------------------- workers


def jobs(*names, folder=Path()):
    return [CampaignJob(index, name, Path(name), folder, Path("store")) for index, name in enumerate(names)]


def test_a_worker_takes_many_campaigns_with_one_thread_a_library(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    found = [report for _, report in work_through(jobs(*"abcdef"), 2, task=odd_work.told)]
    assert len(found) == 6 and len({report.pid for report in found}) <= 2
    assert {report.told.name for report in found} == {"1"}
    assert "OMP_NUM_THREADS" not in os.environ


def test_a_worker_that_has_grown_is_replaced():
    found = [report.pid for _, report in work_through(jobs(*"abc"), 1, task=odd_work.heavy)]
    assert len(set(found)) == 3


def test_a_campaign_that_kills_its_worker_is_tried_once_more_and_fails_alone(tmp_path):
    asked = jobs("a", "deadly", "b", "once", "c", folder=tmp_path)
    found = {job.given: report for job, report in work_through(asked, 2, task=odd_work.deadly)}
    assert {name: report.told.status for name, report in found.items()} == {
        "a": "done", "b": "done", "c": "done", "once": "done", "deadly": "failed",
    }  # fmt: skip
    assert found["deadly"].told.error == LOST


def test_what_a_worker_cannot_tell_is_a_defect_of_that_campaign_alone():
    found = [report for _, report in work_through(jobs("a", "b"), 1, task=odd_work.unspeakable)]
    assert [report.told.status for report in found] == ["failed", "failed"]
    assert all(report.told.error.startswith("a defect: ") for report in found)


@pytest.mark.parametrize(
    ("n", "wanted", "free", "expected"),
    [(5, None, None, 4), (3, None, None, 3), (5, None, 2 * WORKER_BYTES + 1, 2), (5, None, 0, 1), (5, 9, 0, 5)],
)
def test_as_many_workers_as_pay(monkeypatch, n, wanted, free, expected):
    monkeypatch.setattr(run_many_workers.os, "sched_getaffinity", lambda _: set(range(4)), raising=False)
    monkeypatch.setattr(run_many_workers, "free_memory_bytes", lambda: free)
    assert n_workers(n, wanted) == expected


@NEEDS_PROC
def test_memory_is_what_the_system_says():
    """Held against the ``statm`` of the same process, in pages."""
    block = bytearray(os.urandom(1 << 20) * 64)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    assert memory.used_memory_bytes() == pytest.approx(pages * os.sysconf("SC_PAGE_SIZE"), rel=0.1)
    assert memory.peak_memory_bytes() >= len(block)
    assert 0 < memory.free_memory_bytes() <= os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def test_memory_where_nobody_tells(monkeypatch, tmp_path):
    for name in ("_MEMINFO", "_STATUS", "_CGROUP"):
        monkeypatch.setattr(memory, name, tmp_path / "none")
    assert memory.free_memory_bytes() is None
    monkeypatch.setitem(sys.modules, "resource", None)
    assert memory.used_memory_bytes() == 0 and not memory.can_measure_memory()


# ---------------------------------------------------------------- killed, interrupted


def children_of(pid):
    """Worker processes of a process: those that `multiprocessing` spawned, without its tracker."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = stat.read_text().rsplit(")", 1)[1].split()[:2]
            words = (stat.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(parent) == pid and state != "Z" and b"spawn_main" in words:
            found.append(int(stat.parent.name))
    return found


def leaves_ctrl_c(pid):
    """Whether a process ignores Ctrl-C: once a worker does, its parent alone hears it."""
    try:
        ignored = re.search(r"SigIgn:\s*([0-9a-f]+)", Path(f"/proc/{pid}/status").read_text())
    except OSError:
        return False
    return bool(int(ignored[1], 16) >> (signal.SIGINT - 1) & 1)


def until(condition, seconds):
    deadline = time.monotonic() + seconds
    while not (held := condition()) and time.monotonic() < deadline:
        time.sleep(0.02)
    return held


@pytest.fixture
def fresh(made, tmp_path):
    shutil.copytree(made[0] / "c", tmp_path / "c")
    shutil.rmtree(tmp_path / "c" / "wrong")
    return tmp_path


ARGUMENTS = ("c/*", "-o", "out", "--store", "store", "--jobs", "2")


def assert_as_undisturbed(folder, made):
    for name in NAMES:
        assert files_of(folder / "out" / name) == files_of(made[0] / "out" / name)


@NEEDS_PROC
def test_a_worker_that_is_killed_is_survived(fresh, made):
    process = program(*ARGUMENTS, cwd=fresh)
    workers = until(lambda: children_of(process.pid), 60.0)
    time.sleep(random.Random(7).uniform(0.5, 1.5))
    os.kill(workers[0], signal.SIGKILL)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 0, err.decode()
    assert column(fresh / "out", "status") == ["done"] * 3
    assert_as_undisturbed(fresh, made)


@NEEDS_PROC
def test_killed_it_leaves_no_process_and_goes_on(fresh, made):
    process = program(*ARGUMENTS, cwd=fresh)
    assert until(lambda: len(children_of(process.pid)) == 2, 60.0)
    time.sleep(1.0)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert until(lambda: not alive_in_session(process.pid), 20.0)
    for name in NAMES:
        assert_whole(fresh / "out" / name)
    assert called(*ARGUMENTS, cwd=fresh)[0] == 0
    assert_as_undisturbed(fresh, made)


@NEEDS_PROC
@pytest.mark.usefixtures("hears_ctrl_c")
def test_interrupted_it_says_how_far_it_came_and_leaves_no_process(fresh, made):
    process = program(*ARGUMENTS, cwd=fresh)
    assert until(lambda: len([pid for pid in children_of(process.pid) if leaves_ctrl_c(pid)]) == 2, 60.0)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 1 and out == b""
    assert err.decode().startswith("stopped; ") and "of 3 campaigns are settled; run again to go on" in err.decode()
    assert until(lambda: not alive_in_session(process.pid), 20.0)
    assert set(column(fresh / "out", "status")) <= {"open", "done"} and "open" in column(fresh / "out", "status")
    assert called(*ARGUMENTS, cwd=fresh)[0] == 0
    assert_as_undisturbed(fresh, made)


def test_the_table_is_one_of_ours(made):
    """UTF-8, LF, one header row."""
    text = (made[0] / "out" / "campaigns.csv").read_bytes()
    assert b"\r" not in text and text.endswith(b"\n") and not text.startswith(b"\xef\xbb\xbf")
    assert text.splitlines()[0] == (
        b"campaign,name,out,status,n_runs,n_conditions,n_problems,steps_computed,steps_found,error"
    )
