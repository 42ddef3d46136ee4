"""Which source owns which noise line, and which dominates a condition.

Two questions are kept apart: which body *radiates* a line (whose sensors show
it), and what *excites* it (whose order it is).
"""

from tdacoustic.attribution.contributions import CampaignContributions, ContributionState
from tdacoustic.attribution.dominance import Dominance, dominance_of_condition
from tdacoustic.attribution.evidence import EVIDENCE, EvidenceSettings, RunEvidence
from tdacoustic.attribution.judgement import ConditionLine
from tdacoustic.attribution.kinematic import RunKinematics, run_kinematics
from tdacoustic.attribution.slips import RunSlip, check_tachos, run_slips
from tdacoustic.attribution.sources import ConditionEvidence, SourceLine, attribute, means_line
from tdacoustic.attribution.speed_axis import RunSpeeds, run_speeds, steady_speeds

__all__ = [
    "EVIDENCE",
    "CampaignContributions",
    "ConditionEvidence",
    "ConditionLine",
    "ContributionState",
    "Dominance",
    "EvidenceSettings",
    "RunEvidence",
    "RunKinematics",
    "RunSlip",
    "RunSpeeds",
    "SourceLine",
    "attribute",
    "check_tachos",
    "dominance_of_condition",
    "means_line",
    "run_kinematics",
    "run_slips",
    "run_speeds",
    "steady_speeds",
]
