"""Every quantity of the library, a row each: its names, what computes it, what asks Pinocchio, its bound.

Methods, checks, validation, the judge, plots, reports, replay lines and the command line read this table: a
new quantity is a row here, beside the functions that the row names, and a page of docs.

Functions are named, not imported: whoever asks for help needs no numpy.

>>> for quantity in walked():
...     print(quantity.name, quantity.inputs, quantity.shape)
placement q (4, 4)
velocity qv (6,)
jacobian q (6, 'nv')
jacobian rate qv (6, 'nv')
hessian q (6, 'nv', 'nv')
acceleration qva (6,)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from urdfkin.errors import Question, UnknownNameError
from urdfkin.system.lazy_import import lazy_import

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from urdfkin.compiled.plan import CompiledTree
    from urdfkin.model.reference import Reference
    from urdfkin.model.tree import FloatArray
    from urdfkin.verify.bounds import Bound, Magnitudes
    from urdfkin.verify.pinocchio import Oracle
    from urdfkin.verify.pinocchio_inputs import BaseNumbers

#: The rows of a velocity, an acceleration or a Jacobian.
SIX = ("vx", "vy", "vz", "wx", "wy", "wz")
#: (oracle, part, ours, witness) to its results and what the two are measured against.
Against = Callable[..., "tuple[FloatArray, Bound]"]


def asked(name: str) -> Callable[..., Any]:
    """The oracle's method of that name, whichever oracle it is."""

    def ask(oracle: Any, *arguments: Any) -> Any:
        return getattr(oracle, name)(*arguments)

    return ask


_bound = lazy_import("urdfkin.verify.bounds:bound_of")


@dataclass(frozen=True, eq=False, kw_only=True)
class Quantity:
    """A row of the table.

    Attributes:
        name: In certificates, errors and reports.
        title: As a sentence has it.
        inputs: What of q, v and a it is computed from: "q", "qv" or "qva".
        shape: Of one result; "nv" stands for the robot's rates.
        equations: The text's.
        compute: The walk, (plan, *inputs, reference, base=, out=, threads=) to (n, frames, ...); where it is
            not `walked`, what a method of the robot's has computed in a way of its own.
        ask: Asks an oracle, (oracle, *inputs, frames, reference, base) to (n, frames, ...); of joints, which
            of the moving ones. Where it is not `referred`, neither takes a reference.
        scale: The size of its terms, (plan, magnitudes, reference): see `urdfkin.verify.bounds`.
        factors: How many rotated vectors each term of [linear; angular] multiplies, in LOCAL_WORLD_ALIGNED.
        against: (oracle, part, ours, witness) to its results and their bound, where `ask` and `scale` cannot
            say it.
        exact: Its true values, (motion, link, reference) to numbers of any kind, for judge and enclosures.
        walked: Whether the walk computes it for any frames.
        validated: Whether what is walked is validated, judged and plotted too. A Hessian has as many numbers
            as all other quantities together, times the rates, and is made of the Jacobian's columns.
        referred: Whether it is given in a reference; a placement is not.
        of: What a validation compares it of: "frames", "joints" or "columns".
        head: The column of a report; rows of one head share it.
        labels: Of a result's rows, where they have any.
        units: By the name of each three numbers of a vector.
        command: What computes one case again on the command line, if anything does.
        summary: For a command of its own: its line in the list of commands.
        page: The rest of its help.
        example: A command line.
    """

    name: str
    title: str
    inputs: str
    shape: tuple[int | Literal["nv"], ...]
    equations: tuple[str, ...]
    compute: Callable[..., Any]
    ask: Callable[..., Any]
    scale: Callable[..., Any]
    factors: int
    against: Against | None = None
    exact: Callable[..., Any] | None = None
    walked: bool = True
    validated: bool = True
    referred: bool = True
    of: Literal["frames", "joints", "columns"] = "frames"
    head: str = ""
    labels: tuple[str, ...] = SIX
    units: Mapping[str, str] = field(default_factory=dict)
    command: str = ""
    summary: str = ""
    page: str = ""
    example: str = ""

    @property
    def method(self) -> str:
        """The robot's, by that name."""
        return self.name.replace(" ", "_")

    @property
    def axes(self) -> int:
        """How many axes one result has: one for [linear; angular], two for a matrix, three for a Hessian."""
        return len(self.shape)

    @property
    def columns(self) -> bool:
        """Whether it has a column for each rate."""
        return "nv" in self.shape

    @property
    def references(self) -> tuple[Reference | None, ...]:
        """In which it is validated and judged."""
        from urdfkin.model.reference import Reference  # noqa: PLC0415

        return tuple(Reference) if self.referred else (None,)

    def own_shape(self, rates: int) -> tuple[int, ...]:
        """One result's, for a robot of so many rates."""
        return tuple(rates if size == "nv" else size for size in self.shape)

    def ours(
        self, plan: CompiledTree, inputs: Sequence[FloatArray], reference: Reference | None, **how: Any
    ) -> FloatArray:
        """(n, frames, ...) by the text's recursion; of q, v and a it takes what it needs."""
        found: FloatArray = self.compute(plan, *inputs[: len(self.inputs)], *self._in(reference), **how)
        return found

    def theirs(
        self,
        oracle: Oracle,
        inputs: Sequence[FloatArray],
        of: Sequence[str] | slice,
        reference: Reference | str | None,
        base: BaseNumbers | None = None,
    ) -> FloatArray:
        """(n, frames, ...) by Pinocchio, likewise; `of` frames by name, or of a run of the moving joints."""
        moving = () if base is None else (base,)
        given = inputs[: len(self.inputs)]
        found: FloatArray = self.ask(oracle, *given, of, *self._in(reference), *moving)
        return found

    def bound(self, plan: CompiledTree, size: Magnitudes, reference: Reference | None) -> Bound:
        """What the two are measured against."""
        scale = self.scale(plan, size, *self._in(reference))
        bound: Bound = _bound(scale, self.factors, size, *self._in(reference))
        return bound

    def truth(self, motion: Any, link: int, reference: Reference | None) -> NDArray[Any]:
        """One link's, as `exact` gives it."""
        assert self.exact is not None
        values: NDArray[Any] = self.exact(motion, link, *self._in(reference))
        return values

    def _in(self, reference: Reference | str | None) -> tuple[Reference | str | None, ...]:
        return (reference,) if self.referred else ()


PLACEMENT = Quantity(
    name="placement",
    title="placement",
    inputs="q",
    shape=(4, 4),
    equations=("7.77",),
    compute=lazy_import("urdfkin.compiled.evaluate:placements"),
    ask=asked("placements"),
    scale=lazy_import("urdfkin.verify.bounds:placement_scale"),
    exact=lazy_import("urdfkin.verify.exact.recursion:placement_values"),
    factors=1,
    referred=False,
    head="place",
    labels=(),
    command="placement",
    summary="pose of a frame",
    example="urdfkin placement panda --q 0,-0.5,0,-2,0,1.5,0.8,0.02",
)
RELATIVE_PLACEMENT = replace(
    PLACEMENT,
    name="relative placement",
    title="placement in another frame",
    against=partial(lazy_import("urdfkin.verify.derived:check_relative_placement"), PLACEMENT.bound),
    walked=False,
    command="",
)
VELOCITY = Quantity(
    name="velocity",
    title="velocity",
    inputs="qv",
    shape=(6,),
    equations=("7.127", "7.128"),
    compute=lazy_import("urdfkin.compiled.evaluate:velocities"),
    ask=asked("velocities"),
    scale=lazy_import("urdfkin.verify.bounds:velocity_scale"),
    exact=lazy_import("urdfkin.verify.exact.recursion:velocity_values"),
    factors=2,
    head="vel",
    units={"linear": "m/s", "angular": "rad/s"},
    command="velocity",
    summary="velocity of a frame",
    page="Of the frame's origin in m/s and about it in rad/s, for joint rates --v.",
    example="urdfkin velocity ur5 --q random --v 1,0,0,0,0,0 --frame tool0",
)
JACOBIAN = Quantity(
    name="jacobian",
    title="Jacobian",
    inputs="q",
    shape=(6, "nv"),
    equations=("7.85",),
    compute=lazy_import("urdfkin.compiled.evaluate:jacobians"),
    ask=asked("jacobians"),
    scale=lazy_import("urdfkin.verify.bounds:jacobian_scale"),
    exact=lazy_import("urdfkin.verify.exact.recursion:jacobian_values"),
    factors=2,
    head="J",
    command="jacobian",
    summary="Jacobian of a frame",
    page="A row of the table for each rate: the velocity it alone causes.",
    example="urdfkin jacobian panda --q random --seed 1 --frame panda_hand",
)
JACOBIAN_RATE = Quantity(
    name="jacobian rate",
    title="Jacobian rate",
    inputs="qv",
    shape=(6, "nv"),
    equations=("7.126",),
    compute=lazy_import("urdfkin.compiled.evaluate:jacobian_rates"),
    ask=asked("jacobian_rates"),
    scale=lazy_import("urdfkin.verify.bounds:jacobian_rate_scale"),
    exact=lazy_import("urdfkin.verify.exact.recursion:jacobian_rate_values"),
    factors=3,
    head="J-dot",
    command="jacobian-rate",
    summary="time derivative of a frame's Jacobian",
    page="Its time derivative for rates --v: a row of the table for each rate. In local_world_aligned,"
    " J a + J' v is the acceleration that `urdfkin acceleration` gives; in local and world it is the spatial"
    " acceleration.",
    example="urdfkin jacobian-rate panda --q random --v random --frame panda_hand",
)
HESSIAN = Quantity(
    name="hessian",
    title="Hessian",
    inputs="q",
    shape=(6, "nv", "nv"),
    equations=("7.85", "7.126"),
    compute=lazy_import("urdfkin.compiled.evaluate:hessians"),
    ask=asked("hessians"),
    scale=lazy_import("urdfkin.verify.bounds:hessian_scale"),
    exact=lazy_import("urdfkin.verify.exact.recursion:hessian_values"),
    factors=3,
    validated=False,
    head="H",
    command="hessian",
    summary="derivatives of a frame's Jacobian by each joint coordinate",
    page="For each column of the Jacobian, a row of the table for each rate: how fast that rate changes the"
    " column. Summed over the rates, each times its --v, that is `urdfkin jacobian-rate`.",
    example="urdfkin hessian panda --q random --seed 1 --frame panda_hand",
)
ACCELERATION = Quantity(
    name="acceleration",
    title="acceleration",
    inputs="qva",
    shape=(6,),
    equations=("7.129", "7.130"),
    compute=lazy_import("urdfkin.compiled.evaluate:accelerations"),
    ask=asked("accelerations"),
    scale=lazy_import("urdfkin.verify.bounds:acceleration_scale"),
    exact=lazy_import("urdfkin.verify.exact.recursion:acceleration_values"),
    factors=3,
    head="acc",
    units={"linear": "m/s^2", "angular": "rad/s^2"},
    command="acceleration",
    summary="classical acceleration of a frame",
    page="The second derivative of the origin's position in m/s^2 and the angular acceleration in rad/s^2,"
    " for rates --v and their rates --a. Gravity is not in it. With --explain, what each joint contributes:"
    " transverse, centripetal, Coriolis and sliding parts (eq. 7.125, joint by joint)."
    f" {Question.TWO_ACCELERATIONS}, {Question.GRAVITY}.",
    example="urdfkin acceleration panda --q random --v random --a random --explain",
)
ANALYTICAL_JACOBIAN = replace(
    JACOBIAN,
    name="analytical jacobian",
    title="analytical Jacobian",
    equations=("7.118", "7.122"),
    compute=lazy_import("urdfkin.kinematics.bodies:analytical_jacobian"),
    against=partial(lazy_import("urdfkin.verify.derived:check_analytical_jacobian"), JACOBIAN.bound),
    walked=False,
    referred=False,
    command="",
)
ACCELERATION_BREAKDOWN = replace(
    ACCELERATION,
    name="acceleration breakdown",
    title="acceleration by its parts",
    equations=("7.125", "7.130"),
    compute=lazy_import("urdfkin.compiled.breakdown:acceleration_breakdown"),
    walked=False,
    command="acceleration --explain",
)
IMU = replace(
    ACCELERATION,
    name="imu",
    title="IMU reading",
    equations=("7.127", "7.129", "7.130"),
    compute=lazy_import("urdfkin.compiled.evaluate:imus"),
    against=lazy_import("urdfkin.verify.derived:check_imu"),
    walked=False,
    referred=False,
    labels=("ax", "ay", "az", "wx", "wy", "wz"),
    units={"proper acceleration": "m/s^2", "angular velocity": "rad/s"},
    command="",
)
JOINT_JACOBIAN = replace(
    JACOBIAN, name="joint jacobian", title="joint Jacobian", ask=asked("joint_jacobians"), of="joints"
)
JOINT_JACOBIAN_RATE = replace(
    JACOBIAN_RATE,
    name="joint jacobian rate",
    title="joint Jacobian rate",
    ask=asked("joint_jacobian_rates"),
    of="joints",
)
SCREWS = replace(
    JACOBIAN, name="screws", title="data.J", shape=(6,), ask=asked("screws"), of="columns", head="data.J"
)

#: Every quantity by its name, in the order of certificates and reports.
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


def walked(of: str = "frames") -> list[Quantity]:
    """Those that the walk computes for any frames, or for any joints."""
    return [row for row in QUANTITIES.values() if row.walked and row.of == of]


def validated(of: str = "frames") -> list[Quantity]:
    """Those of them that are compared wherever everything is."""
    return [row for row in walked(of) if row.validated]


def compared() -> str:
    """What a validation compares of every frame, as a sentence has it."""
    return _listed([row.title for row in validated()])


def not_compared() -> str:
    """What `Robot` computes of a frame that a validation does not compare; a call checks it all the same."""
    return _listed(
        [row.title for row in QUANTITIES.values() if row.of == "frames" and row not in validated()]
    )


def _listed(titles: Sequence[str]) -> str:
    return f"{', '.join(titles[:-1])} and {titles[-1]}"


def by_command() -> dict[str, Quantity]:
    """Those with a command of their own, by its name."""
    return {row.command: row for row in walked() if row.command}


def quantity(name: str) -> Quantity:
    """The row of that name; raises UnknownNameError with the nearest names."""
    if (found := QUANTITIES.get(name)) is None:
        raise UnknownNameError("quantity", name, QUANTITIES)
    return found
