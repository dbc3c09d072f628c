"""Newton's method for F(u; v) = 0, with a preconditioner that is kept and rebuilt when needed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.common import Timer
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base import compat
from cutsim.base.checks import require
from cutsim.base.lifetime import free_dropped
from cutsim.base.options import Options
from cutsim.solvers.convergence import CRITERIA, Criteria
from cutsim.solvers.directions import Directions
from cutsim.solvers.iterations import LINE_SEARCHES, Iterations, Outcome
from cutsim.solvers.path import PathIterations, PathStep
from cutsim.solvers.preconditioners import LaggedPC
from cutsim.solvers.system import STRUCTURE, Structure, System


@dataclass(frozen=True)
class Kept:
    """Data that a solve passes on to the next one, beside the solution.

    The preconditioner is kept as well, which no number can tell: a problem goes on exactly like another one if both
    make it anew, by `LaggedPC.refresh(pattern=True)`.

    Attributes:
        force: Force scale of the last converged solve [force].
        line_search: The line search.
        linear_solver: Name of the preset of the linear solver, empty where the user's options name one.
    """

    force: float
    line_search: str
    linear_solver: str


class NonlinearProblem:
    """Newton's method for F(u; v) = 0 with Dirichlet conditions. Every method is collective.

    Prescribed values are never written into u before the solve: their increment is lifted through the tangent in
    the first iteration. Converged means that the prescribed values hold and that the norm of the free rows of F is
    at most `rtol` times the force scale. The force scale is the norm of the reactions, of the present iterate or
    of the last converged solve, whichever is larger; without any Dirichlet condition it is the norm of F at the
    start, and with inertia the larger of both. A state free of forces is accepted when F is down to rounding,
    1e-14 ||diag(K)|| (max |u| + h). Displacement and energy are judged, too, if they have a tolerance.

    Args:
        F: Residual, or its parts, linear in a test function of the space of u: internal minus external virtual work.
        u: The unknown; start and result of a solve.
        petsc_options_prefix: Prefix of all PETSc options of this problem; not empty, and its own.
        bcs: Dirichlet conditions. Their values may change between solves, their dofs may not.
        petsc_options: PETSc options without prefix. With `pc_type` or `ksp_type` among them no preset is used and
            PETSc does as told; otherwise they refine the preset of `cutsim.solvers.preconditioners.preset_for`, whose
            preconditioners have the prefixes `direct_`, `bulk_`, `factor_`, `crack_`, `strip_` and `saddle_`.
        entity_maps: Entity maps of the forms.
        structure: What is known of the problem beside the form.
        criteria: What convergence is judged by.

    Attributes:
        known: Owned nodal forces that are added to those of F, such as the share of the last step in a time
            integration scheme; zero at first.
        fixed: Which owned unknowns have a Dirichlet condition.
        guided: Which owned dofs supports or rigid bodies move; of a node with axes of its own all of them.
        bcs: As above.

    Raises:
        ValueError: The prefix is empty.
    """

    def __init__(
        self,
        F: ufl.Form | Sequence[ufl.Form],
        u: fem.Function,
        *,
        petsc_options_prefix: str,
        bcs: Sequence[fem.DirichletBC] = (),
        petsc_options: Mapping[str, Any] | None = None,
        entity_maps: compat.EntityMaps | None = None,
        structure: Structure = STRUCTURE,
        criteria: Criteria = CRITERIA,
    ) -> None:
        self._options = Options(petsc_options_prefix, petsc_options or {})
        self.bcs = list(bcs)
        parts = [F] if isinstance(F, ufl.Form) else F
        self._constants = {constant for part in parts for constant in part.constants()}
        self._system = System(parts, u, bcs, entity_maps, structure)
        self.known, self.fixed = self._system.forces.known, self._system.forces.fixed
        self.guided = self._system.guided
        free_dropped(self._system.comm)
        # nothing that is prescribed has a reaction then: the residual at the start is the only force to compare with
        criteria = replace(criteria, by_start=criteria.by_start or not (bcs or structure.directions))
        self._iterations = Iterations(self._system, criteria, self._options)
        self._path: PathIterations | None = None
        self._force = 0.0

    @property
    def snes(self) -> PETSc.SNES:
        """The PETSc solver."""
        return self._iterations.snes

    @property
    def preconditioner(self) -> LaggedPC | None:
        """The preconditioner of the preset: `refresh` it when the sparsity pattern has changed; None if the user's."""
        return self._iterations.linear.preconditioner

    @property
    def linear_solver(self) -> str:
        """What solves the linear equations, in words."""
        return self._iterations.linear.description

    @property
    def kept(self) -> Kept:
        """What the last solve has left to the next one; set it to go on as another problem of the same kind does."""
        return Kept(self._force, self._iterations.line_search, self._iterations.linear.name)

    @kept.setter
    def kept(self, kept: Kept) -> None:
        self._force = kept.force
        self._iterations.line_search = kept.line_search
        self._iterations.linear.use(kept.linear_solver)

    @property
    def drag(self) -> NDArray[np.float64] | None:
        """Stiffness of a force at each owned dof against its displacement, alike along all axes of a node, or None."""
        return self._system.drag

    @drag.setter
    def drag(self, drag: NDArray[np.float64] | None) -> None:
        self._system.drag = drag

    def solve(self, line_search: str | None = None) -> Outcome:
        """Solve from the present u.

        Args:
            line_search: "l2", "bt" or "basic"; by default the one of the last solve, at first "l2" or the option
                `snes_linesearch_type`.

        Returns:
            The outcome. Failure does not raise and leaves u at the last iterate.

        Raises:
            ValueError: The line search is unknown.
        """
        if line_search is not None:
            require("line_search", line_search, line_search in LINE_SEARCHES, f"one of {', '.join(LINE_SEARCHES)}")
            self._iterations.line_search = line_search
        with Timer("~cutsim: nonlinear solve"):
            outcome = self._iterations.run(self._force)
        # the scale of forces by which the next solve is judged: that of a failed one would be a wild iterate's
        if outcome.converged:
            self._force = self._iterations.force
        return outcome

    def solve_path(self, step: PathStep) -> Outcome:
        """Solve for u and the time at which the path has a given length; see `cutsim.solvers.path`.

        Args:
            step: The step.

        Returns:
            The outcome. Failure does not raise and leaves u and the problem at the last iterate.
        """
        if self._path is None:
            self._path = PathIterations(self._system, self._iterations)
        outcome = self._path.run(step, self._force)
        if outcome.converged:
            self._force = self._iterations.force
        return outcome

    def uses(self, constant: fem.Constant) -> bool:
        """Whether the residual depends on a constant."""
        return constant in self._constants

    def refresh(self) -> None:
        """Forget what was factorised."""
        self._iterations.linear.forget_pattern()

    def residual(self) -> PETSc.Vec:
        """Internal minus external forces at the present u, known ones and the constrained rows included.

        Returns:
            A new vector of the owned dofs; the caller owns it.
        """
        return self._system.forces.vector()

    def reactions(self) -> PETSc.Vec:
        """Forces of the supports on the body: `residual` along what is prescribed, else zero; the caller owns it."""
        b = self.residual()
        b.array[:] = self.supported(b.array_r)
        return b

    @property
    def directions(self) -> Directions:
        """Axes of the nodes at which something is prescribed along no component."""
        return self._system.directions

    def supported(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned nodal vectors, one a row, along what is prescribed: zero where nothing is."""
        return self._system.supported(v)

    def carried(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned nodal vectors, one a row, that supports or rigid bodies carry."""
        return self._system.carried(v)

    def restrained(self, motions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned motions, one a row, that supports or rigid bodies hold. Collective."""
        return self._system.restrained(motions)

    def free(self) -> str | None:
        """A motion of a rigid body that nothing resists at the committed state, in words, or None. Collective."""
        return self._system.free()

    def resistance(self, motions: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Forces against motions by the tangent at the present u, without any Dirichlet condition. Collective.

        Args:
            motions: Owned displacements, one motion a row [length].

        Returns:
            Owned forces, of the same shape, and the mean entry of the tangent's diagonal [force/length].
        """
        self._iterations.renew_tangent()
        return self._system.resistance(motions)

    def destroy(self) -> None:
        """Free the PETSc objects and remove the options of this problem."""
        for thing in (self._path, self._iterations, self._system):
            if thing is not None:
                thing.destroy()
        self._options.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.destroy()
