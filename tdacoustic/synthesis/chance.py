"""Random numbers that belong to a purpose, so that adding a line to a recipe leaves all the others as they were."""

from __future__ import annotations

import hashlib

import numpy as np

__all__ = ["generator"]


def generator(seed: int, *purpose: str) -> np.random.Generator:
    """Return the random generator of one purpose.

    Parameters
    ----------
    seed : int
        The campaign's seed.
    *purpose : str
        What the numbers are for: run, channel, part. Different purposes give independent numbers.

    Examples
    --------
    >>> int(generator(1, "a").integers(100)) - int(generator(1, "a").integers(100))
    0
    """
    digest = hashlib.blake2b("\x1f".join(purpose).encode(), digest_size=16).digest()
    return np.random.Generator(np.random.PCG64([seed, *np.frombuffer(digest, dtype="<u4").tolist()]))
