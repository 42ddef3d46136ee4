"""Whose tone: the judged noise line of this channel and run first, other receivers where they agree, else orders."""

from types import SimpleNamespace

import numpy as np
import pytest

from tdacoustic.fleet import GearStage, Kinematics
from tdacoustic.speed import SpeedProfile
from tdacoustic.tones import ToneLabel
from tdacoustic.workflows.tone_origins import NOBODY, SpeedOverTime, expected_at, known_origin, origin


def tone(frequency, error=0.05):
    return SimpleNamespace(frequency_hz=frequency, frequency_error_hz=error)


def source(channel, owner, members, name="mesh x1", conflict=False):
    lines = tuple((run, SimpleNamespace(line=tone(frequency))) for run, frequency in members)
    line = SimpleNamespace(channel=channel, members=lines)
    return SimpleNamespace(line=line, source=owner, excitation_name=name, excitation="mesh", conflict=conflict)


def test_the_line_of_its_own_channel_goes_first():
    held = [source("right", "motor", [("a", 300.0)]), source("left", "gearbox", [("a", 300.2)])]
    assert known_origin(tone(300.0), "left", "a", held, 1.0).owner == "gearbox"
    assert known_origin(tone(300.0), "right", "a", held, 1.0).owner == "motor"


def test_other_receivers_speak_only_where_they_agree():
    one, other = source("right", "motor", [("a", 300.0)]), source("up", "gearbox", [("a", 300.1)])
    assert known_origin(tone(300.0), "near", "a", [one], 1.0).owner == "motor"
    assert known_origin(tone(300.0), "near", "a", [one, other], 1.0) is None


def test_the_line_of_another_run_is_another_tone():
    held = [source("left", "motor", [("b", 300.0)]), source("left", "gearbox", [("a", 306.0)])]
    assert known_origin(tone(300.0), "left", "a", held, 1.0) is None
    assert known_origin(tone(306.0), "left", "a", held, 1.0).owner == "gearbox"


@pytest.mark.parametrize(("spacing", "found"), [(1.0, False), (2.7, True)])
def test_half_a_line_of_the_spectrum_that_shows_the_tone_is_near(spacing, found):
    held = [source("left", "motor", [("a", 301.2)])]
    assert (known_origin(tone(300.0), "left", "a", held, spacing) is not None) is found


def test_a_conflict_and_an_unknown_order_are_said():
    held = [source("left", "motor", [("a", 300.0)], conflict=True)]
    assert known_origin(tone(300.0), "left", "a", held, 1.0).notes == ("sensor and order disagree",)
    nameless = source("left", "unassigned", [("a", 300.0)], name=None)
    nameless.excitation = "unknown"
    assert known_origin(tone(300.0), "left", "a", [nameless], 1.0) == NOBODY


def test_an_ambiguous_label_names_the_rivals():
    assert origin(ToneLabel(None, None)) == NOBODY
    found = origin(ToneLabel("mesh x1", "gearbox", 0.0, 1.0, ("motor shaft x2",), True))
    assert (found.owner, found.notes) == ("ambiguous", ("or motor shaft x2",))
    assert origin(ToneLabel("slot", None)).owner == "unassigned"


DRIVE = Kinematics(1.0, (GearStage("1", (20, 60)),))
T = np.arange(0.0, 30.01, 0.1)


def profile(shaft, symbol, speed):
    return SpeedProfile("s", shaft, symbol, T, speed)


@pytest.mark.parametrize(
    ("shaft", "symbol", "factor"), [("motor", "1/s", 1.0), ("wheelset", "1/s", 1.0 / 3.0), (None, "m/s", np.pi / 3.0)]
)
def test_the_motor_follows_from_any_shaft(shaft, symbol, factor):
    over_time = SpeedOverTime(profile(shaft, symbol, factor * (8.0 + 0.1 * T)), DRIVE)
    stretch = over_time.stretch(10.0, 13.0)
    assert over_time.unit == "km/h"
    assert stretch.motor_hz == pytest.approx(9.15, rel=1e-6)
    assert (stretch.low, stretch.high) == pytest.approx((9.0 / 3 * np.pi * 3.6, 9.3 / 3 * np.pi * 3.6), rel=1e-6)
    assert stretch.change == pytest.approx(0.3 / 9.15, rel=1e-6)
    names = {item.name for item in expected_at(DRIVE, stretch, 5000.0)}
    assert "mesh x1" in names and "mesh x12" in names and "mesh x13" not in names


def test_without_a_fleet_the_speed_is_the_shafts_own():
    stretch = SpeedOverTime(profile("wheelset", "1/s", 8.0 + 0.1 * T), None).stretch(10.0, 13.0)
    assert (stretch.low, stretch.high, stretch.motor_hz) == (pytest.approx(540.0), pytest.approx(558.0), None)
    assert expected_at(None, stretch, 5000.0) == ()
    motor = SpeedOverTime(profile("motor", "1/s", 8.0 + 0.1 * T), None)
    assert motor.unit == "rpm" and motor.stretch(10.0, 13.0).motor_hz == pytest.approx(9.15)


def test_a_stretch_whose_speed_is_not_known_has_none():
    over_time = SpeedOverTime(profile("motor", "1/s", 8.0 + 0.1 * T), DRIVE)
    assert over_time.stretch(29.0, 32.0) is None
    assert over_time.stretch(27.5, 30.5) is not None  # a sixth of it is missing


def test_backwards_is_a_speed_too():
    stretch = SpeedOverTime(profile("motor", "1/s", -(8.0 + 0.1 * T)), DRIVE).stretch(10.0, 13.0)
    assert stretch.motor_hz == pytest.approx(9.15) and stretch.low < stretch.high
