#!/usr/bin/env bash
# Build sdist and wheel into dist/, install the wheel with the dolfinx of PyPI into an empty environment
# elsewhere, and cut with it from there.
set -Eeuo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

task=dist
# shellcheck source=scripts/python.sh
source scripts/python.sh

step="looking for a Python that takes the wheel of dolfinx"
find_wheel_python || die "${refused[@]}" "None here is 3.12 or later." \
    "Next: uv python install 3.13, or PYTHON=/path/to/python3 make dist"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

begin "building dist/ with $python ($found)"
rm -rf dist
"$python" -m venv "$scratch/build"
"$scratch/build/bin/python" -m pip install --quiet --disable-pip-version-check build
"$scratch/build/bin/python" -m build --outdir dist &>"$scratch/log" || die "$(tail -n 20 "$scratch/log")" "Next: make dist"

begin "installing the wheel into an empty environment in $scratch"
"$python" -m venv "$scratch/use"
wheel=$(echo "$PWD"/dist/*.whl)
"$scratch/use/bin/python" -m pip install --quiet --disable-pip-version-check "${wheel}[dolfinx]"

begin "cutting with it"
cp scripts/cut_installed.py "$scratch"
(cd "$scratch" && OMP_NUM_THREADS=1 use/bin/python cut_installed.py)
say "done: $(cd dist && echo *)"
