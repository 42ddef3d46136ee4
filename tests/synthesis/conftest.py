"""A small recipe that tests change, and plain numpy to look at what comes out."""

import copy

import numpy as np
import pytest

RATE = 8192.0

BASE = {
    "schema": "tdacoustic-synthesis/1",
    "name": "test",
    "seed": 5,
    "sample_rate_hz": RATE,
    "duration_s": 8.0,
    "kinematics": {"wheel_diameter_mm": 1051.12, "gear_pair": [{"teeth": [31, 104]}]},
    "channel": [
        {
            "name": "motor_z",
            "quantity": "acceleration",
            "component": "motor",
            "floor": [[10, 60], [100, 70], [4096, 50]],
        },
        {"name": "gearbox_z", "quantity": "acceleration", "component": "gearbox", "floor": [[100, 60]]},
        {
            "name": "mic",
            "quantity": "sound_pressure",
            "component": "air",
            "role": "receiver",
            "distance_m": 4.0,
            "floor": [[10, 50], [400, 45], [4096, 30]],
        },
        {"name": "tacho", "quantity": "tacho", "component": "shaft", "pulses_per_rev": 12},
    ],
    "condition": [{"name": "40", "train_speed_km_h": 40}],
}


@pytest.fixture
def base():
    return copy.deepcopy(BASE)


def sine_amplitude_rms(signal, phase_turns):
    """Rms of the sinusoid that follows a phase, by least squares: independent of how it was made."""
    angle = 2 * np.pi * phase_turns
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    coefficients, *_ = np.linalg.lstsq(basis, signal, rcond=None)
    return float(np.hypot(*coefficients) / np.sqrt(2))


@pytest.fixture
def fitted_rms():
    return sine_amplitude_rms
