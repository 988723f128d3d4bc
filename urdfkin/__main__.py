"""`python -m urdfkin` is the `urdfkin` command."""

from urdfkin.cli import main

main()
