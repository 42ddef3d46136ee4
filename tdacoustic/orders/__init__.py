"""Orders: what follows the turns of a shaft.

A time signal becomes even in angle (`AngleResampler`), is cut into frames (`Frames`) and read by meters: maps
(`MapMeter`), cuts (`CutMeter`); `SynchronousMeter` averages turns. `VoldKalman` tracks orders in the time signal.
"""

from tdacoustic.orders.bandwidth import BandwidthAdvice, advise_bandwidth
from tdacoustic.orders.discovery import find_orders, order_strengths
from tdacoustic.orders.frames import EachFrame, Frames, LineFrames, SpeedRows, TimeRows, plan_line_frames
from tdacoustic.orders.named import FrequencyCurve, NamedOrder, OrderKind
from tdacoustic.orders.order_cut import CutMeter, Neighbour, OrderCut
from tdacoustic.orders.order_map import MapMeter, OrderMap
from tdacoustic.orders.resampling import AngleResampler, AngleSignal, EvenBlock, EvenTime
from tdacoustic.orders.resonances import FixedFrequency, find_fixed_frequencies
from tdacoustic.orders.sidebands import SidebandFamily, sideband_families, sideband_orders
from tdacoustic.orders.synchronous_average import SynchronousAverage, SynchronousMeter
from tdacoustic.orders.vold_kalman import REASONS, OrderTrack, TrackedOrder, VoldKalman

__all__ = [
    "REASONS",
    "AngleResampler",
    "AngleSignal",
    "BandwidthAdvice",
    "CutMeter",
    "EachFrame",
    "EvenBlock",
    "EvenTime",
    "FixedFrequency",
    "Frames",
    "FrequencyCurve",
    "LineFrames",
    "MapMeter",
    "NamedOrder",
    "Neighbour",
    "OrderCut",
    "OrderKind",
    "OrderMap",
    "OrderTrack",
    "SidebandFamily",
    "SpeedRows",
    "SynchronousAverage",
    "SynchronousMeter",
    "TimeRows",
    "TrackedOrder",
    "VoldKalman",
    "advise_bandwidth",
    "find_fixed_frequencies",
    "find_orders",
    "order_strengths",
    "plan_line_frames",
    "sideband_families",
    "sideband_orders",
]
