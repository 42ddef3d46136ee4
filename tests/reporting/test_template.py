"""A company's template: what it says is on the page, what it leaves out is said, what is wrong with it is one line."""

import base64
import re
from pathlib import Path

import pytest

import tdacoustic
from tdacoustic.errors import MissingFileError, TemplateError
from tdacoustic.reporting import Document, Paragraph, Section
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.template import SECTIONS, load_template

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
HEAD = 'schema = "tdacoustic-template/1"\n'


def template(tmp_path, text):
    path = tmp_path / "template.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


def document():
    inner = [Section(name, name.title(), [Paragraph(name)]) for name in ("sources", "orders", "spectra")]
    return Document(
        "Type test",
        "",
        "measured",
        sections=[Section("recordings", "Recordings", [Paragraph("first"), *inner]), Section("provenance", "How", [])],
        lineage={"sources": "provenance"},
    )


def headings(text):
    return re.findall(r'<h[23] id="h-([a-z-]+)"', text)


def test_company_logo_lines_and_title_stand_above_the_report(tmp_path):
    (tmp_path / "logo.png").write_bytes(PNG)
    said = 'company = "Böhm & Söhne <Lok>"\ntitle = "Report 7: {title}"\nlogo = "logo.png"\nlines = ["Acoustics"]\n'
    text = render_html(load_template(template(tmp_path, said)).applied(document()))
    assert "Böhm &amp; Söhne &lt;Lok&gt;" in text and "<Lok>" not in text
    assert "<h1>Report 7: Type test</h1>" in text and "<p>Acoustics</p>" in text
    assert f"data:image/png;base64,{base64.b64encode(PNG).decode()}" in text


def test_sections_come_in_the_asked_order_at_each_level_the_others_after_them(tmp_path):
    path = template(tmp_path, '[sections]\nfirst = ["provenance", "spectra", "orders"]\n')
    text = render_html(load_template(path).applied(document()))
    assert headings(text) == ["provenance", "recordings", "spectra", "orders", "sources"]


def test_what_is_left_out_is_said(tmp_path):
    path = template(tmp_path, 'footer = ["Confidential"]\n[sections]\nleave_out = ["orders", "provenance"]\n')
    text = render_html(load_template(path).applied(document()))
    assert headings(text) == ["recordings", "sources", "spectra"]
    assert "Left out by the template of this report: Orders, How." in text
    assert text.index("Confidential") < text.index("Left out by the template")
    assert "How it came about" not in text  # its target is gone


def test_an_empty_template_changes_nothing(tmp_path):
    assert render_html(load_template(template(tmp_path, "")).applied(document())) == render_html(document())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[sections]\nfirst = ["spectre"]', "names no section: 'spectre'; the nearest is 'spectra'"),
        ('[sections]\nfirst = ["spectra", "spectra"]', "names 'spectra' twice"),
        ('title = "Report"', "{title} once"),
        ('title = "{title} {name}"', "no other braces"),
        ('compny = "x"', "unknown key 'compny' at the top level; the nearest known key is 'company'"),
        ('logo = "note.txt"', "note.txt: a logo has to be a PNG or a JPEG"),
        ('company = ""', "must not be empty"),
    ],
)
def test_what_is_wrong_is_one_line_that_names_the_file(tmp_path, text, said):
    (tmp_path / "note.txt").write_text("<svg onload='alert(1)'/>")
    with pytest.raises(TemplateError, match=re.escape(said)) as error:
        load_template(template(tmp_path, text))
    assert "\n" not in str(error.value) and str(tmp_path) in str(error.value)


def test_a_logo_that_is_not_there_or_too_large(tmp_path):
    with pytest.raises(MissingFileError, match=re.escape("logo.png: no such file")):
        load_template(template(tmp_path, 'logo = "logo.png"'))
    (tmp_path / "logo.png").write_bytes(PNG + bytes(600_000))
    with pytest.raises(TemplateError, match="a logo may have 500 kB, this one has 600"):
        load_template(template(tmp_path, 'logo = "logo.png"'))


def test_another_logo_is_another_template(tmp_path):
    (tmp_path / "logo.png").write_bytes(PNG)
    path = template(tmp_path, 'logo = "logo.png"')
    first = load_template(path).sha256
    (tmp_path / "logo.png").write_bytes(PNG + b"0")
    assert load_template(path).sha256 != first


def test_the_sections_that_can_be_named_are_those_of_the_reports():
    root = Path(tdacoustic.__file__).parent / "reporting"
    files = [*root.glob("sections/*.py"), *root.glob("*_report.py")]
    text = "".join(path.read_text(encoding="utf-8") for path in files)
    made = set(re.findall(r'Section\(\s*"([a-z-]+)"', text))
    assert made >= SECTIONS - {"calibration"}
