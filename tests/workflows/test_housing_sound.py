"""Housing and radiation through the commands: columns, steps that are kept, progress, bad input, no NGSolve."""

import numpy as np
import pandas as pd
import pytest
from made_up_modes import fleet_text

import tdacoustic as td
from tdacoustic.campaign import load_campaign
from tdacoustic.errors import FittingError
from tdacoustic.fitting.free import checked_free
from tdacoustic.fleet import load_fleet
from tdacoustic.workflows.microphones import microphone_doubts, microphones

MOTOR = """
[motor]
position_m = [0.0, 0.6, 0.0]
[[motor.excitation]]
name = "low"
fixed_hz = 250
sound_power_level_db = 90
"""


def small_fleet(folder, **replacements):
    text = fleet_text(MOTOR, 400).replace("[20, 30, 40, 50, 60, 114.455]", "[20, 30, 40]")
    for old, new in replacements.items():
        assert old in text
        text = text.replace(old, new, 1)
    folder.mkdir(exist_ok=True)
    (folder / "fleet.toml").write_text(text, encoding="utf-8")
    return folder / "fleet.toml"


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("store")


@pytest.fixture(scope="module")
def found(tmp_path_factory, store):
    pytest.importorskip("ngsolve")
    told = []
    path = small_fleet(tmp_path_factory.mktemp("drive"))
    result = td.predict(path, store, lambda what, done, total: told.append((what, done, total)), jobs=1)
    return result, told, path


def test_every_column_is_filled(found):
    tables = found[0].tables
    conditions = tables["conditions"]
    wanted = [f"{path}_spl_4m_db" for path in ("structure", "mesh", "motor")]
    assert np.isfinite(conditions[[*wanted, "spl_4m_db"]].to_numpy(dtype=float)).all()
    levels = tables["predictions"]
    assert set(levels["path"]) == {"structure", "mesh", "motor", "total"}
    assert np.isfinite(levels["level_db"].to_numpy(dtype=float)).all()
    around = tables["directivity"]
    assert len(around) == 7 * 72
    assert np.isfinite(around["spl_12m_db"].to_numpy(dtype=float)).all()
    assert tables["helix"]["spl_4m_db"].notna().all()
    through = tables["insertion_loss"]
    assert set(through["kind"]) == {"line", "third_octave", "mesh"}
    assert through["insertion_loss_db"].notna().all()


def test_progress_names_the_steps_and_their_parts(found):
    words = [what for what, _, _ in found[1]]
    assert any(what.startswith("Modes of the housing by finite elements") for what in words)
    assert any(what.startswith("Sound of the housing's modes and of point sources") for what in words)
    parts = [done for what, done, _ in found[1] if what.startswith("Sound of")]
    assert any(not float(done).is_integer() for done in parts)


def test_the_steps_are_recorded(found):
    steps = {record.step for _, record in found[0].records}
    assert {"housing-modes", "transfer-vectors", "mean-vectors", "point-vectors"} <= steps
    assert {"cavity-modes", "insertion-loss"} <= steps


def test_a_later_prediction_computes_nothing(found, store):
    before = {path: path.stat().st_mtime_ns for path in store.rglob("*.npz")}
    again = td.predict(found[2], store, jobs=1)
    assert {path: path.stat().st_mtime_ns for path in store.rglob("*.npz")} == before
    pd.testing.assert_frame_equal(again.tables["conditions"], found[0].tables["conditions"])


def test_another_torque_or_loss_factor_computes_no_vectors(found, store, tmp_path):
    kept = {path.name for path in store.rglob("*.npz")}
    changed = small_fleet(tmp_path / "other", **{"loss_factor = 0.03": "loss_factor = 0.1", "= 5913": "= 3000"})
    other = td.predict(changed, store, jobs=1)
    new = {record.step for key, record in other.records if f"{key}.npz" not in kept}
    assert new <= {"gear-sweep", "insertion-loss", "responses"}
    level = "structure_spl_4m_db"
    assert not np.allclose(other.tables["conditions"][level], found[0].tables["conditions"][level], atol=0.1)


def test_no_more_sound_than_the_forces_put_in(found, store):
    """Radiated power against the power of the bearing forces at the seats, line by line."""
    from tdacoustic.drive.housing_steps import housing_tasks
    from tdacoustic.housing import seat_loads
    from tdacoustic.steps import Store, result_of

    result, _, _ = found
    fleet = result.fleet
    tasks = housing_tasks(fleet)
    modes = result_of(tasks.modes, Store(store))
    for state, sound in zip(result.prediction.conditions, result.prediction.sound, strict=True):
        lines = [source for source in sound.sources if source.path == "structure"]
        assert lines
        loads = seat_loads(tasks.box, state.forces)
        for source in lines:
            line = int(np.argmin(np.abs(state.forces.frequency_hz - source.frequency_hz)))
            seats = np.einsum("msd,m->sd", modes.seats, source.velocities)
            put_in = 0.5 * float((loads[:, :, line].conj() * seats).sum().real)
            radiated = 1e-12 * 10.0 ** (0.1 * source.sound_power_level_db)
            assert 0.0 < radiated < put_in


def test_in_process_and_in_workers_the_numbers_are_the_same(found, tmp_path):
    again = td.predict(found[2], tmp_path / "store", jobs=2)
    for name in ("conditions", "directivity"):
        pd.testing.assert_frame_equal(again.tables[name], found[0].tables[name], rtol=1e-6)


def test_a_receiver_inside_the_housing_is_one_line_on_stderr(call_program, tmp_path):
    fleet = small_fleet(tmp_path / "drive", **{"position_m = [0.0, 0.6, 0.0]": "position_m = [0.0, 0.0, 0.1]"})
    code, out, err = call_program("predict", fleet, "-o", tmp_path / "out", "--store", tmp_path / "store")
    assert (code, out) == (1, "")
    assert len(err.splitlines()) == 1
    assert "the motor's source ([motor] position_m) at (0.0, 0.0, 0.1) m lies inside the housing" in err
    assert not (tmp_path / "out").exists()


def test_without_ngsolve_the_extra_is_named(call_program, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "ngsolve", None)
    monkeypatch.setitem(sys.modules, "netgen", None)
    fleet = small_fleet(tmp_path / "drive")
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    code, _, err = call_program("predict", fleet, "-o", tmp_path / "out", "--store", tmp_path / "store")
    assert code == 1
    assert "tdacoustic[housing]" in err


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("housing.wall_mm", "housing.wall_mm cannot be free with boundary elements"),
        ("housing.seat.2.radius_m", "housing.seat.2.radius_m cannot be free"),
        ("radiation.temperature_degc", "radiation.temperature_degc cannot be free"),
        ("housing.loss_factor", None),
        ("model.structure_gain_db", None),
        ("train.wheel_diameter_mm", None),
    ],
)
def test_what_would_take_minutes_for_each_value_is_refused_at_once(tmp_path, key, message):
    fleet = load_fleet(small_fleet(tmp_path / "drive"))
    if message is None:
        checked_free(fleet, [key])
        return
    with pytest.raises(FittingError, match=message):
        checked_free(fleet, [key])


def test_where_the_ground_or_the_seats_follow_a_parameter_it_cannot_be_free(tmp_path):
    seats = {"position_m = [-0.1, 0.0, 0.0]\n": "", "position_m = [0.1, 0.0, 0.0]\n": ""}
    big = {"size_m = [0.2, 0.5, 0.4]": "size_m = [0.2, 0.9, 0.4]"}
    fleet = load_fleet(small_fleet(tmp_path / "drive", **seats, **big))
    with pytest.raises(FittingError, match=r"gear_pair\.1\.centre_distance_mm cannot be free"):
        checked_free(fleet, ["gear_pair.1.centre_distance_mm"])
    half = load_fleet(small_fleet(tmp_path / "half", **{"[radiation]": '[radiation]\nspace = "half"'}))
    with pytest.raises(FittingError, match=r"train\.wheel_diameter_mm cannot be free"):
        checked_free(half, ["train.wheel_diameter_mm"])


def test_a_microphone_at_the_wall_is_left_out_and_said(tmp_path):
    fleet = load_fleet(small_fleet(tmp_path / "drive"))
    mic = '[[channel]]\nname = "{}"\nquantity = "sound_pressure"\nposition_m = [0.0, {}, 0.0]\n'
    campaign = tmp_path / "campaign.toml"
    campaign.write_text(
        'schema = "tdacoustic-campaign/1"\norigin = "measured"\nfleet = "drive/fleet.toml"\n'
        + mic.format("far", 4.0)
        + mic.format("wall", 0.11)
        + mic.format("oil", 0.05)
        + '[[level]]\ncondition = "1"\ndistance_m = 4.0\nlevel_db = 80.0\n',
        encoding="utf-8",
    )
    loaded = load_campaign(campaign)
    assert set(microphones(loaded, fleet)) == {"far"}
    doubts = microphone_doubts(loaded, fleet)
    assert any("channel wall is 10 mm from its wall" in doubt for doubt in doubts)
    assert any("channel oil lies inside the housing" in doubt for doubt in doubts)


def test_a_sphere_too_small_is_refused_before_anything_is_computed(call_program, tmp_path):
    fleet = small_fleet(tmp_path / "drive", **{"sphere_radius_m = { value = 4,": "sphere_radius_m = { value = 0.4,"})
    code, _, err = call_program("predict", fleet, "-o", tmp_path / "out", "--store", tmp_path / "store")
    assert code == 1
    assert "a sphere of 0.4 m does not enclose the housing and the sources with room" in err
    assert str(fleet) in err


def test_the_source_inside_through_the_command(found, store, tmp_path):
    """The mesh is lower by the insertion loss at its frequency; where the source stands cannot be free."""
    changed = small_fleet(tmp_path / "inside", **{'placement = "free"': 'placement = "inside"'})
    other = td.predict(changed, store, jobs=1)
    loss = other.tables["insertion_loss"]
    loss = loss[loss["kind"] == "mesh"].set_index("condition")["insertion_loss_db"]
    apart = found[0].tables["conditions"]["mesh_spl_4m_db"] - other.tables["conditions"]["mesh_spl_4m_db"]
    assert apart.to_numpy() == pytest.approx(loss.to_numpy(), abs=0.1)
    assert loss.min() > 5.0
    fleet = load_fleet(small_fleet(tmp_path / "told", **{'placement = "free"': 'placement = "inside"'}))
    told = fleet.replaced({"masuda.position_m": (0.05, 0.0, 0.1)})
    with pytest.raises(FittingError, match=r"masuda\.position_m\.3 cannot be free"):
        checked_free(told, ["masuda.position_m.3"])
    checked_free(told, ["housing.cavity_loss_factor"])
