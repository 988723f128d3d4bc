#!/bin/sh
# Install urdfkin, check format, lint and types, and run all tests except the long tests of test_long.sh.
. "$(dirname "$0")/environment.sh"
make_environment "[test]"
set -e
ruff format --check .
ruff check .
python scripts/changelog_gate.py
urdfkin warm  # Compile the kernels once here, not in every worker.
types=$(mktemp)
mypy >"$types" 2>&1 &  # Mypy runs at the same time as the tests.
mypy=$!
trap 'kill "$mypy" 2>/dev/null || true; rm -f "$types"' EXIT
status=0
pytest -n 2 --dist worksteal -m "not long" "$@" || status=$?
wait "$mypy" || status=1
cat "$types"
exit "$status"
