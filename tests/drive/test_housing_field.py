"""The housing in the drive model: paths, gains, receivers, keys of the steps, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_up_modes import fleet_text, modes_of, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.drive import DriveModel, Receiver
from tdacoustic.drive.housing_box import box_of
from tdacoustic.drive.housing_steps import housing_tasks, panel_velocities
from tdacoustic.errors import FleetError
from tdacoustic.housing import seat_loads

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
BESIDE = Receiver("beside", 3.0, (0.0, 3.0, 0.0))
CLOSE = Receiver("close", 0.25, (0.0, -0.25, 0.0))
SOMEWHERE = Receiver("8 m", 8.0)


@pytest.fixture(scope="module")
def text():
    return fleet_text(MOTOR, 700)


@pytest.fixture(scope="module")
def fleet(text, tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(text, encoding="utf-8")
    return td.load_fleet(path)


@pytest.fixture(scope="module")
def housing(fleet):
    return sound_of_made_up_modes(fleet, (BESIDE, CLOSE))


def evaluated(fleet, housing, receivers=(), **values):
    changed = fleet.replaced({key.replace("__", "."): value for key, value in values.items()}) if values else fleet
    return DriveModel(changed, housing=housing).evaluate(receivers=receivers)


@pytest.fixture(scope="module")
def prediction(fleet, housing):
    return evaluated(fleet, housing, (BESIDE, CLOSE, SOMEWHERE))


def test_every_path_has_a_level_everywhere(prediction):
    for sound in prediction.sound[:5]:  # the sixth meshes at 1001 Hz, beyond these vectors
        for receiver in ("4 m", "beside", "close", "8 m"):
            for path in ("structure", "mesh", "motor", "total"):
                assert math.isfinite(sound.level_db(receiver, path))
    assert prediction.sound[5].level_db("4 m", "structure") is None
    assert len(prediction.directivity) == 10
    assert all(np.isfinite(around.level_db).all() for around in prediction.directivity)


def test_the_power_of_the_mesh_is_held(prediction):
    """Masuda's level is that of the unit with its housing, so its mean at 4 m is that of a point source."""
    for state, sound in zip(prediction.conditions, prediction.sound, strict=True):
        wanted = state.masuda_db - 20.0 * math.log10(4.0)
        assert sound.level_db("4 m", "mesh") == pytest.approx(wanted, abs=0.06)
    around = prediction.directivity[3].level_db
    assert 0.3 < np.ptp(around) < 20.0  # the housing gives it a direction


def test_the_motor_is_scattered_and_keeps_its_volume_flow(prediction, fleet):
    plain = DriveModel(fleet.replaced({"radiation.method": "point_sources"})).evaluate().sound[0]
    change = prediction.sound[0].level_db("4 m", "motor") - plain.level_db("4 m", "motor")
    assert 0.001 < abs(change) < 3.0


def test_lines_beyond_the_vectors_are_said(prediction):
    said = [doubt for doubt in prediction.doubts if "not scattered" in doubt]
    assert len(said) == 1
    assert "at 1001 to 1500 Hz" in said[0]


def test_the_level_of_the_structure_is_that_of_its_forces(fleet, housing, prediction):
    """By hand: forces on seats, modal velocities, and the means of the vectors."""
    state = prediction.conditions[1]
    lines = np.flatnonzero(state.forces.frequency_hz <= 700.0)
    loads = seat_loads(housing.box, state.forces)[:, :, lines]
    total = 0.0
    for number, line in enumerate(lines):
        frequency = state.forces.frequency_hz[line]
        omega = 2.0 * math.pi * frequency
        modal = np.einsum("msd,sd->m", housing.modes.seats, loads[:, :, number])
        stiffness = (2.0 * math.pi * housing.modes.frequency_hz) ** 2 * (1.0 + 0.03j)
        velocity = 1j * omega * modal / (stiffness - omega**2)
        total += 0.5 * housing.mean.of_modes(frequency, velocity)
    wanted = 10.0 * math.log10(total / 4e-10)
    assert prediction.sound[1].level_db("4 m", "structure") == pytest.approx(wanted, abs=1e-6)


def test_gain_and_loss_factor(fleet, housing, prediction):
    louder = evaluated(fleet, housing, model__structure_gain_db=7.5)
    quieter = evaluated(fleet, housing, housing__loss_factor=0.3)
    for before, gained, damped in zip(prediction.sound[:5], louder.sound, quieter.sound, strict=False):
        level = before.level_db("4 m", "structure")
        assert gained.level_db("4 m", "structure") == pytest.approx(level + 7.5, abs=1e-5)
        assert gained.level_db("4 m", "mesh") == before.level_db("4 m", "mesh")
        assert damped.level_db("4 m", "structure") != pytest.approx(level, abs=0.01)


@pytest.mark.parametrize(("gear_path", "adds"), [("masuda", "mesh"), ("structure", "structure"), ("sum", "both")])
def test_what_the_total_adds(fleet, housing, gear_path, adds):
    found = evaluated(fleet, housing, model__gear_path=gear_path)
    sound = found.sound[2]
    parts = ["motor", *(["mesh", "structure"] if adds == "both" else [adds])]
    wanted = 10.0 * math.log10(sum(10.0 ** (0.1 * sound.level_db("4 m", part)) for part in parts))
    assert sound.level_db("4 m") == pytest.approx(wanted, abs=1e-9)
    assert any("counted twice" in doubt for doubt in found.doubts) is (adds == "both")


def test_a_receiver_without_position_is_the_surface_moved(prediction):
    sound = prediction.sound[2]
    for path in ("structure", "mesh", "motor"):
        assert sound.level_db("8 m", path) == pytest.approx(sound.level_db("4 m", path) - 6.0206, abs=0.01)


def test_the_fields_facts(prediction, housing):
    facts = prediction.housing
    assert facts.mode_hz.tolist() == housing.modes.frequency_hz.tolist()
    assert facts.range_hz == (20.0, 700.0)
    assert facts.left_share == (0.5, 0.5)
    assert facts.mesh_m == pytest.approx((0.0, 0.0, 0.3))
    assert facts.motor_m == (0.0, 0.6, 0.0)


def test_panel_velocities_are_means(fleet):
    box = box_of(fleet, DriveModel(fleet).unit)
    modes = modes_of(box, 700.0)
    tasks = housing_tasks(fleet)
    coarse, fine = tasks.body.surface(1000.0), tasks.body.surface(4000.0)
    whole = [s.areas_m2 @ panel_velocities(modes, s, tasks.body.position_m) for s in (coarse, fine)]
    assert whole[0] == pytest.approx(whole[1], abs=2e-3 * np.abs(whole[1]).max())


def keys_of(fleet, receivers=()):
    tasks = housing_tasks(fleet, receivers)
    return tasks.modes.key, tuple(task.key for task in tasks.bands), tasks.mean.key, tasks.points.key


@pytest.mark.parametrize(
    ("key", "value", "changes"),
    [
        ("housing.loss_factor", 0.1, ""),
        ("operation.torque_n_m", 1000.0, ""),
        ("gear_dynamics.mesh_damping_ratio", 0.2, ""),
        ("masuda.constant_db", 5.0, ""),
        ("model.structure_gain_db", 3.0, ""),
        ("housing.seat.1.position_m", (-0.1, 0.02, 0.0), ""),  # the gear's place along its shaft only splits forces
        ("radiation.circle_radius_m", 10.0, "points"),
        ("radiation.sphere_radius_m", 5.0, "mean"),
        ("radiation.temperature_degc", 5.0, "bands mean points"),
        ("motor.position_m", (0.0, 0.7, 0.0), "bands mean points"),
        ("housing.wall_mm", 7.0, "modes bands mean points"),
        ("housing.seat.1.radius_m", 0.06, "modes bands mean points"),
        ("radiation.max_frequency_hz", 800.0, "modes bands mean points"),
        ("radiation.elements_per_wavelength", 9.0, "bands mean points"),
    ],
)
def test_steps_are_computed_again_when_what_they_depend_on_changes_and_only_then(fleet, key, value, changes):
    before, after = keys_of(fleet), keys_of(fleet.replaced({key: value}))
    names = ("modes", "bands", "mean", "points")
    assert {name for name, a, b in zip(names, before, after, strict=True) if a != b} == set(changes.split())


def test_a_far_receiver_costs_no_boundary_elements(fleet):
    modes, bands, mean, points = keys_of(fleet)
    assert keys_of(fleet, (BESIDE, SOMEWHERE))[:3] == (modes, bands, mean)
    assert keys_of(fleet, (BESIDE,))[3] != points
    assert keys_of(fleet, (CLOSE,))[:3] == (modes, bands, mean)
    assert len(housing_tasks(fleet, (CLOSE,)).near) == len(bands)
    assert not housing_tasks(fleet, (BESIDE,)).near
    moved = replace(BESIDE, name="the same place by another name")
    assert keys_of(fleet, (moved,)) == keys_of(fleet, (BESIDE,))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("position_m = [-0.1, 0.0, 0.0]", "position_m = [-0.24, 0.0, 0.0]", "the pinion's seat .* leaves its panel"),
        ("position_m = [-0.1, 0.0, 0.0]\n", "", "position_m is stated for the wheel alone"),
        ('shaft = "pinion"', 'shaft = "wheel"', "the wheel has one already"),
        ("wall_mm = 6\n", "", r"\[housing\]: wall_mm is missing"),
        ("position_m = [0.0, 0.6, 0.0]\n", "", r"\[motor\]: position_m is missing"),
        ("position_m = [0.0, 0.6, 0.0]", "position_m = [0.0, 0.05, 0.0]", "motor's source .* lies inside the housing"),
        ("position_m = [0.0, 0.6, 0.0]", "position_m = [0.0, 0.12, 0.0]", "is 20 mm from the housing's wall"),
        ("= 700", "= 20000", "what the grid can carry ends at about"),
        ("elements_per_wavelength = 7.5", "elements_per_wavelength = 3", "must be at least 5"),
        ("circle_radius_m = { value = 12,", "circle_radius_m = { value = 0.2,", "lies inside the housing"),
        ("size_m = [0.2", 'step_file = "box.step"\nsize_m = [0.2', "step_file: there is no file .*box.step"),
        (
            "[radiation]",
            '[radiation]\nspace = "half"',
            "",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(text, tmp_path, old, new, words):
    assert old in text
    path = tmp_path / "fleet.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    fleet = td.load_fleet(path)
    if not words:
        assert housing_tasks(fleet).body.ground_m == pytest.approx(-0.52556)
        return
    with pytest.raises(FleetError, match=words) as refused:
        housing_tasks(fleet)
    assert str(path) in str(refused.value)


def test_a_receiver_inside_the_housing_is_refused_by_name(fleet):
    with pytest.raises(FleetError, match=r"the receiver oil at .* lies inside the housing, which reaches over x -0.25"):
        housing_tasks(fleet, (Receiver("oil", 0.1, (0.0, 0.05, 0.05)),))


def test_without_transfer_vectors_there_is_no_sound(fleet):
    with pytest.raises(FleetError, match="needs the transfer vectors of the housing"):
        DriveModel(fleet).evaluate()
