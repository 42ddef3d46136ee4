"""Maps close to the housing through `predict`: steps, progress, tables, and names that are no conditions."""

import numpy as np
import pytest
from test_housing_sound import small_fleet

import tdacoustic as td
from tdacoustic.errors import FleetError
from tdacoustic.workflows.near_field import NO_HOUSING

MAPS = {"[radiation]": '[radiation]\nmap_conditions = ["3", "1"]\nmap_half_width_m = 0.6\nmap_spacing_m = 0.1'}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    pytest.importorskip("ngsolve")
    told = []
    folder = tmp_path_factory.mktemp("maps")
    path = small_fleet(folder / "drive", **MAPS)
    result = td.predict(path, folder / "store", lambda what, done, total: told.append(what), jobs=1)
    return result, told, path, folder / "store"


def test_the_conditions_that_are_named_are_mapped(found):
    result, told, _, _ = found
    assert [field.condition for field in result.prediction.maps] == ["3", "1"]
    labels = {record.label for _, record in result.records if record.step == "near-field"}
    assert labels == {"condition 1", "condition 3"}
    assert any(what.startswith("Sound pressure around the housing by boundary elements") for what in told)
    table = result.tables["near_field"]
    assert set(table["condition"]) == {"1", "3"}
    outside = table[table["place"] == "outside"]
    assert np.isfinite(outside["level_db"]).mean() > 0.99  # all but the sources themselves
    inside = table[table["place"] == "inside"]
    assert np.isfinite(inside["structure_level_db"]).all()
    assert inside["motor_level_db"].isna().all()


def test_a_later_prediction_computes_no_maps(found):
    _, _, path, store = found
    before = {file: file.stat().st_mtime_ns for file in store.rglob("*.npz")}
    again = td.predict(path, store, jobs=1)
    assert {file: file.stat().st_mtime_ns for file in store.rglob("*.npz")} == before
    one, other = found[0].prediction.maps[0], again.prediction.maps[0]
    assert np.array_equal(one.planes[0].level_db["total"], other.planes[0].level_db["total"], equal_nan=True)


def test_another_sound_power_computes_no_maps(found, tmp_path):
    result, _, _, store = found
    kept = {key for key, _ in result.records}
    path = small_fleet(tmp_path / "louder", **MAPS, **{"sound_power_level_db = 90": "sound_power_level_db = 96"})
    louder = td.predict(path, store, jobs=1)
    new = {record.step for key, record in louder.records if key not in kept}
    assert not new & {"near-field", "transfer-vectors", "point-vectors", "housing-modes"}
    levels = [one.prediction.maps[0].planes[0].level_db["motor"] for one in (result, louder)]
    change = levels[1] - levels[0]
    assert np.nanmin(change) == pytest.approx(6.0, abs=1e-6)
    assert np.nanmax(change) == pytest.approx(6.0, abs=1e-6)


def test_a_name_that_is_no_condition(tmp_path):
    path = small_fleet(tmp_path / "drive", **{"[radiation]": '[radiation]\nmap_conditions = ["7"]'})
    with pytest.raises(FleetError, match=r"map_conditions names '7', which is no condition; there are 1, 2, 3$"):
        td.predict(path, tmp_path / "store")


def test_without_a_housing_nothing_is_mapped(tmp_path):
    path = small_fleet(tmp_path / "drive", **MAPS, **{'"boundary_elements"': '"point_sources"'})
    result = td.predict(path, tmp_path / "store")
    assert result.prediction.maps == ()
    assert NO_HOUSING in result.prediction.doubts
    assert "near_field" not in result.tables
