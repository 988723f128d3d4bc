"""In whose axes a walk sees a motion: the world's, as the text, or each link's own.

A rotation R takes vectors from a link's axes to the world's; what is constant in the link, its joint's axis
and its interorigin vector, is known in the link's. In the world's axes both are turned by R, and a motion is
seen alike from one link and the next. In a link's own axes they stay what they are, (0, 0, 1) and a constant,
and the motion is turned from one link's axes to the next one's.

Each has its results where they are asked for: turned at the end they would be less exact, by the rounding of
a second rotation.
"""

from __future__ import annotations

from urdfkin.compiled import compiled_equations as eq
from urdfkin.compiled.compiling import compiled


@compiled
def link_axes(own, world):
    """The choice of what is seen in the link's own axes."""
    return own


@compiled
def world_axes(own, world):
    """The choice of what is seen in the world's axes."""
    return world


@compiled
def seen(axes, R, x):
    """A vector of a link, in the motion's axes."""
    return axes(x, eq.rotate(R, x))


@compiled
def seen_after(axes, S, x):
    """A vector of the motion, after its frame was turned by S."""
    return axes(eq.rotate(eq.transposed(S), x), x)
