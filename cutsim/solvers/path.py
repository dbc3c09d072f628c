"""Newton's method for a state of given distance along an equilibrium path, with the time as a further unknown.

Where a path turns back (snap-back, limit point of a force) there is no equilibrium, or none near by, at a later time.
There the time t is an unknown, and the step has a given size Δτ in a measure D(u) that grows along the path, such as
the energy that it dissipates (Gutiérrez 2004; Verhoosel, Remmers and Gutiérrez 2009).  With the residual b(u, t), in
which prescribed values are lifted, and the tangent A

    A y₁ = −b,    A y₂ = −∂b/∂t,    δt = −(D − Δτ + D_u·y₁)/(D_u·y₂),    δu = y₁ + δt y₂,

so that supports, loads and the paths of tools are treated alike, and the linear solver sees the matrix that it knows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite
from typing import TypeAlias

import numpy as np
from dolfinx.common import Timer

from cutsim.base.arrays import Array
from cutsim.base.assembly import global_dot
from cutsim.solvers.convergence import BC_ROUNDING, Reason
from cutsim.solvers.iterations import Iterations, Outcome
from cutsim.solvers.system import System

#: Relative error of the size of a step.
SIZE = 1e-4
#: Newton iterations of a step.
ITERATIONS = 25
# change of time for the derivative of the forces, relative to the largest one
_DIFFERENCE = 1e-6
# residuals this close to those of two or three iterations ago are a cycle, in which a point loads and unloads in turn
_CYCLE = 0.02
# halvings of an iteration that has inverted an element
_HALVINGS = 5

#: Value of what measures a step, and its derivative (owned entries of the space of the displacement). Collective.
Measure: TypeAlias = Callable[[], tuple[float, Array]]


@dataclass(frozen=True)
class PathStep:
    """A step along a path.

    Attributes:
        size: Its size Δτ > 0.
        measure: Measures the present displacement; zero at the start of the step.
        span: Largest change of time in an iteration [time].
        move: Moves the problem to a time after the start of the step. Collective.
        after: The time at which the iterations begin, after that start [time].
    """

    size: float
    measure: Measure
    span: float
    move: Callable[[float], None]
    after: float = 0.0

    def starting(self, after: float) -> "PathStep":
        """The same step, with iterations that begin at another time."""
        return replace(self, after=after)


@dataclass(frozen=True)
class _Iterate:
    """Unknowns, time, residual and measure of an iterate."""

    x: Array
    time: float
    b: Array
    value: float
    slope: Array


class PathIterations:
    """Newton iterations along a path. Every method is collective.

    They use the matrix, linear solver and judge of the iterations at a given time.

    Args:
        system: The equations.
        iterations: The iterations at a given time.
    """

    def __init__(self, system: System, iterations: Iterations) -> None:
        self._system, self._iterations = system, iterations
        self._rhs, self._y = iterations.vectors()
        self._linear = 0

    def run(self, step: PathStep, force: float) -> Outcome:
        """Iterate from the present unknowns to equilibrium at the end of the step, or to failure.

        Args:
            step: The step; the problem is left at the time of the last iterate.
            force: Force scale of the last converged solve [force].
        """
        judge, self._linear = self._iterations.judge, 0
        with Timer("~cutsim: path solve"):
            iterates, reason, words = self._iterate(step, force)
        return Outcome(
            converged=reason is Reason.CONVERGED,
            reason=1 if reason is Reason.CONVERGED else -1,
            message=words or reason.value,
            iterations=iterates,
            linear_iterations=self._linear,
            residuals=tuple(r / (judge.scale or 1.0) for r in judge.residuals),
            history=tuple(judge.history),
        )

    def _iterate(self, step: PathStep, force: float) -> tuple[int, Reason, str]:
        """Number of iterations, and why they end, perhaps in words of its own."""
        judge, norms = self._iterations.judge, self._iterations.measures
        judge.start(force)
        here = self._at(step, self._system.unknowns, step.after)
        norms.start(here.x)
        for iteration in range(ITERATIONS + 1):
            reason = judge.judge(iteration, norms.of(here.x, here.b))
            if reason is Reason.CONVERGED and abs(here.value / step.size - 1) < SIZE:
                return iteration, reason, ""
            if reason not in (Reason.CONVERGED, Reason.GOING_ON):
                return iteration, reason, ""
            if iteration == ITERATIONS:
                break
            change = self._direction(step, here)
            if change is None:
                return iteration, Reason.GOING_ON, "nothing breaks along the path, or the linear solver failed"
            part = 0.5 if self._cycles() else 1.0
            here = self._moved(step, here, part * change[0], part * change[1])
        return ITERATIONS, Reason.GOING_ON, "no convergence along the path"

    def _at(self, step: PathStep, x: Array, time: float) -> _Iterate:
        step.move(time)
        b = self._residual(x)
        return _Iterate(x, time, b, *step.measure())

    def _residual(self, x: Array) -> Array:
        system = self._system
        system.forces.prescribe()
        return system.residual(x, BC_ROUNDING * self._iterations.judge.length)

    def _moved(self, step: PathStep, here: _Iterate, change: Array, later: float) -> _Iterate:
        """The next iterate; less of the way where that inverts an element."""
        for halving in range(_HALVINGS):
            there = self._at(step, here.x + 0.5**halving * change, here.time + 0.5**halving * later)
            if isfinite(global_dot(self._system.comm, there.b, there.b)):
                break
        return there

    def _cycles(self) -> bool:
        """Whether the last residual is that of two or three iterations ago."""
        r = self._iterations.judge.residuals
        return any(len(r) > back and abs(r[-1] - r[-1 - back]) < _CYCLE * r[-1 - back] for back in (2, 3))

    def _direction(self, step: PathStep, here: _Iterate) -> tuple[Array, float] | None:
        """Changes of unknowns and time, None where there are none. The problem is moved."""
        system = self._system
        self._iterations.renew_tangent()
        system.assemble_tangent(here.x)
        difference = _DIFFERENCE * step.span
        step.move(here.time + difference)
        rate = (self._residual(here.x) - here.b) / difference
        still, moving = self._solve(here.b, observe=True), self._solve(rate)
        if still is None or moving is None:
            return None
        slope = np.zeros_like(here.x)
        slope[: system.forces.n] = system.directions.turn(here.slope)
        ahead, along = (global_dot(system.comm, slope, y) for y in (still, moving))
        missing = step.size - here.value - ahead
        # where nothing breaks yet the loads go on as far as they may
        if abs(missing) >= abs(along) * step.span:
            later = float(np.copysign(step.span, missing * along if along else missing))
        else:
            later = missing / along
        return still + later * moving, later

    def _solve(self, b: Array, *, observe: bool = False) -> Array | None:
        """Solution y of A y = −b, exact where something is prescribed; None if the linear solver fails."""
        snes, linear, held = self._iterations.snes, self._iterations.linear, self._system.held
        A = snes.getJacobian()[0]
        while True:
            ksp = snes.getKSP()
            ksp.setOperators(A, A)
            self._rhs.array[:] = -b
            ksp.solve(self._rhs, self._y)
            self._linear += ksp.getIterationNumber()
            if ksp.getConvergedReason() > 0:
                break
            if not linear.improve():
                return None
            A.stateIncrease()  # PETSc sets a preconditioner up anew for another matrix only
        if observe:
            linear.observe()
        y: Array = self._y.array_r.copy()
        y[held] = -b[held]
        return y

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for vector in (self._rhs, self._y):
            vector.destroy()
