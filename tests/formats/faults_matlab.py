"""Ways in which a MAT-file is broken or says less than it seems to."""

import struct
import zlib

import numpy as np
from fault_table import Fault
from makers_matlab import (
    PACKED,
    cell,
    element,
    level4_matrix,
    level5,
    level73,
    matlab_dataset,
    matlab_struct,
    matrix,
    numbers,
    packed,
    structure,
    text,
)

X = np.sin(np.arange(300) / 7.0) + 0.1
Y = np.cos(np.arange(300) / 5.0)
RATE = numbers("fs", [[1000.0]])
TIME = np.arange(300)[:, None] / 64.0
UNIX = 1700000000.25 + TIME
LONG = np.arange(200_000) % 977 / 7.0


def written(*variables: bytes, **options):
    """A maker of a level 5 file."""

    def make(folder):
        (folder / "a.mat").write_bytes(level5(*variables, **options))
        return folder / "a.mat"

    return make


def blob(data: bytes):
    def make(folder):
        (folder / "a.mat").write_bytes(data)
        return folder / "a.mat"

    return make


def changed(data: bytes, at: int, new: bytes) -> bytes:
    return data[:at] + new + data[at + len(new) :]


def hdf5(fill):
    return lambda folder: level73(folder / "a.mat", fill)


def cut73(fraction: float):
    def make(folder):
        path = level73(folder / "a.mat", lambda file: matlab_dataset(file, "x", X[:, None]))
        data = path.read_bytes()
        path.write_bytes(data[: int(len(data) * fraction)])
        return path

    return make


def one(values):
    return np.array([values])


WHOLE = level5(numbers("x", X[:, None]), RATE)
PACKED_X = packed(numbers("x", X[:, None]))
PACKED_LONG = packed(numbers("x", LONG[:, None]))


def bomb(claimed: int, held: int) -> bytes:
    """A packed variable that claims and holds what it should not."""
    whole = bytearray(numbers("x", np.zeros((held, 1))))
    struct.pack_into("<I", whole, 4, claimed)
    return element(PACKED, zlib.compress(bytes(whole)))


def nested(depth: int) -> bytes:
    inner = numbers("", X[:, None])
    for _ in range(depth):
        inner = structure("", {"s": inner})
    return structure("deep", {"s": inner})


def opaque(name: str, class_name: str) -> bytes:
    head = element(6, struct.pack("<II", 17, 0)) + b"".join(
        element(1, word.encode()) for word in (name, "MCOS", class_name)
    )
    return element(14, head + numbers("", [[1, 2, 3]], "u4"))


def of_testlab(label="g", factor=1 / 9.80665, axis="s", n=300, names=("3:Point1", "4:Point2"), increment=0.001):
    unit = structure("", {"factor": numbers("", [[factor]]), "offset": numbers("", [[0.0]])})
    y = structure(
        "",
        {
            "values": numbers("", np.array([X, Y]).T),
            "quantity": structure("", {"label": text("", label), "unit_transformation": unit}),
        },
    )
    x = structure(
        "",
        {
            "start_value": numbers("", [[0.5]]),
            "increment": numbers("", [[increment]]),
            "number_of_values": numbers("", [[n]], "i4"),
            "quantity": structure("", {"label": text("", axis)}),
        },
    )
    record = structure("", {"name": cell("", [text("", name) for name in names])})
    return structure("Signal", {"x_values": x, "y_values": y, "function_record": record})


def of_pulse(rate="1000", n="300", count="2", unit="Pa"):
    header = {"NumberOfChannels": count, "SampleFrequency": rate, "NumberOfSamplesPerChannel": n}
    channel = {"SignalName": text("", "Mic"), "Unit": text("", unit)}
    return (
        structure("File_Header", {key: text("", value) for key, value in header.items()}),
        numbers("Channel_1_Data", X[:, None], "f4"),
        structure("Channel_1_Header", channel),
        numbers("Channel_2_Data", Y[:, None]),
        structure("Channel_2_Header", channel | {"SignalName": text("", "Motor")}),
    )


def external(file):
    matlab_dataset(file, "x", X[:, None])
    file.create_dataset("y", (300, 1), "f8", external=[("other.bin", 0, 2400)])


def links(file):
    import h5py

    matlab_dataset(file, "x", X[:, None])
    file["soft"] = h5py.SoftLink("/x")
    file["outside"] = h5py.ExternalLink("/etc/passwd", "/x")


def virtual(file):
    import h5py

    matlab_dataset(file, "x", X[:, None])
    layout = h5py.VirtualLayout((300,), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", (300,))
    file.create_virtual_dataset("y", layout)


def references(file):
    import h5py

    matlab_dataset(file, "x", X[:, None])
    held = file.create_group("#refs#").create_dataset("a", data=Y[None])
    held.attrs["MATLAB_class"] = np.bytes_("double")
    cells = file.create_dataset("c", (1, 1), h5py.ref_dtype)
    cells[0, 0] = held.ref
    cells.attrs["MATLAB_class"] = np.bytes_("cell")


def sparse(file):
    matlab_dataset(file, "x", X[:, None])
    group = matlab_struct(file, "s")
    group.attrs["MATLAB_sparse"] = np.uint64(5)
    group.create_dataset("data", data=np.arange(5.0))


def empty(file):
    matlab_dataset(file, "x", X[:, None])
    dataset = file.create_dataset("e", data=np.array([0, 0], "u8"))
    dataset.attrs["MATLAB_class"], dataset.attrs["MATLAB_empty"] = np.bytes_("double"), np.uint8(1)


def complex73(file):
    matlab_dataset(file, "x", X[:, None])
    pairs = np.zeros((1, 300), [("real", "f8"), ("imag", "f8")])
    file.create_dataset("z", data=pairs).attrs["MATLAB_class"] = np.bytes_("double")


def table73(file):
    matlab_dataset(file, "x", X[:, None])
    dataset = file.create_dataset("T", data=np.zeros((1, 6), "u4"))
    dataset.attrs["MATLAB_class"], dataset.attrs["MATLAB_object_decode"] = np.bytes_("timetable"), np.int32(3)


def with_rate(*variables):
    return written(numbers("x", X[:, None]), *variables)


FAULTS = [
    Fault("cut within the header", blob(WHOLE[:100]), "refused", "truncated"),
    Fault("cut behind the header", blob(WHOLE[:128]), "refused", "no array that could be a channel"),
    Fault("cut within the values", blob(WHOLE[:1000]), "refused", "truncated: variable 'x' claims 2\\d+ bytes"),
    Fault("cut within a tag", blob(WHOLE[:-50][: len(level5(numbers("x", X[:, None]))) + 4]), "flagged", "cut", one(X)),
    Fault("cut within what is packed", blob(level5(PACKED_X)[:-9]), "refused", "truncated: variable 'x'"),
    Fault("byte order swapped in the header", blob(changed(WHOLE, 124, b"\1\0MI")), "refused", "damaged|truncated"),
    Fault("header of neither byte order", blob(changed(WHOLE, 126, b"XX")), "refused", "no MAT-file of level 5"),
    Fault(
        "more rows claimed than held", written(numbers("x", X[:, None], shape=(400, 1))), "refused", "400 x 1 values"
    ),
    Fault(
        "fewer rows claimed than held", written(numbers("x", X[:, None], shape=(200, 1))), "refused", "200 x 1 values"
    ),
    Fault("dimensions below zero", written(numbers("x", X[:, None], shape=(-300, -1))), "refused", "-300 x -1"),
    Fault("values of a type that is no number", written(matrix("x", (4, 1), element(16, b"abcd"), 6)), "refused", "16"),
    Fault("a class that there is not", written(matrix("x", (4, 1), element(9, bytes(32)), 77)), "refused", "class 77"),
    Fault("a size that leads out of the file", blob(changed(WHOLE, 132, b"\xff\xff\xff\x7f")), "refused", "truncated"),
    Fault("an element behind which nothing is", written(element(9, bytes(80))), "refused", "data element of type 9"),
    Fault(
        "a bit of what is packed is flipped",
        blob(level5(changed(PACKED_X, 700, bytes([PACKED_X[700] ^ 16])))),
        "refused",
        "'?x?'?: .*(damaged|truncated)",
    ),
    Fault(
        "checksum of a long packed variable",
        blob(level5(changed(PACKED_LONG, len(PACKED_LONG) - 2, bytes([PACKED_LONG[-2] ^ 1])))),
        "refused",
        "variable 'x': its packed data are damaged \\(incorrect data check\\)",
    ),
    Fault("bomb: claims 4 GB", written(bomb(0xFFFFFF00, 300)), "refused", "more than its \\d+ packed bytes can hold"),
    Fault("bomb: unpacks to more than it claims", written(bomb(2456, 200_000)), "refused", "claims|damaged"),
    Fault("packed in it is no variable", written(element(PACKED, zlib.compress(bytes(400)))), "refused", "no variable"),
    Fault("what is packed is not", written(element(PACKED, bytes(400))), "refused", "damaged"),
    Fault("a cell of a billion", written(matrix("c", (1, 10**9), b"", 1)), "refused", "claims 1000000000 elements"),
    Fault("a structure of a billion", written(structure("s", {"a": b""}, shape=(10**5, 10**4))), "refused", "claims"),
    Fault("structures 40 deep", written(numbers("x", X[:, None]), nested(40)), "flagged", "nested more than 32 deep"),
    Fault("no rate", written(numbers("x", X[:, None])), "read", values=one(X)),
    Fault("rate of zero", with_rate(numbers("fs", [[0.0]])), "flagged", "'fs' is 0: no sampling rate", one(X)),
    Fault("rate that is not a number", with_rate(numbers("fs", [[np.nan]])), "flagged", "'fs' is nan", one(X)),
    Fault("rate below zero", with_rate(numbers("fs", [[-8.0]])), "flagged", "'fs' is -8", one(X)),
    Fault("rate no logger has", with_rate(numbers("fs", [[1e12]])), "flagged", "1e\\+12: no sampling rate", one(X)),
    Fault(
        "two rates",
        with_rate(RATE, numbers("dt", [[0.01]])),
        "flagged",
        "'fs' says 1000 Hz, 'dt' says 100 Hz: none is taken",
        one(X),
    ),
    Fault(
        "rate and time vector disagree",
        with_rate(RATE, numbers("t", np.arange(300)[:, None] / 500.0)),
        "flagged",
        "none is taken",
    ),
    Fault(
        "uneven time",
        with_rate(numbers("time", np.cumsum(1.0 + (np.arange(300)[:, None] > 150)))),
        "refused",
        "not evenly sampled and are not resampled",
    ),
    Fault(
        "uneven time beside a rate",
        with_rate(RATE, numbers("time", np.cumsum(1.0 + (np.arange(300)[:, None] > 150)))),
        "flagged",
        "neither is taken",
    ),
    Fault("time runs back", with_rate(numbers("t", -np.arange(300.0)[:, None])), "flagged", "does not rise"),
    Fault(
        "time in days", with_rate(numbers("t", 739_000 + np.arange(300)[:, None] / 86.4e6)), "flagged", "day numbers"
    ),
    Fault(
        "time is the first column",
        written(numbers("data", np.array([np.arange(300) / 500.0, X]).T)),
        "flagged",
        "first column rises evenly: if it is a time in seconds, the sampling rate is 500 Hz",
    ),
    *(
        Fault(
            f"{kind}time since 1970",
            make,
            "flagged",
            r"its start is 2023-11-14T22:13:20\.250000\+00:00$",
            one(X),
            rate_hz=64.0,
        )
        for kind, make in {
            "": with_rate(numbers("t", UNIX)),
            "packed ": written(packed(numbers("x", X[:, None])), packed(numbers("time", UNIX))),
            "7.3: ": hdf5(lambda file: (matlab_dataset(file, "x", X[:, None]), matlab_dataset(file, "t", UNIX))),
        }.items()
    ),
    Fault(
        "time since 1904",
        with_rate(numbers("t", UNIX + 2082844800.0)),
        "flagged",
        "may be since 1904; .* counted from the first of them, and no start is taken",
        one(X),
        rate_hz=64.0,
    ),
    Fault(
        "time that begins ten days after zero",
        with_rate(numbers("t", 864000.0 + TIME)),
        "read",
        "",
        one(X),
        rate_hz=64.0,
    ),
    *(
        Fault(
            f"rate in words, {words!r}",
            with_rate(text("fs", words)),
            "flagged",
            "'fs': the mark in .* may be of thousands or of decimals: no sampling rate is taken from it",
            one(X),
            rate_hz=None,
        )
        for words in ("51,200", "51.200", "51,200 Hz", "51,200 51,200", "1,024,000")
    ),
    *(
        Fault(f"rate in words, {words!r}", with_rate(text("fs", words)), "read", "", one(X), rate_hz=rate_hz)
        for words, rate_hz in {"51200,0": 51200.0, "51,2000": 51.2, "8192.000 Hz": 8192.0}.items()
    ),
    Fault(
        "interval in words",
        with_rate(text("dt", "1.250")),
        "flagged",
        "'dt': the mark in '1.250'",
        one(X),
        rate_hz=None,
    ),
    *(
        Fault(f"{name}, a time", with_rate(numbers(name, [[0.5]])), "read", "", one(X), rate_hz=None)
        for name in ("t_s", "t", "time_s", "ts", "TS", "T_s", "time")
    ),
    Fault("Ts, MATLAB's sample time", with_rate(numbers("Ts", [[0.5]])), "read", "", one(X), rate_hz=2.0),
    Fault(
        "unsigned integers",
        with_rate(numbers("y", [[1, 2, 3]], "u2")),
        "flagged",
        r"unsigned integers of 16 bits .*offset binary\) is not known, 32768 is taken",
        [X, [1.0, 2.0, 3.0]],
    ),
    Fault(
        "7.3: true and false of another program",
        hdf5(lambda file: file.create_dataset("x", data=np.array([[True], [False], [True]]))),
        "flagged",
        "logical values: 0 and 1",
        one([1, 0, 1]),
    ),
    Fault(
        "two variables of one name",
        written(numbers("x", X[:, None]), numbers("x", Y[:, None])),
        "flagged",
        "several channels 'x': this one is called 'x#2'",
        np.array([X, Y]),
    ),
    Fault("as many rows as columns", written(numbers("x", np.eye(3))), "flagged", "as many rows", np.eye(3)),
    Fault(
        "not a number among the values", written(numbers("x", [[1.0, np.nan, 2.0]])), "read", values=one([1, np.nan, 2])
    ),
    Fault("doubles stored as bytes", written(numbers("x", [[7, 200, 3]], "f8", "u1")), "read", values=one([7, 200, 3])),
    Fault(
        "integers of 64 bits",
        written(numbers("x", [[1, 2, 3]], "i8")),
        "flagged",
        "beyond 9007199254740992",
        one([1, 2, 3]),
    ),
    Fault(
        "logical values", written(numbers("x", [[1, 0, 1]], "u1", flags=0x200)), "flagged", "logical", one([1, 0, 1])
    ),
    Fault(
        "complex values",
        with_rate(numbers("z", X[:, None], flags=0x800)),
        "flagged",
        "complex, no time signals: .*: z",
        one(X),
    ),
    Fault("a cell with signals", with_rate(cell("c", [numbers("", Y)])), "flagged", "are cells: .*: c", one(X)),
    Fault(
        "an array of structures",
        with_rate(structure("s", {"a": numbers("", Y), "b": numbers("", Y)}, shape=(1, 1))),
        "read",
        values=np.array([X, Y, Y]),
    ),
    Fault(
        "structures in a row",
        with_rate(structure("s", {"a": numbers("", Y) + numbers("", Y)}, shape=(1, 2))),
        "flagged",
        "arrays of structures: .*: s",
        one(X),
    ),
    Fault("a sparse matrix", with_rate(matrix("s", (9, 9), b"", 5)), "flagged", "sparse: save full", one(X)),
    Fault("a function handle", with_rate(matrix("f", (1, 1), b"", 16)), "flagged", "nothing is ever executed", one(X)),
    Fault("a timetable", with_rate(opaque("T", "timetable")), "flagged", "timetable2table", one(X)),
    Fault("an object", with_rate(opaque("o", "Recorder")), "flagged", "objects: .*o \\(Recorder\\)", one(X)),
    Fault(
        "a third dimension", with_rate(numbers("v", np.ones(24), shape=(2, 3, 4))), "flagged", "two dimensions", one(X)
    ),
    Fault(
        "MATLAB's own store of functions",
        written(
            numbers("x", X[:, None]), numbers("", [[1, 2, 3]], "u1"), subsystem=len(level5(numbers("x", X[:, None])))
        ),
        "read",
        values=one(X),
    ),
    Fault("a variable without a name", with_rate(numbers("", Y)), "flagged", "have no name: variable 2", one(X)),
    Fault("Testlab: whole", written(of_testlab()), "read", values=np.array([X, Y]) / 9.80665, tolerance=1e-15),
    Fault("Testlab: a spectrum", written(of_testlab(axis="Hz")), "refused", "axis in 'Hz', not time signals"),
    Fault(
        "Testlab: more values claimed",
        written(of_testlab(n=400)),
        "flagged",
        "number_of_values' says 400, 'Signal.y_values.values' is 300 x 2",
    ),
    Fault(
        "Testlab: a factor that does not lead to the unit",
        written(of_testlab(factor=9.80665)),
        "flagged",
        "values are left as stored, the unit is not taken",
        np.array([X, Y]),
    ),
    Fault(
        "Testlab: an increment of zero",
        written(of_testlab(increment=0.0)),
        "flagged",
        "increment' is 0: no sampling rate",
    ),
    Fault("PULSE: whole", written(*of_pulse()), "read", values=np.array([X.astype("f4"), Y])),
    Fault("PULSE: decimal comma, twice", written(*of_pulse("1000,5 1000,5")), "read"),
    Fault(
        "PULSE: a mark of thousands",
        written(*of_pulse("51,200 51,200")),
        "flagged",
        "'File_Header.SampleFrequency': the mark in '51,200' may be of thousands",
        rate_hz=None,
    ),
    Fault("PULSE: rate in words", written(*of_pulse("fast")), "flagged", "SampleFrequency' is not there, or no number"),
    Fault(
        "PULSE: more samples claimed", written(*of_pulse(n="400")), "flagged", "says 400, 'Channel_1_Data' holds 300"
    ),
    Fault("PULSE: more channels claimed", written(*of_pulse(count="3")), "flagged", "says 3, 2 channels are there"),
    Fault(
        "level 4: cut", blob(level4_matrix("x", X[:, None])[:900]), "refused", "'x' claims 300 x 1 values, 2400 bytes"
    ),
    Fault("level 4: more claimed", blob(level4_matrix("x", X, shape=(2**30, 4))), "refused", "claims 1073741824 x 4"),
    Fault(
        "level 4: numbers of a VAX", blob(struct.pack("<i", 2000) + level4_matrix("x", X)[4:]), "refused", "no MATLAB"
    ),
    Fault(
        "level 4: complex",
        blob(level4_matrix("x", X) + level4_matrix("z", [X, X], shape=(1, 300), imaginary=1)),
        "flagged",
        "complex",
        one(X),
    ),
    Fault(
        "level 4: sparse, and a text",
        blob(
            level4_matrix("x", X)
            + level4_matrix("s", np.ones((3, 3)), kind=2)
            + level4_matrix("w", [[72, 105]], kind=1)
        ),
        "flagged",
        "sparse",
        one(X),
    ),
    Fault(
        "level 4: damaged behind the first",
        blob(level4_matrix("x", X) + b"\xff" * 40),
        "refused",
        "no matrix of level 4",
    ),
    Fault("7.3: cut in the middle", cut73(0.6), "refused", "truncated|damaged"),
    Fault("7.3: cut in the user block", cut73(0.05), "refused", "truncated"),
    Fault("7.3: data in another file", hdf5(external), "flagged", "in other files: y", one(X)),
    Fault("7.3: links", hdf5(links), "flagged", "2 skipped, they are links", one(X)),
    Fault("7.3: a virtual dataset", hdf5(virtual), "flagged", "virtual: .*: y", one(X)),
    Fault("7.3: cells", hdf5(references), "flagged", "cells: .*: c", one(X)),
    Fault("7.3: a sparse matrix", hdf5(sparse), "flagged", "sparse: .*: s", one(X)),
    Fault("7.3: an empty array holds its dimensions", hdf5(empty), "read", values=one(X)),
    Fault("7.3: complex", hdf5(complex73), "flagged", "complex, .*: z", one(X)),
    Fault("7.3: a timetable", hdf5(table73), "flagged", "timetables: .*: T", one(X)),
]
