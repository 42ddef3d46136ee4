"""WAV and FLAC: encodings, chunks, the vendor chunk LEA, truncation."""

import struct

import numpy as np
import pytest
import soundfile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_makers import chunk, lea_chunk, signals, wav_bytes

from tdacoustic.errors import FormatError
from tdacoustic.formats import scan
from tdacoustic.formats.audio.riff import start_time_of_bext

RAMP = np.array([[-32768, -1, 0, 1, 32767], [5, 4, 3, 2, 1]])


def values(log):
    n = log.channels[0].raster.n_samples
    return np.concatenate(list(log.reader.blocks(range(len(log.channels)), 0, n, 1000)), axis=1)


@pytest.mark.parametrize(
    ("container", "subtype", "bits"),
    [
        ("WAV", "PCM_U8", 8),
        ("WAV", "PCM_16", 16),
        ("WAV", "PCM_24", 24),
        ("WAV", "PCM_32", 32),
        ("WAVEX", "PCM_24", 24),
        ("RF64", "PCM_16", 16),
        ("FLAC", "PCM_S8", 8),
        ("FLAC", "PCM_16", 16),
        ("FLAC", "PCM_24", 24),
        ("WAV", "FLOAT", None),
        ("WAV", "DOUBLE", None),
        ("WAVEX", "FLOAT", None),
        ("WAV", "ULAW", None),
        ("WAV", "MS_ADPCM", None),
    ],
)
def test_encodings_read_as_soundfile_reads_them(tmp_path, container, subtype, bits, conformance):
    path = tmp_path / ("a.flac" if container == "FLAC" else "a.wav")
    soundfile.write(path, signals().T, 51200, format=container, subtype=subtype)
    log = scan(path)
    expected, rate = soundfile.read(path, dtype="float64")
    apart = float(np.abs(values(log) - expected.T).max())
    conformance(f"{container} {subtype}, largest difference", 0.0, apart, 0.0, "of full scale", "program: soundfile")
    for channel in log.channels:
        assert (channel.unit, channel.full_scale, channel.raster.sample_rate_hz) == (None, 1.0, rate)
        assert channel.limits == (None if bits is None else (-1.0, (2.0 ** (bits - 1) - 1) / 2.0 ** (bits - 1)))


def test_big_endian_rifx(tmp_path):
    soundfile.write(tmp_path / "a.wav", signals().T, 8000, subtype="PCM_16", endian="BIG")
    assert (tmp_path / "a.wav").read_bytes()[:4] == b"RIFX"
    assert np.array_equal(values(scan(tmp_path / "a.wav")), soundfile.read(tmp_path / "a.wav")[0].T)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    bits=st.sampled_from([16, 24, 32]),
    data=st.data(),
    n_channels=st.integers(1, 5),
    before=st.binary(max_size=9),
    after=st.binary(max_size=9),
)
def test_written_integers_come_back(tmp_path, bits, data, n_channels, before, after):
    top = 2 ** (bits - 1)
    n = data.draw(st.integers(1, 20))
    flat = data.draw(st.lists(st.integers(-top, top - 1), min_size=n * n_channels, max_size=n * n_channels))
    x = np.array(flat, dtype=np.int64).reshape(n_channels, n)
    (tmp_path / "a.wav").write_bytes(wav_bytes(x, bits, chunk(b"junk", before), chunk(b"iXML", after)))
    log = scan(tmp_path / "a.wav")
    assert np.array_equal(values(log), x / top)
    assert log.flags == ()


def test_lea_gives_names_units_and_scale(tmp_path):
    lea = lea_chunk([("Mikro Ä".encode("latin-1"), b"Pa", 2.0), (b"Drehzahl", b"tr/min", 4821.5)])
    (tmp_path / "a.wav").write_bytes(wav_bytes(RAMP, 16, after=chunk(b"LIST", b"odd") + lea))
    log = scan(tmp_path / "a.wav")
    assert [c.name for c in log.channels] == ["Mikro Ä", "Drehzahl"]
    assert [c.quantity for c in log.channels] == ["sound_pressure", "speed"]
    assert [c.full_scale for c in log.channels] == [None, None]
    assert log.channels[0].limits == (-2.0, 2.0 * 32767 / 32768)
    np.testing.assert_allclose(values(log), RAMP / 32768 * [[2.0], [4821.5]], rtol=1e-15)


@pytest.mark.parametrize("spoil", [b"xx", b"", b"le00\xff\xff\xff\xff"])
def test_a_damaged_lea_is_flagged(tmp_path, spoil):
    (tmp_path / "a.wav").write_bytes(wav_bytes(RAMP, 16, after=chunk(b"LEA ", spoil)))
    log = scan(tmp_path / "a.wav")
    assert [c.name for c in log.channels] == ["ch1", "ch2"]
    assert "'LEA' is damaged" in log.flags[0]


def test_a_lea_cut_off_is_flagged(tmp_path):
    lea = lea_chunk([(b"a", b"Pa", 2.0), (b"b", b"Pa", 1.0)])
    (tmp_path / "a.wav").write_bytes(wav_bytes(RAMP, 16, after=lea)[:-9])
    log = scan(tmp_path / "a.wav")
    assert values(log).shape == RAMP.shape
    assert any("'LEA' behind the data is cut off" in flag for flag in log.flags)


def test_real_recording_with_lea(recordings):
    log = scan(recordings / "ansys_accel_with_rpm" / "accel_with_rpm.wav")
    pressure, speed = log.channels
    assert (pressure.name, pressure.unit, pressure.quantity) == ("Acceleration_with_Tacho", "Pa", "sound_pressure")
    assert (speed.name, speed.unit, speed.quantity) == ("Acceleration_with_Tacho_RPM", "tr/min", "speed")
    assert pressure.raster.sample_rate_hz == 44100.0 and pressure.raster.n_samples == 909956
    assert pressure.limits == (-1.0, 32767 / 32768)
    rpm = np.concatenate([block[0] for block in log.reader.blocks([1], 0, 909956, 100_000)])
    assert rpm[0] == pytest.approx(974.5, abs=0.1) and rpm.max() == pytest.approx(4821.4, abs=0.2)


def test_bext_gives_the_start(tmp_path):
    bext = b"test run".ljust(256, b"\0") + b"\0" * 64 + b"2024-06-05" + b"13:49:58" + b"\0" * 264
    (tmp_path / "a.wav").write_bytes(wav_bytes(RAMP, 16, before=chunk(b"bext", bext)))
    log = scan(tmp_path / "a.wav")
    assert log.start_time == "2024-06-05T13:49:58"
    assert ("description", "test run") in log.metadata
    assert start_time_of_bext(b"\0" * 320 + b"0000-00-0000:00:00") is None
    assert start_time_of_bext(b"") is None


@pytest.mark.parametrize("keep", [45, 50, 61, 63])
def test_truncated_data_are_refused(tmp_path, keep):
    (tmp_path / "a.wav").write_bytes(wav_bytes(RAMP, 16)[:keep])
    with pytest.raises(
        FormatError, match=rf"truncated: the header claims 5 samples, the file holds {(keep - 44) // 4}"
    ):
        scan(tmp_path / "a.wav")


@pytest.mark.parametrize("size", [0, 0xFFFFFFFF, 0x7FFFF000])
def test_a_streamed_file_is_read_to_its_end(tmp_path, size):
    blob = bytearray(wav_bytes(RAMP, 16))
    blob[40:44] = struct.pack("<I", size)
    (tmp_path / "a.wav").write_bytes(blob)
    log = scan(tmp_path / "a.wav")
    assert "streamed" in log.flags[0]
    assert np.array_equal(values(log), RAMP / 32768)


def test_no_samples_no_fmt_and_bad_chunks(tmp_path):
    path = tmp_path / "a.wav"
    path.write_bytes(wav_bytes(RAMP[:, :0], 16))
    with pytest.raises(FormatError, match="no samples"):
        scan(path)
    path.write_bytes(b"RIFF" + struct.pack("<I", 16) + b"WAVE" + chunk(b"data", b"1234"))
    with pytest.raises(FormatError, match="no fmt chunk"):
        scan(path)
    path.write_bytes(wav_bytes(RAMP, 16, before=b"junk" + struct.pack("<I", 1 << 31)))
    with pytest.raises(FormatError, match="truncated: chunk 'junk' claims"):
        scan(path)
    path.write_bytes(wav_bytes(RAMP, 16, after=b"\x00\x01\x02\x03\x04\x05\x06\x07\x08"))
    assert "belong to no chunk" in scan(path).flags[0]


def test_unpadded_odd_chunks(tmp_path):
    (tmp_path / "a.wav").write_bytes(wav_bytes(RAMP, 16, before=b"junk" + struct.pack("<I", 3) + b"abc"))
    assert np.array_equal(values(scan(tmp_path / "a.wav")), RAMP / 32768)


@pytest.mark.parametrize("size_in_ds64", ["right", "too much"])
def test_bw64(tmp_path, size_in_ds64):
    soundfile.write(tmp_path / "a.wav", signals().T, 8000, subtype="PCM_16", format="RF64")
    blob = bytearray((tmp_path / "a.wav").read_bytes())
    expected = soundfile.read(tmp_path / "a.wav")[0].T
    blob[:4] = b"BW64"
    if size_in_ds64 == "too much":
        blob[28:36] = struct.pack("<Q", 1 << 34)
    (tmp_path / "a.wav").write_bytes(blob)
    if size_in_ds64 == "right":
        assert np.array_equal(values(scan(tmp_path / "a.wav")), expected)
    else:
        with pytest.raises(FormatError, match=f"the header claims {(1 << 34) // 4} samples, the file holds 1003"):
            scan(tmp_path / "a.wav")


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9, 0.999])
def test_truncated_flac(tmp_path, fraction):
    noise = np.random.default_rng(0).normal(scale=0.1, size=(50_000, 1))
    soundfile.write(tmp_path / "a.flac", noise, 48000)
    blob = (tmp_path / "a.flac").read_bytes()
    (tmp_path / "a.flac").write_bytes(blob[: int(len(blob) * fraction)])
    with pytest.raises(FormatError, match="truncated"):
        log = scan(tmp_path / "a.flac")
        values(log)


@pytest.mark.parametrize("suffix", ["flac", "wav"])
def test_a_file_of_other_channels_than_were_scanned_is_refused(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    kind = {"flac": "PCM_16", "wav": "IMA_ADPCM"}[suffix]
    noise = np.random.default_rng(0).normal(scale=0.1, size=(5000, 2))
    soundfile.write(path, noise, 8000, subtype=kind)
    log = scan(path)
    soundfile.write(path, noise[:, :1], 8000, subtype=kind)
    with pytest.raises(FormatError, match=r"a\.\w+: the file has 1 channels, and had 2 when it was scanned"):
        values(log)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 43), bit=st.integers(0, 7))
def test_a_flipped_bit_in_the_header_never_crashes(tmp_path, at, bit):
    blob = bytearray(wav_bytes(RAMP, 16))
    blob[at] ^= 1 << bit
    (tmp_path / "a.wav").write_bytes(blob)
    try:
        values(scan(tmp_path / "a.wav"))
    except FormatError as error:
        assert "a.wav" in str(error)
