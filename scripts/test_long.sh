#!/bin/sh
# Set everything up and pass the long tests: processes, mutants, fuzzing, benchmark, packages, site, browsers.
. "$(dirname "$0")/environment.sh"
make_environment "[test]"
set -e
urdfkin warm
exec pytest -n 2 --dist worksteal -m long "$@"
