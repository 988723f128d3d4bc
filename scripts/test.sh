#!/bin/sh
# Set everything up and pass the tests: format, lint, types, then the whole suite.
. "$(dirname "$0")/environment.sh"
make_environment "[test]"
set -e
ruff format --check .
ruff check .
mypy
python scripts/changelog_gate.py
urdfkin warm  # once, by both processors, and not by every worker for itself
exec pytest -n 2 --dist worksteal "$@"
