"""The dataset as its users get it: typed, with units, for pandas and DuckDB, however its rows are grouped."""

import datetime

import pandas as pd
import pytest
from made_up_results import calibration, fitted, level, made_result, model, quality, verdict

from tdacoustic.gathering import DatasetWriter, dataset, open_result, read_result
from tdacoustic.gathering.contracts import DATASET_TABLES, IDENTITY

pa = pytest.importorskip("pyarrow", reason="a dataset needs pyarrow")
pq = pytest.importorskip("pyarrow.parquet", reason="a dataset needs pyarrow")


def written(folder, results, target):
    with DatasetWriter(target, "1.2.3") as writer:
        for number, keys in enumerate(results):
            made = made_result(folder / str(number), **{"name": f"c{number}", **keys})
            writer.add(read_result(open_result(made)), f"somewhere/{number}")
    return writer


ONE = {
    "meta": {"train": "185 042", "date": "2024-05-01"},
    "started": "2024-05-01T10:00:00+02:00",
    "levels": [level("a", 30.0, 85.0), level("b", 60.0, 95.0)],
    "dominance": [verdict("a", 30.0, "motor", 0.95), verdict("b", 60.0, "gearbox", 0.99)],
    "quality": [quality("a"), quality("b", word="bad", detail="412 samples, at full scale")],
    "conditions": [model("a", 30.0)],
    "bands": [("a", "a", "mic", 100.0, 70.0, True), ("a", "a", "mic", 125.0, 71.0, False)],
    "files": {"calibration.json": calibration({"masuda.constant_db": fitted(60.0, None, None)}, ["x"])},
    "problems": ["this was not done"],
}
TWO = {"origin": "synthetic", "fleet": "", "levels": [level("a", 30.0, 70.0)]}


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset")
    writer = written(folder / "results", [ONE, TWO], folder / "dataset")
    assert writer.rows["levels"] == 3
    return folder / "dataset"


def test_every_table_is_there_with_whose_rows_they_are(held):
    assert {path.stem for path in held.iterdir()} == set(DATASET_TABLES)
    for path in held.iterdir():
        assert pq.read_schema(path).names[: len(IDENTITY)] == [
            *("result", "campaign", "train", "date", "year", "origin", "fleet")
        ]


def test_types_units_and_references_are_in_the_files(held):
    schema = pq.read_schema(held / "levels.parquet")
    assert schema.metadata[b"tdacoustic"] == b"1.2.3"
    assert (schema.metadata[b"schema"], schema.metadata[b"table"]) == (b"tdacoustic-dataset/1", b"levels")
    assert pa.types.is_dictionary(schema.field("channel").type)
    assert schema.field("level_db").type == pa.float64()
    assert schema.field("laeq_db").metadata == {b"unit": b"dB", b"reference": b"20 uPa"}
    assert schema.field("train_speed_km_h").metadata == {b"unit": b"km/h"}
    assert pq.read_schema(held / "bands.parquet").field("filter_dependent").type == pa.bool_()
    conditions = pq.read_schema(held / "conditions.parquet")
    assert conditions.field("motor_sound_power_level_db").metadata[b"reference"] == b"1 pW"
    assert conditions.field("torque_n_m").metadata == {b"unit": b"N m"}
    assert pq.read_schema(held / "lines.parquet").field("prominence_db").metadata[b"reference"].startswith(b"none")
    results = pq.read_schema(held / "results.parquet")
    assert results.field("started").type == pa.timestamp("us", tz="UTC")
    assert results.field("date").type == pa.date32()


def test_every_level_of_the_dataset_has_a_reference(held):
    for path in held.iterdir():
        for field in pq.read_schema(path):
            if field.name.endswith("_db"):
                assert field.metadata[b"unit"] == b"dB" and field.metadata[b"reference"], (path.stem, field.name)


def test_pandas_reads_what_was_written(held):
    levels = pd.read_parquet(held / "levels.parquet")
    assert levels["level_db"].tolist() == [85.0, 95.0, 70.0]
    assert levels["train"].tolist()[:2] == ["185 042"] * 2
    assert levels["train"].isna().tolist() == [False, False, True]
    assert levels.groupby("origin", observed=True)["level_db"].max().to_dict() == {"measured": 95.0, "synthetic": 70.0}
    results = pd.read_parquet(held / "results.parquet")
    assert results["started"][0] == pd.Timestamp("2024-05-01T08:00:00Z")
    assert results["date"][0] == datetime.date(2024, 5, 1)
    assert results["first_problem"][0] == "this was not done"
    assert (results["runs"].tolist(), results["runs_bad"].tolist()) == ([2, 0], [1, 0])
    overview = pd.read_parquet(held / "overview.parquet")
    assert overview["level_4m_db"].dropna().tolist() == [85.0, 70.0]  # the run of the other condition is bad
    assert overview["dominant"].tolist()[:2] == ["motor", "gearbox"]
    parameters = pd.read_parquet(held / "parameters.parquet")
    assert parameters[["parameter", "value", "state"]].values.tolist() == [["masuda.constant_db", 60.0, "on a bound"]]
    bad = pd.read_parquet(held / "quality.parquet").query("verdict == 'bad'")
    assert bad[["check", "checks", "runs", "first_detail"]].values.tolist() == [
        ["clipping", 1, 1, "412 samples, at full scale"]
    ]
    assert pd.read_parquet(held / "residuals.parquet")["measured_db"].tolist() == [85.0]
    assert pd.read_parquet(held / "bands.parquet")["filter_dependent"].tolist() == [True, False]


def test_duckdb_answers_across_tables(held):
    duckdb = pytest.importorskip("duckdb", reason="a query with DuckDB needs it")
    asked = f"""
        select o.train, o.dominant, round(avg(l.level_db), 3)
        from '{(held / "overview.parquet").as_posix()}' o
        join '{(held / "levels.parquet").as_posix()}' l using (result, condition)
        where o.origin = 'measured' and o.confidence > 0.9
        group by all order by o.dominant
    """
    assert duckdb.sql(asked).fetchall() == [("185 042", "gearbox", 95.0), ("185 042", "motor", 85.0)]


@pytest.mark.parametrize(("rows", "tables"), [(3, 256), (1000, 2), (7, 1)])
def test_however_the_rows_are_grouped_the_table_is_the_same(tmp_path, monkeypatch, rows, tables):
    many = [
        {"levels": [level(f"c{n}", 30.0 + n, 80.0 + 0.1 * k, run=f"r{k}", channel=f"m{k}") for k in range(n % 4)]}
        for n in range(11)
    ]
    expected = [(f"c{n}", 80.0 + 0.1 * k, f"m{k}") for n in range(11) for k in range(n % 4)]
    monkeypatch.setattr(dataset, "ROWS_A_GROUP", rows)
    monkeypatch.setattr(dataset, "TABLES_APART", tables)
    written(tmp_path / "results", many, tmp_path / "dataset")
    frame = pd.read_parquet(tmp_path / "dataset/levels.parquet")
    found = list(zip(frame["condition"], frame["level_db"], frame["channel"], strict=True))
    assert [(condition, channel) for condition, _, channel in found] == [(c, m) for c, _, m in expected]
    assert [value for _, value, _ in found] == pytest.approx([value for _, value, _ in expected])
    groups = pq.ParquetFile(tmp_path / "dataset/levels.parquet").metadata.num_row_groups
    assert groups == 1 if rows == 1000 else groups > 1


def test_the_same_results_give_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        written(tmp_path / "results", [ONE, TWO], tmp_path / name)
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
