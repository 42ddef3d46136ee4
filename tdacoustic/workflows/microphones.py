"""Where the microphones of a campaign stand, in the frame of the fleet's drive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from tdacoustic.errors import CampaignError

if TYPE_CHECKING:
    from tdacoustic.campaign import Campaign, CampaignChannel
    from tdacoustic.drive import Receiver
    from tdacoustic.drive.housing_box import BodyInAir
    from tdacoustic.fleet import Fleet

__all__ = ["microphone_doubts", "microphones"]

APART: Final = 0.1
"""Relative difference of a stated distance from that of a stated position which is said [assumed]."""

SIDES: Final = {"left": 1.0, "right": -1.0}
"""Sign of y; looking along the direction of travel."""


def microphones(campaign: Campaign, fleet: Fleet) -> dict[str, Receiver]:
    """Return the microphones of a campaign whose place is known, by the channel's name.

    A place is ``position_m``; else what ``distance_m``, ``height_above_rail_m`` and ``side`` (``"left"`` or
    ``"right"``) give together: x = 0, z the height less half a wheel diameter (the drive's centre lies at the height
    of the wheel's, as the ground of `tdacoustic.drive.PointField`), y what remains of the distance; else the distance
    alone, without direction. With boundary elements a microphone in the housing or at its walls is left out;
    `microphone_doubts` says so.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet
        For its wheel diameter, the ground of its space and its housing.

    Raises
    ------
    CampaignError
        A place that cannot be: higher than it is far, at the drive's centre itself, or below the rail where
        ``[radiation] space`` has its ground there.
    """
    found, housing = {}, _housing_of(fleet)
    for channel in campaign.channels:
        receiver = _receiver(campaign, channel, fleet) if _is_microphone(channel) else None
        if receiver is not None and not _too_close(receiver, housing):
            found[channel.name] = receiver
    return found


def _housing_of(fleet: Fleet) -> BodyInAir | None:
    """The housing that receivers must keep off; None of point sources."""
    if fleet.radiation.method.value == "point_sources":
        return None
    from tdacoustic.drive import gear_unit_of
    from tdacoustic.drive.housing_box import body_of, housing_of

    return body_of(fleet, housing_of(fleet, gear_unit_of(fleet)))


def _too_close(receiver: Receiver, housing: BodyInAir | None) -> bool:
    """Whether boundary elements take no receiver there."""
    if housing is None or receiver.position_m is None:
        return False
    return housing.distance_m(receiver.position_m) < housing.clearance_m


def microphone_doubts(campaign: Campaign, fleet: Fleet) -> tuple[str, ...]:
    """Return what campaigns say of a microphone's place that does not agree or cannot be used.

    A ``position_m`` more than 10 % nearer or farther than ``distance_m`` (the position holds), a ``side`` that is
    neither left nor right, and with boundary elements a place in the housing or at its walls.

    Parameters
    ----------
    campaign : Campaign
    fleet : Fleet
    """
    found, housing = [], _housing_of(fleet)
    for channel in filter(_is_microphone, campaign.channels):
        receiver = _receiver(campaign, channel, fleet)
        if receiver is not None and housing is not None and _too_close(receiver, housing):
            assert receiver.position_m is not None
            apart_m = housing.distance_m(receiver.position_m)
            where = "lies inside the housing" if apart_m <= 0.0 else f"is {1e3 * apart_m:.0f} mm from its wall"
            found.append(
                f"channel {channel.name} {where}: boundary elements take {1e3 * housing.clearance_m:.0f} mm at least, "
                "so the model has no level there"
            )
        if channel.position_m is not None and channel.distance_m is not None:
            distance_m = math.hypot(*channel.position_m)
            if abs(distance_m - channel.distance_m) > APART * max(distance_m, channel.distance_m):
                found.append(
                    f"channel {channel.name}: position_m is {distance_m:.3g} m from the drive's centre, distance_m "
                    f"says {channel.distance_m:g} m; its place in the model is the position"
                )
        elif channel.position_m is None and channel.side is not None and _side(channel) is None:
            found.append(
                f"channel {channel.name}: side {channel.side!r} is neither left nor right; its place in the model is "
                "its distance alone"
            )
    return tuple(found)


def _is_microphone(channel: CampaignChannel) -> bool:
    """Whether a channel is a microphone by its quantity or, where only the log says that, by having a distance."""
    quantity = channel.scale.stated_quantity()
    return quantity == "sound_pressure" or (quantity is None and channel.distance_m is not None)


def _side(channel: CampaignChannel) -> float | None:
    return None if channel.side is None else SIDES.get(channel.side.strip().lower())


def _receiver(campaign: Campaign, channel: CampaignChannel, fleet: Fleet) -> Receiver | None:
    from tdacoustic.drive import Receiver

    where = f"{campaign.path}: channel {channel.name!r}"
    position_m, distance_m = channel.position_m, channel.distance_m
    if position_m is None and distance_m is None:
        return None
    if position_m is None:
        assert distance_m is not None
        position_m = _position_m(where, channel, distance_m, 0.5 * fleet.train.wheel_diameter_m)
    else:
        distance_m = math.hypot(*position_m)
    if not distance_m > 0.0:
        raise CampaignError(f"{where} is at the drive's centre itself, where the model has no level")
    _check_ground(where, position_m, fleet)
    return Receiver(channel.name, distance_m, position_m)


def _position_m(
    where: str, channel: CampaignChannel, distance_m: float, centre_m: float
) -> tuple[float, float, float] | None:
    """Place at a distance, a height and a side; `centre_m` is the height of the drive's centre above the rail."""
    side, height_m = _side(channel), channel.height_above_rail_m
    if height_m is None:
        return None
    z = height_m - centre_m
    if abs(z) > distance_m:
        raise CampaignError(
            f"{where}: height_above_rail_m = {height_m:g} is {abs(z):.3g} m {'above' if z > 0.0 else 'below'} the "
            f"drive's centre, and distance_m = {distance_m:g} from there is less"
        )
    return None if side is None else (0.0, side * math.sqrt(distance_m**2 - z**2), z)


def _check_ground(where: str, position_m: tuple[float, float, float] | None, fleet: Fleet) -> None:
    below_m = 0.0 if position_m is None else -0.5 * fleet.train.wheel_diameter_m - position_m[2]
    if below_m > 0.0 and fleet.radiation.space.value == "half":
        raise CampaignError(
            f'{where} lies {below_m:.3g} m below the rail, where [radiation] space = "half" has its ground'
        )
