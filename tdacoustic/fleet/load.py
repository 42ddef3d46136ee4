"""From ``fleet.toml`` to a `Fleet`, or to one message that says what is wrong."""

from __future__ import annotations

from pathlib import Path

from tdacoustic.errors import FleetError
from tdacoustic.fleet.fleet import Fleet
from tdacoustic.fleet.messages import VOCABULARY
from tdacoustic.fleet.sections import SCHEMA
from tdacoustic.toml_models import check_schema, file_or_inside, frozen, read_toml

__all__ = ["load_fleet"]


def load_fleet(path: str | Path) -> Fleet:
    """Read and check a fleet.

    Parameters
    ----------
    path : str or Path
        ``fleet.toml``, or the folder that holds it.

    Returns
    -------
    Fleet

    Raises
    ------
    MissingFileError
        The file does not exist.
    FleetError
        No valid TOML, another schema, an unknown key, a bad value or a contradiction.
        The first line names the first problem and how many more there are.
    """
    path = file_or_inside(Path(path), "fleet.toml").absolute()
    raw = frozen(read_toml(path, FleetError))
    check_schema(path, raw, SCHEMA, VOCABULARY, FleetError)
    return Fleet.of_tables(path, raw)
