"""Steps of a FEBio analysis: duration, time steps, statics or dynamics."""

from typing import Any

from cutsim.cases.importing.draft import Draft
from cutsim.cases.importing.febio_file import FebioFile, children
from cutsim.readers.xml_tree import LinedElement

_STATIC, _DYNAMIC = ("static", "", "0"), ("dynamic", "1")
#: Settings of FEBio's solver and of its output, which ours do without.
_NUMERICS = (
    "solver", "title", "plot_zero_state", "plot_range", "plot_level", "output_level", "plot_stride", "output_stride",
    "adaptor_re_solve", "max_refs", "max_ups", "dtol", "etol", "rtol", "ptol", "lstol", "lsmin", "lsiter",
    "min_residual", "max_residual", "diverge_reform", "reform_each_time_step", "reform_augment", "qnmethod",
    "qn_method", "optimize_bw", "linear_solver", "symmetric_stiffness", "logSolve", "print_level", "integration",
    "cmax", "use_three_field_hex8",
)  # fmt: skip


def translate_steps(file: FebioFile, draft: Draft) -> None:
    """Translate the controls of all steps; sets the end of the run in the file."""
    controls = [
        child for section in (file.root, *file.steps()) for child in children(section) if child.tag == "Control"
    ]
    for control in controls:
        file.read(control)
    steps = [_step(file, control) for control in controls]
    kinds = [_analysis(file, control, draft) for control in controls] or [{"type": "quasi-static"}]
    if not controls:
        draft.difference(file.root.line, "the file has no <Control>: the run ends at time 1")
    if any(kind != kinds[0] for kind in kinds):
        draft.untranslated(controls[-1].line, "<Control>: steps of other kinds of analysis than that of the first one")
    file.end = float(f"{sum(duration for _, duration in steps):.12g}") or 1.0
    draft.set("analysis", {**kinds[0], "until": file.end})
    draft.set("steps", _smallest([sizes for sizes, _ in steps]))
    for control in controls:
        for tag in _NUMERICS:
            if (setting := file.child(control, tag)) is not None:
                file.read_all(setting)


def _smallest(steps: list[dict[str, float]]) -> dict[str, float]:
    """Sizes of steps for the whole analysis: the smallest ones of all."""
    if not steps:
        return {"first": 0.1, "largest": 0.1}
    if all("fixed" in sizes for sizes in steps):
        return {"fixed": min(sizes["fixed"] for sizes in steps)}
    first = [sizes.get("first", sizes.get("fixed", 0.0)) for sizes in steps]
    largest = [sizes.get("largest", sizes.get("fixed", 0.0)) for sizes in steps]
    return {"first": min(*first, *largest), "largest": min(largest)}


def _step(file: FebioFile, control: LinedElement) -> tuple[dict[str, float], float]:
    """How a case file says the time steps of a control, and its duration."""
    size = file.number(control, "step_size", 1.0)
    duration = size * file.number(control, "time_steps", 1.0)
    stepper = file.child(control, "time_stepper")
    if stepper is None:
        return {"fixed": size}, duration
    file.read_all(stepper)
    limit = next((child for child in children(stepper) if child.tag == "dtmax"), None)
    largest = size
    if limit is not None:
        curve = file.curve(limit)
        largest = float(limit.text or 0) if curve is None else float(curve.values.max())
    largest = min(largest, duration) if largest > 0 else size
    return {"first": min(size, largest), "largest": largest}, duration


def _analysis(file: FebioFile, control: LinedElement, draft: Draft) -> dict[str, Any]:
    """Kind of analysis, and its scheme."""
    kind = file.child(control, "analysis")
    word = "" if kind is None else (kind.get("type") or kind.text or "").strip().lower()
    if word in _STATIC:
        return {"type": "quasi-static"}
    if word not in _DYNAMIC:
        draft.untranslated(control.line, f"<Control>: analysis {word!r} is taken to be static")
        return {"type": "quasi-static"}
    solver = next((child for child in children(control) if child.tag == "solver"), control)
    rho = file.number(solver, "rhoi", -2.0)
    for tag in ("rhoi", "alpha"):
        file.child(control, tag)
    if 0 <= rho <= 1:
        return {"type": "dynamic", "scheme": {"model": "generalised-alpha", "rho_inf": rho}}
    beta, gamma = file.number(solver, "beta", 0.25), file.number(solver, "gamma", 0.5)
    return {"type": "dynamic", "scheme": {"model": "newmark", "beta": beta, "gamma": gamma}}
