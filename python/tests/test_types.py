"""Docstrings run, and stubs fit what is there."""

import doctest
import importlib.util
import pkgutil
import subprocess
import sys

import pytest

import teachtree

OPTIONAL = {"teachtree.dask", "teachtree.ray"}
if not (importlib.util.find_spec("pyarrow") and importlib.util.find_spec("fsspec")):
    OPTIONAL.add("teachtree.fleet")


def modules() -> list[str]:
    names = [f"teachtree.{found.name}" for found in pkgutil.iter_modules(teachtree.__path__)]
    return ["teachtree", *(name for name in names if not name.endswith(("_teachtree", "__main__")) and name not in OPTIONAL)]


def test_docstrings_run() -> None:
    flags = doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL
    results = [doctest.testmod(importlib.import_module(name), optionflags=flags) for name in modules()]
    assert sum(result.failed for result in results) == 0
    # The examples are found at all.
    assert sum(result.attempted for result in results) > 25


def test_the_stub_fits_the_extension() -> None:
    pytest.importorskip("mypy")
    words = [sys.executable, "-m", "mypy.stubtest", "teachtree._teachtree"]
    checked = subprocess.run(words, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout


def test_types_hold() -> None:
    pytest.importorskip("mypy")
    words = [sys.executable, "-m", "mypy", "--config-file", "python/pyproject.toml", "-p", "teachtree"]
    checked = subprocess.run(words, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout
