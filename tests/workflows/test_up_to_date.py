"""A result is up to date as long as nothing changed that it rests on, and nothing that was written."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from small_campaigns import HEAD, MIC, fleet_campaign, small_campaign

from tdacoustic.steps import Store
from tdacoustic.workflows import up_to_date
from tdacoustic.workflows.up_to_date import standing

sys.path.insert(0, str(Path(__file__).parents[1] / "formats"))  # for the makers of logs

ROOT = Path(__file__).resolve().parents[2]

READ_BY = """
import json, sys
from pathlib import Path

root, opened = Path(sys.argv[1]).resolve(), set()


def hear(event, arguments):
    if event == "open" and isinstance(arguments[0], (str, bytes)):
        path = Path(arguments[0].decode() if isinstance(arguments[0], bytes) else arguments[0]).resolve()
        if path.is_relative_to(root):
            opened.add(path.relative_to(root).as_posix())


sys.addaudithook(hear)
from tdacoustic.cli import main

try:
    main(["run", str(root / "ride"), "-o", sys.argv[2], "--store", sys.argv[3], "--quiet", "--jobs", "1"])
except SystemExit as end:
    print(json.dumps([end.code or 0, sorted(opened)]))
"""


def finished(campaign, out, store):
    from tdacoustic.campaign import load_campaign
    from tdacoustic.workflows.output import OutputFolder
    from tdacoustic.workflows.run_one import run_into

    run_into(load_campaign(campaign), OutputFolder(out, campaign), store)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A campaign of two runs, one of whose logs is missing, with its fleet and its result."""
    root = tmp_path_factory.mktemp("made")
    campaign = fleet_campaign(root / "ride")
    (root / "ride" / "b.h5").rename(root / "b.h5")
    finished(campaign, root / "out", Store(root / "store"))
    return root


@pytest.fixture
def copy(made, tmp_path):
    """The same elsewhere: the manifest names no place of this machine."""
    shutil.copytree(made, tmp_path / "copy")
    return tmp_path / "copy"


def stands(root):
    return standing(root / "out", root / "ride" / "campaign.toml", Store(root / "store")) is not None


def test_what_has_just_been_made_stands(made, copy):
    assert stands(made) and stands(copy)
    held = standing(made / "out", made / "ride" / "campaign.toml", Store(made / "store"))
    assert (held.name, held.n_runs, held.n_conditions) == ("Small", 2, 2) and held.n_problems > 0


def test_what_is_no_part_of_the_result_changes_nothing(copy):
    (copy / "out" / "note of mine.txt").touch()
    (copy / "ride" / "protocol.pdf").touch()
    (copy / "ride" / "a.h5").touch()
    shutil.rmtree(copy / "store")
    assert stands(copy)


def flipped(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


CHANGES = {
    "the campaign": lambda root: flipped(root / "ride/campaign.toml"),
    "the fleet": lambda root: flipped(root / "ride/fleet.toml"),
    "one byte of a log": lambda root: flipped(root / "ride/a.h5"),
    "a log is gone": lambda root: (root / "ride/a.h5").unlink(),
    "a log is a folder": lambda root: ((root / "ride/a.h5").unlink(), (root / "ride/a.h5").mkdir()),
    "the missing log came": lambda root: (root / "b.h5").rename(root / "ride/b.h5"),
    "a table of the result": lambda root: flipped(root / "out/levels.csv"),
    "a table is gone": lambda root: (root / "out/levels.csv").unlink(),
    "no manifest": lambda root: (root / "out/manifest.json").unlink(),
    "the campaign is gone": lambda root: shutil.rmtree(root / "ride"),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_any_change_is_seen(copy, change):
    change(copy)
    assert not stands(copy)


def manifest_with(**keys):
    def change(root):
        path = root / "out/manifest.json"
        path.write_text(json.dumps({**json.loads(path.read_text(encoding="utf-8")), **keys}), encoding="utf-8")

    return change


@pytest.mark.parametrize(
    "change",
    [
        manifest_with(complete=False),
        manifest_with(command="analyze"),
        manifest_with(schema="other/1"),
        manifest_with(subject="../elsewhere/campaign.toml"),
        manifest_with(made_from=None),
        manifest_with(made_from=[]),
        manifest_with(counts={"runs": "2", "conditions": None}),
        manifest_with(campaign=None, counts=None),
        manifest_with(files={}),
        manifest_with(files={"../ride/campaign.toml": "0"}),
    ],
)
def test_a_manifest_that_says_something_else(copy, change):
    change(copy)
    assert not stands(copy)


@pytest.mark.parametrize("files", [{}, {"\x00": None}, {"//server/share": None}, {"a.h5": 3}, None])
def test_a_manifest_with_odd_files(copy, files):
    held = json.loads((copy / "out/manifest.json").read_text(encoding="utf-8"))
    manifest_with(made_from={**held["made_from"], "files": files})(copy)
    assert not stands(copy)


def test_other_software_is_seen(copy, monkeypatch):
    monkeypatch.setattr(up_to_date, "software", lambda: "0" * 64)
    assert not stands(copy)


@pytest.mark.parametrize("name", ["source_sha256", "versions", "_more_versions"])
def test_the_software_is_its_files_and_its_libraries(monkeypatch, name):
    up_to_date.software.cache_clear()
    before = up_to_date.software()
    monkeypatch.setattr(up_to_date, name, lambda: "" if name == "source_sha256" else [("numpy", "0.1")])
    up_to_date.software.cache_clear()
    assert up_to_date.software() != before
    up_to_date.software.cache_clear()


def test_a_file_that_changes_while_it_is_read_leaves_nothing_to_stand_on(made, copy):
    from tdacoustic.campaign import load_campaign
    from tdacoustic.results import LogInput
    from tdacoustic.workflows.made_from import FilesRead

    campaign = load_campaign(copy / "ride")
    read = FilesRead(campaign, Store(copy / "store"))
    assert read.made_from(())["files"].keys() == {"a.h5", "b.h5", "campaign.toml", "fleet.toml"}
    assert read.made_from((LogInput("a.h5", "0" * 64, 1, "hdf5"),)) is None
    flipped(copy / "ride/fleet.toml")
    assert read.made_from(()) is None


def everything_campaign(root):
    """A campaign that reads a file of each kind, below one folder; some of them wrong or missing."""
    from makers_atfx import make_atfx_components

    folder = root / "ride"
    path = small_campaign(folder, conditions=("a",))
    (root / "other").mkdir()
    (root / "atfx").mkdir()
    log = make_atfx_components(root / "atfx").path
    assert len(list((root / "atfx").iterdir())) == 2  # the log and a file that it names
    fleet_campaign(root / "other", conditions=("o",))
    shutil.copy(root / "other/fleet.toml", root / "fleet.toml")
    (folder / "damaged.h5").write_bytes(b"no HDF5")
    (folder / "runs.csv").write_text(
        f"condition,logs,train_speed_km_h\na,a.h5,30\na,missing.h5,30\na,damaged.h5,30\na,../atfx/{log.name},30\n"
    )
    named = 'fleet = "../fleet.toml"\nruns = "runs.csv"\nsensors = "sensors.csv"\ntemplate = "../house"\n'
    head = HEAD.replace("\n\n", f"\n{named}\n", 1)
    house = root / "house"
    house.mkdir()
    (house / "template.toml").write_text('schema = "tdacoustic-template/1"\ncompany = "House"\nlogo = "logo.png"\n')
    (house / "logo.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    fit = '[calibration]\nwith_campaigns = ["../other"]\nprior_fleet = "../other/fleet.toml"\n'
    (folder / "sensors.csv").write_text("serial,sensitivity,unit\n1,50,mV/Pa\n")
    path.write_text(head.replace('"Small"', '"All"') + MIC + fit, encoding="utf-8")
    return path


def test_every_file_that_a_run_opens_stands_in_its_manifest(tmp_path):
    """Held against what the interpreter itself says that was opened (``sys.addaudithook``)."""
    campaign = everything_campaign(tmp_path / "root")
    command = [sys.executable, "-c", READ_BY, tmp_path / "root", tmp_path / "out", tmp_path / "store"]
    done = subprocess.run([*map(str, command)], capture_output=True, cwd=ROOT, check=True)
    code, opened = json.loads(done.stdout.decode().splitlines()[-1])
    assert code == 0, done.stderr.decode()
    manifest = json.loads((tmp_path / "out/manifest.json").read_text(encoding="utf-8"))
    named = {(campaign.parent / name).resolve() for name in manifest["made_from"]["files"]}
    missing = {path for path in opened if (tmp_path / "root").resolve() / path not in named}
    assert not missing
    assert len(opened) >= 7, opened
