"""Steps of Abaqus and how prescribed values vary through them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from cutsim.cases.importing.abaqus_file import AbaqusFile
from cutsim.cases.importing.curves import Curve, Timed, with_jumps
from cutsim.cases.importing.draft import Untranslatable
from cutsim.readers.abaqus_cards import Card

_PROCEDURES = ("STATIC", "VISCO", "DYNAMIC")
_DEFINITIONS: Mapping[str, Callable[..., Curve]] = MappingProxyType(
    {"TABULAR": Curve, "": Curve, "SMOOTH STEP": Curve.smooth_steps}
)


@dataclass(frozen=True)
class Step:
    """Step of an analysis.

    Attributes:
        start: Time at its start [time].
        end: Time at its end [time].
        ramped: Whether values without an amplitude grow with time in it, in place of a jump at its start.
    """

    start: float
    end: float
    ramped: bool = True


def translate_steps(file: AbaqusFile) -> list[Step]:
    """Translate the steps; the first one returned is a moment before them."""
    heads = {located.step: located.card for located in file.take("STEP")}
    procedures = {located.step: located.card for located in file.take(*_PROCEDURES)}
    steps, sizes = [Step(0.0, 0.0)], []
    for number, head in heads.items():
        file.large |= head.get("NLGEOM").upper() in ("YES", "") and "NLGEOM" in head.parameters
        card, start = procedures.get(number), steps[-1].end
        if card is None:
            file.draft.untranslated(
                head.line, "*STEP: no *STATIC, *VISCO or *DYNAMIC; taken to be static over a time of 1"
            )
        first, period, largest = _increments(file, card)
        sizes.append((first, largest, card is not None and "DIRECT" in card.parameters))
        usual = "STEP" if card is not None and card.keyword == "DYNAMIC" else "RAMP"
        steps.append(Step(start, start + period, (head.get("AMPLITUDE").upper() or usual) == "RAMP"))
    file.end = steps[-1].end or 1.0
    dynamic = [card for card in procedures.values() if card.keyword == "DYNAMIC"]
    for card in dynamic[:1]:
        file.draft.difference(card.line, "*DYNAMIC: Newmark's trapezoidal rule, without the damping of Abaqus's scheme")
    file.draft.set("analysis", {"type": "dynamic" if dynamic else "quasi-static", "until": file.end})
    file.draft.set("steps", _smallest(sizes))
    return steps


def _increments(file: AbaqusFile, card: Card | None) -> tuple[float, float, float]:
    """First increment, period and largest increment of a step."""
    numbers = [] if card is None else file.numbers(card)
    period = (numbers[1] if len(numbers) > 1 else 0.0) or 1.0
    first = min((numbers[0] if numbers else 0.0) or period, period)
    largest = (numbers[3] if len(numbers) > 3 else 0.0) or period
    return first, period, min(largest, period)


def _smallest(sizes: list[tuple[float, float, bool]]) -> dict[str, float]:
    if sizes and all(direct for _, _, direct in sizes):
        return {"fixed": min(first for first, _, _ in sizes)}
    first, largest = (min((size[i] for size in sizes), default=0.1) for i in (0, 1))
    return {"first": min(first, largest), "largest": largest}


@dataclass
class History:
    """Value of a condition through the steps.

    Attributes:
        times: Times of its points; two of them may be the same, where it jumps.
        values: Its value at each.
    """

    times: list[float] = field(default_factory=lambda: [0.0])
    values: list[float] = field(default_factory=lambda: [0.0])

    def set(self, value: float, step: Step, amplitude: Curve | None = None) -> None:
        """Bring the value to another one in a step, along an amplitude or as the step says."""
        if step.end == step.start:  # before the first step
            self.values[-1] = value
        elif amplitude is not None:
            inside = amplitude.times[(amplitude.times > step.start) & (amplitude.times < step.end)]
            times = np.array([step.start, *inside, step.end])
            for time, factor in zip(times, np.interp(times, amplitude.times, amplitude.values), strict=True):
                self._add(float(time), value * float(factor))
        else:
            self._add(step.start, self.values[-1])
            self._add(step.end if step.ramped else step.start, value)

    def _add(self, time: float, value: float) -> None:
        if (time, value) != (self.times[-1], self.values[-1]):
            self.times.append(time)
            self.values.append(value)

    def timed(self) -> Timed:
        """The value as a function of time."""
        if len(set(self.values)) == 1:
            return Timed(self.values[0])
        return Timed(1.0, Curve(with_jumps(np.array(self.times)), np.array(self.values)))


class Amplitudes:
    """Amplitudes of a file.

    Args:
        file: The file.
    """

    def __init__(self, file: AbaqusFile) -> None:
        self._file = file
        self._cards = {located.card.get("NAME").upper(): located.card for located in file.take("AMPLITUDE")}

    def of(self, card: Card, step: Step) -> Curve | None:
        """Amplitude of a condition in a step as a function of the time of the run, None if it has none.

        Raises:
            Untranslatable: It is of a kind that has no counterpart.
            ValueError: There is none of its name, or its points are in no order.
        """
        name = card.get("AMPLITUDE")
        if not name:
            return None
        if name.upper() not in self._cards:
            with card.at():
                raise ValueError(f"there is no *AMPLITUDE {name!r}")
        amplitude = self._cards[name.upper()]
        make = _DEFINITIONS.get(amplitude.get("DEFINITION").upper())
        if make is None:
            raise Untranslatable(f"its amplitude has DEFINITION={amplitude.get('DEFINITION')}", amplitude.line)
        numbers = np.array(self._file.numbers(amplitude))
        times, values = numbers[: len(numbers) // 2 * 2].reshape(-1, 2).T
        if not len(times) or (np.diff(times) < 0).any():
            with amplitude.at():
                raise ValueError("needs points with increasing times")
        shift = 0.0 if amplitude.get("TIME").upper().startswith("TOTAL") else step.start
        return make(with_jumps(times + shift), values)
