"""Tables as CSV text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["csv_text"]


def csv_text(frame: pd.DataFrame) -> str:
    """Return a table as CSV: one header row, LF, ``%.9g``, empty for what is not determined, true / false."""
    import pandas as pd

    shown = frame.copy()
    for column in shown.columns:
        if pd.api.types.is_bool_dtype(shown[column]):
            shown[column] = shown[column].map({True: "true", False: "false"}, na_action="ignore")
    return shown.to_csv(index=False, lineterminator="\n", float_format="%.9g", na_rep="")
