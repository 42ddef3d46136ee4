"""The box as input: what it checks, what it weighs, which way its axes point, how forces come to its seats."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_housing import reference_box

from tdacoustic.gears import BearingForces
from tdacoustic.housing import (
    SEAT_PLACES,
    Box,
    HousingError,
    Seat,
    gear_axes,
    horizontal_centres,
    mean_seat_loads,
    seat_loads,
)
from tdacoustic.housing.box_modes import expected_modes

PINION, WHEEL = horizontal_centres(0.495)


def with_seat(number, **changes):
    seats = list(reference_box().seats)
    seats[number] = replace(seats[number], **changes)
    return reference_box(seats=tuple(seats))


def test_mass_of_the_reference_housing():
    # physics.md says "about": 480 kg are the plates with their edges counted twice
    assert reference_box().mass_kg == pytest.approx(480.0, abs=15.0)


def test_size_is_along_the_shafts_along_travel_and_up():
    box = reference_box()
    assert box.extent_m == (1.0, 0.45, 0.9)
    assert box.thickness_m == (0.012, 0.014, 0.010)


def test_a_seat_outside_its_panel_is_refused():
    with pytest.raises(
        HousingError, match=r"the wheel's seat at x = 0.3 m, z = 0 m .* leaves its panel.*\|x\| < 0.488"
    ):
        with_seat(1, centre_m=(0.3, 0.0))
    with pytest.raises(HousingError, match=r"the pinion's seat .* leaves its panel.*\|z\| < 0.44 m"):
        with_seat(0, centre_m=(-0.2475, 0.35))


def test_overlapping_seats_are_refused():
    with pytest.raises(HousingError, match=r"seats of pinion and wheel overlap: their centres are 0.33 m apart"):
        with_seat(0, centre_m=(-0.0825, 0.0))


def test_seats_of_one_shaft_only_are_refused():
    seat = Seat("pinion", PINION, 0.1)
    with pytest.raises(HousingError, match="one of the pinion and one of the wheel, in this order, got pinion, pinion"):
        reference_box(seats=(seat, replace(seat, centre_m=WHEEL)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wall_m": 0.0}, "wall_m must be > 0"),
        ({"size_m": (0.45, math.nan, 0.9)}, "size_m must be > 0"),
        ({"poisson": 0.5}, "poisson must be"),
        ({"loss_factor": 0.0}, "loss_factor must be above 0"),
        ({"wall_m": 0.3}, "leave no room"),
        ({"hanger_radius_m": 0.3}, "does not fit on the end wall"),
    ],
)
def test_values_out_of_range_are_refused(changes, message):
    with pytest.raises(HousingError, match=message):
        reference_box(**changes)


def test_seats_thinner_than_their_panel_and_gears_beyond_their_bearings_are_refused():
    with pytest.raises(HousingError, match="must be thicker than its panel"):
        with_seat(0, thickness_m=0.014)
    with pytest.raises(HousingError, match=r"pinion's gear at y = 0.2 m is not between its two bearings"):
        with_seat(0, gear_y_m=0.2)
    with pytest.raises(HousingError, match="shaft of a seat must be one of pinion, wheel"):
        Seat("motor", PINION, 0.1)


def test_the_gears_frame_in_the_drive_frame():
    axes = gear_axes(PINION, WHEEL)
    assert axes @ [1.0, 0.0, 0.0] == pytest.approx([1.0, 0.0, 0.0])  # from the pinion to the wheel
    assert axes @ [0.0, 1.0, 0.0] == pytest.approx([0.0, 0.0, 1.0])  # tangential: up
    assert axes @ [0.0, 0.0, 1.0] == pytest.approx([0.0, -1.0, 0.0])  # along the shafts: to the right


@pytest.mark.parametrize("degrees", [0.0, 25.0, 90.0, 160.0, 250.0])
def test_the_gears_frame_is_a_rotation_wherever_the_wheel_is(degrees):
    turn = math.radians(degrees)
    axes = gear_axes((0.1, -0.2), (0.1 + math.cos(turn), -0.2 + math.sin(turn)))
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[:, 0] == pytest.approx([math.cos(turn), 0.0, math.sin(turn)])


def test_traction_forward_turns_the_wheelset_forward():
    # T1 > 0 turns the pinion about +z of the gears, the wheel about -z; forward is about +y of the drive
    turning = gear_axes(PINION, WHEEL) @ [0.0, 0.0, -1.0]
    assert turning == pytest.approx([0.0, 1.0, 0.0])


def forces(amplitude, mean):
    return BearingForces(np.array([500.0]), np.array([1.0]), np.asarray(amplitude)[..., None], np.asarray(mean))


def test_bearing_forces_come_to_the_seats_half_each_with_their_sign():
    pressing = forces([[1.0, 2.0j, 3.0], [-4.0, 5.0, -6.0]], [[10.0, 20.0, 30.0], [0.0, 0.0, 0.0]])
    loads = seat_loads(reference_box(), pressing)
    assert loads.shape == (4, 3, 1)
    for place, expected in zip(SEAT_PLACES, ([0.5, -1.5, 1.0j],) * 2 + ([-2.0, 3.0, 2.5],) * 2, strict=True):
        assert loads[SEAT_PLACES.index(place), :, 0] == pytest.approx(expected)
    assert mean_seat_loads(reference_box(), pressing)[0] == pytest.approx([5.0, -15.0, 10.0])


def test_a_gear_nearer_to_one_bearing_loads_it_more():
    # bearings at y = ± (0.225 - 0.03) m: a gear at + 0.0975 m leaves three quarters to the left
    box = with_seat(0, gear_y_m=0.0975)
    loads = seat_loads(box, forces(np.ones((2, 3)), np.zeros((2, 3))))
    assert np.abs(loads[:, 0, 0]) == pytest.approx([0.75, 0.25, 0.5, 0.5])
    arms = np.array([0.195, -0.195])
    assert (np.abs(loads[:2, 0, 0]) * arms).sum() == pytest.approx(0.0975)


def test_the_split_keeps_each_gears_force():
    rng = np.random.default_rng(3)
    pressing = forces(rng.standard_normal((2, 3)), rng.standard_normal((2, 3)))
    loads = seat_loads(with_seat(1, gear_y_m=-0.05), pressing)[..., 0]
    for gear in range(2):
        whole = loads[2 * gear] + loads[2 * gear + 1]
        assert np.linalg.norm(whole) == pytest.approx(np.linalg.norm(pressing.amplitude_n[gear, :, 0]))


@pytest.mark.parametrize("degrees", [0.0, 40.0, 200.0])
@pytest.mark.parametrize("gear_y_m", [0.0, 0.05])
def test_mean_loads_balance_the_torques_on_the_shafts(degrees, gear_y_m):
    """What bearings put on the box: no force in all, and the sum of both torques about the shafts, -y of the drive.

    The gears' forces anew: the line of contact is normal to both base circles, F = T1 / (r1 cos βb).
    """
    torque_n_m, radii_m, base_helix, turn = 5913.0, (0.0995, 0.3677), math.radians(17.0), math.radians(degrees)
    centre_distance_m = 0.495
    angle = math.acos(sum(radii_m) / centre_distance_m)
    normal = np.array([math.cos(base_helix) * math.sin(angle), math.cos(base_helix) * math.cos(angle), 0.0])
    normal[2] = math.sin(base_helix)
    force = torque_n_m / (radii_m[0] * math.cos(base_helix))
    apart = 0.5 * centre_distance_m * np.array([math.cos(turn), math.sin(turn)])
    seats = [
        replace(seat, centre_m=tuple(place), radius_m=0.1, gear_y_m=gear_y_m)
        for seat, place in zip(reference_box().seats, (-apart, apart), strict=True)
    ]
    box = reference_box(seats=tuple(seats))
    loads = mean_seat_loads(box, forces(np.zeros((2, 3)), [-force * normal, force * normal]))
    middle = 0.5 * (0.45 - 0.06)
    places = [(*apart * side, y) for side in (-1.0, 1.0) for y in (middle, -middle)]
    moment = sum(np.cross((x, y, z), load) for (x, z, y), load in zip(places, loads, strict=True))
    assert loads.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-8)
    # T2 = T1 r2 / r1; about the shafts, which the gears' z = -y of the drive points along
    assert moment[1] == pytest.approx(-torque_n_m * (1.0 + radii_m[1] / radii_m[0]))


def test_expected_modes_are_about_those_of_physics_md():
    # the estimate only starts the search for modes
    got = expected_modes(reference_box(), 3000.0)
    assert got == pytest.approx(210, abs=25)


def test_a_box_is_plain_and_can_be_kept():
    from tdacoustic.steps.codec import decode, encode

    box = reference_box()
    arrays = []
    assert decode(encode(box, arrays), arrays) == box
    assert isinstance(box, Box)
