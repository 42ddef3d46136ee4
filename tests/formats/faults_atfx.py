"""How an ATFX file and its component files are broken."""

import re
from pathlib import Path

import numpy as np
from fault_table import Fault
from log_makers import RATE_HZ, signals
from makers_atfx import Atfx, make_atfx_components, make_atfx_inline, make_atfx_interleaved, numbers

N = 200
X = signals(N)[0]


def changed(make, old: str, new: str, count: int = 1):
    """A log of a maker with a piece of its XML replaced."""

    def write(folder: Path) -> Path:
        made = make(folder)
        path = made if isinstance(made, Path) else made.path
        text = path.read_text(encoding="utf-8")
        assert re.search(old, text), old
        path.write_text(re.sub(old, new, text, count=count), encoding="utf-8")
        return path

    return write


def cut(make, name: str, keep: float | int):
    """A log of a maker with one of its files cut short."""

    def write(folder: Path) -> Path:
        path = make(folder).path
        blob = (folder / name).read_bytes()
        (folder / name).write_bytes(blob[: int(len(blob) * keep) if isinstance(keep, float) else keep])
        return path

    return write


def single(blob: bytes | None = None, more=None, files=(("B", "run.bin"),), rows: int | None = N, **said):
    """A log of one channel: values in run.bin, or what `more(atfx)` puts in their place."""

    def write(folder: Path) -> Path:
        if files and not Path(files[0][1]).is_absolute() and ".." not in files[0][1]:
            (folder / files[0][1]).write_bytes(X.astype("<f4").tobytes() if blob is None else blob)
        atfx = Atfx(files=list(files))
        matrix = atfx.matrix(rows, said.pop("begin", "20141007171440"))
        atfx.time(matrix, atfx.unit("s", time=True))
        inner = atfx.component("values", "B", "ieeefloat4", N, block=4, per_block=1) if more is None else more(atfx)
        atfx.column(matrix, "mic", atfx.unit("Pa"), inner, **said)
        return atfx.write(folder / "log.atfx")

    return write


def inline(text: str, kind: str = "A_FLOAT64", **said):
    return single(more=lambda atfx: atfx.array("values", f"<{kind}>{text}</{kind}>"), files=(), **said)


def flagged(flags: str):
    values = f"<A_FLOAT64>{numbers(X)}</A_FLOAT64>"
    return single(more=lambda atfx: atfx.array("values", values) + atfx.array("flags", flags), files=())


def component(**layout):
    n, kind = layout.pop("n", N), layout.pop("kind", "ieeefloat4")
    return lambda atfx: atfx.component("values", "B", kind, n, **layout)


def over_axis(values: str, unit: str | None = "s", name: str = "Time", rows: int = N, time: bool = True, **said):
    """A log of one channel over a written axis."""

    def write(folder: Path) -> Path:
        atfx = Atfx()
        matrix = atfx.matrix(rows)
        axis = None if unit is None else atfx.unit(unit, time=time)
        inner = atfx.array("values", f"<A_FLOAT64>{values}</A_FLOAT64>") if values else ""
        atfx.column(matrix, name, axis, inner, **({"independent": 1} | said))
        atfx.column(matrix, "mic", atfx.unit("Pa"), atfx.array("values", f"<A_FLOAT64>{numbers(X)}</A_FLOAT64>"))
        return atfx.write(folder / "log.atfx")

    return write


def with_prologue(prologue: str, body=lambda text: text):
    def write(folder: Path) -> Path:
        path = make_atfx_inline(folder).path
        text = path.read_text(encoding="utf-8")
        path.write_text(prologue + body(text.partition("?>")[2]), encoding="utf-8")
        return path

    return write


def linked(folder: Path) -> Path:
    outside = folder / "outside"
    outside.mkdir()
    (outside / "secret.bin").write_bytes(X.astype("<f4").tobytes())
    (folder / "log").mkdir()
    path = single()(folder / "log")
    (folder / "log" / "run.bin").unlink()
    (folder / "log" / "run.bin").symlink_to(outside / "secret.bin")
    return path


def renamed(make, suffix: str):
    """A log of a maker under another suffix."""
    return lambda folder: (path := make(folder)).rename(path.with_suffix(suffix))


def unsigned(folder: Path) -> Path:
    """Counts of 16 bits, of which nothing says what they are."""
    (folder / "run.bin").write_bytes(INTEGERS.astype("<u2").tobytes())
    atfx = Atfx(files=[("B", "run.bin")])
    matrix = atfx.matrix(N)
    atfx.time(matrix, atfx.unit("s", time=True))
    atfx.column(matrix, "mic", None, atfx.component("values", "B", "dt_ushort", N, block=2, per_block=1))
    return atfx.write(folder / "log.atfx")


def missing(folder: Path) -> Path:
    path = single()(folder)
    (folder / "run.bin").unlink()
    return path


T = np.arange(N) / RATE_HZ
GAP = np.where(np.arange(N) < 90, T, T + 3 / RATE_HZ)
BACK = np.where(np.arange(N) == 50, T - 3 / RATE_HZ, T)
WITH_NAN = np.where(np.arange(N) == 50, np.nan, T)
HOLES = np.where(np.arange(N) % 3 == 0, np.nan, X)
FLAGS = " ".join("0" if i % 3 == 0 else "15" for i in range(N))
BOMB = "<!DOCTYPE a [" + '<!ENTITY a "aaaaaaaaaa">' + '<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">' + "]>"
SWAPPED = X.astype(">f4").tobytes()
INTEGERS = np.round(X * 1000).astype("<i2")


FAULTS = [
    # what the XML is
    Fault("XML cut in the middle of its values", cut(make_atfx_inline, "inline.atfx", 0.7), "refused", "truncated"),
    Fault("XML cut before its last tag", cut(make_atfx_inline, "inline.atfx", -13), "refused", "truncated"),
    Fault("XML cut in the application model", cut(make_atfx_inline, "inline.atfx", 3000), "refused", "truncated"),
    Fault("a tag that is not closed", changed(make_atfx_inline, "</instance_data>", ""), "refused", "not well-formed"),
    Fault(
        "a document type with entities",
        with_prologue(BOMB),
        "refused",
        "document type or entities",
    ),
    Fault(
        "an external document type",
        with_prologue('<!DOCTYPE atfx_file SYSTEM "http://example.org/a.dtd">'),
        "refused",
        "document type or entities",
    ),
    Fault(
        "an external entity",
        with_prologue('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>'),
        "refused",
        "document type or entities",
    ),
    Fault(
        "an entity that is not declared",
        changed(make_atfx_inline, "drive 1", "&nothing;"),
        "refused",
        "not well-formed",
    ),
    Fault(
        "XML nested without end",
        changed(make_atfx_inline, "<instance_data>", "<instance_data>" + "<a>" * 200),
        "refused",
        "nested more than",
    ),
    Fault("no application model", changed(make_atfx_inline, "(?s)<application_model>.*</application_model>", ""),
          "refused", "before its application model"),
    Fault("no instances", changed(make_atfx_inline, "(?s)<instance_data>.*</instance_data>", ""), "refused",
          "no local column"),
    Fault("two instances of one identifier",
          changed(make_atfx_inline, "<LocalColumn><Id>12<", "<LocalColumn><Id>10<"), "refused", "two instances"),
    # files
    Fault("component file absent", missing, "refused", r"component file 'run.bin' is not there"),
    Fault("component file cut", cut(make_atfx_interleaved, "data/run.bda", 0.9), "refused",
          "truncated: .*'(motor|mic)'"),
    Fault(
        "component file that lacks the last byte",
        single(X.astype("<f4").tobytes()[:-1]),
        "refused",
        "truncated: .*'mic'.* claims 200 values up to byte 800 .* has 799 bytes",
    ),
    Fault("component file empty", single(b""), "refused", "truncated"),
    Fault("component file of another folder", single(files=(("B", "../run.bin"),)), "refused", "log's own folder"),
    Fault("component file by an absolute path", single(files=(("B", "/etc/passwd"),)), "refused", "log's own folder"),
    Fault("component file by a path of Windows", single(files=(("B", "C:\\data\\run.bin"),)), "refused",
          "log's own folder"),
    Fault("component file by a link out of the folder", linked, "refused", "log's own folder"),
    Fault("component file by a URL", changed(single(), "run.bin", "file:run.bin"), "refused", "log's own folder"),
    Fault("identifier of no component file", changed(single(), "<identifier>B</identifier><datatype>",
          "<identifier>C</identifier><datatype>"), "refused", "no component file is called 'C'"),
    # layout of a component
    Fault("claims more values than its file", single(more=component(n=N + 1, block=4, per_block=1), rows=N + 1),
          "refused", "truncated"),
    Fault("claims values without end", single(more=component(n=10**17, block=4, per_block=1), rows=10**17), "refused",
          "truncated"),
    Fault("claims fewer values than its submatrix has rows", single(more=component(n=N - 5, block=4, per_block=1)),
          "refused", "'mic'.* has 195 values, its submatrix claims 200 rows"),
    Fault("blocks too small for their values", single(more=component(block=4, per_block=2)), "refused",
          "block of 4 bytes cannot hold 2 values of 4"),
    Fault("blocks of no bytes", single(more=component(block=0, per_block=1)), "refused", "0 bytes"),
    Fault("start offset behind the end", single(more=component(start=801, block=4, per_block=1)), "refused",
          "truncated"),
    Fault("start offset negative", single(more=component(start=-4, block=4, per_block=1)), "refused",
          "whole number >= 0"),
    Fault("value type unknown", single(more=component(kind="dt_quad", block=4, per_block=1)), "refused",
          "unknown type 'dt_quad'"),
    Fault("bytes swapped, the range stated", single(SWAPPED, minimum=-1.0, maximum=1.0), "flagged",
          "byte order or the scaling"),
    Fault("last block cut short behind its last value",
          single(np.repeat(X.astype("<f4"), 31).tobytes()[:-120], component(block=124, per_block=1)),
          "read", values=X[np.newaxis], tolerance=1e-7),
    # values in the XML
    Fault("fewer values than rows", inline(numbers(X[:-1])), "refused", "has 199 values, its submatrix claims 200"),
    Fault("more values than rows", inline(numbers(X) + " 1"), "refused", "has 201 values, its submatrix claims 200"),
    Fault("a value that is none", inline(numbers(X[:-1]) + " 1,5"), "refused", "'1,5' among its values is no number"),
    Fault("a value of a megabyte", inline(numbers(X[:-1]) + " " + "1" * (1 << 20)), "refused", "no number"),
    Fault("values that are NaN", inline(numbers(HOLES).replace("nan", "NaN")), "read", values=HOLES[np.newaxis]),
    Fault("values with an infinity", inline(numbers(X[:-1]) + " -INF"), "read",
          values=np.append(X[:-1], -np.inf)[np.newaxis]),
    Fault("unsigned integers without a unit", unsigned, "flagged",
          r"unsigned integers of 16 bits .*offset binary\) is not known, 32768 is taken",
          INTEGERS.astype("<u2").astype(float)[np.newaxis]),
    Fault("a time since 1970", over_axis(numbers(1700000000.25 + T)), "flagged",
          r"its start is 2023-11-14T22:13:20\.250000\+00:00, not 2014", X[np.newaxis], rate_hz=RATE_HZ),
    Fault("complex values", inline(numbers(X), "A_COMPLEX64"), "refused", "A_COMPLEX64"),
    Fault("texts as values", inline("<s>a</s>" * N, "A_UTF8STRING"), "refused", "A_UTF8STRING"),
    Fault("no values", single(more=lambda atfx: "", files=()), "refused", "'mic'.* has no values"),
    # what it is called
    *(
        Fault(f"{words} under {suffix}", renamed(make, suffix), "flagged",
              f"the suffix is {suffix}, the content is ASAM ODS ATFX", X[np.newaxis], 1e-6, RATE_HZ)
        for suffix in (".xml", ".txt", ".asc", ".csv")
        for words, make in (("values in the XML", inline(numbers(X))), ("component files", single()))
    ),
    # scaling
    Fault("raw values without a scaling", single(INTEGERS.tobytes(), component(kind="dt_short", block=2, per_block=1),
          sequence_representation="raw_linear_external"), "refused", "needs 2 as generation parameters"),
    Fault("a scaling that is NaN", single(INTEGERS.tobytes(), component(kind="dt_short", block=2, per_block=1),
          sequence_representation="raw_linear", generation_parameters="0 NaN"), "refused", "no numbers"),
    Fault("a scaling by 0", single(INTEGERS.tobytes(), component(kind="dt_short", block=2, per_block=1),
          sequence_representation="raw_linear", generation_parameters="0 0"), "refused", "factor of its values is 0"),
    Fault("a polynomial of another grade than its coefficients",
          single(INTEGERS.tobytes(), component(kind="dt_short", block=2, per_block=1),
                 sequence_representation="raw_polynomial", generation_parameters="3 0 1"), "refused", "a grade and"),
    Fault("a formula", single(sequence_representation="formula"), "refused", "formula, which is not read"),
    Fault("a sequence representation that is not known", single(sequence_representation="packed"), "refused",
          "'packed' is not known"),
    # flags
    Fault("flags of single values", flagged(FLAGS), "read", values=HOLES[np.newaxis]),
    Fault("fewer flags than values", flagged("15 15"), "refused", "200 values and 2 flags"),
    Fault("flags that are no flags", flagged(" ".join(["1e300"] * N)), "read", values=np.full((1, N), np.nan)),
    Fault("a global flag that says not valid", single(global_flag=0), "refused", "says that its values are not valid"),
    # axis and rate
    Fault("an increment of zero", changed(single(), "0.0 0.0001220703125", "0.0 0.0"), "flagged", "increment .* is 0"),
    Fault("an increment below zero", changed(single(), "0.0 0.0001220703125", "0.0 -0.1"), "flagged", "is -0.1"),
    Fault("an increment that is NaN", changed(single(), "0.0 0.0001220703125", "0.0 NaN"), "refused", "no numbers"),
    Fault("an increment so small that the rate is infinite", changed(single(), "0.0 0.0001220703125", "0.0 1e-320"),
          "flagged", "no sampling rate"),
    Fault("a time that goes back", over_axis(numbers(BACK)), "refused", "goes back in time"),
    Fault("a time with a gap", over_axis(numbers(GAP)), "refused", "unevenly spaced"),
    Fault("a time that stands still", over_axis(numbers(np.zeros(N))), "flagged", "increment .* is 0"),
    Fault("a time with NaN", over_axis(numbers(WITH_NAN).replace("nan", "NaN")), "refused", "no numbers"),
    Fault("an axis in hertz", over_axis(numbers(T), "Hz", "Frequency", time=False), "refused", "in 'Hz', not a time"),
    Fault("an axis that is an index", over_axis(numbers(np.arange(N)), None, "Index"), "flagged", "an index"),
    Fault("a time without a unit", over_axis(numbers(T), None), "flagged", "seconds are taken"),
    Fault("no column marked as the axis", over_axis(numbers(T), independent=0), "flagged", "'Time' is taken"),
    Fault("an implicit axis without parameters", over_axis("", sequence_representation="implicit_linear"), "refused",
          "needs 2 as generation parameters"),
    # instances
    Fault("a start that is no date", single(begin="20141399000000"), "flagged", "no instant"),
    Fault("a start that is the begin of a clock", single(begin="19040101000000"), "flagged", "no instant"),
    Fault("a start to the year", single(begin="2014"), "flagged", "no instant"),
    Fault("a unit whose factor contradicts its name",
          changed(single(), "<Name>Pa</Name><Factor>1.0</Factor>", "<Name>Pa</Name><Factor>1000.0</Factor>"),
          "flagged", "1 Pa is 1000"),
    Fault("a column of two submatrices",
          changed(make_atfx_inline, "</instance_data>", "<SubMatrix><Id>99</Id><LocalColumns>10</LocalColumns>"
                  "</SubMatrix></instance_data>"), "refused", "several submatrix"),
    Fault("external components in no order",
          changed(make_atfx_components, "<x_ordinal_number>2", "<x_ordinal_number>1"), "refused",
          "order is not clear"),
    Fault("two channels of one name", changed(make_atfx_inline, "<Name>mic</Name>", "<Name>motor</Name>", 9),
          "flagged", "several channels 'motor'"),
]  # fmt: skip
