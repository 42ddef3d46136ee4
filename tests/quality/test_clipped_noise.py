"""Noise cut by an analogue stage or a float log: no long plateaus, and yet every clipped sample is counted."""

import numpy as np
import pytest

from tdacoustic.quality import StatisticsMeter


def statistics_of(x):
    meter = StatisticsMeter(8192.0, (None,))
    for start in range(0, x.size, 5000):
        meter.take(x[np.newaxis, start : start + 5000])
    return meter.result()


@pytest.mark.parametrize("part", [0.0008, 0.0124, 0.0456, 0.317])
def test_every_clipped_sample_of_noise_is_counted(part):
    rng = np.random.default_rng(1)
    x = rng.standard_normal(200_000)
    top = np.quantile(np.abs(x), 1.0 - part)
    cut = np.clip(x, -top, top)
    assert statistics_of(cut).plateau[0] == np.count_nonzero(np.abs(cut) == top)
    assert statistics_of(x).plateau[0] == 0


def test_coarse_whole_numbers_are_not_clipped():
    """8-bit noise has few values, and its extremes come up by chance; so does the crest of a slow sine."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        assert statistics_of(np.round(20 * rng.standard_normal(65536))).plateau[0] == 0
    assert statistics_of(np.round(100 * np.sin(np.arange(65536) / 50.0))).plateau[0] == 0


def test_a_dead_channel_has_no_plateau():
    assert statistics_of(np.zeros(10_000)).plateau[0] == 0
