# Sourced by try.sh, test.sh and test_long.sh: a virtual environment in .venv with urdfkin and the extras named in $1.
# Needs a Python >= 3.11; installs Debian's python3-venv if the Python there cannot make environments.

cd "$(dirname "$0")/.." || exit 2

find_python() {
    for candidate in python3 python3.11 python3.12 python3.13 python3.14; do
        if command -v "$candidate" >/dev/null 2>&1 &&
            "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$candidate"
            return
        fi
    done
    echo "urdfkin needs Python 3.11 or newer; none was found (sudo apt-get install python3)" >&2
    exit 2
}

install_venv_package() {
    as_root=""
    [ "$(id -u)" -eq 0 ] || as_root="sudo"
    echo "installing Debian's $1-venv, which this Python needs to make a virtual environment" >&2
    $as_root apt-get update -qq && $as_root apt-get install -y -qq "$1-venv" >/dev/null
}

make_environment() {
    python=$(find_python) || exit 2
    if [ ! -x .venv/bin/pip ]; then
        "$python" -c 'import ensurepip' 2>/dev/null ||
            install_venv_package "python$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')" ||
            exit 2
        "$python" -m venv .venv || exit 2
    fi
    echo "installing urdfkin and what it needs into .venv (some minutes the first time)" >&2
    .venv/bin/pip install --quiet --disable-pip-version-check -e ".$1" || exit 2
    PATH="$PWD/.venv/bin:$PATH"
    export PATH
}
