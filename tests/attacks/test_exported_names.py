"""No name in a URDF becomes code in an exported file of any language."""

import ast
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.attacks.hostile import IN_XML, NAMES, chain_of_all, urdf
from tests.export.writing import code, file, need
from tests.urdfs import loaded
from urdfkin.export import LANGUAGES, write
from urdfkin.export.code import FrameCode
from urdfkin.export.naming import comment_name, function_prefix, safe_name, unique_safe_names

pytestmark = pytest.mark.slow
_PYTHON = [to for to, (_, suffix) in LANGUAGES.items() if suffix.endswith(".py")]
_WORDS = (
    "int", "double", "for", "end", "function", "template", "class", "lambda", "def", "out", "in", "L",
    "q", "v", "a", "sin", "cos", "sqrt", "R", "T", "real", "np", "main", "eye", "pi", "i", "None", "_",
    "__", "t1", "R1_00", "1", "2dof", "é", "\u202e", "*/",
    "??/", "%{", "%}", "...", "\\", "a" * 300, "x" * 41,
)  # fmt: skip
ROBOTS = {
    "every name at once": chain_of_all(),
    **{kind: urdf(IN_XML[kind]) for kind in ("c comment", "python", "matlab", "latex", "line")},
    **{word: urdf(word) for word in ("int", "end", "class", "\u00e9", "1")},
}


@pytest.fixture(scope="module", params=ROBOTS)
def written(request: pytest.FixtureRequest) -> FrameCode:
    return code(loaded(ROBOTS[request.param], verify=False), quantities=("placement",))


def said(*command: object) -> str:
    """Return the output of a program that must succeed."""
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=True).stdout


def test_no_name_becomes_code_in_the_export_of_any_language(written: FrameCode) -> None:
    words = set(re.findall(r"\w+", written.name)) | {x for row in written.identifiers.values() for x in row}
    assert all(re.fullmatch(r"[A-Za-z0-9_]+", word) for word in words)
    for to in LANGUAGES:
        text = write(written, to)
        assert text.isascii()
        assert all(c.isprintable() or c == "\n" for c in text)
        assert to == "latex" or "hacked = 1" not in code_alone(text, to), "LaTeX shows names as text"


def code_alone(text: str, to: str) -> str:
    """Return code without its comments."""
    if to in ("c", "cpp", "cuda"):
        return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    if to == "matlab":
        return re.sub(r"%.*", "", text)
    return re.sub(r'""".*?"""|#[^\n]*', "", text, flags=re.DOTALL)


@pytest.mark.parametrize("to", _PYTHON)
def test_exported_python_code_contains_only_functions_and_tables(written: FrameCode, to: str) -> None:
    module = ast.parse(write(written, to))
    kinds = [type(node) for node in module.body]
    allowed = {ast.Expr, ast.Import, ast.ImportFrom, ast.FunctionDef, ast.Assign, ast.If}
    classes = [node for node in module.body if isinstance(node, ast.ClassDef)]
    assert [node.name for node in classes] == (["Kinematics"] if to == "torch" else [])
    assert set(kinds) - ({ast.ClassDef} if classes else set()) <= allowed
    assert kinds.count(ast.Expr) == 1, "the docstring"
    checked = ["_demand", "_stacked"]
    helpers = {"numpy": ["_demand"], "casadi": ["_demand"], "array": ["_namespace", *checked]}
    helpers |= {"jax": checked, "torch": checked}
    assert [node.name for node in module.body if isinstance(node, ast.FunctionDef)] == [
        *helpers.get(to, []), "placement", *(["gradients"] if to == "torch" else []), "_values", "check",
    ]  # fmt: skip


@pytest.mark.parametrize("to", ["numpy", "array", "torch", "sympy-exact"])
def test_the_self_check_of_an_exported_file_passes_with_any_names(written: FrameCode, to: str) -> None:
    need(to)
    scope: dict[str, Any] = {"__name__": "checked"}
    exec(write(written, to), scope)
    assert max(scope["check"]().values()) <= 1.0
    assert "hacked" not in scope


STRICT = ["-trigraphs", "-O0", "-Wall", "-Wextra", "-Werror"]


@pytest.mark.long  # compiling each header takes seconds
@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
def test_the_cuda_header_declares_only_the_exported_functions(written: FrameCode, tmp_path: Path) -> None:
    path, name = file(written, "cuda", tmp_path), written.name
    shim = f"-I{Path(__file__).parents[1] / 'export'}"
    build = ["g++", *STRICT, "-std=c++20", "-Wno-unknown-pragmas", shim, "-x", "c++", path, "-o"]
    said(*build, tmp_path / "x.o", "-c", "-D__CUDACC__", f"-D{name.upper()}_ENTRY_POINTS")
    symbols = said("nm", "-g", "--defined-only", tmp_path / "x.o").splitlines()
    plain = {line.split()[-1] for line in symbols if " T " in line}
    assert plain == {f"{name}_placement_{real}" for real in ("double", "float")}
    said(*build, tmp_path / "check", f"-D{name.upper()}_MAIN")
    assert said(tmp_path / "check").startswith("good placement: 4 test vectors")


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_exported_c_code_defines_only_the_exported_functions(written: FrameCode, tmp_path: Path) -> None:
    path, name = file(written, "c", tmp_path), written.name
    said("gcc", *STRICT, "-std=c99", "-pedantic", "-c", path, "-o", tmp_path / "x.o")
    symbols = said("nm", "-g", "--defined-only", tmp_path / "x.o").splitlines()
    assert {line.split()[-1] for line in symbols} == {f"{name}_placement", f"{name}_placement_batch"}


@given(st.lists(st.one_of(st.text(max_size=60), st.sampled_from([*_WORDS, *NAMES.values()])), max_size=20))
def test_identifiers_are_valid_and_unique(names: list[str]) -> None:
    found = unique_safe_names(names)
    assert len({word.lower() for word in found}) == len(names)
    for word in found:
        assert re.fullmatch(r"[A-Za-z0-9_]{1,60}", word)
        assert not word.startswith("_")


@pytest.mark.parametrize(
    ("robot", "frame"), [("2" * 40, "tool_frame1"), ("2" * 40, "3" * 40), ("a" * 40, "b" * 40)]
)
def test_the_name_of_an_exported_matlab_function_has_at_most_63_characters(robot: str, frame: str) -> None:
    assert len(f"{function_prefix(robot, frame)}_kinematics") <= 63


@given(st.text(max_size=60) | st.sampled_from([*_WORDS, *NAMES.values()]))
def test_a_name_in_a_comment_cannot_end_the_comment(name: str) -> None:
    for text in (comment_name(name), comment_name(name * 50)):
        assert text.isascii()
        assert text == "" or text.isprintable()
        assert not set("*\"'\\%\n") & set(text)
        assert len(text) < 100
    assert function_prefix(name, name)[0].isalpha()
    assert len(f"{function_prefix(name * 50, f'x{name}' * 50)}_kinematics") <= 63  # the limit of MATLAB
    assert re.fullmatch(r"\w+", safe_name(name), re.ASCII)
