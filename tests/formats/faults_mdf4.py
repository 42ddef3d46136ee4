"""Ways in which an MDF 4 log is broken or odd."""

import struct

import numpy as np
from fault_table import Fault
from mdf4_parts import (
    FLOAT_BE,
    RATE_HZ,
    SIGNAL,
    TIME,
    Parts,
    data_group,
    data_list,
    group,
    header,
    one_group,
    packed,
    rows,
)

N = 400
T = np.arange(N) / RATE_HZ
X = np.sin(0.1 * np.arange(N))
WRITTEN = X[None]


def put(folder, blob):
    (folder / "a.mf4").write_bytes(blob)
    return folder / "a.mf4"


def sound(**given):
    """A maker of one group with something changed."""
    made = given.pop("made", {})
    times = given.pop("times", T)
    return lambda folder: put(folder, one_group(times, given.pop("x", X[: len(times)]), **given).made(**made))


def of_counts():
    """A group of unsigned counts of which nothing says what they are."""
    raw = np.zeros((N, 10), np.uint8)
    raw[:, :8] = np.frombuffer(rows(T), np.uint8).reshape(N, 8)
    raw[:, 8:] = np.arange(N, dtype="<u2").view(np.uint8).reshape(N, 2)
    return one_group(T, None, (TIME, ("n", 8, {"data_type": 0, "bits": 16})), raw=raw.tobytes(), size=10)


def patched(tag, offset, value, width=8, **given):
    """A maker whose bytes at an offset in a block are set to a number."""

    def make(folder):
        parts = one_group(T, X, **given)
        blob = bytearray(parts.made())
        at = parts.at(tag, offset)
        blob[at : at + width] = int(value).to_bytes(width, "little")
        return put(folder, bytes(blob))

    return make


def linked(tag, index, target, data=None):
    """A maker in which a link of a block leads to another block, or to an address."""

    def make(folder):
        parts = one_group(T, X, data=data)
        blob = bytearray(parts.made())
        address = target if isinstance(target, int) else parts.at(target)
        at = parts.at(tag, 24 + 8 * index)
        blob[at : at + 8] = struct.pack("<Q", address)
        return put(folder, bytes(blob))

    return make


def cut(tag, offset):
    """A maker that ends the file at an offset behind the beginning of a block."""

    def make(folder):
        parts = one_group(T, X)
        blob = parts.made()
        return put(folder, blob[: parts.at(tag, offset)])

    return make


def ended_in_the_head(folder):
    return put(folder, one_group(T, X).made()[:40])


def in_a_list(parts, raw):
    return data_list(parts, [parts.add("DT", [], raw[:1000], "first"), parts.add("DT", [], raw[1000:])])


def in_dz(parts, raw):
    return parts.add("DZ", [], packed(raw), "data")


def in_dz_without_its_end(parts, raw):
    """The check sum of the packed bytes is missing; the bytes are all there."""
    body = packed(raw)
    n_packed = int.from_bytes(body[16:24], "little") - 4
    return parts.add("DZ", [], body[:16] + struct.pack("<Q", n_packed) + body[24:-4], "data")


def signal(**keywords):
    return (TIME, ("motor", 8, {"unit": "m/s^2", **keywords}))


def with_another(**keywords):
    """A maker of a sound channel and one more."""
    return sound(
        raw=rows(T, X, X),
        size=24,
        channels=(TIME, SIGNAL, ("other", 16, keywords)),
        n=N,
        data=keywords.pop("data", None),
    )


def two_groups(second_times, **second):
    def make(folder):
        parts = Parts()
        data = parts.add("DT", [], rows(second_times, np.ones(len(second_times))))
        options = {"n": len(second_times), "size": 16, "tag": "second", **second}
        later = data_group(parts, group(parts, [TIME, ("bus", 8, {})], **options), data, tag="later")
        data = parts.add("DT", [], rows(T, X))
        first = group(parts, [TIME, SIGNAL], n=N, size=16)
        return put(folder, header(parts, data_group(parts, first, data, later)).made())

    return make


def mixed(folder):
    """Two groups whose records follow each other in one run of bytes, each with its id."""
    parts = Parts()
    raw = b"".join(
        b"\1" + rows(T[i : i + 1], X[i : i + 1]) + b"\2" + rows(T[i : i + 1], X[i : i + 1]) for i in range(N)
    )
    second = group(parts, [TIME, ("mic", 8, {})], n=N, size=16, record_id=2)
    first = group(parts, [TIME, SIGNAL], second, n=N, size=16, record_id=1)
    return put(folder, header(parts, data_group(parts, first, parts.add("DT", [], raw), id_bytes=1)).made())


def foreign_ids(folder):
    raw = b"".join(bytes([1 + (i == 200)]) + rows(T[i : i + 1], X[i : i + 1]) for i in range(N))
    return put(folder, one_group(T, X, raw=raw, id_bytes=1, record_id=1).made())


def gap_in_a_long_log(folder):
    """Longer than what a scan looks at as a whole; the gap closes again before the next place that is looked at."""
    times = np.arange(1_200_000) / RATE_HZ
    times[100_000:100_010] += 0.4
    return put(folder, one_group(times, np.zeros(len(times))).made())


def marked(folder):
    bits = np.zeros((N, 1), np.uint8)
    bits[3:5] = 2
    raw = np.hstack([np.frombuffer(rows(T, X), np.uint8).reshape(N, 16), bits]).tobytes()
    return put(folder, one_group(T, X, signal(flags=2, invalid=1), raw=raw, invalid_bytes=1).made())


def lengths_open(folder):
    """The writer came to state neither the number of records nor the length of its data block, which is the last."""
    parts = one_group(T, X, n=0)
    parts.blocks.append(parts.blocks[parts.tags["data"]])
    data = len(parts.blocks) - 1
    parts.blocks[parts.tags["data group"]][1][2] = data
    parts.tags["data"] = data
    blob = bytearray(parts.made(b"UnFinMF ", unfinished=5))
    blob[parts.at("data", 8) : parts.at("data", 16)] = struct.pack("<Q", 24)
    return put(folder, bytes(blob) + b"\0" * 5)


def links_beyond_the_end(folder):
    """As before, and its last data block claims links that would lie behind the file's end."""
    blob = bytearray(lengths_open(folder).read_bytes())
    at = blob.rindex(b"##DT")
    blob[at + 8 : at + 24] = struct.pack("<QQ", 24 + 8 * 10**9, 10**9)
    return put(folder, bytes(blob))


GAPS = np.concatenate([T[:200], T[200:] + 0.5])
JITTER = T + 0.1 / RATE_HZ * np.where(np.arange(N) % 2, 1.0, -1.0)
MARKED = WRITTEN.copy()
MARKED[0, 3:5] = np.nan
EVIL = "__import__('os').system('touch executed')"

FAULTS = [
    Fault("ends in the identification", ended_in_the_head, "refused", "truncated: 40 bytes"),
    Fault("ends in the header", cut("header", 50), "refused", "truncated: the header"),
    Fault("ends before the data", cut("data", 0), "refused", "truncated"),
    Fault("ends in the data", cut("data", 1000), "refused", "truncated"),
    Fault("ends before the last block", cut("data group", 0), "refused", "outside its"),
    Fault("header of another kind", patched("header", 0, 0x58582323, 4), "refused", "begins with b'##XX'"),
    Fault("header shorter than its links", patched("header", 8, 30), "refused", "30 bytes with 6 links"),
    Fault("header of a trillion links", patched("header", 16, 2**40), "refused", "links in them"),
    Fault("group behind the file's end", linked("header", 0, 1 << 40), "refused", "outside its"),
    Fault("data groups in a circle", linked("data group", 0, "data group"), "refused", "runs in a circle"),
    Fault("channels in a circle", linked("channel motor", 0, "channel t"), "refused", "runs in a circle"),
    Fault("data lists in a circle", linked("list", 0, "list", in_a_list), "refused", "runs in a circle"),
    Fault("one data block named twice", linked("list", 2, "first", in_a_list), "refused", "belongs twice"),
    Fault(
        "list claims more than it names", patched("list", 52, 9, 4, data=in_a_list), "refused", "claims 9 data blocks"
    ),
    Fault(
        "more records than bytes", patched("group", 80, 2000), "refused", "claims 2000 records of 16 bytes.*holds 400"
    ),
    Fault("2^63 records", patched("group", 80, 2**63), "refused", "claims 9223372036854775808 records"),
    Fault(
        "fewer records than bytes", patched("group", 80, 300), "flagged", "1600 bytes behind its 300", WRITTEN[:, :300]
    ),
    Fault("records of no bytes", patched("group", 96, 0, 4), "refused", "of records that have 0"),
    Fault("records of 4 GB", patched("group", 96, 2**32 - 1, 4), "refused", "4194304 at most are read"),
    Fault(
        "channel beyond its record",
        patched("channel motor", 92, 9, 4),
        "refused",
        "bytes 9 to 17 of records that have 16",
    ),
    Fault("record ids of three bytes", patched("data group", 56, 3, 1), "refused", "record ids of 3 bytes"),
    Fault("ids of another group", foreign_ids, "refused", "record 200 .* id of another group"),
    Fault("packed block claims 60 MB", patched("data", 32, 60_000_000, data=in_dz), "refused", "exhaust the memory"),
    Fault("packed block claims a byte more", patched("data", 32, 6401, data=in_dz), "refused", "6401 bytes, 6400 were"),
    Fault("packed block claims fewer bytes", patched("data", 32, 6399, data=in_dz), "refused", "claims 400 records"),
    Fault("packed block is no deflate", patched("data", 48, 0, data=in_dz), "refused", "cannot be unpacked"),
    Fault("packed block without its check sum", sound(data=in_dz_without_its_end), "refused", "were unpacked: damaged"),
    Fault("packed bytes flipped", patched("data", 1000, 0x5A, 1, data=in_dz), "refused", "cannot be unpacked|damaged"),
    Fault("packed with Zstandard", patched("data", 26, 2, 1, data=in_dz), "refused", "Zstandard, which is not read"),
    Fault("packed bytes beyond the block", patched("data", 40, 10**9, data=in_dz), "refused", "damaged"),
    Fault("rows of no bytes", patched("data", 26, 1, 1, data=in_dz), "refused", "rows of 0 bytes"),
    Fault("a gap in time", sound(times=GAPS), "refused", "not even: steps from .* to 0.5"),
    Fault("a gap that the scan does not see", gap_in_a_long_log, "refused", "not evenly sampled: sample 100000"),
    Fault("time runs back", sound(times=T[::-1]), "refused", "do not increase"),
    Fault("time stands still", sound(times=np.zeros(N)), "refused", "do not increase"),
    Fault("time is no number", sound(times=np.where(np.arange(N) == 7, np.nan, T)), "refused", "are no numbers"),
    Fault("jitter of a tenth of a step", sound(times=JITTER), "flagged", "0.10 of a step: taken as even", WRITTEN),
    Fault("events of a bus beside a raster", two_groups(np.cumsum(np.arange(1, 90.0))), "flagged", "not even", WRITTEN),
    Fault("time in a unit of no time", sound(channels=(("t", 0, {**TIME[2], "unit": "K"}), SIGNAL)), "refused", "'K'"),
    Fault("sampled over an angle", sound(channels=(("a", 0, {"kind": 2, "sync": 2}), SIGNAL)), "refused", "an angle"),
    Fault("no time channel", sound(channels=(("a", 0, {}), SIGNAL)), "flagged", "rate is not known", np.array([T, X])),
    Fault("two samples", sound(times=T[:2]), "flagged", "cannot be told", WRITTEN[:, :2]),
    Fault("one sample", sound(times=T[:1]), "flagged", "no sampling rate", WRITTEN[:, :1]),
    Fault("texts", with_another(data_type=7), "flagged", "1 left out, they are texts: 'other'", WRITTEN),
    Fault("converted to texts", with_another(convert={"kind": 7, "values": (1.0,)}), "flagged", "to texts", WRITTEN),
    Fault(
        "a formula of code", with_another(convert={"kind": 3, "text": EVIL}), "flagged", "no code of a file", WRITTEN
    ),
    Fault("a formula of 9**9**9", with_another(convert={"kind": 3, "text": "X*0+9**9**9"}), "read"),
    Fault(
        "a factor of zero",
        with_another(convert={"kind": 1, "values": (1.0, 0.0)}),
        "flagged",
        "factor of zero",
        WRITTEN,
    ),
    Fault(
        "a factor that is no number",
        with_another(convert={"kind": 1, "values": (0.0, np.nan)}),
        "flagged",
        "no numbers",
    ),
    Fault(
        "a table upside down", with_another(convert={"kind": 4, "values": (2.0, 1.0, 1.0, 2.0)}), "flagged", "ascend"
    ),
    Fault("arrays", with_another(composition="CA"), "flagged", "are arrays", WRITTEN),
    Fault("structures", with_another(composition="CN"), "flagged", "are structures", WRITTEN),
    Fault("values of variable length", with_another(kind=1), "flagged", "variable length", WRITTEN),
    Fault("complex values", with_another(data_type=15), "flagged", "complex", WRITTEN),
    Fault("65 bits", with_another(data_type=0, bits=64, bit=1), "flagged", "64 bits from bit 1", WRITTEN),
    Fault("frames of a bus", two_groups(T, flags=2), "flagged", "frames of a bus", WRITTEN),
    Fault("a group without records", two_groups(T[:0]), "flagged", "hold no values", WRITTEN),
    Fault("records of two groups mixed", mixed, "refused", "not sorted"),
    Fault("all values marked invalid", with_another(flags=1), "flagged", "all marked invalid", WRITTEN),
    Fault("two values marked invalid", marked, "flagged", "2 of 400 samples are marked invalid", MARKED),
    Fault("an invalidation bit beyond the record", sound(channels=signal(flags=2, invalid=8)), "refused", "bit 8 of"),
    Fault(
        "one name twice",
        sound(raw=rows(T, X, X), size=24, channels=(TIME, SIGNAL, ("motor", 16, {})), n=N),
        "flagged",
        "several channels 'motor'",
        np.array([X, X]),
    ),
    Fault(
        "not finished: no number of records",
        sound(n=0, made={"magic": b"UnFinMF ", "unfinished": 1}),
        "flagged",
        "400 records are there, 0 were noted",
        WRITTEN,
    ),
    Fault("not finished: no length of the data", lengths_open, "flagged", "400 records are there", WRITTEN),
    Fault("not finished: links behind the end", links_beyond_the_end, "refused", "truncated: the data block"),
    Fault(
        "not finished: lists open", sound(made={"magic": b"UnFinMF ", "unfinished": 16}), "refused", "last list of data"
    ),
    Fault("not finished: own points", sound(made={"magic": b"UnFinMF ", "own": 4}), "refused", "own flags 0x4"),
    Fault(
        "long names that break lines and steer terminals, none of them read",
        sound(channels=(("t", 0, {"kind": 2, "sync": 2, "unit": "rad"}), ("n\r\n\x1b]0;\x07" * 3000, 8, {}))),
        "refused",
        r"no channel in it that can be read: 1 left out, they were sampled over .* \.\.\. ",
    ),
    Fault(
        "unsigned integers without a unit",
        lambda folder: put(folder, of_counts().made()),
        "flagged",
        r"unsigned integers of 16 bits .*offset binary\) is not known, 32768 is taken",
        np.arange(float(N))[None],
    ),
    Fault("MDF 3", sound(made={"version": b"3.30", "number": 330}), "refused", r"save it as MDF 4"),
    Fault("MDF 5", sound(made={"version": b"5.00", "number": 500}), "refused", "unknown version"),
    Fault("a start of a clock never set", sound(start_ns=315_532_800 * 10**9), "flagged", "1980-01-01", WRITTEN),
    Fault("no start", sound(start_ns=0), "read", values=WRITTEN),
    Fault("an offset from UTC of two months", sound(zone=32000, summer=32000), "flagged", "is no date", WRITTEN),
    Fault(
        "swapped bytes",
        sound(
            raw=np.column_stack([T, X]).astype(">f8").tobytes(),
            channels=(("t", 0, {**TIME[2], "data_type": FLOAT_BE}), ("motor", 8, {"data_type": FLOAT_BE})),
        ),
        "read",
        values=WRITTEN,
    ),
    Fault("values that are no numbers", sound(x=np.full(N, np.nan)), "read", values=np.full((1, N), np.nan)),
]
