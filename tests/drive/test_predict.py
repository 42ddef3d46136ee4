"""The modelled side as its user gets it: tables, files, messages."""

import importlib.util
import json
import math
from pathlib import Path

import h5py
import numpy as np
import pytest

import tdacoustic as td
from tdacoustic.steps import Store

CHECKER = Path(__file__).resolve().parents[3] / "shared" / "check_outputs.py"


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    return Store(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="session")
def predicted(reference, store):
    return td.predict(reference, store)


@pytest.fixture
def tda(tmp_path, store, call_program, monkeypatch):
    """Run the program in this process with a stand-in for the page; returns exit code, stdout, stderr."""
    import tdacoustic.reporting.html as html

    monkeypatch.setenv("TDACOUSTIC_STORE", str(store.folder))
    monkeypatch.setattr(html, "render_html", lambda document: "<!doctype html><title>stand-in</title>" + 2000 * " ")
    monkeypatch.chdir(tmp_path)
    return call_program


def test_the_contracts_of_the_tables(tda, reference, tmp_path):
    code, out, err = tda("predict", reference.path.parent, "-o", "out")
    assert code == 0
    assert out.splitlines() == [str(Path("out") / "report.html")]
    assert {line.partition(":")[0] for line in err.splitlines()} == {"warning"}
    if not CHECKER.is_file():
        pytest.skip("the checker of the contracts is not at hand")
    spec = importlib.util.spec_from_file_location("check_outputs", CHECKER)
    checker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(checker)
    assert list(checker.table_faults(tmp_path / "out", checker.PREDICT)) == []


def test_the_same_bytes_twice_and_the_manifest_last(tda, reference, tmp_path):
    for name in ("one", "two"):
        assert tda("predict", reference.path, "-o", name, "--quiet")[0] == 0
    first, second = ({p.name: p.read_bytes() for p in (tmp_path / name).iterdir()} for name in ("one", "two"))
    assert first == second
    manifest = json.loads(first["manifest.json"])
    assert manifest["command"] == "predict"
    assert set(manifest["files"]) == set(first) - {"manifest.json"}
    assert manifest["inputs"][0]["file"] == "fleet.toml"


def test_a_wrong_fleet_is_one_line_and_leaves_what_is_there(tda, reference, tmp_path):
    text = reference.path.read_text(encoding="utf-8")
    fleet = tmp_path / "fleet.toml"
    fleet.write_text(text, encoding="utf-8")
    assert tda("predict", fleet, "-o", "out")[0] == 0
    before = {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()}
    fleet.write_text(text.replace("[5]", "[150]"), encoding="utf-8")
    code, out, err = tda("predict", fleet, "-o", "out")
    assert (code, out) == (1, "")
    assert err.splitlines() == [
        f"error: {fleet}: [[gear_pair]] 1: the transmission error, 300 um peak to peak, is larger than the backlash of "
        "200 um: the teeth would jam"
    ]
    assert {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()} == before


def test_another_fleets_results_are_not_written_over(tda, reference, tmp_path):
    assert tda("predict", reference.path, "-o", "out")[0] == 0
    other = tmp_path / "fleet.toml"
    other.write_text(reference.path.read_text(encoding="utf-8"), encoding="utf-8")
    code, _, err = tda("predict", other, "-o", "out")
    assert code == 1
    assert "give --overwrite" in err
    assert tda("predict", other, "-o", "out", "--overwrite")[0] == 0


def test_conditions_in_contact(predicted, store):
    table = predicted.tables["conditions"].set_index("condition")
    assert (table["method"] == "harmonic_balance").all()
    assert table["periodic"].all()
    assert (table["floquet_max"] < 1.0).all()
    assert (table["contact_part"] == 1.0).all()
    # F0 / k̄ with F0 = T1/(r1 cos β_b): physics.md's base radius, k̄ by the ISO formula written out in tests/gears
    mean_force = 5913.0 / (0.107285 * math.cos(math.asin(math.sin(math.radians(4.0)) * math.cos(math.radians(20.0)))))
    stiffness = predicted.prediction.unit.stiffness.normal_n_per_m
    expected = 1e6 * mean_force / stiffness
    assert table["static_compression_um"].to_numpy() == pytest.approx(np.full(6, expected), rel=1e-5)
    # physics.md: condition 5 comes to 91-97 dB where X is over the static deflection
    static = td.predict(predicted.fleet.replaced({"masuda.displacement": "static_ratio"}), store)
    level = static.tables["conditions"].set_index("condition")["masuda_spl_1m_db"]["5"]
    assert level == pytest.approx(94.0, abs=3.0)
    watts = table["masuda_spl_1m_db"]["5"]
    assert watts == pytest.approx(123.0, abs=2.0)


def test_bearing_forces_and_their_mean(predicted):
    table = predicted.tables["bearing_forces"]
    mean = table[(table["harmonic"] == 0) & (table["condition"] == "3")].set_index(["gear", "direction"])
    r1, alpha, beta = 0.107285, math.radians(19.29), math.asin(math.sin(math.radians(4)) * math.cos(math.radians(20)))
    force = 5913.0 / (r1 * math.cos(beta))
    expected = {
        "x": force * math.cos(beta) * math.sin(alpha),
        "y": force * math.cos(beta) * math.cos(alpha),
        "z": force * math.sin(beta),
    }
    for gear in ("pinion", "wheel"):
        for direction, value in expected.items():
            assert mean.loc[(gear, direction), "force_amplitude_n"] == pytest.approx(value, rel=1e-4)
    held = table[(table["condition"] == "1") & (table["gear"] == "wheel") & (table["direction"] == "y")]
    assert held["harmonic"].tolist() == list(range(18))  # to 3 kHz
    assert held["frequency_hz"].to_numpy() == pytest.approx(174.968014 * np.arange(18), rel=1e-6)


def test_the_helix_sweep_follows_the_centre_distance(predicted, conformance):
    table = predicted.tables["helix"]
    assert table["helix_angle_deg"].tolist() == [0.1, 4.0, 8.0, 12.0]
    printed = {0.1: 493.8, 12.0: 504.9}
    for angle, distance in printed.items():
        got = table.set_index("helix_angle_deg")["centre_distance_mm"][angle]
        conformance(
            f"centre distance at {angle:g}°",
            distance,
            got,
            0.051,
            "mm",
            "analytic: ISO 21771, working pressure angle from its involute, by hand",
        )
    assert (table["mesh_frequency_hz"].round(1) == 1001.3).all()
    assert table["spl_4m_db"].notna().all()


def test_hauled_uses_the_other_flank(reference, store):
    fleet = reference.replaced({"operation.mode": "hauled", "operation.helix_angle_deg": (4.0,)})
    found = td.predict(fleet, store)
    table = found.tables["conditions"]
    assert (table["torque_n_m"] == -5913.0).all()
    assert (table["static_compression_um"] < 0.0).all()
    assert any("the wheelset drives" in doubt for doubt in found.prediction.doubts)


def test_no_torque_is_a_case(reference, store):
    found = td.predict(reference.replaced({"operation.torque_n_m": 0.0}), store)
    table = found.tables["conditions"]
    assert (table["method"] == "at_rest").all()
    assert (table["dte_pp_um"] == 0.0).all()
    assert table["masuda_spl_1m_db"].isna().all()
    assert any("without torque" in doubt for doubt in found.prediction.doubts)


def test_motions_that_do_not_repeat_say_so(reference, store):
    changes = {
        "operation.torque_n_m": 300.0,
        "operation.train_speed_km_h": (50.0, 61.16, 100.0),
        "gear_pair.1.transmission_error_um": (8.0,),
        "operation.helix_angle_deg": (4.0,),
    }
    model = td.DriveModel(reference.replaced(changes))
    prediction = model.evaluate()
    _, doubled, rattling = (state.steady for state in prediction.conditions)
    assert doubled.method == "time_integration"  # 535 Hz: beyond the period doubling near 520 Hz of physics.md
    assert doubled.floquet_max > 1.0
    assert not doubled.is_periodic
    assert rattling.method == "time_integration"
    from tdacoustic.tables import predicted_tables

    forces = predicted_tables(prediction, 3000.0)["bearing_forces"]
    assert forces[forces["condition"] == "3"]["harmonic"].isna().any()
    assert not forces[forces["condition"] == "1"]["harmonic"].isna().any()
    assert any("does not repeat" in doubt or "repeats only after" in doubt for doubt in prediction.doubts)


def test_the_result_file_holds_waveforms_and_forces(tda, reference, tmp_path):
    assert tda("predict", reference.path, "-o", "out", "--quiet")[0] == 0
    with h5py.File(tmp_path / "out" / "result.h5") as file:
        assert file.attrs["schema"] == "tdacoustic-result-file/1"
        held = file["model/conditions/5"]
        delta = held["displacement"][:]
        assert np.ptp(delta) == pytest.approx(12.2128e-6, rel=1e-4)
        points, forces = held["point_frequency_hz"][:], held["point_force"][:]
        on_mesh = np.isclose(points / held.attrs["mesh_frequency_hz"] % 1.0, 0.0, atol=1e-9) | np.isclose(
            points / held.attrs["mesh_frequency_hz"] % 1.0, 1.0, atol=1e-9
        )
        assert (forces[:, :, ~on_mesh] == 0.0).all()
        assert (forces[:, :, on_mesh] > 0.0).all()
        stiffness = file["model/mesh/stiffness"][:]
        assert stiffness.mean() == pytest.approx(2.5621e9, rel=1e-4)


def test_the_sweep_is_kept(reference, store):
    from tdacoustic.steps import execute

    td.predict(reference, store)
    model = td.DriveModel(reference)
    from tdacoustic.drive.sweep_step import sweep_speeds_km_h, sweep_tasks

    outcome = execute(list(sweep_tasks(model, sweep_speeds_km_h(reference, 114.455))), store)
    assert len(outcome.found) == 2
    assert outcome.computed == ()
