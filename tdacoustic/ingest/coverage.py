"""Whether every channel of a campaign can be used in some run."""

from __future__ import annotations

from collections.abc import Sequence

from tdacoustic.campaign import CampaignChannel
from tdacoustic.errors import CampaignError
from tdacoustic.ingest.bound import Bound

__all__ = ["check_coverage"]


def check_coverage(bounds: Sequence[Bound], channels: Sequence[CampaignChannel]) -> tuple[str, ...]:
    """Check that no channel is refused in every run.

    Parameters
    ----------
    bounds : sequence of Bound
        Of the campaign's runs.
    channels : sequence of CampaignChannel

    Returns
    -------
    tuple of str
        One warning for each channel that some runs cannot give.

    Raises
    ------
    CampaignError
        Some channels are refused in every run; one line each, with the first run's reason.
    """
    faults: list[str] = []
    warnings: list[str] = []
    for channel in channels:
        reasons = [refusal for bound in bounds for refusal in bound.refused if refusal.channel == channel.name]
        if not reasons:
            continue
        asked = [bound for bound in bounds if channel.name not in bound.absent]
        if len(reasons) == len(asked):
            faults.append(reasons[0].reason)
            continue
        runs = f"{len(reasons)} of {len(asked)} runs ({', '.join(refusal.run for refusal in reasons)})"
        warnings.append(f"channel {channel.name!r} cannot be used in {runs}: {reasons[0].reason}")
    if faults:
        raise CampaignError("\n".join(faults))
    return tuple(warnings)
