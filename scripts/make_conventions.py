"""Write docs/conventions.md: the conventions of urdfkin, Pinocchio and MuJoCo, determined by experiment.

For most rows, each library computes a result for a random motion of a robot, and the script computes the same
quantity by several definitions. Exactly one definition must agree with the library's result, and the page
shows this definition. A test checks that the page is current.

The tables of other tools come from urdfkin/model/conventions/conventions.toml. With --measure, the script
first runs each installed library on all robots of the catalogue, and writes the results to conventions.toml.
Each library uses its own convention.

    python scripts/make_conventions.py
    python scripts/make_conventions.py --measure
"""

import re
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

import urdfkin
from scripts.pages import DOCS, insert_parts, table
from urdfkin.model.conventions import Convention, find_convention
from urdfkin.model.conventions.convention import _load_built_in, spell_name
from urdfkin.model.tree import FloatArray
from urdfkin.urdf.catalogue import catalogue

PAGE = DOCS / "conventions.md"
DATA = Path(__file__).parents[1] / "urdfkin" / "model" / "conventions" / "conventions.toml"

_LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'
_BODY = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def _joint(name: str, kind: str, parent: str, child: str, more: str = "") -> str:
    limit = "" if kind in ("floating", "fixed", "continuous") else _LIMIT
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.3 -0.2 0.5" rpy="0.4 0.5 0.6"/>{limit}{more}</joint>'
    )


def _robot(*joints: str) -> str:
    """Return a robot whose links MuJoCo does not merge."""
    links = "".join(f'<link name="{name}">{_BODY}</link>' for name in ("base", *(f"l{i}" for i in (1, 2, 3))))
    compiler = '<mujoco><compiler fusestatic="false"/></mujoco>'
    return f'<robot name="r">{compiler}{links}{"".join(joints)}</robot>'


ARM = _robot(  # The joints are in reverse alphabetical order.
    _joint("c", "revolute", "base", "l1", '<axis xyz="0 0 1"/>'),
    _joint("b", "revolute", "l1", "l2", '<axis xyz="0 1 0"/>'),
    _joint("a", "revolute", "l2", "l3", '<axis xyz="0.6 0 0.8"/>'),
)
#: A robot with two branches, which shows the order of coordinates.
TREE = _robot(
    _joint("z", "revolute", "base", "l1"),
    _joint("a", "revolute", "base", "l2"),
    _joint("k", "revolute", "l1", "l3"),
)
CONTINUOUS = _robot(
    *(_joint(f"j{i}", "continuous", "base" if i == 1 else f"l{i - 1}", f"l{i}") for i in (1, 2, 3))
)
MIMIC = _robot(
    _joint("a", "revolute", "base", "l1"),
    _joint("b", "revolute", "l1", "l2", '<mimic joint="a" multiplier="0.5" offset="0.1"/>'),
    _joint("c", "revolute", "l2", "l3"),
)
MIXED_MIMIC = _robot(
    _joint("a", "revolute", "base", "l1"),
    _joint("b", "continuous", "l1", "l2", '<mimic joint="a"/>'),
    _joint("c", "revolute", "l2", "l3"),
)
MASSLESS, NEGATIVE_MASS = ARM.replace(_BODY, ""), ARM.replace('value="1"', 'value="-1"')
#: MuJoCo's free joint connects a body to the world only.
FREE = (
    '<mujoco><worldbody><body name="l1" pos="0 0 0"><freejoint name="f"/>'
    '<inertial pos="0.1 0.2 0.3" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>'
)
FREE_URDF = '<robot name="r"><link name="base"/><link name="l1"/>' + (
    '<joint name="f" type="floating"><parent link="base"/><child link="l1"/></joint></robot>'
)


_TABLES = (
    ("urdfkin", "pinocchio", "mujoco", "drake", "idyntree", "rtb", "kdl"),
    ("isaaclab", "isaaclab3", "isaacgym", "newton", "newton-usd", "usd", "ros"),
)
#: Maps a library's name to the name of its package in the package index, if the two names differ.
_DISTRIBUTIONS = {
    "pinocchio": "pin",
    "rtb": "roboticstoolbox-python",
    "newton-usd": "newton",
    "usd": "usd-exchange",
}

Readings = Mapping[str, FloatArray]


def find_definition(found: FloatArray, readings: Readings) -> str:
    named = [
        name for name, x in readings.items() if found.shape == x.shape and np.allclose(found, x, 1e-6, 1e-6)
    ]
    if len(named) != 1:
        raise ValueError(f"{found} is {named or 'none'} of {list(readings)}")
    return named[0]


#: A row of the table: a convention, and the results of urdfkin, Pinocchio and MuJoCo.
Row = tuple[str, str, str, str]


class MeasuredMotion:
    """A motion that libraries compute, and that difference quotients compute independently."""

    def __init__(self, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.q, self.v, self.a = rng.uniform(-1.0, 1.0, (3, 3))
        self.robot = urdfkin.load(ARM)
        self.model: Any = pin.buildModelFromXML(ARM)
        self.data = self.model.createData()
        pin.forwardKinematics(self.model, self.data, self.q, self.v, self.a)
        pin.updateFramePlacements(self.model, self.data)
        pin.computeJointJacobians(self.model, self.data, self.q)
        self.frame = self.model.getFrameId("l3")
        self.mj_model: Any = mujoco.MjModel.from_xml_string(ARM)
        self.mj_data = mujoco.MjData(self.mj_model)
        self.mj_data.qpos[:], self.mj_data.qvel[:] = self.q, self.v
        mujoco.mj_fwdPosition(self.mj_model, self.mj_data)
        mujoco.mj_fwdVelocity(self.mj_model, self.mj_data)
        self.mj_data.qacc[:] = self.a
        mujoco.mj_rnePostConstraint(self.mj_model, self.mj_data)
        self.body = self.mj_model.body("l3").id

    def path(self, t: float) -> FloatArray:
        """Return T_world_frame at time t."""
        return self.robot.placement(self.q + self.v * t + self.a * t * t / 2.0, "l3")

    def motion(self) -> tuple[FloatArray, ...]:
        """Return (R, p, velocity, w, acceleration, alpha), in world axes."""
        h = 1e-3
        T = {i: self.path(i * h) for i in (-2, -1, 0, 1, 2)}
        rate = (T[-2] - 8.0 * T[-1] + 8.0 * T[1] - T[2]) / (12.0 * h)
        rate_2 = (-T[-2] + 16.0 * T[-1] - 30.0 * T[0] + 16.0 * T[1] - T[2]) / (12.0 * h * h)
        R = T[0][:3, :3]

        def axial(S: FloatArray) -> FloatArray:
            return np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]]) / 2.0

        w, alpha = (axial(x[:3, :3] @ R.T) for x in (rate, rate_2))
        return R, T[0][:3, 3], rate[:3, 3], w, rate_2[:3, 3], alpha

    def velocity_readings(self) -> dict[str, FloatArray]:
        R, p, v, w, _, _ = self.motion()
        points = {
            "velocity of the frame's origin, in world axes": (v, w),
            "velocity of the frame's origin, in the frame's axes": (R.T @ v, R.T @ w),
            "velocity of the body point at the world's origin, in world axes": (v - np.cross(w, p), w),
        }
        linear_first = {f"[linear; angular] {name}": np.concatenate(parts) for name, parts in points.items()}
        other = {f"[angular; linear] {name}": np.concatenate(parts[::-1]) for name, parts in points.items()}
        return linear_first | other

    def acceleration_readings(self, *, flipped: bool) -> dict[str, FloatArray]:
        _, _, v, w, a, alpha = self.motion()
        up, spatial = np.array([0.0, 0.0, 9.81]), a - np.cross(w, v)
        linear = {
            "classical: the second derivative of the origin's position": a,
            "spatial: the classical acceleration minus w x v": spatial,
            "the classical acceleration plus 9.81 m/s^2 upwards because of gravity": a + up,
            "the spatial acceleration plus 9.81 m/s^2 upwards because of gravity": spatial + up,
        }
        return {name: np.concatenate((alpha, x) if flipped else (x, alpha)) for name, x in linear.items()}

    def mujoco_vector(self, function: Callable[..., None], local: int) -> FloatArray:
        six = np.empty(6)
        function(self.mj_model, self.mj_data, mujoco.mjtObj.mjOBJ_XBODY, self.body, six, local)
        return six


def measure_rows() -> Iterator[Row]:
    yield from _motion_rows(MeasuredMotion())
    yield from _layout_rows()
    yield from _free_body_rows()


def _motion_rows(measured: MeasuredMotion) -> Iterator[Row]:
    robot, readings, frame = (
        measured.robot,
        measured.velocity_readings(),
        (measured.model, measured.data, measured.frame),
    )
    for name, local in (("local_world_aligned", 0), ("local", 1), ("world", None)):
        theirs = pin.getFrameVelocity(*frame, getattr(pin, name.upper())).vector
        mujocos = "not available"
        if local is not None:
            velocity = measured.mujoco_vector(mujoco.mj_objectVelocity, local)
            mujocos = f"{find_definition(velocity, readings)} (`flg_local={local}`)"
        ours = robot.velocity(measured.q, measured.v, "l3", name)
        yield (
            f"velocity, `{name}`",
            find_definition(ours, readings),
            find_definition(theirs, readings),
            mujocos,
        )
    columns = np.zeros((6, 3))  # MuJoCo's Jacobian of the body's origin: rows `jacp`, then rows `jacr`
    position = measured.mj_data.xpos[measured.body]
    mujoco.mj_jac(measured.mj_model, measured.mj_data, columns[:3], columns[3:], position, measured.body)
    yield (
        "product of a Jacobian and the joint velocities",
        find_definition(robot.jacobian(measured.q, "l3") @ measured.v, readings),
        find_definition(pin.getFrameJacobian(*frame, pin.LOCAL_WORLD_ALIGNED) @ measured.v, readings),
        f"`mj_jac`, `jacp` above `jacr`: {find_definition(columns @ measured.v, readings)}",
    )
    _, p, v, w, _, _ = measured.motion()
    com = measured.mj_data.subtree_com[measured.mj_model.body_rootid[measured.body]]
    at_com = "[angular; linear] velocity of the body point at the tree's centre of mass, in world axes"
    points = {
        at_com: np.concatenate((w, v + np.cross(w, com - p))),
        "[angular; linear] velocity of the frame's origin, in world axes": np.concatenate((w, v)),
    }
    stored = measured.data.v[measured.model.frames[measured.frame].parentJoint].vector
    yield (
        "velocity stored in the data structure",
        "none",
        f"`data.v`: {find_definition(stored, readings)}",
        f"`cvel`: {find_definition(np.array(measured.mj_data.cvel[measured.body]), points)}",
    )
    linear_first = measured.acceleration_readings(flipped=False)
    result = find_definition(robot.acceleration(measured.q, measured.v, measured.a, "l3"), linear_first)
    spatial, classical = (
        find_definition(get(*frame, pin.LOCAL_WORLD_ALIGNED).vector, linear_first)
        for get in (pin.getFrameAcceleration, pin.getFrameClassicalAcceleration)
    )
    six = measured.mujoco_vector(mujoco.mj_objectAcceleration, 0)
    of_mujoco = find_definition(six, measured.acceleration_readings(flipped=True))
    yield (
        "acceleration, in world axes",
        f"`acceleration`: {result}",
        f"`getFrameAcceleration`: {spatial}; `getFrameClassicalAcceleration`: {classical}",
        f"`mj_objectAcceleration`: {of_mujoco}, [angular; linear]",
    )


def _name_order(names: Iterable[str]) -> str:
    orders = {
        "azk": "depth first, sibling joints by name",
        "zka": "depth first, in file order",
        "zak": "in file order",
        "akz": "by name",
    }
    return orders["".join(names)]


def _layout_rows() -> Iterator[Row]:
    tree_model, continuous_model, mimic_model = (
        mujoco.MjModel.from_xml_string(text) for text in (TREE, CONTINUOUS, MIMIC)
    )
    data = mujoco.MjData(mimic_model)
    data.qpos[:] = 0.7, 0.0, 0.0
    mujoco.mj_kinematics(mimic_model, data)
    mujocos = "coupled"
    if data.qpos[1] == 0.0 and mimic_model.neq == 1:
        mujocos = (
            f"independent, {mimic_model.nq} coordinates; {mimic_model.neq} constraint, in the dynamics only"
        )
    free, coupled = (pin.buildModelFromXML(MIMIC, mimic=mimic) for mimic in (False, True))
    yield (
        "order of coordinates",
        _name_order(urdfkin.load(TREE).coordinate_names),
        _name_order(list(pin.buildModelFromXML(TREE).names)[1:]),
        _name_order(tree_model.joint(i).name for i in range(tree_model.njnt)),
    )
    yield (
        "numbers in q for a continuous joint",
        f"{urdfkin.load(CONTINUOUS).nq // 3}, the angle",
        f"{pin.buildModelFromXML(CONTINUOUS).nq // 3}, its cosine and sine",
        f"{continuous_model.nq // 3}, the angle",
    )
    yield (
        "a joint with `<mimic>`",
        f"coupled: {urdfkin.load(MIMIC).nq} coordinates for 3 joints",
        f"independent, {free.nq} coordinates; coupled with `mimic=True`, {coupled.nq}",
        mujocos,
    )
    yield "a continuous joint with `<mimic>` of a revolute joint", *_read_answers(MIXED_MIMIC)
    yield "a moving link without `<inertial>`", *_read_answers(MASSLESS)
    yield "a link with negative mass", *_read_answers(NEGATIVE_MASS)


def _read_answers(text: str) -> tuple[str, str, str]:

    def reads(load: Callable[..., object], **options: bool) -> bool:
        try:
            load(text, **options)
        except ValueError:
            return False
        return True

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ours = "read" if reads(urdfkin.load, verify=False) else "refused"
    codes = sorted({code for w in caught for code in re.findall(r"URDF\d+", str(w.message))})
    theirs = "read" if reads(pin.buildModelFromXML) else "refused"
    if theirs == "read" and not reads(pin.buildModelFromXML, mimic=True):
        theirs = "read; with `mimic=True` refused"
    mujocos = "read" if reads(mujoco.MjModel.from_xml_string) else "refused"
    return f"{ours}, with {', '.join(codes)}" if codes else ours, theirs, mujocos


def _free_body_rows() -> Iterator[Row]:
    rng = np.random.default_rng(1)
    xyzw = rng.normal(size=4)
    xyzw /= np.linalg.norm(xyzw)
    p, rates = rng.normal(size=3), rng.normal(size=6)
    q, robot = np.array([*p, *xyzw]), urdfkin.load(FREE_URDF)
    model: Any = pin.buildModelFromXML(FREE_URDF)
    data, frame = model.createData(), model.getFrameId("l1")
    mj_model: Any = mujoco.MjModel.from_xml_string(FREE)
    mj_data = mujoco.MjData(mj_model)

    def mujocos(qpos: FloatArray) -> FloatArray:
        mj_data.qpos[:], mj_data.qvel[:] = qpos, rates
        mujoco.mj_fwdPosition(mj_model, mj_data)
        mujoco.mj_fwdVelocity(mj_model, mj_data)
        return np.array(mj_data.xmat[1].reshape(3, 3))

    def pinocchios(q: FloatArray) -> FloatArray:
        pin.framesForwardKinematics(model, data, q)
        return np.array(data.oMf[frame].rotation)

    R = robot.placement(q, "l1")[:3, :3]
    orders = {
        "x, y, z, then qx, qy, qz, qw": q,
        "x, y, z, then qw, qx, qy, qz": np.array([*p, *np.roll(xyzw, 1)]),
    }
    rotations = (lambda q: robot.placement(q, "l1")[:3, :3]), pinocchios, mujocos
    ours, theirs, third = (
        find_definition(R, {name: R_of(q) for name, q in orders.items()}) for R_of in rotations
    )
    yield "q of a free body", ours, theirs, third
    axes = {
        "both in the body's axes": np.concatenate((R @ rates[:3], R @ rates[3:])),
        "linear in world axes, angular in the body's axes": np.concatenate((rates[:3], R @ rates[3:])),
        "both in world axes": rates,
    }
    six = np.empty(6)
    mujoco.mj_objectVelocity(mj_model, mj_data, mujoco.mjtObj.mjOBJ_XBODY, 1, six, 0)
    pin.forwardKinematics(model, data, q, rates)
    of_pinocchio = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).vector
    velocities = robot.velocity(q, rates, "l1"), of_pinocchio, np.roll(six, 3)
    yield (
        "v of a free body",
        find_definition(velocities[0], axes),
        find_definition(velocities[1], axes),
        find_definition(velocities[2], axes),
    )


def _make_table(names: tuple[str, ...]) -> str:
    columns = [_make_cells(find_convention(name)) for name in names]
    heads = ["", *(f"{find_convention(name).title} (`{name}`)" for name in names)]
    return table(heads, [(what, *(column[what] for column in columns)) for what in columns[0]])


def _make_cells(convention: Convention) -> dict[str, str]:
    order = {"given": "no known rule", "name": "by name", "file": "that of the file"}.get(
        convention.order, convention.order.replace("file", "place in the file")
    )
    parts = ["x, y, z", f"q{', q'.join(convention.quaternion)}"]
    q = ", then ".join(parts if convention.base_q == "position first" else parts[::-1])
    axes = {"body": "its own axes", "parent": "world axes"}
    v = [f"linear in {axes[convention.linear]}", f"angular in {axes[convention.angular]}"]
    v = v if convention.base_v == "linear first" else v[::-1]
    free = convention.name not in ("rtb", "kdl")
    links = "".join(
        f" [{k}]({source.split(' ', maxsplit=1)[0].rstrip(':')})"
        for k, source in enumerate(convention.sources, 1)
    )
    return {
        "order of joints": order,
        "names of joints": {"urdf": "those of the URDF", "usd": "USD, `1` is `tn__1_`"}.get(
            convention.names, f"identifiers, `1` is `{spell_name('1', convention.names)}`"
        ),
        "q of a continuous joint": "the angle" if convention.continuous == 1 else "its cosine and sine",
        "unit of angles": convention.angle,
        "mimic joint": "own coordinate" if convention.mimic == "own" else "none",
        "q of a free body": q if free else "not available",
        "v of a free body": f"{', '.join(v)}{', at the centre of mass' * (convention.point != 'origin')}"
        if free
        else "not available",
        "six-vector": "[linear; angular]"
        if convention.six_vectors == "linear first"
        else "[angular; linear]",
        "evidence": (f"measured: {convention.measurement}" if convention.measurement else convention.evidence)
        + links,
    }


def write_measurements() -> None:
    from tests.model.conventions.libraries import LIBRARIES

    for name, library in LIBRARIES.items():
        package = _DISTRIBUTIONS.get(name, name)
        try:
            line = f'measurement = "{package} {metadata.version(package)}, {_measure_library(name, library)}"'
        except metadata.PackageNotFoundError:
            continue
        head, mark, rest = DATA.read_text("utf-8").partition(f"[{name}]\n")
        section, blank, others = rest.partition("\n\n")
        section = re.sub(r"\nmeasurement = .*", "", section).replace(
            'evidence = "measured"', f'evidence = "measured"\n{line}'
        )
        DATA.write_text(head + mark + section + blank + others, "utf-8")


def _measure_library(name: str, make: Callable[[Any, Path], Any]) -> str:
    from tests.model.conventions.test_libraries import _conversion, _differences, _loaded

    agree, worst, share, robots = 0, 0.0, 0.0, sorted(catalogue())
    for name_of_robot in robots:
        robot = _loaded(name_of_robot, name)
        with tempfile.TemporaryDirectory() as folder:
            try:
                library = make(robot, Path(folder))
                conversion = _conversion(robot, name, library)
                pairs = list(_differences(robot, library, conversion))
            except Exception as error:
                print(f"{name}: {name_of_robot}: {type(error).__name__}: {str(error)[:200]}")
                continue
        bad = any((errors > bound).any() for errors, bound in pairs)
        if bad or list(conversion.joint_names) != library.names:
            print(f"{name}: {name_of_robot}: different")
            continue
        agree += 1
        worst = max(worst, *(float(errors.max(initial=0.0)) for errors, _ in pairs))
        share = max(share, *(float((x[bound > 0] / bound[bound > 0]).max(initial=0.0)) for x, bound in pairs))
    return f"{agree} of {len(robots)} robots, at most {worst:.0e} off, {100 * share:.2g} % of the bound"


def make_page() -> str:
    heads = ("", "urdfkin", f"Pinocchio {pin.__version__}", f"MuJoCo {mujoco.__version__}")
    tools = "\n\n".join(map(_make_table, _TABLES))
    return insert_parts(PAGE.read_text("utf-8"), measured=table(heads, measure_rows()), tools=tools)


if __name__ == "__main__":
    if "--measure" in sys.argv[1:]:
        write_measurements()
        _load_built_in.cache_clear()
    PAGE.write_text(make_page(), "utf-8")
