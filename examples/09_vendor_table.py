"""Does a URDF agree with the table that its vendor publishes?

Learn: a table is compared cell by cell and in millimetres at the tip, after its free choices are fitted.
"""

from dataclasses import replace

import urdfkin
from urdfkin.dh.compare import compare
from urdfkin.dh.references import reference_path

robot = urdfkin.load("ur5")
published = urdfkin.read_table(reference_path("ur5"))  # or a .toml, .json or .csv of your own
path = robot.chain("tool0", "base")

found = compare(path, published)
print(f"as published: agrees {found.agrees}, {1e3 * found.metres:.2g} mm at the tip at most")

# A slip of a millimetre in one cell is found, and named.
rows = list(published.rows)
rows[2] = replace(rows[2], a=rows[2].a + 1e-3)
found = compare(path, replace(published, rows=tuple(rows)))
print(f"with a slip:  agrees {found.agrees}, {1e3 * found.metres:.2g} mm at the tip at most")
for cell in found.differences:
    print(
        f"  row {cell.row + 1}, {cell.cell}: {cell.reference:.5f} is published, {cell.urdf:.5f} is the URDF's"
    )
