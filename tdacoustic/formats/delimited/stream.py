"""Text files as streams of bytes in which the ASCII characters stand for themselves."""

from __future__ import annotations

import codecs
import io
from pathlib import Path
from typing import Any, BinaryIO

__all__ = ["decoded", "encoding_of", "open_text_bytes"]

UTF16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}


class _Transcoded(io.RawIOBase):
    """A UTF-16 file as UTF-8."""

    def __init__(self, stream: BinaryIO, encoding: str) -> None:
        self._stream = stream
        self._decoder = codecs.getincrementaldecoder(encoding)(errors="replace")
        self._ready = b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        while not self._ready:
            raw = self._stream.read(1 << 16)
            self._ready = self._decoder.decode(raw, final=not raw).encode("utf-8")
            if not raw:
                break
        count = min(len(buffer), len(self._ready))
        buffer[:count], self._ready = self._ready[:count], self._ready[count:]
        return count

    def close(self) -> None:
        self._stream.close()
        super().close()


def encoding_of(head: bytes) -> tuple[str, int]:
    """Encoding of a text, and the length of its byte order mark.

    UTF-8 and UTF-16 are known by their marks, UTF-8 also by its content; the rest is taken to be Latin-1.

    Examples
    --------
    >>> encoding_of("m/s²".encode("latin-1"))
    ('latin-1', 0)
    """
    if head.startswith(codecs.BOM_UTF8):
        return "utf-8", 3
    for mark, name in UTF16.items():
        if head.startswith(mark):
            return name, 2
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "latin-1", 0
    return "utf-8", 0


def open_text_bytes(path: Path, encoding: str, offset: int) -> BinaryIO:
    """Open a text for reading bytes, UTF-16 turned into UTF-8.

    Parameters
    ----------
    path : Path
    encoding : str
    offset : int
        Byte to begin with; of UTF-16 a byte of the UTF-8 that it becomes.
    """
    stream = path.open("rb")
    if not encoding.startswith("utf-16"):
        stream.seek(offset)
        return stream
    stream.seek(2)
    turned = io.BufferedReader(_Transcoded(stream, encoding), 1 << 20)
    while offset > 0:
        offset -= len(turned.read(min(offset, 1 << 20))) or offset
    return turned


def decoded(raw: bytes, encoding: str) -> str:
    """Text of bytes that `open_text_bytes` gave."""
    return raw.decode("latin-1" if encoding == "latin-1" else "utf-8", errors="replace")
