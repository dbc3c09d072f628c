"""Check whether a rigid tool has passed through the surface of the body, where it would push outwards."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cutsim.fields.points import Surface, Values
from cutsim.tools.rigid_tool import RigidTool

# cosine between the normals of body and tool from which the tool is behind the surface of the body
_BEHIND = 0.5
# change of this cosine in a step that is a jump to the other side of the tool
_TURN = 0.5
# times of a step at which a tool that has come behind the surface is looked for in it
_SAMPLES = 50


class Touched(Protocol):
    """Surface of the body that a tool may touch.

    Attributes:
        surface: Its points.
    """

    surface: Surface

    def contact(self) -> Mapping[str, Values]:
        """Present "depth" of the points in the tool and "facing" of its normal and theirs. Collective."""


@dataclass(frozen=True)
class _Seen:
    """Contact of all patches at the end of a step, and depth and facing of the point that is nearest to the tool."""

    contact: tuple[Mapping[str, Values], ...]
    nearest: tuple[float, float]


class Passing:
    """Check on which side of the surfaces a tool is. Every method is collective.

    Args:
        tool: The tool, at the start of its path.
        patches: The surfaces.

    Raises:
        ValueError: The tool begins so deep in the body that it would come out on the far side.
    """

    def __init__(self, tool: RigidTool, patches: Sequence[Touched]) -> None:
        self._tool, self._patches = tool, patches
        seen = tuple(p.contact() for p in patches)
        if count := self._count([_pushed(now) for now in seen]):
            depth = max(p.surface.points.maximum(now["depth"]) for p, now in zip(patches, seen, strict=True))
            raise ValueError(
                f"path of {tool.name!r}: at its start {count} points of the body lie behind the middle of the tool, up "
                f"to {depth:.3g} deep in it, from where it would push them outwards; let it begin outside the body, or "
                "less deep in it"
            )
        nearest, facing = _nearest(patches, seen)
        if facing > _BEHIND and nearest < 0:
            tool.state.verdict.doubt(
                f"{tool.name}: start",
                f"{tool.name} begins {-nearest:.3g} behind the nearest point of what it can touch: inside the body, or "
                "beyond it",
            )
        start = _Seen(seen, (nearest, facing))
        places = {"contact": [p.surface.points.places for p in patches], "nearest": None}
        self._known = tool.state.memory.value(f"{tool.name}: passing", start, places=places)

    def objection(self) -> str | None:
        """In words, whether the tool has come through the surface in this step; None if it has not."""
        seen, old = tuple(p.contact() for p in self._patches), self._known.committed
        both = list(zip(old.contact, seen, strict=True))
        # a rim that friction folds turns slowly, step by step, and is left alone
        pushed = [_pushed(now) & (now["facing"] - then["facing"] > _TURN) for then, now in both]
        turned = [(then["facing"] < -_BEHIND) & (now["facing"] > _BEHIND) for then, now in both]
        if self._count(turned):
            pushed = [p | t for p, t in zip(pushed, self._met(turned), strict=True)]
        passed = f"{self._tool.name} has passed through the surface of the body"
        if count := self._count(pushed):
            return f"{passed} at {count} points"
        self._known.trial = _Seen(seen, _nearest(self._patches, seen))
        (depth_old, facing_old), (depth, facing) = old.nearest, self._known.trial.nearest
        # a tool smaller than a facet may meet no point before its middle is behind them
        between = facing > 0 and facing - facing_old > 2 * _TURN and min(depth_old, depth) <= 0
        return f"{passed} between its points" if between else None

    def _met(self, some: Sequence[NDArray[np.bool_]]) -> list[NDArray[np.bool_]]:
        """Which of some points have been in the tool during the step."""
        tool, state = self._tool, self._tool.state
        end, met = state.u.x.array.copy(), [np.zeros_like(points) for points in some]
        for s in np.linspace(0.0, 1.0, _SAMPLES + 1)[1:]:
            state.u.x.array[:] = state.u_old.x.array + s * (end - state.u_old.x.array)
            tool.move(s)
            inside = [patch.contact()["depth"] > 0 for patch in self._patches]
            met = [before | (points & now) for before, points, now in zip(met, some, inside, strict=True)]
        state.u.x.array[:] = end
        return met

    def _count(self, points: Sequence[NDArray[np.bool_]]) -> int:
        return sum(p.surface.points.count(where) for p, where in zip(self._patches, points, strict=True))


def _nearest(patches: Sequence[Touched], contact: Sequence[Mapping[str, Values]]) -> tuple[float, float]:
    """Depth of the deepest of all points in the tool, negative outside, and how it faces the tool. Collective."""
    own = []
    for now in contact:
        depth, facing = now["depth"].ravel(), now["facing"].ravel()
        own.append((float(depth.max(initial=-np.inf)), float(facing[depth.argmax()]) if len(depth) else -1.0))
    return max(max(of_rank) for of_rank in patches[0].surface.points.comm.allgather(own))


def _pushed(contact: Mapping[str, Values]) -> NDArray[np.bool_]:
    """Points that the tool pushes outwards."""
    return np.asarray((contact["facing"] > _BEHIND) & (contact["depth"] > 0))
