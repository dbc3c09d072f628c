"""Hooks and fixtures of all tests. What they share otherwise is in the package helpers."""

import gc
import logging
from itertools import groupby

import pytest
from mpi4py import MPI

# their asserts show values, like those of the tests
pytest.register_assert_rewrite("helpers")


def pytest_addoption(parser):
    """A run whose parameters were all tried on fewer ranks, or with another dolfinx, need not try them all again."""
    ends = "of each test, take its last set of parameters only (1), or its first and last one (2)"
    parser.addoption("--thin", type=int, choices=(1, 2), help=ends)


def pytest_collection_modifyitems(config, items):
    """Leave out what `--thin` leaves out, the same on all ranks."""
    ends = config.getoption("thin")
    if ends is None:
        return
    kept = []
    for _, sets in groupby(items, lambda item: (item.path, getattr(item, "originalname", item.name))):
        *others, last = sets
        kept += [*others[: ends - 1], last]
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = kept


def pytest_collection_finish():
    """What is imported stays: collections during the run need not look at it again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _nothing_is_left():
    """What a test has dropped is freed before the next one: MPICH has some two thousand communicators a process."""
    yield
    gc.collect()


@pytest.fixture(autouse=True)
def _messages():
    """The command sets up the messages of its process: what they were before comes back."""
    logger = logging.getLogger("cutsim")
    handlers, propagate, level = list(logger.handlers), logger.propagate, logger.level
    yield
    logger.handlers[:], logger.propagate = handlers, propagate
    logger.setLevel(level)


@pytest.fixture
def folder(tmp_path):
    """One folder for all ranks."""
    return MPI.COMM_WORLD.bcast(tmp_path, root=0)
