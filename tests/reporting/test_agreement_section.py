"""The sentence on the kinds of evidence never says that they agree where they name different sources."""

from types import SimpleNamespace

import pytest

from tdacoustic.contributions.agreement import agreement_of_evidence
from tdacoustic.reporting.sections.agreement import agreement_words


def words(**evidence):
    found = SimpleNamespace(agreement=agreement_of_evidence(evidence), contribution_words="")
    return agreement_words(SimpleNamespace(agreements={"1": found}), "1")


def of(motor):
    return {"motor": motor, "gearbox": 1.0 - motor}


AGREE = "The kinds of evidence agree"
DIFFER = "The kinds of evidence name different sources, and at most one of them is sure"
DISAGREE = "The kinds of evidence disagree"


@pytest.mark.parametrize(
    ("sensor", "order", "sentence"),
    [
        (0.9, 0.8, f"{AGREE}: sensors and orders say motor."),
        (0.51, 0.49, f"{DIFFER}: sensors say motor; orders say gearbox."),
        (0.95, 0.4, f"{DIFFER}: sensors say motor; orders say gearbox."),
        (0.95, 0.05, f"{DISAGREE}: sensors say motor; orders say gearbox."),
    ],
)
def test_different_sources_are_no_agreement(sensor, order, sentence):
    assert words(sensor=of(sensor), order=of(order)) == sentence


def test_one_kind_alone():
    assert words(sensor=of(0.9), order=None) == (
        "One kind of evidence alone: sensors say motor; orders name no source."
    )
