"""docs/formats.md and docs/install.md have the formats, keys, defaults and extras of the program, and no others."""

import re
import tomllib
import typing

import pytest
from guides import DOCS, ROOT, section

from tdacoustic.campaign import SCHEMA as CAMPAIGN_SCHEMA
from tdacoustic.campaign.calibration import CalibrationParameter, CalibrationSettings
from tdacoustic.campaign.channels import CampaignChannel
from tdacoustic.campaign.judgements import Exclude, Level, Override
from tdacoustic.campaign.model import CampaignFile
from tdacoustic.campaign.railway import RailwaySettings
from tdacoustic.campaign.runs import CampaignRun
from tdacoustic.campaign.sensor_columns import SENSOR_COLUMNS
from tdacoustic.campaign.settings import AnalysisSettings
from tdacoustic.fleet import housing, motor
from tdacoustic.fleet.sections import SCHEMA as FLEET_SCHEMA
from tdacoustic.fleet.sections import FleetFile
from tdacoustic.formats import FORMATS
from tdacoustic.reporting.template import TemplateFile, TemplateSections
from tdacoustic.toml_models import Table

PAGE = DOCS / "formats.md"
CODE = re.compile(r"`([^`]+)`")


def table(text):
    """Rows of the first table in a text, as lists of cells, without its head."""
    lines = re.search(r"(?:^\|.*\n)+", text, re.MULTILINE)[0].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def part(marker):
    """What stands below a bold marker of campaign.toml, up to the next one."""
    text = section(PAGE, "campaign.toml")
    start = text.index(f"**`{marker}`**")
    end = text.find("\n**`", start + 1)
    return text[start : None if end < 0 else end]


def keys(rows):
    return {key for row in rows for key in CODE.findall(row[0])}


def test_the_formats():
    rows = {CODE.findall(row[2])[0]: CODE.findall(row[1]) for row in table(section(PAGE, "Logs"))}
    assert rows == {row.name: list(row.suffixes) for row in FORMATS}


def test_the_top_of_a_campaign():
    tables = {"channel", "run", "level", "exclude", "override", "analysis", "calibration", "railway"}
    assert keys(table(section(PAGE, "campaign.toml"))) == {"schema", *CampaignFile.model_fields} - tables
    assert CAMPAIGN_SCHEMA in section(PAGE, "campaign.toml")
    for name in tables:
        double = typing.get_origin(CampaignFile.model_fields[name].annotation) is tuple
        assert part(f"[[{name}]]" if double else f"[{name}]")


@pytest.mark.parametrize(
    ("marker", "model", "elsewhere"),
    [
        ("[[channel]]", CampaignChannel, set()),
        ("[[run]]", CampaignRun, set()),
        ("[analysis]", AnalysisSettings, set()),
        ("[calibration]", CalibrationSettings, {"parameter"}),
    ],
)
def test_the_tables_of_a_campaign(marker, model, elsewhere):
    assert keys(table(part(marker))) == set(model.model_fields) - elsewhere


@pytest.mark.parametrize(
    ("marker", "model"),
    [("[[level]]", Level), ("[[exclude]]", Exclude), ("[[override]]", Override), ("[railway]", RailwaySettings)],
)
def test_the_short_tables_of_a_campaign(marker, model):
    said = {code.split()[0] for code in CODE.findall(part(marker))}
    assert set(model.model_fields) <= said


def test_a_parameter_of_the_calibration():
    said = CODE.findall(part("[calibration]").split("`[[calibration.parameter]]`")[1])
    assert said == list(CalibrationParameter.model_fields)


@pytest.mark.parametrize(
    ("marker", "model"), [("[analysis]", AnalysisSettings), ("[calibration]", CalibrationSettings)]
)
def test_the_defaults(marker, model):
    """Each number, word or truth in the column of defaults is the model's."""
    checked = 0
    for names, said, *_ in table(part(marker)):
        named = CODE.findall(names)
        for name, word in zip(named, said.split(", ") if len(named) > 1 else [said], strict=True):
            default = model.model_fields[name].default
            word = word.strip('`"')
            if isinstance(default, bool):
                assert word == str(default).lower(), name
            elif isinstance(default, int | float):
                assert float(word) == default, name
            elif isinstance(default, str):
                assert word == default, name
            else:
                continue
            checked += 1
    assert checked >= 8


def inner(annotation):
    """The models of tables that an annotation holds."""
    some = (annotation, *typing.get_args(annotation))
    parts = {part for one in some for part in (one, *typing.get_args(one))}
    return {part for part in parts if isinstance(part, type) and issubclass(part, Table)}


def test_the_keys_of_a_fleet():
    rows = {CODE.findall(row[0])[0] if "`" in row[0] else row[0]: CODE.findall(row[1]) for row in table(_fleet())}
    models = {name: field for name, field in FleetFile.model_fields.items() if inner(field.annotation)}
    expected = {}
    for name, field in models.items():
        (model,) = inner(field.annotation)
        double = typing.get_origin(field.annotation) is not None and "tuple" in str(field.annotation)
        expected[f"[[{name}]]" if double else f"[{name}]"] = set(model.model_fields)
    expected["[motor]"] -= {"excitation"}
    expected["[housing]"] -= {"material", "seat"}
    expected["[[motor.excitation]]"] = set(motor.MotorExcitation.model_fields)
    expected["[housing.material]"] = set(housing.Material.model_fields)
    expected["[[housing.seat]]"] = set(housing.HousingSeat.model_fields)
    assert FLEET_SCHEMA in rows.pop("top")[0]
    assert {marker: set(held) for marker, held in rows.items()} == expected


def _fleet():
    return section(PAGE, "fleet.toml")


def test_the_keys_of_a_template():
    rows = table(section(PAGE, "template.toml"))
    assert keys(rows) == {"schema", *TemplateFile.model_fields}
    assert set(TemplateSections.model_fields) == set(CODE.findall(rows[-1][1]))


def test_the_columns_of_a_sensor_table():
    said = set(CODE.findall(section(PAGE, "sensors.csv")))
    assert set(SENSOR_COLUMNS) <= said


def test_the_extras():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    rows = {CODE.findall(row[0])[0] for row in table(section(DOCS / "install.md", "Extras"))}
    assert rows == set(project["optional-dependencies"])
    assert f"Python {project['requires-python'].removeprefix('>=')} or later" in (DOCS / "install.md").read_text(
        "utf-8"
    )
