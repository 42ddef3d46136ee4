"""Which channels are held against each other, and the step that does so over blocks."""

from dataclasses import replace

import numpy as np
import pytest
from array_recording import ArrayReader, recording_of

from tdacoustic.contributions import measure_cross_spectra
from tdacoustic.measured import cross_spectra_step
from tdacoustic.measured.cross_spectra_step import CROSS_SPECTRA, cross_channels, cross_spectra_settings
from tdacoustic.measured.tasks import as_read
from tdacoustic.recording import Log, Recording

RATE = 2048.0
KINDS = ("acceleration", "acceleration", "sound_pressure", "sound_pressure")


def recording(components=("motor", "gearbox", "air", "air"), roles=(None, None, "receiver", "near_field"), seconds=8.0):
    rng = np.random.default_rng(0)
    made = recording_of(rng.standard_normal((4, int(seconds * RATE))), RATE, KINDS)
    held = zip(made.channels, components, roles, strict=True)
    return replace(made, channels=tuple(replace(c, component=part, role=role) for c, part, role in held))


USABLE = ("c0", "c1", "c2", "c3")


def test_accelerometers_with_a_component_are_the_references():
    got = cross_channels(recording(), ["c2"], USABLE)
    assert (got.references, got.receivers) == (("c0", "c1"), ("c2",))
    assert got.left_out == (("c3", "no component is named that the sensor belongs to"),)


def test_a_near_field_microphone_with_a_component_is_one_too():
    got = cross_channels(recording(components=("motor", "gearbox", "air", "motor")), ["c2"], USABLE)
    assert got.references == ("c0", "c1", "c3")


def test_bad_channels_and_nameless_ones_are_left_out_with_their_reason():
    got = cross_channels(recording(components=("motor", None, "air", "air")), ["c2"], ("c0", "c1", "c2"))
    assert got.references == ("c0",)
    assert dict(got.left_out)["c1"].startswith("no component")
    got = cross_channels(recording(), ["c2"], ("c1", "c2"))
    assert ("c0", "its quality is bad") in got.left_out


@pytest.mark.parametrize("usable", [("c0", "c1"), ("c2",), ()])
def test_without_references_or_receivers_there_is_nothing(usable):
    got = cross_channels(recording(), ["c2"], usable)
    assert (got.references, got.receivers) == ((), ())


def test_what_is_on_another_raster_is_left_out():
    made = recording()
    channels = list(made.channels)
    channels[1] = replace(channels[1], start_s=0.5)
    got = cross_channels(replace(made, channels=tuple(channels)), ["c2"], USABLE)
    assert got.references == ("c0",)
    assert dict(got.left_out)["c1"].startswith("another log, rate or start than c2")


def test_the_step_is_one_pass_over_blocks(monkeypatch):
    """The same as of the whole record at once, whatever the block."""
    made = recording()
    settings = cross_spectra_settings([as_read(c) for c in made.only(["c0", "c1", "c2"]).channels], 2, steady=True)
    monkeypatch.setattr(
        cross_spectra_step, "scan", lambda path: Log(path, "array", (), ArrayReader(made.logs[0].reader.data))
    )
    monkeypatch.setattr(cross_spectra_step, "BLOCK_BYTES", 8 * 3 * 1500)

    class Path:
        path = made.logs[0].path

    got = cross_spectra_step.measure_cross_spectra(settings, (Path(),))
    whole = measure_cross_spectra(made, ["c0", "c1"], ["c2"], 4.0, 0.5, 0.4 * RATE, 16)
    np.testing.assert_array_equal(got.density, whole.density)
    assert got.plan.frames.n_segments == 16 and got.frequencies_hz[-1] == pytest.approx(0.4 * RATE, abs=4.0)


def test_segments_are_what_memory_leaves():
    """A run-up has more segments; many channels at a high rate fewer, but never less than eight."""
    channel = as_read(recording(seconds=60.0).channels[0])
    few = [replace(channel, name=f"c{k}") for k in range(3)]
    assert cross_spectra_settings(few, 2, steady=True).max_segments == 16
    assert cross_spectra_settings(few, 2, steady=False).max_segments == 64
    many = [replace(channel, name=f"c{k}", sample_rate_hz=51200.0, n_samples=51200 * 60) for k in range(16)]
    settings = cross_spectra_settings(many, 14, steady=False)
    assert settings.max_segments == 8 and settings.max_frequency_hz == 5000.0


def test_names_of_components_are_not_in_the_key():
    made = recording()
    other = recording(components=("wheelset", "bogie", "air", "air"))
    keys = {
        CROSS_SPECTRA.task("x", cross_spectra_settings([as_read(c) for c in r.channels[:3]], 2, steady=True)).key
        for r in (made, other)
    }
    assert len(keys) == 1
    assert isinstance(made, Recording)
