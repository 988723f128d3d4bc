"""Compare a URDF with the Denavit-Hartenberg table that its vendor publishes.

You learn that the table and the URDF may have different base frames, tool frames and zero positions of the
joints. The function `compare` first fits the two frames and the zero positions. Then `compare` computes the
largest distance between the table's tip and the URDF's tip, and lists the cells of the table that differ.
"""

from dataclasses import replace

import urdfkin
from urdfkin.dh.compare import compare
from urdfkin.dh.parse_table import reference_path

robot = urdfkin.load("ur5")
published = urdfkin.read_table(reference_path("ur5"))  # The argument can also be the path of your own table.
path = robot.chain("tool0", "base")

found = compare(path, published)
print(f"as published: agrees {found.agrees}, {1e3 * found.metres:.2g} mm at the tip at most")

# Add 1 mm to the cell `a` of the third row. `compare` finds this cell.
rows = list(published.rows)
rows[2] = replace(rows[2], a=rows[2].a + 1e-3)
found = compare(path, replace(published, rows=tuple(rows)))
print(f"with an error: agrees {found.agrees}, {1e3 * found.metres:.2g} mm at the tip at most")
for cell in found.differences:
    print(
        f"  row {cell.row + 1}, {cell.cell}: {cell.reference:.5f} in the table, {cell.urdf:.5f} in the URDF"
    )
