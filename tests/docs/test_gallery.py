"""The gallery names pictures, figures and commands that there are; `.ci/gallery` makes them by these commands."""

import importlib.machinery
import importlib.util
import struct
import sys

import pytest
from guides import DOCS, ROOT

from tdacoustic.reporting.document import Document, FigureBlock, Section
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.html import render_html


@pytest.fixture
def gallery():
    loader = importlib.machinery.SourceFileLoader("ci_gallery", str(ROOT / ".ci" / "gallery"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("ci_gallery", loader))
    sys.modules["ci_gallery"] = module  # its dataclass asks for it
    loader.exec_module(module)
    return module


def test_every_picture_is_there_and_none_is_left_over(gallery):
    named = {entry.picture for entry in gallery.entries()}
    assert named == set((DOCS / "gallery").glob("*"))
    for picture in named:
        head = picture.read_bytes()[:24]
        assert head.startswith(b"\x89PNG\r\n\x1a\n")
        assert min(struct.unpack(">II", head[16:24])) > 300
        assert picture.stat().st_size < 300_000


def test_every_command_names_a_campaign_of_the_repository(gallery):
    for entry in gallery.entries():
        program, command, campaign = entry.command.split()
        assert (program, command) == ("tdacoustic", "run")
        assert (ROOT / campaign / "campaign.toml").is_file()


def test_a_picture_without_its_command_is_an_error(gallery, monkeypatch, tmp_path):
    page = tmp_path / "gallery.md"
    page.write_text((DOCS / "gallery.md").read_text(encoding="utf-8").replace("```sh", "```", 1), encoding="utf-8")
    monkeypatch.setattr(gallery, "PAGE", page)
    with pytest.raises(SystemExit, match="each heading needs one picture"):
        gallery.entries()


def report(tmp_path, *names):
    axis = Axis("Speed", "km/h")
    blocks = [FigureBlock(Figure(name, name, "", axis, axis, [Line([0.0, 1.0], [0.0, 1.0], "a")])) for name in names]
    path = tmp_path / "report.html"
    path.write_text(render_html(Document("T", "", "measured", sections=[Section("one", "One", blocks)])), "utf-8")
    return path


def test_figures_are_found_in_a_report_as_it_is_written(gallery, tmp_path):
    found = gallery.figures(report(tmp_path, "first", "second"))
    assert list(found) == ["first", "second"]
    assert all(png.startswith(b"\x89PNG") for png in found.values())


def test_a_figure_that_no_report_has_is_an_error(gallery, tmp_path):
    made = {entry.command: gallery.figures(report(tmp_path, "first")) for entry in gallery.entries()}
    with pytest.raises(SystemExit, match=r"makes no figure 'source-shares'; there are: first"):
        gallery.pictures(made)
