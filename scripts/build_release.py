"""Build the wheel, the sdist, the SBOM and the checksums of a release, and check them.

    python scripts/build_release.py dist                  # build into the folder dist
    python scripts/build_release.py --tag v0.1.0 dist     # also fail if the tag is not the version

The script builds the sdist from the checkout and the wheel from the sdist. The script builds twice and
compares the bytes. Then `twine check --strict` and `check-wheel-contents` check the sdist and the wheel. The
SBOM (CycloneDX, JSON) lists the packages of a new virtual environment in which the wheel is installed. With
`--sbom-of PYTHON`, the SBOM lists an existing environment instead, and the script needs no network.
SHA256SUMS has one line for each file. Exit 1: a check fails.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]


def read_version() -> str:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project["version"])


def _run(*command: str | Path, **environment: str) -> None:
    subprocess.run([str(part) for part in command], check=True, cwd=ROOT, env={**os.environ, **environment})


def _commit_time() -> str:
    """Return the time of the last commit (s); 1980-01-01 outside a repository."""
    command = ["git", "log", "-1", "--format=%ct"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "315532800"


def build(folder: Path) -> tuple[Path, Path]:
    build_: list[str | Path] = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder]
    time = _commit_time()
    _run(*build_, "--sdist", ROOT, SOURCE_DATE_EPOCH=time)
    (sdist,) = folder.glob("*.tar.gz")
    with tempfile.TemporaryDirectory() as unpacked, tarfile.open(sdist) as archive:
        archive.extractall(unpacked, filter="data")
        (source,) = Path(unpacked).iterdir()
        _run(*build_, "--wheel", source, SOURCE_DATE_EPOCH=time)
    (wheel,) = folder.glob("*.whl")
    return sdist, wheel


def check_reproducible(files: tuple[Path, Path]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for first, second in zip(files, build(Path(folder)), strict=True):
            if first.read_bytes() != second.read_bytes():
                sys.exit(f"{first.name}: two builds of one commit differ; unpack both and run diff -r")


def write_sbom(wheel: Path, target: Path, python: str | None) -> None:
    with tempfile.TemporaryDirectory() as folder:
        if python is None:
            venv.create(folder, with_pip=True)
            python = str(Path(folder) / "bin" / "python")
            _run(python, "-m", "pip", "install", "--quiet", wheel)
        command = [sys.executable, "-m", "cyclonedx_py", "environment", "--output-reproducible"]
        _run(*command, "--pyproject", ROOT / "pyproject.toml", "--of", "JSON", "-o", target, python)


def main() -> None:
    parser = argparse.ArgumentParser(description="Build and check the files of a release.")
    parser.add_argument("folder", type=Path, help="new or empty folder for the files of the release")
    parser.add_argument("--tag", help="tag of the release, such as v0.1.0")
    parser.add_argument("--sbom-of", metavar="PYTHON", help="list the packages of this Python environment")
    options = parser.parse_args()
    if options.tag not in (None, f"v{read_version()}"):
        sys.exit(f"the tag is {options.tag}, and pyproject.toml has version {read_version()}")
    options.folder.mkdir(parents=True, exist_ok=True)
    if any(options.folder.iterdir()):
        sys.exit(f"{options.folder} is not empty; name a new or an empty folder")
    files = build(options.folder.resolve())
    check_reproducible(files)
    _run(sys.executable, "-m", "twine", "check", "--strict", *files)
    # The wheel contains the licence of three.js twice: in the package, and in the folder of licences.
    # check-wheel-contents reports equal files as W002, so this code is ignored.
    _run(sys.executable, "-m", "check_wheel_contents", "--ignore", "W002", files[1])
    sbom = options.folder / f"urdfkin-{read_version()}.cdx.json"
    write_sbom(files[1], sbom.resolve(), options.sbom_of)
    lines = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in (*files, sbom)]
    (options.folder / "SHA256SUMS").write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
