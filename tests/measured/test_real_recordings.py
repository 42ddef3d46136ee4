"""Recordings made by others, against numpy and the program they come with."""

import math

import numpy as np
import pytest
from pyoctaveband import OctaveFilterBank

from tdacoustic.formats import scan
from tdacoustic.ingest.single import bind_log
from tdacoustic.measured import MeasurementSettings, RunSpeed, survey_recording
from tdacoustic.measured.measurement_step import measure_run
from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames
from tdacoustic.speed import SpeedChannelMeter


def test_the_run_up_of_ansys(real_recordings, conformance):
    import soundfile

    path = real_recordings / "ansys_accel_with_rpm" / "accel_with_rpm.wav"
    recording = bind_log(scan(path))
    mic, rpm = recording.channels
    assert (mic.si_symbol, rpm.quantity, rpm.si_symbol) == ("Pa", "speed", "1/s")
    meter = SpeedChannelMeter(rpm.sample_rate_hz)
    meter.take(recording.samples(rpm.name))
    _, speed = meter.result()
    source = "recording: Ansys, accel_with_rpm.wav, full scales in its LEA chunk"
    # Mean over 50 ms of a run-up by 190 rpm/s on average; the start is nearly flat.
    conformance("speed at the start", 974.5, 60.0 * speed[0], 5.0, "rpm", source)
    conformance("speed at the end", 4821.4, 60.0 * speed.max(), 10.0, "rpm", source)
    raw, _ = soundfile.read(path, dtype="float64")  # full scale is 1 Pa
    survey = survey_recording(recording.only([mic.name]), bands=False)
    rms = math.sqrt(float(survey.rasters[0].statistics.mean_square[0]))
    conformance("rms of the pressure", float(raw[:, 0].std()), rms, 1e-9, "Pa", "program: soundfile and numpy")


def test_the_motor_of_mosqito(real_recordings, conformance):
    pyuff = pytest.importorskip("pyuff")
    path = real_recordings / "mosqito_emotor_vibration" / "electric_motor_vibration_signal.uff"
    recording = bind_log(scan(path))
    (channel,) = recording.channels
    assert (channel.sample_rate_hz, channel.n_samples, channel.si_symbol) == (51200.0, 181504, "m/s^2")
    record = pyuff.UFF(str(path)).read_sets(0)
    raw = np.asarray(record["data"]).real
    survey = survey_recording(recording)
    rms = math.sqrt(float(survey.rasters[0].statistics.mean_square[0]))
    conformance("rms of the acceleration", float(raw.std()), rms, 1e-9, "m/s^2", "program: pyuff and numpy")
    settings = MeasurementSettings(recording.channels, (), 4.0, 0.03, 50.0, None, ())
    (result,) = measure_run(settings, RunSpeed(()), survey).channels
    other = OctaveFilterBank(fs=51200, fraction=3, order=6, limits=[19.0, 20500.0])
    levels, centres = other.filter(raw, detrend=False)
    theirs = dict(zip(np.round(centres), np.ravel(levels) + 20.0 * math.log10(20e-6), strict=True))
    strongest = max(band.mean_square for band in result.bands)
    distance = [
        10.0 * math.log10(band.mean_square) - theirs[round(centre)]
        for centre, band in zip(survey.rasters[0].bands.centre_hz, result.bands, strict=True)
        if not band.filter_dependent and band.mean_square > 1e-3 * strongest
    ]
    assert len(distance) >= 3
    # A tone of 54 dB decides what its neighbours show: those bands are flagged, and are left out here.
    source = "program: pyoctaveband.OctaveFilterBank"
    conformance("strong third octaves, largest distance", 0.0, float(np.max(np.abs(distance))), 0.2, "dB", source)


def test_the_pair_of_pyuff_gives_one_spectrum(real_recordings, conformance):
    spectra, samples = [], []
    for name in ("Sample_UFF58_ascii.uff", "Sample_UFF58b_bin.uff"):
        recording = bind_log(scan(real_recordings / "pyuff_microphone" / name))
        survey = survey_recording(recording, bands=False)
        samples.append(recording.samples(recording.channels[0].name))
        spectra.append(average_spectrum(survey.rasters[0].powers, 0, "sound_pressure", "Pa"))
    total = 10.0 * math.log10(spectra[0].mean_square() / spectra[1].mean_square())
    conformance(
        "level, ASCII against binary",
        0.0,
        total,
        1e-5,
        "dB",
        "recording: pyuff, Sample_UFF58_ascii.uff and Sample_UFF58b_bin.uff, one record twice",
    )
    # By the triangle inequality the two differ by no more than the spectrum of the samples' difference.
    assert np.max(np.abs(samples[0] - samples[1])) <= 0.5e-5 * np.max(np.abs(samples[1]))  # six digits
    plan = plan_frames(65536.0, samples[0].size)
    meter = FramePowerMeter(plan, 1)
    meter.take((samples[0] - samples[1])[np.newaxis])
    rounding = average_spectrum(meter.result(), 0, "sound_pressure", "Pa").density
    ascii_, binary = (np.sqrt(spectrum.density) for spectrum in spectra)
    assert np.all(np.abs(ascii_ - binary) <= np.sqrt(rounding) * 1.001 + 1e-7 * binary)  # kept as float32
