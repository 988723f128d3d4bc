"""The page on threats names an existing test for each row."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "threats.md").read_text(encoding="utf-8")


def test_every_row_of_the_threats_page_names_an_existing_test() -> None:
    named = re.findall(r"`(tests/[^`]+\.py)`", PAGE)
    assert len(named) >= 10
    assert [name for name in named if not (ROOT / name).is_file()] == []
    scripts = re.findall(r"`python -m (scripts\.\w+)", PAGE)
    assert scripts
    assert [name for name in scripts if not (ROOT / f"{name.replace('.', '/')}.py").is_file()] == []
    rows = [row.split(" | ") for row in PAGE.splitlines() if row.startswith("| ")][1:]
    for row in rows:
        assert len(row) == 4, row
        assert row[2].strip(), row[0]
        assert "tests/" in row[3], row[0]
    assert "(docs/threats.md)" in (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert "SECURITY.md" in (ROOT / "README.md").read_text(encoding="utf-8")
