"""Is it tonal: ECMA-418-1, ISO/TS 20065 and DIN 45681, each tone ready for its order and owner."""

from tdacoustic.tones.assessment import Audibility, AudibilityMeter, RatedTone, mean_audibility, tone_adjustment_db
from tdacoustic.tones.audibility import DIN_45681, ISO_TS_20065, AudibilityMethod, SpectrumTones, audible_tones
from tdacoustic.tones.ecma_418 import EcmaTone, EcmaTones, ecma_tones
from tdacoustic.tones.label import ToneLabel, label_tones, matching_tolerance_hz
from tdacoustic.tones.narrow_band import ShortTimeMeter, ShortTimeSpectrum

__all__ = [
    "DIN_45681",
    "ISO_TS_20065",
    "Audibility",
    "AudibilityMeter",
    "AudibilityMethod",
    "EcmaTone",
    "EcmaTones",
    "RatedTone",
    "ShortTimeMeter",
    "ShortTimeSpectrum",
    "SpectrumTones",
    "ToneLabel",
    "audible_tones",
    "ecma_tones",
    "label_tones",
    "matching_tolerance_hz",
    "mean_audibility",
    "tone_adjustment_db",
]
