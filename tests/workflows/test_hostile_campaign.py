"""A hostile campaign through every command: nothing runs, nothing is written elsewhere, no cell is a formula.

Opened in headless Chromium once, by hand, on 2026-11-23: 49 figures drawn and hovered, tables sorted and downloaded, no
script of the logs ran, no request left the page.
"""

import csv
import io
import json
import os
import re
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path

import pytest
from hostile_campaign import CHINESE, CYRILLIC, IMAGE, NAMES, RIGHT_TO_LEFT, UNBROKEN, hostile_campaign, hostile_logs
from small_campaigns import small_campaign

from tdacoustic.campaign import load_campaign

ROOT = Path(__file__).resolve().parents[2]
STEERING = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
OUR_ELEMENTS = {
    *(
        "a",
        "article",
        "body",
        "button",
        "caption",
        "code",
        "col",
        "dd",
        "details",
        "div",
        "dl",
        "dt",
        "em",
        "figcaption",
    ),
    *("figure", "footer", "h1", "h2", "h3", "h4", "h5", "head", "header", "html", "img", "li", "main", "meta", "nav"),
    *("ol", "p", "pre", "script", "section", "small", "span", "strong", "style", "sub", "summary", "sup", "table"),
    *("tbody", "td", "th", "thead", "title", "tr", "ul"),
    *("audio", "polyline", "svg"),
}


class Page(HTMLParser):
    """Elements, attributes and scripts of a page, read as a browser reads them."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[tuple[str | None, str]] = []
        self.words: list[str] = []
        self._script: str | None = None
        self._open = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._open = tag
        if tag == "script":
            self.scripts.append((dict(attrs).get("type"), ""))

    def handle_endtag(self, tag):
        self._open = ""

    def handle_data(self, data):
        if self._open == "script":
            kind, text = self.scripts[-1]
            self.scripts[-1] = (kind, text + data)
        elif self._open != "style":
            self.words.append(data)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """The campaign, what each command said, and the folder that was to be written."""
    folder = tmp_path_factory.mktemp("hostile")
    campaign = hostile_campaign(folder / "camp")
    environment = {**os.environ, "TDACOUSTIC_STORE": str(folder / "store"), "PYTHONPATH": str(ROOT),
                   "OMP_NUM_THREADS": "1", "PYTHONUTF8": "1"}  # fmt: skip
    logs = sorted(str(path) for path in campaign.parent.iterdir() if path.suffix in (".h5", ".wav", ".csv", ".uff"))
    said = {}
    for name, arguments in {
        "info": ["info", *logs],
        "json": ["info", "--json", *logs],
        "init": ["init", *logs, "-o", "first"],
        "check": ["check", "camp", "-o", "checked"],
        "run": ["run", "camp", "-o", "out", *(["--pdf"] if find_spec("reportlab") else [])],
    }.items():
        said[name] = subprocess.run(
            [sys.executable, "-P", "-m", "tdacoustic", *arguments],
            cwd=folder, env=environment, capture_output=True, text=True, encoding="utf-8",
        )  # fmt: skip
    return folder, said


def test_every_command_ends_in_words(hostile):
    _, said = hostile
    for name, run in said.items():
        assert "Traceback" not in run.stderr, (name, run.stderr[-2000:])
        # a rejected log that is not there, runs without the sources: `check` refuses, the others go on
        assert run.returncode == (1 if name == "check" else 0), (name, run.stderr[-2000:])


def test_no_command_steers_the_terminal(hostile):
    for name, run in hostile[1].items():
        assert STEERING.search(run.stdout + run.stderr) is None, name


def test_info_as_json_is_json(hostile):
    held = json.loads(hostile[1]["json"].stdout)
    assert len(held) == 5
    names = [channel["name"] for log in held for channel in log["channels"]]
    assert all(len(name) <= 204 and name.isprintable() for name in names)


def test_init_writes_toml_that_loads(hostile):
    folder, _ = hostile
    tomllib.loads((folder / "first" / "campaign.toml").read_text(encoding="utf-8"))
    assert load_campaign(folder / "first").channels


def test_nothing_was_written_elsewhere(hostile):
    folder, _ = hostile
    assert {path.name for path in folder.iterdir()} == {"camp", "store", "first", "checked", "out"}
    for result in ("checked", "out"):
        inside = sorted(path.relative_to(folder / result).as_posix() for path in (folder / result).rglob("*"))
        assert all(re.fullmatch(r"[a-z0-9_.]+", name) for name in inside), inside
    assert not {path.name for path in (folder / "camp").iterdir()} - {
        *(log.name for log in hostile_logs(folder / "camp")), "campaign.toml", "fleet.toml",
    }  # fmt: skip


def test_the_page_has_only_its_own_elements(hostile):
    text = (hostile[0] / "out" / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert {tag for tag, _ in page.elements} <= OUR_ELEMENTS
    for tag, attributes in page.elements:
        assert not [name for name in attributes if name.startswith("on")], (tag, attributes)
        if tag == "img":
            assert (attributes["src"] or "").startswith("data:image/png;base64,")
        if tag == "audio":
            assert (attributes["src"] or "").startswith("data:audio/mpeg;base64,")
        if tag == "a":
            assert (attributes["href"] or "").startswith("#")
        assert "expression(" not in (attributes.get("style") or "") and "url(" not in (attributes.get("style") or "")
    (policy,) = [held["content"] for tag, held in page.elements if tag == "meta" and "http-equiv" in held]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe-inline" not in policy.split("style-src")[0]
    assert any("<img src=x onerror=window.PWNED=1>" in words for words in page.words)  # shown as it is written


def test_scripts_are_the_pages_own_and_data(hostile):
    page = Page((hostile[0] / "out" / "report.html").read_text(encoding="utf-8"))
    own = [text for kind, text in page.scripts if kind is None]
    assert len(own) == 1 and "PWNED" not in own[0]
    figures = [json.loads(text) for kind, text in page.scripts if kind == "application/json"]
    assert len(figures) > 3
    strings = list(strings_of(figures))
    for text in strings:  # plotly reads a subset of HTML: of elements only ours may be in it
        assert set(re.findall(r"<\s*/?\s*([a-zA-Z]+)", text)) <= {"b", "br", "i", "sub", "sup", "extra"}, text
        assert "javascript:" not in text.replace("&", "") or "href" not in re.sub("&lt;.*?&gt;", "", text)


def strings_of(value):
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for held in value.values():
            yield from strings_of(held)
    elif isinstance(value, list):
        for held in value:
            yield from strings_of(held)


@pytest.mark.parametrize("result", ["checked", "out"])
def test_no_cell_of_a_table_is_a_formula(hostile, result):
    tables = sorted((hostile[0] / result).glob("*.csv"))
    assert tables
    for table in tables:
        text = table.read_bytes().decode("utf-8")
        assert "\r" not in text and STEERING.search(text) is None
        for delimiter in ",;":
            for row in csv.reader(io.StringIO(text, newline=""), delimiter=delimiter):
                for cell in row:
                    assert not cell.startswith(("=", "@", "＝", "＠")), (table.name, cell[:200])
                    if cell.startswith(("+", "-")) and delimiter == ",":
                        float(cell.removesuffix(" dB").removesuffix(" %"))


def test_writing_of_every_script_is_text_of_the_page_and_of_no_warning(hostile):
    words = "\n".join(Page((hostile[0] / "out" / "report.html").read_text(encoding="utf-8")).words)
    for text in (CHINESE, CYRILLIC, RIGHT_TO_LEFT, UNBROKEN, *NAMES):
        assert text in words
    assert not [line for run in hostile[1].values() for line in run.stderr.splitlines() if "Glyph" in line]


def test_the_pdf_shows_it_as_it_is_written(hostile):
    """Words of each direction are found as they are read; a sign of no font is its code."""
    pytest.importorskip("reportlab")
    pypdf = pytest.importorskip("pypdf")
    pages = pypdf.PdfReader(hostile[0] / "out" / "report.pdf").pages
    text = "".join("".join(page.extract_text() for page in pages).split())
    for words in (IMAGE, CHINESE, CYRILLIC, UNBROKEN, "מיקרופון", "[U+1F600][U+1F682]"):
        assert "".join(words.split()) in text
    seen = {str(note.get_object()["/Subtype"]) for page in pages for note in page.get("/Annots") or []}
    assert seen == {"/Link"}
    targets = [note.get_object() for page in pages for note in page.get("/Annots") or []]
    assert not [one for one in targets if "/A" in one and "/URI" in one["/A"]]


def test_manifest_and_result_are_well_formed(hostile):
    import h5py

    folder = hostile[0]
    json.loads((folder / "out" / "manifest.json").read_text(encoding="utf-8"))
    with h5py.File(folder / "out" / "result.h5") as file:
        assert all("/" not in name for name in file) and "</script>" in file.attrs["name"]
        for name in file:
            assert not isinstance(file.get(name, getlink=True), h5py.SoftLink | h5py.ExternalLink)


# ---------------------------------------------------------------- where a program from outside could get in


PLANTED = "import pathlib, os\npathlib.Path(os.environ['MARK']).write_text('ran')\n"


def test_modules_in_the_working_directory_are_not_run(tmp_path):
    """A folder from outside, entered with cd: its modules are not those of the workers."""
    folder = tmp_path / "camp"
    small_campaign(folder, seconds=1.0)
    for name in ("multiprocessing", "numpy", "h5py", "soundfile", "pandas", "pickle", "tdacoustic", "ngsolve"):
        (folder / f"{name}.py").write_text(PLANTED)
    # as the installed program is started: its own folder stands first among those of modules
    command = [sys.executable, str(tmp_path / "bin" / "tdacoustic")]
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "tdacoustic").write_text(
        "from tdacoustic.cli import main\nif __name__ == '__main__':\n    main()\n"
    )
    environment = {**os.environ, "TDACOUSTIC_STORE": str(tmp_path / "store"), "MARK": str(tmp_path / "mark"),
                   "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}  # fmt: skip
    run = subprocess.run(
        [*command, "check", ".", "--jobs", "2", "-o", str(tmp_path / "out")],
        cwd=folder, env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert not (tmp_path / "mark").exists()


def test_a_process_apart_does_not_run_the_working_directory(tmp_path, monkeypatch):
    from tdacoustic.housing.step_file.isolation import run_apart

    for name in ("pickle", "importlib", "threading", "numpy"):
        (tmp_path / f"{name}.py").write_text(PLANTED)
    monkeypatch.setenv("MARK", str(tmp_path / "mark"))
    monkeypatch.chdir(tmp_path)
    assert run_apart("math:sqrt", (4.0,), "counting", 60.0, 4 << 30) == 2.0
    assert not (tmp_path / "mark").exists()


def test_init_does_not_write_through_a_link_that_was_laid_for_it(tmp_path):
    from tdacoustic.workflows.init import write_campaign

    victim = tmp_path / "victim"
    victim.write_text("precious")
    folder = tmp_path / "camp"
    log = hostile_logs(folder)[0]
    (folder / ".campaign.toml.partial").symlink_to(victim)
    (folder / "campaign.toml").symlink_to(victim)
    write_campaign([log], folder, overwrite=True)
    assert victim.read_text() == "precious" and not (folder / "campaign.toml").is_symlink()


def test_results_are_not_written_through_links(tmp_path):
    from tdacoustic.workflows.output import OutputFolder

    subject = tmp_path / "campaign.toml"
    subject.write_text("x")
    with OutputFolder(tmp_path / "out", subject) as folder:
        folder.write_text("quality.csv", "one")
    victims = [tmp_path / f"victim{n}" for n in range(3)]
    for victim in victims:
        victim.write_text("precious")
    (tmp_path / "out" / "quality.csv").unlink()
    (tmp_path / "out" / "quality.csv").symlink_to(victims[0])
    held = json.loads((tmp_path / "out" / "manifest.json").read_text())
    held["files"] |= {"../victim1": None, str(victims[2]): None, "link": None, IMAGE: None}
    (tmp_path / "out" / "link").symlink_to(victims[1])
    (tmp_path / "out" / "manifest.json").write_text(json.dumps(held))
    with OutputFolder(tmp_path / "out", subject) as folder:
        folder.write_text("quality.csv", "two")
    assert [victim.read_text() for victim in victims] == ["precious"] * 3
    assert (tmp_path / "out" / "quality.csv").read_text() == "two"
    for damaged in ([], {"schema": "tdacoustic-manifest/1", "files": 7, "subject": held["subject"], "complete": True}):
        (tmp_path / "out" / "manifest.json").write_text(json.dumps(damaged))
        with OutputFolder(tmp_path / "out", subject, overwrite=True, keep=True) as folder:
            folder.write_text("quality.csv", "three")
        assert (tmp_path / "out" / "quality.csv").read_text() == "three"
