"""Ways in which texts of numbers are broken."""

import numpy as np
from fault_table import Fault
from log_makers import signals

N = 300
X = np.round(signals(N)[0], 6)
T = np.arange(N) / 8192.0
HEAD = "Time [s],mic [Pa]\n"
ROWS = [f"{t:.8f},{x:.6f}\n" for t, x in zip(T, X, strict=True)]
NAMED = "mic [Pa]\n"
SINGLE = [f"{x:.6f}\n" for x in X]
PAIRS = [f"{x:.6f},{-x:.6f}\n" for x in X]


def text(content, name="a.csv", encoding="utf-8"):
    def make(folder):
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
        return folder / name

    return make


def rows(change, base=ROWS, head=HEAD):
    changed = list(base)
    change(changed)
    return text(head + "".join(changed))


def put(at, row):
    return lambda changed: changed.__setitem__(at, row)


def late(rows_at, value):
    """Times of which those from a row on are later."""
    t = T.copy()
    t[rows_at:] += value
    return text(HEAD + "".join(f"{a:.8f},{x:.6f}\n" for a, x in zip(t, X, strict=True)))


WHOLE = HEAD + "".join(ROWS)
ONE = X[np.newaxis]
WITH_NAN = X.copy()
WITH_NAN[150] = np.nan


def from_instant(begin, form="{:.6f}", name="Time [s]", head=""):
    """A text whose time column begins at some instant, 8192 samples a second."""
    lines = "".join(f"{form.format(begin + i / 8192)},{x:.6f}\n" for i, x in enumerate(X))
    return text(f"{head}{name},mic [Pa]\n{lines}")


def stated(line, rate_hz, outcome="flagged", says="may be of thousands or of decimals"):
    """A heading that states a rate, above one column."""
    return Fault(
        f"the heading says {line!r}", text(f"{line}\n{NAMED}" + "".join(SINGLE)), outcome,
        says if outcome == "flagged" else "", ONE, rate_hz=rate_hz,
    )  # fmt: skip


UNIX = "its start is 2023-11-14T22:13:20.250000\\+00:00"
STARTS = [
    Fault("times since 1970", from_instant(1700000000.25), "flagged", UNIX, ONE, rate_hz=8192.0),
    Fault(
        "times since 1970 in milliseconds",
        text("t [ms],mic\n" + "".join(f"{1.70000000025e12 + i:.0f},{x:.6f}\n" for i, x in enumerate(X))),
        "flagged",
        UNIX,
        ONE,
        rate_hz=1000.0,
    ),
    Fault(
        "times since 1970 and another start in the heading",
        from_instant(1700000000.25, head="Start time: 2023-11-13 22:13:20\n"),
        "flagged",
        UNIX + ", not 2023-11-13T22:13:20, which it states without a time zone",
        ONE,
    ),
    Fault(
        "times since 1904",
        from_instant(3782844800.25),
        "flagged",
        "may be since 1904; .* counted from the first of them, and no start is taken",
        ONE,
    ),
    Fault(
        "times that begin two years after zero",
        from_instant(6.3e7),
        "flagged",
        "begin at 63000000 s, since what date is not known",
        ONE,
    ),
    Fault("times that begin ten days after zero", from_instant(864000.0), "read", "", ONE),
]
RATES = [
    *(stated(line, None) for line in ("Sample rate: 51,200", "Sample rate: 51.200 Hz", "fs = 1,024", "dt: 1.250")),
    *(stated(line, None) for line in ("Sampling rate;51,200;Hz", "Sample rate: 1,024,000", "Sample rate: 51'200 Hz")),
    *(
        stated(line, rate_hz, "read")
        for line, rate_hz in {
            "Sample rate: 51200,0": 51200.0,
            "Sample rate: 51,2 kHz": 51200.0,
            "Sample rate: 51.200 kHz": 51200.0,
            "Sample rate [kHz]: 51.200": 51200.0,
            "Sample rate: 8192.000 Hz": 8192.0,
            "Sample rate: 5.120E+04": 51200.0,
            "dt: 0.125": 8.0,
            "dt: 19.531250 us": 51200.0,
            "t_s: 0.5": None,
            "t: 0.5": None,
            "time_s = 0.5": None,
            "Sampling time: 60 s": None,
        }.items()
    ),
]
WORDS = [
    Fault("a heading that names HEAD acoustics", text("; Copyright HEAD acoustics\nHEAD acoustics SQuadriga\n" + WHOLE),
          "read", "", ONE),
    Fault("a column called ID3", text("ID3,ID4\n" + "".join(PAIRS)), "read", "", np.array([X, -X])),
    Fault("a column called OggS", text("OggS\n" + "".join(SINGLE)), "read", "", ONE),
    Fault("a column called BZh", text("BZh,b\n" + "".join(PAIRS)), "read", "", np.array([X, -X])),
    Fault("one column that begins like a universal file", text("    -1\n    58\n   151\n     3\n", "a.txt"), "read", "",
          np.array([[-1.0, 58.0, 151.0, 3.0]])),
    Fault("one column that begins like a universal file, with NaN", text("-1\n58\nNaN\n-.5\n3.5\n"),
          "read", "", np.array([[-1.0, 58.0, np.nan, -0.5, 3.5]])),
]  # fmt: skip

FAULTS = [
    Fault("cut in a number", text(WHOLE[: len(WHOLE) - 4]), "flagged", "may have been cut off"),
    Fault("cut between two fields", text(WHOLE[: WHOLE.rindex(",")]), "refused", r"line 301 has 1 fields, .* 2"),
    Fault("cut behind the heading", text(HEAD), "refused", "no row of numbers"),
    Fault("cut in the heading", text(HEAD[:7]), "refused", "no row of numbers"),
    Fault(
        "the heading claims more samples than there are",
        text("Samples: 500\n" + WHOLE),
        "refused",
        "truncated: the heading claims 500 samples, the file holds 300",
    ),
    Fault("the heading claims as many as there are", text("Samples: 300\n" + WHOLE), "read", "", ONE),
    Fault("a row with a field too few", rows(put(150, "0.0183\n")), "refused", "line 152 has 1 fields"),
    Fault("a row with a field too many", rows(put(150, "0.0183,1,2\n")), "refused", "line 152 has 3 fields"),
    Fault("an empty line among the rows", rows(put(150, "\n")), "refused", "line 152 is empty"),
    Fault("empty lines at the end", text(WHOLE + "\n\n\n"), "read", "", ONE),
    Fault(
        "a text among the numbers", rows(put(150, "0.01831055,OVERLOAD\n")), "refused", "line 152: 'OVERLOAD'.*'mic'"
    ),
    Fault("an empty cell", rows(put(150, f"{T[150]:.8f},\n")), "read", "", WITH_NAN[np.newaxis]),
    Fault("NaN in words", rows(put(150, f"{T[150]:.8f},NaN\n")), "read", "", WITH_NAN[np.newaxis]),
    Fault("numbers in hexadecimal", rows(put(150, f"{T[150]:.8f},0x1A\n")), "refused", "'0x1A'.*is no number"),
    Fault("the comma of thousands", rows(put(150, '0.01831055,"1,234.5"\n')), "refused", "is no number|fields"),
    Fault("another decimal mark in one row", rows(put(150, f"{T[150]:.8f};0,5\n")), "refused", "line 152"),
    Fault("a gap in the times", late(150, 0.01), "refused", "line 152: the time column is not equidistant"),
    Fault("a sample lost", rows(lambda changed: changed.pop(150)), "refused", "line 152: the time column is not equi"),
    Fault(
        "a row twice", rows(lambda changed: changed.insert(150, changed[150])), "refused", "line 15[23]: the time col"
    ),
    Fault("a time that goes back", late(150, -0.01), "refused", "line 152: the time column is not equidistant"),
    Fault("times that fall", text(HEAD + "".join(reversed(ROWS))), "refused", "does not rise"),
    Fault("times that stand still", text(HEAD + "".join(f"0.0,{x}\n" for x in X)), "refused", "does not rise"),
    Fault("a time that is NaN", rows(put(150, "nan,0.5\n")), "refused", "not equidistant|not rise"),
    Fault(
        "times too coarse for their rate",
        text(HEAD + "".join(f"{t:.3f},{x}\n" for t, x in zip(T, X, strict=True))),
        "refused",
        "not equidistant",
    ),
    Fault(
        "a time without unit", text(WHOLE.replace("Time [s]", "Time")), "flagged", "has no unit: taken as seconds", ONE
    ),
    Fault(
        "a stated rate of zero", text("Sample rate: 0 Hz\n" + NAMED + "".join(SINGLE)), "flagged", "not understood", ONE
    ),
    Fault(
        "a stated rate that contradicts the times",
        text("Sample rate: 51200 Hz\n" + WHOLE),
        "flagged",
        "the heading states 51200 Hz, the time column gives 8192 Hz",
        ONE,
    ),
    Fault(
        "two stated rates",
        text("Sample rate: 8192 Hz\nSampling frequency: 51200\n" + NAMED + "".join(SINGLE)),
        "flagged",
        "several sampling rates",
        ONE,
    ),
    Fault("a rate in words", text("Sample rate: fast\n" + NAMED + "".join(SINGLE)), "flagged", "not understood", ONE),
    Fault(
        "more names than columns", text("a,b,c\n" + "".join(PAIRS)), "refused", "line 1 names 3 columns, .* 2 fields"
    ),
    Fault("two columns of one name", text("a,a\n" + "".join(PAIRS)), "flagged", "'a#2'"),
    Fault("no names", text("".join(PAIRS)), "read", "", np.array([X, -X])),
    Fault(
        "a quote that is never closed",
        text('a,"b"\n' + "".join(PAIRS) + '"1,2\n' + "".join(PAIRS)),
        "refused",
        "a quote is opened and not closed|fields",
    ),
    Fault(
        "a quote never closed in one column", text('mic\n1.5\n"2.5\n3.5\n4.5\n'), "refused", "line 3: a quote is opened"
    ),
    Fault(
        "a zero byte",
        text((HEAD + "".join(ROWS)).encode() + b"\x00"),
        "refused",
        "no number|fields|cannot be read|line",
    ),
    Fault(
        "zeros where the disk was full",
        text((HEAD + "".join(ROWS)).encode() + bytes(4096)),
        "refused",
        "fields|no number|line",
    ),
    Fault("UTF-16 cut in a character", text((HEAD + "".join(ROWS)).encode("utf-16")[:-1]), "refused", "is no number"),
    Fault("UTF-16 of the other byte order", text(b"\xfe\xff" + WHOLE.encode("utf-16-be")), "read", "", ONE),
    Fault("UTF-16 without its mark", text(WHOLE.encode("utf-16-le")), "refused", "no CSV"),
    Fault("UTF-32", text(WHOLE.encode("utf-32")), "refused", "no CSV"),
    Fault(
        "Latin-1 among UTF-8", text("Zeit [s],Öl [m/s²]\n".encode("latin-1") + "".join(ROWS).encode()), "read", "", ONE
    ),
    Fault("a CR between quoted cells", rows(put(100, '0.01220703,"0.5"\r7\n')), "refused", "line 102: a CR between"),
    Fault(
        "a CR between quoted cells far behind the beginning",
        rows(put(70_000, '0.5,"0.5"\r7\n'), PAIRS * 240, "a [Pa],b [Pa]\n"),
        "refused",
        "line 70002",
    ),
    Fault("a quoted word of 140 000 letters above", text(f'note,"{"x" * 140_000}"\n' + WHOLE), "read", "", ONE),
    Fault("lines that end in CR alone", text(WHOLE.replace("\n", "\r")), "refused", "CR alone"),
    Fault("lines that end in CR LF and LF", text(WHOLE.replace("\n", "\r\n", 100)), "read", "", ONE),
    Fault(
        "a line of two megabytes",
        text(HEAD + "0.0," + "1" * 2_000_000 + "\n"),
        "refused",
        "longer|no row|no number|fields",
    ),
    Fault("20 000 columns", text((",".join(["1"] * 20_000) + "\n") * 5), "refused", "more than 10000 columns"),
    Fault("a formula in the heading", text('"=1+1",mic\n' + "".join(PAIRS)), "read", "", np.array([X, -X])),
    Fault("a heading in reversed writing", text("a\u202ecim,b\n" + "".join(PAIRS)), "flagged", "is shown as"),
    Fault("a number of a thousand digits", rows(put(150, f"{T[150]:.8f},{'9' * 1000}\n")), "read", ""),
    Fault("a heading of a page", text("remark\n" * 5000 + WHOLE), "read", "", ONE),
    Fault(
        "a web page",
        text("<!DOCTYPE html><html><body><p>Not found</p></body></html>\n"),
        "refused",
        "no row of numbers",
    ),
    *STARTS,
    *RATES,
    *WORDS,
    Fault("a workbook under the name of a text", text(b"PK\x03\x04" + bytes(200)), "refused", "packed archive"),
]
