"""One step of the text's recursion: equations 7.127 to 7.130 (section 7.7), for a block of configurations.

The state of a link is its frame's rotation R, origin P, angular velocity W, origin velocity V, angular
acceleration ALPHA and origin acceleration A, all in the world frame. A step takes the state of link i-1 to
link i in two moves, each the text's own:

*carry* goes along the rigid link i-1, by the interorigin vector d, to the origin on the axis of joint i:

    vel += w x d                        the first term of 7.128
    acc += alpha x d + w x (w x d)      the first terms of 7.130

*move* adds what joint i does about or along its axis z:

    alpha_i = alpha_{i-1} + a z + v w_{i-1} x z      7.129, revolute
    w_i     = w_{i-1} + v z                          7.127, revolute
    vel    += v z                                    7.128, prismatic
    acc    += a z + 2 v w_{i-1} x z                  7.130, prismatic

The text numbers a frame by the link before its joint's axis, so that its d_{i-1,i} belongs to link i and
is met after the joint; a URDF's frame lies on its own joint's axis, so here d belongs to link i-1 and is
met before it. The sums are the same. The slide of a prismatic joint is part of d, as in 7.64.
"""

from __future__ import annotations

from urdfkin.recursion.lanes import (
    LANES,
    column,
    copy_rows,
    cross,
    dot,
    lane_function,
    load,
    plus,
    rotate,
    sine_cosine,
    store,
    times,
)
from urdfkin.recursion.plan import GEOMETRY_WIDTH, STEP_WIDTH, Geometry, Motion, Step
from urdfkin.recursion.rows import (
    ALPHA,
    ANGLE,
    COSINE,
    QUATERNION,
    RATE,
    RATE_2,
    SINE,
    SLIDE,
    SLIDE_RATE,
    SLIDE_RATE_2,
    TURN_RATE,
    TURN_RATE_2,
    A,
    D,
    P,
    R,
    V,
    W,
)

_KIND, _Q, _V = int(Step.KIND), int(Step.Q), int(Step.V)
_OFFSET, _MULTIPLIER, _CONSTANT = int(Geometry.OFFSET), int(Geometry.MULTIPLIER), int(Geometry.CONSTANT)
_TURN, _SLIDE, _PLANAR = int(Motion.TURN), int(Motion.SLIDE), int(Motion.PLANAR)


@lane_function
def turn_by_constant(m, s, at, g, i):
    """R <- R G with the constant rotation G that lies in `g[i]`, row by row."""
    x = (g[i], g[i + 3], g[i + 6])
    y = (g[i + 1], g[i + 4], g[i + 7])
    z = (g[i + 2], g[i + 5], g[i + 8])
    for row in range(3):
        for k in range(m):
            r = load(s, at + 3 * row, k)
            store(s, at + 3 * row, k, (dot(r, x), dot(r, y), dot(r, z)))


@lane_function
def turn_about_z(m, s):
    """R <- R Rz(angle), eq. 7.5: the third column, the axis, stays."""
    for row in range(3):
        for k in range(m):
            at = (R + 3 * row) * LANES + k
            x, y = s[at], s[at + LANES]
            sine, cosine = s[SINE * LANES + k], s[COSINE * LANES + k]
            s[at] = x * cosine + y * sine
            s[at + LANES] = y * cosine - x * sine


@lane_function
def turn_by_quaternion(m, s):
    """R <- R R(quat) for the unit quaternion (x, y, z, w)."""
    for k in range(m):
        x, y, z = load(s, QUATERNION, k)
        w = s[(QUATERNION + 3) * LANES + k]
        e = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y))
        f = (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x))
        g = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        for row in range(3):
            r = load(s, R + 3 * row, k)
            turned = plus(times(r[0], e), plus(times(r[1], f), times(r[2], g)))
            store(s, R + 3 * row, k, turned)


@lane_function
def interorigin(m, s, g, i):
    """D = R p for the constant offset p that lies behind the rotation in `g[i]`, seen in the axes of R."""
    p = (g[i + _OFFSET], g[i + _OFFSET + 1], g[i + _OFFSET + 2])
    for k in range(m):
        store(s, D, k, rotate(s, R, p, k))


@lane_function
def add_slide(m, s):
    """D += R t for the slide t of the joint, in its own axes."""
    for k in range(m):
        store(s, D, k, plus(load(s, D, k), rotate(s, R, load(s, SLIDE, k), k)))


@lane_function
def carry(m, s, at, order):
    """From one point of a rigid link to another, d away: 7.128 and 7.130, and P += d (7.77)."""
    for k in range(m):
        store(s, at + P, k, plus(load(s, at + P, k), load(s, D, k)))
    if order >= 1:
        for k in range(m):
            vel_by_turning = cross(load(s, at + W, k), load(s, D, k))
            store(s, at + V, k, plus(load(s, at + V, k), vel_by_turning))
    if order >= 2:
        for k in range(m):
            w, d = load(s, at + W, k), load(s, D, k)
            transverse = cross(load(s, at + ALPHA, k), d)
            centripetal = cross(w, cross(w, d))
            store(s, at + A, k, plus(load(s, at + A, k), plus(transverse, centripetal)))


@lane_function
def move_revolute(m, s, order):
    """The joint turns about z at rate v: 7.129, then 7.127, then the turn itself."""
    if order >= 2:
        for k in range(m):
            z, w = column(s, R, 2, k), load(s, W, k)
            v, a = s[RATE * LANES + k], s[RATE_2 * LANES + k]
            store(s, ALPHA, k, plus(load(s, ALPHA, k), plus(times(a, z), times(v, cross(w, z)))))
    if order >= 1:
        for k in range(m):
            v, z = s[RATE * LANES + k], column(s, R, 2, k)
            store(s, W, k, plus(load(s, W, k), times(v, z)))
    turn_about_z(m, s)


@lane_function
def move_prismatic(m, s, order):
    """The joint slides along z at rate v: 7.130, then 7.128."""
    if order >= 2:
        for k in range(m):
            z, w = column(s, R, 2, k), load(s, W, k)
            v, a = s[RATE * LANES + k], s[RATE_2 * LANES + k]
            coriolis = times(2.0 * v, cross(w, z))
            store(s, A, k, plus(load(s, A, k), plus(times(a, z), coriolis)))
    if order >= 1:
        for k in range(m):
            v, z = s[RATE * LANES + k], column(s, R, 2, k)
            store(s, V, k, plus(load(s, V, k), times(v, z)))


@lane_function
def move_free(m, s, order):
    """A planar or floating joint: rates u (sliding) and o (turning) along the axes of the moved frame.

    The same derivation as 7.129 and 7.130 (differentiate R u and R o with R-dot = S(w_i) R):

        alpha_i = alpha_{i-1} + R o-dot + w_{i-1} x R o
        acc    += R u-dot + (w_{i-1} + w_i) x R u

    With u along a fixed z and no turning, w_i = w_{i-1} and the last term is the text's 2 v w x z.
    """
    for k in range(m):
        w, u = load(s, W, k), rotate(s, R, load(s, SLIDE_RATE, k), k)
        o = rotate(s, R, load(s, TURN_RATE, k), k)
        if order >= 2:
            o_rate = rotate(s, R, load(s, TURN_RATE_2, k), k)
            u_rate = rotate(s, R, load(s, SLIDE_RATE_2, k), k)
            store(s, ALPHA, k, plus(load(s, ALPHA, k), plus(o_rate, cross(w, o))))
            twice_w = plus(w, plus(w, o))
            store(s, A, k, plus(load(s, A, k), plus(u_rate, cross(twice_w, u))))
        store(s, V, k, plus(load(s, V, k), u))
        store(s, W, k, plus(w, o))


@lane_function
def gather_joint(m, s, plan, i, order):
    """Coordinate and rates of a joint with one coordinate; a follower's come from its leader's."""
    at, rate_at = plan.steps[STEP_WIDTH * i + _Q], plan.steps[STEP_WIDTH * i + _V]
    rule = GEOMETRY_WIDTH * i
    multiplier, constant = plan.geometry[rule + _MULTIPLIER], plan.geometry[rule + _CONSTANT]
    copy_rows(m, s, plan.q + at, ANGLE, 1)
    for k in range(m):
        s[ANGLE * LANES + k] = multiplier * s[ANGLE * LANES + k] + constant
    if order >= 1:
        copy_rows(m, s, plan.v + rate_at, RATE, 1)
        for k in range(m):
            s[RATE * LANES + k] = multiplier * s[RATE * LANES + k]
    if order >= 2:
        copy_rows(m, s, plan.a + rate_at, RATE_2, 1)
        for k in range(m):
            s[RATE_2 * LANES + k] = multiplier * s[RATE_2 * LANES + k]


@lane_function
def gather_place(m, s, plan, i):
    """Place of a planar joint (x, y and the angle) or of a floating one (x, y, z and the quaternion)."""
    at = plan.q + plan.steps[STEP_WIDTH * i + _Q]
    if plan.steps[STEP_WIDTH * i + _KIND] == _PLANAR:
        copy_rows(m, s, at, SLIDE, 2)
        for k in range(m):
            s[(SLIDE + 2) * LANES + k] = 0.0
        copy_rows(m, s, at + 2, ANGLE, 1)
    else:
        copy_rows(m, s, at, SLIDE, 3)
        copy_rows(m, s, at + 3, QUATERNION, 4)


@lane_function
def _gather_rates(m, s, planar, at, slide, turn):
    """Rates of a planar (x, y, about z) or floating (three and three) joint into two vectors."""
    if planar:
        copy_rows(m, s, at, slide, 2)
        copy_rows(m, s, at + 2, turn + 2, 1)
        for k in range(m):
            s[(slide + 2) * LANES + k] = 0.0
            s[turn * LANES + k] = 0.0
            s[(turn + 1) * LANES + k] = 0.0
    else:
        copy_rows(m, s, at, slide, 3)
        copy_rows(m, s, at + 3, turn, 3)


@lane_function
def gather_rates(m, s, plan, i, order):
    """Rates of a planar or floating joint, in the axes of the moved frame."""
    at, planar = plan.steps[STEP_WIDTH * i + _V], plan.steps[STEP_WIDTH * i + _KIND] == _PLANAR
    _gather_rates(m, s, planar, plan.v + at, SLIDE_RATE, TURN_RATE)
    if order >= 2:
        _gather_rates(m, s, planar, plan.a + at, SLIDE_RATE_2, TURN_RATE_2)


@lane_function
def _step_free(m, s, plan, i, order):
    """A planar or floating joint, after R <- R G and d = R p."""
    gather_place(m, s, plan, i)
    add_slide(m, s)
    carry(m, s, 0, order)
    if plan.steps[STEP_WIDTH * i + _KIND] == _PLANAR:
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        turn_about_z(m, s)
    else:
        turn_by_quaternion(m, s)
    if order >= 1:
        gather_rates(m, s, plan, i, order)
        move_free(m, s, order)


@lane_function
def step(m, s, plan, i, order):
    """The state of link i-1 becomes the state of link i."""
    turn_by_constant(m, s, 0, plan.geometry, GEOMETRY_WIDTH * i)
    interorigin(m, s, plan.geometry, GEOMETRY_WIDTH * i)
    kind = plan.steps[STEP_WIDTH * i + _KIND]
    if kind == _TURN:
        carry(m, s, 0, order)
        gather_joint(m, s, plan, i, order)
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        move_revolute(m, s, order)
    elif kind == _SLIDE:
        gather_joint(m, s, plan, i, order)
        for k in range(m):
            store(s, SLIDE, k, (0.0, 0.0, s[ANGLE * LANES + k]))
        add_slide(m, s)
        carry(m, s, 0, order)
        move_prismatic(m, s, order)
    else:
        _step_free(m, s, plan, i, order)
