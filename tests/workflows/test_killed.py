"""A run that is killed at any moment leaves nothing half written, goes on when run again, and ends the same.

``TDACOUSTIC_KILLS=20`` kills it 20 times, and half as often with a fleet, where it calibrates and predicts too; the
moments are drawn with a fixed seed over the time one run takes.
"""

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_campaigns import files_of, fleet_campaign, small_campaign

KILLS = int(os.environ.get("TDACOUSTIC_KILLS", "4"))
ROOT = Path(__file__).resolve().parents[2]


def command(campaign, folder, *options):
    arguments = ["run", campaign, "--store", folder / "store", "-o", folder / "result", "--quiet", *options]
    return [sys.executable, "-m", "tdacoustic", *map(str, arguments)]


def started(*arguments):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command(*arguments), stderr=subprocess.PIPE, env=environment, start_new_session=True)


def finished(*arguments):
    process = started(*arguments)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 0, said.decode()


def killed(moment_s, *arguments):
    """Kill the program at a moment of its life; return its session's number (its own process number)."""
    process = started(*arguments)
    try:
        process.wait(moment_s)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.pid


def assert_whole(result):
    """No folder, or one whose manifest is complete and true, or (a refresh) one that says that it is incomplete."""
    if not result.exists():
        return
    manifest = json.loads((result / "manifest.json").read_text(encoding="utf-8"))
    if not manifest["complete"]:
        return
    held = files_of(result)
    assert set(held) == {*manifest["files"], "manifest.json"}
    for name, sha256 in manifest["files"].items():
        assert hashlib.sha256(held[name]).hexdigest() == sha256, name


def alive_in_session(session):
    """Process numbers of a session that still run."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, its_session = stat.read_text().rsplit(")", 1)[1].split()[:4]
        except OSError:
            continue
        if int(its_session) == session and state != "Z":
            found.append(int(stat.parent.name))
    return found


def undisturbed(campaign, folder):
    """A campaign, its result when nothing disturbs, and how long that takes."""
    start = time.monotonic()
    finished(campaign, folder)
    took_s = time.monotonic() - start
    return campaign, files_of(folder / "result"), took_s


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    campaign = small_campaign(tmp_path_factory.mktemp("campaign"), seconds=4.0)
    found = undisturbed(campaign, tmp_path_factory.mktemp("undisturbed"))
    assert len(found[1]) >= 9
    return found


@pytest.fixture(scope="module")
def reference_with_fleet(tmp_path_factory):
    campaign = fleet_campaign(tmp_path_factory.mktemp("campaign"))
    found = undisturbed(campaign, tmp_path_factory.mktemp("undisturbed"))
    assert {"levels.csv", "calibration.json", "speed_sweep.csv"} < set(found[1])
    return found


def assert_killed_and_run_again_it_is_the_same(reference, folder, number, kills):
    campaign, expected, took_s = reference
    moment_s = took_s * random.Random(1000 + number).uniform(number, number + 1) / kills
    killed(moment_s, campaign, folder)
    assert_whole(folder / "result")
    finished(campaign, folder)
    assert files_of(folder / "result") == expected


@pytest.mark.parametrize("number", range(KILLS))
def test_killed_and_run_again_the_result_is_the_same(reference, tmp_path, number):
    assert_killed_and_run_again_it_is_the_same(reference, tmp_path, number, KILLS)


@pytest.mark.parametrize("number", range(KILLS // 2))
def test_killed_and_run_again_with_a_fleet_the_result_is_the_same(reference_with_fleet, tmp_path, number):
    assert_killed_and_run_again_it_is_the_same(reference_with_fleet, tmp_path, number, KILLS // 2)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes through /proc")
def test_killed_with_worker_processes_none_stays_behind(reference, tmp_path):
    campaign, _, _ = reference
    process = started(campaign, tmp_path, "--jobs", "2")
    deadline = time.monotonic() + 20.0
    while len(alive_in_session(process.pid)) < 4 and time.monotonic() < deadline:  # itself, a tracker, two workers
        time.sleep(0.02)
    assert len(alive_in_session(process.pid)) >= 4
    process.send_signal(signal.SIGKILL)
    process.communicate()  # also waits until nobody holds its stderr any more
    deadline = time.monotonic() + 5.0
    while alive_in_session(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert alive_in_session(process.pid) == []
    assert_whole(tmp_path / "result")
