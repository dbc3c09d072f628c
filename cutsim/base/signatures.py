"""Type checks of arguments: one that does not fit its annotation is refused by name before anything is computed."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from cutsim.base.checks import Refused

Checked = TypeVar("Checked", bound=Callable[..., Any])

#: What `require_number` and its like look at, since only they know the range.
_NUMBERS = (float, int, complex)
_MISSING = object()


def checked(target: Checked) -> Checked:
    """Compare the arguments of a function, or of the constructor of a class, with their annotations.

    Numbers are left to the checks of their ranges.

    Args:
        target: A function, or a class.

    Returns:
        The same; called with an argument of another kind than its annotation it raises a ValueError that names it.
    """
    if isinstance(target, type):
        target.__init__ = checked(target.__init__)  # type: ignore[misc]
        return target
    signature = inspect.signature(target)
    hints: dict[str, Any] = {}

    @wraps(target)
    def call(*args: Any, **kwargs: Any) -> Any:
        if not hints:  # names of the module that are defined further below are known only now
            hints.update(get_type_hints(target))
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            raise TypeError(f"{target.__qualname__.removesuffix('.__init__')}: {error}") from None
        for name, value in given.items():
            if name in hints and not _fits(value, hints[name]):
                raise _refused(name, value, hints[name])
        return target(*args, **kwargs)

    return call  # type: ignore[return-value]


def _resolved(hint: Any) -> Any:
    """An annotation without aliases."""
    alias = get_origin(hint) or hint
    if hasattr(alias, "__value__"):
        return _resolved(alias.__value__[get_args(hint)] if get_args(hint) else alias.__value__)
    return hint


def _fits(value: Any, hint: Any) -> bool:
    hint = _resolved(hint)
    origin, parts = get_origin(hint), get_args(hint)
    if hint is Any or hint in _NUMBERS or isinstance(hint, TypeVar):
        return True
    if origin in (Union, UnionType):
        return any(_fits(value, part) for part in parts)
    if origin is Literal:
        return isinstance(value, str) and value in parts
    if origin is np.ndarray:
        return _is_array(value, parts)
    if origin is not None and issubclass(origin, Sequence):
        if parts[0] in _NUMBERS:
            return isinstance(value, tuple | list | np.ndarray)
        count = len(parts) if origin is tuple and Ellipsis not in parts else None
        fits = isinstance(value, origin | list | tuple) and all(_fits(entry, parts[0]) for entry in value)
        return fits and count in (None, len(value))
    if origin is not None and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(_fits(entry, parts[1]) for entry in value.values())
    if origin is not None:
        return callable(value)
    if hint is bool:
        return isinstance(value, bool | np.bool_)
    if getattr(hint, "_is_protocol", False):  # isinstance would run the properties of the value
        return all(inspect.getattr_static(value, name, _MISSING) is not _MISSING for name in _members(hint))
    return isinstance(value, hint) if isinstance(hint, type) else True


def _refused(name: str, value: Any, hint: Any) -> Refused:
    """What to raise for an argument that does not fit; it names the entry of a sequence or mapping that is none."""
    hint = _resolved(hint)
    parts = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    for part in parts:
        kind = get_origin(part)
        if inspect.isclass(kind) and issubclass(kind, Mapping) and isinstance(value, Mapping):
            for key, entry in value.items():
                if not _fits(entry, get_args(part)[1]):
                    return Refused(f"{name}[{key!r}]", entry, _words(get_args(part)[1]))
        if inspect.isclass(kind) and issubclass(kind, Sequence) and isinstance(value, list | tuple):
            for i, entry in enumerate(value):
                if not _fits(entry, get_args(part)[0]):
                    return Refused(f"{name}[{i}]", entry, _words(get_args(part)[0]))
    return Refused(name, value, _words(hint))


def _is_array(value: Any, parts: tuple[Any, ...]) -> bool:
    """Whether a value is an array, or can be one: of integers where the annotation says so, of numbers elsewhere."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        return False
    whole = any(part in (np.int32, np.int64) for dtype in parts for part in get_args(dtype))
    return array.ndim > 0 and (array.size == 0 or array.dtype.kind in ("iu" if whole else "iuf"))


def _members(protocol: type) -> set[str]:
    bases = [base for base in protocol.__mro__ if getattr(base, "_is_protocol", False)]
    names = {name for base in bases for name in (*vars(base), *inspect.get_annotations(base))}
    return {name for name in names if not name.startswith("_")}


def _words(hint: Any) -> str:
    """An annotation in words that complete "it must be …"."""
    hint = _resolved(hint)
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(dict.fromkeys(_words(part) for part in parts))
    if origin is Literal:
        return " or ".join(repr(part) for part in parts)
    if origin is np.ndarray:
        return "an array"
    if origin is tuple and Ellipsis not in parts and parts[0] not in _NUMBERS:
        return f"{len(parts)} values, each {_words(parts[0])}"
    if origin is not None and issubclass(origin, Sequence):
        return f"a sequence, each {_words(parts[0])}"
    if origin is not None:
        return "a mapping" if issubclass(origin, Mapping) else "a function"
    names = {str: "a string", bool: "True or False", type(None): "None", float: "a number", int: "a whole number"}
    return names.get(hint, f"a {getattr(hint, '__name__', hint)}")
