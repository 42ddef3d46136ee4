"""Masuda's source inside the housing in the drive model: its level, its place, its doubts, and the insertion loss."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_up_modes import air_of_made_up_modes, fleet_text, sound_of_made_up_modes

import tdacoustic as td
from tdacoustic.cavity import WallModes, coupled_velocities
from tdacoustic.drive import DriveModel, Receiver
from tdacoustic.drive.gear_unit import gear_unit_of
from tdacoustic.drive.housing_box import box_of
from tdacoustic.drive.housing_steps import housing_tasks
from tdacoustic.drive.insertion_loss import INSERTION_LOSS, air_tasks
from tdacoustic.drive.levels import PointField
from tdacoustic.drive.source_inside import CAVITY_MODES, inside_m
from tdacoustic.drive.sources import StructureSource
from tdacoustic.errors import FleetError

BESIDE = Receiver("beside", 3.0, (0.0, 3.0, 0.0))
SEAT = "position_m = [-0.1, 0.0, 0.0]"


def inside(fleet, **values):
    changes = {"masuda.placement": "inside"} | {key.replace("__", "."): value for key, value in values.items()}
    return fleet.replaced(changes)


@pytest.fixture(scope="module")
def text():
    return fleet_text("", 700)


@pytest.fixture(scope="module")
def fleet(text, tmp_path_factory):
    path = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    path.write_text(text, encoding="utf-8")
    return td.load_fleet(path)


@pytest.fixture(scope="module")
def housing(fleet):
    return air_of_made_up_modes(fleet, sound_of_made_up_modes(fleet, (BESIDE,)))


def model_of(fleet, housing, **values):
    return DriveModel(inside(fleet, **values), housing=housing)


def test_the_mesh_is_the_housing_that_the_air_shakes(fleet, housing):
    """Its level is Masuda's at 4 m less the insertion loss there, and its field is that of the walls."""
    prediction = model_of(fleet, housing).evaluate(receivers=(BESIDE,))
    with_loss = model_of(fleet, housing).with_insertion_loss(prediction)
    losses = {mesh.condition: mesh.loss_db for mesh in with_loss.insertion_loss.at_mesh}
    for state, sound in zip(prediction.conditions[:5], prediction.sound[:5], strict=True):
        (source,) = (source for source in sound.sources if source.path == "mesh")
        assert isinstance(source, StructureSource)
        wanted = state.masuda_db - 20.0 * math.log10(4.0) - losses[state.condition.name]
        assert sound.level_db("4 m", "mesh") == pytest.approx(wanted, abs=1e-4)
        assert sound.level_db("4 m") == pytest.approx(wanted, abs=1e-4)  # the total holds it
        walls = WallModes(housing.modes.frequency_hz, 0.03)
        unit = coupled_velocities(housing.cavity.modes, walls, state.mesh_hz, 0.01)
        square = housing.points.of_modes(state.mesh_hz, unit, [housing.places[BESIDE.position_m]])[0]
        at_1_m = state.masuda_db + 10.0 * math.log10(float(square))
        assert sound.level_db("beside", "mesh") == pytest.approx(at_1_m, abs=1e-4)
    assert max(losses[name] for name in "12345") > 5.0


def test_beyond_the_housings_frequencies_it_has_no_sound_and_this_is_said(fleet, housing):
    prediction = model_of(fleet, housing).evaluate()
    assert prediction.sound[5].level_db("4 m", "mesh") is None  # it meshes at 1001 Hz
    assert prediction.sound[5].level_db("4 m") is None
    assert any("condition 6: Masuda's source inside the housing has no sound" in text for text in prediction.doubts)
    mesh = model_of(fleet, housing).with_insertion_loss(prediction).insertion_loss.at_mesh[5]
    assert mesh.loss_db is None and mesh.beside_db is None and mesh.mass_law_db > 30.0


@pytest.mark.parametrize(
    ("gear_path", "adds"), [("masuda", {"mesh"}), ("structure", {"structure"}), ("sum", {"mesh", "structure"})]
)
def test_what_the_total_adds(fleet, housing, gear_path, adds):
    prediction = model_of(fleet, housing, model__gear_path=gear_path).evaluate()
    sound = prediction.sound[2]
    parts = [sound.level_db("4 m", path) for path in adds]
    total = 10.0 * math.log10(sum(10.0 ** (0.1 * part) for part in parts))
    assert sound.level_db("4 m") == pytest.approx(total, abs=1e-9)
    assert any("a second time" in text for text in prediction.doubts) is ("mesh" in adds)
    assert any("counted twice" in text for text in prediction.doubts) is (gear_path == "sum")


def test_with_point_sources_it_is_shown_and_not_added(fleet):
    plain = inside(fleet, radiation__method="point_sources")
    prediction = DriveModel(plain).evaluate()
    assert PointField(plain).adds == ("motor",)
    assert prediction.sound[0].level_db("4 m") is None
    assert prediction.sound[0].level_db("4 m", "mesh") is not None
    assert any('takes method = "boundary_elements"' in text for text in prediction.doubts)


def test_the_constant_adds_to_its_level_and_both_loss_factors_change_it(fleet, housing):
    def levels(**values):
        prediction = model_of(fleet, housing, **values).evaluate()
        return np.array([sound.level_db("4 m", "mesh") for sound in prediction.sound[:5]])

    plain = levels()
    assert levels(masuda__constant_db=27.0) - plain == pytest.approx(np.full(5, 7.0), abs=1e-4)
    for key in ("housing__loss_factor", "housing__cavity_loss_factor"):
        assert np.abs(levels(**{key: 0.08}) - plain).max() > 0.1


def test_a_read_weighting_is_taken_off(fleet, housing):
    plain, weighted = (
        model_of(fleet, housing, masuda__weighting=name).evaluate().sound[2].level_db("4 m", "mesh") for name in "ZA"
    )
    assert 2.0 < weighted - plain < 8.0  # 350 Hz


def test_it_stands_at_the_pitch_point_unless_told_otherwise(fleet, text, tmp_path):
    unit = gear_unit_of(fleet)
    first, second = unit.geometry.teeth
    x, y, z = inside_m(fleet, unit, box_of(fleet, unit))
    assert (x, y, z) == pytest.approx((-0.1 + 0.2 * first / (first + second), 0.0, 0.0), abs=1e-6)
    assert first / (first + second) == pytest.approx(unit.geometry.pitch_radii_m[0] / sum(unit.geometry.pitch_radii_m))
    along = tmp_path / "fleet.toml"
    along.write_text(text.replace(SEAT, "position_m = [-0.1, 0.02, 0.0]"), encoding="utf-8")
    moved = td.load_fleet(along)
    assert inside_m(moved, unit, box_of(moved, unit))[1] == pytest.approx(0.02)
    told = inside(fleet, masuda__position_m=(0.05, 0.03, -0.1))
    assert inside_m(told, unit, box_of(told, unit)) == pytest.approx((0.05, 0.03, -0.1))
    free = fleet.replaced({"masuda.position_m": (0.0, 0.0, 0.9)})
    assert inside_m(free, unit, box_of(free, unit))[2] == 0.0  # that is where the free source stands


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.5), (0.0, 0.085, 0.0)])
def test_a_place_that_is_not_inside_is_refused(fleet, place):
    told = inside(fleet, masuda__position_m=place)
    with pytest.raises(FleetError, match=r"\[masuda\]: the source at .* is not inside it, 20 mm off the walls: \|x\|"):
        air_tasks(told, housing_tasks(told))


def test_keys_of_the_steps(fleet):
    def keys(**values):
        changed = fleet.replaced({key.replace("__", "."): value for key, value in values.items()})
        cavity, loss = air_tasks(changed, housing_tasks(changed))
        assert (cavity.step, loss.step) == (CAVITY_MODES, INSERTION_LOSS)
        return cavity.key, loss.key

    plain = keys()
    for values in (
        {"masuda.constant_db": 5.0},
        {"operation.train_speed_km_h": (20.0,) * 6},
        {"model.gear_path": "sum"},
    ):
        assert keys(**values) == plain
    for key in ("housing__loss_factor", "housing__cavity_loss_factor"):
        cavity, loss = keys(**{key: 0.05})
        assert cavity == plain[0] and loss != plain[1]
    moved = keys(masuda__placement="inside", masuda__position_m=(0.0, 0.0, 0.1))
    assert moved[0] != plain[0] and moved[1] != plain[1]


def test_the_insertion_loss_over_frequency(fleet, housing):
    """Whatever the placement; its bands, walls and losses are held in test_insertion_loss.py."""
    prediction = DriveModel(fleet, housing=housing)
    held = prediction.with_insertion_loss(prediction.evaluate()).insertion_loss
    step = 10.0 ** (0.1 / 47)  # lines a third octave for the 0.01 of the air
    assert 50.0 <= held.frequency_hz[0] < 50.0 * step and 700.0 / step < held.frequency_hz[-1] <= 700.0
    assert np.diff(np.log(held.frequency_hz)) == pytest.approx(math.log(step))
    assert held.source_m == pytest.approx(tuple(np.add(housing.cavity.source_m, housing.body.position_m)))
    assert np.diff(held.mass_law_db).min() > 0.0
    mesh = held.at_mesh[2]
    line = np.interp(mesh.frequency_hz, held.frequency_hz, held.loss_db)
    assert mesh.loss_db == pytest.approx(line, abs=1.0)
    assert mesh.beside_db[0] <= mesh.loss_db <= mesh.beside_db[1]


def test_a_housing_without_air_inside_has_no_insertion_loss(fleet, housing):
    bare = replace(housing, cavity=None, insertion_loss=None)
    prediction = DriveModel(fleet, housing=bare)
    assert prediction.with_insertion_loss(prediction.evaluate()).insertion_loss is None
    with pytest.raises(FleetError, match="needs the air inside a parametric box"):
        model_of(fleet, bare).evaluate()


def test_the_field_inside_is_that_of_source_and_walls(fleet, housing):
    """Close to the source 1/r; the same at mirrored places of a symmetric drive; nothing without source and motion."""
    held = housing.inside
    moved = held.velocities(280.0, 0.03, 0.01)
    source = np.array(held.source_m)
    near = held.pressures(source + 0.002 * np.eye(3)[1], 280.0, 0.01, moved, 1.0)
    assert abs(near[0]) == pytest.approx(500.0, rel=0.1)
    points = np.array([[0.1, 0.03, 0.1], [-0.15, -0.02, -0.12]])
    both = held.pressures(points, 280.0, 0.01, moved, 1.0)
    apart = held.pressures(points, 280.0, 0.01, moved), held.pressures(points, 280.0, 0.01, None, 1.0)
    assert both == pytest.approx(apart[0] + apart[1])
    assert not held.pressures(points, 280.0, 0.01).any()
