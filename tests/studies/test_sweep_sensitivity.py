"""What a study says of the level: of made-up levels whose answer is known, and of the model beside its own slopes."""

import math

import numpy as np
import pytest

from tdacoustic.drive import conditions_of
from tdacoustic.fleet.design_sweep import DesignSweep, Range
from tdacoustic.steps import Store
from tdacoustic.studies import QUANTITIES, sensitivity_of, sweep_sensitivity_of
from tdacoustic.studies.design_sweeps import SweepResult
from tdacoustic.studies.designs import coordinates, points_of
from tdacoustic.studies.responses import _responses, responses_task
from tdacoustic.studies.sweep_sensitivity import energy_mean_db
from tdacoustic.workflows.studies import studies_of

RANGES = (("a.one", Range(1.0, 3.0)), ("a.two", Range(0.1, 10.0, "log")), ("a.three", Range(-1.0, 1.0)))


def made_up(levels_of, sampling="latin_hypercube", conditions=("1", "2"), **more):
    """A study whose levels are a function of its coordinates, shape (points, conditions)."""
    more = more or {"points": 200}
    sweep = DesignSweep(name="made up", sampling=sampling, parameters=RANGES, **more)
    points = points_of(sweep)
    levels = levels_of(coordinates(sweep, points))
    values = np.full((*levels.shape, len(QUANTITIES)), 1.0)
    values[..., QUANTITIES.index("spl_4m_db")] = levels
    return SweepResult(sweep, points, conditions, np.ones(levels.shape), values, ("",) * len(points))


def additive(unit):
    return np.stack([80.0 + unit @ [4.0, -2.0, 0.0], 60.0 + unit @ [0.0, 1.0, 0.0]], axis=1)


def test_slopes_are_told_in_decibels_over_the_range_on_its_own_scale():
    study = sweep_sensitivity_of(made_up(additive))
    first, second, mean = study.levels
    assert first.regression.slope.value == pytest.approx([4.0, -2.0, 0.0], abs=1e-9)
    assert second.regression.slope.value == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    assert mean.condition is None
    assert first.total is None and first.n_used == 200
    assert study.ranking()[:2] == (0, 1)  # of the mean, which condition 1 decides


def test_saltellis_design_gives_the_parts_of_the_variance():
    study = sweep_sensitivity_of(made_up(additive, "saltelli", base_points=1024))
    first = study.levels[0]
    assert first.first_order.value == pytest.approx([0.8, 0.2, 0.0], abs=0.03)
    assert first.total.value == pytest.approx([0.8, 0.2, 0.0], abs=0.02)
    assert first.regression.slope.value == pytest.approx([4.0, -2.0, 0.0], abs=1e-9)
    assert study.ranking() == (0, 1, 2)


def test_the_energy_mean_is_of_energies():
    assert energy_mean_db(np.array([[80.0, 80.0], [90.0, -math.inf], [90.0, math.nan]])) == pytest.approx(
        [80.0, 90.0 - 10.0 * math.log10(2.0), math.nan], nan_ok=True
    )
    study = sweep_sensitivity_of(made_up(lambda unit: additive(unit)[:, :1], conditions=("1",)))
    assert [level.condition for level in study.levels] == ["1"]  # of one condition it would say the same twice


def spoiled(found, where, what):
    """A study in which some points rattle in condition 2, cannot be, or are silent there."""
    values, reasons = found.values.copy(), list(found.reasons)
    for number in np.flatnonzero(where).tolist():
        if what == "refused":
            values[number], reasons[number] = np.nan, "cannot be"
        else:
            names = ["spl_4m_db"] if what == "silent" else list(QUANTITIES)
            values[number, 1, [QUANTITIES.index(name) for name in names]] = np.nan
    return SweepResult(found.sweep, found.points, found.conditions, found.speed_km_h, values, tuple(reasons))


@pytest.mark.parametrize("what", ["rattling", "silent", "refused"])
@pytest.mark.parametrize(
    ("sampling", "more"), [("latin_hypercube", {"points": 200}), ("saltelli", {"base_points": 64})]
)
def test_points_without_a_level_are_left_out_and_counted(sampling, more, what):
    found = made_up(additive, sampling, **more)
    where = np.arange(len(found.points)) % 20 == 3
    study = sweep_sensitivity_of(spoiled(found, where, what))
    first, second, mean = study.levels
    gone = int(where.sum())
    assert study.n_refused == (gone if what == "refused" else 0)
    assert [level.n_rattling for level in study.levels] == ([0, gone, gone] if what == "rattling" else [0, 0, 0])
    assert [level.n_silent for level in study.levels] == ([0, gone, gone] if what == "silent" else [0, 0, 0])
    assert first.n_used == len(found.points) - (gone if what == "refused" else 0)
    assert mean.n_used == second.n_used == len(found.points) - gone
    assert second.regression.slope.value == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    if sampling == "saltelli":
        assert second.total.value == pytest.approx([0.0, 1.0, 0.0], abs=0.15)  # of 45 base points


def test_a_grid_has_no_such_sensitivities():
    sweep = DesignSweep(name="grid", parameters=(("a.one", (1.0, 2.0)),))
    found = SweepResult(sweep, points_of(sweep), ("1",), np.ones((2, 1)), np.ones((2, 1, len(QUANTITIES))), ("", ""))
    assert sweep_sensitivity_of(found) is None


def test_a_level_that_does_not_vary_says_nothing():
    study = sweep_sensitivity_of(made_up(lambda unit: np.full((len(unit), 2), 80.0)))
    assert all(level.regression is None and level.weights is None for level in study.levels)
    assert study.ranking() == (0, 1, 2)


def test_over_small_ranges_it_is_the_local_sensitivity(reference, tmp_path):
    """Slopes over ±0.5 % beside those of central differences of ±1 %, which are told for 10 % and for 1 dB."""
    keys = ("gear_dynamics.mesh_damping_ratio", "operation.torque_n_m", "gear_pair.1.face_width_mm")
    values = {key: float(reference.value_of(key)) for key in keys}
    ranges = [(key, Range(0.995 * value, 1.005 * value)) for key, value in values.items()]
    constant = reference.masuda.constant_db.value
    ranges.append(("masuda.constant_db", Range(constant - 0.05, constant + 0.05)))
    asked = DesignSweep(
        name="small", sampling="latin_hypercube", points=40, parameters=tuple(ranges), conditions=("3", "5")
    )
    fleet = reference.replaced({})
    object.__setattr__(fleet, "sweep", (asked,))
    studies, _ = studies_of(fleet, None, conditions_of(reference), Store(tmp_path))
    (study,) = studies.sweep_sensitivities
    local = sensitivity_of(_responses(responses_task(reference, None, conditions_of(reference)).settings))
    names = [case.name for case in local.cases if case.over == "conditions"]
    for level in study.levels[:2]:
        assert level.regression.explained > 0.999
        for place, (key, _) in enumerate(ranges):
            number = [variation.key for variation in local.varied].index(key)
            change = local.of_total("conditions")[number, names.index(level.condition)]
            times = 10.0  # 1 % of 10 %, and 0.1 dB of 1 dB
            assert times * level.regression.slope.value[place] == pytest.approx(change, rel=0.02, abs=0.01)
