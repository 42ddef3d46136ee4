"""Design sweeps: each point is the prediction that its fleet would have."""

import math
import pickle

import numpy as np
import pytest
from made_up_modes import fleet_text, sound_of_made_up_modes

from tdacoustic.drive import DriveModel, conditions_of
from tdacoustic.fleet import load_fleet
from tdacoustic.fleet.design_sweep import DesignSweep, Range
from tdacoustic.gears import steady_state
from tdacoustic.steps import Store, execute
from tdacoustic.steps.codec import fingerprint
from tdacoustic.studies import points_of
from tdacoustic.studies.changed_fleet import housing_signature
from tdacoustic.studies.design_sweeps import sweep_task
from tdacoustic.studies.kept_housing import kept_housing
from tdacoustic.studies.responses import bare_fleet
from tdacoustic.studies.sweep_housings import keys_of_housings
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
    assert {record.step for record in records.values()} >= {"design-sweep", "responses"}


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


def study(fleet, store, sampling="latin_hypercube", jobs=1, conditions=("1", "5"), ranges=None, **more):
    """A study over ranges and what it computed: numbers of points by batch."""
    ranges = ranges or {"gear_dynamics.mesh_damping_ratio": Range(0.02, 0.2), "masuda.constant_db": Range(18.0, 26.0)}
    sweep = DesignSweep(
        name="study", sampling=sampling, parameters=tuple(ranges.items()), conditions=conditions, **more
    )
    asking = fleet.replaced({})
    object.__setattr__(asking, "sweep", (sweep,))
    told = []
    studies, _ = studies_of(
        asking, None, conditions_of(fleet), store, lambda what, done, total: told.append((what, done, total)), jobs
    )
    return studies.sweeps[0], told


def results_of(store):
    return {path.name: path.stat().st_mtime_ns for path in store.folder.glob("results/*/*.npz")}


def test_points_of_a_hypercube_are_the_predictions_of_their_fleets(reference, store):
    found, told = study(reference, store, points=120)
    assert set(found.reasons) == {""}
    for number in (0, 99, 119):
        prediction = DriveModel(reference.replaced(dict(found.points[number]))).evaluate()
        levels = [prediction.sound_of(condition).level_db("4 m") for condition in found.conditions]
        assert found.of("spl_4m_db")[number] == pytest.approx(levels, rel=SAME_DB)
    assert any("study, 20 of 120 points" in what for what, _, _ in told)
    last = told[-1]
    assert last[1] == last[2] == 2


def test_a_study_that_grows_computes_its_new_batches_alone(reference, store):
    short, _ = study(reference, store, points=100)
    before = results_of(store)
    long, _ = study(reference, store, points=200)
    after = results_of(store)
    assert np.array_equal(long.values[:100], short.values, equal_nan=True)
    assert len(after) == len(before) + 1
    assert {name: after[name] for name in before} == before


def test_a_grid_that_gains_a_value_computes_its_new_batches_alone(reference, store):
    values = tuple(0.02 + 0.001 * number for number in range(100))
    first, _ = swept(reference, store, conditions=("1",), gear_dynamics__mesh_damping_ratio=values)
    before = results_of(store)
    more, _ = swept(reference, store, conditions=("1",), gear_dynamics__mesh_damping_ratio=(*values, 0.5))
    assert np.array_equal(more.values[:100], first.values, equal_nan=True)
    assert len(results_of(store)) == len(before) + 1


def test_two_processes_give_the_same_numbers(reference, tmp_path):
    one, _ = study(reference, Store(tmp_path / "one"), "saltelli", base_points=64)
    two, _ = study(reference, Store(tmp_path / "two"), "saltelli", base_points=64, jobs=2)
    assert np.array_equal(one.values, two.values, equal_nan=True)
    assert results_of(Store(tmp_path / "one")).keys() == results_of(Store(tmp_path / "two")).keys()


def test_points_with_the_same_gears_share_their_motions(reference, store, monkeypatch):
    asked = []
    monkeypatch.setattr("tdacoustic.drive.model.steady_state", lambda *a: asked.append(a) or steady_state(*a))
    swept(
        reference, store, conditions=("1", "2"),
        gear_dynamics__mesh_damping_ratio=(0.03, 0.06, 0.12), masuda__constant_db=(18.0, 20.0, 22.0),
    )  # fmt: skip
    of_points = [one for one in asked if one[0].mesh_damping_ratio in (0.03, 0.06, 0.12)]
    assert len(set(of_points)) == len(of_points) == 3 * 2


def test_a_batch_is_light_to_send_however_heavy_its_model(tmp_path, store):
    path = tmp_path / "fleet.toml"
    path.write_text(fleet_text("", 500), encoding="utf-8")
    fleet = load_fleet(path)
    housing = sound_of_made_up_modes(fleet)
    kept = kept_housing(housing, store)
    task = sweep_task("batch", bare_fleet(fleet), kept, conditions_of(fleet), [(("masuda.constant_db", 20.0),)])
    assert len(pickle.dumps(housing)) > 1e5
    assert len(pickle.dumps((task, store))) < 1e4
    assert fingerprint(store.load(kept.key)) == fingerprint(housing)
    found = {path.name: path.stat().st_mtime_ns for path in store.folder.glob("results/*/*.npz")}
    kept_housing(housing, store)
    assert results_of(store) == found  # not written again


def test_a_housing_that_is_gone_is_said(tmp_path, store):
    path = tmp_path / "fleet.toml"
    path.write_text(fleet_text("", 500), encoding="utf-8")
    fleet = load_fleet(path)
    kept = kept_housing(sound_of_made_up_modes(fleet), store)
    (path,) = store.folder.glob("results/*/*.npz")
    path.unlink()
    batch = sweep_task("batch", bare_fleet(fleet), kept, conditions_of(fleet), [(("masuda.constant_db", 20.0),)])
    outcome = execute([batch], store)
    (message,) = {str(error) for error in outcome.failed.values()}
    assert "is no longer in the store; start it again" in message


LOW_TORQUE = {"operation.torque_n_m": Range(100.0, 3000.0)}
"""Below some 700 N m the gears rattle at the fastest condition."""


def test_a_study_leaves_out_rattling_gears_and_a_grid_integrates_them(reference, store):
    found, _ = study(reference, store, points=20, conditions=("1", "6"), ranges=LOW_TORQUE)
    assert set(found.reasons) == {""}
    torques = np.array([point[0][1] for point in found.points])
    at_fastest = found.rattles[:, 1]
    assert 0 < at_fastest.sum() < 10
    assert torques[at_fastest].max() < torques[~at_fastest].max()
    assert not found.rattles[:, 0].any()
    assert np.isnan(found.values[at_fastest, 1]).all()
    assert np.isfinite(found.of("spl_4m_db")[~found.rattles]).all()
    torque = float(torques[at_fastest][0])
    whole, _ = swept(reference, store, conditions=("6",), operation__torque_n_m=(torque,))
    assert np.isfinite(whole.of("spl_4m_db")).all()


def test_whole_numbers_are_swept_as_such(reference, store):
    """The centre distance of the reference drive is stated, so other teeth need another profile shift or helix."""
    found, _ = study(reference, store, points=40, conditions=("1",), ranges={"gear_pair.1.teeth.1": Range(30, 32)})
    assert found.whole == ("gear_pair.1.teeth.1",)
    assert {point[0][1] for point in found.points} == {30, 31, 32}
    own = reference.value_of("gear_pair.1.teeth.1")
    assert all(not reason for point, reason in zip(found.points, found.reasons, strict=True) if point[0][1] == own)


SAME_HOUSING = {
    "gear_dynamics.mesh_damping_ratio": 0.2, "gear_dynamics.mass_kg.1": 70.0, "operation.torque_n_m": 900.0,
    "masuda.constant_db": 21.0, "masuda.displacement": "static_ratio", "masuda.weighting": "A",
    "model.motor_gain_db": 2.0, "model.structure_gain_db": 2.0, "model.gear_path": "sum", "housing.loss_factor": 0.1,
    "housing.cavity_loss_factor": 0.02, "gear_pair.1.face_width_mm": 110.0, "gear_pair.1.backlash_um": 300.0,
    "gear_pair.1.transmission_error_um.1": 3.0,
}  # fmt: skip
OTHER_HOUSING = {
    "housing.wall_mm": 7.0, "radiation.temperature_degc": 30.0, "radiation.sphere_radius_m": 5.0,
    "housing.material.modulus_gpa": 100.0, "radiation.space": "half", "masuda.position_m": (0.0, 0.0, 0.9),
    "gear_pair.1.centre_distance_mm": 496.0,
}  # fmt: skip


def test_keys_that_no_housing_depends_on(tmp_path):
    """Held against the keys of the tasks behind the housing, which are made of all that they read."""
    path = tmp_path / "fleet.toml"
    text = fleet_text("", 500).replace("size_m = [0.2, 0.5, 0.4]", "size_m = [0.5, 1.1, 0.6]")
    for place in ("position_m = [-0.1, 0.0, 0.0]\n", "position_m = [0.1, 0.0, 0.0]\n"):
        text = text.replace(place, "")  # so that the seats follow the centre distance
    path.write_text(text, encoding="utf-8")
    fleet = load_fleet(path)
    own = housing_signature(fleet)
    for key, value in SAME_HOUSING.items():
        assert keys_of_housings(fleet, [key]) == (), key
        assert housing_signature(fleet.replaced({key: value})) == own, key
    for key, value in OTHER_HOUSING.items():
        assert keys_of_housings(fleet, [key]) == (key,), key
        assert housing_signature(fleet.replaced({key: value})) != own, key
    assert keys_of_housings(fleet, ["gear_pair.1.helix_angle_deg"]) == ()


def test_point_sources_have_no_housing_to_tell_apart(reference):
    assert keys_of_housings(reference, ["radiation.temperature_degc", "housing.wall_mm"]) == ()
    assert keys_of_housings(reference, ["radiation.method", "masuda.constant_db"]) == ("radiation.method",)


def test_the_grid_has_its_last_key_fastest():
    sweep = DesignSweep(name="two", parameters=(("a.b", (1.0, 2.0)), ("c.d", ("x", "y", "z"))))
    assert sweep.n_points == 6
    assert points_of(sweep)[4] == (("a.b", 2.0), ("c.d", "y"))
