# ruff: noqa: E402 - the path is set first
"""How large a report is, how soon a browser has opened it, and how soon a figure lives once it is looked at.

``python tests/benchmarks/bench_report.py [report.html ...]`` (half a minute; default: the five conditions of
``recordings/crrc-freight``, made first where they are not there). Each is opened five times in a fresh page of headless
Chromium: from asking for the file to the end of loading, and to the first paint; then the first figure that can be
zoomed is scrolled to. The median is given.
"""

from __future__ import annotations

import os
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parent)]

from figures import note
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[2]
SYSTEM = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ROUNDS = 5
BUDGET_MB = 15.0
BUDGET_S = 2.0
PAINT = "() => performance.getEntriesByName('first-contentful-paint').map((entry) => entry.startTime / 1000)[0]"
FIRST_LIVE = "figure.figure:has(script)"


def opened(browser: Any, page: Path) -> tuple[float, float, float | None]:
    """Seconds to the end of loading, to the first paint, and from looking at the first figure until it lives."""
    tab = browser.new_page(viewport={"width": 1280, "height": 900})
    start = time.perf_counter()
    tab.goto(page.resolve().as_uri(), wait_until="load")
    loaded = time.perf_counter() - start
    painted = float(tab.evaluate(PAINT))
    alive = None
    if tab.locator(FIRST_LIVE).count():
        figure = tab.locator(FIRST_LIVE).first
        tab.evaluate(
            "(node) => { for (let n = node; n; n = n.parentElement) if (n.tagName === 'DETAILS') n.open = true; }",
            figure.element_handle(),
        )
        start = time.perf_counter()
        figure.scroll_into_view_if_needed()
        figure.locator(".js-plotly-plot .main-svg").first.wait_for(state="attached")
        alive = time.perf_counter() - start
    tab.close()
    return loaded, painted, alive


def main() -> None:
    """Open each report and say what it took."""
    pages = [Path(argument) for argument in sys.argv[1:]]
    if not pages:
        target = ROOT / "reports" / "crrc-freight"
        if not (target / "report.html").is_file():
            command = [sys.executable, "-m", "tdacoustic", "run", str(ROOT / "recordings" / "crrc-freight")]
            subprocess.run([*command, "-o", str(target), "--quiet"], check=True, cwd=ROOT)
        pages = [target / "report.html"]
    named = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, SYSTEM)), None)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=named, args=["--no-sandbox", "--disable-gpu"])
        for page in pages:
            rounds = [opened(browser, page) for _ in range(ROUNDS)]
            loaded, painted = (statistics.median(values) for values in list(zip(*rounds, strict=True))[:2])
            size_mb = page.stat().st_size / 1e6
            lives = [alive for *_, alive in rounds if alive is not None]
            text = f"{page.parent.name}: {size_mb:.1f} MB, loaded in {loaded:.2f} s, first paint after {painted:.2f} s"
            print(text + (f", a figure lives after {statistics.median(lives):.2f} s" if lives else ""))
            note(f"report of {page.parent.name}, size", size_mb, "MB", budget=BUDGET_MB)
            note(f"report of {page.parent.name}, opened", loaded, "s", budget=BUDGET_S)
        browser.close()


if __name__ == "__main__":
    main()
