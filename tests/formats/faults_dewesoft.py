"""Damaged Dewesoft files before the maker's real library, which crashes on some of them: its process alone ends.

Where the library is not installed, that is what is said.
"""

import struct

from fault_table import Fault

MAGICS = [b"MULTI_STREAM_FILE_VER" + version for version in (b"0100", b"0200", b"0201", b"0210")]
REFUSED = "maker's library|package dwdatareader"


def file_of(content):
    def make(folder):
        (folder / "a.dxd").write_bytes(content)
        return folder / "a.dxd"

    return make


def stream(number, name, at, size):
    """An entry of the table of contents, as public descriptions of the format show it."""
    return struct.pack("<Q", number) + name.ljust(8, b"\0") + struct.pack("<QQQxIx", at, at, size, 0x1E0)


def page(content, previous=-1, following=-1):
    return b"PAG1" + bytes(4) + struct.pack("<qq", previous, following) + bytes(8) + content


def indexed(index_at, content=b"", magic=MAGICS[3]):
    """A file with a table of contents at an offset, and what stands at the offset 512."""
    head = (magic + b"6\0\0\0Dewesoft_Data_7.x__dynamicVERX3").ljust(126, b"\0")
    head += struct.pack("<Q", 126) + b"___INDEX" + struct.pack("<QQQxIx", index_at, index_at, 0x3F8, 0x7E0) + b"NLKW"
    return file_of(head.ljust(512, b"\0") + content)


def contents(*entries, **links):
    found = page(struct.pack("<I", len(entries)) + b"".join(entries), **links)
    return found.ljust(512, b"\0") + page(b"<").ljust(8192, b"<")


FAULTS = [
    *(Fault(f"nothing but {magic.decode()}", file_of(magic), "refused", REFUSED) for magic in MAGICS),
    *(
        Fault(f"zeros behind {magic.decode()}", file_of(magic + bytes(4000)), "refused", REFUSED)
        for magic in MAGICS[:2]
    ),
    Fault("ones behind the first bytes", file_of(MAGICS[3] + b"\xff" * 4000), "refused", REFUSED),
    Fault("an index at the file's end", indexed(512), "refused", REFUSED),
    Fault("an index far behind the file's end", indexed(1 << 60, contents()), "refused", REFUSED),
    Fault("an index that is empty", indexed(512, contents()), "refused", REFUSED),
    Fault("an index whose pages run in a circle", indexed(512, contents(following=512)), "refused", REFUSED),
    Fault("a setup that is no XML", indexed(512, contents(stream(1, b"SETUP", 1024, 500))), "refused", REFUSED),
    Fault("a measurement of no bytes", indexed(512, contents(stream(4, b"MEASINFO", 1024, 0))), "refused", REFUSED),
    Fault(
        "streams of 2^60 bytes",
        indexed(512, contents(stream(4, b"MEASINFO", 1024, 1 << 60), stream(50, b"SETUP", 1024, 1 << 60))),
        "refused",
        REFUSED,
    ),
]
