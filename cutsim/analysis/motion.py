"""Static and dynamic analysis: equilibrium at each time, or motion with inertia."""

from collections.abc import Callable, Sequence
from typing import Protocol

from mpi4py import MPI

from cutsim.analysis.mobility import free_motion
from cutsim.base.arrays import Array
from cutsim.base.borders import Bordered
from cutsim.base.terms import Advising, Body, Term, offering
from cutsim.bodies.inertia import Inertia
from cutsim.bodies.loads import Support
from cutsim.bodies.schemes import Scheme
from cutsim.fields.state import State
from cutsim.solvers.newton import NonlinearProblem


class Motion(Protocol):
    """Protocol of an analysis: what it adds to the static terms.

    Attributes:
        inertia: The inertia of the bodies, or None.
    """

    inertia: Inertia | None

    def check(self, problem: NonlinearProblem, apart: str | None) -> None:
        """Refuse what has no solution, before the first step. Collective.

        Args:
            problem: The solver.
            apart: Where the mesh has nodes in one place that are not merged, in words, or None.
        """

    def start(self, problem: NonlinearProblem, static: Callable[[], Array], end: float) -> Array | None:
        """Forces at the start of the first step, None if there are none. Collective.

        Args:
            problem: The solver.
            static: Gives the forces of the static terms.
            end: Time at which the step ends.
        """

    def begin(self) -> None:
        """Start a trial step, after all terms."""

    def known(self, old: Array) -> Array | float:
        """Known forces of a step's balance, from the forces at its start."""

    def predict(self) -> None:
        """Start the search for the end of the step where the last one leads."""

    def forces(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """Forces at the end of a step, from the residual of its balance; see `Inertia.balance`. Collective.

        Rigid bodies take note of them.
        """

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words; empty if nothing is known."""


class RigidBodies:
    """Rigid bodies of a problem, whose motion is unknown.

    Args:
        terms: The terms, some of which are such bodies.
        scheme: Time integration of their own inertia.
    """

    def __init__(self, terms: Sequence[Term], scheme: Scheme) -> None:
        self._borders = [b for t in offering(terms, Bordered) if (b := t.border) is not None]
        for border in self._borders:
            border.integrate(scheme)

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self._borders)

    def predict(self) -> None:
        """Go on at the rate of the last step."""
        for border in self._borders:
            border.predict()

    def settle(self, forces: Array) -> Array:
        """Take note of the forces at the end of a step, and return them. Collective."""
        for border in self._borders:
            border.settle(forces)
        return forces

    @staticmethod
    def check(problem: NonlinearProblem) -> None:
        """Refuse one with a motion that nothing resists. Collective.

        Raises:
            ValueError: There is one.
        """
        motion = problem.free()
        if motion is not None:
            raise ValueError(motion)


class QuasiStatic:
    """Static analysis: equilibrium at each time.

    Args:
        state: Displacement and time.
        terms: The terms.
        scheme: Time integration of the inertia of rigid bodies, which counts all the same.
    """

    inertia: Inertia | None = None

    def __init__(self, state: State, terms: Sequence[Term], scheme: Scheme) -> None:
        self._state, self._terms, self._rigid = state, terms, RigidBodies(terms, scheme)

    def check(self, problem: NonlinearProblem, apart: str | None) -> None:
        """Refuse a problem in which a body is free to move. Collective.

        Raises:
            ValueError: A piece of a body can move as a rigid body, and nothing resists at the committed state.
        """
        self._rigid.check(problem)
        bodies = {b.name: b.cells for b in offering(self._terms, Body)}
        motion = free_motion(self._state, problem.restrained, problem.resistance, bodies)
        if motion is not None:
            raise ValueError(
                f"{motion}: neither a support nor a bond nor a closed contact holds it. Add a Support, let the "
                "surfaces overlap a little where a contact is to hold it, or use analysis='dynamic'"
                + (f". In the mesh {apart}" if apart else "")
            )

    def start(self, problem: NonlinearProblem, static: Callable[[], Array], end: float) -> Array | None:
        """Forces of a state that others have loaded, or that was set, or in which rigid bodies move. Collective."""
        loaded = self._state.mesh.comm.allreduce(bool(self._state.u_old.x.array.any()), MPI.LOR)
        return static() if loaded or self._rigid else None

    def begin(self) -> None:
        """Nothing."""

    def known(self, old: Array) -> Array | float:
        """None."""
        return 0.0

    def predict(self) -> None:
        """Go on at the rate of the last step."""
        self._state.predict()
        self._rigid.predict()

    def forces(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """The residual itself. Collective."""
        return self._rigid.settle(solved)

    def advise(self) -> str:
        """What the terms know."""
        return "; ".join(t.advise() for t in offering(self._terms, Advising))


class Dynamic:
    """Dynamic analysis: motion with inertia.

    Args:
        inertia: Inertia of the bodies.
        terms: The other terms.
        supports: Prescribed displacements.
    """

    def __init__(self, inertia: Inertia, terms: Sequence[Term], supports: Sequence[Support]) -> None:
        self.inertia: Inertia | None = inertia
        self._inertia, self._terms, self._supports = inertia, terms, supports
        self._rigid = RigidBodies(terms, inertia.scheme)

    def check(self, problem: NonlinearProblem, apart: str | None) -> None:
        """Refuse a rigid body that nothing resists; one that deforms flies where it is free."""
        self._rigid.check(problem)

    def start(self, problem: NonlinearProblem, static: Callable[[], Array], end: float) -> Array | None:
        """Initial accelerations; the forces are zero but for those of the supports. Collective."""
        state = self._inertia.state
        for term in self._terms:
            term.evaluate()
        state.commit()
        prescribed = [(s.dofs, *s.rates(state.time, end)) for s in self._supports]
        return self._inertia.start(static(), problem.bcs, problem.directions, prescribed)

    def begin(self) -> None:
        """Let rigid bodies go on at the present velocity, as those do that deform."""
        self._rigid.predict()

    def known(self, old: Array) -> Array | float:
        """What the scheme takes from the start of the step."""
        return self._inertia.history(old)

    def predict(self) -> None:
        """Nothing: the step has started at the present velocity already."""

    def forces(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """Forces R + M a at the end of the step. Collective."""
        return self._rigid.settle(self._inertia.balance(solved, old, supported))

    def advise(self) -> str:
        """Nothing is known."""
        return ""
