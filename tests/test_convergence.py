"""The judge of convergence, on plain numbers."""

import ast
from pathlib import Path

import numpy as np
import pytest

from cutsim.solvers import convergence
from cutsim.solvers.convergence import Criteria, Iterate, Judge, Reason, Tolerances, table

NAN = float("nan")


def judged(iterates, criteria=convergence.CRITERIA, force=0.0, **options):
    """The judge after a solve whose iterates are given, and its reasons."""
    judge = Judge(criteria, h=1.0)
    judge.start(force, **options)
    return judge, [judge.judge(k, iterate) for k, iterate in enumerate(iterates)]


def reason(*frees, **options):
    """The last reason for the norms of residuals beside a reaction of 1."""
    return judged([Iterate(free, reaction=1.0) for free in frees], **options)[1][-1]


def test_the_judge_needs_neither_petsc_nor_dolfinx():
    tree = ast.parse(Path(convergence.__file__).read_text())
    modules = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert not any(isinstance(n, ast.Import) for n in ast.walk(tree))
    assert {m for m in modules if m.startswith("cutsim")} == {"cutsim.base.checks", "cutsim.base.signatures"}
    assert not {m.split(".")[0] for m in modules} & {"petsc4py", "mpi4py", "dolfinx"}


@pytest.mark.parametrize(("free", "expected"), [(0.9e-8, Reason.CONVERGED), (1.1e-8, Reason.GOING_ON)])
def test_the_residual_is_compared_with_the_reactions(free, expected):
    assert reason(1.0, free) is expected


def test_the_reactions_of_the_last_solve_count_while_they_are_larger():
    """A body that is unloaded has none of its own."""
    unloaded = [Iterate(1.0), Iterate(1e-7)]
    assert judged(unloaded)[1][-1] is Reason.GOING_ON
    judge, reasons = judged(unloaded, force=20.0)
    assert reasons[-1] is Reason.CONVERGED and judge.scale == 20.0 and judge.force == 0.0


def test_without_reactions_the_start_is_the_scale():
    without = [Iterate(2.0), Iterate(1e-8)]
    assert judged(without)[1][-1] is Reason.GOING_ON
    judge, reasons = judged(without, Criteria(by_start=True))
    assert reasons[-1] is Reason.CONVERGED and judge.force == 2.0


def test_forces_that_are_nothing_but_rounding_are_none():
    """1e-14 of the nodal forces that cancel: stiffness times largest displacement and cell."""
    assert judged([Iterate(2.9e-11, stiffness=1e3, size=2.0)])[1] == [Reason.CONVERGED]
    assert judged([Iterate(3.1e-11, stiffness=1e3, size=2.0)])[1] == [Reason.GOING_ON]


def test_prescribed_values_have_to_hold():
    assert judged([Iterate(0.0, reaction=1.0, size=2.0, jump=2.9e-12)])[1] == [Reason.CONVERGED]
    assert judged([Iterate(0.0, reaction=1.0, size=2.0, jump=3.1e-12)])[1] == [Reason.GOING_ON]


def test_what_ends_a_solve():
    assert reason(1.0, NAN) is Reason.NOT_FINITE
    assert reason(1.0, 0.9e6) is Reason.GOING_ON
    assert reason(1.0, 1.1e6) is Reason.GROWING
    far = Criteria(largest=5.0)
    assert judged([Iterate(1.0, size=6.0)], far)[1] == [Reason.GOING_ON], "where it starts is not its fault"
    assert judged([Iterate(1.0), Iterate(0.0, size=6.0)], far)[1][-1] is Reason.RUNAWAY


def test_a_search_that_crawls_is_given_up_if_it_is_to_be():
    crawling = [0.99**k for k in range(6)]  # 0.951 after five
    falling = [0.98**k for k in range(6)]
    assert reason(*crawling) is Reason.GOING_ON
    assert reason(*crawling, line_search="bt") is Reason.STALLED
    assert reason(*crawling, line_search="l2") is Reason.GOING_ON
    assert reason(*crawling[:5], line_search="bt") is Reason.GOING_ON
    assert reason(*falling, line_search="bt") is Reason.GOING_ON


@pytest.mark.parametrize("line_search", ["l2", "basic"])
def test_a_search_that_goes_round_in_circles_is_given_up(line_search):
    """After eight iterations in which the residual was never smaller than before; the start does not count."""
    circles = [1e-4, 10.0, 0.4, *(2.0, 0.5, 0.4) * 3]
    assert reason(*circles[:10], line_search=line_search) is Reason.GOING_ON
    assert reason(*circles[:11], line_search=line_search) is Reason.STALLED
    assert reason(*circles[:10], 0.39, line_search=line_search) is Reason.GOING_ON
    assert reason(*circles) is Reason.GOING_ON, "a path has no line search"


def test_a_start_after_a_pause_is_no_new_iterate():
    judge, iterate = Judge(convergence.CRITERIA, h=1.0), Iterate(1.0, reaction=1.0)
    for number in (0, 1, 0, 1):
        judge.judge(number, iterate)
    assert len(judge.residuals) == 3 and len(judge.history) == 2
    judge.start(0.0)
    assert judge.residuals == [] and judge.history == [] and judge.length == 1.0


# Table 4.7: squares of displacement and residual, and energy, of a step of two bonded boxes
ENERGY = [1.417000e-7, 4.278462e-9, 3.689671e-13, 4.218806e-17]
DISPLACEMENT = np.sqrt([2.387279e-14, 3.158365e-13, 2.533324e-17, 4.087037e-21])
RESIDUAL = np.sqrt([1.246976, 7.549132e-5, 6.568224e-9, 6.594945e-16])
FIRST = {"first_step": np.sqrt(4.376051e-13), "first_work": 7.086406e-7}
REQUIRED = {"energy": 7.086406e-9, "displacement": np.sqrt(1.660441e-19)}
WAY = REQUIRED["displacement"] / 1e-3
BOXES = [Iterate(np.sqrt(1.702439), reaction=1.0)] + [
    Iterate(r, reaction=1.0, step=u, way=WAY, work=-w, **FIRST)
    for r, u, w in zip(RESIDUAL, DISPLACEMENT, ENERGY, strict=True)
]


@pytest.mark.parametrize(
    ("tolerances", "iterations"),
    [
        (Tolerances(rtol=10.0), 0),
        (Tolerances(rtol=10.0, etol=1e-2), 2),
        (Tolerances(rtol=10.0, dtol=1e-3), 4),
        (Tolerances(rtol=1e-4, etol=1e-2), 3),
        (Tolerances(rtol=1e-4, dtol=1e-3, etol=1e-2), 4),
        (Tolerances(rtol=2.6e-8), 4),
    ],
)
def test_the_printed_step_ends_where_its_criteria_say(tolerances, iterations):
    _, reasons = judged(BOXES, Criteria(tolerances))
    assert reasons.index(Reason.CONVERGED) == iterations


def test_the_printed_table_comes_out():
    judge, _ = judged(BOXES, Criteria(Tolerances(rtol=1e-4, dtol=1e-3, etol=1e-2)))
    for row, energy, displacement, residual in zip(judge.history, ENERGY, DISPLACEMENT, RESIDUAL, strict=True):
        assert (row.initial.energy, row.initial.displacement) == (FIRST["first_work"], FIRST["first_step"])
        assert (row.current.energy, row.current.displacement, row.current.residual) == (energy, displacement, residual)
        assert row.required.energy == pytest.approx(REQUIRED["energy"])
        assert row.required.displacement == pytest.approx(REQUIRED["displacement"])
    lines = table(judge.history).splitlines()
    assert len(lines) == 1 + 3 * 4
    assert lines[4].split() == ["2", "energy", "7.086406e-07", "4.278462e-09", "7.086406e-09"]
    without = table(judged(BOXES)[0].history).splitlines()
    assert without[2].split() == ["displacement", "6.615173e-07", "1.545082e-07", "–"]


def test_further_criteria_never_end_a_solve_earlier():
    rng = np.random.default_rng(1)
    for _ in range(200):
        frees, steps, works = (np.cumprod(rng.uniform(1e-4, 1.0, 12)) for _ in range(3))
        iterates = [
            Iterate(r, reaction=1.0, step=s, way=1.0, work=w, first_work=1.0)
            for r, s, w in zip(frees, steps, works, strict=True)
        ]
        alone = judged(iterates)[1]
        for further in ({"dtol": 1e-3}, {"etol": 1e-6}, {"dtol": 1e-9, "etol": 1e-12}):
            together = judged(iterates, Criteria(Tolerances(**further)))[1]
            assert Reason.CONVERGED not in [b for a, b in zip(alone, together, strict=True) if a is Reason.GOING_ON]


def test_with_further_criteria_a_step_is_made_unless_there_are_no_forces():
    judge = Criteria(Tolerances(dtol=1e-3, etol=1e-2))
    at_rest = Iterate(1e-9, reaction=1.0, stiffness=1.0)
    assert judged([at_rest])[1] == [Reason.CONVERGED]
    assert judged([at_rest], judge)[1] == [Reason.GOING_ON]
    assert judged([Iterate(1e-15, reaction=1.0, stiffness=1.0)], judge)[1] == [Reason.CONVERGED]


@pytest.mark.parametrize("name", ["rtol", "dtol", "etol"])
@pytest.mark.parametrize("value", [0.0, -1.0, NAN])
def test_a_tolerance_is_positive(name, value):
    with pytest.raises(ValueError, match=f"{name} = .* must be a finite number > 0"):
        Tolerances(**{name: value})
