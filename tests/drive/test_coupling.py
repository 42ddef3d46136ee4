"""Two-way coupling in the drive model: the key, the housing under the bearings, helix angles, the comparison."""

import math
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from made_up_modes import fleet_text, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.drive import DriveModel
from tdacoustic.drive.coupling import COUPLINGS, coupling_doubts, values_of
from tdacoustic.errors import FleetError
from tdacoustic.gears import BearingForces, bearing_forces, steady_state
from tdacoustic.housing import foundation_of, seat_loads
from tdacoustic.tables import predicted_tables

TWO_WAY = {"model.coupling": "two_way"}


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(fleet_text("", 700), encoding="utf-8")
    return td.load_fleet(path).replaced({"model.gear_path": "structure"})


@pytest.fixture(scope="module")
def housing(fleet):
    return sound_of_made_up_modes(fleet)


@pytest.fixture(scope="module")
def both(fleet, housing):
    """Predictions with one-way and with two-way coupling, each with the comparison."""
    models = [DriveModel(held, housing=housing) for held in (fleet, fleet.replaced(TWO_WAY))]
    return [model.with_coupling(model.evaluate()) for model in models]


# ------------------------------------------------------------------ the housing under the bearings


def uneven(housing):
    """A housing whose gears stand out of the middle of their shafts, each at another place."""
    pinion, wheel = housing.box.seats
    return replace(housing.box, seats=(replace(pinion, gear_y_m=0.03), replace(wheel, gear_y_m=-0.05)))


def test_the_power_that_the_gears_give_is_the_power_that_the_seats_take(housing):
    """Bearing forces on the housing by `seat_loads`, motions by the compliance of the seats: R·u = Σ f·w."""
    rng = np.random.default_rng(3)
    box, frequency = uneven(housing), np.array([90.0, 420.0])
    amplitude = rng.standard_normal((2, 3, 2)) + 1j * rng.standard_normal((2, 3, 2))
    loads = seat_loads(box, BearingForces(frequency, np.array([1.0, 2.0]), amplitude, np.zeros((2, 3))))
    at_seats = np.einsum("sdten,ten->sdn", housing.modes.seat_compliance(frequency, 0.03), loads)
    taken = np.einsum("sdn,sdn->n", at_seats, loads.conj())
    moved = np.einsum(
        "nij,jn->in", foundation_of(box, housing.modes, 0.03).compliance_m_per_n(frequency), amplitude.reshape(6, 2)
    )
    given = np.einsum("in,in->n", moved, amplitude.reshape(6, 2).conj())
    assert given == pytest.approx(taken, rel=1e-12)


def test_modal_velocities_are_those_of_the_seats(housing):
    """The same bearing forces shake the housing's modes for the sound and move the seats for the gears."""
    box, frequency = uneven(housing), np.array([333.0])
    amplitude = np.random.default_rng(4).standard_normal((2, 3, 1)) + 0.0j
    loads = seat_loads(box, BearingForces(frequency, np.array([1.0]), amplitude, np.zeros((2, 3))))
    velocities = housing.modes.response(frequency, loads, 0.03)[:, 0]
    held = foundation_of(box, housing.modes, 0.03)
    modal = 2j * np.pi * 333.0 * held.modal_receptance(333.0)[0] * (held.shapes @ amplitude.reshape(6))
    assert velocities == pytest.approx(modal, rel=1e-12)


# ------------------------------------------------------------------ the key


def test_two_way_coupling_needs_a_housing(fleet):
    with pytest.raises(FleetError, match=r"coupling = \"two_way\" needs \[radiation\] method = \"boundary_elements\""):
        fleet.replaced(TWO_WAY | {"radiation.method": "point_sources"})
    with pytest.raises(FleetError, match=r"coupling = \"two_way\" needs the modes of the housing"):
        DriveModel(fleet.replaced(TWO_WAY)).gears(DriveModel(fleet).conditions[0])


def test_one_way_is_what_it_was(fleet, housing):
    """Without the key, and with it at its default, the housing changes nothing at the gears."""
    plain = DriveModel(fleet.replaced({"radiation.method": "point_sources"}))
    held = DriveModel(fleet, housing=housing)
    for condition in plain.conditions:
        one, other = plain.gears(condition), held.gears(condition)
        assert one.steady.dte_pp_m == other.steady.dte_pp_m
        assert np.array_equal(one.forces.amplitude_n, other.forces.amplitude_n)


def test_the_housing_acts_on_the_gears(both, fleet, housing):
    one_way, two_way = both
    changed = [
        two.steady.dte_pp_m / one.steady.dte_pp_m
        for one, two in zip(one_way.conditions, two_way.conditions, strict=True)
    ]
    assert max(abs(ratio - 1.0) for ratio in changed) > 0.01
    model = DriveModel(fleet.replaced(TWO_WAY), housing=housing)
    for state, sound in zip(two_way.conditions, two_way.sound, strict=True):
        expected = model.field.structure_sources(bearing_forces(two_way.unit.system, state.steady))
        heard = [source for source in sound.sources if source.path == "structure"]
        assert [s.sound_power_level_db for s in heard] == pytest.approx([s.sound_power_level_db for s in expected])


def test_helix_angles_stand_on_the_fleets_own_housing(both, fleet):
    _, two_way = both
    compliance = two_way.unit.system.foundation.compliance_m_per_n(300.0)
    for case in two_way.helix:
        held = case.unit.system.foundation
        assert held is not None
        assert np.array_equal(held.compliance_m_per_n(300.0), compliance)
    assert len({case.unit.system.pressure_angle_rad for case in two_way.helix}) > 1


def test_the_loss_factor_of_the_fleet_is_that_of_the_foundation(fleet, housing):
    held = DriveModel(fleet.replaced(TWO_WAY | {"housing.loss_factor": 0.11}), housing=housing).unit.system.foundation
    assert held.loss_factor == 0.11


# ------------------------------------------------------------------ the comparison


def test_the_comparison_is_the_same_from_either_side(both):
    """What a fleet with one coupling says of the other one is what a fleet with that says of itself."""
    one_way, two_way = both
    assert (one_way.coupling.used, two_way.coupling.used) == COUPLINGS
    for one, two in zip(one_way.coupling.conditions, two_way.coupling.conditions, strict=True):
        for name in ("dte_pp_m", "structure_db", "total_db", "floquet_max"):
            values = [[v if v is not None else math.nan for v in getattr(held, name)] for held in (one, two)]
            assert values[0] == pytest.approx(values[1], rel=1e-12, nan_ok=True)
    for number, prediction in enumerate(both):
        for held, state, sound in zip(
            prediction.coupling.conditions, prediction.conditions, prediction.sound, strict=True
        ):
            assert held.dte_pp_m[number] == state.steady.dte_pp_m
            assert held.structure_db[number] == sound.level_db("4 m", "structure")
            assert held.total_db[number] == sound.level_db("4 m")


def test_curves_hold_the_mesh_lines_and_the_balance(both):
    """A transmission error alone, on a mesh of constant stiffness, is what the curves are for."""
    curves = both[0].coupling.curves
    assert (np.diff(curves.frequency_hz) >= 0.0).all()
    lines = [line for line in curves.lines if line is not None]
    assert ("1", 1) in lines
    assert ("1", 4) in lines  # 4 x 175 Hz, the modes reach 700 Hz
    assert ("1", 5) not in lines
    unit = both[1].unit
    lines = replace(unit.system.contact_lines, transverse_contact_ratio=2.0, overlap_ratio=0.0)
    system = replace(unit.system, contact_lines=lines, transmission_error_m=(1e-6,))
    state = both[1].conditions[2]
    steady = steady_state(system, state.mesh_hz, 5913.0)
    place = curves.lines.index((state.condition.name, 1))
    forces = np.abs(bearing_forces(system, steady).amplitude_n[..., 0])
    assert curves.bearing_force_n_per_um[1, ..., place] == pytest.approx(forces, rel=1e-6)


def test_differences_name_extremes_in_their_range(both):
    curves = both[0].coupling.curves
    held = (curves.frequency_hz >= 200.0) & (curves.frequency_hz <= 500.0)
    found = curves.differences(200.0, 500.0)
    assert [(one.gear, one.direction) for one in found][:4] == [
        ("pinion", "x"),
        ("pinion", "y"),
        ("pinion", "z"),
        ("wheel", "x"),
    ]
    values = curves.difference_db[0, 1, held]
    assert found[1].lowest[0] == values.min()
    assert found[1].highest[0] == values.max()
    assert curves.frequency_hz[held][values.argmax()] == found[1].highest[1]
    assert abs(found[1].worst[0]) == np.abs(values).max()


def test_tables_of_the_comparison(both):
    tables = predicted_tables(both[1], 700.0)
    curves, conditions = tables["coupling"], tables["coupling_conditions"]
    assert len(curves) == both[1].coupling.curves.frequency_hz.size
    assert curves["pinion_y_force_two_way_db"].notna().all()
    line = curves[(curves["condition"] == "2") & (curves["harmonic"] == 1.0)]
    assert line["frequency_hz"].item() == pytest.approx(both[1].conditions[1].mesh_hz)
    assert set(conditions["coupling"]) == {"two_way"}
    assert conditions["dte_pp_two_way_um"].tolist() == pytest.approx(
        [1e6 * s.steady.dte_pp_m for s in both[1].conditions]
    )
    assert conditions["in_contact_one_way"].dtype == bool
    plain = predicted_tables(replace(both[0], coupling=None), 700.0)
    assert "coupling" not in plain


def test_a_motion_that_the_balance_does_not_find_leaves_its_side_empty(fleet, housing):
    """Light loads rattle; with the other coupling nothing is integrated in time."""
    light = fleet.replaced(
        {"operation.torque_n_m": 150.0, "operation.train_speed_km_h": (100.0,), "operation.helix_angle_deg": (0.1,)}
    )
    light = light.replaced({"gear_pair.1.transmission_error_um": (20.0,)})
    model = DriveModel(light, housing=housing)
    states = [model.gears(condition) for condition in model.conditions]
    found = model._either_way(model._on_housing(model.unit), states[0], model.sound_of(states[0]))
    assert states[0].steady.separates
    assert found.dte_pp_m[0] == states[0].steady.dte_pp_m
    if found.dte_pp_m[1] is None:
        assert found.total_db[1] is None
        assert found.in_contact[1] is None


def test_a_change_of_the_total_is_told(both):
    one_way = both[0]
    doubts = list(coupling_doubts(one_way.coupling, one_way.conditions))
    worst = max(abs(two - one) for held in one_way.coupling.conditions for one, two in [held.total_db] if one and two)
    assert bool(doubts) is (worst >= 1.0)
    assert all("[model] coupling" in doubt for doubt in doubts)
    assert list(coupling_doubts(both[1].coupling, both[1].conditions)) == []


@pytest.mark.parametrize(
    ("changes", "contact"),
    [
        ({}, True),
        ({"operation.torque_n_m": 0.0}, None),
        ({"operation.torque_n_m": 150.0, "gear_pair.1.transmission_error_um": (20.0,)}, False),
    ],
)
def test_teeth_stay_in_contact_part_or_rest(fleet, changes, contact):
    """Rated torque; none; and too little under a large transmission error."""
    model = DriveModel(fleet.replaced({"radiation.method": "point_sources", "model.gear_path": "masuda"} | changes))
    steady = model.motion(replace(model.conditions[-1], motor_hz=30.0))
    dte, multiplier, found = values_of(steady)
    assert found is contact
    assert dte == steady.dte_pp_m
    assert multiplier is None or 0.0 < multiplier <= 1.0
    assert values_of(None) == (None, None, None)


def test_spur_teeth_push_nothing_along_the_shafts(fleet, housing, tmp_path):
    """Helix 0: no force along z with one-way coupling, so nothing there to compare; and no warning."""
    text = fleet.path.read_text(encoding="utf-8")
    (distance,) = re.findall(r"(?m)^centre_distance_mm.*$", text)
    path = tmp_path / "fleet.toml"
    path.write_text(text.replace(distance, "helix_angle_deg = 0"), encoding="utf-8")
    spur = td.load_fleet(path).replaced({"model.gear_path": "structure", "operation.helix_angle_deg": (0.0, 4.0)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = DriveModel(spur, housing=housing)
        prediction = model.with_coupling(model.evaluate())
        curves = prediction.coupling.curves
        found = curves.differences(100.0, 600.0)
        tables = predicted_tables(prediction, 700.0)
    assert prediction.unit.geometry.helix_angle_rad == 0.0
    assert np.abs(curves.bearing_force_n_per_um[0, :, 2]).max() < 1e-12 * curves.bearing_force_n_per_um[0].max()
    assert [(one.gear, one.direction) for one in found] == [(g, d) for g in ("pinion", "wheel") for d in "xy"]
    assert np.isnan(curves.difference_db[:, 2]).all()
    assert np.isfinite(curves.difference_db[:, :2]).all()
    assert tables["coupling"]["pinion_x_force_two_way_db"].notna().all()
    one, two = prediction.coupling.conditions[2].dte_pp_m
    assert one > 0.0 and two > 0.0
