"""Base of the balances of momentum and heat: terms, prescribed values, one unknown and its solver."""

from collections.abc import Mapping, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from cutsim.base.borders import Bordered
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.places import Places
from cutsim.base.terms import Bounded, Columns, Constrained, Diagnosing, Showing, Term, offering
from cutsim.fields.constraints import Constraints, Prescribed
from cutsim.fields.state import State
from cutsim.solvers.directions import Directions, Guided
from cutsim.solvers.iterations import Outcome
from cutsim.solvers.newton import Kept, NonlinearProblem
from cutsim.solvers.path import PathStep
from cutsim.solvers.system import Structure


class Held(Prescribed, Protocol):
    """Protocol of a value that is prescribed on some dofs and may change in time.

    Attributes:
        bc: Its Dirichlet condition; None if it is prescribed along no component (`cutsim.solvers.directions`).
        corners: Times at which its rate jumps.
    """

    bc: fem.DirichletBC | None
    corners: tuple[float, ...]

    def begin(self) -> None:
        """Move it to its value at the end of the step."""

    def record(self, reaction: float) -> Columns:
        """Columns of the history row.

        Args:
            reaction: What it takes from the balance.
        """


T = TypeVar("T", bound=Term)
H = TypeVar("H", bound=Held)


class Balance(Generic[T, H]):
    """Balance of one step.

    Args:
        name: Name of the balance in the memory.
        state: Displacement and time.
        unknown: What it is solved for.
        terms: Its terms.
        held: Prescribed values.
        kind: What the user calls these, such as "supports".
        rounding: Difference of two prescribed values that is none.
        interface_dofs: Owned nodes on both faces of all cracks, for the solver.
        solver: Further arguments of `cutsim.solvers.newton.NonlinearProblem`.

    Attributes:
        state: Displacement and time.
        terms: Its terms.
        problem: The solver.

    Raises:
        ValueError: Two terms or prescribed values share a name, or two values are prescribed for one dof.
    """

    def __init__(
        self,
        name: str,
        state: State,
        unknown: fem.Function,
        terms: Sequence[T],
        held: Sequence[H],
        *,
        kind: str,
        rounding: float = 0.0,
        interface_dofs: NDArray[np.int32] | None = None,
        **solver: Any,
    ) -> None:
        names = [t.name for t in terms] + [h.name for h in held if h.name]
        require("names", names, len(set(names)) == len(names), f"different for all terms and {kind}")
        self.state, self.terms, self._held = state, tuple(terms), tuple(held)
        self._parts: tuple[T | H, ...] = (*terms, *held)
        directions = Directions(unknown.function_space, offering(held, Guided))
        self._constraints = Constraints(unknown.function_space, held, kind, rounding)
        self._constraints.check(state.time)
        v = ufl.TestFunction(unknown.function_space)
        self.problem = NonlinearProblem(
            [_residual(t, v) for t in terms],
            unknown,
            bcs=[h.bc for h in held if h.bc is not None],
            entity_maps={mesh: entities for t in terms for mesh, entities in t.entity_maps.items()},
            structure=Structure(
                symmetric=all(t.symmetric for t in terms),
                assemblers=[a for t in terms for a in t.assemblers],
                multipliers=[m for t in offering(terms, Constrained) for m in t.multipliers],
                borders=[b for t in offering(terms, Bordered) if (b := t.border) is not None],
                interface_dofs=interface_dofs,
                directions=directions,
                bounds=[t.possible for t in offering(terms, Bounded)],
            ),
            **solver,
        )
        self._kept = state.memory.value(f"{name}: solver", self.problem.kept, self._keep)
        places = Places.owned(unknown.function_space)
        self._residual = state.memory.value(f"{name}: residual", np.zeros(len(self.problem.fixed)), places=places)

    def _keep(self, kept: Kept) -> None:
        if kept != self.problem.kept:
            self.problem.kept = kept

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which a path, load or prescribed value has a kink."""
        return tuple(sorted({c for part in self._parts for c in part.corners}))

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields of the terms for output, by name."""
        return {name: field for t in offering(self.terms, Showing) for name, field in t.fields.items()}

    def refresh(self) -> None:
        """Forget what the solver has factorised. Collective."""
        self.problem.refresh()

    def begin(self) -> None:
        """Start the trial step that the state has begun: constants move. Collective."""
        for part in self._parts:
            part.begin()
        self._constraints.check(self.state.time)

    def solve(self, line_search: str | None = None) -> Outcome:
        """Find the unknown at the end of the step. Collective.

        Args:
            line_search: "l2", "bt" or "basic"; the solver's default if None.
        """
        outcome = self.problem.solve(line_search)
        # a solver that has failed is of no use to the next try either
        self._kept.set(self.problem.kept)
        return outcome

    def solve_path(self, step: PathStep) -> Outcome:
        """Find the unknown, and the time, at the end of a step along the path. Collective."""
        outcome = self.problem.solve_path(step)
        self._kept.set(self.problem.kept)
        return outcome

    def reaction(self, held: H) -> float:
        """What a prescribed value takes from the balance in the trial state. Collective."""
        return self._constraints.reaction(held, self.problem.directions.turn(self._residual.trial))

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""
        for term in self.terms:
            term.watch()

    def diagnose(self) -> str:
        """After a failed solve: what is wrong and where, in words. Collective."""
        return "; ".join(words for t in offering(self.terms, Diagnosing) if (words := t.diagnose()))

    def record(self) -> Columns:
        """Columns of the history row. Collective."""
        columns: Columns = {}
        for term in self.terms:
            columns |= term.record()
        for held in self._held:
            if held.name:
                columns |= held.record(self.reaction(held))
        return columns

    def _out_of_balance(self) -> NDArray[np.float64]:
        """Residual at the present unknown, prescribed rows included. Collective."""
        residual = self.problem.residual()
        forces: NDArray[np.float64] = residual.array_r.copy()
        residual.destroy()
        return forces


def _residual(term: Term, v: Expr) -> ufl.Form:
    """Virtual work of a term.

    Raises:
        ValueError: It has written something else, such as nothing.
    """
    written = term.residual(v)
    valid = isinstance(written, ufl.Form)
    require(f"residual of {term.name!r}", written, valid, "a ufl.Form, its virtual work; ufl.Form([]) if there is none")
    return written
