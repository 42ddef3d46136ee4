"""Speed over time, from tacho pulses or a speed channel."""

from tdacoustic.speed.angle import ShaftAngle
from tdacoustic.speed.profile import SpeedProfile
from tdacoustic.speed.speed_channel import SpeedChannelMeter
from tdacoustic.speed.tacho import EdgeFinder, LevelFinder, clean_edges, speed_from_edges

__all__ = [
    "EdgeFinder",
    "LevelFinder",
    "ShaftAngle",
    "SpeedChannelMeter",
    "SpeedProfile",
    "clean_edges",
    "speed_from_edges",
]
