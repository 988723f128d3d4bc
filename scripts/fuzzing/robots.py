"""Make random robots, which are trees with all kinds of joints and some unusual content.

Most of these robots are legal: a rejected robot would not test the computations. A robot depends only on the
seed, its family and its number.
"""

import random
from collections.abc import Collection
from xml.sax.saxutils import quoteattr

from scripts.fuzzing import Case
from scripts.fuzzing import odd_numbers as odd
from urdfkin.urdf.records import FURTHER_LIMITS

#: Robots of the family "everything" have several random kinds of unusual content.
ODDITIES = ("names", "prefixes", "versions", "followers", "lengths", "angles", "axes", "limits", "roots")
FAMILIES = (*ODDITIES, "everything")

#: Names that resemble internal names of urdfkin or Pinocchio.
LIKE_OURS = (
    "a", "link:a", "joint:a", "link:link:a", "link:joint:a", "universe", "root_joint", "base", "link:", "1",
    "joint 1", "moving base (urdfkin)",
)  # fmt: skip
STRANGE = (
    "-", "--", " ", " a", "a ", "\u00a0", "\u200b", "_", ".", "/", "../a", "a/b", "ä", "a\u0308", "关节",
    "\U0001f916", "\u202eba", "<a>", "&amp;", "'", '"', "#", "%s", "{0}", "$a", "=1+1", "null", "None", "nan",
    "0", "-1", "A", "joint", "link", "world", "a,b", "a;b", "[a]", "\\", "x" * 300, "y" * 9_999,
)  # fmt: skip
_PARTS = ("link:", "joint:", "a", "b", ":", " ", "-", "ä", "universe", "1")

KINDS = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")
_WEIGHTS = (5, 4, 4, 3, 1, 1)
_ONE_COORDINATE = KINDS[:3]

#: Elements of other programs, which a URDF reader must not interpret as joints; {p} is a prefix.
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


def robot(seed: int, family: str, number: int) -> Case:
    rng = random.Random(f"{seed}:{family}:{number}")
    if family == "everything":
        strange: Collection[str] = {name for name in ODDITIES if rng.random() < 0.4}
    else:
        strange = {family}
    root_joint = rng.choice((None, "floating", "planar")) if "roots" in strange else None
    mimic = rng.choice((None, None, None, True, False)) if "followers" in strange else None
    what = f"{family} {number}: {' '.join(sorted(strange)) or 'plain'}"
    return Case(what, _Robot(rng, strange).text().encode(), root_joint, mimic)


class _Robot:
    def __init__(self, rng: random.Random, strange: Collection[str]) -> None:
        self.rng, self.strange = rng, strange
        self.version = rng.choice(("", "1.0", "1.1", "1.1", "1.2", "1.2")) if "versions" in strange else ""
        count = rng.randint(1, 8) if rng.random() < 0.97 else 0
        self.links, self.joints = self.names("l", count + 1), self.names("j", count)
        self.kinds = [rng.choices(KINDS, _WEIGHTS)[0] for _ in range(count)]
        if "followers" in strange and count > 1:
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
        name = quoteattr(rng.choice((*LIKE_OURS, *STRANGE)) if "names" in self.strange else "r")
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
            names[self.rng.choice((self.rng.choice(LIKE_OURS), self.rng.choice(STRANGE), mixed))] = None
        return list(names)

    def joint(self, i: int) -> str:
        """Return joint i, the parent of link i + 1."""
        rng, kind = self.rng, self.kinds[i]
        # Most robots are chains, because rounding errors add up along a chain.
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
        length = odd.odd_length if "lengths" in self.strange and rng.random() < 0.5 else odd.tame_length
        angle = odd.odd_angle if "angles" in self.strange and rng.random() < 0.5 else odd.tame_angle
        xyz = f' xyz="{odd.vector(rng, [length(rng) for _ in range(3)])}"'
        rpy = f' rpy="{odd.vector(rng, [angle(rng) for _ in range(3)])}"'
        if "versions" in self.strange and rng.random() < 0.5:
            quaternion = f' quat_xyzw="{odd.vector(rng, odd.odd_quaternion(rng))}"'
            rpy = quaternion if rng.random() < 0.95 else rpy + quaternion
        return rng.choice((f"<origin{xyz}{rpy}/>",) * 4 + (f"<origin{rpy}/>", f"<origin{xyz}/>", ""))

    def axis(self, kind: str) -> str:
        """Return the joint's axis; a planar joint has z, as in urdfkin and Pinocchio."""
        if kind == "planar":
            return '<axis xyz="0 0 1"/>'
        if kind in ("fixed", "floating"):
            return ""
        odd_one = "axes" in self.strange and self.rng.random() < 0.8
        numbers = odd.odd_axis(self.rng) if odd_one else odd.direction(self.rng)
        return f'<axis xyz="{odd.vector(self.rng, numbers)}"/>' if self.rng.random() < 0.9 else ""

    def limit(self, kind: str) -> str:
        rng = self.rng
        # From version 1.2 on, limits apply to all kinds of joints.
        least = 0.8 if "versions" in self.strange else 1.0
        idle = kind not in _ONE_COORDINATE and rng.random() < least
        if idle or (kind == "continuous" and rng.random() < 0.7):
            return ""
        lower, upper, effort = -1.0 - rng.random(), 1.0 + rng.random(), 1.0
        if "limits" in self.strange:
            lower, upper = odd.odd_range(rng, kind == "revolute")
            effort = rng.choice((0.0, 1.0, 1e300, 5e-324, abs(odd.odd_length(rng))))
        words = [f'lower="{odd.written(rng, lower)}"', f'upper="{odd.written(rng, upper)}"']
        if kind == "continuous" or (kind not in _ONE_COORDINATE and rng.random() < 0.5):
            words = []
        elif "limits" in self.strange and rng.random() < 0.2:
            words.pop(rng.randrange(2))
        words += [f'{word}="{odd.written(rng, effort)}"' for word in ("effort", "velocity")]
        if "versions" in self.strange:
            further = [name for name in FURTHER_LIMITS if rng.random() < 0.3]
            words += [f'{name}="{odd.odd_limit(rng)}"' for name in further]
        return f"<limit {' '.join(words)}/>"

    def mimic(self, i: int) -> str:
        rng = self.rng
        if "followers" not in self.strange or self.kinds[i] not in _ONE_COORDINATE or rng.random() < 0.35:
            return ""
        # A mimic joint mimics only a joint with a lower number, so there is no cycle.
        leaders = [j for j in range(i) if self.kinds[j] in _ONE_COORDINATE]
        if not leaders:
            return ""
        words = [f"joint={quoteattr(self.joints[rng.choice(leaders)])}"]
        if rng.random() < 0.9:
            words.append(f'multiplier="{odd.written(rng, odd.odd_factor(rng))}"')
        if rng.random() < 0.6:
            words.append(f'offset="{odd.written(rng, rng.choice((odd.odd_angle, odd.tame_angle))(rng))}"')
        return f"<mimic {' '.join(words)}/>"

    def foreign(self) -> str:
        if "prefixes" not in self.strange or self.rng.random() < 0.6:
            return ""
        return self.rng.choice(_FOREIGN).format(p=self.prefix)
