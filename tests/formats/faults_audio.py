"""Ways in which WAV, RF64 and FLAC files are broken."""

import struct

import numpy as np
from fault_table import Fault
from log_makers import chunk, lea_chunk, signals, wav_bytes

N = 400
VALUES = np.round(signals(N) * 32767).astype(int)
X = VALUES / 32768.0
BLOB = wav_bytes(VALUES, 16)


def write(blob, name="a.wav"):
    def make(folder):
        (folder / name).write_bytes(blob)
        return folder / name

    return make


def patched(at, form, *values, blob=BLOB):
    spoiled = bytearray(blob)
    struct.pack_into(form, spoiled, at, *values)
    return bytes(spoiled)


def rf64(data_size, n_bytes=None):
    data = VALUES.T.astype("<i2").tobytes()
    ds64 = struct.pack("<QQQI", 36 + len(data), data_size, N, 0)
    fmt = struct.pack("<HHIIHH", 1, 2, 8192, 8192 * 4, 4, 16)
    body = b"WAVE" + chunk(b"ds64", ds64) + chunk(b"fmt ", fmt) + b"data" + b"\xff" * 4 + data[:n_bytes]
    return b"RF64" + b"\xff" * 4 + body


def mp3(n_channels):
    """MP3 of two channels in WAV, as some recorders write it; its header may say what it likes."""

    def make(folder):
        import soundfile

        soundfile.write(folder / "a.mp3", np.tile(X, 8).T, 32000, format="MP3")
        fmt = struct.pack("<HHIIHHHHIHHH", 0x55, n_channels, 32000, 4000, 1, 0, 12, 1, 2, 417, 1, 1393)
        chunks = chunk(b"fmt ", fmt) + chunk(b"data", (folder / "a.mp3").read_bytes())
        (folder / "a.mp3").unlink()
        (folder / "a.wav").write_bytes(b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks)
        return folder / "a.wav"

    return make


def flac(spoil):
    def make(folder):
        import soundfile

        soundfile.write(folder / "a.flac", X.T, 8192, subtype="PCM_16")
        (folder / "a.flac").write_bytes(spoil((folder / "a.flac").read_bytes()))
        return folder / "a.flac"

    return make


def flac_total_samples(blob, count):
    """STREAMINFO holds the number of samples in 36 bits that end 18 bytes after its begin at byte 8."""
    spoiled = bytearray(blob)
    held = int.from_bytes(spoiled[18:26], "big")
    spoiled[18:26] = ((held >> 36 << 36) | count).to_bytes(8, "big")
    return bytes(spoiled)


FLOATS = X.astype("<f4").copy()
FLOATS[0, 5:8] = np.nan, np.inf, -np.inf
FLOAT_BLOB = (
    b"RIFF" + struct.pack("<I", 36 + FLOATS.size * 4) + b"WAVE"
    + chunk(b"fmt ", struct.pack("<HHIIHH", 3, 2, 8192, 8192 * 8, 8, 32)) + chunk(b"data", FLOATS.T.tobytes())
)  # fmt: skip
ADPCM = BLOB[:20] + struct.pack("<HHIIHH", 0x11, 2, 8192, 8192, 4, 4) + BLOB[36:]
RIFX = (
    b"RIFX" + struct.pack(">I", len(BLOB) - 8) + b"WAVEfmt " + struct.pack(">I", 16)
    + struct.pack(">HHIIHH", 1, 2, 8192, 8192 * 4, 4, 16) + b"data" + struct.pack(">I", N * 4)
    + VALUES.T.astype(">i2").tobytes()
)  # fmt: skip

FAULTS = [
    *(
        Fault(f"cut {where}", write(BLOB[:at]), "refused", "truncated|damaged|no WAV|is no")
        for where, at in {
            "in the RIFF header": 6,
            "behind the RIFF header": 12,
            "in the head of fmt": 17,
            "in fmt": 30,
            "behind fmt": 36,
            "in the head of data": 42,
            "behind the head of data": 44,
            "in the samples": 700,
            "one byte before the end": len(BLOB) - 1,
        }.items()
    ),
    Fault(
        "data claim one sample more than there are",
        write(patched(40, "<I", (N + 1) * 4)),
        "refused",
        "claims 401 samples, the file holds 400",
    ),
    Fault("data claim 4 GB", write(patched(40, "<I", 0xFFFFFFF0)), "refused", "truncated"),
    Fault("data size 0 (a recorder that lost its power)", write(patched(40, "<I", 0)), "flagged", "streamed", X),
    Fault("data size FFFFFFFF (written into a pipe)", write(patched(40, "<I", 0xFFFFFFFF)), "flagged", "streamed", X),
    Fault("RIFF size larger than the file", write(patched(4, "<I", 10**9)), "flagged", "the header claims", X),
    Fault("RIFF size 0", write(patched(4, "<I", 0)), "read", "", X),
    Fault("no fmt chunk", write(BLOB[:12] + BLOB[36:]), "refused", "no fmt"),
    Fault("fmt behind the samples", write(BLOB[:12] + BLOB[36:] + BLOB[12:36]), "read", "", X),
    Fault("fmt of 10 bytes", write(BLOB[:12] + chunk(b"fmt ", BLOB[20:30]) + BLOB[36:]), "refused", "fmt chunk has 10"),
    Fault("no channels", write(patched(22, "<H", 0)), "refused", "0 channels"),
    Fault("a rate of zero", write(patched(24, "<I", 0)), "refused", "0 Hz"),
    Fault("zero bytes a sample", write(patched(32, "<H", 0)), "refused", "0 bytes a sample"),
    Fault("an encoding nobody knows", write(patched(20, "<H", 0x4242)), "refused", "cannot be read|format 16962"),
    Fault("compressed, but the blocks are no such", write(ADPCM), "refused", "cannot be read|truncated|damaged|claims"),
    Fault(
        "MP3 of two channels in a WAV file that says three", mp3(3), "refused", "it says 3 channels, WAV format 85 .* 2"
    ),
    Fault("cut in ds64", write(rf64(N * 4)[:30]), "refused", "the file ends in its ds64 chunk"),
    Fault("ds64 claims 2^63 + 1 bytes", write(rf64(2**63 + 1)), "refused", "truncated"),
    Fault(
        "bytes a sample that do not fit the bits",
        write(patched(32, "<H", 5)),
        "refused",
        "channels of 16 bits cannot take 5 bytes",
    ),
    Fault(
        "the last sample is cut in two",
        write(wav_bytes(VALUES[:, :-1], 16)[:40] + struct.pack("<I", 4 * N - 6) + BLOB[44:-6]),
        "flagged",
        "middle of a sample",
    ),
    Fault("garbage behind the samples", write(BLOB + b"\x00\x01\x02garbage"), "flagged", "belong to no chunk", X),
    Fault("a second data chunk", write(BLOB + BLOB[36:]), "flagged", "second data chunk", X),
    Fault(
        "a chunk behind the samples is cut",
        write(BLOB + b"LIST" + struct.pack("<I", 5000) + b"INFO"),
        "flagged",
        "cut off",
        X,
    ),
    Fault(
        "a chunk before the samples claims 2 GB",
        write(BLOB[:12] + b"junk" + struct.pack("<I", 2**31) + BLOB[12:]),
        "refused",
        "junk.*claims 2147483648",
    ),
    Fault(
        "the vendor chunk is damaged",
        write(wav_bytes(VALUES, 16, before=chunk(b"LEA ", b"le00\xff\xff\xff\x7f"))),
        "flagged",
        "'LEA' is damaged",
        X,
    ),
    Fault(
        "the vendor chunk's full scale is NaN",
        write(wav_bytes(VALUES, 16, before=lea_chunk([(b"a", b"Pa", float("nan")), (b"b", b"Pa", 1.0)]))),
        "flagged",
        "'LEA' is damaged",
        X,
    ),
    Fault(
        "the vendor chunk names two channels alike",
        write(wav_bytes(VALUES, 16, before=lea_chunk([(b"a", b"Pa", 1.0), (b"a", b"Pa", 1.0)]))),
        "flagged",
        "'a#2'",
        X,
    ),
    Fault(
        "a broadcast date that is none",
        write(wav_bytes(VALUES, 16, before=chunk(b"bext", bytes(320) + b"2026-99-99" + b"99:99:99" + bytes(264)))),
        "read",
        "",
        X,
    ),
    Fault(
        "an odd chunk without its padding",
        write(BLOB[:12] + b"junk" + struct.pack("<I", 3) + b"abc" + BLOB[12:]),
        "read",
        "",
        X,
    ),
    Fault("NaN and infinity among the samples", write(FLOAT_BLOB), "read", "", FLOATS.astype(np.float64)),
    Fault("swapped bytes (RIFX)", write(RIFX), "read", "", X),
    Fault(
        "swapped bytes under a header that says they are not",
        write(b"RIFF" + RIFX[4:]),
        "refused",
        "truncated|damaged|claims",
    ),
    Fault("RF64 that claims more than there is", write(rf64(10**12), "a.rf64"), "refused", "truncated"),
    Fault("RF64 cut in the samples", write(rf64(N * 4, 800), "a.rf64"), "refused", "claims 400 samples"),
    Fault("RF64 without its size", write(rf64(0), "a.rf64"), "flagged", "streamed", X),
    Fault("FLAC cut in half", flac(lambda blob: blob[: len(blob) // 2]), "refused", "truncated|damaged"),
    Fault("FLAC cut behind its header", flac(lambda blob: blob[:42]), "refused", "truncated|damaged"),
    Fault(
        "FLAC that does not say how long it is",
        flac(lambda blob: flac_total_samples(blob, 0)),
        "refused",
        "does not say how many",
    ),
    Fault(
        "FLAC that claims ten times its samples",
        flac(lambda blob: flac_total_samples(blob, 10 * N)),
        "refused",
        "truncated|damaged",
    ),
    Fault(
        "FLAC that claims 2^36 samples",
        flac(lambda blob: flac_total_samples(blob, 2**36 - 1)),
        "refused",
        "truncated|damaged|more than any packing",
    ),
    Fault(
        "FLAC with a damaged frame",
        flac(lambda blob: blob[:-200] + b"\xff" * 100 + blob[-100:]),
        "refused",
        "truncated|damaged",
    ),
    Fault(
        "the name is of a WAV, the content of a FLAC",
        lambda folder: flac(lambda blob: blob)(folder).rename(folder / "a.wav"),
        "read",
        "",
        X,
        1e-12,
    ),
    Fault("the name is of a text, the content of a WAV", write(BLOB, "a.csv"), "flagged", "the suffix is .csv", X),
]
