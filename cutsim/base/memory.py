"""Memory of a run: named quantities, each with a trial and a committed value.

Whoever has to remember something from step to step registers it, and reads and sets its trial value.  A step that is
accepted is committed here, one that is given up is rolled back here; both restore values bit for bit.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from cutsim.base.packing import unpacked
from cutsim.base.places import Places

T = TypeVar("T")
Q = TypeVar("Q", bound="Remembered[Any]")
Container: TypeAlias = fem.Function | fem.Constant


class Remembered(Generic[T]):
    """A quantity with a trial and a committed value.

    Values are replaced and never changed in place, so that trial and committed value may be one object.

    Args:
        value: Value at the start.
        show: Called with the value that counts from then on, whenever a step is committed or given up. It keeps up to
            date what is derived from the committed value, such as a coefficient of forms.
        places: Places of the entries of its arrays, see `Memory.value`.

    Attributes:
        trial: Value at the end of the trial step.
        committed: Value at its start.
        places: As above.
    """

    def __init__(self, value: T, show: Callable[[T], None] | None = None, places: Any = None) -> None:
        self.trial = self.committed = value
        self._show, self.places = show, places

    def set(self, value: T) -> None:
        """Set both values: for what is known whether or not the step is accepted."""
        self.trial = self.committed = value
        self.rollback()

    def commit(self) -> None:
        """Adopt the trial value."""
        self.committed = self.trial
        self.rollback()

    def rollback(self) -> None:
        """Give the trial value up."""
        self.trial = self.committed
        if self._show is not None:
            self._show(self.committed)


class RememberedArray(Remembered[NDArray[np.float64]]):
    """The values of a function or form constant, which shows the trial value.

    Args:
        shown: The function or constant; what it is at the time is the value at the start.
        before: A function or constant that shows the committed value.
        places: Places of the values of a function, if they are not those of its space.
    """

    def __init__(self, shown: Container, before: Container | None = None, places: Places | None = None) -> None:
        self._values, self._before = _values(shown), None if before is None else _values(before)
        if places is None and isinstance(shown, fem.Function):
            places = Places.of(shown.function_space)
        super().__init__(self._values.copy(), places=places)
        self.rollback()

    @property
    def trial(self) -> NDArray[np.float64]:
        """Present values of the function or constant."""
        return self._values

    @trial.setter
    def trial(self, values: NDArray[np.float64]) -> None:
        self._values[...] = values

    def commit(self) -> None:
        """Adopt the present values."""
        self.committed = self._values.copy()
        self.rollback()

    def rollback(self) -> None:
        """Bring the committed values back."""
        self._values[...] = self.committed
        if self._before is not None:
            self._before[...] = self.committed


class Cache(Generic[T]):
    """What can be found anew, at a cost, and is kept whether or not a step is accepted. No snapshot has it.

    Args:
        value: Value at the start.
        anew: Gives the value from which it is found anew, from the present one.

    Attributes:
        value: Present value.
    """

    def __init__(self, value: T, anew: Callable[[T], T]) -> None:
        self.value, self._anew = value, anew

    def forget(self) -> None:
        """Find it anew."""
        self.value = self._anew(self.value)


class Memory:
    """Registry of what a run remembers.

    Quantities are independent of each other: the order in which they are registered, committed or restored does not
    matter.  A name that is taken is numbered: "crack", "crack 2".
    """

    def __init__(self) -> None:
        self._quantities: dict[str, Remembered[Any]] = {}
        self._awaited: dict[str, Any] = {}
        self._caches: list[Cache[Any]] = []

    @property
    def awaited(self) -> Mapping[str, Any]:
        """Values that were loaded for what is not registered yet, by name."""
        return MappingProxyType(self._awaited)

    @property
    def quantities(self) -> Mapping[str, Remembered[Any]]:
        """What is remembered, by name."""
        return MappingProxyType(self._quantities)

    def value(
        self, name: str, value: T, show: Callable[[T], None] | None = None, *, places: Any = None
    ) -> Remembered[T]:
        """Register a value: a number, an array, a tuple, a dictionary or a frozen dataclass of these.

        Args:
            name: Name, with that of the owner in front, such as "crack: losses".
            value: Value at the start.
            show: See `Remembered`; not called yet.
            places: Places of the entries of its arrays (`cutsim.base.places.Places`), by which they find their way to
                other ranks. If those of its parts differ, a tuple, a dictionary or a dataclass of them, as the value
                is. None for numbers, and for arrays that are the same on all ranks.
        """
        return self._register(name, Remembered(value, show, places))

    def array(
        self, name: str, shown: Container, before: Container | None = None, *, places: Places | None = None
    ) -> RememberedArray:
        """Register a function or form constant that shows the trial value.

        Args:
            name: As in `value`.
            shown: The function or constant.
            before: A function or constant that shows the committed value.
            places: Places of the values of a function, if they are not those of its space.
        """
        return self._register(name, RememberedArray(shown, before, places))

    def cache(self, value: T, anew: Callable[[T], T]) -> Cache[T]:
        """Register what can be found anew; see `Cache`."""
        cache = Cache(value, anew)
        self._caches.append(cache)
        return cache

    def commit(self) -> None:
        """Adopt all trial values."""
        for quantity in self._quantities.values():
            quantity.commit()

    def rollback(self) -> None:
        """Give all trial values up."""
        for quantity in self._quantities.values():
            quantity.rollback()

    def save(self) -> "Snapshot":
        """The committed values, as they are on this rank. What can be found anew is forgotten."""
        self._forget()
        return Snapshot({name: quantity.committed for name, quantity in self._quantities.items()})

    def load(self, snapshot: "Snapshot") -> None:
        """Commit saved values; those of quantities that are not registered yet, as soon as they are.

        Raises:
            ValueError: The snapshot is that of another problem: it lacks a quantity that is remembered, or one has
                other fields or another shape. Nothing is changed then.
        """
        if lacking := self._quantities.keys() - snapshot.values.keys():
            raise ValueError(f"snapshot: {', '.join(sorted(lacking))} of the problem are not in it")
        values = {
            name: unpacked(quantity.committed, snapshot.values[name], name)
            for name, quantity in self._quantities.items()
        }
        self._awaited = {name: value for name, value in snapshot.values.items() if name not in self._quantities}
        for name, quantity in self._quantities.items():
            quantity.set(values[name])
        self._forget()

    def _forget(self) -> None:
        for cache in self._caches:
            cache.forget()

    def _register(self, name: str, quantity: Q) -> Q:
        number, taken = 2, name
        while taken in self._quantities:
            taken, number = f"{name} {number}", number + 1
        self._quantities[taken] = quantity
        if taken in self._awaited:
            quantity.set(unpacked(quantity.committed, self._awaited.pop(taken), taken))
        return quantity


class Snapshot:
    """Committed values of a memory at one time.  Two are equal if all their values are, bit for bit.

    Attributes:
        values: Name → value.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.values = dict(values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Snapshot) and _equal(self.values, other.values)

    __hash__ = None  # type: ignore[assignment]  # it has arrays


def _values(shown: Container) -> NDArray[np.float64]:
    """The values of a function or constant, to be changed in place."""
    return np.asarray(shown.value if isinstance(shown, fem.Constant) else shown.x.array)


def _equal(a: Any, b: Any) -> bool:
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return bool(np.array_equal(a, b, equal_nan=True))
    if isinstance(a, Mapping):
        return a.keys() == b.keys() and all(_equal(a[key], b[key]) for key in a)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(_equal, a, b))
    if is_dataclass(a):
        return all(_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return bool(a == b or (a != a and b != b))
