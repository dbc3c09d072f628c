"""State of a run: displacement, time and all else that is remembered, trial and committed."""

from dataclasses import dataclass, replace

import numpy as np
import ufl
from dolfinx import default_scalar_type, fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from cutsim.base import kinematics
from cutsim.base.checks import require
from cutsim.base.kinematics import Expr
from cutsim.base.memory import Memory
from cutsim.base.places import Places
from cutsim.base.signatures import checked
from cutsim.base.verdict import Verdict
from cutsim.fields.cells import check_cells
from cutsim.fields.measures import Measures


@dataclass(frozen=True)
class Clock:
    """Clock of a step: its end, size and number.

    Attributes:
        time: Its end [time].
        dt: Its size [time].
        rate: Velocity of the displacement in it, local entries, ghosts included [length/time].
        number: Its number, 0 before the first.
        back: All the time that steps so far went back [time].
    """

    time: float
    dt: float
    rate: NDArray[np.float64]
    number: int = 0
    back: float = 0.0


@dataclass(frozen=True)
class Pace:
    """Pace of a run: its step control and the size of the next step.

    Attributes:
        control: The control that has chosen the size, in words.
        size: The size [time].
        smooth: Whether the last step tells where the next one leads.
        path: Size of the next step along the equilibrium path, 0 for a step in time [energy].
        turned: Whether the path had to be followed before.
        carrier: Name of what carries the run across a jump; empty while nothing does.
    """

    control: str = ""
    size: float = 0.0
    smooth: bool = False
    path: float = 0.0
    turned: bool = False
    carrier: str = ""


class State:
    """State of a run: displacement, time and step size, and the memory of all that terms remember.

    Args:
        V: Vector space of the displacement, usually from `cutsim.fields.space.cracked_space`.
        axisymmetric: Whether the mesh is a meridian plane, the axis of rotation at x₀ = r = 0 and along x₁ = z
            (docs/elements.md). Forces and energies are then those of the whole body of revolution.

    Attributes:
        u: Trial displacement [length].
        u_old: Committed displacement, at the start of the step.
        dt: Step size as a form constant.
        jerks: Whether prescribed velocities may jump at the start of the step; `cutsim.analysis.mechanics` says so.
        memory: What displacement, terms, solvers and the loop over steps remember.
        pace: What the loop over steps knows of the next one; it is set by `cutsim.analysis.stepping.run`.
        measures: Integration measures that the terms share.
        verdict: What speaks against trusting the displacement.

    Raises:
        ValueError: The space is not one of vectors, cells are folded or have no volume, or the mesh is no meridian
            plane.
    """

    @checked
    def __init__(self, V: fem.FunctionSpace, *, axisymmetric: bool = False) -> None:
        check_cells(V.mesh)
        require("V", V.value_shape, V.value_shape == (V.mesh.geometry.dim,), "a vector space of the mesh's dimension")
        if axisymmetric:
            _check_meridian(V.mesh)
        self.axisymmetric = axisymmetric
        self.V = V
        self.mesh = V.mesh
        self.u = fem.Function(V, name="u")
        self.u_old = fem.Function(V, name="u_old")
        self.dt = fem.Constant(V.mesh, default_scalar_type(1.0))
        self.jerks = False
        self.measures = Measures(V.mesh, axisymmetric=axisymmetric)
        self.memory = Memory()
        self.verdict = Verdict(self.memory)
        self.memory.array("displacement", self.u, self.u_old)
        start = Clock(0.0, float(self.dt.value), np.zeros_like(self.u.x.array))
        self._clock = self.memory.value("clock", start, self._show, places=Places.of(V))
        self.pace = self.memory.value("pace", Pace())

    def _show(self, clock: Clock) -> None:
        self.dt.value = clock.dt

    @property
    def time(self) -> float:
        """Time at the end of the step (trial) [time]."""
        return self._clock.trial.time

    @property
    def time_old(self) -> float:
        """Committed time, at the start of the step [time]."""
        return self._clock.committed.time

    @property
    def path(self) -> float:
        """Path variable: the time, and twice the time that steps went back, so that it never falls (trial) [time]."""
        return self._clock.trial.time + 2 * self._clock.trial.back

    @property
    def jumping(self) -> bool:
        """Whether the trial step, which is accepted, is one across a jump, after which the body does not yet rest."""
        return bool(self.pace.trial.carrier)

    @property
    def number(self) -> int:
        """Number of the step (trial)."""
        return self._clock.trial.number

    @property
    def unknowns(self) -> int:
        """Number of unknowns of the displacement on all ranks."""
        return int(self.V.dofmap.index_map.size_global * self.V.dofmap.index_map_bs)

    def begin(self, time: float) -> None:
        """Start a step that ends at `time`; the trial displacement starts from the committed one."""
        old = self._clock.committed
        back = old.back + max(old.time - time, 0.0)
        self._clock.trial = replace(old, time=time, dt=time - old.time, number=old.number + 1, back=back)
        self.dt.value = self._clock.trial.dt

    def predict(self) -> None:
        """Let the trial displacement go on at the rate of the last committed step."""
        self.u.x.array[:] = self.u_old.x.array + float(self.dt.value) * self._clock.committed.rate

    def rollback(self) -> None:
        """Give the trial step up: all that is remembered is as it was at its start, bit for bit."""
        self.memory.rollback()

    def commit(self) -> None:
        """Adopt the trial step, with all that is remembered."""
        if self.time > self.time_old:
            rate = (self.u.x.array - self.u_old.x.array) / (self.time - self.time_old)
            self._clock.trial = replace(self._clock.trial, rate=rate)
        self.memory.commit()

    def deformation_gradient(self, u: Expr) -> Expr:
        """Deformation gradient of a displacement, 3 × 3, with the hoop stretch 1 + u_r/r of an axisymmetric problem."""
        hoop = 1 + u[0] / ufl.SpatialCoordinate(self.mesh)[0] if self.axisymmetric else 1.0
        return kinematics.deformation_gradient(u, hoop)

    @property
    def facet_measure(self) -> str:
        """What the measure of a facet is, "length" or "area"."""
        return "area" if self.axisymmetric or self.mesh.geometry.dim == 3 else "length"

    @property
    def increment(self) -> np.ndarray:
        """Displacement increment of the step, owned dofs [length]."""
        owned = self.V.dofmap.index_map.size_local * self.V.dofmap.index_map_bs
        return self.u.x.array[:owned] - self.u_old.x.array[:owned]


def _check_meridian(mesh: Mesh) -> None:
    """Refuse an axisymmetric problem on a mesh that is not flat or reaches beyond the axis. Collective."""
    require("axisymmetric", True, mesh.geometry.dim == 2, "False on a 3-D mesh")
    x = mesh.geometry.x[:, 0]
    low, high = (mesh.comm.allreduce(pick(x, initial=0.0), op) for pick, op in ((np.min, MPI.MIN), (np.max, MPI.MAX)))
    require("axisymmetric", True, low >= -1e-9 * high, f"False on a mesh with radii x[0] < 0, such as {low:.3g}")
