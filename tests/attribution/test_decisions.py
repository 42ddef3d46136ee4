"""Decisions of the attribution: equal sources, sensitivity, excitation matching, observed mesh, repeated runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tdacoustic.attribution.excitation import Expected, observed_scale, owner_of, refined
from tdacoustic.attribution.judgement import source_by_rule
from tdacoustic.attribution.radiator import radiator_of
from tdacoustic.synthesis import synthesize
from tdacoustic.workflows.analyze import analyze

FLEET = """
schema = "tdacoustic-fleet/1"
name = "Test drive"
[train]
wheel_diameter_mm = 1051.12
[[gear_pair]]
name = "1"
teeth = [31, 104]
"""


def recipe(lines: str, channels: str = "", condition: str = "") -> str:
    return f"""
schema = "tdacoustic-synthesis/1"
name = "decisions"
seed = 3
sample_rate_hz = 8192
duration_s = 8.0
fleet = "fleet.toml"
[kinematics]
wheel_diameter_mm = 1051.12
[[kinematics.gear_pair]]
teeth = [31, 104]
[[channel]]
name = "motor_z"
quantity = "acceleration"
component = "motor"
floor = [[10, 80], [4096, 80]]
[[channel]]
name = "gearbox_z"
quantity = "acceleration"
component = "gearbox"
floor = [[10, 80], [4096, 80]]
{channels}
[[channel]]
name = "mic"
quantity = "sound_pressure"
component = "air"
role = "receiver"
distance_m = 4.0
floor = [[10, 50], [4096, 50]]
[[channel]]
name = "tacho"
quantity = "tacho"
component = "shaft"
shaft = "motor"
pulses_per_rev = 12
[[condition]]
name = "40"
train_speed_km_h = 40
{condition}
{lines}
"""


def campaign(folder: Path, text: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "synthesis.toml").write_text(text, encoding="utf-8")
    (folder / "fleet.toml").write_text(FLEET, encoding="utf-8")
    return synthesize(folder / "synthesis.toml", folder).campaign


def line(source: str, frequency: str, **prominence: float) -> str:
    levels = ", ".join(f"{name} = {value}" for name, value in prominence.items())
    return f'[[condition.line]]\nsource = "{source}"\n{frequency}\nprominence_db = {{ {levels} }}\n'


def test_equal_levels_give_undecided(tmp_path):
    lines = line("motor", "frequency_hz = 905", motor=20, receiver=20)
    lines += line("gearbox", "frequency_hz = 1283", gearbox=20, receiver=20)
    tables = analyze(campaign(tmp_path / "c", recipe(lines)), tmp_path / "store").tables
    (verdict,) = tables["dominance"].to_dict("records")
    assert verdict["dominant"] == "undecided"
    assert verdict["confidence"] < 0.9
    assert verdict["motor_share"] == pytest.approx(0.5, abs=0.1)
    assert set(tables["sources"]["source"]) == {"motor", "gearbox"}


@pytest.mark.parametrize(("stronger", "weaker"), [("motor", "gearbox"), ("gearbox", "motor")])
def test_the_stronger_source_dominates(tmp_path, stronger, weaker):
    lines = line(stronger, "frequency_hz = 905", **{stronger: 20, "receiver": 26})
    lines += line(weaker, "frequency_hz = 1283", **{weaker: 20, "receiver": 12})
    tables = analyze(campaign(tmp_path / "c", recipe(lines)), tmp_path / "store").tables
    (verdict,) = tables["dominance"].to_dict("records")
    assert verdict["dominant"] == stronger
    assert verdict["confidence"] > 0.95


def test_a_sensor_20_db_more_sensitive_changes_nothing(tmp_path):
    """The line is the motor's; the gearbox's sensor shows its cross-talk at a higher raw level."""
    lines = line("motor", "frequency_hz = 905", motor=25, gearbox=12, receiver=22)
    plain = recipe(lines)
    keen = plain.replace('component = "gearbox"', 'component = "gearbox"\ngain_db = 20')
    found = [
        analyze(campaign(tmp_path / n, text), tmp_path / "store").tables for n, text in (("a", plain), ("b", keen))
    ]
    for tables in found:
        (source,) = tables["sources"].to_dict("records")
        assert (source["radiator"], source["source"]) == ("motor", "motor")
    raw = found[1]["lines"].set_index("channel")["level_db"]
    assert raw["gearbox_z"] > raw["motor_z"]


def test_both_sensors_leave_it_to_the_order(tmp_path):
    """Mesh x2 at 699.9 Hz, in both sensors alike: the order makes it the gearbox's; an unknown one stays ambiguous."""
    lines = line("gearbox", "mesh = 2", motor=20, gearbox=20, receiver=20)
    lines += line("other", "frequency_hz = 1283", motor=20, gearbox=20, receiver=16)
    tables = analyze(campaign(tmp_path / "c", recipe(lines)), tmp_path / "store").tables
    by_radiator = tables["sources"].set_index("source")
    assert by_radiator.loc["gearbox", "excitation"] == "mesh"
    assert (by_radiator["radiator"] == "both").all()
    assert set(by_radiator.index) == {"gearbox", "ambiguous"}


def test_repeated_runs_are_averaged_and_their_spread_is_told(tmp_path):
    lines = line("motor", "frequency_hz = 905", motor=20, receiver=20)
    text = recipe(lines, condition="runs = 3\nrepeat_sigma_db = 2.0")
    tables = analyze(campaign(tmp_path / "c", text), tmp_path / "store").tables
    (verdict,) = tables["dominance"].to_dict("records")
    levels = tables["levels"].query("channel == 'mic'")["level_db"]
    assert verdict["n_runs"] == 3
    assert verdict["spread_db"] == pytest.approx(levels.max() - levels.min(), abs=1e-9)
    assert len(tables["sources"]) == 1
    energies = 10.0 ** (0.1 * tables["lines"].query("channel == 'mic'")["level_db"])
    assert tables["sources"]["level_db"].iloc[0] == pytest.approx(10.0 * np.log10(energies.mean()), abs=1e-9)


def test_no_noise_lines_no_shares(tmp_path):
    tables = analyze(campaign(tmp_path / "c", recipe("")), tmp_path / "store").tables
    (verdict,) = tables["dominance"].to_dict("records")
    assert verdict["dominant"] == "undecided"
    assert np.isnan(verdict["motor_share"])


@pytest.mark.parametrize(
    ("prominence", "expected"),
    [
        ({"motor": 20.0, "gearbox": 2.0}, "motor"),
        ({"motor": 20.0, "gearbox": 19.0}, "both"),
        ({"motor": 0.0, "gearbox": -np.inf}, "neither"),
        ({"motor": 10.0, "gearbox": 30.0}, "gearbox"),
        ({"motor": 9.0, "gearbox": 30.0, "bogie": 40.0}, "bogie"),
    ],
)
def test_radiator(prominence, expected):
    assert radiator_of(prominence) == expected


@pytest.mark.parametrize(
    ("radiator", "kind", "source", "conflict"),
    [
        ("motor", "mesh", "motor", True),
        ("motor", "inverter", "motor", False),
        ("gearbox", None, "gearbox", False),
        ("both", "inverter", "motor", False),
        ("both", None, "ambiguous", False),
        ("neither", "mesh", "gearbox", False),
        ("neither", None, "unassigned", False),
        ("bogie", "mesh", "bogie", True),
        ("neither", "wheelset", "wheelset", False),
    ],
)
def test_the_stated_rule(radiator, kind, source, conflict):
    assert source_by_rule(radiator, kind) == (source, conflict)


def mesh(frequency_hz: float, error: float = 0.002) -> list[Expected]:
    return [
        Expected(f"mesh x{k}", "mesh", k * frequency_hz, k * frequency_hz * error, "mesh 1", float(k))
        for k in range(1, 9)
    ]


def test_an_order_owns_what_lies_within_its_uncertainty():
    match, _ = owner_of(350.5, 0.05, mesh(350.0))
    assert match is not None and match.expected.name == "mesh x1"
    assert owner_of(362.0, 0.05, mesh(350.0))[0] is None


def test_the_observed_mesh_is_found_from_its_harmonics():
    """Lines 1.2 % above the calculated mesh, with strangers among them."""
    true_hz = 350.0 * 1.012
    lines = [true_hz, 2 * true_hz, 4 * true_hz, 517.0, 1233.0]
    scale = observed_scale(lines, [0.05] * 5, [20.0] * 5, mesh(350.0, 0.005), 0.016)
    assert scale is not None
    assert scale.value == pytest.approx(1.012, abs=2e-4)
    moved = refined(mesh(350.0), scale)
    assert moved[2].frequency_hz == pytest.approx(3 * true_hz, rel=3e-4)


def test_lines_far_from_any_harmonic_give_no_observed_mesh():
    assert observed_scale([517.0], [0.05], [20.0], mesh(350.0), 0.016) is None
    assert observed_scale([], [], [], mesh(350.0), 0.016) is None
