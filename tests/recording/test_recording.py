"""A recording reads its channels in SI, in blocks, and mixes no rasters."""

from dataclasses import replace

import numpy as np
import pytest
from array_recording import recording_of

from tdacoustic.errors import AnalysisError, FormatError
from tdacoustic.recording import Raster

DATA = np.arange(20.0).reshape(2, 10)


def test_values_are_scaled_and_cut():
    recording = recording_of(DATA, 10.0)
    channel = replace(recording["c1"], gain=2.0, offset=1.0, start_sample=3, n_samples=5, start_s=0.3)
    recording = replace(recording, channels=(recording["c0"], channel))
    assert recording.samples("c1").tolist() == (2.0 * DATA[1, 3:8] + 1.0).tolist()
    assert np.allclose(recording.times_s("c1"), 0.3 + np.arange(5) / 10.0)
    assert recording.samples("c0").tolist() == DATA[0].tolist()
    assert recording["c1"].duration_s == 0.5


@pytest.mark.parametrize("block", [1, 3, 10, 100])
def test_blocks_are_full_but_for_the_last(block):
    pieces = list(recording_of(DATA, 10.0).blocks(["c1", "c0"], block))
    assert np.array_equal(np.concatenate(pieces, axis=1), DATA[::-1])
    assert {piece.shape[1] for piece in pieces[:-1]} <= {block}


def test_channels_on_two_rasters_are_grouped_and_not_read_together():
    recording = recording_of(DATA, 10.0)
    recording = replace(recording, channels=(recording["c0"], replace(recording["c1"], n_samples=9)))
    assert recording.rasters() == (("c0",), ("c1",))
    with pytest.raises(AnalysisError, match="'c0' and 'c1' of run are on different rasters"):
        list(recording.blocks(["c0", "c1"], 4))


def test_an_unknown_channel_is_named_with_those_there_are():
    recording = recording_of(DATA, 10.0)
    with pytest.raises(AnalysisError, match="no channel 'mic' in run; there are c0, c1"):
        recording["mic"]
    assert [channel.name for channel in recording.only(["c1"]).channels] == ["c1"]


def test_a_raster_has_a_positive_rate_and_no_negative_length():
    assert Raster(10.0, 25).duration_s == 2.5
    assert Raster(None, 25).duration_s is None
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(FormatError, match="sample_rate_hz must be > 0, got"):
            Raster(rate, 1)
    with pytest.raises(FormatError, match="n_samples must be >= 0, got -1"):
        Raster(10.0, -1)
