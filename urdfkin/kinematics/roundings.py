"""Bounds on the difference of two correct computations, in numbers of roundings; all tolerances use them.

The unit is eps = 2^-52 times the rounded number. Each operation has an error of half an eps at most. Errors
are counted to first order. A tolerance is a count of this module times a scale. The scales are computed
elsewhere: in `urdfkin.verify.bounds` for the forward recursion, and in the modules of `urdfkin.dh` for
tables.

**A joint.** For each joint, the recursion multiplies the rotation so far by the joint's constant rotation and
by its rotation about its axis. If *all* roundings add up, the error of a component of a rotated vector grows
for each joint by

| | urdfkin | Pinocchio |
|---|---|---|
| product with the constant rotation: three terms, fused (FMA) in urdfkin only | 1.5 | 1.8 |
| rotation about the axis, with its sine and cosine | 1.5 | 1.7 |
| constant rotation from roll, pitch, yaw; Pinocchio: by a normalised quaternion | 3.1 | 12.5 |
| all of a joint about a coordinate axis | 5.7 | 16.8 |

The worst cases of the parts do not occur together, so the error of the whole joint is smaller than the sum of
the parts. The two errors may have opposite signs, so the bound for the difference is 5.7 + 16.8 = 22.5.
`tests/kinematics/test_roundings.py` computes these counts: it runs the same equations on numbers that record
each of their roundings.

The sum over the joints and the cross product of each term add 2 eps at most in each implementation, for the
two or three factors of that term together (`bounds`). The count uses one joint more than the path has. This
covers the frame's own offset and the first of these sums. Rounding 22.5 up to `ROUNDINGS` = 24 covers the
others.

The recursion expresses its vectors in the world's axes or in a link's. In the world's axes, each of R d and z
is rotated by all joints before it, once for each factor. In a link's axes, w of link k is rotated back by the
joints before it. A term of link k is rotated by the joints up to the frame, and R rotates it once by all
joints. For w x (w x d) these are at most three times the joints of the path, as for the three factors in the
world's axes.

A joint about an axis that is **not a coordinate axis** needs two more products before its rotation. One is
the constant rotation times the rotation that turns z to the axis. The other is the product with the inverse
of that rotation, for the previous joint. Pinocchio uses Rodrigues' formula. In urdfkin and in Pinocchio, the
result depends on the length of the axis. If all 340 roundings add up, the error is 41. The bound does not
allow for this. If each rounding is uniformly distributed in its half unit, the standard deviation is 3.3.
`ROUNDINGS` is seven standard deviations for a single joint.

Pinocchio replaces an axis within 1e-12 of a coordinate axis by that coordinate axis. Let Q be the rotation
that turns the file's axis to the coordinate axis, and let t be its angle (the tilt). Then |Q R Q^T - R| <= 2
|Q - 1| <= 2 t. A vector that the joint rotates, or moves along its axis, has an error of 2 t at most. Each
later factor also has an error of 2 t at most. A tilt larger than eps is a finding (URDF514). It adds 2 t /
eps to the roundings of each factor, for the frames after that joint only.

**An export** (`urdfkin.export`) writes the same equations without products with 0 and 1. A number of a
constant's row or of an offset is omitted if it is less than half an eps of the largest number there. This
causes an error of half an eps, but the product and the sum that are omitted have no rounding. The compiler
decides whether products and sums are fused. The sine and cosine are those of a library. In batches in C they
are polynomials of an angle that is reduced in three parts, with an error of one eps:

| Roundings of the polynomials, with r the reduced angle | |
|---|---|
| sine: r, rounded twice | 0.5 |
| sine: the sum | 0.25 |
| sine: the terms that are added to it | 0.1 |
| cosine: r | 0.35 |
| cosine: the square of r | 0.13 |
| cosine: the two sums and the last product | 0.08, 0.13, 0.25 |

The counts of an export's joint are

| | fused | not fused |
|---|---|---|
| product with a constant in which a number is omitted | | 1.5 |
| rotation about the axis, with such a sine and cosine | 2.5 | 2.6 |
| all of an export's joint | 6.5 | 7.2 |

Omitting components of an offset causes an error of 0.5 each, 0.7 of its length. This is less than the 1.5 of
the omitted products with a row, or of those of a cross product. With Pinocchio's 16.8, an export's joint has
24.0 if nothing is fused, plus the sums above. The bound does not allow for this; the standard deviation is
the same as urdfkin's. The comparison of an export with true values (test vectors) uses 7.2 of `ROUNDINGS`.

**An export in single precision** has a bound of its own for each number of a test vector. The unit is eps =
2^-23. `urdfkin.export.single` multiplies the error of each operation and of each constant by the derivative
of the result, and adds the absolute values. The error of one operation is

| | in eps of its value |
|---|---|
| a constant: its own rounding to single precision, 0 if it is a single-precision number | up to 0.5 |
| a sum, a difference, a product; fused products and sums have fewer roundings | 0.5 |
| a quotient, a square root; a compiler may write x / sqrt(y) as x rsqrt(y), with 1 for rsqrt and 0.5 | 1.0 |
| sine and cosine of a library: two units in the last place, CUDA's bound; others have smaller ones | 2.0 |
| sine and cosine by the polynomials of C's batches, in eps of 1 | 1.0 |

A change of sign has no error. The inputs of test vectors are single-precision numbers, which have no error
either. A number below the smallest normal number, 2^-126, has an error of 2^-126 at most, because GPUs and
some compilers replace it by 0. The code's constants have the errors of the double code: its bound is added,
multiplied by 2^-52 / 2^-23. These are the only errors: an export has no other operations.

**MuJoCo**, the optional second oracle, computes the orientation as a unit quaternion. It multiplies this
quaternion by those of the constant rotation and of the joint's rotation, about an axis that it normalises. At
each link it normalises the quaternion and converts it to a matrix. If all roundings add up, the error is

| | MuJoCo |
|---|---|
| a joint about any axis: two products of quaternions, the norm, the matrix | 21.5 |

With urdfkin's 5.7 the difference is 27.2. Rounding it up to `MUJOCO` = 30 covers the same sums as above.
MuJoCo uses the axes of the file.

**A mimic joint** adds no rounding. urdfkin and the oracle compute its angle as fl(fl(m q) + c), with the same
doubles m and c, and neither fuses the two operations. IEEE 754 then defines the result to the last bit. Both
multiply out chains of mimic rules in the same order, starting with the mimicked joint. The errors of sine and
cosine are counted above; the reduction of their argument is exact for every size. A mistake in a mimic
joint's angle is therefore detected, even at 1e12 rad.

**A base** that is rotated counts as one joint more. A base that is not rotated adds no rounding. The user's
matrix M has nine correct digits. Both implementations replace it by the nearest rotation, each by its own
method. The distance of M from a rotation therefore does not matter. The counts, with u = eps/2, are

| | urdfkin | Pinocchio |
|---|---|---|
| M^T M - I: nine sums of three products, 9 u in the Frobenius norm; the step uses half of it | 2.3 | |
| the difference M - M (M^T M - I)/2, u sqrt(3), and the remaining error of the step, u/8 | 0.9 | |
| K: sums of two or three numbers, 12 u; eigenvalues differ by 4; a quaternion's error counts twice | | 3.0 |
| the eigenvector once more by K + I: four products, 16 u, likewise; the division by its norm | | 5.0 |
| the quaternion's matrix | | 3.0 |
| a base's velocity and acceleration, expressed in its axes: two cross products and two sums | | 6.0 |
| sum | 3.2 | 17.0 |

The sum 20.2 is within `ROUNDINGS`. The largest measured errors of the rotation are 0.6 and 5.1 (1,500
matrices, compared with 50 digits).

**An MJCF equality** is y - y0 = c0 + c1 (x - x0), with reference values y0 and x0. The tree's mimic rules
satisfy it up to

| | |
|---|---|
| the rule's offset y0 + c0 - c1 x0 | 1.5 |
| a rule that refers to a mimic joint: two products and a sum | 1.5 |
| x and y by their rules, m q + c | 2.0 |
| MuJoCo's residual: x - x0, c1 times that, y - y0, two differences | 2.5 |
| sum | 7.5 |

This is multiplied by the size of all these terms and by the number of rules up to the mimicked joint, plus
one.

**Numbers near zero.** A product below the smallest normal number loses bits. Its error is 2^-1075, half the
smallest subnormal number, which is (eps/2) times the smallest normal number. Every scale that is not zero is
therefore at least the smallest normal number (`urdfkin.kinematics.number_kinds`). The counts of this module
then cover this error too, also after later multiplications. The least unit is eps times that number, 2^-1074.

**A row** of a Denavit-Hartenberg table has 8 roundings at most:

| | |
|---|---|
| theta + q: half an eps of theta, up to pi; the half eps of q is counted with the angles | 1.6 |
| sine and cosine of that sum, of alpha and of beta; products of two of them in a Hayati row | 2.1 |
| the product of the row's two matrices (two terms), and that with the pose so far (three terms) | 3.8 |
| the sum of the pose's position and the row's | 0.5 |
| sum | 8.0 |

The tool counts as one row more.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

EPS = sys.float_info.epsilon
#: Relative error of a number that was rounded to single precision.
SINGLE = 2.0**-24
#: The smallest normal number.
SMALLEST = sys.float_info.min
#: The smallest unit of rounding: eps times the smallest normal number. It is the smallest subnormal number.
LEAST_UNIT = EPS * SMALLEST
#: This number replaces a divisor 0 if the dividend is 0 too. It is smaller than every measured number.
NOT_ZERO = 1e-300

#: Roundings for each joint and each factor, of urdfkin and Pinocchio together; derived above.
ROUNDINGS = 24.0
#: Roundings for each joint and each factor, of urdfkin and MuJoCo together; derived above.
MUJOCO = 30.0
#: Roundings for each mimic rule of an MJCF file, between the tree and MuJoCo; derived above.
MJCF_RULE = 8.0
#: Roundings for each row of a table; derived above.
ROW = 8.0

# An export in single precision (`urdfkin.export.single`); derived above.

SINGLE_EPS = 2.0**-23
#: The smallest normal number, and the largest number.
SINGLE_SMALLEST, SINGLE_LARGEST = 2.0**-126, (2.0 - SINGLE_EPS) * 2.0**127
#: Error of each operation, in eps of its value.
SINGLE_OPERATION = {
    "+": 0.5,
    "-": 0.5,
    "*": 0.5,
    "/": 1.0,
    "sqrt": 1.0,
    "neg": 0.0,
    "sin": 2.0,
    "cos": 2.0,
}
#: Error of a sine or a cosine by polynomials, in eps of 1.
SINGLE_POLYNOMIAL = 1.0

# Rounding errors in the constant pose between two joint axes (`urdfkin.dh.common_normals`).

#: For each URDF joint with a constant transform in the pose, by two parsers. The worst case is 18.9 (the
#: table above without the rotation about the axis). The standard deviation is 2.4, and this is nearly six
#: times that.
CONSTANT = 13.7
#: For the two axes: each is divided by its length, 0.5, or rotated into place by Rodrigues' formula, 2.0.
AXES = 5.0
#: For each joint, in the program that wrote the file. A double that is written with fifteen digits (DBL_DIG)
#: has an error of half a unit in the last digit. For an angle up to pi this is 5e-15 rad or 22.5 eps. It
#: counts for roll and pitch, which tilt an axis; yaw does not.
WRITTEN = 45.0
#: For a length along an axis, in units of the length of the path whose positions are summed: 2.4 for the dot
#: product, and 0.5 for each sum; few sums are as large as the whole path.
SUMMED = 4.0

# Numbers that are round up to rounding errors.

#: An angle up to pi: 1.2 for a computed multiple of pi/12, 1.0 for the number in a file (half a unit in the
#: last place), and 1.1 for arctan2.
ANGLE = 4.0
#: An entry of a rotation: a difference of two products, 0.75; one factor is itself such a difference, 0.75.
ENTRY = 2.0
#: A length with twelve digits: half of its largest error.
DIGITS = SUMMED / 2.0
#: An angle between two rotations. One is computed from roll, pitch and yaw, 3.1. The other is the product of
#: three rotations: sine and cosine, 0.5 each, and two products, 1.4 and 1.8.
TURN = 8.0

#: Widening of the limits of a mimic joint when they are converted to the mimicked joint: 0.5 each for a
#: difference and a quotient there and for a product and a sum here, and as much again so that a value at the
#: limits is accepted.
FOLLOWER = 4.0


def of_joints(joints: ArrayLike, tilt: ArrayLike = 0.0) -> FloatArray:
    """Return the number of roundings for each factor of a term.

    It is for a comparison of two programs that read the same URDF.

    Args:
        joints: (...,) number of joints on the path.
        tilt: (...,) radians, the sum over the path's joints of the angle between Pinocchio's axis and the
            file's axis.

    >>> of_joints([7, 8]).tolist()
    [168.0, 192.0]
    """
    return np.asarray(ROUNDINGS * np.asarray(joints) + 2.0 * np.asarray(tilt) / EPS)


def of_rows(rows: int) -> float:
    """Return the number of roundings of the pose that a table and its tool give.

    It does not contain the half eps of q, which is counted with the angles.
    """
    return ROW * (rows + 1)


def of_rows_read_back(rows: int) -> float:
    """Return the number of roundings in a comparison of a table with the URDF that was written from it.

    Pinocchio's computation has as many roundings as the computation with the table. The conversion to roll,
    pitch and yaw has twice as many.
    """
    return 4.0 * of_rows(rows)


def of_two_texts(joints: int) -> float:
    """Return the number of roundings of a pose after `joints` joints, for two URDF texts of the same robot.

    The parser and the writer round each joint's constant transform and its axis. If fixed joints are merged,
    the writer rounds the product of their constants, which adds no more roundings.
    """
    return (CONSTANT + WRITTEN + AXES) * (joints + 1)


def of_a_fit(rows: int) -> float:
    """Return the number of roundings in a comparison of a URDF with a table that was fitted to it.

    A fit ends within 12.5 times `of_rows`.
    """
    return 12.5 * of_rows(rows)
