"""`urdfkin check`: exit codes, formats, options."""

import os
import re
from pathlib import Path
from urllib.parse import unquote_to_bytes, urlsplit

import pytest

from tests.cli.running import good, refused, urdfkin

GOOD = '<robot name="r">\n  <link name="a"/>\n</robot>\n'
WARNED = '<robot name="">\n  <link name="a"/>\n</robot>\n'
BAD = '<robot name="r">\n  <link name="a"/>\n  <link name="a"/>\n</robot>\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("good", GOOD), ("warned", WARNED), ("bad", BAD)):
        (tmp_path / f"{name}.urdf").write_text(text)


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
    done = urdfkin("check", *line.split(), stdin=BAD)
    assert (done.code, done.err) == (code, "")
    assert words[1:] in done.text if words.startswith("*") else done.text.startswith(words)
    if "json" in line or "sarif" in line:
        assert done.data, "one document"


def test_an_error_exits_with_1_and_a_missing_file_or_an_unknown_code_with_2(folder: None) -> None:
    done = urdfkin("check good.urdf bad.urdf")
    assert done.code == 1
    lines = done.text.splitlines()
    assert lines[0].startswith("bad.urdf:3:9: URDF402 error: link 'a': another link has this name")
    assert lines[1:3] == ['  3 |   <link name="a"/>', "    |         ^^^^^^^^"]
    assert lines[3] == "1 error in 2 files"
    assert lines[4].startswith("run 'urdfkin explain URDF402'")
    done = urdfkin("check nowhere.urdf bad.urdf")
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
    tmp_path: Path, name: bytes, absolute: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / os.fsdecode(name)
    place.write_bytes(b"<robot name='r'><link name='a'/><link name='a'/></robot>")
    given = os.fsencode(place) if absolute else name
    monkeypatch.chdir(tmp_path)
    done = urdfkin("check --format sarif", os.fsdecode(given))
    assert done.code == 1, done.err
    (result,) = done.data["runs"][0]["results"]
    parts = urlsplit(result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"])
    assert PATH.fullmatch(parts.path)
    assert (parts.scheme, parts.netloc) == ("file" if absolute else "", "")
    assert (parts.query, parts.fragment) == ("", "")
    assert unquote_to_bytes(parts.path) == given
