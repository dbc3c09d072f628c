#!/usr/bin/env bash
# Set up everything cutsim needs: a dolfinx of version 0.9, 0.10 or 0.11, and .venv with cutsim in it.
#
#   bash scripts/setup.sh                            does nothing when .venv is up to date
#   PYTHON=/path/to/python3 bash scripts/setup.sh    from this interpreter
#   DOLFINX=wheel|system bash scripts/setup.sh       with dolfinx from PyPI, or from the system
#
# dolfinx comes from the first of: a Python that imports it already; its wheel, for any Python from 3.12
# on; apt (Debian 13, recent Ubuntu); its wheel with a Python from uv, from apt, or on Debian 12 from the
# suite trixie, pinned low. Elsewhere the script explains other ways and stops.
set -Eeuo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

task=setup
refreshed=""
VENV=.venv
STAMP=$VENV/.setup-stamp
# A .venv that is active is what to make, not what to make it from.
PATH=$(tr : '\n' <<<"$PATH" | grep -vxF "$PWD/$VENV/bin" | paste -sd :)
# shellcheck source=scripts/python.sh
source scripts/python.sh

PICTURE_PACKAGES=(libegl1 libgl1-mesa-dri) # those draw off screen
# What cutsim takes from Debian beside dolfinx: meshing, the C compiler that forms need, MPI, a fast BLAS,
# virtual environments, pictures. apt is given the list as a whole, so that versions fit each other.
SYSTEM_PACKAGES=(
    python3-dolfinx-real python3-petsc4py-real python3-gmsh python3-meshio python3-matplotlib python3-pytest
    gcc libc6-dev mpi-default-bin libopenblas0-pthread
    python3-venv python3-pip-whl python3-setuptools-whl
    "${PICTURE_PACKAGES[@]}"
)
# The shared libraries that the wheel of gmsh needs, and what has them, and those for pictures off screen.
LIBRARIES=(
    libGLU.so.1 libGL.so.1 libXrender.so.1 libXcursor.so.1 libXfixes.so.3 libXext.so.6 libXft.so.2
    libfontconfig.so.1 libXinerama.so.1 libX11.so.6 libgomp.so.1
)
LIBRARY_PACKAGES=(
    libglu1-mesa libgl1 libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 libfontconfig1 libxinerama1 libx11-6 libgomp1
)
FEDORA_PACKAGES=(
    gcc python3-devel mesa-libGLU libglvnd-glx libglvnd-egl mesa-dri-drivers libXrender libXcursor libXfixes
    libXext libXft fontconfig libXinerama libX11 libgomp
)
COMPILES='
import os, shlex, subprocess, sysconfig, tempfile
compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC"))
with tempfile.TemporaryDirectory() as folder:
    arguments = ["-I", sysconfig.get_path("include"), "-shared", "-fPIC", "-x", "c", "-", "-o", folder + "/probe.so"]
    subprocess.run([*compiler, *arguments], input=b"#include <Python.h>", check=True)
'
LOADS_LIBRARIES="
import ctypes
for name in '${LIBRARIES[*]}'.split():
    ctypes.CDLL(name)
"

attended() { [[ -t 0 && -t 1 ]]; }

confirm() {
    attended || return 0
    local answer
    read -rp "[setup] Go on? [Y/n] " answer
    [[ $answer != [nN]* ]] || die "Stopped on request; nothing of this step was changed." \
        "Next, with a Python of your own: PYTHON=/path/to/python3 make setup"
}

# ---------------------------------------------------------------- the .venv there is
stamped() { sed -n "s/^$1=//p" "$STAMP" 2>/dev/null; }

# The stamp is written last: without it, or elsewhere, or with its Python gone, .venv is half made.
venv_is_whole() {
    [[ $(stamped place) == "$PWD" ]] && ask "$PWD/$VENV/bin/python" '
import importlib.util, sys
sys.exit(not all(map(importlib.util.find_spec, ("cutsim", "dolfinx", "pyvista"))))' >/dev/null
}

venv_is_wanted() {
    [[ -z ${DOLFINX:-} || $DOLFINX == "$(stamped way)" ]] || return 1
    [[ -z ${PYTHON:-} || $PYTHON -ef $VENV/bin/python && $PYTHON == *$VENV/bin/* ]] ||
        [[ $(ask "$PYTHON" 'import sys; print(sys.executable)') == "$(stamped python)" ]]
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

refresh() {
    [[ -z $refreshed ]] && can_be_root || return 0
    refreshed=yes
    begin "refreshing the package lists (apt-get update)"
    apt update >/dev/null || say "some lists could not be refreshed; going on with those there are"
}

# install PURPOSE RELEASE PACKAGES...: RELEASE is a suite to prefer, or empty.
install() {
    local plan purpose=$1 release=${2:+-o APT::Default-Release=$2}
    shift 2
    step="installing $purpose"
    can_be_root || die "This needs root rights, or sudo that does not ask when there is no terminal." \
        "Next: let an administrator run" \
        "  apt-get update && apt-get install --no-install-recommends $*" "then: make setup"
    # shellcheck disable=SC2086 # an empty release is no argument
    plan=$(apt-get $release -s install --no-install-recommends "$@") || die \
        "apt-get finds no way to install $*; its own message is above." "Next: apt-get update, then: make setup"
    say "apt-get will install $purpose: $*"
    awk '/^Inst/ { if ($3 ~ /^\[/) upgraded++; else added++ }
        /^Remv/ { removed = removed " " $2 }
        END { printf "[setup]   in all %d packages new, %d upgraded; removed:%s. This may take some minutes.\n",
            added, upgraded, removed ? removed : " none" }' <<<"$plan"
    confirm
    # Its errors are shown, not the names of what it unpacks.
    # shellcheck disable=SC2086
    apt $release -y -o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold \
        install --no-install-recommends "$@" >/dev/null || die "apt-get did not succeed; its own message is above." \
        "Next: put that right (apt-get --fix-broken install, where an installation was cut short), then: make setup"
}

offers() {
    local version
    version=$(apt-cache policy "$1" | awk '/Candidate:/ { print $2 }')
    [[ ${version:=none} != *none* ]] && dpkg --compare-versions "$version" ge "$2" &&
        dpkg --compare-versions "$version" lt "$3" && return
    refused+=("apt offers $1 $version")
    return 1
}

on_bookworm() { [[ $(apt-cache policy) == *o=Debian,*n=bookworm,* ]]; }

# Debian 12 has Python 3.11: take 3.13 from trixie, at a priority that leaves all other packages alone.
add_trixie() {
    [[ $(apt-cache policy) != *n=trixie,* ]] || return 0
    local mirror name=cutsim-trixie
    # shellcheck disable=SC2016 # a format of apt's
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' \
        'Component: main' 'Label: Debian' | head -n 1)
    say "The suite trixie of $mirror will be added, pinned to 100:"
    say "  /etc/apt/sources.list.d/$name.list and /etc/apt/preferences.d/$name"
    confirm
    printf 'Package: *\nPin: release n=trixie\nPin-Priority: 100\n' |
        as_root tee "/etc/apt/preferences.d/$name" >/dev/null
    echo "deb $mirror trixie main" | as_root tee "/etc/apt/sources.list.d/$name.list" >/dev/null
    apt update >/dev/null
}

# python3.N with what Debian splits off from it.
python_packages() { echo "$1 $1-venv lib$1-dev python3-pip-whl python3-setuptools-whl"; }

# ---------------------------------------------------------------- where dolfinx comes from
choose() {
    step="looking for dolfinx"
    if [[ ${DOLFINX:-} != wheel ]] && find_system_python; then
        way=system
    elif [[ ${DOLFINX:-} != system ]] && find_wheel_python; then
        way=wheel
    else
        [[ -z ${PYTHON:-} ]] || explain
        provide_python || explain
    fi
}

# No Python that will do is here: get one, with dolfinx or for its wheel.
provide_python() {
    local apt_here=
    if command -v apt-get >/dev/null; then
        apt_here=yes
        refresh
    fi
    if [[ $apt_here && ${DOLFINX:-} != wheel ]] && offers python3-dolfinx-real 1:0.9 1:0.12~; then
        say "dolfinx will come from apt, and the rest go into $VENV."
        install "dolfinx and what belongs to it" "" "${SYSTEM_PACKAGES[@]}"
        way=system
        find_system_python
        return
    fi
    [[ ${DOLFINX:-} != system ]] && wheel_fits_machine || return 1
    way=wheel
    if command -v uv >/dev/null; then
        say "Python 3.13 will come from uv, and dolfinx's wheel and the rest go into $VENV."
        uv python install 3.13 && find_wheel_python && return
        refused+=("uv python install 3.13 failed; its message is above")
    fi
    [[ $apt_here ]] || return 1
    if offers python3 3.12 4; then
        say "Python will come from apt, and dolfinx's wheel and the rest go into $VENV."
        # shellcheck disable=SC2046 # a list
        install "Python" "" $(python_packages python3)
    elif on_bookworm && can_be_root; then
        say "Debian 12 has no Python from 3.12 on: 3.13 will come from Debian 13 (trixie), and dolfinx's wheel" \
            "and the rest go into $VENV."
        add_trixie
        # shellcheck disable=SC2046
        install "Python 3.13" trixie $(python_packages python3.13)
    else
        return 1
    fi
    find_wheel_python
}

explain() {
    local other="uv python install 3.13 && make setup          (no root; uv: pip install uv)"
    step="looking for dolfinx"
    printf '[setup] %s\n' "${refused[@]}" | awk '!seen[$0]++' >&2
    [[ -z ${PYTHON:-} ]] || die "PYTHON=$PYTHON cannot be used${DOLFINX:+ with DOLFINX=$DOLFINX}: see above." \
        "Next: name another, or none: make setup"
    [[ $DOLFINX != system ]] || other="DOLFINX=wheel make setup                      (no root)"
    die "Nothing here has a dolfinx that can be used${DOLFINX:+ with DOLFINX=$DOLFINX}: see above. Next, one of these:" \
        "  $other" \
        "  conda env create -f environment.yml && conda activate cutsim && make setup" \
        "  docker build -t cutsim . && docker run -it --rm cutsim" \
        "  PYTHON=/path/to/python3 make setup            (one from 3.12 on, or one that imports dolfinx)" \
        "docs/install.md says more about each."
}

# ---------------------------------------------------------------- what compiles, meshes and draws
from_package() { dpkg-query -S "$(readlink -f "$python")" &>/dev/null; }

# Packages of Debian and Ubuntu without which $python can do nothing here.
essentials() {
    local name headers=""
    if from_package; then
        name=$(basename "$(readlink -f "$python")")
        headers=lib$name-dev
        ask "$python" "$MAKES_VENV" >/dev/null || python_packages "$name"
    fi
    ask "$python" "$COMPILES" >/dev/null || echo gcc libc6-dev "$headers"
    if [[ $way == wheel ]] || ! ask "$python" "import gmsh" >/dev/null; then
        ask "$python" "$LOADS_LIBRARIES" >/dev/null || echo "${LIBRARY_PACKAGES[*]}"
    fi
}

# Those for pictures, and for speed where dolfinx is Debian's.
recommended() {
    local package
    if [[ $way == system ]] && from_package; then
        for package in "${SYSTEM_PACKAGES[@]}"; do
            [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || echo "$package"
        done
    else
        ask "$python" "import ctypes; ctypes.CDLL('libEGL.so.1')" >/dev/null || echo "${PICTURE_PACKAGES[*]}"
    fi
}

complete_system() {
    local packages extra release="" reason
    read -ra packages < <(essentials | xargs)
    read -ra extra < <(recommended | xargs)
    if ((${#packages[@]} == 0)); then
        ((${#extra[@]} == 0)) || say "NOTE: recommended, not installed: ${extra[*]}"
    elif command -v apt-get >/dev/null; then
        [[ $way == wheel ]] || ! from_package || packages=("${SYSTEM_PACKAGES[@]}")
        # Only there has Debian 12 what belongs to a newer Python.
        [[ ${packages[*]} != *python3.1[2-9]-venv* ]] || ! on_bookworm || release=trixie
        refresh
        install "what is missing beside $python" "$release" "${packages[@]}" "${extra[@]}"
    else
        die "A C compiler, Python's headers or shared libraries of gmsh are missing." "Next, on Fedora:" \
            "  sudo dnf install ${FEDORA_PACKAGES[*]}" "or their like elsewhere, then: make setup"
    fi
    step="checking $python"
    reason=$(ask "$python" "$MAKES_VENV") || die "It makes no virtual environments: ${reason##*$'\n'}" \
        "Next, with another Python: PYTHON=/path/to/python3 make setup"
    reason=$(ask "$python" "$COMPILES") || die "Its C compiler does not work: ${reason##*$'\n'}" \
        "Next: install one, or name it: CC=/path/to/cc make setup"
}

# ---------------------------------------------------------------- the virtual environment
make_venv() {
    begin "making $VENV from $python"
    if [[ $way == wheel ]]; then
        "$python" -m venv --clear "$VENV"
        return
    fi
    "$python" -m venv --clear --system-site-packages "$VENV"
    # Where $python is itself a virtual environment (containers), its packages would not be seen.
    "$python" -c 'import site, sys
if sys.prefix != sys.base_prefix: print(*site.getsitepackages(), sep="\n")' >"$VENV/parent"
    mv "$VENV/parent" "$("$VENV/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/parent.pth"
}

install_cutsim() {
    local module what=(-e ".[dev]")
    begin "installing cutsim and its Python dependencies into $VENV"
    : >"$VENV/constraints.txt"
    if [[ $way == wheel ]]; then
        what=(-e ".[dolfinx,dev]")
    else
        # The compiled packages beside dolfinx stay as they are.
        "$VENV/bin/python" - >"$VENV/constraints.txt" <<'PY'
from importlib.metadata import distributions
fixed = {"numpy", "scipy", "mpi4py", "petsc4py", "fenics-dolfinx"}
print(*sorted({f"{d.name}=={d.version}" for d in distributions() if d.name.lower() in fixed}), sep="\n")
PY
        for module in gmsh meshio; do
            "$VENV/bin/python" -c "import $module" 2>/dev/null || what+=("$module")
        done
    fi
    "$VENV/bin/python" -m pip install --quiet --disable-pip-version-check -c "$VENV/constraints.txt" "${what[@]}" ||
        die "pip did not succeed; its own message is above. Where it found no package or no connection, this machine" \
            "cannot reach the package index: behind a proxy set HTTPS_PROXY, with a mirror set PIP_INDEX_URL." \
            "Next: make setup"
}

check() {
    local reason
    begin "checking the installation"
    reason=$(ask "$PWD/$VENV/bin/python" "from mpi4py import MPI; import cutsim, gmsh, meshio, pyvista") ||
        die "$VENV does not work: ${reason##*$'\n'}" \
            "Next, with another Python or another dolfinx: PYTHON=/path/to/python3 make setup, DOLFINX=wheel|system make setup"
    ask "$PWD/$VENV/bin/python" '
import ctypes, pyvista
ctypes.CDLL("libEGL.so.1")
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
assert plotter.screenshot(return_img=True).std() > 0' >/dev/null || say "NOTE: pyvista cannot draw off screen: no pictures"
}

[[ ${DOLFINX:=} =~ ^(|wheel|system)$ ]] || die "DOLFINX=$DOLFINX is neither wheel nor system." "Next: make setup"
sources=$(cat pyproject.toml scripts/setup.sh scripts/python.sh | cksum)
if venv_is_whole && venv_is_wanted; then
    [[ $(stamped sources) != "$sources" ]] || exit 0
    way=$(stamped way)
    python=$(stamped python)
    say "$VENV is brought up to date; its dolfinx ($way) and its Python ($python) stay."
    rm "$STAMP"
else
    choose
    case $way in
        wheel) say "$VENV will be made from $python ($found), with dolfinx 0.11 from its wheel (no root, some 400 MB)." ;;
        system) say "$VENV will be made from $python, with the $found it has." ;;
    esac
    say "To choose otherwise: DOLFINX=wheel|system or PYTHON=/path/to/python3 before make."
    complete_system
    make_venv
fi
install_cutsim
check
printf '%s\n' "way=$way" "python=$python" "place=$PWD" "sources=$sources" >"$STAMP"
say "done"
