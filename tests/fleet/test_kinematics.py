import csv
import dataclasses
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.errors import FleetError
from tdacoustic.fleet import GearStage, Kinematics, Motor, MotorExcitation, Parameter, load_fleet
from tdacoustic.fleet.kinematics import mesh_orders, shaft_orders, supply_hz

ROOT = Path(__file__).resolve().parents[2]

TABLE_1 = (  # condition, km/h, rpm, Hz
    ("1", 20, 338.65, 174.97),
    ("2", 30, 507.97, 262.45),
    ("3", 40, 677.30, 349.94),
    ("4", 50, 846.61, 437.42),
    ("5", 60, 1015.90, 524.90),
)

PAPER = Kinematics(1.05112, (GearStage("1", (31, 104)),))
TWO_STAGES = Kinematics(0.92, (GearStage("first", (20, 40)), GearStage("second", (25, 50))))


@pytest.fixture
def drive():
    return Kinematics.of(load_fleet(ROOT / "calibration" / "crrc-freight"))


@pytest.mark.parametrize(("condition", "km_h", "rpm", "hz"), TABLE_1)
def test_table_1(drive, conformance, condition, km_h, rpm, hz):
    motor_hz = drive.motor_hz_at_km_h(km_h)
    what, source = f"condition {condition}, {km_h} km/h", "paper: Table 1"
    # Printed to 0.01, and cut rather than rounded.
    note = "1015.90 rpm contradict the 524.90 Hz printed beside them, which are 1015.94 rpm" if condition == "5" else ""
    conformance(f"{what}: motor speed", rpm, 60.0 * motor_hz, 0.011, "rpm", source, note, deviates=bool(note))
    conformance(f"{what}: mesh frequency", hz, drive.mesh_hz(motor_hz)["1"], 0.01, "Hz", source)


def test_the_motor_speed_printed_for_condition_5_is_not_that_of_its_own_mesh_frequency(drive, conformance):
    # 1015.90 rpm x 31 / 60 is 524.88 Hz, but 524.90 Hz is printed, which is 1015.94 rpm: that is what we get
    rpm = 60.0 * drive.motor_hz_at_km_h(60.0)
    conformance(
        "condition 5: motor speed by its 524.90 Hz",
        60 * 524.90 / 31,
        rpm,
        0.01,
        "rpm",
        "paper: Table 1, 524.90 Hz over 31 teeth",
    )
    assert abs(rpm - 1015.90) > 0.03
    assert abs(1015.90 * 31 / 60 - 524.90) > 0.01


def test_table_4_condition_6(drive, conformance):
    motor_hz, source = 1938.0 / 60.0, "paper: Table 4"
    conformance("condition 6: mesh frequency at 1938 rpm", 1001.3, drive.mesh_hz(motor_hz)["1"], 0.05, "Hz", source)
    speed = drive.train_speed_km_h(motor_hz)
    conformance("condition 6: train speed", 114.455, speed, 0.001, "km/h", "analytic: pi D n z1 / z2, by hand")
    conformance("condition 6: train speed as printed", 114.0, speed, 0.5, "km/h", source)


@pytest.mark.parametrize("table", ["table1_test_conditions.csv", "table4_operating_conditions.csv"])
def test_the_tables_beside_the_checkout(table):
    path = ROOT.parent / "shared" / "paper" / table
    if not path.is_file():
        pytest.skip("the paper's tables are not at hand")
    rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    assert len(rows) >= 5
    for row in rows:
        mesh = PAPER.mesh_hz(PAPER.motor_hz_at_km_h(float(row["train_speed_km_h"])))["1"]
        if row["condition"] == "6":  # 114 is 114.455 without its decimals
            assert abs(mesh / float(row["mesh_frequency_hz"]) - 1.0) < 0.5 / 114
        else:
            assert abs(mesh - float(row["mesh_frequency_hz"])) <= 0.01


def test_two_stages_by_hand():
    assert TWO_STAGES.ratio == 4.0
    assert TWO_STAGES.shaft_orders == (1.0, 0.5, 0.25)
    assert TWO_STAGES.wheelset_order == 0.25
    assert TWO_STAGES.mesh_hz(30.0) == {"first": 600.0, "second": 375.0}  # 25 teeth on a shaft of 15 turns a second
    meshes = [e for e in TWO_STAGES.excitations(30.0, 1200.0) if e.kind == "mesh"]
    assert [(e.name, e.pair, e.harmonic, e.order, e.frequency_hz) for e in meshes] == [
        ("mesh second x1", "second", 1, 12.5, 375.0),
        ("mesh first x1", "first", 1, 20.0, 600.0),
        ("mesh second x2", "second", 2, 25.0, 750.0),
        ("mesh second x3", "second", 3, 37.5, 1125.0),
        ("mesh first x2", "first", 2, 40.0, 1200.0),
    ]


teeth_lists = st.lists(st.tuples(st.integers(5, 200), st.integers(5, 200)), min_size=1, max_size=4)


@given(teeth_lists)
def test_both_gears_of_a_pair_mesh_equally_often(teeth):
    shafts = shaft_orders(teeth)
    for stage, ((driving, driven), order) in enumerate(zip(teeth, mesh_orders(teeth), strict=True)):
        assert order == pytest.approx(driving * shafts[stage], rel=1e-12)
        assert order == pytest.approx(driven * shafts[stage + 1], rel=1e-12)


@given(teeth_lists, st.floats(0.3, 2.0), st.floats(0.01, 400.0))
def test_there_and_back_again(teeth, diameter_m, km_h):
    drive = Kinematics(diameter_m, tuple(GearStage(str(k), pair) for k, pair in enumerate(teeth)))
    motor_hz = drive.motor_hz_at_km_h(km_h)
    assert drive.train_speed_km_h(motor_hz) == pytest.approx(km_h, rel=1e-12)
    assert drive.train_speed_m_s(motor_hz) * 3.6 == pytest.approx(km_h, rel=1e-12)
    wheel_hz = drive.wheel_hz(km_h / 3.6)
    assert drive.wheel_hz_of_motor(motor_hz) == pytest.approx(wheel_hz, rel=1e-12)
    assert drive.motor_hz_of_wheel(wheel_hz) == pytest.approx(motor_hz, rel=1e-12)
    assert drive.wheelset_order * motor_hz == pytest.approx(wheel_hz, rel=1e-12)


def test_a_worn_wheel_turns_faster():
    fleet = load_fleet(ROOT / "calibration" / "crrc-freight")
    new, worn = Kinematics.of(fleet), Kinematics.of(fleet, wheel_diameter_mm=1000.0)
    assert worn.motor_hz(10.0) == pytest.approx(1.05112 * new.motor_hz(10.0), rel=1e-12)
    assert worn.mesh_orders == new.mesh_orders
    assert Kinematics.of(fleet, wheel_diameter_mm=1051.12).wheel_diameter_m == new.wheel_diameter_m


def of_motor(**entries):
    excitations = entries.pop("excitation", ())
    motor = Motor(**{key: Parameter(value) for key, value in entries.items()}, excitation=excitations)
    return dataclasses.replace(PAPER, motor=motor)


def excitation(name, **entries):
    return MotorExcitation(name=name, **{key: Parameter(value) for key, value in entries.items()})


def named(drive, motor_hz, highest_hz=5000.0):
    return {e.name: e for e in drive.excitations(motor_hz, highest_hz)}


def test_families_without_a_motor():
    found = named(PAPER, 20.0, 2000.0)
    assert {e.kind for e in found.values()} == {"mesh", "motor", "wheelset"}
    assert [name for name in found if name.startswith("mesh")] == ["mesh x1", "mesh x2", "mesh x3"]
    assert found["mesh x3"].frequency_hz == pytest.approx(3 * 31 * 20.0)
    assert found["motor shaft x2"].order == 2.0
    assert found["wheelset x1"].frequency_hz == pytest.approx(20.0 * 31 / 104)
    assert all(e.frequency_hz == pytest.approx(e.order * 20.0) for e in found.values())
    frequencies = [e.frequency_hz for e in PAPER.excitations(20.0, 2000.0)]
    assert frequencies == sorted(frequencies)


def test_a_mesh_harmonic_at_the_highest_frequency_is_in():
    motor_hz = 174.97 / 31
    assert named(PAPER, motor_hz, 3 * 31 * motor_hz)["mesh x3"]


def test_a_carrier_alone_gives_its_first_six_multiples():
    found = [e for e in of_motor(carrier_hz=463.0).excitations(15.0, 5000.0) if e.kind == "inverter"]
    assert [(e.name, e.frequency_hz, e.order, e.harmonic) for e in found] == [
        (f"carrier x{k}", 463.0 * k, None, k) for k in range(1, 7)
    ]


def test_the_demonstration_names_the_multiples_of_table_2(drive):
    # no conformance: the carrier is inferred from the same table
    found = named(drive, drive.motor_hz_at_km_h(20.0))
    assert [name for name in found if name.startswith("carrier")] == [f"carrier x{k}" for k in (1, 2, 3, 4, 6)]
    assert all(e.kind == "inverter" and e.order is None for name, e in found.items() if name.startswith("carrier"))
    for k, hz in ((1, 462), (2, 926), (3, 1387), (4, 1852), (6, 2778)):
        assert abs(found[f"carrier x{k}"].frequency_hz - hz) <= 2.0
        assert found[f"carrier x{k}"].harmonic == k


def test_excitations_of_the_motor():
    entries = {"pole_pairs": 2, "slip": 0.01, "carrier_hz": 500.0}
    drive = of_motor(
        **entries,
        excitation=(
            excitation("side", carrier=2.0, supply=-2.0),
            excitation("slot", shaft=44.0),
            excitation("pole", supply=2.0, shaft=1.0),
            excitation("fan", shaft=9.0, fixed_hz=3.0),
            excitation("hum", fixed_hz=100.0),
            excitation("below", carrier=1.0, supply=-40.0),
            excitation("nothing", supply=1.0, fixed_hz=-supply_hz(30.0, 2, 0.01)),
        ),
    )
    found = named(drive, 30.0)
    supply = 60.0 / 0.99
    assert found["side"].frequency_hz == pytest.approx(1000.0 - 2 * supply)
    assert (found["side"].kind, found["side"].order) == ("inverter", None)
    assert found["side"].hz_per_motor_hz == pytest.approx(-2 * supply / 30.0)
    assert (found["slot"].kind, found["slot"].order, found["slot"].frequency_hz) == ("motor", 44.0, 1320.0)
    assert found["pole"].order == pytest.approx(2 * supply / 30.0 + 1.0)
    assert (found["fan"].order, found["fan"].hz_per_motor_hz, found["fan"].frequency_hz) == (None, 9.0, 273.0)
    assert (found["hum"].kind, found["hum"].order, found["hum"].hz_per_motor_hz) == ("motor", None, 0.0)
    assert "below" not in found and "nothing" not in found
    assert drive.supply_hz(30.0) == pytest.approx(supply)
    assert PAPER.supply_hz(30.0) is None and PAPER.carrier_hz(30.0) is None


def test_at_standstill_only_what_stands_still_is_left():
    drive = of_motor(carrier_hz=500.0, excitation=(excitation("a", carrier=1.0), excitation("b", shaft=3.0)))
    assert [e.name for e in drive.excitations(0.0, 1000.0)] == ["a"]


@pytest.mark.parametrize(
    ("rpm", "hz"), [(0, 400), (500, 500), (1000, 600), (1400, 600), (1401, None), (1938, None), (2001, None)]
)
def test_a_carrier_over_motor_speed(rpm, hz):
    drive = of_motor(carrier_hz=((0.0, 400.0), (1000.0, 600.0), (1400.0, 600.0), (1402.0, 0.0), (2000.0, 0.0)))
    assert drive.carrier_hz(rpm / 60.0) == (None if hz is None else pytest.approx(hz))
    assert bool([e for e in drive.excitations(rpm / 60.0, 3000.0) if e.kind == "inverter"]) is (hz is not None)


def test_a_carrier_between_tables_ends_and_zero():
    drive = of_motor(carrier_hz=((100.0, 0.0), (200.0, 500.0), (300.0, 700.0)))
    assert [drive.carrier_hz(rpm / 60.0) for rpm in (50, 100, 150, 301)] == [None] * 4
    assert drive.carrier_hz(250 / 60.0) == pytest.approx(600.0)


def test_an_excitation_is_expected_only_where_its_amplitude_is():
    drive = of_motor(
        carrier_hz=500.0,
        excitation=(
            excitation("t", carrier=1.0, flux_density_t=((300.0, 0.2, 0.1), (600.0, 0.4, 0.3))),
            excitation("p", carrier=2.0, sound_power_level_db=((300.0, 80.0), (600.0, 90.0))),
            excitation("zero", carrier=3.0, flux_density_t=(0.0, 0.2)),
            excitation("always", carrier=4.0, sound_power_level_db=80.0),
        ),
    )
    named_at = {
        rpm: {e.name for e in drive.excitations(rpm / 60.0, 5000.0) if e.kind == "inverter"} for rpm in (450, 900)
    }
    assert named_at == {450: {"t", "p", "always"}, 900: {"always"}}
    t, p, *_ = drive.motor.excitation
    assert t.flux_density_t_at(450.0) == pytest.approx((0.3, 0.2))
    assert p.sound_power_level_db_at(450.0) == pytest.approx(85.0)
    assert t.sound_power_level_db_at(450.0) is None and p.flux_density_t_at(450.0) is None


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Kinematics(0.0, PAPER.stages), r"wheel_diameter_m must be > 0, got 0\.0"),
        (lambda: Kinematics(math.nan, PAPER.stages), "wheel_diameter_m must be > 0, got nan"),
        (lambda: Kinematics(1.0, ()), "at least one gear pair"),
        (lambda: PAPER.excitations(-1.0, 100.0), r"motor_hz must be >= 0, got -1\.0"),
        (lambda: PAPER.excitations(1.0, math.inf), "highest_hz must be > 0, got inf"),
    ],
)
def test_what_cannot_be_is_refused(call, message):
    with pytest.raises(FleetError, match=message):
        call()


def test_a_drive_that_all_but_stands_has_no_endless_row_of_harmonics():
    meshes = [e for e in PAPER.excitations(1e-9, 25600.0) if e.kind == "mesh"]
    assert len(meshes) == 1000 and meshes[-1].harmonic == 1000
