"""Whose noise it is, by signals alone: coherence, operational transfer paths, modes of driving, agreement."""

from tdacoustic.contributions.agreement import Agreement, agreement_of_evidence
from tdacoustic.contributions.coherence import (
    Coherence,
    multiple_coherence,
    order_range,
    ordinary_coherence,
    partial_coherence,
    reference_coherence,
    sequential_parts,
)
from tdacoustic.contributions.cross_spectra import (
    CrossPlan,
    CrossSpectra,
    CrossSpectrumMeter,
    measure_cross_spectra,
    plan_cross_spectra,
)
from tdacoustic.contributions.matrices import CrossMatrices
from tdacoustic.contributions.modes import ModeComparison, ModePart, ModeRun, compare_modes
from tdacoustic.contributions.parts import RESIDUAL, GroupPart, SpanContributions
from tdacoustic.contributions.paths import path_contributions
from tdacoustic.contributions.states import OperatingState, PathSettings, Span

__all__ = [
    "RESIDUAL",
    "Agreement",
    "Coherence",
    "CrossMatrices",
    "CrossPlan",
    "CrossSpectra",
    "CrossSpectrumMeter",
    "GroupPart",
    "ModeComparison",
    "ModePart",
    "ModeRun",
    "OperatingState",
    "PathSettings",
    "Span",
    "SpanContributions",
    "agreement_of_evidence",
    "compare_modes",
    "measure_cross_spectra",
    "multiple_coherence",
    "order_range",
    "ordinary_coherence",
    "partial_coherence",
    "path_contributions",
    "plan_cross_spectra",
    "reference_coherence",
    "sequential_parts",
]
