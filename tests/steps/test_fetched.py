"""Logs named by URL: fetched whole, once, within the disk; from file systems of fsspec and of the tests' own."""

import io
import os
import shutil
import sys
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from types import MappingProxyType, SimpleNamespace

import pytest

from tdacoustic.errors import FetchError, MissingFileError, MissingPackageError
from tdacoustic.steps.fetched import fetch

fsspec = pytest.importorskip("fsspec", reason="the extra `cluster` is not installed")

CONTENT = bytes(range(256)) * 20_000  # more than a block


class Shelf(fsspec.AbstractFileSystem):
    """A file system of one file that the test decides on."""

    protocol = "shelf"
    cachable = False
    said = MappingProxyType({})
    content = CONTENT
    opened = 0

    def info(self, path, **_):
        if path.endswith("gone.h5"):
            raise FileNotFoundError(path)
        return {"name": path, "type": "file", **type(self).said}

    def _open(self, path, mode="rb", **_):
        type(self).opened += 1
        if path.endswith("denied.h5"):
            raise PermissionError("not for you\nreally")
        return io.BytesIO(type(self).content)


fsspec.register_implementation("shelf", Shelf, clobber=True)


@pytest.fixture
def shelf(monkeypatch):
    monkeypatch.setattr(Shelf, "said", {"size": len(CONTENT), "ETag": '"one"'})
    monkeypatch.setattr(Shelf, "content", CONTENT)
    monkeypatch.setattr(Shelf, "opened", 0)
    return Shelf


def files_in(folder):
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_what_is_fetched_is_whole_and_named_as_it_was(tmp_path, shelf):
    parts = []
    path = fetch("shelf://archive/2026/run 1/a.h5".replace(" ", "-"), tmp_path, parts.append)
    assert path.name == "a.h5"
    assert path.read_bytes() == CONTENT
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    assert files_in(tmp_path) == ["a.h5"]


def test_what_did_not_change_is_not_fetched_again_and_what_changed_is(tmp_path, shelf):
    first = fetch("shelf://archive/a.h5", tmp_path)
    assert fetch("shelf://archive/a.h5", tmp_path) == first
    assert shelf.opened == 1
    shelf.said = {**shelf.said, "ETag": '"two"'}
    shelf.content = CONTENT[::-1]
    second = fetch("shelf://archive/a.h5", tmp_path)
    assert second != first
    assert (second.read_bytes(), first.read_bytes()) == (CONTENT[::-1], CONTENT)  # who reads the first is not disturbed
    assert fetch("shelf://other/a.h5", tmp_path) not in (first, second)
    assert shelf.opened == 3


@pytest.mark.parametrize(
    "stamp", ["ETag", "etag", "mtime", "LastModified", "last_modified", "Last-Modified", "md5", "created"]
)
def test_each_of_what_file_systems_say_counts(tmp_path, shelf, stamp):
    for value, opened in (("1", 1), ("1", 1), ("2", 2)):
        shelf.said = {"size": len(CONTENT), stamp: value}
        fetch("shelf://archive/a.h5", tmp_path)
        assert shelf.opened == opened


@pytest.mark.parametrize("said", [{"size": len(CONTENT)}, {}, {"size": None, "mimetype": "x"}])
def test_where_nothing_is_said_of_the_content_it_is_fetched_each_time(tmp_path, shelf, said):
    shelf.said = said
    for times in (1, 2):
        assert fetch("shelf://archive/a.h5", tmp_path).read_bytes() == CONTENT
        assert shelf.opened == times


@pytest.mark.parametrize(
    ("size", "match"), [(len(CONTENT) + 1, "ended after 5120000 of 5120001 bytes"), (100, "more than the 100 bytes")]
)
def test_another_size_than_was_said_is_refused_and_leaves_nothing(tmp_path, shelf, size, match):
    shelf.said = {"size": size, "ETag": "x"}
    with pytest.raises(FetchError, match=f"shelf://archive/a.h5: .*{match}"):
        fetch("shelf://archive/a.h5", tmp_path)
    assert files_in(tmp_path) == []


@pytest.mark.parametrize("said", [{"size": len(CONTENT)}, {}], ids=["size said", "size not said"])
def test_the_disk_is_not_filled(tmp_path, shelf, said, monkeypatch):
    shelf.said = said
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=(1 << 30) + 1_000_000))
    with pytest.raises(FetchError, match=r"shelf://archive/a\.h5: .* bytes, but the disk of .* has room for 1000000"):
        fetch("shelf://archive/a.h5", tmp_path)
    assert files_in(tmp_path) == []
    assert shelf.opened == (0 if said else 1)


def test_errors_are_one_line_and_name_the_url(tmp_path, shelf):
    with pytest.raises(MissingFileError, match=r"^shelf://archive/gone\.h5: no such file$"):
        fetch("shelf://archive/gone.h5", tmp_path)
    with pytest.raises(
        FetchError, match=r"^shelf://archive/denied\.h5: cannot be fetched \(PermissionError: not for you really"
    ):
        fetch("shelf://archive/denied.h5", tmp_path)
    with pytest.raises(FetchError, match=r"^nonsense://x/a\.h5: cannot be fetched"):
        fetch("nonsense://x/a.h5", tmp_path)
    with pytest.raises(FetchError, match="is a folder"):
        fetch(tmp_path.as_uri(), tmp_path / "fetched")


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gcsfs", None)
    with pytest.raises(MissingPackageError, match=r"^gs://bucket/a\.h5: fetching it needs a package .*gcsfs"):
        fetch("gs://bucket/a.h5", tmp_path)
    for name in [name for name in sys.modules if name.split(".")[0] == "fsspec"]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingPackageError, match=r"needs fsspec: pip install 'tdacoustic\[cluster\]'"):
        fetch("shelf://archive/a.h5", tmp_path)


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("shelf://x/a.h5?signature=1#there", "a.h5"),
        ("shelf://x/Lauf%201%20(%C3%96l).h5", "Lauf 1 (Öl).h5"),
        ("shelf://x/..%2F..%2F..%2Fevil.h5", "evil.h5"),
        ("shelf://x/..", "log"),
        ("shelf://x/a%5C..%5Cb%3A.h5", "a_.._b_.h5"),
        ("shelf://x/" + "long" * 100 + ".h5", ("long" * 100 + ".h5")[-100:]),
    ],
)
def test_the_name_is_fit_for_a_disk_and_leads_nowhere(tmp_path, shelf, url, name):
    path = fetch(url, tmp_path)
    assert path.name == name
    assert path.resolve().is_relative_to(tmp_path.resolve())


def test_file_and_memory(tmp_path):
    source = tmp_path / "source" / "a.h5"
    source.parent.mkdir()
    source.write_bytes(b"one")
    first = fetch(source.as_uri(), tmp_path / "fetched")
    assert first.read_bytes() == b"one"
    assert fetch(source.as_uri(), tmp_path / "fetched") == first
    source.write_bytes(b"two")
    os.utime(source, (1, 1))
    assert fetch(source.as_uri(), tmp_path / "fetched").read_bytes() == b"two"
    fsspec.filesystem("memory").pipe_file("/logs/b.h5", b"three")
    assert fetch("memory://logs/b.h5", tmp_path / "fetched").read_bytes() == b"three"


@pytest.fixture
def web(tmp_path):
    """A web server of the folder ``web``; its address and what it was asked for."""
    pytest.importorskip("aiohttp", reason="fsspec needs it for http")
    asked = []

    class Handler(SimpleHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            super().do_GET()

        def log_message(self, *_):
            pass

    folder = tmp_path / "web"
    folder.mkdir()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}", folder, asked
    server.shutdown()
    server.server_close()
    thread.join(5)


def test_http(tmp_path, web):
    address, folder, asked = web
    (folder / "a.h5").write_bytes(CONTENT)
    first = fetch(f"{address}/a.h5", tmp_path / "fetched")
    assert first.read_bytes() == CONTENT
    gets = len(asked)
    assert fetch(f"{address}/a.h5", tmp_path / "fetched") == first
    assert len(asked) == gets  # it was asked for its head alone
    (folder / "a.h5").write_bytes(CONTENT[::-1])
    os.utime(folder / "a.h5", (1_000_000_000, 1_000_000_000))
    assert fetch(f"{address}/a.h5", tmp_path / "fetched").read_bytes() == CONTENT[::-1]
    with pytest.raises(MissingFileError, match=rf"^{address}/gone\.h5: no such file$"):
        fetch(f"{address}/gone.h5", tmp_path / "fetched")
