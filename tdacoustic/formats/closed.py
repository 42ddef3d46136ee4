"""Files that tdacoustic recognises and does not read, each with the way out of it.

Where no open reader is known, the program that wrote the file has to write it in a format that is read. What a row
states was looked up (`ClosedFormat.known_from`); where nothing was found that says it, it is marked ``[unverified]``.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import takewhile
from typing import Final

__all__ = ["CLOSED_FORMATS", "UNVERIFIED", "ClosedFormat", "closed_by_content", "closed_by_suffix"]

UNVERIFIED: Final = "[unverified]"
"""What `ClosedFormat.known_from` says where a row rests on what users call these files alone."""

_READ: Final = "UFF 58b, HDF5, MATLAB, ATFX or WAV"


@dataclass(frozen=True)
class ClosedFormat:
    """A kind of file that is recognised and not read.

    Parameters
    ----------
    title : str
        What it is, in words.
    suffixes : tuple of str
        Lower case, with the dot; those that alone say what a file is.
    remedy : str
        What to do, a sentence without its full stop.
    known_from : str
        Where suffix and first bytes were looked up, or `UNVERIFIED`.
    matches : callable or None
        Given the first bytes of a file, says whether it is this; None where only the suffix tells.
    is_wrapping : bool
        The bytes are those of a wrapping that many programs use: a suffix that is known says more.
    """

    title: str
    suffixes: tuple[str, ...]
    remedy: str
    known_from: str
    matches: Callable[[bytes], bool] | None = None
    is_wrapping: bool = False


def _begins(*magics: bytes) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(magics)


def _is_head(head: bytes) -> bool:
    """Whether one of the comment lines at the very beginning is the format's own."""
    comments = takewhile(lambda line: line.startswith(b";"), head.splitlines())
    return any(line.strip() == b"; HEAD acoustics datafile format" for line in comments)


def _is_id3(head: bytes) -> bool:
    """Whether the head of an ID3 tag of version 2 stands there, and not a word that begins with the same letters."""
    return len(head) >= 10 and head[:3] == b"ID3" and head[3] in (2, 3, 4) and head[4] == 0 and max(head[6:10]) < 0x80


def _is_tdm(head: bytes) -> bool:
    return head.lstrip(b"\xef\xbb\xbf\r\n\t ").startswith(b"<?xml") and b"<usi:tdm" in head


def _is_tar(head: bytes) -> bool:
    return head[257:265] in (b"ustar\x0000", b"ustar  \x00")


def _export(program: str, formats: str = _READ) -> str:
    return f"only {program} reads it: open it there and export the time signals as {formats}"


def _read_elsewhere(program: str, formats: str = _READ) -> str:
    return f"tdacoustic has no reader for it: export the time signals from {program} as {formats}"


CLOSED_FORMATS: Final[tuple[ClosedFormat, ...]] = (
    ClosedFormat(
        "a HEAD acoustics recording (its .hdf is not HDF5)",
        (".hdf",),
        _export("HEAD acoustics' ArtemiS SUITE", "WAV, UFF 58, ATFX or ASCII")
        + "; in WAV the full scale is not stated: note the range of each channel for full_scale",
        "comment line '; HEAD acoustics datafile format': public readers of SQobold recordings; WAV export: HEAD "
        "acoustics, application note Wave-Export 07/14; the other exports " + UNVERIFIED,
        _is_head,
    ),
    ClosedFormat(
        "an HDF4 file, which is another format than HDF5",
        (".hdf", ".h4", ".hdf4"),
        "convert it with the HDF Group's h4toh5 to HDF5",
        "first bytes 0E 03 13 01: filesignature.org and Wikipedia",
        _begins(b"\x0e\x03\x13\x01"),
    ),
    ClosedFormat(
        "a Simcenter Testlab throughput or project file",
        (".ldsf", ".lms", ".tdf", ".xtrp", ".trp"),
        _export("Simcenter Testlab", "UFF 58b (Export to Universal File), ATFX or WAV"),
        "universal file export: Siemens KB000046842; .trp and .xtrp: LMS Test.Lab Recorder Data Conversion manual 16A; "
        ".ldsf, .lms, .tdf " + UNVERIFIED,
    ),
    ClosedFormat(
        "a Brüel & Kjær PULSE or BK Connect file",
        (".bkc", ".pls"),
        _export("BK Connect or PULSE LabShop", "UFF 58b, WAV, HDF5 or MATLAB"),
        UNVERIFIED,
    ),
    ClosedFormat(
        "a Müller-BBM PAK measurement",
        (".pak", ".mea"),
        _export("PAK", "ATFX, UFF 58b or WAV"),
        UNVERIFIED,
    ),
    ClosedFormat(
        "an OROS NVGate signal file",
        (".oros", ".orx", ".orsx"),
        _export("NVGate", "text, UFF 58 or WAV (without 'Normalize', which takes the level away)"),
        "WAV and text export: wiki.oros.com; the suffixes " + UNVERIFIED,
    ),
    ClosedFormat(
        "an imc FAMOS file",
        (),  # .raw and .dat are many things
        _read_elsewhere("imc FAMOS or imc STUDIO", "ATFX, UFF 58, MATLAB or WAV"),
        "first bytes '|CF,2,1,1;|CK': description in the public readers raw_eater and IMCtermite",
        lambda head: re.match(rb"\|CF,\d+,\d+,\d+;", head) is not None,
    ),
    ClosedFormat(
        "the header of a National Instruments TDM file, whose numbers lie in the .tdx beside it",
        (".tdm", ".tdx"),
        _read_elsewhere("DIAdem or LabVIEW", "TDMS"),
        "XML beside a binary .tdx: public readers tdm_loader and TDMtermite",
        _is_tdm,
    ),
    ClosedFormat(
        "a LabVIEW measurement text",
        (".lvm",),
        _read_elsewhere("LabVIEW", "TDMS, or rename it to .txt where it is one table under one heading"),
        "first words 'LabVIEW Measurement': public reader lvm_read",
    ),
    ClosedFormat(
        "an enDAQ recording",
        (".ide",),
        _read_elsewhere("enDAQ Lab or with idelib", "CSV or MATLAB"),
        "EBML: documentation of idelib; first bytes 1A 45 DF A3: RFC 8794",
        _begins(b"\x1a\x45\xdf\xa3"),
    ),
    ClosedFormat(
        "a Dewesoft setup, which holds no samples",
        (".dxs", ".d7s"),
        "take the data file (.dxd) that was recorded with it",
        UNVERIFIED,
    ),
    ClosedFormat(
        "a workbook",
        (".xlsx", ".xls", ".xlsm", ".ods"),
        "save the sheet as CSV UTF-8",
        "first bytes D0 CF 11 E0 of .xls: file(1); .xlsx and .ods are ZIP archives: ECMA-376, OASIS ODF",
        _begins(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
        is_wrapping=True,
    ),
    ClosedFormat(
        "a packed archive",
        (".zip", ".7z", ".gz", ".bz2", ".xz", ".zst", ".rar", ".tar", ".tgz"),
        "unpack it and name the logs in it",
        "first bytes: file(1)",
        lambda head: (
            head.startswith((b"PK\x03\x04", b"PK\x05\x06", b"7z\xbc\xaf\x27\x1c", b"\x1f\x8b\x08"))
            or re.match(rb"BZh[1-9]1AY&SY", head) is not None
            or head.startswith((b"\xfd7zXZ\x00", b"\x28\xb5\x2f\xfd", b"Rar!\x1a\x07"))
            or _is_tar(head)
        ),
        is_wrapping=True,
    ),
    ClosedFormat("a PDF", (".pdf",), "a document holds no samples: name the log itself", "first bytes %PDF-: ISO 32000",
                 lambda head: re.match(rb"%PDF-\d\.\d", head) is not None),
    ClosedFormat(
        "a pickle of Python, which can run programs when it is opened",
        (".pkl", ".pickle", ".joblib"),
        "it is never opened here: save the numbers as HDF5 or WAV with the program that made it",
        "Python's documentation of pickle; first bytes 80 02 to 80 05 are protocols 2 to 5",
        lambda head: len(head) > 1 and head[0] == 0x80 and 2 <= head[1] <= 5,
    ),
    ClosedFormat(
        "an array of NumPy",
        (".npy", ".npz"),
        "it states neither rate nor unit: save it as HDF5, with both as attributes",
        "first bytes 93 NUMPY: NumPy's documentation of the format",
        _begins(b"\x93NUMPY"),
    ),
    ClosedFormat(
        "audio packed with loss",
        (".mp3", ".m4a", ".aac", ".ogg", ".opus", ".wma"),
        "what was left out cannot be measured: record WAV or FLAC",
        "page head 'OggS' of version 0: RFC 3533; tag 'ID3' of versions 2.2 to 2.4: id3.org, ID3v2.4 section 3.1",
        lambda head: head.startswith(b"OggS\x00") or _is_id3(head),
    ),
)  # fmt: skip
"""The table. Rows that content tells stand for themselves; the others are asked by suffix, after every format."""


def closed_by_content(suffix: str, head: bytes) -> ClosedFormat | None:
    r"""Row that the first bytes of a file name, None where they name none.

    Parameters
    ----------
    suffix : str
        Lower case; says which, where the bytes are those of a wrapping: a workbook is a ZIP archive too.
    head : bytes

    Examples
    --------
    >>> closed_by_content(".xlsx", b"PK\x03\x04").title
    'a workbook'
    >>> closed_by_content(".h5", b"PK\x03\x04").title
    'a packed archive'
    """
    found = next((row for row in CLOSED_FORMATS if row.matches is not None and row.matches(head)), None)
    if found is not None and found.is_wrapping:
        return closed_by_suffix(suffix) or found
    return found


def closed_by_suffix(suffix: str) -> ClosedFormat | None:
    """Row that a suffix names, where nothing in the file says more."""
    return next((row for row in CLOSED_FORMATS if suffix in row.suffixes), None)
