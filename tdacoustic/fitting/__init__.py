"""Calibration: parameters of a fleet fitted to measured levels, and what the data can and cannot tell of them."""

from tdacoustic.fitting.least_squares import fit
from tdacoustic.fitting.optimum import Fit
from tdacoustic.fitting.parameters import FreeParameter

__all__ = ["Fit", "FreeParameter", "fit"]
