"""The example workflow for CI runs the steps that its page states; pages name existing files and tests."""

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[2]
yaml = pytest.importorskip("yaml")


def steps() -> list[dict[str, Any]]:
    workflow = yaml.safe_load((ROOT / "docs/examples/robots.yml").read_text("utf-8"))
    found: list[dict[str, Any]] = workflow["jobs"]["robots"]["steps"]
    return found


def index(words: str) -> int:
    (found,) = (i for i, step in enumerate(steps()) if words in str(step.get("run", step.get("uses"))))
    return found


def test_later_steps_run_after_a_failure_and_the_comparison_needs_only_two_files() -> None:
    later = steps()[index("urdfkin check --strict") + 1 :]
    assert len(later) >= 9
    for step in later:
        assert re.search(r"!cancelled\(\)|always\(\)", step["if"]), step
    condition = steps()[index("urdfkin report compare")]["if"]
    assert "hashFiles('main.json')" in condition
    assert "hashFiles('results.json')" in condition


@pytest.mark.slow
def test_the_cache_key_of_the_kernels_contains_every_dependency(tmp_path: Path) -> None:
    assert "steps.kernels.outputs.key" in steps()[index("actions/cache@")]["with"]["key"]
    told = steps()[index("pip freeze")]
    assert told["id"] == "kernels"
    assert "/proc/cpuinfo" in told["run"]
    assert index("pip install") < index("pip freeze") < index("actions/cache@") < index("urdfkin validate")
    command = steps()[index("pip freeze")]["run"]
    output = tmp_path / "output"
    environ = {**os.environ, "GITHUB_OUTPUT": str(output)}
    subprocess.run(["bash", "-euo", "pipefail", "-c", command], env=environ, check=True)
    assert re.fullmatch(r"key=[0-9a-f]{16}\n", output.read_text())


def test_no_page_names_a_tag_and_every_workflow_is_validated_against_a_schema() -> None:
    for page in ("docs/ci.md", ".pre-commit-hooks.yaml", "README.md"):
        assert not re.search(r"rev: v?\d", (ROOT / page).read_text("utf-8")), page
    files = {str(path.relative_to(ROOT)) for path in (ROOT / ".github/workflows").iterdir()}
    assert files <= WRITTEN.keys()


#: GitHub's schema of each file.
WRITTEN = {
    "action.yml": "github-actions",
    ".github/workflows/ci.yml": "github-workflows",
    ".github/workflows/release.yml": "github-workflows",
    ".github/workflows/site.yml": "github-workflows",
    "docs/examples/robots.yml": "github-workflows",
}


def schema_says(schema: str, file: Path) -> tuple[int, str]:
    checker = pytest.importorskip("check_jsonschema")
    done = CliRunner().invoke(checker.main, ["--builtin-schema", f"vendor.{schema}", str(file)])
    return done.exit_code, done.output


@pytest.mark.parametrize("file", WRITTEN)
def test_every_file_for_github_conforms_to_the_schema(file: str, tmp_path: Path) -> None:
    code, said = schema_says(WRITTEN[file], ROOT / file)
    assert code == 0, said
    broken = tmp_path / "broken.yml"
    broken.write_text(re.sub(r"(?m)^( *)(jobs|runs):", r"\1\2x:", (ROOT / file).read_text("utf-8")))
    assert schema_says(WRITTEN[file], broken)[0] == 1


def test_the_site_is_built_by_make_and_the_output_folder_is_published() -> None:
    jobs = yaml.safe_load((ROOT / ".github/workflows/site.yml").read_text("utf-8"))["jobs"]
    commands = [step["run"] for step in jobs["build"]["steps"] if "run" in step]
    assert commands == ['python -m pip install --quiet --editable ".[docs]"', "make site"]
    (upload,) = (step for step in jobs["build"]["steps"] if "upload-pages" in step.get("uses", ""))
    assert f"site_dir: {upload['with']['path']}\n" in (ROOT / "mkdocs.yml").read_text("utf-8")
    assert "permissions" not in jobs["build"]  # a pull request's code runs there
    assert jobs["publish"]["needs"] == "build"
    assert "pull_request" in jobs["publish"]["if"]


def test_every_row_of_the_threats_page_names_an_existing_test() -> None:
    page = (ROOT / "docs" / "threats.md").read_text(encoding="utf-8")
    tests = re.findall(r"`(tests/[^`]+\.py)`", page)
    scripts = [f"{name.replace('.', '/')}.py" for name in re.findall(r"`python -m (scripts\.\w+)", page)]
    assert len(tests) >= 10
    assert scripts
    assert [name for name in tests + scripts if not (ROOT / name).is_file()] == []
    for row in [row.split(" | ") for row in page.splitlines() if row.startswith("| ")][1:]:
        assert len(row) == 4, row
        assert row[2].strip(), row[0]
        assert "tests/" in row[3], row[0]
    assert "(docs/threats.md)" in (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert "SECURITY.md" in (ROOT / "README.md").read_text(encoding="utf-8")
