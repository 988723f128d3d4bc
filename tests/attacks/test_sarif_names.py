"""SARIF names every file by a valid URI, whatever bytes its name is made of."""

import os
import re
from pathlib import Path
from urllib.parse import unquote_to_bytes, urlsplit

import pytest

from tests.cli.running import urdfkin

NAMES = [b"r\xff\xe9.urdf", b"a b:c%41?#\\[].urdf", "ä\u202e.urdf".encode(), b"a\nb.urdf"]

#: What RFC 3986 lets a path hold.
PATH = re.compile(r"(?:[A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-F]{2})+")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("absolute", [False, True])
def test_a_file_of_any_name_is_named_by_a_uri_that_gives_its_bytes_back(
    tmp_path: Path, name: bytes, absolute: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / os.fsdecode(name)
    place.write_bytes(b"<robot name='r'><link name='a'/><link name='a'/></robot>")
    given = os.fsencode(place) if absolute else name
    monkeypatch.chdir(tmp_path)
    done = urdfkin("check", "--format", "sarif", os.fsdecode(given))
    assert done.code == 1, done.err
    (result,) = done.data["runs"][0]["results"]
    uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    parts = urlsplit(uri)
    assert PATH.fullmatch(parts.path)
    assert (parts.scheme, parts.netloc) == ("file" if absolute else "", "")
    assert (parts.query, parts.fragment) == ("", "")
    assert unquote_to_bytes(parts.path) == given
