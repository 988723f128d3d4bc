"""How many roundings two correct computations may lie apart by: the one place where tolerances come from.

Everything is counted in eps = 2^-52 of what is rounded, each operation being off by half of that at most, and
to first order. The sizes that the counts multiply are elsewhere (`urdfkin.verify.bounds` for what the
recursion computes, the modules of `urdfkin.dh` for tables), the counts are all here.

**A joint.** It multiplies the rotation so far by its constant rotation and by its own turn. A number of a
rotated vector is off, where *all* roundings conspire, for each joint by

| | urdfkin | Pinocchio |
|---|---|---|
| the product with the constant: three terms, fused by urdfkin alone | 1.5 | 1.8 |
| the turn, with its sine and cosine | 1.5 | 1.7 |
| the constant, read from roll, pitch, yaw: products of sines; through a quaternion, normalised | 3.1 | 12.5 |
| all of a joint about a coordinate axis | 5.7 | 16.8 |

which is 22.5 together: not all that conspires in a part does so in the whole. The two may err in opposite
directions, hence the sum. `tests/kinematics/test_roundings.py` finds these counts by running the equations,
the same text, on numbers that remember each of their roundings.

Adding a joint's term to the sum and its cross product cost 2 eps at most on each side, for the two or three
factors of that term together (`bounds`). Counting one joint more than there is covers the frame's own offset
and the first of these sums; the rest is in rounding 22.5 up to `ROUNDINGS` = 24.

The walk may see its vectors in the world's axes or in a link's. In the world's, R d and z are turned by all
joints up to theirs, one factor each. In a link's, w as it comes to link k has been turned back by the joints
between, and a term made there by those up to the frame and, by R, once by all: for w x (w x d) no more than
three times the joints of the path, as many as the three factors have in the world's.

About an axis **askew** two more products stand before the turn: of the constant with the axis made z, and
with the one before it, turned back; Pinocchio has Rodrigues' formula, and the axis's length enters both. All
340 roundings conspiring make 41. That is not allowed for: with each anything up to its half unit, the
standard deviation is 3.3, and ROUNDINGS seven times that, for a single joint.

Pinocchio takes an axis within 1e-12 of a coordinate axis for that one. With Q the turn by the tilt t that
brings one axis to the other, |Q R Q^T - R| <= 2 |Q - 1| <= 2 t: a vector turned by the joint, or slid along
its axis, is off by 2 t at most, and so is each factor behind it. A larger tilt than eps is a finding
(URDF514). It adds 2 t / eps to the roundings of each factor, for the frames behind that joint and no others.

**An export** (`urdfkin.export`) writes the same equations without products with 0 and 1. What of a constant's
row, or of an offset, is less than half an eps of its largest number is left out: it is off by that half, and
the product and the sum that are gone are not rounded. Whether the rest is fused is the compiler's affair. Its
sine and cosine are a library's, or in C's batches polynomials of an angle that was reduced in three parts,
and then right to one eps: r is rounded twice, 0.5; the sum that makes the sine 0.25 and what is added there
0.1; for the cosine r counts 0.35, its square 0.13, the sums and the product behind it 0.08, 0.13 and 0.25.

| | fused | not fused |
|---|---|---|
| the product with a constant of which something is left out | | 1.5 |
| the turn, with such sine and cosine | 2.5 | 2.6 |
| all of an export's joint | 6.5 | 7.2 |

An offset's own numbers are off by 0.5 each where they are left out, 0.7 of its length: less than its products
with a row or a cross product's that are gone, 1.5. With Pinocchio's 16.8 an export's joint makes 24.0 where
nothing is fused, and the sums above come on top. That is not allowed for: the standard deviation is as
urdfkin's own. Against true values, as test vectors are, an export stands alone, with 7.2 of ROUNDINGS.

**MuJoCo**, where it is asked, goes another way: the orientation so far is a unit quaternion, which the
constant's quaternion and the turn's multiply, about an axis that it normalises; at each link it is brought to
norm 1 and made a matrix. All of that conspiring is

| | MuJoCo |
|---|---|
| a joint: two products of quaternions, the norm, the matrix, about any axis | 21.5 |

and with urdfkin's 5.7 it is 27.2, the rest up to `MUJOCO` = 30 being the same sums. Its axes are the file's.

A follower's angle counts nothing: urdfkin and the oracle compute fl(fl(m q) + c) with the same doubles m and
c (rules that follow rules are multiplied out from the leader's end, by both), which IEEE 754 defines to the
last bit, and neither fuses the two operations. What is left is sine and cosine, above, whose argument is
reduced without loss however large it is. So a slip in a follower's angle shows as it is, at 1e12 rad too.

**A base** that is turned counts as one joint more; one that is not rounds nothing. Both sides bring the
user's matrix M, right to nine digits, to the rotation nearest to it, each in its own way, so that how far M
is from a rotation does not enter:

| | urdfkin | Pinocchio |
|---|---|---|
| M^T M - I: nine sums of three products, 9 u in the Frobenius norm, of which the step takes half | 2.3 | |
| the difference M - M (M^T M - I)/2, u sqrt(3), and what the step leaves, u/8 | 0.9 | |
| K: sums of two or three numbers, 12 u; eigenvalues 4 apart; a quaternion's turn counts twice | | 3.0 |
| the eigenvector once more through K + I: four products, 16 u, likewise; the quotient by its norm | | 5.0 |
| the quaternion's matrix | | 3.0 |
| a base's velocity and acceleration, brought into its axes: two crosses and two sums | | 6.0 |
| | 3.2 | 17.0 |

with u = eps/2. 20.2 is within ROUNDINGS. Found were 0.6 and 5.1 for the rotation (1,500 matrices, against 50
digits).

**An MJCF equality** y - y0 = c0 + c1 (x - x0), of reference values y0 and x0, holds where the tree's mimic
rules put the joints, but for

| | |
|---|---|
| the rule's offset y0 + c0 - c1 x0 | 1.5 |
| a rule that follows a rule: the product of multipliers, that with the offset, the sum | 1.5 |
| x and y by their rules, m q + c | 2.0 |
| MuJoCo's residual: x - x0, c1 times that, y - y0, two differences | 2.5 |
| | 7.5 |

for each rule up to the joint that moves, and one more, times the size of all these terms.

**Numbers near zero.** Products below the smallest normal number lose bits one by one. Such a product is off
by 2^-1075, half the smallest subnormal number, which is (eps/2) times the smallest normal number: counting
every size that is not zero as that large at least (`urdfkin.kinematics.number_kinds`) puts it among the
roundings counted here, whatever it is multiplied with afterwards. The least unit is then eps times it,
2^-1074.

**A row** of a Denavit-Hartenberg table rounds its pose by 8 at most:

| | |
|---|---|
| theta + q: half an eps of theta, up to pi; that of q is counted with the angles | 1.6 |
| sine and cosine of that, of alpha and of beta; a Hayati row's products of two | 2.1 |
| the product of its two matrices, of two terms, and that with the pose so far, of three | 3.8 |
| the sum of the pose's position and the row's | 0.5 |
| | 8.0 |

The tool counts as one row more.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

EPS = sys.float_info.epsilon
#: The smallest normal number.
SMALLEST = sys.float_info.min
#: The smallest unit: eps times the smallest normal number, which is the smallest number of all.
LEAST_UNIT = EPS * SMALLEST
#: Divides in the place of a 0, where 0 is divided too: less than anything that is measured.
NOT_ZERO = 1e-300

#: For each joint and each factor, both computations together; derived above.
ROUNDINGS = 24.0
#: The same of urdfkin and MuJoCo together; derived above.
MUJOCO = 30.0
#: For each mimic rule of an MJCF file, between the tree and MuJoCo; derived above.
MJCF_RULE = 8.0
#: For each row of a table; derived above.
ROW = 8.0

# What of a constant pose between two joint axes is rounding (`urdfkin.dh.noise`).

#: For each URDF joint whose constant is folded into the pose, by two readers: of the 18.9 that conspire above
#: (all but the turn), the standard deviation is 2.4, and this nearly six times that.
CONSTANT = 13.7
#: For the two axes: each divided by its length, 0.5, or turned into place by Rodrigues' formula, 2.0.
AXES = 5.0
#: For each joint, in the program that wrote the file. A double that goes through text keeps fifteen digits
#: (DBL_DIG), so that an angle up to pi is off by half a unit of the fifteenth, 5e-15 rad or 22.5 eps; roll
#: and pitch tilt an axis, yaw does not.
WRITTEN = 45.0
#: Of a length along an axis, for the way on which positions are summed: the dot product that gives it, 2.4,
#: and 0.5 for each sum, of which few are as large as the whole way.
SUMMED = 4.0

# What is round but for rounding.

#: An angle up to pi: the multiples of pi/12, as they are computed, are off by 1.2; the number in a file, half
#: a unit in the last place, by 1.0, and arctan2 by 1.1.
ANGLE = 4.0
#: An entry of a rotation: a difference of two products, of which one was made of another such, 0.75 each.
ENTRY = 2.0
#: A length that twelve digits hold: half of what it may be off by.
DIGITS = SUMMED / 2.0
#: An angle between two rotations, one read from roll, pitch and yaw, 3.1, one the product of three turns:
#: sine and cosine, 0.5 each, and two products, 1.4 and 1.8.
TURN = 8.0

#: By how much the limits of a follower, referred to its leader, are too wide: a difference and a quotient
#: there, a product and a sum here, 0.5 each, and as much for the limits themselves to be kept.
FOLLOWER = 4.0


def of_joints(joints: ArrayLike, tilt: ArrayLike = 0.0) -> FloatArray:
    """For each factor, between two readers of a URDF.

    Args:
        joints: (...,) on the way.
        tilt: (...,) radians by which Pinocchio's axes on it are off the file's, added up.

    >>> of_joints([7, 8]).tolist()
    [168.0, 192.0]
    """
    return np.asarray(ROUNDINGS * np.asarray(joints) + 2.0 * np.asarray(tilt) / EPS)


def of_rows(rows: int) -> float:
    """Of a table's pose, its tool's included; what its angles round by (half of q) is not."""
    return ROW * (rows + 1)


def of_rows_read_back(rows: int) -> float:
    """Between a table and the URDF that was made of it.

    Pinocchio's side rounds as often as the table's own, the way through roll, pitch and yaw twice so.
    """
    return 4.0 * of_rows(rows)


def of_two_texts(joints: int) -> float:
    """Of a pose that a text gives by so many joints, between it and another text of the same robot.

    Each joint's constant is rounded by who read it and by who wrote it, its axis by both. Merging fixed
    joints multiplies their constants and writes the product, which rounds no more than that.
    """
    return (CONSTANT + WRITTEN + AXES) * (joints + 1)


def of_a_fit(rows: int) -> float:
    """Between a table and the fit of its freedoms to a URDF, which ends a dozen times off what rows round."""
    return 12.5 * of_rows(rows)
