"""Make random measured poses of arms: correct data, and data with degrees or with shifted rows of q.

Correct data must be calibrated and verified; wrong data must be rejected. The data depend only on the seed
and the number, and are stored as JSON.
"""

from __future__ import annotations

import json
import random

import numpy as np

import urdfkin
from scripts.fuzzing import Case, Outcome
from urdfkin.calibration.calibrate import ImplausibleError, calibrate
from urdfkin.calibration.parameters import urdf_model
from urdfkin.kinematics.rotation import exp_rotation

FAMILY = "calibrations"
ARMS = ("ur3", "ur5", "ur10", "panda", "z1", "xarm7", "kinova", "so100", "talos_left_arm", "elbow", "polar")
MISTAKES = ("none", "degrees", "rows one later", "rows one earlier")
_SHIFT = {"rows one later": 1, "rows one earlier": -1}


def calibration(seed: int, number: int) -> Case:
    """Return the random measured poses with a given number."""
    rng = random.Random(f"{seed}:{FAMILY}:{number}")
    drawn = {
        "arm": rng.choice(ARMS),
        "mistake": rng.choice(MISTAKES),
        "complete": rng.random() < 0.5,
        "anywhere": rng.random() < 0.5,
        "poses": rng.randint(25, 60),
        "error": 10.0 ** rng.uniform(-5.0, -2.5),
        "noise": 10.0 ** rng.uniform(-6.0, -3.0),
        "seed": rng.randrange(10**6),
    }
    return Case(f"{drawn['mistake']} on {drawn['arm']}", json.dumps(drawn).encode())


def judge(case: Case) -> Outcome:
    """Test that correct data are calibrated and wrong data are rejected."""
    drawn = json.loads(case.data)
    robot = urdfkin.load(drawn["arm"])
    tip, base = robot.tip_frame, robot.base_frame
    model = urdf_model(robot.tree, tip, base, ("origins",))
    rng, n = np.random.default_rng(drawn["seed"]), drawn["poses"]
    q = robot.sample(n, drawn["seed"])
    truth = drawn["error"] * rng.standard_normal(len(model.way.parameters))
    T = model.way.poses(model.coupling.values(model.coupling.select(robot.tree, q)), truth)
    T[:, :3, :3] = exp_rotation(drawn["noise"] * rng.standard_normal((n, 3))) @ T[:, :3, :3]
    T[:, :3, 3] += drawn["noise"] * rng.standard_normal((n, 3))
    if drawn["mistake"] == "degrees":
        q = np.degrees(q)
    q = np.roll(q, _SHIFT.get(drawn["mistake"], 0), axis=0)
    fit = ["base", "tool", "origins"] if drawn["anywhere"] else ["origins"]
    try:
        found = calibrate(robot, q, T if drawn["complete"] else T[:, :3, 3], tip=tip, base=base, fit=fit)
    except ImplausibleError as error:
        if drawn["mistake"] == "none":
            return Outcome("good measurements are refused", str(error))
        return Outcome("refused", str(error))
    if drawn["mistake"] != "none":
        return Outcome("wrong measurements are calibrated", str(found.fitted and found.fitted.rms()))
    verified = found.certificate is not None and found.certificate.verified
    return Outcome("verified" if verified else "a calibration is not verified")
