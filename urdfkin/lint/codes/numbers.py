"""URDF3xx: numbers and vectors."""

from urdfkin.lint.rule import ERROR, REFUSES, WARNING, Code


def _origin(attributes: str) -> str:
    return (
        '<joint name="j" type="fixed">\n  <parent link="base"/>\n  <child link="tip"/>\n'
        f"  <origin {attributes}/>\n</joint>\n"
    )


BAD_NUMBER = Code(
    "URDF301",
    "bad-number",
    ERROR,
    "not a number as URDF writes them",
    why="A number is ASCII: sign, digits, point, exponent, as in -1.5e-3. No units, no commas, no"
    " hexadecimal, no 1_0, no nan and no inf: each of these is read by some programs and refused, or read as"
    " something else, by others. A number too large for a double (1e400) is refused too.",
    bad=_origin('xyz="0 0 0x10"'),
    good=_origin('xyz="0 0 16"'),
    others="Pinocchio refuses it; yourdfpy refuses it: it takes nan, inf and 1_0, though.",
)

BAD_VECTOR = Code(
    "URDF302",
    "bad-vector",
    ERROR,
    "not exactly as many numbers as the vector has",
    why="xyz and rpy are three numbers. With fewer or more, nobody can know which one is meant.",
    bad=_origin('xyz="0 1"'),
    good=_origin('xyz="0 1 0"'),
    others="Pinocchio refuses it; yourdfpy refuses it: not for every vector, though.",
)

WHITESPACE = Code(
    "URDF303",
    "whitespace-in-number",
    WARNING,
    "numbers are separated or followed by blanks that urdfdom refuses",
    why="XML turns tabs and line ends in an attribute into spaces, so the value is legal. urdfdom's parser"
    " keeps them and then refuses the number; it also refuses a space after a single number. The robot is"
    " computed, but Pinocchio cannot read it, so nothing can be verified.",
    bad=_origin('xyz="0\t0 1"'),
    good=_origin('xyz="0 0 1"'),
    others="Pinocchio refuses it; yourdfpy reads it.",
    oracle=REFUSES,
)

UNDERFLOW = Code(
    "URDF304",
    "underflow",
    WARNING,
    "a number too small for a double: it is read as zero",
    why="The smallest double is about 5e-324. A value below it is lost; probably the exponent is mistyped.",
    bad=_origin('xyz="0 0 1e-400"'),
    good=_origin('xyz="0 0 1e-4"'),
    others="Pinocchio reads it as zero; yourdfpy reads it as zero.",
)

NUMBER_TOO_LONG = Code(
    "URDF305",
    "number-too-long",
    ERROR,
    "a number has more characters than the limit allows",
    why="The limit is 2,000 characters for each number of an attribute. Seventeen digits tell every double;"
    " what converts longer ones takes time that grows with the square of their length. It can be raised:"
    " --max-number, or `Limits` in the library.",
    bad=_origin(f'xyz="0 0 0.{"3" * 2000}"'),
    good=_origin('xyz="0 0 0.3333333333333333"'),
    others="Pinocchio reads it; yourdfpy reads it.",
)
