#!/bin/sh
# Install urdfkin into .venv, then show a DH table, a checked Jacobian and a validation of a real robot.
. "$(dirname "$0")/environment.sh"
make_environment ""
set -e
show() {
    printf '\n$ %s\n' "$*"
    "$@"
}
show urdfkin dh ur5 --base base --tip tool0 --snap 1e-6 --degrees --millimetres
show urdfkin jacobian panda --q ready
show urdfkin validate panda --samples 100
cat <<'END'

urdfkin works. Try next:

  . .venv/bin/activate
  urdfkin info panda                     # links, joints, limits, frames
  urdfkin check PATH_OF_YOUR.urdf        # what is wrong with a URDF, with line and remedy
  urdfkin dh PATH_OF_YOUR.urdf           # its Denavit-Hartenberg table
END
