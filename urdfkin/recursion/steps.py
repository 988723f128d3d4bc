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
    cross,
    dot,
    entry,
    lane_function,
    load,
    plus,
    rotate,
    sine_cosine,
    store,
    times,
)
from urdfkin.recursion.plan import Geometry, Motion

# Rows of the scratch array. The state comes first, in one piece, so that it can be saved and restored.
R, P, W, V, ALPHA, A = 0, 9, 12, 15, 18, 21
STATE_ROWS = 24
#: How much of the state each order of motion has: placement, velocity, acceleration.
ROWS_OF_ORDER = (12, 18, 24)
# The state of a frame on the way out, and what a single step needs.
FRAME = 24
D, ANGLE, SINE, COSINE = 48, 51, 52, 53
SLIDE, SLIDE_RATE, TURN_RATE, SLIDE_RATE_2, TURN_RATE_2 = 54, 57, 60, 63, 66
RATE, RATE_2 = 69, 70
FIXED_ROWS = 71

_OFFSET, _MULTIPLIER, _CONSTANT = int(Geometry.OFFSET), int(Geometry.MULTIPLIER), int(Geometry.CONSTANT)
_TURN, _SLIDE, _PLANAR = int(Motion.TURN), int(Motion.SLIDE), int(Motion.PLANAR)


@lane_function
def turn_by_constant(m, s, at, g, i):
    """R <- R G with the constant rotation G in row `i` of `g`."""
    x = (g[i, 0], g[i, 3], g[i, 6])
    y = (g[i, 1], g[i, 4], g[i, 7])
    z = (g[i, 2], g[i, 5], g[i, 8])
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
def turn_by_quaternion(m, s, q, b, at):
    """R <- R R(quat) for the unit quaternion (x, y, z, w) in columns `at` to `at + 3` of `q`."""
    for k in range(m):
        x, y, z, w = (
            entry(q, b + k, at),
            entry(q, b + k, at + 1),
            entry(q, b + k, at + 2),
            entry(q, b + k, at + 3),
        )
        e = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y))
        f = (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x))
        g = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        for row in range(3):
            r = load(s, R + 3 * row, k)
            turned = plus(times(r[0], e), plus(times(r[1], f), times(r[2], g)))
            store(s, R + 3 * row, k, turned)


@lane_function
def interorigin(m, s, g, i):
    """D = R p for the constant offset p in row `i` of `g`, seen in the axes of R."""
    p = (g[i, _OFFSET], g[i, _OFFSET + 1], g[i, _OFFSET + 2])
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
def gather_joint(m, s, b, i, steps, g, q, v, a, order):
    """Coordinate and rates of a joint with one coordinate; a follower's come from its leader's."""
    at, rate_at = steps[i, 3], steps[i, 4]
    multiplier, constant = g[i, _MULTIPLIER], g[i, _CONSTANT]
    for k in range(m):
        s[ANGLE * LANES + k] = multiplier * entry(q, b + k, at) + constant
    if order >= 1:
        for k in range(m):
            s[RATE * LANES + k] = multiplier * entry(v, b + k, rate_at)
    if order >= 2:
        for k in range(m):
            s[RATE_2 * LANES + k] = multiplier * entry(a, b + k, rate_at)


@lane_function
def gather_free(m, s, b, at, planar, x, slide, turn):
    """Rates of a planar (x, y, about z) or floating (three and three) joint into two vectors."""
    for k in range(m):
        if planar:
            store(s, slide, k, (entry(x, b + k, at), entry(x, b + k, at + 1), 0.0))
            store(s, turn, k, (0.0, 0.0, entry(x, b + k, at + 2)))
        else:
            store(
                s,
                slide,
                k,
                (entry(x, b + k, at), entry(x, b + k, at + 1), entry(x, b + k, at + 2)),
            )
            store(
                s,
                turn,
                k,
                (
                    entry(x, b + k, at + 3),
                    entry(x, b + k, at + 4),
                    entry(x, b + k, at + 5),
                ),
            )


@lane_function
def step_free(m, s, b, i, steps, q, v, a, order):
    """A planar or floating joint, after R <- R G and d = R p."""
    at, rate_at, planar = steps[i, 3], steps[i, 4], steps[i, 0] == _PLANAR
    for k in range(m):
        z = 0.0 if planar else entry(q, b + k, at + 2)
        store(s, SLIDE, k, (entry(q, b + k, at), entry(q, b + k, at + 1), z))
    add_slide(m, s)
    carry(m, s, 0, order)
    if planar:
        for k in range(m):
            s[ANGLE * LANES + k] = entry(q, b + k, at + 2)
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        turn_about_z(m, s)
    else:
        turn_by_quaternion(m, s, q, b, at + 3)
    if order >= 1:
        gather_free(m, s, b, rate_at, planar, v, SLIDE_RATE, TURN_RATE)
        if order >= 2:
            gather_free(m, s, b, rate_at, planar, a, SLIDE_RATE_2, TURN_RATE_2)
        move_free(m, s, order)


@lane_function
def step(m, s, b, i, steps, g, q, v, a, order):
    """The state of link i-1 becomes the state of link i."""
    turn_by_constant(m, s, 0, g, i)
    interorigin(m, s, g, i)
    kind = steps[i, 0]
    if kind == _TURN:
        carry(m, s, 0, order)
        gather_joint(m, s, b, i, steps, g, q, v, a, order)
        sine_cosine(m, s, ANGLE, SINE, COSINE)
        move_revolute(m, s, order)
    elif kind == _SLIDE:
        gather_joint(m, s, b, i, steps, g, q, v, a, order)
        for k in range(m):
            store(s, SLIDE, k, (0.0, 0.0, s[ANGLE * LANES + k]))
        add_slide(m, s)
        carry(m, s, 0, order)
        move_prismatic(m, s, order)
    else:
        step_free(m, s, b, i, steps, q, v, a, order)
