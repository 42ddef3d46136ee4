"""Tonal audibility against the printed examples of ISO/PAS 20065:2016 and DIN 45681:2005."""

import numpy as np
import printed_examples as printed
import pytest

from tdacoustic.tones import mean_audibility, tone_adjustment_db
from tdacoustic.tones.critical_bands import critical_bandwidth_hz, masking_index_db, separation_hz
from tdacoustic.tones.masking import (
    audibility_uncertainty_db,
    combined_level_db,
    groups_of,
    mean_narrow_band_level_db,
    tone_extent,
    tone_level_db,
)

E1 = "standard: ISO/PAS 20065:2016, table E.1, as quoted by the program phonometry"
E2 = "standard: ISO/PAS 20065:2016, table E.2, as quoted by the program phonometry"
E3 = "standard: ISO/PAS 20065:2016, table E.3, as quoted by the program phonometry"
I10 = "standard: DIN 45681:2005, tables I.9 and I.10, as quoted by the program phonometry"
ROUNDED = 0.005 + 1e-9
"""Printed to 0.01 dB."""
CHAIN = 0.03
"""The printed audibility comes from numbers rounded to 0.01 dB, the line spacing to 0.1 Hz among them."""


def rated(levels, frequencies, tone_hz):
    levels = np.asarray(levels)
    peak = int(np.argmin(np.abs(np.asarray(frequencies) - tone_hz)))
    mean, kept = mean_narrow_band_level_db(levels, (0, levels.size), peak)
    return mean, kept, tone_extent(levels, peak, mean)


def test_the_engines_tone_at_137_hz(conformance):
    levels = np.array(printed.ENGINE_LEVELS_DB)
    mean, kept, lines = rated(levels, printed.ENGINE_LINES_HZ, 137.3)
    level = tone_level_db(levels, np.arange(lines[0], lines[1] + 1))
    conformance("mean narrow-band level at 137.3 Hz", 49.22, mean, ROUNDED, "dB", E1)
    conformance("tone level at 137.3 Hz", 67.96, level, ROUNDED, "dB", E1)
    uncertainty = audibility_uncertainty_db(
        levels[lines[0] : lines[1] + 1], levels[kept], 137.3, printed.ENGINE_SPACING_HZ
    )
    conformance("uncertainty at 137.3 Hz", printed.ENGINE_UNCERTAINTY_137_DB, uncertainty, 0.01, "dB", E2)


def test_the_wind_turbines_tone(conformance):
    frequency, audibility, mean, level, critical, masking, uncertainty = printed.TURBINE_TONE
    levels, spacing = np.array(printed.TURBINE_LEVELS_DB), printed.TURBINE_SPACING_HZ
    got_mean, kept, lines = rated(levels, printed.TURBINE_LINES_HZ, frequency)
    got_level = tone_level_db(levels, np.arange(lines[0], lines[1] + 1))
    got_critical = got_mean + 10.0 * np.log10(critical_bandwidth_hz(frequency) / spacing)
    got = got_level - got_critical - masking_index_db(frequency)
    conformance("mean narrow-band level at 298.8 Hz", mean, got_mean, ROUNDED, "dB", I10)
    conformance("tone level at 298.8 Hz", level, got_level, ROUNDED, "dB", I10)
    conformance("critical-band level at 298.8 Hz", critical, got_critical, 0.01, "dB", I10)
    conformance("masking index at 298.8 Hz", masking, masking_index_db(frequency), ROUNDED, "dB", I10)
    conformance("audibility at 298.8 Hz", audibility, got, 0.01, "dB", I10)
    got_uncertainty = audibility_uncertainty_db(levels[lines[0] : lines[1] + 1], levels[kept], frequency, spacing)
    conformance("uncertainty at 298.8 Hz", uncertainty, got_uncertainty, 0.01, "dB", I10)


@pytest.mark.parametrize("row", printed.ENGINE_TONES, ids=lambda row: f"{row[0]:g} Hz")
def test_every_tone_of_the_engine_from_its_levels(row, conformance):
    frequency, mean, level, audibility, critical, masking = row
    got_critical = mean + 10.0 * np.log10(critical_bandwidth_hz(frequency) / printed.ENGINE_SPACING_HZ)
    conformance(f"critical-band level at {frequency:g} Hz", critical, got_critical, 0.02, "dB", E2)
    conformance(f"masking index at {frequency:g} Hz", masking, masking_index_db(frequency), 0.011, "dB", E2)
    got = level - got_critical - masking_index_db(frequency)
    conformance(f"audibility at {frequency:g} Hz", audibility, got, CHAIN, "dB", E2)


def test_the_engines_three_tones_as_one(conformance):
    levels, group = np.array(printed.ENGINE_LEVELS_DB), printed.ENGINE_GROUP
    extents = []
    for frequency, mean, *_ in printed.ENGINE_TONES[:3]:
        peak = int(np.argmin(np.abs(np.array(printed.ENGINE_LINES_HZ) - frequency)))
        extents.append(tone_extent(levels, peak, mean))
    level = combined_level_db(levels, extents)
    conformance("level of three tones of one critical band", group[0], level, ROUNDED, "dB", E2)
    _, kept, _ = rated(levels, printed.ENGINE_LINES_HZ, 137.3)
    tone_levels = np.array([row[2] for row in printed.ENGINE_TONES[:3]])
    uncertainty = audibility_uncertainty_db(tone_levels, levels[kept], 137.3, printed.ENGINE_SPACING_HZ)
    conformance("uncertainty of the audibility of three tones", group[2], uncertainty, 0.01, "dB", E2)
    audibility = level - printed.ENGINE_TONES[1][4] - masking_index_db(137.3)
    conformance("audibility of three tones of one critical band", group[1], audibility, 0.02, "dB", E2)


@pytest.mark.parametrize("number", range(5))
def test_groups_are_made_where_the_print_has_them(number):
    tones = printed.ENGINE_ALL_TONES[number]
    groups = groups_of([frequency for frequency, _ in tones], [audibility for _, audibility in tones])
    assert tuple(tones[leading][0] for leading, _ in groups) == printed.ENGINE_ALL_GROUPS_HZ[number]


def test_the_mean_over_the_engines_spectra(conformance):
    mean, uncertainty = mean_audibility(printed.ENGINE_DECISIVE_DB, printed.ENGINE_DECISIVE_UNCERTAINTY_DB)
    # 6.96 dB follows to the last digit with 9.12 dB for spectrum 1, which is its second group (at 592.2 Hz).
    conformance("mean audibility of five spectra", printed.ENGINE_MEAN_DB, mean, 0.02, "dB", E3)
    conformance("uncertainty of the mean audibility", printed.ENGINE_MEAN_UNCERTAINTY_DB, uncertainty, 0.01, "dB", E3)


def test_the_tone_adjustment():
    # DIN 45681, annex I.3 (6.38 dB: 4 dB), and the ends of its table 1: a value on a limit belongs to the lower class.
    assert tone_adjustment_db(printed.TURBINE_MEAN_DB) == printed.TURBINE_ADJUSTMENT_DB
    limits = {-10.0: 0, 0.0: 0, 0.01: 1, 2.0: 1, 2.01: 2, 4.0: 2, 6.0: 3, 9.0: 4, 9.1: 5, 12.0: 5, 12.01: 6, 40.0: 6}
    assert {limit: tone_adjustment_db(limit) for limit in limits} == limits


@pytest.mark.parametrize("row", printed.BANDWIDTHS_HZ, ids=lambda row: f"{row[0]} Hz")
def test_critical_bandwidths(row, conformance):
    source = "standard: DIN 45681:2005, table A.1, as quoted by the program phonometry"
    tolerance = 0.5 if row[0] < 13500 else 1.2  # whole numbers, but for the last, which is 1.1 Hz off the formula
    conformance(f"critical bandwidth at {row[0]} Hz", row[1], critical_bandwidth_hz(row[0]), tolerance, "Hz", source)


def test_separation_of_two_tones(conformance):
    source = "standard: DIN 45681:2005, annex J, as quoted by the program phonometry"
    conformance("separation of two tones at 212 Hz", 21.0, separation_hz(212.0), 1e-9, "Hz", source)
    conformance("separation of two tones at 137 Hz", 24.09, separation_hz(137.0), 0.06, "Hz", source)
