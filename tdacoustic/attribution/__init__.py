"""Which source owns which noise line, and which dominates a condition.

Two questions are kept apart: which body *radiates* a line (whose sensors show
it), and what *excites* it (whose order it is).
"""

from tdacoustic.attribution.dominance import Dominance, dominance_of_condition
from tdacoustic.attribution.evidence import EVIDENCE, EvidenceSettings, RunEvidence
from tdacoustic.attribution.judgement import ConditionLine
from tdacoustic.attribution.kinematic import RunKinematics, run_kinematics
from tdacoustic.attribution.sources import ConditionEvidence, SourceLine, attribute, means_line

__all__ = [
    "EVIDENCE",
    "ConditionEvidence",
    "ConditionLine",
    "Dominance",
    "EvidenceSettings",
    "RunEvidence",
    "RunKinematics",
    "SourceLine",
    "attribute",
    "dominance_of_condition",
    "means_line",
    "run_kinematics",
]
