"""The drive's sources and their levels, put together from a fleet file."""

import math

import numpy as np
import pytest

import tdacoustic as td
from tdacoustic.drive import Receiver
from tdacoustic.errors import FleetError
from tdacoustic.fleet import load_fleet

MOTOR = """
[motor]
pole_pairs = 3
slip = 0.01
carrier_hz = 463
core_radius_mm = 420
core_length_mm = 450
core_thickness_mm = 60
frame_radius_mm = 460
frame_length_mm = 450
frame_thickness_mm = 20
frame_modulus_gpa = 210
core_modulus_gpa = 210
density_kg_m3 = 7850
loss_factor = 0.02
position_m = [0.0, 0.6, 0.0]
"""
FLUX = '[[motor.excitation]]\nname = "carrier x2"\norder = 4\ncarrier = 2\nflux_density_t = [0.25, 0.2]\n'
POWER = '[[motor.excitation]]\nname = "fan"\nshaft = 7\nsound_power_level_db = [[0, 80], [1000, 100]]\n'
UNKNOWN = '[[motor.excitation]]\nname = "slots"\nshaft = 40\n'


@pytest.fixture
def fleet_of(reference, tmp_path):
    """A fleet like the reference drive with other text for its motor."""

    def made(motor, **replacements):
        text = reference.path.read_text(encoding="utf-8")
        start, end = text.index("# Radii usual for machines"), text.index("# The paper prints no housing")
        text = text[:start] + motor + "\n" + text[end:]
        for old, new in replacements.items():
            text = text.replace(old, new)
        path = tmp_path / "fleet.toml"
        path.write_text(text, encoding="utf-8")
        return load_fleet(path)

    return made


def test_the_motors_tones(fleet_of):
    prediction = td.DriveModel(fleet_of(MOTOR + FLUX + POWER + UNKNOWN)).evaluate()
    tones = {source.name: source for source in prediction.sound[0].sources}
    assert set(tones) == {"carrier x2", "fan", "mesh"}  # slots has no amplitude
    assert tones["carrier x2"].frequency_hz == 926.0
    turns_hz = prediction.conditions[0].condition.motor_hz
    assert tones["fan"].frequency_hz == pytest.approx(7.0 * turns_hz)
    assert tones["fan"].sound_power_level_db == pytest.approx(80.0 + 20.0 * 60.0 * turns_hz / 1000.0)
    # beyond the table, at 1015.9 rpm and above, the fan says nothing
    assert {source.name for source in prediction.sound[4].sources} == {"carrier x2", "mesh"}
    assert any("slots" in doubt for doubt in prediction.doubts)


def test_levels_at_4_m_are_powers_less_23_decibels(fleet_of):
    prediction = td.DriveModel(fleet_of(MOTOR + FLUX)).evaluate()
    for state, sound in zip(prediction.conditions, prediction.sound, strict=True):
        mesh, motor = sound.level_db("4 m", "mesh"), sound.level_db("4 m", "motor")
        # Masuda's level is that at 1 m of a point source: at 4 m 12.04 dB less
        assert mesh == pytest.approx(state.masuda_db - 20.0 * math.log10(4.0), abs=1e-9)
        assert motor == pytest.approx(sound.sound_power_level_db("motor") - 23.0333, abs=1e-3)
        total = 10.0 * math.log10(10.0 ** (mesh / 10.0) + 10.0 ** (motor / 10.0))
        assert sound.level_db("4 m") == pytest.approx(total, abs=1e-9)
        assert sound.level_db("4 m", "structure") is None


def test_a_level_read_as_a_weighted_stands_higher_at_low_frequency(fleet_of):
    plain = td.DriveModel(fleet_of("")).evaluate()
    weighted = td.DriveModel(fleet_of("", **{'weighting = "Z"': 'weighting = "A"'})).evaluate()
    for one, other in zip(plain.sound, weighted.sound, strict=True):
        # read as dB(A), the formula's level is the A-weighted one of the mesh
        assert other.level_db("4 m", "mesh", "A") == pytest.approx(one.level_db("4 m", "mesh"), abs=1e-9)


def test_receivers_hear_the_sources_from_where_they_are(fleet_of):
    model = td.DriveModel(fleet_of(MOTOR + FLUX))
    near_motor = Receiver("near", 0.9, (0.0, 1.1, 0.0))
    sound = model.evaluate(receivers=[near_motor, Receiver("at 4 m", 4.0)]).sound[2]
    motor = next(source for source in sound.sources if source.path == "motor")
    expected = motor.sound_power_level_db - 10.0 * math.log10(4.0 * math.pi * 0.5**2)
    assert sound.level_db("near", "motor") == pytest.approx(expected, abs=1e-9)
    assert sound.level_db("at 4 m") == pytest.approx(sound.level_db("4 m"), abs=1e-9)


def test_over_ground_the_mean_is_three_decibels_higher(fleet_of):
    free = td.DriveModel(fleet_of("")).evaluate().sound[0]
    half = td.DriveModel(fleet_of("", **{"[radiation]": '[radiation]\nspace = "half"'})).evaluate().sound[0]
    assert half.level_db("4 m") - free.level_db("4 m") == pytest.approx(3.0103, abs=1e-4)


def test_the_directivity_of_one_point_is_round_and_of_two_is_not(fleet_of):
    mesh_alone = td.DriveModel(fleet_of("")).evaluate().directivity
    assert [around.sweep for around in mesh_alone] == ["speed"] * 6 + ["helix"] * 4
    assert all(around.angle_deg.tolist() == list(range(0, 360, 5)) for around in mesh_alone)
    assert np.ptp(mesh_alone[0].level_db) < 1e-9
    with_motor = td.DriveModel(
        fleet_of(MOTOR + FLUX, **{"constant_db = { value = 20": "constant_db = { value = -20"})
    ).evaluate()
    level = with_motor.directivity[0].level_db
    assert np.ptp(level) > 0.1
    assert int(np.argmax(level)) == 18  # 90°, the motor's side


@pytest.mark.parametrize(
    ("old", "new", "adds", "doubt"),
    [
        ('placement = "free"', 'placement = "off"', False, "is off"),
        ('placement = "free"', 'placement = "inside"', False, "inside the housing"),
        ('gear_path = "masuda"', 'gear_path = "structure"', False, "way through the housing takes method"),
        ('gear_path = "masuda"', 'gear_path = "sum"', True, "way through the housing takes method"),
    ],
)
def test_what_the_total_adds_is_said(fleet_of, old, new, adds, doubt):
    prediction = td.DriveModel(fleet_of(MOTOR + FLUX, **{old: new})).evaluate()
    sound = prediction.sound[0]
    alone = sound.level_db("4 m", "motor")
    assert (sound.level_db("4 m") > alone + 1e-6) is adds
    assert sound.level_db("4 m", "mesh") is not None  # shown in any case
    assert any(doubt in text for text in prediction.doubts)


@pytest.mark.parametrize(
    ("motor", "message"),
    [
        (MOTOR.replace("loss_factor = 0.02", "") + FLUX, r"\[motor\]: loss_factor is missing"),
        (MOTOR + FLUX.replace("order = 4\n", ""), r"carrier x2: order is missing, and its flux densities need it"),
        (MOTOR + FLUX.replace("order = 4", "order = 1"), r"carrier x2: spatial order 1 moves the rotor"),
    ],
)
def test_a_motor_that_cannot_be_computed_is_refused(fleet_of, motor, message):
    with pytest.raises(FleetError, match=message):
        td.DriveModel(fleet_of(motor)).evaluate()


def test_the_air_takes_what_iso_9613_says(fleet_of, conformance):
    """3.66 dB/km at 1 kHz, 10 °C and 70 %, in proportion to the way from each source (ISO 9613-2, Table 2)."""
    tone = '[[motor.excitation]]\nname = "tone"\nfixed_hz = 1000\nsound_power_level_db = 100\n'
    cold = "[radiation]\ntemperature_degc = 10\nhumidity_percent = 70\n"
    far = Receiver("far", 1000.0, (1000.0, 0.6, 0.0))
    levels = []
    for switch in ("", "air_absorption = true\n"):
        model = td.DriveModel(fleet_of(MOTOR + tone, **{"[radiation]\n": cold + switch}))
        levels.append(model.evaluate(receivers=[far]).sound[0])
    plain, absorbed = levels
    taken = plain.level_db("far", "motor") - absorbed.level_db("far", "motor")
    source = "standard: ISO 9613-2:1996, Table 2"
    conformance("absorption over 1 km at 1 kHz, 10 °C, 70 %", 3.7, taken, 0.05, "dB", source)
    assert taken == pytest.approx(3.66, abs=0.01)
    assert plain.level_db("4 m", "motor") - absorbed.level_db("4 m", "motor") == pytest.approx(0.0146, abs=1e-3)
    assert plain.sound_power_level_db("motor") == absorbed.sound_power_level_db("motor")


def test_air_beyond_the_standard_is_a_doubt(fleet_of):
    dry = "[radiation]\nhumidity_percent = 5\nair_absorption = true\n"
    doubts = td.DriveModel(fleet_of(MOTOR + FLUX, **{"[radiation]\n": dry})).evaluate().doubts
    assert any("5 % humidity is extrapolated: ISO 9613-1" in doubt for doubt in doubts)


def test_the_air_takes_by_the_way_from_the_source(fleet_of):
    """100 m from the motor and 60 m from the drive's middle: 0.366 dB at 1 kHz, 10 °C and 70 %, and 0.97 dB at 2 kHz.

    ISO 9613-2, Table 2: 3.7 and 9.7 dB/km; ISO 9613-1 has 3.66 dB/km at 1 kHz.
    """
    far_off = MOTOR.replace("[0.0, 0.6, 0.0]", "[0.0, 40.0, 0.0]")
    cold = "[radiation]\ntemperature_degc = 10\nhumidity_percent = 70\n"
    receiver = Receiver("other side", 60.0, (0.0, -60.0, 0.0))
    for frequency, taken, digits in ((1000, 0.366, 1e-3), (2000, 0.97, 5e-3)):
        tone = f'[[motor.excitation]]\nname = "tone"\nfixed_hz = {frequency}\nsound_power_level_db = 100\n'
        levels = []
        for switch in ("", "air_absorption = true\n"):
            model = td.DriveModel(fleet_of(far_off + tone, **{"[radiation]\n": cold + switch}))
            levels.append(model.evaluate(receivers=[receiver]).sound[0].level_db("other side", "motor"))
        assert levels[0] - levels[1] == pytest.approx(taken, abs=digits)


@pytest.mark.parametrize(("frequency", "said"), [(40, "40 to "), (600, ""), (12000, "to 12000 Hz")])
def test_frequencies_beyond_the_standard_are_a_doubt(fleet_of, frequency, said):
    tone = f'[[motor.excitation]]\nname = "tone"\nfixed_hz = {frequency}\nsound_power_level_db = 100\n'
    absorbing = {"[radiation]\n": "[radiation]\nair_absorption = true\n"}
    doubts = td.DriveModel(fleet_of(MOTOR + tone, **absorbing)).evaluate().doubts
    held = [doubt for doubt in doubts if "ISO 9613-1 states it for 50 to 10000 Hz" in doubt]
    assert bool(held) is bool(said)
    assert all(said in doubt for doubt in held)
    plain = td.DriveModel(fleet_of(MOTOR + tone)).evaluate().doubts
    assert not any("ISO 9613" in doubt for doubt in plain)
