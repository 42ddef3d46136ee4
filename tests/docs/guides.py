"""Pages of docs/ as tests read them: fenced blocks, headings, links; and a guide followed to the letter.

The word behind a fence says what a block is: ``sh`` is run line by line by bash, ``toml campaign.toml`` is the content
of that file, ``text output`` has to stand in what the block before it printed. Blocks without a word are not run.
"""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the file or word behind it, its text."""

    language: str
    name: str
    text: str


def blocks(page):
    """Every fenced block of a page, in order."""
    found = FENCE.findall(page.read_text(encoding="utf-8"))
    words = [(*info.split(None, 1), "", "") for info, _ in found]
    return [Block(language, name, text) for (language, name, *_), (_, text) in zip(words, found, strict=True)]


def prose(page):
    """The text of a page without its fenced blocks."""
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def anchors(page):
    """Anchors of a page's headings, as they are on GitHub."""
    headings = re.findall(r"^#{1,6} (.+)$", prose(page), re.MULTILINE)
    words = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", word).replace(" ", "-") for word in words}


def links(page):
    """Targets of a page's links and pictures, without those inside of code."""
    text = re.sub(r"`[^`\n]*`", "", prose(page))
    return re.findall(r"\]\(([^)\s]+)\)", text)


def section(page, heading):
    """The text below a heading, up to the next heading of its rank or above."""
    text = page.read_text(encoding="utf-8")
    start = re.search(rf"^(#+) {re.escape(heading)}$", text, re.MULTILINE)
    assert start is not None, f"{page.name} has no heading {heading!r}"
    rest = text[start.end() :]
    end = re.search(rf"^#{{1,{len(start[1])}}} ", rest, re.MULTILINE)
    return rest if end is None else rest[: end.start()]


def follow(page, folder, store, **variables):
    """Write each file and run each command of a page in a folder, and return what they printed.

    What a page says that the block before printed has to be in it.
    """
    printed, whole = "", ""
    for block in blocks(page):
        if block.language == "sh":
            printed = shell(block.text, folder, store, **variables)
            whole += printed
        elif block.name == "output":
            assert block.text in printed, f"{page.name}: not printed:\n{block.text}\nbut:\n{printed}"
        elif block.name:
            (folder / block.name).write_text(block.text, encoding="utf-8")
    return whole


def shell(commands, folder, store, **variables):
    """Run commands by bash, with this Python's `tdacoustic` and `python`; return what they printed on both streams."""
    programs = store / "programs"
    programs.mkdir(parents=True, exist_ok=True)
    for name, what in (("tdacoustic", "-m tdacoustic "), ("python", "")):
        (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {what}"$@"\n')
        (programs / name).chmod(0o755)
    paths = [variables.pop("PYTHONPATH", None), str(ROOT)]
    environment = {
        **os.environ,
        **variables,
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join(path for path in paths if path),
        "TDACOUSTIC_STORE": str(store),
    }
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", commands],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
    )
    said = done.stdout.decode("utf-8")
    assert done.returncode == 0, f"{commands}\nended with {done.returncode}:\n{said}"
    return said
