"""From files to recordings: pulses stored as true and false, and rates that a log leaves to the campaign."""

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from tdacoustic.campaign import CampaignChannel, CampaignRun, WrittenPath
from tdacoustic.formats import scan
from tdacoustic.ingest import bind_run

RATE_HZ = 51200.0
PULSES = np.arange(4000) % 100 < 30


def bound(path, channel, **run):
    made = CampaignRun(name="1", condition="1", logs=(WrittenPath(path.name, path),), **run)
    return bind_run([channel], made, [scan(path)])


def tdms(path):
    with TdmsWriter(str(path)) as writer:
        writer.write_segment([ChannelObject("log", "tacho", PULSES, {"wf_increment": 1.0 / RATE_HZ})])


def hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("tacho", data=PULSES).attrs["fs"] = RATE_HZ


@pytest.mark.parametrize("write", [tdms, hdf5])
def test_true_and_false_are_the_pulses_of_a_tacho(tmp_path, write):
    write(tmp_path / "a.log")
    found = bound(tmp_path / "a.log", CampaignChannel(name="tacho", quantity="tacho", pulses_per_rev=1.0))
    channel = found.recording["tacho"]
    assert (channel.si_symbol, channel.gain, channel.offset, channel.limits) == ("1", 1.0, 0.0, None)
    assert "logical values: 0 and 1" in channel.flags
    (block,) = found.recording.logs[0].reader.blocks([0], 0, PULSES.size, PULSES.size)
    assert np.array_equal(block[0], PULSES.astype(float))


def test_a_rate_in_doubt_is_asked_for_and_then_taken_from_the_campaign(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Sample rate: 51,200 Hz\nmic [Pa]\n" + "0.5\n" * 100)
    mic = CampaignChannel(name="mic")
    (refused,) = bound(path, mic).refused
    assert "the log states no sampling rate, add sample_rate_hz = ... to its [[run]]" in refused.reason
    assert bound(path, mic, sample_rate_hz=RATE_HZ).recording["mic"].sample_rate_hz == RATE_HZ
