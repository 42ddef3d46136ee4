"""A real dask.distributed scheduler and workers, each a process of its own on 127.0.0.1."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
START_S = 40.0


class DaskProcesses:
    """Processes of one cluster, all ended on leaving.

    Parameters
    ----------
    folder : Path
        For what they write.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.processes = []
        self.workers = []
        self._scheduler_file = self.folder / "scheduler.json"
        self.scheduler = None
        self.address = ""

    def _start(self, module, *arguments, paths=(ROOT, HERE), **environment):
        number = len(self.processes)
        log = (self.folder / f"{number}.log").open("wb")
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", module, "--host", "127.0.0.1", *map(str, arguments)],
            stdout=log,
            stderr=subprocess.STDOUT,
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths)), **environment},
        )
        log.close()
        self.processes.append(process)
        return process

    def start_scheduler(self, *, paths=(ROOT, HERE)):
        file = self._scheduler_file
        self.scheduler = self._start(
            "distributed.cli.dask_scheduler", "--port", 0, "--no-dashboard", "--scheduler-file", file, paths=paths
        )
        end = time.monotonic() + START_S
        while time.monotonic() < end:
            try:
                self.address = json.loads(file.read_text())["address"]
                return self
            except (OSError, ValueError, KeyError):
                time.sleep(0.05)
        raise AssertionError(f"no scheduler: {self.said()}")

    def start_worker(self, *, threads=1, **how):
        number = len(self.processes)
        arguments = ["--nthreads", threads, "--no-nanny", "--no-dashboard", "--name", f"worker-{number}"]
        arguments += ["--local-directory", self.folder / f"local-{number}", "--death-timeout", "60"]
        worker = self._start("distributed.cli.dask_worker", self.address, *arguments, **how)
        self.workers.append(worker)
        return worker

    def wait_for_workers(self, count):
        """Wait until that many are there; their addresses."""
        from distributed import Client

        with Client(self.address, timeout=START_S, set_as_default=False) as client:
            end = time.monotonic() + START_S
            while len(client.nthreads()) != count:
                assert time.monotonic() < end, f"{len(client.nthreads())} of {count} workers: {self.said()}"
                time.sleep(0.05)
            return list(client.nthreads())

    @property
    def n_alive(self):
        return sum(worker.poll() is None for worker in self.workers)

    def end_worker(self, worker):
        worker.kill()
        worker.wait(20)
        self.wait_for_workers(self.n_alive)

    def said(self):
        return "\n".join(path.read_text(errors="replace")[-2000:] for path in sorted(self.folder.glob("*.log")))

    def end(self):
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.wait(20)


@contextmanager
def dask_cluster(folder, n_workers=2, **how):
    """A cluster with workers that have what the tests have."""
    cluster = DaskProcesses(folder)
    try:
        cluster.start_scheduler()
        for _ in range(n_workers):
            cluster.start_worker(**how)
        cluster.wait_for_workers(n_workers)
        yield cluster
    finally:
        cluster.end()
