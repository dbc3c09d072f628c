"""A few unknowns beside the displacement, such as the motion of a rigid body, and what the solver asks of them."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc


@dataclass(frozen=True)
class BorderBlocks:
    """Derivatives with respect to the unknowns of a border, and of its equations.

    Attributes:
        columns: Derivative of the owned forces on the displacement by each unknown, one a row.
        rows: Derivative of each equation by the owned displacements.
        corner: Derivative of the equations by the unknowns, the same on all ranks.
    """

    columns: NDArray[np.float64]
    rows: NDArray[np.float64]
    corner: NDArray[np.float64]


class Border(Protocol):
    """Protocol of a few unknowns beside the displacement, the same on all ranks, such as the motion of a rigid body.

    They are scaled to lengths, so that their equations are forces.  Displacements may be tied to them: these follow
    from the unknowns and are none themselves.

    Attributes:
        held: Which of the unknowns are prescribed.
        tied: Owned dofs of the displacement that are tied to them.
        touched: Further owned dofs on which their equations depend.
    """

    held: NDArray[np.bool_]
    tied: NDArray[np.int32]
    touched: NDArray[np.int32]

    @property
    def values(self) -> NDArray[np.float64]:
        """The present unknowns [length]."""

    @property
    def target(self) -> NDArray[np.float64]:
        """Prescribed values, of those that are held [length]."""

    def assign(self, values: NDArray[np.float64], u: NDArray[np.float64]) -> None:
        """Set the unknowns, and what is tied to them in the owned part of a displacement."""

    def residual(self, forces: NDArray[np.float64], jump: NDArray[np.float64] | None) -> NDArray[np.float64]:
        """Left-hand sides of the equations [force]. Collective.

        Args:
            forces: Owned forces of the balance of the displacement.
            jump: Owned increments to prescribed displacements, which the equations take in advance; None if there are
                none.
        """

    @property
    def loads(self) -> NDArray[np.float64]:
        """Forces in the equations at the last residual that tell what is large [force]."""

    def blocks(self, stiffness: PETSc.Mat) -> BorderBlocks:
        """Derivatives at the present unknowns. Collective.

        Args:
            stiffness: Tangent of the forces on the displacement.
        """

    def restrained(self, motions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The part of owned motions, one a row, that the border holds as a support does. Collective."""

    def free(self) -> str | None:
        """A motion of its own that nothing resists at the committed state, in words, or None. Collective."""

    def integrate(self, scheme: Any) -> None:
        """Use a time integration scheme (`cutsim.bodies.schemes.Scheme`) for the inertia of the unknowns."""

    def predict(self) -> None:
        """Let the unknowns go on at the rate of the last step."""

    def settle(self, forces: NDArray[np.float64]) -> None:
        """Take note of the owned forces on the displacement at the end of a step, after all terms. Collective."""


@runtime_checkable
class Bordered(Protocol):
    """A term with a few unknowns of its own."""

    @property
    def border(self) -> Border | None:
        """The unknowns with their equations, None if there are none."""
