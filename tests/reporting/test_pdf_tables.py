"""Tables on paper: nothing cut off, the header on every page, and what is left out is said."""

import pytest
from read_pdf import ReadPdf, tight

from tdacoustic.reporting import Column, Document, Facts, Paragraph, Section, Table
from tdacoustic.reporting.document import Shown
from tdacoustic.reporting.pdf import render_pdf

A4 = (595, 842)


def read_table(table: Table, *more: object) -> ReadPdf:
    blocks = [Paragraph("before"), table, *more, Paragraph("after")]
    return ReadPdf(render_pdf(Document("Report", "", "measured", sections=[Section("one", "One", blocks)])))  # type: ignore[arg-type]


def numbers(n_columns: int, n_rows: int, digits: int = 2) -> Table:
    columns = [Column("name", "Name")]
    columns += [Column(f"c{i}", f"Quantity-{i:02d}", "dB", digits=digits, kind="number") for i in range(n_columns)]
    rows = [[f"row-{r:04d}", *(1000.0 * r + i for i in range(n_columns))] for r in range(n_rows)]
    return Table("wide", "Wide", columns, rows)


def sizes(read: ReadPdf) -> list[tuple[int, int]]:
    return [(round(page.mediabox.width), round(page.mediabox.height)) for page in read.file.pages]


def assert_within_margins(read: ReadPdf) -> None:
    for number in range(1, len(read.texts) + 1):
        ink = read.ink(number)
        assert ink[:, :36].min() > 200 and ink[:, -36:].min() > 200 and ink[-22:].min() > 200, number


@pytest.mark.parametrize(
    ("n_columns", "across"), [(5, False), (8, False), (13, True), (40, True)], ids=["narrow", "full", "across", "parts"]
)
def test_every_cell_is_printed_however_many_columns(n_columns: int, across: bool) -> None:
    table = numbers(n_columns, 6)
    read = read_table(table)
    assert ((A4[1], A4[0]) in sizes(read)) == across
    assert_within_margins(read)
    for row in range(6):
        for column in range(n_columns):
            assert f"{1000.0 * row + column:.2f}" in read.tight
    for column in range(n_columns):
        assert f"Quantity-{column:02d}" in read.tight
    assert tight("before") in read.tight and tight("after") in read.tight
    assert sizes(read)[-1] == A4


def test_each_part_of_a_wide_table_begins_with_its_first_column() -> None:
    read = read_table(numbers(40, 3))
    parts = read.tight.count("Columns")
    assert parts >= 2
    assert read.tight.count("row-0002") == parts
    assert "Columns2to" in read.tight and "to41of41." in read.tight


def test_a_long_table_has_its_header_on_each_page_and_says_what_is_left_out() -> None:
    read = read_table(numbers(3, 500))
    held = [text for text in read.texts if "row-" in text]
    assert len(held) >= 2
    assert all("Quantity-01" in text for text in held)
    assert "row-0119" in read.tight and "row-0120" not in read.tight
    assert tight("The first 120 of 500 rows; the HTML page has all and saves them as table-wide.csv.") in read.tight


def test_rows_that_are_all_printed_are_not_called_shortened() -> None:
    assert "The first" not in " ".join(read_table(numbers(3, 120)).texts)


def test_a_table_without_rows_says_so() -> None:
    assert "No rows." in " ".join(read_table(numbers(3, 0)).texts)


def test_a_caption_stands_on_the_page_of_its_table() -> None:
    """However much stands before: the caption is never the last line of a page."""
    for lines in range(26, 42):
        blocks = [Paragraph("text")] * lines + [numbers(3, 30)]
        read = ReadPdf(render_pdf(Document("Report", "", "measured", sections=[Section("one", "One", blocks)])))
        page = next(text for text in read.texts if "Table 1." in text)
        assert "row-0000" in page and "row-0002" in page, lines


def test_what_is_broken_within_a_row_goes_on_at_the_same_place() -> None:
    read = read_table(numbers(1, 1), Facts([("key", "word " * 3000)]))
    begins = [int((read.ink(page)[400:760] < 128).any(axis=0).argmax()) for page in (1, 2, 3)]
    assert begins[0] == begins[1] == begins[2]
    assert 38 + 15 < begins[0] < 38 + 35  # beside its key, which is at the margin


def test_columns_share_the_page_by_what_they_hold_on_average() -> None:
    """One long text among many short ones does not squeeze the other columns; no word of theirs is broken."""
    columns = [Column(name, name.capitalize()) for name in ("one", "two", "three")]
    rows = [["what is said in a few words", "and here in some more words", "short"] for _ in range(40)]
    rows[7][2] = "a very long remark " * 30
    text = "\n".join(read_table(Table("shared", "Shared", columns, rows)).texts)
    assert text.count("what is said in a few words") == 40 and text.count("and here in some more words") == 40


def test_a_heading_stands_on_the_page_of_what_it_heads() -> None:
    for lines in range(26, 42):
        blocks = [*[Paragraph("text")] * lines, Section("in", "Inner title", [Paragraph("tail")])]
        read = ReadPdf(render_pdf(Document("Report", "", "measured", sections=[Section("one", "One", blocks)])))
        page = read.outline[-1][2]
        assert "tail" in read.texts[page - 1], lines


@pytest.mark.parametrize("text", ["word " * 3000, "x" * 3000, "中车" * 1500], ids=["words", "one word", "Chinese"])
def test_a_cell_that_is_longer_than_a_page_is_shortened_and_says_by_how_much(text: str) -> None:
    columns = (Column("a", "A"), Column("b", "B" * 100), *(Column(f"c{i}", f"C {i}") for i in range(6)))
    read = read_table(Table("long", "Long", columns, [(text, "b", *"cdefgh"), ("next", "b", *"cdefgh")]))
    assert tight(f"({len(text) - 600} more signs)") in read.tight and "next" in read.tight
    assert_within_margins(read)


def test_what_is_left_out_is_said_before_the_table() -> None:
    """After it, it could stand alone on a page."""
    read = read_table(numbers(3, 500))
    assert "The first" in read.texts[0] and "The first" not in "".join(read.texts[1:])


def test_a_unit_keeps_the_number_of_its_reference() -> None:
    columns = [Column(f"c{number}", "Level", "dB re 20 \u00b5Pa", digits=1, kind="number") for number in range(12)]
    text = read_table(Table("levels", "Levels", columns, [[60.0] * 12])).pdfium_text()
    assert text.replace("\u00a0", " ").count("20 \u00b5Pa") == 12


def test_a_number_in_words_is_printed_in_words() -> None:
    columns = [Column("p", "P", digits=1, kind="number"), Column("level_db", "Level", "dB", digits=1, kind="number")]
    text = read_table(Table("t", "T", columns, [[Shown("> 0.99", 0.9973), Shown("at most 61.2", order=61.2)]])).tight
    assert tight("> 0.99") in text and tight("at most 61.2") in text and "1.0" not in text


def test_long_names_do_not_turn_the_page() -> None:
    """The columns of numbers fit upright; names without a space are broken rather than set on a page across."""
    columns = [Column("run", "Run"), Column("mic", "Microphone"), *numbers(5, 1).columns]
    name = "Getriebegehaeuse" * 4
    read = read_table(Table("named", "Named", columns, [[name, name, "row", *[1.0] * 5]]))
    assert sizes(read) == [(595, 842)]
    assert read.tight.count(name) == 2
    assert_within_margins(read)
