"""Derive the Denavit-Hartenberg table of a URDF, and print the table as Markdown.

You learn that `snap` rounds an angle of 1.57079632679 in the URDF to a right angle. By default, urdfkin
compares each table with Pinocchio.
"""

import numpy as np

import urdfkin

robot = urdfkin.load("ur5")
table = robot.dh("tool0", "base", snap=1e-6)
print(table.to_markdown())

q = np.full(6, 0.3)
print("the tip by the table, metres:", table.placement(q)[:3, 3].round(6))
for convention in ("standard", "modified"):
    rows = robot.dh("tool0", "base", convention, snap=1e-6).rows
    print(f"{convention:>8}: a = {[round(row.a, 5) for row in rows]}")
