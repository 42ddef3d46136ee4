"""One channel at a time: all views are in the page, in order, and found by whoever walks the document."""

import pytest
from report_figures import spectrum

from tdacoustic.reporting import Document, FigureBlock, Paragraph, ReportError, Section
from tdacoustic.reporting.document import Alternatives, walk
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.sections.folding import chosen


def views(*names):
    return [(name, [FigureBlock(spectrum(name, f"of {name}"), "measured")]) for name in names]


def page(*blocks):
    return render_html(Document("Report", "", "measured", sections=[Section("one", "One", blocks)]))


def test_every_view_is_in_the_page_with_its_name_and_its_figure():
    text = page(Alternatives("Channel", views("mic_1", "mic_2")))
    assert text.count('class="view"') == 2
    assert text.index('data-name="mic_1"') < text.index('id="fig-mic_1"') < text.index('data-name="mic_2"')
    assert text.index('data-name="mic_2"') < text.index('id="fig-mic_2"')
    assert '<p class="view-name">Channel: mic_2</p>' in text  # on paper, and where no scripts run
    assert "Figure 1." in text and "Figure 2." in text


def test_what_is_inside_is_walked_and_named_once():
    block = Alternatives("Channel", views("mic_1", "mic_2"))
    assert [one.figure.name for one in walk([block]) if isinstance(one, FigureBlock)] == ["mic_1", "mic_2"]
    with pytest.raises(ReportError, match="two of the document's figures are named mic_1"):
        page(block, *views("mic_1")[0][1])


@pytest.mark.parametrize("names", [(), ("mic_1", "mic_1")])
def test_views_need_names_of_their_own(names):
    with pytest.raises(ReportError, match="alternatives by 'Channel' need views with different names"):
        Alternatives("Channel", [(name, [Paragraph("x")]) for name in names])


def test_a_single_view_needs_no_choice():
    (name, blocks), *_ = views("mic_1")
    assert chosen("Channel", []) == []
    assert chosen("Channel", [(name, blocks)]) == blocks
    (both,) = chosen("Channel", views("mic_1", "mic_2"))
    assert isinstance(both, Alternatives)


def test_names_are_text():
    evil = '"><script>alert(1)</script>'
    text = page(Alternatives(evil, [(evil, [Paragraph("a")]), ("b", [Paragraph("b")])]))
    assert "<script>alert" not in text and "&lt;script&gt;alert(1)" in text
