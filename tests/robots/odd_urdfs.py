"""URDF texts of unusual robots, with joints of every kind at unusual places.

Numbers of origins and axes have six digits, as from CAD exporters, so right angles are only approximate.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from tests import urdfs
from tests.urdfs import limit

_ODD_ANGLES = (0.0, 1.5708, -1.5708, 3.14159, 0.785398, -0.001047, 1e-6, 2.0944)


@dataclass
class Urdf:
    """A URDF that is built joint by joint, with the root link `links[0]`."""

    name: str
    seed: int
    links: list[str] = field(default_factory=lambda: ["base"])
    joints: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)

    def add(
        self,
        kind: str,
        parent: int | None = None,
        *,
        joint: str = "",
        link: str = "",
        mimic: tuple[str, float | None, float | None] | None = None,
        axis: str | None = None,
        origin: str | None = None,
    ) -> str:
        """Add a joint with a child link to link `parent` (None: the last link); return the joint's name."""
        number = len(self.joints)
        joint, link = joint or f"joint_{number}", link or f"link_{number}"
        above, origin = (
            self.links[-1 if parent is None else parent],
            self._origin() if origin is None else origin,
        )
        if kind in ("fixed", "floating"):
            axis = ""
        elif axis is None:
            axis = self._axis(kind)
        reach = {"prismatic": 0.6, "revolute": 2.5}.get(kind)
        more = "" if reach is None else limit(-reach, reach)
        if mimic is not None:
            mimicked_joint, multiplier, offset = mimic
            given = "" if multiplier is None else f' multiplier="{multiplier!r}"'
            given += "" if offset is None else f' offset="{offset!r}"'
            more += f'<mimic joint="{mimicked_joint}"{given}/>'
        self.joints.append(urdfs.joint(joint, kind, above, link, origin, axis, more))
        self.links.append(link)
        return joint

    def _origin(self) -> str:
        rpy = self._rng.choice(_ODD_ANGLES, 3)
        xyz = self._rng.uniform(-0.4, 0.4, 3)
        return f'xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"'

    def _axis(self, kind: str) -> str:
        if kind == "planar":  # Pinocchio's planar joint moves in the joint frame's x-y plane
            return "0 0 1"
        plain = self._rng.random() < 0.3
        axis = np.eye(3)[self._rng.integers(3)] * self._rng.choice((-1.0, 1.0)) if plain else None
        return _numbers(self._rng.normal(size=3) if axis is None else axis)

    @property
    def text(self) -> str:
        return urdfs.robot(*self.joints, name=self.name)


def _numbers(values: Sequence[float] | np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _chain(name: str, seed: int, kinds: Sequence[str]) -> str:
    urdf = Urdf(name, seed)
    for kind in kinds:
        urdf.add(kind)
    return urdf.text


def _hand(name: str, seed: int, *, sliding: bool = False) -> str:
    """Return five fingers of eight joints; 30 of the 40 joints mimic one of the other 10 by a random rule."""
    urdf, rng = Urdf(name, seed), np.random.default_rng(seed)
    for finger in range(5):
        parent, independent_joints = 0, list[str]()
        for phalanx in range(8):
            kind = "prismatic" if sliding and phalanx % 3 == 2 else ("revolute", "continuous")[phalanx % 2]
            rule, leads = None, phalanx in (0, 3)
            if not leads:
                rule = (
                    independent_joints[-1],
                    float(rng.normal()),
                    float(rng.normal()) if phalanx % 2 else None,
                )
            made = urdf.add(kind, parent, joint=f"f{finger}_{phalanx}", mimic=rule)
            parent = len(urdf.links) - 1
            if leads:
                independent_joints.append(made)
    return urdf.text


def random_tree(seed: int) -> str:
    """Return fourteen joints of every kind at random links; some mimic an earlier joint."""
    urdf, rng = Urdf(f"tree_{seed}", seed), np.random.default_rng(seed + 1000)
    kinds = ("revolute", "continuous", "prismatic", "fixed", "planar", "floating")
    independent_joints: list[str] = []
    for _ in range(14):
        kind = str(rng.choice(kinds, p=(0.3, 0.15, 0.2, 0.15, 0.1, 0.1)))
        single = kind in ("revolute", "continuous", "prismatic")
        rule = None
        if single and independent_joints and rng.random() < 0.3:
            rule = (str(rng.choice(independent_joints)), float(rng.normal()), float(rng.normal()))
        made = urdf.add(kind, int(rng.integers(len(urdf.links))), mimic=rule)
        if single and rule is None:
            independent_joints.append(made)
    return urdf.text


def _names() -> str:
    urdf = Urdf("Roboter \u00e4\u00f6\u00fc \u65e5\u672c\u8a9e", 11)
    for name in ("z\u00fcrich", "\u03b8\u2081", "\u95a2\u7bc0", "Arm", "arm", "a b", "x'y", "q&a", "10", "9"):
        urdf.add("revolute", 0 if len(name) == 2 else None, joint=name, link=f"L {name}")
    return urdf.text


def _same_names() -> str:
    """Return a robot with a joint and a child link `wrist`, and an unrelated joint and link `elbow`."""
    urdf = Urdf("same", 12)
    urdf.add("revolute", joint="wrist", link="wrist")
    urdf.add("revolute", joint="elbow", link="forearm")
    urdf.add("prismatic", joint="slide", link="elbow")
    return urdf.text


def _default_everything() -> str:
    """Return a robot without optional elements and attributes, and with axes that are not unit vectors."""
    urdf = Urdf("terse", 13)
    urdf.add("continuous", axis="", origin="")
    urdf.add("continuous", axis="0 3 4", origin='xyz="0.1 0.2 0.3"')
    urdf.add("prismatic", axis="0 0 2", origin='rpy="0.1 0.2 0.3"')
    urdf.add("prismatic", axis="-0.001 0 0.0005", origin="")
    return urdf.text


def _mimics_of_mimics() -> str:
    urdf = Urdf("relay", 14)
    first = urdf.add("revolute", joint="z_leader")
    second = urdf.add("revolute", joint="a_follower", mimic=(first, -0.5, 0.1))
    third = urdf.add("continuous", joint="m_follower", mimic=(second, 3.0, None))
    urdf.add("prismatic", joint="b_follower", mimic=(third, -0.02, 0.3))
    return urdf.text


def _sizes() -> str:
    """Return a chain with origins of kilometres and of micrometres, and with angles of many turns."""
    urdf = Urdf("sizes", 15)
    urdf.add("revolute", origin='xyz="1000 -2000 500" rpy="1.5708 0 0"')
    urdf.add("revolute", origin='xyz="1e-06 2e-06 0" rpy="0 1e-06 0"')
    urdf.add("prismatic", origin='xyz="-1000 2000 -500" rpy="0.5 -1.5708 3.14159"')
    urdf.add("revolute", origin='xyz="0 0 0" rpy="100 -200 300"')
    return urdf.text


_SIX = ("revolute",) * 6

_TEXTS: dict[str, Callable[[], str]] = {
    "planar_root": lambda: _chain("planar_root", 1, ("planar", *_SIX)),
    "floating_root": lambda: _chain("floating_root", 2, ("floating", *_SIX)),
    "planar_and_floating_in_the_middle": lambda: _chain(
        "middle", 3, ("revolute", "planar", "prismatic", "fixed", "floating", "continuous", "planar")
    ),
    "two_floating_in_a_row": lambda: _chain("twice", 4, ("floating", "fixed", "floating", "revolute")),
    "continuous": lambda: _chain("continuous", 5, ("continuous",) * 7),
    "sliding_only": lambda: _chain("gantry", 6, ("prismatic",) * 5),
    "deep_with_fixed": lambda: _chain(
        "deep", 7, [("revolute", "fixed", "fixed", "prismatic", "fixed")[i % 5] for i in range(90)]
    ),
    "mimic_hand_40": lambda: _hand("hand", 8),
    "mimic_hand_40_sliding": lambda: _hand("gripper", 9, sliding=True),
    "single_link": lambda: '<robot name="stone"><link name="base"/></robot>',
    "fixed_only": lambda: _chain("statue", 10, ("fixed",) * 6),
    "one_joint": lambda: _chain("door", 16, ("revolute",)),
    "odd_names": _names,
    "same_names": _same_names,
    "default_everything": _default_everything,
    "followers_of_followers": _mimics_of_mimics,
    "sizes": _sizes,
    **{f"tree_{seed}": partial(random_tree, seed) for seed in range(12)},
}

NAMES = tuple(_TEXTS)


def urdf_of(name: str) -> str:
    return _TEXTS[name]()
