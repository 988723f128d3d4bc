"""Time and memory grow linearly with the size of a file, and not with the number of deleted robots."""

import copy
import json
import pickle
import re
import signal
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from scripts.check_growth import KINDS
from scripts.leaks import PARTS
from tests.reading import tree_of
from tests.urdf.lint.cases.arm import arm
from urdfkin.errors import find_similar_names
from urdfkin.robot import Robot
from urdfkin.urdf.findings import MAX_COMPLETE_FINDINGS, MAX_ERRORS_PER_CODE, Reporter
from urdfkin.urdf.lint import Finding, Severity, UrdfError, check_text
from urdfkin.urdf.lint.formats import as_json
from urdfkin.urdf.parser import read_document
from urdfkin.verify.oracle import parse_mimic_rules

#: For four times the size: largest accepted ratio of times, between 4 (linear) and 16 (quadratic), and
#: additional seconds for a busy machine. Then the largest time of a test, s.
TIMES, MORE, ENOUGH = 10.0, 0.3, 30.0


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise AssertionError after this processor time, so that a quadratic time does not stop the tests."""

    def end(*_: object) -> None:
        raise AssertionError(f"more than {seconds:g} s of processor time")

    before = signal.signal(signal.SIGVTALRM, end)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def grows_like_its_size(work: Callable[[int], object], size: int) -> None:
    def seconds(of: int) -> float:
        start = time.process_time()
        work(of)
        return time.process_time() - start

    with at_most(ENOUGH):
        small = min(seconds(size) for _ in range(2))
        large = seconds(4 * size)
        if large >= TIMES * small + MORE:  # measure again, because the machine may have been busy
            large = min(large, seconds(4 * size))
    assert large < TIMES * small + MORE, (small, large)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_document_four_times_as_long_takes_about_four_times_the_time(kind: str) -> None:
    documents = {size: KINDS[kind](size) for size in (100_000, 400_000)}
    grows_like_its_size(lambda size: check_text(documents[size], fold=False), 100_000)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_document_four_times_as_long_takes_about_four_times_the_memory(kind: str) -> None:
    def megabytes(size: int) -> float:
        document = KINDS[kind](size)
        tracemalloc.start()
        try:
            check_text(document, fold=False)
            return tracemalloc.get_traced_memory()[1] / 1e6
        finally:
            tracemalloc.stop()

    with at_most(ENOUGH):
        assert megabytes(50_000) < 6.0 * megabytes(12_500) + 0.5


@pytest.mark.long
def test_a_chain_of_mimic_joints_is_read_in_linear_time_by_both_readers() -> None:
    documents = {size: KINDS["a chain of mimic joints"](size) for size in (100_000, 400_000)}

    def read(size: int) -> None:
        tree = tree_of(documents[size])
        names = {joint.name for joint in tree.joints}
        assert (
            parse_mimic_rules(documents[size].decode(), names)[tree.joints[-1].name] == tree.joints[-1].mimic
        )

    grows_like_its_size(read, 100_000)


def test_a_long_text_is_truncated_and_leading_blanks_hide_no_text() -> None:
    root = read_document(Reporter("f", b"<robot>" + b"some &lt; words " * 10_000 + b"</robot>"))
    assert root is not None
    assert root.text.startswith("some < words some")
    assert len(root.text) < 1_000
    (finding,) = check_text(arm(more=" \n" * 5_000 + "hello").encode())
    assert (finding.code, finding.found) == ("URDF212", '"hello"')


@pytest.mark.parametrize(
    ("xyz", "code"),
    [
        (f"{'1' * 200_000}e+ 0 0", "URDF305"),
        (f"{'1' * 1_998}e+ 0 0", "URDF301"),
        (f"0.{'1' * 1_998} 0 0", None),
        (f"0.{'1' * 1_999} 0 0", "URDF305"),
        ("1 " * 100_000, "URDF305"),
        *((f"&#{'0' * n}49; 0 0", code) for n, code in ((10, None), (3_000, None), (10_000, "URDF305"))),
    ],
)
def test_a_number_with_too_many_characters_is_refused(xyz: str, code: str | None) -> None:
    with at_most(ENOUGH):
        findings = urdfkin.check(arm(origin=f'<origin xyz="{xyz}"/>'))
    assert {finding.code for finding in findings} == ({code} if code else set())


MANY = 3 * MAX_COMPLETE_FINDINGS
DOUBLES = "<robot name='r'>" + "<link name='a'/>\n" * MANY + "</robot>"


def told(findings: list[Finding], code: str) -> int:
    return sum(finding.count for finding in findings if finding.code == code)


@pytest.mark.long
def test_many_errors_of_one_kind_are_summarised_also_by_load_and_hide_no_other_errors() -> None:
    findings = urdfkin.check(DOUBLES, fold=True)
    assert len(findings) == MAX_ERRORS_PER_CODE
    assert told(findings, "URDF402") == MANY - 1
    assert f"(also on lines 102, 103, 104, 105 and {MANY - 105} more)" in str(findings[-1])
    assert sum(len(str(finding)) for finding in findings) < 50_000
    findings = urdfkin.check(DOUBLES.replace("</robot>", "<joint name='j' type='x'/></robot>"), fold=True)
    assert {"URDF402", "URDF501", "URDF210"} <= {finding.code for finding in findings}
    with pytest.raises(UrdfError) as refused:
        urdfkin.load(DOUBLES)
    message = str(refused.value)
    assert message.startswith(f"<text>: the URDF has {MANY - 1} errors")
    assert f"... and {MANY - 6} more" in message
    assert len(message) < 2_000


@pytest.mark.long
def test_without_folding_findings_beyond_the_stated_number_are_listed_by_line() -> None:
    findings = urdfkin.check(DOUBLES)
    assert len(findings) == MAX_COMPLETE_FINDINGS
    assert [finding.line for finding in findings] == list(range(2, MAX_COMPLETE_FINDINGS + 2))
    assert findings[-1].other_lines == tuple(range(MAX_COMPLETE_FINDINGS + 2, MANY + 1))
    document = json.loads(as_json(findings, ["f"], "1"))
    assert document["counts"]["error"] == MANY - 1
    assert document["findings"][-1]["other_lines"][-1] == MANY


def test_findings_of_one_kind_are_counted_with_the_lines_on_which_they_occur() -> None:
    text = "<robot name='r'>" + "<link name='a'/>" * 150 + "</robot>"
    findings = urdfkin.check(text, fold=True)
    assert told(findings, "URDF402") == 149
    assert "(49 more on this line)" in str(findings[-1])
    (finding,) = urdfkin.check(arm(more="<a/><b/><c/><d/>\n<e/>"), fold=True)
    assert (finding.count, finding.severity) == (5, Severity.WARNING)
    assert "(4 more on this line and line 9)" in str(finding)


def test_similar_names_and_the_positions_of_many_attributes_are_found_quickly() -> None:
    attributes = "".join(f'\n  a{i}="ä" b{i}="1"' for i in range(50))
    findings = urdfkin.check(f'<robot name="r"><link name="l"{attributes}/></robot>')
    assert [(f.line, f.column) for f in findings] == [
        place for i in range(50) for place in ((i + 2, 3), (i + 2, 9 + len(str(i))))
    ]
    known = ["ab" * 60 + str(i) for i in range(100_000)]
    with at_most(ENOUGH):
        assert len(find_similar_names("ba" * 60, known)) == 3
    assert find_similar_names("elbwo", ["shoulder", "elbow", "wrist"]) == ["elbow"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("inside", "filling"),
    [("<!--{}-->", "a"), ("<?a {}?>", "a"), ('<material note="{}"/>', "a"), ("<material {}/>", 'a="1" ')],
)
def test_very_long_markup_is_refused_without_being_read_repeatedly(inside: str, filling: str) -> None:
    long = inside.format(filling * (15_000_000 // len(filling)))
    with at_most(ENOUGH):
        findings = urdfkin.check(f'<robot name="r"><link name="l"/>{long}</robot>')
    assert [(finding.code, finding.line) for finding in findings] == [("URDF119", 1)]


@pytest.mark.parametrize("inside", ["<!--{}-->", "<![CDATA[{}]]>", '<material note="{}"/>'])
def test_long_markup_that_is_read_in_blocks_does_not_change_positions(inside: str) -> None:
    text = f'<robot name="r">\n<link name="l"/>{inside.format("ä&lt;>" * 400_000)}\n<link name="l"/></robot>'
    double = next(f for f in urdfkin.check(text) if f.code == "URDF402")
    assert (double.line, double.column) == (3, 7)


def test_limits_of_the_file_are_enforced_when_a_robot_is_loaded() -> None:
    for text, code in (
        (arm(origin=f'<origin xyz="{"1" * 200_000} 0 0"/>'), "URDF305"),
        (arm(base=f'<link name="{"n" * 20_000}"/>'), "URDF117"),
        (arm(more="<gazebo " + " ".join(f'a{i}=""' for i in range(201)) + "/>"), "URDF116"),
        (arm(more="<a>" * 600 + "</a>" * 600), "URDF115"),
    ):
        with pytest.raises(UrdfError, match=re.escape(code)):
            urdfkin.load(text)


@pytest.mark.long
def test_three_hundred_deleted_robots_leak_no_object_file_descriptor_or_memory() -> None:
    # `python -m scripts.leaks 10000` is a longer run of this test.
    command, root = [sys.executable, "-m", "scripts.leaks", "300"], Path(__file__).parents[2]
    parts = json.loads(subprocess.run(command, capture_output=True, check=True, cwd=root).stdout)
    assert len(parts) == PARTS
    # The first parts fill caches of limited size. One leaked object for each robot would be 180 objects.
    second, last = parts[1], parts[-1]
    assert last["descriptors"] == second["descriptors"]
    assert last["objects"] - second["objects"] < 60
    assert last["MiB"] - second["MiB"] < 8.0


@pytest.mark.parametrize(
    "copied",
    [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))],
    ids=["copy", "deepcopy", "pickle"],
)
def test_a_copy_of_a_robot_gives_the_same_results_and_has_its_own_certificate(
    copied: Callable[[Robot], Robot],
) -> None:
    robot = urdfkin.load("panda", verify="sample")
    q, several = robot.neutral(), robot.sample(3)
    robot.placement(q, "panda_hand")
    robot.prepare("panda_hand").placement(q)
    again = copied(robot)
    assert again.certificate().lines == ()
    assert not again.certificate().verified
    again.jacobian(q, "panda_hand", verify=False)
    again.prepare("panda_hand").jacobian(q)
    assert [(line.checked, line.unchecked) for line in robot.certificate().lines] == [(1, 1)]
    assert [(line.checked, line.unchecked) for line in again.certificate().lines] == [(0, 2)]
    assert (again.name, again.verifier.policy, again.tip_frame) == (robot.name, "sample", robot.tip_frame)
    assert (again.sample(3) == several).all()
    here, there = (one.placement(several, robot.link_frames) for one in (robot, again))
    np.testing.assert_array_equal(here, there)
