"""Makers of small TDMS logs: by npTDMS's own writer, and bit by bit where that cannot write what loggers write."""

import struct
from pathlib import Path

import numpy as np
from log_makers import RATE_HZ, Made, signals

METADATA, NEW_LIST, RAW, INTERLEAVED, BIG, DAQMX = 2, 4, 8, 32, 64, 128
OPEN = 0xFFFFFFFFFFFFFFFF
SAME, NONE = "same", None
CODES = {
    **{f"i{2**n}": 1 + n for n in range(4)},
    **{f"u{2**n}": 5 + n for n in range(4)},
    "f4": 9,
    "f8": 10,
    "bool": 0x21,
    "time": 0x44,
    "text": 0x20,
    "c8": 0x08000C,
    "ext": 0x0B,
}
SCALER_CODES = {name: n for n, name in enumerate(("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"))}


def text(value, order="<"):
    raw = value if isinstance(value, bytes) else value.encode()
    return struct.pack(order + "I", len(raw)) + raw


def prop(name, value, order="<"):
    if isinstance(value, tuple):  # seconds since 1904 and 2**-64 s
        packed = struct.pack("<Qq", value[1], value[0]) if order == "<" else struct.pack(">qQ", *value)
        return text(name, order) + struct.pack(order + "I", 0x44) + packed
    if isinstance(value, str | bytes):
        return text(name, order) + struct.pack(order + "I", 0x20) + text(value, order)
    if isinstance(value, bool):
        return text(name, order) + struct.pack(order + "IB", 0x21, value)
    if isinstance(value, int):
        return text(name, order) + struct.pack(order + "II", 7, value)
    return text(name, order) + struct.pack(order + "Id", 10, value)


def plain(dtype, n, n_bytes=None, order="<"):
    """Raw data index of ordinary values."""
    index = struct.pack(order + "IIQ", CODES[dtype], 1, n)
    if n_bytes is not None:
        index += struct.pack(order + "Q", n_bytes)
    return struct.pack(order + "I", 4 + len(index)) + index


def daqmx(n, scalers, widths, order="<", code=0xFFFFFFFF, line=False):
    """Raw data index of DAQmx values; scalers are (type, buffer, byte or bit offset, scale)."""
    index = struct.pack(order + "IIQI", code, 1, n, len(scalers))
    for dtype, buffer, offset, scale in scalers:
        index += struct.pack(order + ("IIIBI" if line else "IIIII"), SCALER_CODES[dtype], buffer, offset, 0, scale)
    index += struct.pack(order + "I", len(widths)) + struct.pack(order + f"{len(widths)}I", *widths)
    return struct.pack(order + "I", 0x126A if line else 0x1269) + index


def segment(
    objects,
    values=b"",
    *,
    interleaved=False,
    order="<",
    new_list=True,
    metadata=True,
    raw=None,
    next_offset=None,
    raw_offset=None,
    padding=b"",
    version=4713,
    tag=b"TDSm",
    flags=0,
):
    """One segment; `objects` are (path, raw data index or SAME or NONE, properties)."""
    listed = b""
    if metadata:
        listed = struct.pack(order + "I", len(objects))
        for path, index, properties in objects:
            listed += text(path, order)
            listed += b"\xff" * 4 if index is NONE else b"\0" * 4 if index == SAME else index
            listed += struct.pack(order + "I", len(properties))
            listed += b"".join(prop(name, value, order) for name, value in properties.items())
    listed += padding
    toc = flags | METADATA * metadata | NEW_LIST * new_list | RAW * (bool(values) if raw is None else raw)
    toc |= INTERLEAVED * interleaved | BIG * (order == ">")
    raw_offset = len(listed) if raw_offset is None else raw_offset
    next_offset = len(listed) + len(values) if next_offset is None else next_offset
    head = tag + struct.pack("<I", toc) + struct.pack(order + "IQQ", version, next_offset, raw_offset)
    return head + listed + values


def wave(unit="m/s^2", rate=RATE_HZ, **more):
    return {"wf_increment": 1.0 / rate, "unit_string": unit, **more}


def linear(slope, intercept=0.0, index=1, source=0, count=2):
    name = f"NI_Scale[{index}]_"
    return {
        "NI_Number_Of_Scales": count,
        name + "Scale_Type": "Linear",
        name + "Linear_Slope": slope,
        name + "Linear_Y_Intercept": intercept,
        name + "Linear_Input_Source": source,
    }


def two(x, dtype="f8", order="<", interleaved=False, **properties):
    """Objects and values of two channels, motor and mic, in group log."""
    stored = x.astype(order + dtype)
    n = x.shape[1]
    objects = [
        ("/'log'/'motor'", plain(dtype, n, order=order), {**wave("m/s^2"), **properties}),
        ("/'log'/'mic'", plain(dtype, n, order=order), {**wave("Pa"), **properties}),
    ]
    return objects, (stored.T if interleaved else stored).tobytes()


def log(*parts):
    """A maker of a file of some bytes."""

    def make(folder: Path, name="a.tdms") -> Path:
        path = folder / name
        path.write_bytes(b"".join(parts))
        return path

    return make


def make_tdms(folder: Path) -> Made:
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    x = signals()
    with TdmsWriter(str(folder / "a.tdms")) as writer:
        head = [RootObject({"name": "run 7"}), GroupObject("log", {"description": "two sensors"})]
        for at in range(0, x.shape[1], 250):
            channels = [
                ChannelObject("log", name, row[at : at + 250], wave(unit))
                for name, unit, row in zip(("motor", "mic"), ("m/s^2", "Pa"), x, strict=True)
            ]
            writer.write_segment([*head, *channels])
            head = []
    return Made(folder / "a.tdms", ["motor", "mic"], x, 0.0)


def make_tdms_two_groups(folder: Path) -> Made:
    from nptdms import ChannelObject, TdmsWriter

    x = signals().astype(np.float32)
    with TdmsWriter(str(folder / "b.tdms"), version=4713) as writer:
        for group, row in zip(("motor", "car body"), x, strict=True):  # one channel behind the other
            writer.write_segment([ChannelObject(group, "z", row, wave("m/s^2"))])
    return Made(folder / "b.tdms", ["motor/z", "car body/z"], x.astype(np.float64), 0.0)


def make_tdms_interleaved_big_endian(folder: Path) -> Made:
    x = signals()
    objects, first = two(x[:, :500], "f8", ">", interleaved=True)
    again = [(path, SAME, {}) for path, _, _ in objects]
    second = x[:, 500:1000].T.astype(">f8").tobytes()
    last = [(path, plain("f8", 3, order=">"), {}) for path, _, _ in objects]
    (folder / "c.tdms").write_bytes(
        segment(objects, first, interleaved=True, order=">")
        + segment(again, second, interleaved=True, order=">", new_list=False)
        + segment(last, x[:, 1000:].T.astype(">f8").tobytes(), interleaved=True, order=">")
    )
    return Made(folder / "c.tdms", ["motor", "mic"], x, 0.0)


def make_tdms_daqmx(folder: Path) -> Made:
    """Two cards: 16-bit and 32-bit counts with a linear scale each, in segments of several chunks."""
    x = signals()
    n, slopes = 59, (2.0**-14, 2.0**-28)  # 17 chunks of 59
    counts = np.round(x / np.array(slopes)[:, None])
    objects = [
        ("/'log'/'motor'", daqmx(n, [("i2", 0, 2, 0)], [4, 4]), {**wave("m/s^2"), **linear(slopes[0])}),
        ("/'log'/'mic'", daqmx(n, [("i4", 1, 0, 0)], [4, 4]), {**wave("Pa"), **linear(slopes[1])}),
    ]
    chunks = []
    for at in range(0, x.shape[1], n):
        rows = np.zeros((n, 2), "<i2")
        rows[:, 1] = counts[0, at : at + n]
        chunks.append(rows.tobytes() + counts[1, at : at + n].astype("<i4").tobytes())
    (folder / "d.tdms").write_bytes(
        segment(objects, b"".join(chunks[:10]), flags=DAQMX) + segment([], b"".join(chunks[10:]), metadata=False)
    )
    return Made(folder / "d.tdms", ["motor", "mic"], x, 2.0**-15)


MAKERS = [make_tdms, make_tdms_two_groups, make_tdms_interleaved_big_endian, make_tdms_daqmx]
