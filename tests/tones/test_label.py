"""Order and owner of tones, by what a fleet expects of a speed."""

from dataclasses import dataclass

import pytest

from tdacoustic.fleet import GearStage, Kinematics
from tdacoustic.tones import label_tones, matching_tolerance_hz

DRIVE = Kinematics(1.05, (GearStage("1", (20, 80)),))
MOTOR_HZ = 30.0


@dataclass(frozen=True)
class Tone:
    frequency_hz: float
    frequency_error_hz: float = 0.05


def labels(*tones, error=3e-3):
    return label_tones(tones, DRIVE.excitations(MOTOR_HZ, 5000.0), MOTOR_HZ, error)


def test_a_mesh_harmonic_is_the_gearboxs():
    (label,) = labels(Tone(1200.2))
    assert (label.excitation, label.owner, label.order, label.ambiguous) == ("mesh x2", "gearbox", 40.0, False)
    assert label.distance_hz == pytest.approx(0.2)


def test_the_reach_follows_the_tone_and_the_speed():
    # mesh x2: 40 times the speed's 0.003 Hz, and the tone's 0.05 Hz; three standard deviations of both.
    expected = next(e for e in DRIVE.excitations(MOTOR_HZ, 5000.0) if e.name == "mesh x2")
    tolerance = matching_tolerance_hz(Tone(1200.0), expected, 3e-3)
    assert tolerance == pytest.approx(3.0 * (0.12**2 + 0.05**2) ** 0.5)
    inside, outside = labels(Tone(1200.0 + 0.99 * tolerance), Tone(1200.0 + 1.01 * tolerance))
    assert inside.excitation == "mesh x2" and inside.tolerance_hz == pytest.approx(tolerance)
    assert outside.excitation is None and outside.owner is None
    assert outside.order == pytest.approx((1200.0 + 1.01 * tolerance) / 30.0)  # its own, of nobody


def test_a_tone_within_reach_of_two_owners_is_ambiguous():
    # Motor shaft x2 and wheelset x4 are 60 and 30 Hz; motor shaft x1 and wheelset x4 share 30 Hz exactly.
    (label,) = labels(Tone(30.0))
    assert label.ambiguous and {label.excitation, *label.also} == {"motor shaft x1", "wheelset x4"}


def test_without_a_turning_motor_there_is_no_order():
    (label,) = label_tones([Tone(100.0)], DRIVE.excitations(0.0, 5000.0), 0.0, 0.0)
    assert label.excitation is None and label.order is None
