"""A real dask.distributed cluster of separate processes: the same numbers, whatever happens to its workers."""

import os
import pickle
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from sample_steps import BROKEN, DYING, FAILING, LARGE, NUMBERS, SLOW, THREADS, TOTAL, log_of

from tdacoustic.errors import AnalysisError, ExecutorError, MissingFileError, MissingPackageError
from tdacoustic.steps import Cluster, LogFile, Store, cluster_link, cluster_worker, execute, result_of
from tdacoustic.steps.cluster_check import check_workers
from tdacoustic.steps.cluster_link import Link, forget
from tdacoustic.steps.cluster_worker import SharedStore
from tdacoustic.steps.computation import alone_on_one_thread
from tdacoustic.steps.software import own_software

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

from dask_cluster import HERE, ROOT, DaskProcesses, dask_cluster

HIDING = """
import sys
class Hiding:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "tdacoustic":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hiding())
"""
"""What makes an interpreter one without tdacoustic, installed or not."""


@pytest.fixture(scope="module")
def without_tdacoustic(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hiding")
    (folder / "sitecustomize.py").write_text(HIDING)
    return folder


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory, without_tdacoustic):
    """A cluster of two workers, whose scheduler has no tdacoustic and needs none."""
    cluster = DaskProcesses(tmp_path_factory.mktemp("two"))
    try:
        cluster.start_scheduler(paths=(without_tdacoustic,))
        for _ in range(2):
            cluster.start_worker(OMP_NUM_THREADS="2", NUMBA_NUM_THREADS="2")
        cluster.wait_for_workers(2)
        yield cluster
    finally:
        forget(cluster.address)
        cluster.end()


@pytest.fixture
def elsewhere(monkeypatch):
    """A store that lies where no worker sees it: they have nothing under its path."""
    of = SharedStore.of

    def unseen(store):
        shared = of(store)
        return SharedStore(f"{shared.folder}-of-another-machine", shared.sign)

    monkeypatch.setattr(SharedStore, "of", unseen)


def tree(tmp_path):
    log = log_of(tmp_path / "a.h5")
    one, other = NUMBERS.task("one", (1,), logs=(log,)), NUMBERS.task("other", (2,))
    return one, other, TOTAL.task("total", ("s",), one=one, other=other)


def bits(result):
    return [value.tobytes() if isinstance(value, np.ndarray) else value for value in result]


# ---------------------------------------------------------------- the same numbers


def assert_as_inline(tmp_path, address):
    tasks = tree(tmp_path)
    inline, cluster = Store(tmp_path / "inline"), Store(tmp_path / "cluster")
    execute([tasks[-1]], inline)
    outcome = execute([tasks[-1]], cluster, Cluster(address))
    assert outcome.computed[-1] == tasks[-1].key
    assert set(outcome.computed) == {task.key for task in tasks}
    for task in tasks:
        assert bits(cluster.load(task.key)) == bits(inline.load(task.key))
        assert cluster.record(task.key).inputs == inline.record(task.key).inputs
    again = execute([tasks[-1]], cluster, Cluster(address))
    assert (again.computed, set(again.found)) == ((), {task.key for task in tasks})


def test_the_same_bits_through_a_store_that_workers_see(tmp_path, two_workers):
    assert_as_inline(tmp_path, two_workers.address)
    assert list((tmp_path / "cluster" / "signs").iterdir()) == []


def test_the_same_bits_where_results_travel(tmp_path, two_workers, elsewhere):
    assert_as_inline(tmp_path, two_workers.address)
    assert not (tmp_path / "cluster-of-another-machine").exists()


def test_a_worker_computes_on_one_thread(tmp_path, two_workers):
    task = THREADS.task("x", ())
    execute([task], Store(tmp_path / "store"), Cluster(two_workers.address))
    assert result_of(task, Store(tmp_path / "store")) == ("threads", 1, 1)


def test_large_inputs_travel_without_a_word(tmp_path, two_workers, elsewhere, recwarn):
    store = Store(tmp_path / "store")
    large = LARGE.task("large", (2_000_000,))
    total = TOTAL.task("total", (), one=large, other=large)
    execute([total], store, Cluster(two_workers.address))
    assert result_of(total, store) == ((), (1.0 + 2.0) * 2_000_000)
    assert [str(warning.message) for warning in recwarn] == []


def test_a_worker_that_does_not_see_the_store_after_all_gets_its_inputs_sent(tmp_path, two_workers):
    store = Store(tmp_path / "store")
    _, _, total = tree(tmp_path)
    with Cluster(two_workers.address) as cluster:
        shared = cluster._shared_with_all(store)
        assert shared is not None
        shared.remove()  # as for a worker of another machine that joined a moment ago
        execute(total.upstream, store)
        assert cluster.submit(total, store).result(30) == total.key
    assert total.key in store


def test_a_damaged_result_upstream_is_computed_again(tmp_path, two_workers, elsewhere):
    store = Store(tmp_path / "store")
    one, _, total = tree(tmp_path)
    execute([total], store)
    expected = result_of(total, store)
    store._path(total.key).unlink()
    path = store._path(one.key)
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 1  # within an array: the record can be read
    path.write_bytes(whole)
    outcome = execute([total], store, Cluster(two_workers.address))
    assert outcome.failed == {}
    assert result_of(total, store) == expected


# ---------------------------------------------------------------- errors


def test_errors_are_collected_and_the_rest_is_done(tmp_path, two_workers):
    store = Store(tmp_path / "store")
    good, bad = NUMBERS.task("good", (1,)), FAILING.task("bad", ("a",))
    below = TOTAL.task("below", (), one=bad, other=good)
    outcome = execute([below, good], store, Cluster(two_workers.address))
    assert outcome.computed == (good.key,)
    assert {key: str(error) for key, error in outcome.failed.items()} == dict.fromkeys(
        (bad.key, below.key), "no result for ('a',)"
    )


def test_a_defect_propagates_and_says_where(tmp_path, two_workers):
    with pytest.raises(ZeroDivisionError, match="a defect") as caught:
        execute([BROKEN.task("x", ())], Store(tmp_path / "store"), Cluster(two_workers.address))
    assert "sample_steps.py" in caught.value.__notes__[0]
    assert not [link for link in cluster_link._links if link[1] == two_workers.address]  # closed: the program may end


@pytest.mark.parametrize("shared", [True, False], ids=["shared", "travels"])
def test_a_log_that_a_worker_does_not_see_is_named_with_the_worker(tmp_path, two_workers, shared, request):
    if not shared:
        request.getfixturevalue("elsewhere")
    task = NUMBERS.task("x", (1,), logs=(LogFile(tmp_path / "gone.h5", "ab" * 32, 3),))
    outcome = execute([task], Store(tmp_path / "store"), Cluster(two_workers.address))
    error = outcome.failed[task.key]
    assert isinstance(error, MissingFileError)
    assert str(error).startswith(f"{tmp_path / 'gone.h5'}: no such file on the worker tcp://127.0.0.1:")
    assert "named by URL" in str(error)


@pytest.mark.parametrize("content", ["abd", "abcd"], ids=["other content", "other size"])
def test_a_log_that_is_another_one_there_is_refused(tmp_path, two_workers, content):
    log = log_of(tmp_path / "a.h5")
    log.path.write_text(content)
    task = NUMBERS.task("x", (1,), logs=(log,))
    error = execute([task], Store(tmp_path / "store"), Cluster(two_workers.address)).failed[task.key]
    assert isinstance(error, AnalysisError)
    assert f"{log.path}: the worker tcp://127.0.0.1:" in str(error)
    assert f"finds another content there than the client did ({len(content)} bytes, the client's has 3)" in str(error)


@pytest.mark.parametrize("content", ["abc", "abd"])
def test_a_worker_fetches_what_it_does_not_see_and_checks_it(tmp_path, two_workers, elsewhere, content):
    pytest.importorskip("fsspec")
    log = log_of(tmp_path / "source" / "a.h5")
    log.path.write_text(content)
    fetched = LogFile(tmp_path / "fetched" / "a.h5", log.sha256, 3, url=log.path.as_uri())
    task = NUMBERS.task("x", (1,), logs=(fetched,))
    store = Store(tmp_path / "store")
    outcome = execute([task], store, Cluster(two_workers.address))
    if content == "abc":
        assert bits(result_of(task, store)) == bits(NUMBERS.function((1,), (LogFile(log.path, "", 3),)))
    else:
        assert str(outcome.failed[task.key]).startswith(f"{fetched.url}: the worker tcp://127.0.0.1:")


# ---------------------------------------------------------------- nothing twice


CLIENT = """
import sys
sys.path.insert(0, {here!r})
from sample_steps import COUNTED
from tdacoustic.steps import Cluster, Store, execute
if __name__ == "__main__":
    outcome = execute([COUNTED.task("x", ({count!r}, 3.0))], Store({store!r}), Cluster({address!r}))
    assert not outcome.failed
"""


def test_two_programs_that_want_the_same_compute_it_once(tmp_path, two_workers):
    count = tmp_path / "count"
    count.mkdir()
    script = tmp_path / "client.py"
    script.write_text(
        CLIENT.format(here=str(HERE), count=str(count), store=str(tmp_path / "store"), address=two_workers.address)
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    clients = [subprocess.Popen([sys.executable, script], stderr=subprocess.PIPE, env=environment) for _ in range(2)]
    for client in clients:
        _, said = client.communicate(timeout=60)
        assert client.returncode == 0, said.decode()
    assert len(list(count.iterdir())) == 1


# ---------------------------------------------------------------- workers that die


def slow_tasks(pids, count, seconds):
    return [SLOW.task(f"slow {number}", (str(pids), seconds, number)) for number in range(count)]


def kill_one(pids, killed):
    """Kill a worker while it works; tasks leave its process number."""
    end = time.monotonic() + 30.0
    while time.monotonic() < end:
        working = [int(path.name) for path in pids.iterdir() if int(path.name) not in killed]
        if working:
            os.kill(working[-1], signal.SIGKILL)
            killed.append(working[-1])
            return
        time.sleep(0.02)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kills as POSIX does")
def test_two_workers_killed_on_the_way_change_nothing(tmp_path):
    pids, killed = tmp_path / "pids", []
    pids.mkdir()
    store = Store(tmp_path / "store")
    tasks = [*slow_tasks(pids, 9, 0.3), *tree(tmp_path)]

    def kill():
        for moment_s in (0.4, 0.5):
            time.sleep(moment_s)
            kill_one(pids, killed)

    with dask_cluster(tmp_path / "dask", 3) as processes:
        killer = threading.Thread(target=kill)
        killer.start()
        outcome = execute(tasks, store, Cluster(processes.address))
        killer.join()
        assert sorted(worker.pid for worker in processes.workers if worker.poll() is not None) == sorted(killed)
        forget(processes.address)
    assert len(killed) == 2
    assert outcome.failed == {}
    assert set(outcome.computed) == {task.key for task in tasks}
    inline = Store(tmp_path / "inline")
    execute(tasks[-3:], inline)
    for task in tasks[-3:]:
        assert bits(result_of(task, store)) == bits(result_of(task, inline))


def test_a_task_that_kills_its_workers_fails_and_all_others_are_done(tmp_path, monkeypatch):
    """Dask may hold a task guilty that waited beside the one that killed: such a one is tried again, alone."""
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "1")
    store = Store(tmp_path / "store")
    good = [NUMBERS.task(str(number), (number,)) for number in range(3)]
    bad = DYING.task("bad one", ())
    with dask_cluster(tmp_path / "dask", 5) as processes:  # two and two may die
        outcome = execute([bad, *good], store, Cluster(processes.address))
        forget(processes.address)
    assert set(outcome.computed) == {task.key for task in good}
    assert set(outcome.failed) == {bad.key}
    error = outcome.failed[bad.key]
    assert isinstance(error, AnalysisError)
    assert str(error).startswith(
        "Dying: bad one: 2 workers ended while they worked on it, the last one tcp://127.0.0.1:"
    )


def test_without_any_worker_left_it_ends(tmp_path, two_workers, monkeypatch):
    monkeypatch.setattr("tdacoustic.steps.cluster._NO_WORKER_S", 0.2)
    monkeypatch.setattr("tdacoustic.steps.execution._LOOK_S", 0.1)
    monkeypatch.setattr(Link, "n_threads", lambda self: 0)
    with pytest.raises(ExecutorError, match=f"{two_workers.address} has had no worker for"):
        execute(slow_tasks(tmp_path, 1, 1.5), Store(tmp_path / "store"), Cluster(two_workers.address))


# ---------------------------------------------------------------- other software


def test_workers_without_tdacoustic_or_with_another_are_named(tmp_path, without_tdacoustic):
    other, changed = tmp_path / "other", tmp_path / "changed"
    (other / "tdacoustic").mkdir(parents=True)
    (other / "tdacoustic" / "__init__.py").write_text('__version__ = "99.0"\n')
    shutil.copytree(ROOT / "tdacoustic", changed / "tdacoustic", ignore=shutil.ignore_patterns("__pycache__"))
    with (changed / "tdacoustic" / "units.py").open("a") as stream:
        stream.write("# changed\n")
    store = Store(tmp_path / "store")

    def assert_refused(match, **how):
        """A worker of other software among the others is named; it is ended again."""
        before = processes.wait_for_workers(processes.n_alive)
        worker = processes.start_worker(**how)
        (address,) = set(processes.wait_for_workers(processes.n_alive)) - set(before)
        with pytest.raises(ExecutorError, match=match) as caught:
            execute([NUMBERS.task("x", (1,))], store, Cluster(processes.address))
        assert str(caught.value).startswith(f"the worker {address} has ")
        processes.end_worker(worker)

    with dask_cluster(tmp_path / "dask", 1) as processes:
        (good,) = processes.workers
        assert_refused(r"has tdacoustic 99\.0, this is .*; install tdacoustic", paths=(other,))
        assert_refused("has no tdacoustic; install tdacoustic", paths=(without_tdacoustic,))
        assert_refused("the same version of tdacoustic, but other source files", paths=(changed, HERE))

        # one that joins later is found out by the task
        assert execute([NUMBERS.task("x", (1,))], store, Cluster(processes.address)).failed == {}
        processes.start_worker(paths=(without_tdacoustic,))
        processes.wait_for_workers(2)
        processes.end_worker(good)
        (late,) = processes.wait_for_workers(1)
        task = NUMBERS.task("late", (2,))
        error = execute([task], store, Cluster(processes.address)).failed[task.key]
        assert isinstance(error, AnalysisError)
        assert str(error).startswith(f"Numbers: late: the worker {late} has no tdacoustic; install tdacoustic")
        forget(processes.address)


def test_a_task_for_other_software_is_refused_by_the_worker(monkeypatch):
    monkeypatch.setattr(cluster_worker, "_worker", lambda: "tcp://a")
    version, _, system = own_software()
    task = NUMBERS.task("x", (1,))
    for software, words in (
        (("99.0", "", system), rf"has other software than the client: tdacoustic {version}, not 99\.0"),
        ((version, "", system), "the same version of tdacoustic with other source files"),
    ):
        reply = pickle.loads(cluster_worker.Call(task, software, None).to_bytes())
        with pytest.raises(AnalysisError, match=f"the worker tcp://a .*{words}"):
            raise pickle.loads(reply["error"])


def test_a_worker_that_does_not_see_the_store_leaves_it_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_worker, "_worker", lambda: "tcp://a")
    shared = SharedStore.of(Store(tmp_path / "store"))
    task = NUMBERS.task("x", (1,))
    for sign in ("00" * 16, shared.sign):
        call = cluster_worker.Call(task, own_software(), SharedStore(shared.folder, sign))
        reply = pickle.loads(call.to_bytes())
        assert reply["seen"] is (sign == shared.sign)
        assert (task.key in Store(tmp_path / "store")) is (sign == shared.sign)
    for path in (tmp_path / "store" / "signs").iterdir():
        path.write_text("of another store")
    assert not shared.is_seen()


def test_tasks_of_one_process_take_turns():
    inside, most = [], []

    def work():
        with alone_on_one_thread():
            inside.append(1)
            most.append(len(inside))
            time.sleep(0.02)
            inside.pop()

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1] * 4


def test_other_libraries_and_several_threads_are_doubts(monkeypatch):
    class Client:
        def nthreads(self):
            return {"tcp://a": 1, "tcp://b": 4}

        def run(self, function, *arguments, on_error):
            if arguments == ("scipy",):
                return {"tcp://a": function(*arguments), "tcp://b": "0.1"}
            return dict.fromkeys(("tcp://a", "tcp://b"), function(*arguments))

    one, two = check_workers(Client(), "tcp://x")
    assert one.startswith("the worker tcp://b has scipy 0.1, this is ")
    assert one.endswith("its numbers are the same within 1e-9 only")
    assert two.startswith("the worker tcp://b has 4 threads, but computes one task at a time")


# ---------------------------------------------------------------- schedulers


def test_a_scheduler_that_goes_away_is_one_clear_error_and_what_is_done_is_kept(tmp_path):
    store = Store(tmp_path / "store")
    pids = tmp_path / "pids"
    pids.mkdir()
    quick, slow = NUMBERS.task("quick", (1,)), slow_tasks(pids, 2, 60.0)
    with dask_cluster(tmp_path / "dask", 1) as processes:

        def end_scheduler(what, done, total):
            if done >= 1:
                processes.scheduler.kill()

        with pytest.raises(ExecutorError, match=f"the scheduler {processes.address} was lost.*what is done is kept"):
            execute([quick, *slow], store, Cluster(processes.address), end_scheduler)
    assert quick.key in store


def test_a_scheduler_that_is_not_there_is_one_clear_error(store, monkeypatch):
    monkeypatch.setattr("tdacoustic.steps.cluster_link._CONNECT_S", 0.5)
    task = NUMBERS.task("x", (1,))
    with pytest.raises(ExecutorError, match=r"the scheduler tcp://127\.0\.0\.1:9 does not answer"):
        execute([task], store, Cluster("tcp://127.0.0.1:9"))
    with pytest.raises(
        ExecutorError, match=r"the scheduler nonsense://x has no address of dask \(unknown address scheme 'nonsense'"
    ):
        execute([task], store, Cluster("nonsense://x"))
    with pytest.raises(ExecutorError, match=r"the scheduler tls://x:1 asks for certificates.*distributed\.comm\.tls"):
        execute([task], store, Cluster("tls://x:1"))
    with pytest.raises(ExecutorError, match="the address of a scheduler is empty"):
        Cluster(" ")


def test_what_is_in_the_store_needs_no_scheduler(store):
    task = NUMBERS.task("x", (1,))
    execute([task], store)
    assert execute([task], store, Cluster("tcp://127.0.0.1:9")).found == (task.key,)


def test_without_the_package_the_extra_is_named(store, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'tdacoustic\[cluster\]'"):
        execute([NUMBERS.task("x", (1,))], store, Cluster("tcp://127.0.0.1:9"))


def test_a_cluster_is_small_and_travels(two_workers):
    cluster = Cluster(two_workers.address)
    assert cluster.doubts == ()
    data = pickle.dumps(cluster)
    assert len(data) < 200
    assert repr(pickle.loads(data)) == f"Cluster('{two_workers.address}')"


def test_a_lost_connection_is_forgotten(store, two_workers):
    cluster = Cluster(two_workers.address)
    assert cluster.doubts == ()
    with pytest.raises(ExecutorError, match="was lost"):
        cluster.renew()
    task = NUMBERS.task("x", (7,))
    assert execute([task], store, cluster).computed == (task.key,)
