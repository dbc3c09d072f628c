"""Hooks and fixtures of all tests. What they share otherwise is in the package helpers."""

import gc
import logging
from itertools import count, groupby

import pytest
from mpi4py import MPI

# their asserts show values, like those of the tests
pytest.register_assert_rewrite("helpers")


def pytest_addoption(parser):
    """A run whose parameters were all tried on fewer ranks, or with another dolfinx, need not try them all again."""
    parser.addoption("--thin", action="store_true", help="of each test, take its first and last set of parameters only")


def pytest_collection_modifyitems(config, items):
    """Leave out what `--thin` leaves out, the same on all ranks."""
    if not config.getoption("thin"):
        return
    kept = []
    for _, sets in groupby(items, lambda item: (item.path, getattr(item, "originalname", item.name))):
        first, *others = sets
        kept += [first, *others[-1:]]
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = kept


def pytest_collection_finish():
    """What is imported stays: collections during the run need not look at it again."""
    gc.collect()
    gc.freeze()


_ended = count(1)


@pytest.fixture(autouse=True)
def _nothing_is_left():
    """What tests have dropped is freed: MPICH has some two thousand communicators for all ranks of a process.

    On one rank, where most are not needed, now and then is enough.
    """
    yield
    if MPI.COMM_WORLD.size > 1 or next(_ended) % 8 == 0:
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
