"""A hostile xacro file can compute names and numbers, but cannot read other files or run programs."""

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.running import python
from urdfkin.urdf.confinement import AllowedPaths
from urdfkin.urdf.expressions import RefusedError, evaluate
from urdfkin.urdf.xacro import XacroError, expand

pytestmark = pytest.mark.slow
NAMESPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
SECRET = "hunter2"

Expand = Callable[..., str]


@pytest.fixture
def expanded(tmp_path: Path) -> Expand:
    """Expand a robot with some content."""

    def expanded(inside: str, patience: float = 60.0, **arguments: str) -> str:
        path = tmp_path / "robot" / "urdf" / "r.xacro"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'<robot name="r" {NAMESPACE}>{inside}</robot>')
        return expand(path, arguments, timeout=patience).decode()

    return expanded


def link(expression: str) -> str:
    return f'<link name="{expression}"/>'


def as_eval(program: str) -> str:
    """Write $(eval ...) with a property, because the argument of $(eval) cannot contain a bracket."""
    return f'<xacro:property name="p" value="{program}"/><link name="$(eval ${{p}})"/>'


#: Expressions that give access to `os.system` if xacro itself evaluates them.
PROGRAMS = [
    "(lambda: ().__class__)()", "[c for c in ''.__class__.__mro__]", "(x for x in [1]).gi_frame.f_back",
    "(lambda: [c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen'])()", "[(yield)]",
    "load_yaml.__globals__['os']", "xacro.load_yaml.__globals__['os'].system('touch ' + mark)",
    "'{0.__globals__}'.format(load_yaml)", "str.format('{0.__globals__}', load_yaml)", "list.mro()",
    "python.vars(python)", "python.map(python.vars, [python])", "python.type('x', (), dict(__init__=len))",
    "list(map(python.type, ['x']))", "dict['a']", "math.__loader__", "(a := 1)", "__import__('os')",
    "f'{load_yaml.__globals__}'", "__builtins__", "(len if 1 else 2).__self__",
]  # fmt: skip


REFUSALS = (
    "the expression .* is not allowed|not allowed in expressions|is not a function|may not index"
    "|'\\w+' is not defined"
)


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_dangerous_expression_is_refused_with_the_reason(expanded: Expand, program: str) -> None:
    ways = [as_eval(program)]
    if "}" not in program:  # the character ends an expression
        ways.append(link(f"${{{program}}}"))
    words = rf"r\.xacro: xacro cannot expand the file: found .*({REFUSALS})"
    for inside in ways:
        with pytest.raises(XacroError, match=words):
            expanded(inside)


def test_eval_has_no_builtins(expanded: Expand, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    for program in (f"open('{mark}', 'w')", f"map(open, ['{mark}'], ['w'])", "open('/etc/passwd').read()"):
        with pytest.raises(XacroError, match="'open' is not defined"):
            expanded(as_eval(program))
    assert not mark.exists()
    assert 'name="3"' in expanded(as_eval("1 + 2"))


COMPUTED = {
    "pi/2": "1.5707963267948966", "radians(90)": "1.5707963267948966", "-2 + 7 // 2 % 3": "-2",
    "math.sqrt(2)**2": "2.0000000000000004", "d['a'] + d.b[1]": "4", "prefix[-5:-1]": "left",
    "prefix + 'arm' + str(1)": "left_arm1", "' '.join(map(str, [1, 2]))": "1 2", "'%0.2f' % pi": "3.14",
    "'x'.join([str(i * j) for i, j in [(1, 2), (3, 4)] if i])": "2x12", "xacro.arg('size')": "2",
    "len(python.list(python.range(3)))": "3", "max(*[1, 2]) if 1 < 2 <= 2 and not None else 0": "2",
    "'1:2'.split(':').pop(0).strip().zfill(2)": "01", "y.limits.upper": "1.5", "1 << 2": None,
    "python.isinstance(prefix, str) and 'left' in prefix": "True", "y.tilt": "3.141592653589793",
    "xacro.dotify(dict(a=dict(b=5))).a.b": "5",
}  # fmt: skip


@pytest.mark.parametrize("expression", COMPUTED)
def test_the_usual_expressions_are_evaluated(expanded: Expand, expression: str, tmp_path: Path) -> None:
    folder = tmp_path / "robot" / "config"
    folder.mkdir(parents=True)
    (folder / "y.yaml").write_text("limits: {upper: 1.5}\ntilt: !degrees 180\n")
    before = (
        '<xacro:arg name="size" default="2"/><xacro:property name="prefix" value="left_"/>'
        '<xacro:property name="d" value="${xacro.dotify(dict(a=1, b=[2, 3]))}"/>'
        '<xacro:property name="y" value="${xacro.load_yaml(\'../config/y.yaml\')}"/>'
    )
    (tmp_path / "robot" / "package.xml").write_text("<package><name>robot</name></package>")
    written = before + link(f"${{{expression}}}".replace("<", "&lt;"))
    if (value := COMPUTED[expression]) is None:
        with pytest.raises(XacroError, match="operator in"):
            expanded(written)
    else:
        assert f'<link name="{value}"/>' in expanded(written)


# -- files -------------------------------------------------------------------------------------------


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    """Create a file beside the robot's folder."""
    path = tmp_path / "neighbour" / "secret.yaml"
    path.parent.mkdir()
    path.write_text(f"{{password: {SECRET}}}")
    (path.parent / "secret.xacro").write_text(f'<robot><link name="{SECRET}"/></robot>')
    return path


def refused(expanded: Expand, inside: str) -> str:
    """Return the message of the error, which must not contain the secret."""
    with pytest.raises(XacroError) as caught:
        expanded(inside)
    assert SECRET not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    "name",
    ["../../neighbour/secret", "{tmp}/neighbour/secret", "../urdf/../../neighbour/secret", "link/secret"],
)
def test_files_outside_the_robots_folder_are_not_read(
    expanded: Expand, secret: Path, tmp_path: Path, name: str
) -> None:
    (tmp_path / "robot" / "urdf").mkdir(parents=True)
    (tmp_path / "robot" / "urdf" / "link").symlink_to(secret.parent)
    name = name.format(tmp=tmp_path)
    message = refused(expanded, link(f"${{xacro.load_yaml('{name}.yaml')['password']}}"))
    assert "outside the allowed folders. A xacro file may read its own folder" in message
    for how in ('filename="{}.xacro"', 'filename="{}.x*"', 'filename="{}.xacro" optional="true"'):
        refused(expanded, f"<xacro:include {how.format(name)}/>")


def test_a_file_that_the_user_names_or_that_is_in_a_package_or_search_path_is_read(
    expanded: Expand, secret: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside = '<xacro:arg name="file" default=""/>' + link("${xacro.load_yaml('$(arg file)')['password']}")
    message = refused(expanded, inside.replace('default=""', f'default="{secret}"'))
    for words in (
        "It may also read files and folders that the user passes as arguments",
        "the xacro file may read a file or folder if its path is the VALUE of an argument",
    ):
        assert words in message
    assert SECRET in expanded(inside, file=str(secret))
    fixed = '<xacro:arg name="folder" default=""/>' + link(f"${{xacro.load_yaml('{secret}')['password']}}")
    refused(expanded, fixed)
    assert SECRET in expanded(fixed, folder=str(secret.parent))
    inside = '<xacro:include filename="$(find neighbour)/secret.xacro"/>'
    assert "package 'neighbour' is not found" in refused(expanded, inside)
    refused(expanded, '<xacro:include filename="$(find etc)/passwd"/>')
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(secret.parents[1]))
    assert SECRET in expanded(inside)
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    (secret.parent / "package.xml").write_text("<package><name>neighbour</name></package>")
    assert SECRET in expanded(inside)


def test_the_package_xml_of_another_folder_is_not_read(expanded: Expand, secret: Path) -> None:
    manifest = secret.parent / ".hidden" / "package.xml"
    manifest.parent.mkdir()
    manifest.write_text(f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro">{link(SECRET)}</robot>')
    refused(expanded, f'<xacro:include filename="{manifest}"/>')


def test_hidden_files_and_entities_are_not_read(expanded: Expand, tmp_path: Path, secret: Path) -> None:
    hidden = tmp_path / "robot" / "urdf" / ".git" / "config"
    hidden.parent.mkdir(parents=True)
    hidden.write_text(f"token: {SECRET}")
    refused(expanded, link("${xacro.load_yaml('.git/config')['token']}"))
    path, entity = tmp_path / "e.xacro", f'<!DOCTYPE r [<!ENTITY e SYSTEM "{secret}">]>'
    path.write_text(f'{entity}<robot name="r"><link name="a">&e;</link></robot>')
    assert SECRET not in expand(path, {}).decode()


def test_files_in_the_repository_may_be_read_unless_the_repository_is_the_home_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    file, other = home / "robots" / "urdf" / "r.xacro", str(home / "robots" / "other" / "o.xacro")
    file.parent.mkdir(parents=True)
    file.touch()
    assert not AllowedPaths.of_file(file, [], []).allows(other)
    (home / "robots" / ".git").mkdir()
    allowed_paths = AllowedPaths.of_file(file, [], [])
    assert allowed_paths.allows(other)
    for hidden_or_outside in ("robots/.git/config", "robots2/o.xacro"):
        assert not allowed_paths.allows(str(home / hidden_or_outside))
    monkeypatch.setenv("HOME", str(home))
    (home / "robots" / ".git").rename(home / ".git")
    for arguments in ([], ["/", str(home)]):
        assert not AllowedPaths.of_file(file, [], arguments).allows(other)


def test_links_in_an_installed_package_may_only_lead_to_its_sources(tmp_path: Path) -> None:
    installed, source, secret = tmp_path / "install/share/arm", tmp_path / "src/arm", tmp_path / "secret.yaml"
    installed.mkdir(parents=True)
    source.mkdir(parents=True)
    for file in (secret, source / "package.xml", source / "arm.xacro", source / ".hidden"):
        file.touch()
    for link in ("arm.xacro", ".hidden"):
        (installed / link.removeprefix(".")).symlink_to(source / link)
    (installed / "secret.yaml").symlink_to(secret)
    (source / "secret.yaml").symlink_to(secret)
    (installed / "by-way.yaml").symlink_to(source / "secret.yaml")
    allowed_paths = AllowedPaths.of_file(tmp_path / "robot" / "r.xacro", [str(tmp_path / "install")], [])
    assert allowed_paths.allows(str(installed / "arm.xacro"))
    assert not allowed_paths.allows(str(source / "arm.xacro"))
    for other in ("secret.yaml", "by-way.yaml", "hidden", "../../../secret.yaml"):
        assert not allowed_paths.allows(str(installed / other)), other


def test_links_in_a_repository_on_a_search_path_are_not_followed(
    expanded: Expand, secret: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "link").symlink_to(secret.parent)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "robot"))
    for name in ("../link/secret", "$(find robot)/link/secret"):
        refused(expanded, f'<xacro:include filename="{name}.xacro"/>')


# -- the environment, programs, the net ---------------------------------------------------------------


def test_a_xacro_file_reads_no_environment_variables(
    expanded: Expand, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOKEN", SECRET)
    assert "'TOKEN' is not set" in refused(expanded, link("$(env TOKEN)"))
    assert 'name="none"' in expanded(link("$(optenv TOKEN none)"))
    for process in ("self", os.getpid()):
        refused(expanded, link(f"${{xacro.load_yaml('/proc/{process}/environ')}}"))


WORST = """
from urdfkin.urdf.confinement import confine, limit_process
import ctypes, os, socket, subprocess
limit_process(20)
confine(lambda path: path == "/etc/hostname")
{}
"""


DEEDS = [
    "os.system('true')", "subprocess.run(['true'])", "os.fork()", "os.execv('/bin/true', ['true'])",
    "os.posix_spawn('/bin/true', ['true'], {})", "socket.socket()", "import antigravity", "eval('1')",
    "socket.create_connection(('127.0.0.1', PORT))", "ctypes.CDLL(None)", "ctypes.string_at(id(1), 1)",
    "open('/etc/passwd')", "open(0)", "open('/etc/hostname', 'a')", "os.open('/etc/hostname', os.O_RDWR)",
    "os.remove('/etc/hostname')", "os.rename('/etc/hostname', '/tmp/x')", "os.mkdir('/tmp/x')",
    "os.listdir('/')", "os.kill(1, 0)", "os.symlink('/etc/passwd', '/tmp/x')",
]  # fmt: skip


@pytest.mark.parametrize("deed", DEEDS)
def test_a_forbidden_operation_in_the_confined_process_is_refused(deed: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        done = python(WORST.format(deed.replace("PORT", str(server.getsockname()[1]))), check=False)
        server.setblocking(False)
        with pytest.raises(BlockingIOError):  # no connection waits
            server.accept()
    assert "RefusedError: " in done.stderr.splitlines()[-1]


# -- limits of memory, time and output ----------------------------------------------------------------


@pytest.mark.parametrize(
    "inside",
    [
        link("${'x' * 3000000000}"),
        link("${'%3000000000d' % 1}"),
        link("${python.list(python.range(10**10))}"),
        link("${len('x' * 1100000000 + 'y' * 1100000000)}"),
    ],
)
def test_the_memory_of_an_expansion_is_limited(expanded: Expand, inside: str) -> None:
    with pytest.raises(XacroError, match="the expansion takes more than 2 GiB of memory"):
        expanded(inside)


def test_the_time_and_the_output_of_an_expansion_are_limited(
    expanded: Expand, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(XacroError, match="did not finish: found 2 s"):
        expanded(link("${max(python.range(10**12))}"), patience=2.0)
    with pytest.raises(XacroError, match="recursion"):
        expanded('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>')
    monkeypatch.setattr("urdfkin.urdf.xacro.MAX_EXPANDED_BYTES", 10_000)
    with pytest.raises(XacroError, match="URDF is too long: found more than 10000 bytes"):
        expanded(link("${'x' * 20000}"))


# -- evaluation ---------------------------------------------------------------------------------------


def test_only_allowed_functions_are_called_and_operators_evaluate_like_python() -> None:
    names = {"f": len, "g": max, "d": {"h": print}, "x": [1, 2]}
    assert evaluate("g(x)", names, [max]) == 2
    others = "f(x)", "d.h(x)", "d['h'](x)", "(lambda: 1)()", "g(x)(x)", "x.__len__()", "f.__self__"
    for expression in others:
        with pytest.raises(RefusedError):
            evaluate(expression, names, [max])
    for expression in ("0 and 1 / 0", "2 or 1 / 0", "1 and 0 or 5", "1 < 0 < 1 / 0", "[] or ''", "3 and 4"):
        assert evaluate(expression, {}, []) == eval(expression)
