"""Make random robots, which are trees with all kinds of joints and some unusual content.

Most of these robots are legal: a rejected robot would not test the computations. A robot depends only on the
seed, its family and its number.
"""

import math
import random
from collections.abc import Collection
from xml.sax.saxutils import quoteattr

from scripts.fuzzing import Case
from urdfkin.urdf.records import FURTHER_LIMITS

#: Kinds of unusual content. Each kind is also a family of robots. A robot of the family "everything" has each
#: kind with probability 0.4.
ODDITIES = ("names", "prefixes", "versions", "mimic", "lengths", "angles", "axes", "limits", "roots")
FAMILIES = (*ODDITIES, "everything")

#: Names for random robots: internal names of urdfkin or Pinocchio, and similar names.
INTERNAL_NAMES = (
    "a", "link:a", "joint:a", "link:link:a", "link:joint:a", "universe", "root_joint", "base", "link:", "1",
    "joint 1", "moving base (urdfkin)",
)  # fmt: skip
UNUSUAL_NAMES = (
    "-", "--", " ", " a", "a ", "\u00a0", "\u200b", "_", ".", "/", "../a", "a/b", "ä", "a\u0308", "关节",
    "\U0001f916", "\u202eba", "<a>", "&amp;", "'", '"', "#", "%s", "{0}", "$a", "=1+1", "null", "None", "nan",
    "0", "-1", "A", "joint", "link", "world", "a,b", "a;b", "[a]", "\\", "x" * 300, "y" * 9_999,
)  # fmt: skip
_PARTS = ("link:", "joint:", "a", "b", ":", " ", "-", "ä", "universe", "1")

KINDS = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")
_WEIGHTS = (5, 4, 4, 3, 1, 1)
_ONE_COORDINATE = KINDS[:3]

#: XML elements that other programs add to URDF files.
#: A namespace prefix replaces `{p}`.
#: A URDF reader must ignore these elements.
_FOREIGN = (
    '<{p}:joint name="j0" type="fixed"><parent link="l0"/><child link="l1"/></{p}:joint>',
    '<{p}:link name="l0"/>',
    '<{p}:mimic joint="j0" multiplier="9"/>',
    '<{p}:axis xyz="1 1 1"/>',
    '<{p}:origin xyz="9 9 9"/>',
    '<{p}:x><link name="l0"/><mimic joint="j0"/></{p}:x>',
    '<{p}:x {p}:y="1"/>',
    '<gazebo reference="l0"><{p}:joint name="l0"/></gazebo>',
    '<gazebo><plugin name="p" {p}:file="x">text</plugin></gazebo>',
    '<transmission name="t"><joint name="j0"><{p}:x/></joint></transmission>',
)
PREFIXES = ("drake", "gazebo", "link", "joint", "x", "mujoco", "ns0", "xml", "_", "a.b")


_TURNS = (0.0, math.pi, -math.pi, math.pi / 2, 1.5708, 3.14159, 1e-9)


def format_number(rng: random.Random, x: float) -> str:
    plain = repr(x)
    if rng.random() < 0.85:
        return plain
    return rng.choice((f"+{plain}" if x >= 0.0 else plain, f"{x:.17g}", f"{x:.40e}", f"{x:.3g}", f"{x:E}"))


def format_vector(rng: random.Random, numbers: list[float]) -> str:
    return " ".join(format_number(rng, x) for x in numbers)


def usual_length(rng: random.Random) -> float:
    return rng.choice((0.0, 0.0, round(rng.uniform(-1.0, 1.0), 3), rng.uniform(-1.0, 1.0)))


def odd_length(rng: random.Random) -> float:
    """Return a length of random magnitude, below 1e301 so that a sum of lengths does not overflow."""
    ranges = ((-320, 300), (-20, 20), (-6, 8), (-320, -150), (-310, -310))
    exponent = rng.choice([rng.uniform(*ends) for ends in ranges])
    return rng.choice((-1.0, 1.0)) * rng.uniform(1.0, 9.9) * math.pow(10.0, exponent)


def usual_angle(rng: random.Random) -> float:
    return rng.choice((*_TURNS[:4], rng.uniform(-math.pi, math.pi)))


def odd_angle(rng: random.Random) -> float:
    near = rng.choice(_TURNS) + rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-18, -3)
    large = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(0, 15)
    return rng.choice((near, large, 10.0 ** rng.uniform(-320, 0), rng.uniform(-9.0, 9.0), 90.0, 180.0))


def draw_direction(rng: random.Random) -> list[float]:
    if rng.random() < 0.5:
        axis = [0.0, 0.0, 0.0]
        axis[rng.randrange(3)] = rng.choice((1.0, -1.0))
        return axis
    numbers = [rng.gauss(0.0, 1.0) for _ in range(3)]
    return [x / math.hypot(*numbers) for x in numbers]


def odd_axis(rng: random.Random) -> list[float]:
    axis = draw_direction(rng)
    if rng.random() < 0.5:
        tilt = 10.0 ** rng.uniform(-20, -3)
        axis = [x + tilt * rng.gauss(0.0, 1.0) for x in axis]
    size = odd_size(rng)
    return [x * (odd_size(rng) if rng.random() < 0.05 else size) for x in axis]


def odd_quaternion(rng: random.Random) -> list[float]:
    numbers = rng.choice(
        (
            [0.0, 0.0, 0.0, 1.0],
            [rng.gauss(0.0, 1.0) for _ in range(4)],
            [10.0 ** rng.uniform(-20, -3), 0.0, 0.0, -1.0],
            [0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)],
            [rng.choice((0.0, 1.0, -1.0, 1e-310)) for _ in range(4)],
        )
    )
    size = odd_size(rng)
    return [x * size for x in numbers]


def odd_size(rng: random.Random) -> float:
    exponent = rng.choice((0.0, 0.0, rng.uniform(-1e-9, 1e-9), rng.uniform(-6, 6), rng.uniform(-170, 170)))
    return math.pow(10.0, rng.uniform(-320, 300) if rng.random() < 0.05 else exponent)


def odd_factor(rng: random.Random) -> float:
    plain = (0.0, -0.0, 1.0, -1.0, 3.7, -0.1, 1e-300, 5e-324)
    return rng.choice((*plain, rng.gauss(0.0, 1.0), -(10.0 ** rng.uniform(-12, 12))))


def odd_range(rng: random.Random, turns: bool) -> tuple[float, float]:
    a = odd_angle(rng) if turns else odd_length(rng)
    b = odd_angle(rng) if turns else odd_length(rng)
    if rng.random() < 0.02:
        return max(a, b), min(a, b)
    far = rng.uniform(-1e6, 1e6)
    drawn = ((min(a, b), max(a, b)), (a, a), (a, math.nextafter(a, math.inf)), (far, far + 1.0))
    plain = ((-1e300, 1e300), (0.0, 0.0), (-0.0, 5e-324), (-math.pi, math.pi))
    return rng.choice((*drawn, *plain))


def odd_limit(rng: random.Random) -> str:
    refused = ("-1.0", "-5e-324", "inf", "nan", "", "1e400", "0x10", "1.0 ")
    fine = ("0", "-0.0", "1e300", "5e-324", "1e-400")
    return (
        rng.choice(refused) if rng.random() < 0.03 else rng.choice((*fine, format_number(rng, rng.random())))
    )


def make_robot(seed: int, family: str, number: int) -> Case:
    rng = random.Random(f"{seed}:{family}:{number}")
    if family == "everything":
        strange: Collection[str] = {name for name in ODDITIES if rng.random() < 0.4}
    else:
        strange = {family}
    root_joint = rng.choice((None, "floating", "planar")) if "roots" in strange else None
    mimic = rng.choice((None, None, None, True, False)) if "mimic" in strange else None
    what = f"{family} {number}: {' '.join(sorted(strange)) or 'plain'}"
    return Case(what, _RandomRobot(rng, strange).text().encode(), root_joint, mimic)


class _RandomRobot:
    def __init__(self, rng: random.Random, strange: Collection[str]) -> None:
        self.rng, self.strange = rng, strange
        self.version = rng.choice(("", "1.0", "1.1", "1.1", "1.2", "1.2")) if "versions" in strange else ""
        count = rng.randint(1, 8) if rng.random() < 0.97 else 0
        self.links, self.joints = self.names("l", count + 1), self.names("j", count)
        self.kinds = [rng.choices(KINDS, _WEIGHTS)[0] for _ in range(count)]
        if "mimic" in strange and count > 1:
            self.kinds[0] = "revolute"
        declared = rng.random() < 0.5
        self.prefix = rng.choice(PREFIXES)
        self.declaration = (
            f' xmlns:{self.prefix}="http://example.org/{self.prefix}"'
            if "prefixes" in strange and declared and self.prefix != "xml"
            else ""
        )

    def text(self) -> str:
        rng, version = self.rng, self.version
        numbers = f' version="{version}"' if version else ""
        name = quoteattr(rng.choice((*INTERNAL_NAMES, *UNUSUAL_NAMES)) if "names" in self.strange else "r")
        parts = [f"<link name={quoteattr(link)}>{self.foreign()}</link>" for link in self.links]
        parts += [self.joint(i) for i in range(len(self.joints))]
        if rng.random() < 0.3:
            rng.shuffle(parts)
        return (
            f"<robot name={name}{numbers}{self.declaration}>\n"
            + "\n".join(parts)
            + f"{self.foreign()}\n</robot>\n"
        )

    def names(self, letter: str, count: int) -> list[str]:
        if "names" not in self.strange:
            return [f"{letter}{i}" for i in range(count)]
        names = dict[str, None]()
        while len(names) < count:
            mixed = "".join(self.rng.choices(_PARTS, k=self.rng.randint(1, 4)))
            names[
                self.rng.choice((self.rng.choice(INTERNAL_NAMES), self.rng.choice(UNUSUAL_NAMES), mixed))
            ] = None
        return list(names)

    def joint(self, i: int) -> str:
        """Return joint i, whose child is link i + 1."""
        rng, kind = self.rng, self.kinds[i]
        # Link i is the most probable parent, so about half of the random robots are chains. A chain
        # accumulates the largest rounding errors.
        parent = i if rng.random() < 0.7 else rng.randint(0, i)
        parts = [
            f"<parent link={quoteattr(self.links[parent])}/>",
            f"<child link={quoteattr(self.links[i + 1])}/>",
            self.origin(),
            self.axis(kind),
            self.limit(kind),
            self.mimic(i),
            self.foreign(),
        ]
        return f'<joint name={quoteattr(self.joints[i])} type="{kind}">{"".join(parts)}</joint>'

    def origin(self) -> str:
        rng = self.rng
        length = odd_length if "lengths" in self.strange and rng.random() < 0.5 else usual_length
        angle = odd_angle if "angles" in self.strange and rng.random() < 0.5 else usual_angle
        xyz = f' xyz="{format_vector(rng, [length(rng) for _ in range(3)])}"'
        rpy = f' rpy="{format_vector(rng, [angle(rng) for _ in range(3)])}"'
        if "versions" in self.strange and rng.random() < 0.5:
            quaternion = f' quat_xyzw="{format_vector(rng, odd_quaternion(rng))}"'
            rpy = quaternion if rng.random() < 0.95 else rpy + quaternion
        return rng.choice((f"<origin{xyz}{rpy}/>",) * 4 + (f"<origin{rpy}/>", f"<origin{xyz}/>", ""))

    def axis(self, kind: str) -> str:
        if kind == "planar":
            return '<axis xyz="0 0 1"/>'
        if kind in ("fixed", "floating"):
            return ""
        odd_one = "axes" in self.strange and self.rng.random() < 0.8
        numbers = odd_axis(self.rng) if odd_one else draw_direction(self.rng)
        return f'<axis xyz="{format_vector(self.rng, numbers)}"/>' if self.rng.random() < 0.9 else ""

    def limit(self, kind: str) -> str:
        rng = self.rng
        # In URDF 1.2, planar, floating and fixed joints may have limits.
        least = 0.8 if "versions" in self.strange else 1.0
        idle = kind not in _ONE_COORDINATE and rng.random() < least
        if idle or (kind == "continuous" and rng.random() < 0.7):
            return ""
        lower, upper, effort = -1.0 - rng.random(), 1.0 + rng.random(), 1.0
        if "limits" in self.strange:
            lower, upper = odd_range(rng, kind == "revolute")
            effort = rng.choice((0.0, 1.0, 1e300, 5e-324, abs(odd_length(rng))))
        attributes = [f'lower="{format_number(rng, lower)}"', f'upper="{format_number(rng, upper)}"']
        if kind == "continuous" or (kind not in _ONE_COORDINATE and rng.random() < 0.5):
            attributes = []
        elif "limits" in self.strange and rng.random() < 0.2:
            attributes.pop(rng.randrange(2))
        attributes += [f'{word}="{format_number(rng, effort)}"' for word in ("effort", "velocity")]
        if "versions" in self.strange:
            further = [name for name in FURTHER_LIMITS if rng.random() < 0.3]
            attributes += [f'{name}="{odd_limit(rng)}"' for name in further]
        return f"<limit {' '.join(attributes)}/>"

    def mimic(self, i: int) -> str:
        rng = self.rng
        if "mimic" not in self.strange or self.kinds[i] not in _ONE_COORDINATE or rng.random() < 0.35:
            return ""
        # A mimic joint mimics only a joint with a lower number, so there is no cycle.
        independent_joints = [j for j in range(i) if self.kinds[j] in _ONE_COORDINATE]
        if not independent_joints:
            return ""
        attributes = [f"joint={quoteattr(self.joints[rng.choice(independent_joints)])}"]
        if rng.random() < 0.9:
            attributes.append(f'multiplier="{format_number(rng, odd_factor(rng))}"')
        if rng.random() < 0.6:
            attributes.append(f'offset="{format_number(rng, rng.choice((odd_angle, usual_angle))(rng))}"')
        return f"<mimic {' '.join(attributes)}/>"

    def foreign(self) -> str:
        if "prefixes" not in self.strange or self.rng.random() < 0.6:
            return ""
        return self.rng.choice(_FOREIGN).format(p=self.prefix)
