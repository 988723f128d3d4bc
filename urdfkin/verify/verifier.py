"""Compare a robot's results with an oracle (Pinocchio or MuJoCo), and record the checks.

The oracle receives the user's arguments. `Verifier.check` receives results in the user's batch shape, and
therefore also finds errors in the conversion to this shape.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from urdfkin.compiled import preload
from urdfkin.compiled.plan import CompiledTree, IntArray
from urdfkin.errors import InputError, OracleError, RangeError, warn_caller
from urdfkin.errors.validators import safe_repr
from urdfkin.kinematics.roundings import EPS, MIN_DIVISOR, joint_roundings
from urdfkin.model.base_motion import FIXED_BASE_STATE, BaseMotion
from urdfkin.model.configuration import draw_samples, warn_of_degrees
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.system.lazy_import import urdfkin_version
from urdfkin.urdf.sources import Origin
from urdfkin.verify.bounds import VERIFY_KERNELS_MODULE, Bound, compute_magnitudes
from urdfkin.verify.call import Call, CallPart
from urdfkin.verify.certificate import Certificate, Ledger, VerificationError
from urdfkin.verify.comparison import (
    CHECK_KERNEL_NAMES,
    BatchComparison,
    compare,
    compare_units,
    disagreement,
    worst_disagreements,
)
from urdfkin.verify.oracle import Oracle, QueryBatch
from urdfkin.verify.oracles import PINOCCHIO, OracleLibrary, OracleName, oracle_library
from urdfkin.verify.pinocchio import build_model, pinocchio, version
from urdfkin.verify.quantities import QUANTITIES, Quantity, format_replay_command

if TYPE_CHECKING:
    from urdfkin.dh.table import DHTable
    from urdfkin.dh.tree_parameters import TreeParameters
    from urdfkin.verify.tables import TableCheck

#: Number of random configurations in the check of a table, besides zero and limit configurations.
TABLE_SAMPLES = 40

#: True checks all results of a call, False checks none, and "sample" checks `SAMPLE_SIZE` configurations.
Verify = bool | Literal["sample"]

SAMPLE_SIZE = 100

#: Maximum number of values that are compared at once.
#: 262,144 doubles (2 MB) fit into the processor's cache.
_MAX_VALUES = 262_144
#: Maximum number of configurations that are compared at once.
_MAX_CONFIGURATIONS = 4096


class NotVerifiedWarning(UserWarning):
    """The oracle could not check some results. The message gives the reason.

    >>> import urdfkin
    >>> issubclass(urdfkin.NotVerifiedWarning, UserWarning)
    True
    """


class Verifier:
    """Checks and records the results of a robot.

    `oracle` checks only the results of the methods of `Robot`. Pinocchio always checks tables, accuracy
    studies and enclosures.

    Args:
        unverifiable: Reason why Pinocchio cannot check the robot.

    Attributes:
        source_notes: Text about the conversion to URDF.
    """

    def __init__(
        self,
        text: str,
        tree: KinematicTree,
        origin: Origin,
        *,
        policy: Verify = True,
        mimic: bool = True,
        unverifiable: str | None = None,
        oracle: OracleName = "pinocchio",
    ) -> None:
        self.text, self.tree, self.origin = text, tree, origin
        self.policy, self.mimic, self.known_refusal = as_verify(policy), mimic, unverifiable
        self.library = oracle_library(oracle)
        self.ledger, self.source_notes = Ledger(), ""
        self._oracles: dict[tuple[str, bool], Oracle] = {}
        self._refusals: dict[str, str] = {}

    def __getstate__(self) -> dict[str, Any]:
        # A copy has no checked results, and builds its own Pinocchio and MuJoCo models.
        return {**self.__dict__, "ledger": Ledger(), "_oracles": {}}

    def oracle(self, base: BaseMotion | None = None, library: OracleLibrary = PINOCCHIO) -> Oracle:
        """Return the robot's oracle.

        If `base` is given, the oracle's model has a free-flyer.
        """
        key = library.name, base is not None
        if key not in self._oracles:
            self._oracles[key] = library.make_oracle(
                self.text,
                self.tree,
                mimic=self.mimic,
                moving_base=key[1],
                root_joint=self.origin.root_joint,
                lock=dict(self.origin.lock),
            )
        return self._oracles[key]

    def make_pinocchio_model(self, *, mimic: bool) -> Any:
        if self.known_refusal is not None:
            raise OracleError(self.known_refusal, where=self.tree.name)
        return build_model(
            self.text,
            self.tree,
            self.origin.root_joint,
            mimic=mimic and self.mimic,
            lock=dict(self.origin.lock),
            lock_mimic_joints=self.mimic,
        )

    def with_lock(self, tree: KinematicTree, lock: tuple[tuple[str, float], ...]) -> Verifier:
        # Pinocchio may refuse the robot but accept the locked robot, which has fewer moving joints.
        # Therefore, the new verifier does not keep Pinocchio's refusal.
        known_refusal = self.known_refusal if self.known_refusal not in self._refusals.values() else None
        verifier = Verifier(
            self.text,
            tree,
            replace(self.origin, lock=(*self.origin.lock, *lock)),
            policy=self.policy,
            mimic=self.mimic,
            unverifiable=known_refusal,
            oracle=self.library.name,
        )
        verifier.source_notes = self.source_notes
        return verifier

    def find_refusal(self, base: BaseMotion | None = None, library: OracleLibrary = PINOCCHIO) -> str | None:
        """Return the reason why an oracle cannot check the robot, or None."""
        if library is PINOCCHIO and self.known_refusal is not None:
            return self.known_refusal
        if library.name not in self._refusals:
            try:
                self.oracle(base, library)
            except OracleError as error:
                self._refusals[library.name] = str(error)
                if library is PINOCCHIO:
                    self.known_refusal = str(error)
        return self._refusals.get(library.name)

    def resolve_policy(self, verify: Verify | None) -> Verify:
        return as_verify(self.policy if verify is None else verify)

    def require_pinocchio(self, verify: Verify | None) -> None:
        if (
            self.resolve_policy(verify) is not False
            and self.known_refusal is None
            and self.library is PINOCCHIO
        ):
            pinocchio()

    def certificate(self) -> Certificate:
        return replace(
            self.ledger.certificate(self.tree.name, self.library.name_and_version),
            source_notes="; ".join(filter(None, (self.source_notes, self.origin.locks_text))),
            source=self.origin.source,
            sha256=self.sha256,
            urdfkin=urdfkin_version(),
        )

    @property
    def sha256(self) -> str:
        """SHA-256 of the MJCF or USD file, or of the URDF text."""
        # The import is slow, because hashlib loads OpenSSL.
        import hashlib

        return self.origin.sha256 or hashlib.sha256(self.text.encode()).hexdigest()

    # -- quantities ----------------------------------------------------------------------------------

    def check(self, quantity: Quantity, call: Call, result: FloatArray, verify: Verify | None) -> None:
        """Check and record the results of a call.

        Raises:
            VerificationError: A result and the oracle's result differ by more than the bound.
            RangeError: The oracle's result or a bound leaves the range of doubles.
        """
        ledger, policy = self.ledger, self.resolve_policy(verify)
        if policy is False:
            ledger.count_unchecked(quantity.name, call.result_count)
            return
        if (reason := self.find_refusal(call.base, self.library)) is not None:
            _warn(reason)
            ledger.count_unchecked(quantity.name, call.result_count, reason)
            return
        results = call.query.flatten_result(result, quantity.ndim)
        total, worst = BatchComparison(), None
        for part in split_into_parts(policy, call.n, results[:1].size):
            comparison, failure = self._compare_part(quantity, call, results[part], part)
            if failure is not None and (worst is None or comparison.bound_ratio > total.bound_ratio):
                worst = failure
            total += comparison
        if worst is not None:
            # The failed call returns no results, but the certificate must show the disagreement.
            ledger.count_checked(quantity.name, replace(total, result_count=0))
            raise worst
        ledger.count_checked(quantity.name, total)
        if unchecked := call.result_count - total.result_count:
            ledger.count_unchecked(
                quantity.name, unchecked, f'verify="sample" checks {SAMPLE_SIZE} configurations of a call'
            )

    def make_checked_function(
        self,
        name: str,
        compute: Callable[..., FloatArray | None],
        plan: CompiledTree,
        frame: str,
        reference: Reference,
    ) -> Callable[..., FloatArray | None]:
        """Return a function that calls `compute` and checks the result.

        The returned function has the arguments of `compute`; the last argument is `out`. It returns None if
        `compute` does not support the arguments, or if the oracle cannot check the robot.
        """
        quantity, library, frames = QUANTITIES[name], self.library, (frame,)
        if self.find_refusal(None, library) is not None:
            return lambda *arguments: None
        for kernel in CHECK_KERNEL_NAMES:
            preload.get_kernel(kernel, preload.LOAD_AFTER, VERIFY_KERNELS_MODULE)

        def compute_and_check(*arguments: Any) -> FloatArray | None:
            result = compute(*arguments)
            if result is None:
                return None
            rows = tuple(x[np.newaxis] for x in arguments[:-1])
            query = QueryBatch(frames, rows, reference)
            x = CallPart(plan, reference, rows[0], rows[1:], FIXED_BASE_STATE, query)
            ours = result[np.newaxis, np.newaxis]
            theirs, bound = compute_oracle_results_with_bound(
                quantity, self.oracle(None, library), x, ours, library
            )
            comparison = compare(ours, theirs, bound, 2)
            if comparison.agrees:
                warn_of_degrees(self.tree, arguments[0])
                self.ledger.count_checked(name, comparison)
            else:  # `check` raises the error.
                call = Call(self.tree, lambda _: plan, frame, reference, None, arguments[:-1])
                self.check(quantity, call, result, True)
            return result

        return compute_and_check

    def _compare_part(
        self, quantity: Quantity, call: Call, ours: FloatArray, part: slice | IntArray
    ) -> tuple[BatchComparison, VerificationError | None]:
        x = call.select(part)
        arguments = quantity, self.oracle(call.base, self.library), x, ours, self.library
        comparison = compare_with_oracle(*arguments)
        if comparison.agrees:
            return comparison, None
        theirs, bound = compute_oracle_results_with_bound(*arguments)
        i, f = comparison.index
        k = part.start + i if isinstance(part, slice) else int(part[i])
        bound = Bound(*(np.broadcast_to(x, ours.shape)[i, f] for x in (bound.scale, bound.k)))
        if not (np.isfinite(bound.scale).all() and np.isfinite(theirs[i, f]).all()):
            raise RangeError(
                f"the {quantity.name} of {call.frames[f]} leaves the range of double precision",
                where=f"sample {list(call.batch_index(k))}" if call.shape else None,
                remedy="give smaller numbers",
            )
        return comparison, VerificationError(
            quantity.name,
            call.frames[f],
            str(call.options.get("representation", call.reference.name)),
            index=call.batch_index(k),
            ours=ours[i, f],
            theirs=theirs[i, f],
            bound=EPS * bound.k * bound.scale,
            units=float(disagreement(ours[i, f], theirs[i, f], bound.scale).max()),
            reproduce=self._make_replay_line(quantity, call, k, call.frames[f]),
            oracle=self.library.title,
        )

    def _make_replay_line(self, quantity: Quantity, call: Call, k: int, frame: str) -> str:
        inputs = (call.q, *call.rates)
        values = {name: array[k].tolist() for name, array in zip("qva", inputs, strict=False)}
        reference = call.reference.name.lower() if quantity.has_reference else None
        if call.base is None and quantity.command:
            return format_replay_command(self.origin, quantity.command, frame, reference, values)
        options = call.options if reference is None else {"reference": reference, **call.options}
        words = [*map(repr, values.values()), repr(frame), *(f"{x}={y!r}" for x, y in options.items())]
        if (query := call.query.select(np.array([k])).base) is not None:
            fields = query.placement, query.velocity, query.acceleration
            words.append(f"base=urdfkin.BaseMotion({', '.join(repr(x[0].tolist()) for x in fields)})")
        return f"{self.origin.python_call}.{quantity.method}({', '.join(words)})"

    # -- tables --------------------------------------------------------------------------------------

    def check_table(self, table: DHTable, samples: int = TABLE_SAMPLES) -> TableCheck | None:
        """Check a Denavit-Hartenberg table. Return None if Pinocchio cannot check the robot.

        Raises:
            TableError: The table and Pinocchio differ by more than the bound.
        """
        from urdfkin.verify.tables import TableError, check_table

        if (reason := self.find_refusal()) is not None:
            _warn(reason)
            return None
        inputs = draw_samples(self.tree, samples, np.random.default_rng(0), with_zero_and_limits=True)
        check = check_table(self.oracle(), self.tree, table, inputs)
        if not check.agrees:
            raise TableError(
                f"the {table.convention} table of {table.base_frame} to {table.tip_frame}"
                " disagrees with Pinocchio",
                where=f"{self.tree.name}, Pinocchio {version()}",
                found=str(check),
                remedy="please report this as an error of urdfkin, with the URDF",
            )
        if check.loss is not None:
            _warn(str(check))
        return check

    def check_tree_parameters(self, parameters: TreeParameters) -> str | None:
        """Check Khalil-Kleinfinger parameters. Return None if Pinocchio cannot check the robot.

        Raises:
            TableError: The parameters and Pinocchio differ by more than the bound.
        """
        from urdfkin.verify.tables import TableError

        if (reason := self.find_refusal()) is not None:
            _warn(reason)
            return None
        tree = self.tree
        q = draw_samples(tree, TABLE_SAMPLES, np.random.default_rng(0), with_zero_and_limits=True).q
        ours = parameters.placements(q)
        theirs = self.oracle().placements(QueryBatch(tree.link_frames[1:], (q,)))
        error = np.abs(ours - theirs)[..., :3, :]
        reach = parameters.reach(q)
        units = max(
            float((error[..., 3].max(axis=-1) / np.maximum(EPS * reach, MIN_DIVISOR)).max(initial=0.0)),
            float(error[..., :3].max(initial=0.0)) / EPS,
        )
        line = (
            f"Pinocchio {version()}: {len(tree.links) - 1} links on {len(q)} samples within"
            f" {error[..., 3].max(initial=0.0):.2e} m, {units:.2g} eps*scale"
        )
        tilt = max(sum(tree.joints[i].pinocchio_tilt for i in tree.path(leaf)) for leaf in tree.leaves())
        if units > parameters.roundings + joint_roundings(0, tilt):
            raise TableError(
                f"the tree parameters of {tree.name} disagree with Pinocchio",
                where=f"Pinocchio {version()}",
                found=line,
            )
        return line


def compare_with_oracle(
    quantity: Quantity, oracle: Oracle, x: CallPart, ours: FloatArray, library: OracleLibrary
) -> BatchComparison:
    if quantity.blocks is None:
        theirs, bound = compute_oracle_results_with_bound(quantity, oracle, x, ours, library)
        _check_result_count(quantity, library, len(theirs), len(ours))
        return compare(ours, theirs, bound, 2)
    bound, units, first = compute_bound(quantity, x, library), np.empty(ours.shape[:2]), 0
    with _ignore_overflow():
        for theirs in yield_oracle_blocks(quantity, oracle, x.query):
            part = slice(first, first + len(theirs))
            if part.stop > len(ours):
                _check_result_count(quantity, library, part.stop, len(ours))
            scale = bound.scale if len(bound.scale) == 1 else bound.scale[part]
            units[part], first = worst_disagreements(ours[part], theirs, scale, 2), part.stop
    _check_result_count(quantity, library, first, len(ours))
    return compare_units(units, bound)


def _check_result_count(quantity: Quantity, library: OracleLibrary, found: int, wanted: int) -> None:
    if found != wanted:
        raise OracleError(
            f"{library.title} does not return the {quantity.name} of each configuration",
            found=f"{found} of {wanted} results",
            remedy="please report this as an error of urdfkin, with the URDF",
        )


def compute_oracle_results_with_bound(
    quantity: Quantity, oracle: Oracle, x: CallPart, ours: FloatArray, library: OracleLibrary = PINOCCHIO
) -> tuple[FloatArray, Bound]:
    if quantity.results_and_bound is not None:
        return quantity.results_and_bound(oracle, x, ours, library)
    return compute_oracle_results(quantity, oracle, x.query), compute_bound(quantity, x, library)


def compute_bound(quantity: Quantity, x: CallPart, library: OracleLibrary = PINOCCHIO) -> Bound:
    """Bound the differences between urdfkin and an oracle.

    The bound is constant if the quantity needs only q, the base is fixed and all joints are revolute.
    """
    v, a = (*x.rates, None, None)[:2]
    is_constant = v is None and x.state is FIXED_BASE_STATE and x.plan.all_revolute and len(x.q) > 0
    key = "bound", quantity.name, x.reference, library.name
    bound: Bound | None = x.plan.cache.get(key) if is_constant else None
    if bound is None:
        q = x.q[:1] if is_constant else x.q
        bound = quantity.bound(
            x.plan, library.adapt_magnitudes(compute_magnitudes(x.plan, q, v, a, x.state)), x.reference
        )
        if is_constant:
            x.plan.cache[key] = bound
    return bound


def compute_own_results(quantity: Quantity, x: CallPart) -> FloatArray:
    return quantity.compute_results(x.plan, (x.q, *x.rates), x.reference, base=x.state)


#: The comparison reports inf and NaN, so NumPy need not warn.
_ignore_overflow = partial(np.errstate, over="ignore", under="ignore", invalid="ignore")


@_ignore_overflow()
def compute_oracle_results(quantity: Quantity, oracle: Oracle, query: QueryBatch) -> FloatArray:
    return quantity.ask_oracle(oracle, query)


def yield_oracle_blocks(quantity: Quantity, oracle: Oracle, query: QueryBatch) -> Iterator[FloatArray]:
    """Yield blocks of results. Each block may overwrite the previous block."""
    assert quantity.blocks is not None
    return quantity.blocks(oracle, query)


def _warn(reason: str) -> None:
    warn_caller(f"not verified: {reason}", NotVerifiedWarning)


def as_verify(verify: object) -> Verify:
    if verify is True or verify is False:
        return verify
    if isinstance(verify, str) and verify == "sample":
        return "sample"
    raise InputError('verify must be True, False or "sample"', found=safe_repr(verify))


def split_into_parts(verify: Verify, n: int, values_per_configuration: int) -> Iterator[slice | IntArray]:
    """Split the checked configurations into parts, and yield the indices of each part.

    With "sample", the configurations are random, because equal steps could match a pattern in the batch.
    """
    step = min(_MAX_CONFIGURATIONS, max(1, _MAX_VALUES // max(1, values_per_configuration)))
    if verify == "sample" and n > SAMPLE_SIZE:
        indices = np.sort(np.random.default_rng(0).choice(n, SAMPLE_SIZE, replace=False))
        yield from (indices[i : i + step] for i in range(0, SAMPLE_SIZE, step))
    else:
        yield from (slice(i, min(i + step, n)) for i in range(0, n, step))
