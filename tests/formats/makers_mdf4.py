"""Logs by asammdf: plain, packed, in lists, of several versions, with integers and a conversion."""

from pathlib import Path

import numpy as np
from log_makers import RATE_HZ, Made, N, signals

NAMES = ["motor", "mic"]


def times(start=0.0):
    return start + np.arange(N) / RATE_HZ


def write(path, version="4.10", compression=0, fragment=None, start=0.0):
    from asammdf import MDF, Signal

    x = signals()
    with MDF(version=version) as log:
        if fragment:
            log.configure(write_fragment_size=fragment)
        units = ("m/s^2", "Pa")
        log.append([Signal(v, times(start), name=n, unit=u) for v, n, u in zip(x, NAMES, units, strict=True)])
        log.save(path, compression=compression, overwrite=True)
    return Made(path, NAMES, x, 0.0)


def make_plain(folder: Path) -> Made:
    return write(folder / "a.mf4")


def make_packed(folder: Path) -> Made:
    return write(folder / "b.mf4", compression=1)


def make_transposed_in_a_list(folder: Path) -> Made:
    return write(folder / "c.mf4", compression=2, fragment=4096)


def make_list(folder: Path) -> Made:
    return write(folder / "d.mf4", "4.00", fragment=5000)


def make_newer(folder: Path) -> Made:
    return write(folder / "e.mf4", "4.20", compression=2)


def make_integers(folder: Path) -> Made:
    from asammdf import MDF, Signal

    x = signals()
    with MDF(version="4.11") as log:
        made = [
            Signal(np.round(v / 2e-5).astype("i2"), times(), name=n, unit="Pa", conversion={"a": 2e-5, "b": 0.0})
            for v, n in zip(x, NAMES, strict=True)
        ]
        log.append(made)
        log.save(folder / "f.mf4", overwrite=True)
    return Made(folder / "f.mf4", NAMES, x, 1e-5)


MAKERS = [make_plain, make_packed, make_transposed_in_a_list, make_list, make_newer, make_integers]
