"""Write docs/api.md from the docstrings: python docs/make_api.py (or make api).

The page lists what scripts use, by what they want to do: signatures and one line each. The built site has all modules
with their whole docstrings as well; `reference_pages` writes the sources of those pages, which are not kept.
"""

import importlib
import inspect
import pkgutil
from pathlib import Path

import cutsim

HERE = Path(__file__).parent
HEAD = """# API

Signatures and one line each of what scripts use, grouped by what you want to do. Names without a module are
imported from `cutsim` itself: `from cutsim import Blade`. The built site (`make docs`) has the whole docstrings, with
units, shapes, signs and errors, of these names and of all modules. Section numbers in them are those of the page on
[theory](theory.md).

*This page is written by `make api` from the docstrings. Do not edit it.*
"""
#: Heading → packages whose names in `cutsim` belong there, and modules of which all public names do.
GROUPS = {
    "Read or make a mesh and crack it": ("fields",),
    "Choose a material": ("materials",),
    "Make bodies, hold and load them": ("bodies",),
    "Give a crack its law": ("interface",),
    "Push a rigid tool": ("tools",),
    "Let surfaces with different meshes touch": ("pairs",),
    "Add heat": ("heat",),
    "Solve, step by step": ("solvers", "analysis"),
    "Record, read and plot results": ("results", "cutsim.results"),
    "Start from a ready-made problem": ("studies", "cutsim.studies"),
    "Find parameters from measurements": ("identify", "cutsim.identify"),
    "Read and run case files": ("cases", "cutsim.cases"),
    "Write a term of your own": ("base", "cutsim.base.terms", "cutsim.base.borders"),
}


def modules(package):
    """Names of a package and of its modules."""
    found = importlib.import_module(package)
    return [package, *(f"{package}.{m.name}" for m in pkgutil.iter_modules(getattr(found, "__path__", [])))]


def doors(package):
    """Modules from which scripts import: the package alone where it says what it holds."""
    return [package] if hasattr(importlib.import_module(package), "__all__") else modules(package)


def public(module):
    """Public classes and functions that a module defines, in the order of its text."""
    own = [n for n, o in vars(module).items() if getattr(o, "__module__", "") == module.__name__]
    names = getattr(module, "__all__", [n for n in own if not n.startswith("_")])
    return [n for n in names if inspect.isclass(getattr(module, n)) or inspect.isfunction(getattr(module, n))]


def default(value):
    """A default value in short."""
    plain = isinstance(value, (str, int, float, type(None))) or value == ()
    return repr(value) if plain else "…"


def signature(thing, bound=False):
    """Parameters with their defaults, without annotations; those of a method without its first one."""
    try:
        parameters = list(inspect.signature(thing).parameters.values())[bound:]
    except (TypeError, ValueError):  # a protocol, an enumeration
        return ""
    words, star = [], False
    for p in parameters:
        if p.kind is p.KEYWORD_ONLY and not star:
            words.append("*")
        star = star or p.kind in (p.KEYWORD_ONLY, p.VAR_POSITIONAL)
        prefix = {p.VAR_POSITIONAL: "*", p.VAR_KEYWORD: "**"}.get(p.kind, "")
        words.append(f"{prefix}{p.name}" + ("" if p.default is p.empty else f"={default(p.default)}"))
    return f"({', '.join(words)})"


def line(thing):
    """First line of a docstring."""
    return (inspect.getdoc(thing) or "").split("\n")[0]


def is_protocol(thing):
    """Whether something is a protocol or the term that others derive from."""
    return getattr(thing, "_is_protocol", False) or thing.__module__ in GROUPS["Write a term of your own"]


def inherited_promises():
    """Members that a protocol describes: they are listed there and not again at each class that keeps the promise."""
    found = set()
    for name in modules_of_all():
        module = importlib.import_module(name)
        found |= {
            m for n in public(module) if inspect.isclass(c := getattr(module, n)) and is_protocol(c) for m in vars(c)
        }
    return found


def modules_of_all():
    """Names of all modules, package by package."""
    packages = [m.name for m in pkgutil.iter_modules(cutsim.__path__) if m.ispkg]
    return [name for package in packages for name in modules(f"cutsim.{package}")]


def entry(thing, promises):
    """A name with its signature and line, and what its instances can do."""
    read = hasattr(thing, "model_fields")  # what files give and scripts do not make
    kind = "" if read or is_protocol(thing) else signature(thing)
    lines = [f"- `{thing.__name__}{kind}`: {line(thing)}"]
    if inspect.isclass(thing):
        for name, member in vars(thing).items():
            if name.startswith(("_", "model_")) or (name in promises and not is_protocol(thing)):
                continue
            function = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
            if isinstance(function, property):
                lines.append(f"  - `.{name}`: {line(function)}")
            elif inspect.isfunction(function):
                bound = not isinstance(member, staticmethod)
                lines.append(f"  - `.{name}{signature(function, bound)}`: {line(function)}")
    return lines


def page():
    """Text of docs/api.md."""
    promises = inherited_promises()
    top = [getattr(cutsim, name) for name in cutsim.__all__]
    missing = {t.__module__.split(".")[1] for t in top} - {package for group in GROUPS.values() for package in group}
    if missing:
        raise ValueError(f"no group of GROUPS has the packages {', '.join(sorted(missing))}")
    lines = [HEAD]
    for title, parts in GROUPS.items():
        chosen = [t for t in top if t.__module__.split(".")[1] in parts]
        rest = []
        for name in (m for part in parts if part.startswith("cutsim.") for m in doors(part)):
            module = importlib.import_module(name)
            things = [getattr(module, n) for n in public(module) if getattr(module, n) not in top]
            if things:
                rest += ["", f"In `{name}`:", "", *(row for thing in things for row in entry(thing, promises))]
        if chosen or rest:
            order = sorted(chosen, key=lambda t: (t.__module__, inspect.getsourcelines(t)[1]))
            lines += [f"## {title}", "", *(row for thing in order for row in entry(thing, promises)), *rest, ""]
    return "\n".join(lines).replace("\n\n\n", "\n\n")


def reference_pages():
    """Write docs/reference/<package>.md, from which Sphinx makes the pages with all docstrings."""
    folder = HERE / "reference"
    folder.mkdir(exist_ok=True)
    packages = [m.name for m in pkgutil.iter_modules(cutsim.__path__) if m.ispkg]
    for old in {path for path in folder.glob("*.md") if path.stem not in packages}:
        old.unlink()
    for package in packages:
        names = modules(f"cutsim.{package}")
        lines = [f"# cutsim.{package}", "", importlib.import_module(names[0]).__doc__ or "", ""]
        for name in names[1:]:
            lines += [f"## {name}", "", "```{eval-rst}", f".. automodule:: {name}", "```", ""]
        path, text = folder / f"{package}.md", "\n".join(lines)
        if not path.exists() or path.read_text(encoding="utf-8") != text:  # Sphinx reads anew what is newer
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    (HERE / "api.md").write_text(page(), encoding="utf-8")
