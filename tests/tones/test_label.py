"""Origin of tones, by what a fleet expects of a speed."""

from dataclasses import dataclass

import pytest

from tdacoustic.fleet import GearStage, Kinematics
from tdacoustic.tones import expected_tones, label_tones

DRIVE = Kinematics(1.05, (GearStage("1", (20, 80)),))
MOTOR_HZ = 30.0


@dataclass(frozen=True)
class Tone:
    frequency_hz: float
    frequency_error_hz: float = 0.05


def expected(error, motor_hz=MOTOR_HZ):
    return expected_tones(DRIVE.excitations(motor_hz, 5000.0), motor_hz, error)


def labels(*tones, error=3e-3):
    return label_tones(tones, expected(error))


def test_a_mesh_harmonic_is_the_gearboxs():
    (label,) = labels(Tone(1200.2))
    assert (label.excitation, label.owner, label.ambiguous) == ("mesh x2", "gearbox", False)
    assert label.distance_hz == pytest.approx(0.2)


def test_the_reach_follows_the_tone_and_the_speed():
    # mesh x2: 40 times the speed's 0.003 Hz, and the tone's 0.05 Hz; three standard deviations of both.
    tolerance = 3.0 * (0.12**2 + 0.05**2) ** 0.5
    inside, outside = labels(Tone(1200.0 + 0.99 * tolerance), Tone(1200.0 + 1.01 * tolerance))
    assert inside.excitation == "mesh x2" and inside.tolerance_hz == pytest.approx(tolerance)
    assert outside.excitation is None and outside.owner is None


def test_a_tone_within_reach_of_two_owners_is_ambiguous():
    # Motor shaft x2 and wheelset x4 are 60 and 30 Hz; motor shaft x1 and wheelset x4 share 30 Hz exactly.
    (label,) = labels(Tone(30.0))
    assert label.ambiguous and {label.excitation, *label.also} == {"motor shaft x1", "wheelset x4"}


def test_a_speed_known_too_badly_names_no_harmonic():
    # At 1 % the reach of mesh x2 is 3 x 2 x 6 Hz, 6 % of the distance to the next; that of x10 is 30 %.
    (low,) = labels(Tone(1201.0), error=0.01 * MOTOR_HZ)
    assert low.excitation == "mesh x2"
    (high,) = label_tones([Tone(6002.0)], expected_tones(DRIVE.excitations(MOTOR_HZ, 7000.0), MOTOR_HZ, 0.3))
    assert high.excitation is None


def test_a_carrier_has_an_error_of_its_own():
    @dataclass(frozen=True)
    class Carrier:
        name: str = "carrier x2"
        kind: str = "inverter"
        frequency_hz: float = 1600.0
        harmonic: int = 2
        hz_per_motor_hz: float = 0.0

    (tone,) = expected_tones([Carrier()], MOTOR_HZ, 1.0, fixed_error=3e-3)
    assert tone.error_hz == pytest.approx(4.8)
    (label,) = label_tones([Tone(1612.0)], [tone])
    assert (label.excitation, label.owner) == ("carrier x2", "motor")


def test_without_a_turning_motor_there_is_no_origin():
    (label,) = label_tones([Tone(100.0)], expected(0.0, motor_hz=0.0))
    assert label.excitation is None and label.owner is None
