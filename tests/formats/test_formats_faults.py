"""Every row of the fault tables comes to what the row says: no traceback, no silent wrong number.

What is flagged is also said by ``tdacoustic info``.
"""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
from fault_table import NOT_HELD
from fuzz_worker import STEERING

from tdacoustic.errors import TdacousticError
from tdacoustic.formats import scan
from tdacoustic.formats.bounds import MAX_MESSAGE
from tdacoustic.workflows.info import describe_log, info_text

MODULES = sorted(path.stem for path in Path(__file__).parent.glob("faults_*.py"))
ROWS = [
    pytest.param(fault, id=f"{module.removeprefix('faults_')}: {fault.name}")
    for module in MODULES
    for fault in importlib.import_module(module).FAULTS
]


def read_all(path):
    """Scan a log and read every channel by itself; returns the log and its values."""
    log = scan(path)
    values = []
    for column, channel in enumerate(log.channels):
        blocks = list(log.reader.blocks([column], 0, channel.raster.n_samples, 1000))
        values.append(np.concatenate(blocks, axis=1)[0] if blocks else np.empty(0))
    return log, values


@pytest.mark.parametrize("fault", ROWS)
def test_fault(fault, tmp_path):
    path = fault.make(tmp_path)
    if fault.outcome == "refused":
        with pytest.raises(TdacousticError) as caught:
            read_all(path)
        message = str(caught.value)
        assert path.name in message, message
        assert re.search(fault.says, message), message
        assert not STEERING.search(message) and len(message) <= MAX_MESSAGE
        return
    log, values = read_all(path)
    flags = [*log.flags, *(flag for channel in log.channels for flag in channel.flags)]
    if fault.outcome == "flagged":
        assert any(re.search(fault.says, flag) for flag in flags), flags
        said = info_text(describe_log(path))
        assert re.search(fault.says, said), said
    else:
        assert not flags
    if fault.rate_hz != NOT_HELD:
        assert {channel.raster.sample_rate_hz for channel in log.channels} == {fault.rate_hz}
    if fault.values is not None:
        assert len(values) == len(fault.values)
        for found, wanted in zip(values, fault.values, strict=True):
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=fault.tolerance, equal_nan=True)
