"""Numbers in arguments and files must be decimal numbers in ASCII."""

from pathlib import Path

import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import refused, urdfkin
from tests.urdfs import joint, robot
from urdfkin.robot.trajectory import read_trajectory

NAMES = "shoulder_pan_joint,shoulder_lift_joint,elbow_joint,wrist_1_joint,wrist_2_joint,wrist_3_joint"
#: Words that are no numbers; Python's `float` accepts some of them.
NO_NUMBERS = [
    "1_0", "\u0661", "\u0967.\u0966", "\uff11", "nan", "inf", "-Infinity", "1e999", "0x10", "1,5", "1\u22122",
    "\u22121", "", "+", ".", "1e", "e5", "1 2", "--1", "1j", "9" * 3000,
]  # fmt: skip
NUMBERS = {"1": 1.0, "+1.5": 1.5, "-.5": -0.5, "1.": 1.0, "1e-3": 1e-3, " 2E+2 ": 200.0, "007": 7.0}


@pytest.mark.parametrize("text", NO_NUMBERS)
def test_an_invalid_number_is_refused_with_joint_and_line(text: str, tmp_path: Path) -> None:
    if "," not in text:
        words = "--q, elbow_joint: not a finite number: found"
        assert words in refused("placement ur5 --q", f"0,0,{text},0,0,0")
    path = tmp_path / "q.csv"
    path.write_text(f'0,0,0,0,0,0\n# a remark\n0,0,0,"{text}",0,0\n', encoding="utf-8")
    assert "q.csv:3, wrist_1_joint: not a finite number: found" in refused("placement ur5 --q", f"@{path}")
    rows = [f"t,{NAMES}", *(f"{t},0,0,0,0,0,0" for t in range(3)), f'3,0,0,0,0,0,"{text}"', "4,0,0,0,0,0,0"]
    (tmp_path / "t.csv").write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(library.InputError, match=r"t.csv:5, wrist_3_joint: not a finite number"):
        read_trajectory(library.load("ur5"), tmp_path / "t.csv")


OPTIONS = [
    ("dh", "ur5", "--snap"), ("dh", "ur5", "--compare", "ur5", "--tolerance"), ("dh", "ur5", "--digits"),
    ("plot", "ur5", "--to", "neutral", "-o", "x.svg", "--duration"),
    ("plot", "ur5", "--to", "neutral", "-o", "x.svg", "--samples"),
    ("placement", "ur5", "--seed"), ("validate", "ur5", "--samples"), ("validate", "ur5", "--jobs"),
    ("check", "ur5", "--max-bytes"), ("report", "compare", "a.json", "b.json", "--factor"),
    ("view", "ur5", "--port"),
]  # fmt: skip


@pytest.mark.parametrize("text", ["1_0", "\u0661\u0660", "nan", "\uff14"])
@pytest.mark.parametrize("words", OPTIONS, ids=lambda words: words[-1])
def test_an_invalid_number_is_refused_as_an_option(
    words: tuple[str, ...], text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert f"Invalid value for '{words[-1]}'" in refused(*words, text)


@pytest.mark.parametrize("count", ["1_0", "\u0661", "0", "-1", "1.5", ""])
def test_an_invalid_number_of_samples_is_refused(count: str) -> None:
    done = urdfkin("placement ur5 --q", f"random:{count}")
    assert (done.code == 0) is (count == ""), done.err


@pytest.mark.parametrize("text", NUMBERS)
def test_a_decimal_number_is_accepted(text: str) -> None:
    done = urdfkin("placement ur5 --no-verify --format json --q", f"0,0,{text},0,0,0")
    assert done.data["q"] == [[0.0, 0.0, NUMBERS[text], 0.0, 0.0, 0.0]]


#: Wrong contents of a file for --q, and a part of the message.
FILES = [
    ("1,2\n", "q.csv:1: 6 numbers are expected"),
    ("a,b,c,d,e,f\n0,0,0,0,0,0\n", "q.csv:1: the first line must name the columns of --q"),
    (f"{NAMES},more\n0,0,0,0,0,0,0\n", "q.csv:1: the first line must name the columns of --q"),
    (f"{NAMES},more\n0,0,0,0,0,0,0\n", "found unknown: more;"),
    (f"{NAMES},\n0,0,0,0,0,0,\n", "found unknown: '';"),
    (f'{NAMES}\n0,0,0,0,0,0\n   \n""\n', "q.csv:4: 6 numbers are expected"),
    (NAMES.replace(",elbow_joint", "") + "\n0,0,0,0,0\n", "found missing: elbow_joint;"),
    (NAMES.replace("elbow_joint", "wrist_1_joint") + "\n", "missing: elbow_joint; duplicate: wrist_1_"),
    (f"{NAMES}\n0,0,0,0,0,0,0\n", f"q.csv:2: 6 numbers are expected ({NAMES.replace(',', ', ')}): found 7"),
    (f"{NAMES}\n0,0,0,0,0\n", "q.csv:2: 6 numbers are expected"),
    (f"{NAMES}\n0,0,0,0,0\n", "found 5, none for wrist_3_joint"),
    (f'# remark\n\n{NAMES}\n"0",0,0,0,0,0\n\n0,0\n', "q.csv:6: 6 numbers are expected"),
    (f'{NAMES}\n0,0,0,0,0,"0\n', "q.csv:2: not valid CSV"),
    ("\x00\x00", "q.csv"),
    ("0;0;0;0;0;0\n", "q.csv:1"),
]


@pytest.mark.parametrize(("content", "message"), FILES)
def test_wrong_columns_are_refused_with_file_line_and_name(
    content: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "q.csv").write_text(content)
    assert message in refused("placement ur5 --q", f"@{tmp_path / 'q.csv'}")


def test_columns_in_any_order_are_read_by_name(tmp_path: Path) -> None:
    names, path = ",".join(NAMES.split(",")[::-1]), tmp_path / "q.csv"
    path.write_text(f"{names}\n6,5,4,3,2,1\n")
    done = urdfkin("placement ur5 --no-verify --format json --q", f"@{path}")
    assert done.data["q"] == [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]]
    path.write_text(f"{names}\n6,5,4,3,2,x\n")
    assert "q.csv:2, shoulder_pan_joint: not a finite number" in refused("placement ur5 --q", f"@{path}")


def test_the_names_of_columns_may_be_numbers(tmp_path: Path) -> None:
    text = robot(joint("1", "continuous", "a", "b"), joint("2", "continuous", "b", "c"))
    (tmp_path / "q.csv").write_text("2,1\n0.2,0.1\n")
    done = urdfkin("placement - --format json --q", f"@{tmp_path / 'q.csv'}", stdin=text)
    np.testing.assert_array_equal(done.data["q"], [[0.1, 0.2]])
