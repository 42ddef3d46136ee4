"""Three kinds of evidence: what they say together, and that they disagree where they do."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.contributions import agreement_of_evidence
from tdacoustic.errors import AnalysisError


def test_three_that_agree_are_surer_than_each():
    found = agreement_of_evidence(
        {
            "sensor": {"motor": 0.8, "gearbox": 0.2},
            "order": {"motor": 0.7, "gearbox": 0.3},
            "contribution": {"motor": 0.75, "gearbox": 0.2, "residual": 0.05},
        }
    )
    assert (found.word, found.source, found.silent) == ("agree", "motor", ())
    assert found.probability > 0.9
    assert sum(found.joint.values()) == pytest.approx(1.0)
    assert found.words.startswith("they agree on motor")


def test_the_joint_probability_by_hand():
    """Reliability 0.9 of two sources: 0.9 x 0.8 + 0.05 and so on."""
    found = agreement_of_evidence({"sensor": {"motor": 0.8, "gearbox": 0.2}, "order": {"motor": 0.6, "gearbox": 0.4}})
    motor, gearbox = 0.77 * 0.59, 0.23 * 0.41
    assert found.probability == pytest.approx(motor / (motor + gearbox))


def test_two_that_are_sure_of_different_sources_disagree():
    found = agreement_of_evidence(
        {"sensor": {"motor": 0.95, "gearbox": 0.05}, "order": {"gearbox": 0.9, "motor": 0.1}, "contribution": None}
    )
    assert (found.word, found.source, found.probability, found.joint) == ("disagree", None, None, {})
    assert found.words == "they disagree: sensor: motor 95 %; order: gearbox 90 % (contribution silent)"


def test_one_that_is_not_sure_does_not_make_a_disagreement():
    found = agreement_of_evidence(
        {"sensor": {"motor": 0.95, "gearbox": 0.05}, "order": {"gearbox": 0.55, "motor": 0.45}}
    )
    assert (found.word, found.source) == ("agree", "motor")
    assert "one is not sure" in found.words


def test_what_names_nobody_is_silent():
    found = agreement_of_evidence(
        {"sensor": {"unassigned": 0.8, "motor": 0.2}, "order": {}, "contribution": {"residual": 0.9, "gearbox": 0.1}}
    )
    assert (found.word, found.source, found.silent) == ("silent", None, ("sensor", "order", "contribution"))
    alone = agreement_of_evidence({"sensor": {"motor": 3.0, "gearbox": 1.0}, "order": None})
    assert (alone.word, alone.source) == ("single", "motor")
    assert alone.leads["sensor"] == ("motor", 0.75)  # scaled to one


def test_no_kind_settles_it_alone():
    found = agreement_of_evidence({"sensor": {"motor": 1.0, "gearbox": 0.0}})
    assert found.probability == pytest.approx(0.95)


def test_probabilities_that_are_none_are_refused():
    with pytest.raises(AnalysisError, match="'order' must hold probabilities"):
        agreement_of_evidence({"order": {"motor": -0.1}})
    with pytest.raises(AnalysisError, match="'order' must hold probabilities"):
        agreement_of_evidence({"order": {"motor": float("nan")}})
    with pytest.raises(AnalysisError, match="reliability must be in"):
        agreement_of_evidence({}, reliability=1.5)


DISTRIBUTION = st.dictionaries(st.sampled_from(["motor", "gearbox", "wheelset", "unassigned"]), st.floats(0.0, 1.0))


@given(st.dictionaries(st.sampled_from(["sensor", "order", "contribution"]), st.one_of(st.none(), DISTRIBUTION)))
def test_whatever_is_given_the_answer_holds_together(evidence):
    found = agreement_of_evidence(evidence)
    assert (found.source is None) == (found.word in ("disagree", "silent"))
    if found.source is not None:
        assert sum(found.joint.values()) == pytest.approx(1.0)
        assert found.probability == pytest.approx(max(found.joint.values()))
    assert set(found.silent) | set(found.leads) == set(evidence)
