"""Convert the arguments of a call to batches with one axis, and the results to the caller's shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from urdfkin.compiled.plan import CompiledTree, IntArray
from urdfkin.errors import InputError, NotFiniteError
from urdfkin.errors.validators import reject_set, safe_repr
from urdfkin.kinematics.inputs import common_batch_shape
from urdfkin.model.base_motion import FIXED_BASE_STATE, BaseMotion
from urdfkin.model.configuration import parse_and_normalise, parse_finite, parse_numbers
from urdfkin.model.configuration_like import ConfigurationLike, as_text_or_mapping
from urdfkin.model.reference import Reference
from urdfkin.model.tree import FloatArray, KinematicTree
from urdfkin.verify.oracle import OracleQuery, QueryBatch

T = TypeVar("T")

#: Array types with the unchanged `reshape` of NumPy.
_PLAIN_ARRAY_TYPES = np.ndarray, np.memmap


class CallPart(NamedTuple):
    """A part of a call's configurations.

    Attributes:
        rates: (), (v,) or (v, a).
        state: Result of `BaseMotion.state`, (n, 24) or (1, 24).
        query: Input of the oracle, converted independently.
    """

    plan: CompiledTree
    reference: Reference
    q: FloatArray
    rates: tuple[FloatArray, ...]
    state: FloatArray
    query: QueryBatch
    options: Mapping[str, object] = MappingProxyType({})


class Call:
    """The inputs of one call.

    Args:
        plan: Compiles the tree for link indices.
        q_v_a: (q,), (q, v) or (q, v, a).
        additional_frames: Frames that the call computes, but that are not part of the result.
        options: Arguments of a quantity, for example `gravity`.
    """

    def __init__(
        self,
        tree: KinematicTree,
        plan: Callable[[Sequence[int]], CompiledTree],
        frame: str | Sequence[str],
        reference: Reference | str,
        base: BaseMotion | None,
        q_v_a: Sequence[ConfigurationLike],
        additional_frames: Sequence[str] = (),
        **options: object,
    ) -> None:
        if base is not None and not isinstance(base, BaseMotion):
            raise InputError("base must be a BaseMotion or None", found=type(base).__name__)
        named = [as_text_or_mapping(x, name) for x, name in zip(q_v_a, "qva", strict=False)]
        inputs: list[ArrayLike] = [
            cast("ArrayLike", x) if by_name is None else parse_numbers(tree, by_name, name)
            for x, by_name, name in zip(q_v_a, named, "qva", strict=False)
        ]
        self.tree, self.base, self.inputs, self.options = tree, base, inputs, options
        self.is_list, self.frames = _parse_frames(frame)
        joints = [(joint.name, joint.nv) for joint in tree.joints if joint.nv] if any(named) else ()
        self.query = OracleQuery(frame, reference, base, inputs, named, joints)
        self.reference = Reference.of(reference)
        self.links = tuple(tree.frame_link(name) for name in self.frames)
        self.plan = plan((*self.links, *(tree.frame_link(name) for name in additional_frames)))
        arrays = [parse_and_normalise(tree, x, name) for x, name in zip(inputs, "qva", strict=False)]
        self.shape = self._broadcast_batch_shapes(arrays)
        self.n = math.prod(self.shape)
        flat = [self._flatten_input(array) for array in arrays]
        self.q, *self.rates = flat
        self.state = FIXED_BASE_STATE if base is None else base.state(self.shape)

    def _broadcast_batch_shapes(self, arrays: list[FloatArray]) -> tuple[int, ...]:
        shapes = [array.shape[:-1] for array in arrays]
        if self.base is not None:
            shapes.append(self.base.batch_shape)
        if all(shape == shapes[0] for shape in shapes):
            return shapes[0]
        return common_batch_shape(shapes, "q, v, a and base")

    def _flatten_input(self, array: FloatArray) -> FloatArray:
        width = array.shape[-1]
        if array.shape[:-1] == self.shape:
            return np.ascontiguousarray(array.reshape(self.n, width))
        if array.size == width:
            return np.broadcast_to(np.ascontiguousarray(array).reshape(width), (self.n, width))
        return np.ascontiguousarray(np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width))

    @property
    def result_count(self) -> int:
        return self.n * len(self.links)

    def flatten_out(self, out: FloatArray | None, shape: tuple[int, ...]) -> FloatArray | None:
        """Flatten the batch axes of `out`.

        An `out` of a subclass other than `memmap` raises InputError, because a subclass may have a different
        `reshape`. A kernel could then write past the end of `out`.
        """
        if out is None:
            return None
        expected_shape = (*self.shape, *((len(self.links),) if self.is_list else ()), *shape)
        is_usable = type(out) in _PLAIN_ARRAY_TYPES and out.dtype == np.float64 and out.flags.carray
        if not is_usable or out.shape != expected_shape:
            raise InputError(
                f"out must be a writable C-contiguous float64 array of shape {expected_shape}",
                found=_describe_array(out),
                remedy="np.asarray(out) is a plain array"
                if isinstance(out, np.ndarray) and type(out) not in _PLAIN_ARRAY_TYPES
                else None,
            )
        self.query.cache_inputs()
        if any(np.may_share_memory(out, array) for array in (*self.inputs, self.q, *self.rates)):
            raise InputError(
                "out must not share memory with q, v or a, because the check reads the inputs again"
            )
        return out.reshape(self.n, len(self.links), *shape)

    def restore_shape(self, result: FloatArray) -> FloatArray:
        return result.reshape(*self.shape, *result.shape[1 if self.is_list else 2 :])

    def run_and_locate_error(self, function: Callable[..., T], *arguments: Any, **options: Any) -> T:
        """Call `function`. If an input is not finite, raise an error that names the joint."""
        try:
            return function(*arguments, **options)
        except NotFiniteError:
            for x, name in zip(self.inputs, "qva", strict=False):
                parse_finite(self.tree, x, name)
            raise

    def select(self, part: slice | IntArray) -> CallPart:
        state = self.state if len(self.state) == 1 else self.state[part]
        rates = tuple(x[part] for x in self.rates)
        query = self.query.select(part)
        return CallPart(self.plan, self.reference, self.q[part], rates, state, query, self.options)

    def batch_index(self, k: int) -> tuple[int, ...]:
        return tuple(int(i) for i in np.unravel_index(k, self.shape)) if self.shape else ()


def _describe_array(out: object) -> str:
    if not isinstance(out, np.ndarray):
        return type(out).__name__
    flags = {
        "read-only": out.flags.writeable,
        "not C-contiguous": out.flags.c_contiguous,
        "not aligned": out.flags.aligned,
    }
    faults = (fault for fault, is_good in flags.items() if not is_good)
    return ", ".join((f"{type(out).__name__} of {out.dtype} {out.shape}", *faults))


def _parse_frames(frame: str | Sequence[str]) -> tuple[bool, tuple[str, ...]]:
    if isinstance(frame, str):
        return False, (frame,)
    reject_set(frame, "a list of frames")
    try:
        return True, tuple(frame)[: len(frame)]  # `len` raises TypeError for an iterator.
    except TypeError:
        raise InputError(
            "a frame must be a name of a link or joint, or a list of names",
            found=safe_repr(frame),
            remedy="robot.link_frames lists all links",
        ) from None
