"""Functions with which the recursion expresses vectors in world axes or in each link's own axes.

The textbook uses world axes. The rotation R of a link converts components in the link's axes to components in
world axes. The joint axis and the interorigin vector have constant components in the link's axes.

| axes | joint axis and interorigin vector | velocities and accelerations of the previous link |
|---|---|---|
| world | rotated by R | unchanged |
| link's own | constant: (0, 0, 1) and a constant vector | rotated to the next link's axes |

The recursion uses the axes in which the result is requested. A conversion of the result to other axes would
add the rounding errors of another rotation.
"""

from __future__ import annotations

from urdfkin.kinematics import equations as eq


def link_axes(own, world):
    return own


def world_axes(own, world):
    return world


def seen(axes, R, x):
    """Return the components of x, given in the link's axes, in the axes of `link_axes` or `world_axes`."""
    return axes(x, eq.rotate(R, x))


def seen_after(axes, S, x):
    """Return a link's velocity or acceleration x after the link's frame is rotated by S.

    In world axes, the components of x do not change. In the link's axes, they are rotated.
    """
    return axes(eq.rotate(eq.transposed(S), x), x)
