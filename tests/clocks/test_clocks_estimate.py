"""Offset and drift against recorders whose clocks are known, made by code that shares nothing with the estimate."""

import numpy as np
import pytest
from two_recorders import two_recorders

from tdacoustic.clocks import ArrayRecord, ClockEstimate, NoRelation, estimate_clock
from tdacoustic.clocks.records import windows_of
from tdacoustic.clocks.relation import Relation

PUT_IN = "known input: one noise on two recorders of known clocks"

RATE = 8192.0
SECONDS = 30.0


def own_time(t, offset_s, drift_ppm):
    return (t - offset_s) * (1.0 + 1e-6 * drift_ppm)


def worst_samples(found, offset_s, drift_ppm, rate):
    """Largest error of an instant within the overlap."""
    ends = np.array(found.overlap_s)
    return float(np.max(np.abs(found.relation.to_own(ends) - own_time(ends, offset_s, drift_ppm)))) * rate


def estimate(one, two, rates=(RATE, RATE), **keys):
    return estimate_clock(ArrayRecord(one, rates[0]), ArrayRecord(two, rates[1]), **keys)


def instants(seconds=SECONDS, offset_s=0.0, drift_ppm=0.0):
    return offset_s + np.arange(round(seconds * RATE)) / (RATE * (1.0 + 1e-6 * drift_ppm))


def test_ten_minutes_are_aligned_to_a_tenth_of_a_sample(conformance):
    """The issue's figure; some 0.001 samples are reached, so that 0.01 leaves room for other processors' rounding."""
    found = estimate(*two_recorders(1, 600.0, (RATE, RATE), 0.37, 20.0, -10.0))
    worst = worst_samples(found, 0.37, 20.0, RATE)
    conformance("two clocks over 600 s, worst instant", 0.0, worst, 0.01, "samples", PUT_IN)
    conformance("offset of a clock, 600 s", 0.37, found.offset_s, 0.01 / RATE, "s", PUT_IN)
    conformance("drift of a clock, 600 s", 20.0, found.drift_ppm, 0.01, "ppm", PUT_IN)
    assert found.axis_error_s * RATE < 0.01
    assert found.inverted
    assert found.notes == ("one channel has the other's sign turned round",)
    assert found.doubts == ()  # a turned sign makes nothing doubtful


@pytest.mark.parametrize(
    ("rates", "offset_s", "drift_ppm"),
    [((8192.0, 44113.23), 0.37, 20.0), ((8192.0, 8000.0), -3.21, -95.0), ((8192.0, 8192.0), 24.0, 250.0)],
    ids=["no common measure", "starts earlier", "late, much drift"],
)
def test_rates_starts_and_drifts(rates, offset_s, drift_ppm, conformance):
    found = estimate(*two_recorders(2, SECONDS, rates, offset_s, drift_ppm, -20.0), rates)
    worst = worst_samples(found, offset_s, drift_ppm, max(rates))
    what = f"two clocks, rates {rates[0]:g} and {rates[1]:g} Hz, {offset_s:g} s, {drift_ppm:g} ppm: worst instant"
    conformance(what, 0.0, worst, 0.1, "samples", PUT_IN)
    first, last = found.overlap_s
    assert first == pytest.approx(max(0.0, offset_s), abs=1e-3)
    assert last == pytest.approx(min(SECONDS, offset_s + SECONDS - 1.0), abs=0.02)


@pytest.mark.parametrize("noise_db", [0.0, -15.0])
def test_stated_errors_hold(noise_db):
    """Twelve seeds: the rms of z lies within 0.55 and 1.55 with 99 % if the errors are right (chi-square of 12)."""
    scores = []
    for seed in range(12):
        found = estimate(*two_recorders(100 + seed, 20.0, (RATE, 8000.0), 0.37, 20.0, noise_db), (RATE, 8000.0))
        assert isinstance(found, ClockEstimate)
        assert worst_samples(found, 0.37, 20.0, RATE) < 0.1
        scores.append(
            ((found.offset_s - 0.37) / found.offset_error_s, (found.drift_ppm - 20.0) / found.drift_error_ppm)
        )
    rms = np.sqrt(np.mean(np.square(scores), axis=0))
    assert np.all((rms > 0.5) & (rms < 1.55)), rms


def test_the_result_does_not_depend_on_who_is_the_reference():
    one, two = two_recorders(4, SECONDS, (RATE, 8000.0), 0.37, 20.0, -20.0)
    there, back = estimate(one, two, (RATE, 8000.0)), estimate(two, one, (8000.0, RATE))
    assert back.drift_ppm == pytest.approx(-there.drift_ppm, abs=0.05)
    assert back.offset_s == pytest.approx(-0.37 * (1.0 + 20e-6), abs=3e-6)


def tacho(turns):
    return (np.mod(turns, 1.0) < 0.5).astype(float)


def test_a_tacho_of_constant_speed_is_ambiguous():
    noise = np.random.default_rng(1).standard_normal((2, instants().size)) * 1e-3
    found = estimate(tacho(50.3 * instants()) + noise[0], tacho(50.3 * instants(offset_s=0.37)) + noise[1])
    assert isinstance(found, NoRelation)
    assert found.ambiguous


def test_pulses_of_one_second_need_a_bound_to_be_told_apart():
    noise = np.random.default_rng(1).standard_normal((2, instants().size)) * 1e-3
    one, two = ((np.mod(t, 1.0) < 0.01) + n for t, n in zip((instants(), instants(offset_s=0.37)), noise, strict=True))
    assert estimate(one, two).ambiguous
    found = estimate(one, two, max_offset_s=0.4)
    assert found.offset_s == pytest.approx(0.37, abs=1.0 / RATE)  # an edge is known to a sample


def test_a_tacho_of_a_run_up_is_no_riddle():
    turns = [5.0 * t + 2.1 * t**2 for t in (instants(), instants(offset_s=0.37, drift_ppm=20.0))]
    found = estimate(tacho(turns[0]), 1.0 - tacho(turns[1]))
    assert worst_samples(found, 0.37, 20.0, RATE) < 0.2  # a few hundred edges, each known to a sample
    assert any("digital" in doubt for doubt in found.doubts)
    assert found.axis_error_s * RATE > 0.3


@pytest.mark.parametrize("hz", [100.0, 1000.3])
def test_a_pure_tone_is_ambiguous(hz):
    found = estimate(np.sin(2 * np.pi * hz * instants()), np.sin(2 * np.pi * hz * instants(offset_s=0.37)))
    assert isinstance(found, NoRelation)
    assert found.ambiguous


@pytest.mark.parametrize("seed", range(4))
def test_records_without_a_shared_signal_have_no_relation(seed):
    noise = np.random.default_rng(seed).standard_normal((2, 100_000))
    assert isinstance(estimate(*noise), NoRelation)


def test_records_that_do_not_overlap_have_no_relation():
    found = estimate(*two_recorders(3, SECONDS, (RATE, RATE), 500.0, 0.0, -10.0))
    assert isinstance(found, NoRelation)
    none = np.zeros(50_000)
    assert isinstance(estimate(none, none), NoRelation)
    far = estimate(np.ones(1000), np.ones(1000), max_offset_s=1.0, centre_s=100.0)
    assert "do not overlap with an offset within 1 s" in far.reason


def test_a_clock_that_wanders_is_said_to():
    random = np.random.default_rng(7)
    frequencies, phases = np.exp(random.uniform(3.0, 8.0, 200)), random.uniform(0.0, 6.28, 200)

    def signal(t):
        return sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(frequencies, phases, strict=True))

    t = instants(offset_s=0.37)
    found = estimate(signal(instants()), signal(t + 100e-6 * np.sin(2.0 * np.pi * t / 10.0)))
    assert any("do not run evenly" in doubt for doubt in found.doubts)
    assert 4e-5 < found.wander_s < 9e-5  # 71 us rms
    assert found.axis_error_s > found.wander_s


def test_gaps_and_what_is_no_number_are_survived():
    one, two = two_recorders(5, SECONDS, (RATE, RATE), 0.37, 20.0, -20.0)
    one[100_000:100_050] = np.nan
    two[150_000:170_000] = 0.0
    found = estimate(one, two)
    assert worst_samples(found, 0.37, 20.0, RATE) < 0.01


def test_a_filter_in_one_channel_is_seen():
    from scipy import signal

    one, two = two_recorders(6, SECONDS, (RATE, RATE), 0.37, 0.0, -30.0)
    found = estimate(one, signal.lfilter(*signal.butter(2, 300.0 / (0.5 * RATE)), two))
    assert any("answer differently" in doubt for doubt in found.doubts)
    assert found.offset_error_s > 1e-4  # the filter's delay is 0.75 ms and less


def test_windows_stream_as_slices_do():
    samples = np.random.default_rng(1).standard_normal(700_000)
    starts = [5, 1000, 262_000, 262_100, 699_900]
    for start, window in zip(starts, windows_of(ArrayRecord(samples, 1.0), starts, 400), strict=True):
        held = samples[start : start + 400]
        assert np.array_equal(window[: held.size], held)
        assert not window[held.size :].any()


def test_a_relation_goes_there_and_back():
    relation = Relation(0.37, 20e-6)
    assert relation.to_own(relation.to_reference(123.0)) == pytest.approx(123.0, abs=1e-12)
    assert relation.to_reference(0.0) == 0.37
