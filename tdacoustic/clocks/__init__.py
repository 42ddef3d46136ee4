"""Two recorders of one physical signal: how the time of one lies on that of the other."""

from tdacoustic.clocks.estimate import MAX_DRIFT_PPM, estimate_clock
from tdacoustic.clocks.records import ArrayRecord, SharedRecord
from tdacoustic.clocks.relation import ClockEstimate, NoRelation

__all__ = ["MAX_DRIFT_PPM", "ArrayRecord", "ClockEstimate", "NoRelation", "SharedRecord", "estimate_clock"]
