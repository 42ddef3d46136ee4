"""Small steps to run, importable by a spawned worker."""

import os
import time
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

import numpy as np

from tdacoustic.errors import AnalysisError
from tdacoustic.steps import Step, log_file
from tdacoustic.steps.progress import tell_progress


def numbers(settings, logs=()):
    """Read the logs, and make numbers that depend on them and on the settings."""
    seed = settings[0] + sum(len(log.path.read_bytes()) for log in logs)
    values = np.random.default_rng(seed).standard_normal((64, 64))
    tell_progress(0.5)
    return ("numbers", values @ values.T, np.linalg.svd(values, compute_uv=False))


def total(settings, one, other):
    return (settings, float(one[1].sum() + other[2].sum()))


def failing(settings, **inputs):
    raise AnalysisError(f"no result for {settings}")


def broken(settings):
    raise ZeroDivisionError("a defect")


def dying(settings):
    os._exit(3)


def dying_once(settings):
    try:
        Path(settings[0]).touch(exist_ok=False)
    except FileExistsError:
        return settings
    os._exit(3)


def slow(settings):
    (Path(settings[0]) / str(os.getpid())).touch()
    time.sleep(settings[1])
    return settings


def counted(settings):
    (Path(settings[0]) / uuid4().hex).touch()
    time.sleep(settings[1])
    return settings


def large(settings):
    return ("large", np.full(settings[0], 1.0), np.full(settings[0], 2.0))


def threads(settings):
    """Threads that numba and the libraries of linear algebra would use here."""
    import numba
    from threadpoolctl import threadpool_info

    np.ones((8, 8)) @ np.ones((8, 8))
    return ("threads", numba.get_num_threads(), max(one["num_threads"] for one in threadpool_info()))


THREADS = Step("threads", 1, threads, "Threads")
COUNTED = Step("counted", 1, counted, "Counted")
LARGE = Step("large", 1, large, "Large")
NUMBERS = Step("numbers", 1, numbers, "Numbers")
TOTAL = Step("total", 1, total, "Total")
FAILING = Step("failing", 1, failing, "Failing")
BROKEN = Step("broken", 1, broken, "Broken")
DYING = Step("dying", 1, dying, "Dying")
DYING_ONCE = Step("dying-once", 1, dying_once, "Dying once")
SLOW = Step("slow", 1, slow, "Slow")


def log_of(path, text="abc"):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return log_file(path)


def raised(step, **changes):
    return replace(step, **changes)
