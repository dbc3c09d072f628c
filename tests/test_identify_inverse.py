"""Parameters of simulations from curves: methods, restart, processes, and a blade cut."""

import json
import logging
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from cutsim import (
    Blade,
    Drive,
    Exponential,
    Insertion,
    NeoHookean,
    StepControl,
    StepError,
    cracked_block,
    read_geo,
    run,
)
from cutsim.identify import fit_simulation
from cutsim.identify.inverse import Evaluations

MESH = Path(__file__).parents[1] / "meshes" / "block.geo"
TRUE = {"stiffness": 2.0, "decay": 0.5}
GUESS = {"stiffness": 1.0, "decay": 1.0}
X = np.linspace(0.5, 3.0, 30)


def spring(values):
    """A spring that softens, on a grid of its own."""
    x = np.linspace(0.0, 3.2, 400)
    return x, values["stiffness"] * x * np.exp(-values["decay"] * x)


def brittle(values):
    """The same, without equilibrium for small decay."""
    if values["decay"] < 0.45:
        raise StepError("no equilibrium")
    return spring(values)


def noisy():
    exact = np.interp(X, *spring(TRUE))
    return exact + 0.01 * np.random.default_rng(0).standard_normal(len(X))


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["gradient", "simplex"])
def test_both_methods_find_the_parameters(method):
    exact = np.interp(X, *spring(TRUE))
    assert fit_simulation(spring, GUESS, X, exact, method=method, tolerance=1e-5).values == pytest.approx(
        TRUE, rel=1e-3
    )
    fit = fit_simulation(spring, GUESS, X, noisy(), method=method, tolerance=1e-4)
    for name, (low, high) in fit.intervals(0.99).items():
        assert low < TRUE[name] < high and high - low < 0.1
    assert fit.rmse == pytest.approx(0.01, rel=0.3)


WAY = np.concatenate([np.linspace(0, 2, 21), np.linspace(1.9, 1, 10), np.linspace(1.1, 3, 20)])


STEPS = np.concatenate([np.linspace(0, 2.03, 40), np.linspace(2.0, 0.97, 30), np.linspace(1.0, 3, 40)])


def tool(values, way=STEPS):
    """Force in a push, back and a push with less: friction changes its sign, and what is cut does not resist again."""
    deepest = np.maximum.accumulate(way)
    cutting = np.where(way >= deepest, 1.0 + 0.3 * way, 0.0)
    return way, values["toughness"] * cutting + values["friction"] * np.sign(np.diff(way, prepend=-1.0)) * way


def test_a_way_back_is_compared_leg_by_leg():
    """Push, back and push: each point is compared with its own leg; noise of the way is no turn."""
    true = {"toughness": 1.0, "friction": 0.4}
    rng = np.random.default_rng(0)
    exact = tool(true, WAY)[1]
    keep = np.arange(len(WAY)) != 40  # where the second push meets the uncut, which the simulation does a little later
    x = (WAY + 0.002 * rng.standard_normal(len(WAY)))[keep]
    y = (exact + 0.01 * rng.standard_normal(len(WAY)))[keep]
    fit = fit_simulation(tool, {"toughness": 0.5, "friction": 0.2}, x, y, tolerance=1e-5)
    assert fit.values == pytest.approx(true, rel=0.02)


@pytest.mark.mpi
def test_other_turns_than_measured_are_refused():
    with pytest.raises(ValueError, match=r"turns of the simulation = 0 .* 2, as often as x turns back \(at 1.9, 1.1"):
        fit_simulation(spring, GUESS, WAY, WAY)
    with pytest.raises(ValueError, match=r"turns of the simulation = 2 .* 0, as often as x turns back"):
        fit_simulation(tool, {"toughness": 0.5, "friction": 0.2}, X, X)


def test_a_failed_simulation_is_a_bad_fit(caplog):
    start = {"stiffness": 2.5, "decay": 0.8}
    with caplog.at_level(logging.WARNING):
        fit = fit_simulation(brittle, start, X, np.interp(X, *spring(TRUE)), method="simplex", tolerance=1e-5)
    assert fit.values == pytest.approx(TRUE, rel=1e-2)
    bad = Evaluations(brittle, None)([{"stiffness": 1.0, "decay": 0.1}])
    assert bad == [None] and "no curve at" in caplog.text


def test_an_interrupted_fit_goes_on_where_it_was(tmp_path):
    """The second fit repeats no simulation of the first, also where the file ends in half a line."""
    runs = []

    def counted(values):
        runs.append(dict(values))
        if len(runs) == 6:
            raise KeyboardInterrupt
        return spring(values)

    store = tmp_path / "fit" / "runs.json"
    exact = np.interp(X, *spring(TRUE))
    with pytest.raises(KeyboardInterrupt):
        fit_simulation(counted, GUESS, X, exact, store=store)
    assert len(store.read_text().splitlines()) == 5
    with store.open("a") as file:
        file.write('{"parameters": {"stiff')
    # a half line is left by a kill; what follows must not be lost with it
    resumed = fit_simulation(counted, GUESS, X, exact, store=store)
    assert resumed.values == fit_simulation(spring, GUESS, X, exact).values
    done = [tuple(r.values()) for r in runs]
    assert len(set(done)) == len(done) - 1, "only the interrupted simulation was run twice"
    before = len(runs)
    assert fit_simulation(counted, GUESS, X, exact, store=store).values == resumed.values
    assert len(runs) == before
    assert all(json.loads(line)["curve"] for line in store.read_text().splitlines())


def test_processes_give_the_same_fit(tmp_path):
    alone = fit_simulation(spring, GUESS, X, noisy())
    together = fit_simulation(spring, GUESS, X, noisy(), workers=2, store=tmp_path / "runs.json")
    assert together.values == alone.values
    np.testing.assert_array_equal(together.covariance, alone.covariance)


def test_bounds_are_kept(caplog):
    with caplog.at_level(logging.WARNING):
        fit = fit_simulation(spring, GUESS, X, noisy(), bounds={"decay": (0.6, 2.0)})
    assert fit.values["decay"] == pytest.approx(0.6, abs=1e-3) and "has met its bound" in caplog.text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "magic"}, r"method = 'magic' .* 'gradient' or 'simplex'"),
        ({"step": 0.0}, r"step = 0.0"),
        ({"tolerance": 2.0}, r"tolerance = 2.0"),
        ({"workers": 0}, r"workers = 0"),
        ({"x": X + 1.0}, r"range of the simulation = \(0.0, 3.2\) .* at least \(1.5, 4.0\)"),
        ({"y": X[1:]}, r"shape of y = \(29,\) .* \(30,\)"),
        ({"guess": {"stiffness": 1.0, "decay": 1.0, "colour": 1.0}}, r"parameter = 'colour' .* depend on it"),
        ({"bounds": {"length": (0, 1)}}, r"bounds = 'length' .* stiffness, decay"),
    ],
)
def test_bad_input_is_refused(options, message):
    arguments = {"guess": GUESS, "x": X, "y": np.interp(X, *spring(TRUE))} | options
    with pytest.raises(ValueError, match=message):
        fit_simulation(spring, **arguments)


# -- blade cut --------------------------------------------------------------------------------------------------------


@cache
def block():
    sizes = {"dim": 2, "Lx": 3.0, "H": 4.5, "lc": 0.15, "band": 0.45, "growth": 1.6, "notch": 0.6}
    return read_geo(MESH, MPI.COMM_WORLD, sizes, gdim=2)


def blade_cut(values):
    """Force per width against depth."""
    law = Exponential(strength=0.4, toughness=values["toughness"])
    body = cracked_block(block(), NeoHookean(0.777, 0.45), law, viscosity=0.002)
    cut = Insertion.build(body, Blade(0.2, 0.15, 0.855), Drive(1.0, 1.0), notch=0.6, friction=values["friction"])
    rows = []
    run(
        cut.mechanics,
        cut.time_of(4.0),
        StepControl(first=0.1, largest=0.1),
        lambda r: rows.append(cut.columns(r.columns)),
    )
    depth, force = (np.array([row[name][0] for row in rows]) for name in ("depth", "force"))
    pushed = np.flatnonzero(np.diff(depth, prepend=-1.0) > 1e-9)
    return depth[pushed], force[pushed]


def test_toughness_and_friction_from_the_curve_of_a_blade_cut():
    """From one curve with 1 % noise and a guess 27 and 50 % off: both within 3 %, and within their intervals."""
    true = {"toughness": 0.3, "friction": 0.1}
    depth, force = blade_cut(true)
    x = np.linspace(0.7, 3.55, 60)
    measured = np.interp(x, depth, force) + 0.01 * force.max() * np.random.default_rng(0).standard_normal(60)
    guess = {"toughness": 0.38, "friction": 0.15}
    fit = fit_simulation(blade_cut, guess, x, measured, bounds={"friction": (0.0, 1.0)}, tolerance=1e-2)
    assert fit.values == pytest.approx(true, rel=0.03)
    for name, (low, high) in fit.intervals(0.99).items():
        assert low < true[name] < high
    assert fit.r_squared > 0.995
