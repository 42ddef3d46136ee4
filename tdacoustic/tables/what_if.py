"""``what_if.csv`` as a view of an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tdacoustic.drive.what_if import WhatIfAnswer, WhatIfLevel
from tdacoustic.tables.frames import Row, frame_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["what_if_table"]


def what_if_table(answer: WhatIfAnswer) -> pd.DataFrame:
    """Return the levels of each case, with their intervals where there are any.

    Parameters
    ----------
    answer : WhatIfAnswer
    """
    return frame_of("what_if", [_row(level) for level in answer.levels])


def _row(level: WhatIfLevel) -> Row:
    ends = {"change": level.change_95_db, "level": level.level_95_db, "fit_change": level.fit_95_db}
    return {
        "condition": level.condition,
        "train_speed_km_h": level.train_speed_km_h,
        "receiver": level.receiver,
        "weighting": level.weighting,
        "case": level.case,
        "level_db": level.level_db,
        "change_db": level.change_db,
        "before_db": level.before_db,
        **{f"{what}_low_db": held[0] for what, held in ends.items() if held is not None},
        **{f"{what}_high_db": held[1] for what, held in ends.items() if held is not None},
    }
