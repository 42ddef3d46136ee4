"""Right-to-left writing on paper, against the Unicode Standard's own examples and forms."""

import unicodedata

import pytest
from read_pdf import ReadPdf

from tdacoustic.reporting import Document, Paragraph, Section
from tdacoustic.reporting.pdf import render_pdf
from tdacoustic.reporting.pdf.bidi import is_right_to_left, visual


@pytest.mark.parametrize(
    ("read", "seen"),
    [
        ("run אבג next", "run גבא next"),
        ("אבג דה", "הד גבא"),  # words in the order of the other direction
        ("אבג 123 דה", "הד 123 גבא"),  # a number keeps its digits (L2)
        ("אבג 1,234.5 דה", "הד 1,234.5 גבא"),  # one separator between digits belongs to the number (W4)
        ("אבג 5% דה", "הד 5% גבא"),  # and so does its sign (W5)
        ("mic 12 אבג", "mic 12 גבא"),  # a number after Latin is Latin (W7)
        ("x (אבג) y", "x (גבא) y"),
        ("אב (גד)", "(דג) בא"),  # brackets turn and stay a pair (N0)
        ("אב, x", "בא, x"),
        ("only Latin, 株洲, шум", "only Latin, 株洲, шум"),
        ("ב\u05bcא", "אב\u05bc"),  # a mark follows its letter (L3)
    ],
)
def test_the_order_is_that_of_the_unicode_algorithm(read: str, seen: str) -> None:
    """UAX #9, worked by hand for each of the rules that are named."""
    assert visual(read) == seen


@pytest.mark.parametrize(
    ("read", "forms"),
    [
        ("\u0628\u0628\u0628", "\ufe91\ufe92\ufe90"),  # beh: initial, medial, final
        ("\u0628", "\ufe8f"),  # alone
        ("\u062f\u0628", "\ufea9\ufe8f"),  # dal does not reach out to the next
        ("\u0644\u0627", "\ufefb"),  # lam with alef is one sign
        ("\u0628\u0644\u0627", "\ufe91\ufefc"),
        ("\u0628\u0621\u0628", "\ufe8f\ufe80\ufe8f"),  # hamza joins neither
        ("\u0628\u064e\u0628", "\ufe91\u064e\ufe90"),  # a mark does not part what joins
    ],
)
def test_arabic_letters_have_the_form_of_their_place(read: str, forms: str) -> None:
    """Arabic Presentation Forms-B of the Unicode Standard; turned back here to the order of reading."""
    letters = visual(read)
    marks = "\u064e"
    clusters = [""]
    for sign in letters:
        clusters = [*clusters[:-1], clusters[-1] + sign] if sign in marks else [*clusters, sign]
    assert "".join(reversed(clusters)) == forms


def test_what_has_no_such_sign_is_left_alone() -> None:
    assert not is_right_to_left("株洲 шум Ω 12 \U0001f600")
    assert visual("e\u0301 (x) ]") == "e\u0301 (x) ]"


def test_a_program_that_reads_the_file_finds_the_text_as_it_is_read() -> None:
    """pdfium undoes the order of the letters; the forms are letters again once they are taken apart."""
    blocks = [Paragraph("Run שלום עולם ends"), Paragraph("Run قاطرة ends")]
    file = ReadPdf(render_pdf(Document("Report", "", "measured", sections=[Section("one", "One", blocks)])))
    held = unicodedata.normalize("NFKC", file.pdfium_text())
    assert all(word in held for word in ("שלום", "עולם", "قاطرة"))
    assert "[U+" not in file.tight
