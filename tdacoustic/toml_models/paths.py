r"""What a file that people write may name as a path.

The rule, for every path in campaigns, tables of runs and fleets:

* it names one file to *read*; nothing that such a file says is ever a place to write to;
* it is relative to the file that names it, and may go up with ``..``; an absolute path stands for itself. A backslash
  is read as ``/``;
* nothing in it is expanded: ``$X`` and ``%X%`` are letters, a leading ``~`` and an address with ``://`` are refused
  (a log alone may be named by one, which is opened only when the user says so: `address_problem`);
* a path to another machine (``//server/share``) and into the devices of Windows (``\\.\``, ``\\?\``, ``NUL``,
  ``file:stream``) is refused: opening it would send the user's name there, or wait for a device;
* what it names has to be a regular file when it is opened: no pipe, no device, nothing of ``/proc``. Symbolic links are
  followed: they are the folder's, as the files are.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated, Final

from pydantic import AfterValidator

from tdacoustic.errors import MissingFileError, TdacousticError

__all__ = [
    "MAX_FILE_BYTES",
    "MAX_PATH",
    "PathText",
    "address_problem",
    "is_address",
    "path_problem",
    "small_file",
]

MAX_PATH: Final = 1000
"""Characters of a path."""

MAX_PART_BYTES: Final = 255

MAX_FILE_BYTES: Final = 64 << 20
"""What a file that people write may hold."""

_DEVICES: Final = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³])\s*(\..*)?", re.IGNORECASE)


def path_problem(text: str, windows: bool = os.name == "nt") -> str | None:
    """Say what keeps a text from being a path, or return None where nothing does.

    Parameters
    ----------
    text : str
    windows : bool
        Whether its devices' names and its ``:`` are meant.

    Examples
    --------
    >>> path_problem("../../calibration/crrc-freight/fleet.toml") is None
    True
    >>> path_problem("https://example.com/a.wav")
    'is an address; name a file'
    """
    problem = _text_problem(text)
    if problem is not None:
        return problem
    if is_address(text):
        return "is an address; name a file"
    if text.startswith("~"):
        return "begins with '~', which is not expanded; write the folder, or './~'"
    text = text.replace("\\", "/")
    if any(len(part.encode()) > MAX_PART_BYTES for part in text.split("/")):
        return f"has a part of more than {MAX_PART_BYTES} bytes, which no file's name has"
    if text.startswith("//"):
        return "leads to another machine or a device; name a file of this machine, or give the share a drive letter"
    if windows:
        rest = re.sub(r"\A[A-Za-z]:(?=/)", "", text)
        if ":" in rest:
            return "has ':', which is no part of a file's name there"
        device = next((part for part in rest.split("/") if _DEVICES.fullmatch(part.rstrip(". "))), None)
        if device is not None:
            return f"names the device {device!r}"
    return None


def _text_problem(text: str) -> str | None:
    if not text.strip():
        return "is empty"
    if len(text) > MAX_PATH:
        return f"has {len(text)} characters, allowed are {MAX_PATH}"
    if any(ord(character) < 0x20 or 0x7F <= ord(character) <= 0x9F for character in text):
        return "has control characters"
    if any(0xD800 <= ord(character) <= 0xDFFF for character in text):
        return "is no valid Unicode"
    return None


def is_address(text: str) -> bool:
    """Say whether a text is an address (a URL) and no path.

    Parameters
    ----------
    text : str

    Examples
    --------
    >>> [is_address(text) for text in ("s3://bucket/run.h5", "C:/run.h5", "run.h5")]
    [True, False, False]
    """
    return re.match(r"[A-Za-z][A-Za-z0-9+.-]+:[\\/]{2}", text) is not None


def address_problem(text: str) -> str | None:
    """Say what keeps an address from being one that a log may be named by, or return None where nothing does.

    Parameters
    ----------
    text : str

    Examples
    --------
    >>> address_problem("s3://bucket/run.h5") is None
    True
    >>> address_problem("https://me:secret@example.com/run.h5")
    'holds a password, which everybody who reads the report would see'
    """
    problem = _text_problem(text)
    if problem is not None:
        return problem
    if "\\" in text or any(character.isspace() for character in text):
        return "has a backslash or a space, which no URL has"
    if "::" in text:
        return "has '::', an address within an address; name the log itself"
    host = text.split("://", 1)[1].split("/", 1)[0]
    if ":" in host.rpartition("@")[0]:
        return "holds a password, which everybody who reads the report would see"
    if not text.split("://", 1)[1].strip("/"):
        return "names no file"
    return None


def _path_text(text: str) -> str:
    problem = path_problem(text)
    if problem is not None:
        raise ValueError(f"must be a path: {text[:80]!r} {problem}")
    return text


PathText = Annotated[str, AfterValidator(_path_text)]
"""A path as written."""


def small_file(path: Path, error_type: type[TdacousticError]) -> bytes:
    """Return what a file that people write holds.

    Raises
    ------
    MissingFileError
        There is none, or it is no regular file.
    error_type
        It cannot be read, or is larger than such a file can be.
    """
    try:
        if not path.is_file():
            raise MissingFileError(f"{path}: {'is not a file' if path.exists() else 'no such file'}")
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise error_type(f"{path}: has {size} bytes, allowed are {MAX_FILE_BYTES}")
        # of files that claim no bytes and have some, as those of /proc, nothing is read: some never end
        return path.read_bytes() if size else b""
    except OSError as error:
        if isinstance(error, TdacousticError):
            raise
        raise error_type(f"{path}: cannot be read ({error.strerror})") from error
