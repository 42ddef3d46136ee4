"""One format's reader under a fuzzer that is guided by its coverage (libFuzzer through atheris); run by `formats_fuzz`.

``formats_fuzz_target.py SCRATCH SUFFIX [libFuzzer's options] CORPUS``
"""

import contextlib
import importlib
import pkgutil
import random
import resource
import sys
from pathlib import Path

import atheris

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


def main() -> None:
    """Fuzz until libFuzzer's time is over."""
    path = Path(sys.argv[1], f"log{sys.argv[2]}")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def attempt(data: bytes) -> None:
        path.write_bytes(data)
        read_log(str(path))

    atheris.Setup([sys.argv[0], *sys.argv[3:]], attempt, custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
