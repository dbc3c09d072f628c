"""Hooks and fixtures of all tests. What they share otherwise is in the package helpers."""

import gc

import pytest
from mpi4py import MPI

# their asserts show values, like those of the tests
pytest.register_assert_rewrite("helpers")


def pytest_collection_finish():
    """What is imported stays: collections during the run need not look at it again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _nothing_is_left():
    """What a test has dropped is freed before the next one: MPICH has some two thousand communicators a process."""
    yield
    gc.collect()


@pytest.fixture
def folder(tmp_path):
    """One folder for all ranks."""
    return MPI.COMM_WORLD.bcast(tmp_path, root=0)
