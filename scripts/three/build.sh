#!/bin/sh
# Builds urdfkin/report/assets/three.min.js from the npm package three, unchanged, and puts its licence beside
# it. A maintainer runs this to move to another version (package.json names it); users and CI never do: the
# result is committed and ships in the wheel. Needs node and npm.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
assets="$here/../../urdfkin/report/assets"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here/package.json" "$here/entry.mjs" "$work"
cd "$work"
npm install --no-audit --no-fund --no-package-lock
version=$(node -p 'JSON.parse(fs.readFileSync("node_modules/three/package.json")).version')
npx esbuild entry.mjs --bundle --minify --format=iife --global-name=THREE --target=es2020 --charset=ascii \
    --legal-comments=none \
    --banner:js="/*! three.js $version, MIT licence, see three.LICENSE.txt; made by scripts/three/build.sh */" \
    --outfile="$assets/three.min.js"
cp node_modules/three/LICENSE "$assets/three.LICENSE.txt"
cd "$assets" && sha256sum three.min.js three.LICENSE.txt > three.sha256
