"""Collect the exported functions of one frame, and write their expressions as text."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from urdfkin.compiled.plan import CompiledTree, StepField
from urdfkin.errors import InputError, UnknownNameError
from urdfkin.errors.validators import as_names, as_str, reject_set
from urdfkin.export import recursion
from urdfkin.export.check import EXPORT_MARK, SEAL
from urdfkin.export.expression import Node, Number
from urdfkin.export.function import Function, make_function
from urdfkin.export.naming import comment_name, comment_text, function_prefix, unique_safe_names
from urdfkin.export.proof import Proof, make_proof
from urdfkin.model.configuration import coordinate_names, velocity_names
from urdfkin.model.reference import Reference
from urdfkin.model.tree import KinematicTree
from urdfkin.verify.quantities import QUANTITIES, Quantity, recursive_quantities
from urdfkin.verify.verifier import Verifier

#: Precedences of operators, the lowest first.
_SUM, _SIGN, _PRODUCT = range(3)
_PRECEDENCE = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT}


@dataclass(frozen=True)
class FrameCode:
    """The functions of a frame.

    The names of the robot, the frame, the coordinates and the joints are escaped, so no name can end a
    comment.

    Attributes:
        identifiers: Lists of names in the code. The keys are "q" (coordinates), "v" and "a" (velocities), and
            "s" (joints).
        maybe_proof: The proof, or None for code that is not exported.
        exact: Function that returns the code with exact constants.
    """

    name: str
    robot: str
    frame: str
    reference: Reference
    functions: tuple[Function, ...]
    coordinates: tuple[str, ...]
    rates: tuple[str, ...]
    joints: tuple[str, ...]
    identifiers: dict[str, list[str]]
    about: tuple[str, ...] = ()
    maybe_proof: Proof | None = None
    exact: Callable[[], FrameCode] | None = None

    @property
    def proof(self) -> Proof:
        if self.maybe_proof is None:
            raise ValueError("the code has no proof, so it cannot be exported")
        return self.maybe_proof

    @property
    def inputs(self) -> str:
        return max((function.inputs for function in self.functions), key=len)

    @property
    def nq(self) -> int:
        return len(self.coordinates)

    @property
    def nv(self) -> int:
        return len(self.rates)

    def widths(self, function: Function) -> dict[str, int]:
        return {letter: self.nq if letter == "q" else self.nv for letter in function.inputs}

    @property
    def header(self) -> list[str]:
        """Lines of a file's header.

        The first line marks unverified code.
        """
        verdict, *rest = self.proof.lines
        subject = f"{self.robot}, frame {self.frame}"
        about = f"Kinematics of {subject}: {EXPORT_MARK}."
        verified = self.proof.certificate.verified
        lines = [
            *([about, "", verdict] if verified else [verdict, about, ""]),
            *rest,
            SEAL,
            "",
            "Units are metres, radians and seconds. Results are written row by row.",
            "Six-vectors and the rows of a Jacobian are [linear; angular] in the reference frame",
            f"{self.reference.name}. Accelerations are classical, without gravity.",
            "Numbers such as 7.130 are equations of the textbook. To read one: urdfkin explain 7.130",
            "",
            *(f"q[{i}] {name}" for i, name in enumerate(self.coordinates)),
        ]
        if self.rates != self.coordinates:
            lines += [f"v[{i}], a[{i}] {name}" for i, name in enumerate(self.rates)]
        return [*lines, *([""] if self.about else []), *self.about]


def make_verified_code(
    verifier: Verifier,
    plan_of: Callable[[Sequence[int]], CompiledTree],
    frame: str,
    quantities: Collection[str],
    reference: Reference | str,
    *,
    name: str | None,
    verify: bool | None,
    about: str = "",
) -> FrameCode:
    """Make functions and their test vectors.

    Pinocchio checks the functions unless verification is off.
    """
    tree, reference = verifier.tree, Reference.of(reference)
    plan = plan_of([tree.frame_link(frame)])
    rows = _parse_quantities(quantities)
    if not tree.nv and any(row.has_columns for row in rows):
        raise InputError(
            "the Jacobian has no columns",
            where=tree.name,
            found="no moving joint",
            remedy="export the placement instead",
        )
    prefix = function_prefix("", name) if name else function_prefix(tree.name, frame)
    code = make_unverified_code(tree, plan, frame, rows, reference, prefix)
    proof = make_proof(verifier, plan_of, frame, reference, code.functions, verify)
    code = replace(code, maybe_proof=proof, about=tuple(map(comment_text, about.splitlines())))

    def exact() -> FrameCode:
        from urdfkin.export.exact import make_exact_functions

        functions, exact_proof = make_exact_functions(
            verifier, plan_of, frame, reference, code.functions, proof, verify
        )
        return replace(code, functions=functions, maybe_proof=exact_proof, exact=None)

    return replace(code, exact=exact)


def make_unverified_code(
    tree: KinematicTree,
    plan: CompiledTree,
    frame: str,
    rows: Sequence[Quantity],
    reference: Reference,
    name: str,
) -> FrameCode:
    coordinates, rates = coordinate_names(tree), velocity_names(tree)
    joints = tuple(tree.joints[i].name for i in plan.joints)
    names = {"q": coordinates, "v": rates, "a": rates, "s": joints}
    return FrameCode(
        name=name,
        robot=comment_name(tree.name),
        frame=comment_name(frame),
        reference=reference,
        functions=tuple(make_function(plan, row, reference) for row in rows),
        coordinates=tuple(map(comment_name, coordinates)),
        rates=tuple(map(comment_name, rates)),
        joints=tuple(map(comment_name, joints)),
        identifiers={letter: unique_safe_names(found) for letter, found in names.items()},
    )


def exportable_quantities() -> list[Quantity]:
    return [row for row in recursive_quantities() if row.name in recursion.QUANTITY_FUNCTIONS]


def _parse_quantities(names: Collection[str]) -> list[Quantity]:
    reject_set(names, "quantities")
    checked = [as_str(name, "each of quantities") for name in as_names(names, "quantities")]
    names_of_methods = [row.method for row in exportable_quantities()]
    for name in checked:
        if name.replace("_", " ") not in QUANTITIES:
            raise UnknownNameError("quantity", name, names_of_methods)
    rows = [QUANTITIES[name] for name in dict.fromkeys(name.replace("_", " ") for name in checked)]
    possible = ", ".join(names_of_methods)
    if not rows:
        raise InputError("no quantity to export", remedy=f"name some of {possible}")
    for row in rows:
        if row not in exportable_quantities():
            raise InputError(f"the {row.name} cannot be exported", remedy=f"choose among {possible}")
    return rows


class Writer:
    """Writes expressions as code.

    If `sine` is False, the code reads sines and cosines from its inputs instead of computing them.
    """

    def __init__(
        self,
        code: FrameCode,
        function: Function,
        literal: Callable[[float], str] = repr,
        *,
        sine: bool = True,
    ) -> None:
        self.code, self.function, self.literal = code, function, literal
        self.variables = set(function.statements)
        self.leaves = () if sine else ("sin", "cos")
        self.dependencies = function.dependencies_without(self.leaves)
        self.names = {node: self._name(node, k) for k, node in enumerate(function.nodes)}

    def _name(self, node: Node, k: int) -> str:
        identifiers = self.code.identifiers
        if node.op in identifiers:
            return f"{node.op}_{identifiers[node.op][node.operands[0]]}"
        if node.op in ("sin", "cos") and node.step >= 0:
            return f"{node.op[0]}_{identifiers['s'][node.step]}"
        return node.name or f"t{k}"

    @property
    def inputs(self) -> list[Node]:
        leaves = (*self.code.identifiers, *self.leaves)
        return [node for node in self.function.nodes if node.op in leaves and node in self.dependencies]

    def statements(self) -> Iterator[tuple[str, list[tuple[str, str]]]]:
        """Yield a comment and assignments for each step."""
        nodes = [x for x in self.function.statements if x in self.dependencies and x.op not in self.leaves]
        for step, group in groupby(nodes, key=lambda node: node.step):
            assigned = list(group)
            equations = dict.fromkeys(n for x in assigned for n in x.equation.split(", ") if n)
            lines = [(self.names[node], self.value(node)) for node in assigned]
            yield ": ".join(filter(None, (self._describe_step(step), ", ".join(equations)))), lines

    def _describe_step(self, step: int) -> str:
        joints, steps = self.code.joints, self.function.plan.steps
        if step < 0:
            return "constants"
        if step < len(joints):
            kind = ("is revolute", "is prismatic", "is planar", "is floating")[steps[step, StepField.KIND]]
            return f"{joints[step]} {kind}"
        return self.code.frame if step == len(joints) else "results"

    def results(self) -> list[str]:
        return [self.text(x) for x in self.function.results]

    def text(self, x: Number, precedence: int = _SUM) -> str:
        """Return an expression as code, with brackets if necessary."""
        if not isinstance(x, Node):
            return self.literal(float(x) if isinstance(x, int) else x)
        if x in self.variables or x.op in self.code.identifiers:
            return self.names[x]
        return self.value(x, precedence)

    def value(self, x: Node, precedence: int = _SUM) -> str:
        if x.op in ("sin", "cos", "sqrt"):
            return f"{x.op}({self.text(x.operands[0])})"
        return _arithmetic(x, self.text, precedence)

    def expand(self, x: Number, input_text: Callable[[Node], str], precedence: int = _SUM) -> str:
        """Return an expression as code that contains inputs, but no other variables."""
        if not isinstance(x, Node):
            return self.literal(float(x))
        if x.op in self.code.identifiers:
            return input_text(x)
        return _arithmetic(x, lambda y, level: self.expand(y, input_text, level), precedence)


def _arithmetic(x: Node, text: Callable[[Number, int], str], precedence: int) -> str:
    if x.op == "neg":
        own, result = _SIGN, f"-{text(x.operands[0], _PRODUCT)}"
    else:
        own = _PRECEDENCE[x.op]
        # Brackets as in a + (b + c) keep the order of operations that was compared with Pinocchio.
        result = f"{text(x.operands[0], own)} {x.op} {text(x.operands[1], own + 1)}"
    return result if own >= precedence else f"({result})"
