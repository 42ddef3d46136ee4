"""What the report says of changes: a sentence a speed, with intervals where there are any, and nothing unescaped."""

from dataclasses import replace

import numpy as np
import pytest
from plain_fleets import plain_fleet

from tdacoustic.drive.what_if import IntervalBasis, WhatIfAnswer, WhatIfLevel, most_off_db
from tdacoustic.fleet import WhatIf, load_fleet
from tdacoustic.reporting.document import Document, FigureBlock, Notice, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.figure import Axis, Bars, Figure, ReportError
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.layout import axis_ranges
from tdacoustic.reporting.matplotlib_renderer import render_png
from tdacoustic.reporting.plotly_renderer import render_plotly
from tdacoustic.reporting.sections.what_if import what_if_line, what_if_section

FLEET = load_fleet(plain_fleet("reference-drive"))
STEPS = {"10 dB less": -10, "3 dB less": -3, "off": "off"}
USUAL = tuple(
    WhatIf.model_validate({"name": f"{path} {step}", f"{path}_db": change})
    for path in ("motor", "mesh")
    for step, change in STEPS.items()
)
BASIS = IntervalBasis("profile", 100, ("masuda.constant_db",), 4.0, ())


def level(condition, case, change_db, ends=None, km_h=40.0, before_db=85.0, receiver="4 m", weighting="Z"):
    after = None if change_db is None else before_db + change_db
    return WhatIfLevel(condition, km_h, receiver, weighting, case, before_db, after, ends, ends, ends)


def usual(condition, km_h, motor, mesh, ends=None):
    """Levels of the usual cases: changes for 10 dB, 3 dB and off of motor and mesh."""
    held = [(f"motor {s}", c) for s, c in zip(STEPS, motor, strict=True)]
    held += [(f"mesh {s}", c) for s, c in zip(STEPS, mesh, strict=True)]
    return tuple(level(condition, case, change, (ends or {}).get(case), km_h) for case, change in held)


@pytest.fixture
def answer():
    slow = usual("b", 20.0, (-5.3, -2.2, -6.7), (-0.9, -0.5, -1.0))
    fast = usual("a", 60.0, (-0.4, -0.2, -0.5), (-8.0, -2.7, -12.0))
    return WhatIfAnswer("4 m", ("motor", "mesh"), USUAL, True, (*fast, *slow))


def words(section):
    found = [block.text for block in walk([section]) if isinstance(block, Paragraph | Notice)]
    return found + [item for block in walk([section]) if isinstance(block, Sentences) for item in block.items]


def said(section, start):
    (found,) = [text for text in words(section) if text.startswith(start)]
    return found


def test_a_sentence_a_speed_without_intervals(answer):
    section = what_if_section(answer, FLEET)
    assert said(section, "Condition b") == (
        "Condition b (20 km/h), 85.0 dB at 4 m: 10 dB less from the motor takes 5.3 dB off, 6.7 dB if it were silent; "
        "10 dB less from the meshing noise takes 0.9 dB off, 1.0 dB if it were silent."
    )
    order = [text[:11] for text in words(section) if text.startswith("Condition ")]
    assert order == ["Condition b", "Condition a"]  # by speed
    assert said(section, "10 dB less bring") == (
        "10 dB less bring most at the motor in condition b and at the meshing noise in condition a."
    )
    assert said(section, "Left out").endswith("is gained from the motor in condition a: others come first.")
    assert said(section, "There is no interval: without a calibration")
    assert "[assumed steps]" in said(section, "The fleet asks for no case")


def test_intervals_in_brackets_and_what_they_hold(answer):
    ends = {
        "motor 10 dB less": (-9.7, -0.7),
        "mesh 10 dB less": (-6.0, 0.0),
    }
    calibrated = replace(answer, levels=usual("b", 20.0, (-5.3, -2.2, -6.7), (-0.9, -0.5, -1.0), ends), basis=BASIS)
    section = what_if_section(calibrated, FLEET)
    text = said(section, "Condition b")
    assert "from the motor takes 5.3 dB (0.7 to 9.7) off, 6.7 dB if it were silent" in text
    assert "from the meshing noise takes 0.9 dB (0.0 to 6.0) off" in text
    assert said(section, "10 dB less bring").endswith(
        "; in condition b the intervals overlap, and which source to begin with is not decided."
    )
    basis = said(section, "In brackets: intervals of 95 %")
    assert (
        "the range over all values of Masuda constant (masuda.constant_db) that the data allow (profile likelihood)"
        in basis
    )
    assert "the model's scatter of 4 dB as an error of each source by itself in each condition [assumed]" in basis
    assert what_if_line(calibrated).startswith(
        "What if (the model's level at 4 m): at 20 km/h 10 dB less from the motor takes 5.3 dB (0.7 to 9.7) off"
    )


def test_a_source_that_is_silent_has_an_interval_and_little_is_little_only_where_that_says_so(answer):
    ends = {
        "motor off": (-20.0, -0.9),
        "mesh off": (-8.7, 0.0),
    }
    sure = {"motor off": (-0.8, -0.1)}
    held = (
        *usual("b", 20.0, (-5.3, -2.2, -6.7), (-0.5, -0.2, -0.7), ends),
        *usual("a", 60.0, (-0.4, -0.2, -0.5), (-8.0, -2.7, -12.0), sure),
    )
    section = what_if_section(replace(answer, levels=held, basis=BASIS), FLEET)
    assert "takes 5.3 dB off, 6.7 dB (0.9 to 20.0) if it were silent" in said(section, "Condition b")
    assert [text for text in words(section) if text.startswith("Left out")] == [
        "Left out altogether, less than 1 dB is gained from the motor in condition a: others come first.",
        "Left out altogether, less than 1 dB is gained from the meshing noise in condition b by the fitted values, but "
        "up to 8.7 dB by the intervals.",
    ]


def test_what_of_a_recorded_level_can_change(answer):
    bare = "The model has lines alone: a recorded level, with broadband sound in it, changes by less."
    assert bare in words(what_if_section(answer, FLEET))
    assert what_if_line(answer).endswith(f". {bare}")
    recorded = replace(answer, line_fractions=(("b", 0.06), ("a", 0.16)))  # 10 lg(1 - 0.06) and 10 lg(1 - 0.16)
    assert what_if_line(recorded).endswith(
        ". The model has lines alone, which are 6 to 16 % of the recorded sound energy: as long as the rest stays, the "
        "recorded level falls by 0.3 to 0.8 dB at most, depending on the condition."
    )
    assert most_off_db(0.5) == pytest.approx(3.01, abs=0.01)
    assert what_if_line(replace(answer, line_fractions=(("a", 1.0),))).endswith("100 % of the recorded sound energy.")


def test_an_undetermined_parameter_is_a_warning(answer):
    basis = replace(BASIS, open_parameters=("masuda.constant_db", "model.motor_gain_db"))
    section = what_if_section(replace(answer, basis=basis), FLEET)
    assert said(
        section,
        "The data do not determine Masuda constant (masuda.constant_db) and motor gain (model.motor_gain_db): their "
        "bounds hold",
    )


@pytest.mark.parametrize(
    ("change_db", "ends", "expected"),
    [
        (-2.0, None, "takes 2.0 dB off"),
        (1.5, None, "adds 1.5 dB"),
        (1.5, (0.5, 2.5), "adds 1.5 dB (0.5 to 2.5)"),
        (-0.2, (-1.0, 0.5), "changes it by \N{MINUS SIGN}0.2 dB (\N{MINUS SIGN}1.0 to +0.5)"),
        (0.0, None, "changes nothing"),
        (0.0, (-3.0, 0.0), "takes 0.0 dB (0.0 to 3.0) off"),
        (0.0, (0.0, 0.0), "changes nothing"),
        (0.01, (-0.02, 0.03), "changes nothing"),
        (-0.01, (-0.06, 0.06), "changes it by 0.0 dB (\N{MINUS SIGN}0.1 to +0.1)"),
        (-10.0, (-10.0, -10.0), "takes 10.0 dB off"),
        (None, None, "leaves nothing that sounds"),
    ],
)
def test_words_of_a_change(change_db, ends, expected):
    case = WhatIf(name="case", motor_db=-1)
    one = WhatIfAnswer(
        "4 m", ("motor",), (case,), False, (level("1", "case", change_db, ends),), BASIS if ends else None
    )
    assert f"\N{LEFT DOUBLE QUOTATION MARK}case\N{RIGHT DOUBLE QUOTATION MARK} {expected}." in said(
        what_if_section(one, FLEET), "Condition 1"
    )


def test_a_source_that_alone_sounds(answer):
    alone = usual("c", 114.0, (0.0, 0.0, 0.0), (-10.0, -3.0, None))
    text = said(what_if_section(replace(answer, levels=(*answer.levels, *alone)), FLEET), "Condition c")
    assert text.endswith(
        "the meshing noise is all that sounds in the model, each decibel less of it is one less at 4 m."
    )


def test_stated_cases_are_named_with_what_they_change(answer):
    parameters = (("gear_dynamics.mesh_damping_ratio", 0.2), ("gear_pair.1.transmission_error_um", (3.0, 1.0)))
    cases = (
        WhatIf(name="a", motor_db=-5, mesh_db="off"),
        WhatIf(name="b", parameters=parameters, conditions=("1", "2")),
    )
    held = (level("1", "a", -5.0), level("1", "b", 1.0))
    text = said(what_if_section(replace(answer, cases=cases, assumed=False, levels=held), FLEET), "The cases are")
    assert text.replace("\N{LEFT DOUBLE QUOTATION MARK}", "'").replace("\N{RIGHT DOUBLE QUOTATION MARK}", "'") == (
        "The cases are those of the fleet's [[what_if]]: 'a' (motor \N{MINUS SIGN}5 dB, mesh off) and 'b' "
        "(mesh damping ratio (gear_dynamics.mesh_damping_ratio) = 0.2, transmission error "
        "(gear_pair.1.transmission_error_um) = [3, 1] µm, in conditions 1 and 2 only)."
    )


def test_many_cases_are_in_the_table(answer):
    cases = tuple(WhatIf(name=f"case {n}", motor_db=-n) for n in range(1, 9))
    levels = tuple(level("1", case.name, -0.1 * n) for n, case in enumerate(cases, 1))
    section = what_if_section(replace(answer, cases=cases, assumed=False, levels=levels), FLEET)
    assert said(section, "Condition 1").endswith("; more in the table.")
    (surface,) = [b for b in walk([section]) if isinstance(b, Table) and b.name == "what-if-surface"]
    assert len(surface.rows) == 8


def test_a_silent_drive_has_no_section():
    assert what_if_section(WhatIfAnswer("4 m", (), (), True, ()), FLEET) is None
    assert what_if_line(None) == ""


def test_names_are_escaped():
    hostile = '<script>alert("x")</script>'
    case = WhatIf.model_construct(name=hostile, motor_db=-1.0, conditions=None, parameters=())
    held = (level(hostile, hostile, -1.0), level(hostile, hostile, -1.0, receiver=hostile))
    section = what_if_section(WhatIfAnswer("4 m", ("motor",), (case,), False, held), FLEET)
    page = render_html(Document("t", "s", "calculated", sections=[section]))
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert" in page


def test_the_figure_has_bars_with_both_lengths_and_marks(answer):
    ends = {"motor 10 dB less": (-9.7, -0.7), "mesh 10 dB less": (-6.0, 0.0)}
    calibrated = replace(answer, levels=usual("b", 20.0, (-5.3, -2.2, -6.7), (-0.9, -0.5, -1.0), ends), basis=BASIS)
    (figure,) = [b.figure for b in walk([what_if_section(calibrated, FLEET)]) if isinstance(b, FigureBlock)]
    bar = figure.elements[0]
    assert isinstance(bar, Bars)
    assert bar.values.tolist() == pytest.approx([5.3])
    assert bar.errors[:, 0].tolist() == pytest.approx([4.6, 4.4])  # from 5.3 down to 0.7, up to 9.7
    drawn = render_plotly(figure)["data"][0]["error_y"]
    assert (drawn["symmetric"], drawn["arrayminus"], drawn["array"]) == (False, [4.6], [4.4])
    assert render_png(figure, 60)[:4] == b"\x89PNG"
    assert figure.elements[-1].y.tolist() == pytest.approx([6.7, 1.0])


def test_error_bars_of_two_lengths_fit_on_the_axis():
    bars = Bars(["a"], [5.0], "x", [[1.0], [20.0]])
    figure = Figure("f", "t", "", Axis("x"), Axis("y", "dB"), [bars])
    assert axis_ranges(figure)[1][1] >= 25.0
    assert np.shape(bars.errors) == (2, 1)
    with pytest.raises(ReportError, match=r"errors of bars 'x' must have shape \(2, 1\), got \(1, 1\)"):
        Bars(["a"], [5.0], "x", [[1.0]])
