"""The PDF as other programs read it: everything the document says, where the contents say it is, on numbered pages."""

import dataclasses
import html
import re
from typing import get_args

import pytest
from read_pdf import ReadPdf, tight
from report_figures import EVIL, every_figure, heatmap, spectrum

from tdacoustic.errors import MissingPackageError
from tdacoustic.reporting import (
    Column,
    Details,
    Document,
    Facts,
    FigureBlock,
    Link,
    Notice,
    Paragraph,
    ReportError,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.document import ORIGINS, Alternatives, Block, House, Sound, SoundTrack
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.pdf import render_pdf

HOSTILE = f"<b>{EVIL}\u202e \"quoted\" 'q' &amp; 中车株洲 Ёлка-шум µ ² − Ω {'long' * 60}\x07"
"""A name with markup, quotes, Chinese, Cyrillic, signs of the trade, a word wider than the page, and a bell."""


def table(name: str, word: str) -> Table:
    columns = (
        Column("channel", "Channel"),
        Column("level_db", "Level", "dB re 20 µPa", digits=1, kind="number"),
        Column("origin", "Origin", kind="origin"),
        Column("verdict", "Check", kind="verdict"),
        Column("valid", "Valid"),
        Column("report", "Report"),
    )
    rows = [
        (word, -3.25, "measured", "ok", True, Link(word, "../a%20b/report.html")),
        ("=cmd()", None, "assumed", "bad", False, None),
    ]
    return Table(name, f"Levels of {word}", columns, rows, origin="measured")


def report(word: str) -> Document:
    """Every kind of block, every origin, every element of a figure."""
    sound = Sound(
        "ride", f"Ride {word}", f"Caption {word}", [SoundTrack("As recorded", b"-", "82 dB")], None, "measured"
    )
    views = [(f"first {word}", [Paragraph(word)]), ("second", [FigureBlock(heatmap("other"), "printed")])]
    return Document(
        f"Report {word}",
        f"Subtitle {word}",
        "synthetic",
        summary=[Paragraph(word), Sentences([word, "second item"]), table("first", word)],
        notices=[Notice("synthetic", word), Notice("bad", "a problem"), Notice("assumed", "an assumption")],
        sections=[
            Section("one", f"One {word}", [FigureBlock(figure, "calculated") for figure in every_figure()]),
            Section(
                "two", "Two", [Section("inner", f"Inner {word}", [FigureBlock(spectrum("evil", word), "assumed")])]
            ),
            Section("three", "Three", [Facts([(f"key {word}", word, o) for o in ORIGINS]), Details(word, [sound])]),
            Section("four", "Four", [Alternatives("Channel", views), Section("deep", "Deep", [table("second", word)])]),
        ],
        facts=[("Program", word)],
        footer=[f"footer {word}"],
        lineage={"one": "four", "inner": "deep"},
        house=House(f"Company {word}", ["Department"]),
    )


@pytest.fixture(scope="module")
def read() -> ReadPdf:
    return ReadPdf(render_pdf(report(HOSTILE)))


@pytest.fixture(scope="module")
def page() -> str:
    return render_html(report(HOSTILE))


def shown(text: str) -> str:
    """A text as the PDF must show it, without spaces: a bell as a mark, a turn of the direction as its code."""
    return tight(text.replace("\x07", "\ufffd").replace("\u202e", "[U+202E]").replace("\u2028", " "))


def test_pages_are_numbered_and_say_whose_report_it_is_and_of_what_data(read: ReadPdf) -> None:
    n = len(read.texts)
    assert n > 4
    for number, text in enumerate(read.texts, start=1):
        assert f"page {number} of {n}" in text
        assert tight(text).startswith(tight("Report <b></script><img src=x"))
        assert "data: synthetic" in text


def test_every_text_of_the_document_is_in_the_pages(read: ReadPdf) -> None:
    def texts(value):
        if isinstance(value, str):
            yield value
        elif dataclasses.is_dataclass(value):
            skipped = {"id", "name", "origin", "kind", "align", "csv", "key", "lineage", "texts", "href", "scale"}
            skipped -= {"key"} if type(value).__name__ == "Fact" else set()
            if type(value).__name__ == "Figure":
                yield from (value.title, value.caption)
                return
            for field in dataclasses.fields(value):
                if field.name not in skipped:
                    yield from texts(getattr(value, field.name))
        elif isinstance(value, tuple | list):
            for item in value:
                yield from texts(item)

    found = list(texts(report(HOSTILE)))
    assert len(found) > 60
    for text in found:
        assert shown(text).rstrip(".") in read.tight, text


def test_headings_and_captions_are_those_of_the_page(read: ReadPdf, page: str) -> None:
    """Numbers and titles of the HTML page, which has its own template."""
    heads = re.findall(r'<h[2-6] id="h-[^"]*">(.*?) <a class="anchor"', page, re.S)
    captions = [
        *re.findall(r'<figcaption id="cap-tab-[^"]*">(.*?)(?: <a class="behind|\n)', page, re.S),
        *re.findall(r'id="cap-fig-[^"]*">(.*?)(?: <a class="behind|\n|</div>)', page, re.S),
    ]
    assert len(heads) == 7 and len(captions) == 2 + 6
    for marked in (*heads, *captions):
        chips = re.sub(r'<span class="chip[^>]*>(\w+)</span>', r"[\1]", marked)
        assert shown(html.unescape(re.sub(r"</?span[^>]*>", "", chips))) in read.tight, marked


def test_contents_and_bookmarks_lead_to_where_the_headings_are(read: ReadPdf) -> None:
    titles = ["Summary", "1 One", "2 Two", "2.1 Inner", "3 Three", "4 Four", "4.1 Deep"]
    assert [depth for depth, _, _ in read.outline] == [0, 0, 0, 1, 0, 0, 1]
    contents = next(number for number, text in enumerate(read.texts, start=1) if "Contents" in text)
    printed = shown("".join(read.texts[contents - 1 : contents + 1]))
    for (_, title, page), wanted in zip(read.outline, titles, strict=True):
        assert tight(title).startswith(tight(wanted))
        assert shown(title)[:60] in shown(read.texts[page - 1]), title
        assert f"{shown(title)}{page}" in printed, title
        assert (contents, page) in read.links or (contents + 1, page) in read.links


def test_links_lead_to_pages_and_to_files_beside(read: ReadPdf) -> None:
    assert {target for _, target in read.links if isinstance(target, str)} == {"../a%20b/report.html"}
    assert len(read.links) >= 2 * 7 + 5


def test_captions_say_how_it_came_about_and_lead_there(read: ReadPdf) -> None:
    pages = {title.replace("\u2002", " ")[:6]: page for _, title, page in read.outline}
    four, deep = pages["4 Four"], pages["4.1 De"]
    behind = [target for number, target in read.links if pages["1 One "] <= number <= pages["3 Thre"]]
    assert behind == [four] * 4 + [deep]
    assert read.tight.count(tight("How it came about: 4")) == 5


def test_a_sound_is_in_the_page_and_the_paper_says_so(read: ReadPdf) -> None:
    assert tight("To be heard in the HTML page: As recorded: 82 dB.") in read.tight


def test_fonts_are_in_the_file(read: ReadPdf) -> None:
    fonts = read.fonts()
    assert len(fonts) == 3, fonts  # regular, bold, Chinese
    assert all(fonts.values()), fonts


def test_chinese_and_cyrillic_are_text_for_another_program_too(read: ReadPdf) -> None:
    text = tight(read.pdfium_text())
    for word in ("中车株洲", "Ёлка-шум", "µ²−Ω", "[U+202E]"):
        assert text.count(word) > 15, word


def test_nothing_is_drawn_beyond_the_margins(read: ReadPdf) -> None:
    """Words that are wider than the page, tables, figures: all is between the margins of 13.5 mm."""
    for number in range(1, len(read.texts) + 1):
        ink = read.ink(number)
        side = 36
        assert ink[:, :side].min() > 200 and ink[:, -side:].min() > 200, number
        assert ink.min() < 120


def test_the_same_document_gives_the_same_bytes_and_no_date(read: ReadPdf) -> None:
    assert render_pdf(report(HOSTILE)) == read.raw
    said = read.file.metadata
    assert said is not None
    assert tight(str(said["/Title"])) == shown(f"Report {HOSTILE}").replace("[U+202E]", "\u202e")
    assert str(said["/Subject"]).startswith("Subtitle")
    assert not {"/CreationDate", "/ModDate"} & set(said)
    assert b"D:20" not in read.raw


def test_every_kind_of_block_has_its_place() -> None:
    """A kind that is added to the documents and not to the PDF fails here."""
    from tdacoustic.reporting.pdf.fonts import Fonts
    from tdacoustic.reporting.pdf.story import Story

    assert set(Story(Fonts(), (500.0, 700.0), {}, {})._add) == set(get_args(Block))


def test_an_unknown_block_is_refused_and_not_left_out() -> None:
    with pytest.raises(ReportError, match="no way to show a block of kind 'dict'"):
        render_pdf(Document("Report", "", "measured", sections=[Section("one", "One", [{}])]))  # type: ignore[list-item]


def test_without_the_package_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tdacoustic.reporting.pdf.find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=r"pip install 'tdacoustic\[pdf\]'"):
        render_pdf(Document("Report", "", "measured"))


def test_a_document_of_a_title_alone_is_a_page() -> None:
    read = ReadPdf(render_pdf(Document("Report", "", "mixed")))
    assert len(read.texts) == 1 and "page 1 of 1" in read.texts[0]
    assert "Each number says its own" in read.texts[0]
