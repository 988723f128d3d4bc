"""The table of quantities: names, shapes, functions for computation and checks, bounds and help texts.

The methods of `Robot`, the checks, reports and the command line use this table. The table names functions by
text and imports them at their first use, so that `--help` does not import NumPy.

>>> for quantity in recursive_quantities():
...     print(quantity.name, quantity.inputs, quantity.shape)
placement q (4, 4)
velocity qv (6,)
jacobian q (6, 'nv')
jacobian rate qv (6, 'nv')
hessian q (6, 'nv', 'nv')
acceleration qva (6,)
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from urdfkin.errors import QuestionsSection, UnknownNameError
from urdfkin.system.lazy_import import lazy_import

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from urdfkin.compiled.plan import CompiledTree
    from urdfkin.model.reference import Reference
    from urdfkin.model.tree import FloatArray
    from urdfkin.urdf.sources import Origin
    from urdfkin.verify.bounds import Bound, Magnitudes
    from urdfkin.verify.oracle import Oracle, QueryBatch

#: Rows of a velocity, an acceleration or a Jacobian.
SIX_VECTOR_LABELS = ("vx", "vy", "vz", "wx", "wy", "wz")


def make_oracle_call(name: str) -> Callable[[Oracle, QueryBatch], Any]:
    return lambda oracle, query: getattr(oracle, name)(query)


_make_bound = lazy_import("urdfkin.verify.bounds:make_bound")


@dataclass(frozen=True, eq=False, kw_only=True)
class Quantity:
    """A row of the table.

    Attributes:
        inputs: "q", "qv" or "qva".
        shape: Shape of one result, for example (6, "nv").
        compute: `compute(plan, *inputs, reference, base=, out=, threads=)` returns urdfkin's results.
            If `recursive` is False, `compute` may have other arguments.
        ask_oracle: `ask_oracle(oracle, query)` returns the oracle's results.
        blocks: `blocks(oracle, query)` yields the oracle's results in blocks.
        scale: `scale(plan, magnitudes, reference)` returns the scale of the bound.
        factors: Number of vectors in the longest product, for example 3 for w x (w x d).
            `make_bound` adds 1 to `factors` for LOCAL and WORLD.
        results_and_bound: `results_and_bound(oracle, part, ours, library)` returns the oracle's results and
            the bound. Checks call this function, if there is one, instead of `ask_oracle` and `scale`.
        compute_intervals: `compute_intervals(motion, link, reference)` returns intervals around true values.
        recursive: Whether one forward recursion computes the result, without further arguments such as
            `gravity`.
        in_validation: `validate` compares the quantity if `recursive` and `in_validation` are True. False for
            Hessians, which are nv times larger than Jacobians.
        has_reference: Whether `compute`, `scale` and `compute_intervals` have the argument `reference`.
        object_kind: Compared objects: "frames", "joints" or "columns".
        heading: Column in reports; quantities can share a column.
    """

    name: str
    title: str
    inputs: str
    shape: tuple[int | Literal["nv"], ...]
    equations: tuple[str, ...]
    compute: Callable[..., Any]
    ask_oracle: Callable[[Oracle, QueryBatch], FloatArray]
    scale: Callable[..., Any]
    factors: int
    blocks: Callable[[Oracle, QueryBatch], Iterator[FloatArray]] | None = None
    results_and_bound: Callable[..., tuple[FloatArray, Bound]] | None = None
    compute_intervals: Callable[..., Any] | None = None
    recursive: bool = True
    in_validation: bool = True
    has_reference: bool = True
    object_kind: Literal["frames", "joints", "columns"] = "frames"
    heading: str = ""
    labels: tuple[str, ...] = SIX_VECTOR_LABELS
    units: Mapping[str, str] = field(default_factory=dict)
    command: str = ""
    summary: str = ""
    help_text: str = ""
    example: str = ""

    @property
    def method(self) -> str:
        """Name of the method of `Robot`."""
        return self.name.replace(" ", "_")

    @property
    def ndim(self) -> int:
        return len(self.shape)

    @property
    def has_columns(self) -> bool:
        return "nv" in self.shape

    @property
    def references(self) -> tuple[Reference | None, ...]:
        from urdfkin.model.reference import Reference

        return tuple(Reference) if self.has_reference else (None,)

    def result_shape(self, nv: int) -> tuple[int, ...]:
        return tuple(nv if size == "nv" else size for size in self.shape)

    def compute_results(
        self, plan: CompiledTree, inputs: Sequence[FloatArray], reference: Reference | None, **options: Any
    ) -> FloatArray:
        results: FloatArray = self.compute(
            plan, *inputs[: len(self.inputs)], *self._reference_arguments(reference), **options
        )
        return results

    def bound(self, plan: CompiledTree, magnitudes: Magnitudes, reference: Reference | None) -> Bound:
        scale = self.scale(plan, magnitudes, *self._reference_arguments(reference))
        bound: Bound = _make_bound(scale, self.factors, magnitudes, *self._reference_arguments(reference))
        return bound

    def enclose(self, motion: Any, link: int, reference: Reference | None) -> NDArray[Any]:
        assert self.compute_intervals is not None
        values: NDArray[Any] = self.compute_intervals(motion, link, *self._reference_arguments(reference))
        return values

    def _reference_arguments(self, reference: Reference | None) -> tuple[Reference | None, ...]:
        return (reference,) if self.has_reference else ()


PLACEMENT = Quantity(
    name="placement",
    title="placement",
    inputs="q",
    shape=(4, 4),
    equations=("7.77",),
    compute=lazy_import("urdfkin.compiled.evaluate:placements"),
    ask_oracle=make_oracle_call("placements"),
    scale=lazy_import("urdfkin.verify.bounds:placement_scale"),
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:placement_values"),
    factors=1,
    has_reference=False,
    heading="place",
    labels=(),
    command="placement",
    summary="pose of a frame",
    example="urdfkin placement panda --q 0,-0.5,0,-2,0,1.5,0.8,0.02",
)
RELATIVE_PLACEMENT = replace(
    PLACEMENT,
    name="relative placement",
    title="placement in another frame",
    results_and_bound=partial(
        lazy_import("urdfkin.verify.derived:derive_relative_placement"), PLACEMENT.bound
    ),
    recursive=False,
    command="",
)
VELOCITY = Quantity(
    name="velocity",
    title="velocity",
    inputs="qv",
    shape=(6,),
    equations=("7.127", "7.128"),
    compute=lazy_import("urdfkin.compiled.evaluate:velocities"),
    ask_oracle=make_oracle_call("velocities"),
    scale=lazy_import("urdfkin.verify.bounds:velocity_scale"),
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:velocity_values"),
    factors=2,
    heading="vel",
    units={"linear": "m/s", "angular": "rad/s"},
    command="velocity",
    summary="velocity of a frame",
    help_text="Linear velocity of the frame's origin (m/s), and angular velocity (rad/s), for the joint"
    " velocities --v.",
    example="urdfkin velocity ur5 --q random --v 1,0,0,0,0,0 --frame tool0",
)
JACOBIAN = Quantity(
    name="jacobian",
    title="Jacobian",
    inputs="q",
    shape=(6, "nv"),
    equations=("7.85",),
    compute=lazy_import("urdfkin.compiled.evaluate:jacobians"),
    ask_oracle=make_oracle_call("jacobians"),
    blocks=make_oracle_call("jacobian_blocks"),
    scale=lazy_import("urdfkin.verify.bounds:jacobian_scale"),
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:jacobian_values"),
    factors=2,
    heading="J",
    command="jacobian",
    summary="Jacobian of a frame",
    help_text="Each row of the table is the frame's velocity when one joint velocity is 1 and all others"
    " are 0.",
    example="urdfkin jacobian panda --q random --seed 1 --frame panda_hand",
)
JACOBIAN_RATE = Quantity(
    name="jacobian rate",
    title="Jacobian rate",
    inputs="qv",
    shape=(6, "nv"),
    equations=("7.126",),
    compute=lazy_import("urdfkin.compiled.evaluate:jacobian_rates"),
    ask_oracle=make_oracle_call("jacobian_rates"),
    scale=lazy_import("urdfkin.verify.bounds:jacobian_rate_scale"),
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:jacobian_rate_values"),
    factors=3,
    heading="J-dot",
    command="jacobian-rate",
    summary="time derivative of a frame's Jacobian",
    help_text="Time derivative J' for joint velocities --v. The table has a row for each column of the"
    " Jacobian. With --reference local_world_aligned, J a + J' v is the result of `urdfkin"
    " acceleration`. With local or world, J a + J' v is the spatial acceleration.",
    example="urdfkin jacobian-rate panda --q random --v random --frame panda_hand",
)
HESSIAN = Quantity(
    name="hessian",
    title="Hessian",
    inputs="q",
    shape=(6, "nv", "nv"),
    equations=("7.85", "7.126"),
    compute=lazy_import("urdfkin.compiled.evaluate:hessians"),
    ask_oracle=make_oracle_call("hessians"),
    scale=lazy_import("urdfkin.verify.bounds:hessian_scale"),
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:hessian_values"),
    factors=3,
    in_validation=False,
    heading="H",
    command="hessian",
    summary="derivatives of a frame's Jacobian by each joint coordinate",
    help_text="The table has a group of rows for each column of the Jacobian. Each row of a group"
    " is the derivative of the group's column by one joint coordinate. Multiply each row of a group by the"
    " velocity of the row's joint. The sum of these products is a row of `urdfkin jacobian-rate`.",
    example="urdfkin hessian panda --q random --seed 1 --frame panda_hand",
)
ACCELERATION = Quantity(
    name="acceleration",
    title="acceleration",
    inputs="qva",
    shape=(6,),
    equations=("7.129", "7.130"),
    compute=lazy_import("urdfkin.compiled.evaluate:accelerations"),
    ask_oracle=make_oracle_call("accelerations"),
    scale=lazy_import("urdfkin.verify.bounds:acceleration_scale"),
    compute_intervals=lazy_import("urdfkin.verify.exact.recursion:acceleration_values"),
    factors=3,
    heading="acc",
    units={"linear": "m/s^2", "angular": "rad/s^2"},
    command="acceleration",
    summary="classical acceleration of a frame",
    help_text="Second derivative of the position of the frame's origin (m/s^2), and angular acceleration"
    " (rad/s^2). --v and --a are the joint velocities and accelerations. Gravity is not included. --breakdown"
    " lists the transverse, centripetal, Coriolis and sliding contribution of each joint (eq. 7.125)."
    f" {QuestionsSection.TWO_ACCELERATIONS}, {QuestionsSection.GRAVITY}.",
    example="urdfkin acceleration panda --q random --v random --a random --breakdown",
)
ANALYTICAL_JACOBIAN = replace(
    JACOBIAN,
    name="analytical jacobian",
    title="analytical Jacobian",
    blocks=None,
    equations=("7.118", "7.122"),
    compute=lazy_import("urdfkin.kinematics.bodies:analytical_jacobian"),
    results_and_bound=partial(
        lazy_import("urdfkin.verify.derived:derive_analytical_jacobian"), JACOBIAN.bound
    ),
    recursive=False,
    has_reference=False,
    command="",
)
ACCELERATION_BREAKDOWN = replace(
    ACCELERATION,
    name="acceleration breakdown",
    title="acceleration breakdown by joint",
    equations=("7.125", "7.130"),
    compute=lazy_import("urdfkin.compiled.breakdown:acceleration_breakdown"),
    recursive=False,
    command="acceleration --breakdown",
)
IMU = replace(
    ACCELERATION,
    name="imu",
    title="IMU reading",
    equations=("7.127", "7.129", "7.130"),
    compute=lazy_import("urdfkin.compiled.evaluate:imus"),
    results_and_bound=lazy_import("urdfkin.verify.derived:derive_imu_reading"),
    recursive=False,
    has_reference=False,
    labels=("ax", "ay", "az", "wx", "wy", "wz"),
    units={"proper acceleration": "m/s^2", "angular velocity": "rad/s"},
    command="",
)
JOINT_JACOBIAN = replace(JACOBIAN, name="joint jacobian", title="joint Jacobian", object_kind="joints")
JOINT_JACOBIAN_RATE = replace(
    JACOBIAN_RATE, name="joint jacobian rate", title="joint Jacobian rate", object_kind="joints"
)
SCREWS = replace(
    JACOBIAN,
    name="screws",
    title="data.J",
    shape=(6,),
    ask_oracle=make_oracle_call("screws"),
    blocks=None,
    object_kind="columns",
    heading="data.J",
)

#: All quantities, in the order of certificates and reports.
QUANTITIES = {
    row.name: row
    for row in (
        PLACEMENT,
        RELATIVE_PLACEMENT,
        VELOCITY,
        JACOBIAN,
        JACOBIAN_RATE,
        HESSIAN,
        ACCELERATION,
        ANALYTICAL_JACOBIAN,
        ACCELERATION_BREAKDOWN,
        IMU,
        JOINT_JACOBIAN,
        JOINT_JACOBIAN_RATE,
        SCREWS,
    )
}


def recursive_quantities(object_kind: str = "frames") -> list[Quantity]:
    return [row for row in QUANTITIES.values() if row.recursive and row.object_kind == object_kind]


def validated_quantities(object_kind: str = "frames") -> list[Quantity]:
    return [row for row in recursive_quantities(object_kind) if row.in_validation]


def format_validated_titles() -> str:
    return _join_titles([row.title for row in validated_quantities()])


def format_unvalidated_titles() -> str:
    return _join_titles(
        [
            row.title
            for row in QUANTITIES.values()
            if row.object_kind == "frames" and row not in validated_quantities()
        ]
    )


def _join_titles(titles: Sequence[str]) -> str:
    return f"{', '.join(titles[:-1])}, and {titles[-1]}"


def quantities_by_command() -> dict[str, Quantity]:
    return {row.command: row for row in recursive_quantities() if row.command}


def find_quantity(name: str) -> Quantity:
    """Find a quantity, or raise UnknownNameError."""
    if (found := QUANTITIES.get(name)) is None:
        raise UnknownNameError("quantity", name, QUANTITIES)
    return found


def format_replay_command(
    origin: Origin, command: str, frame: str, reference: str | None, values: Mapping[str, Sequence[float]]
) -> str:
    """Return a shell command that repeats a sample, with all digits of the numbers.

    >>> from urdfkin.urdf.sources import Origin
    >>> format_replay_command(Origin("ur5"), "velocity", "tool 0", "local", {"q": [0.5, 0.1], "v": []})
    "urdfkin velocity ur5 --frame 'tool 0' --reference local --q 0.5,0.1 --v neutral"
    """
    words = ["urdfkin", command, origin.command_line, "--frame", shlex.quote(frame)]
    if reference:
        words += ["--reference", reference]
    for letter, numbers in values.items():
        words += [f"--{letter}", ",".join(repr(float(x)) for x in numbers) or "neutral"]
    return " ".join(words)
