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

from tdacoustic.reporting import Column, Details, Document, FigureBlock, Paragraph, Section, Table
from tdacoustic.reporting.document import Alternatives
from tdacoustic.reporting.html import render_html

SYSTEM = ("chromium", "chromium-browser", "google-chrome")
LEVELS = [71.5, 9.25, None, 104.0, -3.0, 71.25]


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
        sections=[
            Section("one", "One", [FigureBlock(spectrum("spectrum-1", EVIL), "measured")]),
            Section("maps", "Maps", [Alternatives("Channel", views)]),
            Section("tables", "Tables", [Table("levels", "Levels", columns, rows)]),
            Section("provenance", "How", [Details("Folded", [Section("deep", "Deep", [Paragraph("here")])])]),
        ],
        lineage={"one": "deep"},
    )


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


def column(page, number):
    return page.eval_on_selector_all(
        "#tab-levels tbody tr", f"rows => rows.map(row => row.cells[{number}].textContent.trim())"
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
