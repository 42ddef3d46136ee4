"""``--pdf``: the report for paper beside the page, in the manifest; what it needs is said before any work."""

import hashlib
import io
import json

import pypdf
import pytest
from small_campaigns import small_campaign

from tdacoustic.reporting import Document, Paragraph, Section
from tdacoustic.steps import Store
from tdacoustic.workflows.output import OutputFolder
from tdacoustic.workflows.up_to_date import standing
from tdacoustic.workflows.write import write_report

COMMANDS = ("run", "analyze", "predict", "calibrate", "fleet")


def report() -> Document:
    return Document("Report", "", "measured", sections=[Section("one", "One", [Paragraph("text")])])


def test_the_pdf_is_in_the_manifest_by_its_hash_and_goes_when_it_is_not_asked_for(tmp_path) -> None:
    subject = tmp_path / "campaign.toml"
    for pdf in (True, False):
        with OutputFolder(tmp_path / "out", subject) as folder:
            write_report(folder, report, pdf)
        files = json.loads((tmp_path / "out/manifest.json").read_text(encoding="utf-8"))["files"]
        assert sorted(files) == (["report.html", "report.pdf"] if pdf else ["report.html"])
        assert (tmp_path / "out/report.pdf").exists() == pdf
        if pdf:
            raw = (tmp_path / "out/report.pdf").read_bytes()
            assert files["report.pdf"] == hashlib.sha256(raw).hexdigest()
            assert "page 1 of 1" in pypdf.PdfReader(io.BytesIO(raw)).pages[0].extract_text()


@pytest.mark.parametrize("command", COMMANDS)
def test_without_reportlab_nothing_is_even_opened(command, tmp_path, monkeypatch, call_program) -> None:
    """The campaign is not there: were anything looked at before, the error would be another."""
    monkeypatch.setattr("tdacoustic.reporting.pdf.find_spec", lambda name: None)
    code, out, err = call_program(command, tmp_path / "none", "-o", tmp_path / "out", "--pdf")
    assert (code, out) == (1, "")
    assert err.splitlines() == ["error: a PDF report needs reportlab: pip install 'tdacoustic[pdf]'"]
    assert not (tmp_path / "out").exists()


def test_a_campaign_is_run_with_its_pdf_and_one_without_is_not_up_to_date(tmp_path, call_program) -> None:
    campaign = small_campaign(tmp_path / "campaign", seconds=2.0, conditions=("a",))
    where = ("-o", tmp_path / "out", "--store", tmp_path / "store", "--quiet", "--jobs", "1")
    assert call_program("run", campaign, *where)[0] == 0
    store = Store(tmp_path / "store")
    assert standing(tmp_path / "out", campaign, store) is not None
    assert standing(tmp_path / "out", campaign, store, ("report.pdf",)) is None
    assert call_program("run", campaign, *where, "--pdf")[0] == 0
    assert standing(tmp_path / "out", campaign, store, ("report.pdf",)) is not None
    pages = pypdf.PdfReader(tmp_path / "out/report.pdf").pages
    assert all("Small" in page.extract_text() and "data: measured" in page.extract_text() for page in pages)
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    text = "".join("".join(page.extract_text().split()) for page in pages)
    for number in (1, 2, 3):
        assert f"Figure{number}." in text and f"Figure {number}." in page
