"""What the work of an insertion is spent on: toughness, parts of the force, the experiment with two insertions.

All of it starts from the columns of a run of `cutsim.studies.insertion.Insertion` (docs/needle_insertion.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from cutsim.base.checks import between, require, require_number
from cutsim.studies.insertion import Insertion
from cutsim.tools.tool_parts import PARTS

Array = NDArray[np.float64]
History = Mapping[str, Array]


def recovered_toughness(history: History, start: float, end: float, whole: float) -> float:
    """Toughness from a simulated curve by a balance of work, G = (∫F ds − ΔE − losses)/ΔA [force/length].

    What the tool spends between two depths is taken from its force, not from the cohesive law: the external work less
    the energy held by body and contact, and less friction and viscous losses; ΔA is the growth of the cut area.

    Args:
        history: Columns of a run of `Insertion`.
        start: Depth at which the balance begins [length].
        end: Depth at which it ends [length].
        whole: Factor from the meshed part to the whole block.

    Raises:
        ValueError: The cut does not grow between the two depths.
    """
    held = ("strain", "contact", "friction", "viscous")
    spent = whole * (history["work_external"] - sum(history[f"energy_{name}"] for name in held))
    pushed = _first_push(history["depth"])

    def grown(column: Array) -> float:
        first, last = np.interp([start, end], history["depth"][pushed], column[pushed])
        return float(last - first)

    area = grown(history["cut"])
    require("depths", (start, end), area > 0, "such that the cut grows between them")
    return grown(spent) / area


def force_parts(history: History, whole: float, window: float) -> dict[str, Array]:
    """The force of the first push by what its work is spent on, in means over windows of the depth.

    Between two depths ∫F ds is what body and contact take up, what the crack takes up and dissipates, friction on tip
    and shaft, and viscosity: the mean force is the sum of its parts, but for the closure of the energy audit.

    Args:
        history: Columns of a run of `Insertion`.
        whole: Factor from the meshed part to the whole block.
        window: Length of the windows > 0 [length].

    Returns:
        By name: "depth", the middle of each window [length]; the mean "force" there; its parts "deformation",
        "cutting", "tip friction", "shaft friction" and "viscosity" [force].

    Raises:
        ValueError: The push is shorter than a window.
    """
    pushed = _first_push(history["depth"])
    depth = history["depth"][pushed]
    way = float(np.ptp(depth))
    require_number("window", window, between(0, way, "(]", name="way pushed"))
    ends = depth[-1] - window * np.arange(int(way / window * (1 + 1e-9)) + 1)[::-1]

    def rate(work: Array) -> Array:
        return np.diff(np.interp(ends, depth, work)) / window

    def energy(*names: str) -> Array:
        return rate(whole * np.sum([history[f"energy_{name}"][pushed] for name in names], axis=0))

    return {
        "depth": 0.5 * (ends[1:] + ends[:-1]),
        "force": rate(cumulative_trapezoid(history["force"][pushed], depth, initial=0.0)),
        "deformation": energy("strain", "contact"),
        "cutting": energy("cohesive_stored", "fracture"),
        **{f"{part} friction": rate(history[f"{part}_friction_work"][pushed]) for part in PARTS},
        "viscosity": energy("viscous"),
    }


@dataclass(frozen=True)
class TwoInsertions:
    """Work of two insertions to the same depth, the second along the broken path (Azar and Hayward 2008).

    The body ends in the same state both times, so that the difference is what was lost in the first insertion only.

    Attributes:
        first: Work of the tool in the first push [energy].
        second: Work in the second push [energy].
        losses: Friction and viscous work of the first push beyond that of the second [energy].
        area: New crack area, each point by its damage.
    """

    first: float
    second: float
    losses: float
    area: float

    @property
    def apparent(self) -> float:
        """What the experiment reads off, with the friction of both insertions taken to be the same [force/length]."""
        return (self.first - self.second) / self.area

    @property
    def toughness(self) -> float:
        """The same without the losses that the audit finds in excess in the first push [force/length]."""
        return (self.first - self.second - self.losses) / self.area

    @classmethod
    def of(cls, history: History, cut: Insertion) -> "TwoInsertions":
        """Evaluate a run to the end of the second push.

        Args:
            history: Its columns.
            cut: The insertion, with a `turn`.

        Raises:
            ValueError: The tool does not turn, or the run ended before the second push did.
        """
        require("turn", cut.turn, cut.turn is not None, "a depth: the tool is to be pushed twice")
        ends = [cut.time_of(depth, push) for push in (1, 2) for depth in (cut.tip, cut.turn or cut.tip)]
        time = history["time"]
        require("time", float(time[-1]), time[-1] >= ends[-1] * (1 - 1e-9), f">= {ends[-1]}, when the second push ends")
        work = cumulative_trapezoid(history["force"], history["depth"], initial=0.0)
        lost = cut.whole * (history["energy_friction"] + history["energy_viscous"])
        works, losses = (np.diff(np.interp(ends, time, column))[::2] for column in (work, lost))
        area = cut.whole * float(np.interp(ends[1], time, history["crack_broken"]))
        return cls(float(works[0]), float(works[1]), float(losses[0] - losses[1]), area)


def _first_push(depth: Array) -> NDArray[np.intp]:
    """Rows of the first push: the last one before it, then those in which the tool is deeper than ever before."""
    before = np.flatnonzero(np.diff(np.maximum.accumulate(depth)) > 0)
    return np.concatenate([before[:1], before + 1])
