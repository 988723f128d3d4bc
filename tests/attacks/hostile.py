"""Names that attack programs which display them, and robots with such names."""

from collections.abc import Sequence
from itertools import pairwise

from tests import urdfs

#: Names that would be interpreted in an output format if they were not escaped.
NAMES = {
    "script": "<script>window.hacked=1</script>",
    "event": "<img src=x onerror=window.hacked=1>",
    "frame": '<iframe srcdoc="<script>parent.hacked=1</script>"></iframe>',
    "attribute": "\"'><svg onload=window.hacked=1>",
    "end of data": "</script></style></textarea></title>--><b id=hacked>x</b>",
    "comment": "<!-- ]]> --> <?php x ?> <![CDATA[<b id=hacked>]]>",
    "template": "{{7*7}}$ {7*7}#{7*7}<%= 7*7 %>&amp;&#60;b id=hacked&#62;",
    "link": "[x](javascript:window.hacked=1)",
    "image": "![x](/etc/hostname)",
    "reference": "[x]: https://evil.example",
    "address": "https://evil.example/x www.evil.example me@evil.example <https://evil.example>",
    "mention": "@somebody #1 GH-1",
    "code": "`</code><b id=hacked>x</b>`` ``` ~~~",
    "backslashes": "\\`<b id=hacked>x</b>\\\\`\\|\\",
    "emphasis": "**x** _x_ ~~x~~ # x",
    "cell": "a | b | c \\| d |",
    "rule": "---",
    "line": "a\n\n<b id=hacked>x</b>\n::error::forged\n# heading\n| a | b |",
    "carriage": "a\r::error::forged\rverified by Pinocchio",
    "separators": "a\u2028::error::forged\u2029b\x85c\x0bd\x0ce",
    "workflow": "::error file=x::forged",
    "workflow after a blank": "x ::error::forged " * 8,
    "azure": "##vso[task.setvariable variable=x]y ##[error]x ##teamcity[x]",
    "colours": "\x1b[31mred\x1b[0m\x1b]0;title\x07\x1b[2J\x9b31m",
    "link of a terminal": "\x1b]8;;https://evil.example\x1b\\x\x1b]8;;\x1b\\",
    "colours of one byte": "\x9b31mred\x9b0m\x9d0;title\x9c\x7f",
    "erased": "good\x08\x08\x08\x08evil\x7f",
    "bidi": "\u202egnp.exe\u202c\u2066x\u2069\u200f\u061c\ufeff\U000e0041",
    "markup": "[red]x[/red] [link=https://evil.example]x[/link] :skull: [bold",
    "latex": r"\input{/etc/passwd}$x^2_{}~%\write18{id}",
    "math": "J$$(x)$\\frac{",
    "c comment": '*/ int hacked = 1; /* // "; ??/',
    "python": '"""; hacked = 1; """ \\',
    "matlab": "'; hacked = 1; % ...",
    "formula": "=cmd|' /C calc'!A0",
    "formula of another kind": "@SUM(1+1)*cmd|' /C calc'!A0",
    "key": "__proto__",
    "percent": "%s%n%d{0}{x!r}",
}  # fmt: skip

#: Names that XML 1.0 allows.
IN_XML = {
    kind: name for kind, name in NAMES.items() if not any(c in "\x1b\x07\x08\x0b\x0c\x00" for c in name)
}


def chain_of_all(names: Sequence[str] = tuple(IN_XML.values()), robot: str = NAMES["line"]) -> str:
    """Write a chain whose links have these names; each joint has its child link's name and a blank."""
    joints = (
        urdfs.joint(f"{child} ", "continuous", parent, child, 'xyz="0.1 0 0"', f"0 {k % 2} {1 - k % 2}")
        for k, (parent, child) in enumerate(pairwise(["base", *names]))
    )
    return urdfs.robot(*joints, name=robot)


def urdf(name: str) -> str:
    """Write an arm whose robot and root link have this name; other names are this name and a number."""
    return urdfs.robot(
        urdfs.joint(f"{name} 1", "revolute", name, f"{name}1", 'xyz="0 0 0.4"', more=urdfs.limit()),
        urdfs.joint(f"{name} 2", "revolute", f"{name}1", f"{name}2", 'xyz="0.3 0 0"', "0 1 0", urdfs.limit()),
        name=name,
    )
