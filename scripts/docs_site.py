r"""Hooks of mkdocs that generate and convert pages of the documentation site; mkdocs.yml refers to them.

The pages of commands and of the library are generated from the program, so they are always current. A formula
between $` and `$ becomes MathML. A lesson is also available as a notebook.
"""

import html
import importlib
import inspect
import json
import re
from pathlib import Path
from typing import Any

import click

import urdfkin
from urdfkin.cli import cli

LESSONS = "lessons/"
_EQUATIONS = re.compile(r" \(eq\. [^)]*\)")
_ROBOT = "urdfkin.robot.Robot"
#: Maps a page to its title, its introduction, and the names that the page describes. A name without a dot
#: belongs to the package `urdfkin` or to the class `Robot`.
LIBRARY: dict[str, tuple[str, str, str]] = {
    "api/robot.md": (
        "Load a robot",
        "`load` reads a robot. The class `Robot` has names, joints, limits and computations.",
        "load robots Robot name source path origin sha256 urdf joints joint_names link_names "
        "link_frames frame_names all_frames frames tip_frame coordinate_names velocity_names nq nv "
        "root_joint limits velocity_limits view",
    ),
    "api/configurations.md": (
        "Configurations",
        "Joint values `q`: named poses, samples, limits, integration, and the conversion to other tools.",
        "neutral poses sample limit_violations integrate difference to_pinocchio from_pinocchio "
        "pinocchio_model convention with_convention with_locked_joints",
    ),
    "api/kinematics.md": (
        "Kinematics",
        "Poses, velocities, Jacobians and accelerations. Each result is checked against Pinocchio.",
        "placement relative_placement velocity jacobian jacobian_rate hessian acceleration "
        "acceleration_breakdown analytical_jacobian imu compute enclose Reference BaseMotion",
    ),
    "api/trajectories.md": (
        "Trajectories",
        "Read trajectories, and compute a frame's motion along a trajectory. Pinocchio checks each sample.",
        "read_trajectory frame_motion urdfkin.robot.trajectory.Trajectory "
        "urdfkin.robot.frame_motion.FrameMotion",
    ),
    "api/singularities.md": (
        "Singular values",
        "Singular values with guaranteed bounds, manipulability, and the reason for a singularity.",
        "singular_values urdfkin.verify.singular_values.SingularValues "
        "urdfkin.verify.singularity.Singularity",
    ),
    "api/fast.md": (
        "Fast evaluation",
        "Evaluators of one frame for a control loop, and kinematics as source code.",
        "prepare urdfkin.compiled.prepared.PreparedFrame compile "
        "urdfkin.export.compiled_frame.CompiledFrame export torch",
    ),
    "api/tables.md": (
        "Chains and tables",
        "Denavit-Hartenberg tables, products of exponentials and chains between two frames.",
        "dh chain screws tree_parameters select DHTable DHRow read_table table_from_rows FrameChain "
        "urdfkin.dh.screws.ProductOfExponentials",
    ),
    "api/models.md": (
        "Compare and calibrate",
        "Compare two models, list the changes between two versions, fit parameters to measured poses.",
        "same urdfkin.comparison.result.Sameness diff calibrate",
    ),
    "api/checks.md": (
        "Checks and reports",
        "Certificates of results, validation of robots, checks of your functions, findings about URDF files.",
        "certificate Certificate validate check Finding verify_function"
        " urdfkin.validation.functions.FunctionCheck urdfkin.validation.programs.Program",
    ),
    "api/errors.md": (
        "Errors",
        "All errors derive from `UrdfkinError`. A message states the problem, and usually the place, the"
        " value found and the remedy.",
        "UrdfkinError InputError UnknownNameError SourceError UrdfError TableError "
        "VerificationError NotVerifiedWarning UrdfWarning DegreesWarning",
    ),
}
_FORMULA = re.compile(r"(?:<p>)?\$<code>(.*?)</code>\$(?:</p>)?", re.DOTALL)
_DISPLAYED = re.compile(r"^```math\n(.*?)\n```$", re.DOTALL | re.MULTILINE)
#: Regular expression for GitHub's markup of an image with a light and a dark version.
_PICTURE = re.compile(
    r'<picture><source media="[^"]*dark[^"]*" srcset="([^"]+)"><img src="([^"]+)"(.*?)></picture>'
)
#: MathML of a sine or cosine without brackets, for example `cos q`.
_NAME_OF_FUNCTION = re.compile(r"(<mi>(?:cos|sin)</mi>)(?=<m(?:i|sub)>)")
_FENCE = re.compile(r"^```(\w+)\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)


def on_config(config: Any) -> Any:
    named = set(re.findall(r"[\w/-]+\.md", json.dumps(config.nav)))
    docs = Path(config.docs_dir)
    pages = sorted(str(path.relative_to(docs)) for path in docs.rglob("*.md"))
    if more := [page for page in pages if page not in named]:
        config.nav.append({"More": more})
    return config


def on_files(files: Any, config: Any) -> Any:
    from mkdocs.structure.files import File

    made = {"cli.md": make_commands_page(), "api.md": make_library_page()}
    made |= {page: make_subject_page(page) for page in LIBRARY}
    for file in files.documentation_pages():
        if file.src_uri.startswith(LESSONS):
            name = str(Path(file.src_uri).with_suffix(".ipynb"))
            made[name] = json.dumps(make_notebook(file.content_string), indent=1)
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    markdown = _DISPLAYED.sub(r"\n$`\1`$\n", markdown)
    markdown = _PICTURE.sub(r'<img src="\2#only-light"\3><img src="\1#only-dark"\3>', markdown)
    if not page.file.src_uri.startswith(LESSONS):
        return markdown
    name = Path(page.file.src_uri).with_suffix(".ipynb").name
    return f"{markdown}\n\n[This lesson as a notebook]({name})\n"


def on_page_content(content: str, **_: Any) -> str:
    from latex2mathml.converter import convert

    def convert_formula(match: re.Match[str]) -> str:
        alone = match[0].startswith("<p>") and match[0].endswith("</p>")
        text = str(convert(html.unescape(match[1]), display="block" if alone else "inline"))
        text = text.replace("<mover>", '<mover accent="true">')
        text = _NAME_OF_FUNCTION.sub(r'\1<mspace width="0.17em"/>', text)
        if alone:
            return f'<div class="formula">{text}</div>'
        return match[0].replace(f"$<code>{match[1]}</code>$", text)

    return _FORMULA.sub(convert_formula, content)


def on_post_page(output: str, **_: Any) -> str:
    """Add `aria-label` to the search dialog, for screen readers."""
    dialog = 'data-md-component="search" role="dialog"'
    return output.replace(dialog, f'{dialog} aria-label="Search"')


def make_notebook(page: str) -> dict[str, Any]:
    cells: list[dict[str, Any]] = []
    position = 0
    for block in _FENCE.finditer(page):
        kind, text = block.groups()
        if kind == "python" or (kind == "text" and cells and cells[-1]["cell_type"] == "code"):
            _add_text(cells, page[position : block.start()])
            position = block.end()
        if kind == "python":
            cells.append(_make_cell("code", text, execution_count=None, outputs=[]))
        elif kind == "text" and position == block.end():
            cells[-1]["outputs"].append({"output_type": "stream", "name": "stdout", "text": text})
    _add_text(cells, page[position:])
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}


def _add_text(cells: list[dict[str, Any]], text: str) -> None:
    text = re.sub(r"\$`(.*?)`\$", r"$\1$", _DISPLAYED.sub(r"$$\1$$", text), flags=re.DOTALL)
    if text := text.strip():
        cells.append(_make_cell("markdown", text))


def _make_cell(kind: str, source: str, **more: Any) -> dict[str, Any]:
    return {"cell_type": kind, "metadata": {}, "source": source.rstrip(), **more}


def make_library_page() -> str:
    parts = ["# Library", "`import urdfkin`, then `urdfkin.load` a robot. Every example is run as a test."]
    for page, (title, words, names) in LIBRARY.items():
        parts += [f"## [{title}]({page})", words, "| Name | Purpose |\n|---|---|"]
        rows = [
            f"| [`{_short(name)}`]({page}#{find_address(name)}) | {_purpose(name)} |"
            for name in names.split()
        ]
        parts[-1] = "\n".join([parts[-1], *rows])
    return "\n\n".join(parts) + "\n"


def make_subject_page(page: str) -> str:
    title, words, names = LIBRARY[page]
    parts = [f"# {title}", words]
    for name in names.split():
        options = [f"heading: {_short(name)}", f"toc_label: {_short(name).removeprefix('Robot.')}"]
        # Each method of `Robot` has a section of its own, so the section of `Robot` shows no members.
        options += ["members: []"] if name == "Robot" else []
        lines = "\n".join(f"      {option}" for option in options)
        parts.append(f"::: {find_address(name)}\n    options:\n{lines}")
    return "\n\n".join(parts) + "\n"


def find_address(name: str) -> str:
    if "." in name:
        return name
    return f"{urdfkin._HOMES[name]}.{name}" if name in urdfkin.__all__ else f"{_ROBOT}.{name}"


def _short(name: str) -> str:
    if "." in name:
        return name.rpartition(".")[2]
    return name if name in urdfkin.__all__ else f"Robot.{name}"


def _purpose(name: str) -> str:
    module, _, own = find_address(name).rpartition(".")
    if module == _ROBOT:
        module, own = "urdfkin.robot", f"Robot.{own}"
    found: Any = importlib.import_module(module)
    for part in own.split("."):
        found = inspect.getattr_static(found, part)
    first = (inspect.getdoc(found) or "").partition("\n\n")[0]
    return _EQUATIONS.sub("", " ".join(first.split())).replace("|", "\\|")


def make_commands_page() -> str:
    parent = click.Context(cli, info_name="urdfkin", terminal_width=80, **cli.context_settings)
    parts = [
        "# Commands",
        "`urdfkin COMMAND --help` prints the help of a command.",
        *_help(cli, parent, "##"),
    ]
    return "\n\n".join(parts) + "\n"


def _help(command: click.Command, context: click.Context, heading: str) -> list[str]:
    parts = [f"{heading} {context.command_path}", f"```text\n{command.get_help(context)}\n```"]
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            if found is None:
                raise LookupError(name)
            parts += _help(found, click.Context(found, parent=context, info_name=name), heading)
    return parts
