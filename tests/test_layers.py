"""The order of the rooms: who may import whom, nested imports too; and what an import may cost."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "tdacoustic"

ALLOWED = {
    "errors": "",
    "units": "errors",
    "sensors": "units errors",
    "clocks": "errors",
    "recording": "errors",
    "isolation": "",
    "formats": "recording units isolation errors",
    "toml_models": "errors",
    "fleet": "toml_models errors",
    "campaign": "sensors toml_models units errors",
    "ingest": "campaign recording units errors",
    "speed": "errors",
    "orders": "speed errors",
    "spectra": "units errors",
    "lines": "spectra errors",
    "tones": "lines spectra units errors",
    "railway": "spectra units errors",
    "quality": "lines spectra speed recording units errors",
    "contributions": "spectra recording errors",
    "steps": "errors __version__",
    "gears": "errors",
    "motor": "errors",
    "radiation": "units errors",
    "housing": "gears isolation errors",
    "cavity": "housing radiation errors",
    "drive": "cavity housing radiation motor gears spectra fleet steps units errors",
    "studies": "drive housing radiation gears fleet toml_models steps errors",
    "fitting": "drive radiation motor gears fleet steps units errors",
    "measured": "contributions orders tones quality lines spectra speed recording formats ingest campaign sensors "
    "clocks steps units errors",
    "attribution": "measured contributions orders quality lines spectra speed campaign fleet steps units errors",
    "results": "studies fitting drive attribution measured contributions railway campaign fleet spectra steps errors",
    "tables": "studies drive gears attribution measured contributions orders tones railway speed campaign fleet units "
    "sensors errors",
    "gathering": "tables errors",
    "reporting": "gathering studies results tables fitting drive gears attribution measured contributions orders tones "
    "railway campaign sensors fleet toml_models steps quality lines spectra speed recording units errors __version__",
    "synthesis": "errors",
    "workflows": "gathering studies reporting tables results fitting drive gears attribution measured contributions "
    "orders tones railway steps quality lines spectra speed ingest campaign sensors fleet toml_models formats "
    "recording units errors",
    "cli_options": "",
    "cli": "cli_options workflows synthesis results campaign fleet steps errors __version__",
    "__main__": "cli",
    "__init__": "",
}
"""Which rooms a room may import, directly and nested in its functions; a room that is not here fails the test."""

CORE = (
    "clocks",
    "sensors",
    "speed",
    "orders",
    "spectra",
    "lines",
    "quality",
    "tones",
    "railway",
    "contributions",
    "gears",
    "motor",
    "radiation",
    "cavity",
)
NOT_IN_THE_CORE = frozenset(
    {"csv", "h5py", "io", "logging", "matplotlib", "os", "pandas", "pathlib", "plotly", "rich", "shutil", "soundfile"}
    | {"subprocess", "sys", "tempfile", "time", "typer"}
)
CALLS_NOT_IN_THE_CORE = frozenset({"open", "print", "input"})

HEAVY = frozenset(
    {"h5py", "librosa", "lmfit", "matplotlib", "ngsolve", "numba", "pandas", "plotly", "pyoctaveband", "pyuff"}
    | {"aiohttp", "asammdf", "dask", "defusedxml", "distributed", "dwdatareader", "nptdms", "pyarrow", "scipy"}
    | {"reportlab", "soundfile"}
)


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def modules():
    return sorted(PACKAGE.rglob("*.py"))


def imported(path):
    """Each imported module's full name and line; lazy imports by name count too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: a relative import"
            if node.module == "tdacoustic":
                yield from ((f"tdacoustic.{alias.name}", node.lineno) for alias in node.names)
            else:
                yield node.module, node.lineno
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) in (
            "import_module",
            "__import__",
        ):
            yield from (
                (argument.value, node.lineno)
                for argument in node.args
                if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
            )


def inner_imports():
    """(room, imported room, where) for each import of one room by another."""
    for path in modules():
        for name, line in imported(path):
            parts = name.split(".")
            if parts[0] == "tdacoustic" and len(parts) > 1 and parts[1] != room_of(path):
                yield room_of(path), parts[1], f"{path.relative_to(ROOT)}:{line}"


def test_every_room_imports_only_what_is_upstream():
    faults = [
        f"{where}: {room} must not import {target}"
        for room, target, where in inner_imports()
        if target not in ALLOWED.get(room, "").split()
    ]
    assert not faults, "\n".join(faults)


def test_every_room_has_its_line_in_the_table():
    rooms = {room_of(path) for path in modules()}
    assert rooms <= set(ALLOWED), f"without a line: {sorted(rooms - set(ALLOWED))}"
    assert set(ALLOWED) <= rooms, f"rooms that are no more: {sorted(set(ALLOWED) - rooms)}"


def test_the_table_has_no_cycle():
    order: list[str] = []
    waiting = {room: set(allowed.split()) - {"__version__"} for room, allowed in ALLOWED.items()}
    while waiting:
        free = [room for room, upstream in waiting.items() if upstream <= set(order)]
        assert free, f"these import each other in a circle: {sorted(waiting)}"
        order += free
        waiting = {room: upstream for room, upstream in waiting.items() if room not in free}


@pytest.mark.parametrize("room", CORE)
def test_the_core_touches_no_file_plot_or_terminal(room):
    faults = []
    for path in (path for path in modules() if room_of(path) == room):
        faults += [
            f"{path.name}:{line}: imports {name}"
            for name, line in imported(path)
            if name.split(".")[0] in NOT_IN_THE_CORE
        ]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = getattr(getattr(node, "func", None), "id", None) if isinstance(node, ast.Call) else None
            if called in CALLS_NOT_IN_THE_CORE:
                faults.append(f"{path.name}:{node.lineno}: calls {called}")
            if isinstance(node, (ast.Global, ast.Nonlocal)):
                faults.append(f"{path.name}:{node.lineno}: a global")
    assert not faults, "\n".join(faults)


def test_the_reading_of_imports_sees_nested_and_lazy_ones(tmp_path):
    path = tmp_path / "module.py"
    path.write_text(
        "import json\ndef f():\n    from tdacoustic.cli import main\n    from tdacoustic import formats\n"
        "    import_module('tdacoustic.steps')\nif False:\n    import h5py\n"
    )
    assert {name for name, _ in imported(path)} == {
        "json",
        "tdacoustic.cli",
        "tdacoustic.formats",
        "tdacoustic.steps",
        "h5py",
    }


def loaded_by(statement):
    code = f"import sys; {statement}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    return set(
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True).stdout.decode().split()
    )


@pytest.mark.parametrize("statement", ["import tdacoustic.cli", "import tdacoustic; dir(tdacoustic)"])
def test_importing_the_program_loads_nothing_heavy(statement):
    assert not loaded_by(statement) & HEAVY


def test_the_package_itself_loads_nothing_beyond_the_standard_library():
    foreign = loaded_by("import tdacoustic") - loaded_by("import importlib, typing") - {"tdacoustic"}
    assert foreign <= set(sys.stdlib_module_names), f"import tdacoustic loads {sorted(foreign)}"
