"""The expansion of xacro files without ROS, with arguments, packages and errors."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests import urdfs
from tests.cli.running import refused
from tests.cli.running import urdfkin as run
from urdfkin.errors import InputError, SourceError, UnknownNameError
from urdfkin.urdf import xacro
from urdfkin.urdf.catalogue import find_package
from urdfkin.urdf.sources import read_source
from urdfkin.urdf.xacro import XacroError, expand

pytestmark = pytest.mark.slow

NAMESPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
ARM = f"""<robot name="arm" {NAMESPACE}>
  <xacro:arg name="n" default="2"/>
  <xacro:include filename="part.xacro"/>
  <xacro:include filename="$(find tools)/urdf/tool.xacro"/>
  <link name="base"/>
  <xacro:part name="a" parent="base" h="${{$(arg n) * 0.25}}"/>
  <xacro:tool parent="a"/>
</robot>"""
PART = f"""<robot {NAMESPACE}><xacro:macro name="part" params="name parent h">
  <link name="${{name}}"/>
  <joint name="j_${{name}}" type="continuous"><parent link="${{parent}}"/><child link="${{name}}"/>
    <origin xyz="0 0 ${{h}}"/><axis xyz="0 0 1"/></joint>
</xacro:macro></robot>"""
TOOL = f"""<robot {NAMESPACE}><xacro:macro name="tool" params="parent">
  <link name="tool"/>
  <joint name="t" type="fixed"><parent link="${{parent}}"/><child link="tool"/></joint>
</xacro:macro></robot>"""


Write = Callable[..., Path]


@pytest.fixture
def arm(write: Write) -> Path:
    write(TOOL, "ws/tools/urdf/tool.xacro")
    write("<package><name>tools</name></package>", "ws/tools/package.xml")
    write(PART, "ws/my_arm/urdf/part.xacro")
    return write(ARM, "ws/my_arm/urdf/arm.urdf.xacro")


def test_a_xacro_file_is_loaded_with_its_arguments(arm: Path) -> None:
    for arguments, height in (({}, 0.5), ({"n": 6}, 1.5)):
        robot = urdfkin.load(arm, xacro_args=arguments)
        T = robot.placement(robot.neutral(), "tool")
        np.testing.assert_array_equal(T[:3, 3], [0.0, 0.0, height])
        assert robot.certificate().verified


def test_an_escaped_expression_stays_text(write: Write) -> None:
    """The program xacro replaces `$${` by `${` and evaluates nothing in the result."""
    path = write(f'<robot name="$${{1 + 1}} $$(arg n) ${{1 + 1}}" {NAMESPACE}/>', "escaped.xacro")
    assert b'name="${1 + 1} $(arg n) 2"' in expand(path, {})


def test_abs_filename_returns_an_absolute_path_in_the_main_file_and_in_included_files(write: Write) -> None:
    use = "<link name=\"${xacro.abs_filename('x.yaml')}\"/>"
    part = write(f"<robot {NAMESPACE}>{use}</robot>", "parts/part.xacro")
    path = write(
        f'<robot name="r" {NAMESPACE}>{use}<xacro:include filename="parts/part.xacro"/></robot>', "r.xacro"
    )
    text = expand(path, {}).decode()
    for folder in (path.parent, part.parent):
        assert f'"{folder}/x.yaml"' in text


def test_the_expansion_stays_in_the_working_directory(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(arm.parents[1])
    assert b'name="tool"' in expand(Path("urdf/arm.urdf.xacro"), {})
    assert Path.cwd() == arm.parents[1]


def test_the_command_and_the_call_that_load_a_robot_again_contain_the_arguments(arm: Path) -> None:
    robot = urdfkin.load(arm, xacro_args={"n": 3})
    assert robot.source == str(arm)
    assert robot.origin.command_line == f"{arm} --xacro-arg n:=3"
    assert eval(robot.origin.python_call, {"urdfkin": urdfkin}).urdf == robot.urdf
    report = urdfkin.validate(arm, samples=0, xacro_args={"n": 3})
    assert report.command == f"urdfkin validate {arm} --samples 0 --seed 0 --xacro-arg n:=3"


def test_findings_refer_to_the_expanded_text(arm: Path) -> None:
    arm.with_name("part.xacro").write_text(PART.replace("continuous", "hinge"))
    (finding,) = urdfkin.check(arm)
    assert (finding.code, finding.file) == ("URDF501", f"{arm} (expanded)")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('<xacro:include filename="$(find nowhere)/x.xacro"/>', "package 'nowhere' is not found"),
        ('<xacro:include filename="nothing.xacro"/>', "No such file"),
        ("<xacro:unknown/>", "unknown macro"),
        ('<link name="${1/0}"/>', "division by zero"),
        ("<link", "not well-formed|unclosed|invalid"),
    ],
)
def test_a_failed_expansion_is_an_error_with_the_reason(write: Write, text: str, reason: str) -> None:
    path = write(f'<robot name="r" {NAMESPACE}>{text}</robot>', "r.xacro")
    with pytest.raises(XacroError, match=f"(?s)cannot expand the file: found .*({reason})"):
        urdfkin.load(path)


def test_an_endless_expansion_ends_with_an_error(write: Write) -> None:
    endless = '<xacro:property name="x" value="${9**9**9**9}"/><link name="${x}"/>'
    path = write(f'<robot name="r" {NAMESPACE}>{endless}</robot>', "r.xacro")
    with pytest.raises(XacroError, match="did not finish"):
        expand(path, {}, timeout=3.0)


@pytest.mark.parametrize(
    "use",
    [
        "$(arg n)",
        "$(eval n*1)",
        "$(eval n if 'no' else 0)",
        "${xacro.arg('n')}",
        "${xacro.arg( &quot;n&quot; )}",
        "${xacro.arg('' + 'n')}",
    ],
)
def test_an_argument_that_the_file_uses_in_any_way_is_known(write: Write, use: str) -> None:
    path = write(f'<robot name="r" {NAMESPACE}><link name="l{use}"/></robot>', "r.xacro")
    assert urdfkin.load(path, xacro_args={"n": 3}).link_names == ("l3",)
    if "''" not in use:
        with pytest.raises(UnknownNameError, match="unknown xacro argument 'no'; did you mean n"):
            urdfkin.load(path, xacro_args={"n": 3, "no": 1})


def test_mistakes_with_xacro_are_errors_with_a_remedy(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SourceError, match="no such file"):
        urdfkin.load(arm.with_name("r.xacro"))
    with pytest.raises(InputError, match="xacro_args"):
        read_source("panda", xacro_args={"n": 1})
    with pytest.raises(urdfkin.UrdfError, match="expand the file first"):
        urdfkin.load(f'<robot name="r" {NAMESPACE}><link name="a"/><xacro:b/></robot>')
    monkeypatch.setattr(xacro, "find_spec", lambda name: None)
    with pytest.raises(XacroError, match="pip install 'xacrodoc>=2'"):
        urdfkin.load(arm)


def test_commands_and_validate_accept_xacro_arguments(arm: Path) -> None:
    for command in (["check", str(arm)], ["placement", str(arm), "--frame", "tool", "--format", "csv"]):
        done = run(*command, "--xacro-arg", "n:=6")
        assert done.code == 0, done.err
    assert "1.5" in done.text
    report = urdfkin.validate([arm], samples=3, xacro_args={"n": 4})
    assert report.passed
    assert "--xacro-arg n:=4" in str(report.as_dict())


def test_check_passes_xacro_arguments_only_to_xacro_files(arm: Path) -> None:
    other = arm.with_name("other.urdf")
    other.write_text('<robot name="r"><link name="a"/><joint name="unused" type="fixed"/></robot>')
    done = run("check", str(other), str(arm), "--xacro-arg", "n:=6")
    assert (done.code, "URDF" in done.text, done.err) == (1, True, "")


def test_check_fixes_no_file_before_an_option_without_effect_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(urdfs.robot(urdfs.joint("a", "revolute", "l0", "l1", axis="0 0 2", more=urdfs.limit())))
    text = file.read_text()
    for option in ("--xacro-arg=n:=6", "--variant=a=b"):
        assert "does nothing without a" in refused("check", "--fix", str(file), option)
        assert file.read_text() == text


# -- packages ----------------------------------------------------------------------------------------


def test_packages_are_searched_in_the_documented_order(tmp_path: Path) -> None:
    above = tmp_path / "up" / "pkg"
    places = [tmp_path / place for place in ("ros/pkg", "src/repository/pkg", "opt/share/pkg")]
    for folder in (*places, above / "urdf"):
        folder.mkdir(parents=True)
    referring_file = above / "urdf" / "a.urdf"
    environ = {
        "ROS_PACKAGE_PATH": os.pathsep.join((str(tmp_path / "ros"), str(tmp_path / "src"))),
        "AMENT_PREFIX_PATH": str(tmp_path / "opt"),
    }
    for place in places:
        assert find_package("pkg", referring_file, environ) == place
        place.rmdir()
    assert find_package("pkg", referring_file, environ) == above
    assert find_package("other", referring_file, environ) is None


def test_a_package_is_also_found_by_its_search_path_or_its_manifest_but_not_by_an_invalid_name(
    write: Write, tmp_path: Path
) -> None:
    clone = write("<package><name> my_arm </name></package>", "clone-main/package.xml").parent
    (tmp_path / "pkg").mkdir()
    assert find_package("pkg", None, {"ROS_PACKAGE_PATH": str(tmp_path / "pkg")}) == tmp_path / "pkg"
    assert find_package("my_arm", clone / "urdf" / "a.urdf", {}) == clone
    for name in ("", ".", "..", "a\0b"):
        assert find_package(name, tmp_path / "a.urdf", {}) is None
