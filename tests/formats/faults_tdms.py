"""Broken TDMS logs: cut, claiming what they do not hold, contradicting themselves, or with traps of real loggers."""

import struct

import numpy as np
from fault_table import Fault
from makers_tdms import (
    BIG,
    DAQMX,
    METADATA,
    NEW_LIST,
    NONE,
    OPEN,
    RAW,
    SAME,
    daqmx,
    linear,
    log,
    plain,
    segment,
    two,
    wave,
)

X = np.round(1000.0 * np.random.default_rng(7).normal(size=(2, 40)))
OBJECTS, VALUES = two(X)
ONE = segment(OBJECTS, VALUES)
TWO = ONE + segment(OBJECTS, VALUES)
LISTED = len(ONE) - 28 - len(VALUES)
A = "/'log'/'a'"
SECOND = 3564686121  # 2016-12-15 22:35:21 UTC


def single(index, values=b"", properties=None, **more):
    return segment([(A, index, wave() if properties is None else properties)], values, **more)


def f8(values):
    return np.asarray(values, dtype="<f8").tobytes()


def changed(blob, at, replacement):
    return blob[:at] + replacement + blob[at + len(replacement) :]


def cut(name, blob, length, says="truncated"):
    return Fault(f"cut {name}", log(blob[:length]), "refused", says)


def counts(n, **more):
    """A DAQmx channel of 16-bit counts."""
    return daqmx(n, [("i2", 0, 0, 0)], [2], **more)


def scaled(properties, says):
    stored = np.arange(40, dtype="<i2").tobytes()
    other = ("/'log'/'b'", daqmx(40, [("i2", 0, 0, 0)], [2]), {**wave(), **linear(0.5)})
    return log(segment([(A, counts(40), {**wave("V"), **properties}), other], stored, flags=DAQMX)), says


CUTS = [
    cut("within the first lead-in", ONE, 13),
    cut("behind the first lead-in", ONE, 28),
    cut("within the list of channels", ONE, 28 + LISTED // 2),
    cut("behind the list of channels", ONE, 28 + LISTED, "claims 40 values, the file holds 0"),
    cut("one byte before the end", ONE, len(ONE) - 1, "claims 40 values, the file holds 0 in whole chunks"),
    cut("within the second lead-in", TWO, len(ONE) + 20, "segment 2 begins at byte"),
    cut("within the tag of the second lead-in", TWO, len(ONE) + 3, "segment 2 begins at byte"),
    cut("behind the second lead-in", TWO, len(ONE) + 28, "list of channels of segment 2"),
    cut("within the second list", TWO, len(ONE) + 60, "list of channels of segment 2"),
    cut("within the second values", TWO, len(TWO) - 320, "claims 80 values, the file holds 40"),
]

CLAIMS = [
    Fault(
        "an interrupted recording ends within a chunk",
        log(ONE, segment(OBJECTS, VALUES[:500], next_offset=OPEN)),
        "flagged",
        r"was not closed.*the last 500 bytes, less than a chunk of 640 bytes, are left out",
        X,
    ),
    Fault(
        "an interrupted recording of interleaved channels",
        log(segment(*two(X, interleaved=True), interleaved=True, next_offset=OPEN)[:-24]),
        "flagged",
        "was not closed.*holds 38 of 40 values a channel, which are read; the last 8 bytes are left out",
        X[:, :38],
    ),
    Fault(
        "an interrupted recording that happens to be whole",
        log(segment(OBJECTS, VALUES, next_offset=OPEN)),
        "flagged",
        "was not closed: the length of its last segment",
        X,
    ),
    Fault(
        "a list of channels that claims twice the values",
        log(single(plain("f8", 80), f8(X[0]))),
        "flagged",
        "shorter than its list of channels says: its last chunk holds 40 of 80 values",
        X[:1],
    ),
    Fault(
        "values that are no whole part of a chunk",
        log(segment([(A, plain("f8", 40), {}), ("/'log'/'b'", plain("i2", 39), {})], bytes(200))),
        "refused",
        "end 200 bytes into a chunk of 398 bytes; .*claims 40 values, the file holds 0",
    ),
    Fault(
        "2^63 values claimed", log(single(plain("f8", 2**63), f8(X[0]))), "flagged", "40 of 9223372036854775808", X[:1]
    ),
    Fault("values claimed that are not there", log(ONE, single(plain("f8", 9), b"", raw=True)), "flagged", "hold none"),
    Fault(
        "raw data offset behind the next segment",
        log(segment(OBJECTS, VALUES, raw_offset=10_000)),
        "refused",
        "begin at byte 10028, behind its end",
    ),
    Fault("raw data offset too small", log(segment(OBJECTS, VALUES, raw_offset=40)), "refused", "does not end within"),
    Fault(
        "next segment offset eight bytes short",
        log(segment(OBJECTS, VALUES, next_offset=LISTED + len(VALUES) - 8), ONE),
        "refused",
        "into a chunk|no segment begins",
    ),
    Fault(
        "next segment offset behind the end",
        log(segment(OBJECTS, VALUES, next_offset=1 << 40)),
        "refused",
        "truncated: segment 1 claims",
    ),
    Fault("garbage between segments", log(ONE, b"\x01garbage" * 9, ONE), "refused", "no segment begins there"),
    Fault("garbage at the end", log(ONE, b"\x01garbage" * 9), "refused", "no segment begins there"),
    Fault("zeros at the end", log(ONE, bytes(300)), "flagged", "last 300 bytes are zeros", X),
    Fault("a file of another kind", log(b"TDSx" + ONE[4:]), "refused", "no TDMS file"),
    Fault("4 billion objects", log(changed(ONE, 28, b"\xff" * 4)), "refused", "does not end within"),
    Fault(
        "a path of 4 GB", log(changed(ONE, 32, b"\xfe\xff\xff\xff")), "refused", "list of channels does not end within"
    ),
    Fault(
        "a path that is none",
        log(single(plain("f8", 40), f8(X[0])).replace(b"'a'", b"'a/")),
        "refused",
        "not of the form",
    ),
    Fault("the first segment lists nothing", log(segment([], VALUES, metadata=False)), "refused", "lists no channels"),
    Fault("values laid out as before, at first", log(single(SAME, f8(X[0]))), "refused", "had none before"),
    Fault("values of no channel", log(single(NONE, f8(X[0]))), "refused", "no channel they belong to"),
    Fault(
        "no values, says the lead-in",
        log(ONE, segment(OBJECTS, VALUES, raw=False)),
        "flagged",
        "segment 2 says that it has no values, but holds 640 bytes",
        X,
    ),
    Fault("an unknown version", log(segment(OBJECTS, VALUES, version=9999)), "flagged", "version 9999 is not known", X),
    Fault(
        "stray bytes before the values",
        log(segment(OBJECTS, VALUES, padding=b"strayed ")),
        "flagged",
        "8 bytes that belong to nothing",
        X,
    ),
    Fault("zeros before the values, as DAQmx pads", log(segment(OBJECTS, VALUES, padding=bytes(300))), "read", "", X),
    Fault("a type that is none", log(single(struct.pack("<IIIQ", 20, 99, 1, 40), f8(X[0]))), "refused", "type 0x63"),
    Fault("two dimensions", log(single(struct.pack("<IIIQ", 20, 10, 2, 40), f8(X[0]))), "refused", "2 dimensions"),
    Fault("extended floats", log(single(plain("ext", 40), bytes(640))), "refused", "40 extended-precision numbers"),
    Fault("an index of 9999 bytes", log(single(struct.pack("<I", 9999), b"")), "refused", "raw data index of 9999"),
    Fault(
        "interleaved channels of two lengths",
        log(segment([(A, plain("f8", 40), {}), ("/'log'/'b'", plain("f8", 20), {})], bytes(480), interleaved=True)),
        "refused",
        "interleaved channels of different lengths",
    ),
    Fault(
        "the byte order of the lead-in alone",
        log(changed(ONE, 4, struct.pack("<I", METADATA | NEW_LIST | RAW | BIG))),
        "refused",
        "behind|truncated",
    ),
    Fault("an index file", log(b"TDSh" + ONE[4:]), "refused", "an index of a TDMS file, without its values"),
    Fault(
        "a channel whose type changes",
        log(ONE, segment([("/'log'/'motor'", plain("i2", 40), {})], bytes(80))),
        "flagged",
        "left out: 'log/motor': the type of their values changes",
        X[1:],
    ),
]

DAQMX_FAULTS = [
    Fault(f"DAQmx: {name}", make, "flagged", says)
    for name, (make, says) in {
        "no scaling": scaled({}, "raw DAQmx counts, and no scaling is given"),
        "an unknown type of scaling": scaled(
            {**linear(1.0), "NI_Scale[1]_Scale_Type": "Spline"}, "'Spline'.*not known"
        ),
        "a slope that is missing": scaled(
            {"NI_Number_Of_Scales": 2, "NI_Scale[1]_Scale_Type": "Linear"}, r"lacks NI_Scale\[1\]_Linear_Slope"
        ),
        "a slope that is no number": scaled(linear("steep"), "no number to scale with"),
        "a slope that is NaN": scaled(linear(float("nan")), "no number to scale with"),
        "a scale fed by itself": scaled(linear(1.0, source=1), "fed by itself"),
        "a scale fed by none there is": scaled(linear(1.0, source=7), "fed by scale 7, of 2"),
        "a scale fed by raw values": scaled(linear(1.0, source=0xFFFFFFFF), "they are DAQmx counts"),
        "a stored number that is none": scaled(linear(1.0, index=2, source=1, count=3), "scale 1 is not described"),
        "4 billion scales": scaled({"NI_Number_Of_Scales": 0xFFFFFFFF}, "4294967295 scales"),
        "4 billion coefficients": scaled(
            {
                "NI_Number_Of_Scales": 2,
                "NI_Scale[1]_Scale_Type": "Polynomial",
                "NI_Scale[1]_Polynomial_Coefficients_Size": 0xFFFFFFFF,
            },
            "is 4.29496.*e.09; 0 to",
        ),
        "a table that turns back": scaled(
            {
                "NI_Number_Of_Scales": 2,
                "NI_Scale[1]_Scale_Type": "Table",
                "NI_Scale[1]_Table_Pre_Scaled_Values_Size": 3,
                "NI_Scale[1]_Table_Scaled_Values_Size": 3,
                **{f"NI_Scale[1]_Table_Pre_Scaled_Values[{k}]": v for k, v in enumerate((0.0, 2.0, 1.0))},
                **{f"NI_Scale[1]_Table_Scaled_Values[{k}]": v for k, v in enumerate((0.0, 2.0, 1.0))},
                "NI_Scale[1]_Table_Input_Source": 0,
            },
            "neither rise nor fall",
        ),
    }.items()
] + [
    Fault(
        "DAQmx: a scaler behind its row",
        log(single(daqmx(40, [("i4", 0, 0, 0)], [2]), bytes(80))),
        "refused",
        "bytes 0 to 4 of a row of 2 bytes",
    ),
    Fault(
        "DAQmx: a buffer there is not",
        log(single(daqmx(40, [("i2", 3, 0, 0)], [2]), bytes(80))),
        "refused",
        "buffer 3 of 1",
    ),
    Fault(
        "DAQmx: rows stated in two ways",
        log(segment([(A, counts(4), {}), ("/'log'/'b'", daqmx(4, [("i2", 0, 2, 0)], [4]), {})], bytes(16))),
        "refused",
        "different rows",
    ),
    Fault(
        "DAQmx: among other values",
        log(segment([(A, counts(4), {}), ("/'log'/'b'", plain("i2", 4), {})], bytes(16))),
        "refused",
        "DAQmx raw data and other values",
    ),
    Fault(
        "DAQmx: a last chunk that is shorter",
        log(single(counts(30), np.arange(40, dtype="<i2").tobytes(), {**wave(), **linear(2.0)})),
        "flagged",
        "its last chunk holds 10 of 30 values",
        2.0 * np.arange(40)[None],
    ),
    Fault(
        "DAQmx: cut",
        log(single(counts(40), bytes(80), {**wave(), **linear(2.0)})[:-3]),
        "refused",
        "claims 40 values, the file holds 0",
    ),
]


def timed(first, *later):
    """One channel, each segment with properties of its own."""
    parts = [single(plain("f8", 40), f8(X[0]), {"unit_string": "Pa", **first})]
    return log(*parts, *(single(plain("f8", 40), f8(X[0]), properties) for properties in later))


def grouped(*groups):
    """(group, values, rate) each in a segment of its own."""
    return log(
        *(
            segment([(f"/'{group}'/'mic'", plain("f8", len(values)), wave("Pa", rate))], f8(values))
            for group, values, rate in groups
        )
    )


LONG = np.cumsum(np.random.default_rng(3).normal(size=1000))
PAIRS = LONG.reshape(-1, 20)
MIN_MAX = np.column_stack([PAIRS.min(axis=1), PAIRS.max(axis=1)]).ravel()

TRAPS = [
    Fault(
        "an increment of zero",
        timed({"wf_increment": 0.0}),
        "flagged",
        "wf_increment is 0.0: the sampling rate is not",
        X[:1],
    ),
    Fault("a negative increment", timed({"wf_increment": -1.0}), "flagged", "rate is not known", X[:1]),
    Fault("an increment that is NaN", timed({"wf_increment": float("nan")}), "flagged", "rate is not known", X[:1]),
    Fault("an increment that is text", timed({"wf_increment": "fast"}), "flagged", "rate is not known", X[:1]),
    Fault(
        "an increment that changes among the values",
        log(ONE, single(plain("f8", 40), f8(X[0])), single(plain("f8", 40), f8(X[0]), wave(rate=99.0))),
        "flagged",
        r"left out: 'log/a': its wf_increment changes from 0\.00012207.* to 0\.0101.* after 40 values",
        X,
    ),
    Fault(
        "an increment that changes after the values",
        log(ONE, single(plain("f8", 40), f8(X[0])), single(NONE, b"", wave(rate=99.0), new_list=False)),
        "flagged",
        "while its values were written and .* after",
    ),
    Fault(
        "a start that was never set", timed({**wave(), "wf_start_time": (0, 0)}), "flagged", r"never set \(1904", X[:1]
    ),
    Fault(
        "a start before 1970", timed({**wave(), "wf_start_time": (86400, 0)}), "flagged", "1904-01-02.*no date", X[:1]
    ),
    Fault("a start in the future", timed({**wave(), "wf_start_time": (2**33, 0)}), "flagged", "2176-.*no date", X[:1]),
    Fault("a start beyond all years", timed({**wave(), "wf_start_time": (2**62, 0)}), "flagged", "no date", X[:1]),
    Fault(
        "a gap between segments",
        timed({**wave(), "wf_start_time": (SECOND, 0)}, {"wf_start_time": (SECOND + 9, 0)}),
        "flagged",
        r"at value 40 it is 8\.995\d* s off an unbroken recording",
    ),
    Fault(
        "an abscissa in Hz", timed({**wave(), "wf_xunit_string": "Hz"}), "refused", "its x axis is in 'Hz', not a time"
    ),
    Fault(
        "a channel that joins later",
        log(ONE, segment([*OBJECTS, (A, plain("f8", 40), wave("Pa"))], VALUES + f8(X[0]))),
        "flagged",
        "left out: 'log/a': their first values come after 40 values of 'log/motor'",
        np.concatenate([X, X], axis=1),
    ),
    Fault(
        "a channel that misses a segment",
        log(ONE, segment(OBJECTS[:1], VALUES[:320]), ONE),
        "flagged",
        "holds 80 values, 'log/motor' of the same rate and start 120",
    ),
    Fault(
        "a scaling that changes",
        log(
            single(plain("f8", 40), f8(X[0]), {**wave(), **linear(2.0, index=0, source=0xFFFFFFFF, count=1)}),
            single(plain("f8", 40), f8(X[0]), linear(3.0, index=0, source=0xFFFFFFFF, count=1)),
        ),
        "flagged",
        "its scaling was changed while the file was written",
        3.0 * np.concatenate([X[:1], X[:1]], axis=1),
    ),
    *(
        Fault(
            f"an increment that is the text {text!r}",
            timed({"wf_increment": text}),
            "flagged",
            f"wf_increment is {text}: the sampling rate is not known",
            X[:1],
            rate_hz=None,
        )
        for text in ("0,000", "1,250", "51.200")
    ),
    Fault(
        "true or false beside a channel, one a byte of all ones",
        log(
            segment(
                [("/'log'/'motor'", plain("f8", 40), wave()), ("/'log'/'tacho'", plain("bool", 40), wave("V"))],
                f8(X[0]) + bytes(255 if high else 0 for high in X[1] > 0),
            )
        ),
        "flagged",
        "logical values: 0 and 1",
        np.array([X[0], X[1] > 0]),
        rate_hz=8192.0,
    ),
    Fault(
        "true or false between numbers of another machine",
        log(
            segment(
                [
                    ("/'log'/'motor'", plain("i2", 40, order=">"), wave("g")),
                    ("/'log'/'tacho'", plain("bool", 40, order=">"), wave("")),
                ],
                b"".join(int(x).to_bytes(2, "big", signed=True) + bytes([int(y > 0)]) for x, y in X.T),
                order=">",
                interleaved=True,
            )
        ),
        "flagged",
        "logical values: 0 and 1",
        np.array([X[0], X[1] > 0]),
    ),
    Fault(
        "unsigned integers without a unit",
        log(single(plain("u2", 40), np.arange(40, dtype="<u2").tobytes(), wave(""))),
        "flagged",
        r"unsigned integers of 16 bits .*offset binary\) is not known, 32768 is taken",
        np.arange(40.0)[None],
    ),
    Fault(
        "unsigned integers with a unit",
        log(single(plain("u2", 40), np.arange(40, dtype="<u2").tobytes())),
        "read",
        "",
        np.arange(40.0)[None],
    ),
    Fault(
        "text, instants and complex numbers beside a channel",
        log(
            segment(
                [
                    ("/'log'/'motor'", plain("f8", 40), wave()),
                    ("/'log'/'note'", plain("text", 2, 12), {}),
                    ("/'log'/'when'", plain("time", 2), {}),
                    ("/'log'/'z'", plain("c8", 1), {}),
                ],
                f8(X[0]) + struct.pack("<II", 2, 4) + b"abcd" + bytes(32) + bytes(8),
            )
        ),
        "flagged",
        "left out: 'log/note': their values are text",
        X[:1],
    ),
    Fault(
        "decimated copies as SignalExpress writes them",
        grouped(
            ("05/22 - S - All Data", LONG, 1000.0),
            ("05/22 - S - Decimated Data_Level1", LONG[::10], 100.0),
            ("05/22 - S - Decimated Data_Level2", LONG[::100], 10.0),
        ),
        "flagged",
        "left out: '05/22 - S - Decimated Data_Level1/mic': a copy of '05/22 - S - All Data/mic' reduced 10 times",
        LONG[None],
    ),
    Fault(
        "a preview of smallest and largest values",
        grouped(("S", LONG, 1000.0), ("S preview", MIN_MAX, 100.0)),
        "flagged",
        "left out: 'S preview/mic': a copy of 'S/mic' reduced 10 times",
        LONG[None],
    ),
    Fault(
        "called a copy, of other values",
        grouped(("S", LONG, 1000.0), ("S decimated", LONG[::10] + 100.0, 100.0)),
        "flagged",
        "says that it is a reduced copy, but it is not one of 'S/mic': its value 0 is",
    ),
    Fault(
        "called a copy, of another rate",
        grouped(("S", LONG, 1000.0), ("S decimated", LONG[::10], 90.0)),
        "flagged",
        "is no whole part of 1000",
    ),
    Fault(
        "a copy without its original",
        grouped(("S decimated", LONG, 100.0)),
        "flagged",
        "what it was taken from",
        LONG[None],
    ),
    Fault(
        "nothing but text",
        log(segment([("/'log'/'note'", plain("text", 1, 6), {})], b"\2\0\0\0ab")),
        "refused",
        "are text",
    ),
    Fault("no values at all", log(segment([("/'log'/'a'", NONE, wave())])), "refused", "they hold no values"),
    Fault(
        "NaN among the values",
        log(single(plain("f8", 3), f8([1.0, np.nan, 2.0]))),
        "read",
        "",
        np.array([[1, np.nan, 2]]),
    ),
]

FLIPS = [
    Fault(
        f"bit {bit} of byte {byte} of the lead-in turned over",
        log(changed(TWO, byte, bytes([TWO[byte] ^ (1 << bit)]))),
        "refused",
        "segment|TDMS",
    )
    for byte, bit in [(0, 0), (3, 5), (12, 3), (13, 1), (19, 7), (20, 0), (20, 3), (21, 4), (27, 7)]
]

FAULTS = [*CUTS, *CLAIMS, *DAQMX_FAULTS, *TRAPS, *FLIPS]
