"""Energy stored in the springs and dissipated in the dashpots of a viscoelastic solid (docs/materials.md).

A term h of quasi-linear viscoelasticity is h = g (S(E) − z), where the stress z follows S, τ ż = S − z.
With the strain E_z at which the spring would be in equilibrium with z, S(E_z) = z, the power of h is

    h : Ė = Ψ̇ + D,    Ψ = g [W(E) − W(E_z) − z : (E − E_z)],    D = h : (E − E_z)/τ.

Neither Ψ, which is recoverable, nor D is ever negative if W is convex in E.  A W that does not depend on the volume is
not; E and E_z are then those of the isochoric parts of the deformations, and z is S(E_z) up to a pressure.
"""

from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem

from cutsim.base.assembly import Array, integrate
from cutsim.base.compat import form
from cutsim.base.memory import Memory
from cutsim.bodies.spring import Spring


@dataclass(frozen=True)
class _Terms:
    """Terms of the series at one instant, and sums over the body.

    Attributes:
        overstress: h of each term at each point, shape (terms, cells, points, components), as work conjugates.
        relaxed: Strain E_z.
        ahead: E − E_z.
        stored: Ψ of the body [energy].
        lost: Work of the dashpots so far [energy].
    """

    overstress: Array
    relaxed: Array
    ahead: Array
    stored: float = 0.0
    lost: float = 0.0


class Maxwell:
    """Stored and dissipated energy of the overstresses. Collective.

    Args:
        name: Name in the memory.
        memory: Memory of the run.
        spring: The strain energy that relaxes.
        strengths: gᵢ of the series.
        measure: Measure over the body.
        strain: Components of strain at the start, at which there is no overstress.

    Attributes:
        heat: What the dashpots dissipate in the trial step at each point, per reference volume.
    """

    def __init__(
        self, name: str, memory: Memory, spring: Spring, strengths: Array, measure: ufl.Measure, strain: Array
    ) -> None:
        self._spring, self._strengths = spring, strengths
        # of energy, for sums over the body
        self._density, self.heat = (fem.Function(spring.points.space()) for _ in range(2))
        self._integral = form(self._density * measure)
        rest = np.zeros((len(strengths), *strain.shape))
        relaxed = np.stack([spring.reduced(strain)] * len(strengths))
        self._terms = memory.value(name, _Terms(rest, relaxed, rest), places=spring.points.places(axis=1))

    @property
    def stored(self) -> float:
        """Energy that the springs of the series would give back [energy]."""
        return self._terms.trial.stored

    @property
    def lost(self) -> float:
        """Energy that the dashpots have turned into heat so far [energy]."""
        return self._terms.trial.lost

    def evaluate(self, strain: Array, stress: Array, overstress: Array, steps: Array) -> None:
        """Energies at the end of a step.

        Args:
            strain: Components of strain, shape (cells, points, components).
            stress: Stress of the spring as work conjugates.
            overstress: h of each term as work conjugates.
            steps: Size of the step over the relaxation time of each term.
        """
        old = self._terms.committed
        full = self._spring.reduced(strain)
        W = self._spring.energy(full)
        relaxed, ahead = np.empty_like(old.relaxed), np.empty_like(overstress)
        stored = lost = np.zeros_like(W)
        for i, (g, h, h_old) in enumerate(zip(self._strengths, overstress, old.overstress, strict=True)):
            z = stress - h / g
            relaxed[i] = self._spring.invert(z, old.relaxed[i])
            ahead[i] = (full - relaxed[i])[..., :-1]
            stored = stored + g * (W - self._spring.energy(relaxed[i]) - (z * ahead[i]).sum(-1))
            start, cross, end = _weights(steps[i])
            first, last = old.ahead[i], ahead[i]
            lost = lost + (h_old * (start * first + cross * last) + h * (cross * first + end * last)).sum(-1)
        self.heat.x.array[self._spring.points.dofs] = lost
        self._terms.trial = _Terms(overstress, relaxed, ahead, self._sum(stored), old.lost + self._sum(lost))

    def _sum(self, values: Array) -> float:
        self._density.x.array[self._spring.points.dofs] = values
        return integrate(self._integral)


def _weights(x: float) -> tuple[float, float, float]:
    """Integrals over a step of φ₀², φ₀φ₁ and φ₁², φ₁ = (1 − e^(−s))/(1 − e^(−x)) = 1 − φ₀, s from 0 to x.

    In a step overstress and strain ahead go from their first to their last value as φ₁ goes from 0 to 1: exactly if S
    is linear in E and straight in time.
    """
    if x < 1e-4:
        return x / 3, x / 6, x / 3
    r = -np.expm1(-x)
    mean = x / r - 1
    end = (x - 2 * r - 0.5 * np.expm1(-2 * x)) / r**2
    return x - 2 * mean + end, mean - end, end
