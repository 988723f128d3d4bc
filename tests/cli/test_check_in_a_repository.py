"""`urdfkin check`: formats and options; in a repository, folders, settings, baselines, changes, fixes."""

import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes, urlsplit

import pytest

from tests.cli.running import Done, good, refused, urdfkin
from tests.urdf.lint.cases import CASES
from tests.urdfs import chain
from urdfkin.urdf.lint import check as lint

LONG = """<robot name="r">
  <link name="a"/><link name="b"/>
  <joint name="j" type="continuous">
    <parent link="a"/><child link="b"/>
    <axis xyz="0 0 2"/>
  </joint>
</robot>
"""
GOOD = LONG.replace("0 0 2", "0 0 1")
BAD = '<robot name="r"><link name="a"/><link name="b"/></robot>\n'


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make an empty repository the current folder until the end of the test."""
    (tmp_path / ".git").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def put(name: str, text: str = LONG) -> Path:
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def check(*words: str) -> Done:
    return urdfkin("check", *words)


def found(*words: str) -> list[tuple[str, str]]:
    """Return (file, code) of each finding."""
    return [(f["file"], f["code"]) for f in check("--format", "json", *words).data["findings"]]


def settings(text: str) -> None:
    Path("pyproject.toml").write_text(f"[tool.urdfkin]\n{text}\n")


# -- exit codes and formats ----------------------------------------------------------------------------

TWICE = '<robot name="r">\n  <link name="a"/>\n  <link name="a"/>\n</robot>\n'


@pytest.fixture
def folder(here: Path) -> None:
    """Make a folder with a good file, a file with a warning, and a file with an error current."""
    put("good.urdf", GOOD)
    put("warned.urdf", '<robot name="">\n  <link name="a"/>\n</robot>\n')
    put("bad.urdf", TWICE)


#: For each line: the exit code, and the start of the output or, after a star, a text in the output
LINES = {
    "good.urdf": (0, "no findings in 1 file\n"), "warned.urdf": (0, "*URDF405"),
    "--strict warned.urdf": (1, "*URDF405 error"),
    "--ignore URDF402 bad.urdf": (0, "no findings in 1 file\n"), "-": (1, "<stdin>:"),
    "--format json bad.urdf good.urdf": (1, "*URDF402"), "--format sarif bad.urdf good.urdf": (1, "*URDF402"),
    "--format github good.urdf": (0, ""), "--max-bytes 10 good.urdf": (1, "*URDF108"),
}  # fmt: skip


@pytest.mark.parametrize("line", LINES)
def test_only_errors_exit_with_1_and_strict_turns_warnings_into_errors(line: str, folder: None) -> None:
    code, words = LINES[line]
    done = urdfkin(f"check {line}", stdin=TWICE)
    assert (done.code, done.err) == (code, "")
    assert words[1:] in done.text if words.startswith("*") else done.text.startswith(words)
    if "json" in line or "sarif" in line:
        assert done.data, "one document"


def test_an_error_exits_with_1_and_a_missing_file_or_an_unknown_code_with_2(folder: None) -> None:
    done = check("good.urdf", "bad.urdf")
    assert done.code == 1
    lines = done.text.splitlines()
    assert lines[0].startswith("bad.urdf:3:9: URDF402 error: link 'a': another link has this name")
    assert lines[1:3] == ['  3 |   <link name="a"/>', "    |         ^^^^^^^^"]
    assert lines[3] == "1 error in 2 files"
    assert lines[4].startswith("run 'urdfkin explain URDF402'")
    done = check("nowhere.urdf", "bad.urdf")
    assert done.code == 2
    assert "URDF402" in done.text
    assert done.err == "urdfkin: error: nowhere.urdf: no such file; did you mean warned.urdf?\n"
    assert "did you mean URDF402" in refused("check --ignore URDF4022 bad.urdf")


def test_explain_prints_a_page_and_lists_all_codes() -> None:
    assert good("explain urdf502").text.startswith("URDF502 axis-without-direction (error)")
    assert urdfkin("explain").text.count("\n") > 60
    assert urdfkin("explain URDF999").code == 2


NAMES = [b"r\xff\xe9.urdf", b"a b:c%41?#\\[].urdf", "ä\u202e.urdf".encode(), b"a\nb.urdf"]

#: A path according to RFC 3986
PATH = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-F]{2})+")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("absolute", [False, True])
def test_a_sarif_uri_decodes_to_the_exact_bytes_of_the_file_name(
    here: Path, name: bytes, absolute: bool
) -> None:
    place = here / os.fsdecode(name)
    place.write_text(TWICE)
    given = os.fsencode(place) if absolute else name
    done = urdfkin("check --format sarif", os.fsdecode(given))
    assert done.code == 1, done.err
    (result,) = done.data["runs"][0]["results"]
    parts = urlsplit(result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"])
    assert PATH.fullmatch(parts.path)
    assert (parts.scheme, parts.netloc) == ("file" if absolute else "", "")
    assert (parts.query, parts.fragment) == ("", "")
    assert unquote_to_bytes(parts.path) == given


# -- files ---------------------------------------------------------------------------------------------


def test_a_folder_means_all_contained_urdfs_except_hidden_copied_and_excluded_files(here: Path) -> None:
    put("build/COLCON_IGNORE", "")
    others = ".venv/x.urdf", "build/arm.urdf", "old/arm.urdf", "hands/x.xml"
    for name in ("arm.urdf", "hands/left.urdf", *others):
        put(name)
    expected = [("arm.urdf", "URDF503"), ("hands/left.urdf", "URDF503")]
    assert found("--exclude", "old") == found(".", "--exclude", "old/*") == expected
    assert found("hands", str(here / "arm.urdf"), "hands/left.urdf") == [
        ("hands/left.urdf", "URDF503"), (str(here / "arm.urdf"), "URDF503"),
    ]  # fmt: skip


def test_patterns_and_files_named_like_a_robot_or_an_option_are_found(here: Path) -> None:
    for name in ("a/one.urdf", "a/b/two.urdf", "a/three.txt"):
        put(name)
    assert found("a/**/*.urdf") == [("a/b/two.urdf", "URDF503"), ("a/one.urdf", "URDF503")]
    assert found("a/o?e.urdf") == [("a/one.urdf", "URDF503")]
    for name in ("[odd].urdf", "panda.urdf", "-x.urdf"):
        put(name)
    assert found("[odd].urdf") == [("[odd].urdf", "URDF503")]
    names = "-x.urdf", "[odd].urdf", "a/b/two.urdf", "a/one.urdf", "panda.urdf"
    assert found() == [(name, "URDF503") for name in names]


@pytest.mark.parametrize("word", ["empty", "nowhere/*.urdf", "."])
def test_a_folder_or_pattern_without_a_urdf_is_an_error_not_a_success(here: Path, word: str) -> None:
    (here / "empty").mkdir()
    done = check(word)
    assert (done.code, done.err.startswith(f"urdfkin: error: {word}: no URDF found")) == (2, True)


# -- output --------------------------------------------------------------------------------------------


def test_carets_mark_the_finding_and_a_long_line_is_shown_in_part(here: Path) -> None:
    put("arm.urdf", LONG.replace("    <axis", "\t<!-- \u6c49 --><axis"))
    lines = check("arm.urdf").text.splitlines()
    assert lines[0].startswith("arm.urdf:5:18: URDF503 [*] warning: joint 'j': the axis has length 2")
    assert lines[1] == '  5 |     <!-- \u6c49 --><axis xyz="0 0 2"/>'
    assert lines[2] == "    | " + " " * (4 + len("<!-- ") + 2 + len(" --><axis ")) + "^" * len('xyz="0 0 2"')
    assert lines[3:] == ["1 warning in 1 file", "[*] --fix fixes these findings; --diff prints the changes"]
    assert check("arm.urdf", "--format", "concise").text.splitlines() == [lines[0], *lines[3:]]
    put("arm.urdf", " ".join(LONG.replace("<joint", f"<!-- {'x' * 5000} --><joint").split()))
    _, line, caret, *_ = check("arm.urdf").text.splitlines()
    assert len(line) < 120
    assert line[caret.index("^") : caret.rindex("^") + 1] == 'xyz="0 0 2"'


def test_codes_are_selected_and_ignored_by_code_name_and_family(here: Path) -> None:
    put("arm.urdf", LONG.replace("<axis", '<axis shade="3"'))
    assert [code for _, code in found()] == ["URDF208", "URDF503"]
    for words in ("--select URDF5", "--select axis-not-unit", "--ignore 2", "--ignore URDF208"):
        assert [code for _, code in found(*words.split())] == ["URDF503"]
    assert found("--select", "URDF5,URDF2", "--ignore", "ALL") == []
    assert "did you mean URDF523, URDF513, URDF503" in check("--select", "URDF5O3").err


def test_statistics_are_counted_by_code_and_sorted_by_number(here: Path) -> None:
    for k in range(3):
        put(f"{k}.urdf")
    put("bad.urdf", BAD)
    done = check("--statistics")
    assert done.code == 1
    assert [line.split()[:3] for line in done.text.splitlines()] == [
        ["3", "URDF503", "warning"], ["1", "URDF411", "error"], ["1", "error,", "3"],
    ]  # fmt: skip
    assert "--statistics does nothing with --format json" in check("--statistics", "--format", "json").err


def test_statistics_mark_the_codes_that_fix_corrects_without_another_option(here: Path) -> None:
    turned = (
        '<joint name="r" type="fixed"><parent link="b"/><child link="c"/><origin rpy="1.5708 0 0"/></joint>'
    )
    put("arm.urdf", LONG.replace("</robot>", f'<link name="c"/>{turned}</robot>'))
    lines = check("--statistics").text.splitlines()
    assert {line.split()[1]: "[*]" in line for line in lines[:-1]} == {"URDF503": True, "URDF601": False}


# -- comments ------------------------------------------------------------------------------------------


def test_a_comment_silences_a_finding_and_json_contains_the_reason(here: Path) -> None:
    comment = "<!-- urdfkin: ignore[URDF503] the drawing gives two points -->"
    put("arm.urdf", LONG.replace("    <axis", f"    {comment}\n    <axis"))
    done = check("--strict", "arm.urdf")
    assert (done.code, done.text) == (0, "no findings in 1 file (silenced by comments: 1)\n")
    data = check("--format", "json", "arm.urdf").data
    assert data["findings"] == []
    (silenced,) = data["silenced"]
    assert (silenced["code"], silenced["reason"]) == ("URDF503", "the drawing gives two points")
    (result,) = check("--format", "sarif", "arm.urdf").data["runs"][0]["results"]
    assert result["suppressions"] == [{"kind": "inSource", "justification": "the drawing gives two points"}]


# -- settings ------------------------------------------------------------------------------------------


def test_settings_are_read_from_a_parent_folder_and_options_override_settings(here: Path) -> None:
    put("robots/arm.urdf")
    put("robots/old/arm.urdf", BAD)
    settings('strict = true\nexclude = ["robots/old"]\nselect = ["URDF5"]')
    os.chdir("robots")
    assert found() == [("arm.urdf", "URDF503")]
    assert check().code == 1
    assert check("--select", "URDF2").code == check("--no-strict").code == 0
    assert check("--isolated", "arm.urdf").code == 0
    put("other.toml", "[tool.urdfkin]\nignore = ['503']\n")
    assert check("--config", "other.toml", "arm.urdf").code == 0


def test_codes_are_ignored_per_file_and_only_by_settings_of_the_same_repository(here: Path) -> None:
    for name in ("legacy/arm.urdf", "arm.urdf", "inner/arm.urdf"):
        put(name)
    (here / "inner/.git").mkdir(parents=True)
    settings('per-file-ignores = { "legacy/*" = ["URDF5"] }')
    assert found() == [("arm.urdf", "URDF503"), ("inner/arm.urdf", "URDF503")]
    settings('ignore = ["URDF503"]')
    os.chdir("inner")  # inside another repository
    assert found() == [("arm.urdf", "URDF503")]
    Path("pyproject.toml").write_text("[tool.other]\nignor = 1\n")
    assert found() == [("arm.urdf", "URDF503")]
    assert "no table [tool.urdfkin]" in check("--config", "pyproject.toml").err


WRONG = {
    "ignor = []": "[tool.urdfkin]: unknown setting 'ignor'; did you mean ignore?",
    "strict = 1": "[tool.urdfkin]: strict must be true or false: found 1",
    "ignore = 'URDF503'": "[tool.urdfkin]: ignore must be a list of strings: found 'URDF503'",
    "ignore = ['URDF5O3']": "[tool.urdfkin]: ignore: unknown code 'URDF5O3'; did you mean",
    "per-file-ignores = { x = 'URDF503' }": "per-file-ignores must be a table of lists of strings",
    "baseline = 'no.json'": "no.json: the baseline file does not exist; ",
    "ignore = [": "pyproject.toml: this file is not TOML: found ",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_setting_is_reported_with_its_place(here: Path, text: str) -> None:
    put("arm.urdf", GOOD)
    settings(text)
    assert WRONG[text] in refused("check")
    assert check("--isolated").code == 0


# -- baselines -----------------------------------------------------------------------------------------


def test_findings_in_a_baseline_do_not_fail_the_check_and_new_findings_do(here: Path) -> None:
    arm = put("robots/arm.urdf")
    put("robots/two.urdf", BAD)
    done = check("--strict", "--write-baseline", "known.json")
    assert (done.code, done.text, done.err) == (0, "", "wrote known.json: 2 findings in the baseline\n")
    done = check("--strict", "--baseline", "known.json")
    assert (done.code, done.text) == (0, "no findings in 2 files (already known: 2)\n")
    arm.write_text("\n\n" + LONG.replace("<axis", '<axis  shade="3"'))  # still known on another line
    assert found("--baseline", "known.json") == [("robots/arm.urdf", "URDF208")]
    arm.write_text(LONG.replace("0 0 2", "0 0 3"))  # a finding of a changed element is new
    assert found("--baseline", "known.json") == [("robots/arm.urdf", "URDF503")]
    arm.write_text(GOOD)
    known = "already known: 1, listed in the baseline but no longer found: 1; write the baseline again"
    assert f"({known})" in check("--baseline", "known.json").text


def test_a_file_with_two_spellings_is_checked_once(here: Path) -> None:
    put("robots/arm.urdf")
    spellings = "robots", "robots/arm.urdf", "robots/../robots/arm.urdf", str(here / "robots/arm.urdf")
    assert found(*spellings) == found(*spellings, "./robots//arm.urdf") == [("robots/arm.urdf", "URDF503")]
    assert "known.json: 1 finding in" in check(*spellings, "--write-baseline", "known.json").err
    assert check(*spellings, "--diff").text.count("@@ ") == 1


def test_a_second_finding_of_a_known_kind_is_new_and_a_setting_selects_the_baseline(here: Path) -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><a/>{}</joint>'
    text = f'<robot name="r"><link name="a"/><link name="b"/>{joint}</robot>'
    put("arm.urdf", text.format(""))
    check("--write-baseline", "known.json")
    put("arm.urdf", text.format("<a/>"))
    assert found("--baseline", "known.json") == [("arm.urdf", "URDF207")]
    put("robots/arm.urdf")
    check("--write-baseline", "known.json")
    settings('baseline = "known.json"')
    os.chdir("robots")
    assert found() == found(str(here)) == []


def test_a_baseline_written_for_some_files_keeps_the_findings_of_other_files(here: Path) -> None:
    one, two = put("one.urdf"), put("two.urdf")
    check("--write-baseline", "known.json")
    one.write_text(GOOD)
    check("--write-baseline", "known.json", "one.urdf")
    assert found("--baseline", "known.json") == []
    two.unlink()
    check("--write-baseline", "known.json", "one.urdf")
    assert json.loads(Path("known.json").read_text())["findings"] == []


_INFINITE_COUNT = (
    '{"schema": "urdfkin-baseline", "version": 1, "findings": [{"file": "arm.urdf", "code": "URDF503",'
    ' "severity": "warning", "element": "", "name": "", "found": "", "count": 1e400}]}'
)


@pytest.mark.parametrize(
    "text", ["", "[]", "{", '{"schema": "urdfkin-baseline", "version": 2}', "[" * 100_000, _INFINITE_COUNT]
)
def test_an_invalid_baseline_is_refused(here: Path, text: str) -> None:
    put("arm.urdf")
    put("known.json", text)
    for option in ("--baseline", "--write-baseline"):
        done = check(option, "known.json")
        assert (done.code, "not a baseline of urdfkin" in done.err) == (2, True)
    assert Path("known.json").read_text() == text


# -- changes since a version ---------------------------------------------------------------------------


def git(*words: str) -> None:
    who = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    environ = os.environ | {"GIT_CONFIG_GLOBAL": "/dev/null", "GIT_CONFIG_SYSTEM": "/dev/null"}
    subprocess.run(["git", *who, *words], check=True, capture_output=True, env=environ)


def commit() -> None:
    git("add", ".")
    git("commit", "-qm", "a change")


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a repository with two robots on the branch `main`, and a new branch `work`."""
    monkeypatch.chdir(tmp_path)
    git("init", "-q", "-b", "main")
    put("arm.urdf")
    put("hand.urdf", LONG.replace('"r"', '"hand"'))
    commit()
    git("checkout", "-qb", "work")
    return tmp_path


def test_only_findings_that_are_new_since_a_branch_are_reported(repository: Path) -> None:
    done = check("--strict", "--changed-since", "main")
    assert (done.code, done.text) == (0, "no findings in 0 files (unchanged files: 2)\n")
    put("arm.urdf", "\n" + LONG.replace("<axis", '<axis  shade="3"'))
    put("new.urdf", LONG.replace('"r"', '"new"'))
    Path("hand.urdf").rename("left.urdf")
    new = [("arm.urdf", "URDF208"), ("new.urdf", "URDF503")]
    assert found("--changed-since", "main") == new
    commit()
    assert found("--changed-since", "main") == new
    # A later commit on main changes nothing.
    git("checkout", "-q", "main")
    put("arm.urdf", GOOD)
    git("commit", "-qam", "mended on main")
    git("checkout", "-q", "work")
    assert found("--changed-since", "main") == new


def test_changes_are_found_from_a_subfolder_and_for_a_file_outside_the_repository(
    repository: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    (repository / "below").mkdir()
    os.chdir("below")
    other = tmp_path_factory.mktemp("other") / "arm.urdf"
    other.write_text(LONG.replace('"r"', '"other"'))
    assert found("--changed-since", "main", "../arm.urdf", str(other)) == [(str(other), "URDF503")]


def test_a_deleted_mesh_is_reported_in_an_unchanged_file(repository: Path) -> None:
    mesh = put("meshes/arm.stl", "")
    shape = '<link name="a"><visual><geometry><mesh filename="meshes/arm.stl"/></geometry></visual></link>'
    put("shaped.urdf", LONG.replace('<link name="a"/>', shape))
    commit()
    assert found("--changed-since", "HEAD") == []
    mesh.unlink()
    assert found("--changed-since", "HEAD") == [("shaped.urdf", "URDF706")]


STAGE = """#usda 1.0
(
    subLayers = [@./parts.usda@]
)
def PhysicsRevoluteJoint "j" {
    rel physics:body0 = </a>
    rel physics:body1 = </b>
}
"""
PARTS = """#usda 1.0
def Xform "a" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {
}
def Xform "b" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {
}
"""
MJCF = """<mujoco><worldbody><body name="a"><joint name="j"/><geom size="1"/><include file="part.xml"/></body>
</worldbody><tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon></mujoco>"""
SITE = '<mujocoinclude><site name="tip"/></mujocoinclude>'


#: File, text, included file, text of the included file before and after the change, and findings
IN_PARTS = {
    "usd": ("arm.usda", STAGE, "parts.usda", PARTS, PARTS + "\n", ["USD301", "USD302"]),
    "mjcf": ("arm.xml", MJCF, "part.xml", SITE, SITE + "\n", ["MJCF101", "MJCF102"]),
}


@pytest.mark.slow
@pytest.mark.parametrize("form", IN_PARTS)
def test_all_findings_of_a_usd_or_mjcf_file_are_reported_if_a_part_changed(
    repository: Path, form: str
) -> None:
    pytest.importorskip("pxr" if form == "usd" else "mujoco")
    file, text, part, before, after, expected = IN_PARTS[form]
    put(file, text)
    put(part, before)

    def told() -> list[str]:
        return [code for _, code in found("--changed-since", "HEAD", file)]

    assert told() == expected
    commit()
    assert told() == []
    assert "(unchanged files: 1)" in check("--changed-since", "HEAD", file).text
    put(part, after)
    assert told() == expected
    git("checkout", "-q", part)
    assert told() == []
    put(file, text + "\n")
    assert told() == expected


@pytest.mark.slow
def test_all_findings_of_a_xacro_file_are_reported_if_a_possible_include_changed(repository: Path) -> None:
    pytest.importorskip("xacrodoc")
    robot = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    macro = robot + '<xacro:property name="l" value="{}"/></robot>'
    include = robot + '<xacro:include filename="part.xacro"/>'
    put("part.xacro", macro.format(2))
    put("whole.urdf.xacro", LONG.replace('<robot name="r">', include).replace("0 0 2", "0 0 ${l}"))
    settings('include = ["*.urdf.xacro"]')
    commit()
    assert found("--changed-since", "HEAD") == []
    put("part.xacro", macro.format(3))
    assert found("--changed-since", "HEAD") == [("whole.urdf.xacro (expanded)", "URDF503")]
    before = Path("whole.urdf.xacro").read_text()
    assert "URDF503" in check("--fix", "--changed-since", "HEAD").text
    assert Path("whole.urdf.xacro").read_text() == before


@pytest.mark.slow
def test_all_findings_of_a_new_xacro_file_are_reported(repository: Path) -> None:
    pytest.importorskip("xacrodoc")
    settings('include = ["*.urdf.xacro"]')
    commit()
    put("new.urdf.xacro", LONG + "<!-- a new file -->")
    assert found("--changed-since", "HEAD") == [("new.urdf.xacro (expanded)", "URDF503")]
    commit()
    assert found("--changed-since", "HEAD") == []


@pytest.mark.parametrize("version", ["nowhere", "--help", "HEAD:arm.urdf", ""])
def test_an_unknown_git_version_is_an_error_with_a_remedy(repository: Path, version: str) -> None:
    err = refused("check", f"--changed-since={version}")
    assert "git finds no branch, tag or commit with this name; correct the name, or fetch" in err
    assert "fetch-depth: 0" in err


def test_a_commit_without_common_history_is_an_error_with_a_remedy(repository: Path) -> None:
    git("checkout", "-q", "--orphan", "other")
    put("other.urdf")
    commit()
    git("checkout", "-q", "work")
    err = refused("check", "--changed-since=other")
    assert "other: git finds no common ancestor of this commit and HEAD" in err
    assert "fetch the history of both commits first" in err


def test_without_a_repository_or_without_git_the_error_states_this(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    put("arm.urdf")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert "not a git repository" in refused("check --changed-since main")
    monkeypatch.setenv("PATH", "")
    assert "git is not installed" in check("--changed-since", "main").err


def test_git_runs_no_program_from_the_settings_of_an_untrusted_repository(repository: Path) -> None:
    mark = repository / "RUN"
    for setting in ("core.fsmonitor", "diff.external", "filter.x.clean", "core.pager", "core.sshCommand"):
        git("config", setting, f"touch {mark}; cat")
    Path(".gitattributes").write_text("*.urdf filter=x diff=x\n")
    put("arm.urdf", LONG.replace("0 0 2", "0 0 3"))
    assert found("--changed-since", "main") == [("arm.urdf", "URDF503")]
    assert not mark.exists()


# -- fixes ---------------------------------------------------------------------------------------------


def test_fix_corrects_files_and_reports_the_remaining_findings(here: Path) -> None:
    arm = put("arm.urdf", LONG.replace("<parent", '<parent frame="x"'))
    arm.chmod(0o640)
    done = check("--fix")
    assert (done.code, done.text) == (0, "no findings in 1 file\n")
    assert done.err.splitlines() == [
        "arm.urdf: fixed URDF208 unknown-attribute, line 4; the robot is unchanged",
        "arm.urdf: fixed URDF503 axis-not-unit, line 5; the robot is unchanged",
    ]
    assert arm.read_text() == GOOD
    assert arm.stat().st_mode & 0o777 == 0o640
    before = arm.stat().st_mtime_ns, arm.stat().st_ino
    assert check("--fix").err == ""
    assert (arm.stat().st_mtime_ns, arm.stat().st_ino) == before


def test_the_hint_about_fixes_states_that_a_file_with_an_error_is_not_changed(here: Path) -> None:
    hint = "[*] --fix fixes these findings; "
    put("arm.urdf")
    assert f"{hint}--diff prints the changes" in check("--strict").text
    put("arm.urdf", LONG.replace('link="b"', 'link="c"'))
    assert f"{hint}correct the errors of a file first" in check().text


def test_no_fix_is_offered_for_a_text_that_fix_cannot_write(here: Path) -> None:
    pytest.importorskip("xacrodoc")
    put("arm.xacro")
    for done in (check("kinova"), check("arm.xacro"), urdfkin("check", "-", stdin=LONG)):
        assert "warning" in done.text
        assert "[*]" not in done.text
        assert "fixes" not in done.text
    assert "[*]" not in check("--statistics", "kinova").text


def test_only_reported_findings_are_fixed(here: Path) -> None:
    text = LONG.replace("<parent", '<parent frame="x"')
    mended = text.replace("0 0 2", "0 0 1")
    arm = put("arm.urdf", text)
    check("--select", "URDF503", "--fix")
    assert arm.read_text() == mended
    check("--write-baseline", "known.json")
    check("--baseline", "known.json", "--fix")
    assert arm.read_text() == mended
    silenced = mended.replace("<parent", "<!-- urdfkin: ignore[208] wanted --><parent")
    arm.write_text(silenced)
    check("--fix")
    assert arm.read_text() == silenced


def test_diff_prints_a_patch_with_the_changes_of_fix(here: Path) -> None:
    arm = put("arm.urdf", LONG.replace("    <axis", "\t<axis"))
    done = check("--diff")
    assert (done.code, done.err) == (1, "1 finding to fix in 1 file\n")
    assert arm.read_text() == LONG.replace("    <axis", "\t<axis")
    apply(done.out)
    assert arm.read_text() == GOOD.replace("    <axis", "\t<axis")
    done = check("--diff")
    assert (done.code, done.out) == (0, b"")


def test_a_baseline_contains_all_findings_so_changed_since_is_refused(here: Path) -> None:
    put("arm.urdf")
    done = check("--changed-since", "HEAD", "--write-baseline", "known.json")
    assert (done.code, Path("known.json").exists()) == (2, False)
    assert "--changed-since does nothing with --write-baseline" in done.err


@pytest.mark.parametrize("words", [["--fix"], ["--format", "json"], ["--statistics"], ["--each"]])
def test_diff_refuses_an_option_that_it_does_not_use(here: Path, words: list[str]) -> None:
    put("arm.urdf")
    done = check("--diff", *words)
    assert (done.code, done.out) == (2, b"")
    assert f"{words[0]} does nothing with --diff" in done.err


ODD_LINES = {
    "line feeds": LONG,
    "carriage returns": LONG.replace("\n", "\r\n"),
    "one carriage return": LONG.replace("\n", "\r\n", 1),
    "a lone carriage return": LONG.replace("    <axis", "   \r <axis"),
    "no final line feed": LONG.removesuffix("\n"),
    "no final line feed, a fix on the last line": LONG.replace("\n", " ").strip(),
    "a bidi mark nearby": LONG.replace('"b"', '"b\u202e"'),
    "an escape for a CI service": LONG.replace("  </joint>", "  </joint>\n::error::x\n##[group]"),
    "a form feed and a line separator": LONG.replace("<axis", "<!--\u2028 \x85--><axis"),
    "a byte order mark": "\ufeff" + LONG,
    "umlauts": LONG.replace('"r"', '"r\xe4"'),
    "carriage returns, no final one": LONG.replace("\n", "\r\n").replace('"b"', '"b\u202e"').rstrip(),
}


def apply(patch: bytes) -> None:
    command = ["git", "apply", "--whitespace=nowarn"]
    subprocess.run(command, input=patch, check=True, capture_output=True)


@pytest.mark.parametrize("name", ["arm.urdf", "an arm.urdf", "\xe4rm.urdf", 'ar"m.urdf', "below/arm.urdf"])
@pytest.mark.parametrize("lines", ODD_LINES)
def test_git_applies_the_patch_of_diff_with_the_result_of_fix(here: Path, lines: str, name: str) -> None:
    arm, odd = put(name), ODD_LINES[lines].encode()
    arm.write_bytes(odd)
    done = check("--diff", str(arm) if name != "arm.urdf" else str(arm.resolve()))
    assert done.code == 1, done.text
    assert "\u202e" not in done.text
    assert not re.search(r"^\s*::|##\[", done.text, re.MULTILINE)
    git("init", "-q")
    apply(done.out)
    patched = arm.read_bytes()
    arm.write_bytes(odd)
    check("--fix", str(arm))
    assert patched == arm.read_bytes() != odd


@pytest.mark.parametrize("lines", ["line feeds", "a bidi mark nearby"])
def test_a_patch_printed_in_a_subfolder_is_applied_in_the_subfolder(here: Path, lines: str) -> None:
    git("init", "-q")
    arm = put("robots/arm.urdf")
    arm.write_bytes(ODD_LINES[lines].encode())
    os.chdir("robots")
    apply(check("--diff", arm.name).out)
    assert b"0 0 1" in Path(arm.name).read_bytes()


def test_fixes_that_rotate_a_joint_need_unsafe_fixes(here: Path) -> None:
    text = LONG.replace("<axis", '<origin rpy="1.5708 0 0"/><axis')
    arm = put("arm.urdf", text)
    hint = "--unsafe-fixes also fixes 1 finding, but rotates joints by more than a rounding error"
    assert hint in check().text
    assert check("--diff").err == "1 finding to fix in 1 file (1 more with --unsafe-fixes)\n"
    put("arm.urdf", text.replace("</robot>", '<joint name="loose"/></robot>'))
    assert check("--diff").err.endswith("0 findings to fix in 1 file\n"), "an error prevents all fixes"
    put("arm.urdf", text)
    check("--fix")
    assert arm.read_text() == text.replace("0 0 2", "0 0 1")
    assert "--unsafe-fixes does nothing without --fix and --diff" in check("--unsafe-fixes").err
    assert "1.5707963267948966" in check("--diff", "--unsafe-fixes").text
    line = "line 5; each joint rotated by at most 3.7e-06 rad"
    assert f"arm.urdf: fixed URDF601 rounded-pi, {line}\n" in check("--fix", "--unsafe-fixes").err
    assert 'rpy="1.5707963267948966 0 0"' in arm.read_text()


def test_github_output_has_errors_first_and_one_line_for_many_findings_of_a_kind(here: Path) -> None:
    text = chain([""] * 30, origin="", axis="0 0 2").replace("</robot>", '<link name="stray"/></robot>')
    put("arm.urdf", text.replace("<joint", "\n<joint"))
    text = check("--format", "github").text
    words = [line.split(" ")[0] for line in text.splitlines()]
    assert words == sorted(words, key=["::error", "::warning", "::notice"].index)
    assert text.count("=URDF503::") == 1
    assert check("--format", "github", "--each").text.count("=URDF503::") == 30


@pytest.mark.parametrize("style", ["terminal", "concise", "json", "sarif", "github"])
def test_findings_are_written_to_a_file(here: Path, style: str) -> None:
    put("arm.urdf")
    printed = check("--format", style)
    done = check("--format", style, "-o", "found.txt")
    assert (done.code, done.out) == (printed.code, b"")
    assert Path("found.txt").read_bytes() == printed.out
    patch = check("--diff")
    assert check("--diff", "-o", "fix.patch").out == b""
    assert Path("fix.patch").read_bytes() == patch.out


def test_standard_input_and_a_robot_of_the_catalogue_are_not_fixed(here: Path) -> None:
    done = urdfkin("check --fix -", stdin=LONG)
    assert (done.code, "URDF503" in done.text) == (0, True)
    assert check("--fix", "ur5", "--select", "URDF601").code == 0


@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["no mark", "byte order mark"])
def test_sarif_contains_the_edits_of_fix_and_counts_a_byte_order_mark(here: Path, mark: str) -> None:
    put("arm.urdf", mark + LONG)
    results = check("--format", "sarif", "--select", "URDF503").data["runs"][0]["results"]
    (change,) = results[0]["fixes"][0]["artifactChanges"]
    (edit,) = change["replacements"]
    region: Any = edit["deletedRegion"]
    cut = Path("arm.urdf").read_bytes()[region["byteOffset"] :][: region["byteLength"]]
    assert (cut, edit["insertedContent"]["text"]) == (b"0 0 2", "0 0 1")


# -- the page ------------------------------------------------------------------------------------------

PAGE = (Path(__file__).parents[2] / "docs" / "check.md").read_text("utf-8")


def test_the_page_shows_the_real_output_and_lists_the_fixable_codes(here: Path) -> None:
    put("arm.urdf")
    (shown,) = re.findall(r"```console\n\$ urdfkin check arm.urdf\n(.*?)```", PAGE, re.DOTALL)
    assert check("arm.urdf").text == shown
    (table,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    put("pyproject.toml", table)
    (comment,) = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
    put("arm.urdf", LONG.replace('    <axis xyz="0 0 2"/>\n', comment))
    put("urdfkin-baseline.json", '{"schema": "urdfkin-baseline", "version": 1, "findings": []}')
    done = check()
    assert (done.code, done.text) == (0, "no findings in 1 file (silenced by comments: 1)\n")
    rows = set(re.findall(r"^\| (URDF\d+) \|", PAGE, re.MULTILINE))
    cured = {f.code for case in CASES for f in lint(case.data) if f.fix}
    assert rows == cured
