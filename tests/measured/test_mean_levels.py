"""Mean levels over runs and receivers: their standard deviations cover what they claim."""

import math

import numpy as np
import pytest

from tdacoustic.measured.mean_levels import RecordedLevels, Scatter, mean_levels, pooled_scatter
from tdacoustic.measured.record_scatter import band_energy, record_sigma_db
from tdacoustic.spectra import Spectrum
from tdacoustic.spectra.frames import plan_frames
from tdacoustic.spectra.powers import FramePowerMeter


def table(*rows, records=None):
    """Levels of runs (rows) at receivers (columns)."""
    levels = {(f"r{i}", f"m{j}"): level for i, row in enumerate(rows) for j, level in enumerate(row)}
    return RecordedLevels(levels, dict.fromkeys(levels, records) if records is not None else {})


def test_energies_are_averaged(conformance):
    found = mean_levels({"1": table([80.0, 90.0])}, 0.3, over_receivers=False)["1"]
    conformance(
        "mean of two receivers, 80 and 90 dB", 87.404, found.level_db, 1e-3, "dB", "analytic: 10 lg of the mean energy"
    )


def test_a_receiver_that_misses_a_run_counts_like_the_others():
    levels = {("a", "left"): 80.0, ("b", "left"): 80.0, ("a", "right"): 90.0}
    held = RecordedLevels(levels)
    assert mean_levels({"1": held}, 0.3, False)["1"].level_db == pytest.approx(87.404, abs=1e-3)
    assert held.run_differences_db() == [0.0, 0.0]  # the missing one makes no difference between the runs


def test_the_scatter_is_pooled_and_goes_with_the_root_of_the_number():
    """Conditions of 3, 2 and 1 runs: s² = (2 · 1 + 1 · 4) / 3 = 2, three degrees of freedom, t = 1.1969."""
    conditions = {
        "1": table([80.0], [81.0], [82.0]),
        "2": table([90.0 - math.sqrt(2.0)], [90.0 + math.sqrt(2.0)]),
        "3": table([70.0]),
    }
    found = mean_levels(conditions, 0.3, over_receivers=False)
    widened = 1.1969 * math.sqrt(2.0)
    for name, number in (("1", 3), ("2", 2), ("3", 1)):
        assert found[name].sigma_db == pytest.approx(math.hypot(0.3, widened / math.sqrt(number)), rel=1e-3)
    assert found["3"].words == (
        "1 run, 1 receiver; sigma of instruments 0.3 dB, runs (scatter over 3 degrees of freedom) 1.7 dB"
    )


def test_receivers_of_a_surface_add_their_scatter_and_those_at_their_place_do_not():
    conditions = {"1": table([80.0, 82.0]), "2": table([90.0, 92.0])}
    on_surface = mean_levels(conditions, 0.3, over_receivers=True)["1"]
    widened = 1.3213 * math.sqrt(2.0)  # two degrees of freedom
    assert on_surface.sigma_db == pytest.approx(math.hypot(0.3, widened / math.sqrt(2.0)), rel=1e-3)
    assert "receivers (scatter over 2 degrees of freedom)" in on_surface.words
    at_place = mean_levels(conditions, 0.3, over_receivers=False)["1"]
    assert at_place.sigma_db == pytest.approx(0.3)
    alone = mean_levels({"1": table([80.0])}, 0.3, over_receivers=True)["1"]
    assert alone.sigma_db == 0.3
    assert "the spread over receivers not known" in alone.words


def test_one_run_has_what_its_record_shows():
    found = mean_levels({"1": table([80.0], records=0.4)}, 0.3, False)["1"]
    assert found.sigma_db == pytest.approx(0.5)
    assert "the record itself (no condition was run twice) 0.4 dB" in found.words
    nothing = mean_levels({"1": table([80.0])}, 0.3, False)["1"]
    assert nothing.sigma_db == 0.3
    assert "the spread between runs not known" in nothing.words
    # Receivers of one run scatter together; runs do not.
    assert table([80.0, 80.0], records=0.4).record_db() == pytest.approx(0.4)
    assert table([80.0], [80.0], records=0.4).record_db() == pytest.approx(0.4 / math.sqrt(2.0))
    # With repeats the record's own scatter is part of that between the runs and is not counted twice.
    repeated = {"1": table([80.0], [80.0], records=0.4)}
    assert mean_levels(repeated, 0.3, False)["1"].sigma_db == pytest.approx(0.3)


def test_no_group_of_two_is_no_scatter():
    assert pooled_scatter([[80.0], []]) is None
    assert Scatter(1.0, 1).sigma_db == pytest.approx(1.8373, rel=1e-4)  # Student's quantile at 0.8413
    assert Scatter(1.0, 1000).sigma_db == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(("conditions", "runs"), [(1, 2), (2, 2), (1, 3), (5, 2), (4, 1)])
def test_one_sigma_covers_68_percent(conditions, runs):
    """Means of `runs` runs that scatter by 1 dB, over 2000 seeds; with one run a condition, one more condition has two.

    Scatter in decibels: the truth is the level of the mean energy, 0.115 dB above the mean level at 1 dB.
    """
    rng = np.random.default_rng(conditions * 10 + runs)
    truth = 80.0 + 0.5 * math.log(10.0) / 10.0
    inside = 0
    for _ in range(2000):
        held = {str(k): table(*(80.0 + rng.standard_normal((runs, 1))).tolist()) for k in range(conditions)}
        if runs == 1:
            held["twice"] = table(*(80.0 + rng.standard_normal((3, 1))).tolist())
        found = mean_levels(held, 0.0, over_receivers=False)["0"]
        inside += abs(found.level_db - truth) <= found.sigma_db
    # Exact binomial ± 4 sigma is 0.042; the mean of few energies lies some 0.06 dB below the truth, which takes 0.01.
    assert inside / 2000 == pytest.approx(0.6827, abs=0.055)


def powers_of(x, rate=4096.0, resolution_hz=1.0):
    meter = FramePowerMeter(plan_frames(rate, x.size, resolution_hz), 1)
    meter.take(x[np.newaxis])
    return meter.result()


@pytest.mark.parametrize("band_hz", [(100.0, 200.0), (891.0, 1122.0), (20.0, 2000.0)])
def test_noise_scatters_by_its_bandwidth_and_duration(band_hz):
    """4.34 / sqrt(B T) dB; from some 20 segments, the mean over 30 records."""
    seconds = 10.0
    found = []
    for seed in range(30):
        powers = powers_of(np.random.default_rng(seed).standard_normal(round(4096 * seconds)))
        found.append(record_sigma_db(powers.density[0], powers.frames[0], 1.0, band_hz))
    expected = 4.343 / math.sqrt((band_hz[1] - band_hz[0]) * seconds)
    assert math.sqrt(np.mean(np.square(found))) == pytest.approx(expected, rel=0.2)


def test_a_steady_tone_does_not_scatter_and_a_swelling_one_does():
    t = np.arange(round(4096 * 20.0)) / 4096.0
    tone = np.sin(2 * np.pi * 300.0 * t)
    steady, swelling = (powers_of(x) for x in (tone, tone * (1.0 + 0.5 * np.sin(2 * np.pi * 0.3 * t))))
    assert record_sigma_db(steady.density[0], steady.frames[0], 1.0) < 0.001
    assert record_sigma_db(swelling.density[0], swelling.frames[0], 1.0) > 0.3


def test_too_few_segments_say_nothing():
    assert record_sigma_db(np.ones((3, 10)), np.ones(3, dtype=int), 1.0) is None
    assert record_sigma_db(np.zeros((5, 10)), np.ones(5, dtype=int), 1.0) is None
    with_gaps = record_sigma_db(np.array([[1.0], [np.nan], [1.0], [1.0], [1.0]]), np.array([1, 0, 1, 1, 1]), 1.0)
    assert with_gaps == pytest.approx(0.0, abs=1e-9)


def test_the_energy_of_a_band_is_that_of_the_spectrum():
    density = np.random.default_rng(1).uniform(0.5, 2.0, 200)
    spectrum = Spectrum(2.0 * np.arange(200), density, 2.0, 3.0, 10.0, 0.5, "sound_pressure", "Pa")
    for low, high in ((20.0, 100.0), (31.7, 32.1), (55.0, 56.9), (17.0, 301.3)):
        expected = spectrum.mean_square(low, high)
        assert band_energy(density[np.newaxis], 2.0, low, high)[0] == pytest.approx(expected, rel=1e-12)
