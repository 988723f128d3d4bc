"""No mutant between input and result gives a wrong verified result, and no mutant disables the check."""

import pytest

from scripts.mutating.operators import mutated, rewritten
from tests.attacks.input_to_result_mutants import MODULES, attempt, mutants_of, source_of, truth
from urdfkin.model.tree import FloatArray

#: Mutants that change an order, a direction or an assignment: the module, its code, and the replacement.
FRAGMENTS = [
    # the base's motion
    ("model.base_motion", "self._rotation.reshape(", "np.swapaxes(self._rotation, -1, -2).reshape("),
    ("model.base_motion", "self.placement[..., :3, 3],", "-self.placement[..., :3, 3],"),
    ("model.base_motion", "  self.velocity[..., 3:],\n", "  self.velocity[..., :3],\n"),
    ("model.base_motion", "  self.velocity[..., :3],\n", "  self.acceleration[..., :3],\n"),
    ("model.base_motion", "  self.acceleration[..., 3:],\n", "  -self.acceleration[..., 3:],\n"),
    ("model.base_motion", "np.broadcast_to(part, (*shape, part.shape[-1]))",
     "np.broadcast_to(part, (*shape, part.shape[-1]))[::-1]"),
    ("kinematics.rotation", "return M - M @ (0.5 * defect)",
     "return np.swapaxes(M - M @ (0.5 * defect), -1, -2)"),
    ("kinematics.rotation", "M - M @ (0.5 * defect)", "M + M @ (0.5 * defect)"),
    # a call's inputs and its results
    ("verify.call", "np.ascontiguousarray(array.reshape(self.n, width))",
     "np.ascontiguousarray(array.reshape(self.n, width)[::-1])"),
    ("verify.call", "np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width)",
     "np.broadcast_to(array, (*self.shape, width)).reshape(self.n, width)[::-1]"),
    ("verify.call", "self.q, *self.rates = flat", "self.q, *self.rates = flat[:1] + flat[:0:-1]"),
    ("verify.call", "return result.reshape(*self.shape,", "return result[::-1].reshape(*self.shape,"),
    ("verify.call", "return out.reshape(self.n", "return out.copy().reshape(self.n"),
    ("verify.call", "tuple(tree.frame_link(name) for name in self.frames)",
     "tuple(tree.frame_link(name) for name in reversed(self.frames))"),
    ("verify.call", "return True, tuple(frame)[: len(frame)]", "return True, tuple(frame)[::-1]"),
    ("verify.call", "base.state(self.shape)", "base.state(self.shape)[::-1]"),
    ("verify.call", "self.reference = Reference.of(reference)",
     "self.reference = Reference.LOCAL_WORLD_ALIGNED"),
    ("verify.call", "result.shape[1 if self.several else 2 :]", "result.shape[1:]"),
    ("verify.call", "return False, (frame,)", "return True, (frame,)"),
    # numbers by name
    ("model.configuration_like", "return {at + k: x[..., k] for k in range(size)}",
     "return {at + k: x[..., -1 - k] for k in range(size)}"),
    ("model.configuration_like", "            out[..., i] = x\n", "            out[..., i - 1] = x\n"),
    # configurations, coordinates, mimic joints
    ("model.configuration", "quaternion[...] = unit_quaternions(", "_ = unit_quaternions("),
    ("kinematics.rotation", "normalised: FloatArray = quat / norms",
     "normalised: FloatArray = quat * norms"),
    ("model.tree", "tuple(int(own[i]) for i in leaders)",
     "tuple(int(own[i]) for i in range(len(self.joints)))"),
    ("model.tree", "return sorted(joints, key=lambda pair: pair[0].name, reverse=True)",
     "return sorted(joints, key=lambda pair: pair[0].name)"),
    ("urdf.reader", "= rule.multiplier * end.offset + rule.offset", "= end.offset + rule.offset"),
    ("urdf.reader", "rule.multiplier * end.multiplier, offset)", "rule.multiplier, offset)"),
    ("urdf.reader", "resolved[name] = Mimic(end.leader,", "resolved[name] = Mimic('b',"),
    ("verify.oracle", "offset = rule.multiplier * end.offset + rule.offset",
     "offset = end.offset + rule.offset"),
    ("verify.oracle", "rule.multiplier * end.multiplier, offset)", "rule.multiplier, offset)"),
    # the tree and the plan
    ("model.tree", "return link if link is not None else self._joint_index[name] + 1",
     "return joint + 1 if joint is not None else self._link_index[name] - 1"),
    ("urdf.reader", "T[:3, 3] = joint.xyz", "T = T.round(9); T[:3, 3] = joint.xyz"),
    ("urdf.reader", "axis if length == 1.0 else axis / length", "axis if length == 1.0 else -axis / length"),
    ("compiled.plan", "T[:3, :3].ravel(), T[:3, 3]))", "T[:3, :3].ravel(), T[:3, :3].T @ T[:3, 3]))"),
    ("compiled.plan", "return bool((R[axis] == one).all() and (R[:, axis] == one).all())",
     "return bool(R[axis, axis] > 0.9)"),
    ("compiled.plan", "op = Op.CARRY_X + along[0] if len(along) == 1 else Op.CARRY",
     "op = Op.CARRY_X + along[0]"),
    ("compiled.plan", "how = int(self.plan.columns[c, ColumnField.TURNS]) + 2 * (to != c)",
     "how = int(self.plan.columns[c, ColumnField.TURNS])"),
    ("compiled.plan", "int(self.rules[i] > 0)", "0"),
    ("compiled.plan", "turned(joint).T, 0.0)", "turned(joint), 0.0)"),
    ("compiled.plan", "anchors[joint.parent].T @ joint.T_parent_joint @ turned(joint)",
     "joint.T_parent_joint @ anchors[joint.parent].T @ turned(joint)"),
    ("compiled.plan", "else (rule.multiplier, rule.offset)", "else (rule.multiplier, -rule.offset)"),
    ("compiled.plan", "steps[row, StepField.V] = tree.v_index[i]",
     "steps[row, StepField.V] = tree.v_index[i] - 1"),
    ("compiled.plan", "order = sorted(range(len(links)), key=lambda place: anchors[links[place]].step)",
     "order = sorted(range(len(links)), key=lambda place: -anchors[links[place]].step)"),
    ("kinematics.rotation", "return np.stack([*columns, axis]", "return -np.stack([*columns, axis]"),
    # a table's URDF
    ("model.path", "    if motion.turns:", "    if not motion.turns:"),
    ("dh.convert", "[row.S @ row.X for", "[row.X @ row.S for"),
    ("dh.convert", "T_last_tip @ table.tool]", "table.tool @ T_last_tip]"),
    ("urdf.writer", "numbers(rpy_of(T[:3, :3]))", "numbers(rpy_of(T[:3, :3])[::-1])"),
    ("urdf.writer", "numbers(T[:3, 3])", "numbers(T[:3, :3] @ T[:3, 3])"),
    # Pinocchio's side
    ("verify.oracle", "linear = acc[..., :3] - np.cross(vel[..., 3:], vel[..., :3])",
     "linear = acc[..., :3]"),
    ("verify.oracle", "*at[rule.leader], rule.multiplier",
     "*at[rule.leader][::-1], rule.multiplier"),
    ("verify.oracle", "body, joint = self._bodies.get(name)",
     "body, joint = self._bodies.get(name[5:])"),
    ("verify.oracle", "return spread[np.unravel_index(numbers, self.shape)]",
     "return spread[np.unravel_index(numbers, self.shape)][::-1]"),
    ("verify.oracle", "return result.reshape(self.n, len(self.frames), *own)",
     "return result.reshape(self.n, len(self.frames), *own)[::-1]"),
]  # fmt: skip


@pytest.fixture(scope="module")
def right() -> dict[str, FloatArray]:
    return truth()


def test_the_code_of_each_listed_mutant_exists_once_in_its_module() -> None:
    for module, before, after in FRAGMENTS:
        rewritten(source_of(module), before, after)


@pytest.mark.long
@pytest.mark.parametrize(("module", "before", "after"), FRAGMENTS)
def test_each_listed_mutant_between_input_and_result_is_detected(
    right: dict[str, FloatArray], module: str, before: str, after: str
) -> None:
    assert attempt(module, lambda source: rewritten(source, before, after), right) == "caught"


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_no_random_mutant_gives_a_wrong_verified_result_or_disables_the_check(
    right: dict[str, FloatArray], seed: int
) -> None:
    # python -m tests.attacks.input_to_result_mutants runs all mutants
    found = {
        (module, number): attempt(module, lambda source, number=number: mutated(source, number), right)  # type: ignore[misc]
        for module, number in mutants_of(MODULES, 40, seed)
    }
    assert [mutant for mutant, word in found.items() if word.startswith(("WRONG", "BLIND"))] == []
    assert "caught" in found.values()
