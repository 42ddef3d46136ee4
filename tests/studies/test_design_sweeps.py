"""Design sweeps: each point is the prediction that its fleet would have."""

import math

import numpy as np
import pytest
from made_up_modes import fleet_text, sound_of_made_up_modes

from tdacoustic.drive import DriveModel, conditions_of
from tdacoustic.fleet import load_fleet
from tdacoustic.fleet.studies import DesignSweep
from tdacoustic.steps import Store
from tdacoustic.studies import points_of
from tdacoustic.workflows.studies import studies_of

SAME_DB = 1e-9


def swept(fleet, store, housing=None, conditions=(), **parameters):
    keys = tuple((key.replace("__", "."), values) for key, values in parameters.items())
    sweep = DesignSweep(name="made up", parameters=keys, conditions=conditions)
    asking = fleet.replaced({})
    object.__setattr__(asking, "sweep", (sweep,))
    studies, records = studies_of(asking, housing, conditions_of(fleet), store)
    (found,) = studies.sweeps
    return found, records


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "store")


def test_points_are_the_predictions_of_their_fleets(reference, store):
    found, records = swept(
        reference, store, gear_dynamics__mesh_damping_ratio=(0.02, 0.1), gear_pair__1__face_width_mm=(100.0, 140.0)
    )
    assert found.points[1] == (("gear_dynamics.mesh_damping_ratio", 0.02), ("gear_pair.1.face_width_mm", 140.0))
    for point, values in zip(found.points, found.of("spl_4m_db"), strict=True):
        prediction = DriveModel(reference.replaced(dict(point))).evaluate()
        assert values == pytest.approx([sound.level_db("4 m") for sound in prediction.sound], rel=SAME_DB)
    assert {record.step for record in records.values()} >= {"design-sweep", "design-sweep-groups", "responses"}


def test_conditions_can_be_chosen_and_can_change(reference, store):
    found, _ = swept(reference, store, conditions=("2",), operation__train_speed_km_h__2=(31.0, 33.0))
    assert found.conditions == ("2",)
    assert found.speed_km_h.tolist() == [[31.0], [33.0]]
    fast = DriveModel(reference.replaced({"operation.train_speed_km_h.2": 33.0})).evaluate()
    assert found.of("masuda_spl_1m_db")[1, 0] == pytest.approx(fast.conditions[1].masuda_db, rel=SAME_DB)


def test_a_helix_angle_is_that_of_the_helix_sweep(reference, store):
    """Though the fleet states its centre distance, which 8° alone would contradict."""
    reference = reference.replaced({"operation.helix_angle_deg": (8.0,)})
    found, _ = swept(reference, store, gear_pair__1__helix_angle_deg=(4.0, 8.0))
    assert found.reasons == ("", "")
    prediction = DriveModel(reference).evaluate()
    (case,) = prediction.helix
    assert found.of("spl_4m_db")[1, -1] == pytest.approx(case.sound.level_db("4 m"), rel=SAME_DB)
    assert found.of("dte_pp_um")[1, -1] == pytest.approx(1e6 * case.gears.steady.dte_pp_m, rel=SAME_DB)


def test_what_cannot_be_is_an_empty_row_with_its_reason(reference, store):
    found, _ = swept(reference, store, gear_dynamics__mesh_damping_ratio=(0.05, 1.5, -0.1))
    assert found.reasons[0] == ""
    assert found.reasons[1] == "[gear_dynamics]: mesh_damping_ratio must be <= 1, got 1.5"
    assert np.isfinite(found.of("spl_4m_db")[0]).all()
    assert np.isnan(found.values[1:]).all()
    gears, _ = swept(reference, store, gear_pair__1__transmission_error_um__1=(5.0, 400.0))
    assert "backlash" in gears.reasons[1]
    words, _ = swept(reference, store, model__gear_path=("masuda", "loudest"))
    assert "must be one of masuda, structure, sum" in words.reasons[1]


def test_words_and_readings_can_be_swept(reference, store):
    found, _ = swept(
        reference, store, masuda__displacement=("um_pp", "static_ratio"), masuda__placement=("free", "off")
    )
    levels = found.of("mesh_spl_4m_db")[:, 0]
    assert levels[0] != pytest.approx(levels[2], abs=1.0)
    totals = found.of("spl_4m_db")[:, 0]
    assert math.isnan(totals[1]) or totals[1] < totals[0]


def test_the_second_time_it_is_looked_up(reference, store, monkeypatch):
    first, _ = swept(reference, store, gear_dynamics__mesh_damping_ratio=(0.02, 0.1))
    import tdacoustic.studies.design_sweeps as module

    monkeypatch.setattr(module, "CaseModel", None)
    again, _ = swept(reference, store, gear_dynamics__mesh_damping_ratio=(0.02, 0.1))
    assert np.array_equal(first.values, again.values, equal_nan=True)


def test_points_with_another_housing_get_vectors_of_their_own(tmp_path, store, monkeypatch):
    path = tmp_path / "fleet.toml"
    path.write_text(fleet_text("", 500), encoding="utf-8")
    fleet = load_fleet(path).replaced({"model.gear_path": "structure"})
    made = []

    def made_up(of, *_):
        made.append(of.value_of("housing.wall_mm"))
        return sound_of_made_up_modes(of), ()

    monkeypatch.setattr("tdacoustic.workflows.housing_sound.housing_sound", made_up)
    own = sound_of_made_up_modes(fleet)
    found, _ = swept(
        fleet, store, own, conditions=("1", "2"), housing__wall_mm=(6.0, 9.0, 300.0), housing__loss_factor=(0.03, 0.1)
    )
    assert made == [9.0]  # 6 mm is the fleet's own; both loss factors share the vectors
    assert [bool(reason) for reason in found.reasons] == [False] * 4 + [True] * 2
    for number in (0, 3):
        changed = fleet.replaced(dict(found.points[number]))
        housing = own if number == 0 else sound_of_made_up_modes(changed)
        prediction = DriveModel(changed, housing=housing).evaluate(conditions_of(changed)[:2])
        levels = [sound.level_db("4 m") for sound in prediction.sound]
        assert found.of("spl_4m_db")[number] == pytest.approx(levels, rel=SAME_DB)


def test_a_housing_that_fails_is_a_reason_and_no_end(reference, tmp_path, store, monkeypatch):
    path = tmp_path / "fleet.toml"
    path.write_text(fleet_text("", 500), encoding="utf-8")
    fleet = load_fleet(path)

    def failing(of, *_):
        from tdacoustic.errors import FleetError

        raise FleetError(f"{of.path}: [housing]: no such modes")

    monkeypatch.setattr("tdacoustic.workflows.housing_sound.housing_sound", failing)
    found, _ = swept(fleet, store, sound_of_made_up_modes(fleet), conditions=("1",), housing__wall_mm=(6.0, 9.0))
    assert found.reasons == ("", "[housing]: no such modes")


def test_the_grid_has_its_last_key_fastest():
    sweep = DesignSweep(name="two", parameters=(("a.b", (1.0, 2.0)), ("c.d", ("x", "y", "z"))))
    assert sweep.n_points == 6
    assert points_of(sweep)[4] == (("a.b", 2.0), ("c.d", "y"))
