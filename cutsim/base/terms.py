"""Terms of the virtual work, and what they contribute to a step.

The object that owns a term writes it: its form, its moving constants, its history and its share of the energy audit.
`cutsim.analysis.mechanics` only adds terms up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.compat import EntityMaps
from cutsim.base.kinematics import Expr

#: Entries of the energy audit; the external work equals their sum (docs/theory.md §6).
ENTRIES = (
    "strain", "kinetic", "thermoelastic", "cohesive_stored", "contact",  # stored
    "fracture", "friction", "viscous", "numerical",  # lost
)  # fmt: skip


@dataclass(frozen=True)
class Multiplier:
    """Additional unknown of a term, and the equation that it adds.

    Attributes:
        value: The unknown. Scaled to a length, so that its equation is a force like those of the displacement.
        equation: Derivative of the term's energy along a test function of the space of `value`.
    """

    value: fem.Function
    equation: ufl.Form


class Term:
    """A term of the virtual work; every method but `residual` has a neutral default.

    Attributes:
        name: Name in messages and in the columns of the history.
        symmetric: Whether the tangent of the term is symmetric.
        assembles: Whether the term has forces that are no form: it then adds them, and their tangent, by itself.
    """

    name: str = "term"
    symmetric: bool = True
    assembles: bool = False

    def residual(self, v: Expr) -> ufl.Form:
        """Internal minus external virtual work."""
        raise TypeError(f"{type(self).__name__} has to write its virtual work")

    @property
    def entity_maps(self) -> EntityMaps:
        """Maps from mesh entities to the cells of submeshes on which coefficients of the term live."""
        return {}

    @property
    def multipliers(self) -> Sequence[Multiplier]:
        """Unknowns of the term beside the displacement, with their equations."""
        return ()

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields of the term for output, by name."""
        return {}

    def prepare(self) -> None:
        """Bring coefficients of forms to the present displacement; for terms that assemble, before each assembly."""

    def add_forces(self, b: PETSc.Vec, along: NDArray[np.float64] | None = None) -> None:
        """Add forces that are no form, at the present displacement. Collective.

        Args:
            b: Vector of the owned dofs; the caller assembles it afterwards.
            along: Displacement of the local dofs, ghosts included, times which the tangent is added, too.
        """

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the tangent of these forces; the caller assembles the matrix afterwards. Collective."""

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros wherever `add_tangent` may add something, as long as the `pattern` is the same. Collective."""

    @property
    def pattern(self) -> int:
        """Number of the sparsity pattern, the same on all ranks; another one asks for another matrix."""
        return 0

    @property
    def corners(self) -> tuple[float, ...]:
        """Times the stepping has to meet exactly."""
        return ()

    def begin(self, time: float) -> None:
        """Move constants to their value at the end of the step."""

    def augment(self) -> bool:
        """Improve a multiplier after equilibrium; True if the step has to be solved again. Collective."""
        return False

    def objection(self) -> str | None:
        """After equilibrium: why the trial state cannot be the end of this step, in words, or None. Collective."""
        return None

    def evaluate(self) -> None:
        """Compute trial history and energies from the converged trial displacement. Collective."""

    def energies(self) -> dict[str, float]:
        """Trial value of the audit entries this term contributes to [energy]. Collective."""
        return {}

    def rate_forces(self) -> NDArray[np.float64] | None:
        """The part of the forces in the trial step that jumps with the velocity, owned entries. Collective."""
        return None

    def external_work(self) -> float:
        """External work that enters through this term in the trial step [energy]. Collective."""
        return 0.0

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step [–]. Collective."""
        return 0.0

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""

    def diagnose(self) -> str | None:
        """After a failed solve: what is wrong in this term, in words, or None. Collective."""
        return None

    def record(self) -> dict[str, tuple[float, str]]:
        """Columns of the history row: name → (value, kind of quantity). Collective."""
        return {}

    def rollback(self) -> None:
        """Forget the trial step: constants back to the committed time."""

    def commit(self) -> None:
        """Adopt trial history."""


class Assembler(Protocol):
    """A part of a term that adds forces by itself; its methods are those of `Term`."""

    def add_forces(self, b: PETSc.Vec, along: NDArray[np.float64] | None) -> None:
        """As `Term.add_forces`."""

    def add_tangent(self, A: PETSc.Mat) -> None:
        """As `Term.add_tangent`."""

    def add_pattern(self, A: PETSc.Mat) -> None:
        """As `Term.add_pattern`."""


P = TypeVar("P", bound=Assembler)


class AssembledTerm(Term, Generic[P]):
    """A term all of whose forces are those of its passes, none of them a form.

    Attributes:
        passes: What adds the forces.
    """

    assembles = True
    passes: Sequence[P]

    def residual(self, v: Expr) -> ufl.Form:
        """No form: see `add_forces`."""
        return ufl.Form([])

    def add_forces(self, b: PETSc.Vec, along: NDArray[np.float64] | None = None) -> None:
        """Add the forces of all passes. Collective."""
        for p in self.passes:
            p.add_forces(b, along)

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add their derivative. Collective."""
        for p in self.passes:
            p.add_tangent(A)

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros wherever the derivative may be. Collective."""
        for p in self.passes:
            p.add_pattern(A)
