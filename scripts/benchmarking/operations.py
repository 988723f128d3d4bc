"""How many multiplications and additions one configuration takes: the equations, counted.

A cross product is 6 multiplications and 3 additions, a rotation times a vector 9 and 6. Signs are free.
"""

from __future__ import annotations

from urdfkin.recursion.plan import Motion, Plan, Step

_CROSS, _SUM, _SCALED, _ROTATED = 9, 3, 3, 15
_TIMES_CONSTANT_ROTATION = 3 * _ROTATED
#: Range reduction 9, quarter turns 18, two polynomials of degree 13 and 14: 30 (`lanes.sine_cosine`).
_SINE_COSINE = 57
_ABOUT_Z = 18
#: 7.77; 7.128 on top; 7.130 on top of both, for going from one point of a link to another.
_CARRIED = (_SUM, _CROSS + _SUM, 3 * _CROSS + 2 * _SUM)
#: The coordinate; its rate; its second rate: a follower's rule is applied to every joint.
_GATHERED = (2, 1, 1)
#: 7.127, then 7.129.
_TURNED = (0, _SCALED + _SUM, _SCALED + _CROSS + _SCALED + 2 * _SUM)
#: 7.128, then 7.130.
_SLID = (0, _SCALED + _SUM, 1 + _SCALED + _CROSS + _SCALED + 2 * _SUM)
#: A column of 7.85 for a joint that turns: z x d.
_COLUMN = _SUM + _CROSS


def operations(plan: Plan, quantity: str) -> int:
    """For a plan of revolute and prismatic joints and one frame, in LOCAL_WORLD_ALIGNED.

    Raises:
        ValueError: another kind of joint.
    """
    order = {"jacobian": 0, "velocity": 1, "acceleration": 2}[quantity]
    return (
        sum(_step(kind, order, quantity == "jacobian") for kind in plan.steps[:, Step.KIND].tolist())
        + _ROTATED
        + sum(_CARRIED[: order + 1])
    )


def _step(kind: int, order: int, column: bool) -> int:
    shared = _TIMES_CONSTANT_ROTATION + _ROTATED + sum(_CARRIED[: order + 1]) + sum(_GATHERED[: order + 1])
    if kind == Motion.TURN:
        return shared + _SINE_COSINE + _ABOUT_Z + sum(_TURNED[: order + 1]) + column * _COLUMN
    if kind == Motion.SLIDE:
        return shared + _ROTATED + _SUM + sum(_SLID[: order + 1])
    raise ValueError("only joints that turn or slide are counted")
