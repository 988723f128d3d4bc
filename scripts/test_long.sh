#!/bin/sh
# Set everything up and pass the long tests: processes, mutants, fuzzing, benchmark, packages, site, browsers.
# In CI also with CUDA's compiler, if it installs.
. "$(dirname "$0")/environment.sh"
make_environment "[test]"
[ "${CI:-}" != true ] || install_nvcc ||
    echo "CUDA's compiler was not installed (see above); the tests that need it are skipped" >&2
set -e
urdfkin warm
exec pytest -n 2 --dist worksteal -m long "$@"
