"""Which software this is: what two machines must have in common to compute the same."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from pathlib import Path

from tdacoustic import __version__

__all__ = ["own_software", "source_sha256"]


@cache
def source_sha256() -> str:
    """SHA-256 over the files of this package, whatever their ends of line; some 20 ms once a process."""
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*")):  # templates, styles and scripts of the report too
        if path.is_file() and "__pycache__" not in path.parts:
            content = path.read_bytes().replace(b"\r\n", b"\n")
            digest.update(f"{path.relative_to(package).as_posix()} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def own_software() -> tuple[str, str, str]:
    """Return version, hash of the sources, and whether paths are those of Windows (``nt``) or not (``posix``)."""
    return __version__, source_sha256(), "nt" if platform.system() == "Windows" else "posix"
