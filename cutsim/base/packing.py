"""Values as plain data, which a file can hold: numbers, words, and arrays apart from them."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cutsim.base.places import Places

Array = NDArray[Any]
#: The JSON forms of a dictionary, a dataclass, a tuple, a list and the number of an array have one of these keys each.
_MAPPING, _FIELDS, _TUPLE, _LIST, _ARRAY = "mapping", "fields", "tuple", "list", "array"


class Fields(dict[str, Any]):
    """Fields of a dataclass by name, as they are read from a file, before it is known of which."""


def pack(value: Any, places: Any, store: Callable[[Array, Places | None], int]) -> Any:
    """A value in the types JSON knows.

    Args:
        value: Numbers, words, arrays, and tuples, lists, dictionaries and dataclasses of these.
        places: Places of its arrays, see `cutsim.base.memory.Memory.value`.
        store: Called with each array and its places; gives it a number.

    Raises:
        TypeError: There is something else in it.
    """
    if isinstance(value, np.ndarray):
        return {_ARRAY: store(value, places)}
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if is_dataclass(value):
        parts = {f.name: pack(getattr(value, f.name), _part(places, f.name), store) for f in fields(value)}
        return {_FIELDS: parts}
    if isinstance(value, Mapping):
        entries = [[pack(key, None, store), pack(entry, _part(places, key), store)] for key, entry in value.items()]
        return {_MAPPING: entries}
    if isinstance(value, tuple | list):
        kind = _TUPLE if isinstance(value, tuple) else _LIST
        return {kind: [pack(entry, _part(places, i), store) for i, entry in enumerate(value)]}
    raise TypeError(f"{value!r} is no number, word or array, and no dataclass, dictionary or tuple of these")


def unpack(packed: Any, places: Any, fetch: Callable[[int, Places | None], Array]) -> Any:
    """The value that was packed, with `Fields` in place of dataclasses.

    Args:
        packed: What `pack` has given.
        places: As for `pack`.
        fetch: Gives the array of a number, and with these places.
    """
    if not isinstance(packed, dict):
        return packed
    ((kind, parts),) = packed.items()
    if kind == _ARRAY:
        return fetch(parts, places)
    if kind == _FIELDS:
        return Fields({name: unpack(part, _part(places, name), fetch) for name, part in parts.items()})
    if kind == _MAPPING:
        keys = [unpack(key, None, fetch) for key, _ in parts]
        return {key: unpack(part, _part(places, key), fetch) for key, (_, part) in zip(keys, parts, strict=True)}
    entries = [unpack(part, _part(places, i), fetch) for i, part in enumerate(parts)]
    return tuple(entries) if kind == _TUPLE else entries


def unpacked(like: Any, value: Any, name: str) -> Any:
    """A value with dataclasses in place of their fields.

    Args:
        like: A value of the same kind, which has the dataclasses.
        value: The value.
        name: Name of the quantity.

    Raises:
        ValueError: A dataclass has other fields, or an array another shape.
    """
    if isinstance(value, Fields):
        names = [f.name for f in fields(like)] if is_dataclass(like) else []
        if list(value) != names or isinstance(like, type):
            raise ValueError(f"{name}: {', '.join(value)} in place of {', '.join(names) or repr(like)}")
        return type(like)(**{key: unpacked(getattr(like, key), part, name) for key, part in value.items()})
    if isinstance(value, np.ndarray) and isinstance(like, np.ndarray) and value.shape != like.shape:
        raise ValueError(f"{name}: shape {value.shape} in place of {like.shape}")
    if isinstance(value, tuple | list) and isinstance(like, tuple | list) and len(like) == len(value):
        return type(value)(unpacked(a, b, name) for a, b in zip(like, value, strict=True))
    if isinstance(value, Mapping) and isinstance(like, Mapping):
        return {key: unpacked(like.get(key), part, name) for key, part in value.items()}
    return value


def _part(places: Any, key: Any) -> Any:
    """Places of a part of a value."""
    if places is None or isinstance(places, Places):
        return places
    return getattr(places, key) if is_dataclass(places) else places[key]
