"""What a reading says of a scale: set, checked, doubtful, and the mistakes that are named."""

import math

import pytest

from tdacoustic.errors import UnitError
from tdacoustic.sensors import parse_calibrator, series_of
from tdacoustic.sensors.calibrator_check import CalibratorRun, ChannelScale
from tdacoustic.sensors.calibrators import likely_mistake
from tdacoustic.sensors.channel_calibration import calibrate_channel
from tdacoustic.sensors.checking import check_tone
from tdacoustic.sensors.reading import Plateau, ToneReading

VOLTS = ChannelScale("mic", "V")
STATED = ChannelScale("mic", "V", 1.0, 20.0, "50 mV/Pa")


def plateau(rms, hz=1000.0, start_s=2.0, end_s=12.0, **keys):
    found = {"steadiness_db": 0.01, "wander_db": 0.0, "scatter_db": 0.001, "distortion": 0.001, "residue_db": -60.0}
    return Plateau(start_s, end_s, hz, rms, clipped=keys.pop("clipped", False), **(found | keys))


def run(kind="before", gives="94 dB", hz=None, series=1):
    return CalibratorRun(kind, kind, series, None if gives is None else parse_calibrator(gives), hz)


def check(*plateaus, scale=STATED, **keys):
    return check_tone(run(**keys), scale, ToneReading("mic", plateaus))


def test_what_calibrators_give(conformance):
    conformance(
        "pressure of a calibrator of 94 dB",
        1.00237,
        parse_calibrator("94 dB").rms,
        5e-6,
        "Pa",
        "analytic: 20 uPa x 10^(94/20)",
    )
    conformance(
        "level of a calibrator of 1 Pa",
        93.9794,
        parse_calibrator("1 Pa").level_db,
        5e-5,
        "dB",
        "analytic: 20 lg(1 Pa / 20 uPa)",
    )
    conformance(
        "rms of a calibrator of 1 g peak",
        6.93435,
        parse_calibrator("1 g peak").rms,
        5e-6,
        "m/s²",
        "analytic: 9.80665 m/s² / sqrt 2",
    )
    conformance(
        "frequency of a calibrator of vibration",
        1000 / (2 * math.pi),
        parse_calibrator("10 m/s^2").usual_hz[0],
        1e-3,
        "Hz",
        "analytic: 1000 rad/s",
    )
    assert parse_calibrator("114.0 dB re 20 µPa").quantity == "sound_pressure"
    assert parse_calibrator("10 m/s²").rms == 10.0
    assert parse_calibrator("20 m/s^2 pp").rms == pytest.approx(10.0 / math.sqrt(2.0))


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("94", "is not of the form"),
        ("loud", "is not of the form"),
        ("-94 dB", "is no level of a sound calibrator"),
        ("940 dB", "is no level of a sound calibrator"),
        ("94 dB re 1 pW", "is not of the form|not known"),
        ("94 dB(A)", "is not of the form|not known"),
        ("0 Pa", "must be positive"),
        ("1 V", "neither a sound pressure nor an acceleration"),
        ("94,0 dB", "is not of the form|not known"),
    ],
)
def test_what_is_no_calibrator(text, match):
    with pytest.raises(UnitError, match=match):
        parse_calibrator(text)


def test_a_right_scale_is_confirmed():
    found = check(plateau(0.05 * 1.00237))
    assert (found.verdict, round(found.deviation_db, 3)) == ("ok", 0.0)
    assert found.sigma_db == pytest.approx(0.25 / math.sqrt(3), rel=0.01)  # the calibrator's own decides


@pytest.mark.parametrize(
    ("ratio_db", "verdict", "words"),
    [
        (0.45, "ok", ""),
        (0.55, "warning", r"0.55 dB too high by the stated scale, more than 0.5 dB$"),
        (-3.0, "warning", "a peak value taken for an rms value"),
        (20.0, "warning", "94 dB calibrator taken for one of 114 dB or the reverse, or a factor of ten"),
        (-20.0, "warning", "factor of ten"),
        (60.0, "warning", "V for mV"),
    ],
)
def test_deviations_and_the_mistakes_behind_them(ratio_db, verdict, words):
    import re

    found = check(plateau(0.05 * 1.00237 * 10 ** (ratio_db / 20)))
    assert found.verdict == verdict
    assert re.search(words, found.reason)
    assert calibrate_channel([found]).verdict == verdict


def test_g_and_metres_and_ten_and_a_hundred_millivolts():
    assert "10 and 100 mV/g" in likely_mistake(20.0, "acceleration")
    assert "g taken for m/s^2" in likely_mistake(-19.83, "acceleration")
    assert "calibrator" not in likely_mistake(30.0, "acceleration") if likely_mistake(30.0, "acceleration") else True


@pytest.mark.parametrize(
    ("plateaus", "keys", "words"),
    [
        ((), {}, "no tone stands out"),
        ((plateau(0.05, clipped=True),), {}, "the tone is clipped"),
        ((plateau(0.05, hz=250.1),), {"hz": 1000.0}, "its tone is at 250.1 Hz, but 1000 Hz is stated"),
        ((plateau(0.05, hz=500.0),), {}, r"500 Hz, but 1000 or 250 Hz is usual for such a calibrator \[assumed\]"),
        ((plateau(0.05), plateau(0.06, start_s=20.0, end_s=25.0)), {}, "differ by up to 1.6 dB: which of them"),
    ],
)
def test_what_is_not_used(plateaus, keys, words):
    import re

    found = check(*plateaus, **keys)
    assert found.verdict == "bad" and not found.counts
    assert re.search(words, found.reason)
    assert calibrate_channel([found]).action == "reported"


def test_two_settings_of_one_calibrator_are_told_apart():
    low, high = plateau(0.05 * 1.00237), plateau(0.5 * 1.00237, start_s=20.0, end_s=40.0)
    for gives, factor in (("94 dB", 1.0), ("114 dB", 10.0)):
        found = check(low, high, gives=gives, scale=VOLTS)
        assert found.rms == pytest.approx(0.05 * 1.00237 * factor)
        assert "two levels 20.0 dB apart" in found.reason


def test_put_on_twice_is_averaged_and_widens_the_uncertainty():
    found = check(plateau(0.05), plateau(0.05 * 10 ** (0.4 / 20), start_s=20.0, end_s=25.0), scale=VOLTS)
    assert 20 * math.log10(found.rms / 0.05) == pytest.approx(0.2, abs=0.005)
    assert found.sigma_db > check(plateau(0.05), scale=VOLTS).sigma_db
    assert "put on 2 times, which differ by 0.40 dB" in found.reason


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"steadiness_db": 0.15}, "unsteady by 0.15 dB"),
        ({"wander_db": 0.4}, "unsteady by 0.40 dB"),
        ({"distortion": 0.05}, "harmonics are 5 % of the tone"),
        ({"residue_db": -12.0}, "all else is only 12 dB below the tone"),
    ],
)
def test_doubts_that_stop_nothing(keys, words):
    found = check(plateau(0.05 * 1.00237, **keys))
    assert found.verdict == "warning" and found.counts and words in found.reason


def test_without_a_stated_calibrator_nothing_is_done():
    found = check(plateau(0.05), gives=None)
    assert not found.counts and "states no calibrator" in found.reason
    assert (calibrate_channel([found]).action, calibrate_channel([found]).verdict) == ("reported", "ok")


def both(after_db, scale=VOLTS, override=False):
    sensitivity = 0.05 * 1.00237
    made = (("before", 0.0), ("after", after_db))
    checks = [check(plateau(sensitivity * 10 ** (d / 20)), scale=scale, kind=kind) for kind, d in made]
    return calibrate_channel(checks, override)


def test_a_scale_is_set_by_the_energy_mean_of_before_and_after():
    found = both(0.8)
    assert found.action == "set"
    mean_db = 10 * math.log10((1 + 10**0.08) / 2)
    assert 20 * math.log10(1 / found.scale.si_per_unit / 0.05) == pytest.approx(mean_db, abs=1e-4)
    assert found.drift_db == pytest.approx(0.8, abs=1e-9)
    assert found.verdict == "warning" and "more than 0.5 dB" in found.reason
    assert found.sigma_db == pytest.approx(math.hypot(0.25 / math.sqrt(3), 0.4 / math.sqrt(3)), rel=0.01)


def test_drift_up_to_half_a_decibel_is_in_order():
    assert both(0.49).verdict == "ok" and both(-0.51).verdict == "warning"


def test_a_stated_scale_is_checked_unless_it_is_to_be_set():
    wrong = ChannelScale("mic", "V", 1.0, 15.0, "66.7 mV/Pa")
    assert both(0.0, wrong).action == "checked" and both(0.0, wrong).scale == wrong
    replaced = both(0.0, wrong, override=True)
    assert replaced.action == "set" and replaced.scale.si_per_unit == pytest.approx(20.0, rel=1e-5)
    assert "instead of the stated scale, by which it reads -2.50 dB off" in replaced.reason


def test_a_sensitivity_that_no_sensor_has_is_said():
    found = calibrate_channel([check(plateau(0.5), scale=VOLTS)])
    assert found.verdict == "warning" and "more than sensors have; is the calibrator one of 20 dB" in found.reason


def test_readings_in_different_units_set_nothing():
    one, two = (
        check(plateau(0.05), scale=VOLTS),
        check(plateau(0.05), scale=ChannelScale("mic", "number"), kind="after"),
    )
    found = calibrate_channel([one, two])
    assert (found.action, found.verdict) == ("reported", "warning")


@pytest.mark.parametrize(
    ("kinds", "series"),
    [
        ("BTTA", "1111"),
        ("BTABTA", "111222"),
        ("BTBTA", "11222"),
        ("TTBA", "1111"),  # calibrators written behind their runs
        ("BBTAA", "11111"),
        ("TBTA", "1111"),
        ("BBAATT", "111111"),
        ("T", "1"),
    ],
)
def test_series(kinds, series):
    names = {"B": "calibration_before", "A": "calibration_after", "T": "test"}
    assert series_of([names[kind] for kind in kinds]) == tuple(int(number) for number in series)
