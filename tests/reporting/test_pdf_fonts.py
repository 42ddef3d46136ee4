"""Signs on paper: in a font of the file, or named; never lost, whatever is installed."""

import pytest
from read_pdf import ReadPdf, tight

from tdacoustic.reporting import Axis, Bars, Column, Document, Figure, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.language import Language, speaking
from tdacoustic.reporting.pdf import fonts, render_pdf
from tdacoustic.reporting.pdf.fonts import plain, prepared


def read(text: str) -> ReadPdf:
    return ReadPdf(render_pdf(Document("Report", "", "measured", sections=[Section("one", "One", [Paragraph(text)])])))


@pytest.mark.parametrize(
    "text",
    ["Ω π µm/s² 10⁻⁶ √Hz ≥ ± − – — … × ° Δ ∞ ½", "Электровоз 2ЭС6 «Синара»", "株洲中车时代电气", "Škoda Łódź ß ø ñ"],
    ids=["signs", "Cyrillic", "Chinese", "Latin"],
)
def test_a_text_is_read_back_as_it_was_written(text: str) -> None:
    file = read(text)
    assert tight(text) in file.tight
    assert tight(text) in tight(file.pdfium_text())
    assert all(file.fonts().values())
    assert "[U+" not in file.tight


def test_chinese_is_drawn_and_not_only_said() -> None:
    """pdfium here has no font for Chinese: what it draws is in the file. A sign of many strokes has more ink."""
    blank, few, many = (read(text).ink(1, 150.0) for text in ("\u3000" * 40, "一" * 40, "噪" * 40))
    ink = [int((page < 128).sum()) for page in (blank, few, many)]
    assert ink[1] > ink[0] + 500 and ink[2] > ink[1] + 3000


def test_a_sign_that_no_font_has_is_named() -> None:
    file = read("a \U0001f600 b \u1e9f7 ᚠ \u202e \u200b \ue000")
    for code in ("[U+1F600]", "[U+202E]", "[U+200B]", "[U+E000]"):
        assert code in file.tight
    assert tight("A sign that no font of this file has is shown by its code") in file.tight


def test_without_the_font_for_chinese_the_text_stays_and_the_file_says_what_it_needs(monkeypatch) -> None:
    monkeypatch.setattr(fonts, "chinese_font", lambda: None)
    file = read("株洲 \U00020000 шум")
    assert "株洲[U+20000]шум" in tight(file.pdfium_text())
    assert file.fonts()["/STSong-Light"] is False
    assert tight("Chinese signs are shown by the program that opens this file") in file.tight
    assert "Chinese signs are shown" not in " ".join(read("шум").texts)


def test_the_texts_of_figures_are_in_those_fonts() -> None:
    bars = Bars(["工况一", "Режим 2"], [80.0, 82.0], "测量")
    figure = Figure(
        "f", "Title", "", Axis("工况"), Axis("Pegel", "dB"), [bars, Bars(["工况一", "Режим 2"], [1.0, 2.0], "b")]
    )
    file = ReadPdf(render_pdf(Document("R", "", "measured", sections=[Section("one", "One", [FigureBlock(figure)])])))
    for word in ("工况一", "Режим2", "测量", "Pegel"):
        assert word in file.tight
    assert all(file.fonts().values())


def test_what_steers_a_program_becomes_a_mark() -> None:
    assert plain("a\nb\u2028c\x1b[31m\x00") == "a b c\ufffd[31m\ufffd"
    assert plain("e\u0301") == "é"


def test_the_parts_of_a_text_are_all_of_it() -> None:
    held = prepared(["株洲 шум a"])
    parts = held.runs("株洲 шум a\U0001f600", bold=True)
    assert "".join(part for _, part in parts) == "株洲 шум a[U+1F600]"
    assert [font for font, _ in parts] == [held.chinese, fonts.BOLD]
    assert held.simple("plain µ") and not held.simple("株") and not held.simple("a\nb")


def test_what_pages_say_themselves_is_in_those_fonts_in_the_language_of_the_report() -> None:
    """Numbers of pages and of captions stand in no block: their signs are those of the translation alone."""
    said = {"page {page} of {pages}": "第{page}页，共{pages}页", "Table {number}.": "表{number}。", "Contents": "目录"}
    table = Table("t", "Caption", [Column("run", "Run")], [["a"]])
    document = Document("Report", "", "measured", sections=[Section("one", "One", [table])])
    with speaking(Language("zh", said)):
        file = ReadPdf(render_pdf(document))
    for words in ("第1页，共1页", "表1。", "目录"):
        assert words in file.tight
        assert words in tight(file.pdfium_text())
    assert "[U+" not in file.tight
    assert file.file.trailer["/Root"]["/Lang"] == "zh"
