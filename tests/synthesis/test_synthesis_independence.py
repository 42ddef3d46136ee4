"""The generator shares no code with the analysis that its campaigns test."""

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "tdacoustic" / "synthesis"
ALLOWED = ("tdacoustic.errors", "tdacoustic.synthesis")


def imports(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in {path.name}"
            yield node.module


def test_synthesis_imports_nothing_of_the_analysis():
    files = sorted(PACKAGE.glob("**/*.py"))
    assert len(files) > 5
    for path in files:
        for name in imports(path):
            if name.split(".")[0] == "tdacoustic":
                assert name.startswith(ALLOWED), f"{path.name} imports {name}"
            assert name.split(".")[0] not in ("pandas", "librosa", "soundfile", "importlib"), f"{path.name}: {name}"
