"""The sentence on the kinds of evidence never says that they agree where they name different sources."""

from types import SimpleNamespace

import pytest

from tdacoustic.contributions.agreement import agreement_of_evidence
from tdacoustic.reporting.sections.agreement import agreement_words


def words(contribution_words="", **evidence):
    found = SimpleNamespace(agreement=agreement_of_evidence(evidence), contribution_words=contribution_words)
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


STATES = "the states do not tell cross-talk with motor: 0.3 dB lower, 0.2 dB higher at most"
ONE_STATE = "one operating state does not tell cross-talk with gearbox: no lower bound, 9.1 dB higher at most"


@pytest.mark.parametrize(
    ("raw", "sentence"),
    [
        (
            f"flagged, {STATES} (references coherent, 0.44)",
            "the operating states are too alike to tell the loudest part from cross-talk with the motor, so it may be "
            "up to 0.3 dB lower or 0.2 dB higher (the sensors of the two are coherent by 0.44)",
        ),
        (
            f"flagged, {ONE_STATE}",
            "from a single operating state the loudest part cannot be told from cross-talk with the gearbox, so it may "
            "be up to 9.1 dB higher, and has no lower bound",
        ),
        (
            "refused, its references are coherent with those of motor: 2.5 % of it is its own",
            "the sensors of the loudest part show what those of the motor show too; only 2.5 % of it is its own",
        ),
        ("below, not above its own scatter", "no component's part stands above its own scatter"),
        ("most of the sound is explained by no sensor", "most of the sound is explained by no sensor"),
    ],
)
def test_why_the_contributions_name_no_source_is_a_sentence(raw, sentence):
    assert words(raw, contribution=None) == f"Contributions name no source: {sentence}."
