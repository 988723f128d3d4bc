"""No mutant between input and result gives a wrong verified result, and no mutant disables the check."""

import pytest

from scripts.mutating.operators import apply_change, replace_code
from tests.attacks.input_to_result_mutants import MODULES, attempt, mutants_of, source_of, truth
from urdfkin.model.tree import FloatArray

#: Mutants that change an order, a direction or an assignment: the function, its code, and the replacement.
CHANGES = [
    # the base's motion
    ("model.base_motion.BaseMotion.state", "self._rotation", "np.swapaxes(self._rotation, -1, -2)"),
    ("model.base_motion.BaseMotion.state", "self.placement[..., :3, 3]", "-self.placement[..., :3, 3]"),
    ("model.base_motion.BaseMotion.state", "self.velocity[..., 3:]", "self.velocity[..., :3]"),
    ("model.base_motion.BaseMotion.state", "self.velocity[..., :3]", "self.acceleration[..., :3]"),
    ("model.base_motion.BaseMotion.state", "self.acceleration[..., 3:]", "-self.acceleration[..., 3:]"),
    ("model.base_motion.BaseMotion.state",
     "np.broadcast_to(part, (*shape, part.shape[-1]))",
     "np.broadcast_to(part, (*shape, part.shape[-1]))[::-1]"),
    ("kinematics.rotation.nearest_rotation",
     "M - M @ (0.5 * defect)", "np.swapaxes(M - M @ (0.5 * defect), -1, -2)"),
    ("kinematics.rotation.nearest_rotation", "M - M @ (0.5 * defect)", "M + M @ (0.5 * defect)"),
    # a call's inputs and its results
    ("verify.call.Call._flatten_input", "array.reshape(self.n, width)", "array.reshape(self.n, width)[::-1]"),
    ("verify.call.Call._flatten_input",
     "np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width)",
     "np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width)[::-1]"),
    ("verify.call.Call.__init__",
     "self.q, *self.rates = flat", "self.q, *self.rates = flat[:1] + flat[:0:-1]"),
    ("verify.call.Call.restore_shape", "result.reshape", "result[::-1].reshape"),
    ("verify.call.Call.flatten_out", "out.reshape", "out.copy().reshape"),
    ("verify.call.Call.__init__",
     "(tree.frame_link(name) for name in self.frames)",
     "(tree.frame_link(name) for name in reversed(self.frames))"),
    ("verify.call._parse_frames", "tuple(frame)[:len(frame)]", "tuple(frame)[::-1]"),
    ("verify.call.Call.__init__", "base.state(self.shape)", "base.state(self.shape)[::-1]"),
    ("verify.call.Call.__init__", "Reference.of(reference)", "Reference.LOCAL_WORLD_ALIGNED"),
    ("verify.call.Call.restore_shape", "1 if self.is_list else 2", "1"),
    ("verify.call._parse_frames", "False, (frame,)", "True, (frame,)"),
    # numbers by name
    ("model.configuration_like.CoordinateLayout._parse_joint", "x[..., k]", "x[..., -1 - k]"),
    ("model.configuration_like.CoordinateLayout._combine_values", "out[..., i] = x", "out[..., i - 1] = x"),
    # configurations, coordinates, mimic joints
    ("model.configuration.with_unit_quaternions",
     "quaternion[...] = normalise_quaternions(quaternion, f'the quaternion of joint {tree.joints[i].name}')",
     "_ = normalise_quaternions(quaternion, f'the quaternion of joint {tree.joints[i].name}')"),
    ("kinematics.rotation.normalise_quaternions", "quat / norms", "quat * norms"),
    ("model.tree.KinematicTree._offsets",
     "(int(own[i]) for i in independent_joints)", "(int(own[i]) for i in range(len(self.joints)))"),
    ("model.tree._sort_names_descending", "reverse=True", ""),
    ("urdf.reader._mimic_rules", "rule.multiplier * end.offset", "end.offset"),
    ("urdf.reader._mimic_rules", "rule.multiplier * end.multiplier", "rule.multiplier"),
    ("urdf.reader._mimic_rules", "end.mimicked_joint", "'b'"),
    ("verify.oracle.resolve_rules", "rule.multiplier * end.offset", "end.offset"),
    ("verify.oracle.resolve_rules", "rule.multiplier * end.multiplier", "rule.multiplier"),
    # the tree and the plan
    ("model.tree.KinematicTree.frame_link",
     "link if link is not None else self._joint_index[name] + 1",
     "joint + 1 if joint is not None else self._link_index[name] - 1"),
    ("urdf.reader._make_joint", "T[:3, 3] = joint.xyz", "T = T.round(9)\nT[:3, 3] = joint.xyz"),
    ("urdf.reader._normalize", "axis / length", "-axis / length"),
    ("compiled.plan._flatten_pose",
     "T[:3, :3].ravel(), T[:3, 3]", "T[:3, :3].ravel(), T[:3, :3].T @ T[:3, 3]"),
    ("compiled.plan._is_rotation_about",
     "(R[axis] == one).all() and (R[:, axis] == one).all()", "R[axis, axis] > 0.9"),
    ("compiled.plan._ProgramWriter._add_transform",
     "Op.TRANSLATE_X + along[0] if len(along) == 1 else Op.TRANSLATE", "Op.TRANSLATE_X + along[0]"),
    ("compiled.plan._ProgramWriter._add_columns",
     "int(self.plan.columns[c, ColumnField.IS_ROTATION]) + 2 * (to != c)",
     "int(self.plan.columns[c, ColumnField.IS_ROTATION])"),
    ("compiled.plan._ProgramWriter._program_angles", "int(self.rules[i] > 0)", "0"),
    ("compiled.plan._anchors", "axis_pose(joint).T", "axis_pose(joint)"),
    ("compiled.plan._steps",
     "anchors[joint.parent].T @ joint.T_parent_joint", "joint.T_parent_joint @ anchors[joint.parent].T"),
    ("compiled.plan._steps", "rule.offset", "-rule.offset"),
    ("compiled.plan._steps", "tree.v_index[i]", "tree.v_index[i] - 1"),
    ("compiled.plan.compile_tree", "anchors[links[place]].step", "-anchors[links[place]].step"),
    ("kinematics.rotation.rotation_with_z_axis",
     "np.stack([*columns, axis], axis=-1)", "-np.stack([*columns, axis], axis=-1)"),
    # a table's URDF
    ("model.path._apply_motion", "motion.turns", "not motion.turns"),
    ("dh.convert.relative_frame_poses", "row.S @ row.X", "row.X @ row.S"),
    ("dh.convert.relative_frame_poses", "T_last_tip @ table.tool", "table.tool @ T_last_tip"),
    ("urdf.writer._write_joint", "rpy_of(T[:3, :3])", "rpy_of(T[:3, :3])[::-1]"),
    ("urdf.writer._write_joint", "format_numbers(T[:3, 3])", "format_numbers(T[:3, :3] @ T[:3, 3])"),
    # Pinocchio's side
    ("verify.oracle.free_flyer_acceleration",
     "acc[..., :3] - np.cross(vel[..., 3:], vel[..., :3])", "acc[..., :3]"),
    ("verify.oracle.PinocchioLayout.__init__", "at[rule.mimicked_joint]", "at[rule.mimicked_joint][::-1]"),
    ("verify.oracle.Frames.find_index", "self._bodies.get(name)", "self._bodies.get(name[5:])"),
    ("verify.oracle.OracleQuery.select.pick",
     "broadcast_x[np.unravel_index(indices, self.shape)]",
     "broadcast_x[np.unravel_index(indices, self.shape)][::-1]"),
    ("verify.oracle.OracleQuery.flatten_result",
     "result.reshape(self.n, len(self.frames), *own_shape)",
     "result.reshape(self.n, len(self.frames), *own_shape)[::-1]"),
]  # fmt: skip


def _split(function: str) -> tuple[str, str]:
    """Return the module below `urdfkin` and the function's name in the module."""
    module = max((name for name in MODULES if f"{function}.".startswith(f"{name}.")), key=len)
    return module, function[len(module) + 1 :]


@pytest.fixture(scope="module")
def right() -> dict[str, FloatArray]:
    return truth()


def test_the_code_of_each_listed_mutant_occurs_once_in_its_function() -> None:
    for function, before, after in CHANGES:
        module, name = _split(function)
        replace_code(source_of(module), name, before, after)


@pytest.mark.long
@pytest.mark.parametrize(("function", "before", "after"), CHANGES)
def test_each_listed_mutant_between_input_and_result_is_detected(
    right: dict[str, FloatArray], function: str, before: str, after: str
) -> None:
    module, name = _split(function)
    assert attempt(module, lambda source: replace_code(source, name, before, after), right) == "caught"


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_no_random_mutant_gives_a_wrong_verified_result_or_disables_the_check(
    right: dict[str, FloatArray], seed: int
) -> None:
    # python -m tests.attacks.input_to_result_mutants runs all mutants
    found = {
        (module, number): attempt(module, lambda source, number=number: apply_change(source, number), right)  # type: ignore[misc]
        for module, number in mutants_of(MODULES, 40, seed)
    }
    assert [mutant for mutant, word in found.items() if word.startswith(("WRONG", "BLIND"))] == []
    assert "caught" in found.values()
