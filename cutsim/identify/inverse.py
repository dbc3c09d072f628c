"""Inverse analysis: parameters of a simulation, such as toughness and friction, from a measured curve."""

from __future__ import annotations

import json
import logging
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from cutsim.analysis.steps import StepError
from cutsim.base.checks import between, count, require, require_number
from cutsim.base.signatures import checked
from cutsim.identify.fitting import Bounds, Fit, Parameters, finished, limits_of, require_pairs, require_problem
from cutsim.results.progress import Progress

logger = logging.getLogger(__name__)
#: Abscissae and ordinates that a simulation gave.
SimulatedCurve = tuple[NDArray[np.float64], NDArray[np.float64]]
Simulation = Callable[[Parameters], tuple[ArrayLike, ArrayLike]]
Vector = NDArray[np.float64]

#: Way back, in parts of the range of the abscissae, up to which it is noise.
_NOISE = 0.01
#: Residuals of a simulation that found no equilibrium, in largest measured values.
_FAILURE = 10.0


class Evaluations:
    """Simulated curves and their parameters, kept in a file so that an interrupted fit can continue. Collective.

    Args:
        simulate: Parameters -> abscissae, which grow, and ordinates; the same on all ranks.
        store: A file with one curve a line, which grows; None keeps nothing.  Give each simulation its own.
        mapping: Like `map`, for curves at several points at once.
        comm: Communicator; its first rank reads and writes.
    """

    def __init__(
        self,
        simulate: Simulation,
        store: Path | str | None,
        mapping: Callable[..., Any] = map,
        comm: MPI.Comm = MPI.COMM_WORLD,
    ) -> None:
        self._attempt, self._mapping, self._comm = partial(_attempt, simulate), mapping, comm
        self._store = None if store is None else Path(store)
        self._curves: dict[tuple[Any, ...], SimulatedCurve | None] = comm.bcast(
            self._read() if comm.rank == 0 else None
        )

    def __len__(self) -> int:
        return len(self._curves)

    def __call__(self, points: Sequence[Parameters]) -> list[SimulatedCurve | None]:
        """Curves at several points, None where the simulation found no equilibrium; known ones are not run again."""
        new = {_key(values): values for values in points if _key(values) not in self._curves}
        for values, curve in zip(new.values(), self._mapping(self._attempt, list(new.values())), strict=True):
            self._curves[_key(values)] = curve
            if self._comm.rank == 0:
                self._write(values, curve)
        return [self._curves[_key(values)] for values in points]

    def _read(self) -> dict[tuple[Any, ...], SimulatedCurve | None]:
        if self._store is None or not self._store.exists():
            return {}
        text = self._store.read_text(encoding="utf-8")
        complete = text[: text.rfind("\n") + 1]
        if complete != text:  # a run that was killed has left half a line
            self._store.write_text(complete, encoding="utf-8")
        rows = [json.loads(line) for line in complete.splitlines()]
        return {_key(row["parameters"]): row["curve"] and tuple(map(np.array, row["curve"])) for row in rows}

    def _write(self, values: Parameters, curve: SimulatedCurve | None) -> None:
        if self._store is None:
            return
        self._store.parent.mkdir(parents=True, exist_ok=True)
        row = {"parameters": values, "curve": curve and [list(map(float, part)) for part in curve]}
        with self._store.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


@checked
def fit_simulation(
    simulate: Simulation,
    guess: Parameters,
    x: ArrayLike,
    y: ArrayLike,
    *,
    method: Literal["gradient", "simplex"] = "gradient",
    bounds: Bounds | None = None,
    step: float = 0.02,
    tolerance: float = 1e-3,
    evaluations: int = 200,
    workers: int = 1,
    store: Path | str | None = None,
) -> Fit:
    """Fit parameters of a simulation to a measured curve by least squares. Collective.

    Three ways to use several cores: simulations on all ranks of ``MPI.COMM_WORLD``, one after the other; or, on one
    rank, ``workers`` processes with a simulation each.  These start anew, so that ``simulate`` must be a function of a
    module, and a script needs its ``if __name__ == "__main__"``.

    A curve that turns back, such as a push, a way back and another push, is compared leg by leg, in the order in which
    the points are given.

    Args:
        simulate: Parameters -> abscissae and ordinates, in the order of time; the same on all ranks.  A `StepError`
            counts as a bad fit.
        guess: First guess of each parameter, none zero: it also sets the scale.
        x: Measured abscissae in the order of time, each leg within that of every simulation.  They turn back where they
            go back by more than a hundredth of their range; less is noise.
        y: Measured ordinates.
        method: "gradient" is a trust-region method with one-sided finite differences, whose simulations run at once;
            "simplex" is that of Nelder and Mead, without derivatives, for curves that are rough in the parameters.
        bounds: Parameter -> lower and upper bound.
        step: Finite-difference step, relative to the guess: well above the noise of the simulation.
        tolerance: Relative change of the parameters at which the fit ends.
        evaluations: About how many simulations at most.
        workers: Processes that simulate at once.
        store: File of all simulations, to go on after an interruption.

    Returns:
        The fit; its intervals hold for noise in the measured ordinates alone.

    Raises:
        ValueError: An option or guess is outside its range, there are too few data, a simulation does not reach over
            the measured abscissae or turns back more or less often, or the curve does not depend on a parameter.
    """
    require_pairs("x", x, "y", y)
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    require_number("step", step, between(0, 1))
    require_number("tolerance", tolerance, between(0, 1))
    ranks = MPI.COMM_WORLD.size
    require_number("evaluations", evaluations, count(1))
    require_number("workers", workers, count(1))
    require("workers", workers, workers == 1 or ranks == 1, "1 on several ranks")
    require_problem(guess, len(y), bounds)
    pool = _pool(workers) if workers > 1 else nullcontext()
    with pool as executor, Progress(evaluations, MPI.COMM_WORLD, "fit", start=0) as progress:
        known = Evaluations(simulate, store, executor.map if executor else map)
        problem = _Problem(known, guess, x, y, bounds, step, progress)
        best = _SEARCHES[method](problem, tolerance, evaluations)
        jacobian = problem.jacobian(best)
    return finished(guess, best, jacobian, y, problem.residuals(best), problem.limits)


def _pool(workers: int) -> ProcessPoolExecutor:
    """Processes that do not inherit the state of MPI, as forks would, and that Ctrl-C ends without a traceback."""
    quit_at_once = (signal.SIGINT, signal.SIG_DFL)
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=signal.signal, initargs=quit_at_once)


class _Problem:
    """Residuals and finite differences of a simulated curve.

    Args:
        known: The simulations.
        guess: First guess, which sets the scale.
        x: Measured abscissae.
        y: Measured ordinates.
        bounds: Parameter -> lower and upper bound.
        step: Finite-difference step, relative to the guess.
        progress: What shows how far the fit is.
    """

    def __init__(
        self, known: Evaluations, guess: Parameters, x: Vector, y: Vector, bounds: Bounds | None, step: float,
        progress: Progress,
    ) -> None:  # fmt: skip
        self._known, self._names, self._x, self._y, self._progress = known, list(guess), x, y, progress
        self._noise = _NOISE * float(np.ptp(x))
        self._legs = _legs(x, self._noise)
        self.start = np.array(list(guess.values()))
        self.scale = np.abs(self.start)
        self.limits = limits_of(guess, bounds)
        self._step = step

    def residuals(self, point: Vector) -> Vector:
        """Simulation less measurement."""
        return self.at([point])[0]

    def at(self, points: Sequence[Vector]) -> list[Vector]:
        """Residuals at several points, which are simulated at once."""
        named = [dict(zip(self._names, map(float, point), strict=True)) for point in points]
        residuals = [self._residuals(curve) for curve in self._known(named)]
        shown = {name: float(value) for name, value in named[0].items()}
        error = float(np.sqrt(np.mean(residuals[0] ** 2)))
        self._progress.update(len(self._known), error=error, **shown)
        return residuals

    def jacobian(self, point: Vector) -> Vector:
        """Derivatives of the residuals, by one-sided differences that stay inside the bounds."""
        steps = self._step * self.scale
        steps = np.where(point + steps > self.limits[1], -steps, steps)
        base, *moved = self.at([point, *(point + np.diag(steps))])
        return np.stack([(r - base) / h for r, h in zip(moved, steps, strict=True)], axis=1)

    def _residuals(self, curve: SimulatedCurve | None) -> Vector:
        if curve is None:
            return np.full(len(self._y), _FAILURE * np.abs(self._y).max())
        x, y = curve
        simulated = _legs(x, 0.0)
        turns = [float(self._x[leg.start]) for leg in self._legs[1:]]
        where = f" (at {', '.join(f'{turn:.4g}' for turn in turns)}; sort the points if they are of one leg)"
        wanted = f"{len(turns)}, as often as x turns back{where if turns else ''}"
        require("turns of the simulation", len(simulated) - 1, len(simulated) == len(self._legs), wanted)
        parts = [slice(max(part.start - 1, 0), part.stop) for part in simulated]  # both legs have the turn
        values = [self._on(self._x[leg], x[part], y[part]) for leg, part in zip(self._legs, parts, strict=True)]
        return np.concatenate(values) - self._y

    def _on(self, measured: Vector, x: Vector, y: Vector) -> Vector:
        """Ordinates of a leg of the simulation at measured abscissae; where it turns back, noise may lie beyond."""
        x, y = (x, y) if x[-1] >= x[0] else (x[::-1], y[::-1])
        reach, beyond = (float(x[0]), float(x[-1])), self._noise if len(self._legs) > 1 else 0.0
        covered = reach[0] - beyond <= measured.min() and measured.max() <= reach[1] + beyond
        require("range of the simulation", reach, bool(covered), f"at least ({measured.min()}, {measured.max()})")
        return np.interp(measured, x, y)


def _legs(x: Vector, noise: float) -> list[slice]:
    """The parts of a way between its turns; a way back of no more than the noise is none."""
    turns, direction, furthest = [0], 0.0, 0
    for i, place in enumerate(x):
        way = place - x[furthest]
        if way * direction > 0 or (direction == 0 and abs(way) > noise):
            direction, furthest = direction or float(np.sign(way)), i
        elif abs(way) > noise and way * direction < 0:
            turns.append(furthest + 1)
            direction, furthest = -direction, i
    return [slice(a, b) for a, b in pairwise([*turns, len(x)])]


def _by_gradient(problem: _Problem, tolerance: float, evaluations: int) -> Vector:
    found = optimize.least_squares(
        problem.residuals, problem.start, problem.jacobian, problem.limits, x_scale=problem.scale, xtol=tolerance,
        ftol=tolerance**2, gtol=None, max_nfev=max(1, evaluations // (len(problem.start) + 1)),
    )  # fmt: skip
    return _ended(found.x, found.success, found.message)


def _by_simplex(problem: _Problem, tolerance: float, evaluations: int) -> Vector:
    scale, (low, high) = problem.scale, problem.limits
    start = problem.start / scale
    corners = np.vstack([start, start + np.diag(np.where(start + 0.1 > high / scale, -0.1, 0.1))])
    problem.at(list(corners * scale))  # at once, for the search to find them known
    found = optimize.minimize(
        lambda z: float(np.mean(problem.residuals(z * scale) ** 2)),
        start,
        method="Nelder-Mead",
        bounds=optimize.Bounds(low / scale, high / scale),
        options={"initial_simplex": corners, "xatol": tolerance, "fatol": np.inf, "maxfev": evaluations},
    )
    return _ended(found.x * scale, found.success, found.message)


_SEARCHES: dict[str, Callable[[_Problem, float, int], Vector]] = {"gradient": _by_gradient, "simplex": _by_simplex}


def _ended(point: Vector, success: bool, message: str) -> Vector:
    if not success:
        logger.warning("the fit has not converged: %s", message)
    return point


def _attempt(simulate: Simulation, values: Parameters) -> SimulatedCurve | None:
    """A curve, or None where there is no equilibrium."""
    try:
        x, y = simulate(values)
    except StepError as error:
        logger.warning("no curve at %s: %s", values, error)
        return None
    return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)


def _key(values: Parameters) -> tuple[Any, ...]:
    return tuple(values.items())
