"""Every row of the fault tables comes to what the row says: no traceback, no silent wrong number."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest

from tdacoustic.errors import TdacousticError
from tdacoustic.formats import scan

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
        assert "\n" not in message and len(message) < 2000
        return
    log, values = read_all(path)
    flags = [*log.flags, *(flag for channel in log.channels for flag in channel.flags)]
    if fault.outcome == "flagged":
        assert any(re.search(fault.says, flag) for flag in flags), flags
    else:
        assert not flags
    if fault.values is not None:
        assert len(values) == len(fault.values)
        for found, wanted in zip(values, fault.values, strict=True):
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=fault.tolerance, equal_nan=True)
