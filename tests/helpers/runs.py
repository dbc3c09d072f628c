"""Runs of a few steps and what is kept of them."""

import numpy as np

from cutsim.analysis.stepping import StepControl, run


def history(mechanics, until, control):
    """Run and return the columns of all accepted steps."""
    rows = []
    run(mechanics, until, control, lambda r: rows.append({"time": r.time} | {k: v for k, (v, _) in r.columns.items()}))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def final(mechanics, until=1.0, step=0.25):
    """Columns of the last row."""
    rows = []
    run(mechanics, until, StepControl.fixed(step), lambda r: rows.append(r.columns))
    return {name: value for name, (value, _) in rows[-1].items()}


LINE_SEARCHES = ("basic", "bt")
