#!/bin/sh
# Set everything up and do the main job: hold a real robot against Pinocchio.
. "$(dirname "$0")/environment.sh"
make_environment ""
exec urdfkin validate panda --samples 100
