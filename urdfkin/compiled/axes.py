"""Axes in which the recursion expresses vectors: the world's, as in the textbook, or each link's own.

A rotation R takes vectors from a link's axes to the world's. The joint axis and the interorigin vector are
constant in the link's axes.

| axes | joint axis and interorigin vector | motion of the previous link |
|---|---|---|
| world | rotated by R | unchanged |
| link's own | constant: (0, 0, 1) and a constant vector | rotated to the next link's axes |

Results are computed in the axes in which they are requested. A rotation at the end would add the rounding of
a second rotation.
"""

from __future__ import annotations

from urdfkin.compiled import compiled_equations as eq
from urdfkin.compiled.compiling import compiled


@compiled
def link_axes(own, world):
    """Select the link's own axes."""
    return own


@compiled
def world_axes(own, world):
    """Select the world's axes."""
    return world


@compiled
def seen(axes, R, x):
    """Express a vector of a link in the axes of the recursion."""
    return axes(x, eq.rotate(R, x))


@compiled
def seen_after(axes, S, x):
    """Express a vector of the motion after its frame is rotated by S."""
    return axes(eq.rotate(eq.transposed(S), x), x)
