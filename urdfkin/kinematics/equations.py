"""The textbook's equations of motion (sections 7.3 to 7.7) for many kinds of numbers.

A vector is a triple of numbers (x, y, z), and a rotation is a triple of rows. The module imports nothing,
because the equations use the arithmetic of their arguments. Therefore, each equation is written only once.
The kinds of numbers are batches in vector registers, NumPy arrays, numbers with 50 digits, intervals, lengths
of vectors, and LaTeX expressions.

For NumPy arrays and for lengths of vectors, `urdfkin.kinematics.number_kinds` replaces the functions of the
section "vectors".

| Argument | Meaning |
|---|---|
| `R`, `S` | rotations |
| `sine`, `cosine` | sine and cosine of the rotation angle |
| `zero`, `one` | 0 and 1 in the number type of `sine` |
| `w`, `alpha` | angular velocity and angular acceleration of a link or frame |
| `vel`, `acc` | velocity and acceleration of the frame's origin, or of a point P of the link |
| `d` | vector from the origin or from P to another point |
| `z`, `v`, `a` | a joint's axis, velocity and acceleration; z is fixed to the link before the joint |
| `p`, `u`, `b` | position, velocity and acceleration of a point in a moving frame |
| `o`, `u` | angular and linear velocity of a planar or floating joint |
| `b` | time derivatives of the components of o or u |

All vectors of an equation are expressed in the same axes. These are the world's axes, as in the textbook, or
the link's own axes. In the link's own axes, z and the offset of an `<origin>` are constant.

The textbook and a URDF number the frames differently. In the textbook, the offset d_{i-1,i} belongs to link i
and follows joint i. In a URDF, the frame of a joint lies on the joint's own axis. The `<origin>` of joint i
in a URDF contains an offset that belongs to link i-1 and precedes joint i. Both numberings give the same
sums.
"""

# -- vectors ------------------------------------------------------------------------------------------


def plus(x, y):
    """Return x + y."""
    return x[0] + y[0], x[1] + y[1], x[2] + y[2]


def minus(x, y):
    """Return x - y."""
    return x[0] - y[0], x[1] - y[1], x[2] - y[2]


def times(c, x):
    """Return c x."""
    return c * x[0], c * x[1], c * x[2]


def dot(x, y):
    """Return x . y."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def cross(x, y):
    """Return the cross product S(x) y (7.16)."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


def rotate(R, x):
    """Return R x, expressed in the outer frame."""
    return dot(R[0], x), dot(R[1], x), dot(R[2], x)


def transposed(R):
    """Return R^T, the inverse of R (7.11)."""
    return (R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2])


def product(R, S):
    """Return R S."""
    columns = transposed(S)
    return rotate(columns, R[0]), rotate(columns, R[1]), rotate(columns, R[2])


# -- rotations ----------------------------------------------------------------------------------------


def about_x(sine, cosine, zero, one):
    """Return a rotation about x."""
    return (one, zero, zero), (zero, cosine, -sine), (zero, sine, cosine)


def about_y(sine, cosine, zero, one):
    """Return a rotation about y."""
    return (cosine, zero, sine), (zero, one, zero), (-sine, zero, cosine)


def about_z(sine, cosine, zero, one):
    """Return a rotation about z (7.5, extended to three dimensions)."""
    return (cosine, -sine, zero), (sine, cosine, zero), (zero, zero, one)


def rotation_of_quaternion(x, y, z, w):
    """Return the rotation of a unit quaternion; w is the scalar part."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


# -- positions ----------------------------------------------------------------------------------------


def point_position(d, R, p):
    """7.58, 7.60, 7.77: position of a point p."""
    return plus(d, rotate(R, p))


def interorigin_vector(d, z, a, x):
    """7.64: interorigin vector `d z + a x`."""
    return plus(times(d, z), times(a, x))


# -- velocities ---------------------------------------------------------------------------------------


def angular_velocity(w, z, v):
    """7.127, rotary: angular velocity after the joint."""
    return plus(w, times(v, z))


def tangential(w, d):
    """7.59: tangential velocity of a point."""
    return cross(w, d)


def point_velocity(vel, w, d):
    """7.59, 7.115, 7.128: velocity of a point Q of a link.

    Point P has the velocity vel. The vector d leads from P to Q.
    """
    return plus(vel, tangential(w, d))


def sliding_velocity(vel, z, v):
    """7.128, prismatic: velocity after the joint."""
    return plus(vel, times(v, z))


def moving_point_velocity(vel, w, p, u):
    """7.61, 7.124: velocity of a moving point."""
    return plus(point_velocity(vel, w, p), u)


# -- accelerations ------------------------------------------------------------------------------------


def transverse(alpha, d):
    """7.123: transverse acceleration of a point."""
    return cross(alpha, d)


def centripetal(w, d):
    """7.123: centripetal acceleration of a point."""
    return cross(w, cross(w, d))


def coriolis(w, u):
    """7.125: Coriolis acceleration of a moving point."""
    return times(2, cross(w, u))


def angular_acceleration(alpha, w, z, v, a):
    """7.129, rotary: angular acceleration after the joint."""
    return plus(plus(alpha, times(a, z)), times(v, cross(w, z)))


def point_acceleration(acc, alpha, w, d):
    """7.123, 7.130: acceleration of a point Q of a link.

    Point P has the acceleration acc. The vector d leads from P to Q.
    """
    return plus(plus(acc, transverse(alpha, d)), centripetal(w, d))


def sliding_acceleration(acc, w, z, v, a):
    """7.130, prismatic: acceleration after the joint."""
    return plus(plus(acc, times(a, z)), coriolis(w, times(v, z)))


def moving_point_acceleration(acc, alpha, w, p, u, b):
    """7.125: acceleration of a moving point."""
    return plus(plus(point_acceleration(acc, alpha, w, p), coriolis(w, u)), b)


# -- planar and floating joints -----------------------------------------------------------------------
# The joint's velocity is expressed in the axes of the link after the joint. The vector b contains the time
# derivatives of the joint velocity's components. The axes of the link after the joint rotate with the angular
# velocity w + o.


def free_angular_acceleration(alpha, w, o, b):
    """7.129: angular acceleration after a planar or floating joint."""
    return plus(plus(alpha, b), cross(w, o))


def free_acceleration(acc, w, o, u, b):
    """7.130: acceleration after a planar or floating joint."""
    return plus(plus(acc, b), cross(plus(w, plus(w, o)), u))


# -- Jacobians ----------------------------------------------------------------------------------------


def turning_column(z, d):
    """7.80, 7.85: column [z x d; z] of a revolute joint.

    The vector d leads from the joint to the frame.
    """
    return cross(z, d), z


def axis_rate(w, z):
    """7.37: time derivative of an axis that is fixed to a link."""
    return cross(w, z)


def turning_column_rate(z, z_rate, d, d_rate):
    """7.126: time derivative of [z x d; z]."""
    return plus(cross(z_rate, d), cross(z, d_rate)), z_rate


def rate_in_turning_axes(rate, w, x):
    """Return the time derivative of x in rotating axes.

    rate:  time derivative of x in fixed axes
    w:     angular velocity of the rotating axes
    """
    return minus(rate, cross(w, x))


# -- derivatives of Jacobian columns with respect to one joint -----------------------------------------
# The time derivative of column i is a sum over all joints j (7.126):
#     `d(column i)/dq_j * v_j`


def derivative_by_earlier_joint(w, linear, angular):
    """7.85: derivative of column i with respect to joint j <= i.

    w:  angular part of column j
    """
    return cross(w, linear), cross(w, angular)


def derivative_by_later_joint(z, linear):
    """7.85: derivative of the linear part of column i with respect to joint j > i.

    z:       axis of joint i
    linear:  linear part of column j
    """
    return cross(z, linear)


def motion_product(linear_1, angular_1, linear_2, angular_2):
    """Return the spatial cross product of two columns.

    | reference | the product is the derivative of |
    |---|---|
    | WORLD | column 2 with respect to the earlier joint 1 |
    | LOCAL | column 1 with respect to the later joint 2 |
    """
    return plus(cross(angular_1, linear_2), cross(linear_1, angular_2)), cross(angular_1, angular_2)
