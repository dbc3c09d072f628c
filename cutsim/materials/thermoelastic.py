"""Thermoelasticity: thermal expansion and a shear modulus that depends on temperature (docs/theory.md §3.4)."""

from dataclasses import dataclass

import ufl

from cutsim.base.checks import finite, require_number
from cutsim.base.kinematics import Expr
from cutsim.base.signatures import checked
from cutsim.base.units import Expansion, TemperatureValue


@checked
@dataclass(frozen=True)
class ThermoElastic:
    """Isotropic thermal expansion F = F_e F_θ, F_θ = ϑ I with ϑ = 1 + α (T − T_ref), and G(T) = G exp(β (T − T_ref)).

    The strain energy is that of the elastic part, per volume of the freely expanded body, so that a modulus is what a
    specimen shows at its own temperature.  The exponential keeps the shear modulus positive at any temperature.

    Args:
        expansion: Coefficient of linear expansion α [1/temperature].
        reference: Temperature T_ref at which the body has its reference shape and moduli [temperature].
        softening: Relative change β of the shear modulus per unit of temperature, at the reference temperature;
            negative if the body softens as it warms [1/temperature].

    Raises:
        ValueError: A number is not finite.
    """

    expansion: Expansion
    reference: TemperatureValue
    softening: Expansion = 0.0

    def __post_init__(self) -> None:
        for name in ("expansion", "reference", "softening"):
            require_number(name, getattr(self, name), finite)

    def stretch(self, temperature: Expr) -> Expr:
        """Stretch ϑ of the freely expanded body [–]."""
        return 1 + self.expansion * (temperature - self.reference)

    def shear_factor(self, temperature: Expr) -> Expr:
        """Shear modulus over that at the reference temperature, G(T)/G [–]."""
        return ufl.exp(self.softening * (temperature - self.reference))
