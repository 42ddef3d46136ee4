"""Verdicts on channels and runs: what is in order, what is doubtful, what cannot be used."""

from tdacoustic.quality.checks import check_channel, check_duplicates, check_siblings
from tdacoustic.quality.run_checks import check_speed
from tdacoustic.quality.statistics import Statistics, StatisticsMeter
from tdacoustic.quality.verdict import Verdict, worst

__all__ = [
    "Statistics",
    "StatisticsMeter",
    "Verdict",
    "check_channel",
    "check_duplicates",
    "check_siblings",
    "check_speed",
    "worst",
]
