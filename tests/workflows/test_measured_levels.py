"""The data of a calibration: what of a campaign's recordings a model is held against, and how well it is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from level_campaigns import REFERENCE, Made, campaign_of, mic, run_of, tone
from small_campaigns import RATE_HZ, table

from tdacoustic.errors import FittingError
from tdacoustic.workflows.measured_levels import campaign_conditions, measured_levels

LEFT = {"distance_m": 4.0, "height_above_rail_m": 1.2, "side": "left"}


# ------------------------------------------------------------ overall levels


def test_microphones_that_are_doubtful_by_calibrator_are_said(tmp_path):
    """The left one's sensitivity is stated 3 dB too high; the far one's too, but it feeds no 4 m level."""
    true_volts = {"left": 0.05, "right": 0.05, "far": 0.05}
    stated = {"left": 50.0 * 10 ** (3 / 20), "right": 50.0, "far": 100.0}
    channels = "".join(
        mic(name, distance_m=distance_m, sensitivity=f"{stated[name]:.6g} mV/Pa")
        for name, distance_m in (("left", 4.0), ("right", 4.0), ("far", 7.5))
    )
    calibrator = {name: (tone(94.0, 1000.0, 12.0) * volts, "V") for name, volts in true_volts.items()}
    drive = {name: (tone(80.0, 500.0) * volts, "V") for name, volts in true_volts.items()}
    before = table("run", name="cal", kind="calibration_before", logs=["cal.h5"], calibrator="94 dB")
    made = Made(tmp_path, channels, [before, run_of("a", "a1")], {"cal": calibrator, "a1": drive})
    (datum,), doubts = made.levels()
    said = [doubt for doubt in doubts if "doubtful by calibrator" in doubt]
    assert len(said) == 1
    assert said[0].startswith("channel left: doubtful by calibrator (read -3.00 dB off the stated scale, more than 0.5")
    # the level itself stays: 80 dB of the right one, 77 of the left one
    assert datum.level_db == pytest.approx(10 * math.log10((1e8 + 10**7.7) / 2), abs=0.01)
    _, doubts = made.levels("receivers")
    assert {doubt.split(":")[0] for doubt in doubts if "by calibrator" in doubt} == {"channel left", "channel far"}


def test_the_4_m_level_is_the_energy_mean_over_runs_and_receivers(tmp_path, conformance):
    levels = {"a1": ("a", {"left": 80.0, "right": 90.0, "far": 60.0}), "a2": ("a", {"left": 80.0, "right": 90.0})}
    channels = mic("left", distance_m=4.0) + mic("right", distance_m=4.19) + mic("far", distance_m=7.5)
    levels["a2"][1]["far"] = 60.0
    (datum,), doubts = campaign_of(tmp_path, levels, channels).levels()
    source = "analytic: 10 lg of the mean energy of 80 and 90 dB"
    conformance("level at 4 m of two receivers and two runs", 87.404, datum.level_db, 0.01, "dB", source)
    assert (datum.receiver.name, datum.receiver.distance_m, datum.receiver.position_m) == ("4 m", 4.0, None)
    assert (datum.what, datum.band_hz, datum.group, datum.origin) == ("overall", None, "a", "measured")
    assert doubts == []


def test_a_microphone_at_the_machine_is_no_receiver_at_4_m(tmp_path):
    near_field = table("channel", name="motor", role="near_field", quantity="sound_pressure", distance_m=4.0)
    levels = {"a1": ("a", {"left": 80.0, "motor": 100.0})}
    (datum,), _ = campaign_of(tmp_path, levels, mic("left", position_m=[0.0, 4.0, 0.0]) + near_field).levels()
    assert datum.level_db == pytest.approx(80.0, abs=0.01)


def test_standard_deviations_are_pooled_over_conditions(tmp_path):
    """Runs of a differ by 2 dB and those of b by 0: s = 1 dB of two degrees of freedom; c has one run and the same."""
    levels = {
        **{"a1": ("a", {"m": 79.0}), "a2": ("a", {"m": 81.0})},
        **{"b1": ("b", {"m": 80.0}), "b2": ("b", {"m": 80.0}), "c1": ("c", {"m": 80.0})},
    }
    data, _ = campaign_of(tmp_path, levels).levels(level_sigma_db=0.5)
    widened = 1.3213  # Student, two degrees of freedom
    expected = {"a": math.sqrt(0.5), "b": math.sqrt(0.5), "c": 1.0}
    for datum in data:
        name = datum.condition.name
        assert datum.sigma_db == pytest.approx(math.hypot(0.5, widened * expected[name]), rel=0.01)
        assert "sigma of instruments 0.5 dB, runs (scatter over 2 degrees of freedom)" in datum.source


def test_one_run_a_condition_has_what_its_record_shows(tmp_path):
    made = campaign_of(tmp_path, {"a1": ("a", {"m": 80.0}), "b1": ("b", {"m": 80.0})})
    data, _ = made.levels()
    assert all("the record itself (no condition was run twice)" in datum.source for datum in data)
    assert data[0].sigma_db == pytest.approx(0.3, abs=0.001)  # a steady tone
    (datum, _), _ = made.levels(store=None)
    assert "the spread between runs not known" in datum.source


def test_noise_of_few_hertz_has_the_scatter_of_its_record(tmp_path):
    t = np.arange(round(20.0 * RATE_HZ)) / RATE_HZ
    spectrum = np.fft.rfft(np.random.default_rng(3).standard_normal(t.size))
    frequencies = np.fft.rfftfreq(t.size, 1.0 / RATE_HZ)
    spectrum[(frequencies < 500.0) | (frequencies > 510.0)] = 0.0
    made = Made(tmp_path, mic("m", distance_m=4.0), [run_of("a", "a1")], {"a1": {"m": (np.fft.irfft(spectrum), "Pa")}})
    (datum,), _ = made.levels()
    # 4.34 / sqrt(10 Hz · 20 s) = 0.31 dB, estimated from some 38 segments
    assert math.sqrt(datum.sigma_db**2 - 0.3**2) == pytest.approx(0.31, rel=0.4)


def test_each_receiver_at_its_own_place(tmp_path):
    channels = mic("left", **LEFT) + mic("far", distance_m=7.5) + mic("top", position_m=[1.0, 0.0, 3.0])
    channels += mic("lost") + table("channel", name="none", quantity="sound_pressure", distance_m=4.0)
    levels = {"a1": ("a", {"left": 80.0, "far": 70.0, "top": 75.0, "lost": 60.0, "none": 50.0})}
    data, doubts = campaign_of(tmp_path, levels, channels).levels("receivers")
    found = {datum.receiver.name: datum for datum in data}
    assert {name: round(datum.level_db, 1) for name, datum in found.items()} == {"left": 80.0, "far": 70.0, "top": 75.0}
    z = 1.2 - 0.5 * 1.05112
    assert found["left"].receiver.position_m == pytest.approx((0.0, math.sqrt(16.0 - z * z), z))
    assert (found["far"].receiver.distance_m, found["far"].receiver.position_m) == (7.5, None)
    assert found["top"].receiver.position_m == (1.0, 0.0, 3.0)
    assert found["top"].receiver.distance_m == pytest.approx(math.sqrt(10.0))
    assert doubts == ["channel lost is a receiver without position_m or distance_m: it has no place"]


def test_the_same_recordings_twice_are_said(tmp_path):
    made = campaign_of(tmp_path, {"a1": ("a", {"m": 80.0})})
    _, doubts = made.levels("surface", "receivers", "bands")
    assert "the 4 m level and its receivers and bands are of the same recordings, which count more than once" in doubts


def test_bad_channels_do_not_enter_and_are_said(tmp_path):
    logs = {"good": (tone(80.0, 500.0), "Pa"), "dead": (np.zeros(round(3 * RATE_HZ)), "Pa")}
    made = Made(tmp_path, "".join(mic(n, distance_m=4.0) for n in logs), [run_of("a", "a1")], {"a1": logs})
    for data in (("surface",), ("receivers",), ("bands",)):
        found, doubts = made.levels(*data)
        overall = [datum for datum in found if datum.what in ("overall", "1/3 octave 500 Hz")]
        assert [datum.level_db for datum in overall] == pytest.approx([80.0], abs=0.05)
        (doubt,) = [doubt for doubt in doubts if not doubt.startswith("third-octave")]
        assert doubt.startswith("run a1, channel dead: bad (") and "do not feed the calibration" in doubt


def test_a_verdict_alone_is_enough_to_leave_a_channel_out(tmp_path):
    made = campaign_of(tmp_path, {"a1": ("a", {"one": 80.0, "two": 90.0})})
    quality = made.analysis.tables["quality"].copy()
    quality.loc[(quality["channel"] == "two") & (quality["check"] == "level"), "verdict"] = "bad"
    made.analysis = replace(made.analysis, tables={**made.analysis.tables, "quality": quality})
    for data in (("surface",), ("bands",)):
        found, doubts = made.levels(*data)
        assert max(datum.level_db for datum in found) == pytest.approx(80.0, abs=0.05)
        assert "run a1, channel two: bad (level, rms" in doubts[0]


def test_a_level_in_the_background_is_an_upper_bound(tmp_path):
    logs = {
        "a1": {"m": (tone(80.0, 500.0), "Pa")},
        "b1": {"m": (tone(90.0, 500.0), "Pa")},
        "quiet": {"m": (tone(79.0, 500.0), "Pa")},
    }
    silence = table("run", name="quiet", kind="background", logs=["quiet.h5"])
    made = Made(tmp_path, mic("m", distance_m=4.0), [run_of("a", "a1"), run_of("b", "b1"), silence], logs)
    (datum,), doubts = made.levels()
    expected = 10.0 * math.log10(1e9 - 10.0**7.9)
    assert (datum.condition.name, datum.level_db) == ("b", pytest.approx(expected, abs=0.01))
    assert doubts[0].startswith("run a1, channel m: less than 3 dB above the background, so its level is an upper")
    data, doubts = made.levels("bands")
    (band,) = [datum for datum in data if datum.what == "1/3 octave 500 Hz"]
    assert (band.condition.name, band.level_db) == ("b", pytest.approx(expected, abs=0.05))
    assert "less than 3 dB above the background" in doubts[0]


# ------------------------------------------------------------ third octaves


def test_third_octaves_at_4_m(tmp_path):
    """A tone in each of two bands, over a floor that keeps their neighbours clear of the filters' skirts."""
    t = tone(80.0, 500.0, floor_db=80.0) + tone(85.0, 1250.0, floor_db=-20.0)
    exclude = table("exclude", condition="a", frequency_hz=[90.0, 101.0], reason="fan")
    made = Made(tmp_path, mic("m", distance_m=4.0), [run_of("a", "a1")], {"a1": {"m": (t, "Pa")}}, exclude)
    data, doubts = made.levels("bands")
    found = {datum.what: datum for datum in data}
    assert found["1/3 octave 1250 Hz"].band_hz == pytest.approx((1122.02, 1412.54), rel=1e-5)
    lines = found["1/3 octave 500 Hz"], found["1/3 octave 1250 Hz"]
    in_band = [10.0 ** (0.1 * 80.0) * (band[1] - band[0]) / (0.5 * RATE_HZ) for band in (d.band_hz for d in lines)]
    expected = [10.0 * math.log10(10.0**level + noise) for level, noise in zip((8.0, 8.5), in_band, strict=True)]
    assert [datum.level_db for datum in lines] == pytest.approx(expected, abs=0.3)
    assert {datum.receiver.name for datum in data} == {"4 m"} and {datum.group for datum in data} == {"a"}
    # From 20 Hz to the last band below the model's 3000 Hz (and the rate's 0.45); 100 Hz is excluded.
    edges = [datum.band_hz for datum in data]
    assert edges == sorted(edges) and min(edges)[0] == pytest.approx(17.78, abs=0.01)
    assert max(edges)[1] <= 3000.0
    assert "1/3 octave 100 Hz" not in found and "1/3 octave 80 Hz" in found
    # The skirt of a filter is no level.
    loud = Made(tmp_path / "loud", mic("m", distance_m=4.0), [run_of("a", "a1")], {"a1": {"m": (tone(90, 500), "Pa")}})
    data, doubts = loud.levels("bands")
    assert "1/3 octave 630 Hz" not in {datum.what for datum in data}
    assert doubts[0].startswith("third-octave levels of single runs and receivers left out: ")
    assert "decided by a strong line beside the band" in doubts[0]


def test_bands_beyond_the_model_are_left_out(tmp_path):
    fleet = REFERENCE.read_text(encoding="utf-8").replace("max_frequency_hz = 3000", "max_frequency_hz = 900")
    logs = {"a1": {"m": (tone(80.0, 500.0, floor_db=80.0), "Pa")}}
    data, _ = Made(tmp_path, mic("m", distance_m=4.0), [run_of("a", "a1")], logs, fleet=fleet).levels("bands")
    assert max(datum.band_hz[1] for datum in data) == pytest.approx(891.25, abs=0.01)


# ------------------------------------------------------------ conditions and what is refused


def test_conditions_have_the_speed_of_their_runs_and_wheels(tmp_path):
    keys = {
        "a1": {"torque_n_m": 100.0},
        "a2": {"torque_n_m": 300.0},
        "b1": {"wheel_diameter_mm": 1000.0},
        "c1": {"train_speed_km_h": 0.0},
        "d1": {"mode": "hauled"},
    }
    levels = {name: (name[0], {"m": 80.0}) for name in keys}
    made = campaign_of(tmp_path, levels, run_keys=keys)
    conditions, doubts = campaign_conditions(made.campaign, made.analysis, made.fleet)
    assert set(conditions) == {"a", "b", "d"}
    assert conditions["a"].torque_n_m == 200.0
    assert conditions["b"].motor_hz == pytest.approx(30.0 / 3.6 / math.pi * 104 / 31)
    assert conditions["d"].torque_n_m == 5913.0
    assert doubts[0] == "condition c stands still, where the model has no sound: it is left out"
    assert doubts[1].startswith("the runs were hauled and state no torque: the model computes the fleet's traction")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (("surface", "spectra"), "data must be out of surface, receivers, bands, orders, got spectra"),
        ((), "data must be out of surface, receivers, bands, orders, got nothing"),
    ],
)
def test_what_there_is_not_is_refused(tmp_path, data, message):
    made = campaign_of(tmp_path, {"a1": ("a", {"m": 80.0})})
    with pytest.raises(FittingError, match=message):
        measured_levels(made.campaign, made.analysis, made.fleet, data)


def test_no_level_at_all_and_no_sigma_at_all_are_refused(tmp_path):
    made = campaign_of(tmp_path, {"a1": ("a", {"m": 80.0})}, mic("m", distance_m=7.5))
    with pytest.raises(FittingError, match="no level to calibrate with: no receiver within 5 % of 4 m"):
        made.levels()
    with pytest.raises(FittingError, match="standard deviation must be > 0 dB"):
        made.levels("receivers", level_sigma_db=0.0, store=None)
