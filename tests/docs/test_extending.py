"""The examples of docs/extending.md, run in the order in which they stand there."""

import csv
import tomllib

import pytest
from guides import DOCS, blocks, follow


@pytest.fixture(scope="module")
def followed(store, tmp_path_factory):
    """The folder in which the page was followed, its package installed beside it."""
    folder = tmp_path_factory.mktemp("extending")
    packages = tmp_path_factory.mktemp("packages")
    page = {block.name: block.text for block in blocks(DOCS / "extending.md")}
    install(page["pyproject.toml"], packages)
    (packages / "ourlogger.py").write_text(page["ourlogger.py"], encoding="utf-8")
    follow(DOCS / "extending.md", folder, store, PYTHONPATH=str(packages))
    return folder


def install(pyproject, packages):
    """Write what pip writes for these entry points; pip itself would ask the network for setuptools."""
    project = tomllib.loads(pyproject)["project"]
    about = packages / f"{project['name']}-{project['version']}.dist-info"
    about.mkdir()
    about.joinpath("METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    lines = []
    for group, entries in project["entry-points"].items():
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in entries.items())]
    about.joinpath("entry_points.txt").write_text("\n".join(lines) + "\n")


def rows(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_format_is_read(followed):
    """Levels of sinusoids of known rms: 0.2 Pa and 5 m/s^2, with scatter 20 and 28 dB below."""
    levels = {row["channel"]: float(row["level_db"]) for row in rows(followed / "result" / "levels.csv")}
    assert levels["mic"] == pytest.approx(80.0, abs=0.1)
    assert levels["gearbox"] == pytest.approx(133.98, abs=0.1)


def test_the_fleet_names_the_line(followed):
    line = max(rows(followed / "result" / "sources.csv"), key=lambda row: float(row["level_db"]))
    assert float(line["frequency_hz"]) == pytest.approx(620.0, abs=0.1)
    assert (line["order_name"], line["radiator"], line["source"]) == ("mesh x1", "gearbox", "gearbox")


def test_the_report_is_the_company_s(followed):
    page = (followed / "result" / "report.html").read_text(encoding="utf-8")
    assert "Our company" in page and "Our ride: noise of the drive" in page and "For internal use." in page
    assert page.index('<section id="levels"') < page.index('<section id="quality"')  # else the other way round
    assert '<section id="tones"' not in page and "Left out by the template of this report: Is it tonal?" in page


def test_the_report_speaks_the_language_of_its_translations(followed):
    page = (followed / "result" / "report.html").read_text(encoding="utf-8")
    assert '<html lang="de">' in page
    for english, german in (("Summary", "Zusammenfassung"), ("Contents", "Inhalt"), ("Figure 1.", "Bild 1.")):
        assert f">{german}" in page and f">{english}" not in page


def test_the_section_is_in_the_page(followed):
    page = (followed / "with-our-section.html").read_text(encoding="utf-8")
    assert 'id="our-limit"' in page and "Our own limit" in page
    ours = page.split('<section id="our-limit"')[1].split("<section")[0]
    assert "verdict-bad" in ours  # 80 dB beside a limit of 78 dB
    assert 'href="#from-levels"' in ours and page.count('<section id="from-levels"') == 1
    assert "Our company" in page and '<html lang="de">' in page
    assert page.index('<section id="our-limit"') < page.index('<section id="provenance"')
