"""From each figure and table of the modelled side's own reports to the steps and files behind it."""

import re

import pytest
from plain_fleets import plain_campaign, plain_fleet

import tdacoustic as td
from tdacoustic.reporting.calibration_report import calibration_report
from tdacoustic.reporting.document import FigureBlock, Section, Table, walk
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.predicted_report import predicted_report
from tdacoustic.steps import Store
from tdacoustic.workflows.predict import predict


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    store = Store(tmp_path_factory.mktemp("store"))
    return predict(plain_fleet("reference-drive"), store=store)


def anchors(page):
    return re.findall(r'class="behind" href="#([^"]+)"', page)


def test_every_figure_of_a_prediction_leads_to_its_steps(predicted):
    document = predicted_report(predicted)
    shown = [block for section in document.sections[:-1] for block in walk([section])]
    shown = [block for block in [*walk(document.summary), *shown] if isinstance(block, (FigureBlock, Table))]
    page = render_html(document)
    assert len(shown) > 10 and len(anchors(page)) == len(shown)
    assert set(anchors(page)) == {"from-prediction"}
    (behind,) = [
        block for block in walk(document.sections) if isinstance(block, Table) and block.name == "lineage-prediction"
    ]
    steps = {row[1] for row in behind.rows}
    assert steps == {f"{record.step}, version {record.version}" for _, record in predicted.records}


def test_every_figure_of_a_calibration_leads_to_what_it_came_of(tmp_path):
    result = td.calibrate(plain_campaign("crrc-freight-printed"), tmp_path / "store")
    document = calibration_report(result)
    page = render_html(document)
    ids = {block.id for block in walk(document.sections) if isinstance(block, Section)}
    assert anchors(page) and set(anchors(page)) <= ids
    assert ("from-calibration" in ids) == bool(result.records)
    (settings,) = [block for block in walk(document.sections) if isinstance(block, Table) and block.name == "settings"]
    (freed,) = [row[1] for row in settings.rows if row[0] == "calibration.free"]
    assert freed == ", ".join(parameter.key for parameter in result.calibration.parameters)
