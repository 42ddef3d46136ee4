"""A guide that does not do what it says fails when it is followed."""

import pytest
from guides import anchors, blocks, follow, links, section

PAGE = """# A page

See [there](other.md#part) and `[not](a-link.md)`.

```txt notes.txt
two words
```

```sh
cat notes.txt; echo said on stderr >&2
```

```text output
two words
```

## Part: `a_b.csv`

```
never run
```
"""


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "page.md"
    path.write_text(PAGE, encoding="utf-8")
    return path


def changed(page, old, new):
    page.write_text(PAGE.replace(old, new), encoding="utf-8")
    return page


def test_files_are_written_and_commands_run(page, store, tmp_path):
    assert follow(page, tmp_path, store).splitlines() == ["two words", "said on stderr"]
    assert (tmp_path / "notes.txt").read_text() == "two words\n"


def test_output_that_is_not_printed_fails(page, store, tmp_path):
    with pytest.raises(AssertionError, match="not printed"):
        follow(changed(page, "output\ntwo words", "output\nthree words"), tmp_path, store)


def test_a_command_that_fails_fails(page, store, tmp_path):
    with pytest.raises(AssertionError, match="ended with 1"):
        follow(changed(page, "cat notes.txt", "cat other.txt"), tmp_path, store)


def test_what_a_page_holds(page):
    assert [(block.language, block.name) for block in blocks(page)] == [
        ("txt", "notes.txt"),
        ("sh", ""),
        ("text", "output"),
        ("", ""),
    ]
    assert links(page) == ["other.md#part"]
    assert anchors(page) == {"a-page", "part-a_bcsv"}
    assert "never run" in section(page, "Part: `a_b.csv`")
