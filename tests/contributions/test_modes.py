"""Traction, braking and coasting at one speed: parts made by hand come back, doubts and refusals are said."""

import numpy as np
import pytest

from tdacoustic.contributions import ModeRun, compare_modes
from tdacoustic.errors import AnalysisError

BANDS = ("500 Hz", "1000 Hz", "2000 Hz")
SPEED_PART = np.array([1.0, 1.0, 1.0])
TORQUE_PART = {"traction": np.array([9.0, 0.1, 1.0]), "brake": np.array([4.5, 0.1, 1.0]), "coast": np.zeros(3)}


def run(mode, name=None, rng=None, segments=32, run_db=0.0, torque=None, speed=20.0, power=None):
    """Segments scatter as 8 averages would; the run as a whole by `run_db`."""
    rng = np.random.default_rng(0) if rng is None else rng
    power = SPEED_PART + TORQUE_PART[mode] if power is None else np.asarray(power, dtype=float)
    drawn = power * rng.gamma(8.0, 1.0 / 8.0, (segments, len(BANDS))) * 10.0 ** (0.1 * run_db * rng.standard_normal())
    return ModeRun(name or mode, mode, speed, drawn, np.full(segments, 8.0), torque)


def part(found, mode, band):
    return next(one for one in found.parts if (one.mode, one.band) == (mode, band))


def test_parts_made_by_hand_come_back():
    rng = np.random.default_rng(1)
    runs = [run(mode, f"{mode} {k}", rng, 400) for mode in ("traction", "brake", "coast") for k in (1, 2, 3)]
    found = compare_modes(runs, BANDS)
    for mode in ("traction", "brake"):
        for k, band in enumerate(BANDS):
            one = part(found, mode, band)
            assert one.speed_part == pytest.approx(1.0, abs=0.05)
            assert one.torque_part == pytest.approx(TORQUE_PART[mode][k], abs=0.2)
            assert one.share_low <= TORQUE_PART[mode][k] / (1.0 + TORQUE_PART[mode][k]) <= one.share_high
            assert one.mean_square == pytest.approx(one.speed_part + one.torque_part)
    assert part(found, "traction", "500 Hz").depends_on == "torque"
    assert part(found, "traction", "1000 Hz").depends_on == "speed"
    assert part(found, "traction", "2000 Hz").depends_on == "undecided"
    assert part(found, "traction", "total").torque_part == pytest.approx(10.1, abs=0.5)
    assert "comes and goes with the torque: 90 %" in part(found, "traction", "500 Hz").words
    ratio = {row[0]: row[1:] for row in found.brake_over_traction_db}["500 Hz"]
    assert ratio[0] == pytest.approx(10.0 * np.log10(0.5), abs=0.3)
    assert ratio[1] <= 10.0 * np.log10(0.5) <= ratio[2]
    assert not found.scatter_assumed


def test_the_interval_holds_the_truth_over_many_campaigns():
    """Two runs a mode that scatter by 1 dB; the share of torque is 0.9. 95 % are asked for."""
    inside, decided = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        runs = [run(mode, f"{mode} {k}", rng, 32, 1.0) for mode in ("traction", "coast") for k in (1, 2)]
        one = part(compare_modes(runs, BANDS, draws=400), "traction", "500 Hz")
        inside.append(one.share_low <= 0.9 <= one.share_high)
        decided.append(one.depends_on)
    assert np.mean(inside) > 0.88
    assert "speed" not in decided


def test_single_runs_take_the_assumed_scatter_and_say_so():
    found = compare_modes([run("traction"), run("coast", power=[1.0, 1.0, 1.0])], BANDS)
    assert found.scatter_assumed
    assert found.run_scatter_db == 1.0
    assert "no mode was run twice: 1 dB between runs is assumed" in found.doubts
    # 0.1 of 1.1 cannot be told from nothing at 1 dB.
    small = part(found, "traction", "1000 Hz")
    assert small.share_low == 0.0
    assert small.depends_on == "undecided"


def test_louder_coasting_is_said():
    rng = np.random.default_rng(2)
    runs = [run("traction", f"t{k}", rng, power=[1.0, 1.0, 1.0]) for k in (1, 2, 3)]
    runs += [run("coast", f"c{k}", rng, power=[5.0, 1.0, 1.0]) for k in (1, 2, 3)]
    one = part(compare_modes(runs, BANDS), "traction", "500 Hz")
    assert one.torque_part < 0.0
    assert one.torque_share == one.share_high == 0.0
    assert one.words.startswith("coasting is louder than traction")


def test_braking_has_its_doubts():
    runs = [run("traction", torque=1000.0), run("brake", torque=-600.0), run("coast", torque=0.0)]
    doubts = " ".join(compare_modes(runs, BANDS).doubts)
    assert "differ by more than 10 %" in doubts
    assert "a friction brake would too" in doubts


@pytest.mark.parametrize(
    ("runs", "words"),
    [
        ([run("traction")], "takes a coasting or hauled run; there are traction"),
        ([run("coast")], "takes a run in traction or braking; there are coast"),
        ([run("traction"), run("coast", speed=21.0)], "'traction' and 'coast' are at speeds 20 and 21"),
        ([run("traction", torque=1000.0), run("coast", torque=80.0)], "'coast' is coast with a torque of 80 N m"),
        ([run("traction"), ModeRun("c", "idle", 20.0, np.ones((1, 3)), np.ones(1))], "mode must be one of"),
        ([run("traction"), ModeRun("c", "coast", 20.0, np.ones((2, 3)), np.ones(1))], r"shape \(1, 3\), got \(2, 3\)"),
        ([run("traction"), ModeRun("c", "coast", 20.0, np.full((1, 3), np.nan), np.ones(1))], "must hold powers"),
        ([run("traction"), ModeRun("c", "coast", 20.0, np.ones((1, 3)), np.zeros(1))], "at least of one segment"),
    ],
)
def test_what_cannot_be_compared_is_refused(runs, words):
    with pytest.raises(AnalysisError, match=words):
        compare_modes(runs, BANDS)


def test_segments_without_frames_do_not_count():
    held = run("coast")
    holed = ModeRun(
        "coast", "coast", 20.0, np.vstack((held.mean_square, np.full(3, np.nan))), np.append(held.weights, 0.0)
    )
    whole, found = (compare_modes([run("traction"), one], BANDS) for one in (held, holed))
    assert found.parts[0].speed_part == whole.parts[0].speed_part
