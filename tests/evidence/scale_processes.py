"""The program as the study of scale sees it from outside: started, watched, killed; processes are seen in /proc."""

from __future__ import annotations

import os
import random
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def start(folder: Path, *options: object) -> subprocess.Popen[bytes]:
    """Start a run over all campaigns below ``campaigns`` in a folder, in a session of its own."""
    words = ["run", "campaigns/*", "-o", "out", "--store", "store", "--quiet", *map(str, options)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-m", "tdacoustic", *words],
        cwd=folder, env=environment, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip


def processes_of(session: int) -> dict[int, str]:
    """Return the living processes of a session, and what each is: ``parent``, ``worker`` or ``other``."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, its_session = stat.read_text().rsplit(")", 1)[1].split()[:4]
            words = (stat.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(its_session) == session and state != "Z":
            pid = int(stat.parent.name)
            found[pid] = "parent" if pid == session else "worker" if b"spawn_main" in words else "other"
    return found


@dataclass
class Watched:
    """A run that ended: how long it took, and the most memory that its processes held."""

    wall_s: float
    code: int
    said: str
    peak_mib: dict[str, list[int]] = field(default_factory=dict)


def watched(folder: Path, *options: object) -> Watched:
    """Run to the end; each process's peak is what the system keeps of it (``VmHWM``), asked every 50 ms."""
    peaks: dict[int, tuple[str, int]] = {}
    began = time.monotonic()
    process = start(folder, *options)
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(0.05):
            for pid, kind in processes_of(process.pid).items():
                try:
                    text = Path(f"/proc/{pid}/status").read_text()
                except OSError:
                    continue
                found = re.search(r"VmHWM:\s+(\d+) kB", text)
                if found:
                    peaks[pid] = kind, int(found[1]) // 1024

    watcher = threading.Thread(target=look)
    watcher.start()
    _, said = process.communicate()
    took_s = time.monotonic() - began
    ended.set()
    watcher.join()
    by_kind: dict[str, list[int]] = {}
    for kind, mib in peaks.values():
        by_kind.setdefault(kind, []).append(mib)
    return Watched(took_s, process.returncode, said.decode(), {kind: sorted(mib) for kind, mib in by_kind.items()})


def kill_at_random(folder: Path, kills: int, mean_s: float, jobs: int, seed: int) -> dict[str, int]:
    """Kill the program or one of its workers until it was done so often, going on each time; return who was killed.

    Where it comes to its end between, it is started again to assemble everything anew.
    """
    rng = random.Random(seed)
    told = {"parent": 0, "worker": 0, "starts": 0, "ends between": 0}
    options: Sequence[object] = ("--jobs", jobs)
    process = start(folder, *options)
    told["starts"] += 1
    while told["parent"] + told["worker"] < kills:
        try:
            process.wait(rng.expovariate(1.0 / mean_s))
        except subprocess.TimeoutExpired:
            kind = _kill_one(process, rng)
            if kind is None:
                continue
            told[kind] += 1
            if kind == "worker":
                continue
        else:
            told["ends between"] += 1
            options = ("--jobs", jobs, "--again")
        _ended(process)
        process = start(folder, *options)
        told["starts"] += 1
    process.send_signal(signal.SIGKILL)
    _ended(process)
    return told


def _kill_one(process: subprocess.Popen[bytes], rng: random.Random) -> str | None:
    held = processes_of(process.pid)
    workers = sorted(pid for pid, kind in held.items() if kind == "worker")
    victim = rng.choice(workers) if workers and rng.random() < 0.5 else process.pid
    if process.poll() is not None:
        return None
    try:
        os.kill(victim, signal.SIGKILL)
    except ProcessLookupError:
        return None
    return "parent" if victim == process.pid else "worker"


def _ended(process: subprocess.Popen[bytes]) -> None:
    """Wait until a program that ended has left no process behind."""
    process.communicate()
    deadline = time.monotonic() + 30.0
    while processes_of(process.pid):
        if time.monotonic() > deadline:
            raise RuntimeError(f"these outlive their parent: {processes_of(process.pid)}")
        time.sleep(0.05)
