"""The page in a real browser: zoom, read-out, choice of channel, sorting, dark, narrow, keyboard, nothing from outside.

Needs the package playwright (extra ``verification``) and a Chromium: its own (``playwright install chromium``) or that
of the system, which ``CHROMIUM`` may name.
"""

import csv
import io
import os
import re
import shutil
import struct
from contextlib import contextmanager

import numpy as np
import pytest
from report_figures import EVIL, heatmap, spectrum

from tdacoustic.reporting import (
    Axis,
    Column,
    Details,
    Document,
    Facts,
    Figure,
    FigureBlock,
    Heatmap,
    Line,
    Notice,
    Paragraph,
    Section,
    Table,
)
from tdacoustic.reporting.document import Alternatives, House, Shown
from tdacoustic.reporting.html import render_html

SYSTEM = ("chromium", "chromium-browser", "google-chrome")
LEVELS = [71.5, 9.25, None, 104.0, -3.0, 71.25]

CHANNELS = 11
PROBABILITIES = [
    Shown("> 0.99", 0.9973),
    Shown("0.98", 0.98),
    Shown("refused"),
    Shown("0.85 to 0.93", 0.89),
    None,
    Shown("\u2264 0.95", order=0.95),
    Shown("< 0.01", 0.004),
]


def channels():
    """Lines of as many channels as a usual campaign has, each a constant level: 60 dB, 61 dB and so on."""
    x = np.linspace(20.0, 2000.0, 500)
    lines = [Line(x, np.full(x.size, 60.0 + n), f"channel_{n}") for n in range(CHANNELS)]
    return Figure("channels", "Channels", "", Axis("Frequency", "Hz"), Axis("Level", "dB", reference="20 uPa"), lines)


def order_map():
    """A map of 40 dB everywhere, with an order's line across it."""
    x, y = np.linspace(0.0, 60.0, 90), np.linspace(0.0, 3000.0, 60)
    heat = Heatmap(x, y, np.full((60, 90), 40.0), "mic_1", Axis("Level", "dB", limits=(20.0, 60.0)))
    order = Line(x, np.full(x.size, 1500.0), "mesh x1")
    return Figure("orders", "Orders", "", Axis("Time", "s"), Axis("Frequency", "Hz"), (heat, order))


def wide_table(name, n_columns):
    columns = [Column(f"c{n}", f"Column {n}", "dB", 1, "number") for n in range(n_columns)]
    return Table(name, "Of many columns", columns, [[61.5 + n for n in range(n_columns)]] * 3)


def document():
    rows = [(f"mic_{n}", level, "measured") for n, level in enumerate(LEVELS)]
    columns = (
        Column("channel", "Channel"),
        Column("level_db", "Level", "dB re 20 µPa", digits=1, kind="number"),
        Column("origin", "Origin", kind="origin"),
    )
    views = [(name, [FigureBlock(heatmap(f"map-{n}", 60, 90))]) for n, name in enumerate(("left", "right <b>"))]
    return Document(
        "Type test",
        "a page",
        "measured",
        summary=[Paragraph("The gearbox dominates.")],
        notices=[Notice("synthetic", "Made by a program.")],
        facts=[(f"Fact {n}", "something that is known of it") for n in range(8)],
        sections=[
            Section("one", "One", [FigureBlock(spectrum("spectrum-1", EVIL), "measured")]),
            Section("maps", "Maps", [Alternatives("Channel", views)]),
            Section("tables", "Tables", [Table("levels", "Levels", columns, rows), _worded()]),
            Section("hover", "Hover", [FigureBlock(channels()), FigureBlock(order_map())]),
            Section("twelve", "Twelve", [wide_table("of-twelve", 12)]),
            Section("fifteen", "Fifteen", [wide_table("of-fifteen", 15)]),
            Section("provenance", "How", [Details("Folded", [Section("deep", "Deep", [Paragraph("here")])])]),
        ],
        lineage={"one": "deep"},
    )


def _worded():
    columns = (Column("line", "Line"), Column("p", "P", kind="number"))
    return Table("worded", "Probabilities", columns, [(f"line {n}", shown) for n, shown in enumerate(PROBABILITIES)])


@pytest.fixture(scope="module")
def chromium():
    playwright = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    named = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, SYSTEM)), None)
    with playwright.sync_playwright() as driver:
        try:
            browser = driver.chromium.launch(executable_path=named, args=["--no-sandbox", "--disable-gpu"])
        except playwright.Error as error:
            pytest.skip(f"no Chromium can be started: {str(error).splitlines()[0]}")
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(render_html(document()), encoding="utf-8", newline="\n")
    return path.as_uri()


@contextmanager
def opened(chromium, address, **how):
    """The page, which in the end has said nothing on its console and asked nobody for anything."""
    context = chromium.new_context(**({"viewport": {"width": 1280, "height": 900}, "accept_downloads": True} | how))
    page = context.new_page()
    said, asked = [], []
    page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    try:
        yield page
        assert said == []
        assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [address]
    finally:
        context.close()


def drawn(page, name):
    """A figure once it is alive."""
    figure = page.locator(f"#fig-{name}")
    figure.scroll_into_view_if_needed()
    page.wait_for_selector(f"#fig-{name}.live .main-svg")
    page.wait_for_timeout(300)
    return figure


def x_range(page, name):
    return page.evaluate(f"[...document.querySelector('#fig-{name} .live-plot')._fullLayout.xaxis.range]")


def plot_area(figure):
    return figure.locator(".nsewdrag").first.bounding_box()


def test_a_figure_zooms_and_goes_back(chromium, address):
    with opened(chromium, address) as page:
        figure = drawn(page, "spectrum-1")
        before = x_range(page, "spectrum-1")
        box = plot_area(figure)
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"])
        page.mouse.down()
        page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 0.8 * box["height"], steps=5)
        page.mouse.up()
        page.wait_for_timeout(400)
        after = x_range(page, "spectrum-1")
        assert after[0] == pytest.approx(np.mean(before), abs=0.02 * np.ptp(before))
        assert np.ptp(after) == pytest.approx(0.25 * np.ptp(before), rel=0.05)
        figure.get_by_role("button", name="Reset view").click()
        page.wait_for_timeout(400)
        assert x_range(page, "spectrum-1") == pytest.approx(before)


def test_the_value_under_the_cursor_is_read_out(chromium, address):
    with opened(chromium, address) as page:
        box = plot_area(drawn(page, "spectrum-1"))
        page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 0.8 * box["height"], steps=3)
        page.wait_for_selector("#fig-spectrum-1 .hoverlayer text")
        page.wait_for_timeout(300)  # the pointer passed other places
        said = page.locator("#fig-spectrum-1 .hoverlayer").text_content()
        low, high = x_range(page, "spectrum-1")
        number = re.search(r"\d[\d.,\u202f ]*", said)
        assert number is not None, said
        frequency = 10 ** (low + 0.62 * (high - low))
        shown = [float(one.replace("\u202f", "").replace(",", "")) for one in re.findall(r"\d[\d,\u202f]*\.?\d*", said)]
        assert any(abs(value - frequency) < 0.02 * frequency for value in shown), (said, frequency)


def test_the_channel_is_chosen_with_mouse_and_keyboard(chromium, address):
    with opened(chromium, address) as page:
        chooser = page.locator("#chooser-1")
        assert page.locator("#fig-map-0").is_visible() and not page.locator("#fig-map-1").is_visible()
        assert chooser.locator("option").all_text_contents() == ["left", "right <b>"]
        chooser.select_option(label="right <b>")
        assert page.locator("#fig-map-1").is_visible() and not page.locator("#fig-map-0").is_visible()
        drawn(page, "map-1")
        chooser.focus()
        page.keyboard.press("ArrowUp")
        assert page.locator("#fig-map-0").is_visible()


def test_all_channels_are_on_paper(chromium, address):
    with opened(chromium, address) as page:
        page.emulate_media(media="print")
        assert page.locator("#fig-map-0 img").is_visible() and page.locator("#fig-map-1 img").is_visible()
        assert not page.locator("#chooser-1").is_visible()


def column(page, number, table="levels"):
    return page.eval_on_selector_all(
        f"#tab-{table} tbody tr", f"rows => rows.map(row => row.cells[{number}].textContent.trim())"
    )


def test_a_table_sorts_by_numbers_with_the_missing_ones_last(chromium, address):
    with opened(chromium, address) as page:
        head = page.locator("#tab-levels").get_by_role("button", name="Level")
        known = sorted(value for value in LEVELS if value is not None)
        head.click()
        assert column(page, 1) == [f"{value:.1f}".replace("-", "\N{MINUS SIGN}") for value in known] + ["–"]
        assert page.locator("#tab-levels th[aria-sort]").get_attribute("aria-sort") == "ascending"
        head.focus()
        page.keyboard.press("Enter")
        assert column(page, 1)[0] == "104.0" and column(page, 1)[-1] == "–"
        page.keyboard.press("Enter")
        assert column(page, 0) == [f"mic_{n}" for n in range(len(LEVELS))]


def test_numbers_in_words_are_sorted_by_the_number_and_those_without_come_last(chromium, address):
    up = ["< 0.01", "0.85 to 0.93", "\u2264 0.95", "0.98", "> 0.99"]
    with opened(chromium, address) as page:
        head = page.locator("#tab-worded thead button").nth(1)
        head.click()
        assert column(page, 1, "worded") == [*up, "refused", "\u2013"]
        head.click()
        assert column(page, 1, "worded") == [*up[::-1], "refused", "\u2013"]


def test_numbers_in_words_are_saved_as_numbers_and_words(chromium, address, tmp_path):
    with opened(chromium, address) as page:
        with page.expect_download() as waited:
            page.locator("#tab-worded").get_by_role("button", name="Download CSV").click()
        waited.value.save_as(tmp_path / "worded.csv")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "worded.csv").read_text(encoding="utf-8"))))
    assert [row["p"] for row in rows] == ["0.9973", "0.98", "", "0.89", "", "", "0.004"]  # a bound is no value
    assert [row["p_text"] for row in rows] == [shown.text if shown else "\u2013" for shown in PROBABILITIES]


def test_a_live_figure_has_the_words_of_its_picture(chromium, address):
    with opened(chromium, address) as page:
        drawn(page, "channels")
        words = page.locator("#fig-channels img").get_attribute("alt")
        assert words
        assert page.get_by_role("img", name=words, exact=True).count() == 1
        assert page.locator("#fig-channels .live-plot").get_attribute("aria-description")


def test_a_figure_is_zoomed_and_moved_by_keys(chromium, address):
    with opened(chromium, address) as page:
        drawn(page, "channels")
        page.locator("#fig-channels .live-plot").focus()
        low, high = x_range(page, "channels")

        def after(key):
            page.keyboard.press(key)
            page.wait_for_timeout(300)
            return x_range(page, "channels")

        assert after("-") == pytest.approx([low, high])  # the whole is shown already
        near = after("+")
        assert np.mean(near) == pytest.approx((low + high) / 2) and 0.5 < np.ptp(near) / (high - low) < 0.95
        moved = after("ArrowRight")
        assert np.ptp(moved) == pytest.approx(np.ptp(near)) and low < near[0] < moved[0] < moved[1] <= high
        assert after("Escape") == pytest.approx([low, high])
        after("+")
        assert after("0") == pytest.approx([low, high])
        page.keyboard.press("Tab")
        page.keyboard.press("Shift+Tab")  # a ring is asked for when keys have brought the reader here
        outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
        assert page.evaluate("document.activeElement.className").startswith("live-plot") and outline == "solid"
        assert page.locator("footer .keys").is_visible()


def hovered(page, name, over, down):
    box = plot_area(drawn(page, name))
    page.mouse.move(box["x"] + over * box["width"], box["y"] + down * box["height"], steps=3)
    page.wait_for_selector(f"#fig-{name} .hoverlayer text")
    page.wait_for_timeout(300)
    return page.locator(f"#fig-{name} .hoverlayer").text_content()


def test_all_channels_are_read_out_wherever_the_pointer_is(chromium, address):
    with opened(chromium, address) as page:
        said = hovered(page, "channels", 0.3, 0.97)
        for n in range(CHANNELS):
            assert f"channel_{n}: {60 + n} dB" in said
        figure, box = (
            page.locator(where).bounding_box() for where in ("#fig-channels .plot", "#fig-channels .hoverlayer .legend")
        )
        assert box["y"] >= figure["y"] - 1 and box["y"] + box["height"] <= figure["y"] + figure["height"] + 1


def test_a_line_on_a_map_does_not_hide_its_level(chromium, address):
    with opened(chromium, address) as page:
        said = hovered(page, "orders", 0.5, 0.5)
        assert "Level: 40 dB" in said and "mesh x1" not in said


def test_a_table_and_a_figure_are_saved(chromium, address, tmp_path):
    with opened(chromium, address) as page:
        with page.expect_download() as waited:
            page.locator("#tab-levels").get_by_role("button", name="Download CSV").click()
        waited.value.save_as(tmp_path / "levels.csv")
        rows = list(csv.DictReader(io.StringIO((tmp_path / "levels.csv").read_text(encoding="utf-8"))))
        assert [float(row["level_db"]) if row["level_db"] else None for row in rows] == LEVELS
        figure = drawn(page, "spectrum-1")
        with page.expect_download() as waited:
            figure.get_by_role("button", name="Download PNG").click()
        waited.value.save_as(tmp_path / "figure.png")
        content = (tmp_path / "figure.png").read_bytes()
        assert content.startswith(b"\x89PNG")
        width, height = struct.unpack(">II", content[16:24])
        assert width > 1500 and height > 600


def test_the_title_of_a_saved_figure_stands_above_a_legend_of_two_rows(chromium, address, tmp_path):
    image = pytest.importorskip("PIL.Image")
    with opened(chromium, address) as page:
        figure = drawn(page, "channels")
        with page.expect_download() as waited:
            figure.get_by_role("button", name="Download PNG").click()
        waited.value.save_as(tmp_path / "figure.png")
    ink = np.asarray(image.open(tmp_path / "figure.png").convert("L")).min(axis=1) < 160
    edges = np.flatnonzero(np.diff(np.r_[0, ink.astype(int)])) / 3  # in pixels of the page
    title, first_row, second_row = zip(edges[:6:2], edges[1:6:2], strict=True)
    assert 8 < title[1] - title[0] < 22  # one line of type: nothing runs into it
    assert first_row[0] >= 34 and first_row[0] - title[1] > 6
    assert second_row[0] > first_row[1]


def test_dark_is_dark_and_the_figures_follow(chromium, address):
    def light(page):
        colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
        return sum(map(int, re.findall(r"\d+", colour)[:3])) / 765

    def ink(page):
        return page.evaluate("document.querySelector('#fig-spectrum-1 .live-plot')._fullLayout.xaxis.title.font.color")

    with opened(chromium, address, color_scheme="dark") as page:
        drawn(page, "spectrum-1")
        assert light(page) < 0.25
        in_dark = ink(page)
        page.emulate_media(color_scheme="light")
        page.wait_for_timeout(600)
        assert light(page) > 0.9 and ink(page) != in_dark


def test_a_phone_shows_it_without_scrolling_sideways(chromium, address):
    how = {"viewport": {"width": 360, "height": 740}, "is_mobile": True, "has_touch": True}
    with opened(chromium, address, **how) as page:
        drawn(page, "spectrum-1")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360


@pytest.mark.parametrize("width", [360, 1280])
def test_a_name_without_spaces_does_not_widen_the_page(chromium, tmp_path, width):
    name = 200 * "C"
    blocks = [Paragraph(name), Notice("warning", name), Facts([(name, name)]), FigureBlock(spectrum("s", name))]
    blocks.append(Table("t", name, (Column("step", name),), [(name,)]))
    house = House(company=name, lines=(name,))
    document = Document(name, name, "measured", sections=[Section("one", name, blocks)], house=house)
    path = tmp_path / "report.html"
    path.write_text(render_html(document), encoding="utf-8", newline="\n")
    with opened(chromium, path.as_uri(), viewport={"width": width, "height": 740}) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_phone_shows_the_answer_on_its_first_screen(chromium, address):
    how = {"viewport": {"width": 360, "height": 740}, "is_mobile": True, "has_touch": True}

    def top(page, selector):
        return page.locator(selector).first.bounding_box()["y"]

    with opened(chromium, address, **how) as page:
        answer = page.locator("#summary p").first.bounding_box()
        assert answer["y"] + answer["height"] < 740
        assert top(page, ".notice-synthetic") < answer["y"] < top(page, ".facts") < top(page, "#one")
        assert page.locator("details.narrow > summary").is_visible()
        assert not page.locator("details.narrow nav").is_visible()
    with opened(chromium, address) as page:
        assert top(page, "h1") < top(page, ".facts") < top(page, "#summary p")


def test_a_row_does_not_push_columns_out_of_sight(chromium, tmp_path):
    words = "a name of a step that is as long as a sentence and goes on for quite a while after that too"
    columns = (Column("step", "Step"), Column("of", "Of"), Column("from", "Made from"))
    held = Section("one", "One", [Table("steps", "Steps", columns, [(words, words, words)])])
    path = tmp_path / "report.html"
    path.write_text(render_html(Document("T", "", "measured", sections=[held])), encoding="utf-8", newline="\n")
    with opened(chromium, path.as_uri()) as page:
        beyond = "node => node.scrollWidth - node.clientWidth"
        assert page.eval_on_selector("#tab-steps .scroll", beyond) <= 0
        page.set_viewport_size({"width": 360, "height": 740})
        assert page.locator("#tab-steps tbody th").bounding_box()["width"] < 180


def test_a_table_of_twelve_columns_is_printed_upright_and_no_heading_stands_alone(chromium, address, tmp_path):
    pypdf = pytest.importorskip("pypdf")
    with opened(chromium, address) as page:
        page.pdf(path=tmp_path / "page.pdf", prefer_css_page_size=True)
    pages = pypdf.PdfReader(tmp_path / "page.pdf").pages
    across = {word: [] for word in ("Twelve", "Fifteen")}
    for printed in pages:
        text = printed.extract_text()
        for word, found in across.items():
            if re.search(rf"^\d\s*{word}\b", text, re.MULTILINE):
                assert "Of many columns" in text.split(word)[1]  # the heading is followed by its table on its page
                found.append(printed.mediabox.width > printed.mediabox.height)
    assert across == {"Twelve": [False], "Fifteen": [True]}


def test_a_link_opens_what_is_folded_away(chromium, address):
    with opened(chromium, address) as page:
        assert not page.locator("#deep").is_visible()
        page.locator("#fig-spectrum-1").get_by_role("link", name="How it came about").click()
        page.wait_for_timeout(200)
        assert page.locator("#deep").is_visible()


def test_everything_is_reached_by_keyboard_and_has_a_name(chromium, address):
    with opened(chromium, address) as page:
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.textContent") == "Skip to the content"
        nameless = page.evaluate(
            """() => [...document.querySelectorAll('button, a[href], select, audio, img, [role=region]')]
            .filter((node) => !(node.getAttribute('aria-label') || node.getAttribute('aria-labelledby')
              || (node.labels || []).length || node.alt || node.textContent.trim()))
            .map((node) => node.outerHTML.slice(0, 80))"""
        )
        assert nameless == []
        ids = page.evaluate("[...document.querySelectorAll('[id]')].map((node) => node.id)")
        assert len(ids) == len(set(ids))


def test_hostile_names_are_text(chromium, address):
    with opened(chromium, address) as page:
        drawn(page, "spectrum-1")
        assert page.locator("img[src=x]").count() == 0
        assert "onerror=alert(1)" in page.locator("#fig-spectrum-1 figcaption").text_content()
