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
    # the constant is seen apart from them and keeps its interval; the three that hide each other have none
    assert found.parameters[0].key == CONSTANT
    assert found.parameters[0].stderr == pytest.approx(_of_the_constant(shared_fleet, levels_of), rel=0.2)
    assert all(parameter.stderr is None and parameter.ci95 is None for parameter in found.parameters[1:])
    assert said(found, f"no interval can be given for {', '.join(keys[1:])}")


def _of_the_constant(fleet, levels_of):
    free = [free_parameter(fleet, CONSTANT), free_parameter(fleet, GAIN)]
    return calibrate_fleet(fleet, levels_of(TRUTH), free, SURE).parameters[0].stderr


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


def test_what_the_data_do_not_see_stays_where_it_was(shared_fleet, levels_of):
    keys = [CONSTANT, "housing.wall_mm", "radiation.sphere_radius_m", "model.structure_gain_db"]
    free = [free_parameter(shared_fleet, key) for key in keys]
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), free, SURE)
    for parameter in found.parameters[1:]:
        assert parameter.value == parameter.initial
        assert parameter.ci95 is None
        assert said(found, f"{parameter.key} changes none of the levels: the data cannot see it")
        assert found.fleet.get(parameter.key) == shared_fleet.get(parameter.key)  # with its own origin
    assert found.parameters[0].ci95 is not None
    assert all(left.sigma_db is not None for left in found.left_out)


def test_the_torque_of_the_fleets_law_can_be_freed(shared_fleet, levels_of):
    free = [free_parameter(shared_fleet, "operation.torque_n_m", low=1000.0, high=9000.0)]
    truth = {"operation.torque_n_m": 3000.0}
    found = calibrate_fleet(shared_fleet, levels_of(truth), free, SURE)
    assert found.parameters[0].value == pytest.approx(3000.0, rel=1e-3)


def test_a_robust_loss_does_not_depend_on_the_order_and_leaves_priors_alone(shared_fleet, levels_of):
    data = levels_of(TRUTH, scatter_db=1.0, seed=2)
    twins = [replace(datum, receiver=replace(datum.receiver, name="other")) for datum in data]
    off = replace(twins[4], level_db=twins[4].level_db + 12.0)
    both = [*data, *twins[:4], off, *twins[5:]]
    free = [free_parameter(shared_fleet, CONSTANT, prior=(8.0, 0.5))]
    settings = FitSettings(1.0, loss="cauchy")
    found = [calibrate_fleet(shared_fleet, held, free, settings).parameters[0] for held in (both, both[::-1])]
    assert found[0].value == pytest.approx(found[1].value, abs=1e-6)
    low, high = found[0].ci95
    assert low < found[0].value - 0.2 < found[0].value + 0.2 < high
    far = calibrate_fleet(shared_fleet, data[:1], free, settings)  # the motor's condition alone: the prior decides
    assert far.parameters[0].value == pytest.approx(8.0, abs=0.3)


def test_microphones_that_agree_do_not_make_the_scatter_surer(shared_fleet, levels_of):
    data = levels_of(TRUTH, scatter_db=2.0, seed=1)
    twins = [replace(datum, receiver=replace(datum.receiver, name="other")) for datum in data]
    free = [free_parameter(shared_fleet, CONSTANT)]
    once = calibrate_fleet(shared_fleet, data, free, FitSettings(None))
    twice = calibrate_fleet(shared_fleet, [*data, *twins], free, FitSettings(None))
    assert twice.model_sigma_db == pytest.approx(once.model_sigma_db, rel=0.05)
    assert twice.parameters[0].ci95 == pytest.approx(once.parameters[0].ci95, abs=0.1)
    assert said(twice, "is taken from a misfit with 5 degrees of freedom")


def test_levels_that_stand_twice(shared_fleet, levels_of):
    data = levels_of(TRUTH)
    free = two(shared_fleet)
    again = [replace(datum, condition=replace(datum.condition, name=f"B: {datum.condition.name}")) for datum in data]
    assert said(calibrate_fleet(shared_fleet, [*data, *again], free, SURE), "6 of 12 levels stand twice")
    first = calibrate_fleet(shared_fleet, data, free, SURE)
    second = calibrate_fleet(shared_fleet, data, free, SURE, earlier=first.fleet)
    assert said(second, "6 of 6 levels are those that the earlier fleet was calibrated to")


def test_a_prior_that_the_data_contradict(shared_fleet, levels_of):
    free = [free_parameter(shared_fleet, CONSTANT, prior=(-6.0, 1.0))]
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH), free, FitSettings(1.0))
    assert said(found, f"the data contradict the prior of {CONSTANT}: they pull it ")


def test_places_where_the_model_cannot_be_computed_end_the_interval(shared_fleet, levels_of):
    free = [
        free_parameter(shared_fleet, CONSTANT),
        free_parameter(shared_fleet, "gear_pair.1.profile_shift.1", low=-1.0, high=3.0),
    ]
    found = calibrate_fleet(shared_fleet, levels_of(TRUTH, [4, 5]), free, FitSettings(2.0))
    assert said(found, "of the search the model could not be computed")
    assert "[[gear_pair]]" in said(found, "of the search the model could not be computed")[0]


@pytest.mark.parametrize(
    ("free", "message"),
    [
        ([("x", {"expression": "x + 1", "initial": 1.0})], "x: expression 'x . 1' leads back to the parameter itself"),
        ([("1x", {"initial": 1.0})], "'1x' can be no name in an expression"),
        ([("lambda", {"initial": 1.0})], "'lambda' can be no name in an expression"),
        ([("a", {"expression": "log(0)", "initial": 1.0})], "a: expression 'log.0.'"),
        ([("a", {"expression": "1 +", "initial": 1.0})], "a: expression '1 .': is no expression"),
        (
            [("a", {"expression": "b", "initial": 1.0}), ("b", {"expression": "a", "initial": 1.0})],
            "a: expression 'b' leads back to the parameter itself",
        ),
        ([(DAMPING, {"low": 0.0})], "values and bounds above 0, got 0.05 from 0"),
    ],
)
def test_expressions_and_bounds_that_cannot_be(shared_fleet, levels_of, free, message):
    with pytest.raises(FittingError, match=message):
        made = [free_parameter(shared_fleet, key, **more) for key, more in free]
        calibrate_fleet(shared_fleet, levels_of(TRUTH), [*two(shared_fleet), *made], SURE)


def test_usual_bounds_stay_within_what_a_file_may_have(shared_fleet):
    wheel = free_parameter(shared_fleet, "train.wheel_diameter_mm")
    assert wheel.high == pytest.approx(3000.0, rel=1e-3)
    assert wheel.low == pytest.approx(105.112)
    with pytest.raises(FittingError, match=r"gear_pair.1.teeth.1 is a whole number and cannot be freed"):
        free_parameter(shared_fleet, "gear_pair.1.teeth.1")
