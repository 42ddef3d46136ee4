"""Levels of ISO 3095 and ISO 3381 from made-up passages; what is missing is named, and no level is made up."""

import math

import numpy as np
import pytest

from tdacoustic.errors import AnalysisError
from tdacoustic.railway import (
    ISO_3095_2013,
    ISO_3095_2025,
    ISO_3381_2021,
    UNVERIFIED,
    Conditions,
    Passage,
    braking,
    constant_speed,
    pass_by,
    starting,
    stationary,
    transit_exposure,
)
from tdacoustic.spectra.time_weighting import LevelMeter

RATE = 8192.0
LENGTH_M, SPEED_KM_H, DISTANCE_M = 100.0, 80.0, 7.5
FRONT_S, SECONDS = 8.0, 22.0
TP_S = LENGTH_M / (SPEED_KM_H / 3.6)

WAYSIDE = Conditions(
    place="wayside",
    distance_m=7.5,
    height_m=1.2,
    nominal_km_h=80.0,
    lowest_km_h=79.0,
    highest_km_h=82.0,
    background_db=45.0,
    reference_track=True,
)
PASSAGE = Passage(front_s=FRONT_S, length_m=LENGTH_M, speed_km_h=SPEED_KM_H)


def history(x, weighting="A"):
    meter = LevelMeter(RATE, 1, weighting)
    meter.take(np.atleast_2d(x))
    return meter.result()


def sine(seconds, amplitude=1.0):
    """A 1 kHz sine, whose A-weighted level is its own."""
    return amplitude * np.sin(2.0 * np.pi * 1000.0 * np.arange(int(seconds * RATE)) / RATE)


def line_of_sources(t):
    """Mean square of incoherent sources along a moving unit: the angle it is seen under, over pi."""
    x = SPEED_KM_H / 3.6 * (t - FRONT_S)
    return (np.arctan(x / DISTANCE_M) - np.arctan((x - LENGTH_M) / DISTANCE_M)) / math.pi


@pytest.fixture(scope="module")
def passing():
    t = np.arange(int(SECONDS * RATE)) / RATE
    return history(sine(SECONDS) * np.sqrt(line_of_sources(t)))


def states(quantity):
    return {finding.requirement: finding.state for finding in quantity.findings}


def test_the_pass_by_level_of_a_line_of_sources(passing, conformance):
    got = pass_by(passing, 0, WAYSIDE, PASSAGE, ISO_3095_2013)
    assert (got.symbol, got.start_s, got.end_s) == ("LpAeq,Tp", FRONT_S, FRONT_S + TP_S)
    t = np.linspace(FRONT_S, FRONT_S + TP_S, 20001)
    expected = 10.0 * math.log10(0.5 * np.mean(line_of_sources(t)) / 20e-6**2)
    # Intervals of 10 ms at both ends, the filter at 1 kHz: 0.02 dB.
    source = "known input: incoherent sources along a moving line"
    conformance("LpAeq,Tp of a unit of 100 m at 80 km/h, 7.5 m", expected, got.level_db, 0.02, "dB", source)
    # The integral over all time is Tp: each source passes with the energy of d/v, of which the line has L/d.
    exposure = transit_exposure(passing, 0, WAYSIDE, PASSAGE, ISO_3095_2013)
    t = np.linspace(0.0, SECONDS, 200001)
    expected = 10.0 * math.log10(0.5 * np.mean(line_of_sources(t)) * SECONDS / TP_S / 20e-6**2)
    conformance(
        "TEL of a unit of 100 m at 80 km/h, 7.5 m",
        expected,
        exposure.level_db,
        0.02,
        "dB",
        source + "; ISO 3095:2005, formula (10)",
    )
    assert expected == pytest.approx(10.0 * math.log10(0.5 / 20e-6**2), abs=0.2)
    assert got.state == "met" and set(states(got).values()) == {"met"}


@pytest.mark.parametrize(
    "passage",
    [
        Passage(front_s=FRONT_S, rear_s=FRONT_S + TP_S),
        Passage(middle_s=FRONT_S + 0.5 * TP_S, length_m=LENGTH_M, speed_km_h=SPEED_KM_H),
        Passage(rear_s=FRONT_S + TP_S, length_m=LENGTH_M, speed_km_h=SPEED_KM_H),
        Passage(front_s=FRONT_S, middle_s=FRONT_S + 0.5 * TP_S),
    ],
)
def test_any_two_facts_give_the_same_interval(passage):
    assert passage.interval_s() == pytest.approx((FRONT_S, FRONT_S + TP_S))


@pytest.mark.parametrize("passage", [Passage(), Passage(front_s=3.0), Passage(length_m=100.0, speed_km_h=80.0)])
def test_without_the_instants_there_is_no_pass_by_level(passing, passage):
    got = pass_by(passing, 0, WAYSIDE, passage, ISO_3095_2013)
    assert got.level_db is None and got.reason.startswith("nothing says when the unit's front and rear pass")
    assert transit_exposure(passing, 0, WAYSIDE, passage, ISO_3095_2013).level_db is None


def test_a_microphone_on_the_vehicle_gives_no_pass_by(passing):
    got = pass_by(passing, 0, Conditions(place="vehicle"), PASSAGE, ISO_3095_2013)
    assert got.level_db is None and got.state == "unknown"
    assert got.reason == "the microphone does not stand beside the track (place: vehicle)"


def test_what_is_not_known_is_named_and_the_level_stays(passing):
    got = pass_by(passing, 0, Conditions(), PASSAGE, ISO_3095_2013)
    assert got.level_db is not None and got.state == "unknown"
    unknown = {name for name, state in states(got).items() if state == "unknown"}
    assert unknown == {
        "microphone beside the track",
        "microphone 7.5 m from the track's centreline",
        "microphone 1.2 m above the rail",
        "speed within 5 % of the nominal",
        "background at least 10 dB below",
        "reference track: rail roughness and decay rates within their limits",
    }


@pytest.mark.parametrize(
    ("change", "requirement"),
    [
        ({"distance_m": 4.0}, "microphone 7.5 m from the track's centreline"),
        ({"height_m": 2.0}, "microphone 1.2 m above the rail"),
        ({"lowest_km_h": 75.9}, "speed within 5 % of the nominal"),
        ({"background_db": 84.0}, "background at least 10 dB below"),
        ({"reference_track": False}, "reference track: rail roughness and decay rates within their limits"),
    ],
)
def test_each_broken_requirement_is_named(passing, change, requirement):
    got = pass_by(passing, 0, Conditions(**{**WAYSIDE.__dict__, **change}), PASSAGE, ISO_3095_2013)
    assert got.level_db is not None and got.state == "broken"
    assert [name for name, state in states(got).items() if state == "broken"] == [requirement]


def test_at_the_limit_of_the_speed_the_rule_is_met(passing):
    at_limit = Conditions(**{**WAYSIDE.__dict__, "lowest_km_h": 76.0, "highest_km_h": 84.0})
    assert states(pass_by(passing, 0, at_limit, PASSAGE, ISO_3095_2013))["speed within 5 % of the nominal"] == "met"


def test_a_near_background_is_corrected_beside_the_level_and_never_in_it(passing, conformance):
    plain = pass_by(passing, 0, WAYSIDE, PASSAGE, ISO_3095_2013)
    near = Conditions(**{**WAYSIDE.__dict__, "background_db": plain.level_db - 6.0})
    got = pass_by(passing, 0, near, PASSAGE, ISO_3095_2013)
    assert got.level_db == plain.level_db and plain.corrected_db is None
    source = "standard: ISO 3095:2013, D.4.2, formula (D.1), as quoted by the program phonometry"
    conformance(
        "level corrected for a background 6 dB below", -1.26, got.corrected_db - got.level_db, 0.005, "dB", source
    )
    too_near = Conditions(**{**WAYSIDE.__dict__, "background_db": plain.level_db - 3.0})
    assert pass_by(passing, 0, too_near, PASSAGE, ISO_3095_2013).corrected_db is None


def test_a_record_cut_at_the_unit_lacks_its_margins():
    t = np.arange(int(SECONDS * RATE)) / RATE
    x = sine(SECONDS) * np.sqrt(line_of_sources(t))
    first, last = int((FRONT_S - 0.3) * RATE), int((FRONT_S + TP_S + 0.05) * RATE)
    passage = Passage(front_s=0.3, length_m=LENGTH_M, speed_km_h=SPEED_KM_H)
    got = pass_by(history(x[first:last]), 0, WAYSIDE, passage, ISO_3095_2013)
    assert states(got)["record begins at least 10 dB below the unit's front"] == "unknown"
    assert states(got)["record ends at least 10 dB below the unit's rear"] == "broken"
    outside = pass_by(history(x[first : last - 4096]), 0, WAYSIDE, passage, ISO_3095_2013)
    assert outside.level_db is None and "is not within the record of" in outside.reason


def test_standing_starting_and_braking(conformance):
    source = "known input: sine of 1 kHz"
    level = 10.0 * math.log10(0.5 / 20e-6**2)
    steady = history(sine(21.0))
    standing = Conditions(place="wayside", distance_m=7.5, height_m=1.2, highest_km_h=0.0, background_db=60.0)
    got = stationary(steady, 0, standing, ISO_3095_2013)
    conformance("LpAeq,T of a sine", level, got.level_db, 0.01, "dB", source)
    assert got.state == "met"
    rolling = stationary(steady, 0, Conditions(highest_km_h=5.0), ISO_3095_2013)
    assert states(rolling)["vehicle at standstill"] == "broken"
    assert states(stationary(history(sine(19.0)), 0, standing, ISO_3095_2013))["at least 20 s"] == "broken"
    # A sine of 2 s: LpAFmax is its level, LpAeq over 10 s is 7 dB lower.
    x = np.concatenate((np.zeros(int(4 * RATE)), sine(2.0), np.zeros(int(4 * RATE))))
    got = starting(history(x), 0, standing, ISO_3095_2013)
    conformance("LpAFmax of two seconds of a sine", level, got.level_db, 0.01, "dB", source)
    braked = braking(history(x), 0, Conditions(highest_km_h=30.5), ISO_3095_2013)
    assert braked.symbol == "LpAFmax" and states(braked)["braked from 30 km/h"] == "met"
    assert (
        states(braking(history(x), 0, Conditions(highest_km_h=50.0), ISO_3095_2013))["braked from 30 km/h"] == "broken"
    )


def test_inside_the_vehicle():
    got = constant_speed(
        history(sine(25.0)), 0, Conditions("interior", None, 1.2, 80.0, 79.0, 81.0, 40.0), ISO_3381_2021
    )
    assert got.symbol == "LpAeq,T" and got.state == "met" and got.standard == "ISO 3381:2021"
    assert all(UNVERIFIED in finding.origin for finding in got.findings)
    wayside = constant_speed(history(sine(25.0)), 0, WAYSIDE, ISO_3381_2021)
    assert states(wayside)["microphone inside the vehicle"] == "broken"
    assert (
        states(starting(history(sine(5.0)), 0, Conditions(), ISO_3381_2021))["microphone inside the vehicle"]
        == "unknown"
    )


def test_the_wrong_standard_is_refused(passing):
    with pytest.raises(AnalysisError, match=r"ISO 3381:2021 has no pass-by"):
        pass_by(passing, 0, WAYSIDE, PASSAGE, ISO_3381_2021)
    with pytest.raises(AnalysisError, match=r"ISO 3095:2025 rates constant speed by the pass-by"):
        constant_speed(passing, 0, WAYSIDE, ISO_3095_2025)
    with pytest.raises(AnalysisError, match=r"takes an A-weighted history, got weighting 'Z'"):
        stationary(history(sine(1.0), "Z"), 0, WAYSIDE, ISO_3095_2013)


def test_silence_and_missing_samples_give_reasons():
    got = stationary(history(np.zeros(int(21 * RATE))), 0, WAYSIDE, ISO_3095_2013)
    assert got.level_db is None and got.reason == "no sound within the interval"
    x = sine(SECONDS)
    x[int(10.0 * RATE)] = np.nan
    got = pass_by(history(x), 0, WAYSIDE, PASSAGE, ISO_3095_2013)
    assert got.level_db is None and got.reason == "samples are missing within the interval"
    early = Passage(front_s=1.0, rear_s=5.0)
    assert pass_by(history(x), 0, WAYSIDE, early, ISO_3095_2013).level_db is not None  # the gap lies elsewhere


def test_every_rule_of_2025_says_that_it_is_not_verified():
    assert all(not rule.verified and UNVERIFIED in rule.origin for rule in ISO_3095_2025.rules)
    assert [rule.key for rule in ISO_3095_2025.rules] == [rule.key for rule in ISO_3095_2013.rules]
    not_verified = {rule.key for rule in ISO_3095_2013.rules if not rule.verified}
    assert not_verified == {"position_tolerance_m", "speed_tolerance"}
    with pytest.raises(AnalysisError, match=r"has no rule 'wind'"):
        ISO_3381_2021.rule("wind")
