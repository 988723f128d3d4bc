"""Every command, name, link, number and answer of the pages is correct."""

import pkgutil
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import urdfkin
from scripts import check_exports, make_pages, measure_size
from scripts.benchmarking.operations import count_operations
from scripts.pages import insert_parts
from tests import urdfs
from tests.cli.running import urdfkin as run
from tests.pages import pages
from tests.reading import present
from urdfkin.cli import cli
from urdfkin.verify.quantities import QUANTITIES, format_unvalidated_titles, format_validated_titles

ROOT = Path(__file__).parents[1]
DOCS = [f"docs/{page}" for page in pages()]
PAGES = [*DOCS, "docs/examples/robots.yml", "README.md"]


def test_the_layout_on_the_page_is_generated_from_the_schema() -> None:
    page = make_pages.page_path("reports").read_text("utf-8")
    assert page == make_pages.make_page("reports"), "run python scripts/make_pages.py reports"


def commands() -> list[tuple[str, str]]:
    """Return every line that calls urdfkin, in shell blocks and in the steps of the workflow."""
    found = []
    for page in PAGES:
        text = (ROOT / page).read_text("utf-8")
        shown = re.findall(r"```(?:sh|console)\n(.*?)```", text, re.DOTALL)
        for block in shown if page.endswith(".md") else [text]:
            joined = re.sub(r">\n\s+(urdfkin [^\n]*)\n\s+--", r"\1 --", block)
            lines = re.findall(r"(?:\$ |run: |^\s*)(urdfkin \w[^#\n]*)", joined, re.M)
            found += [(page, words) for words in lines]
    return found


@pytest.mark.parametrize(("page", "line"), commands())
def test_every_command_on_the_pages_can_be_parsed(page: str, line: str) -> None:
    words = shlex.split(line.split(" || ", maxsplit=1)[0].split(" > ", maxsplit=1)[0])[1:]
    group = cli.make_context("urdfkin", ["--help"], resilient_parsing=True)
    command = cli.get_command(group, words[0])
    assert command is not None, (page, line)
    command.make_context(words[0], words[1:], parent=group)  # raises the command's error


def test_the_pages_contain_commands() -> None:
    assert len({page for page, _ in commands()}) >= 12
    assert len(commands()) >= 40


@pytest.mark.parametrize("page", [*DOCS, "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"])
def test_links_point_to_existing_files_and_headings(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", text) + re.findall(r'src="([^"]+)"', text):
        if target.startswith("https://"):
            continue
        file, _, anchor = target.partition("#")
        there = (ROOT / page).parent / file if file else ROOT / page
        assert there.exists(), target
        heads = re.findall(r"^#+ (.*)", there.read_text(), re.M) if anchor else []
        anchors = [re.sub(r"[^a-z0-9 -]", "", head.lower()).replace(" ", "-") for head in heads]
        assert not anchor or (there.suffix == ".md" and anchor in anchors), target


def test_every_script_that_writes_a_page_is_run_by_make_docs() -> None:
    target = re.findall(r"^docs:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text("utf-8"), re.M)[0]
    run_by_make = set(re.findall(r"python scripts/(\w+)\.py", target))
    texts = {path.stem: path.read_text("utf-8") for path in (ROOT / "scripts").glob("*.py")}
    writers = {name for name, text in texts.items() if re.search(r"PAGE\.write_text|update_page\(PAGE", text)}
    makers = {path.stem for path in (ROOT / "scripts").glob("make_*.py")}
    assert run_by_make == writers | makers - {"make_pictures"}  # screenshots need a browser


@pytest.mark.slow
def test_the_sizes_of_exported_code_are_those_on_the_page() -> None:
    text = check_exports.PAGE.read_text("utf-8")
    assert check_exports.make_page(text) == text, "run python scripts/check_exports.py --sizes"


@pytest.mark.slow
def test_the_size_of_an_installation_is_written_by_its_script() -> None:
    text = measure_size.PAGE.read_text("utf-8")
    (checking,) = re.findall(r"needs only urdfkin and click, together (\d+) MB\.", text)
    assert (
        abs(
            int(checking)
            - (measure_size.measure_wheel() + measure_size.measure_packages("click")["click"]) / 1e6
        )
        < 1.0
    )
    core = {"example-robot-data": 10**9, "click": 10**6, "trimesh": 10**9}
    written = measure_size.make_section(core, {"click": 10**6}, {"view": (8, 40_000_000)})
    assert "takes 2.0 GB: 1.00 GB for" in insert_parts(text, size=written)
    assert "2 packages (2000 MB) come only" in written
    assert "| `[view]` | 8 | 40 MB |" in written
    with pytest.raises(ValueError, match="0 places"):
        insert_parts("", size=written)


@pytest.mark.slow
@pytest.mark.parametrize("pair", ["icub icub_reduced", "talos talos_reduced", "ur5 ur5_gripper", "ur5 ur10"])
def test_the_distances_of_the_catalogues_pairs_are_those_that_same_finds(pair: str) -> None:
    page = (ROOT / "docs/same.md").read_text("utf-8")
    (found,) = re.findall(rf"^\| {pair.replace(' ', ' [|] ')} \| (.*) \|$", page, re.M)
    figures = re.findall(r"[\d.]+(?= mm)|[\d.]+e-\d+(?= rad)", found)
    text = run("same", *pair.split()).text.replace("e-09", "e-9")
    assert figures
    assert [figure for figure in figures if figure not in text] == []


def plain(text: str) -> str:
    """Return the words of a text, separated by one blank."""
    return " ".join(re.sub(r"<[^>]+>", "", text).split())


def test_the_texts_about_validation_list_the_quantities_of_the_table() -> None:
    group = cli.make_context("urdfkin", ["--help"], resilient_parsing=True)
    shown = plain(present(present(cli.get_command(group, "validate")).help))
    template = (ROOT / "urdfkin/report/templates/report.html.j2").read_text("utf-8")
    assert "{{ compared }}" in template
    assert "{{ not_compared }}" in template
    for text in (
        shown,
        *(plain((ROOT / page).read_text("utf-8")) for page in ("docs/commands.md", "docs/ci.md")),
    ):
        assert format_validated_titles() in text, text
        assert format_unvalidated_titles() in text, text
    assert format_unvalidated_titles() in plain((ROOT / "docs/known-limits.md").read_text("utf-8"))
    named = [row for row in QUANTITIES.values() if row.object_kind == "frames"]
    assert {row.title for row in named} == {
        *re.split(", and |, ", f"{format_validated_titles()}, {format_unvalidated_titles()}")
    }


def test_no_page_claims_that_a_validation_compares_every_quantity() -> None:
    texts = [ROOT / page for page in PAGES] + sorted((ROOT / "urdfkin").rglob("*.py"))
    claim = re.compile(r"(?i)every quantity (of every|but the)")
    assert [path for path in texts if claim.search(path.read_text("utf-8"))] == []


def test_the_exit_status_without_a_robot_is_the_documented_one() -> None:
    (row,) = re.findall(r"^\| (\d) \|.*no robot was given", (ROOT / "docs/ci.md").read_text("utf-8"), re.M)
    assert run("validate").code == int(row)


def test_the_guide_and_the_finding_state_the_same_size() -> None:
    (size,) = re.findall(r"URDF604, a robot (smaller than .*):", GUIDE)
    assert size in run("explain", "URDF604").text


def leads_somewhere(name: str) -> bool:
    """Return whether a dotted name is a module or a member of a module."""
    try:
        pkgutil.resolve_name(name)
    except (ImportError, AttributeError):
        return False
    return True


@pytest.mark.parametrize("page", [*DOCS, "README.md", "CHANGELOG.md", "CONTRIBUTING.md"])
def test_every_name_and_file_of_urdfkin_on_a_page_exists(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    names = set(re.findall(r"`(urdfkin(?:\.\w+)+)", text))
    assert {name for name in names if not leads_somewhere(name)} == set()
    files = set(re.findall(r"`((?:urdfkin|tests|scripts|docs)/[\w./-]*\w)", text)) - {"urdfkin/robots/dh"}
    assert {file for file in files if not (ROOT / file).exists()} == set()


# -- files of examples, targets of make, commands of hooks -----------------------------------------------


GUIDE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
HOOKS = (ROOT / ".pre-commit-config.yaml").read_text("utf-8")
TARGETS = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))


def test_every_file_in_the_guide_exists() -> None:
    named = re.findall(r"(?:urdfkin|tests|scripts|docs)/[\w/.-]*[\w/]", GUIDE)
    assert len(named) > 30
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_every_make_target_in_the_guide_exists() -> None:
    shown = "\n".join(re.findall(r"^make .*|`make .*?`", GUIDE, re.MULTILINE))
    lines = re.findall(r"`?make ((?:[a-z]+ ?)+)", shown)
    named = {word for line in lines for word in line.split()}
    assert {"setup", "fast", "test"} <= named <= TARGETS


@pytest.mark.skipif(shutil.which("make") is None, reason="make is a convenience")
def test_make_can_parse_the_makefile() -> None:
    for target in sorted(TARGETS):
        subprocess.run(["make", "--dry-run", target], cwd=ROOT, check=True, capture_output=True)


def test_ci_runs_two_commands_that_together_run_every_test() -> None:
    scripts = re.findall(r"^\./(scripts/\S+)$", (ROOT / ".ci/run").read_text("utf-8"), re.MULTILINE)
    assert scripts == ["scripts/test.sh", "scripts/test_long.sh"]
    texts = ((ROOT / name).read_text("utf-8") for name in scripts)
    chosen = [re.findall(r'pytest .*-m ("[^"]+"|\w+) "\$@"', text) for text in texts]
    assert chosen == [['"not long"'], ["long"]]


@pytest.mark.parametrize("broken", ["", "ruff", "python", "urdfkin", "mypy", "pytest"])
def test_the_test_script_fails_if_one_of_its_steps_fails(broken: str, tmp_path: Path) -> None:
    shutil.copy(ROOT / "scripts/test.sh", tmp_path)
    (tmp_path / "environment.sh").write_text("make_environment() { :; }\n")
    for name in ("ruff", "python", "urdfkin", "mypy", "pytest"):
        program = tmp_path / name
        program.write_text(f"#!/bin/sh\necho {name} was run\nexit {int(name == broken)}\n")
        program.chmod(0o755)
    path = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    done = subprocess.run([tmp_path / "test.sh"], env=path, capture_output=True, text=True, check=False)
    assert done.returncode == int(bool(broken)), done.stderr
    assert f"{broken or 'mypy'} was run" in done.stdout


#: A pip that installs a compiler, which exits with the status in the file `status`.
_PIP = """#!/bin/sh
for word in "$@"; do
    [ "$before" != --target ] || target=$word
    before=$word
done
mkdir -p "$target/nvidia/cu13/bin" "$target/nvidia/cu13/lib"
printf '#!/bin/sh\\nexit "$(cat status)"\\n' >"$target/nvidia/cu13/bin/nvcc"
chmod +x "$target/nvidia/cu13/bin/nvcc"
exit "$(cat pip)"
"""


@pytest.mark.parametrize(("pip", "status"), [(0, 0), (1, 0), (0, 1)])
def test_cudas_compiler_is_installed_only_if_it_compiles(pip: int, status: int, tmp_path: Path) -> None:
    for name in ("scripts", ".venv/bin"):
        (tmp_path / name).mkdir(parents=True)
    shutil.copy(ROOT / "scripts/environment.sh", tmp_path / "scripts")
    (tmp_path / ".venv/bin/pip").write_text(_PIP, encoding="utf-8")
    (tmp_path / ".venv/bin/pip").chmod(0o755)
    (tmp_path / "pip").write_text(str(pip), encoding="utf-8")
    (tmp_path / "status").write_text(str(status), encoding="utf-8")
    command = ["sh", "-c", ". scripts/environment.sh; install_nvcc", "scripts/setup"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == int(pip or status), done.stderr
    left = {path.name for path in (tmp_path / ".venv").iterdir()}
    assert left == ({"bin"} if pip or status else {"bin", "nvcc"})
    assert (tmp_path / ".venv/nvcc/lib64").exists() == (not pip and not status)


@pytest.mark.parametrize("installs", [True, False])
@pytest.mark.parametrize("ci", ["true", ""])
def test_long_tests_run_if_cudas_compiler_does_not_install(ci: str, installs: bool, tmp_path: Path) -> None:
    shutil.copy(ROOT / "scripts/test_long.sh", tmp_path)
    functions = f"install_nvcc() {{ echo nvcc; return {int(not installs)}; }}"
    (tmp_path / "environment.sh").write_text(f"make_environment() {{ :; }}\n{functions}\n", encoding="utf-8")
    for name in ("urdfkin", "pytest"):
        (tmp_path / name).write_text(f"#!/bin/sh\necho {name}\n", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    how: dict[str, Any] = {"env": {"PATH": f"{tmp_path}:/usr/bin:/bin", "CI": ci}, "text": True}
    done = subprocess.run([tmp_path / "test_long.sh"], capture_output=True, check=True, **how)
    assert done.stdout.split() == [*(["nvcc"] if ci else []), "urdfkin", "pytest"]
    assert ("CUDA's compiler was not installed" in done.stderr) == bool(ci and not installs)


def test_every_hook_runs_a_command_of_the_environment_and_needs_no_network() -> None:
    commands = re.findall(r"entry: \.venv/bin/(\S+)", HOOKS)
    assert {"ruff", "mypy", "urdfkin"} == set(commands)
    assert [name for name in commands if not (Path(sys.executable).parent / name).exists()] == []
    assert re.findall(r"repo: (\S+)", HOOKS) == ["local"]
    assert HOOKS.count("language: system") == HOOKS.count("- id: ")


@pytest.mark.parametrize("path", sorted((ROOT / "robots").glob("*.urdf")), ids=lambda path: path.stem)
def test_the_projects_own_robots_have_no_findings(path: Path) -> None:
    assert urdfkin.check(path) == []


# -- the numbers of operations on the page about speed ---------------------------------------------------


def counted(name: str, frame: str, quantity: str) -> int:
    robot = urdfkin.load(name, mimic=False)
    return count_operations(robot.plan([robot.tree.frame_link(frame)]), quantity)


def test_one_joint_about_z_needs_the_operations_counted_by_hand() -> None:
    plan = urdfkin.load(urdfs.robot(urdfs.joint("j", "continuous", "a", "b"))).plan([1])
    # Sine and cosine 51. R Rz: three rows of two numbers, each two products and a sum: 18. The column: p - o
    # 3 and z x d 9, and nothing else.
    assert count_operations(plan, "jacobian") == 51 + 18 + 12
    # w + v z: 6.
    assert count_operations(plan, "velocity") == 51 + 18 + 6
    # alpha + a z + v w x z: 6 + 9 + 6.
    assert count_operations(plan, "acceleration") == 51 + 18 + 6 + 6 + 15


def test_operations_of_unused_outputs_are_not_counted() -> None:
    hands = ("panda", "panda_hand"), ("talos", "gripper_left_base_link"), ("panda", "panda_leftfinger")
    for name, frame in hands:
        velocity, acceleration = (counted(name, frame, quantity) for quantity in ("velocity", "acceleration"))
        assert velocity < acceleration < 2 * velocity
