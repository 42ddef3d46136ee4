"""Executors: inline and in processes the same comes out, errors are collected, a killed parent leaves nobody."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path

import pytest
from sample_steps import BROKEN, DYING, DYING_ONCE, FAILING, NUMBERS, TOTAL, log_of

from tdacoustic.errors import AnalysisError
from tdacoustic.steps import Store, execute, lineage, result_of
from tdacoustic.steps.executor import Inline, SuspectedError

HERE = Path(__file__).parent


def tree():
    one, other = NUMBERS.task("one", (1,)), NUMBERS.task("other", (2,))
    return one, other, TOTAL.task("total", ("s",), one=one, other=other)


def test_what_is_there_is_not_computed_again(store):
    one, other, total = tree()
    first = execute([total], store)
    assert first.computed == (one.key, other.key, total.key)
    assert (first.found, first.failed) == ((), {})
    again = execute([total], store)
    assert again.computed == ()
    assert set(again.found) == set(first.computed)


def test_a_run_that_was_stopped_goes_on(store):
    one, other, total = tree()
    execute([one], store)
    assert execute([total], store).computed == (other.key, total.key)


@pytest.mark.parametrize("jobs", [1, 2])
def test_errors_are_collected_what_rests_on_them_fails_and_the_rest_is_done(store, jobs):
    one, other, total = tree()
    bad = FAILING.task("bad", ("a",))
    below = TOTAL.task("below", (), one=bad, other=one)
    lowest = TOTAL.task("lowest", (), one=below, other=one)
    outcome = execute([lowest, total], store, jobs)
    assert set(outcome.computed) == {one.key, other.key, total.key}
    assert set(outcome.failed) == {bad.key, below.key, lowest.key}
    assert {str(error) for error in outcome.failed.values()} == {"no result for ('a',)"}
    assert all(isinstance(error, AnalysisError) for error in outcome.failed.values())


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_defect_propagates(store, jobs):
    with pytest.raises(ZeroDivisionError, match="a defect"):
        execute([BROKEN.task("x", ()), NUMBERS.task("y", (1,))], store, jobs)


def test_a_task_that_kills_its_worker_fails_alone_and_the_others_go_on(store):
    good = [NUMBERS.task(f"good {number}", (number,)) for number in range(4)]
    bad = DYING.task("bad", ())
    below = TOTAL.task("below", (), one=bad, other=good[0])
    worse = DYING.task("worse", (1,))
    outcome = execute([bad, *good[:2], worse, below, *good[2:]], store, 2)
    assert set(outcome.computed) == {task.key for task in good}
    assert set(outcome.failed) == {bad.key, worse.key, below.key}
    for key, error in outcome.failed.items():
        assert isinstance(error, AnalysisError)
        whose = "worse" if key == worse.key else "bad"
        assert str(error).startswith(f"Dying: {whose}: a worker process ended before its work was done, and again")


def test_a_task_whose_worker_dies_of_something_else_is_computed_after_all(store, tmp_path):
    tasks = [DYING_ONCE.task("once", (str(tmp_path / "died"),)), *(NUMBERS.task(str(n), (n,)) for n in range(3))]
    outcome = execute(tasks, store, 2)
    assert (tmp_path / "died").exists()
    assert outcome.failed == {}
    assert set(outcome.computed) == {task.key for task in tasks}


UNGUARDED = """
import sys
sys.path.insert(0, {here!r})
from sample_steps import NUMBERS
from tdacoustic.steps import Store, execute
execute([NUMBERS.task(str(i), (i,)) for i in range(4)], Store({store!r}), 2)
"""


def test_workers_that_cannot_even_start_are_one_clear_error(tmp_path):
    script = tmp_path / "unguarded.py"  # each worker runs it again, and ends there
    script.write_text(UNGUARDED.format(here=str(HERE), store=str(tmp_path / "store")))
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}
    ended = subprocess.run([sys.executable, script], stderr=subprocess.PIPE, env=environment, timeout=60)
    assert ended.returncode == 1
    lines = ended.stderr.decode().splitlines()  # Python itself may warn after the last of ours
    (said,) = [line for line in lines if line.startswith("tdacoustic.errors.ExecutorError: ")]
    assert "worker processes end before they take any work" in said
    assert 'if __name__ == "__main__":' in said


class Suspecting(Inline):
    """Suspects tasks by their labels, so many times each; takes all at once."""

    n_slots = 9

    def __init__(self, **times):
        self.times = times

    def submit(self, task, store):
        if self.times.get(task.label, 0) < 1:
            return super().submit(task, store)
        self.times[task.label] -= 1
        suspect = Future()
        suspect.set_exception(SuspectedError(f"{task.label}: workers ended"))
        return suspect


def test_a_task_that_was_beside_a_deadly_one_is_tried_again_alone(store):
    one, other, total = tree()
    outcome = execute([total], store, Suspecting(one=1, other=1))
    assert outcome.failed == {} and set(outcome.computed) == {one.key, other.key, total.key}


def test_the_deadly_one_among_suspects_fails_with_what_rests_on_it(store):
    one, other, total = tree()
    outcome = execute([total], store, Suspecting(one=9, other=1))
    assert set(outcome.computed) == {other.key}
    assert {key: str(error) for key, error in outcome.failed.items()} == dict.fromkeys(
        (one.key, total.key), "one: workers ended"
    )


def test_a_suspect_without_others_is_not_tried_again(store):
    one, _, total = tree()
    executor = Suspecting(one=9)
    assert set(execute([total], store, executor).failed) == {one.key, total.key}
    assert executor.times == {"one": 8}


def test_a_pool_of_processes_gives_the_same_bytes(tmp_path):
    log = log_of(tmp_path / "a.h5")
    one, other = NUMBERS.task("one", (1,), logs=(log,)), NUMBERS.task("other", (2,), logs=(log,))
    tasks = [TOTAL.task("total", ("s",), one=one, other=other), NUMBERS.task("more", (3,))]
    inline, pool = Store(tmp_path / "inline"), Store(tmp_path / "pool")
    execute(tasks, inline, 1)
    execute(tasks, pool, 2)
    for task in (one, other, *tasks):
        a, b = result_of(task, inline), result_of(task, pool)
        assert [getattr(x, "tobytes", lambda x=x: x)() for x in a] == [
            getattr(x, "tobytes", lambda x=x: x)() for x in b
        ]


@pytest.mark.parametrize("jobs", [1, 2])
def test_progress_is_told(store, jobs):
    heard = []
    *_, total = tree()
    execute([total], store, jobs, lambda *told: heard.append(told))
    assert heard[0] == ("starting", 0.0, 3)
    assert [done for _, done, _ in heard] == sorted(done for _, done, _ in heard)
    assert heard[-1] == ("Total: total", 3.0, 3)
    if jobs == 1:
        assert ("Numbers: one", 0.5, 3) in heard  # told by the step itself
    heard.clear()
    execute([total], store, jobs, lambda *told: heard.append(told))
    assert heard == [("found in the store", 3.0, 3)]


def test_the_lineage_of_a_result(store, tmp_path):
    log = log_of(tmp_path / "a.h5")
    one, other = NUMBERS.task("one", (1,), logs=(log,)), NUMBERS.task("other", (2,))
    total = TOTAL.task("total", ("s",), one=one, other=other)
    execute([total], store)
    found = dict(lineage(total, store))
    assert list(found) == [one.key, other.key, total.key]
    assert found[one.key].inputs == (("logs", f"sha256:{log.sha256}"),)
    assert found[total.key].inputs == (("one", one.key), ("other", other.key))
    assert (found[one.key].step, found[one.key].version, found[one.key].label) == ("numbers", 1, "one")
    assert found[total.key].settings == '{"$tuple":["s"]}'
    assert {"python", "numpy"} <= {name for name, _ in found[total.key].libraries}


POOL = """
import signal
import sys
sys.path.insert(0, {here!r})
from sample_steps import SLOW
from tdacoustic.steps import Store, execute
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job is started deaf to it
    execute([SLOW.task(str(i), ({pids!r}, 60.0 + i)) for i in range(4)], Store({store!r}), 2)
"""


def started_pool(tmp_path):
    """A program with two busy workers; their process numbers."""
    pids = tmp_path / "pids"
    pids.mkdir()
    script = tmp_path / "pool.py"
    script.write_text(POOL.format(here=str(HERE), pids=str(pids), store=str(tmp_path / "store")))
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}
    process = subprocess.Popen([sys.executable, script], stderr=subprocess.PIPE, env=environment)
    deadline = time.monotonic() + 30
    while len(list(pids.iterdir())) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    return process, [int(path.name) for path in pids.iterdir()]


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes through /proc")
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT], ids=["killed", "Ctrl-C"])
def test_workers_end_with_their_parent(tmp_path, blow):
    process, workers = started_pool(tmp_path)
    assert len(workers) == 2
    process.send_signal(blow)
    process.communicate(timeout=10)
    deadline = time.monotonic() + 5
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(alive, workers))
