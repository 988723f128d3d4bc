"""Which parameters a set of configurations can tell apart, which stand still for that, and why.

A change of parameters that moves no measured number cannot be found: it lies in the null space of the stacked
Jacobian. Its rank is how many numbers can be found, and is decided by what the columns are known to:
a singular value counts when its lower bound (`urdfkin.verify.singular_values`: Weyl, with what the columns
may be off by and what the decomposition leaves) is above 0. There is no tolerance to choose.

A turning joint's frame may slide along its axis and turn about it, a sliding joint's be shifted anywhere and
turn about its direction, if the next frame undoes it: of six for each of n joints and six for the tip, 4 for
each turning and 2 for each sliding joint and 6 can be found (Everett, Driels and Mooring, 1987), of positions
alone 3 fewer, for where the tool points is not seen.

What stands still is chosen place by place, base to tip, by orthogonal elimination: of columns that are nearly
as independent of those kept as the most independent one, the first in the model's order is kept. So no kept
parameter need be large to make up for one that stands still: that is what four parameters of nearly parallel
axes do, hundreds of metres that cancel.


The parameters with which a model comes closest to measured poses, and how well they are known.

Damped Gauss-Newton (Levenberg, 1944; Marquardt, 1963) on the tip's errors, each divided by its noise s. At
the minimum, with J the Jacobian of what is divided so and r what is left of it,

    C = (J^T J)^-1       the covariance of the parameters,
    H = J C J^T          what of each measurement the fit follows; 1 - H_ii of it is left to judge by.

Noise that nobody states is estimated from what is left, of positions and of turns apart: the sum of their
squares over the sum of their 1 - H_ii (Foerstner's variance components), until it stays.

A pose is **odd** when r_i^T (1 - H_ii)^-1 r_i, which is distributed as chi^2 with as many degrees of freedom
as it has numbers, is larger than the largest of so many good ones is in a hundred campaigns but one. The
largest is taken out and the rest fitted anew, until none is odd: one bad pose hides another.


Where the instrument stands and where its target is, from poses alone, before anything is fitted.

With T_i the robot's poses, M_i the measured ones, B the base and X the tool: M_i = B T_i X. The rotations are
linear in the two unknown ones together, R_B^T R_Mi = R_i R_X, and found as the null vector of all of these
(Shah, 2013); the positions are linear in the rest, p_Mi = R_B (R_i x + p_i) + b. Of positions alone base and
target are found in turns: each is a linear problem when the other is known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from urdfkin.calibration.parameters import Model
from urdfkin.errors import InputError
from urdfkin.kinematics.rotation import euler_of, log_rotation
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import FloatArray
from urdfkin.verify.singular_values import singular_values

#: Of the most independent column: what is as good.
_AS_GOOD = 0.5
#: How many parameters a reason names, and which share of what stands still one does at least.
_NAMED, _SHARE = 3, 1e-6


@dataclass(frozen=True)
class Identification:
    """What can be found.

    Attributes:
        kept: Numbers of the parameters that are fitted: the minimal set.
        still: Those that stand still, each with the reason.
        numbers: How many measured numbers there are.
    """

    kept: tuple[int, ...]
    still: dict[int, str]
    numbers: int

    @property
    def rank(self) -> int:
        """How many numbers can be found."""
        return len(self.kept)


def stacked(model: Model, values: FloatArray, *, complete: bool, at: FloatArray | None = None) -> FloatArray:
    """(rows, p) Jacobian of all that was measured, in metres: angles count at the distance `way.size`.

    Args:
        model: The model.
        values: (s, n) joint values.
        complete: Whether poses were measured, or positions alone.
        at: (p,) where; the model as it is when None.
    """
    L = model.way.size
    _, columns = model.way.columns(values, at)
    columns[:, 3:] *= L
    lengths = np.array([1.0 if parameter.unit == "m" else 1.0 / L for parameter in model.way.parameters])
    seen = columns[:, : 6 if complete else 3] * lengths
    return seen.reshape(-1, len(lengths)) if len(lengths) else np.empty((seen.size, 0))


def identify(
    model: Model, values: FloatArray, *, complete: bool = True, at: FloatArray | None = None
) -> Identification:
    """What configurations tell of a model.

    Args:
        model: The model.
        values: (s, n) joint values.
        complete: Whether poses are measured, or positions alone.
        at: (p,) parameters where this is asked; the model as it is when None.
    """
    J = stacked(model, values, complete=complete, at=at)
    error = np.full_like(J, model.way.rounding(values))
    kept = list[int]()
    for group in model.groups:
        among = [*kept, *group]
        wanted = _rank(J[:, among], error[:, among]) - len(kept)
        kept += _most_independent(J, kept, group, wanted)
    still = {k: _reason(model, J, error, kept, k) for group in model.groups for k in group if k not in kept}
    return Identification(tuple(kept), still, len(J))


def _rank(J: FloatArray, error: FloatArray) -> int:
    if not J.size:
        return 0
    lower = singular_values(J, error, np.ones(J.shape[1], dtype=bool)).values.lower
    return int(np.count_nonzero(lower > 0.0))


def _most_independent(J: FloatArray, kept: Sequence[int], group: Sequence[int], wanted: int) -> list[int]:
    Q, left, chosen = np.linalg.qr(J[:, list(kept)])[0], J[:, list(group)].copy(), list[int]()
    left -= Q @ (Q.T @ left)
    for _ in range(max(wanted, 0)):
        sizes = np.linalg.norm(left, axis=0)
        i = int(np.argmax(sizes >= _AS_GOOD * sizes.max()))
        chosen.append(group[i])
        direction = left[:, i] / sizes[i]
        left -= np.outer(direction, direction @ left)
        left[:, i] = 0.0
    return sorted(chosen, key=list(group).index)


def _reason(model: Model, J: FloatArray, error: FloatArray, kept: Sequence[int], k: int) -> str:
    column = J[:, k]
    if np.linalg.norm(column) <= np.linalg.norm(error[:, k]):
        return "moves nothing that is measured"
    shares = np.linalg.lstsq(J[:, list(kept)], column, rcond=None)[0] * np.linalg.norm(
        J[:, list(kept)], axis=0
    )
    shares = np.abs(shares) / np.linalg.norm(column)
    order = [i for i in np.argsort(-shares, kind="stable") if shares[i] > _SHARE]
    names = [str(model.way.parameters[kept[i]]) for i in order[:_NAMED]]
    more = f" and {len(order) - _NAMED} more" if len(order) > _NAMED else ""
    return f"does what {', '.join(names)}{more} {'do together' if len(order) > 1 else 'does'}"


_ROUNDS = 100
#: Of the largest singular value: where damping starts, and ends.
_DAMPING, _MOST = 1e-4, 1e3
#: Below what there is none, and where it starts again then.
_UNDAMPED, _AGAIN = _DAMPING**3, _DAMPING**2
#: What a success leaves of the damping, and how much more of it there is after a failure.
_EASING, _HARDER = 0.03, 10.0
#: Of the squared errors: what is no gain any more.
_NOTHING = 1e-13
#: For each measured number, in eps: what of their sum of squares changes by rounding alone.
_ROUNDED = 4.0
#: Counted numbers: fewer than half of one is none.
_ONE_OR_MORE = 0.5
#: Of a pose's largest share that is left to judge by: a direction with less is followed by the fit.
_FOLLOWED = 1e-9
#: How often noise is estimated, and by what share it may still change.
_ESTIMATES, _STAYS = 20, 1e-3
#: In how many campaigns without an odd pose one is called so.
WRONGLY = 0.01
#: Standard deviations: a parameter that moved by less is not written.
SIGMAS = 2.0
#: Of all poses: more than these are no odd ones.
_MOST_ODD = 0.25


@dataclass(frozen=True, eq=False)
class Measured:
    """What was measured.

    Attributes:
        values: (s, n) joint values of the path, rad or m.
        p: (s, 3) positions in the base, m.
        R: (s, 3, 3) orientations; None where positions alone were measured.
    """

    values: FloatArray
    p: FloatArray
    R: FloatArray | None = None

    @property
    def complete(self) -> bool:
        """Whether orientations are there."""
        return self.R is not None

    def __len__(self) -> int:
        return len(self.p)

    def some(self, which: NDArray[np.bool_]) -> Measured:
        """Those that `which` (s,) chooses."""
        return Measured(self.values[which], self.p[which], None if self.R is None else self.R[which])


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of each number that is measured.

    Attributes:
        metres: Of a coordinate of a position.
        radians: Of a turn about an axis.
    """

    metres: float
    radians: float

    def of(self, complete: bool) -> FloatArray:
        """(6,) or (3,), for one pose."""
        return np.array([self.metres] * 3 + ([self.radians] * 3 if complete else []))


@dataclass(frozen=True, eq=False)
class Fit:
    """The end of a fit.

    Attributes:
        at: (p,) all parameters.
        errors: (s, 6) or (s, 3): measured minus computed, in the base, m and rad.
        noise: What it was weighted by.
        covariance: (k, k) of the kept parameters, in their units; inf where nothing is left to judge by.
        left: (s, 6) or (s, 3): which share of each number is left to judge by, 1 - H_ii.
        odd: (s,) chi^2 of each pose.
    """

    at: FloatArray
    errors: FloatArray
    noise: Noise
    covariance: FloatArray
    left: FloatArray
    odd: FloatArray

    @property
    def freedom(self) -> float:
        """How many numbers more were measured than fitted."""
        return float(self.left.sum())

    @property
    def is_judged(self) -> bool:
        """Whether there are numbers to judge by."""
        return self.freedom >= _ONE_OR_MORE

    @property
    def ratio(self) -> float:
        """The noise that is left by that which was stated: 1 but for 1/sqrt(2 freedom) or so."""
        if not self.is_judged:
            return math.nan
        whitened = self.errors / self.noise.of(self.errors.shape[1] == 6)
        return math.sqrt(float((whitened**2).sum()) / self.freedom)

    @property
    def spread(self) -> float:
        """The standard deviation of that ratio."""
        return 1.0 / math.sqrt(2.0 * max(self.freedom, _ONE_OR_MORE))

    def rms(self) -> tuple[float, float | None]:
        """Of positions (the vector's length, m) and of turns (rad)."""
        position, turn = (np.sqrt((x**2).sum(axis=1).mean()) for x in np.hsplit(self.errors, [3]))
        return float(position), float(turn) if self.errors.shape[1] == 6 else None


def errors(model: Model, measured: Measured, at: FloatArray) -> FloatArray:
    """(s, 6) or (s, 3) measured minus computed, [position; turn] in the base."""
    T = model.way.poses(measured.values, at)
    away = measured.p - T[:, :3, 3]
    if measured.R is None:
        return away
    return np.hstack([away, log_rotation(measured.R @ T[:, :3, :3].swapaxes(-1, -2))])


def best_fit(
    model: Model, measured: Measured, kept: Sequence[int], noise: Noise | None, at: FloatArray
) -> Fit:
    """The best fit.

    Args:
        model: What is fitted.
        measured: To what.
        kept: Numbers of the parameters that may move.
        noise: As it is known; None: to be estimated.
        at: (p,) where to begin.
    """
    weights = noise or Noise(1.0, 1.0 / model.way.size)
    for _ in range(1 if noise else _ESTIMATES):
        at = _descended(model, measured, kept, weights, at)
        found = _ended(model, measured, kept, weights, at)
        if noise or not found.is_judged:
            break
        estimated = _estimated(found, model, measured)
        stays = abs(estimated.metres - weights.metres) <= _STAYS * weights.metres and (
            not measured.complete or abs(estimated.radians - weights.radians) <= _STAYS * weights.radians
        )
        weights = estimated
        if stays:
            break
    found = _ended(model, measured, kept, weights, at)
    if noise is None and not found.is_judged:
        found = replace(found, covariance=np.full_like(found.covariance, np.inf))
    return found


def _estimated(found: Fit, model: Model, measured: Measured) -> Noise:
    """Noise from what is left; no less than rounding, or there would be nothing to divide by."""
    rounding = model.way.rounding(measured.values)

    def of(part: slice, least: float, former: float) -> float:
        left = float(found.left[:, part].sum())
        size = float((found.errors[:, part] ** 2).sum())
        return max(math.sqrt(size / left), least) if left > _ONE_OR_MORE else former

    return Noise(
        of(slice(0, 3), rounding, found.noise.metres),
        of(slice(3, 6), rounding / model.way.size, found.noise.radians),
    )


def _whitened(
    model: Model, measured: Measured, kept: Sequence[int], noise: Noise, at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Errors (rows,) and columns (rows, k), divided by the noise."""
    scale = noise.of(measured.complete)
    _, columns = model.way.columns(measured.values, at)
    J = columns[:, : len(scale), list(kept)] / scale[:, np.newaxis]
    r = (errors(model, measured, at) / scale).ravel()
    return r, J.reshape(r.size, len(kept))


def _descended(
    model: Model, measured: Measured, kept: Sequence[int], noise: Noise, at: FloatArray
) -> FloatArray:
    scale, damping = noise.of(measured.complete), _DAMPING

    def size(at: FloatArray) -> float:
        return float(np.linalg.norm(errors(model, measured, at) / scale))

    now = size(at)
    for _ in range(_ROUNDS):
        r, J = _whitened(model, measured, kept, noise, at)
        units = np.linalg.norm(J, axis=0)
        units[units == 0.0] = 1.0
        U, S, Vt = np.linalg.svd(J / units, full_matrices=False)
        before, along = now, U.T @ r
        if float(along @ along) <= _NOTHING * now**2:
            break
        while damping <= _MOST:
            factor = S / (S**2 + (damping * S[0]) ** 2) if S.size else S
            trial = at.copy()
            trial[list(kept)] += Vt.T @ (factor * along) / units
            if (after := size(trial)) < now:
                at, now, damping = trial, after, _EASING * damping
                break
            damping = max(_HARDER * damping, _AGAIN)
        if now >= before * (1.0 - _ROUNDED * EPS * len(r)):
            break
        damping = 0.0 if damping < _UNDAMPED else damping
    return at


def _ended(model: Model, measured: Measured, kept: Sequence[int], noise: Noise, at: FloatArray) -> Fit:
    r, J = _whitened(model, measured, kept, noise, at)
    k = noise.of(measured.complete).size
    units = np.linalg.norm(J, axis=0)
    units[units == 0.0] = 1.0
    Q, R = np.linalg.qr(J / units)
    half = np.linalg.solve(R, np.eye(len(R))) / units[:, np.newaxis]
    blocks = Q.reshape(len(measured), k, len(kept))
    judged = np.eye(k) - blocks @ blocks.swapaxes(-1, -2)
    own = r.reshape(-1, k)
    odd = np.einsum("si,sij,sj->s", own, np.linalg.pinv(judged, rcond=_FOLLOWED, hermitian=True), own)
    left = np.clip(np.einsum("sii->si", judged), 0.0, 1.0)
    return Fit(at, errors(model, measured, at), noise, half @ half.T, left, odd)


def odd_poses(
    model: Model, measured: Measured, kept: Sequence[int], noise: Noise | None, found: Fit
) -> tuple[tuple[int, ...], Fit]:
    """Numbers of the poses that do not belong to the others, and the fit without them."""
    out = list[int]()
    # No fewer numbers may be left than there are parameters, and a quarter is no exception any more.
    most = min(int(_MOST_ODD * len(measured)), len(measured) - 1 - -(-len(kept) // found.errors.shape[1]))
    clean = found
    while len(out) < most:
        inside = np.setdiff1d(np.arange(len(measured)), out)
        worst = int(np.argmax(clean.odd))
        if clean.odd[worst] <= quantile(1.0 - WRONGLY / len(measured), clean.errors.shape[1]):
            break
        out.append(int(inside[worst]))
        chosen = np.ones(len(measured), dtype=bool)
        chosen[out] = False
        clean = best_fit(model, measured.some(chosen), kept, noise, clean.at)
    return tuple(sorted(out)), clean


def significant(moved: FloatArray, covariance: FloatArray, fixed: Sequence[bool]) -> NDArray[np.bool_]:
    """(k,) which parameters moved by more than `SIGMAS` standard deviations, by backward elimination.

    The least significant is put back to where it was, which moves the others by their covariance with it,
    until all that are left are significant: of two that are known together only, one stays.

    Args:
        moved: (k,) by how much each moved.
        covariance: (k, k) of these; inf where nothing is known of it.
        fixed: (k,) those that are in any case.

    >>> significant(np.array([3.0, 1.0]), np.eye(2), [False, False]).tolist()
    [True, False]
    """
    stays, free = np.ones(len(moved), dtype=bool), ~np.array(fixed, dtype=bool)
    if not np.isfinite(covariance).all():
        return ~free
    x, C = moved.copy(), covariance.copy()
    while (rest := np.flatnonzero(stays & free)).size:
        sizes = np.abs(x[rest]) / np.sqrt(C[rest, rest])
        k = rest[int(np.argmin(sizes))]
        if sizes.min() > SIGMAS:
            break
        column, variance = C[:, k].copy(), C[k, k]
        x -= column * (x[k] / variance)
        C -= np.outer(column, column) / variance
        stays[k] = False
    return stays


def quantile(share: float, freedom: int) -> float:
    """Of chi^2 (Wilson and Hilferty, 1931): right to a few per cent, also far out."""
    step = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - step + NormalDist().inv_cdf(share) * math.sqrt(step)) ** 3


#: Turns that base and target take at most, and by what share of its way the target may still move.
_TURNS, _FIXED_END = 200, 1e-9
#: How many times as far as the robot's tip goes measured positions may be spread: millimetres are a thousand.
_FARTHER = 100.0


def starting(model: Model, measured: Measured) -> FloatArray:
    """(p,) parameters of the model as it is, with base and tool as the poses have them."""
    at = model.way.start.copy()
    places = {parameter.where for parameter in model.way.parameters if parameter.end}
    if not places:
        return at
    T = model.way.poses(measured.values)
    free = "base" in places, "tool" in places
    B, X = (
        _complete(T, measured.p, measured.R, *free) if measured.R is not None else _seen(T, measured.p, *free)
    )
    for which, end in (("base", B), ("tool", X)):
        six = [*end[:3, 3], *euler_of("XYZ", end[:3, :3])]
        for k, parameter in enumerate(model.way.parameters):
            if parameter.end and parameter.where == which:
                at[k] = six[("x", "y", "z", "rx", "ry", "rz").index(parameter.what)]
    return at


def _complete(
    T: FloatArray, p: FloatArray, R: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    B, X = np.eye(4), np.eye(4)
    if base and tool:
        B[:3, :3], X[:3, :3] = _rotations(T[:, :3, :3], R)
    elif base:
        B[:3, :3] = _rotation(np.einsum("sij,skj->ik", R, T[:, :3, :3]))
    else:
        X[:3, :3] = _rotation(np.einsum("sji,sjk->ik", T[:, :3, :3], R))
    B[:3, 3], X[:3, 3] = _shifts(T, p, B[:3, :3], base, tool)
    return B, X


def _seen(T: FloatArray, p: FloatArray, base: bool, tool: bool) -> tuple[FloatArray, FloatArray]:
    """Base and target from positions alone."""
    B, X = np.eye(4), np.eye(4)
    for _ in range(_TURNS if base and tool else 1):
        if base:
            points = T[:, :3, :3] @ X[:3, 3] + T[:, :3, 3]
            B[:3, :3] = _rotation((p - p.mean(axis=0)).T @ (points - points.mean(axis=0)))
        before = X[:3, 3].copy()
        B[:3, 3], X[:3, 3] = _shifts(T, p, B[:3, :3], base, tool)
        if np.linalg.norm(X[:3, 3] - before) <= _FIXED_END * np.linalg.norm(X[:3, 3]):
            break
    return B, X


def _rotations(R: FloatArray, M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R_B and R_X of R_B^T M_i = R_i R_X: M_i^T R_B - R_X^T R_i^T = 0, vectors by rows."""
    unit = np.eye(3)
    left = np.einsum("sab,cd->sacbd", M.swapaxes(-1, -2), unit).reshape(-1, 9)
    right = np.einsum("ab,scd->sacbd", unit, R).reshape(-1, 9)
    null = np.linalg.svd(np.hstack([left, -right]), full_matrices=False)[2][-1]
    B, X_back = null[:9].reshape(3, 3), null[9:].reshape(3, 3)
    sign = np.sign(np.linalg.det(B)) or 1.0
    return _rotation(sign * B), _rotation(sign * X_back).T


def _rotation(M: FloatArray) -> FloatArray:
    """The rotation nearest to any matrix."""
    U, _, Vt = np.linalg.svd(M)
    if np.linalg.det(U @ Vt) < 0.0:
        U[:, 2] *= -1.0
    return np.asarray(U @ Vt)


def _shifts(
    T: FloatArray, p: FloatArray, R_B: FloatArray, base: bool, tool: bool
) -> tuple[FloatArray, FloatArray]:
    """The vectors b and x of p_Mi = R_B R_i x + R_B p_i + b."""
    rest = (p - T[:, :3, 3] @ R_B.T).ravel()
    parts = []
    if base:
        parts.append(np.tile(np.eye(3), (len(p), 1)))
    if tool:
        parts.append((R_B @ T[:, :3, :3]).reshape(-1, 3))
    found = np.asarray(np.linalg.lstsq(np.hstack(parts), rest, rcond=None)[0], np.float64)
    nothing = np.zeros(3)
    return found[:3] if base else nothing, found[-3:] if tool else nothing


def demand_plausible(model: Model, measured: Measured) -> None:
    """Raise InputError where positions can be no metres: they spread much farther than the robot's.

    Raises:
        InputError: as said.
    """
    T = model.way.poses(measured.values)
    ours, theirs = (
        float(np.linalg.norm(x - x.mean(axis=0), axis=1).max()) for x in (T[:, :3, 3], measured.p)
    )
    if ours > 0.0 and theirs > _FARTHER * ours:
        raise InputError(
            "measured positions spread farther than the robot's",
            found=f"{theirs:.4g} m, where the robot's tip goes {ours:.4g} m",
            remedy="say --unit mm, unit='mm', if that is what they are in",
        )
