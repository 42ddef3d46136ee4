"""Output folders: written aside, moved into place, manifest last."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
import time
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any
from uuid import uuid4

from tdacoustic.errors import OutputError, TdacousticError

__all__ = [
    "MANIFEST",
    "OutputFolder",
    "default_output",
    "partial_name",
    "read_manifest",
    "subject_of",
    "sweep_left_overs",
]

MANIFEST = "manifest.json"
SCHEMA = "tdacoustic-manifest/1"

_LEFT_OVER_S = 3600.0
"""A staging folder in which nothing was written for this long was left by a run that was killed."""


def _staging_mark() -> str:
    """Return what tells one run's staging folder from another's: this machine, this process, a random part."""
    machine = hashlib.sha256(platform.node().encode()).hexdigest()[:6]
    return f"{machine}-{os.getpid()}-{uuid4().hex[:6]}"


def _is_left_over(folder: Path, mark: str) -> bool:
    """Whether the run that wrote a staging folder is gone: its process on this machine is, or it is silent for long."""
    machine, _, rest = mark.partition("-")
    process = rest.partition("-")[0]
    if os.name == "posix" and machine == _staging_mark().partition("-")[0] and process.isdigit():
        try:
            os.kill(int(process), 0)
        except ProcessLookupError:
            return True
        except OSError:
            pass  # somebody else's, and alive
    return time.time() - folder.stat().st_mtime > _LEFT_OVER_S


def partial_name(name: str) -> str:
    """Return the name under which a file or folder is written before it is moved into place beside itself."""
    return f".{name}.{_staging_mark()}.partial"


def sweep_left_overs(parent: Path, names: Collection[str]) -> None:
    """Take away what killed runs left beside their results; not what another run is writing at this moment.

    Parameters
    ----------
    parent : Path
        The folder that the results are in; it need not exist.
    names : collection of str
        Of these result folders and files.
    """
    for left in parent.glob(".*.partial"):
        name, _, mark = left.name[1:].removesuffix(".partial").rpartition(".")
        with suppress(OSError):  # somebody else takes it away
            if name in names and _is_left_over(left, mark):
                left.unlink() if left.is_file() else shutil.rmtree(left, ignore_errors=True)


def default_output(toml_file: Path) -> Path:
    """Return ``reports/<name of the folder the TOML is in>`` below the working directory."""
    return Path("reports") / toml_file.resolve().parent.name


def subject_of(subject: Path, folder: Path) -> str:
    """Return what the manifest of a result folder calls the file that its results are of: its path from there."""
    try:
        return Path(os.path.relpath(subject.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return subject.resolve().as_posix()


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """Return the manifest of a result folder, complete or not; None where there is none of tdacoustic."""
    try:
        held = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(held, dict) or not str(held.get("schema", "")).startswith("tdacoustic-manifest/"):
        return None
    return held if isinstance(held.get("files"), dict) else {**held, "files": {}}


class OutputFolder:
    """A result folder that never holds a half-written file, used as a context.

    Files are written to `staging`, a folder beside the target. On leaving the
    context without an error a new target is renamed into place whole. An
    existing one is refreshed file by file: first its manifest is marked
    incomplete, the new manifest comes last, and files that the old manifest
    named and the new result lacks are taken away. On an error nothing changes.

    Parameters
    ----------
    path : Path
    subject : Path
        The campaign or fleet file that the results are of; of a view of many
        results the folder that they are all in. A folder whose manifest names
        the same subject is refreshed; anything else in the way is refused.
    overwrite : bool
        Write over whatever is there; foreign files of other names stay.
    keep : bool
        Refresh the files that are written and keep the others of the result.

    Raises
    ------
    OutputError
        Something else is in the way, or the folder cannot be written.
    """

    def __init__(self, path: Path, subject: Path, overwrite: bool = False, keep: bool = False) -> None:
        self.path = path
        whole = path.absolute() if path.name not in ("", "..") else path.resolve()  # "." and ".." name no folder
        self._name = whole.name
        self.staging = whole.with_name(partial_name(whole.name))
        self.manifest: dict[str, Any] = {}
        self._subject = subject_of(subject, path)
        self._overwrite = overwrite
        self._keep = keep
        try:
            self._check()
        except PermissionError as error:
            raise OutputError(f"{self.path}: cannot be read ({error.strerror})") from error

    def _check(self) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise OutputError(f"{self.path}: a file is in the way of the output folder")
        if self._overwrite or not self.path.is_dir() or not any(self.path.iterdir()):
            return
        held = read_manifest(self.path)
        if held is None:
            raise OutputError(f"{self.path}: the folder is not empty and not a result of tdacoustic; give --overwrite")
        if held.get("subject") != self._subject:
            raise OutputError(
                f"{self.path}: the folder holds results of {held.get('subject')!r}, not of {self._subject!r}; "
                "give --overwrite or another -o"
            )

    def __enter__(self) -> OutputFolder:
        try:
            sweep_left_overs(self.staging.parent, {self._name})
            self.staging.mkdir(parents=True)
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written ({error.strerror})") from error
        return self

    def write_text(self, name: str, text: str) -> None:
        """Write one file of the result."""
        target = self.staging / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(text.encode("utf-8"))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._publish()
            elif isinstance(error, OSError) and not isinstance(error, TdacousticError):
                raise error
        except OSError as failure:
            raise OutputError(f"{self.path}: cannot be written ({failure})") from failure
        finally:
            shutil.rmtree(self.staging, ignore_errors=True)

    def _publish(self) -> None:
        names = sorted(p.relative_to(self.staging).as_posix() for p in self.staging.rglob("*") if p.is_file())
        files = {name: _sha256(self.staging / name) for name in names}
        old = read_manifest(self.path) or {}
        if self._keep and old.get("complete") and old.get("subject") == self._subject:
            self.manifest = {key: value for key, value in old.items() if key not in ("schema", "subject", "complete")}
            files = {**old["files"], **files}
        document = {"schema": SCHEMA, "subject": self._subject, "complete": True, **self.manifest, "files": files}
        (self.staging / MANIFEST).write_text(_json(document), encoding="utf-8")
        if not self.path.exists():
            try:
                self.staging.replace(self.path)
            except OSError:
                if not self.path.is_dir():
                    raise
            else:
                return
        self._check()  # another run may have written it meanwhile
        marker = self.staging / f"{MANIFEST}.incomplete"
        known = sorted({*old.get("files", {}), *names})
        marker.write_text(
            _json({"schema": SCHEMA, "subject": self._subject, "complete": False, "files": dict.fromkeys(known)}),
            encoding="utf-8",
        )
        marker.replace(self.path / MANIFEST)
        for name in names:
            target = self.path / name
            target.parent.mkdir(parents=True, exist_ok=True)
            (self.staging / name).replace(target)
        for name in set(old.get("files", {})) - set(files):
            stale = (self.path / name).resolve()
            if stale.is_relative_to(self.path.resolve()):
                stale.unlink(missing_ok=True)
        (self.staging / MANIFEST).replace(self.path / MANIFEST)


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _json(document: Mapping[str, Any]) -> str:
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
