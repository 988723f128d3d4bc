"""Bounds on the difference that rounding errors cause between two correct computations.

All tolerances of urdfkin use these bounds:

`tolerance = count * eps * scale`

The number eps is 2^-52. The error of one operation is at most eps/2 times the rounded number. The scale is an
upper bound on the sum of the absolute values of the result's terms. This module defines the counts, to first
order in eps.

| Scale | Module |
|---|---|
| definition | `urdfkin.kinematics.number_kinds` |
| forward recursion | `urdfkin.verify.bounds` |
| Denavit-Hartenberg tables | modules of `urdfkin.dh` |

**A joint.** For each joint, the recursion multiplies the rotation of the previous link by two rotations:

    R_i = R_{i-1} (constant rotation of joint i) (rotation about the axis of joint i)

If *all* rounding errors have the same sign, each joint increases the error of a vector's component by

| | urdfkin | Pinocchio |
|---|---|---|
| product with the constant rotation: three terms, fused (FMA) in urdfkin only | 1.5 | 1.8 |
| rotation about the axis, with its sine and cosine | 1.5 | 1.7 |
| constant rotation from roll, pitch, yaw; Pinocchio: by a normalised quaternion | 3.1 | 12.5 |
| all of a joint about a coordinate axis | 5.7 | 16.8 |
| for comparison: sum of the first three rows | 6.1 | 16.0 |
| cause of the difference | worst cases do not occur together | rotations add errors of several components |
| urdfkin and Pinocchio, with opposite signs | 5.7 + 16.8 = 22.5 | |

`tests/kinematics/test_roundings.py` computes the first four rows.

| Sum or product in a term, for example in the acceleration's term w x (w x d) | |
|---|---|
| factors of a term (`urdfkin.verify.bounds`) | two or three; here w, w and d |
| errors of cross products and sums, in each implementation | at most 2 for each term |
| first margin: one additional joint | for the frame's own offset and the first sum |
| second margin: `PINOCCHIO_ROUNDINGS` = 24 = 22.5 + 1.5 | for all other sums |

| Axes of the recursion's vectors | Vector | Rotations of the vector |
|---|---|---|
| world | z and R d of a joint | once by each earlier joint |
| link | w of link k | by the inverse rotation of each joint before link k |
| link | a term of link k | by each joint between link k and the frame, and once by R, the product of all |
| both | w x (w x d) | at most three times the number of joints on the path |

If a joint's axis is **not a coordinate axis**, urdfkin computes two more matrix products:

| | |
|---|---|
| constant rotation of joint i | R_i |
| rotation that turns z to the axis of joint i | A_i |
| computation of urdfkin | A_{i-1}^-1 R_i A_i |
| computation of Pinocchio | Rodrigues' formula |
| length of the axis | changes both results |

| Errors of a single joint | Count |
|---|---|
| all 340 rounding errors with the same sign; more than `PINOCCHIO_ROUNDINGS` | 41 |
| standard deviation of uniformly distributed rounding errors | 3.3 |
| `PINOCCHIO_ROUNDINGS`, seven times this standard deviation | 24 |

Pinocchio replaces an axis within 1e-12 of a coordinate axis by that coordinate axis. The rotation Q turns the
file's axis to the coordinate axis. The angle t of Q is the tilt. The replacement changes the joint's rotation
R by at most 2 t:

`|Q R Q^T - R| <= 2 |Q - 1| <= 2 t`

Therefore, a rotated vector and a translation along the axis have an error of at most 2 t. For all frames
after the joint, each factor's error increases by 2 t. If t > eps, urdfkin reports the finding URDF514.

**An export.** Exported code (`urdfkin.export`) computes the same equations, with these changes:

| Number in exported code | Change |
|---|---|
| product with 0 or 1 | omitted |
| entry of a constant rotation, less than half an eps of the largest entry in its row | omitted |
| component of an offset, less than half an eps of the largest component | omitted |
| each omission | error of 0.5, but one product and one sum are not rounded |
| product and sum | fused or not, as the compiler decides |
| sine and cosine | from a library; in C's batches from polynomials with an error of 1 |
| angle of the polynomials | reduced by three subtractions |

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

| Omission in an export | Error |
|---|---|
| one component of an offset | 0.5 |
| two components of an offset | 0.7, in multiples of the offset's length |
| products with an omitted component, in matrix rows and cross products | below 1.5, as in the first row |

| Difference of an export without fused multiply-adds | At most, for each joint |
|---|---|
| from Pinocchio, without the sums over the joints | 7.2 + 16.8 = 24.0 |
| `PINOCCHIO_ROUNDINGS`, which does not cover these sums | 24.0 |
| from test vectors, which contain true values | 7.2, within `PINOCCHIO_ROUNDINGS` |

The errors of an export and of urdfkin have the same standard deviation.

**Single precision.** `urdfkin.export.function` computes a bound for each number of a test vector. Each
operation and each constant has a value x. The bound is the sum of these products over all x:

`(rounding error of x) * |derivative of the result with respect to x|`

With eps = 2^-23, the error of one operation is

| | in eps of its value |
|---|---|
| a constant: its own rounding to single precision, 0 if it is a single-precision number | up to 0.5 |
| a sum, a difference, a product; fused products and sums have fewer roundings | 0.5 |
| a quotient, a square root; a compiler may write x / sqrt(y) as x rsqrt(y), with 1 for rsqrt and 0.5 | 1.0 |
| sine and cosine of a library: 3.5 units in the last place (SLEEF, used by PyTorch); CUDA has 2 | 3.5 |
| sine and cosine by the polynomials of C's batches, in eps of 1 | 1.0 |
| a change of sign | 0 |
| an input of a test vector, stored in single precision | 0 |

| Other errors | |
|---|---|
| number below the smallest normal number, 2^-126; GPUs and some compilers replace it by 0 | at most 2^-126 |
| constants: bound of the export in double precision | added, times 2^-52 / 2^-23 |

An export contains no other operations.

**MuJoCo.** The optional second oracle computes the orientation as a unit quaternion:

| At | MuJoCo's operations |
|---|---|
| each joint | normalises the axis |
| each joint | multiplies by the quaternions of the constant rotation and of the joint's rotation |
| each link | normalises the quaternion, and converts it to a matrix |

If all rounding errors have the same sign, the error is

| | MuJoCo |
|---|---|
| a joint about any axis: two products of quaternions, the norm, the matrix | 21.5 |
| with urdfkin's error | 21.5 + 5.7 = 27.2 |
| `MUJOCO_ROUNDINGS`, with a margin for the sums over the joints | 27.2 + 2.8 = 30 |

MuJoCo does not replace the file's axes by coordinate axes.

**Mimic joints.** A mimic joint adds no rounding error:

| | |
|---|---|
| angle of a mimic joint | m q + c, from the same doubles m and c in urdfkin and in the oracle |
| product and sum | rounded in this order, so IEEE 754 defines each bit |
| rule that refers to another mimic joint | combined in the same order, from the independent joint on |
| sine and cosine | errors in the first table above |
| subtraction of multiples of pi/2 from the angle | exact for every angle, even for 1e12 rad |

The checks therefore detect every mistake in a mimic joint's angle.

**A base.** `urdfkin.BaseMotion` gives the robot's root link a pose in the world:

| | |
|---|---|
| base with a rotation M | counts as one more joint of the path |
| base without a rotation | does not change the count |
| entries of the user's M | have at least nine correct decimals |
| nearest rotation to M | replaces M, by different methods in urdfkin and in Pinocchio |
| distance of M from this rotation | does not change the error |

The counts, with u = eps/2, are

| | urdfkin | Pinocchio |
|---|---|---|
| M^T M - I: nine sums of three products, 9 u in the Frobenius norm; the step uses half of it | 2.3 | |
| the difference M - M (M^T M - I)/2, u sqrt(3), and the remaining error of the step, u/8 | 0.9 | |
| K: sums of two or three numbers, 12 u; eigenvalues differ by 4; a quaternion's error counts twice | | 3.0 |
| the eigenvector once more by K + I: four products, 16 u, likewise; the division by its norm | | 5.0 |
| the quaternion's matrix | | 3.0 |
| a base's velocity and acceleration, expressed in its axes: two cross products and two sums | | 6.0 |
| sum | 3.2 | 17.0 |
| sum of both, within `PINOCCHIO_ROUNDINGS` | 20.2 | |
| largest measured errors; 1,500 matrices, reference values with 50 digits | 0.6 | 5.1 |

**MJCF equalities.** The tree's mimic rules satisfy an equality in an MJCF file up to rounding:

`y - y0 = c0 + c1 (x - x0)`

The numbers x and y are the values of two joints. The numbers x0 and y0 are reference values.

| | |
|---|---|
| the rule's offset y0 + c0 - c1 x0 | 1.5 |
| a rule that refers to a mimic joint: two products and a sum | 1.5 |
| x and y by their rules, m q + c | 2.0 |
| MuJoCo's residual: x - x0, c1 times that, y - y0, two differences | 2.5 |
| sum, at most `MJCF_MIMIC_ROUNDINGS` = 8 | 7.5 |

With k mimic rules between the mimic joint and the independent joint, the tolerance is:

`MJCF_MIMIC_ROUNDINGS * eps * (size of all terms in the table) * (k + 1)`

**Numbers near zero.** Let n = 2^-1022 be the smallest normal number. A product below n loses bits. The
smallest subnormal number is eps n, so the error of the product is at most eps n / 2. Every nonzero scale is
at least n (`urdfkin.kinematics.number_kinds`). Therefore, the tolerance is larger than this error:

`count * eps * scale >= count * eps n > eps n / 2`

A later product with a large number multiplies the error and the scale by the same factor.

**A row** of a Denavit-Hartenberg table has an error of at most 8:

| | |
|---|---|
| theta + q: half an eps of theta, up to pi; the half eps of q is counted with the angles | 1.6 |
| sine and cosine of that sum, of alpha and of beta; products of two of them in a Hayati row | 2.1 |
| the product of the row's two matrices (two terms), and that with the pose so far (three terms) | 3.8 |
| the sum of the pose's position and the row's | 0.5 |
| sum | 8.0 |

The tool counts as one more row.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.kinematics.inputs import FloatArray

EPS = sys.float_info.epsilon
#: Relative error of rounding a number to single precision.
SINGLE_ROUNDOFF = 2.0**-24
#: The smallest normal number.
SMALLEST_NORMAL = sys.float_info.min
#: `eps * scale` for the smallest nonzero scale, which is `SMALLEST_NORMAL`.
SMALLEST_SUBNORMAL = EPS * SMALLEST_NORMAL
#: Least divisor: `max(x, MIN_DIVISOR)` avoids a division by 0. Every measured number is larger.
MIN_DIVISOR = 1e-300

#: Without tilts, this is the allowed difference between urdfkin and Pinocchio:
#:     `joints * factors * PINOCCHIO_ROUNDINGS * eps * scale`
#: `joints` is the number of joints of the path plus one, or plus two for a rotated base. `factors` is the
#: number of factors of a term. For example, the term w x (w x d) has three factors. The docstring above
#: derives these rules.
PINOCCHIO_ROUNDINGS = 24.0
#: This is the allowed difference between urdfkin and MuJoCo:
#:     `joints * factors * MUJOCO_ROUNDINGS * eps * scale`
#: `joints` is the same number as for `PINOCCHIO_ROUNDINGS`. `factors` is twice the number of factors, because
#: MuJoCo's terms have more factors: MuJoCo computes at a centre of mass (`urdfkin.verify.bounds`).
MUJOCO_ROUNDINGS = 30.0
#: Allowed residual (in eps) of a mimic rule in an MJCF file, as computed by MuJoCo.
MJCF_MIMIC_ROUNDINGS = 8.0
#: Rounding error (in eps) that each row of a Denavit-Hartenberg table adds.
ROW_ROUNDINGS = 8.0

# Rounding errors of exports in single precision (`urdfkin.export.function`). The section "Single precision"
# of the docstring above derives these errors.

SINGLE_EPS = 2.0**-23
#: Smallest normal number and largest number in single precision.
SINGLE_SMALLEST, SINGLE_LARGEST = 2.0**-126, (2.0 - SINGLE_EPS) * 2.0**127
#: Relative error (in eps) of each operation.
SINGLE_OPERATION_ERRORS = dict.fromkeys("+-*", 0.5) | {
    "/": 1.0,
    "sqrt": 1.0,
    "neg": 0.0,
    "sin": 3.5,
    "cos": 3.5,
}
#: Absolute error (in eps) of a sine or cosine that a polynomial computes.
SINGLE_POLYNOMIAL_ERROR = 1.0

# Rounding errors between consecutive joint axes.
# The module `urdfkin.dh.common_normals` uses these numbers.

#: Allowed difference of the constant poses that two programs compute from the same file, in eps per joint.
#: The largest possible difference is 1.5 + 1.8 + 3.1 + 12.5 = 18.9 eps. The four counts are in rows 1 and 3
#: of the table "A joint" in the docstring above. The standard deviation is 2.4 eps, so the allowed difference
#: is 5.7 standard deviations.
CONSTANT_POSE_ROUNDINGS = 13.7
#: Rounding errors of the directions of two joint axes, in eps. For each axis, the division by the length has
#: an error of 0.5, and Rodrigues' formula has an error of 2.0.
AXIS_ROUNDINGS = 5.0
#: Error of the angle between consecutive axes, in eps per joint. Angles in a file are rounded. An angle with
#: fifteen digits (DBL_DIG) has an error of half a unit of its last digit. For angles up to pi, this error is
#: 5e-15 rad, or 22.5 eps. If both joint axes are z axes, roll and pitch both change the angle between the
#: joint axes. Yaw does not change this angle. Therefore, the error is twice 22.5 eps.
FILE_ANGLE_ROUNDINGS = 45.0
#: Rounding error of a length along a joint axis, as a multiple of eps times the path length. A dot product
#: has an error of 2.4 eps, and a sum of lengths has an error of 0.5 eps times the sum. Few sums of lengths
#: are nearly as large as the path length.
LENGTH_ROUNDINGS = 4.0

# Numbers within these tolerances are replaced by round numbers.

#: Rounding error (in multiples of eps rad) of an angle between -pi and pi. A computed multiple of pi/12 has
#: an error of 1.2, and a value of arctan2 has an error of 1.1. The rounding of a file's angle to a double has
#: an error of 1.0.
ANGLE_ROUNDINGS = 4.0
#: Error (in eps) of an entry of a rotation matrix. An entry is `a x - b y`, and this difference has an error
#: of 0.75. The factors x and y are differences of two products, also with an error of 0.75.
ENTRY_ROUNDINGS = 2.0
#: A length is rounded to twelve digits if the change is at most this number times eps times the path length.
SNAPPED_LENGTH_ROUNDINGS = LENGTH_ROUNDINGS / 2.0
#: Error (in eps) of the angle between two rotations. The first rotation is computed from roll, pitch and yaw,
#: with an error of 3.1 eps. The second rotation is a product of three rotations, with an error of 4.2 eps.
#: This error is 0.5 for the sines, 0.5 for the cosines, 1.4 for the first product, and 1.8 for the second.
ROTATION_ROUNDINGS = 8.0

#: Allowed error (in eps) of a mimicked joint's limit that is computed from a mimic joint's limit:
#:     `(limit of the mimic joint - offset) / multiplier`
#: The computation of the limit has a subtraction and a division. The mimic rule has a multiplication and an
#: addition. Each of these four operations has an error of 0.5, so the sum is 2.0. urdfkin moves each end of
#: the mimicked joint's range inwards by 4.0, which is twice the sum. Therefore, the mimic joint's limits
#: accept both ends of the narrowed range.
MIMIC_LIMIT_ROUNDINGS = 4.0


def joint_roundings(joints: ArrayLike, tilt: ArrayLike = 0.0) -> FloatArray:
    """Return the allowed difference (eps) between urdfkin and Pinocchio for each factor of a term.

    `PINOCCHIO_ROUNDINGS * joints + 2 tilt / eps`

    The caller counts the joints; `PINOCCHIO_ROUNDINGS` describes the usual count. `tilt` is the sum of the
    tilts (rad) of the path's joints.

    >>> joint_roundings([7, 8]).tolist()
    [168.0, 192.0]
    """
    return np.asarray(PINOCCHIO_ROUNDINGS * np.asarray(joints) + 2.0 * np.asarray(tilt) / EPS)


def table_roundings(rows: int) -> float:
    """Return an upper bound (eps) on the rounding error of a table's pose.

    The bound does not include the rounding of the joint values.
    """
    return ROW_ROUNDINGS * (rows + 1)


def written_urdf_roundings(rows: int) -> float:
    """Return the allowed difference (eps) between a table's pose and the pose of the URDF written from it.

    | Error | Multiple of `table_roundings(rows)` |
    |---|---|
    | pose of the table | 1 |
    | Pinocchio's pose of the URDF | 1 |
    | conversion to roll, pitch and yaw | 2 |
    """
    return 4.0 * table_roundings(rows)


def fitted_table_roundings(rows: int) -> float:
    """Return the allowed pose difference (eps) between a URDF and its fitted table.

    After the fit, the difference is at most 12.5 * table_roundings(rows).
    """
    return 12.5 * table_roundings(rows)
