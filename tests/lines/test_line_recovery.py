"""Lines put into noise are found again, with honest errors; noise, skirts and slopes give none."""

import math

import numpy as np
import pytest

from tdacoustic.lines import find_lines, local_floor
from tdacoustic.spectra import FramePowerMeter, average_spectrum, plan_frames

PUT_IN = "known input: sine in white noise"

RATE, SECONDS = 8192.0, 20
N = int(RATE * SECONDS)
T = np.arange(N) / RATE
FLOOR = 1.5 * 2.0 / RATE
"""Mean square of white noise of variance one in one noise bandwidth of a Hann window at 1 Hz."""


def spectrum_of(x, overlap=0.5):
    meter = FramePowerMeter(plan_frames(RATE, x.size, 1.0, overlap), 1)
    meter.take(x[np.newaxis])
    return average_spectrum(meter.result(), 0, "acceleration", "m/s^2", "a")


def noise(rng, exponent=0.0, n=N):
    """Gaussian noise with a density over frequency to the minus `exponent`."""
    spectrum = np.fft.rfft(rng.standard_normal(n))
    frequency = np.maximum(np.fft.rfftfreq(n, 1.0 / RATE), 2.0)
    return np.fft.irfft(spectrum * (frequency / 1000.0) ** (-0.5 * exponent), n)


def sine(frequency, rms, phase=0.0):
    return math.sqrt(2.0) * rms * np.sin(2.0 * np.pi * frequency * T + phase)


def rms_of_prominence(prominence_db):
    return math.sqrt(FLOOR * 10.0 ** (0.1 * prominence_db))


@pytest.mark.parametrize("prominence", [6, 10, 20, 30, 40])
def test_frequency_level_and_prominence_come_back_with_honest_errors(prominence, conformance):
    scores, levels, prominences, missed = [], [], [], 0
    seeds = 80
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        frequency, rms = rng.uniform(200.0, 3000.0), rms_of_prominence(prominence)
        found = find_lines(spectrum_of(rng.standard_normal(N) + sine(frequency, rms, rng.uniform(0.0, 6.28))))
        near = [line for line in found if abs(line.frequency_hz - frequency) < 2.0]
        assert len(near) == len(found), f"seed {seed}: {found}"
        if not near:
            missed += 1
            continue
        scores.append((near[0].frequency_hz - frequency) / near[0].frequency_error_hz)
        levels.append(20.0 * math.log10(near[0].rms / rms))
        prominences.append(near[0].prominence_db)
    assert missed <= (2 if prominence < 10 else 0)  # 2 dB over the threshold, with 0.7 dB of scatter
    # The scatter of 80 values is known to 1/sqrt(160) = 8 %: an honest error lies within two to three of that.
    assert 0.8 < np.std(scores) < 1.3, np.std(scores)
    assert abs(np.mean(scores)) < 0.35
    if prominence >= 10:
        source = f"known input: sine in white noise, {seeds} seeds"
        conformance(f"bias of a line's level at {prominence} dB", 0.0, float(np.mean(levels)), 0.2, "dB", source)
        conformance(f"prominence at {prominence} dB", prominence, float(np.mean(prominences)), 0.5, "dB", source)


@pytest.mark.parametrize("offset", [0.0, 0.1, 0.25, 0.4, 0.5])
def test_a_line_between_two_lines_of_the_spectrum_is_as_good(offset, conformance):
    x = np.random.default_rng(1).standard_normal(N) + sine(700.0 + offset, rms_of_prominence(60.0))
    (line,) = find_lines(spectrum_of(x))
    # 60 dB over the floor: scatter of 5e-5 Hz and 0.005 dB.
    conformance(f"frequency of a sine at 700 Hz + {offset:g}", 700.0 + offset, line.frequency_hz, 2e-4, "Hz", PUT_IN)
    level = 20.0 * math.log10(line.rms / rms_of_prominence(60.0))
    conformance(f"level of a sine at 700 Hz + {offset:g}", 0.0, level, 0.02, "dB", PUT_IN)
    assert line.width_hz == 0.0


@pytest.mark.parametrize("exponent", [0.0, 2.0, 4.0])
def test_noise_has_no_lines(exponent):
    alarms = sum(len(find_lines(spectrum_of(noise(np.random.default_rng(seed), exponent)))) for seed in range(100))
    assert alarms <= 5  # two are expected at the stated rate of 0.02 a spectrum; more than five: 1.7 %


def test_short_records_of_noise_have_few_lines():
    alarms = 0
    for seed in range(200):
        alarms += len(find_lines(spectrum_of(np.random.default_rng(seed).standard_normal(N // 4))))
    assert alarms <= 12  # 5 averages: the floor's own scatter adds to the rate; 4 expected at the stated one


def test_a_line_on_a_slope_is_found_where_it_is():
    scores, levels = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        frequency = rng.uniform(100.0, 2000.0)
        rms = rms_of_prominence(20.0) * (frequency / 1000.0) ** -1.0
        found = find_lines(spectrum_of(noise(rng, 2.0) + sine(frequency, rms)))
        (line,) = [line for line in found if abs(line.frequency_hz - frequency) < 2.0]
        scores.append((line.frequency_hz - frequency) / line.frequency_error_hz)
        levels.append(20.0 * math.log10(line.rms / rms))
    assert 0.65 < np.std(scores) < 1.4  # 30 values: 13 % each
    assert abs(np.mean(levels)) < 0.2


def test_two_lines_six_hertz_apart_are_two():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        frequency = rng.uniform(200.0, 3000.0)
        x = 0.1 * rng.standard_normal(N) + sine(frequency, 1.0) + sine(frequency + 6.0, 0.5, 1.0)
        low, high = find_lines(spectrum_of(x))
        assert low.frequency_hz == pytest.approx(frequency, abs=0.01)  # the other's skirt at 6 lines: -60 dB
        assert high.frequency_hz == pytest.approx(frequency + 6.0, abs=0.01)
        assert (low.rms, high.rms) == (pytest.approx(1.0, rel=0.01), pytest.approx(0.5, rel=0.01))


@pytest.mark.parametrize("frequency", [60.3, 1000.0, 1000.25, 1000.5, 3999.7])
@pytest.mark.parametrize("modulation", [0.0, 1e-3])
def test_the_skirts_of_a_strong_line_are_no_lines(frequency, modulation):
    strong = sine(frequency, rms_of_prominence(80.0)) * (1.0 + modulation * np.sin(2.0 * np.pi * 0.3 * T))
    (line,) = find_lines(spectrum_of(np.random.default_rng(3).standard_normal(N) + strong))
    assert line.frequency_hz == pytest.approx(frequency, abs=1e-3)
    # At 60 Hz the floor's window of 51 lines is filled with skirts: the floor rises by some 4 dB there.
    assert line.prominence_db == pytest.approx(80.0, abs=6.0 if frequency < 100.0 else 1.0)


def test_a_very_strong_line_is_one_line():
    """Noise and the skirt beside it are in phase by chance somewhere; that is no second line of the same level."""
    for seed in range(6):
        white = np.random.default_rng(seed).standard_normal(N)
        for number, prominence in enumerate((75.0, 85.0, 95.0, 105.0)):
            frequency = 900.1 + 317.31 * number + 100.01 * seed
            found = find_lines(spectrum_of(white + sine(frequency, rms_of_prominence(prominence))))
            near = [line.frequency_hz for line in found if abs(line.frequency_hz - frequency) < 50.0]
            assert near == pytest.approx([frequency], abs=0.01), (seed, prominence)


def test_a_line_on_the_skirt_of_a_strong_one_is_found():
    """12 Hz beside a line of 80 dB, whose skirt lies 5 dB over the floor there; it does not borrow its level."""
    white = np.random.default_rng(3).standard_normal(N)
    strong = white + sine(1000.4, rms_of_prominence(80.0))
    for prominence in (20.0, 30.0, 40.0):
        first, second = find_lines(spectrum_of(strong + sine(1012.77, rms_of_prominence(prominence))))
        assert first.frequency_hz == pytest.approx(1000.4, abs=1e-3)
        assert abs(second.frequency_hz - 1012.77) < 3.0 * second.frequency_error_hz < 0.3
        assert 20.0 * math.log10(second.rms) == pytest.approx(20.0 * math.log10(rms_of_prominence(prominence)), abs=1.5)


def test_three_frames_of_noise_have_no_smeared_lines():
    """Powers of so few frames scatter far beyond a normal number's reach."""
    alarms = 0
    for seed in range(60):
        white = np.random.default_rng(seed).standard_normal(2 * int(RATE))
        alarms += len(find_lines(spectrum_of(white), 4.0, 2e-4 * (1 + seed % 4)))
    assert alarms <= 6  # 2 here; 34 before their chances were those of powers


@pytest.mark.parametrize("quality", [10, 30, 100])
def test_a_resonance_gives_at_most_one_line_and_its_width(quality):
    from scipy import signal

    b, a = signal.iirpeak(800.0, quality, fs=RATE)
    for seed in range(15):
        rng = np.random.default_rng(seed)
        found = find_lines(spectrum_of(10.0 * signal.lfilter(b, a, rng.standard_normal(N)) + 0.1 * noise(rng)))
        assert len(found) <= (0 if quality == 10 else 1)
        for line in found:
            assert abs(line.frequency_hz - 800.0) < 400.0 / quality  # inside the half-power width
            assert line.width_hz > 1.0  # a steady line has none
            assert line.frequency_error_hz > 0.1


@pytest.mark.parametrize(("width", "scatter"), [(0.004, 0.0012), (0.01, 0.003)])
def test_a_line_smeared_by_the_speed_keeps_its_level(width, scatter):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        ramp = 1000.0 * (T + width * (T**2 / (2.0 * SECONDS) - 0.5 * T))  # 1000 Hz, a linear drift of `width`
        x = rng.standard_normal(N) + math.sqrt(2.0) * rms_of_prominence(30.0) * np.sin(2.0 * np.pi * ramp)
        (line,) = find_lines(spectrum_of(x), speed_scatter=scatter)
        assert abs(20.0 * math.log10(line.rms / rms_of_prominence(30.0))) < 0.6  # the drift's ends may lie outside
        assert line.frequency_hz == pytest.approx(1000.0, abs=0.35 * 1000.0 * width)


def test_the_floor_is_the_density_of_the_noise(conformance):
    ratios = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        x = rng.standard_normal(N) + sum(sine(f, 1.0) for f in np.arange(100.0, 4000.0, 90.0))
        ratios.append(local_floor(spectrum_of(x))[30:-30] / (2.0 / RATE))
    got = 10.0 * math.log10(float(np.mean(ratios)))
    # Lines fill 5 to 15 % of the median's window, which raises it by up to 0.2 dB.
    conformance("floor under 44 lines in white noise", 0.0, got, 0.3, "dB", "known input: white noise of known density")


def test_nothing_and_silence_have_no_lines():
    assert find_lines(spectrum_of(np.zeros(N))) == ()
    assert find_lines(spectrum_of(np.zeros(20))) == ()
