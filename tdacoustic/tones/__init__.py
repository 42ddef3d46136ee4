"""Is it tonal: ECMA-418-1, ISO/TS 20065 and DIN 45681, each tone ready for its order and owner."""

from tdacoustic.tones.assessment import (
    Audibility,
    AudibilityMeter,
    RatedTone,
    mean_audibility,
    rated_tone,
    tone_adjustment_db,
)
from tdacoustic.tones.audibility import (
    DIN_45681,
    ISO_TS_20065,
    NO_TONE_DB,
    AudibilityMethod,
    SpectrumTones,
    audible_tones,
    highest_rated_hz,
)
from tdacoustic.tones.curves import audible_level_db, prominent_level_db
from tdacoustic.tones.ecma_418 import (
    EcmaTone,
    EcmaTones,
    ecma_tones,
)
from tdacoustic.tones.label import ExpectedTone, ToneLabel, expected_tones, label_tones
from tdacoustic.tones.narrow_band import ShortTimeMeter, ShortTimeSpectrum

__all__ = [
    "DIN_45681",
    "ISO_TS_20065",
    "NO_TONE_DB",
    "Audibility",
    "AudibilityMeter",
    "AudibilityMethod",
    "EcmaTone",
    "EcmaTones",
    "ExpectedTone",
    "RatedTone",
    "ShortTimeMeter",
    "ShortTimeSpectrum",
    "SpectrumTones",
    "ToneLabel",
    "audible_level_db",
    "audible_tones",
    "ecma_tones",
    "expected_tones",
    "highest_rated_hz",
    "label_tones",
    "mean_audibility",
    "prominent_level_db",
    "rated_tone",
    "tone_adjustment_db",
]
