"""One recording, written to every format by the format's own library, is read back the same.

The library is the one whose files people have: soundfile, h5py, pandas, pyuff, npTDMS, scipy, asammdf. ATFX has none in
Python: its file is the one of `makers_atfx`, text and numpy alone. Dewesoft files are only written by Dewesoft.
"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from tdacoustic.formats import FORMATS, scan

N = 2000
NAMES, UNITS = ["motor z", "mic"], ["m/s^2", "Pa"]
QUANTITIES = ["acceleration", "sound_pressure"]
START = datetime(2026, 3, 1, 10, 20, 30, tzinfo=UTC)
RATES = (51200.0, 8192.0)


def recording(rate: float) -> np.ndarray:
    """Two channels of very different size: an acceleration of some 60 m/s², a pressure of some 0.3 Pa."""
    t = np.arange(N) / rate
    noise = np.random.default_rng(7).normal(size=(2, N))
    return (
        np.array([60.0 * np.sin(2 * np.pi * 437.0 * t), 0.3 * np.cos(2 * np.pi * 1250.0 * t)]) + [[3.0], [0.01]] * noise
    )


@dataclass(frozen=True)
class Written:
    """A file, and what of the recording its format can hold.

    Parameters
    ----------
    path : Path
    relative : float
        Rounding of a sample, relative to the largest of its channel.
    names, units, start : bool
        Whether the format holds them.
    full_scale : float or None
        What a value of 1 stands for, where the format holds fractions alone.
    start_to_s : float
        To what the format keeps the start.
    """

    path: Path
    relative: float
    names: bool = True
    units: bool = True
    start: bool = True
    full_scale: float | None = None
    start_to_s: float = 1e-6


def audio(suffix: str, relative: float, **options) -> Callable[[Path, np.ndarray, float], Written]:
    def write(folder: Path, x: np.ndarray, rate: float) -> Written:
        import soundfile

        soundfile.write(folder / f"a{suffix}", x.T / 100.0, int(rate), **options)
        return Written(
            folder / f"a{suffix}", relative * 100.0 / np.abs(x).max(axis=1).min(), False, False, False, 100.0
        )

    return write


def hdf5(folder: Path, x: np.ndarray, rate: float) -> Written:
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.attrs["schema"], file.attrs["start_time"] = "tdacoustic-log/1", START.isoformat()
        for name, unit, row in zip(NAMES, UNITS, x, strict=True):
            file.create_dataset(name, data=row).attrs.update(unit=unit, sample_rate_hz=rate)
    return Written(folder / "a.h5", 0.0)


def csv(folder: Path, x: np.ndarray, rate: float) -> Written:
    import pandas as pd

    frame = pd.DataFrame({"Time [s]": np.arange(N) / rate})
    for name, unit, row in zip(NAMES, UNITS, x, strict=True):
        frame[f"{name} [{unit}]"] = row
    text = frame.to_csv(index=False, lineterminator="\n")
    (folder / "a.csv").write_text(f"Start time: {START.isoformat()}\n{text}", encoding="utf-8")
    return Written(folder / "a.csv", 0.0)


def german_csv(folder: Path, x: np.ndarray, rate: float) -> Written:
    import pandas as pd

    frame = pd.DataFrame({"Zeit [s]": np.arange(N) / rate})
    for name, unit, row in zip(NAMES, UNITS, x, strict=True):
        frame[f"{name} [{unit}]"] = row
    frame.to_csv(folder / "b.csv", index=False, sep=";", decimal=",", float_format="%.9g", encoding="latin-1")
    return Written(folder / "b.csv", 1e-8, start=False)


def uff(binary: bool, single: bool) -> Callable[[Path, np.ndarray, float], Written]:
    def write(folder: Path, x: np.ndarray, rate: float) -> Written:
        import pyuff

        path = folder / f"{'b' if binary else 'a'}{single:d}.uff"
        file = pyuff.UFF(str(path))
        for name, unit, kind, row in zip(NAMES, UNITS, (12, 15), x, strict=True):
            record = pyuff.prepare_58(
                binary=int(binary), func_type=1, rsp_ent_name=name, rsp_node=1, rsp_dir=3, ref_node=1, ref_dir=1,
                ord_data_type=2 if single else 4, abscissa_spacing=1, abscissa_spec_data_type=17,
                abscissa_axis_units_lab="s", ordinate_spec_data_type=kind,
                ordinate_axis_units_lab=unit, orddenom_spec_data_type=0,
                z_axis_spec_data_type=0, data=row, x=np.arange(N) / rate, id3=START.strftime("%d-%b-%y %H:%M:%S"),
            )  # fmt: skip
            file.write_sets(record, "add")
        # pyuff prints 12 digits of double precision and 6 of single; binary of "single" it writes as double (its #91)
        return Written(path, 0.0 if binary else (1e-5 if single else 1e-10), start_to_s=1.0)

    return write


def tdms(folder: Path, x: np.ndarray, rate: float) -> Written:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(folder / "a.tdms")) as writer:
        start = np.datetime64(START.replace(tzinfo=None), "us")
        for name, unit, row in zip(NAMES, UNITS, x, strict=True):
            properties = {"wf_increment": 1.0 / rate, "wf_start_time": start, "unit_string": unit}
            writer.write_segment([ChannelObject("log", name, row, properties)])
    return Written(folder / "a.tdms", 0.0)


def matlab(**options) -> Callable[[Path, np.ndarray, float], Written]:
    def write(folder: Path, x: np.ndarray, rate: float) -> Written:
        from scipy.io import savemat

        savemat(folder / "a.mat", {"motor_z": x[0], "mic": x[1], "fs": rate}, **options)
        return Written(folder / "a.mat", 0.0, False, False, False)

    return write


def matlab73(folder: Path, x: np.ndarray, rate: float) -> Written:
    from makers_matlab import level73, matlab_dataset

    def fill(file):
        for name, row in (("motor_z", x[0]), ("mic", x[1]), ("fs", np.array([rate]))):
            matlab_dataset(file, name, row[None])

    return Written(level73(folder / "b.mat", fill), 0.0, False, False, False)


def mdf4(**options) -> Callable[[Path, np.ndarray, float], Written]:
    def write(folder: Path, x: np.ndarray, rate: float) -> Written:
        from asammdf import MDF, Signal

        t = np.arange(N) / rate
        with MDF(version="4.10") as log:
            log.start_time = START
            log.append([Signal(row, t, name=n, unit=u) for row, n, u in zip(x, NAMES, UNITS, strict=True)])
            log.save(folder / "a.mf4", overwrite=True, **options)
        return Written(folder / "a.mf4", 0.0)

    return write


def atfx(folder: Path, x: np.ndarray, rate: float) -> Written:
    from makers_atfx import Atfx, numbers

    made = Atfx()
    matrix = made.matrix(N, START.strftime("%Y%m%d%H%M%S"))
    made.time(matrix, made.unit("s", time=True), step=1.0 / rate)
    for name, unit, row in zip(NAMES, UNITS, x, strict=True):
        made.column(matrix, name, made.unit(unit), made.array("values", f"<A_FLOAT64>{numbers(row)}</A_FLOAT64>"))
    return Written(made.write(folder / "a.atfx"), 0.0)


WRITERS: dict[str, tuple[str, Callable[[Path, np.ndarray, float], Written]]] = {
    "WAV 24 bits": ("audio", audio(".wav", 2.0**-23, subtype="PCM_24")),
    "WAV float": ("audio", audio(".wav", 2.0**-24, subtype="FLOAT")),
    "WAV double": ("audio", audio(".wav", 1e-15, subtype="DOUBLE")),
    "RF64": ("audio", audio(".rf64", 2.0**-31, subtype="PCM_32", format="RF64")),
    "FLAC 24 bits": ("audio", audio(".flac", 2.0**-23, subtype="PCM_24")),
    "HDF5": ("hdf5", hdf5),
    "CSV": ("delimited", csv),
    "CSV, German": ("delimited", german_csv),
    "UFF 58, double": ("uff58", uff(False, False)),
    "UFF 58, single": ("uff58", uff(False, True)),
    "UFF 58b, double": ("uff58", uff(True, False)),
    "TDMS": ("tdms", tdms),
    "MATLAB 5": ("matlab", matlab()),
    "MATLAB 5, packed": ("matlab", matlab(do_compression=True)),
    "MATLAB 4": ("matlab", matlab(format="4")),
    "MATLAB 7.3": ("matlab", matlab73),
    "MDF 4": ("mdf4", mdf4()),
    "MDF 4, packed": ("mdf4", mdf4(compression=2)),
    "ATFX": ("atfx", atfx),
}


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("kind", list(WRITERS))
def test_one_recording_in_every_format(tmp_path, kind, rate):
    name, write = WRITERS[kind]
    if name == "mdf4":
        pytest.importorskip("asammdf")
    x = recording(rate)
    written = write(tmp_path, x, rate)
    log = scan(written.path)
    assert log.format == name
    assert len(log.channels) == 2
    order = [0, 1]
    if written.names:
        order = [NAMES.index(channel.name) for channel in log.channels]
    elif name == "matlab":
        order = [["motor_z", "mic"].index(channel.name) for channel in log.channels]
    for column, channel in enumerate(log.channels):
        row = x[order[column]]
        assert channel.raster.sample_rate_hz == rate  # exactly, whatever the format rounds
        assert channel.raster.n_samples == N
        values = np.concatenate([b[0] for b in log.reader.blocks([column], 0, N, 333)]) * (written.full_scale or 1.0)
        np.testing.assert_allclose(values, row, rtol=0.0, atol=max(written.relative, 4e-16) * np.abs(row).max())
        if written.units:
            assert (channel.unit, channel.quantity) == (UNITS[order[column]], QUANTITIES[order[column]])
        else:
            assert channel.unit is None
        assert channel.full_scale == (None if written.full_scale is None else 1.0) or name == "matlab"
    if written.start:
        assert log.start_time is not None
        began = datetime.fromisoformat(log.start_time)
        began = began if began.tzinfo else began.replace(tzinfo=UTC)
        first = began.timestamp() + min(channel.raster.start_s for channel in log.channels)
        assert abs(first - START.timestamp()) <= written.start_to_s
    else:
        assert log.start_time is None


def test_every_format_with_a_writer_is_crossed():
    assert {name for name, _ in WRITERS.values()} >= {row.name for row in FORMATS} - {"dewesoft"}
