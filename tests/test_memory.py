"""The memory of a run: trial and committed values, snapshots, and a run that goes on in another process."""

import pickle
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from dolfinx import fem, mesh
from mpi4py import MPI

from cutsim.base.memory import Memory, Snapshot


@dataclass(frozen=True)
class Record:
    """A record of two values."""

    number: float
    values: np.ndarray


@pytest.fixture
def domain():
    return mesh.create_unit_square(MPI.COMM_SELF, 1, 1)


def test_trial_values_are_adopted_or_given_up():
    memory, shown = Memory(), []
    number = memory.value("number", 1.0, shown.append)
    number.trial = 2.0
    assert (number.trial, number.committed) == (2.0, 1.0)
    memory.rollback()
    assert (number.trial, number.committed, shown) == (1.0, 1.0, [1.0])
    number.trial = 3.0
    memory.commit()
    assert (number.trial, number.committed, shown) == (3.0, 3.0, [1.0, 3.0])


def test_functions_and_constants_show_the_trial_value(domain):
    memory = Memory()
    V = fem.functionspace(domain, ("Lagrange", 1))
    new, old = fem.Function(V), fem.Function(V)
    constants = [fem.Constant(domain, 1.0), fem.Constant(domain, np.array([1.0, 2.0]))]
    memory.array("field", new, old)
    for i, constant in enumerate(constants):
        memory.array(f"constant {i}", constant)
    new.x.array[:], constants[0].value, constants[1].value[:] = 5.0, 7.0, 8.0
    assert not old.x.array.any()
    memory.rollback()
    assert not new.x.array.any()
    assert float(constants[0]) == 1.0
    assert constants[1].value.tolist() == [1.0, 2.0]
    new.x.array[:], constants[0].value = 5.0, 7.0
    memory.commit()
    assert np.all(old.x.array == 5.0)
    new.x.array[:], constants[0].value = 6.0, 9.0
    memory.rollback()
    assert np.all(new.x.array == 5.0)
    assert float(constants[0]) == 7.0


def test_a_name_that_is_taken_is_numbered():
    memory = Memory()
    for value in (1.0, 2.0, 3.0):
        memory.value("crack", value)
    assert memory.save().values == {"crack": 1.0, "crack 2": 2.0, "crack 3": 3.0}


def test_snapshots_are_equal_by_value():
    values = {"a": Record(1.0, np.arange(3.0)), "b": (1, {"x": np.array([np.nan])})}
    assert Snapshot(values) == Snapshot({"b": (1, {"x": np.array([np.nan])}), "a": Record(1.0, np.arange(3.0))})
    for other in (
        {"a": values["a"]},
        {**values, "a": Record(1.0, np.arange(4.0))},
        {**values, "a": Record(1.0 + 1e-16 * 4, np.arange(3.0))},
        {**values, "b": (1, {"y": np.array([np.nan])})},
        {**values, "b": [1, {"x": np.array([np.nan])}]},
    ):
        assert Snapshot(values) != Snapshot(other)


def test_saved_values_wait_for_who_is_late(domain):
    """A recorder registers after the problem was restored; a problem that remembers more is another one."""
    first = Memory()
    first.value("early", 1.0)
    first.value("late", 2.0)
    second = Memory()
    second.value("early", 0.0)
    second.load(first.save())
    assert second.value("late", 0.0).committed == 2.0
    assert second.save() == first.save()
    second.value("more", 0.0)
    with pytest.raises(ValueError, match="snapshot: more of the problem are not in it"):
        second.load(first.save())


def test_a_restored_run_goes_on_bit_for_bit(tmp_path):
    """Ten steps of bodies with all that remembers, in the process that saved and in a new one."""
    script = Path(__file__).with_name("coupled_run.py")
    for what in ("save", "resume"):
        subprocess.run([sys.executable, str(script), what, str(tmp_path)], check=True, timeout=250)
    whole, resumed = (pickle.loads((tmp_path / f"{name}.pickle").read_bytes()) for name in ("whole", "resumed"))
    assert len(whole) == len(resumed) == 10
    for one, other in zip(whole, resumed, strict=True):
        assert one == other
