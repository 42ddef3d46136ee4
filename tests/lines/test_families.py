"""Harmonics are grouped; lines placed at random are not."""

import numpy as np
import pytest

from tdacoustic.lines import Line, find_families


def lines_at(rng, frequencies, error=0.02):
    placed = sorted(frequencies)
    return [Line(float(f + rng.normal(0.0, error)), error, 1.0, 20.0, 0.0) for f in placed]


def test_two_interleaved_families_are_told_apart(conformance):
    families = [[174.97 * k for k in range(1, 7)], [926.0 * k for k in range(1, 4)]]
    worst = np.zeros(2)
    for seed in range(20):
        lines = lines_at(np.random.default_rng(seed), families[0] + families[1])
        for place, (family, truth) in enumerate(zip(find_families(lines, 1.0), families, strict=True)):
            assert [number for _, number in family.members] == list(range(1, len(truth) + 1))
            assert [lines[index].frequency_hz for index, _ in family.members] == pytest.approx(truth, abs=0.1)
            assert family.chance < 1e-3
            worst[place] = max(worst[place], abs(family.fundamental_hz - truth[0]))
    for truth, error in zip(families, worst, strict=True):
        what = f"fundamental of a family at {truth[0]:g} Hz, largest error of 20 draws"
        scatter = 0.02 / np.sqrt(sum(number**2 for number in range(1, len(truth) + 1)))  # of the best possible estimate
        conformance(what, 0.0, error, 4.0 * scatter, "Hz", "known input: harmonics with drawn errors of 0.02 Hz")


@pytest.mark.parametrize("count", [5, 15, 30, 60])
def test_random_lines_form_no_family(count):
    found = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        found += len(find_families(lines_at(rng, rng.uniform(30.0, 4000.0, count)), 1.0))
    assert found <= 1  # 0.1 expected at the stated chance


def test_a_family_whose_fundamental_is_missing_is_found():
    (family,) = find_families(lines_at(np.random.default_rng(1), [80.0 * k for k in (2, 3, 4, 5, 7)]), 1.0)
    assert family.fundamental_hz == pytest.approx(80.0, abs=0.02)
    assert [number for _, number in family.members] == [2, 3, 4, 5, 7]


def test_a_line_belongs_to_one_family_and_strangers_to_none():
    lines = lines_at(np.random.default_rng(2), [100.0 * k for k in range(1, 9)] + [133.7, 257.1, 611.3])
    families = find_families(lines, 1.0)
    members = [index for family in families for index, _ in family.members]
    assert len(members) == len(set(members)) == 8


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_lines_form_none(count):
    assert find_families(lines_at(np.random.default_rng(3), [100.0 * k for k in range(1, count + 1)]), 1.0) == ()
