"""No link of the documents leads nowhere, and every page can be reached from the index."""

import re

import pytest
from guides import DOCS, PAGES, ROOT, anchors, blocks, links

DOCUMENTS = [*PAGES, ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "tests" / "evidence" / "README.md"]


def names(page):
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", DOCUMENTS, ids=names)
def test_links_lead_somewhere(page):
    for link in links(page):
        if "://" in link:
            assert link.startswith("https://"), link
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{names(page)}: {link}"
        assert target.is_relative_to(ROOT), f"{names(page)}: {link} leads out of the repository"
        if anchor:
            assert anchor in anchors(target), f"{names(page)}: {link}: no such heading"


def test_every_page_is_reached_from_the_index():
    reached, open_pages = set(), [DOCS / "README.md"]
    while open_pages:
        page = open_pages.pop()
        if page in reached:
            continue
        reached.add(page)
        targets = [(page.parent / link.partition("#")[0]).resolve() for link in links(page) if "://" not in link]
        open_pages += [target for target in targets if target.suffix == ".md" and target.parent == DOCS]
    assert reached == set(PAGES)


@pytest.mark.parametrize("page", PAGES, ids=names)
def test_files_named_in_prose_are_there(page):
    """Paths of the repository that a page names in code, `recordings/run-up` say."""
    folders = "calibration|docs|recordings|tdacoustic|tests|\\.ci"
    text = page.read_text(encoding="utf-8")
    for path in re.findall(rf"(?<![\w/.])((?:{folders})/[\w./-]*\w)", text):
        assert (ROOT / path).exists(), f"{names(page)}: {path}"


@pytest.mark.parametrize("page", PAGES, ids=names)
def test_fences_are_closed(page):
    assert page.read_text(encoding="utf-8").count("\n```") % 2 == 0
    assert all(block.text.strip() for block in blocks(page))
