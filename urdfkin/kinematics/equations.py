"""The chapter's equations of motion (sections 7.3 to 7.7), each written once, on any kind of number.

A vector is a triple of numbers (x, y, z), a rotation a triple of rows. Nothing is imported: whoever brings
numbers brings their arithmetic, and a kind of number whose vectors are not triples brings its own functions
in the place of those of the first part (`urdfkin.kinematics.number_kinds`). Batches in vector registers,
NumPy arrays, 50 digits, intervals, lengths and words of LaTeX all go through the lines below.

All vectors of an equation are seen in the same axes, whichever these are: the world's, as in the text, or the
link's own, where z is (0, 0, 1) and d a constant.

The text numbers a frame by the link before its joint's axis, so that its d_{i-1,i} belongs to link i and is
met after the joint; a URDF's frame lies on its own joint's axis, so that d belongs to link i-1 and is met
before. The sums are the same.
"""

# -- vectors ------------------------------------------------------------------------------------------


def plus(x, y):
    """X + y."""
    return x[0] + y[0], x[1] + y[1], x[2] + y[2]


def minus(x, y):
    """X - y."""
    return x[0] - y[0], x[1] - y[1], x[2] - y[2]


def times(c, x):
    """C x for a number c."""
    return c * x[0], c * x[1], c * x[2]


def dot(x, y):
    """X . y."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def cross(x, y):
    """X x y, which is S(x) y with the matrix of 7.16."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


def rotate(R, x):
    """R x: the vector x of a turned frame, seen from outside."""
    return dot(R[0], x), dot(R[1], x), dot(R[2], x)


def transposed(R):
    """R^T, which is the inverse of R (7.11)."""
    return (R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2])


def product(R, S):
    """R S: the orientation S of a frame, seen from outside the frame R."""
    columns = transposed(S)
    return rotate(columns, R[0]), rotate(columns, R[1]), rotate(columns, R[2])


# -- rotations ----------------------------------------------------------------------------------------


def about_x(sine, cosine, zero, one):
    """A turn about x; zero and one are numbers of the kind that is computed with."""
    return (one, zero, zero), (zero, cosine, -sine), (zero, sine, cosine)


def about_y(sine, cosine, zero, one):
    """A turn about y."""
    return (cosine, zero, sine), (zero, one, zero), (-sine, zero, cosine)


def about_z(sine, cosine, zero, one):
    """7.5 in space: what a rotary joint does whose axis is z."""
    return (cosine, -sine, zero), (sine, cosine, zero), (zero, zero, one)


def rotation_of_quaternion(x, y, z, w):
    """The rotation of a unit quaternion, scalar last (7.44 with the half angle's functions put in)."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


# -- positions ----------------------------------------------------------------------------------------


def point_position(d, R, p):
    """7.58, 7.60, 7.77: a point p of a frame that is displaced by d and turned by R."""
    return plus(d, rotate(R, p))


def interorigin_vector(d, z, a, x):
    """7.64: d along the axis z, then a along the common normal x."""
    return plus(times(d, z), times(a, x))


# -- velocities ---------------------------------------------------------------------------------------


def angular_velocity(w, z, v):
    """7.127, rotary: a joint turns about z at rate v."""
    return plus(w, times(v, z))


def tangential(w, d):
    """7.59: what turning does to a point d away."""
    return cross(w, d)


def point_velocity(vel, w, d):
    """7.59, 7.115, 7.128: another point of the same link, d away from the one whose velocity is vel."""
    return plus(vel, tangential(w, d))


def sliding_velocity(vel, z, v):
    """7.128, prismatic: a joint slides along z at rate v."""
    return plus(vel, times(v, z))


def moving_point_velocity(vel, w, p, u):
    """7.61, 7.124: a point p of a turning frame that moves in it with velocity u."""
    return plus(point_velocity(vel, w, p), u)


# -- accelerations ------------------------------------------------------------------------------------


def transverse(alpha, d):
    """7.123: what speeding up does to a point d away."""
    return cross(alpha, d)


def centripetal(w, d):
    """7.123: what turning does to a point d away."""
    return cross(w, cross(w, d))


def coriolis(w, u):
    """7.125: what turning does to what moves with velocity u in the turning frame."""
    return times(2, cross(w, u))


def angular_acceleration(alpha, w, z, v, a):
    """7.129, rotary: w is that of the link before the joint, which carries the axis round."""
    return plus(plus(alpha, times(a, z)), times(v, cross(w, z)))


def point_acceleration(acc, alpha, w, d):
    """7.123, 7.130: another point of the same link, d away from the one whose acceleration is acc."""
    return plus(plus(acc, transverse(alpha, d)), centripetal(w, d))


def sliding_acceleration(acc, w, z, v, a):
    """7.130, prismatic: sliding along z, which the links before the joint turn."""
    return plus(plus(acc, times(a, z)), coriolis(w, times(v, z)))


def moving_point_acceleration(acc, alpha, w, p, u, b):
    """7.125: a point p of a turning frame that moves in it with velocity u and acceleration b."""
    return plus(plus(point_acceleration(acc, alpha, w, p), coriolis(w, u)), b)


# -- joints that slide and turn at once, along axes that turn with what they move ----------------------


def free_angular_acceleration(alpha, w, o, b):
    """7.129 for a turning o that changes by b in the moved frame: the rate of w + R o, R-dot = S(w + o) R."""
    return plus(plus(alpha, b), cross(w, o))


def free_acceleration(acc, w, o, u, b):
    """7.130 for a sliding u that changes by b in the moved frame, which turns with w + o."""
    return plus(plus(acc, b), cross(plus(w, plus(w, o)), u))


# -- Jacobians ----------------------------------------------------------------------------------------


def turning_column(z, d):
    """7.80, 7.85, rotary: [z x d; z], with d from the joint's axis to the frame's origin."""
    return cross(z, d), z


def axis_rate(w, z):
    """The rate of an axis that rides on a link turning with w (7.37)."""
    return cross(w, z)


def turning_column_rate(z, z_rate, d, d_rate):
    """7.126: the rate of [z x d; z]."""
    return plus(cross(z_rate, d), cross(z, d_rate)), z_rate


def rate_in_turning_axes(rate, w, x):
    """The rate of the numbers of x in axes that turn with w."""
    return minus(rate, cross(w, x))


# -- second derivatives: how a column of the Jacobian changes with a rate, which 7.126 sums over the rates ---


def turned_along(w, linear, angular):
    """A column of 7.85 as a rate w before it turns it, axis and arm together."""
    return cross(w, linear), cross(w, angular)


def end_moved(z, linear):
    """The linear rows z x d of a turning column, as a rate behind it moves the end of d by its own."""
    return cross(z, linear)


def motion_product(linear_1, angular_1, linear_2, angular_2):
    """Of two columns for one point of the body: how the first moves what the second is the motion of."""
    return plus(cross(angular_1, linear_2), cross(linear_1, angular_2)), cross(angular_1, angular_2)
