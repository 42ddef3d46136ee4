"""Paths of TDMS objects, ``/'group'/'channel'``, and names as messages show them."""

from __future__ import annotations

__all__ = ["label", "path_of", "shown", "split_path"]


def shown(name: str) -> str:
    """A name from the file as messages show it: quoted, on one line, not endless."""
    return repr(name if len(name) <= 80 else f"{name[:77]}...")


def split_path(path: str) -> tuple[str, ...]:
    """Split an object's path, ``/'group'/'channel'``, into its names.

    Raises
    ------
    ValueError
        It is not of this form.

    Examples
    --------
    >>> split_path("/'a/b'/'it''s'")
    ('a/b', "it's")
    >>> split_path("/")
    ()
    """
    if path == "/":
        return ()
    names: list[str] = []
    at = 0
    while at < len(path):
        if path[at : at + 2] != "/'":
            raise ValueError(f"object path {shown(path)} is not of the form /'group'/'channel'")
        at += 2
        parts: list[str] = []
        while True:
            close = path.find("'", at)
            if close < 0:
                raise ValueError(f"object path {shown(path)} is not of the form /'group'/'channel'")
            parts.append(path[at:close])
            at = close + 1
            if path[at : at + 1] != "'":
                break
            parts.append("'")
            at += 1
        names.append("".join(parts))
    return tuple(names)


def path_of(*names: str) -> str:
    """Path of a group or of a channel."""
    return "/" + "/".join("'" + name.replace("'", "''") + "'" for name in names)


def label(path: str) -> str:
    """A path as messages show it: ``'group/channel'``, or as it stands where it cannot be split."""
    try:
        return shown("/".join(split_path(path)) or "/")
    except ValueError:
        return shown(path)
