"""Block powers, spectra, levels, weightings and bands."""

from tdacoustic.spectra.background import Correction, correct_for_background
from tdacoustic.spectra.bands import BandPowers, ThirdOctaveMeter
from tdacoustic.spectra.frames import FramePlan, plan_frames
from tdacoustic.spectra.powers import FramePowerMeter, SegmentPowers
from tdacoustic.spectra.spectrum import Spectrum, average_spectrum
from tdacoustic.spectra.time_weighting import LevelHistory, LevelMeter
from tdacoustic.spectra.weighting import a_weighting_db

__all__ = [
    "BandPowers",
    "Correction",
    "FramePlan",
    "FramePowerMeter",
    "LevelHistory",
    "LevelMeter",
    "SegmentPowers",
    "Spectrum",
    "ThirdOctaveMeter",
    "a_weighting_db",
    "average_spectrum",
    "correct_for_background",
    "plan_frames",
]
