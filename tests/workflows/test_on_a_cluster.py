"""Campaigns on a real dask.distributed cluster: the same files, bit for bit."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small_campaigns import MIC, MOTOR, files_of, fleet_campaign, small_campaign
from test_fetched_logs import by_url

from tdacoustic.errors import AnalysisError
from tdacoustic.steps import Cluster
from tdacoustic.steps.cluster_link import forget
from tdacoustic.steps.cluster_worker import SharedStore

pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "steps"))

from dask_cluster import dask_cluster  # noqa: E402 - found only now


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    with dask_cluster(tmp_path_factory.mktemp("dask"), 2) as cluster:
        yield cluster.address
        forget(cluster.address)


@pytest.fixture
def elsewhere(monkeypatch):
    """No worker sees the store."""
    of = SharedStore.of
    monkeypatch.setattr(SharedStore, "of", lambda store: SharedStore(f"{of(store).folder}-not-there", ""))


def result_of_command(call_program, folder, *arguments):
    code, _, said = call_program(*arguments, "--store", folder / "store", "-o", folder / "out", "--quiet")
    assert code == 0, said
    return files_of(folder / "out")


def test_an_analysis_is_the_same_to_the_bit(tmp_path, call_program, address):
    campaign = small_campaign(tmp_path / "campaign", conditions=("a", "b"), channels=MIC + MOTOR)
    near, far = tmp_path / "near", tmp_path / "far"
    expected = result_of_command(call_program, near, "analyze", campaign, "--jobs", 1)
    assert {"levels.csv", "lines.csv", "sources.csv", "contributions.csv", "report.html"} <= set(expected)
    assert result_of_command(call_program, far, "analyze", campaign, "--scheduler", address) == expected
    assert list((far / "store" / "signs").iterdir()) == []


def test_without_a_shared_store_and_with_urls_it_is_too(tmp_path, call_program, address, elsewhere):
    pytest.importorskip("fsspec")
    campaign = by_url(tmp_path / "url", small_campaign(tmp_path / "campaign", conditions=("a", "b")))
    near, far = tmp_path / "near", tmp_path / "far"
    expected = result_of_command(call_program, near, "check", campaign, "--fetch-urls")
    assert result_of_command(call_program, far, "check", campaign, "--fetch-urls", "--scheduler", address) == expected


WORKFLOWS = {
    "run": "tdacoustic.workflows.run_one.run_into",
    "analyze": "tdacoustic.workflows.analyze.analyze",
    "check": "tdacoustic.workflows.analyze.analyze",
    "calibrate": "tdacoustic.workflows.calibrate.calibrate",
    "predict": "tdacoustic.workflows.predict.predict",
}


@pytest.mark.parametrize("command", WORKFLOWS)
def test_every_command_hands_its_options_on(tmp_path, call_program, monkeypatch, command):
    handed = []

    def workflow(*arguments, **options):
        handed.extend((*arguments, *options.items()))
        raise AnalysisError("far enough")

    monkeypatch.setattr(WORKFLOWS[command], workflow)
    monkeypatch.setattr(Cluster, "doubts", ("a doubt",))
    path = fleet_campaign(tmp_path).with_name("fleet.toml" if command == "predict" else "campaign.toml")
    more = [] if command == "predict" else ["--fetch-urls"]
    code, _, said = call_program(command, path, "--scheduler", "tcp://x:1", "-o", tmp_path / "out", *more)
    assert (code, said) == (1, "warning: a doubt\nerror: far enough\n")
    given = [one[1] if isinstance(one, tuple) else one for one in handed]
    (cluster,) = [one for one in given if isinstance(one, Cluster)]
    assert repr(cluster) == "Cluster('tcp://x:1')"
    assert command == "predict" or ("fetch_urls", True) in handed
    code, _, said = call_program(command, path, "--jobs", 2, "--scheduler", "tcp://x:1", "-o", tmp_path / "out")
    assert code == 2
    assert "leave one out" in said


def test_several_campaigns_hand_theirs_on_too(tmp_path, call_program, monkeypatch):
    handed = {}

    def run_many(*_, **options):
        handed.update(options)
        raise AnalysisError("far enough")

    monkeypatch.setattr("tdacoustic.workflows.run_many.run_many", run_many)
    monkeypatch.setattr(Cluster, "doubts", ())
    paths = [small_campaign(tmp_path / name, seconds=0.5, conditions=("a",)) for name in "ab"]
    code, _, said = call_program("run", *paths, "--scheduler", "tcp://x:1", "--fetch-urls", "-o", tmp_path / "out")
    assert (code, said) == (1, "error: far enough\n")
    assert repr(handed["inner"]) == "Cluster('tcp://x:1')"
    assert handed["fetch_urls"] is True


def test_a_cluster_that_cannot_be_used_is_said_before_anything_is_computed(tmp_path, call_program, monkeypatch):
    monkeypatch.setattr("tdacoustic.steps.cluster_link._CONNECT_S", 0.3)
    campaign = small_campaign(tmp_path / "campaign", conditions=("a",))
    code, _, said = call_program("run", campaign, "--scheduler", "tcp://127.0.0.1:9", "--store", tmp_path / "store")
    assert code == 1
    assert said.startswith("error: the scheduler tcp://127.0.0.1:9 does not answer")
    assert said.count("\n") == 1
    assert not (tmp_path / "store").exists()


def test_a_scheduler_lost_on_the_way_is_one_line_and_what_is_done_is_kept(tmp_path):
    campaign = small_campaign(tmp_path / "campaign", seconds=4.0)
    arguments = ["analyze", campaign, "--store", tmp_path / "store", "-o", tmp_path / "out"]
    with dask_cluster(tmp_path / "dask", 1) as cluster:
        command = [sys.executable, "-m", "tdacoustic", *map(str, arguments), "--scheduler", cluster.address]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        process = subprocess.Popen(command, stderr=subprocess.PIPE, env=environment)
        end = time.monotonic() + 60.0
        while not list((tmp_path / "store").rglob("*.npz")) and time.monotonic() < end:
            time.sleep(0.01)
        cluster.scheduler.kill()
        _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said.decode().startswith(f"error: the scheduler {cluster.address} was lost")
    assert said.decode().count("\n") == 1
    assert list((tmp_path / "store").rglob("*.npz"))
    assert not (tmp_path / "out").exists()
