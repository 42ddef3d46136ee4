"""A fleet with a STEP file: the same levels as its parametric twin, a casting to its levels, and what is refused."""

import math
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_up_modes import fleet_text

import tdacoustic as td
from tdacoustic.drive import DriveModel, Receiver
from tdacoustic.drive.housing_steps import housing_tasks
from tdacoustic.drive.solid_in_air import SolidInAir
from tdacoustic.errors import FleetError
from tdacoustic.radiation.surfaces import Mirrors
from tdacoustic.steps import Store
from tdacoustic.workflows.housing_sound import housing_sound

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "housing"))
pytest.importorskip("ngsolve")

from step_housings import parametric, plain_casting, small, with_opening, write

MOTOR = """
[motor]
position_m = [0.0, 0.6, 0.0]
[[motor.excitation]]
name = "low"
fixed_hz = 300
sound_power_level_db = 100
"""
BESIDE = Receiver("beside", 3.0, (0.5, 2.9, 0.3))
CLOSE = Receiver("close", 0.25, (0.05, -0.2, 0.1))

BOX = """
[housing]
size_m = [0.16, 0.3, 0.24]
wall_mm = 12
bearing_panel_mm = 12
top_bottom_mm = 12
loss_factor = 0.03
"""
STEP = """
[housing]
step_file = "housing.step"
loss_factor = 0.03
"""
SEATS = """
[[housing.seat]]
shaft = "pinion"
position_m = [-0.07, 0.0, 0.01]
radius_m = 0.03
thickness_mm = 25

[[housing.seat]]
shaft = "wheel"
position_m = [0.06, 0.0, -0.01]
radius_m = 0.05
thickness_mm = 25
"""
BORES = """
[[housing.seat]]
shaft = "pinion"
position_m = [-0.11, 0.0, 0.0]

[[housing.seat]]
shaft = "wheel"
position_m = [0.09, 0.0, 0.0]
"""


def fleet_of(folder, housing, highest_hz=1500):
    """A fleet in a folder: the small drive of `made_up_modes` with another housing."""
    text = fleet_text(MOTOR, highest_hz)
    start, end = text.index("[housing]"), text.index("[radiation]")
    folder.mkdir(exist_ok=True)
    path = folder / "fleet.toml"
    path.write_text(text[:start] + housing.lstrip() + "\n" + text[end:], encoding="utf-8")
    return td.load_fleet(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fleets")


@pytest.fixture(scope="module")
def step_fleet(folder):
    fleet = fleet_of(folder / "step", STEP + SEATS)
    write(parametric(small()), fleet.step_path)
    return fleet


@pytest.fixture(scope="module")
def store(folder):
    return Store(folder / "store")


@pytest.fixture(scope="module")
def two(folder, step_fleet, store):
    """The sound of the box and of its twin, with their fleets."""
    box_fleet = fleet_of(folder / "box", BOX + SEATS)
    return [(fleet, housing_sound(fleet, store, 1, None, (BESIDE, CLOSE))[0]) for fleet in (box_fleet, step_fleet)]


def test_a_step_box_sounds_like_the_parametric_box(two):
    """Every condition, path and receiver within 0.5 dB: two grids of the solid, two grids of its surface."""
    box, step = (DriveModel(fleet, housing=sound).evaluate(receivers=(BESIDE, CLOSE)) for fleet, sound in two)
    for one, other in zip(box.sound, step.sound, strict=True):
        for receiver in ("4 m", "beside", "close"):
            for path in ("structure", "mesh", "motor", "total"):
                wanted = one.level_db(receiver, path)
                assert wanted is not None
                assert other.level_db(receiver, path) == pytest.approx(wanted, abs=0.5), (receiver, path)
    assert step.housing.step_file == "housing.step"
    assert any("symmetric to x = 0 m, y = 0 m, z = 0 m" in note for note in step.housing.notes)


def test_and_so_it_does_on_a_fine_axis(two):
    """Forces on all seats, all directions, 200 frequencies: resonances lie within a per cent of each other."""
    frequency = np.linspace(60.0, 1500.0, 200)
    loads = np.zeros((4, 3, 200), dtype=complex)
    loads[:] = np.array([100.0, -60.0, 80.0, 50.0])[:, None, None] * np.array([0.3, 0.5, 1.0])[:, None]
    levels = []
    for _, sound in two:
        moved = sound.modes.response(frequency, loads, 0.03)
        squares = [sound.mean.of_modes(f, column) for f, column in zip(frequency.tolist(), moved.T, strict=True)]
        levels.append(10.0 * np.log10(squares))
    off = levels[1] - levels[0]
    assert math.sqrt(np.mean(off**2)) < 0.6  # 0.53; on the reference housing 0.31 (tests/evidence)
    assert np.abs(off).max() < 2.5  # 1.9: 0.9 % off at a resonance of 3 % width
    sums = [10.0 * math.log10(np.sum(10.0 ** (0.1 * level))) for level in levels]
    assert sums[1] == pytest.approx(sums[0], abs=0.3)


def test_keys_follow_the_content_of_the_file_and_not_its_place(step_fleet, tmp_path):
    moved = fleet_of(tmp_path / "moved", STEP + SEATS)
    shutil.copy(step_fleet.step_path, moved.step_path)
    before, after = housing_tasks(step_fleet), housing_tasks(moved)
    assert before.modes.key == after.modes.key
    assert (before.mean.key, before.points.key) == (after.mean.key, after.points.key)
    text = moved.step_path.read_text(encoding="ascii")
    moved.step_path.write_text(text.replace("'Author'", "'Somebody'"), encoding="ascii")
    assert housing_tasks(moved).modes.key != before.modes.key


@pytest.mark.parametrize(
    ("key", "value", "changes"),
    [
        ("housing.loss_factor", 0.1, ""),
        ("housing.seat.1.position_m", (-0.07, 0.02, 0.01), ""),
        ("radiation.temperature_degc", 5.0, "mean"),
        ("housing.position_m", (0.1, 0.0, 0.0), "modes mean"),  # the seats are stated in the drive's frame
        ("housing.material.modulus_gpa", 200.0, "modes mean"),
    ],
)
def test_steps_are_computed_again_when_what_they_depend_on_changes(step_fleet, key, value, changes):
    if key == "housing.position_m":  # the seats move with the housing
        changes = "mean"
        moved = {"housing.seat.1.position_m": (0.03, 0.0, 0.01), "housing.seat.2.position_m": (0.16, 0.0, -0.01)}
    else:
        moved = {}
    before, after = housing_tasks(step_fleet), housing_tasks(step_fleet.replaced({key: value, **moved}))
    assert (before.modes.key != after.modes.key) is ("modes" in changes)
    assert (before.mean.key != after.mean.key) is ("mean" in changes)


def test_ground_takes_the_level_mirror_plane_away_and_nothing_else(two):
    _, sound = two[1]
    body = sound.body.with_panels(sound.modes)
    assert isinstance(body, SolidInAir)
    assert body.surface(1000.0).mirrors == Mirrors(("x", "y", "z"))
    over_ground = replace(body, ground_m=-0.6)
    assert over_ground.surface(1000.0).mirrors.planes == ("x", "y")
    # the same panels in the same order, so that their velocities fit
    assert over_ground.surface(1000.0).centres_m == pytest.approx(body.surface(1000.0).centres_m, abs=1e-12)
    assert over_ground.surface(1000.0).normals == pytest.approx(body.surface(1000.0).normals, abs=1e-9)


def test_distances_are_those_from_the_surface(two):
    _, sound = two[1]
    for place in ((0.0, 0.3, 0.0), (0.3, 0.2, 0.25), (0.0, 0.05, 0.05), (0.16, 0.0, 0.0)):
        assert sound.body.distance_m(place) == pytest.approx(two[0][1].body.distance_m(place), abs=2e-6)


def test_a_casting_with_bores_ribs_and_roundings_runs_to_its_levels(folder, store):
    fleet = fleet_of(folder / "casting", STEP + BORES, 500)
    write(plain_casting(), fleet.step_path)
    sound, _ = housing_sound(fleet, store, 1)
    found = DriveModel(fleet, housing=sound).evaluate()
    for state in found.sound[:3]:
        for path in ("structure", "mesh", "motor"):
            assert 20.0 < state.level_db("4 m", path) < 130.0
    assert sound.body.mirrors == ("y",)
    assert sound.modes.mass_kg == pytest.approx(7850.0 * 0.0132, rel=0.2)
    assert "closed by plugs" in " ".join(found.housing.notes)


@pytest.mark.parametrize(
    ("housing", "words"),
    [
        (STEP + BORES, r"\[housing\]: step_file housing.step: its inside is open to the outside: about 0.07"),
        (STEP + 'size_m = [0.2, 0.5, 0.4]\n' + BORES, "size_m and step_file are stated both"),
        (STEP + BORES.replace('"wheel"', '"pinion"'), "the pinion has one already"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_naming_fleet_file_and_reason(tmp_path, housing, words):
    fleet = fleet_of(tmp_path / "fleet", housing)
    write(with_opening(), fleet.step_path)
    with pytest.raises(FleetError, match=words) as refused:
        housing_tasks(fleet)
    assert str(fleet.path) in str(refused.value)


def test_a_source_inside_a_step_housing_is_refused(step_fleet, store):
    with pytest.raises(FleetError, match='placement = "inside"'):
        housing_sound(step_fleet.replaced({"masuda.placement": "inside"}), store, 1)


def test_a_receiver_in_it_is_refused_by_name(step_fleet):
    with pytest.raises(FleetError, match=r"the receiver oil at .* lies inside the housing"):
        housing_tasks(step_fleet, (Receiver("oil", 0.1, (0.0, 0.02, 0.05)),))
