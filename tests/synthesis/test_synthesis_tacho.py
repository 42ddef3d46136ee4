"""Tacho pulses and speed channels against the integral of speed."""

import numpy as np
import pytest

from tdacoustic.errors import RecipeError
from tdacoustic.synthesis import make_run, parse_recipe, plan_runs


def rising_edges(voltage, time_s, height=2.5):
    """Instants at which a voltage passes a height upwards, by straight lines between samples."""
    before = np.flatnonzero((voltage[:-1] < height) & (voltage[1:] >= height))
    part = (height - voltage[before]) / (voltage[before + 1] - voltage[before])
    return time_s[before] + part * (time_s[1] - time_s[0])


def one_run(content):
    recipe = parse_recipe(content)
    return recipe, make_run(recipe, plan_runs(recipe)[0], 11)


@pytest.mark.parametrize("pulses_per_rev", [1, 12, 60])
def test_pulses_count_the_turns(base, pulses_per_rev):
    base["kinematics"]["speed_wander"] = 0.003
    base["condition"][0] |= {"train_speed_km_h": 20, "train_speed_end_km_h": 60}
    base["channel"][3]["pulses_per_rev"] = pulses_per_rev
    _, run = one_run(base)
    edges = rising_edges(run.tachos["tacho"].voltage_v, run.motion.time_s)
    turns = np.interp(edges, run.motion.time_s, np.cumsum(run.motion.motor_speed_hz) / 8192.0)
    # between two edges lies one pulse's part of a turn; straight-line interpolation of a straight flank is exact
    np.testing.assert_allclose(np.diff(turns) * pulses_per_rev, 1.0, atol=2e-3)
    total = np.trapezoid(run.motion.motor_speed_hz, run.motion.time_s) * pulses_per_rev
    assert abs(edges.size - total) <= 1.0
    assert run.tachos["tacho"].voltage_v.max() == pytest.approx(5.0)
    assert run.tachos["tacho"].voltage_v.min() == 0.0


def test_a_wheelset_tacho_turns_slower(base):
    base["channel"][3]["shaft"] = "wheelset"
    _, run = one_run(base)
    edges = rising_edges(run.tachos["tacho"].voltage_v, run.motion.time_s)
    assert 1 / np.diff(edges).mean() == pytest.approx(12 * 40 / 3.6 / (np.pi * 1.05112), rel=1e-4)


def test_faults_are_where_the_truth_says(base):
    base["channel"][3] |= {"missing_pulses": 3, "double_pulses": 2}
    _, run = one_run(base)
    tacho = run.tachos["tacho"]
    edges = rising_edges(tacho.voltage_v, run.motion.time_s)
    expected = np.sort(np.concatenate([np.setdiff1d(tacho.rising_s, tacho.missing_s), tacho.double_s]))
    assert tacho.missing_s.size == 3 and tacho.double_s.size == 2
    # an edge at the very first or last sample may fall between the flanks
    inside = expected[(expected > 0.001) & (expected < 7.998)]
    np.testing.assert_allclose(edges[(edges > 0.001) & (edges < 7.998)], inside, atol=1e-6)


def test_pulses_that_do_not_fit_the_rate_are_refused(base):
    base["channel"][3]["pulses_per_rev"] = 512
    with pytest.raises(RecipeError, match=r"pulses_per_rev = 512 gives 5780 pulses/s \(channel 'tacho'\)"):
        one_run(base)


def test_a_speed_channel_reads_the_shaft_in_rpm(base):
    base["channel"].append({"name": "n", "quantity": "speed", "component": "shaft", "decimation": 64})
    base["kinematics"]["mesh_excess"] = 0.01
    recipe, run = one_run(base)
    values = run.samples(recipe, recipe.channel[-1])
    assert values.size == 8 * 128
    assert values.mean() == pytest.approx(1.01 * 677.30, abs=0.02)
