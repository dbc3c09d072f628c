"""Judge of convergence: from the numbers of an iterate to a reason to stop or to continue.

The numbers are global, so that every rank decides alike; PETSc is not needed here.  Beside the residual, the
displacement and the energy of a step may be judged, as FEBio and the program of K. Bronik, *Large deformation cohesive
damage model through contact mechanics*, do; the history of a solve is their table (Table 4.7 there).  Norms are plain
ones: those programs print the squares of residual and displacement.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import inf, isfinite

from cutsim.base.checks import positive, require_number
from cutsim.base.signatures import checked

#: Rounding level of the residual, as a fraction of the nodal forces ||diag(K)|| (max |u| + h) that cancel in it. The
#: cell size h stands for the deformation gradient, which is known within the rounding of 1 however small u is.
ROUNDING = 1e-14
#: A prescribed displacement holds when it is met within this fraction of max |u| + h.
BC_ROUNDING = 1e-12
#: Growth of the residual at which a solve is given up.
GROWTH = 1e6
#: A backtracking search crawls at a kink: it is given up where the residual has not fallen to this fraction ...
STALLED = 0.95
#: ... in so many iterations. Other searches are given up after so many in which the residual is never smaller.
STALL, WANDERING = 5, 8


class Reason(Enum):
    """Reason why a solve continues or stops; the value says it in words."""

    GOING_ON = "not converged yet"
    CONVERGED = "converged"
    NOT_FINITE = "residual or tangent not finite (element inverted, J <= 0)"
    GROWING = f"residual grew by more than {GROWTH:.0e}"
    STALLED = "line search failed at a local minimum of the residual"
    RUNAWAY = "the solution runs away: something moves freely, or there is no equilibrium"


@checked
@dataclass(frozen=True)
class Tolerances:
    """Tolerances of equilibrium; every criterion that is given must hold.

    A criterion on the displacement or the energy never ends a solve earlier than the residual alone would do. It
    matters where a soft direction lets the solution move far while the forces hardly change. Both need a step to
    judge: with one of them at least one iteration is made, unless there are no forces at all.

    Args:
        rtol: Norm of the out-of-balance forces over the force scale, see
            `cutsim.solvers.newton.NonlinearProblem`; PETSc option `snes_rtol`.
        dtol: Norm of the last step over that of the displacement since the start of the solve; None for no criterion.
            The other programs take 1e-3 by default.
        etol: Work of the out-of-balance forces along the last step, over that of the first forces along the first
            Newton step; None for no criterion. The other programs take 1e-2 by default.

    Raises:
        ValueError: A tolerance is not positive.
    """

    rtol: float = 1e-8
    dtol: float | None = None
    etol: float | None = None

    def __post_init__(self) -> None:
        require_number("rtol", self.rtol, positive)
        require_number("dtol", self.dtol, positive.or_none)
        require_number("etol", self.etol, positive.or_none)


#: The residual alone.
TOLERANCES = Tolerances()


@dataclass(frozen=True)
class Criteria:
    """Criteria of the judge, apart from the iterates.

    Args:
        tolerances: When an iterate is equilibrium.
        largest: Size of an unknown at which a solve is given up: the rounding level grows with u, so that far away
            everything would count as converged.
        by_start: Whether the forces at the start count in the force scale: without supports, or where inertia or heat
            capacity balances forces, there may be no reaction to compare with.
    """

    tolerances: Tolerances = TOLERANCES
    largest: float = inf
    by_start: bool = False


#: Those of a problem with supports that nothing sets in motion.
CRITERIA = Criteria()


@dataclass(frozen=True)
class Iterate:
    """Numbers of an iterate by which it is judged, the same on all ranks.

    Attributes:
        free: Norm of the forces that no support takes up [force].
        reaction: Norm of the forces of the supports [force].
        stiffness: Norm of the tangent's diagonal [force/length].
        size: Largest unknown [length].
        jump: Largest amount by which a prescribed value is missed [length].
        step: Norm of the last step [length].
        way: Norm of the displacement since the start of the solve [length].
        work: Work of the forces along the last step [energy].
        first_step: Norm of the first Newton step, before any line search [length].
        first_work: Work of the forces at the start along it [energy].
    """

    free: float
    reaction: float = 0.0
    stiffness: float = 0.0
    size: float = 0.0
    jump: float = 0.0
    step: float = 0.0
    way: float = 0.0
    work: float = 0.0
    first_step: float = 0.0
    first_work: float = 0.0


@dataclass(frozen=True)
class Norms:
    """Norms of an iterate that are judged.

    Attributes:
        residual: Norm of the out-of-balance forces [force].
        displacement: Norm of a step [length].
        energy: Work of the out-of-balance forces along it, without sign [energy].
    """

    residual: float
    displacement: float
    energy: float


@dataclass(frozen=True)
class Iteration:
    """One iteration in the history of a solve.

    Attributes:
        initial: Residual at the start; size and energy of the first Newton step.
        current: Norms after the iteration.
        required: What they may be at most for convergence, infinite where there is no criterion.
    """

    initial: Norms
    current: Norms
    required: Norms


class Judge:
    """Judge of the iterates of one solve.

    Args:
        criteria: What it goes by.
        h: Size of a cell, a length beside which displacements are small or large.

    Attributes:
        criteria: As above.
        residuals: Norm of the out-of-balance forces of each iterate of the present solve, the start included [force].
        history: Its iterations.
        force: Force scale of the present iterate [force].
        scale: The one that counts: that of the last converged solve if larger [force].
    """

    def __init__(self, criteria: Criteria, h: float) -> None:
        self.criteria, self._h = criteria, h
        self.start(0.0)

    def start(self, force: float, *, line_search: str = "") -> None:
        """Begin a solve.

        Args:
            force: Force scale of the last converged solve [force].
            line_search: The line search, by which a solve is given up where the residual hardly falls any more; empty
                for never.
        """
        self.residuals: list[float] = []
        self.history: list[Iteration] = []
        self.force, self.scale = 0.0, force
        self._before, self._line_search, self._size = force, line_search, 0.0

    @property
    def length(self) -> float:
        """Largest unknown so far and the size of a cell: the length that rounding refers to."""
        return self._size + self._h

    def judge(self, iteration: int, iterate: Iterate) -> Reason:
        """Take an iterate into the history, and decide.

        Args:
            iteration: Its number, counted from the last start: one that starts anew where the last ended is no new
                iterate.
            iterate: Its numbers.
        """
        # far away the rounding level passes for convergence; where the solve starts is not its own fault
        if iteration > 0 and iterate.size > self.criteria.largest:
            return Reason.RUNAWAY
        self._size = max(self._size, iterate.size)
        if iteration > 0 or not self.residuals:
            self.residuals.append(iterate.free)
        self._rescale(iterate)
        required = self._required(iterate)
        if iteration > 0:
            self._note(iterate, required)
        if not isfinite(iterate.free):
            return Reason.NOT_FINITE
        if iterate.jump <= BC_ROUNDING * self.length and iterate.free <= required.residual:
            return self._second_opinion(iterate)
        if iterate.free > GROWTH * max(self.residuals[0], self.scale):
            return Reason.GROWING
        return Reason.STALLED if self._stalls(iterate.free) else Reason.GOING_ON

    def _rescale(self, iterate: Iterate) -> None:
        # a body on its way back to rest has hardly any reactions: what is small is told by those of the solve before
        self.force = max(iterate.reaction, self.residuals[0]) if self.criteria.by_start else iterate.reaction
        self.scale = max(self._before, self.force)

    def _floor(self, iterate: Iterate) -> float:
        """Residual that is nothing but rounding [force]."""
        return ROUNDING * iterate.stiffness * self.length

    def _required(self, iterate: Iterate) -> Norms:
        tolerances = self.criteria.tolerances
        return Norms(
            max(tolerances.rtol * self.scale, self._floor(iterate)),
            inf if tolerances.dtol is None else tolerances.dtol * iterate.way,
            inf if tolerances.etol is None else tolerances.etol * abs(iterate.first_work),
        )

    def _note(self, iterate: Iterate, required: Norms) -> None:
        initial = Norms(self.residuals[0], iterate.first_step, abs(iterate.first_work))
        current = Norms(iterate.free, iterate.step, abs(iterate.work))
        self.history.append(Iteration(initial, current, required))

    def _second_opinion(self, iterate: Iterate) -> Reason:
        """Displacement and energy, of an iterate whose residual is small enough."""
        tolerances = self.criteria.tolerances
        if (tolerances.dtol is None and tolerances.etol is None) or iterate.free <= self._floor(iterate):
            return Reason.CONVERGED
        if not self.history:
            return Reason.GOING_ON
        last = self.history[-1]
        small = last.current.displacement <= last.required.displacement and last.current.energy <= last.required.energy
        return Reason.CONVERGED if small else Reason.GOING_ON

    def _stalls(self, free: float) -> bool:
        r = self.residuals
        if self._line_search == "bt":
            # one more iteration at a kink costs as much as any, and the next line search gets past it
            return len(r) > STALL and free > STALLED * r[-1 - STALL]
        # one that goes round in circles seldom leaves them; where it starts it may be close by chance
        wanders = len(r) > 1 + WANDERING and min(r[-WANDERING:]) >= min(r[1:-WANDERING])
        return bool(self._line_search) and wanders


def table(history: Sequence[Iteration]) -> str:
    """The history of a solve in words: three lines an iteration."""
    rows = [f"{'iteration':>9}  {'norm':<12}  {'initial':>12}  {'current':>12}  {'required':>12}"]
    for number, iteration in enumerate(history, 1):
        for name in ("energy", "displacement", "residual"):
            values = (getattr(norms, name) for norms in (iteration.initial, iteration.current, iteration.required))
            numbers = "  ".join(f"{value:12.6e}" if isfinite(value) else f"{'–':>12}" for value in values)
            rows.append(f"{number if name == 'energy' else '':>9}  {name:<12}  {numbers}")
    return "\n".join(rows)
