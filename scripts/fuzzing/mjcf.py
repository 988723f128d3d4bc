"""Make random MJCF files with free joints, equality constraints and default classes.

In some files, MuJoCo aligns free bodies with their inertial frames (attributes `alignfree` and `align`), or
fuses static bodies (attribute `fusestatic`).

A file depends only on the seed, its family and its number. MuJoCo computes the pose of each body and site
and checks the equality constraints, independently of urdfkin's MJCF reader.
"""

import random

import mujoco
import numpy as np

from scripts.fuzzing import Case
from scripts.fuzzing.robots import draw_direction, usual_length
from urdfkin.kinematics.roundings import EPS
from urdfkin.model.tree import JointKind, LinkFrame
from urdfkin.robot import Robot

FAMILIES = ("mjcf-free", "mjcf-equalities", "mjcf-classes")
_CLASSES = ("outer", "inner", "other")
#: Tolerance for placements, relative to the sizes of the joint coordinates. The tolerance for equality
#: constraints is 1000 times larger.
_TOLERANCE = 1e-12

# Without this handler, MuJoCo writes its warnings to a log in the current folder.
mujoco.set_mju_user_warning(lambda said: None)


def make_model(seed: int, family: str, number: int) -> Case:
    rng = random.Random(f"{seed}:{family}:{number}")
    return Case(f"{family} {number}", _RandomModel(rng, family).text().encode())


class _RandomModel:
    def __init__(self, rng: random.Random, family: str) -> None:
        self.rng, self.family = rng, family
        self.bodies, self.sites = 0, 0
        self.joints: list[str] = []
        self.degrees = rng.random() < 0.4

    def text(self) -> str:
        rng = self.rng
        trees = "".join(self.body(0) for _ in range(rng.randint(1, 3)))
        attributes = {
            "angle": "degree" if self.degrees else "radian",
            "eulerseq": rng.choice(("xyz", "ZYX", "zxz", "XyZ")),
            "alignfree": rng.choice(("true", "false")),
            "fusestatic": rng.choice(("true", "false", "false")),
            "autolimits": rng.choice(("true", "true", "false")),
        }
        written = [word for word in attributes if word == "angle" or rng.random() < 0.7]
        compiler = " ".join(f'{word}="{attributes[word]}"' for word in written)
        return (
            f'<mujoco model="m"><compiler {compiler}/>{self.defaults()}<worldbody>{trees}</worldbody>'
            f"{self.equalities()}</mujoco>\n"
        )

    def defaults(self) -> str:
        if self.family != "mjcf-classes":
            return ""
        sites = [f'<site pos="{self.vector()}"/>' * (self.rng.random() < 0.5) for _ in _CLASSES]
        outer, inner, other = (f"<joint {' '.join(self.joint_attributes(0.3))}/>{site}" for site in sites)
        outer = f'<default class="outer">{outer}<default class="inner">{inner}</default></default>'
        return f'<default>{outer}<default class="other">{other}</default></default>'

    def body(self, depth: int) -> str:
        rng = self.rng
        name, self.bodies = f"body{self.bodies}", self.bodies + 1
        attributes = [f'name="{name}"', f'pos="{self.vector()}"', self.orientation()]
        if self.family == "mjcf-classes" and rng.random() < 0.4:
            attributes.append(f'childclass="{rng.choice(_CLASSES)}"')
        kind = "joint" if rng.random() < 0.5 else "freejoint"
        align = f'align="{rng.choice(("true", "false", "auto"))}"' if kind == "freejoint" else 'type="free"'
        if depth == 0 and rng.random() < (0.8 if self.family == "mjcf-free" else 0.1):
            parts = [f'<{kind} name="free{self.bodies}" {align}/>']
        else:
            parts = [self.joint() for _ in range(rng.choice((0, 1, 1, 2)))]
        # The axes of inertia of a rotated box are not parallel to the body's axes.
        for _ in range(rng.randint(1, 2)):
            sizes = " ".join(repr(rng.uniform(0.05, 0.5)) for _ in range(3))
            parts.append(f'<geom type="box" size="{sizes}" pos="{self.vector()}" {self.orientation()}/>')
        if rng.random() < 0.2:
            moments = " ".join(repr(1.0 + rng.random()) for _ in range(3))
            parts.append(f'<inertial pos="{self.vector()}" mass="1" diaginertia="{moments}"/>')
        for _ in range(rng.randint(0, 2)):
            pose = f'pos="{self.vector()}" {self.orientation()}' if rng.random() < 0.7 else ""
            parts.append(f'<site name="site{self.sites}"{self.class_attribute()} {pose}/>')
            self.sites += 1
        while depth < 4 and rng.random() < 0.45:
            parts.append(self.body(depth + 1))
        return f"<body {' '.join(attributes)}>{''.join(parts)}</body>"

    def class_attribute(self) -> str:
        named = self.family == "mjcf-classes" and self.rng.random() < 0.4
        return f' class="{self.rng.choice(_CLASSES)}"' if named else ""

    def joint(self) -> str:
        name = f"joint{len(self.joints)}"
        self.joints.append(name)
        return f'<joint name="{name}"{self.class_attribute()} {" ".join(self.joint_attributes(0.7))}/>'

    def joint_attributes(self, share: float) -> list[str]:
        rng = self.rng
        lower, upper = sorted((rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0)))
        large = rng.random() < 0.2
        words = (
            f'type="{rng.choice(("hinge", "hinge", "slide"))}"',
            f'axis="{" ".join(map(repr, draw_direction(rng)))}"',
            f'pos="{self.vector()}"',
            f'ref="{rng.uniform(-2.0, 2.0) * (1e4 if large else 1.0)!r}"',
            f'range="{lower!r} {upper + 0.1!r}" limited="true"',
        )
        return [word for word in words if rng.random() < share]

    def orientation(self) -> str:
        rng = self.rng
        angle = 90.0 if self.degrees else 1.5
        notations = (
            "",
            f'quat="{" ".join(repr(rng.gauss(0.0, 1.0)) for _ in range(4))}"',
            f'euler="{" ".join(repr(rng.uniform(-angle, angle)) for _ in range(3))}"',
            f'axisangle="{" ".join(map(repr, draw_direction(rng)))} {rng.uniform(-angle, angle)!r}"',
            f'xyaxes="1 {rng.random()!r} 0 0 1 {rng.random()!r}"',
        )
        return rng.choice(notations)

    def vector(self) -> str:
        return " ".join(repr(usual_length(self.rng)) for _ in range(3))

    def equalities(self) -> str:
        rng, constraints = self.rng, []
        count = rng.randint(1, 5) if self.family == "mjcf-equalities" else rng.randint(0, 1)
        for i in range(count if len(self.joints) > 1 else 0):
            first, second = rng.sample(self.joints, 2)
            c = [rng.uniform(-1.0, 1.0), rng.choice((1.0, -1.0, 0.0, rng.uniform(-3.0, 3.0))), 0.0, 0.0, 0.0]
            if rng.random() < 0.1:
                c[rng.randint(2, 4)] = rng.uniform(-1.0, 1.0)
            attributes = [f'name="equality{i}"', f'joint1="{first}"']
            attributes += [f'joint2="{second}"'] if rng.random() < 0.9 else []
            attributes += [f'polycoef="{" ".join(map(repr, c))}"'] if rng.random() < 0.9 else []
            attributes += [f'active="{rng.choice(("true", "false"))}"'] if rng.random() < 0.4 else []
            constraints.append(f"<joint {' '.join(attributes)}/>")
        if self.bodies > 1 and rng.random() < 0.2:
            constraints.append('<weld name="glue" body1="body0" body2="body1"/>')
        return f"<equality>{''.join(constraints)}</equality>"


def compile_model(data: bytes) -> mujoco.MjModel | None:
    try:
        return mujoco.MjModel.from_xml_string(data.decode())
    except ValueError:
        return None


def find_difference(robot: Robot, model: mujoco.MjModel, seed: int) -> str | None:
    """Return a message about the first difference from MuJoCo."""
    data = mujoco.MjData(model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    warned = {
        finding.name
        for finding in robot.findings
        if finding.code == "MJCF101" and finding.element == "equality"
    }
    for q in robot.sample(3, seed=seed):
        data.qpos[:] = model.qpos0
        for joint, q_start in zip(robot.tree.joints, robot.tree.q_index, strict=True):
            if joint.kind is JointKind.FIXED:
                continue
            qpos_start, rule = int(model.joint(joint.name).qposadr[0]), joint.mimic
            if joint.kind is JointKind.FLOATING:
                data.qpos[qpos_start : qpos_start + 7] = [
                    *q[q_start : q_start + 3],
                    q[q_start + 6],
                    *q[q_start + 3 : q_start + 6],
                ]
            else:
                data.qpos[qpos_start] = (
                    q[q_start] if rule is None else rule.multiplier * q[q_start] + rule.offset
                )
        mujoco.mj_fwdPosition(model, data)
        large = 10.0 + float(np.abs(data.qpos).max(initial=0.0)) + float(np.abs(model.qpos0).max(initial=0.0))
        # A hinge angle has a rounding error of about EPS * angle, which the lever arm multiplies.
        sizes = np.abs(data.qpos) + np.abs(model.qpos0)
        angle = float(sizes[model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]].sum())
        tolerance = _TOLERANCE * large + EPS * angle * (10.0 + float(sizes.sum()))
        for kind, count in (("body", model.nbody), ("site", model.nsite)):
            for i in range(1 if kind == "body" else 0, count):
                mj_object = getattr(data, kind)(i)
                T = robot.placement(q, LinkFrame.of(mj_object.name))
                error = max(
                    np.abs(T[:3, 3] - mj_object.xpos).max(), np.abs(T[:3, :3].ravel() - mj_object.xmat).max()
                )
                if error > tolerance:
                    return f"{mj_object.name} is off by {error:.3g}"
        for row in np.flatnonzero(data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)):
            i = int(data.efc_id[row])
            name = model.equality(i).name
            if name not in warned and abs(data.efc_pos[row]) > 1e3 * _TOLERANCE * large:
                return f"{name} is off by {data.efc_pos[row]:.3g}"
    return None
