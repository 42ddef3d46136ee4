"""Ways in which HDF5 files are broken, or reach for what is not theirs."""

import numpy as np
from fault_table import Fault
from log_makers import signals

N = 600
X = signals(N)[0]


def written(write, spoil=None, **options):
    """A file that `write` fills; `spoil` then changes its bytes."""

    def make(folder):
        import h5py

        path = folder / "a.h5"
        with h5py.File(path, "w", **options) as file:
            write(file)
        if spoil is not None:
            path.write_bytes(spoil(path.read_bytes()))
        return path

    return make


def one(file, **options):
    dataset = file.create_dataset("mic", data=X, **options)
    dataset.attrs.update(sample_rate_hz=8192.0, unit="Pa")
    return dataset


def with_attributes(**attributes):
    return written(lambda file: one(file).attrs.update(attributes))


def chunk_spoiled(folder):
    import h5py

    path = folder / "a.h5"
    with h5py.File(path, "w") as file:
        dataset = one(file, chunks=(200,), compression="gzip", fletcher32=True)
        at = dataset.id.get_chunk_info(1).byte_offset + 20
    blob = bytearray(path.read_bytes())
    blob[at : at + 8] = b"\xff" * 8
    path.write_bytes(blob)
    return path


def bit_in_data(folder):
    import h5py

    path = folder / "a.h5"
    with h5py.File(path, "w") as file:
        at = one(file, chunks=(200,), fletcher32=True).id.get_chunk_info(0).byte_offset
    blob = bytearray(path.read_bytes())
    blob[at + 9] ^= 0x10
    path.write_bytes(blob)
    return path


def foreign_filter(folder):
    """A dataset packed with a registered filter that HDF5 does not have itself (32015, Zstandard)."""
    import h5py

    path = folder / "a.h5"
    with h5py.File(path, "w") as file:
        one(file)
        file.create_dataset("packed", data=X, chunks=(200,), fletcher32=True)
    blob = path.read_bytes()
    # a filter pipeline message of version 1: one filter, six bytes of nothing, then the filter's number (3)
    message = b"\x01\x01" + bytes(6)
    assert blob.count(message + b"\x03\x00") == 1
    path.write_bytes(blob.replace(message + b"\x03\x00", message + (32015).to_bytes(2, "little")))
    return path


def outside(make_link):
    def make(folder):
        import h5py

        with h5py.File(folder / "secret.h5", "w") as file:
            file["x"] = np.ones(N)
        (folder / "secret.bin").write_bytes(np.ones(N).tobytes())
        with h5py.File(folder / "a.h5", "w") as file:
            one(file)
            make_link(h5py, file, folder)
        return folder / "a.h5"

    return make


def virtual(h5py, file, folder):
    layout = h5py.VirtualLayout(shape=(N,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(folder / "secret.h5"), "x", shape=(N,))
    file.create_virtual_dataset("v", layout)


def reference(h5py, file, folder):
    file["refs"] = np.array([file["mic"].ref], dtype=h5py.ref_dtype)
    file["regions"] = np.array([file["mic"].regionref[2:5]], dtype=h5py.regionref_dtype)
    file["mic"].attrs["sample_rate_hz"] = file["mic"].ref


def deep(file):
    group = file
    for _ in range(200):
        group = group.create_group("g")
    group["x"] = X
    one(file)


def cycles(file):
    one(file)
    file["a"] = file["/"]
    file["b/c"] = file["/"]


def uneven(file, beside=None, **attributes):
    """A group over a time with a gap; others of the file are not over it."""
    t = np.arange(N) / 8192.0
    t[300:] += 0.01
    file["slow/time"], file["slow/temperature"] = t, X
    file["slow/temperature"].attrs.update(attributes)
    if beside is not None:
        beside(file)


def neighbours(file):
    """One over an even time, one of another length in the group whose time is uneven, one with a rate of its own."""
    file["fast/time"], file["fast/mic"] = np.arange(N) / 8192.0, X
    file["slow/short"] = X[:90]
    file["slow/short"].attrs["fs"] = 8192.0
    one(file)


def from_instant(begin, **attributes):
    """A time vector that begins at some instant."""

    def write(file):
        file["time"], file["mic"] = begin + np.arange(N) / 8192.0, X
        file.attrs.update(attributes)

    return written(write)


def counts(dtype, scale=None, **attributes):
    """Integers, or floats, of which some stand for a missing value: the first, and the 100th to the 104th."""

    def write(file):
        stored = np.round(100.0 * X).astype(dtype)
        stored[[0, *range(100, 105)]] = attributes["missing_value" if "missing_value" in attributes else "_FillValue"]
        dataset = file.create_dataset("mic", data=stored)
        for name, value in attributes.items():
            dataset.attrs.create(name, value, dtype=None if name == "unit" else dtype)
        if scale is not None:
            dataset.attrs.update(scale_factor=scale, add_offset=-1.0)

    return written(write)


def with_units(units):
    def write(file):
        dataset = file.create_dataset("x", data=np.array([X, -X]).T)
        dataset.attrs.update(fs=8192.0, units=units)

    return written(write)


ONE = X[np.newaxis]
COUNTS = np.round(100.0 * X)
COUNTS[[0, *range(100, 105)]] = np.nan
UNIX = "its start is 2023-11-14T22:13:20.250000\\+00:00"
DOUBT = "may be of thousands or of decimals: no sampling rate is taken from it"
PULSES = X > 0.0

TIMES = [
    Fault("a time vector with a gap alone", written(uneven), "refused",
          "not evenly sampled and are not resampled \\('slow/time' is called a time .*: slow/temperature"),
    Fault("a time vector with a gap, beside others", written(lambda file: uneven(file, neighbours)), "flagged",
          "1 skipped, they are not evenly sampled and are not resampled \\('slow/time' .*: slow/temperature",
          [X, X, X[:90]], rate_hz=8192.0),
    Fault("a time vector with a gap, beside a stated rate", written(lambda file: uneven(file, neighbours, fs=8192.0)),
          "flagged", "not evenly sampled", [X, X, X[:90]], rate_hz=8192.0),
    Fault("an even and an uneven time of one length",
          written(lambda file: (uneven(file, neighbours), file.update({"slow/t": np.arange(N) / 8192.0}))), "flagged",
          "not evenly sampled", [X, X, X[:90]], rate_hz=8192.0),
    Fault("a temperature called T that rises unevenly",
          written(lambda file: file.update({"T": np.sqrt(np.arange(N)), "mic": X})), "read", "",
          [np.sqrt(np.arange(N)), X], rate_hz=None),
    Fault("temperatures called temps",
          written(lambda file: file.update({"temps": np.arange(N) + 50.0 * X, "mic": X})), "flagged", "does not rise",
          [X, np.arange(N) + 50.0 * X], rate_hz=None),
    Fault("a time vector that is nowhere a number",
          written(lambda file: file.update({"time": np.full(N, np.nan), "mic": X})), "flagged", "is not finite",
          rate_hz=None),
    Fault("a time vector since 1970", from_instant(1700000000.25), "flagged", UNIX, X[np.newaxis], rate_hz=8192.0),
    Fault("a time vector since 1970, and the start of another day",
          from_instant(1700000000.25, start_time="2023-11-12T22:13:20+00:00"), "flagged",
          UNIX + ", not 2023-11-12T22:13:20", X[np.newaxis]),
    Fault("a time vector since 1970 and a channel without a date",
          written(lambda file: (file.update({"g/t": 1.7e9 + np.arange(N) / 8192.0, "g/mic": X}), one(file))), "flagged",
          "its times say no date and those of others do", np.array([X, X])),
    Fault("a time vector since 1904", from_instant(3782844800.25), "flagged", "may be since 1904", X[np.newaxis],
          rate_hz=8192.0),
]  # fmt: skip
RATES = [
    *(
        Fault(f"a rate of {text!r}", with_attributes(sample_rate_hz=text), "flagged", DOUBT, ONE, rate_hz=None)
        for text in ("51,200", "51.200", "51,200 Hz", "1,024,000")
    ),
    *(
        Fault(f"a rate of {text!r}", with_attributes(sample_rate_hz=text), "read", "", X[np.newaxis], rate_hz=rate_hz)
        for text, rate_hz in {"51200,0": 51200.0, "8192.000": 8192.0, "8192.5 Hz": 8192.5}.items()
    ),
    Fault("an interval of '1.250'",
          written(lambda file: file.create_dataset("x", data=X).attrs.update(dt="1.250")), "flagged", DOUBT, ONE,
          rate_hz=None),
    Fault("a rate in doubt, and the same as a number above it",
          written(lambda file: (one(file).attrs.update(sample_rate_hz="51,200"), file.attrs.update(fs=51200.0))),
          "read", "", ONE, rate_hz=51200.0),
    *(
        Fault(f"an attribute {name} that is a time",
              written(lambda file, name=name: (file.attrs.update({name: 0.5}),
                                               file.create_dataset("x", data=X).attrs.update({name: 0.5}))),
              "read", "", X[np.newaxis], rate_hz=None)
        for name in ("t_s", "t", "time_s", "T_s", "time")
    ),
]  # fmt: skip
VALUES = [
    Fault("true and false", written(lambda file: file.create_dataset("tacho", data=PULSES)), "flagged",
          "logical values: 0 and 1", PULSES[np.newaxis].astype(float)),
    Fault("true and false in two columns, packed",
          written(lambda file: file.create_dataset("d", data=np.array([PULSES, ~PULSES]).T, compression="gzip")),
          "flagged", "logical values", np.array([PULSES, ~PULSES]).astype(float)),
    Fault("integers with a _FillValue", counts("<i2", 0.01, _FillValue=-32768, unit="Pa"), "flagged",
          r"6 of 600 samples are missing \(_FillValue = -32768\) and read as NaN", 0.01 * COUNTS[np.newaxis] - 1.0,
          1e-12),
    Fault("integers of another machine with a missing_value", counts(">i4", missing_value=-9999, unit="Pa"), "flagged",
          r"6 of 600 samples are missing \(missing_value = -9999\)", COUNTS[np.newaxis]),
    Fault("floats with a _FillValue", counts("<f4", _FillValue=9.96921e36, unit="Pa"), "flagged",
          r"6 of 600 samples are missing \(_FillValue = 9.96921", COUNTS[np.newaxis]),
    Fault("several missing values",
          written(lambda file: file.create_dataset("x", data=np.array([1.0, -99.0, 2.0, -98.0]))
                  .attrs.update(missing_value=[-98.0, -99.0])), "flagged", "2 of 4 samples",
          np.array([[1.0, np.nan, 2.0, np.nan]])),
    Fault("a missing value in one of two columns",
          written(lambda file: file.create_dataset("x", data=np.array([[1.0, 2.0], [3.0, -9.0], [5.0, 6.0]]))
                  .attrs.update(_FillValue=-9.0)), "flagged", "1 of 3 samples",
          np.array([[1.0, 3.0, 5.0], [2.0, np.nan, 6.0]])),
    Fault("a _FillValue that no sample has", with_attributes(_FillValue=-9999.0), "read", "", X[np.newaxis]),
    Fault("a _FillValue that the type cannot hold",
          written(lambda file: file.create_dataset("x", data=np.arange(-5, 5, dtype="i1"))
                  .attrs.update(_FillValue=-9999, unit="Pa")), "read", "", np.arange(-5.0, 5.0)[np.newaxis]),
    Fault("a _FillValue in words", with_attributes(_FillValue="none"), "read", "", X[np.newaxis]),
    Fault("a unit that is an array of one", with_attributes(unit=np.array([b"g"])), "read", "", X[np.newaxis]),
    Fault("a unit for each column", with_units(np.array([b"g", b"Pa"])), "flagged",
          "'units' holds several values: the unit is not known", np.array([X, -X])),
    Fault("unsigned integers without a unit",
          written(lambda file: file.create_dataset("x", data=np.arange(10, dtype="u2"))), "flagged",
          r"unsigned integers of 16 bits .*offset binary\) is not known, 32768 is taken", np.arange(10.0)[np.newaxis]),
    Fault("unsigned integers with a unit", written(lambda file: file.create_dataset("x", data=np.arange(10, dtype="u2"))
          .attrs.update(unit="Pa")), "read", "", np.arange(10.0)[np.newaxis]),
]  # fmt: skip


NAN = np.array([1.0, np.nan, np.inf, -np.inf, *range(50)])

FAULTS = [
    *(
        Fault(
            f"cut to {part:.0%}",
            written(one, lambda blob, part=part: blob[: int(part * len(blob))]),
            "refused",
            "truncated|damaged|no HDF5|is no|not known",
        )
        for part in (0.002, 0.05, 0.3, 0.6, 0.9, 0.999)
    ),
    Fault("garbage behind the end", written(one, lambda blob: blob + b"garbage" * 100), "read", "", X[np.newaxis]),
    Fault("a user block before it", written(one, userblock_size=512), "read", "", X[np.newaxis]),
    Fault(
        "the superblock's version is 9", written(one, lambda blob: blob[:8] + b"\x09" + blob[9:]), "refused", "damaged"
    ),
    Fault("offsets of 3 bytes", written(one, lambda blob: blob[:13] + b"\x03" + blob[14:]), "refused", "damaged"),
    Fault(
        "the end of the file lies beyond it",
        written(one, lambda blob: blob[:40] + b"\xff\xff\xff\x7f" + blob[44:]),
        "refused",
        "truncated",
    ),
    Fault("a packed chunk is damaged", chunk_spoiled, "refused", "damaged"),
    Fault("a bit of the samples is flipped under a checksum", bit_in_data, "refused", "damaged"),
    Fault(
        "never written",
        written(lambda file: file.create_dataset("mic", (N,), "f8").attrs.update(fs=8192.0)),
        "flagged",
        "never written",
        np.zeros((1, N)),
    ),
    Fault(
        "claims 10^12 samples of which none is stored",
        written(lambda file: (one(file), file.create_dataset("x", (10**12,), "f8", chunks=(1024,)))),
        "flagged",
        "claim more than the bytes stored",
        X[np.newaxis],
    ),
    Fault(
        "chunks of 2 GB",
        written(
            lambda file: (one(file), file.create_dataset("x", (2**31,), "i1", chunks=(2**31,), compression="gzip"))
        ),
        "flagged",
        "more than 256 MiB",
        X[np.newaxis],
    ),
    Fault(
        "a filter that HDF5 would load from a folder of programs",
        foreign_filter,
        "flagged",
        "packed with filter 32015.*no program is loaded",
        X[np.newaxis],
    ),
    Fault(
        "a link into another file",
        outside(lambda h5py, file, folder: file.__setitem__("x", h5py.ExternalLink(str(folder / "secret.h5"), "/x"))),
        "flagged",
        "links and were not followed",
        X[np.newaxis],
    ),
    Fault(
        "a link to nowhere",
        outside(lambda h5py, file, folder: file.__setitem__("x", h5py.SoftLink("/none"))),
        "flagged",
        "links and were not followed",
        X[np.newaxis],
    ),
    Fault("a virtual dataset of another file", outside(virtual), "flagged", "virtual", X[np.newaxis]),
    Fault(
        "samples in another file",
        outside(
            lambda h5py, file, folder: file.create_dataset(
                "x", (N,), "f8", external=[(str(folder / "secret.bin"), 0, 8 * N)]
            )
        ),
        "flagged",
        "in other files",
        X[np.newaxis],
    ),
    Fault("references in place of numbers", outside(reference), "flagged", "not numeric", X[np.newaxis]),
    Fault("groups 200 deep", written(deep), "flagged", "nested more than 32 deep", X[np.newaxis]),
    Fault("groups that hold themselves", written(cycles), "flagged", "second names", X[np.newaxis]),
    Fault("a rate of zero", with_attributes(sample_rate_hz=0.0), "refused", "'mic': sample_rate_hz must be > 0, got 0"),
    Fault("a negative rate", with_attributes(sample_rate_hz=-8192.0), "refused", "must be > 0"),
    Fault("a rate of NaN", with_attributes(sample_rate_hz=np.nan), "read", "", X[np.newaxis]),
    Fault(
        "a rate that is an array of a million",
        written(lambda file: one(file).attrs.create("fs", np.ones(1_000_000)), libver="latest"),
        "read",
        "",
        X[np.newaxis],
    ),
    Fault(
        "an attribute whose name is not UTF-8",
        written(
            lambda file: one(file).attrs.update({"Gehäuse": 1.0}), lambda blob: blob.replace("ä".encode(), b"\xe4_")
        ),
        "read",
        "",
        X[np.newaxis],
    ),
    Fault("a rate in words", with_attributes(sample_rate_hz="fast"), "read", "", X[np.newaxis]),
    Fault(
        "a unit of a thousand characters",
        with_attributes(unit="Pa" * 500),
        "flagged",
        "unit.*is shown as",
        X[np.newaxis],
    ),
    Fault(
        "a quantity nobody knows", with_attributes(quantity="loudness"), "flagged", "quantity 'loudness'", X[np.newaxis]
    ),
    Fault(
        "a start that is no date",
        written(lambda file: (one(file), file.attrs.update(start_time="yesterday"))),
        "flagged",
        "'yesterday' is no date",
        X[np.newaxis],
    ),
    Fault(
        "a name with controls and reversed writing",
        written(lambda file: file.create_dataset("m\x1b[1m\u202eic", data=X)),
        "flagged",
        "is shown as",
        X[np.newaxis],
    ),
    *TIMES,
    *RATES,
    *VALUES,
    Fault(
        "a time vector that falls",
        written(lambda file: file.update({"time": -np.arange(N) / 8192.0, "mic": X})),
        "flagged",
        "'time' is called a time but does not rise",
        rate_hz=None,
    ),
    Fault(
        "an attribute and a time vector that disagree",
        written(lambda file: (file.create_dataset("time", data=np.arange(N) / 4096.0), one(file))),
        "flagged",
        "the attribute is taken",
        X[np.newaxis],
    ),
    Fault(
        "NaN and infinity among the samples",
        written(lambda file: file.create_dataset("mic", data=NAN)),
        "read",
        "",
        NAN[np.newaxis],
    ),
    Fault(
        "swapped bytes",
        written(lambda file: file.create_dataset("mic", data=X.astype(">f8"))),
        "read",
        "",
        X[np.newaxis],
    ),
    Fault("nothing but text", written(lambda file: file.update({"text": "hello"})), "refused", "no numeric dataset"),
    Fault(
        "nothing but texts, whose long names break lines and steer terminals",
        written(lambda file: [file.create_dataset(f"{n}\n\x1b[2J\u202e{'n' * 9000}", data="a") for n in range(9)]),
        "refused",
        r"no numeric dataset .*n \.\.\. n.*, \.\.\.\)$",
    ),
    Fault(
        "a square matrix",
        written(lambda file: file.create_dataset("m", data=np.eye(4))),
        "flagged",
        "as many rows as columns",
        np.eye(4),
    ),
    Fault(
        "another version of our own layout",
        written(lambda file: (one(file), file.attrs.update(schema="tdacoustic-log/9"))),
        "flagged",
        "this version knows",
        X[np.newaxis],
    ),
    Fault(
        "a MATLAB head before it is cut",
        written(one, lambda blob: b"\x00" * 512 + blob[:900]),
        "refused",
        "truncated|damaged",
    ),
]
