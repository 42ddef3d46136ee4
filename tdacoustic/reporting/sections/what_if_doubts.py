"""How sure it is what changes of the drive do: what the intervals are made of, and what the model does not have."""

from __future__ import annotations

from collections.abc import Iterable

from tdacoustic.drive.what_if import IntervalBasis, WhatIfAnswer, most_off_db
from tdacoustic.fleet import Fleet
from tdacoustic.reporting.language import say, say_count
from tdacoustic.reporting.sections.parameters import keyed_words
from tdacoustic.reporting.sections.words import joined

__all__ = ["interval_words", "lines_words", "open_words"]


def lines_words(answer: WhatIfAnswer) -> str:
    """Return what of the sound the model has, and so what of a recorded level can change."""
    fractions = [fraction for _, fraction in answer.line_fractions]
    if not fractions:
        return say("The model has lines alone: a recorded level, with broadband sound in it, changes by less.")
    ends = (min(fractions), max(fractions))
    part = _range(f"{100.0 * end:.0f}" for end in ends)
    most = _range(f"{most_off_db(end):.1f}" for end in ends if end < 1.0)
    if not most:
        return say("The model has lines alone, which are {part} % of the recorded sound energy.", part=part)
    if len(fractions) == 1:
        return say(
            "The model has lines alone, which are {part} % of the recorded sound energy: as long as the rest stays, "
            "the recorded level falls by {most} dB at most.",
            part=part,
            most=most,
        )
    return say(
        "The model has lines alone, which are {part} % of the recorded sound energy: as long as the rest stays, the "
        "recorded level falls by {most} dB at most, depending on the condition.",
        part=part,
        most=most,
    )


def _range(numbers: Iterable[str]) -> str:
    """Numbers in words, those that are alike once; empty of none."""
    held = list(dict.fromkeys(numbers))
    return say("{low} to {high}", low=held[0], high=held[-1]) if len(held) > 1 else "".join(held)


def interval_words(answer: WhatIfAnswer, fleet: Fleet) -> str:
    """Return what the intervals are made of, and what they leave out."""
    basis = answer.basis
    if basis is None:
        return say(
            "There is no interval: without a calibration the levels of the sources stand as the fleet's values make "
            "them, and nothing says how far these are off."
        )
    clauses = [_basis_words(basis, fleet)]
    alone = []
    if basis.model_sigma_db > 0.0:
        clauses.append(
            say(
                "together with the model's scatter of {sigma:.2g} dB as an error of each "
                "source by itself in each condition [assumed]",
                sigma=basis.model_sigma_db,
            )
        )
        alone.append(
            say(
                "If the sources are off alike, the interval of the fitted parameters alone holds; the table has it too."
            )
        )
    rest = say(
        "Not in them is what parameters that were not fitted are off by beyond that, sound that the model does not "
        "have, and whether a measure keeps what it promises. The levels in the table are the "
        "model's; of a recorded level a change holds as far as these lines make it."
    )
    return " ".join([f"{', '.join(clauses)}.", *alone, rest])


def _basis_words(basis: IntervalBasis, fleet: Fleet) -> str:
    """Over which values of the fitted parameters the intervals reach."""
    keys = joined([keyed_words(key, fleet) for key in basis.parameters])
    if basis.method == "profile":
        if not keys:
            return say("In brackets: intervals of 95 %, the range over no parameter, as none was fitted")
        return say(
            "In brackets: intervals of 95 %, the range over all values of {parameters} that the data allow (profile "
            "likelihood)",
            parameters=keys,
        )
    if not keys:
        return say("In brackets: intervals of 95 %, 2.5 and 97.5 % quantiles over no parameter, as none was fitted")
    return say(
        "In brackets: intervals of 95 %, 2.5 and 97.5 % quantiles over all values of {parameters} out of the posterior",
        parameters=keys,
    )


def open_words(answer: WhatIfAnswer, fleet: Fleet) -> list[str]:
    """Return a warning of parameters that the data do not determine."""
    held = () if answer.basis is None else answer.basis.open_parameters
    if not held:
        return []
    return [
        say_count(
            "The data do not determine {parameters}: its bounds hold these intervals, as far as they depend on it.",
            "The data do not determine {parameters}: their bounds hold these intervals, as far as they depend on them.",
            len(held),
            parameters=joined([keyed_words(key, fleet) for key in held]),
        )
    ]
