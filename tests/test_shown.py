"""Objects are displayed safely in a terminal, a notebook, Markdown and LaTeX, for all names in a file."""

import html
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import urdfkin
from tests.attacks.hostile import NAMES, urdf
from tests.markup import Page
from urdfkin.dh.export import export
from urdfkin.dh.units import parse_units
from urdfkin.errors.display import Table, TextDocument
from urdfkin.report.html import as_html
from urdfkin.report.markdown import as_markdown
from urdfkin.robot import Robot
from urdfkin.urdf.findings import Findings

FORMS = ("__str__", "_repr_html_", "_repr_markdown_", "_repr_latex_")


@pytest.fixture(scope="module")
def robot() -> Robot:
    robot = urdfkin.load("panda", verify=False)
    robot.jacobian("ready", "panda_hand")
    return robot


@pytest.fixture(scope="module")
def objects(robot: Robot) -> dict[str, Any]:
    rates = "neutral, panda_joint1=1, panda_joint2=0.5"
    return {
        "robot": robot, "table": robot.dh(), "chain": robot.chain(),
        "breakdown": robot.acceleration_breakdown("ready", rates, rates),
        "breakdown of a batch": robot.acceleration_breakdown(robot.sample(4), rates, rates),
        "certificate": robot.certificate(), "findings": urdfkin.load("planar_two_link").findings,
        "check": urdfkin.check('<robot name="r"><link name="base"/><link name="stray"/></robot>'),
    }  # fmt: skip


#: Texts in each display form of each object
SAYS = {
    "robot": ("panda: nq 8, nv 8", "panda_joint4", "-3.0718", "-0.0698", "2.175"),
    "table": ("standard Denavit-Hartenberg parameters", "panda_joint4", "0.316", "0.0825"),
    "chain": ("panda_link0 to panda_hand_tcp", "7 joints", "panda_joint4", "0.649"),
    "breakdown": ("Acceleration by joint and kind", "panda_joint2", "centripetal", "coriolis", "sum"),
    "breakdown of a batch": ("sample", "... and 2 more samples"),
    "certificate": (
        "panda: NOT verified by Pinocchio", "jacobian", "the check was turned off by verify=False", "sha256",
    ),
    "findings": ("no findings",),
    "check": ("1 error", "URDF411", "stray", "the link has no parent"),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", SAYS)
def test_an_object_has_the_same_content_in_every_format(name: str, form: str, objects: Any) -> None:
    if (name, form) in {("certificate", "__str__"), ("table", "_repr_latex_")}:
        pytest.skip("a form of its own, tested elsewhere")
    text = getattr(objects[name], form)()
    plain = html.unescape(text).replace("\\", "").replace("&#8288;", "")
    assert [words for words in SAYS[name] if words not in plain] == []


@pytest.mark.parametrize("name", ["robot", "table", "chain", "breakdown"])
def test_its_repr_is_one_short_line(name: str, objects: dict[str, Any]) -> None:
    text = repr(objects[name])
    assert text.startswith("<")
    assert len(text) < 100
    assert "\n" not in text


def test_a_table_has_the_text_of_the_command_line(robot: Robot) -> None:
    table, units = robot.dh(snap=1e-6), parse_units("degrees", "millimetres", 6)
    for form in ("markdown", "latex", "html"):
        own = getattr(table, f"to_{form}")("degrees", "mm", 6)
        assert own == export(table, form, units).rstrip("\n")
        assert "316" in own
    assert str(table) == export(table, "terminal").rstrip("\n")
    with pytest.raises(urdfkin.InputError, match="unknown unit"):
        table.to_latex("turns")


@pytest.mark.slow
def test_a_report_has_the_text_of_the_command_line() -> None:
    report = urdfkin.validate("planar_two_link", samples=3)
    document = report.as_dict()
    assert report.to_html() == as_html(document)
    assert report.to_markdown() == as_markdown(document)
    for form in FORMS:
        text = getattr(report, form)().replace("\\", "")
        assert "1 of 1 robots verified" in text
        assert "planar_two_link" in text


def sheets() -> Iterator[Callable[[str], TextDocument]]:
    yield lambda name: TextDocument(name, ())
    yield lambda name: TextDocument("t", (name, Table((name, "x"), [(name, 1.0)])))


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_name_from_an_untrusted_file_is_escaped_in_every_format(name: str) -> None:
    for made in sheets():
        sheet, tame = made(name), made("tame")
        tags = [tag for tag, _ in Page(sheet.html()).skeleton]
        while tags:  # elements are nested
            end = next(i for i, tag in enumerate(tags) if tag.startswith("/"))
            assert tags[end] == f"/{tags[end - 1]}"
            assert tags[end - 1] in {"div", "p", "b", "table", "thead", "tbody", "tr", "th", "td"}
            del tags[end - 1 : end + 1]
        for form in ("text", "markdown", "latex"):
            written = getattr(sheet, form)()
            assert len(written.splitlines()) == len(getattr(tame, form)().splitlines()), "no line is added"
            assert "\x1b" not in written


def test_a_table_of_numbers_hides_rounding_errors_and_is_aligned() -> None:
    table = Table(("name", "x"), [("a", 1.0), ("longer", 1e-17), ("c", -0.25)])
    assert table.text().splitlines() == [
        "name        x", "-------------", "a           1", "longer      0", "c       -0.25"
    ]  # fmt: skip


def test_a_robots_view_is_a_page_in_its_own_frame(robot: Robot) -> None:
    cell = robot.view("ready, panda_joint1=30deg", height=300)
    shown = cell._repr_html_()
    assert shown.startswith('<iframe sandbox="allow-scripts"')
    assert "height:300px" in shown
    page = cell.page()
    assert "default-src 'none'" in page
    assert "http://" not in page.split("<script>")[0]
    assert repr(np.pi / 6) in page
    with pytest.raises(urdfkin.InputError, match="one configuration"):
        robot.view(robot.sample(2))


# -- public names --------------------------------------------------------------------------------------


def test_limits_joints_and_frames_are_those_of_the_file(robot: Robot) -> None:
    lower, upper = robot.limits
    at = robot.coordinate_names.index("panda_joint4")
    assert (lower[at], upper[at], robot.velocity_limits[at]) == (-3.0718, -0.0698, 2.175)
    assert robot.joints["panda_joint4"].limit is not None
    assert list(robot.joints) == [joint.name for joint in robot.tree.joints]
    assert set(robot.frames) == set(robot.frame_names)
    assert robot.frames["panda_joint4"] == robot.frames["panda_link4"] == "panda_link4"
    with pytest.raises(ValueError, match="read-only"):
        robot.limits[0, 0] = 0.0
    wheel = urdfkin.load("kinova", verify=False)
    assert np.isinf(wheel.limits[:, wheel.coordinate_names.index("j2s6s200_joint_1")]).all()


def test_the_frame_is_optional_if_there_is_one_tip(robot: Robot) -> None:
    np.testing.assert_array_equal(robot.jacobian("ready"), robot.jacobian("ready", "panda_hand_tcp"))
    arm = urdfkin.load(urdfkin.load("planar_two_link").urdf, verify=False)
    q, rates = [0.1, 0.2], [1.0, 2.0]
    tip = arm.tip_frame
    np.testing.assert_array_equal(arm.placement(q), arm.placement(q, tip))
    np.testing.assert_array_equal(arm.velocity(q, rates), arm.velocity(q, rates, tip))
    np.testing.assert_array_equal(arm.acceleration(q, rates, rates), arm.acceleration(q, rates, rates, tip))
    assert arm.analytical_jacobian([0.5, 0.6], representation="quaternion").shape == (7, 2)
    np.testing.assert_array_equal(arm.prepare().jacobian(np.array(q)), arm.jacobian(q, tip))
    two = urdfkin.load(urdfkin.load("a1").urdf, verify=False)
    words = "several tips: found .*FL_foot.*; name one, such as robot.tip"
    with pytest.raises(urdfkin.InputError, match=words):
        two.jacobian("ready")


def test_completion_offers_public_names_only(robot: Robot) -> None:
    offered = [name for name in dir(robot) if not name.startswith("_")]
    assert {"jacobian", "dh", "view", "limits", "joints", "integrate"} <= set(offered)
    assert {"plan", "verifier"}.isdisjoint(offered)


def test_robots_are_the_names_that_load_knows() -> None:
    assert "panda" in urdfkin.robots()
    assert urdfkin.robots("text") == ("one_link", "planar_two_link", "polar", "elbow")
    with pytest.raises(urdfkin.UnknownNameError, match="unknown family 'arms'; did you mean arm"):
        urdfkin.robots("arms")
    with pytest.raises(urdfkin.InputError, match="family must be a name"):
        urdfkin.robots(["arm"])  # type: ignore[arg-type]


def test_findings_are_an_ordinary_list() -> None:
    found = urdfkin.load("planar_two_link").findings
    assert isinstance(found, Findings)
    assert found == []


def test_a_table_is_displayed_independently_of_the_order_of_imports() -> None:
    code = "from urdfkin.dh.rows import table_from_rows as t; print(t([[1, 0, 0, 0]], 'standard'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "standard Denavit-Hartenberg parameters" in done.stdout


#: Names in a URDF that have an effect on a terminal or a log if they are printed without escapes
ACTING = ("line", "carriage", "workflow", "workflow after a blank", "azure", "colours of one byte", "bidi")


def printed(name: str) -> dict[str, str]:
    """Return the texts that `print` and `repr` show of objects of a robot with a given name."""
    text = urdf(name)
    robot = urdfkin.load(text)
    q = [0.1, 0.2]
    robot.jacobian(q)
    other = urdfkin.load(text.replace('xyz="0.3', 'xyz="0.4'))
    compared = urdfkin.same(robot, other)
    changed = urdfkin.diff(text, text.replace('xyz="0.3', 'xyz="0.4'))
    found: dict[str, Any] = {
        "robot": robot, "certificate": robot.certificate(), "chain": robot.chain(), "table": robot.dh(),
        "breakdown": robot.acceleration_breakdown(q, q, q), "enclosures": robot.enclose(q, q, q),
        "same": compared, "findings": robot.findings, "report": urdfkin.validate([text], samples=0),
    }  # fmt: skip
    found |= {f"finding {k}": one for k, one in enumerate(robot.findings)}
    found |= {f"change {k}": one for k, one in enumerate(changed.changes)}
    found |= {f"effect {k}": one for k, one in enumerate(changed.effects)}
    said = {f"str of {kind}": str(one) for kind, one in found.items()}
    said |= {f"repr of {kind}": repr(one) for kind, one in found.items() if "<" in repr(one)[:1]}
    with pytest.raises(urdfkin.UrdfkinError) as error:
        robot.placement(q, name[::-1])
    return said | {"error": str(error.value), "error of a file": str(urdfkin.SourceError("x", where=name))}


@pytest.mark.filterwarnings("ignore::urdfkin.UrdfWarning")
@pytest.mark.parametrize("kind", ACTING)
def test_printed_objects_contain_no_control_sequences(kind: str) -> None:
    tame = printed("tame")
    for where, text in printed(NAMES[kind]).items():
        for line in text.split("\n"):
            assert line.isprintable(), where
            assert not re.match(r"\s*::", line), where
            assert not re.search(r"##(vso|teamcity)?\[", line), where
        if not where.startswith(("str of find", "repr of find", "str of report")) and where in tame:
            assert text.count("\n") == tame[where].count("\n"), where
