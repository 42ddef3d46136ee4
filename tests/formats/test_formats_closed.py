"""Files that are recognised and not read: what the message says, and that what is read goes before it."""

import zipfile

import h5py
import numpy as np
import pytest
from log_makers import all_makers

from tdacoustic.errors import FormatError
from tdacoustic.formats import FORMATS, scan
from tdacoustic.formats.closed import CLOSED_FORMATS, UNVERIFIED, closed_by_content

HEAD_HDF = b"; Copyright HEAD acoustics\n; HEAD acoustics datafile format\nstart of data: 16384\nnbr of channel: 2\n"

BY_CONTENT = {
    "run.hdf": (HEAD_HDF + bytes(3000), "HEAD acoustics recording", "ArtemiS SUITE"),
    "renamed.h5": (HEAD_HDF + bytes(3000), "HEAD acoustics recording", "WAV"),
    "modis.hdf": (b"\x0e\x03\x13\x01" + bytes(3000), "HDF4", "h4toh5"),
    "channel.raw": (b"|CF,2,1,1;|CK,1,3,1,1;\n|NO,1,86,0,78,imc STUDIO 5.0;", "imc FAMOS", "ATFX"),
    "channel.dat": (b"|CF,2,1,1;|CK,1,3,1,1;\n", "imc FAMOS", "ATFX"),
    "a.tdm": (b'<?xml version="1.0"?>\n<usi:tdm xmlns:usi="http://www.ni.com/Schemas/USI/1_0" version="1.0">', "TDM",
              "TDMS"),
    "a.ide": (b"\x1a\x45\xdf\xa3\x42\x82\x84mide" + bytes(100), "enDAQ", "idelib"),
    "a.xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "workbook", "CSV"),
    "logs.7z": (b"7z\xbc\xaf\x27\x1c" + bytes(100), "archive", "unpack"),
    "log.wav.gz": (b"\x1f\x8b\x08" + bytes(100), "archive", "unpack"),
    "log.csv": (b"%PDF-1.7\n%abc\n1 0 obj\n", "PDF", "name the log"),
    "model.dat": (b"\x80\x04\x95\x10\x00", "pickle", "never opened"),
    "a.npy": (b"\x93NUMPY\x01\x00v\x00{'descr': '<f8'", "NumPy", "HDF5"),
    "a.wav": (b"OggS\x00\x02" + bytes(100), "loss", "FLAC"),
    "b.wav": (b"ID3\x04\x00\x00\x00\x00\x01\x7f" + bytes(100), "loss", "FLAC"),
    "song.csv": (b"ID3\x03\x00\x40\x00\x00\x02\x01TIT2" + b"a" * 500, "loss", "FLAC"),
    "head.csv": (b";\r\n; Copyright 1999 HEAD acoustics GmbH\r\n; HEAD acoustics datafile format\r\nnbr: 2\r\n",
                 "HEAD acoustics recording", "ArtemiS SUITE"),
    "log.bz2.csv": (b"BZh91AY&SY" + bytes(50), "archive", "unpack"),
    "logs.tar.dat": (b"a.wav".ljust(257, b"\x00") + b"ustar\x0000" + bytes(300), "archive", "unpack"),
}  # fmt: skip


NOT_CLOSED = [
    b"HEAD acoustics;mic\n", b"# HEAD acoustics datafile format\n", b"x\n; HEAD acoustics datafile format\n",
    b"ID3,mic\n", b"ID3 is a channel\n", b"ID3", b"ID3\x09\x00\x00\x00\x00\x00\x00",
    b"ID3\x04\x00\x00\xff\x00\x00\x00", b"OggS,mic\n", b"BZh;mic\n", b"|CF,mic|\n", b"%PDF-export\n",
    b"a" * 257 + b"ustar;mic\n",    b'<?xml version="1.0"?><a>usi:tdm</a>',
]  # fmt: skip


@pytest.mark.parametrize("head", NOT_CLOSED)
def test_words_that_a_closed_format_begins_with_are_not_that_format(head):
    assert closed_by_content(".csv", head) is None


@pytest.mark.parametrize("name", list(BY_CONTENT))
def test_content_names_a_closed_format(tmp_path, name):
    content, title, remedy = BY_CONTENT[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FormatError, match=rf"{name}: is an? .*{title}|{name}: is (the|audio) .*{title}") as caught:
        scan(tmp_path / name)
    assert remedy in str(caught.value) and "\n" not in str(caught.value)


def test_a_workbook_is_an_archive_inside(tmp_path):
    for name, title in (("a.xlsx", "workbook"), ("a.zip", "archive"), ("a.csv", "archive"), ("a.dat", "archive")):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr("[Content_Types].xml", "<a/>")
        with pytest.raises(FormatError, match=title):
            scan(tmp_path / name)


@pytest.mark.parametrize(
    "row", [row for row in CLOSED_FORMATS if row.suffixes], ids=lambda row: row.title.split(",")[0]
)
def test_a_suffix_names_a_closed_format_where_nothing_else_does(tmp_path, row):
    for suffix in row.suffixes:
        path = tmp_path / f"log{suffix.upper()}"
        path.write_bytes(b"\x01\x02\x03\x04" * 50)
        with pytest.raises(FormatError, match="is, by its suffix, ") as caught:
            scan(path)
        assert any(
            word in str(caught.value) for word in ("export", "save", "convert", "unpack", "take", "record", "name")
        )


def test_every_row_says_where_it_was_looked_up():
    for row in CLOSED_FORMATS:
        assert row.known_from and (row.matches is None or row.known_from != UNVERIFIED), row.title
        assert all(suffix == suffix.lower() and suffix.startswith(".") for suffix in row.suffixes)


def test_no_row_stands_in_the_way_of_a_format_that_is_read(tmp_path):
    read = {suffix for row in FORMATS for suffix in row.suffixes}
    assert not read & {suffix for row in CLOSED_FORMATS for suffix in row.suffixes}
    for maker in all_makers():
        folder = tmp_path / maker.__name__
        folder.mkdir()
        path = maker(folder).path
        assert closed_by_content(path.suffix, path.read_bytes()[:4096]) is None


def test_an_hdf5_file_called_hdf_is_read(tmp_path):
    with h5py.File(tmp_path / "a.hdf", "w") as file:
        file["x"] = np.zeros(10)
    assert scan(tmp_path / "a.hdf").format == "hdf5"
