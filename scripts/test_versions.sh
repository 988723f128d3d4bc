#!/bin/sh
# Run the fast tests with the oldest and the newest allowed versions of libraries.
# The first Python uses the lowest versions in pyproject.toml.
# Every Python uses the newest versions.
# Each environment takes 1.5 GB below .versions.
#
#   scripts/test_versions.sh [PYTHON...]     default: all installed python3.11 to python3.14
cd "$(dirname "$0")/.." || exit 2

if [ $# -eq 0 ]; then
    for version in 11 12 13 14; do
        command -v "python3.$version" >/dev/null 2>&1 && set -- "$@" "python3.$version"
    done
fi
[ $# -gt 0 ] || { echo "no Python 3.11 or newer was found; name one" >&2; exit 2; }

mkdir -p .versions
[ -x .versions/tools/bin/uv ] || { "$1" -m venv .versions/tools && .versions/tools/bin/pip install --quiet uv; } || exit 2
uv="$PWD/.versions/tools/bin/uv"

failed=""
try() { # PYTHON RESOLUTION
    name="$("$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-$2"
    echo "== $name" >&2
    "$uv" venv --quiet --clear --python "$1" ".versions/$name" &&
        "$uv" pip install --quiet --python ".versions/$name/bin/python" --resolution "$2" -e ".[test]" &&
        XDG_CACHE_HOME="$PWD/.versions/cache-$name" ".versions/$name/bin/python" -m pytest -q \
            -p no:cacheprovider -m "not slow and not browser" || failed="$failed $name"
}

try "$1" lowest-direct
for python in "$@"; do try "$python" highest; done

[ -z "$failed" ] || { echo "failed:$failed" >&2; exit 1; }
