"""Compute a hundred thousand Jacobians in one call, and write them into an existing array.

You learn that every method that computes a quantity accepts arrays with leading batch axes. `out=` avoids the
allocation of a result. `verify="sample"` checks only 100 configurations, which saves time.
"""

import time

import numpy as np

import urdfkin

robot = urdfkin.load("panda")
q = robot.sample(100_000, seed=0)  # (100000, 8)
J = np.empty((len(q), 6, robot.nv))
robot.jacobian(q[:1], "panda_hand", verify=False)  # The first call compiles the kernel.

start = time.perf_counter()
robot.jacobian(q, "panda_hand", out=J, verify="sample")
seconds = time.perf_counter() - start
print(f"q {q.shape} gave J {J.shape}, {J.nbytes / 1e6:.0f} MB")
print(f"{len(q):,} Jacobians in {1e3 * seconds:.0f} ms, {1e9 * seconds / len(q):.0f} ns each")

singular = np.linalg.svd(J[:, :, :7], compute_uv=False)[:, -1]
worst = int(singular.argmin())
print(f"nearest to a singularity: sample {worst}, smallest singular value {singular[worst]:.1e}")
