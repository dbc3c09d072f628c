"""One way to refuse bad input: the parameter, its value and what is allowed."""

from collections.abc import Iterable
from typing import Any


def require(name: str, value: Any, valid: bool, allowed: str) -> None:
    """Refuse a parameter.

    Args:
        name: Name of the parameter as the user wrote it.
        value: Its value.
        valid: Whether the value is admissible; the same on all ranks.
        allowed: What is admissible, in words that complete "must be …".

    Raises:
        ValueError: ``valid`` is false.
    """
    if not valid:
        raise ValueError(f"{name} = {value!r} is not allowed: it must be {allowed}")


def place(x: Iterable[float]) -> str:
    """A position in words."""
    return "({})".format(", ".join(f"{round(float(c), 12) + 0.0:.4g}" for c in x))
