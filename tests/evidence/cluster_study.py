"""A cluster of separate worker processes on this machine: the same numbers, scaling, workers killed on the way.

``python tests/evidence/cluster_study.py`` writes ``cluster_record.json``; some four minutes on two cores that do
nothing else. ``--quick`` takes a small campaign, once, and writes nothing.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1]), *(str(HERE.parent / name) for name in ("", "steps", "workflows"))]

from dask_cluster import DaskProcesses, dask_cluster  # noqa: E402
from sample_steps import NUMBERS  # noqa: E402
from small_campaigns import MIC, MOTOR, small_campaign  # noqa: E402

from tdacoustic.steps import Cluster, Jobs, Store, execute  # noqa: E402
from tdacoustic.steps.cluster_worker import SharedStore  # noqa: E402
from tdacoustic.steps.codec import fingerprint  # noqa: E402
from tdacoustic.workflows.analyze import analyze  # noqa: E402

PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "cluster_record.json"
RERUN = "python tests/evidence/cluster_study.py"


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    return [*sorted((PACKAGE / "steps").glob("*.py")), HERE / "cluster_study.py"]


def sources() -> str:
    """Return their stamp."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what was recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


@contextmanager
def unseen() -> Iterator[None]:
    """Let no worker see the store, as on machines without a shared file system."""
    of = SharedStore.of
    SharedStore.of = lambda store: SharedStore(f"{store.folder.resolve()}-not-there", of(store).sign)  # type: ignore[method-assign,assignment]
    try:
        yield
    finally:
        SharedStore.of = of  # type: ignore[method-assign]


def bits_of(store: Store) -> str:
    """SHA-256 over all results of a store, arrays included; not over how long they took."""
    keys = sorted(path.stem for path in (store.folder / "results").rglob("*.npz"))
    return hashlib.sha256("".join(f"{key} {fingerprint(store.load(key))}\n" for key in keys).encode()).hexdigest()


def seconds_of(store: Store) -> float:
    """What the steps of a store took, as their records say."""
    return sum(store.record(path.stem).wall_s for path in (store.folder / "results").rglob("*.npz"))


class Study:
    """Runs one campaign in many ways.

    Parameters
    ----------
    folder : Path
    n_runs, seconds, repeats : int
        Of the campaign; how often each way is timed, the quickest counts.
    """

    def __init__(self, folder: Path, n_runs: int, seconds: float, repeats: int) -> None:
        self.folder = folder
        self.repeats = repeats
        names = [f"c{number}" for number in range(n_runs)]
        self.campaign = small_campaign(folder / "campaign", seconds, names, MIC + MOTOR)
        self.warm = small_campaign(folder / "warm", 2.0, [f"w{number}" for number in range(8)], MIC + MOTOR)
        self._stores = 0

    def store(self) -> Store:
        self._stores += 1
        return Store(self.folder / f"store-{self._stores}")

    def timed(self, jobs: Jobs) -> dict[str, Any]:
        """Time an analysis into empty stores; its bits are those of each store.

        ``steps_s`` is what the steps took, all together, and ``side_by_side`` that over the whole time: how many ran
        at one time on average. It says what an executor does where other programs take the cores.
        """
        analyze(self.warm, self.store(), jobs)  # libraries are imported, kernels compiled
        times, bits, problems = [], set(), set()
        for _ in range(self.repeats):
            store = self.store()
            start = time.perf_counter()
            analysis = analyze(self.campaign, store, jobs)
            times.append((time.perf_counter() - start, seconds_of(store)))
            bits.add(bits_of(store))
            problems.add(len(analysis.problems))
        (one,), (count,), best = bits, problems, min(times)
        return {
            "wall_s": round(best[0], 2),
            "steps_s": round(best[1], 2),
            "side_by_side": round(best[1] / best[0], 2),
            "problems": count,
            "bits": one,
        }

    def ms_per_task(self, jobs: Jobs, count: int = 200) -> float:
        """What a task costs that computes next to nothing."""
        tasks = [NUMBERS.task(str(number), (number,)) for number in range(count)]
        execute([NUMBERS.task("warm", (1_000_000 + number,)) for number in range(8)], self.store(), jobs)
        times = []
        for _ in range(self.repeats):
            store = self.store()
            start = time.perf_counter()
            execute(tasks, store, jobs)
            times.append(time.perf_counter() - start)
        return round(1e3 * min(times) / count, 2)

    def killed(self) -> dict[str, Any]:
        """Kill two of four workers while the campaign is analysed."""
        store = self.store()
        with dask_cluster(self.folder / "killed", 4) as cluster:
            analyze(self.warm, self.store(), Cluster(cluster.address))
            killer = threading.Thread(target=_kill_two, args=(cluster, store))
            killer.start()
            analysis = analyze(self.campaign, store, Cluster(cluster.address))
            killer.join()
            dead = sum(worker.poll() == -signal.SIGKILL for worker in cluster.workers)
        return {"workers": 4, "killed": dead, "problems": len(analysis.problems), "bits": bits_of(store)}


def _kill_two(cluster: DaskProcesses, store: Store) -> None:
    """Kill a worker when the first results are there, and another one a little later."""
    for worker, n_results in zip(cluster.workers, (2, 6), strict=False):
        while len(list(store.folder.rglob("*.npz"))) < n_results:
            time.sleep(0.01)
        worker.kill()


def load() -> float | None:
    """Return how many processes wanted a core in the last minute, where the system says so."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def measure(study: Study) -> dict[str, Any]:
    """Return all figures."""
    ways: dict[str, Any] = {"1 process": study.timed(1), "2 processes": study.timed(2)}
    overhead = {"1 process": study.ms_per_task(1), "2 processes": study.ms_per_task(2)}
    for n_workers in (1, 2):
        with dask_cluster(study.folder / f"dask-{n_workers}", n_workers) as cluster:
            name = f"cluster, {n_workers} worker{'s' if n_workers > 1 else ''}"
            both: tuple[tuple[str, Callable[[], Any]], ...] = ((name, _nothing), (f"{name}, results travel", unseen))
            for way, context in both:
                with context():
                    ways[way] = study.timed(Cluster(cluster.address))
                    overhead[way] = study.ms_per_task(Cluster(cluster.address))
    return {"ways": ways, "ms_per_empty_task": overhead, "killed": study.killed()}


@contextmanager
def _nothing() -> Iterator[None]:
    yield


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    before, busy = sources(), load()
    n_runs, seconds, repeats = (6, 3.0, 1) if arguments.quick else (24, 120.0, 3)
    with tempfile.TemporaryDirectory() as name:
        found = measure(Study(Path(name), n_runs, seconds, repeats))

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    libraries = ("numpy", "scipy", "numba", "dask", "distributed")
    whole = {
        "schema": "tdacoustic-cluster-study/1",
        "sources_sha256": before,
        "versions": {"python": platform.python_version(), **{library: version(library) for library in libraries}},
        "machine": {"system": platform.system(), "machine": platform.machine(), "cores": os.cpu_count()},
        "load": {"before": busy, "after": load()},
        "campaign": {"runs": n_runs, "seconds": seconds, "repeats": repeats},
        **found,
    }
    if not arguments.quick:
        if sources() != before:
            sys.exit("the sources changed during the run: nothing is written")
        whole["commit"] = git("rev-parse", "HEAD")
        whole["modified"] = bool(git("status", "--porcelain", "--", *map(str, source_files())))
        RECORD.write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(whole, indent=1))


if __name__ == "__main__":
    main()
