"""Evaluation of the work of an insertion: toughness, parts of the force, and the experiment with two insertions.

All of it starts from the columns of a run of `cutsim.studies.insertion.Insertion` (docs/needle_insertion.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from cutsim.base.arrays import Array
from cutsim.base.checks import between, require, require_number
from cutsim.studies.insertion import Insertion
from cutsim.tools.tool_parts import PARTS

#: Columns of a run by name, as `cutsim.results.output.read_history` gives them.
HistoryOutput = Mapping[str, Array]

_VISCOUS = ("viscous", "cohesive_viscous")


def audited_toughness(history: HistoryOutput, start: float, end: float, symmetry_factor: float) -> float:
    """Toughness as the rest of the energy audit, (∫F ds − ΔE − losses)/ΔA: a check of the audit [force/length].

    ΔE is what body and contact hold, losses are friction and viscosity, and ΔA, the growth of the column `cut`, counts
    each point by the share of its work that the cohesive law has spent.  If the audit closes, this is the toughness
    that was put in, whatever the mechanics: it says nothing of the cut.  For that there is `SteadyCut`.

    Args:
        history: Columns of a run of `Insertion`.
        start: Depth at which the balance begins [length].
        end: Depth at which it ends [length].
        symmetry_factor: Factor from what is meshed to the whole body.

    Raises:
        ValueError: The cut does not grow between the two depths.
    """
    held = ("strain", "contact", "friction", *_VISCOUS)
    spent = symmetry_factor * (history["work_external"] - sum(history[f"energy_{name}"] for name in held))
    pushed = _first_push(history["depth"])

    def grown(column: Array) -> float:
        first, last = np.interp([start, end], history["depth"][pushed], column[pushed])
        return float(last - first)

    area = grown(history["cut"])
    require("depths", (start, end), area > 0, "such that the cut grows between them")
    return grown(spent) / area


def steady_force(toughness: float, width: float, stiffness: float = np.inf) -> float:
    """Force of a steady frictionless cut in a block that a smooth plate holds from below.

    What is not yet cut carries the force to the plate and is shorter by ε = F/S: per way the tool cuts 1 + ε of bond,
    and the block gives back ½ F ε.  So F (1 + ε/2) = G_c w (1 + ε).

    Args:
        toughness: G_c [force/length].
        width: Length w of the cutting edge; 1 in plane strain [length].
        stiffness: Axial stiffness S of the section below the cut: E A with free sides, E A/(1 − ν²) in plane strain
            [force].
    """
    if np.isinf(stiffness):
        return toughness * width
    x = toughness * width / stiffness
    return stiffness * (x - 1 + float(np.hypot(1, x)))


@dataclass(frozen=True)
class SteadyCut:
    """Steady cut between two depths, evaluated from the force and the crack front, independent of the energy audit.

    Between two steady states all that is stored moves along with the tool.  What the force has spent is then what the
    area swept by the front has cost, and the block below gives back what it was compressed by.

    Attributes:
        force: Mean force [force].
        drift: Change of the mean force from the first half of the stretch to the second, over the mean [–].
        way: Way of the tool [length].
        swept: Area swept by the front, in the reference configuration [area].
    """

    force: float
    drift: float
    way: float
    swept: float

    def toughness(self, stiffness: float = np.inf) -> float:
        """Force × way over swept area, with what the compressed block gives back; frictionless [force/length].

        Args:
            stiffness: Axial stiffness of the section below the cut, as in `steady_force` [force].
        """
        return self.force * self.way * (1 + self.force / stiffness / 2) / self.swept

    @classmethod
    def of(cls, history: HistoryOutput, start: float, end: float) -> "SteadyCut":
        """Evaluate the first push between two depths.

        Args:
            history: Columns of a run of `Insertion`.
            start: Depth at which the cut has become steady [length].
            end: A larger depth [length].

        Raises:
            ValueError: The front does not move between the two depths, or the run does not reach them.
        """
        pushed = _first_push(history["depth"])
        depth = history["depth"][pushed]
        inside = depth[0] <= start < end <= depth[-1] * (1 + 1e-9)
        require("depths", (start, end), inside, f"in growing order within [{depth[0]:g}, {depth[-1]:g}]")
        at = np.array([start, 0.5 * (start + end), end])
        work = np.interp(at, depth, cumulative_trapezoid(history["force"][pushed], depth, initial=0.0))
        swept = float(np.diff(np.interp([start, end], depth, history["front"][pushed]))[0])
        require("depths", (start, end), swept > 0, "such that the front moves between them")
        first, second = 2 * np.diff(work) / (end - start)
        force = float(0.5 * (first + second))
        return cls(force, float(second - first) / force, end - start, swept)


def force_parts(history: HistoryOutput, symmetry_factor: float, window: float) -> dict[str, Array]:
    """The force of the first push by what its work is spent on, in means over windows of the depth.

    Between two depths ∫F ds is what body and contact take up, what the crack takes up and dissipates, friction on tip
    and shaft, and viscosity: the mean force is the sum of its parts, but for the closure of the energy audit.

    Args:
        history: Columns of a run of `Insertion`.
        symmetry_factor: Factor from what is meshed to the whole body.
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
        return rate(symmetry_factor * np.sum([history[f"energy_{name}"][pushed] for name in names], axis=0))

    return {
        "depth": 0.5 * (ends[1:] + ends[:-1]),
        "force": rate(cumulative_trapezoid(history["force"][pushed], depth, initial=0.0)),
        "deformation": energy("strain", "contact"),
        "cutting": energy("cohesive_stored", "fracture"),
        **{f"{part} friction": rate(history[f"{part}_friction_work"][pushed]) for part in PARTS},
        "viscosity": energy(*_VISCOUS),
    }


@dataclass(frozen=True)
class TwoInsertions:
    """Work of two insertions to the same depth, the second along the broken path (Azar and Hayward 2008).

    The body ends in the same state both times, and begins without strain: the difference is what was lost in the first
    insertion only.  Both count from before the tool is in the notch, whose spreading takes work, more while the bond is
    whole.  The tool is not drawn out of it before the second push: what it had to spend up to there is what body and
    contact hold then.

    Attributes:
        first: Work of the tool from its entry into the notch to the end of the first push [energy].
        second: Work in the second push, and what is held at its beginning [energy].
        losses: Friction and viscous work of the first insertion beyond that of the second [energy].
        area: New crack area, each point by the part of its work that is lost for good, which its memory tells.
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
        """The same without the losses that the audit finds in excess in the first [force/length]."""
        return (self.first - self.second - self.losses) / self.area

    def beyond(self, shallower: "TwoInsertions") -> "TwoInsertions":
        """What this experiment adds to one of less depth: the fringe of half broken bond, in both, drops out."""
        names = [field.name for field in fields(self)]
        return TwoInsertions(*(getattr(self, name) - getattr(shallower, name) for name in names))

    @classmethod
    def of(cls, history: HistoryOutput, cut: Insertion) -> "TwoInsertions":
        """Evaluate a run to the end of the second push.

        Args:
            history: Its columns.
            cut: The insertion, with a turning depth.

        Raises:
            ValueError: The tool does not turn, or the run ended before the second push did.
        """
        motion, whole = cut.motion, cut.symmetry_factor
        turn = motion.turning_depth
        require("turning_depth", turn, turn is not None, "a depth: the tool is to be pushed twice")
        assert turn is not None
        pushes = [(turn, 1), (motion.start_depth, 2), (turn, 2)]
        ends = [0.0, *(cut.time_of(depth, push) for depth, push in pushes)]
        time = history["time"]
        require("time", float(time[-1]), time[-1] >= ends[-1] * (1 - 1e-9), f">= {ends[-1]}, when the second push ends")
        time = np.append(0.0, time)
        lost = sum(history[f"energy_{name}"] for name in ("friction", *_VISCOUS))
        works, losses = (
            whole * np.diff(np.interp(ends, time, np.append(0.0, column)))[::2]
            for column in (history["work_external"], lost)
        )
        held = np.append(0.0, history["energy_strain"] + history["energy_contact"])
        second = float(works[1]) + whole * float(np.interp(ends[2], time, held))
        area = float(np.interp(ends[1], history["time"], history["spent"]))
        return cls(float(works[0]), second, float(losses[0] - losses[1]), area)


def _first_push(depth: Array) -> NDArray[np.intp]:
    """Rows of the first push: the last one before it, then those in which the tool is deeper than ever before.

    A second push ends as deep as the first one but for rounding, which must not count.
    """
    before = np.flatnonzero(np.diff(np.maximum.accumulate(depth)) > 1e-12 * np.abs(depth).max())
    return np.concatenate([before[:1], before + 1])
