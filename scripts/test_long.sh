#!/bin/sh
# Install urdfkin, and run the long tests: processes, mutants, fuzzing, benchmark, packages, site, browsers.
# In CI, the tests also use CUDA's compiler, if it can be installed.
. "$(dirname "$0")/environment.sh"
make_environment "[test]"
[ "${CI:-}" != true ] || install_nvcc ||
    echo "CUDA's compiler was not installed (see above); the tests that need it are skipped" >&2
set -e
urdfkin warm
exec pytest -n 2 --dist worksteal -m long "$@"
