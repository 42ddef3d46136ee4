"""From a mesh force to spectral lines: of a series, of a motion of several periods, of one that does not repeat."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.gears.lines import MOST_LINES, WEAKEST_LINE, lines_of_harmonics, lines_of_record, lines_of_repeat

MESH_HZ = 500.0
TWO_PI = 2.0 * np.pi


def record(periods, samples, *sines, mean=0.0):
    """Force of sines (frequency over mesh frequency, amplitude, phase of the cosine) over whole mesh periods."""
    times = np.arange(periods * samples) / samples
    force = mean + sum(size * np.cos(TWO_PI * order * times + phase) for order, size, phase in sines)
    return force.reshape(periods, samples)


def test_harmonics_become_peak_amplitudes():
    found = lines_of_harmonics(MESH_HZ, np.array([100.0, 1.0 - 2.0j, 0.5j]))
    assert found.frequency_hz == pytest.approx([500.0, 1000.0])
    assert found.harmonic == pytest.approx([1.0, 2.0])
    assert found.force_n == pytest.approx([2.0 - 4.0j, 1.0j])


@given(st.floats(0.1, 100.0), st.floats(-3.0, 3.0), st.integers(2, 8))
def test_repeat_of_several_periods_has_its_lines(size, phase, periods):
    sines = [(1.0, size, phase), (1.0 / periods, 2.0 * size, -phase), (3.0 - 1.0 / periods, 0.5 * size, 0.3)]
    found = lines_of_repeat(MESH_HZ, record(periods, 64, *sines, mean=7.0))
    assert found.frequency_hz == pytest.approx(MESH_HZ / periods * np.arange(1, found.frequency_hz.size + 1))
    for order, amplitude, angle in sines:
        line = int(np.argmin(np.abs(found.frequency_hz - order * MESH_HZ)))
        assert found.force_n[line] == pytest.approx(amplitude * np.exp(1j * angle), rel=1e-9)
        assert (found.harmonic[line] == 1.0) if order == 1.0 else np.isnan(found.harmonic[line])
    # Parseval: nothing is lost, nothing counted twice.
    assert (np.abs(found.force_n) ** 2).sum() == pytest.approx(sum(part[1] ** 2 for part in sines), rel=1e-9)


def test_record_of_a_motion_without_a_period_has_mesh_harmonics_and_its_own_lines():
    # Bins are 500/512 Hz wide; 0.381966 of the mesh frequency lies between two of them.
    sines = [(1.0, 10.0, 0.4), (2.0, 3.0, -1.0), (0.381966, 4.0, 0.0), (1.618034, 1.0, 0.0)]
    found = lines_of_record(MESH_HZ, record(512, 64, *sines, mean=50.0))
    for order, amplitude, phase in sines:
        line = int(np.argmin(np.abs(found.frequency_hz - order * MESH_HZ)))
        assert found.frequency_hz[line] == pytest.approx(order * MESH_HZ, abs=0.5 * MESH_HZ / 512)
        # Seven bins of a Hann window hold all but 2e-4 of a line's energy wherever it lies between two bins.
        assert abs(found.force_n[line]) == pytest.approx(amplitude, rel=2e-3)
        if order in (1.0, 2.0):
            assert np.angle(found.force_n[line]) == pytest.approx(phase, abs=1e-3)
            assert found.harmonic[line] == order
        else:
            assert np.isnan(found.harmonic[line])
    strong = np.abs(found.force_n) > 0.5
    assert strong.sum() == 4
    # Every mesh harmonic up to a quarter of the sampling rate is there, silent or not.
    assert np.sort(found.harmonic[~np.isnan(found.harmonic)]) == pytest.approx(np.arange(1, 16))
    assert (np.diff(found.frequency_hz) > 0.0).all()


def test_weak_lines_of_a_record_are_left_out_and_the_strongest_kept():
    weak, kept = 0.5 * WEAKEST_LINE, 2.0 * WEAKEST_LINE
    found = lines_of_record(MESH_HZ, record(512, 64, (1.0, 1.0, 0.0), (0.3, weak, 0.0), (0.7, kept, 0.0)))
    between = found.frequency_hz[np.isnan(found.harmonic)] / MESH_HZ
    assert between == pytest.approx([0.7], abs=1e-3)
    rng = np.random.default_rng(3)
    noise = lines_of_record(MESH_HZ, rng.normal(size=(512, 64)))
    assert np.isnan(noise.harmonic).sum() == MOST_LINES


def test_energy_of_a_record_is_in_its_lines():
    rng = np.random.default_rng(4)
    sines = [(order, size, phase) for order, size, phase in zip(
        [1.0, 2.0, 0.31, 0.77, 1.43, 2.61], rng.uniform(1.0, 5.0, 6), rng.uniform(-3.0, 3.0, 6), strict=True
    )]  # fmt: skip
    force = record(512, 64, *sines)
    found = lines_of_record(MESH_HZ, force)
    assert 0.5 * (np.abs(found.force_n) ** 2).sum() == pytest.approx(force.var(), rel=2e-3)
