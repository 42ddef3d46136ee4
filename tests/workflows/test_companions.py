"""A log that consists of several files: all of them enter the key of what is computed, and the report."""

from dataclasses import dataclass

import numpy as np
import pytest
from small_campaigns import HEAD, MIC, RATE_HZ, signal, table

from tdacoustic.formats import scan
from tdacoustic.steps import Step, Store, execute, log_file
from tdacoustic.workflows.analyze import analyze


@dataclass(frozen=True)
class Nothing:
    """A result."""


def nothing(settings, logs):
    return Nothing()


STEP = Step("any", 1, nothing, "Any")
N = 8192
COLUMNS = """
<application_element><name>{name}</name><basetype>{base}</basetype>
<application_attribute><name>Id</name><base_attribute>id</base_attribute></application_attribute>
<application_attribute><name>Name</name><base_attribute>name</base_attribute></application_attribute>
{attributes}{relations}</application_element>
"""


def write_campaign(folder):
    """A campaign of one run, whose log is an ATFX file with two component files."""
    logs = folder / "logs"
    logs.mkdir(parents=True)

    def element(name, base, attributes=(), relations=()):
        return COLUMNS.format(
            name=name,
            base=base,
            attributes="".join(
                f"<application_attribute><name>{key}</name><base_attribute>{key}</base_attribute>"
                "</application_attribute>"
                for key in attributes
            ),
            relations="".join(
                f"<relation_attribute><name>{key}</name><ref_to>{other}</ref_to><base_relation>{key}</base_relation>"
                "</relation_attribute>"
                for key, other in relations
            ),
        )

    column = ("independent", "sequence_representation", "generation_parameters", "values")
    model = element("sm", "AoSubmatrix", ["number_of_rows"])
    model += element("lc", "AoLocalColumn", column, [("submatrix", "sm"), ("measurement_quantity", "mq")])
    model += element("mq", "AoMeasurementQuantity", (), [("unit", "unit")]) + element("unit", "AoUnit")
    rows = f"<sm><Id>1</Id><number_of_rows>{N}</number_of_rows></sm><unit><Id>1</Id><Name>s</Name></unit>"
    rows += "<unit><Id>2</Id><Name>Pa</Name></unit><mq><Id>1</Id><unit>1</unit></mq><mq><Id>2</Id><unit>2</unit></mq>"
    rows += (
        "<lc><Id>1</Id><Name>Time</Name><independent>1</independent><submatrix>1</submatrix>"
        "<measurement_quantity>1</measurement_quantity><sequence_representation>implicit_linear"
        f"</sequence_representation><generation_parameters>0 {1 / RATE_HZ!r}</generation_parameters></lc>"
    )
    files = ""
    for number, name in enumerate(("mic", "other"), 2):
        files += f"<component><identifier>{name}</identifier><filename>{name}.bin</filename></component>"
        rows += (
            f"<lc><Id>{number}</Id><Name>{name}</Name><independent>0</independent><submatrix>1</submatrix>"
            "<measurement_quantity>2</measurement_quantity><sequence_representation>explicit</sequence_representation>"
            f"<values><component><identifier>{name}</identifier><datatype>ieeefloat4</datatype><length>{N}</length>"
            "</component></values></lc>"
        )
        (logs / f"{name}.bin").write_bytes(signal(number, N / RATE_HZ, 300.0, 0.2).astype("<f4").tobytes())
    text = f"<atfx_file><files>{files}</files><application_model>{model}</application_model>"
    (logs / "run.atfx").write_text(f"{text}<instance_data>{rows}</instance_data></atfx_file>", encoding="utf-8")
    run = table("run", condition="a", logs=["logs/run.atfx"], train_speed_km_h=30.0)
    (folder / "campaign.toml").write_text(HEAD + MIC + run, encoding="utf-8")
    return folder / "campaign.toml"


def louder(path, factor):
    path.write_bytes((np.frombuffer(path.read_bytes(), "<f4") * np.float32(factor)).tobytes())


@pytest.fixture
def campaign(tmp_path):
    return write_campaign(tmp_path / "campaign")


def test_the_files_of_a_log_make_its_key(campaign):
    path = campaign.parent / "logs" / "run.atfx"

    def key():
        file = log_file(path, companions=scan(path).companions)
        return STEP.task("x", (), logs=(file,)).key

    first = key()
    assert first == key() != STEP.task("x", (), logs=(log_file(path),)).key
    louder(path.with_name("other.bin"), 2.0)
    assert key() != first


def test_the_record_of_a_result_names_all_files_of_a_log(campaign, tmp_path):
    path = campaign.parent / "logs" / "run.atfx"
    file = log_file(path, companions=scan(path).companions)
    task, store = STEP.task("x", (), logs=(file,)), Store(tmp_path / "store")
    execute([task], store)
    assert store.record(task.key).inputs == tuple(("logs", f"sha256:{item.sha256}") for item in file.files)
    assert len(file.files) == 3


def test_a_file_alone_is_known_by_its_own_hash(campaign):
    file = log_file(campaign)
    assert (file.key, file.files, file.companions) == (f"sha256:{file.sha256}", (file,), ())


def test_a_changed_component_file_is_computed_anew_and_stands_among_the_inputs(campaign, tmp_path):
    mic = campaign.parent / "logs" / "mic.bin"
    levels, hashes = [], []
    for factor in (1.0, 2.0):
        louder(mic, factor)
        result = analyze(campaign, tmp_path / "store")
        logs = {file.written: file.sha256 for file in result.inputs if file.format == "atfx"}
        assert list(logs) == ["logs/run.atfx", "logs/mic.bin", "logs/other.bin"]
        hashes.append(logs)
        levels.append(float(result.tables["levels"]["level_db"].iloc[0]))
    assert levels[1] - levels[0] == pytest.approx(6.0206, abs=1e-3)  # twice the pressure
    assert hashes[0]["logs/mic.bin"] != hashes[1]["logs/mic.bin"]
    assert hashes[0]["logs/run.atfx"] == hashes[1]["logs/run.atfx"]
