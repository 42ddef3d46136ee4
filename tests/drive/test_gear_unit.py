"""From a fleet file to the gear pair of the model, and what is refused on the way."""

import math

import pytest

from tdacoustic.drive import gear_unit_of
from tdacoustic.errors import FleetError


def test_the_reference_drive(reference, conformance):
    unit = gear_unit_of(reference)
    helix_deg = math.degrees(unit.geometry.helix_angle_rad)
    conformance(
        "helix angle from the centre distance",
        4.0,
        helix_deg,
        0.0005,
        "deg",
        "paper: Table 3 (a = 495 mm) with 4 deg of section 5.2",
    )
    assert unit.system.half_backlash_m == pytest.approx(100e-6)
    assert unit.system.transmission_error_m == pytest.approx((5e-6,))
    # c = 2 ζ √(k m) of the pinion's x bearing, by hand
    assert unit.system.bearing_damping_n_s_per_m[0] == pytest.approx(2 * 0.05 * math.sqrt(1e9 * 60.0))
    assert unit.mesh_hz(10.0) == pytest.approx(310.0)


def test_a_stated_helix_angle_gives_the_centre_distance(reference):
    from_distance = gear_unit_of(reference).geometry
    turned = gear_unit_of(reference, math.radians(12.0)).geometry
    assert turned.centre_distance_m == pytest.approx(0.50487, abs=5e-6)  # physics.md section 1: about 504.9 mm
    both = reference.replaced({"gear_pair.1.helix_angle_deg": math.degrees(from_distance.helix_angle_rad)})
    assert gear_unit_of(both).geometry.centre_distance_m == pytest.approx(0.495, abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gear_pair.1.helix_angle_deg": 8.0}, r"helix_angle_deg 8 and centre_distance_mm 495 contradict each other"),
        ({"gear_pair.1.centre_distance_mm": 480.0}, r"no helix angle gives a centre distance of 480 mm"),
        (
            {"gear_pair.1.transmission_error_um": (150.0,)},
            r"300 um peak to peak, is larger than the backlash of 200 um",
        ),
        ({"gear_pair.1.profile_shift": (0.27807, -2.9)}, r"interference: the tip of the wheel would touch the pinion"),
        ({"gear_pair.1.teeth": (5, 104), "gear_pair.1.centre_distance_mm": 405.0}, r"pointed|interference"),
    ],
)
def test_gears_that_cannot_be_are_refused_with_file_and_pair(reference, changes, message):
    with pytest.raises(FleetError, match=rf"fleet\.toml: \[\[gear_pair\]\] 1: .*({message})"):
        gear_unit_of(reference.replaced(changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gear_dynamics.mesh_damping_ratio": 1.01}, r"mesh_damping_ratio must be <= 1, got 1.01"),
        ({"gear_dynamics.bearing_damping_ratio": 2.0}, r"bearing_damping_ratio must be <= 1, got 2"),
        ({"gear_dynamics.mass_kg": (0.0, 280.0)}, r"mass_kg, entry 1, must be > 0"),
        ({"gear_dynamics.wheel_bearing_stiffness_n_per_m": (1e9, -1e9, 1e9)}, r"entry 2, must be > 0"),
        ({"gear_pair.1.teeth": (0, 104)}, r"teeth, entry 1, must be >= 5, got 0"),
    ],
)
def test_values_out_of_range_are_refused_by_the_file(reference, changes, message):
    with pytest.raises(FleetError, match=message):
        reference.replaced(changes)


def test_a_missing_parameter_is_named(tmp_path, reference):
    from tdacoustic.fleet import load_fleet

    text = reference.path.read_text(encoding="utf-8").replace("face_width_mm = 120", "")
    path = tmp_path / "fleet.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FleetError, match=r"\[\[gear_pair\]\]: face_width_mm is missing, and it is needed here"):
        gear_unit_of(load_fleet(path))


def test_the_second_stage_turns_slower_and_carries_more(tmp_path, reference):
    from tdacoustic.fleet import load_fleet

    text = reference.path.read_text(encoding="utf-8")
    first = '[[gear_pair]]\nname = "first"\nteeth = [20, 40]\n\n[[gear_pair]]\nname = "second"'
    text = text.replace("[[gear_pair]]", first).replace("[model]", '[model]\ngear_pair = "second"')
    path = tmp_path / "fleet.toml"
    path.write_text(text, encoding="utf-8")
    unit = gear_unit_of(load_fleet(path))
    assert unit.pair == "second"
    assert unit.mesh_hz(20.0) == pytest.approx(10.0 * 31)
    assert unit.pinion_torque_n_m(100.0) == pytest.approx(200.0)
    assert unit.pitch_line_speed_m_s(20.0) == pytest.approx(2 * math.pi * 10.0 * 0.495 * 31 / 135)
