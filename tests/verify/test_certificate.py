"""The certificate counts each returned result exactly once, with any number of threads."""

import copy
import hashlib
import json
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

import urdfkin
from tests.laws.subjects import state
from urdfkin.errors import InputError
from urdfkin.robot import Robot
from urdfkin.verify.certificate import CHECK_DISABLED, Certificate
from urdfkin.verify.comparison import BatchComparison
from urdfkin.verify.pinocchio import PinocchioOracle

FRAME = "panda_hand"


@pytest.fixture(scope="module")
def panda() -> Robot:
    return urdfkin.load("panda", verify=False)


@pytest.fixture
def robot(panda: Robot) -> Robot:
    return copy.deepcopy(panda)


@pytest.fixture
def often() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def counts(robot: Robot) -> dict[str, tuple[int, int]]:
    """Return the checked and unchecked results of each quantity."""
    return {str(line.quantity): (line.checked, line.unchecked) for line in robot.certificate().lines}


def test_the_certificate_counts_calls_of_every_kind(robot: Robot) -> None:
    q, v, a = state(robot, 1, 1)
    one = q[0], v[0], a[0]
    fast = robot.prepare(FRAME, "local")
    for _ in range(3):
        fast.placement(one[0])
        fast.velocity(*one[:2])
        fast.jacobian(one[0].tolist())  # without the fast function
        fast.acceleration(*one)
    assert counts(robot) == dict.fromkeys(("placement", "velocity", "jacobian", "acceleration"), (0, 3))
    robot.placement(one[0], FRAME)
    robot.placement(one[0], FRAME, verify=True)
    robot.placement(one[0], robot.link_frames)
    robot.placement(one[0], [FRAME, "panda_link2"], verify=True)
    robot.placement(np.repeat(q, 7, axis=0), FRAME)
    fast.placement(np.repeat(q, 5, axis=0))
    assert counts(robot)["placement"] == (1 + 2, 3 + 1 + len(robot.link_names) + 7 + 5)
    robot.velocity(one[0], np.repeat(v, 4, axis=0), FRAME)
    assert counts(robot)["velocity"] == (0, 3 + 4)
    assert robot.certificate().not_verified == (CHECK_DISABLED,)


def test_the_certificate_does_not_count_refused_calls(robot: Robot) -> None:
    q = robot.neutral()
    bad = np.full(robot.nq, np.nan)
    fast = robot.prepare(FRAME)
    calls: list[Callable[[], object]] = [
        lambda: fast.placement(bad), lambda: fast.velocity(q, bad), lambda: fast.jacobian(q[:3]),
        lambda: fast.jacobian(q, out=np.zeros((6, 9))), lambda: fast.acceleration(q, q, bad),
        lambda: robot.jacobian(bad, FRAME), lambda: robot.placement(bad, robot.link_frames),
        lambda: robot.velocity(q, q, FRAME, out=q),
    ]  # fmt: skip
    for compute in calls:
        with pytest.raises(InputError):
            compute()
    assert robot.certificate().lines == ()
    assert robot.certificate().not_verified == ()


@pytest.mark.parametrize("prepared", [False, True])
def test_a_certificate_is_not_verified_after_a_disagreement(
    prepared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = urdfkin.load("planar_two_link")
    q = np.array([0.3, 0.4])
    robot.jacobian(q, "tip")
    compute = robot.prepare("tip", verify=True).placement if prepared else robot.placement
    right = PinocchioOracle.placements
    monkeypatch.setattr(PinocchioOracle, "placements", lambda *x: right(*x) + 1e-9)
    with pytest.raises(urdfkin.VerificationError):
        compute(q)
    certificate = robot.certificate()
    assert counts(robot) == {"placement": (0, 0), "jacobian": (1, 0)}
    assert certificate.lines[0].bound_ratio > 1.0
    assert not certificate.verified


def test_unchecked_calls_of_a_prepared_frame_and_checked_calls_have_one_certificate(robot: Robot) -> None:
    q = robot.sample(10, 2)
    assert not robot.certificate().verified
    robot.jacobian(q, FRAME, verify=True)
    assert robot.certificate().verified
    fast = robot.prepare(FRAME)
    certificate = robot.certificate()
    assert certificate.verified  # preparing returns no result
    assert certificate.oracle.startswith("Pinocchio 4.")
    assert 0.0 < certificate.lines[0].worst < 100.0
    assert 0.0 < certificate.lines[0].bound_ratio < 1.0
    fast.jacobian(q[0])
    robot.velocity(q, q, FRAME)
    certificate = robot.certificate()
    assert not certificate.verified
    assert counts(robot) == {"velocity": (0, 10), "jacobian": (10, 1)}
    assert "velocity: 0 checked" in str(certificate)
    assert "1 not checked" in str(certificate)


@pytest.mark.slow
@pytest.mark.usefixtures("often")
def test_eight_threads_have_the_counts_and_results_of_one_thread(robot: Robot) -> None:
    q, v, a = state(robot, 16, 3)
    fast = robot.prepare(FRAME), robot.prepare("panda_link5", "local")
    expected = [robot.prepare(FRAME).jacobian(x) for x in q]
    before = counts(robot)["jacobian"][1]
    rounds = 400

    def work(thread: int) -> bool:
        k, good = thread % 16, True
        for turn in range(rounds):
            k = (k + 7) % 16
            good &= bool((fast[0].jacobian(q[k]) == expected[k]).all())
            fast[1].acceleration(q[k], v[k], a[k])
            robot.jacobian(q[k], FRAME)
            if turn % 20 == 0:
                robot.jacobian(q, FRAME)
                robot.placement(q[:2], [FRAME, "panda_link1", "panda_link2"])
                robot.velocity(q[:3], v[:3], FRAME, verify=True)
                robot.certificate()
        return good

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(8)))
    few = rounds // 20
    assert counts(robot) == {
        "placement": (0, 8 * few * 6),
        "velocity": (8 * few * 3, 0),
        "jacobian": (0, before + 8 * (2 * rounds + few * 16)),
        "acceleration": (0, 8 * rounds),
    }


def test_a_certificate_states_the_file_name_and_the_digest_and_can_be_saved(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(urdfkin.load("elbow").urdf)
    robot = urdfkin.load(file)
    robot.placement(robot.neutral(), "tool")
    certificate = robot.certificate()
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert (certificate.sha256, certificate.source) == (digest, str(file))
    assert digest in str(certificate)
    assert f"computed by urdfkin {metadata.version('urdfkin')}" in str(certificate)
    assert (robot.sha256, robot.path) == (digest, str(file))
    certificate.save(tmp_path / "certificate.json")
    data = json.loads((tmp_path / "certificate.json").read_text())
    assert data == certificate.as_dict()
    assert (data["verdict"], data["sha256"], data["lines"][0]["checked"]) == ("verified", [digest], 1)
    assert urdfkin.load(file.read_text()).path is None


@pytest.mark.parametrize("reading", ["", "MuJoCo 4.0.0 at 9 configurations"])
def test_a_certificate_states_the_check_of_the_reader_if_there_was_a_check(reading: str) -> None:
    certificate = Certificate("arm", "Pinocchio 4.1.0", (), (), source_notes=reading)
    for text in (str(certificate), certificate._repr_markdown_(), certificate._repr_html_()):
        assert ("read: " in text.lower()) == bool(reading)
        assert reading in text


@pytest.mark.parametrize("other", [0.5, 7.0, np.inf, np.nan])
def test_a_fraction_of_the_bound_that_is_nan_is_preserved_in_a_sum_of_comparisons(other: float) -> None:
    wrong, right = BatchComparison(1, np.nan, np.nan, (3,)), BatchComparison(2, 1.0, other, (4,))
    for both in (wrong + right, right + wrong):
        assert np.isnan(both.bound_ratio)
        assert np.isnan(both.worst)
        assert not both.agrees
        assert both.result_count == 3
    assert (wrong + BatchComparison()).index == (BatchComparison() + wrong).index == (3,)


def test_a_sum_of_equal_comparisons_has_the_index_of_the_first() -> None:
    first, second = BatchComparison(1, 0.5, 0.5, (3,)), BatchComparison(1, 0.5, 0.5, (4,))
    assert (first + second).index == (3,)
    assert (second + first).index == (4,)
