"""``cutsim fit-material``: numbers of a material from tests with a homogeneous stretch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cutsim.commands.endings import Ending
from cutsim.commands.options import console

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cutsim.identify import MaterialFit, StressTest
    from cutsim.materials.elastic import Material

    Vector = NDArray[np.float64]

#: Poisson's ratio of nearly incompressible solids.
_POISSON = 0.495

EXAMPLES = (
    "cutsim fit-material tension.csv --model ogden",
    "cutsim fit-material tension.csv biaxial.csv --test uniaxial --test equibiaxial --model mooney-rivlin",
    "cutsim fit-material machine.txt --model yeoh --length 20 --area 24 --offset strain",
)


class Model(StrEnum):
    """Materials that tests without shear determine."""

    neo_hookean = "neo-hookean"
    isochoric_neo_hookean = "isochoric-neo-hookean"
    mooney_rivlin = "mooney-rivlin"
    yeoh = "yeoh"
    arruda_boyce = "arruda-boyce"
    ogden = "ogden"
    isochoric_ogden = "isochoric-ogden"


class Test(StrEnum):
    """Tests with a homogeneous stretch."""

    uniaxial = "uniaxial"
    equibiaxial = "equibiaxial"
    pure_shear = "pure shear"


class Offset(StrEnum):
    """What of the zeros of a test is fitted too."""

    strain = "strain"
    stress = "stress"


def command(
    files: Annotated[list[Path], typer.Argument(metavar="DATA…", help="Tables with their units in the header.")],
    *,
    model: Annotated[Model, typer.Option(help="Material, as in case files.")],
    test: Annotated[list[Test] | None, typer.Option(help="Kind of each test; uniaxial.")] = None,
    terms: Annotated[int, typer.Option(min=1, max=3, help="Terms of Ogden's solids.")] = 1,
    x: Annotated[str | None, typer.Option("-x", "--x", help="Column of strain or travel: 'title:unit'.")] = None,
    y: Annotated[str | None, typer.Option("-y", "--y", help="Column of stress or force: 'title:unit'.")] = None,
    length: Annotated[float | None, typer.Option(help=r"Length of the specimen \[mm], for tables of travel.")] = None,
    area: Annotated[float | None, typer.Option(help=r"Area of the specimen \[mm²], for tables of force.")] = None,
    offset: Annotated[list[Offset] | None, typer.Option(help="Fit zeros of the tests too: preload, slack.")] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Snippet for a case file; the plot is written beside it.")
    ] = Path("material.toml"),
) -> None:
    """Fit the numbers of a material to tests in tension, compression, equibiaxial tension or pure shear.

    Prints the numbers with their 95 % intervals and writes a plot and a [material] table for a case file. The bulk
    modulus, which no such test shows, is that of a Poisson's ratio of 0.495.
    """
    from cutsim.base.checks import require
    from cutsim.identify import StressTest, fit_material

    kinds = test or [Test.uniaxial] * len(files)
    require("number of --test", len(kinds), len(kinds) == len(files), f"{len(files)}, one for each file")
    tests = []
    for path, kind in zip(files, kinds, strict=True):
        stretch, stress = _stretch(path, x, length), _stress(path, y, area)
        tests.append(StressTest(kind.value, stretch, stress, 1 / abs(stress).max() if len(files) > 1 else 1.0))
    guess = _GUESSES[model](_shear(tests[0]), terms)
    fitted = fit_material(
        guess.material, guess.vary, tests, bounds=guess.bounds, offsets=[o.value for o in offset or []]
    )
    plot = output.with_suffix(".png")
    fitted.plot(plot, title=model.value)
    output.write_text(_snippet(model, fitted), encoding="utf-8")
    screen = console()
    screen.print(str(fitted.fit), f"written: {output}, {plot}", sep="\n", markup=False)
    if fitted.unstable or fitted.fit.systematic:
        raise typer.Exit(Ending.QUESTIONABLE)


def _stretch(path: Path, title: str | None, length: float | None) -> Vector:
    """Stretches of a test."""
    from cutsim.identify import titled_units

    if length is not None:
        return 1 + _values(path, "displacement", title) / length
    named = [title] if title else titled_units(path)
    kind = "stretch" if any("stretch" in name.lower() for name in named) else "strain"
    values = _values(path, kind, title, "A travel needs --length, that of the specimen")
    return values if kind == "stretch" else 1 + values


def _stress(path: Path, title: str | None, area: float | None) -> Vector:
    """Nominal stresses of a test [MPa]."""
    if area is not None:
        return _values(path, "force", title) / area
    return _values(path, "stress", title, "A force needs --area, that of the specimen")


def _values(path: Path, quantity: str, title: str | None, otherwise: str = "") -> Vector:
    """A column of a table; where there is none, what may be given instead is said."""
    from cutsim.commands.folders import read_columns

    try:
        (column,) = read_columns(path, {quantity: title})
    except ValueError as error:
        raise ValueError(f"{error}. {otherwise}" if otherwise else str(error)) from error
    return column.values


def _shear(test: StressTest) -> float:
    """First guess of the shear modulus: from the stress of a neo-Hookean solid in the same test at its end."""
    end = float(test.stretch[abs(test.stretch - 1).argmax()])
    power = {"uniaxial": -2, "equibiaxial": -5, "pure shear": -3}[test.path]
    return float(abs(test.stress).max() / abs(end - end**power))


@dataclass(frozen=True)
class _Guess:
    """Where a fit starts.

    Attributes:
        material: Material with a first guess of its numbers.
        vary: Those that are fitted.
        bounds: Their bounds.
    """

    material: Material
    vary: tuple[str, ...]
    bounds: dict[str, tuple[float, float]]

    @classmethod
    def of(cls, material: Material, *vary: str, free: tuple[str, ...] = ()) -> _Guess:
        """All that is fitted is positive but what is free."""
        from cutsim.base.parameters import numbers

        names = [n for n in numbers(material) if n.partition("[")[0] in vary]
        return cls(material, vary, {n: (0.0, inf) for n in names if n.partition("[")[0] not in free})


def _bulk(shear: float) -> float:
    return 2 * shear * (1 + _POISSON) / (3 * (1 - 2 * _POISSON))


def _elastic(kind: str) -> Callable[[float, int], _Guess]:
    return lambda shear, _: _Guess.of(_made(kind, young=2 * shear * (1 + _POISSON), poisson=_POISSON), "young")


def _ogden(shear: float, terms: int) -> _Guess:
    material = _made("Ogden", **_moduli(shear, terms), volumetric=_bulk(shear) - 2 * shear / 3)
    return _Guess.of(material, "moduli", "exponents", free=("exponents",))


def _isochoric_ogden(shear: float, terms: int) -> _Guess:
    material = _made("IsochoricOgden", **_moduli(shear, terms), bulk=_bulk(shear))
    return _Guess.of(material, "moduli", "exponents", free=("exponents",))


def _moduli(shear: float, terms: int) -> dict[str, tuple[float, ...]]:
    """Moduli, whose sum is twice that of shear, and exponents near those of Mooney–Rivlin, and of Ogden's own three."""
    exponents = {1: (2.0,), 2: (2.0, -2.0), 3: (1.3, 5.0, -2.0)}[terms]
    shares = {1: (1.0,), 2: (0.8, 0.2), 3: (0.8, 0.05, 0.15)}[terms]
    return {"moduli": tuple(2 * shear * share for share in shares), "exponents": exponents}


def _mooney_rivlin(shear: float, _: int) -> _Guess:
    return _Guess.of(_made("MooneyRivlin", c1=0.4 * shear, c2=0.1 * shear, bulk=_bulk(shear)), "c1", "c2")


def _yeoh(shear: float, _: int) -> _Guess:
    material = _made("Yeoh", c1=0.5 * shear, c2=0.01 * shear, c3=1e-3 * shear, bulk=_bulk(shear))
    return _Guess.of(material, "c1", "c2", "c3", free=("c2",))


def _arruda_boyce(shear: float, _: int) -> _Guess:
    guess = _Guess.of(_made("ArrudaBoyce", modulus=shear, links=5.0, bulk=_bulk(shear)), "modulus", "links")
    return replace(guess, bounds=guess.bounds | {"links": (1.0, inf)})


def _made(kind: str, **values: Any) -> Material:
    import cutsim

    return getattr(cutsim, kind)(**values)


_GUESSES: dict[Model, Callable[[float, int], _Guess]] = {
    Model.neo_hookean: _elastic("NeoHookean"),
    Model.isochoric_neo_hookean: _elastic("IsochoricNeoHookean"),
    Model.mooney_rivlin: _mooney_rivlin,
    Model.yeoh: _yeoh,
    Model.arruda_boyce: _arruda_boyce,
    Model.ogden: _ogden,
    Model.isochoric_ogden: _isochoric_ogden,
}


def _snippet(model: Model, fitted: MaterialFit) -> str:
    """The material as a table of a case file, with the intervals of its numbers."""
    import tomlkit

    document, table = tomlkit.document(), tomlkit.table()
    document.add(tomlkit.comment("Units: mm, N, MPa. 95 % intervals are given where a number was fitted."))
    table["model"] = model.value
    material: Any = fitted.material  # a dataclass
    for name, value in asdict(material).items():
        table[name] = [_rounded(entry) for entry in value] if isinstance(value, tuple) else _rounded(value)
        known = [limits for number, limits in fitted.fit.intervals().items() if number.partition("[")[0] == name]
        if known:
            table[name].comment(", ".join(f"{low:.5g} … {high:.5g}" for low, high in known))
    document["material"] = table
    return tomlkit.dumps(document)


def _rounded(value: float) -> float:
    return float(f"{value:.7g}")
