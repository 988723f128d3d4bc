"""`urdfkin imu` and `urdfkin singular-values` print the library's numbers in every format."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

import urdfkin as library
from tests.cli.running import good, refused, urdfkin
from tests.cli.test_trajectory_option import Motion, write
from tests.laws.test_imu import moving_base
from urdfkin.model.tree import FloatArray


@pytest.fixture
def motion() -> Motion:
    robot = library.load("ur5")
    v, a = np.random.default_rng(4).standard_normal((2, 4, 6))
    return {"t": np.array([0.0, 0.1, 0.25, 0.5]), "q": robot.sample(4, 2), "v": v, "a": a}


def test_a_csv_file_and_an_archive_of_the_same_motion_give_the_librarys_numbers(
    motion: Motion, tmp_path: Path
) -> None:
    robot = library.load("ur5")
    q, v, a = (motion[x] for x in "qva")
    expected = robot.imu(q, v, a, "tool0", gravity=[0.0, 1.0, -9.8])
    np.savez(tmp_path / "log.npz", **motion)  # type: ignore[arg-type]
    write(tmp_path / "log.csv", robot, motion)
    for log in ("log.csv", "log.npz"):
        words = ["imu ur5 --frame tool0 --gravity 0,1,-9.8 --trajectory", str(tmp_path / log)]
        document = urdfkin(*words, "--format", "json").data
        assert (document["result"], document["t"]) == (expected.tolist(), motion["t"].tolist())
        assert (document["quantity"], document["verified"]) == ("imu", True)
        rows = urdfkin(*words, "--format", "csv").rows
        assert rows[0] == ["t", "ax", "ay", "az", "wx", "wy", "wz"]
        np.testing.assert_array_equal(np.array(rows[1:], dtype=float)[:, 1:], expected)
        text = urdfkin(*words).text
        assert "t = 0.25 s" in text
        assert "proper acceleration [m/s^2]" in text


def test_a_base_in_the_archive_is_used_and_missing_derivatives_are_computed(
    motion: Motion, tmp_path: Path
) -> None:
    base, path = moving_base(4, 3), tmp_path / "log.npz"
    fields = {f"base_{name}": getattr(base, name) for name in ("placement", "velocity", "acceleration")}
    np.savez(path, **motion, **fields)  # type: ignore[arg-type]
    words = ["imu ur5 --frame tool0 --format json --trajectory", str(path)]
    q, v, a = (motion[x] for x in "qva")
    expected = library.load("ur5").imu(q, v, a, "tool0", base=base)
    document = urdfkin(*words).data
    assert document["result"] == expected.tolist()
    assert {name: document[name] for name in fields} == {name: x.tolist() for name, x in fields.items()}
    np.savez(path, q=motion["q"])
    assert "rates by central differences" in good(*words).err


#: An .npy file of zeros (4, 6).
SINGLE_ARRAY = (
    b"\x93NUMPY\x01\x00\x46\x00{'descr': '<f8', 'fortran_order': False, 'shape': (4, 6), }".ljust(79)
    + b"\n"
    + bytes(192)
)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"q": np.zeros((4, 5))}, "q must have the shape (n, 6)"),
        ({"q": np.zeros((4, 6)), "a": np.zeros((4, 6))}, "joint accelerations need joint velocities"),
        ({"q": np.zeros((4, 6)), "t": np.zeros(3)}, "t must have the shape (n)"),
        ({"q": np.zeros((4, 6)), "t": np.zeros(4)}, "time must increase"),
        ({"q": np.zeros((2, 6))}, "at least 3 samples"),
        ({"q": np.full((4, 6), np.nan)}, "q must be finite"),
        ({"q": np.array([["x"] * 6] * 4)}, "q must be real numbers"),
        ({"q": np.array(0.0)}, "q must have the shape (n, 6)"),
        (
            {"Q": np.zeros((4, 6))},
            "log.npz: the file has unknown arrays or lacks an array: found unknown: Q",
        ),
        ({"q": np.zeros((4, 6)), "base_velocity": np.zeros((4, 6))}, "must be given together"),
        ({"q": np.array([print], dtype=object)}, "not an .npz file of numbers"),
        (b"", "not an .npz file of numbers"),
        (b"PK\x03\x04 broken", "not an .npz file of numbers"),
        (b"t,q\n1,2\n", "not an .npz file of numbers"),
        (SINGLE_ARRAY, "not an .npz file of numbers: found a single array"),
    ],
)
def test_a_wrong_archive_is_refused_in_one_line(
    content: dict[str, FloatArray] | bytes, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "log.npz"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.savez(path, **content)  # type: ignore[arg-type]
    err = refused("imu ur5 --trajectory", str(path))
    assert words in err
    assert err.count(str(path)) == 1
    assert err.count("\n") == 1


def test_the_json_of_an_imu_states_the_gravity() -> None:
    words = "imu ur5 --format json --gravity=0,0,"
    assert [good(words + z).data["gravity"] for z in ("-9.81", "-1.62")] == [[0, 0, -9.81], [0, 0, -1.62]]


def test_an_incomplete_gravity_vector_is_refused() -> None:
    assert "none for z" in urdfkin("imu ur5 --gravity 0,9.81").err


def test_singular_values_print_the_librarys_numbers_in_every_format(tmp_path: Path) -> None:
    robot = library.load("panda")
    words = ["singular-values", "panda", "--frame", "panda_hand", "--rows", "linear", "--q", "random:3"]
    q = robot.sample(3, 0)
    found = robot.singular_values(q, "panda_hand", "linear")
    gradient = found.manipulability_gradient(robot.hessian(q, "panda_hand"))
    document = urdfkin(*words, "--format", "json").data
    assert document["q"] == q.tolist()
    assert document["singular_values"]["lower"] == found.values.lower.tolist()
    assert document["condition"]["upper"] == found.condition.upper.tolist()
    assert document["manipulability"]["value"] == found.manipulability.value.tolist()
    assert document["manipulability_gradient"] == gradient.tolist()
    target = tmp_path / "w.csv"
    done = urdfkin(*words, "--format", "csv", "--output", str(target))
    assert (done.code, "verified by" in done.err) == (0, True)
    rows = list(csv.DictReader(io.StringIO(target.read_text(encoding="utf-8"))))
    assert [float(row["manipulability lower"]) for row in rows] == found.manipulability.lower.tolist()
    assert [float(row["by panda_joint4"]) for row in rows] == gradient[:, 3].tolist()
    text = urdfkin(*words).text
    assert "lower bound" in text
    assert "sample 2" in text


def test_infinite_and_undefined_numbers_are_null_in_json() -> None:
    words = ["singular-values", "planar_two_link", "--rows", "linear", "--q", "0.3,0", "--format", "json"]
    document = urdfkin(*words).data
    assert document["condition"]["upper"] == [None]
    assert document["manipulability_gradient"] == [[None, None]]
    assert [one["rank"] for one in document["singularities"]] == [1]
    assert document["verified"]


def test_a_singularity_is_explained_instead_of_a_gradient() -> None:
    text = urdfkin("singular-values ur5 --frame tool0 --q neutral").text
    assert "Singular within rounding: rank 5 of 6" in text
    assert "Lost direction: rotation of tool0 about (1, 0, 0), in world axes." in text
    assert "wrist_1_joint are parallel and lie in one plane." in text
    assert "nan" not in text
    regular = urdfkin("singular-values ur5 --frame tool0 --q random").text
    assert "ingular within" not in regular
    assert "manipulability changes by" in regular
