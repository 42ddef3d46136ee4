"""A study of a fleet by the command: in two processes, killed and gone on with, and the same in the end."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from plain_fleets import plain_fleet
from small_campaigns import files_of

ROOT = Path(__file__).resolve().parents[2]
BATCHES = 5
STUDY = f"""
[[sweep]]
name = "Spread"
sampling = "latin_hypercube"
points = {100 * BATCHES}
conditions = ["1"]
[sweep.parameters]
"gear_dynamics.mesh_damping_ratio" = {{ from = 0.02, to = 0.2, scale = "log" }}
"masuda.constant_db" = {{ from = 18, to = 26 }}
"""


def started(fleet, folder, *options):
    arguments = ["predict", fleet, "--store", folder / "store", "-o", folder / "result", "--quiet", *options]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tdacoustic", *map(str, arguments)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, env=environment, start_new_session=True)


def finished(process):
    _, said = process.communicate(timeout=200)
    assert process.returncode == 0, said.decode()


def batches_of(folder):
    """Files of batches in a store by name, with the time each was written."""
    found = {}
    for path in (folder / "store").glob("results/*/*.npz"):
        if b'"step":"design-sweep"' in path.read_bytes():
            found[path.name] = path.stat().st_mtime_ns
    return found


def test_a_killed_study_goes_on_where_it_was_and_ends_the_same(tmp_path):
    fleet = tmp_path / "fleet" / "fleet.toml"
    fleet.parent.mkdir()
    fleet.write_text(plain_fleet("reference-drive").read_text(encoding="utf-8") + STUDY, encoding="utf-8")
    finished(started(fleet, tmp_path / "whole", "--jobs", "1"))
    assert len(batches_of(tmp_path / "whole")) == BATCHES

    process = started(fleet, tmp_path / "killed", "--jobs", "2")
    deadline = time.monotonic() + 120.0
    while not batches_of(tmp_path / "killed") and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    before = batches_of(tmp_path / "killed")
    assert 1 <= len(before) < BATCHES
    assert not (tmp_path / "killed" / "result").exists()

    finished(started(fleet, tmp_path / "killed", "--jobs", "2"))
    after = batches_of(tmp_path / "killed")
    assert after.keys() == batches_of(tmp_path / "whole").keys()
    assert {name: after[name] for name in before} == before  # none of them was computed again
    assert files_of(tmp_path / "killed" / "result") == files_of(tmp_path / "whole" / "result")
