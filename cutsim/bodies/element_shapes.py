"""Elements of a body that have lost their shape, and the energy that is at stake with them."""

import numpy as np
from numpy.typing import NDArray

from cutsim.base.checks import place
from cutsim.bodies.volume_ratio import VolumeRatio
from cutsim.materials.elastic import Material

# volume ratio below which an element is no longer to be trusted: its stiffness may be wrong by a factor. This changes
# the energy of the body, and with it force and work, by about what such elements hold: as much as may be missing in the
# audit is no reason against a result
_FLAT = 0.1


class ElementShapes:
    """Shapes of the elements of a body.

    Args:
        name: Of the body.
        volume: Its volume ratio.
        material: Its material.
        degree: Degree of its displacement.
    """

    def __init__(self, name: str, volume: VolumeRatio, material: Material, degree: int) -> None:
        self._name, self._volume, self._material, self._degree = name, volume, material, degree

    def distortions(self) -> dict[str, tuple[float, str]]:
        """Elements that are turned over at a corner or almost flat: strain energy, words and cure. Collective."""
        name, found = self._name, {}
        turned = self._volume.turned()
        if turned is not None:
            found[f"{name}: folded"] = (
                turned.energy,
                f"{name}: elements that are turned over at a corner, as at {place(turned.place)} with "
                f"J = {turned.smallest:.2g}, hold {{share}}: see what smaller ones change",
            )
        smallest = self._volume.smallest()
        if smallest < _FLAT:
            # where elements of degree 1 are folded, smaller ones are so too
            cure = "smaller ones" if self._degree > 1 else "smaller ones, or those of degree 2,"
            found[f"{name}: J"] = (
                self._volume.held_below(_FLAT),
                f"{name}: elements that are squeezed to {smallest:.2g} of their volume hold {{share}}, "
                f"{cure} are needed",
            )
        return found

    def at_stake(self, cells: NDArray[np.bool_], strain: float) -> float:
        """Energy that would change if some elements were deformed otherwise: what they hold, and ½ E ε² V. Collective.

        Args:
            cells: Of each owned cell of the mesh, whether it is one of them.
            strain: Strain ε by which their deformation would differ [–].
        """
        held, volume = self._volume.held(cells)
        return held + 0.5 * self._material.young * strain**2 * volume
