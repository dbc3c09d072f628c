#!/usr/bin/env bash
# Set up everything cutsim needs: dolfinx 0.9 from the system, then .venv with cutsim in it.
#
#   bash scripts/setup.sh                      does nothing when .venv is up to date
#   PYTHON=/path/to/python3 bash scripts/setup.sh    use this interpreter if it imports dolfinx 0.9
#
# dolfinx comes from the first of: a Python that imports it already; apt (Debian 13, recent Ubuntu);
# the trixie suite, pinned low, on Debian 12. Elsewhere the script explains other ways and stops.
set -Eeuo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

VENV=.venv
STAMP=$VENV/.setup-stamp
# dolfinx and meshing, the C compiler its forms need, MPI, a fast BLAS, venv, off-screen pictures.
PACKAGES=(
    python3-dolfinx-real python3-petsc4py-real python3-gmsh python3-meshio python3-matplotlib python3-pytest
    gcc libc6-dev mpi-default-bin libopenblas0-pthread
    python3-venv python3-pip-whl python3-setuptools-whl
    libgl1 libegl1 libgl1-mesa-dri libxrender1
)
PROBE='
import sys
assert sys.version_info >= (3, 11), "Python is older than 3.11"
import dolfinx, ensurepip, mpi4py, numpy, petsc4py, venv
assert dolfinx.__version__.startswith("0.9."), f"its dolfinx is {dolfinx.__version__}, not 0.9"
assert dolfinx.default_scalar_type is numpy.float64, "its dolfinx is not built for real double precision"
'
step="starting"
release=()

say() { printf '[setup] %s\n' "$*"; }

die() {
    trap - ERR
    printf '[setup] FAILED while %s.\n' "$step" >&2
    printf '[setup] %s\n' "$@" >&2
    exit 1
}
trap 'die "This command did not succeed: $BASH_COMMAND" \
    "Its own message is above. Put that right and run the same command again."' ERR

begin() {
    step=$1
    say "$1 ..."
}

attended() { [[ -t 0 && -t 1 ]]; }

confirm() {
    attended || return 0
    local answer
    read -rp "[setup] Go on? [Y/n] " answer
    [[ $answer != [nN]* ]] || die "Stopped on request; nothing of this step was changed."
}

# ---------------------------------------------------------------- a Python with dolfinx 0.9
find_python() {
    local candidate reason
    for candidate in ${PYTHON:+"$PYTHON"} "$VENV/bin/python" python3 /usr/bin/python3; do
        candidate=$(command -v "$candidate") || continue
        if reason=$("$candidate" -c "$PROBE" 2>&1); then
            python=$candidate
            say "$python imports dolfinx 0.9"
            return 0
        fi
        say "$candidate cannot be used: $(tail -n 1 <<<"$reason")"
    done
    return 1
}

# ---------------------------------------------------------------- system packages
can_be_root() {
    [[ $(id -u) == 0 ]] && return 0
    command -v sudo >/dev/null || return 1
    attended || sudo -n true 2>/dev/null
}

as_root() {
    if [[ $(id -u) == 0 ]]; then "$@"; else sudo "$@"; fi
}

apt() {
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 -q "$@"
}

missing_packages() {
    local package
    for package in "${PACKAGES[@]}"; do
        [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || echo "$package"
    done
}

# Debian 12 carries dolfinx 0.5: take packages from trixie, at a priority that leaves all others alone.
use_trixie() {
    release=(-o APT::Default-Release=trixie)
    [[ $(apt-cache policy) != *n=trixie,* ]] || return 0
    local mirror name=cutsim-trixie
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' \
        'Component: main' 'Label: Debian' | head -n 1)
    say "Debian 12 has no dolfinx 0.9: the suite trixie of $mirror will be added, pinned to 100:"
    say "  /etc/apt/sources.list.d/$name.list and /etc/apt/preferences.d/$name"
    confirm
    printf 'Package: *\nPin: release n=trixie\nPin-Priority: 100\n' |
        as_root tee "/etc/apt/preferences.d/$name" >/dev/null
    echo "deb $mirror trixie main" | as_root tee "/etc/apt/sources.list.d/$name.list" >/dev/null
    apt update
}

offers_dolfinx() {
    local version
    version=$(apt-cache "${release[@]}" policy python3-dolfinx-real | awk '/Candidate:/ { print $2 }')
    say "apt offers python3-dolfinx-real ${version:-not at all}"
    [[ -n $version ]] && dpkg --compare-versions "$version" ge 1:0.9 &&
        dpkg --compare-versions "$version" lt 1:0.10~
}

install_packages() {
    local plan removed packages
    step="installing system packages"
    mapfile -t packages < <(missing_packages)
    ((${#packages[@]})) || return 0
    can_be_root || die "This needs root rights, or sudo that does not ask when there is no terminal." \
        "Or let an administrator install (on Debian 12 from the suite trixie): ${packages[*]}"
    begin "refreshing the package lists (apt-get update)"
    apt update || say "some lists could not be refreshed; going on with those there are"
    if [[ $(apt-cache policy) == *o=Debian,*n=bookworm,* ]]; then use_trixie; fi
    offers_dolfinx || explain
    step="installing system packages"
    plan=$(apt-get "${release[@]}" -s install --no-install-recommends "${packages[@]}")
    removed=$(awk '/^Remv/ { printf " %s", $2 }' <<<"$plan")
    say "apt-get will install: ${packages[*]}"
    say "  in all $(grep -c '^Inst' <<<"$plan") packages new or upgraded; removed:${removed:- none}"
    confirm
    apt "${release[@]}" -y -o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold \
        install --no-install-recommends "${packages[@]}"
}

explain() {
    step="looking for dolfinx 0.9"
    die "No Python here imports it and this system's package manager does not offer it." \
        "Either use conda-forge:" \
        "  conda create -n cutsim -c conda-forge python=3.12 fenics-dolfinx=0.9 'petsc=*=real*' \\" \
        "      python-gmsh meshio c-compiler make" \
        "  conda activate cutsim, then run the same command again" \
        "or a container with dolfinx in it:" \
        "  docker run -it --rm -v \"\$PWD\":/cutsim -w /cutsim dolfinx/dolfinx:v0.9.0 make demo" \
        "or name an interpreter that imports dolfinx 0.9: PYTHON=/path/to/python3 make demo"
}

# ---------------------------------------------------------------- the virtual environment
make_venv() {
    [[ $python != "$VENV/bin/python" ]] || return 0
    begin "making $VENV from $python, with its packages visible"
    "$python" -m venv --clear --system-site-packages "$VENV"
    # Where $python is itself a virtual environment (containers), its packages would not be seen.
    "$python" -c 'import site, sys
if sys.prefix != sys.base_prefix: print(*site.getsitepackages(), sep="\n")' >"$VENV/parent"
    mv "$VENV/parent" "$("$VENV/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/parent.pth"
}

install_cutsim() {
    begin "installing cutsim and its Python dependencies into $VENV"
    # The compiled packages beside dolfinx stay as they are.
    "$VENV/bin/python" - >"$VENV/constraints.txt" <<'PY'
from importlib.metadata import distributions
fixed = {"numpy", "scipy", "mpi4py", "petsc4py", "fenics-dolfinx"}
print(*sorted({f"{d.name}=={d.version}" for d in distributions() if d.name.lower() in fixed}), sep="\n")
PY
    local module extra=()
    for module in gmsh meshio; do
        "$VENV/bin/python" -c "import $module" 2>/dev/null || extra+=("$module")
    done
    "$VENV/bin/python" -m pip install --quiet --disable-pip-version-check -c "$VENV/constraints.txt" \
        "${extra[@]}" -e '.[dev]'
}

check() {
    begin "checking the installation"
    "$VENV/bin/python" -c 'import cutsim, dolfinx, gmsh, meshio, petsc4py, pyvista'
    command -v mpirun >/dev/null || say "NOTE: no mpirun: only one rank can be used"
    "$VENV/bin/python" - >/dev/null 2>&1 <<'PY' || say "NOTE: pyvista cannot draw off screen: no pictures"
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
assert plotter.screenshot(return_img=True).std() > 0
PY
}

fingerprint=$(cat pyproject.toml scripts/setup.sh | cksum)
if [[ -x $VENV/bin/python && -f $STAMP && $(<"$STAMP") == "$fingerprint" ]]; then
    touch "$STAMP"
    exit 0
fi
python=""
say "cutsim needs dolfinx 0.9 from the system and puts the rest into $VENV"
if ! find_python; then
    command -v apt-get >/dev/null || explain
    install_packages
    find_python || explain
elif [[ $(dpkg-query -S "$(readlink -f "$python")" 2>/dev/null) && -n $(missing_packages) ]]; then
    if can_be_root; then install_packages; else say "NOTE: recommended, not installed: $(missing_packages | xargs)"; fi
fi
make_venv
install_cutsim
check
echo "$fingerprint" >"$STAMP"
say "done"
