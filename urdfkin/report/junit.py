"""JUnit XML of a report, and of the checks of `urdfkin verify`.

The XML conforms to junit-10.xsd, the schema of Jenkins. Other programs also accept this schema. The text of
the element `failure` contains all information, because some programs ignore the attributes of this element.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from urdfkin.report.words import (
    check_name,
    checks_in_order,
    format_ratio,
    format_units,
    second_oracle_cells,
    second_oracle_heads,
    second_oracle_title,
)
from urdfkin.validation.document import Case, Document, ReportedCheck, ReportedRobot, outcome_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from urdfkin.validation.functions import FunctionCheck

#: Characters that XML 1.0 forbids, even as references like `&#1;`.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def as_junit(document: Document) -> bytes:
    """Return JUnit XML with a suite for each robot, and a case for each quantity and reference frame."""
    suites = [_suite(robot, document) for robot in document["robots"]]
    robots = document["robots"]
    if document["interrupted"] or not robots or len(robots) != document.get("robots_requested", len(robots)):
        suites.insert(0, _whole_run(document))
    counts = {name: str(sum(int(suite.get(name, "0")) for suite in suites)) for name in _COUNTS}
    root = ET.Element("testsuites", {"name": "urdfkin validate", "time": _time(document["seconds"])} | counts)
    root.extend(suites)
    return _bytes(root)


def _bytes(root: ET.Element) -> bytes:
    ET.indent(root)
    text = _clean(ET.tostring(root, encoding="unicode"))
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def function_checks_as_junit(checks: Sequence[FunctionCheck]) -> bytes:
    """Return JUnit XML with a test case for each function.

    A test case also fails if no oracle could check urdfkin's results.
    """
    cases = [_function_case(check) for check in checks]
    failures = str(sum(case.find("failure") is not None for case in cases))
    counts = {"tests": str(len(cases)), "failures": failures, "errors": "0"}
    root = ET.Element("testsuites", {"name": "urdfkin verify"} | counts)
    ET.SubElement(root, "testsuite", {"name": _clean(checks[0].robot)} | counts).extend(cases)
    return _bytes(root)


def _function_case(check: FunctionCheck) -> ET.Element:
    text = str(check)
    title = text.partition("\n")[0]
    name = f"{check.quantity} by {check.function}"
    case = ET.Element("testcase", {"name": _clean(name), "classname": f"urdfkin.{_clean(check.robot)}"})
    if check.agrees and check.oracle_bound_ratio is not None:
        ET.SubElement(case, "system-out").text = _clean(text)
    else:
        kind = "not verified" if check.agrees else "disagreement"
        ET.SubElement(case, "failure", {"type": kind, "message": _clean(title)}).text = _clean(text)
    return case


_COUNTS = ("tests", "failures", "errors")


def _suite(robot: ReportedRobot, document: Document) -> ET.Element:
    name = _clean(robot["source"])
    cases = [*(_case(check, robot) for check in checks_in_order(robot)), _verdict(robot)]
    facts = {"robot": robot["name"], "verdict": robot["verdict"], "seed": str(document["seed"])}
    return _suite_element(name, cases, facts | document["versions"], robot["seconds"], document)


def _suite_element(
    name: str, cases: list[ET.Element], facts: dict[str, str], seconds: float, document: Document
) -> ET.Element:
    suite = ET.Element(
        "testsuite",
        {
            "name": name,
            "tests": str(len(cases)),
            "failures": str(sum(case.find("failure") is not None for case in cases)),
            "errors": str(sum(case.find("error") is not None for case in cases)),
            "skipped": "0",
            "time": _time(seconds),
            "timestamp": document["started"],
        },
    )
    properties = ET.SubElement(suite, "properties")
    for key, value in facts.items():
        ET.SubElement(properties, "property", {"name": key, "value": _clean(value)})
    suite.extend(cases)
    return suite


def _whole_run(document: Document) -> ET.Element:
    reason = outcome_of(document).reason or ""
    case = ET.Element("testcase", {"name": "every robot was compared in full", "classname": "urdfkin"})
    ET.SubElement(case, "error", {"type": "not passed", "message": reason}).text = reason
    return _suite_element("the whole run", [case], document["versions"], document["seconds"], document)


def _case(check: ReportedCheck, robot: ReportedRobot) -> ET.Element:
    case = ET.Element(
        "testcase", {"name": check_name(check), "classname": f"urdfkin.{_clean(robot['source'])}"}
    )
    text = _clean(_text(check, robot))
    if check["failed"]:
        message = (
            f"{check['failed']:,} of {check['results']:,} results outside their bound,"
            f" worst {format_units(check['worst'])} eps*scale"
        )
        ET.SubElement(case, "failure", {"type": "disagreement", "message": message}).text = text
    else:
        ET.SubElement(case, "system-out").text = text
    return case


def _verdict(robot: ReportedRobot) -> ET.Element:
    case = ET.Element("testcase", {"name": "verdict", "classname": f"urdfkin.{_clean(robot['source'])}"})
    reason = _clean(robot["reason"] or f"{robot['results']:,} results compared")
    text = f"{robot['verdict']}: {reason}" + (f"\n{_clean(error)}" if (error := robot.get("error")) else "")
    if robot["verdict"] == "verified":
        ET.SubElement(case, "system-out").text = text
    else:
        kind = "error" if robot["verdict"] == "bad input" else "failure"
        facts = {"type": robot["verdict"], "message": reason.splitlines()[0]}
        ET.SubElement(case, kind, facts).text = text
    return case


def _text(check: ReportedCheck, robot: ReportedRobot) -> str:
    case: Case | None = check["worst_case"]
    tightest, widest = check["bound"]
    lines = [
        f"{check_name(check)} of {robot['source']}",
        f"results compared: {check['results']:,}",
        f"outside their bound: {check['failed']:,}",
        f"disagreement in eps*scale: median {format_units(check['median'])},"
        f" 99th percentile {format_units(check['p99'])}, worst {format_units(check['worst'])}",
        f"largest disagreement relative to its bound: {format_ratio(check['bound_ratio'])}",
    ]
    if tightest is not None and widest is not None:
        lines.append(f"bounds: {tightest:.0f} to {widest:.0f} eps*scale")
    if "second_oracle" in check and (title := second_oracle_title([robot])) is not None:
        cells = zip(second_oracle_heads(title), second_oracle_cells([check], title), strict=True)
        lines += [f"{head}: {cell}" for head, cell in list(cells)[1:]]
    if case is not None:
        lines += [f"worst case: sample {case['sample']}, {case['frame']}", f"replay: {case['replay']}"]
    return "\n".join(lines)


def _time(seconds: float) -> str:
    return f"{seconds:.3f}"


def _clean(text: str) -> str:
    return _FORBIDDEN.sub(lambda found: f"\\x{ord(found[0]):02x}", text)
