"""A run says whether it is to be trusted, and why not; what it cannot write it refuses on all ranks."""

import json
import shutil
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from cutsim.analysis.doubts import doubt_distortions
from cutsim.analysis.mechanics import Mechanics
from cutsim.analysis.stepping import Interrupted, StepControl, StepError, run
from cutsim.base.memory import Memory
from cutsim.base.verdict import Verdict
from cutsim.bodies.loads import Support
from cutsim.fields.points import Surface
from cutsim.interface.cohesive import Exponential
from cutsim.interface.contact import PenaltyContact, SoftenedContact
from cutsim.materials.elastic import NeoHookean
from cutsim.results.output import claim_folder, read_history
from cutsim.results.recording import Recording
from cutsim.solvers.iterations import Outcome
from cutsim.tools.shapes import Ball, Plane, ToolPath
from cutsim.tools.tool_contact import ToolContact, doubt_units
from helpers.blocks import make_blocks
from helpers.laws import NU, E

# resolved by facets of 1/8: 0.4 ε is larger
TOUGH = Exponential(toughness=0.5, opening=0.35, shear_toughness=0.5, shear_opening=0.35)


def moved(b, path, *terms, law=TOUGH, **options):
    """Blocks whose top moves along a path, their bond and further terms."""
    supports = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    supports += [Support(b.state, b.face(1, 1.0), 0), Support(b.state, b.face(1, 1.0), 1, path, name="top")]
    crack = b.crack(law, contact=options.pop("contact", None))
    return Mechanics(b.state, [b.solid(NeoHookean(E, NU), **options), crack, *terms], supports)


def plate(b, depth):
    """A plane that comes down on the top by a depth, in unit time."""
    path = ToolPath.polyline([0, 1], [(0.5, 1.01), (0.5, 1.0 - depth)])
    surface = Surface.exterior(b.state, b.face(1, 1.0))
    return ToolContact(b.state, Plane((0.0, -1.0)), path, [surface], contact=PenaltyContact(200.0, 1e-3), name="plate")


def reasons(mechanics, until=1.0, step=0.1):
    run(mechanics, until, StepControl.fixed(step))
    return " ".join(mechanics.state.verdict.reasons)


@pytest.mark.mpi
def test_a_run_that_is_resolved_is_trusted():
    mechanics = moved(make_blocks(n=8), lambda t: 0.4 * t)
    assert reasons(mechanics, step=0.05) == ""
    assert mechanics.state.verdict.trusted and str(mechanics.state.verdict) == "trusted"


@pytest.mark.mpi
def test_steps_over_which_the_force_bends_do_not_close():
    """The trapezoidal work of one step to 0.8 of a bond of 0.35 misses more than a tenth."""
    mechanics = moved(make_blocks(n=8), lambda t: 0.8 * t)
    words = reasons(mechanics, step=1.0)
    missing = abs(mechanics.audit.closure)
    assert missing > 0.1 and f"{missing:.1%} of the energy is missing" in words


@pytest.mark.mpi
def test_faces_that_penetrate_by_more_than_half_an_element():
    """A penalty of a hundredth of the body's stiffness: nearly all of the push goes into the penetration."""
    b = make_blocks(n=8)
    mechanics = moved(b, lambda t: -0.2 * t, contact=PenaltyContact(0.01 * E))
    words = reasons(mechanics)
    depth = mechanics.terms[1].penetration()
    assert depth > 1.2 and f"penetrate each other by {depth:.2g} of the mesh size" in words


@pytest.mark.mpi
@pytest.mark.parametrize("depth", [0.0, 0.05])
def test_a_tool_that_never_touches(depth):
    b = make_blocks(n=8)
    bottom = [Support(b.state, b.face(1, 0.0), i) for i in range(2)]
    mechanics = Mechanics(b.state, [b.solid(NeoHookean(E, NU)), b.crack(TOUGH), plate(b, depth or -0.005)], bottom)
    assert reasons(mechanics) == ("" if depth else "plate has never touched the body")


@pytest.mark.mpi
def test_a_viscosity_that_takes_part_in_what_is_lost():
    mechanics = moved(make_blocks(n=8), lambda t: 0.8 * t, viscosity=0.02)
    words = reasons(mechanics, step=0.02)
    share = mechanics.audit.entries["viscous"] / mechanics.audit.scale
    assert share > 0.01 and f"the viscosity takes {share:.1%} of the work that is done" in words
    calm = moved(make_blocks(n=8), lambda t: 0.8 * t, viscosity=1e-4)
    assert "viscosity" not in reasons(calm, step=0.05)


@pytest.mark.mpi
@pytest.mark.parametrize("share", [0.01, 0.04])
def test_contact_that_gives_way(share):
    """Its penalty and a column of unit height that cannot widen are springs in series."""
    modulus = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU))
    b = make_blocks(n=8)
    supports = [Support(b.state, b.face(0, side), 0) for side in (0.0, 1.0)]
    supports += [Support(b.state, b.face(1, 0.0), 1), Support(b.state, b.face(1, 1.0), 1, lambda t: -1e-3 * t)]
    faces = b.crack(None, contact=PenaltyContact(modulus * (1 / share - 1)))
    mechanics = Mechanics(b.state, [b.solid(NeoHookean(E, NU)), faces], supports)
    words = reasons(mechanics, step=0.5)
    assert mechanics.audit.entries["contact"] / mechanics.audit.scale == pytest.approx(share, rel=0.01)
    assert words == (
        "" if share < 0.02 else "contacts hold 4.0% of the work that is done, and give way: firmer ones are needed"
    )


@pytest.mark.mpi
@pytest.mark.parametrize(("clearance", "words"), [(0.0, "contacts hold 4.0% of the work"), (3e-5, "")])
def test_a_tool_with_a_clearance_gives_way_less(clearance, words):
    """The springs in series again: the tool is ahead of the surface by p/ε less the clearance."""
    modulus, travel, share = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU)), 1e-3, 0.04
    b = make_blocks(n=8)
    supports = [Support(b.state, b.face(0, side), 0) for side in (0.0, 1.0)] + [Support(b.state, b.face(1, 0.0), 1)]
    start = 1.0 + clearance - 1e-6  # pressed a little, to be held
    path = ToolPath.polyline([0, 1], [(0.5, start), (0.5, 1.0 - travel)])
    law = SoftenedContact(modulus * (1 / share - 1), 0.0, clearance)
    tool = ToolContact(b.state, Plane((0.0, -1.0)), path, [Surface.exterior(b.state, b.face(1, 1.0))], contact=law)
    body = [b.solid(NeoHookean(E, NU)), b.crack(None, contact=PenaltyContact(1e5 * modulus))]
    mechanics = Mechanics(b.state, [*body, tool], supports)
    assert reasons(mechanics, step=0.5).startswith(words) and bool(words) != mechanics.state.verdict.trusted
    pressure = (1 - share) * modulus * (travel + clearance)
    held = mechanics.audit.entries["contact"] - tool.cushion
    assert held == pytest.approx(0.5 * pressure * (pressure / law.stiffness - clearance), rel=0.02)
    assert 2 * held / mechanics.audit.scale == pytest.approx(2 * (share - clearance / (travel + clearance)), rel=0.02)


def test_an_element_that_is_almost_flat():
    b = make_blocks(n=2)
    mechanics = moved(b, lambda t: -0.93 * t, contact=PenaltyContact(1e4))
    words = reasons(mechanics, step=0.05)
    assert "body: elements that are squeezed to" in words and "smaller ones, or those of degree 2, are needed" in words
    assert mechanics.terms[0].smallest_jacobian() < 0.1


@pytest.mark.mpi
@pytest.mark.parametrize("share", [0.01, 0.04])
def test_flat_elements_count_by_the_energy_that_they_hold(share):
    """A layer of the upper block is squeezed to 0.05, the lower block sheared until the layer holds a share of W."""
    n, squeezed, shear = 8, 0.05, E / (2 * (1 + NU))
    lame = 2 * shear * NU / (1 - 2 * NU)
    layer = 0.5 * shear * (squeezed**2 - 1) - shear * np.log(squeezed) + 0.5 * lame * np.log(squeezed) ** 2
    slope = np.sqrt(layer / n * (1 / share - 1) / (0.5 * shear * 0.5))
    b = make_blocks(n=n)
    solid = b.solid(NeoHookean(E, NU))
    b.move(
        lambda x: np.stack([slope * x[1], 0 * x[1]]),
        lambda x: np.stack([0 * x[1], -(1 - squeezed) * np.maximum(x[1] - (1 - 1 / n), 0)]),
    )
    doubt_distortions(b.state.verdict, solid.distortions(), solid.energies()["strain"])
    words = "squeezed to 0.05 of their volume hold 4.0% of the work that is done"
    assert solid.smallest_jacobian() == pytest.approx(squeezed)
    assert str(b.state.verdict) == "trusted" if share < 0.02 else words in str(b.state.verdict)


@pytest.mark.parametrize(
    ("law", "young", "words"),
    [
        # megapascals for the bond, pascals for the body, and the other way round
        (Exponential(strength=0.6, toughness=0.5), 0.777e6, "are both in the same units"),
        (Exponential(strength=0.6e6, toughness=0.5e6), 0.777, "are both in the same units"),
        # J/m² taken for N/mm
        (Exponential(strength=0.6, toughness=200.0), 0.777, "more than the whole body"),
        (Exponential(strength=0.6, toughness=0.01), 0.777, "do not resolve the process zone"),
        (TOUGH, E, ""),
    ],
)
def test_numbers_that_do_not_go_together(law, young, words):
    b = make_blocks(n=8)
    b.crack(law, young=young)
    assert words in " ".join(b.state.verdict.reasons) and bool(words) != b.state.verdict.trusted


def test_a_tool_of_another_size_than_the_body():
    verdict = Verdict(Memory())
    doubt_units(verdict, "ball", Ball(0.2), body=2.0)
    assert verdict.trusted
    doubt_units(verdict, "ball", Ball(5.0), body=2.0)
    assert "larger than the whole body" in str(verdict)


def test_the_worst_is_kept_and_said_once(caplog):
    verdict = Verdict(Memory())
    for size in (1.0, 3.0, 2.0):
        verdict.doubt("closure", f"{size} missing", size)
    assert verdict.reasons == ("3.0 missing",) and [r.message for r in caplog.records] == ["1.0 missing"]
    assert verdict.record() == {"verdict": "questionable", "reasons": ["3.0 missing"], "kinds": ["closure"]}


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


@pytest.mark.mpi
def test_the_summary_has_the_verdict(tmp_path, capsys):
    """On the disk after the last step; headline numbers are added to it."""
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path)
    mechanics = moved(make_blocks(n=8), lambda t: 0.8 * t)
    with Recording(folder, mechanics, 1.0, title="pull", every=0) as recording:
        run(mechanics, 1.0, StepControl.fixed(1.0), recording)
    recording.summary({"force": 2.5})
    comm.barrier()
    found, line = summary(folder), f"pull: {mechanics.state.verdict}\n"
    size = {"unknowns": mechanics.state.unknowns, "time": 1.0, "until": 1.0}
    assert found == {**mechanics.state.verdict.record(), **size, "force": 2.5}
    assert found["verdict"] == "questionable" and len(found["reasons"]) == 1
    assert (line in capsys.readouterr().out) == (comm.rank == 0)


@pytest.mark.mpi
@pytest.mark.parametrize("error", [StepError, Interrupted, RuntimeError])
def test_a_run_that_ends_early_is_marked(tmp_path, error):
    """In every way in which it can end, also where one rank alone fails in a recorder."""
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path)
    mechanics = moved(make_blocks(n=2), lambda t: 0.1 * t)

    def record(report):
        recording(report)
        if report.number == 1 and error is Interrupted:
            signal.raise_signal(signal.SIGINT)  # asked for after the next step
        if report.number == 2:
            if error is RuntimeError:
                raise error("no more")
            if error is StepError:
                mechanics.solve = lambda line_search=None: Outcome(False, -1, "", 1, 0, ())

    with pytest.raises(error), Recording(folder, mechanics, 1.0, every=0) as recording:
        run(mechanics, 1.0, StepControl.fixed(0.25), record)
    comm.barrier()
    found = summary(folder)
    assert (found["verdict"], found["time"]) == ("questionable", 0.5)
    words = {StepError: "no step succeeds from time 0.5 on", Interrupted: "interrupted at time 0.5 of 1",
             RuntimeError: "ended at time 0.5 of 1 by RuntimeError('no more')"}[error]  # fmt: skip
    assert words in found["reasons"]


@pytest.mark.mpi
def test_an_older_run_is_not_written_over(tmp_path):
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path)
    mechanics = moved(make_blocks(n=2), lambda t: 0.1 * t)
    with Recording(folder / "a", mechanics, 1.0, every=0) as recording:
        run(mechanics, 0.5, StepControl.fixed(0.5), recording)
    for refuse in (lambda: Recording(folder / "a", mechanics, 1.0), lambda: claim_folder(folder, comm)):
        with pytest.raises(FileExistsError, match=r"history\.csv is of an older run"):
            refuse()
    assert read_history(folder / "a" / "history.csv")["time"] == [0.5]
    comm.barrier()
    with Recording(folder / "a", mechanics, 1.0, every=0, overwrite=True) as recording:
        run(mechanics, 1.0, StepControl.fixed(0.5), recording)
    assert read_history(folder / "a" / "history.csv")["time"] == [1.0]
    comm.barrier()
    claim_folder(folder, comm, overwrite=True)
    comm.barrier()
    assert not (folder / "a" / "summary.json").exists()


@pytest.mark.mpi
def test_a_full_disk_is_refused_on_all_ranks(tmp_path, monkeypatch):
    """Before ADIOS2 meets it; the history keeps its rows, and the summary says what happened."""
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path)
    mechanics = moved(make_blocks(n=2), lambda t: 0.1 * t)

    def record(report):
        if report.number == 2 and comm.rank == 0:
            monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=1000))
        recording(report)

    with (
        pytest.raises(OSError, match="no space for the fields"),
        Recording(folder, mechanics, 1.0, every=1) as recording,
    ):
        run(mechanics, 1.0, StepControl.fixed(0.25), record)
    comm.barrier()
    np.testing.assert_allclose(read_history(folder / "history.csv")["time"], [0.25, 0.5])
    assert "no space" in summary(folder)["reasons"][-1]
