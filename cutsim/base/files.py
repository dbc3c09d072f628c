"""Atomic replacement of files: whoever reads one sees the old or the new content, never half of it."""

import os
from pathlib import Path


def replace_file(path: Path | str, data: bytes) -> None:
    """Write a file in one go: readers see the old or the new one, never half of it. Call it on one rank.

    The same holds for a process that is killed meanwhile, a full disk, and a loss of power.

    Args:
        path: The file; folders are made.
        data: What it will hold.

    Raises:
        OSError: It cannot be written; the old one is as it was.
    """
    target = Path(path)
    draft = target.with_name(f".{target.name}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with draft.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, target)
        _sync(target.parent)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror, str(target)) from error


def _sync(folder: Path) -> None:
    """Make sure that the names in a folder survive a loss of power."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
