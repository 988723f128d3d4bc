"""Compiled functions for the checks.

| Function | Purpose |
|---|---|
| `worst` | compares results |
| `coupling` | adds Jacobian columns of mimic joints |
| `lengths` | computes magnitudes for error bounds |
"""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

from urdfkin.compiled.machine.compiling import (
    FLOATS_1D,
    FLOATS_2D,
    INTS_1D,
    INTS_2D,
    WRITABLE_FLOATS_1D,
    WRITABLE_FLOATS_3D,
    WRITABLE_INTS_1D,
    inline_function,
    kernel,
)
from urdfkin.compiled.machine.memory import doubles_at, prefetch
from urdfkin.compiled.plan import JointMotion
from urdfkin.kinematics import lengths as steps
from urdfkin.kinematics.arithmetic import bind_equations, rebind_functions
from urdfkin.kinematics.roundings import EPS, SMALLEST_NORMAL, SMALLEST_SUBNORMAL

_INFINITY_BITS = 0x7FF0000000000000
_MASK_WITHOUT_SIGN = 0x7FFFFFFFFFFFFFFF
#: Prefetch distance: number of rows between the compared row and the row that is loaded into the cache.
_PREFETCH_DISTANCE = 4


@inline_function(fastmath={"reassoc"})
def _is_finite(x, i):
    # 0 times inf or NaN is NaN.
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * x[i, j]
    return total == 0.0


@inline_function(fastmath={"reassoc"})
def _is_difference_finite(x, y, i):
    total = 0.0
    for j in range(x.shape[1]):
        total += 0.0 * (x[i, j] - y[i, j])
    return total == 0.0


@inline_function(fastmath={"nnan", "nsz"})
def _in_eps_scale(difference, size):
    must_be_equal = math.inf if difference > 0.0 else 0.0
    return difference / max(EPS * size, SMALLEST_SUBNORMAL) if size > 0.0 else must_be_equal


@inline_function(fastmath={"nnan", "nsz"})
def _largest_difference(ours, theirs, scale, i, k):
    """Return the largest difference in row i, in multiples of eps * scale[k]; all numbers must be finite."""
    largest = 0.0
    for j in range(ours.shape[1]):
        largest = max(largest, _in_eps_scale(abs(ours[i, j] - theirs[i, j]), scale[k, j]))
    return largest


@inline_function()
def _has_equal_triples(scale, k):
    """Return whether scale[k] has three equal linear rows and three equal angular rows."""
    width = scale.shape[1] // 6
    equal = scale.shape[1] == 6 * width
    for first in range(0, 6 * width, max(3 * width, 1)):
        for j in range(first, first + width):
            equal = equal and scale[k, j] == scale[k, j + width] == scale[k, j + 2 * width]
    return equal


@inline_function()
def _divide_triples(ours, theirs, unit, width, units):
    """Write the largest difference of the rows x, y and z in column j to `units[j]`.

    The difference is in multiples of `unit[j]`, and may be NaN or inf.
    """
    for j in range(width):
        x = abs(ours[j] - theirs[j])
        y = abs(ours[j + width] - theirs[j + width])
        z = abs(ours[j + 2 * width] - theirs[j + 2 * width])
        largest = x if x > y else y
        largest = z if z > largest else largest
        multiple = largest / unit[j]
        units[j] = (multiple if largest != 0.0 else 0.0) + (0.0 * x + 0.0 * y + 0.0 * z)


@inline_function()
def _largest_bits(x, count):
    """Return the bits of the largest double.

    As integers, the bits of doubles >= 0 have the same order as the doubles. The function ignores the sign
    bit, because some processors set the sign bit of NaN.
    """
    most = 0
    for j in range(count):
        most = max(most, x[j] & _MASK_WITHOUT_SIGN)
    return most


@kernel(
    FLOATS_2D,
    FLOATS_2D,
    FLOATS_2D,
    WRITABLE_FLOATS_1D,
    WRITABLE_INTS_1D,
    WRITABLE_FLOATS_1D,
    WRITABLE_FLOATS_1D,
    WRITABLE_INTS_1D,
)
def worst(ours, theirs, scale, out, out_bits, unit, units, bits):
    """Compare two arrays row by row.

    The compiler can vectorize the maximum of integers, but not of doubles.

    - `scale`: the rows repeat if `scale` is shorter than `out`
    - `out`: largest difference in each row, in units of eps * scale; inf if a number or a scale is inf or NaN
    - `unit`, `units`: working memory, as large as `scale` and as one row of `scale`;
      used only if the rows repeat
    - `out_bits`, `bits`: views of `out` and `units` as integers
    """
    is_known_finite = has_triples = len(scale) < len(out)
    for k in range(len(scale)):
        is_known_finite = is_known_finite and _is_finite(scale, k)
        has_triples = has_triples and _has_equal_triples(scale, k)
    has_triples = has_triples and is_known_finite
    width, address = ours.shape[1] // 6, doubles_at(ours.ctypes.data)
    numbers = 6 * width
    if has_triples:
        for k in range(len(scale)):
            for j in range(numbers):
                size = scale[k, j]
                unit[k * numbers + j] = max(EPS * size, SMALLEST_SUBNORMAL) if size > 0.0 else 0.0
    for i in range(len(out)):
        k = i % len(scale)
        if has_triples:
            prefetch(address, min(i + _PREFETCH_DISTANCE, len(out) - 1) * numbers, numbers)
            for first in (0, 3 * width):
                rows, of_scale = slice(first, first + 3 * width), unit[k * numbers + first :]
                _divide_triples(ours[i, rows], theirs[i, rows], of_scale, width, units[first // 3 :])
            out_bits[i] = min(_largest_bits(bits, 2 * width), _INFINITY_BITS)
        elif not (_is_difference_finite(ours, theirs, i) and (is_known_finite or _is_finite(scale, k))):
            out[i] = math.inf
        else:
            out[i] = _largest_difference(ours, theirs, scale, i, k)
    return 0


@kernel(FLOATS_2D, INTS_1D, INTS_1D, FLOATS_1D, WRITABLE_FLOATS_1D)
def coupling(full, columns, index, factor, out):
    """Add Jacobian columns of mimic joints.

    Column i of `full` is multiplied by `factor[i]` and added to column `index[i]` of the sum. `out` contains
    the rows of the sum, one after the other.
    """
    nv = len(out) // max(1, len(full))
    for i in range(len(full)):
        for column in columns:
            out[i * nv + index[column]] += full[i, column] * factor[column]
    return 0


# -- lengths for error bounds ---------------------------------------------------------------------------

_TURN, _SLIDE = int(JointMotion.REVOLUTE), int(JointMotion.PRISMATIC)
#: Number of bounds per link: p, w, vel, alpha and acc. `free` also has five numbers for each planar or
#: floating joint (`urdfkin.verify.bounds._free_lengths`).
_STATE_SIZE = _FREE_SIZE = 5


@inline_function()
def _sum(x, y):
    return x + y


@inline_function()
def _product(x, y):
    """Multiply lengths without underflow to 0."""
    return SMALLEST_NORMAL if x * y < SMALLEST_NORMAL and x != 0.0 and y != 0.0 else x * y


@inline_function()
def _ignore_rotation(R, x):
    return x


_LENGTHS = {
    "plus": _sum,
    "minus": _sum,
    "rotate": _ignore_rotation,
    **dict.fromkeys(("times", "dot", "cross"), _product),
}
# Numba can call functions that are attributes of a module.
_EQUATIONS: Any = ModuleType("length_equations")
vars(_EQUATIONS).update(vars(bind_equations(decorate=inline_function(), **_LENGTHS)))
_STEPS = rebind_functions(steps, decorate=inline_function(), replacements={"eq": _EQUATIONS})
_translate_point, _after_revolute, _after_prismatic, _after_free_joint = (
    _STEPS[name] for name in ("translate_point", "after_revolute", "after_prismatic", "after_free_joint")
)


@inline_function()
def _read_state(x, i):
    return x[0, i], x[1, i], x[2, i], x[3, i], x[4, i]


@inline_function()
def _write_state(x, i, state):
    x[0, i], x[1, i], x[2, i], x[3, i], x[4, i] = state


@inline_function()
def _read_row(x, row, at):
    return x[row, at], x[row, at + 1], x[row, at + 2], x[row, at + 3], x[row, at + 4]


@inline_function()
def _write_scaled(x, first, count, at, factor, to):
    """Write factor * |x| to `to`. If x has one row, this row is used for all configurations."""
    step = 1 if len(x) > 1 else 0
    for i in range(count):
        to[i] = _product(factor, abs(x[(first + i) * step, at]))


@inline_function()
def _propagate_over_revolute(before, after, count, d, rates):
    for i in range(count):
        _write_state(after, i, _after_revolute(_read_state(before, i), d, rates[0, i], rates[1, i]))


@inline_function()
def _propagate_over_prismatic(before, after, count, d, offset, rates):
    for i in range(count):
        length = d + (rates[2, i] + offset)
        _write_state(after, i, _after_prismatic(_read_state(before, i), length, rates[0, i], rates[1, i]))


@inline_function()
def _propagate_over_free(before, after, first, count, d, free, at):
    step = 1 if len(free) > 1 else 0
    for i in range(count):
        displacement, o, u, o_rate, u_rate = _read_row(free, (first + i) * step, at)
        _write_state(
            after, i, _after_free_joint(_read_state(before, i), d + displacement, o, u, o_rate, u_rate)
        )


@kernel(
    INTS_2D,
    FLOATS_2D,
    INTS_2D,
    FLOATS_1D,
    FLOATS_2D,
    FLOATS_2D,
    FLOATS_2D,
    FLOATS_2D,
    FLOATS_2D,
    WRITABLE_FLOATS_3D,
    WRITABLE_FLOATS_1D,
)
def lengths(joints, joint_numbers, ends, tip_lengths, q, v, a, free, base, states, out):
    """Compute the lengths of all frames.

    Each of the arrays q, v, a, free and base has one row or n rows.

    - `joints`: kind, index in q, index in v, previous moving joint
    - `joint_numbers`: length from the previous moving joint, mimic multiplier, offset
    - `ends`: last moving joint before the frame, index in `out`
    - `tip_lengths`: length from the last moving joint
    - `free`: lengths from `urdfkin.verify.bounds._free_lengths`
    - `states`: working memory for a block: base, moving joints, one more state
    - `out`: `p`, `w`, `vel`, `alpha` and `acc` of `Magnitudes`
    """
    frames, block, rates = len(ends), states.shape[2], states[len(joints) + 1]
    n = len(out) // max(1, _STATE_SIZE * frames)
    for first in range(0, n, block):
        count, free_column = min(block, n - first), 0
        start, step = states[0], 1 if len(base) > 1 else 0
        for i in range(count):
            _write_state(start, i, _read_row(base, (first + i) * step, 0))
        for k in range(len(joints)):
            kind, at, parent = joints[k, 0], joints[k, 2], joints[k, 3]
            d, multiplier = joint_numbers[k, 0], joint_numbers[k, 1]
            before, after = states[parent + 1], states[k + 1]
            if kind > _SLIDE:
                _propagate_over_free(before, after, first, count, d, free, free_column)
                free_column += _FREE_SIZE
            else:
                _write_scaled(v, first, count, at, multiplier, rates[0])
                _write_scaled(a, first, count, at, multiplier, rates[1])
                if kind == _TURN:
                    _propagate_over_revolute(before, after, count, d, rates)
                else:
                    _write_scaled(q, first, count, joints[k, 1], multiplier, rates[2])
                    _propagate_over_prismatic(before, after, count, d, joint_numbers[k, 2], rates)
        for f in range(frames):
            before = states[ends[f, 0] + 1]
            for i in range(count):
                at = (first + i) * frames + ends[f, 1]
                state = _translate_point(_read_state(before, i), tip_lengths[f])
                for j in range(_STATE_SIZE):
                    out[j * n * frames + at] = state[j]
    return 0
