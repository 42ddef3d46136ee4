"""MDF 4 files from nothing but struct and zlib, for what no library writes; asammdf reads the sound ones."""

import struct
import zlib

import numpy as np

RATE_HZ = 8192.0
UNSIGNED, UNSIGNED_BE, SIGNED, SIGNED_BE, FLOAT, FLOAT_BE = range(6)


class Parts:
    """Blocks by number; links are numbers of blocks, turned into addresses when the bytes are made."""

    def __init__(self):
        self.blocks = []
        self.tags = {}
        self.addresses = []

    def add(self, kind, links, body, tag=None):
        self.blocks.append((kind, list(links), body))
        if tag:
            self.tags[tag] = len(self.blocks) - 1
        return len(self.blocks) - 1

    def text(self, text, kind="TX"):
        return None if text is None else self.add(kind, [], text.encode() + b"\0")

    def at(self, tag, offset=0):
        """Address of a block, or of a byte in it."""
        return self.addresses[self.tags[tag]] + offset

    def made(self, magic=b"MDF     ", version=b"4.10", unfinished=0, own=0, number=410):
        self.addresses, at = [], 64
        for _, links, body in self.blocks:
            self.addresses.append(at)
            at += (24 + 8 * len(links) + len(body) + 7) // 8 * 8
        blob = magic + version.ljust(8, b"\0") + b"tests\0\0\0" + struct.pack("<4xH30xHH", number, unfinished, own)
        for kind, links, body in self.blocks:
            head = b"##" + kind.encode() + struct.pack("<4xQQ", 24 + 8 * len(links) + len(body), len(links))
            places = [0 if link is None else self.addresses[link] for link in links]
            blob += head + struct.pack(f"<{len(links)}Q", *places) + body
            blob += b"\0" * (-len(blob) % 8)
        return blob


def conversion(parts, kind, values=(), text=None, unit=None, references=()):
    links = [None, parts.text(unit), None, None, *references]
    if text is not None:
        links.append(parts.text(text))
    head = struct.pack("<BBHHHdd", kind, 0, 0, len(links) - 4, len(values), 0.0, 0.0)
    return parts.add("CC", links, head + struct.pack(f"<{len(values)}d", *values), "conversion")


def channel(parts, following, name, offset, **given):
    """One CN block; the blocks of a list are made from its end."""
    kind, sync, data_type = given.get("kind", 0), given.get("sync", 0), given.get("data_type", FLOAT)
    composition = given.get("composition")
    linked = None if composition is None else parts.add(composition, [None], b"\0" * 48)
    convert = given.get("convert")
    if convert is not None:
        convert = conversion(parts, **convert)
    links = [following, linked, parts.text(name), None, convert, None, parts.text(given.get("unit")), None]
    body = struct.pack("<BBBB", kind, sync, data_type, given.get("bit", 0))
    body += struct.pack("<IIII", offset, given.get("bits", 64), given.get("flags", 0), given.get("invalid", 0))
    body += struct.pack("<BBHdddddd", 0, 0, 0, *[0.0] * 6)
    return parts.add("CN", links, body, given.get("tag", f"channel {name}"))


def group(parts, channels, following=None, **given):
    """One CG block; `channels` is a list of (name, byte offset, keywords)."""
    first = None
    for name, offset, keywords in reversed(channels):
        first = channel(parts, first, name, offset, **keywords)
    head = struct.pack("<QQHH4xII", given.get("record_id", 0), given["n"], given.get("flags", 0), 0, given["size"], 0)
    body = head[:-4] + struct.pack("<I", given.get("invalid_bytes", 0))
    links = [following, first, parts.text(given.get("name")), None, None, None]
    if "master" in given:
        links.append(given["master"])
    return parts.add("CG", links, body, given.get("tag", "group"))


def data_group(parts, groups, data, following=None, id_bytes=0, tag="data group"):
    return parts.add("DG", [following, groups, data, None], struct.pack("<B7x", id_bytes), tag)


def packed(data, columns=0, packing=None):
    """Body of a DZ block."""
    plain = data
    if columns:
        n_rows = len(data) // columns
        whole = n_rows * columns
        plain = np.frombuffer(data[:whole], np.uint8).reshape(n_rows, columns).T.tobytes() + data[whole:]
    content = zlib.compress(plain)
    packing = (1 if columns else 0) if packing is None else packing
    return b"DT" + struct.pack("<BxIQQ", packing, columns, len(data), len(content)) + content


def data_list(parts, blocks, tag="list"):
    offsets = struct.pack(f"<{len(blocks)}Q", *[0] * len(blocks))
    return parts.add("DL", [None, *blocks], struct.pack("<B3xI", 0, len(blocks)) + offsets, tag)


def columns(parts, blocks, invalid=()):
    """An LD block of DV blocks, and of DI blocks where there are any."""
    flags = 0x80000000 if invalid else 0
    body = struct.pack("<II", flags, len(blocks)) + struct.pack(f"<{len(blocks)}Q", *[0] * len(blocks))
    return parts.add("LD", [None, *blocks, *invalid], body)


def in_columns(times, x, marks, step=100, claimed=None):
    """Times and values in groups of their own (MDF 4.2), the values with invalidation bits that lie apart."""
    parts = Parts()

    def blocks(kind, values):
        return [parts.add(kind, [], values[at : at + step].tobytes()) for at in range(0, len(values), step)]

    n = len(times) if claimed is None else claimed
    clock = group(parts, [TIME], n=len(times), size=8, tag="clock")
    options = {"n": n, "size": 8, "flags": 8, "invalid_bytes": 1, "master": clock}
    values = group(parts, [("motor", 0, {"unit": "m/s^2", "flags": 2, "invalid": 0})], **options)
    bits = np.asarray(marks, dtype=np.uint8)
    later = data_group(parts, values, columns(parts, blocks("DV", x), blocks("DI", bits)), tag="later")
    return header(parts, data_group(parts, clock, columns(parts, blocks("DV", times)), later))


def header(parts, first, start_ns=1_790_000_000_123_456_000, zone=60, summer=60, flags=2):
    """The HD block, which has to lie first: `Parts.blocks` is turned so that it does."""
    body = struct.pack("<QhhBBBxdd", start_ns, zone, summer, flags, 0, 0, 0.0, 0.0)
    parts.add("HD", [first, None, None, None, None, None], body, "header")
    order = [len(parts.blocks) - 1, *range(len(parts.blocks) - 1)]
    new = {old: at for at, old in enumerate(order)}
    parts.blocks = [
        (kind, [None if link is None else new[link] for link in links], content)
        for kind, links, content in (parts.blocks[old] for old in order)
    ]
    parts.tags = {tag: new[old] for tag, old in parts.tags.items()}
    return parts


TIME = ("t", 0, {"kind": 2, "sync": 1, "unit": "s"})
SIGNAL = ("motor", 8, {"unit": "m/s^2"})


def rows(times, *columns):
    """Records of float64."""
    return np.column_stack([times, *columns]).astype("<f8").tobytes()


def one_group(times, x, channels=(TIME, SIGNAL), data=None, **given):
    """A file of one group of float64 records, as `Parts`; `data` makes the data block of the records."""
    parts = Parts()
    raw = given.pop("raw", None)
    raw = rows(times, x) if raw is None else raw
    head = {key: given.pop(key) for key in ("start_ns", "zone", "summer") if key in given}
    time_flags = given.pop("time_flags", 2)
    block = parts.add("DT", [], raw, "data") if data is None else data(parts, raw)
    id_bytes = given.pop("id_bytes", 0)
    given.setdefault("n", len(times))
    given.setdefault("size", 16)
    made = group(parts, list(channels), **given)
    return header(parts, data_group(parts, made, block, id_bytes=id_bytes), flags=time_flags, **head)
