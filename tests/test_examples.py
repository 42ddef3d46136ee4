"""The examples in the docstrings do what they say."""

import doctest
import importlib
import pkgutil

import pytest

import tdacoustic

MODULES = [
    info.name for info in pkgutil.walk_packages(tdacoustic.__path__, "tdacoustic.") if "__main__" not in info.name
]


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_module(name):
    assert doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS).failed == 0
