"""Points of designs: what makes a hypercube one, what Saltelli's design is made of, and what stays when it grows."""

import numpy as np
import pytest

from tdacoustic.fleet.design_sweep import DesignSweep, Range
from tdacoustic.studies.designs import BATCH_POINTS, batches_of, coordinates, points_of, seed_of, whole_keys

RANGES = (("a.level", Range(18, 26)), ("a.ratio", Range(0.02, 0.2, "log")), ("a.teeth", Range(28, 34)))


def design(sampling="latin_hypercube", **more):
    return DesignSweep(name="made up", sampling=sampling, parameters=RANGES, **more)


def values(points):
    return np.array([[value for _, value in point] for point in points], dtype=float)


def test_each_cube_has_one_point_in_each_slice_of_each_range():
    sweep = design(points=250)
    unit = coordinates(sweep, points_of(sweep))
    for numbers in batches_of(sweep):
        size = len(numbers)
        slices = np.sort(np.floor(unit[list(numbers)] * size), axis=0)
        assert (slices == np.arange(size)[:, None]).all()


def test_a_logarithmic_range_has_as_many_points_in_each_ratio():
    sweep = design(points=BATCH_POINTS)
    held = values(points_of(sweep))[:, 1]
    assert (held < np.sqrt(0.02 * 0.2)).sum() == BATCH_POINTS / 2
    assert held.min() >= 0.02 and held.max() <= 0.2


def test_whole_numbers_are_whole_and_equally_likely():
    points = points_of(design(points=7000), whole=("a.teeth",))
    teeth = [dict(point)["a.teeth"] for point in points]
    assert all(type(one) is int for one in teeth)
    assert set(teeth) == set(range(28, 35))
    counts = np.bincount(teeth)[28:]
    assert counts == pytest.approx(1000, abs=70)  # a share of one slice of 100 more or less in each of 70 cubes
    assert all(type(dict(point)["a.level"]) is float for point in points)


def test_keys_of_whole_numbers_are_found_in_the_fleet(reference):
    ranges = (
        ("gear_pair.1.teeth.1", Range(28, 34)),
        ("masuda.constant_db", Range(18, 26)),
        ("gear_dynamics.mass_kg.1", Range(18, 26)),
    )
    sweep = DesignSweep(name="one", sampling="latin_hypercube", points=9, parameters=ranges)
    assert whole_keys(sweep, reference) == ("gear_pair.1.teeth.1",)


def test_rows_of_saltellis_design():
    """A, B, and A with one column of B: and A and B are halves of a Sobol' sequence, one point in each 1/n."""
    n, d = 32, len(RANGES)
    sweep = design("saltelli", base_points=n)
    points = points_of(sweep)
    assert len(points) == sweep.n_points == n * (d + 2)
    unit = coordinates(sweep, points).reshape(n, d + 2, d)
    first, second = unit[:, 0], unit[:, 1]
    for column in range(d):
        exchanged = unit[:, 2 + column]
        assert (exchanged[:, column] == second[:, column]).all()
        others = [other for other in range(d) if other != column]
        assert (exchanged[:, others] == first[:, others]).all()
    for half in (first, second):
        assert (np.sort(np.floor(half * n), axis=0) == np.arange(n)[:, None]).all()
    assert abs(np.corrcoef(first[:, 0], second[:, 0])[0, 1]) < 0.3


@pytest.mark.parametrize(("sampling", "key"), [("latin_hypercube", "points"), ("saltelli", "base_points")])
def test_a_longer_design_begins_with_the_shorter_one_and_has_its_batches(sampling, key):
    short, long = (design(sampling, **{key: size}) for size in (256, 512))
    assert (
        points_of(long)[: len(points_of(short)) // 100 * 100] == points_of(short)[: len(points_of(short)) // 100 * 100]
    )
    whole = [batch for batch in batches_of(short) if len(batch) == len(batches_of(short)[0])]
    assert len(whole) >= 2
    assert set(whole) <= set(batches_of(long))


def test_the_seed_is_the_stated_one_or_made_of_the_ranges():
    assert points_of(design(points=50, seed=3)) == points_of(design(points=50, seed=3))
    assert points_of(design(points=50, seed=3)) != points_of(design(points=50, seed=4))
    assert seed_of(design(points=50)) == seed_of(design(points=80)) != seed_of(design("saltelli", base_points=16))
    other = design(points=50).model_copy(update={"parameters": RANGES[:2]})
    assert seed_of(other) != seed_of(design(points=50))
    as_floats = (("a.level", Range(18.0, 26.0)), *RANGES[1:])
    assert seed_of(design(points=50).model_copy(update={"parameters": as_floats})) == seed_of(design(points=50))


def grid(*lengths):
    axes = tuple((f"a.k{place}", tuple(range(length))) for place, length in enumerate(lengths))
    return DesignSweep(name="grid", parameters=axes)


@pytest.mark.parametrize("lengths", [(1,), (7,), (250,), (3, 1000), (5, 5, 5), (2, 3, 4, 5), (2,) * 9])
def test_batches_of_a_grid_hold_each_point_once(lengths):
    batches = batches_of(grid(*lengths))
    assert sorted(number for batch in batches for number in batch) == list(range(grid(*lengths).n_points))
    assert max(len(batch) for batch in batches) <= BATCH_POINTS


@pytest.mark.parametrize("longer", [(21, 12), (20, 13), (40, 30)])
def test_a_grid_that_grows_at_the_end_of_an_axis_keeps_its_whole_blocks(longer):
    def blocks(sweep):
        points = points_of(sweep)
        return [tuple(points[number] for number in batch) for batch in batches_of(sweep)]

    before, after = blocks(grid(20, 12)), blocks(grid(*longer))
    whole = [block for block in before if len(block) == BATCH_POINTS]
    assert len(whole) == 2
    assert set(whole) <= set(after)
