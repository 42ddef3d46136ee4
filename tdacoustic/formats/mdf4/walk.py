"""The blocks of an MDF 4 file: heads, links and texts, each held against the file's size.

Layout after ASAM MDF 4: a block is ``##`` and two letters, four bytes, its length (u64), the number of its links
(u64), the links (u64 each, offsets in the file, 0 for none) and its fields. Everything is little endian.
"""

from __future__ import annotations

import html
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

from tdacoustic.errors import FormatError

__all__ = ["HEAD_BYTES", "Block", "Walk"]

HEAD_BYTES: Final = 24
MAX_BODY: Final = 64 << 20
"""Of a block of links and fields: a list of data blocks that are 4 MB long reaches it at 16 TB."""

MAX_TEXT: Final = 1 << 14
MAX_SHARED_TEXTS: Final = 10_000
_HEAD: Final = struct.Struct("<4s4xQQ")
_XML_TEXT: Final = re.compile(r"<TX[^>]{0,200}>([^<]*)</TX>")


@dataclass(frozen=True)
class Block:
    """One block.

    Parameters
    ----------
    path : Path
        Of the file, for messages.
    kind : str
        Its two letters.
    address : int
    links : tuple of int
    body : bytes
        The fields behind the links.
    """

    path: Path
    kind: str
    address: int
    links: tuple[int, ...]
    body: bytes

    def link(self, index: int) -> int:
        """Return a link, 0 where the block has fewer."""
        return self.links[index] if index < len(self.links) else 0

    def fields(self, layout: str, offset: int = 0) -> tuple[Any, ...]:
        """Return fields of the body.

        Raises
        ------
        FormatError
            The block is shorter.
        """
        needed = offset + struct.calcsize(layout)
        if needed > len(self.body):
            raise FormatError(
                f"{self.path}: damaged: the {self.kind} block at {self.address:#x} has {len(self.body)} bytes of "
                f"fields, {needed} are needed"
            )
        return struct.unpack_from(layout, self.body, offset)


class Walk:
    """Reads the blocks of an open file.

    Parameters
    ----------
    path : Path
    stream : BinaryIO
    size : int
        Of the file.
    """

    def __init__(self, path: Path, stream: BinaryIO, size: int) -> None:
        self.path, self.stream, self.size = path, stream, size
        self._texts: dict[int, str | None] = {}

    def head(self, address: int, kinds: tuple[str, ...], what: str) -> tuple[str, int, int]:
        """Return the kind, the length and the number of links of a block.

        Raises
        ------
        FormatError
            There is no block of such a kind, or it reaches beyond the file's end.
        """
        place = f"the {what} at {address:#x}"
        if not 64 <= address <= self.size - HEAD_BYTES:
            raise FormatError(f"{self.path}: truncated or damaged: {place} would lie outside its {self.size} bytes")
        self.stream.seek(address)
        raw = self.stream.read(HEAD_BYTES)
        if len(raw) < HEAD_BYTES:
            raise FormatError(f"{self.path}: truncated: it ends in {place}")
        mark, length, n_links = _HEAD.unpack(raw)
        kind = mark[2:].decode("latin-1")
        if mark[:2] != b"##" or kind not in kinds:
            raise FormatError(f"{self.path}: damaged: {place} begins with {mark!r}, not with ##{' or ##'.join(kinds)}")
        if length < HEAD_BYTES + 8 * n_links:
            raise FormatError(f"{self.path}: damaged: {place} claims {length} bytes with {n_links} links in them")
        return kind, length, n_links

    def check_inside(self, address: int, length: int, what: str) -> None:
        """Refuse a block that reaches beyond the file's end.

        Raises
        ------
        FormatError
            It does.
        """
        if address + length > self.size:
            raise FormatError(
                f"{self.path}: truncated: the {what} at {address:#x} claims {length} bytes, "
                f"the file holds {self.size - address} of them"
            )

    def block(self, address: int, kinds: tuple[str, ...], what: str) -> Block:
        """Return a block with its links and fields.

        Raises
        ------
        FormatError
            As `head`; or it is longer than any such block can be.
        """
        kind, length, n_links = self.head(address, kinds, what)
        self.check_inside(address, length, what)
        if length > MAX_BODY:
            raise FormatError(f"{self.path}: damaged: the {what} at {address:#x} claims {length} bytes")
        raw = self.stream.read(length - HEAD_BYTES)
        if len(raw) < length - HEAD_BYTES:
            raise FormatError(f"{self.path}: truncated: it ends in the {what} at {address:#x}")
        return Block(self.path, kind, address, struct.unpack_from(f"<{n_links}Q", raw), raw[8 * n_links :])

    def chain(self, address: int, kind: str, what: str) -> Iterator[Block]:
        """Yield the blocks of a list, each of which links to the next first.

        Raises
        ------
        FormatError
            As `block`; or the list runs in a circle.
        """
        seen: set[int] = set()
        while address:
            if address in seen:
                raise FormatError(f"{self.path}: damaged: the list of {what}s runs in a circle at {address:#x}")
            seen.add(address)
            block = self.block(address, (kind,), what)
            yield block
            address = block.link(0)

    def text(self, address: int) -> str | None:
        """Return a text: of a TX block, or the TX element of an MD block's XML, which is not parsed further.

        Raises
        ------
        FormatError
            As `head`.
        """
        if not address:
            return None
        if address in self._texts:
            return self._texts[address]
        kind, length, n_links = self.head(address, ("TX", "MD"), "text")
        self.check_inside(address, length, "text")
        self.stream.seek(8 * n_links, 1)
        raw = self.stream.read(min(length - HEAD_BYTES - 8 * n_links, MAX_TEXT))
        text = raw.partition(b"\0")[0].decode("utf-8", errors="replace")
        if kind == "MD":
            found = _XML_TEXT.search(text)
            text = html.unescape(found[1]) if found else ""
        said = text.strip() or None
        if len(self._texts) < MAX_SHARED_TEXTS:
            self._texts[address] = said
        return said
