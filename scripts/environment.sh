# Functions for try.sh, test.sh and test_long.sh.
# make_environment makes a virtual environment in .venv with urdfkin and the extras in $1.
# make_environment needs Python >= 3.11.
# If Python cannot make virtual environments, make_environment installs Debian's python3-venv.
# install_nvcc installs CUDA's compiler.

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

# Install CUDA's compiler from the package registry into .venv/nvcc (280 MB).
# Return 1 if the installation takes more than two minutes.
# Return 1 if the compiler cannot compile a kernel on this system.
install_nvcc() {
    [ ! -x .venv/nvcc/bin/nvcc ] || return 0
    [ -x .venv/bin/pip ] || { echo "there is no .venv; first run make setup" >&2 && return 1; }
    echo "installing CUDA's compiler into .venv/nvcc (280 MB)" >&2
    new=$(mktemp -d .venv/nvcc.XXXXXX) || return 1
    if timeout 120 .venv/bin/pip install --quiet --disable-pip-version-check --retries 1 --timeout 20 --no-deps \
        --no-cache-dir --only-binary :all: --target "$new/packages" nvidia-cuda-nvcc==13.0.88 nvidia-nvvm==13.0.88 \
        nvidia-cuda-crt==13.0.88 nvidia-cuda-runtime==13.0.96 nvidia-cuda-cccl==13.0.85 &&
        cuda="$new/packages/nvidia/cu13" && ln -s lib "$cuda/lib64" && # the folder where nvcc searches for libraries
        echo '__global__ void k() {} int main() { k<<<1, 1>>>(); }' >"$new/try.cu" &&
        "$cuda/bin/nvcc" "$new/try.cu" -o "$new/try"; then
        mv "$cuda" .venv/nvcc
        status=$?
    else
        status=1
    fi
    rm -rf "$new"
    return "$status"
}
