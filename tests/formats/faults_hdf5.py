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


def gap_in_time(file):
    t = np.arange(N) / 8192.0
    t[300:] += 0.01
    file["time"], file["mic"] = t, X


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
    Fault("a time vector with a gap", written(gap_in_time), "flagged", "not equidistant"),
    Fault(
        "a time vector that falls",
        written(lambda file: file.update({"time": -np.arange(N) / 8192.0, "mic": X})),
        "read",
        "",
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
