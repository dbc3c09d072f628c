"""Terms of a balance, and what they contribute to a step.

The object that owns a term writes it: its form, its moving constants, its history and its share of the energy audit.
Balances only add terms up.  `Term` is what every term is.  What only some can do are protocols of their own: a class
takes part in them by having their members.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray
from petsc4py import PETSc

from cutsim.base.compat import EntityMaps
from cutsim.base.kinematics import Expr

#: Entries of the energy audit; the external work equals their sum (docs/theory.md §6).
ENTRIES = (
    "strain", "kinetic", "thermoelastic", "cohesive_stored", "contact",  # stored
    "fracture", "friction", "viscous", "cohesive_viscous", "braked", "damped", "numerical",  # lost
)  # fmt: skip

#: Those of energy that bodies, bonds and contacts hold.
STORED = ENTRIES[:5]

#: Columns of a history row: name → (value, kind of quantity).
Columns = dict[str, tuple[float, str]]


class Assembler(Protocol):
    """Protocol of forces that are not a form, with their tangent."""

    @property
    def pattern(self) -> int:
        """Number of the sparsity pattern, the same on all ranks; another one asks for another matrix."""

    @property
    def rate_dependent(self) -> bool:
        """Whether the forces depend on how long a step takes."""

    def prepare(self) -> None:
        """Bring coefficients of forms to the present displacement, before each assembly. Collective."""

    def add_forces(self, b: PETSc.Vec, along: NDArray[np.float64] | None) -> None:
        """Add the forces at the present displacement. Collective.

        Args:
            b: Vector of the owned dofs; the caller assembles it afterwards.
            along: Displacement of the local dofs, ghosts included, times which the tangent is added, too.
        """

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add the tangent of these forces; the caller assembles the matrix afterwards. Collective."""

    def add_pattern(self, A: PETSc.Mat) -> None:
        """Add zeros wherever `add_tangent` may add something, as long as the `pattern` is the same. Collective."""


class Term:
    """Term of a balance; every member but `residual` has a neutral default. See docs/adding_a_term.md.

    Attributes:
        name: Name in messages and in the columns of the history.
        symmetric: Whether the tangent of the term is symmetric.
    """

    name: str = "term"
    symmetric: bool = True

    def residual(self, v: Expr) -> ufl.Form:
        """Internal minus external virtual work along a test function, as far as it is a form."""
        raise TypeError(f"{type(self).__name__} has to write its virtual work")

    @property
    def companions(self) -> Sequence["Term"]:
        """Further terms that come with this one."""
        return ()

    @property
    def assemblers(self) -> Sequence[Assembler]:
        """The forces of the term that are no form."""
        return ()

    @property
    def entity_maps(self) -> EntityMaps:
        """Maps from mesh entities to the cells of submeshes on which coefficients of the term live."""
        return {}

    @property
    def corners(self) -> tuple[float, ...]:
        """Times the stepping has to meet exactly."""
        return ()

    @property
    def rate_dependent(self) -> bool:
        """Whether the forces depend on how long a step takes; where `State.dt` is in the form, it is known anyway."""
        return any(assembler.rate_dependent for assembler in self.assemblers)

    def begin(self) -> None:
        """Move constants to their value at the end of the step that the state has begun. Collective."""

    def evaluate(self) -> None:
        """Compute trial history and energies from the solved trial state. Collective."""

    def watch(self) -> None:
        """Say in the verdict of the state what makes the trial step, which is accepted, questionable. Collective."""

    def record(self) -> Columns:
        """Columns of the history row. Collective."""
        return {}


@dataclass(frozen=True)
class Multiplier:
    """Additional unknown of a term, and the equation that it adds.

    Attributes:
        value: The unknown. Scaled to a length, so that its equation is a force like those of the displacement.
        equation: Derivative of the term's energy along a test function of the space of `value`.
    """

    value: fem.Function
    equation: ufl.Form


@runtime_checkable
class Energetic(Protocol):
    """A term with energies in the audit."""

    def energies(self) -> dict[str, float]:
        """Trial value of the audit entries this term contributes to, see `ENTRIES` [energy]. Collective."""


@runtime_checkable
class Loading(Protocol):
    """A term through which external work enters."""

    def external_work(self) -> float:
        """External work of the trial step [energy]. Collective."""


@runtime_checkable
class RateDependent(Protocol):
    """A term with forces that jump with the velocity."""

    def rate_forces(self) -> NDArray[np.float64] | None:
        """These forces in the trial step, owned entries; None if there are none. Collective."""


@runtime_checkable
class Augmenting(Protocol):
    """A term with a multiplier that is improved after equilibrium."""

    def augment(self) -> bool:
        """Improve it; True if the step has to be solved again. Collective."""


@runtime_checkable
class Objecting(Protocol):
    """A term that may refuse an equilibrium."""

    def objection(self) -> str | None:
        """Why the trial state cannot be the end of this step, in words, or None. Collective."""


@runtime_checkable
class Damaging(Protocol):
    """A term with damage."""

    def damage_increment(self) -> float:
        """Largest growth of damage at a point in the trial step [–]. Collective."""


@runtime_checkable
class Dissipating(Protocol):
    """A term that loses energy as it breaks, by which an equilibrium path is followed."""

    @property
    def facet_energy(self) -> float:
        """Energy that breaks a facet of mean size in opening; 0 without a law. Collective."""

    def path_measure(self) -> tuple[float, NDArray[np.float64]]:
        """How far the step has come along the path, and the derivative of this. Collective.

        Returns:
            Energy that is lost from the start of the step to the present displacement [energy]: to first order, zero
            while nothing breaks, and growing with the displacement where something does. Its derivative: owned entries
            of the space of the displacement [force].
        """


@runtime_checkable
class Constrained(Protocol):
    """A term with unknowns of its own."""

    @property
    def multipliers(self) -> Sequence[Multiplier]:
        """Unknowns beside that of the balance, with their equations."""


@runtime_checkable
class Showing(Protocol):
    """A term with fields for output."""

    @property
    def fields(self) -> Mapping[str, Expr]:
        """Fields by name."""


@runtime_checkable
class FacetShowing(Protocol):
    """A term with fields on facets for output.

    Attributes:
        name: Its name.
    """

    name: str

    @property
    def submesh(self) -> Mesh:
        """Mesh of the facets."""

    @property
    def facet_fields(self) -> tuple[str, ...]:
        """Names of the fields, none if there is nothing to show."""

    def facet_mean(self, name: str) -> NDArray[np.float64]:
        """Mean of a field over each local facet."""


@runtime_checkable
class Diagnosing(Protocol):
    """A term that can say what goes wrong."""

    def diagnose(self) -> str | None:
        """After a failed solve: what is wrong in this term, in words, or None. Collective."""


@runtime_checkable
class Advising(Protocol):
    """A term that may be why a quasi-static problem has no solution."""

    def advise(self) -> str:
        """What may be tried where no step succeeds, in words."""


@runtime_checkable
class Body(Protocol):
    """A term that gives cells their stiffness.

    Attributes:
        name: Its name.
        cells: Local cells (ghosts allowed); None for all.
        density: Mass per reference volume; None if it was not given [mass/length³].
    """

    name: str
    cells: NDArray[np.int32] | None
    density: float | None


@runtime_checkable
class Bounded(Protocol):
    """A term that not every displacement is possible for."""

    def possible(self) -> bool:
        """Whether the present one is: no element is turned inside out. Collective."""


@runtime_checkable
class Regularised(Protocol):
    """A term with a viscosity that may only help the solver."""

    @property
    def viscous_work(self) -> float:
        """Work of this viscosity up to the trial state [energy]."""


@runtime_checkable
class Cushioned(Protocol):
    """A term with a contact that may begin before its surfaces touch."""

    @property
    def cushion(self) -> float:
        """Energy that it holds in the trial state beyond half the work of its pressure on the penetration [energy]."""


@runtime_checkable
class Distorted(Protocol):
    """A term of elements whose shape may become one of which the strain energy cannot be trusted."""

    def distortions(self) -> dict[str, tuple[float, str]]:
        """Kind of doubt → strain energy of such elements, and words with a place for the ``{share}``. Collective."""

    def at_stake(self, cells: NDArray[np.bool_], strain: float) -> float:
        """Energy that would change if some owned cells of the mesh were strained otherwise by so much. Collective."""


@runtime_checkable
class Interface(Protocol):
    """A term that joins the two faces of a crack or of a pair of surfaces.

    Attributes:
        entities: Rows of (cell, local facet), flattened, of both faces on this rank.
    """

    entities: NDArray[np.int32]

    @property
    def facet_energy(self) -> float:
        """Energy that breaks a facet of mean size in opening; 0 without a law."""


@runtime_checkable
class Bonded(Protocol):
    """A term whose law acts between the sides of facets.

    Attributes:
        name: Its name.
        closing: Whether the two sides of a facet press on each other.
    """

    name: str
    closing: bool

    @property
    def facets(self) -> NDArray[np.int32]:
        """Local facets, ghosts included."""

    @property
    def plane(self) -> Any:
        """Plane of symmetry in which it lies, `cutsim.fields.symmetry.SymmetryPlane`; None if both sides are meshed."""

    @property
    def meshed(self) -> Sequence[Any]:
        """Those of the two faces that are meshed, as `cutsim.fields.faces.Face`. Collective."""


@runtime_checkable
class Joining(Protocol):
    """A term that joins surfaces whose nodes may lie in the same places.

    Attributes:
        name: Its name.
        closed_elsewhere: Local facets of cuts whose faces another term presses on each other.
    """

    name: str
    closed_elsewhere: NDArray[np.int32]

    @property
    def facets(self) -> Sequence[NDArray[np.int32]]:
        """Local facets of each surface, ghosts included."""


class Observer(Protocol):
    """Observer of terms, which adds nothing to a balance.

    Attributes:
        name: Its name.
    """

    name: str

    def evaluate(self) -> None:
        """Take note of the solved trial state, after all terms. Collective."""

    def record(self) -> Columns:
        """Columns of the history row. Collective."""


P = TypeVar("P")


def with_companions(terms: Iterable[Term]) -> list[Term]:
    """Terms, each with those that come with it; what comes with several of them is there once."""
    given = list(terms)
    found, known = list[Term](), {id(term) for term in given}
    for term in given:
        found += [term, *(part for part in term.companions if id(part) not in known)]
        known.update(id(part) for part in term.companions)
    return found


def offering(parts: Iterable[Any], what: type[P]) -> list[P]:
    """Those of some parts that take part in a protocol."""
    return [part for part in parts if isinstance(part, what)]
