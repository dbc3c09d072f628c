"""Log messages about collective actions, printed by one rank."""

import logging

from mpi4py import MPI


def collective_logger(name: str) -> logging.Logger:
    """Logger of a module that issues the same messages on every rank: only the first rank of the world speaks.

    Args:
        name: Name of the module.
    """
    logger = logging.getLogger(name)
    logger.addFilter(_first_rank)
    return logger


def _first_rank(record: logging.LogRecord) -> bool:
    return MPI.COMM_WORLD.rank == 0
