"""A campaign that names a template: its report follows it, and another template is another report."""

import json

import pytest
from small_campaigns import small_campaign

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import MissingFileError, TemplateError
from tdacoustic.steps import Store
from tdacoustic.workflows.output import OutputFolder
from tdacoustic.workflows.run_one import run_into
from tdacoustic.workflows.up_to_date import standing

HEAD = 'schema = "tdacoustic-template/1"\n'


@pytest.fixture
def campaign(tmp_path):
    path = small_campaign(tmp_path / "ride", conditions=("a",))
    text = path.read_text(encoding="utf-8").replace("\n\n", '\ntemplate = "../house.toml"\n\n', 1)
    path.write_text(text, encoding="utf-8")
    (tmp_path / "house.toml").write_text(HEAD + 'company = "House & Sons"\n[sections]\nleave_out = ["spectra"]\n')
    return path


def written(campaign, tmp_path):
    out = tmp_path / "out"
    run_into(load_campaign(campaign), OutputFolder(out, campaign), tmp_path / "store", 1)
    return out


def test_the_report_follows_it_and_the_numbers_do_not(campaign, tmp_path):
    out = written(campaign, tmp_path)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "House &amp; Sons" in page and 'id="h-spectra"' not in page
    assert "Left out by the template of this report: Spectra and lines." in page
    held = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert [item["file"] for item in held["inputs"] if item["format"] == "template"] == ["../house.toml"]
    levels = (out / "levels.csv").read_bytes()
    (tmp_path / "house.toml").write_text(HEAD)
    assert standing(out, campaign, Store(tmp_path / "store")) is None  # another template is another report
    assert (written(campaign, tmp_path) / "levels.csv").read_bytes() == levels
    assert 'id="h-spectra"' in (out / "report.html").read_text(encoding="utf-8")
    assert standing(out, campaign, Store(tmp_path / "store")) is not None


def test_what_is_wrong_with_it_is_said_before_the_work(campaign, tmp_path):
    (tmp_path / "house.toml").write_text(HEAD + "company = 7\n")
    with pytest.raises(TemplateError, match=r"house\.toml: company must be"):
        written(campaign, tmp_path)
    assert not (tmp_path / "store" / "results").exists() and not (tmp_path / "out").exists()
    (tmp_path / "house.toml").unlink()
    with pytest.raises(MissingFileError, match=r"house\.toml: no such file"):
        written(campaign, tmp_path)
