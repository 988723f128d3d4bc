"""A small arm of which each part can be changed, and cases of changed arms."""

from dataclasses import dataclass

ACCEPT, WARN, REJECT = "accept", "accept-with-warning", "reject"


@dataclass(frozen=True)
class Case:
    """A document, its verdict, and the codes and lines of findings that must occur: `CODE:LINE CODE:LINE`."""

    name: str
    text: str | bytes
    verdict: str
    codes: str = ""

    @property
    def findings(self) -> set[tuple[str, int]]:
        pairs = (one.split(":") for one in self.codes.split())
        return {(code, int(line)) for code, line in pairs}

    @property
    def data(self) -> bytes:
        return self.text if isinstance(self.text, bytes) else self.text.encode()


def arm(
    *,
    head: str = '<?xml version="1.0"?>',
    robot: str = 'name="r"',
    base: str = '<link name="base"/>',
    attributes: str = 'type="revolute"',
    origin: str = '<origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/>',
    ends: str = '<parent link="base"/><child link="l1"/>',
    axis: str = '<axis xyz="0 0 1"/>',
    limit: str = '<limit lower="-2" upper="2" effort="10" velocity="5"/>',
    inside: str = "",
    second: str = 'type="revolute"',
    follow: str = "",
    more: str = "",
) -> str:
    """Write an arm: the links on lines 3 to 5, joint j1 on line 6, joint j2 on line 7, `more` on line 8."""
    return f"""{head}
<robot {robot}>
  {base}
  <link name="l1"/>
  <link name="tool"/>
  <joint name="j1" {attributes}>{origin}{ends}{axis}{limit}{inside}</joint>
  <joint name="j2" {second}><parent link="l1"/><child link="tool"/>{LIMIT}{follow}</joint>
  {more}
</robot>
"""


LIMIT = '<limit lower="-2" upper="2" effort="10" velocity="5"/>'


def xyz(value: str) -> str:
    return arm(origin=f'<origin xyz="{value}"/>')


def axis(value: str, kind: str = "revolute") -> str:
    return arm(axis=f'<axis xyz="{value}"/>', attributes=f'type="{kind}"')


def limit(value: str, kind: str = "revolute") -> str:
    return arm(limit=f"<limit {value}/>", attributes=f'type="{kind}"')


def bounds(value: str, kind: str = "revolute") -> str:
    return limit(f'{value} effort="1" velocity="1"', kind)


def follows(rule: str) -> str:
    return arm(follow=f"<mimic {rule}/>")


def fixed(name: str, parent: str, child: str) -> str:
    return f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


SPHERE = '<visual><geometry><sphere radius="1"/></geometry></visual>'

MESH = '<link name="base"><visual><geometry><mesh filename="{}"/></geometry></visual></link>'


def base_link(inside: str) -> str:
    return arm(base=f'<link name="base">{inside}</link>')


def shape(inside: str) -> str:
    return f"<visual><geometry>{inside}</geometry></visual>"


BALL = 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'


def inertial(moments: str, mass: str = '<mass value="1"/>') -> str:
    return base_link(f"<inertial>{mass}<inertia {moments}/></inertial>")
