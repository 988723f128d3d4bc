"""A mistake of the user gives exit code 2, one message on stderr, nothing on stdout and no traceback."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.running import process, refused
from tests.robots.odd_urdfs import urdf_of
from tests.urdfs import chain
from urdfkin.cli.output import check_writable
from urdfkin.errors import SourceError

ZEROS = "0,0,0,-1,0,0,0,0"

#: For each wrong command line, a part of the message
MISTAKES = {
    "completion": "Choose from: bash, zsh, fish; see: urdfkin completion --help",
    "help": "unknown command 'help'; did you mean --help?",
    "info UR5": "unknown robot 'UR5'; did you mean ur5",
    "jacobian pandaa": "unknown robot 'pandaa'; did you mean panda",
    "info ./nowhere.urdf": "nowhere.urdf: no such file",
    "info nowhere/arm.urdf": "no such file; the folder nowhere does not exist",
    "info .": "this is a folder, not a file; name the .urdf file in this folder",
    "info ''": "the robot's name is empty",
    "info ur5 -o ''": "'--output' / '-o': the path is empty",
    "check ''": "the path is empty; give a file, or `.` for the current folder",
    "report ''": "'RESULTS.json|DIR': the path is empty",
    "report history ''": "the path is empty",
    "validate ur5 --store ''": "'--store': the path is empty",
    "dh ur5 --compare ''": "the path is empty; give a file, or one of kinova",
    "dh ur5 --like ''": "the path is empty",
    "placement ur5 --q @": "--q: the path is empty; give a CSV file after @",
    "velocity ur5 --base-velocity @": "--base-velocity: the path is empty",
    "placement ur5 --convention ''": "unknown convention ''",
    "info a.xacro --xacro-arg L:=1 --xacro-arg L:=2": "'L' has two values: '1' and '2'",
    "info a.usda --variant size=small --variant size=big": "'size' has two values",
    "validate ur5 --html a.out --json ./a.out": "two options write the same file, 'a.out'",
    "same ur5 ur5 --markdown a.md --output a.md": "two options write the same file, 'a.md'; name two files",
    "verify a.py ur5 --junit a.md -o a.md": "two options write the same file, 'a.md'",
    f"info {__file__}": "URDF105 error: not well-formed XML",
    "info /dev/null": "URDF101 error: the file is empty",
    "info '<html><body/></html>'": "this is a web page",
    "jacobian panda --frame panda_hnd": "unknown frame 'panda_hnd'; did you mean panda_hand",
    "jacobian panda --q 0,0": "8 numbers are expected (panda_joint1, ",
    f"velocity ur5 --v {'0,' * 6 + '0'}": "6 numbers are expected (shoulder_",
    f"jacobian panda --q {ZEROS.replace('-1', 'one')}": "not a finite number: found 'one'",
    f"jacobian panda --q {ZEROS.replace('-1', 'nan')}": "not a finite number: found 'nan'",
    "velocity panda --v 0,0,0,0,0,0,0,inf": "_joint1: not a finite number: found 'inf'",
    "jacobian panda --q @nowhere.csv": "nowhere.csv: no such file",
    "jacobian panda --q @/bin/sh": "/bin/sh: cannot be read: found text",
    "jacobian panda --q @/dev/null": "no samples; write one line for each",
    "jacobian panda --q random:many": "N in random:N must be a whole number",
    "jacobian panda --q random:0": "N in random:N must be a whole number, at least 1",
    f"jacobian panda --q random:{10**13}": "--q: N random samples do not fit into memory",
    f"velocity panda --v random:{10**23}": "--v: N random samples do not fit into memory",
    f"plot ur5 --to random --samples {10**13} -o a.svg": "is not in the range 3<=x<=10000000",
    "plot ur5 --to random --duration 1e-200 -o a.svg": "the duration is too short",
    f"jacobian ur5 --root-joint floating --q {','.join('0' * 13)}": (
        "the quaternion of joint root_joint must be a unit quaternion: found norm 0"
    ),
    f"acceleration ur5 --v 1e200{',1e200' * 5}": "leaves the range of double precision; give smaller numbers",
    "jacobain panda": "unknown command 'jacobain'; did you mean jacobian",
    "fk panda": "unknown command 'fk'; did you mean placement?",
    "jacobian_rate panda": "'jacobian_rate'; did you mean jacobian-rate?",
    "ik panda": "unknown command 'ik'; urdfkin has no inverse kinematics",
    "compare a b": "did you mean `report compare` (reports), `same` (models) or `diff` (versions",
    "jacobian panda --fram x": "No such option",
    "jacobian panda --reference global": "Invalid value for '--reference'",
    "jacobian panda --format xml": "Invalid value for '--format'",
    "jacobian ur5 -o J.mat": "J.mat: no output format has this suffix",
    "jacobian ur5 -o J.npy --format json": "J.npy: --format json contradicts the file's suffix",
    "validate ur5 --xacro-arg a:=1": "--xacro-arg does nothing",
    "check no.urdf": "no.urdf: no such file",
    "jacobian ur5 --q": "Option '--q' requires an argument",
    "robots --family armchair": "no robots of family 'armchair'; the families",
    "jacobian panda --seed -1": "Invalid value for '--seed'",
    "validate": "give either robots, or --all",
    "export ur5 --to c++": "'c++' is not the name of a language; did you mean cpp?",
    "export ur5 --to Python": "did you mean numpy?",
    "diff HEAD~1 HEAD ur5": "HEAD~1; write `git show VERSION:FILE | urdfkin diff - FILE`",
    "diff HEAD:arm.urdf ur5": "this is a version in git, not a file: found HEAD:arm.urdf",
    "explain 'dh table'": "did you mean urdf-to-dh,",
    "validate panda --all": "give either robots, or --all",
    "validate panda --samples -1": "Invalid value for '--samples'",
    "validate panda --jobs 0": "Invalid value for '--jobs'",
    "jacobian ur5 -o /nowhere/J.csv": "J.csv: cannot be written: found No",
    "validate ur5 --json /nowhere/r.json": "r.json: cannot be written",
    "info alex_psyonic_hands --mimic": "--no-mimic",
    "validate ur5 --html /nowhere/a.html": "/nowhere/a.html: cannot be written",
    "report none.json": "none.json: no such file",
    "report": "give the FILE of `urdfkin validate --json FILE`",
    "report compare none.json none.json": "no such file",
    "plot ur5 -o a.svg": "--to VALUES",
    "plot ur5 --to neutral -o /nowhere/a.svg": "cannot be written",
    "plot ur5 --to neutral -o a.bmp": "unknown picture format",
    "plot ur5 --to random:3 -o a.svg": "need one configuration each",
    "export": "give either a ROBOT to export, or --check FILE",
    "export ur5 --check x.c": "give either a ROBOT to export, or --check",
    "export --check x.c --to c": "--to does nothing with --check",
    "export --check nowhere.c": "no such file",
    "export planar_two_link --quantity speed": "speed",
    "export planar_two_link --frame nowhere": "nowhere",
    "validate ur5 --retry failed": "need --store",
    "validate ur5 --shard 1/2": "need --store",
    "validate ur5 --store s --shard 1/2 --json x": "--shard cannot be combined with a report file",
    "validate ur5 --store s --shard 3/2": "must have the form i/n",
    "validate ur5 --scheduler local:2 --jobs 2": "--scheduler cannot be combined",
    "validate ur5 --scheduler local:none": "N in local:N must be a whole number, at least 1",
    "imu ur5 --gravity 0,0": "--gravity: 3 numbers are expected (x, y, z): found 2, none for z\n",
    "velocity ur5 --base-placement 0,0,0": "6 numbers are expected (x, y, z, roll,",
    "velocity ur5 --base-placement 0,0,0,0,0,0,2": "must be a unit quaternion: found norm 2",
    "velocity ur5 --base-velocity 0,0,0,0,0,x": "--base-velocity, wz: not a finite number: found 'x'",
    "velocity ur5 --base-acceleration 0,0,0,0,0,0": "No such option",
    "velocity ur5 --base-velocity @nowhere.csv": "nowhere.csv: no such file",
    "info panda --lock elbow=1": "unknown coordinate 'elbow'",
    "info panda --lock panda_joint1=200deg": "3.49066 is outside [-2.8973, 2.8973]",
    "info panda --lock panda_joint1=90": "degrees? write 90deg",
    "info panda --lock panda_finger_joint2=0.01": "this joint mimics panda_finger_joint1",
    "info panda --lock 0.4": "give each number with its name",
    "info panda --joints elbow": "unknown coordinate 'elbow'",
    "info panda --joints panda_joint1": "--lock panda_joint4=VALUE",
    "velocity panda --q panda_joint1=30deg,panda_joint4=-pi/2,panda_joint6=1.5": (
        "--q: no value for panda_joint2, panda_joint3, panda_joint5, panda_joint7, panda_finger_joint1; give"
        " a value for each joint, or begin with 'neutral, panda_joint1=...'"
    ),
    "velocity panda --q raedy": "--q: unknown pose 'raedy'; did you mean ready?",
    "velocity panda --q '0 0 0 0 0 0 0 0 0'": "robot.from_pinocchio(q, mimic=False) converts it to ",
    "velocity panda --q ready --v neutral,panda_joint1=1mm/s": "--v, panda_joint1: wrong unit",
    "calibrate ur5 --noise 1,1": "--noise does nothing without --poses",
    "calibrate ur5 --drop-outliers": "--drop-outliers does nothing without --poses",
    "calibrate ur5 --radians": "--radians does nothing without --poses",
    "calibrate ur5 --all": "--all does nothing without --poses",
    "calibrate ur5 --force": "--force does nothing without --poses",
    "calibrate ur5 -o x.urdf": "does nothing without --poses and --ur",
    "calibrate ur5 --order urdf": "--order does nothing without --ur",
    "calibrate ur5 --ur x.yaml --tip tool0": "--tip does nothing with --ur",
    "calibrate ur5 --ur x.yaml --fit base": "--fit does nothing with --ur",
    "calibrate ur5 --poses x.csv --ur x.yaml": "--poses and --ur cannot be used together",
    "calibrate ur5 --poses x.csv --positions": "--positions does nothing with --poses",
    "calibrate ur5 --poses none.csv": "none.csv",
    "calibrate ur5 --fit origin": "did you mean origins",
    "calibrate ur5 --tip tool1": "did you mean tool0",
    "dh ur5 --base base --tip tool1": "did you mean tool0",
    "dh ur5 --all --tree": "cannot be used together",
    "dh ur5 --all --format c": "--all does not support the format 'c'",
    "dh ur5 --tree --format c": "--tree does not support the format 'c'",
    "dh ur5 --compare ur5 --format c": "--compare does not support the format 'c'",
    "dh ur5 --compare ur6": "unknown reference table 'ur6'",
    "dh panda --compare ur5": "choose a base and a tip",
    "dh ur5 --snap 1": "`snap` must be an angle",
    "dh ur5 --flip elbow": "did you mean elbow_joint",
    "same ur5 ur5 --recheck c.json --strict": "--strict does nothing with --recheck",
    "same ur5 ur5 --recheck c.json --within 0.1": "--within does nothing with --recheck",
    "same ur5 ur5 --recheck c.json --html same.html": "--html does nothing with --recheck",
    "validate ur5 --accuracy-samples 3": "--accuracy-samples does nothing without --accuracy",
    "validate ur5 --accuracy-moving-base": "--accuracy-moving-base does nothing without --accuracy",
    "verify f.py ur5 --timeout 3": "--timeout does nothing without --program",
    "vectors write v ur5 --no-catalogue": "--catalogue/--no-catalogue does nothing with a ROBOT",
    "report r.json --cases --html r.html": "does nothing if the report is written to a file",
    "structure ur5 --opw 1 -o s.json": "s.json: --opw writes YAML; use the suffix .txt",
    "structure ur5 --opw 1 -o s.md": "s.md: --opw writes YAML",
    "validate - -": "only one of the robots can come from standard input",
    "validate ur5 --variant size=big": "--variant does nothing without a USD file",
    "validate ur5 --articulation /arm": "--articulation does nothing without a USD file",
    "jacobian ur5 --frame ''": "unknown frame ''",
    "jacobian ur5 --base-placement ''": "--base-placement: 6 numbers are expected",
    "velocity ur5 --base-velocity ''": "--base-velocity: 6 numbers are expected",
    "export ur5 --frame ''": "unknown frame ''",
    "plot ur5 --to neutral --frame '' -o a.svg": "unknown frame ''",
    "dh ur5 --compare ur5 --tip ''": "unknown frame ''",
    "order ur5 --from ''": "unknown convention ''",
    "plot ur5 --trajectory m.csv --duration 2 -o a.svg": "--duration does nothing with --trajectory",
    "plot ur5 --trajectory m.csv --samples 9 -o a.svg": "--samples does nothing with --trajectory",
    "plot ur5 --trajectory m.csv --from ready -o a.svg": "--from does nothing with --trajectory",
    "plot ur5 --to ready --seed 1 -o a.svg": "--seed does nothing without a random --from or --to",
    "view planar_two_link --seed 1 --no-browser": "--seed does nothing without a random --q",
    "view planar_two_link --q 0,0 --trajectory motion.csv --no-browser": (
        "--q and --trajectory cannot be used together"
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("line", MISTAKES)
def test_each_mistake_of_the_user_gives_one_message_and_exit_code_2(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    err = refused(line)
    assert MISTAKES[line] in err
    lines = [line for line in err.splitlines() if not line.startswith("warning: joint")]
    assert lines[0].startswith("urdfkin: error: ")
    assert not any(line.startswith(("Usage:", "Try '", "Error:")) for line in lines), "one style"
    assert list(tmp_path.iterdir()) == []


def test_a_report_without_write_permission_is_refused_before_any_computation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Tests may run as the superuser, who may write every file, so the system's error is simulated.
    def refuse(*args: object, **kwargs: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr("tempfile.NamedTemporaryFile", refuse)
    for line in ("validate ur5 --json", "jacobian ur5 -o"):
        err = refused(line, str(tmp_path / "J.csv"))
        assert "cannot be written: found Permission denied" in err
        assert err.count("\n") == 1


def test_a_read_only_output_file_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "J.csv"
    path.write_text("mine")
    monkeypatch.setattr(os, "access", lambda _, mode: mode != os.W_OK)
    assert "Permission denied" in refused("jacobian ur5 -o", str(path))
    assert path.read_text() == "mine"


def test_a_read_only_output_file_is_found_before_the_computation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, link = tmp_path / "J.csv", tmp_path / "link.csv"
    path.write_text("mine")
    link.symlink_to(path)
    monkeypatch.setattr(os, "access", lambda _, mode: mode != os.W_OK)
    for given in (path, link):
        with pytest.raises(SourceError, match="cannot be written: found Permission denied"):
            check_writable(given)


@pytest.mark.slow
def test_a_reader_that_closes_the_pipe_causes_no_traceback() -> None:
    words = [sys.executable, "-m", "urdfkin", "velocity", "ur5", "--q", "random:5000", "--format", "csv"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        assert running.stdout.readline() == b"sample,vx,vy,vz,wx,wy,wz\n"
        running.stdout.close()
        assert b"Traceback" not in running.stderr.read()


@pytest.mark.slow
def test_a_robot_that_pinocchio_cannot_check_is_reported_once_with_exit_code_3() -> None:
    snake = chain([""] * 316, origin='xyz="0.1 0 0"', name="snake")
    done = process("placement", "-", "--format", "json", stdin=snake.encode())
    assert done.code == 3
    assert done.data["verified"] is False
    assert "memory grows with nv^3" in done.data["check"]
    assert "Warning" not in done.err


@pytest.mark.parametrize("stdin", [b"", b"\xff\xfe\x00", b"<robot", urdf_of("single_link").encode()[:-3]])
def test_standard_input_without_a_valid_urdf_is_an_input_error(stdin: bytes) -> None:
    assert "<stdin>" in refused("placement -", stdin=stdin)


@pytest.mark.parametrize(
    "command",
    [
        "placement planar_two_link --q neutral",
        "singular-values planar_two_link --q neutral",
        "export planar_two_link --quantity placement",
        "verify {folder}/mine.py:placement planar_two_link --samples 1",
        "plot planar_two_link --from neutral --to 1,1 --output {folder}/x.svg",
    ],
)
def test_an_empty_frame_is_an_error_and_not_the_tip(command: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def placement(q):\n    return q\n")
    assert "unknown frame ''" in refused(*command.format(folder=tmp_path).split(), "--frame", "")
