# Sourced by setup.sh and dist.sh, which set $task: messages, and the search for a Python to build upon.
# shellcheck shell=bash disable=SC2034,SC2154 # shared variables

# With an empty HOME caches would lie below /: take the account's.
[[ ${HOME:-} ]] || { unset HOME && export HOME=~; }
# Interpreters are called from elsewhere, so a path to one has to be whole.
[[ ${PYTHON:-} != */* || $PYTHON == /* ]] || PYTHON=$PWD/$PYTHON

step="starting"
python=""
refused=()

say() { printf '[%s] %s\n' "$task" "$*"; }

begin() {
    step=$1
    say "$1 ..."
}

die() {
    trap - ERR
    printf '[%s] FAILED while %s.\n' "$task" "$step" >&2
    printf "[$task] %s\n" "$@" >&2
    exit 1
}
trap 'die "This command did not succeed: $BASH_COMMAND" \
    "Its own message is above. Next: put that right, then: make $task"' ERR

# dolfinx is there. MPI comes first: the dolfinx of the wheel needs it loaded.
HAS_DOLFINX='
import importlib.util, sys
assert sys.version_info >= (3, 11), f"it is Python {sys.version.split()[0]}, older than 3.11"
assert importlib.util.find_spec("dolfinx"), "it has no dolfinx"
assert not importlib.util.find_spec("dolfinx_solver"), "its dolfinx is the wheel, which works in its own .venv only"
from mpi4py import MPI
import dolfinx, numpy, petsc4py
assert dolfinx.__version__.startswith(("0.9.", "0.10.", "0.11.")), f"its dolfinx is {dolfinx.__version__}"
assert dolfinx.default_scalar_type is numpy.float64, "its dolfinx is not built for real double precision"
print(sys.executable, f"dolfinx {dolfinx.__version__}", sep="\n")
'
# The wheel of dolfinx is made for this Python.
TAKES_WHEEL='
import sys, sysconfig
assert sys.version_info >= (3, 12), f"it is Python {sys.version.split()[0]}, older than 3.12"
assert sys.implementation.name == "cpython" and sys.maxsize > 2**32, "it is not a 64-bit CPython"
assert not sysconfig.get_config_var("Py_GIL_DISABLED"), "it is a free-threaded build"
print(sys.executable, f"Python {sys.version.split()[0]}", sep="\n")
'
# Virtual environments can be made. Debian has what it takes in packages of their own, which apt may leave
# at a version too old for a newer Python.
MAKES_VENV='
import ensurepip, sys, venv
pip = ensurepip.version()
assert sys.version_info < (3, 12) or tuple(map(int, pip.split(".")[:2])) >= (23, 2), f"its pip is {pip}"
'

# In / no module of the folder at hand is imported by mistake.
ask() { (cd / && "$1" -c "$2" 2>&1); }

# The first of the interpreters on standard input that passes a test -> python, its version -> found.
first_that() {
    local test=$1 candidate answer
    while read -r candidate; do
        [[ $candidate ]] || continue
        if answer=$(ask "$candidate" "$test"); then
            { read -r python && read -r found; } < <(tail -n 2 <<<"$answer")
            return 0
        fi
        refused+=("$candidate: $(tail -n 1 <<<"$answer" | sed -E 's/^(AssertionError|[^ ]+: line [0-9]+): //')")
    done
    return 1
}

# All on the PATH, as the first may be a shim of pyenv that leads nowhere.
on_path() { type -aP "$1" || true; }

# PYTHON where it is given, else what a command finds.
candidates() {
    if [[ ${PYTHON:-} ]]; then
        type -P "$PYTHON" || echo "$PYTHON"
    else
        "$@" | awk '!seen[$0]++'
    fi
}

find_system_python() { first_that "$HAS_DOLFINX" < <(candidates system_pythons); }

system_pythons() { on_path python3 && echo /usr/bin/python3; }

# The tested version first.
newer_pythons() {
    local version root
    for version in 3.13 3.14 3.12; do
        on_path "python$version"
        # pyenv may be on the PATH although it is not in this HOME.
        for root in "${PYENV_ROOT:-}" "${HOME:-}/.pyenv" "$(dirname "$(dirname "$(type -P pyenv)")")"; do
            compgen -G "$root/versions/$version.*/bin/python" | sort -rV || true
        done
        if type -P uv >/dev/null; then uv python find --system --no-python-downloads "$version" || true; fi
    done 2>/dev/null
    on_path python3
}

# PyPI has it for Linux on x86-64 with glibc 2.34 or later.
wheel_fits_machine() {
    local libc
    libc=$(getconf GNU_LIBC_VERSION 2>/dev/null) || libc="no glibc"
    if [[ $(uname -sm) != "Linux x86_64" || $(printf 'glibc 2.34\n%s\n' "$libc" | sort -V | head -n 1) != "glibc 2.34" ]]; then
        refused+=("The wheel of dolfinx is for Linux x86_64 with glibc 2.34 or later; this is $(uname -sm), $libc")
        return 1
    fi
}

find_wheel_python() {
    local all
    wheel_fits_machine || return 1
    all=$(candidates newer_pythons)
    first_that "$TAKES_WHEEL$MAKES_VENV" <<<"$all" || first_that "$TAKES_WHEEL" <<<"$all"
}
