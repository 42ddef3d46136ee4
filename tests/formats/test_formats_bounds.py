"""What a log may claim, whatever its format; and what is no log at all."""

import os
import re
import struct
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from log_makers import chunk, lea_chunk, uff_ascii, wav_bytes

from tdacoustic.errors import FormatError, MissingFileError, TdacousticError
from tdacoustic.formats import scan
from tdacoustic.formats.bounds import (
    MAX_CHANNELS,
    MAX_FLAGS,
    MAX_MESSAGE,
    MAX_NAME,
    MAX_UNIT,
    ClearReader,
    bounded,
    clean_text,
    clear_message,
)
from tdacoustic.recording import Log, LogChannel, Raster

HOSTILE = "a\x00b\x1b[31m\u202eevil\u2066\u200b\r\nc\u2028d\ud800"


def log_of(path, channels, **fields):
    return Log(path, "test", tuple(channels), None, **fields)


@pytest.fixture
def path(tmp_path):
    (tmp_path / "log.x").write_bytes(b"x" * 1000)
    return tmp_path / "log.x"


@pytest.mark.parametrize(
    ("text", "cleaned"),
    [
        ("Motor Ölwanne #2 (m/s²)", "Motor Ölwanne #2 (m/s²)"),
        ("बोगी १", "बोगी १"),
        ("می\u200cخواهم", "می\u200cخواهم"),
        ("a\tb\r\nc", "a b  c"),
        ("\x1b[31mred", "\ufffd[31mred"),
        ("mic\u202etxt.exe", "mic\ufffdtxt.exe"),
        ("\ud800\U000e0041", "\ufffd\ufffd"),
        ("x" * 300, "x" * 17 + "..."),
    ],
)
def test_cleaned_texts(text, cleaned):
    assert clean_text(text, 20 if len(text) > 40 else 40) == cleaned


@pytest.mark.parametrize(
    ("text", "clear"),
    [
        ("/a  b/log.h5: no such thing", "/a  b/log.h5: no such thing"),
        ("log.h5: 'a\r\n\tb'\nis damaged\n", "log.h5: 'a b' is damaged"),
        ("log.h5: 'm\x1b[2J\u202eic\x00'", "log.h5: 'm\ufffd[2J\ufffdic\ufffd'"),
    ],
)
def test_messages_become_one_clear_line(text, clear):
    assert clear_message(text) == clear == clear_message(clear)


def test_a_long_message_keeps_the_file_and_the_reason():
    clear = clear_message(f"log.h5: {'n' * 9000} cannot be read")
    assert len(clear) == MAX_MESSAGE and clear.startswith("log.h5: nnn") and clear.endswith("nnn cannot be read")
    assert clear.count(" ... ") == 1


def test_what_a_reader_raises_becomes_one_clear_line():
    class Raising:
        def blocks(self, columns, start, stop, block_size):
            yield np.zeros((1, 2))
            raise FormatError(f"log.x: channel {HOSTILE} is cut") from OSError("disk")

    blocks = ClearReader(Raising()).blocks([0], 0, 4, 2)
    assert next(blocks).shape == (1, 2)
    with pytest.raises(FormatError, match=r"^log\.x: channel a.*d. is cut$") as caught:
        next(blocks)
    assert str(caught.value).isprintable() and isinstance(caught.value.__cause__, OSError)


def test_names_units_and_words_are_cleaned_cut_and_flagged(path):
    channels = [
        LogChannel(HOSTILE, Raster(8.0, 5), unit="Pa\u202e"),
        LogChannel("n" * 10_000, Raster(8.0, 5), unit="u" * 10_000, flags=("f" * 10_000,)),
        LogChannel("n" * 9_000, Raster(8.0, 5)),
        LogChannel("\n", Raster(8.0, 5), flags=tuple(f"flag {n}" for n in range(500))),
        LogChannel("good", Raster(8.0, 5), unit="m/s²"),
    ]
    metadata = tuple((f"key {HOSTILE}", HOSTILE * 1000) for _ in range(5000))
    log = bounded(log_of(path, channels, flags=(HOSTILE,), metadata=metadata, start_time="2026-03-01T10:00:00+01:00"))
    names = [channel.name for channel in log.channels]
    assert len(set(names)) == 5 and names[4] == "good" and names[3] == "ch4"
    assert all(name.isprintable() and len(name) <= MAX_NAME + 4 for name in names)
    assert log.channels[4] is not None and log.channels[4].flags == ()
    for channel in log.channels[:4]:
        assert any("is shown as" in flag for flag in channel.flags) or len(channel.flags) > MAX_FLAGS
    assert all(len(channel.unit or "") <= MAX_UNIT for channel in log.channels)
    said = [*log.flags, *(flag for channel in log.channels for flag in channel.flags)]
    said += [text for pair in log.metadata for text in pair]
    assert all(text.isprintable() and len(text) <= 1000 for text in said)
    assert max(len(channel.flags) for channel in log.channels) <= MAX_FLAGS + 1
    assert len(log.metadata) <= 200 and log.start_time == "2026-03-01T10:00:00+01:00"


def test_clean_logs_pass_unchanged(path):
    log = log_of(
        path, [LogChannel("a", Raster(8.0, 5), "Pa"), LogChannel("b", Raster(8.0, 5))], start_time="2026-03-01"
    )
    assert bounded(log) == log


@pytest.mark.parametrize("start", ["yesterday", "<script>", "2026-99-01T00:00:00", "2026-03-01T10:00:00\x00"])
def test_a_start_that_is_no_moment_is_left_out(path, start):
    log = bounded(log_of(path, [LogChannel("a", Raster(8.0, 5))], start_time=start))
    assert log.start_time is None and "is no date and time" in log.flags[0]


def test_too_many_channels_and_samples(path):
    with pytest.raises(FormatError, match=f"{MAX_CHANNELS + 1} channels"):
        bounded(log_of(path, [LogChannel("a", Raster(8.0, 5))] * (MAX_CHANNELS + 1)))
    with pytest.raises(FormatError, match="claims 1000000000000 samples in 1000 bytes"):
        bounded(log_of(path, [LogChannel("a", Raster(8.0, 10**12))]))
    (flag,) = bounded(log_of(path, [LogChannel("a", Raster(8.0, 5_000_000))])).flags
    assert "5000000 samples are packed in 1000 bytes" in flag
    assert bounded(log_of(path, [LogChannel("a", Raster(8.0, 90_000))])).flags == ()


def test_what_is_no_file_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "none", tmp_path / "a\0b", Path("/dev/null"), Path("/dev/zero")):
        with pytest.raises(MissingFileError):
            scan(path)
    (tmp_path / "file").write_bytes(b"x")
    with pytest.raises(MissingFileError):
        scan(tmp_path / "file" / "below")
    with pytest.raises(FormatError, match="cannot be read"):
        scan(tmp_path / ("n" * 5000))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_a_pipe_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "log.wav")
    (tmp_path / "link.wav").symlink_to(tmp_path / "log.wav")
    for name in ("log.wav", "link.wav"):
        raised = []

        def attempt(name=name, raised=raised):
            try:
                scan(tmp_path / name)
            except TdacousticError as error:
                raised.append(str(error))

        thread = threading.Thread(target=attempt, daemon=True)
        thread.start()
        thread.join(5.0)
        assert raised and "is not a file" in raised[0]


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="no /proc")
@pytest.mark.parametrize("name", ["/proc/self/environ", "/proc/self/maps", "/proc/kmsg"])
def test_files_of_proc_are_refused(name):
    with pytest.raises(TdacousticError, match=r"empty|cannot be read|no such file|is not a file"):
        scan(name)


def test_a_loop_of_links_is_refused(tmp_path):
    (tmp_path / "a.wav").symlink_to(tmp_path / "b.wav")
    (tmp_path / "b.wav").symlink_to(tmp_path / "a.wav")
    with pytest.raises(FormatError, match="cannot be read"):
        scan(tmp_path / "a.wav")


BOMB = r"""
import resource, sys, time
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
import h5py, pandas, soundfile, numpy
from tdacoustic.errors import TdacousticError
from tdacoustic.formats import scan
def peak_kb():  # ru_maxrss is handed down from the parent by a vfork
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
before, began = peak_kb(), time.process_time()
try:
    log = scan(sys.argv[1])
    n = 0
    for column, channel in enumerate(log.channels[:3]):
        for block in log.reader.blocks([column], 0, channel.raster.n_samples, 16384):
            n += block.size
    said = "read"
except TdacousticError as error:
    said = "refused " + str(error).replace("\n", " ")
extra = (peak_kb() - before) / 1024
print(f"{extra:.0f} {time.process_time() - began:.1f} {said}")
"""


def wav_of_many_channels(folder):
    n = 65535
    fmt = struct.pack("<HHIIHH", 1, n, 51200, 0, 0, 8)
    fmt = fmt[:12] + struct.pack("<HH", n, 8)
    data = bytes(n * 3)
    body = b"WAVEfmt " + struct.pack("<I", 16) + fmt + b"data" + struct.pack("<I", len(data)) + data
    (folder / "a.wav").write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    return folder / "a.wav", r"channels"


def wav_of_many_chunks(folder):
    (folder / "a.wav").write_bytes(b"RIFF\xff\xff\xff\x7fWAVE" + chunk(b"junk", b"") * 2_000_000)
    return folder / "a.wav", "no data chunk"


def csv_without_line_ends(folder):
    (folder / "a.csv").write_bytes(b"1.5," * 25_000_000)
    return folder / "a.csv", "longer than"


def csv_with_one_long_line(folder):
    (folder / "a.csv").write_bytes(b"a,b\n1,2\n" + b"1" * 100_000_000 + b",2\n")
    return folder / "a.csv", "longer than|fields"


def csv_of_a_million_columns(folder):
    row = b",".join([b"1"] * 500_000)
    (folder / "a.csv").write_bytes(row + b"\n" + row + b"\n")
    return folder / "a.csv", "columns|longer than|fields"


def csv_of_20000_columns(folder):
    row = b",".join([b"1"] * 20_000) + b"\n"
    (folder / "a.csv").write_bytes(row * 60)
    return folder / "a.csv", "columns"


def csv_with_a_quote_never_closed(folder):
    (folder / "a.csv").write_bytes(b'mic\n1.5\n2.5\n"3.5\n' + b"4.5\n" * 20_000_000)
    return folder / "a.csv", "quote|no number|fields|longer"


def csv_with_a_late_quote_never_closed(folder):
    (folder / "a.csv").write_bytes(b'a,"b"\n' + b"1.5,2\n" * 400_000 + b'"1,2\n' + b"4.5,1\n" * 15_000_000)
    return folder / "a.csv", "quote|no number|fields|longer"


def csv_of_quotes(folder):
    (folder / "a.csv").write_bytes(b"a,b\n1,2\n" + b'"' * 50_000_000)
    return folder / "a.csv", ""


def utf32(folder):
    (folder / "a.csv").write_bytes("a,b\n1,2\n3,4\n".encode("utf-32"))
    return folder / "a.csv", "no CSV"


def utf16_cut(folder):
    (folder / "a.csv").write_bytes("a,b\n1,2\n3,4\n".encode("utf-16")[:-1])
    return folder / "a.csv", ""


def hdf5_of_fill_values(folder):
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("x", (10**12,), "f8", chunks=(1024,)).attrs["fs"] = 51200.0
    return folder / "a.h5", "claim more than the bytes stored"


def hdf5_of_huge_chunks(folder):
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("x", (2**31,), "i1", chunks=(2**31,), compression="gzip")
    return folder / "a.h5", "chunks of more than 256 MiB"


def hdf5_packed_twice(folder):
    """Deflate of deflate: a million to one, where one filter reaches a thousand."""
    import zlib

    import h5py

    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((2**27,))
    plist.set_deflate(9)
    plist.set_filter(h5py.h5z.FILTER_DEFLATE, 0, (9,))
    with h5py.File(folder / "a.h5", "w") as file:
        space = h5py.h5s.create_simple((2**33,))
        dataset = h5py.h5d.create(file.id, b"x", h5py.h5t.NATIVE_INT8, space, plist)
        packed = zlib.compress(zlib.compress(bytes(2**27), 9), 9)
        for at in range(64):
            h5py.Dataset(dataset).id.write_direct_chunk((at * 2**27,), packed)
    return folder / "a.h5", "claim more than the bytes stored"


def hdf5_of_many_datasets(folder):
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        for n in range(12_000):
            file.create_dataset(f"x{n}", (4,), "f4")
    return folder / "a.h5", "more than 10000 channels"


def uff_of_many_records(folder):
    (folder / "a.uff").write_bytes(uff_ascii(np.arange(6.0)) * 10_500)
    return folder / "a.uff", "10500 channels"


BOMBS = [
    wav_of_many_channels, wav_of_many_chunks, csv_without_line_ends, csv_with_one_long_line, csv_of_a_million_columns,
    csv_of_20000_columns, csv_with_a_quote_never_closed, csv_with_a_late_quote_never_closed, csv_of_quotes, utf32,
    utf16_cut, hdf5_of_fill_values, hdf5_of_huge_chunks, hdf5_packed_twice, hdf5_of_many_datasets, uff_of_many_records,
]  # fmt: skip


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of the memory is read from /proc")
@pytest.mark.parametrize("make", BOMBS, ids=lambda make: make.__name__)
def test_what_exhausts_others_is_bounded(make, tmp_path):
    path, says = make(tmp_path)
    began = time.monotonic()
    run = subprocess.run([sys.executable, "-c", BOMB, str(path)], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    extra_mb, seconds, said = run.stdout.split(" ", 2)
    assert float(extra_mb) < 300 and float(seconds) < 8.0, (run.stdout, time.monotonic() - began)
    if says:
        assert said.startswith("refused") and re.search(says, said), said


def test_names_of_a_vendor_chunk_are_cleaned(tmp_path):
    lea = lea_chunk([("<b>\u202e".encode() + b"\x1b", b"Pa\n", 2.0), (b"x" * 5000, b"=1+1", 2.0)])
    (tmp_path / "a.wav").write_bytes(wav_bytes(np.zeros((2, 10), int), 16, before=lea))
    log = scan(tmp_path / "a.wav")
    assert log.channels[0].name == "<b>\ufffd\ufffd" and "is shown as" in log.channels[0].flags[0]
    assert len(log.channels[1].name) == MAX_NAME
    assert replace(log, path=log.path) == log
