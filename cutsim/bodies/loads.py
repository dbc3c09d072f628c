"""Supports, and loads on surfaces."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from numpy.typing import NDArray

from cutsim.base.assembly import global_dot, nodal_forces, resultant
from cutsim.base.checks import count, require, require_number, require_numbers
from cutsim.base.compat import form
from cutsim.base.kinematics import Expr, cofactor
from cutsim.base.parameters import Schedule, TimeFunction
from cutsim.base.places import Places
from cutsim.base.signatures import checked
from cutsim.base.terms import Columns, Term
from cutsim.fields.points import Surface
from cutsim.fields.space import locate_dofs, locate_face_dofs
from cutsim.fields.state import State

# component of a direction over its length that is none
_STRAIGHT = 1e-12


class Support:
    """Prescribed displacement along one direction on some facets (or vertices), with its reaction.

    On facets of a crack it holds both faces, on one face of it, ``crack.surface("+")``, this face alone; both meet at a
    front that ends inside a body. Several supports may hold the same node along the same component if they agree on
    its displacement at all times; its reaction then counts for the first of them that has a name.

    Args:
        state: Displacement and time.
        entities: Local mesh entities, or a surface such as a face of a crack.
        component: Index of the displacement component, or the direction along which the displacement is prescribed and
            the reaction counted; its length does not matter.
        value: Displacement, a number or a function of time [length].
        name: Name in the history, None to leave the reaction out of it.
        dim: Dimension of the entities; facets by default. A surface has that of facets.
        corners: Times at which the velocity jumps.

    Attributes:
        nodes: Local nodes (blocked dofs) that it holds, ghosts included.
        direction: Unit vector along which the displacement is prescribed; of two opposite ones always the same.
        sign: 1 if this is the direction that was given, −1 if it is the opposite one.
        component: Index of the component if the direction is that of one, else None.
        dofs: Owned dofs that it holds; for a direction that is no component the mechanical problem finds them, among
            components that these nodes have along axes of their own (`cutsim.solvers.directions`).
        symbol: What is prescribed in words, such as "u_x".

    Raises:
        ValueError: The component does not exist, the direction has no length, or no entity is found on any rank.
    """

    @checked
    def __init__(
        self,
        state: State,
        entities: NDArray[np.int32] | Surface,
        component: int | tuple[float, ...],
        value: float | TimeFunction = 0.0,
        *,
        name: str | None = None,
        dim: int | None = None,
        corners: tuple[float, ...] = (),
    ) -> None:
        gdim = state.mesh.geometry.dim
        require_numbers("corners", corners, least=0)
        self.direction, self.sign = _direction(component, gdim)
        tdim = state.mesh.topology.dim
        require("dim", dim, dim is None or dim in range(tdim + 1), f"0 … {tdim}, or None for facets")
        dim = tdim - 1 if dim is None else dim
        self.name, self.state, self.corners = name, state, corners
        self.component = int(np.argmax(self.direction)) if np.count_nonzero(self.direction) == 1 else None
        prescribed = value if self.sign > 0 else _opposite(value)
        self._value = Schedule(state.mesh, state.memory, prescribed, "value", name or "support")
        if isinstance(entities, Surface):
            require("dim", dim, dim == tdim - 1, f"None or {tdim - 1} for a surface")
            self.nodes = locate_face_dofs(state.V, entities.entities)
        else:
            self.nodes = locate_dofs(state.V, dim, entities)
        found = state.mesh.comm.allreduce(np.count_nonzero(self.nodes < state.V.dofmap.index_map.size_local))
        require("entities", found, found > 0, f"entities that carry dofs (support {name!r})")
        self.dofs: NDArray[np.int32] = np.empty(0, dtype=np.int32)
        self.bc: fem.DirichletBC | None = None
        if self.component is None:
            self.symbol = f"u along ({', '.join(f'{c:.4g}' for c in self.direction)})"
            return
        self.symbol = f"u_{'xyz'[self.component]}"
        dofs = gdim * self.nodes + self.component
        self.dofs = dofs[dofs < len(state.increment)]
        self.bc = fem.dirichletbc(self._value.constant, dofs, state.V.sub(self.component))

    @property
    def prescribed(self) -> float:
        """Prescribed displacement along `direction` at the end of the step [length]."""
        return self._value.value

    @property
    def displacement(self) -> float:
        """Prescribed displacement along the direction that was given, at the end of the step [length]."""
        return self.sign * self.prescribed

    def begin(self) -> None:
        """Set the displacement to its value at the end of the step."""
        self._value.begin(self.state.time)

    def record(self, reaction: float) -> Columns:
        """Displacement and force along the direction.

        Args:
            reaction: Reaction along the direction [force].
        """
        return {f"{self.name}_displacement": (self.displacement, "length"), f"{self.name}_force": (reaction, "force")}

    def rates(self, start: float, end: float) -> tuple[float, float]:
        """Prescribed velocity and acceleration along `direction` at the start of a span of time without a corner."""
        return self._value.rates(start, end)


def _direction(component: int | tuple[float, ...], gdim: int) -> tuple[NDArray[np.float64], int]:
    """A component or a direction as a unit vector, and 1, or −1 if it is the opposite one."""
    if not isinstance(component, Sequence | np.ndarray):
        require_number("component", component, count())
        require("component", component, component in range(gdim), f"0 … {gdim - 1}")
        return np.eye(gdim)[component], 1
    require_numbers("component", component, length=gdim)
    length = float(np.linalg.norm(component))
    require("component", component, length > 0, "a direction, not all zero")
    unit = np.array(component) / length
    unit[np.abs(unit) < _STRAIGHT] = 0.0
    # the first component that is not small tells a direction from its opposite
    sign = 1 if unit[np.abs(unit) > 0.5][0] > 0 else -1
    return sign * unit / np.linalg.norm(unit), sign


def _opposite(value: float | TimeFunction) -> float | TimeFunction:
    if callable(value):
        return lambda time: -value(time)
    return -value if isinstance(value, int | float) else value  # what is no number is refused later


class Load(Term, ABC):
    """Base of loads whose forces are proportional to a factor that varies in time."""

    def __init__(
        self, state: State, factor: float | TimeFunction, parameter: str, name: str, corners: tuple[float, ...]
    ) -> None:
        require_numbers("corners", corners, least=0)
        self.name, self.state, self._corners = name, state, corners
        self._factor = Schedule(state.mesh, state.memory, factor, parameter, name)
        rest, places = np.zeros(len(state.increment)), Places.owned(state.V)
        self._forces = state.memory.value(f"{name}: forces", rest, places=places)

    @property
    def corners(self) -> tuple[float, ...]:
        """Times at which the factor has a kink."""
        return self._corners

    def begin(self) -> None:
        """Set the load to its value at the end of the step."""
        self._factor.begin(self.state.time)

    @abstractmethod
    def _nodal_forces(self) -> NDArray[np.float64]:
        """Forces on the owned dofs in the trial state [force]. Collective."""

    def evaluate(self) -> None:
        """Nodal forces of the load. Collective."""
        self._forces.trial = self._nodal_forces()

    def external_work(self) -> float:
        """Work of the load in the step: mean force times displacement increment. Collective."""
        mean = 0.5 * (self._forces.trial + self._forces.committed)
        return global_dot(self.state.mesh.comm, mean, self.state.increment)

    def advise(self) -> str:
        """Not to prescribe the load."""
        return (
            f"there may be no equilibrium under more of {self.name} (a limit point): prescribe a displacement instead "
            "of the load, or use analysis='dynamic'"
        )

    def record(self) -> dict[str, tuple[float, str]]:
        """Resultant of the load. Collective."""
        total = resultant(self.state.mesh.comm, self._forces.trial, self.state.mesh.geometry.dim)
        return {f"{self.name}_force_{'xyz'[i]}": (float(f), "force") for i, f in enumerate(total)}


class SurfaceLoad(Load):
    """Base of loads on a part of the boundary, `_density` per reference area times the factor."""

    def __init__(
        self,
        state: State,
        facets: NDArray[np.int32],
        factor: TimeFunction,
        parameter: str,
        name: str,
        corners: tuple[float, ...],
    ) -> None:
        super().__init__(state, factor, parameter, name, corners)
        self.nodes = locate_dofs(state.V, state.mesh.topology.dim - 1, facets)
        self._ds = state.measures.exterior(facets)
        self._scale = self._factor.constant
        self._form = form(self.residual(ufl.TestFunction(state.V)))

    @abstractmethod
    def _density(self) -> Expr:
        """Force per reference area at factor 1, a vector [stress]."""

    def residual(self, v: Expr) -> ufl.Form:
        """Minus the virtual work of the load."""
        return -self._scale * ufl.dot(self._density(), v) * self._ds

    def _nodal_forces(self) -> NDArray[np.float64]:
        return -nodal_forces(self._form)

    def _area_vector(self) -> Expr:
        """Current area vector per reference area by Nanson's formula, cof(F) N, three components."""
        gdim = self.state.mesh.geometry.dim
        N = ufl.FacetNormal(self.state.mesh)
        outward = ufl.as_vector([*(N[i] for i in range(gdim)), *[0] * (3 - gdim)])
        return cofactor(self.state.deformation_gradient(self.state.u)) * outward


class Traction(SurfaceLoad):
    """Traction of fixed direction on a part of the boundary; a dead load unless it is per current area.

    Args:
        state: Displacement and time.
        facets: Local exterior facets.
        direction: Traction at factor 1, one number a component [stress].
        factor: Function of time that scales it.
        name: Name in messages and output.
        corners: Times at which the factor has a kink.
        current_area: Whether it is a force per current area in place of one per reference area; in plane stress the
            change of thickness is left out.

    Raises:
        ValueError: The direction has the wrong number of components.
    """

    @checked
    def __init__(
        self,
        state: State,
        facets: NDArray[np.int32],
        direction: tuple[float, ...],
        factor: TimeFunction,
        *,
        name: str = "load",
        corners: tuple[float, ...] = (),
        current_area: bool = False,
    ) -> None:
        gdim = state.mesh.geometry.dim
        require_numbers("direction", direction, length=gdim)
        self._current_area, self.symmetric = current_area, not current_area
        self._direction = fem.Constant(state.mesh, np.array(direction, dtype=default_scalar_type))
        super().__init__(state, facets, factor, "factor", name, corners)

    def _density(self) -> Expr:
        if not self._current_area:
            return self._direction
        area = self._area_vector()
        return ufl.sqrt(ufl.dot(area, area)) * self._direction


class Pressure(SurfaceLoad):
    """Fluid pressure on a part of the boundary, along the current normal and per current area.

    Nanson's formula gives the force −p cof(F) N per reference area; in plane stress the change of thickness is left
    out.

    Args:
        state: Displacement and time.
        facets: Local exterior facets.
        pressure: Function of time, > 0 pushes on the body [stress].
        name: Name in messages and output.
        corners: Times at which the pressure has a kink.

    Raises:
        ValueError: There is no such facet.
    """

    symmetric = False

    @checked
    def __init__(
        self,
        state: State,
        facets: NDArray[np.int32],
        pressure: TimeFunction,
        *,
        name: str = "pressure",
        corners: tuple[float, ...] = (),
    ) -> None:
        super().__init__(state, facets, pressure, "pressure", name, corners)

    def _density(self) -> Expr:
        area = self._area_vector()
        return -ufl.as_vector([area[i] for i in range(self.state.mesh.geometry.dim)])
