"""No name in a file has an effect on a terminal or a log, for any command."""

import json
import os
import pty
import re
import subprocess
import sys
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.attacks.hostile import IN_XML, NAMES, chain_of_all, urdf
from tests.cli.running import Done, good, python, urdfkin
from urdfkin.cli import commands
from urdfkin.cli.paths import SCREW_FORMATS as SCREWS
from urdfkin.cli.streams import SafeStream
from urdfkin.dh.export import FORMATS
from urdfkin.export import LANGUAGES

#: A hostile file name
FILE = "\x1b[31m\n::error::forged\u202e ##vso[x]"

#: Options after each command and its robot; words in capitals are hostile files and names
ROBOT = {
    "info": ["", "--format json"],
    "order": ["", "--format csv", "--from isaaclab --format json", "--to FILE"],
    "readers": [
        "--with yourdfpy", "--with yourdfpy --format json", "--with yourdfpy --format csv", "--with FILE",
    ],
    "placement": [
        "", "--format json", "--format csv", "--frame FRAME", "--relative-to FRAME", "--as rpy",
        "--base-placement FILE", "--trajectory FILE", "--convention FILE",
    ],
    "analytical-jacobian": ["", "--format csv", "--representation FILE"],
    "chain": ["--no-mimic", "--format json", "--format csv", "--base FILE"],
    "velocity": ["", "--q random:3", "--q COLOUR"],
    "jacobian": ["", "--format json", "--format csv", "--frame FILE"],
    "jacobian-rate": ["", "--format csv"],
    "hessian": ["", "--format csv"],
    "imu": ["", "--format csv", "--trajectory FILE", "--trajectory ARCHIVE"],
    "singular-values": ["", "--format csv", "--format json", "--frame FILE", "--trajectory FILE"],
    "acceleration": ["", "--breakdown --v random", "--breakdown --v random --format csv"],
    "dh": [
        *(f"--format {form} --no-mimic" for form in (*FORMATS, "urdf", "svg")),
        *(f"--tree --format {form}" for form in ("terminal", "markdown", "csv", "json")),
        "--flip FILE", "--near-parallel strict",
    ],
    "screws": [*(f"--no-mimic --format {form}" for form in SCREWS), "--base FILE"],
    "calibrate": ["", "--fit FILE", "--poses FILE", "--ur FILE", "--tip FILE"],
    "structure": ["", "--format json", "--opw 1"],
    "export": [*(f"--no-mimic --to {form}" for form in LANGUAGES), "--to c --frame FILE"],
    "check": [
        *(f"--format {form}" for form in ("terminal", "concise", "json", "sarif", "github")),
        "--each", "--statistics", "--diff", "--baseline FILE", "--changed-since FILE", "--config FILE",
        "--select FILE",
    ],
    "validate": ["--samples 2 --cases", "--samples 1 --isolate"],
    "plot": ["--to neutral --frame MATH --output PICTURE", "--to FILE --output PICTURE"],
}  # fmt: skip
OTHERS = {
    "robots": ["", "--format json", "--family FILE"],
    "explain": ["URDF502", "7.130", "FILE"],
    "report": [
        "REPORT", "REPORT --cases", "FILE", "compare REPORT REPORT", "compare REPORT REPORT --format json",
        "compare REPORT FILE", "history REPORT", "history REPORT --format json", "history FILE",
        "status FILE", "merge FILE FILE",
    ],
    "same": ["ROBOT ROBOT", "ROBOT elbow", "ROBOT ROBOT --format json", "ROBOT FILE"],
    "diff": ["ROBOT elbow --no-effects", "ROBOT elbow --no-effects --format json", "ROBOT FILE"],
    "verify": ["FILE ROBOT", "FUNCTION ROBOT", "PROGRAM ROBOT --program --samples 0"],
    "vectors": [
        "write FOLDER ROBOT", "write FOLDER ROBOT --format json", "write FOLDER ROBOT --format csv",
        "write FILE FILE",
    ],
    "view": ["FILE"],
    "warm": ["", "FILE"],
    "completion": ["bash", "zsh", "fish", "FILE"],
}  # fmt: skip
WORDS = {
    "FILE": FILE, "ARCHIVE": f"{FILE}.npz", "FUNCTION": f"{FILE}.py:{FILE}", "FRAME": NAMES["line"],
    "COLOUR": "\x1b[31mx", "MATH": NAMES["math"], "PROGRAM": "echo '\x1b[31m::error::forged'",
}  # fmt: skip
BREAKDOWN = "acceleration --breakdown --v random"
LINES = [f"{command} ROBOT {more}" for command, lines in ROBOT.items() for more in lines]
LINES += [f"{command} {more}" for command, lines in OTHERS.items() for more in lines]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Write a robot and a report with hostile content under hostile names."""
    folder = tmp_path_factory.mktemp("files") / FILE.replace("/", "")
    folder.mkdir()
    made = {name: str(folder / f"{FILE}{ending}") for name, ending in ENDINGS.items()}
    Path(made["ROBOT"]).write_text(chain_of_all(), encoding="utf-8")
    good("validate", made["ROBOT"], "--samples", "1", "--json", made["REPORT"])
    report = json.loads(Path(made["REPORT"]).read_text())
    entry = report["robots"][0]
    entry["source"] = NAMES["colours"] + NAMES["line"]
    entry["checks"][0]["worst_case"]["replay"] = NAMES["colours"]
    refused = {
        **entry, "verdict": "bad input", "reason": "\n".join(NAMES.values()), "checks": [], "model": None,
    }  # fmt: skip
    report["robots"] += [refused | {"joints": [], "frames": [], "chains": [], "results": 0}]
    report["sha256"].append(None)
    report |= {"robots_requested": 2, "verdict": "bad input", "reason": "1 of 2 robots has bad input"}
    report["command"], report["started"] = NAMES["colours"], NAMES["erased"]
    Path(made["REPORT"]).write_text(json.dumps(report))
    return made | WORDS


def table_of(names: list[str]) -> str:
    rows = ", ".join(
        f"{{joint = {_toml(x)}, kind = 'revolute', a = 0.1, alpha = 0, d = 0, theta = 0}}" for x in names
    )
    units = "convention = 'standard'\nangles = 'radians'\nlengths = 'metres'\n"
    return f"{units}robot = {_toml(NAMES['colours'])}\nrows = [{rows}]\n"


def _toml(name: str) -> str:
    return '"' + "".join(f"\\U{ord(c):08x}" for c in name) + '"'


ENDINGS = {"ROBOT": ".urdf", "REPORT": ".json", "PICTURE": ".svg", "FOLDER": ""}


def acts(text: str, *, commands: bool = False) -> list[str]:
    """Return the parts of a text that have an effect on a terminal or a log."""
    found = [repr(c) for c in text if c != "\n" and not c.isprintable()]
    found += re.findall(r"##(?:vso|teamcity)?\[", text)
    lines = [line.strip() for line in re.split("[\n\r]", text)]
    ours = re.compile(r"::(error|warning|notice) file=[^:]*,title=URDF\d+::")
    return found + [line for line in lines if line.startswith("::") and not (commands and ours.match(line))]


def run(files: dict[str, str], line: str) -> Done:
    return urdfkin(*(files.get(word, word) for word in line.split()))


def escape_for_terminal(done: Done, line: str = "") -> None:
    assert acts(done.text, commands="github" in line) == []
    assert acts(done.err) == []
    assert "Traceback" not in done.err


def test_every_command_has_a_test_with_hostile_names() -> None:
    assert set(ROBOT) | set(OTHERS) == set(commands())


@pytest.mark.slow
@pytest.mark.parametrize("line", LINES)
def test_no_name_and_no_argument_has_an_effect_on_the_terminal(line: str, files: dict[str, str]) -> None:
    escape_for_terminal(run(files, line), line)


@pytest.mark.slow
@pytest.mark.parametrize("fit", ["--no-fit", pytest.param("--fit", marks=pytest.mark.long)])
@pytest.mark.parametrize("part", range(5))
def test_no_name_in_a_comparison_of_a_table_has_an_effect_on_the_terminal(
    part: int, fit: str, tmp_path: Path
) -> None:
    # A fifth of the names: the time of a comparison grows with the cube of the table's length.
    names = list(IN_XML.values())[part::5]
    robot, table = tmp_path / f"{FILE}.urdf".replace("/", ""), tmp_path / f"{FILE}.toml".replace("/", "")
    robot.write_text(chain_of_all(names), encoding="utf-8")
    table.write_text(table_of([NAMES["colours"], *names[1:]]), encoding="utf-8")
    done = urdfkin("dh", str(robot), "--compare", str(table), fit)
    escape_for_terminal(done)
    assert "DIFFERS" in done.text


@pytest.mark.parametrize("command", [*commands(), "no such command"])
def test_no_file_name_and_no_option_has_an_effect_on_the_terminal(command: str) -> None:
    for words in ([command, f"--{FILE}"], [command, f"{FILE}.urdf"], [f"{command}{FILE}"]):
        if words != ["explain", f"{FILE}.urdf"]:
            escape_for_terminal(urdfkin(*words))


@pytest.mark.slow
@pytest.mark.parametrize("kind", IN_XML)
def test_no_hostile_name_adds_a_line_to_the_output(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "10000")
    counts: list[list[int]] = []
    lines = "info", "jacobian", "dh", "dh --format markdown", "dh --tree", "dh --format c", BREAKDOWN
    for name in (IN_XML[kind], "x" * len(IN_XML[kind].encode("unicode_escape"))):
        path = tmp_path / f"{len(counts)}.urdf"
        path.write_text(urdf(name), encoding="utf-8")
        shown = [urdfkin(*line.split(), str(path)) for line in lines]
        for done in shown:
            escape_for_terminal(done)
        counts.append([done.text.count("\n") for done in shown])
    assert counts[0] == counts[1]


@pytest.mark.slow
def test_machine_readable_formats_contain_the_names_unchanged(files: dict[str, str]) -> None:
    names = [f"{name} " for name in IN_XML.values()]
    assert set(names) <= {joint["name"] for joint in run(files, "info ROBOT --format json").data["joints"]}
    data = run(files, "dh ROBOT --format json").data
    for table in (data, tomllib.loads(run(files, "dh ROBOT --format toml").text)):
        assert [row["joint"] for row in table["rows"]] == names


def test_the_message_of_a_crash_is_escaped() -> None:
    code = (
        "import urdfkin.cli as c\nclass Crash:\n  @staticmethod\n"
        f"  def main(**_): raise ValueError({FILE!r})\nc.cli = Crash\nc.main()"
    )
    err = python(code, check=False).stderr
    assert "ValueError" in err
    assert acts(err) == []


@pytest.mark.slow
def test_a_real_terminal_receives_no_control_sequences_except_colours(files: dict[str, str]) -> None:
    for command, file in (("check", "ROBOT"), ("info", "ROBOT"), ("dh", "ROBOT"), ("report", "REPORT")):
        shown = on_a_terminal([command, files[file]])
        assert "\x1b[1m" in shown or command in ("dh", "info")
        assert acts(re.sub(r"\x1b\[(0|1|3[1-4]|1;3[1-4])?m", "", shown.replace("\r\n", "\n"))) == []


def on_a_terminal(words: list[str]) -> str:
    pid, screen = pty.fork()
    if pid == 0:
        os.environ["TERM"] = "xterm"
        os.execv(sys.executable, [sys.executable, "-m", "urdfkin", *words])
    shown = b""
    with suppress(OSError):  # the other end is closed
        while piece := os.read(screen, 65536):
            shown += piece
    os.close(screen)
    os.waitpid(pid, 0)
    return shown.decode()


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_terminal_of_any_encoding_shows_escapes(encoding: str, files: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "urdfkin", "check", files["ROBOT"]],
        capture_output=True, check=False, env=os.environ | {"PYTHONIOENCODING": encoding},
    )  # fmt: skip
    assert acts(done.stdout.decode(encoding) + done.stderr.decode(encoding)) == []
    assert b"Traceback" not in done.stderr


class Recorder:
    """A stream that stores the written text."""

    encoding = "utf-8"

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> None:
        self.text += text


@pytest.mark.parametrize("step", [1, 2, 3, 7, 1000])
def test_a_log_command_written_in_pieces_is_escaped(step: int) -> None:
    recorder: Any = Recorder()
    stream = SafeStream(recorder)
    text = " " * 200 + "::error::x\n" + "a ##vso[task]\n  : :x\n:" + ":warning::y\nfine: ::x ## [y]\n"
    for k in range(0, len(text), step):
        stream.write(text[k : k + step])
    assert acts(recorder.text) == []
    assert recorder.text.endswith("fine: ::x ## [y]\n")


def test_all_output_of_the_command_line_passes_the_safe_stream() -> None:
    # Only whole documents, which contain escaped names, are printed by `click.echo`.
    allowed = {
        "streams.py": ("click.echo(escape_unprintable(line)",),
        "explain.py": (
            "click.echo(equation)", "click.echo(format_answer(", "click.echo(explain(",
            'click.echo(f"{rule.id}', 'click.echo(f"questions: ', 'click.echo(f"equations ',
            'click.echo("\\n".join(lines))',
        ),
        "check.py": ("click.echo(as_json(", "click.echo(as_sarif("),
        "options.py": ("click.echo(getattr(importlib.import_module(module), name).schema_text()",),
        "__init__.py": ('click.echo(f"urdfkin {urdfkin_version()}, Pinocchio {version()',),
        "exit.py": ('click.echo("urdfkin: interrupted', 'click.echo("".join(traceback.', "click.echo("),
    }  # fmt: skip
    way = r"\bclick\.echo\(|\bprint\(|Console\(|sys\.stdout\.write"
    harmless_way = r"out\.print\(|def |super\(\)\.|_print\("
    for path in (Path(__file__).parents[2] / "urdfkin" / "cli").glob("*.py"):
        lines = [line.strip() for line in path.read_text().splitlines()]
        ways = [line for line in lines if re.search(way, line) and not re.search(harmless_way, line)]
        strange = [line for line in ways if not line.startswith(allowed.get(path.name, ()))]
        assert strange == [] or path.name == "terminal.py", (path.name, strange)
