"""What memory this machine has free and this process holds, where the system tells; the standard library has no name
for it, so each system's own way is asked.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

__all__ = ["can_measure_memory", "free_memory_bytes", "peak_memory_bytes", "used_memory_bytes"]

_MEMINFO = Path("/proc/meminfo")
_STATUS = Path("/proc/self/status")
_CGROUP = Path("/sys/fs/cgroup")


def free_memory_bytes() -> int | None:
    """Return what can be used without swapping, within the limit of this process's group; None where nobody tells."""
    free = _kib(_MEMINFO, "MemAvailable")
    left = _left_of_group()
    known = [value for value in (free, left) if value is not None]
    return min(known) if known else None


def _left_of_group() -> int | None:
    """What a container's limit leaves; memory that only caches files counts as free."""
    try:
        most = int((_CGROUP / "memory.max").read_text())
        used = int((_CGROUP / "memory.current").read_text())
        cached = re.search(r"^inactive_file (\d+)$", (_CGROUP / "memory.stat").read_text(), re.M)
    except (OSError, ValueError):  # another system, or "max"
        return None
    return max(0, most - used + (int(cached[1]) if cached else 0))


def can_measure_memory() -> bool:
    """Whether this system tells what a process holds."""
    return used_memory_bytes() > 0


def used_memory_bytes() -> int:
    """Return what this process holds now, else what it held at most (macOS); 0 where the system does not tell."""
    return _kib(_STATUS, "VmRSS") or _peak_by_resource()


def peak_memory_bytes() -> int:
    """Return what this process held at most; 0 where the system does not tell."""
    return _kib(_STATUS, "VmHWM") or _peak_by_resource()


def _kib(path: Path, key: str) -> int | None:
    try:
        found = re.search(rf"^{key}:\s+(\d+) kB", path.read_text(), re.M)
    except (OSError, ValueError):
        return None
    return None if found is None else int(found[1]) * 1024


def _peak_by_resource() -> int:
    try:
        import resource
    except ImportError:  # Windows
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
