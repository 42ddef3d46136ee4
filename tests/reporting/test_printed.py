"""What the report holds of the paper is what the fleet of the paper states of it: one set of facts, one verdict."""

import pytest
from plain_fleets import plain_fleet

from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.document import Paragraph, Sentences, Table, walk
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.reporting.sections.printed import DTE_PP_UM, LEVEL_OF_TEXT_DB, MEASURED_4M, MODEL_4M, TABLE_5
from tdacoustic.workflows.predict import predict

FLEET = "calibration/crrc-freight/fleet.toml"


def stated(quantity, kind="model"):
    return [
        (reference.condition, reference.value)
        for reference in load_fleet(FLEET).reference
        if reference.quantity == quantity and reference.kind == kind
    ]


def test_the_numbers_of_the_report_are_those_of_the_fleet_file():
    assert stated("spl_4m_db") == [(row.conditions, row.level_db) for row in MODEL_4M]
    assert stated("spl_4m_db", "measured") == [(row.conditions, row.level_db) for row in MEASURED_4M]
    assert stated("dte_pp_um") == [(("5",), DTE_PP_UM)]
    assert stated("masuda_spl_1m_db") == [
        (("5",), LEVEL_OF_TEXT_DB),
        *(((row.condition,), row.level_db) for row in TABLE_5),
    ]


@pytest.fixture(scope="module")
def document(tmp_path_factory):
    folder = tmp_path_factory.mktemp("printed")
    asked = """
[[feature]]
name = "Wheel over speed"
quantity = "wheel_force_y_n"
shape = "rises_then_falls"
origin = "paper, Fig. 10b"

[[feature]]
name = "Masuda over speed"
quantity = "masuda_spl_1m_db"
shape = "rises_then_falls"
origin = "paper, Table 5"
"""
    path = folder / "fleet.toml"
    path.write_text(plain_fleet("crrc-freight").read_text(encoding="utf-8") + asked, encoding="utf-8")
    return predicted_report(predict(path, folder / "store"))


def test_one_verdict_everywhere(document):
    """Sections on forces and meshing noise have the verdicts of the one that judges, and none of their own."""
    blocks = list(walk([*document.summary, *document.sections]))
    texts = [block.text for block in blocks if isinstance(block, Paragraph)]
    texts += [item for block in blocks if isinstance(block, Sentences) for item in block.items]
    (judged,) = [block for block in blocks if isinstance(block, Table) and block.name == "features"]
    for label, verdict, *_ in judged.rows:
        said = [text for text in texts if text.startswith("Features of another source") and label in text]
        assert len(said) == 1
        before = said[0][: said[0].index(label)]
        assert before.rpartition(": ")[0].endswith(verdict)
    assert not any(word in text.lower() for text in texts for word in (": met", "not met"))
    words = [text for text in texts if text.startswith("Of 2 features of the paper")]
    assert len(words) == 1
