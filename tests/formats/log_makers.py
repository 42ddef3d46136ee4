"""Makers of small logs: soundfile, struct, h5py, plain text and pyuff, never the readers under test."""

import importlib
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

RATE_HZ = 8192.0
N = 1003


@dataclass
class Made:
    """A log and what must be read from it."""

    path: Path
    names: list[str]
    values: np.ndarray  # (channels, n), in what the reader yields
    tolerance: float


def signals(n: int = N) -> np.ndarray:
    t = np.arange(n) / RATE_HZ
    return np.array([0.5 * np.sin(2 * np.pi * 440 * t), 0.25 * np.cos(2 * np.pi * 100 * t)])


def wav_bytes(
    values: np.ndarray, bits: int, before: bytes = b"", after: bytes = b"", rate: int = int(RATE_HZ)
) -> bytes:
    """A PCM WAV from nothing but struct; `values` are integers of shape (channels, n)."""
    channels, width = len(values), bits // 8
    data = b"".join(int(v).to_bytes(width, "little", signed=True) for v in values.T.ravel())
    fmt = struct.pack("<HHIIHH", 1, channels, rate, rate * channels * width, channels * width, bits)
    pad = b"\0" * (len(data) % 2)
    body = (
        b"WAVE" + b"fmt " + struct.pack("<I", 16) + fmt + before + b"data" + struct.pack("<I", len(data)) + data + pad
    )
    return b"RIFF" + struct.pack("<I", len(body + after)) + body + after


def chunk(name: bytes, body: bytes) -> bytes:
    return name + struct.pack("<I", len(body)) + body + b"\0" * (len(body) % 2)


def lea_chunk(channels: list[tuple[bytes, bytes, float]]) -> bytes:
    parts = []
    for index, (name, unit, full_scale) in enumerate(channels):
        inner = struct.pack("<fH", full_scale, len(name)) + name + struct.pack("<H", len(unit)) + unit
        inner += struct.pack("<If", 0, 1.0)
        parts.append(b"le%02d" % index + struct.pack("<I", len(inner)) + inner)
    return chunk(b"LEA ", b"".join(parts))


def uff_header(
    n: int,
    *,
    binary: int | None = None,
    order: int = 1,
    data_type: int = 2,
    function: int = 1,
    even: int = 1,
    entity: str = "NONE",
    id1: str = "NONE",
    node: int = 0,
    abscissa: tuple[int, str, str] = (17, "Time", "s"),
    ordinate: tuple[int, str, bytes] = (12, "Acceleration", b"m/s2"),
    step: str = "1.22070e-04",
    end: bytes = b"\n",
) -> bytes:
    identifier = (
        "    58" if binary is None else f"    58b{order:6d}{2:6d}{11:12d}{binary:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    )
    lines = [b"    -1", identifier.encode(), id1.encode(), b"NONE", b"18-Apr-16 13:49:58", b"NONE", b"NONE"]
    lines.append(f"{function:5d}{0:10d}{0:5d}{0:10d} {entity:<10}{node:10d}{0:4d} {'NONE':<10}{0:10d}{0:4d}".encode())
    lines.append(f"{data_type:10d}{n:10d}{even:10d}{'0.00000e+00':>13}{step:>13}{'0.00000e+00':>13}".encode())
    lines.append(f"{abscissa[0]:10d}{0:5d}{0:5d}{0:5d} {abscissa[1]:<20} {abscissa[2]:<20}".encode())
    lines.append(f"{ordinate[0]:10d}{0:5d}{0:5d}{0:5d} {ordinate[1]:<20} ".encode() + ordinate[2].ljust(20))
    lines += [f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}".encode()] * 2
    return end.join(lines) + end


def uff_ascii(values: np.ndarray, width: int = 13, end: bytes = b"\n", **header) -> bytes:
    per_line, form = (6, "%13.5e") if width == 13 else (4, "%20.12e")
    header.setdefault("data_type", 2 if width == 13 else 4)
    rows = [values[at : at + per_line] for at in range(0, len(values), per_line)]
    body = b"".join("".join(form % v for v in row).encode() + end for row in rows)
    return uff_header(len(values), end=end, **header) + body + b"    -1" + end


def uff_binary(values: np.ndarray, dtype: str = "<f4", closing: bytes = b"\n    -1\n", **header) -> bytes:
    data = values.astype(dtype).tobytes()
    header.setdefault("data_type", 2 if dtype.endswith("4") else 4)
    header.setdefault("order", 1 if dtype[0] == "<" else 2)
    header.setdefault("binary", len(data))
    return uff_header(len(values), **header) + data + closing


def make_wav(folder: Path) -> Made:
    import soundfile

    x = signals()
    soundfile.write(folder / "a.wav", x.T, int(RATE_HZ), subtype="PCM_24")
    return Made(folder / "a.wav", ["ch1", "ch2"], x, 2.0**-23)


def make_rf64(folder: Path) -> Made:
    import soundfile

    x = signals()
    soundfile.write(folder / "a.rf64", x.T, int(RATE_HZ), subtype="FLOAT", format="RF64")
    return Made(folder / "a.rf64", ["ch1", "ch2"], x, 1e-7)


def make_flac(folder: Path) -> Made:
    import soundfile

    x = signals()
    soundfile.write(folder / "a.flac", x.T, int(RATE_HZ), subtype="PCM_16")
    return Made(folder / "a.flac", ["ch1", "ch2"], x, 2.0**-15)


def make_hdf5(folder: Path) -> Made:
    import h5py

    x = signals()
    with h5py.File(folder / "a.h5", "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        for name, row in zip(("motor_z", "group/mic"), x, strict=True):
            dataset = file.create_dataset(name, data=row)
            dataset.attrs["sample_rate_hz"] = RATE_HZ
            dataset.attrs["unit"] = "m/s^2"
    return Made(folder / "a.h5", ["motor_z", "group/mic"], x, 0.0)


def make_hdf5_foreign(folder: Path) -> Made:
    import h5py

    x = signals()
    with h5py.File(folder / "b.h5", "w") as file:
        file.create_dataset("time_data", data=x.T, chunks=(100, 1), compression="gzip").attrs["sample_freq"] = RATE_HZ
    return Made(folder / "b.h5", ["time_data[1]", "time_data[2]"], x, 0.0)


def make_csv(folder: Path) -> Made:
    x = signals()
    rows = [f"{i / RATE_HZ:.8f},{a:.17g},{b:.17g}" for i, (a, b) in enumerate(x.T)]
    (folder / "a.csv").write_text("Time [s],Motor Z [m/s²],mic (Pa)\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return Made(folder / "a.csv", ["Motor Z", "mic"], x, 0.0)


def make_german(folder: Path) -> Made:
    x = signals()
    rows = [f"{i / RATE_HZ:.8f};{a:.17g};{b:.17g}".replace(".", ",") for i, (a, b) in enumerate(x.T)]
    text = "Zeit;Motor Z;mic\r\ns;m/s²;Pa\r\n" + "\r\n".join(rows) + "\r\n"
    (folder / "b.txt").write_bytes(text.encode("latin-1"))
    return Made(folder / "b.txt", ["Motor Z", "mic"], x, 0.0)


def make_utf16(folder: Path) -> Made:
    x = signals()
    rows = [f"{a:.17g}\t{b:.17g}" for a, b in x.T]
    (folder / "c.tsv").write_bytes(("Sample rate: 8192 Hz\na\tb\n" + "\n".join(rows) + "\n").encode("utf-16"))
    return Made(folder / "c.tsv", ["a", "b"], x, 0.0)


def make_uff_ascii(folder: Path) -> Made:
    x = signals()
    blob = uff_ascii(x[0], entity="motor") + uff_ascii(x[1], entity="mic", ordinate=(15, "Pressure", b"Pa"))
    (folder / "a.uff").write_bytes(blob)
    return Made(folder / "a.uff", ["motor", "mic"], x, 1e-5)


def make_uff_double(folder: Path) -> Made:
    x = signals()
    blob = uff_ascii(x[0], 20, b"\r\n", entity="motor") + uff_ascii(x[1], 20, b"\r\n", entity="mic")
    (folder / "b.uff").write_bytes(blob)
    return Made(folder / "b.uff", ["motor", "mic"], x, 1e-12)


def make_uff_binary(folder: Path) -> Made:
    x = signals()
    blob = uff_binary(x[0], entity="motor") + uff_binary(x[1], ">f8", entity="mic")
    (folder / "c.uff").write_bytes(blob)
    return Made(folder / "c.uff", ["motor", "mic"], x, 1e-7)


def make_uff_by_pyuff(folder: Path) -> Made:
    import pyuff

    x = signals()
    file = pyuff.UFF(str(folder / "d.uff"))
    for name, row in zip(("motor", "mic"), x, strict=True):
        record = pyuff.prepare_58(
            binary=1,
            func_type=1,
            rsp_ent_name=name,
            rsp_node=1,
            rsp_dir=3,
            ref_node=1,
            ref_dir=1,
            ord_data_type=4,
            abscissa_spacing=1,
            abscissa_spec_data_type=17,
            ordinate_spec_data_type=0,
            orddenom_spec_data_type=0,
            z_axis_spec_data_type=0,
            data=row,
            x=np.arange(N) / RATE_HZ,
        )
        file.write_sets(record, "add")
    return Made(folder / "d.uff", ["motor", "mic"], x, 0.0)


MAKERS: list[Callable[[Path], Made]] = [
    make_wav,
    make_rf64,
    make_flac,
    make_hdf5,
    make_hdf5_foreign,
    make_csv,
    make_german,
    make_utf16,
    make_uff_ascii,
    make_uff_double,
    make_uff_binary,
    make_uff_by_pyuff,
]


def all_makers() -> list[Callable[[Path], Made]]:
    """The makers above and those of every ``makers_<format>.py`` beside this file."""
    modules = sorted(path.stem for path in Path(__file__).parent.glob("makers_*.py"))
    return [*MAKERS, *(maker for module in modules for maker in importlib.import_module(module).MAKERS)]
