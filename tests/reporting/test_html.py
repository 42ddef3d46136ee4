"""The page: one file, nothing from outside, nothing unescaped, the same every time."""

import base64
import gzip
import hashlib
import html.parser
import json
import re

import numpy as np
import pytest
from report_figures import EVIL, every_figure, spectrum

from tdacoustic.reporting import (
    Axis,
    Column,
    Details,
    Document,
    Facts,
    Figure,
    FigureBlock,
    Line,
    Notice,
    Paragraph,
    ReportError,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.document import ORIGINS, Shown
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.html_views import safe_json
from tdacoustic.reporting.page_limits import Held, PageLimits, left_out_words
from tdacoustic.tables.writing import csv_cell

COLUMNS = (
    Column("channel", "Channel"),
    Column("level_db", "Level", "dB re 20 uPa", digits=1, kind="number"),
    Column("origin", "Origin", kind="origin"),
    Column("verdict", "Check", kind="verdict"),
    Column("valid", "Valid"),
)


def table(name: str = "levels", word: str = "mic_1") -> Table:
    rows = [(word, -3.25, "measured", "ok", True), ("=cmd()", np.nan, "assumed", "bad", False)]
    return Table(name, f"Levels of {word}", COLUMNS, rows, origin="measured")


def document(word: str = "mic_1") -> Document:
    return Document(
        f"Report {word}",
        word,
        "synthetic",
        summary=[Paragraph(word), Sentences([word]), table(word=word)],
        notices=[Notice("synthetic", word), Notice("bad", word)],
        sections=[
            Section("one", word, [FigureBlock(figure, "calculated") for figure in every_figure()]),
            Section("two", "Two", [Section("inner", word, [FigureBlock(spectrum("evil", word), "assumed")])]),
            Section("three", "Three", [Facts([(word, word, "printed")]), Details(word, [table("folded", word)])]),
        ],
        facts=[("Program", word)],
        footer=[word],
    )


@pytest.fixture(scope="module")
def page() -> str:
    return render_html(document(EVIL))


class Elements(html.parser.HTMLParser):
    """Every element of a page, with its attributes."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def test_the_same_document_gives_the_same_bytes(page: str) -> None:
    assert page == render_html(document(EVIL))


def test_nothing_is_loaded_from_anywhere(page: str) -> None:
    for tag, attributes in Elements(page).found:
        assert tag not in ("link", "iframe", "object", "embed", "base", "form"), tag
        for key in ("src", "srcset", "action", "data", "poster"):
            value = attributes.get(key)
            assert value is None or value.startswith("data:image/png;base64,"), (tag, key)
        assert (attributes.get("href") or "#").startswith("#")
        assert not any(key.startswith("on") for key in attributes)
    own = re.sub(r'<script type="text/plain" id="plotly">[^<]*', "", page)
    assert "http://" not in own and "https://" not in own
    assert "url(" not in own and "@import" not in own


def test_only_the_two_named_scripts_may_run(page: str) -> None:
    policy = next(a["content"] for t, a in Elements(page).found if t == "meta" and a.get("http-equiv"))
    assert policy is not None and policy.startswith("default-src 'none'; script-src 'sha256-")
    packed = re.search(r'id="plotly">([^<]*)</script>', page)
    assert packed is not None
    plotly = gzip.decompress(base64.b64decode(packed[1]))
    assert plotly[:100].count(b"plotly.js")
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    assert len(scripts) == 1
    for source in (plotly, scripts[0].encode()):
        assert base64.b64encode(hashlib.sha256(source).digest()).decode() in policy
    assert "unsafe-inline" not in policy.split("script-src")[1].split(";")[0]


def test_names_from_files_stay_text(page: str) -> None:
    elements = Elements(page).found
    assert not any(tag == "img" and attributes.get("src") == "x" for tag, attributes in elements)
    assert "&lt;/script&gt;&lt;img" in page
    for text in re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page):
        assert not set("<>&\u2028\u2029") & set(text)
        json.loads(text)


def test_json_is_inert_and_strict() -> None:
    assert json.loads(safe_json(EVIL)) == EVIL
    assert not set("<>&\u2028") & set(safe_json(EVIL))
    with pytest.raises(ValueError, match="JSON"):
        safe_json(float("nan"))


@pytest.mark.parametrize(
    ("cell", "safe"),
    [
        ("=cmd()", "'=cmd()"),
        ("+1+1", "'+1+1"),
        ("@x", "'@x"),
        ("-x", "'-x"),
        ("\t=1", "'\t=1"),
        ("-3.2", "-3.2"),
        ("a=b", "a=b"),
    ],
)
def test_formulas_are_disarmed_in_downloads(cell: str, safe: str) -> None:
    assert csv_cell(cell) == safe


def test_cells_show_one_thing_and_download_another(page: str) -> None:
    assert 'data-v="&#39;=cmd()">=cmd()</th>' in page
    assert '<td class="right" data-v="-3.25">\u22123.2</td>' in page
    assert '<td class="right" data-v="">\u2013</td>' in page
    assert '<td data-v="true">yes</td>' in page
    assert '<td><span class="chip origin-measured">measured</span></td>' in page
    assert '<td><span class="chip verdict-bad">bad</span></td>' in page


def test_a_number_in_words_is_sorted_and_saved_as_the_number() -> None:
    columns = (Column("p", "P", kind="number"), Column("level_db", "Level", kind="number"))
    rows = [(Shown("> 0.99", 0.9973), Shown("\u2264 61.2", order=61.2)), (Shown("=cmd()", np.nan), None)]
    text = render_html(Document("R", "", "measured", summary=[Table("t", "T", columns, rows)]))
    assert '<td class="right" data-v="0.9973">&gt; 0.99</td>' in text
    assert '<td class="right" data-v="" data-s="61.2">\u2264 61.2</td>' in text  # a bound is no value
    assert '<td class="right" data-v="" data-t="&#39;=cmd()">=cmd()</td>' in text
    assert text.count("data-worded>") == 2
    with pytest.raises(ReportError, match="column 'a' of table 't' is not of numbers"):
        Table("t", "", [Column("a", "A")], [(Shown("> 0.99", 0.9973),)])


def test_structure_is_semantic_and_anchors_are_unique(page: str) -> None:
    elements = Elements(page).found
    ids = [attributes["id"] for _, attributes in elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = {a["href"][1:] for t, a in elements if t == "a" and a.get("href")}
    assert targets <= set(ids)
    assert ("html", {"lang": "en"}) in elements
    assert [tag for tag, _ in elements].count("h1") == 1
    assert all(attributes.get("scope") in ("col", "row") for tag, attributes in elements if tag == "th")
    assert all(attributes.get("alt") for tag, attributes in elements if tag == "img")
    labelled = [a["aria-labelledby"] for _, a in elements if a.get("aria-labelledby")]
    assert set(labelled) <= set(ids)


def test_later_figures_are_still_pictures_and_the_page_says_so() -> None:
    page = render_html(document(), PageLimits(interactive=2))
    assert page.count('<script type="application/json">{"data"') == 2
    assert "Of the 5 figures of this page the first 2 can be zoomed" in page
    assert page.count("A still picture") == 3
    pictures = render_html(document(), PageLimits(interactive=0))
    assert 'id="plotly"' not in pictures and len(pictures) < 600_000


def test_a_page_without_figures_has_no_plotly() -> None:
    page = render_html(Document("Report", "", "measured", sections=[Section("one", "One", [Paragraph("text")])]))
    assert len(page) < 60_000 and 'id="plotly"' not in page


def test_size_of_a_page_with_ten_long_spectra() -> None:
    blocks = [FigureBlock(spectrum(f"s{k}")) for k in range(10)]
    page = render_html(Document("Report", "", "measured", sections=[Section("one", "One", blocks)]))
    assert len(page.encode()) < 5_500_000  # 2 MB of plotly, 0.3 MB a figure of four long traces


@pytest.mark.parametrize("origin", ORIGINS)
def test_every_origin_is_said_in_words(origin: str) -> None:
    page = render_html(Document("Report", "", origin))
    assert f'<span class="chip origin-{origin}">{origin}</span>' in page


def test_wrong_documents_are_refused() -> None:
    line = Figure("f", "F", "", Axis("x"), Axis("y"), [Line([0], [0], "a")])
    with pytest.raises(ReportError, match="two of the document's figures are named f"):
        Document(
            "R", "", "measured", sections=[Section("a", "A", [FigureBlock(line), Details("d", [FigureBlock(line)])])]
        )
    with pytest.raises(ReportError, match="two of the document's sections are named summary"):
        Document("R", "", "measured", sections=[Section("summary", "A", [])])
    with pytest.raises(ReportError, match="origin of a document must be one of"):
        Document("R", "", "guessed")
    with pytest.raises(ReportError, match="row 0 of table 't' has 1 cells, expected 5"):
        Table("t", "", COLUMNS, [("a",)])
    with pytest.raises(ReportError, match="column 'level_db' of table 't' is of numbers, got '3'"):
        Table("t", "", COLUMNS, [("a", "3", "measured", "ok", True)])
    with pytest.raises(ReportError, match="row 0 of table 't' must be one of"):
        Table("t", "", COLUMNS, [("a", 3, "guess", "ok", True)])
    with pytest.raises(ReportError, match="kind of a notice"):
        Notice("shout", "text")


def test_a_page_that_holds_no_more_pictures_says_which_it_leaves_out():
    blocks = [FigureBlock(spectrum(f"figure-{n}", f"word {n}", 301), "measured") for n in range(40)]
    report = Document("Report", "", "measured", sections=[Section("one", "One", blocks)])
    whole = render_html(report)
    assert whole.count("data:image/png;base64,") == 40 and "left out" not in whole
    for most in (2_300_000, 2_700_000):
        page = render_html(report, PageLimits(page_bytes=most))
        assert 0.9 * most < len(page.encode()) <= most
        kept = page.count("data:image/png;base64,")
        zoomed = page.count('<script type="application/json">{"data"')
        assert 1 <= zoomed < kept < 40
        assert (
            f"Of the 40 figures of this report the first {zoomed} can be zoomed, the next {kept - zoomed} are still "
            f"pictures, and the last {40 - kept} are left out" in page
        )
        assert page.count("Left out: the page holds no more pictures") == 1
        for number in range(kept, 40):
            assert f'<span id="fig-figure-{number}">Figure {number + 1}. Spectrum word {number}.</span>' in page


def test_a_page_that_holds_no_more_rows_says_which_tables_it_cuts():
    columns = [Column("name", "Name"), Column("level_db", "Level", "dB", 1, "number")]
    rows = [(f"name {n}", 60.0 + n) for n in range(5000)]
    tables = [Table(f"t{n}", "Levels", columns, rows if n < 4 else rows[:5]) for n in range(5)]
    report = Document("Report", "", "measured", sections=[Section("one", "One", tables)])
    page = render_html(report, PageLimits(page_bytes=400_000, tables=0.5, one_table=0.2))
    assert len(page.encode()) <= 400_000
    kept = [part.count("<tr>") - 1 for part in page.split("<table>")[1:]]  # less the head
    assert 500 < kept[0] == kept[1] < 5000  # 0.2 of nearly 0.4 MB, at about 70 bytes a row
    assert kept[0] > kept[2] > kept[3] == 12 and kept[4] == 5
    for count in kept[:4]:
        assert f"The first {count} of 5000 rows: the page holds no more." in page
    assert "Of 4 long tables the first rows alone are shown" in page
    assert "long tables" not in render_html(report)


def test_tables_and_sounds_that_are_small_leave_their_room_to_the_figures():
    limits = PageLimits(page_bytes=10_000_000)
    first = limits.room(2_000_000)
    assert first.figures + first.tables + first.sounds <= 8_000_000
    again = limits.room(2_000_000, Held(table_bytes=100_000, left_out=3))
    assert again.figures == pytest.approx(first.figures + first.tables + first.sounds - 100_000, abs=2)
    assert again.zoomed < again.figures == limits.room(2_000_000, Held(table_bytes=100_000)).zoomed


def test_many_tables_of_few_rows_leave_the_page_below_its_limit():
    columns = [Column(f"c{n}", "Level", "dB", 1, "number") for n in range(10)]
    tables = [Table(f"t{n}", "Levels", columns, [[60.0] * 10] * 11) for n in range(300)]  # 1 MB of rows never cut
    figures = [FigureBlock(spectrum(f"figure-{n}", f"word {n}", 301), "measured") for n in range(40)]
    report = Document("Report", "", "measured", sections=[Section("one", "One", [*tables, *figures])])
    page = render_html(report, PageLimits(page_bytes=4_500_000))
    assert 4_200_000 < len(page.encode()) <= 4_500_000
    assert 0 < page.count("data:image/png;base64,") < 40


def test_what_a_page_lacks_is_said():
    assert left_out_words(Held(zoomed=3)) == ""
    assert not Held(zoomed=3, still=2).lacks  # pictures are all there
    assert left_out_words(Held(silent=1)) == "One sound is left out: the page holds no more."
    assert left_out_words(Held(silent=2)) == "2 sounds are left out: the page holds no more."


def test_a_page_can_be_sent():
    """Below what the mail of most takes, 20 MB as sent: four thirds of the file's size."""
    assert PageLimits().page_bytes * 4 / 3 <= 20_000_000


def test_notices_of_a_kind_that_follow_each_other_share_a_box():
    said = [Notice("warning", "one"), Notice("warning", "two <b>"), Notice("info", "three"), Notice("warning", "four")]
    page = render_html(Document("Report", "", "measured", sections=[Section("one", "One", said)]))
    boxes = re.findall(r'<div class="notice notice-(\w+)".*?</span>(.*?)</div>', page, re.S)
    assert boxes == [
        ("warning", "<ul><li>one</li><li>two &lt;b&gt;</li></ul>"),
        ("info", "<p>three</p>"),
        ("warning", "<p>four</p>"),
    ]
