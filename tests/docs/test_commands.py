"""docs/commands.md is what the program has, and no page names a command or an option that there is not."""

import importlib.machinery
import importlib.util
import re

import pytest
from guides import DOCS, PAGES, ROOT, blocks, prose

from tdacoustic.tables import COLUMNS


@pytest.fixture(scope="module")
def script():
    loader = importlib.machinery.SourceFileLoader("ci_commands", str(ROOT / ".ci" / "commands"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("ci_commands", loader))
    loader.exec_module(module)
    return module


def test_the_page_is_what_the_program_has(script):
    held = (DOCS / "commands.md").read_text(encoding="utf-8")
    assert held == script.markdown(), "docs/commands.md is out of date: run .ci/commands"


def test_every_command_and_table_is_described(script):
    commands = {command.name or command.callback.__name__ for command in script.app.registered_commands}
    assert set(script.OUTPUTS) == commands == set(script.EXAMPLES)
    assert set(script.TABLES) == set(COLUMNS)
    assert {name for _, tables in script.OUTPUTS.values() for name in tables} == set(COLUMNS)


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda page: page.relative_to(ROOT).as_posix())
def test_commands_that_pages_name_are_there(script, page):
    spellings = {
        command.name or command.callback.__name__: " ".join(row[0] for row in script._inputs(command.callback))
        for command in script.app.registered_commands
    }
    code = [line for block in blocks(page) for line in block.text.splitlines()]
    code += re.findall(r"`([^`]+)`", prose(page))
    said = [found[1] for line in code if (found := re.match(r"(?:\S*/)?tdacoustic\s+([^#]+)", line)) is not None]
    assert said or page.name not in ("ten-minutes.md", "first-run.md", "gallery.md")
    for line in said:
        word = line.split()[0]
        if word in ("--version", "COMMAND"):
            continue
        assert word in spellings, f"{page.name}: tdacoustic {line}"
        for option in re.findall(r"(?<!\S)(-{1,2}[a-z][a-z-]*)", line):
            known = (*re.findall(r"-{1,2}[a-z][a-z-]*", spellings[word]), "--help")
            assert option in known, f"{page.name}: tdacoustic {line}"
