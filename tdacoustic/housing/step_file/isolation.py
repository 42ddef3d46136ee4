"""A function run in a process of its own, bounded in time and memory.

OpenCASCADE can end the process on a damaged file, and Netgen can run for ever on a bad solid. Neither must take the
program, or a worker of its pool, along.
"""

from __future__ import annotations

import importlib
import os
import pickle
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path
from typing import Any, Final

from tdacoustic.errors import TdacousticError
from tdacoustic.housing.box import HousingError
from tdacoustic.isolation import PYTHON, bound_memory, child_environment, end_with_the_parent

__all__ = ["run_apart"]

_CODE: Final = "from tdacoustic.housing.step_file.isolation import serve; serve()"


def run_apart(function: str, arguments: tuple[Any, ...], what: str, most_s: float, most_bytes: int) -> Any:
    """Return what a function returns, run in another process.

    A plain ``subprocess``, because the processes of `multiprocessing` import the user's script again.

    Parameters
    ----------
    function : str
        As ``"package.module:name"``.
    arguments : tuple
        Picklable.
    what : str
        What it does, for messages: ``"reading it"``.
    most_s : float
        After which it is ended.
    most_bytes : int
        Of its address space, where the system can bound it.

    Raises
    ------
    TdacousticError
        What the function raises of this kind.
    HousingError
        Any other failure: a crash, the end of the time or the memory.
    """
    with tempfile.TemporaryDirectory(prefix="tdacoustic-") as folder:
        given, found = Path(folder, "given"), Path(folder, "found")
        given.write_bytes(pickle.dumps((function, arguments, most_bytes)))
        with subprocess.Popen(
            [*PYTHON, "-c", _CODE, str(given), str(found)],
            stdin=subprocess.PIPE,  # its end tells the child that its parent is gone
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=child_environment(),
        ) as child:
            try:
                code = child.wait(most_s)
            except BaseException as error:
                child.kill()
                if isinstance(error, subprocess.TimeoutExpired):
                    raise HousingError(f"{what} took more than {most_s:.0f} s and was ended") from None
                raise
        if not found.exists():
            raise HousingError(
                f"OpenCASCADE, Netgen or NGSolve crashed while {what} (exit status {code}): its geometry is damaged, "
                "or there is too little memory"
            )
        result, refused = pickle.loads(found.read_bytes())
    if refused is not None:
        raise refused
    return result


def serve() -> None:
    """Run what the parent asks for: the entry of the child process."""
    given, found = Path(sys.argv[1]), Path(sys.argv[2])
    end_with_the_parent()
    function, arguments, most_bytes = pickle.loads(given.read_bytes())
    bound_memory(most_bytes)
    result, error = None, None
    try:
        module, name = function.split(":")
        result = getattr(importlib.import_module(module), name)(*arguments)
    except TdacousticError as refused:
        error = refused
    except MemoryError:
        error = HousingError(f"it took more than {most_bytes / 1e9:.0f} GB of memory: simplify the housing")
    except Exception as defect:
        last = traceback.extract_tb(defect.__traceback__)[-1]
        said = " ".join(str(defect).split()) or type(defect).__name__
        error = HousingError(f"OpenCASCADE, Netgen or NGSolve failed with {said[:200]!r} (in {last.name})")
    partial = found.with_suffix(".partial")
    partial.write_bytes(pickle.dumps((result, error)))
    partial.replace(found)
    os._exit(0)  # without the clean-up of libraries that may be in disorder
