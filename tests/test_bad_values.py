"""Every parameter of everything public refuses what it cannot be, by its name and before anything is assembled."""

import inspect
import re
from dataclasses import fields, replace
from typing import get_args

import numpy as np
import pytest
from dolfinx import jit

import cutsim
import cutsim.identify
from helpers.arguments import arguments, hints, kinds
from helpers.examples import instances

INF = float("inf")

#: Made by others, not from numbers of a user.
MADE = {"CrackedBody", "Insertion", "LayeredBlock", "StepReport"}
#: A picture is never worth a run: what cannot be drawn is logged.
DRAWN = {"draw_body"}
#: Where infinity says that there is no limit.
ENDLESS = {("run", "until")}
#: What takes files and curves, beside what is in `cutsim` itself.
FILES_AND_CURVES = ("StressTest", "fit_material", "fit_simulation", "read_table")
#: Functions that are called during the run only.
LATER = {
    ("Recording", "extra"),
    ("ToolPath", "position"),
    ("ToolPath", "rotation"),
    ("run", "record"),
    ("run", "stop"),
    ("identify.fit_simulation", "simulate"),
}
#: Handed to dolfinx as they are.
FREE = {("cracked_space", "element"), ("draw_insertion", "view"), ("draw_stress", "view")}


def callables():
    """Everything public that can be called: functions, classes and their class methods, by name."""
    found = {}
    for name in cutsim.__all__:
        item = getattr(cutsim, name)
        error = inspect.isclass(item) and issubclass(item, Exception)
        if name not in MADE | DRAWN and not error and not getattr(item, "_is_protocol", False):
            found[name] = item
        if inspect.isclass(item):
            methods = (n for c in item.__mro__ for n, m in vars(c).items() if isinstance(m, classmethod))
            found |= {f"{name}.{n}": getattr(item, n) for n in methods if not n.startswith("_")}
    return found | {f"identify.{n}": getattr(cutsim.identify, n) for n in FILES_AND_CURVES}


def bad_values(where, hint):
    """Values that a parameter cannot have, by its annotation."""
    allowed = kinds(hint)
    if "_NestedSequence" in str(hint):  # numpy's ArrayLike, which newer versions do not spell out
        allowed = [k for k in allowed if "numpy" not in str(k) and k not in (bool, int, float, complex, str, bytes)]
    values = {"text": "text", "list": [], "complex": 1j, "object": object(), "nan": float("nan"), "-inf": -INF}
    if where not in ENDLESS:
        values["inf"] = INF
    if type(None) not in allowed:
        values["None"] = None
    if str in allowed:
        del values["text"]
    entries = [k for k in allowed if getattr(k, "__origin__", None) in (tuple,) or "Sequence" in str(k)]
    if entries:
        values |= {"nested": [[]], "texts": ("x", "x"), "nans": (float("nan"), 1.0), "infs": (INF, 1.0)}
        if any(str in get_args(k) for k in entries):
            del values["texts"]
        values |= {"Nones": (None, None)} | ({} if float in allowed else {"numbers": 1.0})
        if where[1] == "corners" or not any(part in (float, int) for k in entries for part in get_args(k)):
            del values["list"]  # there may be none
    if any("Callable" in str(k) for k in allowed) and where not in LATER:
        values |= {"function to text": lambda t: "x", "function to nan": lambda t: np.nan}
    arrays = [str(k) for k in allowed if "ndarray" in str(k).lower()]  # as older and newer numpy write it
    if arrays:
        values |= {"ragged": [[1], [1, 2]]} | ({"fractions": np.array([0.5])} if "int32" in str(arrays) else {})
        values.pop("list", None)
    return values


CASES = [
    # on several ranks one parameter of each is enough: all go the same way
    pytest.param(name, parameter, id=f"{name}({parameter})", marks=[pytest.mark.mpi] * (number == 0))
    for name, item in callables().items()
    for number, parameter in enumerate(p for p in inspect.signature(item).parameters if (name, p) not in FREE)
]


@pytest.mark.parametrize("name, parameter", CASES)
def test_bad_values_are_refused_by_name(name, parameter, monkeypatch):
    """What is no number, not finite or of another kind is refused by the name it has in the signature, uncompiled."""
    item = callables()[name]
    good = arguments(name, item)  # first, since the world has to be compiled

    def compiled(*args, **kwargs):
        raise AssertionError("compiled before it was refused")

    monkeypatch.setattr(jit, "ffcx_jit", compiled)
    wrong = []
    for label, value in bad_values((name, parameter), hints(item)[parameter]).items():
        try:
            item(**good | {parameter: value})
            wrong.append(f"{label}: accepted")
        except (ValueError, TypeError) as error:
            if not re.match(rf"(shape of |indices of )?{parameter}\b", str(error)):
                wrong.append(f"{label}: {type(error).__name__}: {error}")
        except Exception as error:
            wrong.append(f"{label}: {type(error).__name__}: {error}")
    assert not wrong, "\n".join(wrong)


EXTREMES = [
    (name, f.name)
    for name, example in instances().items()
    for f in fields(example)
    if f.init and isinstance(getattr(example, f.name), float)
]


@pytest.mark.parametrize(("name", "parameter"), EXTREMES)
def test_numbers_far_out_of_range_are_refused_by_name(name, parameter):
    """No parameter of a law, tool, material or step control may be as low as −1000."""
    with pytest.raises(ValueError, match=rf"^{parameter}\b.* is not allowed"):
        replace(instances()[name], **{parameter: -1000.0})
