"""How a universal file is broken, or not what one expects: issues 5 to 99 of pyuff, and what a cut or a flip makes."""

from pathlib import Path

import numpy as np
from fault_table import Fault
from log_makers import signals, uff_ascii, uff_binary, uff_header

N = 300
X, Y = signals(N)
F4 = X.astype("<f4").astype(np.float64)
ASCII, BINARY = uff_ascii(X, entity="one"), uff_binary(X, entity="one")
SECOND = uff_binary(Y, entity="two")
BOTH = np.array([F4, Y.astype("<f4")])
PRINTED = np.array([float(f"{value:.5e}") for value in X])
MODEL = b"    -1\n   151\nmodel\n\n  1 2 3\n    -1\n"
SHAPES = b"    -1\n    55\nNONE\n  -1.00000E+00\n    -1\n"
NODES = b"    -1\n  2411\n         1         1         1        11\n   1.0D+00   2.0D+00   3.0D+00\n    -1\n"


def units(code: int, length: float, force: float) -> bytes:
    text = f"    -1\n   164\n{code:10d}{'units':<20}{2:10d}\n"
    factors = "".join(f"{factor:25.17e}".replace("e", "D") for factor in (length, force, 1.0))
    return (text + factors + "\n" + f"{0.0:25.17e}\n    -1\n").encode()


def of(blob: bytes, name: str = "log.uff"):
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(blob)
        return folder / name

    return write


def claims(n: int, blob: bytes, n_bytes: int | None = None) -> bytes:
    """Another number of values in the header, and another number of bytes."""
    assert blob.count(f"{N:10d}".encode()) >= 1
    blob = blob.replace(f"{N:10d}".encode(), f"{n:10d}".encode(), 1)
    return blob if n_bytes is None else blob.replace(f"{4 * N:12d}".encode(), f"{n_bytes:12d}".encode(), 1)


def value_at(place: int, text: bytes) -> bytes:
    """The ASCII record with one field replaced."""
    start = ASCII.index(f"{X[0]:13.5e}".encode() + f"{X[1]:13.5e}".encode()) + place // 6 * 79 + place % 6 * 13
    return ASCII[:start] + text.rjust(13) + ASCII[start + 13 :]


def with_value(place: int, value: float) -> np.ndarray:
    values = PRINTED.copy()
    values[place] = value
    return values[np.newaxis]


def field_of(line: int, start: int, text: bytes, blob: bytes = BINARY) -> bytes:
    """A header with something else in some columns of a line."""
    lines = blob.split(b"\n", 12)
    lines[line] = lines[line][:start] + text + lines[line][start + len(text) :]
    return b"\n".join(lines)


HEADER = len(uff_header(N, binary=4 * N, entity="one"))
TEXT = np.frombuffer(b"\n    -1\n" * 50, "<f4").astype(np.float64)
LINES = np.frombuffer(b"\n\x00\x80?" * 200, "<f4").astype(np.float64)
IN_KHZ = {"abscissa": (18, "Frequency", "kHz")}

CUTS = [
    Fault(f"{kind}: cut {where}", of(MODEL + blob + blob[:keep]), "refused", "truncated")
    for kind, blob, places in (
        ("58b", BINARY, {"in the values": HEADER + 700, "before the last value": HEADER + 4 * N - 1}),
        ("58", ASCII, {"in the values": len(ASCII) // 2, "in a value": len(ASCII) - 20}),
    )
    for where, keep in {
        "behind the opening -1": 7,
        "in the first ID line": BINARY.index(b"NONE") + 2,
        "in record 7": blob.index(f"{N:10d}".encode()) + 3,
        "in record 9": blob.index(b"Acceleration"),
        **places,
    }.items()
]

FAULTS = [
    *CUTS,
    # how a 58b record ends
    Fault("58b: -1 glued to the values", of(uff_binary(X, closing=b"    -1\n", entity="one") + SECOND), "read",
          values=BOTH),
    Fault("58b: -1 on a line of its own (Testlab)", of(BINARY + SECOND), "read", values=BOTH),
    Fault("58b: CR LF before and behind -1", of(uff_binary(X, closing=b"\r\n    -1\r\n", entity="one") + SECOND),
          "read", values=BOTH),
    Fault("58b: no -1 before the next record", of(uff_binary(X, closing=b"", entity="one") + SECOND), "flagged",
          "no closing -1", BOTH),
    Fault("58b: no -1 at the end", of(uff_binary(X, closing=b"")), "flagged", "no closing -1", F4[np.newaxis]),
    Fault("58b: -1 without a line end", of(uff_binary(X, closing=b"    -1")), "read", values=F4[np.newaxis]),
    Fault("58b: the closing -1 is the next one's opening -1",
          of(uff_binary(X, closing=b"\n", entity="one") + SECOND), "flagged", "no closing -1", BOTH),
    Fault("58b: stray bytes behind the values", of(uff_binary(X, closing=b"\x01\x02stray\n    -1\n")), "flagged",
          "7 bytes that belong to nothing|8 bytes that belong to nothing", F4[np.newaxis]),
    Fault("58b: -1 within the values", of(uff_binary(TEXT, entity="one") + uff_binary(TEXT, entity="two")), "read",
          values=np.array([TEXT, TEXT])),
    Fault("58b: LF became CR LF in the values", of(uff_binary(LINES).replace(b"\n", b"\r\n")), "refused",
          "transferred as text"),
    Fault("58b: CR LF became LF in the values",
          of(uff_binary(np.frombuffer(b"\r\n\x80?" * 200, "<f4")).replace(b"\r\n", b"\n") + SECOND), "refused",
          "next record begins within them|truncated"),
    Fault("CR alone ends the lines", of(ASCII.replace(b"\n", b"\r")), "refused", "CR alone"),
    # what a header claims
    Fault("58b: more values than there are, last record", of(claims(N + 1, BINARY, 4 * N + 4)[:-8]), "refused",
          "claims 301 values, the file holds 300"),
    Fault("58b: more values than there are, before another record",
          of(claims(N + 90, BINARY, 4 * N + 360) + SECOND), "refused", "next record begins within them"),
    Fault("58b: far more values than there are", of(claims(10**9, BINARY, 4 * 10**9)), "refused", "truncated"),
    Fault("58b: fewer values than there are", of(claims(N - 50, BINARY, 4 * N - 200)), "flagged",
          "bytes that belong to nothing", F4[np.newaxis, : N - 50]),
    Fault("58b: fewer bytes than values", of(claims(N, BINARY, 4 * N - 4)), "refused", "300 values, but 1196 bytes"),
    Fault("58b: no bytes claimed", of(claims(N, BINARY, 0)), "flagged", "claims 0 bytes", F4[np.newaxis]),
    Fault("58b: says double, holds single", of(uff_binary(X, data_type=4)), "flagged", "4 are taken", F4[np.newaxis]),
    Fault("58b: says single, holds double (pyuff)", of(uff_binary(X, "<f8", data_type=2, binary=4 * N)), "flagged",
          "read as double precision", X[np.newaxis]),
    Fault("58b: says double and as many bytes, holds single", of(uff_binary(X, data_type=4, binary=8 * N) + SECOND),
          "refused", "truncated|next record begins"),
    Fault("58b: byte order of another machine", of(uff_binary(X, ">f4", order=1)), "flagged", "read as big-endian",
          F4[np.newaxis]),
    Fault("58b: no such byte order", of(uff_binary(X, order=3)), "refused", "byte order must be 1 or 2, got 3"),
    Fault("58b: floats of DEC VMS", of(field_of(1, 13, b"     1")), "refused", "float format 1"),
    Fault("58b: ten thousand million header lines", of(field_of(1, 19, b" 9999999999")), "refused", "header lines"),
    Fault("58: more values than there are", of(claims(N + 5, ASCII)), "refused", "claims 305 values, .* holds 300"),
    Fault("58: more values than there are, before another record", of(claims(N + 5, ASCII) + ASCII), "refused",
          "claims 305 values, .* holds 300"),
    Fault("58: fewer values than there are", of(claims(N - 5, ASCII)), "refused", "claims 295 values, but 300"),
    Fault("58: values without end", of(claims(10**9, ASCII)), "refused", "truncated"),
    Fault("a negative number of values", of(claims(-300, ASCII)), "refused", "claims -300 values"),
    Fault("no values", of(uff_ascii(X[:0])), "refused", "holds no values"),
    Fault("a letter in a number of the header", of(field_of(8, 15, b"3o0")), "refused",
          "header of record 1 is damaged"),
    # what is no evenly sampled time signal
    Fault("a spectrum", of(uff_ascii(X, function=12)), "refused", "holds a spectrum, not a time signal"),
    Fault("a frequency response function", of(uff_ascii(X, function=4, data_type=5)), "refused",
          "frequency response function"),
    Fault("a time response whose abscissa is in Hz", of(uff_ascii(X, abscissa=(18, "Frequency", "Hz"))), "refused",
          "not a time signal"),
    Fault("an abscissa in kHz", of(uff_ascii(X, **IN_KHZ)), "refused", "not a time signal"),
    Fault("an abscissa that is an index", of(uff_ascii(X, abscissa=(0, "Index", "NONE"), step="1.00000e+00")),
          "flagged", "an index, not a time", PRINTED[np.newaxis]),
    Fault("complex values", of(uff_ascii(X, data_type=5)), "refused", "complex"),
    Fault("an uneven abscissa", of(uff_ascii(X, even=0)), "refused", "unevenly spaced"),
    Fault("a spectrum beside a time signal", of(uff_ascii(X, function=2) + BINARY), "flagged", "an auto spectrum",
          F4[np.newaxis]),
    *(
        Fault(f"an abscissa increment of {step}", of(uff_binary(X, step=step)), "flagged", "rate is not known",
              F4[np.newaxis])
        for step in ("0.00000e+00", "-1.0000e-03", "NaN", "inf", "1.0000e-320")
    ),
    Fault("an abscissa that begins at NaN", of(field_of(8, 30, b"          NaN")), "flagged", "start is taken as 0",
          F4[np.newaxis]),
    # values in ASCII
    Fault("58: NaN among the values", of(value_at(7, b"NaN")), "read", values=with_value(7, np.nan)),
    Fault("58: asterisks for a value (Fortran)", of(value_at(7, b"*" * 13)), "refused", "no number"),
    Fault("58: a value overflows into the blank between", of(value_at(7, b"-1.23456e-100")), "read",
          values=with_value(7, -1.23456e-100)),
    Fault("58: an exponent without its letter (Fortran)", of(value_at(7, b"1.23456+100")), "read",
          values=with_value(7, 1.23456e100)),
    Fault("58: D exponents", of(ASCII.replace(b"e-", b"D-").replace(b"e+", b"D+")), "read", values=PRINTED[np.newaxis]),
    Fault("58: an underscore in a value", of(value_at(7, b"1_0")), "refused", "no number"),
    Fault("58: blanks behind the last value", of(ASCII.replace(b"\n    -1\n", b"       \n    -1\n")), "read",
          values=PRINTED[np.newaxis]),
    Fault("58: a line is missing", of(b"\n".join(line for i, line in enumerate(ASCII.split(b"\n")) if i != 20)),
          "refused", "holds 294"),
    # what it is called, and what it speaks of
    *(
        Fault(f"{words} under {suffix}", of(blob, f"log{suffix}"), "flagged",
              f"the suffix is {suffix}, the content is UFF 58", values, rate_hz=8192.0)
        for suffix in (".txt", ".asc", ".csv", ".TXT", ".dat")
        for words, blob, values in (
            ("58", ASCII, PRINTED[np.newaxis]),
            ("58 with CR LF", uff_ascii(X, end=b"\r\n"), PRINTED[np.newaxis]),
            ("58 behind other data sets", MODEL + units(1, 1, 1) + NODES + ASCII, PRINTED[np.newaxis]),
            ("58b", BINARY, F4[np.newaxis]),
        )
    ),
    Fault("58 under .txt, cut", of(ASCII[: len(ASCII) // 2], "log.txt"), "refused", "truncated"),
    Fault("an ID line that names HEAD acoustics", of(uff_ascii(X, id1="; HEAD acoustics datafile format")), "read",
          values=PRINTED[np.newaxis]),
    Fault("an increment with a comma", of(uff_ascii(X, step="1,22070e-04")), "refused",
          "header of record 1 is damaged"),
    Fault("an abscissa since 1970", of(field_of(8, 30, b"1.7000000e+09")), "flagged",
          r"its start is 2023-11-14T22:13:20\.000000\+00:00, not 2016-", F4[np.newaxis], rate_hz=8192.0),
    # units and names
    Fault("a unit in Latin-1", of(uff_binary(X, ordinate=(12, "Beschl.", b"m/s\xb2"))), "read", values=F4[np.newaxis]),
    Fault("a unit in UTF-8", of(uff_binary(X, ordinate=(12, "Beschl.", "m/s²".encode()))), "read",
          values=F4[np.newaxis]),
    Fault("a name of eleven characters", of(uff_binary(X, entity="PF-I-0301y+")), "read", values=F4[np.newaxis]),
    Fault("data set 164 in SI", of(units(1, 1.0, 1.0) + BINARY), "read", values=F4[np.newaxis]),
    Fault("data set 164 in millimetres, the label in metres", of(units(5, 1000.0, 1000.0) + BINARY), "flagged",
          "data set 164 says that its numbers are in 0.001 times SI", F4[np.newaxis]),
    Fault("data set 164 in millimetres, the label too",
          of(units(5, 1000.0, 1000.0) + uff_binary(X, ordinate=(12, "a", b"mm/s^2"))), "read", values=F4[np.newaxis]),
    Fault("data set 164 in millimetres, no label",
          of(units(5, 1000.0, 1000.0) + uff_binary(X, ordinate=(12, "a", b"NONE"))), "flagged", "0.001 times SI"),
    Fault("two channels of one name", of(BINARY + BINARY), "flagged", "several channels 'one'"),
    # other data sets between
    Fault("151, 164, 55, 2411 and an unknown one between",
          of(MODEL + units(1, 1, 1) + BINARY + SHAPES + NODES + b"    -1\n 99999\nx\n    -1\n" + SECOND), "read",
          values=BOTH),
    Fault("a data set that is not closed", of(BINARY + MODEL[:-7]), "flagged", "no closing -1", F4[np.newaxis]),
    Fault("cut in a data set number", of(BINARY + BINARY[:12]), "flagged", "may have been cut off", F4[np.newaxis]),
    Fault("no data set 58", of(MODEL + NODES), "refused", "no data set 58"),
    Fault("text between two records", of(BINARY + b"hello\n" + SECOND), "refused", "no data set number: b'hello'"),
    # bits
    Fault("a bit of the number of values flipped", of(claims(N | 64, BINARY)), "refused", "364 values, but 1200 bytes"),
    Fault("58b: values that are NaN", of(uff_binary(np.where(np.arange(N) == 3, np.nan, X))), "read",
          values=np.where(np.arange(N) == 3, np.nan, F4)[np.newaxis]),
]  # fmt: skip
