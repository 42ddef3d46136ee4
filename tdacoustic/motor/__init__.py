"""The motor's noise: radial force waves on rings, and the sound of a cylinder (paper, section 4.4)."""

from tdacoustic.motor.cylinder import relative_intensity
from tdacoustic.motor.frame import MotorFrame, Ring

__all__ = ["MotorFrame", "Ring", "relative_intensity"]
