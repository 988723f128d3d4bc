"""Bounds on the difference that rounding errors cause between two correct computations.

All tolerances of urdfkin use these bounds. The unit of an error is eps = 2^-52 times the rounded number. Each
operation has an error of at most half an eps. Errors are counted to first order. A tolerance is `count * eps
* scale`. A result is a sum of terms. The scale of the result is an upper bound on the sum of the absolute
values of these terms (`urdfkin.kinematics.number_kinds`). This module defines the counts.
`urdfkin.verify.bounds` computes the scales for the forward recursion. The modules of `urdfkin.dh` compute the
scales for Denavit-Hartenberg tables.

**A joint.** For each joint, the recursion multiplies the rotation of the previous link by two rotations. The
first rotation is the joint's constant rotation. The second rotation is the joint's motion about its axis. If
*all* rounding errors have the same sign, the error of a component of a rotated vector grows for each joint by

| | urdfkin | Pinocchio |
|---|---|---|
| product with the constant rotation: three terms, fused (FMA) in urdfkin only | 1.5 | 1.8 |
| rotation about the axis, with its sine and cosine | 1.5 | 1.7 |
| constant rotation from roll, pitch, yaw; Pinocchio: by a normalised quaternion | 3.1 | 12.5 |
| all of a joint about a coordinate axis | 5.7 | 16.8 |

The last row is computed for the whole joint, and is not the sum of the first three rows. For urdfkin, the
three rows sum to 6.1. The error of the whole joint is smaller, because the worst cases of the three rows do
not occur together. For Pinocchio, the three rows sum to 16.0. The error of the whole joint is larger, because
a rotation adds the errors of several components. The errors of urdfkin and of Pinocchio may have opposite
signs, so the bound for the difference is 5.7 + 16.8 = 22.5. `tests/kinematics/test_roundings.py` computes the
counts of the table. The test evaluates the equations with objects that act as numbers and record each
rounding error.

For example, the acceleration of a frame is a sum of terms such as w x (w x d). This term has the three
factors w, w and d. The cross products in a term cause further rounding errors. The addition of the terms
causes rounding errors as well. In each implementation, these further errors sum to at most 2 eps for each
term. A term has two or three factors (`urdfkin.verify.bounds`). Two margins cover these errors. First, the
tolerance is computed for a path with one additional joint. The margin of the additional joint covers the
error of the frame's own offset and the error of the first sum. Second, `PINOCCHIO_ROUNDINGS` is 24, which is
1.5 more than 22.5. The margin of 1.5 covers the errors of all other sums.

The recursion expresses its vectors in the world's axes or in a link's axes. In the world's axes, each joint
rotates the axis z and the offset R d of every later joint once. In a link's axes, the inverse rotation of
each joint before link k multiplies the angular velocity w of link k. A term of link k, such as w x (w x d),
is multiplied by the rotation of each joint between link k and the frame. Finally this term is multiplied once
by R, the product of all rotations. For w x (w x d), the number of rotations is at most three times the number
of joints of the path. This limit holds in the world's axes and in a link's axes.

If a joint's axis is **not a coordinate axis**, urdfkin computes two more matrix products for this joint. Let
R_i be the constant rotation of joint i, and let A_i be the rotation that turns z to the axis of joint i.
urdfkin computes A_{i-1}^-1 R_i A_i. Pinocchio uses Rodrigues' formula. In urdfkin and in Pinocchio, the
result depends on the length of the axis. If all 340 rounding errors have the same sign, the total error is
41. `PINOCCHIO_ROUNDINGS` does not cover this worst case. If each rounding error is uniformly distributed over
its range, the standard deviation of the sum is 3.3. For a single joint, `PINOCCHIO_ROUNDINGS` is seven times
this standard deviation.

Pinocchio replaces an axis within 1e-12 of a coordinate axis by that coordinate axis. Let Q be the rotation
that turns the file's axis to the coordinate axis, and let the tilt t be the angle of Q. Then |Q R Q^T - R| <=
2 |Q - 1| <= 2 t. If the joint rotates a vector, or translates a vector along the joint's axis, the error is
at most 2 t. The bound 2 t holds for all vectors after this joint. Therefore, the allowed difference of each
factor of a term increases by 2 t. In units of eps, this increase is 2 t / eps. The increase applies to all
frames after the joint. If a tilt is larger than eps, urdfkin reports the finding URDF514.

**An export.** Exported code (`urdfkin.export`) computes the same equations, but omits multiplications by 0
and by 1. An export also omits small constants. An entry of a constant rotation matrix is small if the entry
is less than half an eps of the largest entry in the same row. A component of an offset is small if the
component is less than half an eps of the largest component. Each omission causes an error of half an eps, but
the rounding errors of one product and one sum disappear. The compiler decides whether products and sums are
fused. An export uses the sine and cosine of a library. Only batches in C use polynomials with an error of one
eps; three subtractions reduce the polynomials' angle.

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

Each omitted component of an offset causes an error of 0.5; two components cause an error of 0.7 of the
offset's length. In matrix rows and cross products, an export omits each product that contains an omitted
component. The error of this omission is smaller than 1.5, the count of a product in the table. Without fused
multiply-adds, an export and Pinocchio differ by at most 7.2 + 16.8 = 24.0 eps for each joint. The errors of
the sums over the joints are added to this difference. `PINOCCHIO_ROUNDINGS` is 24.0 and does not cover these
sums. The standard deviation of the error is the same for an export and for urdfkin. Test vectors contain true
values. Therefore, the difference between an export and test vectors is at most 7.2 eps. This difference is
within `PINOCCHIO_ROUNDINGS`.

**Single precision.** An export in single precision has a separate bound for each number of a test vector. The
unit is eps = 2^-23. The value x of each operation and of each constant has a rounding error.
`urdfkin.export.function` multiplies this rounding error by the derivative of the result with respect to x.
The bound is the sum of the absolute values of these products for all x. The error of one operation is

| | in eps of its value |
|---|---|
| a constant: its own rounding to single precision, 0 if it is a single-precision number | up to 0.5 |
| a sum, a difference, a product; fused products and sums have fewer roundings | 0.5 |
| a quotient, a square root; a compiler may write x / sqrt(y) as x rsqrt(y), with 1 for rsqrt and 0.5 | 1.0 |
| sine and cosine of a library: 3.5 units in the last place (SLEEF, used by PyTorch); CUDA has 2 | 3.5 |
| sine and cosine by the polynomials of C's batches, in eps of 1 | 1.0 |

A change of sign has no error. The inputs of a test vector are stored as single-precision numbers, so they
have no rounding error. GPUs and some compilers replace a number below the smallest normal number, 2^-126, by
0. Therefore, the error of such a number is at most 2^-126. The constants also have the rounding errors of the
export in double precision. The factor 2^-52 / 2^-23 converts the bound on these errors to the unit of single
precision. The converted bound is added to the bound of single precision. An export contains only the
operations of the table, so this section counts all errors.

**MuJoCo.** The optional second oracle computes the orientation as a unit quaternion. For each joint, MuJoCo
normalises the joint's axis. MuJoCo then multiplies the quaternion by the quaternion of the constant rotation
and by the quaternion of the joint's rotation. At each link, MuJoCo normalises the quaternion and converts it
to a matrix. If all rounding errors have the same sign, the error is

| | MuJoCo |
|---|---|
| a joint about any axis: two products of quaternions, the norm, the matrix | 21.5 |

Together with urdfkin's error of 5.7, the bound for the difference is 27.2. `MUJOCO_ROUNDINGS` is 30, which is
2.8 more than 27.2. The margin of 2.8 covers the errors of the sums over the joints. MuJoCo does not replace
the file's axes by coordinate axes.

**Mimic joints.** A mimic joint adds no rounding error. The angle of a mimic joint is m q + c. urdfkin and the
oracle compute this angle from the same doubles m and c. Both programs round the multiplication and then the
addition, so IEEE 754 defines the result to the last bit. If a mimic joint mimics another mimic joint, urdfkin
and the oracle combine the rules in the same order. Both programs start with the rule that refers to the
independent joint. The first table above contains the errors of sine and cosine. The functions sine and
cosine first subtract multiples of pi/2 from the angle. This subtraction is exact for every angle, even for
1e12 rad. Therefore a mistake in a mimic joint's angle is always detected.

**A base.** `urdfkin.BaseMotion` gives the robot's root link a pose in the world. A base with a rotation M
counts as one more joint of the path. A base without a rotation does not change the count. The entries of the
user's matrix M have at least nine correct decimals. urdfkin and Pinocchio replace M by the nearest rotation,
with different methods. Therefore, the error does not depend on the distance of M from the nearest rotation.
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

The sum 20.2 is within `PINOCCHIO_ROUNDINGS`. The largest measured errors of the rotation are 0.6 for urdfkin
and 5.1 for Pinocchio. The measurement used 1,500 matrices and reference values with 50 digits.

**MJCF equalities.** An equality in an MJCF file is y - y0 = c0 + c1 (x - x0). Here x and y are the values of
two joints, with the reference values x0 and y0. The tree's mimic rules satisfy the equality up to

| | |
|---|---|
| the rule's offset y0 + c0 - c1 x0 | 1.5 |
| a rule that refers to a mimic joint: two products and a sum | 1.5 |
| x and y by their rules, m q + c | 2.0 |
| MuJoCo's residual: x - x0, c1 times that, y - y0, two differences | 2.5 |
| sum | 7.5 |

The tolerance is this sum, multiplied by the size of all terms in the table and by k + 1. Here k is the number
of mimic rules between the mimic joint and the independent joint.

**Numbers near zero.** A product below the smallest normal number loses bits. The error of such a product is
at most 2^-1075. This number is half the smallest subnormal number, or (eps/2) times the smallest normal
number. Therefore, every scale except 0 is at least the smallest normal number
(`urdfkin.kinematics.number_kinds`). With this scale, the tolerance `count * eps * scale` is larger than the
error 2^-1075. If a later operation multiplies the product by a large number, the error and the scale grow by
the same factor. The tolerance is therefore still large enough. The smallest unit is eps times the smallest
normal number, 2^-1074.

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
#: Smallest nonzero value of `eps * scale`: the smallest subnormal number.
LEAST_UNIT = EPS * SMALLEST_NORMAL
#: Least divisor: `max(x, MIN_DIVISOR)` avoids a division by 0. Every measured number is larger.
MIN_DIVISOR = 1e-300

#: urdfkin and Pinocchio may differ by at most joints * factors * PINOCCHIO_ROUNDINGS * eps * scale.
#: A tilt increases this limit. `joints` is the number of joints of the path plus one, or plus two for a
#: rotated base. The docstring above derives these rules.
#: `factors` is the number of factors of a term. For example, the term w x (w x d) has three factors.
PINOCCHIO_ROUNDINGS = 24.0
#: urdfkin and MuJoCo may differ by at most joints * factors * MUJOCO_ROUNDINGS * eps * scale.
#: `joints` is the same number as for Pinocchio.
#: `factors` is twice as large, because MuJoCo computes at a centre of mass (`urdfkin.verify.bounds`).
MUJOCO_ROUNDINGS = 30.0
#: Allowed difference (in eps) between urdfkin and MuJoCo in a mimic rule of an MJCF file.
MJCF_RULE_ROUNDINGS = 8.0
#: Rounding error (in eps) that each row of a Denavit-Hartenberg table adds.
ROW_ROUNDINGS = 8.0

# Rounding errors of exports in single precision (`urdfkin.export.function`).
# The section "Single precision" of the docstring above derives these errors.

SINGLE_EPS = 2.0**-23
#: Smallest normal number and largest number in single precision.
SINGLE_SMALLEST, SINGLE_LARGEST = 2.0**-126, (2.0 - SINGLE_EPS) * 2.0**127
#: Relative error (in eps) of each operation.
SINGLE_OPERATION = dict.fromkeys("+-*", 0.5) | {"/": 1.0, "sqrt": 1.0, "neg": 0.0, "sin": 3.5, "cos": 3.5}
#: Absolute error (in eps) of a sine or cosine that a polynomial computes.
SINGLE_POLYNOMIAL = 1.0

# Rounding errors of a joint axis relative to the previous axis (`urdfkin.dh.common_normals`).

#: Allowed difference of constant poses from the same file,
#: in eps per joint.
#: Largest possible difference: 1.5 + 1.8 + 3.1 + 12.5 = 18.9 eps,
#: from the first and third row of the first table above.
#: Standard deviation: 2.4 eps, so 13.7 is nearly six of them.
CONSTANT_POSE_ROUNDINGS = 13.7
#: Rounding errors in the directions of two joint axes, in eps.
#: Each axis: 0.5 from the division by its length,
#: and 2.0 from Rodrigues' formula.
AXIS_ROUNDINGS = 5.0
#: Error of the angle between consecutive axes, in eps per joint.
#: Angles in a file are rounded.
#: With fifteen digits (DBL_DIG), the error is half a unit of the last digit:
#: 5e-15 rad, or 22.5 eps, for angles up to pi.
#: Roll and pitch both change the angle between the axes.
#: Yaw does not change this angle.
#: Therefore, the error is twice 22.5 eps.
FILE_ROUNDINGS = 45.0
#: Rounding error of a length along a joint axis.
#: Unit: eps times the length of the path.
#: Dot product: 2.4 eps. Sum of lengths: 0.5 eps times the sum.
#: Few of these sums are nearly as long as the path.
LENGTH_ROUNDINGS = 4.0

# Numbers within these tolerances are replaced by round numbers.

#: Rounding error of an angle between -pi and pi, in eps rad.
#: Computed multiple of pi/12: 1.2. Value of arctan2: 1.1.
#: Number in a file: 1.0.
ANGLE_ROUNDINGS = 4.0
#: Error of a rotation matrix entry, in eps.
#: The entry is a difference of two products. This difference causes an error of 0.75.
#: In both products, one factor is a difference of two products.
#: This factor adds an error of 0.75.
ENTRY_ROUNDINGS = 2.0
#: Largest change when a length is rounded to twelve digits.
#: Unit: eps times the length of the path.
DECIMAL_ROUNDINGS = LENGTH_ROUNDINGS / 2.0
#: Error (in eps) of the angle between two rotations.
#: First rotation, from roll, pitch and yaw: 3.1 eps.
#: The second rotation is a product of three rotations.
#: The product's error is the sum of four errors.
#: Sines and cosines: 0.5 each.
#: Two matrix multiplications: 1.4 and 1.8.
ROTATION_ROUNDINGS = 8.0

#: Allowed error of a mimicked joint's computed limit, in eps.
#: Subtraction, division, multiplication and addition: 0.5 each.
#: The sum of the four errors is 2.0.
#: Twice this sum accepts both ends of the converted range.
MIMIC_LIMIT_ROUNDINGS = 4.0


def joint_roundings(joints: ArrayLike, tilt: ArrayLike = 0.0) -> FloatArray:
    """Return the allowed difference (in eps) between urdfkin and Pinocchio for a term with one factor.

    For a term with several factors, the allowed difference is multiplied by the number of factors. For
    example, the term w x (w x d) has three factors. `joints` is the number of joints on the path. `tilt` is
    the sum over these joints of the angle (radians) between Pinocchio's axis and the file's axis.

    >>> joint_roundings([7, 8]).tolist()
    [168.0, 192.0]
    """
    return np.asarray(PINOCCHIO_ROUNDINGS * np.asarray(joints) + 2.0 * np.asarray(tilt) / EPS)


def table_roundings(rows: int) -> float:
    """Return the rounding error (in eps) of a pose that is computed from a table with `rows` rows and a tool.

    The rounding of the joint values, half an eps, is not included.
    """
    return ROW_ROUNDINGS * (rows + 1)


def read_back_roundings(rows: int) -> float:
    """Return the allowed difference (in eps) between a table and the URDF that was written from the table.

    The table's pose has the error `table_roundings(rows)`. Pinocchio's pose of the URDF has the same error.
    The conversion to roll, pitch and yaw has twice this error.
    """
    return 4.0 * table_roundings(rows)


def fit_roundings(rows: int) -> float:
    """Return the allowed difference (in eps) between a URDF and a table that was fitted to the URDF.

    The fit is iterative. After the last iteration, the error can be up to 12.5 times `table_roundings(rows)`.
    """
    return 12.5 * table_roundings(rows)
