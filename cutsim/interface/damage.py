"""How far a bond is broken: damage, loss of strength, and work spent, three measures that differ (docs/theory.md §3.2).

All follow from the smallest secants so far, never fall, and go from 0 to 1.  Of a mode they tell what a bond has
suffered that was opened, or slid, by itself until its secant was the present one.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from cutsim.base.arrays import Array
from cutsim.base.functions import positive_part
from cutsim.base.kinematics import Expr
from cutsim.interface.cohesive import CohesiveLaw
from cutsim.interface.dissipation import Way, losses

# jumps among which that of a secant is sought, over √(2 φ/k_c), as natural logarithms
_SPAN = (-23.0, 14.0)
_HALVINGS = 52


def damage(law: CohesiveLaw, k_n: Expr, k_t: Expr) -> tuple[Expr, Expr]:
    """Damage D = max(0, 1 − k/k_c) of both modes (thesis 4.26, 4.27), for forms and arrays alike [–].

    It is the loss of secant stiffness since the characteristic jump, where the secant is k_c: the area fraction that
    carries nothing any more in opening, or in sliding.

    Args:
        law: The law.
        k_n: Smallest secant so far in opening [stress/length].
        k_t: The same in sliding.
    """
    normal, tangential = law.characteristic_secants
    return positive_part(1 - k_n / normal), positive_part(1 - k_t / tangential)


def strength_loss(law: CohesiveLaw, secants: Array) -> Array:
    """Loss of strength 1 − T/T_max of both modes, beyond the largest traction [–].

    Args:
        law: The law.
        secants: Smallest secants so far (k_n, k_t), shape (…, 2) [stress/length].

    Returns:
        The loss, shape (…, 2).
    """
    jumps = _jumps(law, secants)
    peaks = np.array([_peak(law, mode) for mode in (0, 1)])
    left = secants * jumps / peaks[:, 1]
    return np.where(jumps > peaks[:, 0], np.clip(1 - left, 0.0, 1.0), 0.0)


def spent(law: CohesiveLaw, secants: Array) -> Array:
    """Fraction of the work of separation that both modes have lost, what is stored not counted [–].

    Args:
        law: The law.
        secants: Smallest secants so far (k_n, k_t), shape (…, 2) [stress/length].

    Returns:
        The fraction, shape (…, 2).
    """
    jumps = _jumps(law, secants).reshape(-1, 2)
    intact = np.broadcast_to(np.array(law.secants(0.0, 0.0), dtype=float), jumps.shape)
    works = (law.toughness, law.shear_toughness)
    lost = [losses(law, Way(0 * jumps, jumps * axis), intact)[:, None] for axis in np.eye(2)]
    return np.clip(np.hstack(lost) / works, 0.0, 1.0).reshape(secants.shape)


def _scale(law: CohesiveLaw, mode: int) -> float:
    """Jump of the order of the characteristic one."""
    return float(np.sqrt(2 * (law.toughness, law.shear_toughness)[mode] / law.characteristic_secants[mode]))


def _secant(law: CohesiveLaw, mode: int, jump: Array) -> Array:
    """Secant of a mode by itself."""
    pure = (jump, 0 * jump) if mode == 0 else (0 * jump, jump)
    return np.asarray(law.secants(*pure)[mode])


def _jumps(law: CohesiveLaw, secants: Array) -> NDArray[np.float64]:
    """Largest jump of each mode by itself at which its secant is no smaller, shape (…, 2)."""
    found = np.empty(secants.shape)
    for mode in (0, 1):
        low, high = (np.full(secants.shape[:-1], end) for end in _SPAN)
        scale = _scale(law, mode)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            still = _secant(law, mode, scale * np.exp(middle)) >= secants[..., mode] * (1 - 1e-14)
            low, high = np.where(still, middle, low), np.where(still, high, middle)
        found[..., mode] = scale * np.exp(low)
    return found


def _peak(law: CohesiveLaw, mode: int) -> tuple[float, float]:
    """Jump and traction at the strength of a mode by itself."""
    scale = _scale(law, mode)

    def pull(log_jump: Array) -> Array:
        jump = scale * np.exp(log_jump)
        return _secant(law, mode, jump) * jump

    tried, step = np.linspace(*_SPAN, 1001, retstep=True)
    best = tried[np.argmax(pull(tried))]
    bounds = (best - step, best + step)
    found = minimize_scalar(lambda x: -float(pull(np.array([x]))[0]), bounds=bounds, options={"xatol": 1e-10})
    return float(scale * np.exp(found.x)), float(-found.fun)
