#!/bin/sh
# Set everything up and pass the tests: format, lint, types, then every test but the long ones of test_long.sh.
. "$(dirname "$0")/environment.sh"
make_environment "[test]"
set -e
ruff format --check .
ruff check .
python scripts/changelog_gate.py
urdfkin warm  # once, by both processors, and not by every worker for itself
types=$(mktemp)
mypy >"$types" 2>&1 &  # beside the tests, which wait now and then
mypy=$!
trap 'kill "$mypy" 2>/dev/null || true; rm -f "$types"' EXIT
status=0
pytest -n 2 --dist worksteal -m "not long" "$@" || status=$?
wait "$mypy" || status=1
cat "$types"
exit "$status"
