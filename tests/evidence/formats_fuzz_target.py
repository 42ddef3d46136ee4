"""One format's reader under a fuzzer that is guided by its coverage (libFuzzer through atheris); run by `formats_fuzz`.

``formats_fuzz_target.py SCRATCH SUFFIX [libFuzzer's options] CORPUS``
"""

import contextlib
import importlib
import operator
import pkgutil
import random
import resource
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import atheris
from atheris.version_dependent import CMP_OP_SHIFT_AMOUNT

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "formats"), str(HERE.parents[1])]

with atheris.instrument_imports(include=["tdacoustic.formats"]):
    import tdacoustic.formats

    for module in pkgutil.walk_packages(tdacoustic.formats.__path__, "tdacoustic.formats."):
        with contextlib.suppress(ImportError):  # of an extra that is not installed
            importlib.import_module(module.name)

from fuzz_mutations import CHANGES, Change, changed  # noqa: E402
from fuzz_worker import read_log  # noqa: E402

from tdacoustic.formats.hdf5 import guard  # noqa: E402

guard.examine = lambda path, kind: None  # what its process refuses would teach the fuzzer nothing

COMPARISONS = (operator.lt, operator.le, operator.eq, operator.ne, operator.gt, operator.ge)
TRACED = frozenset({int, str, bytes, bool})
TEXTS = (b"\x00", b"\xff" * 8, b"\n", b'"', b"-1\n", b"<!ENTITY a SYSTEM 'file:///etc/passwd'>", b"1e999", b"\x80" * 40)


def mutated(data: bytes, most: int, seed: int) -> bytes:
    """Half of the changes are ours, which know where the formats keep their sizes."""
    chance = random.Random(seed)
    if chance.random() < 0.5 or len(data) < 2:
        return bytes(atheris.Mutate(data, most))
    for _ in range(chance.randint(1, 3)):
        text = chance.choice(TEXTS) if chance.random() < 0.5 else chance.randbytes(chance.randint(1, 16))
        change = Change(
            chance.choice(sorted(CHANGES)), chance.random(), chance.randint(-40, 80), chance.randint(0, 10_000), text
        )
        data = changed(data, change, data[::-1])
    return data[:most]


def without_leak(trace: Callable[..., Any]) -> Callable[..., Any]:
    """Return atheris' comparison for what it learns from, and Python's own for all else.

    atheris 3.0 keeps a reference to the result of every comparison that it traces. Of arrays that is an array, which
    then stays for ever: some 60 kB an execution in the reader of texts.
    """

    def compared(first: Any, second: Any, operation: int, *place: Any) -> Any:
        if type(first) in TRACED and type(second) in TRACED:
            return trace(first, second, operation, *place)
        return COMPARISONS[operation >> CMP_OP_SHIFT_AMOUNT](first, second)

    return compared


def main() -> None:
    """Fuzz until libFuzzer's time is over."""
    path = Path(sys.argv[1], f"log{sys.argv[2]}")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def attempt(data: bytes) -> None:
        if atheris._trace_cmp.__name__ != "compared":  # not before: `Fuzz` puts its own in place
            atheris._trace_cmp = without_leak(atheris._trace_cmp)
        path.write_bytes(data)
        read_log(str(path))

    atheris.Setup([sys.argv[0], *sys.argv[3:]], attempt, custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
