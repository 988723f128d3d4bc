"""SARIF names every file by a valid URI, whatever bytes its name is made of."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote_to_bytes, urlsplit

import pytest

NAMES = [b"r\xff\xe9.urdf", b"a b:c%41?#\\[].urdf", "ä\u202e.urdf".encode(), b"a\nb.urdf"]

#: What RFC 3986 lets a path hold.
PATH = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-F]{2})+")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("absolute", [False, True])
def test_a_file_of_any_name_is_named_by_a_uri_that_gives_its_bytes_back(
    tmp_path: Path, name: bytes, absolute: bool
) -> None:
    place = tmp_path / os.fsdecode(name)
    place.write_bytes(b"<robot name='r'><link name='a'/><link name='a'/></robot>")
    given = os.fsencode(place) if absolute else name
    done = subprocess.run(
        [sys.executable, "-m", "urdfkin", "check", "--format", "sarif", given],
        capture_output=True,
        check=False,
        cwd=tmp_path,
        env={"PYTHONPATH": str(Path(__file__).parents[2]), "PATH": ""},
    )
    assert done.returncode == 1, done.stderr
    (result,) = json.loads(done.stdout)["runs"][0]["results"]
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    parts = urlsplit(uri)
    assert PATH.fullmatch(parts.path)
    assert (parts.scheme, parts.netloc) == ("file" if absolute else "", "")
    assert (parts.query, parts.fragment) == ("", "")
    assert unquote_to_bytes(parts.path) == given
