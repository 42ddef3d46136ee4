"""Rings and the motor made of them: against the theory of rings, laws, and equations (9) and (10) by hand."""

import math

import pytest

from tdacoustic.errors import MotorError
from tdacoustic.motor import MotorFrame, Ring, relative_intensity

CORE = Ring(0.42, 0.45, 0.06, 210e9, 7850.0)
FRAME = Ring(0.46, 0.45, 0.02, 210e9, 7850.0)
MOTOR = MotorFrame(CORE, FRAME, 0.02)


@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_natural_frequencies_of_a_free_ring(order, conformance):
    # Love/Hoppe: ω² = E I / (ρ A R⁴) r²(r² - 1)²/(r² + 1); of a rectangular section I/A = h²/12.
    speed = math.sqrt(210e9 / 7850.0)
    omega = speed * 0.02 / math.sqrt(12.0) / 0.46**2 * order * (order**2 - 1) / math.sqrt(order**2 + 1)
    got = math.sqrt(FRAME.stiffness_n_per_m(order) / FRAME.mass_kg(order))
    conformance(
        f"natural frequency of a free ring, order {order}",
        omega,
        got,
        1e-9 * omega,
        "rad/s",
        "literature: bending of a thin ring in its plane (Hoppe, J. reine angew. Math. 73 (1871) 158)",
    )


def test_the_breathing_mode_of_a_ring(conformance):
    omega = math.sqrt(210e9 / 7850.0) / 0.46
    got = math.sqrt(FRAME.stiffness_n_per_m(0) / FRAME.mass_kg(0))
    conformance(
        "natural frequency of a free ring, order 0",
        omega,
        got,
        1e-9 * omega,
        "rad/s",
        "literature: breathing of a thin ring, ω² = E / (ρ R²) (Love, Mathematical Theory of Elasticity, 4th ed.)",
    )


def test_a_ring_under_pressure(conformance):
    # Order 0: p R²/(E h); order 2: p R⁴/(9 E h³/12), both statical.
    pressure, area = 1e5, 2.0 * math.pi * 0.46 * 0.45
    uniform = pressure * 0.46**2 / (210e9 * 0.02)
    ovalled = pressure * 0.46**4 / (9.0 * 210e9 * 0.02**3 / 12.0)
    for order, expected in ((0, uniform), (2, ovalled)):
        got = pressure * area / FRAME.stiffness_n_per_m(order)
        conformance(
            f"deflection of a ring under a pressure of order {order}",
            expected,
            got,
            1e-9 * expected,
            "m",
            "analytic: statics of a thin ring, p R² / (E h) and 4 p R⁴ / (3 E h³)",
        )


def test_the_vibration_at_resonance_is_that_of_the_loss_factor(conformance):
    hz = MOTOR.natural_hz(4)
    force = 2.0 * math.pi * 0.42 * 0.45 * 0.25 * 0.2 / (2.0 * 4e-7 * math.pi)
    stiffness = CORE.stiffness_n_per_m(4) + FRAME.stiffness_n_per_m(4)
    expected, source = force / (0.02 * stiffness), "paper: equation (9) at resonance, with a loss factor, by hand"
    got = MOTOR.displacement_m(4, hz, (0.25, 0.2))
    conformance("vibration of the motor at resonance, order 4", expected, got, 1e-9 * expected, "m", source)


def test_the_power_by_hand(conformance):
    hz, impedance, sound_speed = 700.0, 413.3, 343.2
    omega = 2.0 * math.pi * hz
    velocity = omega * MOTOR.displacement_m(3, hz, (0.25, 0.2))
    coefficient = float(relative_intensity(3, omega / sound_speed * 0.46))
    power = 0.5 * impedance * velocity**2 * 2.0 * math.pi * 0.46 * 0.45 * coefficient
    found = MOTOR.sound_power_w(3, hz, (0.25, 0.2), impedance, sound_speed)
    source = "paper: equation (9), radiated power by hand"
    conformance("sound power of the motor, order 3, 700 Hz", power, found, 1e-12 * power, "W", source)
    standing = MOTOR.sound_power_w(3, hz, (0.25, 0.2), impedance, sound_speed, standing=True)
    less = 10.0 * math.log10(found / standing)
    source = "analytic: mean of cos² over the circumference, 10 lg 2"
    conformance("power of a rotating over that of a standing wave", 3.0103, less, 1e-4, "dB", source)


def test_81_db_at_4_m_takes_order_4_near_its_resonance():
    # physics.md section 5: 0.25 T x 0.2 T at r = 4 near the ring's resonance, at 926 Hz below it here
    near = 10.0 * math.log10(MOTOR.sound_power_w(4, 926.0, (0.25, 0.2), 413.3, 343.2) / 1e-12) - 23.03
    assert near == pytest.approx(81.0, abs=10.0)


def test_twice_the_flux_is_twelve_decibels():
    one = MOTOR.sound_power_w(2, 900.0, (0.1, 0.1), 413.3, 343.2)
    two = MOTOR.sound_power_w(2, 900.0, (0.2, 0.2), 413.3, 343.2)
    assert 10.0 * math.log10(two / one) == pytest.approx(40.0 * math.log10(2.0), abs=1e-9)


def test_windings_add_mass_and_no_stiffness():
    loaded = Ring(0.42, 0.45, 0.06, 210e9, 7850.0, 500.0)
    assert loaded.stiffness_n_per_m(3) == CORE.stiffness_n_per_m(3)
    assert loaded.mass_kg(0) == pytest.approx(CORE.mass_kg(0) + 500.0)
    assert MotorFrame(loaded, FRAME, 0.02).natural_hz(3) < MOTOR.natural_hz(3)


def test_what_cannot_be_is_refused():
    with pytest.raises(MotorError, match="spatial order 1 moves the rotor"):
        MOTOR.displacement_m(1, 100.0, (0.1, 0.1))
    with pytest.raises(MotorError, match="loss_factor of a motor must be above 0"):
        MotorFrame(CORE, FRAME, 0.0)
    with pytest.raises(MotorError, match=r"thickness_m of a ring must be > 0, got -0\.01"):
        Ring(0.4, 0.4, -0.01, 210e9, 7850.0)
