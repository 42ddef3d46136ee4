"""Results of many campaigns gathered: result folders -> one columnar dataset, and what stands out among them.

Results may come from others: nothing of theirs is executed, tables are read strictly by their contracts, paths stay
within their folders, and what is not as the manifest says is left out.
"""

from tdacoustic.gathering.dataset import DatasetWriter, check_pyarrow
from tdacoustic.gathering.folders import common_folder, find_folders, named_folders, relative_link
from tdacoustic.gathering.gathered import Gathering, LeftOut, repeated
from tdacoustic.gathering.manifest import NoCampaignError, ResultFolder, open_result
from tdacoustic.gathering.outliers import Comparison, compared
from tdacoustic.gathering.result import GatheredResult, ReadResult, read_result

__all__ = [
    "Comparison",
    "DatasetWriter",
    "GatheredResult",
    "Gathering",
    "LeftOut",
    "NoCampaignError",
    "ReadResult",
    "ResultFolder",
    "check_pyarrow",
    "common_folder",
    "compared",
    "find_folders",
    "named_folders",
    "open_result",
    "read_result",
    "relative_link",
    "repeated",
]
