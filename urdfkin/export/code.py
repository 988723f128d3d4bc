"""The exported functions of one frame, before they are written in a programming language."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from urdfkin.compiled.plan import CompiledTree, StepField
from urdfkin.errors import InputError
from urdfkin.errors.validators import as_names, as_str
from urdfkin.export import recursion
from urdfkin.export.expression import Node, Number
from urdfkin.export.function import Function, function_of
from urdfkin.export.naming import all_safe, quiet, shown, title
from urdfkin.export.proof import Proof, prove
from urdfkin.export.seal import SEAL
from urdfkin.model.configuration import coordinate_names, rate_names
from urdfkin.model.reference import Reference
from urdfkin.model.tree import KinematicTree
from urdfkin.verify.quantities import Quantity, quantity, recursive_quantities
from urdfkin.verify.verifier import Verifier

#: A sum has the lowest precedence. An operand that needs no brackets has the highest precedence.
_SUM, _SIGN, _PRODUCT, _ATOM = range(4)
_LEVEL = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT}


@dataclass(frozen=True)
class FrameCode:
    """The functions of a frame. No name contains characters that end a comment in the exported file.

    Attributes:
        name: Prefix of the names of functions.
        coordinates: Names of the coordinates of q.
        rates: Names of the coordinates of v and a.
        joints: Names of the path's moving joints.
        words: Identifiers in the exported code, by "q", "v" and "a" for the numbers of the input, and by "s"
            for the path's joints.
        about: Lines of the file's header that contain the Denavit-Hartenberg table or the screws; empty for
            code from a URDF's joints.
        vouched: The comparison with Pinocchio and the test vectors; None for code that urdfkin compiles for
            its own use.
        exact: Function that returns this code with fractions instead of doubles as constants. None if there
            is no such code, or if the constants are already exact.
    """

    name: str
    robot: str
    frame: str
    reference: Reference
    functions: tuple[Function, ...]
    coordinates: tuple[str, ...]
    rates: tuple[str, ...]
    joints: tuple[str, ...]
    words: dict[str, list[str]]
    about: tuple[str, ...] = ()
    vouched: Proof | None = None
    exact: Callable[[], FrameCode] | None = None

    @property
    def proof(self) -> Proof:
        """The comparison of the functions with Pinocchio, and the test vectors."""
        if self.vouched is None:
            raise ValueError("code that was not verified is not exported")
        return self.vouched

    @property
    def nq(self) -> int:
        return len(self.coordinates)

    @property
    def nv(self) -> int:
        return len(self.rates)

    def widths(self, function: Function) -> dict[str, int]:
        return {letter: self.nq if letter == "q" else self.nv for letter in function.inputs}

    @property
    def head(self) -> list[str]:
        """The lines of a file's header, without comment marks; the first may say UNVERIFIED."""
        verdict, *rest = self.proof.lines
        lines = [verdict] if not self.proof.certificate.verified else []
        lines += [
            f"Kinematics of {self.robot}, frame {self.frame}: straight-line code for this robot and frame."
        ]
        lines += ["", *([verdict] if not lines[0].startswith("UNVERIFIED") else []), *rest, SEAL, ""]
        lines += [
            "Metres, radians, seconds. Results are row by row; six-vectors and Jacobian rows are [linear;"
        ]
        lines += [f"angular] in {self.reference.name}; accelerations are classical, without gravity."]
        lines += ["Numbers such as 7.130 are equations of the textbook: urdfkin explain 7.130", ""]
        lines += [f"q[{i}] {name}" for i, name in enumerate(self.coordinates)]
        if self.rates != self.coordinates:
            lines += [f"v[{i}], a[{i}] {name}" for i, name in enumerate(self.rates)]
        return [*lines, *([""] if self.about else []), *self.about]


def code_of(
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
    """Return the code of a frame with test vectors and with the result of the comparison with Pinocchio.

    `plan_of` returns the compiled tree of the joints that move the given links. By default, the prefix `name`
    of the functions consists of the names of the robot and the frame. `about` is a text for the file's
    header: the Denavit-Hartenberg table or the screws.

    Raises:
        UnknownNameError: the frame, a quantity or the reference is unknown.
        InputError: no quantity is given, or a quantity cannot be exported.
        VerificationError: Pinocchio computes another result.
    """
    tree, reference = verifier.tree, Reference.of(reference)
    plan = plan_of([tree.frame_link(frame)])
    rows = _rows(quantities)
    if not tree.nv and any(row.columns for row in rows):
        raise InputError(
            "the Jacobian has no columns",
            where=tree.name,
            found="no moving joint",
            remedy="export the placement instead",
        )
    code = bare(tree, plan, frame, rows, reference, title("", name) if name else title(tree.name, frame))
    proof = prove(verifier, plan_of, frame, reference, code.functions, verify)
    code = replace(code, vouched=proof, about=tuple(map(quiet, about.splitlines())))

    def exact() -> FrameCode:
        from urdfkin.export.exact import exact_functions

        functions, vouched = exact_functions(
            verifier, plan_of, frame, reference, code.functions, proof, verify
        )
        return replace(code, functions=functions, vouched=vouched, exact=None)

    return replace(code, exact=exact)


def bare(
    tree: KinematicTree,
    plan: CompiledTree,
    frame: str,
    rows: Sequence[Quantity],
    reference: Reference,
    name: str,
) -> FrameCode:
    coordinates, rates = coordinate_names(tree), rate_names(tree)
    joints = tuple(tree.joints[i].name for i in plan.joints)
    return FrameCode(
        name=name,
        robot=shown(tree.name),
        frame=shown(frame),
        reference=reference,
        functions=tuple(function_of(plan, row, reference) for row in rows),
        coordinates=tuple(map(shown, coordinates)),
        rates=tuple(map(shown, rates)),
        joints=tuple(map(shown, joints)),
        words={"q": all_safe(coordinates), "v": all_safe(rates), "a": all_safe(rates), "s": all_safe(joints)},
    )


def exported() -> list[Quantity]:
    return [row for row in recursive_quantities() if row.name in recursion.QUANTITIES]


def _rows(names: Collection[str]) -> list[Quantity]:
    named = [as_str(name, "each of quantities") for name in as_names(names, "quantities")]
    rows = [quantity(name.replace("_", " ")) for name in dict.fromkeys(named)]
    if not rows:
        raise InputError(
            "no quantity to export", remedy=f"name some of {', '.join(x.method for x in exported())}"
        )
    for row in rows:
        if row not in exported():
            raise InputError(
                f"the {row.name} cannot be exported",
                remedy=f"choose among {', '.join(x.method for x in exported())}",
            )
    return rows


class Writer:
    """Writes a function's expressions in a language in which a sum is written as a + b.

    `literal` writes a constant. Without `sine`, sines and cosines are inputs of the written code.
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
        self.own = set(function.statements)
        self.leaves = () if sine else ("sin", "cos")
        self.inside = function.within(self.leaves)
        self.words = {node: self._word(node, k) for k, node in enumerate(function.nodes)}

    def _word(self, node: Node, k: int) -> str:
        words = self.code.words
        if node.op in words:
            return f"{node.op}_{words[node.op][node.of[0]]}"
        if node.op in ("sin", "cos") and node.place >= 0:
            return f"{node.op[0]}_{words['s'][node.place]}"
        return node.name or f"t{k}"

    @property
    def given(self) -> list[Node]:
        """The needed numbers of q, v and a, and the sines and cosines if they are inputs."""
        leaves = (*self.code.words, *self.leaves)
        return [node for node in self.function.nodes if node.op in leaves and node in self.inside]

    def statements(self) -> Iterator[tuple[str, list[tuple[str, str]]]]:
        """For each joint of the path, yield a comment and a list of assignments (name, value)."""
        nodes = [x for x in self.function.statements if x in self.inside and x.op not in self.leaves]
        for place, group in groupby(nodes, key=lambda node: node.place):
            found = list(group)
            numbers = dict.fromkeys(n for x in found for n in x.equation.split(", ") if n)
            lines = [(self.words[node], self.defined(node)) for node in found]
            yield ": ".join(filter(None, (self._place(place), ", ".join(numbers)))), lines

    def _place(self, place: int) -> str:
        joints, steps = self.code.joints, self.function.plan.steps
        if place < 0:
            return "constants"
        if place < len(joints):
            kind = ("is revolute", "is prismatic", "is planar", "is floating")[steps[place, StepField.KIND]]
            return f"{joints[place]} {kind}"
        return self.code.frame if place == len(joints) else "results"

    def results(self) -> list[str]:
        return [self.text(x) for x in self.function.results]

    def text(self, x: Number, level: int = _SUM) -> str:
        """Return an expression as text, in brackets if the precedence of its operator is below `level`."""
        if not isinstance(x, Node):
            return self.literal(float(x) if isinstance(x, int) else x)
        if x in self.own or x.op in self.code.words:
            return self.words[x]
        return self.defined(x, level)

    def defined(self, x: Node, level: int = _SUM) -> str:
        """Return the text of an expression, as on the right-hand side of an assignment."""
        if x.op in ("sin", "cos", "sqrt"):
            return f"{x.op}({self.text(x.of[0])})"
        if x.op == "neg":
            text, own = f"-{self.text(x.of[0], _PRODUCT)}", _SIGN
        else:
            own = _LEVEL[x.op]
            left, right = x.of
            # The brackets of a + (b + c) keep the order of the check with Pinocchio.
            text = f"{self.text(left, own)} {x.op} {self.text(right, own + 1)}"
        return text if own >= level else f"({text})"

    def whole(self, x: Number, given: Callable[[Node], str], level: int = _SUM) -> str:
        """Return an expression, such as an angle, as a text that contains only inputs and constants."""
        if not isinstance(x, Node):
            return self.literal(float(x))
        if x.op in self.code.words:
            return given(x)
        own = _LEVEL.get(x.op, _SIGN)
        if x.op == "neg":
            text = f"-{self.whole(x.of[0], given, _PRODUCT)}"
        else:
            text = f"{self.whole(x.of[0], given, own)} {x.op} {self.whole(x.of[1], given, own + 1)}"
        return text if own >= level else f"({text})"
