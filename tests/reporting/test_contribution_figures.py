"""Figures of contributions from made-up parts: a line a run, and nothing where the paths do not hold."""

from types import SimpleNamespace

import numpy as np
import pytest

from tdacoustic.attribution import ContributionState
from tdacoustic.attribution.contribution_step import paths_changed
from tdacoustic.contributions import GroupPart
from tdacoustic.reporting.figure import Line
from tdacoustic.reporting.language import Language, speaking
from tdacoustic.reporting.sections.contribution_figures import over_speed
from tdacoustic.reporting.sections.contributions import _run_up_words
from tdacoustic.tables.contributions import contribution_tables

REASON = "paths differ from state to state: alone, its sensors explain 99 % of this sound, by the paths of all 9 %"
PA2 = (20e-6) ** 2


def row(run, speed, total_db, steady=True, reason=""):
    state = ContributionState(f"{run} {speed}", run, run, speed, None, steady)
    verdict = "flagged" if reason else "ok"
    part = GroupPart(1e6 * PA2, 1e6 * PA2, 0.5e6 * PA2, 2e6 * PA2, 0.5e6 * PA2, 2e6 * PA2, verdict, reason)
    total = PA2 * 10.0 ** (0.1 * total_db)
    parts = SimpleNamespace(receiver="mic", total=total, residual=0.5 * total, groups={"motor": part})
    return state, SimpleNamespace(kind="total"), parts


def figure(rows, modes):
    found = SimpleNamespace(states=[state for state, *_ in rows], components=("motor",))
    (made,) = over_speed(found, rows, "mic", modes)
    lines = [element for element in made.elements if isinstance(element, Line)]
    return made, {
        name: [line for line in lines if line.name == name] for name in ("recorded", "explained by no sensor")
    }


def test_runs_of_different_conditions_share_no_line():
    rows = [row("up", 20.0, 80.0, False), row("down", 25.0, 70.0, False), row("up", 30.0, 80.0, False),
            row("down", 35.0, 70.0, False), row("a", 40.0, 75.0), row("b", 50.0, 76.0)]  # fmt: skip
    made, lines = figure(rows, {"a": "traction", "b": "traction"})
    drawn = sorted((line.x.tolist(), np.round(line.y).tolist()) for line in lines["recorded"])
    assert drawn == [([20.0, 30.0], [80.0, 80.0]), ([25.0, 35.0], [70.0, 70.0]), ([40.0, 50.0], [75.0, 76.0])]
    assert "Lines join the speeds of one run-up" in made.caption


def test_steady_runs_of_two_modes_share_no_line():
    _, lines = figure([row("a", 40.0, 75.0), row("b", 50.0, 76.0)], {"a": "traction", "b": "coast"})
    assert sorted(line.x.size for line in lines["recorded"]) == [1, 1]


@pytest.mark.parametrize("reason", ["", REASON])
def test_where_the_paths_differ_what_no_sensor_explains_is_left_out(reason):
    rows = [row("a", 40.0, 75.0, reason=reason), row("b", 50.0, 76.0)]
    made, lines = figure(rows, {})
    (rest,) = lines["explained by no sensor"]
    assert paths_changed(rows[0][2]) == bool(reason) == bool(np.isnan(rest.y[0])) and np.isfinite(rest.y[1])
    assert made.caption.endswith("differ from state to state.") == bool(reason)


@pytest.mark.parametrize(("reason", "verdict"), [("", "ok"), (REASON, "flagged")])
def test_the_table_flags_what_is_left_where_the_paths_differ(reason, verdict):
    state, _, parts = row("a", 40.0, 75.0, reason=reason)
    values = vars(parts) | {
        "span": "total", "band_hz": (20.0, 2000.0), "total_low": parts.total, "total_high": parts.total,
        "residual_low": 0.0, "residual_high": parts.total, "largest": {}, "n_states": 2,
    }  # fmt: skip
    held = [(state, SimpleNamespace(kind="total", order=None), SimpleNamespace(**values))]
    found = SimpleNamespace(rows=lambda: iter(held), coherences=lambda: iter(()), states=[state], spans=[])
    table = contribution_tables(found, None)["contributions"].set_index("part")
    assert table["verdict"]["residual"] == verdict
    assert table["reason"]["residual"] == ("paths differ from state to state: an upper bound" if reason else "")


def test_in_another_language_bars_do_not_stretch_the_axis():
    rows = [row("a", 40.0, 75.0), row("b", 50.0, 76.0)]
    english, _ = figure(rows, {})
    with speaking(Language("de", {"range": "Spanne", "{component}: range": "{component}: Spanne"})):
        german, _ = figure(rows, {})
    assert any(element.name == "motor: Spanne" for element in german.elements)
    assert german.y_axis.limits == english.y_axis.limits


def test_a_run_up_goes_from_speed_to_speed_in_every_language():
    rows = [row("up", None, 80.0, False) for _ in range(2)]
    rows = [
        (ContributionState("up", "up", "up", None, hz, False), span, parts)
        for hz, (_, span, parts) in zip((5.0, 20.0), rows, strict=True)
    ]
    assert _run_up_words(rows).startswith("a run-up from 300 to 1200 rpm: of the whole sound motor 60.0 to 60.0 dB")
    german = {
        "motor {speed:.4g} rpm": "bei {speed:.4g} rpm",
        "a run-up from {first} to {last}": "von {first} auf {last}",
    }
    with speaking(Language("de", german)):
        assert _run_up_words(rows).startswith("von 300 auf 1200 rpm: ")
