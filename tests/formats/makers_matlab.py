"""MAT-files: by scipy.io.savemat, by h5py in MATLAB's manner, and from nothing but struct and zlib for the rest."""

import struct
import zlib
from pathlib import Path

import numpy as np
from log_makers import RATE_HZ, Made, signals

STORED_AS = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 9, "i8": 12, "u8": 13}
CLASS_OF = {"f8": 6, "f4": 7, "i1": 8, "u1": 9, "i2": 10, "u2": 11, "i4": 12, "u4": 13, "i8": 14, "u8": 15}
MATRIX, PACKED = 14, 15


def element(kind: int, data: bytes, order: str = "<", small: bool = True) -> bytes:
    """A data element of level 5, small where it fits."""
    if small and 0 < len(data) <= 4 and kind not in (MATRIX, PACKED):
        word = (len(data) << 16) | kind
        return struct.pack(order + "I", word) + data.ljust(4, b"\0")
    pad = b"" if kind in (MATRIX, PACKED) else b"\0" * (-len(data) % 8)
    return struct.pack(order + "II", kind, len(data)) + data + pad


def matrix(name: str, shape, body: bytes, class_: int, order: str = "<", flags: int = 0, small: bool = True) -> bytes:
    head = element(6, struct.pack(order + "II", class_ | flags, 0), order)
    head += element(5, struct.pack(f"{order}{len(shape)}i", *shape), order, small=False)
    return element(MATRIX, head + element(1, name.encode(), order, small) + body, order)


def numbers(name: str, values, class_="f8", stored=None, order="<", shape=None, flags=0, small=True) -> bytes:
    """A numeric array, stored in a type that need not be its class's."""
    values = np.atleast_2d(np.asarray(values))
    stored = stored or class_
    data = values.astype(order + stored).tobytes(order="F")
    body = element(STORED_AS[stored], data, order, small)
    return matrix(name, shape or values.shape, body, CLASS_OF[class_], order, flags, small)


def text(name: str, words: str, order="<") -> bytes:
    return matrix(name, (1, len(words)), element(16, words.encode(), order), 4, order)


def structure(name: str, fields: dict[str, bytes], order="<", shape=(1, 1), width=32, class_=2) -> bytes:
    names = b"".join(field.encode().ljust(width, b"\0") for field in fields)
    body = element(5, struct.pack(order + "i", width), order) + element(1, names, order, small=False)
    return matrix(name, shape, body + b"".join(fields.values()), class_, order)


def cell(name: str, parts: list[bytes], order="<") -> bytes:
    return matrix(name, (1, len(parts)), b"".join(parts), 1, order)


def packed(variable: bytes, order="<", level=6) -> bytes:
    return element(PACKED, zlib.compress(variable, level), order)


def level5(
    *variables: bytes, order="<", subsystem: int = 0, name: str = "MATLAB 5.0 MAT-file, made by a test"
) -> bytes:
    head = name.encode().ljust(116) + struct.pack(order + "QH", subsystem, 0x0100)
    return head + (b"IM" if order == "<" else b"MI") + b"".join(variables)


def level4_matrix(name: str, values, stored=0, order="<", kind=0, shape=None, imaginary=0) -> bytes:
    values = np.atleast_2d(np.asarray(values))
    rows, columns = shape or values.shape
    mopt = (0 if order == "<" else 1000) + 10 * stored + kind
    dtype = order + ["f8", "f4", "i4", "i2", "u2", "u1"][stored]
    head = struct.pack(order + "5i", mopt, rows, columns, imaginary, len(name) + 1) + name.encode() + b"\0"
    return head + values.astype(dtype).tobytes(order="F")


def level73(path: Path, fill) -> Path:
    """A level 7.3 file: a user block with MATLAB's header, then HDF5, filled by `fill`."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file)
    head = b"MATLAB 7.3 MAT-file, made by a test".ljust(116) + bytes(8) + struct.pack("<H", 0x0200) + b"IM"
    with path.open("r+b") as stream:
        stream.write(head)
    return path


def matlab_dataset(group, name: str, values, class_: str = "double", **options):
    """A dataset as MATLAB saves an array: dimensions in the opposite order, the class in an attribute."""
    dataset = group.create_dataset(name, data=np.atleast_2d(values).T, **options)
    dataset.attrs["MATLAB_class"] = np.bytes_(class_)
    return dataset


def matlab_text(group, name: str, words: str):
    codes = np.frombuffer(words.encode("utf-16-le"), "<u2")[np.newaxis]
    dataset = matlab_dataset(group, name, codes, "char")
    dataset.attrs["MATLAB_int_decode"] = np.int32(2)
    return dataset


def matlab_struct(group, name: str):
    inner = group.create_group(name)
    inner.attrs["MATLAB_class"] = np.bytes_("struct")
    return inner


def make_matlab_struct(folder: Path) -> Made:
    from scipy.io import savemat

    x = signals()
    savemat(folder / "a.mat", {"run": {"motor": x[0][:, None], "mic": x[1], "fs": RATE_HZ}})
    return Made(folder / "a.mat", ["run.motor", "run.mic"], x, 0.0)


def make_matlab_packed(folder: Path) -> Made:
    from scipy.io import savemat

    x = signals()
    savemat(folder / "b.mat", {"dt": 1.0 / RATE_HZ, "data": x.T}, do_compression=True)
    return Made(folder / "b.mat", ["data[1]", "data[2]"], x, 0.0)


def make_matlab_rows_big_endian(folder: Path) -> Made:
    x = signals()
    blob = level5(numbers("data", x, order=">"), packed(numbers("fs", [[RATE_HZ]], order=">"), ">"), order=">")
    (folder / "c.mat").write_bytes(blob)
    return Made(folder / "c.mat", ["data[1]", "data[2]"], x, 0.0)


def make_matlab_level4(folder: Path) -> Made:
    from scipy.io import savemat

    x = signals()
    savemat(folder / "d.mat", {"motor": x[0], "mic": x[1], "Fs": RATE_HZ}, format="4")
    return Made(folder / "d.mat", ["motor", "mic"], x, 0.0)


def make_matlab_level73(folder: Path) -> Made:
    x = signals()

    def fill(file):
        run = matlab_struct(file, "run")
        matlab_dataset(run, "motor", x[0][:, None], chunks=(1, 100), compression="gzip")
        matlab_dataset(run, "mic", x[1][None])
        matlab_dataset(file, "t", np.arange(x.shape[1])[:, None] / RATE_HZ)
        matlab_text(run, "remark", "two channels")

    return Made(level73(folder / "e.mat", fill), ["run.motor", "run.mic"], x, 0.0)


MAKERS = [
    make_matlab_struct,
    make_matlab_packed,
    make_matlab_rows_big_endian,
    make_matlab_level4,
    make_matlab_level73,
]
