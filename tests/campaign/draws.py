"""Random cuts as case files: a seed and a number give a draw, always the same one."""

from dataclasses import asdict, dataclass
from math import ceil, log

import numpy as np

from cutsim.interface.cohesive import Bilinear, CohesiveLaw, Exponential
from cutsim.studies.mesh_rule import MeshRule
from cutsim.tools.pointed import Blade

#: Most unknowns of a cut in the plane and in space.
LARGEST = {2: 8000, 3: 15000}
#: Depth of the tip at the end, by dimension [mm].
DEPTH = {2: 3.0, 3: 2.0}
#: What the tool does: it stays, is drawn out, or is drawn out and pushed in once more.
MOTIONS = ("push", "retract", "re-insert")
LAWS = ("exponential", "bilinear")

_NOTCH = 0.5  # depth of a notch [mm]
_BELOW = 2.0  # of the block below the deepest point [mm]
_HALF_WIDTH, _HALF_THICKNESS = 2.5, 0.43  # of block and blade [mm]
_GROWTH, _BAND, _LAYERS = 1.5, 4, 4  # of the mesh: growth, half width of the fine part in elements, layers in space
_EDGE = 2.0  # length of the cutting edge in space, halved by symmetry [mm]
# largest characteristic opening ε: e ε is a little more than half of the blade's thickness [mm]
_OPENING = _HALF_THICKNESS / 2
# viscosity of the body over G_c and the speed of the tool: it takes about this share of what is lost
_DAMPING = 5e-4
_RISE = 0.1  # of a bilinear law: part of the final opening at which the strength is reached


@dataclass(frozen=True)
class Draw:
    """A random cut.

    Attributes:
        dim: Dimension.
        half_angle: Half angle of the blade [°].
        radius: Radius of its edge [mm].
        toughness: G_c of the bond [N/mm].
        young: Young's modulus E [MPa].
        poisson: Poisson's ratio.
        strength: Strength of the bond over E.
        friction: Coefficient of friction of tool and body.
        notch: Whether the block has a notch.
        law: Name of the cohesive law.
        motion: What the tool does.
    """

    dim: int
    half_angle: float
    radius: float
    toughness: float
    young: float
    poisson: float
    strength: float
    friction: float
    notch: bool
    law: str
    motion: str

    @classmethod
    def of(cls, seed: int, number: int, dim: int, largest: int) -> "Draw":
        """Draw a cut, anew if the blade could not break the bond, or the mesh by the rule had too many unknowns."""
        random = np.random.default_rng([seed, dim, number])
        while True:
            found = cls(
                dim,
                *(
                    float(f"{value:.4g}")
                    for value in (
                        random.uniform(8, 25),
                        _logarithmic(random, 0.03, 0.3),
                        _logarithmic(random, 0.05, 2),
                        _logarithmic(random, 0.05, 2),
                        random.uniform(0.3, 0.49),
                        random.uniform(0.3, 2),
                        max(random.uniform(-0.1, 0.4), 0.0),  # a fifth is smooth
                    )
                ),
                notch=bool(random.integers(2)),
                law=LAWS[random.integers(len(LAWS))],
                motion=MOTIONS[random.integers(len(MOTIONS))],
            )
            if found.bond.opening <= _OPENING and found.unknowns <= largest:
                return found

    @property
    def kind(self) -> str:
        """Class of cuts that take about the same time."""
        return f"{self.dim}-D, {self.motion}, {'rough' if self.friction else 'smooth'}, " + (
            "notch" if self.notch else "intact"
        )

    @property
    def bond(self) -> CohesiveLaw:
        """Its cohesive law."""
        t, g = self.strength * self.young, self.toughness
        return Exponential(t, toughness=g) if self.law == "exponential" else Bilinear(_stiffness(t, g), t, g, t, g)

    @property
    def rule(self) -> MeshRule:
        """Sizes of its elements."""
        return MeshRule.of([Blade(np.radians(self.half_angle), self.radius, _HALF_THICKNESS)], [self.bond])

    @property
    def unknowns(self) -> int:
        """Unknowns of its mesh, about."""
        rule, deep, depth = self.rule, DEPTH[self.dim] + 0.5, DEPTH[self.dim] + _BELOW
        entry = 0 if self.notch else ceil(log(rule.size / rule.mouth) / log(1.2))
        rows = entry + deep / rule.size + _outside(depth - deep, rule.size)
        columns = 2 * (entry + _BAND + _outside(_HALF_WIDTH - _BAND * rule.size, rule.size))
        return ceil((rows + 1) * (columns + 2) * (2 if self.dim == 2 else 3 * (_LAYERS + 1)))

    def parameters(self) -> dict[str, object]:
        """Its numbers by name."""
        return asdict(self)

    def case(self, title: str) -> str:
        """Its case file."""
        t, g, depth = self.strength * self.young, self.toughness, DEPTH[self.dim]
        shear = (
            ""
            if self.law == "exponential"
            else (f"penalty = {_stiffness(t, g):.6g}\nshear_strength = {t:.6g}\nshear_toughness = {g:.6g}\n")
        )
        notch = _NOTCH if self.notch else 0.0
        space = f"B = {_EDGE:g}\nsym = 1\nnz = {_LAYERS}\n" if self.dim == 3 else ""
        directions = "push = [0, -1, 0]\nlateral = [1, 0, 0]\n" if self.dim == 3 else ""
        # body and blade are alike on both sides; else a node that lets go may do so to the wrong one
        faces = "faces = { symmetric = true }\n"
        turning = "" if self.motion == "push" else f"turning_depth = {depth:g}\n"
        # drawn out: until it is where the push began
        start = 0.8 * notch
        # on a path that leads back in time a rough tool would rub on its way back, which no real one does
        path = "path = { facets = 0 }\n" if self.friction else ""
        end = {
            "push": f"depth = {depth:g}\n",
            "re-insert": f"depth = {depth:g}\npush = 2\n",
            "retract": f"entry_time = 0.5\n\n[analysis]\nuntil = {0.5 + 2 * (depth - start):g}\n",
        }[self.motion]
        return f"""\
title = "{title}"

[mesh]
geometry = "block"
dim = {self.dim}

[mesh.set]
Lx = {_HALF_WIDTH:g}
H = {depth + _BELOW:g}
notch = {notch:g}
deep = {depth + 0.5:g}
band = {_BAND * self.rule.size:.6g}
growth = {_GROWTH:g}
{space}
[material]
model = "neo-hookean"
young = {self.young:g}
poisson = {self.poisson:g}

[law]
model = "{self.law}"
strength = {t:.6g}
toughness = {g:g}
{shear}
[body]
viscosity = {_DAMPING * g if self.notch else 0:.6g}

[tool]
shape = "blade"
half_angle = "{self.half_angle:g} deg"
tip_radius = {self.radius:g}
half_thickness = {_HALF_THICKNESS:g}
friction = {self.friction:g}
{directions}
[insertion]
speed = 1
notch = {notch:g}
{faces}{turning}{end}
[steps]
first = 0.02
largest = 0.1
closure = 2e-3
{path}
[output]
every = 0
report = false
animation = false
"""


def _logarithmic(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(log(low), log(high))))


def _stiffness(strength: float, toughness: float) -> float:
    return strength**2 / (2 * toughness * _RISE)


def _outside(length: float, size: float) -> float:
    """Elements that grow from a size over a length."""
    return max(log(1 + length * (_GROWTH - 1) / size / _GROWTH) / log(_GROWTH), 0.0)
