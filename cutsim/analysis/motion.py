"""Static and dynamic analysis: equilibrium at each time, or motion with inertia."""

from collections.abc import Callable, Sequence
from typing import Protocol

from mpi4py import MPI

from cutsim.analysis.mobility import free_motion
from cutsim.base.arrays import Array
from cutsim.base.terms import Advising, Body, Term, offering
from cutsim.bodies.inertia import Inertia
from cutsim.bodies.loads import Support
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

    def known(self, old: Array) -> Array | float:
        """Known forces of a step's balance, from the forces at its start."""

    def predict(self) -> None:
        """Start the search for the end of the step where the last one leads."""

    def forces(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """Forces at the end of a step, from the residual of its balance; see `Inertia.balance`. Collective."""

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words; empty if nothing is known."""


class QuasiStatic:
    """Static analysis: equilibrium at each time.

    Args:
        state: Displacement and time.
        terms: The terms.
    """

    inertia: Inertia | None = None

    def __init__(self, state: State, terms: Sequence[Term]) -> None:
        self._state, self._terms = state, terms

    def check(self, problem: NonlinearProblem, apart: str | None) -> None:
        """Refuse a problem in which a body is free to move. Collective.

        Raises:
            ValueError: A piece of a body can move as a rigid body, and nothing resists at the committed state.
        """
        bodies = {b.name: b.cells for b in offering(self._terms, Body)}
        motion = free_motion(self._state, problem.supported, problem.resistance, bodies)
        if motion is not None:
            raise ValueError(
                f"{motion}: neither a support nor a bond nor a closed contact holds it. Add a Support, let the "
                "surfaces overlap a little where a contact is to hold it, or use analysis='dynamic'"
                + (f". In the mesh {apart}" if apart else "")
            )

    def start(self, problem: NonlinearProblem, static: Callable[[], Array], end: float) -> Array | None:
        """Forces of a state that others have loaded, or that was set. Collective."""
        loaded = self._state.mesh.comm.allreduce(bool(self._state.u_old.x.array.any()), MPI.LOR)
        return static() if loaded else None

    def known(self, old: Array) -> Array | float:
        """None."""
        return 0.0

    def predict(self) -> None:
        """Go on at the rate of the last step."""
        self._state.predict()

    def forces(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """The residual itself."""
        return solved

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

    def check(self, problem: NonlinearProblem, apart: str | None) -> None:
        """Nothing: a body that is free flies."""

    def start(self, problem: NonlinearProblem, static: Callable[[], Array], end: float) -> Array | None:
        """Initial accelerations; the forces are zero but for those of the supports. Collective."""
        state = self._inertia.state
        for term in self._terms:
            term.evaluate()
        state.commit()
        prescribed = [(s.dofs, *s.rates(state.time, end)) for s in self._supports]
        return self._inertia.start(static(), problem.bcs, problem.directions, prescribed)

    def known(self, old: Array) -> Array | float:
        """What the scheme takes from the start of the step."""
        return self._inertia.history(old)

    def predict(self) -> None:
        """Nothing: the step has started at the present velocity already."""

    def forces(self, solved: Array, old: Array, supported: Callable[[Array], Array]) -> Array:
        """Forces R + M a at the end of the step. Collective."""
        return self._inertia.balance(solved, old, supported)

    def advise(self) -> str:
        """Nothing is known."""
        return ""
