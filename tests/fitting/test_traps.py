"""Fits that look like fits and tell nothing: each must say so."""

from dataclasses import replace

import pytest

from tdacoustic.errors import FittingError
from tdacoustic.fitting.calibration import calibrate_fleet, free_parameter
from tdacoustic.fitting.settings import FitSettings

from .conftest import CONSTANT, DAMPING, GAIN

TRUTH = {CONSTANT: 0.0, DAMPING: 0.06}
SURE = FitSettings(0.0)


def two(fleet, **changes):
    return [free_parameter(fleet, CONSTANT), free_parameter(fleet, DAMPING, **changes)]


def said(found, words):
    return [doubt for doubt in found.doubts if words in doubt]


def test_a_good_fit_has_no_doubts(shared_fleet, levels_of):
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), two(shared_fleet), SURE)
    assert found.doubts == ()
    assert {p.key: p.value for p in found.parameters} == pytest.approx(TRUTH, rel=1e-4, abs=1e-4)


def test_an_optimum_outside_of_the_bounds(shared_fleet, levels_of):
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), two(shared_fleet, low=0.1, high=0.3, initial=0.2), SURE)
    assert found.parameters[1].value == pytest.approx(0.1, rel=1e-3)
    assert said(found, f"{DAMPING} ended on its bound 0.1: the optimum may lie beyond it")
    assert found.parameters[1].ci95[0] is None


def test_a_product_of_two_free_parameters(shared_fleet, levels_of):
    keys = [CONSTANT, GAIN, "motor.excitation.1.sound_power_level_db", "motor.excitation.2.sound_power_level_db"]
    free = [free_parameter(shared_fleet, key) for key in keys]
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), free, SURE)
    # gain and levels add in dB: they multiply the power; the two constant lines are one number to six levels
    assert found.rank == 2
    assert said(found, "the data see 2 of 4 directions among the parameters")
    assert all(parameter.stderr is None and parameter.ci95 is None for parameter in found.parameters)


def test_a_condition_off_by_15_db(shared_fleet, levels_of):
    data = levels_of(TRUTH)
    off = [*data[:2], replace(data[2], level_db=data[2].level_db + 15.0), *data[3:]]
    found = calibrate_fleet(shared_fleet, off, two(shared_fleet), FitSettings(4.0))
    (outlying,) = said(found, "is outlying")
    assert outlying.startswith("condition 3 is outlying: from the others the model is -1")
    sure = calibrate_fleet(shared_fleet, off, two(shared_fleet), FitSettings(1.0))
    assert said(sure, "the model does not reach the data: the misfit is ")
    assert said(sure, "at worst -1")
    robust = calibrate_fleet(shared_fleet, off, two(shared_fleet), FitSettings(0.3, loss="cauchy"))
    errors = {left.datum.condition.name: abs(left.error_db) for left in robust.levels}
    assert errors["3"] > 12.0
    assert max(error for name, error in errors.items() if name != "3") < 1.0


def test_one_condition_only(shared_fleet, levels_of):
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH, [5]), two(shared_fleet), SURE)
    assert said(found, "all data are of one condition: what depends on speed cannot be told from what does not")
    assert said(found, "the data see 1 of 2 directions")
    assert found.left_out[0].error_db is None


def test_equal_conditions(shared_fleet, levels_of):
    data = levels_of(TRUTH, [4, 5])
    again = replace(data[1], condition=replace(data[1].condition, name="6 again"), group="6 again")
    found = calibrate_fleet(shared_fleet, [*data, again], two(shared_fleet), SURE)
    assert said(found, "conditions 6 and 6 again are the same to the model, in speed and torque")


def test_the_same_condition_twice_does_not_halve_what_the_model_is_off_by(shared_fleet, levels_of):
    data = levels_of(TRUTH, [5])
    again = replace(data[0], condition=replace(data[0].condition, name="6 again"))
    free = [free_parameter(shared_fleet, CONSTANT)]
    once = calibrate_fleet(shared_fleet, data, free, FitSettings(4.0)).parameters[0].stderr
    twice = calibrate_fleet(shared_fleet, [*data, again], free, FitSettings(4.0)).parameters[0].stderr
    assert twice == pytest.approx(once, rel=0.01)


def test_masudas_source_inside(shared_fleet, levels_of):
    inside = shared_fleet.replaced({"masuda.placement": "inside"})
    found = calibrate_fleet(inside, levels_of(TRUTH), two(inside), SURE)
    assert said(found, "Masuda's source is inside the housing")
    assert said(found, f"{CONSTANT} changes none of the levels: the data cannot see it")
    assert said(found, f"{DAMPING} changes none of the levels: the data cannot see it")
    assert said(found, "the data see 0 of 2 directions")
    assert all(parameter.stderr is None for parameter in found.parameters)


def test_the_gear_counted_twice(shared_fleet, levels_of):
    both = shared_fleet.replaced({"model.gear_path": "sum"})
    found = calibrate_fleet(both, levels_of(TRUTH), two(both), SURE)
    assert said(found, "gear counted twice")


def test_levels_of_a_silent_condition_are_left_out_and_said(shared_fleet, levels_of):
    data = levels_of(TRUTH)
    band = replace(data[0], what="1/3 octave 50 Hz", band_hz=(45.0, 56.0))
    found = calibrate_fleet(shared_fleet, [*data, band], two(shared_fleet), SURE)
    assert len(found.levels) == 6
    assert said(found, "1 of 1 levels of bands and orders are not used: the model has no line there")


def test_parameters_that_hide_each_other(shared_fleet, levels_of):
    free = [free_parameter(shared_fleet, CONSTANT), free_parameter(shared_fleet, "gear_pair.1.transmission_error_um.1")]
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH, [4, 5]), free, FitSettings(1.0))
    assert said(found, "are correlated by ") or said(found, "directions among the parameters")


def test_a_prior_that_the_data_do_not_narrow(shared_fleet, levels_of):
    free = [*two(shared_fleet), free_parameter(shared_fleet, "gear_dynamics.bearing_damping_ratio", prior=(0.05, 1e-4))]
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), free, SURE)
    assert said(found, "the interval of gear_dynamics.bearing_damping_ratio is no narrower than its prior")
    assert found.parameters[2].prior == pytest.approx((0.05, 1e-4))


def test_more_than_one_minimum(shared_fleet, levels_of):
    # beside a resonance of the pinion's bearing each level is reached twice, once on each flank
    data = [replace(levels_of({}, [5])[0], level_db=118.5)]
    key = "gear_dynamics.pinion_bearing_stiffness_n_per_m.2"
    free = [free_parameter(shared_fleet, key, initial=5e9, low=2.7e9, high=1e10)]
    found = calibrate_fleet(shared_fleet, data, free, SURE)
    (doubt,) = said(found, "there is more than one minimum: another set of values fits about as well")
    assert key in doubt
    assert found.levels[0].error_db == pytest.approx(0.0, abs=0.01)
    assert "entry 2 calibrated" in found.fleet.get("gear_dynamics.pinion_bearing_stiffness_n_per_m").origin


@pytest.mark.parametrize(
    ("key", "more", "message"),
    [
        ("gear_pair.1.teeth", {}, r"gear_pair.1.teeth is no single number and cannot be freed"),
        ("gear_dynamics.mass_kg.3", {}, r"gear_dynamics.mass_kg.3: gear_dynamics.mass_kg has no such entry"),
        ("gear_dynamics.mesh_dampin", {}, r"the nearest known one is 'gear_dynamics.mesh_damping"),
        ("helper", {}, r"helper is no parameter of a fleet, and an auxiliary one needs a value"),
        (DAMPING, {"low": 0.1}, r"initial value 0.05 is outside of its bounds, 0.1 to 0.5"),
        (DAMPING, {"prior": (-1.0, 0.1)}, r"a prior on a logarithmic scale needs a mean above 0, got -1"),
    ],
)
def test_parameters_that_cannot_be_freed(shared_fleet, key, more, message):
    with pytest.raises((FittingError, ValueError), match=message):
        free_parameter(shared_fleet, key, **more)


def test_no_data(shared_fleet):
    with pytest.raises(FittingError, match="there are no levels to calibrate with"):
        calibrate_fleet(shared_fleet, [], two(shared_fleet))
