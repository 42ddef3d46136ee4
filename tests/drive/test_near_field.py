"""Maps close to the housing: their levels against those of receivers, their places, and what they say."""

import dataclasses
import math
import warnings

import numpy as np
import pytest
from made_up_maps import bump, by_hand
from made_up_modes import fleet_text, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.drive import DriveModel, Receiver, pattern_correlation
from tdacoustic.drive.housing_steps import housing_tasks, panel_velocities
from tdacoustic.drive.near_field import INSIDE, NOWHERE, OUTSIDE, map_planes
from tdacoustic.drive.near_field_step import (
    FieldLine,
    NearFieldSettings,
    _inside,
    _near_field,
    near_field_of,
    near_field_task,
    planes_of,
)
from tdacoustic.drive.source_inside import CAVITY_MODES, CavitySettings, _cavity
from tdacoustic.errors import FleetError

MOTOR = """
[motor]
position_m = [0.0, 0.6, 0.0]
[[motor.excitation]]
name = "low"
fixed_hz = 300
sound_power_level_db = 100
[[motor.excitation]]
name = "beyond"
fixed_hz = 1500
sound_power_level_db = 90
"""
PLACES = [(0.0, -0.25, 0.0), (0.4, 0.2, 0.0), (-0.1, 0.0, -0.3), (0.0, 0.25, 0.1), (0.6, 0.6, 0.0)]
RECEIVERS = [Receiver(f"r{number}", math.hypot(*place), place) for number, place in enumerate(PLACES)]
PATHS = ("structure", "mesh", "motor", "total")


def made(folder, *replacements):
    """A small fleet with coarse maps, its made-up housing with receivers, its prediction and the maps of "2"."""
    text = fleet_text(MOTOR, 700).replace(
        "[radiation]\n", "[radiation]\nmap_half_width_m = 0.6\nmap_spacing_m = 0.05\n", 1
    )
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new, 1)
    folder.mkdir(exist_ok=True)
    (folder / "fleet.toml").write_text(text, encoding="utf-8")
    fleet = td.load_fleet(folder / "fleet.toml")
    housing = sound_of_made_up_modes(fleet, RECEIVERS)
    prediction = DriveModel(fleet, housing=housing).evaluate(receivers=RECEIVERS)
    return fleet, housing, prediction, field_of(fleet, housing, prediction.sound[1])


def task_of(fleet, housing, sound):
    planes = map_planes(fleet, housing.box, housing.body)
    return near_field_task(fleet, housing, sound, planes, housing_tasks(fleet).modes), planes


def field_of(fleet, housing, sound):
    task, planes = task_of(fleet, housing, sound)
    return near_field_of(fleet, housing, sound, planes, _near_field(task.settings, housing.modes))


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    return made(tmp_path_factory.mktemp("free"), ('method = "bound', 'air_absorption = true\nmethod = "bound'))


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    return made(tmp_path_factory.mktemp("half"), ("[radiation]\n", '[radiation]\nspace = "half"\n'))


def level_at(field, place, path):
    for held in field.planes:
        gap = np.abs(held.plane.points_m - place).max(axis=1)
        if gap.min() < 1e-9:
            return held.level_db[path].ravel()[int(gap.argmin())]
    raise AssertionError(f"{place} is on no map")


@pytest.mark.parametrize("space", ["free", "half"])
def test_maps_are_the_levels_of_receivers(space, request):
    """Near receivers come from pressures interpolated over frequency, the map from a solve at each line."""
    _, _, prediction, field = request.getfixturevalue(space)
    sound = prediction.sound[1]
    for receiver in RECEIVERS:
        for path in PATHS:
            wanted = sound.level_db(receiver.name, path)
            got = level_at(field, receiver.position_m, path)
            assert got == pytest.approx(wanted, abs=0.1), (receiver.position_m, path)


def test_places(free, half):
    _, housing, _, field = free
    assert housing.box.extent_m == (0.5, 0.2, 0.4)
    for held in field.planes:
        plane, levels = held.plane, held.level_db["total"]
        points = plane.points_m.reshape(*plane.place.shape, 3)
        inner = (np.abs(points) < np.array([0.244, 0.092, 0.194]) - 1e-9).all(axis=-1)
        outer = (np.abs(points) < np.array([0.25, 0.1, 0.2]) - 1e-9).all(axis=-1)
        assert (plane.place[inner] == INSIDE).all()
        assert (plane.place[outer & ~inner] == NOWHERE).all()
        assert (plane.place[~outer] == OUTSIDE).all()  # points on the wall take the pressure there
        outside = plane.place == OUTSIDE
        sources = [np.linalg.norm(points - place, axis=-1) < 1e-9 for _, place in field.sources_m]
        assert np.isnan(levels[~outside]).all()
        assert (np.isfinite(levels) == outside & ~np.any(sources, axis=0)).all()
    ground = half[3].planes[1].plane
    assert (ground.place[ground.up_m < half[1].body.ground_m] == NOWHERE).all()
    assert (ground.place == NOWHERE).sum() > (field.planes[1].plane.place == NOWHERE).sum()


def test_there_are_no_planes_around_a_housing_that_is_no_box(free):
    fleet, housing = free[:2]
    assert [plane.name for plane in planes_of(fleet, housing)] == ["XY", "XZ", "YZ"]
    assert planes_of(fleet, dataclasses.replace(housing, box=None)) == ()


def test_what_is_computed_how(free):
    field = free[3]
    assert field.adds == ("motor", "mesh")
    assert field.free_hz == (1500.0,)
    assert field.scattered_hz == pytest.approx([262.45, 300.0, 524.9], abs=0.05)
    assert dict(field.sources_m) == {"motor": (0.0, 0.6, 0.0), "mesh": pytest.approx((0.0, 0.0, 0.3))}
    assert field.low_m == pytest.approx((-0.25, -0.1, -0.2))
    assert field.high_m == pytest.approx((0.25, 0.1, 0.2))


def key_of(fleet, housing, condition=1):
    sound = DriveModel(fleet, housing=housing).evaluate().sound[condition]
    return task_of(fleet, housing, sound)[0].key


@pytest.mark.parametrize(
    ("key", "value", "again"),
    [
        ("masuda.constant_db", 5.0, False),
        ("model.motor_gain_db", 3.0, False),
        ("radiation.sphere_radius_m", 5.0, False),
        ("housing.loss_factor", 0.1, True),
        ("operation.torque_n_m", 1000.0, True),
        ("model.structure_gain_db", 3.0, True),
        ("radiation.map_spacing_m", 0.06, True),
        ("radiation.map_half_width_m", 0.7, True),
    ],
)
def test_a_map_is_computed_again_when_what_it_depends_on_changes_and_only_then(free, key, value, again):
    fleet, housing = free[:2]
    assert (key_of(fleet.replaced({key: value}), housing) != key_of(fleet, housing)) is again
    assert key_of(fleet, housing, 2) != key_of(fleet, housing)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('map_conditions = ["1", "1"]', "names '1' twice"),
        ("map_spacing_m = 0.001", "map_spacing_m must divide the maps into 2 to 300 cells"),
        ("map_half_width_m = 0.02", "map_spacing_m must divide the maps"),
        ("map_spacing_m = 0", "map_spacing_m"),
    ],
)
def test_maps_that_cannot_be_are_refused(tmp_path, keys, message):
    text = fleet_text(MOTOR, 700).replace("[radiation]\n", f"[radiation]\n{keys}\n", 1)
    (tmp_path / "fleet.toml").write_text(text, encoding="utf-8")
    with pytest.raises(FleetError, match=message):
        td.load_fleet(tmp_path / "fleet.toml")


# ---------------------------------------------------------------- what is said of maps, on levels put in by hand


def test_the_loudest_point_leaves_out_what_is_at_a_source():
    field = by_hand(bump((0.0, 0.8, 0.0)))
    loudest = field.highest("outside")
    assert math.dist(loudest.position_m, (0.0, 0.8, 0.0)) == pytest.approx(0.2)
    assert loudest.level_db == pytest.approx(94.0)
    mesh_alone = by_hand(bump((0.0, 0.8, 0.0)), adds=("mesh",)).highest("outside")
    assert mesh_alone.level_db == pytest.approx(100.0)  # the motor is no part of this total
    inside = field.highest("inside")
    assert inside.position_m == pytest.approx((0.0, 0.1, 0.0))
    assert field.inside_path == "total"
    assert field.range_db("outside")[1] == pytest.approx(94.0)


@pytest.mark.parametrize(
    ("place", "between"),
    [
        ((0.0, 0.5, 0.0), True),
        ((0.25, 0.2, -0.1), True),
        ((0.0, 0.9, 0.0), False),
        ((0.0, -0.3, 0.0), False),
        ((0.5, 0.5, 0.0), False),
    ],
)
def test_between_motor_and_housing(place, between):
    assert by_hand(bump(place)).lies_between(place) is between


def test_the_region_around_the_highest_level():
    field = by_hand(bump((0.0, 0.5, 0.0), 90.0))
    right, up = field.outline("XY", "outside")
    corners = np.isfinite(up)
    reach = np.hypot(right[corners], up[corners] - 0.5)
    assert 0.05 < reach.min() < reach.max() < 0.2  # 3 dB are 0.1 m here, and cells are 0.1 m wide
    assert not field.outline("XZ", "outside")[0].size
    assert np.isfinite(right).all()


def test_patterns_are_alike_whatever_their_height():
    one, louder, other = (
        by_hand(bump((0.0, 0.5, 0.0))),
        by_hand(bump((0.0, 0.5, 0.0), 120.0)),
        by_hand(bump((0.9, 0, 0))),
    )
    alike = pattern_correlation([one, louder, other])
    assert alike[0, 1] == pytest.approx(1.0)
    assert abs(alike[0, 2]) < 0.5
    assert alike.shape == (3, 3)
    silent = by_hand(lambda points: np.full(len(points), math.nan))
    assert np.isnan(pattern_correlation([one, silent])).tolist() == [[False, True], [True, True]]
    assert silent.highest("outside") is None
    assert silent.range_db("outside") is None
    assert silent.inside_path is None


# ---------------------------------------------------------------- inside


@pytest.fixture(scope="module")
def cavity(free):
    housing = free[1]
    body = housing.body
    density = body.impedance_pa_s_m / body.sound_speed_m_s
    return _cavity(CavitySettings((0.05, 0.0, 0.02), 700.0, body.sound_speed_m_s, density), housing.modes)


def test_far_below_its_modes_the_air_inside_is_a_spring(free, cavity, conformance):
    """p = ρc² Q / (jωV) everywhere: of the volume that the walls take, and of the source's volume flow."""
    _, housing, _, _ = free
    modes, body = housing.modes, housing.body
    surface = body.surface(1000.0)
    shapes = panel_velocities(modes, surface, body.position_m)
    frequency, omega = 12.0, 2.0 * math.pi * 12.0
    velocities = np.array([0.0, 0.02, 0.0, 0.0, 0.01j, 0.0])
    taken = surface.areas_m2 @ (shapes @ velocities)
    volume = math.prod(
        size - 2.0 * wall for size, wall in zip(housing.box.extent_m, housing.box.thickness_m, strict=True)
    )
    spring = body.impedance_pa_s_m * body.sound_speed_m_s / (omega * volume)
    density = body.impedance_pa_s_m / body.sound_speed_m_s
    flow = 4.0 * math.pi * 2.0 / (omega * density)
    points = np.array([[0.2, 0.05, 0.1], [-0.2, 0.0, 0.0], [0.0, -0.05, -0.15]])
    still = np.zeros(6, dtype=complex)
    lines = (FieldLine(frequency, -1, velocities), FieldLine(frequency, -1, still, 2.0))
    settings = NearFieldSettings(body, 700.0, lines, np.zeros((0, 3)), points, 1e-4)
    found = _inside(settings, modes, cavity)
    assert abs(taken) > 1e-5
    level = 10.0 * np.log10(found[0] / (0.5 * abs(spring * taken) ** 2))
    conformance(
        "level inside of walls far below the first mode",
        0.0,
        np.abs(level).max(),
        0.25,
        "dB",
        "analytic: the air as a spring, p = rho c² Q / (j omega V)",
    )
    # near the source its own field adds some
    level = 10.0 * np.log10(found[1, 1] / (0.5 * (spring * flow) ** 2))
    conformance(
        "level inside of a source far below the first mode",
        0.0,
        level,
        0.25,
        "dB",
        "analytic: the air as a spring, p = rho c² Q / (j omega V)",
    )


def test_a_point_source_outside_moves_no_wall(free, cavity):
    housing = free[1]
    at_source = np.array([housing.body.position_m]) + cavity.source_m
    lines = (FieldLine(300.0, 1, np.zeros(0, dtype=complex)), FieldLine(300.0, -1, np.ones(6, dtype=complex), 1.0))
    settings = NearFieldSettings(housing.body, 700.0, lines, np.zeros((0, 3)), at_source, 0.01)
    found = _inside(settings, housing.modes, cavity)
    assert found[0, 0] == 0.0
    assert np.isnan(found[1, 0])


def test_the_source_inside_is_known_by_what_its_walls_do(free, cavity):
    """Placement inside: the levels inside are those of the source's amplitude and of the walls that it moves."""
    fleet = free[0].replaced({"masuda.placement": "inside", "model.gear_path": "sum"})
    housing = dataclasses.replace(free[1], cavity=cavity)
    model = DriveModel(fleet, housing=housing)
    state, sound = model.evaluate().conditions[1], model.evaluate().sound[1]
    planes = map_planes(fleet, housing.box, housing.body)
    modes = housing_tasks(fleet).modes
    task = near_field_task(fleet, housing, sound, planes, modes, CAVITY_MODES.task("", None, modes=modes))
    (line,) = [line for line in task.settings.lines if line.inside_pa_m]
    assert line.frequency_hz == pytest.approx(state.mesh_hz)
    wanted = math.sqrt(2.0) * 2e-5 * 10.0 ** (0.05 * state.masuda_db)
    assert line.inside_pa_m == pytest.approx(wanted, rel=1e-9)
    field = near_field_of(fleet, housing, sound, planes, _near_field(task.settings, housing.modes, cavity))
    assert dict(field.sources_m)["mesh"] == pytest.approx((0.05, 0.0, 0.02))
    assert field.inside_path == "total"
    assert field.highest("inside").level_db > field.highest("outside", "mesh").level_db
    inside = [held.level_db["mesh"][held.plane.place == INSIDE] for held in field.planes]
    assert all(np.isfinite(levels).all() for levels in inside)


def test_without_its_source_inside_only_the_walls_sound_there(free, cavity):
    fleet, housing = free[0], dataclasses.replace(free[1], cavity=cavity)
    sound, modes = free[2].sound[1], housing_tasks(fleet).modes
    planes = map_planes(fleet, housing.box, housing.body)
    task = near_field_task(fleet, housing, sound, planes, modes, CAVITY_MODES.task("", None, modes=modes))
    field = near_field_of(fleet, housing, sound, planes, _near_field(task.settings, housing.modes, cavity))
    assert field.inside_path == "structure"  # the total here adds motor and mesh
    assert field.highest("inside") == field.highest("inside", "structure")
    assert field.highest("inside", "total") is None
    shown = field.shown_db(field.planes[0])
    outside = field.planes[0].plane.place == OUTSIDE
    assert shown[outside] == pytest.approx(field.planes[0].level_db["total"][outside], nan_ok=True)
    assert np.isfinite(shown[field.planes[0].plane.place == INSIDE]).all()


def test_a_map_without_sound_has_no_correlation_and_leaves_the_others_theirs():
    fields = [
        by_hand(bump((0.0, 0.9, 0.0)), condition="1"),
        by_hand(lambda points: np.full(len(points), -math.inf), condition="2"),
        by_hand(bump((0.0, 0.9, 0.0), 60.0), condition="3"),
        by_hand(lambda points: np.full(len(points), 70.0), condition="4"),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = pattern_correlation(fields)
        silent = pattern_correlation(fields[1:2])
    assert found[0, 2] == pytest.approx(1.0, abs=1e-9)  # the same shape 40 dB down
    assert np.isnan(found[[1, 3]]).all() and np.isnan(found[:, [1, 3]]).all()
    assert silent.shape == (1, 1) and np.isnan(silent).all()
