"""Campaigns whose logs are named by URL: fetched where that is allowed, and then as if they lay beside the campaign."""

import json

import pytest
from small_campaigns import REFERENCE, files_of, small_campaign

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError
from tdacoustic.steps import Store
from tdacoustic.workflows.analyze import analyze
from tdacoustic.workflows.fetched_logs import with_fetched_logs

pytest.importorskip("fsspec", reason="the extra `cluster` is not installed")


def by_url(folder, path):
    """The same campaign elsewhere, its logs named by URL."""
    folder.mkdir()
    text = path.read_text(encoding="utf-8")
    for log in path.parent.glob("*.h5"):
        text = text.replace(json.dumps(log.name), json.dumps(log.as_uri()))
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return folder / "campaign.toml"


def test_a_url_is_not_fetched_unasked(tmp_path, call_program):
    path = by_url(tmp_path / "url", small_campaign(tmp_path / "near", conditions=("a", "b")))
    uri = (tmp_path / "near" / "a.h5").as_uri()
    for command in ("run", "analyze", "check", "calibrate"):
        if command == "calibrate":
            path.write_text('fleet = "fleet.toml"\n' + path.read_text(encoding="utf-8"), encoding="utf-8")
            (path.parent / "fleet.toml").write_bytes(REFERENCE.read_bytes())
        code, _, said = call_program(command, path, "--store", tmp_path / "store", "-o", tmp_path / "out")
        assert code == 1
        assert said.startswith(
            f"error: {path}: run 'a': logs names {uri!r}, which is fetched only where that is allowed"
        )
        assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "store" / "fetched").exists()


def test_what_is_fetched_gives_the_same_result(tmp_path, call_program):
    near = small_campaign(tmp_path / "near", conditions=("a", "b"))
    path = by_url(tmp_path / "url", near)
    for number, campaign in enumerate((near, path, path)):
        more = [] if campaign is near else ["--fetch-urls"]
        out = tmp_path / f"out-{number}"
        code, _, said = call_program(
            "run", campaign, "--store", tmp_path / f"store-{min(number, 1)}", "-o", out, "--quiet", *more
        )
        assert code == 0, said
    one, two, again = (files_of(tmp_path / f"out-{number}") for number in range(3))
    assert two == again
    tables = [name for name in one if name.endswith(".csv")]
    assert len(tables) > 5
    assert {name: two[name] for name in tables} == {name: one[name] for name in tables}
    logs = [entry for entry in json.loads(two["manifest.json"])["inputs"] if entry["file"].endswith(".h5")]
    assert {entry["file"] for entry in logs} == {(tmp_path / "near" / f"{name}.h5").as_uri() for name in "ab"}
    assert str(tmp_path / "store-1") not in two["report.html"].decode()
    fetched = [file for file in (tmp_path / "store-1" / "fetched").rglob("*") if file.is_file()]
    assert sorted(file.name for file in fetched) == ["a.h5", "b.h5"]


def test_a_url_that_cannot_be_fetched_costs_its_run_alone(tmp_path):
    near = small_campaign(tmp_path / "near", conditions=("a", "b"))
    path = by_url(tmp_path / "url", near)
    (tmp_path / "near" / "b.h5").unlink()
    analysis = analyze(path, tmp_path / "store", fetch_urls=True)
    uri = (tmp_path / "near" / "b.h5").as_uri()
    assert analysis.problems[0] == f"run 'b' is left out: {uri}: no such file"
    assert [run.measurement is not None for run in analysis.runs] == [True, False]


def test_each_url_is_fetched_once_and_told(tmp_path):
    path = by_url(tmp_path / "url", small_campaign(tmp_path / "near", conditions=("a",)))
    text = path.read_text(encoding="utf-8")
    path.write_text(
        text + text[text.index("[[run]]") :].replace('condition = "a"', 'condition = "c"\nstart_s = 0.5'),
        encoding="utf-8",
    )
    campaign, heard = load_campaign(path), []
    found, failed = with_fetched_logs(campaign, Store(tmp_path / "store"), True, lambda *told: heard.append(told))
    assert failed == {}
    assert found.runs[0].logs == found.runs[1].logs
    assert not found.runs[0].logs[0].to_fetch
    assert {total for *_, total in heard} == {1}
    assert heard[0][0] == f"fetching {found.runs[0].logs[0].text}"
    assert with_fetched_logs(found, Store(tmp_path / "store"), False) == (found, {})
    with pytest.raises(CampaignError, match="fetched only where that is allowed"):
        with_fetched_logs(campaign, Store(tmp_path / "store"), False)
