"""Point sources: distance, ground, and both readings of equation (7)."""

import math

import numpy as np
import pytest

from tdacoustic.errors import RadiationError
from tdacoustic.radiation import Air, mean_over_sphere_db, overall_level_db, transfer_db

HERE = (0.0, 0.0, 0.0)


def test_power_and_level_at_4_m(conformance):
    source = "analytic: 10 lg of the area of a sphere, of half a sphere"
    conformance("power from the 4 m average, sphere", 23.03, -mean_over_sphere_db(4.0), 0.005, "dB", source)
    conformance("power from the 4 m average, half space", 20.02, -mean_over_sphere_db(4.0, "half"), 0.005, "dB", source)
    conformance("power from the level at 1 m", 11.0, -mean_over_sphere_db(1.0), 0.01, "dB", "analytic: 10 lg(4 pi)")


def test_twice_the_distance_is_six_decibels_less(conformance):
    near, far = (float(transfer_db(HERE, (x, 0.0, 0.0), 500.0, 343.0)) for x in (3.0, 6.0))
    source = "analytic: spherical spreading, 20 lg 2"
    conformance("point source, level at half the distance", 6.0206, near - far, 1e-4, "dB", source)


def test_a_receiver_on_the_ground_hears_twice_the_pressure(conformance):
    found = transfer_db((0.0, 0.0, 1.0), (5.0, 0.0, 0.0), [100.0, 1000.0], 343.0, ground_m=0.0)
    free = transfer_db((0.0, 0.0, 1.0), (5.0, 0.0, 0.0), [100.0, 1000.0], 343.0)
    source = "analytic: image source of a rigid ground, 20 lg 2"
    for frequency, more in zip((100, 1000), found - free, strict=True):
        conformance(f"receiver on a rigid ground at {frequency} Hz, over free space", 6.0206, more, 1e-4, "dB", source)


def test_the_image_cancels_where_its_way_is_half_a_wave_longer(conformance):
    source, receiver = (0.0, 0.0, 1.0), (5.0, 0.0, 1.0)
    longer = math.hypot(5.0, 2.0) - 5.0
    dip = float(transfer_db(source, receiver, 343.0 / (2.0 * longer), 343.0, ground_m=0.0))
    # two pressures of opposite sign, 1/5 and 1/√29
    expected = 20.0 * math.log10(1.0 / 5.0 - 1.0 / math.sqrt(29.0)) - 10.0 * math.log10(4.0 * math.pi)
    source = "analytic: a source and its image, half a wave longer"
    conformance("dip of a point source over rigid ground", expected, dip, 1e-9, "dB", source)


def test_the_mean_over_the_half_sphere_is_that_of_the_pressures_energy():
    # A source on the ground has twice the pressure everywhere: its free-field power gives + 6 dB, of which 3 dB are
    # power that the ground adds; the mean of a source well above it tends to the + 3 dB of the half sphere.
    rng = np.random.default_rng(1)
    z = rng.uniform(0.0, 1.0, 20000)
    angle = rng.uniform(0.0, 2.0 * np.pi, z.size)
    radius = 60.0
    flat = radius * np.sqrt(1.0 - z**2)
    energy = [
        10.0 ** (float(transfer_db((0.0, 0.0, 3.0), (x, y, h), 2000.0, 343.0, ground_m=0.0)) / 10.0)
        for x, y, h in zip(flat * np.cos(angle), flat * np.sin(angle), radius * z, strict=True)
    ]
    # sampling scatter of 20000 points of an interference pattern: 0.03 dB
    assert 10.0 * math.log10(np.mean(energy)) == pytest.approx(mean_over_sphere_db(radius, "half"), abs=0.15)


def test_both_readings_of_equation_7(conformance):
    assert overall_level_db([]) is None
    both = overall_level_db([80.0, 70.0])
    conformance("overall level of lines of 80 and 70 dB", 80.4139, both, 1e-4, "dB", "analytic: 10 lg(10⁸ + 10⁷)")
    # Δf = 175 Hz adds 22 dB to lines that are taken for densities: physics.md section 8
    wrong = overall_level_db([80.0, 70.0], "density", 175.0)
    source = "paper: equation (7) with Δf = 175 Hz, 10 lg 175 by hand"
    conformance("lines taken for densities, over their sum", 22.43, wrong - both, 0.005, "dB", source)
    with pytest.raises(RadiationError, match="bandwidth"):
        overall_level_db([80.0], "density")


def test_air_at_20_degrees(conformance):
    air = Air(293.15)
    conformance(
        "speed of sound at 20 °C", 343.2, air.sound_speed_m_s, 0.1, "m/s", "standard: ISO 9613-1:1993, speed of sound"
    )
    conformance(
        "density at 20 °C", 1.204, air.density_kg_m3, 0.001, "kg/m³", "analytic: p / (R T) of dry air at 101.325 kPa"
    )


def test_what_cannot_be_is_refused():
    with pytest.raises(RadiationError, match="at the source itself"):
        transfer_db(HERE, HERE, 100.0, 343.0)
    with pytest.raises(RadiationError, match="below the ground"):
        transfer_db((0.0, 0.0, -1.0), (1.0, 0.0, 1.0), 100.0, 343.0, ground_m=0.0)
    with pytest.raises(RadiationError, match="radius must be > 0"):
        mean_over_sphere_db(0.0)
