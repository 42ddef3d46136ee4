"""The first run, as its page has it, on the campaign of the repository."""

import shutil

from guides import DOCS, ROOT, follow


def test_it_ends_in_the_report_and_the_verdict_that_the_page_names(store, tmp_path):
    shutil.copytree(ROOT / "recordings" / "first-run", tmp_path / "recordings" / "first-run")
    said = follow(DOCS / "first-run.md", tmp_path, store)
    page = (tmp_path / "reports" / "first-run" / "report.html").read_text(encoding="utf-8")
    assert "They are not measurements." in page
    steady = next(line for line in said.splitlines() if line.startswith("Condition 50 "))
    assert "dominant source undecided" in steady and "sensors and contributions say gearbox" in steady
