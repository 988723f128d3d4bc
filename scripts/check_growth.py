"""Measure how the time and the memory of a check grow with the size of the file (s and MB per MB).

    python scripts/check_growth.py                      # 1, 4, 16 and 64 MB of every kind of content
    python scripts/check_growth.py --sizes 1,4 number   # kinds with "number" in the name

If the cost grows linearly, all numbers in a row are equal. Each document is checked in its own process. After
a check that takes longer than `--patience`, the script skips the larger documents with the same kind of
content.

Each document repeats one kind of content, as a file from a faulty exporter or an attacker may do. Even if
urdfkin rejects the file, the time and memory of the check must be proportional to the file's size.
"""

import argparse
import contextlib
import resource
import subprocess
import sys
import time
from collections.abc import Callable

from scripts.pages import table
from urdfkin.urdf.lint import check_text

Kind = Callable[[int], bytes]

_LINK = '<link name="l"/>'
_JOINT = (
    '<joint name="j{i}" type="{kind}"><parent link="l{p}"/><child link="l{c}"/>'
    '<axis xyz="0 0 1"/>{more}</joint>'
)


def _robot(inside: str) -> bytes:
    return f'<robot name="r">{inside}</robot>'.encode()


def _repeat(size: int, piece: str) -> str:
    count = max(size // len(piece.format(i=10**6)), 2)
    return piece * count if piece == piece.format(i=0) else "".join(piece.format(i=i) for i in range(count))


def _robot_with_many(piece: str, before: str = _LINK) -> Kind:
    return lambda size: _robot(before + _repeat(size, piece))


def _link(name: str, inside: str = "") -> bytes:
    return _robot(f'<link name="{name}">{inside}</link>')


def _origin(xyz: str) -> bytes:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>'
    return _robot(f'<link name="a"/><link name="b"/>{joint}<origin xyz="{xyz}"/></joint>')


def _tree(size: int, parent: Callable[[int], int], kind: str = "fixed", more: str = "") -> bytes:
    links = range(max(size // 130, 2))
    joints = (
        _JOINT.format(i=i, kind=kind, p=parent(i), c=i + 1, more=more.format(i - 1) if i else "")
        for i in links[:-1]
    )
    return _robot("".join(f'<link name="l{i}"/>\n' for i in links) + "".join(joints))


_FIXED = '<joint name="j{i}" type="fixed">'
_MESH = '<visual><geometry><mesh filename="package://{}"/></geometry></visual>'
_SHAPE = '<visual><geometry><box size="1 1 1"/></geometry><material name="m"/></visual>'
_MARKS = "a" + "\u0301\u0323" * 100

KINDS: dict[str, Kind] = {
    # Inputs with long or many numbers.
    "one long number": lambda n: _origin(f"{'1' * n}e+ 0 0"),
    "one long decimal": lambda n: _origin(f"0.{'1' * n} 0 0"),
    "many numbers in a vector": lambda n: _origin("1 " * (n // 2)),
    "many blanks in a vector": lambda n: _origin(f"1{' ' * n}0 0"),
    "tabs in a vector": lambda n: _origin("\t" * n + "1 0 0"),
    "a number by long references": lambda n: _origin(f"&#{'0' * n}49; 0 0"),
    "bad numbers": _robot_with_many(f'{_FIXED}<origin xyz="a b c"/></joint>', ""),
    "signs and points": lambda n: _origin(f"{'+.' * (n // 2)} 0 0"),
    # Inputs with many or long comments that suppress findings (`urdfkin: ignore`).
    "comments that suppress no finding": _robot_with_many("<!-- urdfkin: ignore[x{i}] y -->\n"),
    "consecutive comments": _robot_with_many("<!-- urdfkin: ignore[URDF207] y --><x{i}/>"),
    "one long comment": lambda n: _robot(f"<!-- urdfkin: ignore[{'207 ' * (n // 4)}] y -->{_LINK}"),
    # Inputs with long or many names.
    "one long name": lambda n: _robot(f'<link name="{"a" * n}"/>'),
    "one long tag": lambda n: _link("base", f"<{'a' * n}/>"),
    "one long attribute's name": lambda n: _link("base", f'<visual {"a" * n}="1"/>'),
    "one long type": lambda n: _robot(f'{_LINK}<joint name="j" type="{"a" * n}"/>'),
    "one long version": lambda n: f'<robot name="r" version="{"1" * n}.0">{_LINK}</robot>'.encode(),
    "one long address": lambda n: _link("base", _MESH.format("a" * n)),
    "equal names": _robot_with_many('<link name="a"/>', ""),
    "names of combining marks": _robot_with_many(f'<link name="{{i}}{_MARKS}"/>', ""),
    "names that look alike": _robot_with_many(
        f'<link name="{"ab" * 40}{{i}}"/><joint name="{{i}}" type="x{"ba" * 40}"/>', ""
    ),
    "misspelt names of links": _robot_with_many(
        f'<link name="{"ab" * 25}{{i}}"/>{_FIXED}<parent link="{"ba" * 25}{{i}}"/><child link="c"/></joint>',
        "",
    ),
    "unknown links": _robot_with_many(f'{_FIXED}<parent link="x{{i}}"/><child link="y{{i}}"/></joint>'),
    "unknown mimicked joints": lambda n: _tree(n, lambda i: i, "continuous", '<mimic joint="x{}"/>'),
    "undeclared prefixes": _robot_with_many("<p{i}:x/>"),
    "declared prefixes": _robot_with_many('<gazebo xmlns:p{i}="http://p" p{i}:a="1"/>'),
    # Inputs with many attributes.
    "attributes of one link": lambda n: _robot('<link name="l" ' + _repeat(n, 'a{i}="1" ') + "/>"),
    "unknown attributes": _robot_with_many(
        '<link name="l{i}" ' + "".join(f'a{k}="1" ' for k in range(60)) + "/>", ""
    ),
    "one long value": lambda n: _robot(f'{_LINK}<material file="{"a" * n}"/>'),
    "openings of expressions": lambda n: _robot(f'{_LINK}<material file="{"${" * (n // 2)}"/>'),
    "references in a value": lambda n: _robot(f'{_LINK}<material file="{"&amp;" * (n // 5)}"/>'),
    # Inputs with long content between elements.
    "text": _robot_with_many("words "),
    "lines": _robot_with_many("\n"),
    "lines, then a broken tag": lambda n: _robot(_LINK + "\n" * n + "<"),
    "references in text": _robot_with_many("&lt;"),
    "text between elements": _robot_with_many("a<gazebo/>"),
    "text that looks like attributes": _robot_with_many("\t", f'{_LINK}="'),
    "text that looks like many attributes": _robot_with_many("=\"\t='"),
    "one comment": lambda n: _robot(f"{_LINK}<!--{'a' * n}-->"),
    "comments": _robot_with_many("<!---->"),
    "one instruction": lambda n: f"<?a {'a' * n}?>".encode() + _robot(_LINK),
    "instructions": lambda n: b"<?a b?>" * (n // 7) + _robot(_LINK),
    "instructions inside": _robot_with_many("<?a b?>"),
    "one CDATA section": lambda n: _link("base", f"<![CDATA[{'a' * n}]]>"),
    "CDATA sections": lambda n: _link("base", "<![CDATA[a]]>" * (n // 13)),
    "a declaration that does not end": lambda n: b"<?xml version='1.0' " + b"?" * n,
    "a long encoding": lambda n: f'<?xml version="1.0" encoding="{"a" * n}"?>'.encode() + _robot(""),
    "undefined entities": lambda n: _robot(f'<link name="&{"a" * n};"/>'),
    "a document type": lambda n: f"<!DOCTYPE {'a' * n}>".encode() + _robot(_LINK),
    # Inputs with an unusual structure.
    "links without joints": _robot_with_many('<link name="l{i}"/>\n', ""),
    "a chain": lambda n: _tree(n, lambda i: i),
    "a star": lambda n: _tree(n, lambda i: 0),
    "one parent of all joints": lambda n: _tree(n, lambda i: 0, "continuous"),
    "a chain of mimic joints": lambda n: _tree(n, lambda i: i, "continuous", '<mimic joint="j{}"/>'),
    "a loop": lambda n: _tree(n, lambda i: i).replace(b'<child link="l1"/>', b'<child link="l0"/>', 1),
    "several parents": _robot_with_many(
        f'{_FIXED}<parent link="a"/><child link="b"/></joint>', '<link name="a"/><link name="b"/>'
    ),
    "deep nesting": lambda n: _robot(_LINK + "<a>" * (n // 7) + "</a>" * (n // 7)),
    "misplaced links, deep": lambda n: _robot(
        _LINK + "<a>" * 400 + '<link name="x"/>' * (n // 16) + "</a>" * 400
    ),
    "unknown elements": _robot_with_many("<u{i}/>"),
    "children of one joint": lambda n: _robot(
        f'{_LINK}<joint name="j" type="fixed">{"<origin/>" * (n // 9)}</joint>'
    ),
    "shapes": lambda n: _link("base", _SHAPE * (n // 76)),
    "materials": _robot_with_many("".join(f'<material name="m{k}"/>' for k in range(9))),
    "tags that are never closed": lambda n: b'<robot name="r">' + b"<link>" * (n // 6),
    "a file cut in a tag": lambda n: b'<robot name="r"><link name="' + b"a" * n,
    # Inputs with unusual bytes.
    "no XML": lambda n: b"a" * n,
    "blanks": lambda n: b" " * n,
    "zero bytes": lambda n: _robot("\0" * n),
    "a wrong byte at the end": lambda n: _robot("a" * n) + b"\xff",
    "another encoding": lambda n: ("\ufeff" + "a" * (n // 2)).encode("utf-16-le"),
    "characters of four bytes": lambda n: _robot(_LINK + "\U0001f600" * (n // 4)),
}


def measure_cost(kind: str, size: int) -> str:
    """Return the processor time (s) and the memory with the findings (MB), both per MB of the document."""

    def read_usage() -> tuple[float, float]:
        return time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3

    document = KINDS[kind](size)
    before = read_usage()
    findings = check_text(document, fold=False)
    seconds, memory = (1e6 * (x - y) / len(document) for x, y in zip(read_usage(), before, strict=True))
    del findings
    return f"{seconds:.2f} s, {memory:.0f} MB"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    option = parser.add_argument
    option(
        "words",
        nargs="*",
        help="part of a kind's name, such as `number` (default: all kinds of content)",
    )
    option("--sizes", default="1,4,16,64", help="document sizes in MB, separated by commas")
    option("--patience", type=float, default=600.0, help="maximum time for one document, in seconds")
    option("--one", type=int, help="check only one document, of this size in bytes")
    options = parser.parse_args()
    if options.one is not None:
        print(measure_cost(options.words[0], options.one))
        sys.exit()
    sizes = [float(size) for size in options.sizes.split(",")]
    heads = ["kind of content (time and memory per MB)", *(f"{size:g} MB" for size in sizes)]
    print(table(heads, [], left=1))
    for kind in (kind for kind in KINDS if not options.words or any(word in kind for word in options.words)):
        cells: list[str] = []
        with contextlib.suppress(subprocess.TimeoutExpired):
            for size in sizes:
                command = [sys.executable, __file__, "--one", str(int(size * 1e6)), kind]
                done = subprocess.run(command, capture_output=True, check=True, timeout=options.patience)
                cells.append(done.stdout.decode().strip())
        cells += ["..."] * (len(sizes) - len(cells))
        print(f"| {kind} | {' | '.join(cells)} |", flush=True)
