"""Speed over time: from tacho pulses, a speed channel, or the lines of vibration; slip between two of them."""

from tdacoustic.speed.angle import ShaftAngle
from tdacoustic.speed.comb import CombOrder
from tdacoustic.speed.decimation import Decimator, decimation_of
from tdacoustic.speed.direction import edge_directions, signed_reading, stands_between_edges
from tdacoustic.speed.edges import EdgeFinder, LevelFinder
from tdacoustic.speed.mending import clean_edges
from tdacoustic.speed.profile import SpeedProfile
from tdacoustic.speed.ridge import RidgeSpeed, refinement_of, ridge_speed, speed_from_lines
from tdacoustic.speed.ridge_search import RidgeSearch, RidgeSettings, refusal
from tdacoustic.speed.slip import SlipEvent, WheelSlip, pulses_doubt, relative_excess, wheel_slip
from tdacoustic.speed.speed_channel import SpeedChannelMeter
from tdacoustic.speed.tacho import TachoReading, read_tacho, speed_from_edges

__all__ = [
    "CombOrder",
    "Decimator",
    "EdgeFinder",
    "LevelFinder",
    "RidgeSearch",
    "RidgeSettings",
    "RidgeSpeed",
    "ShaftAngle",
    "SlipEvent",
    "SpeedChannelMeter",
    "SpeedProfile",
    "TachoReading",
    "WheelSlip",
    "clean_edges",
    "decimation_of",
    "edge_directions",
    "pulses_doubt",
    "read_tacho",
    "refinement_of",
    "refusal",
    "relative_excess",
    "ridge_speed",
    "signed_reading",
    "speed_from_edges",
    "speed_from_lines",
    "stands_between_edges",
    "wheel_slip",
]
