"""Check your own URDF in CI: first its text, then every quantity of every frame against Pinocchio.

You learn that the function `check` checks the text of a URDF, and `validate` checks urdfkin's numbers. On the
command line, use `urdfkin check` and `urdfkin validate`.
"""

import urdfkin
from urdfkin.urdf.lint import Severity

URDF = """<robot name="mine">
  <link name="base"/><link name="arm"/>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.5" rpy="0 1.5708 0"/><axis xyz="0 0 2"/>
    <limit lower="-1" upper="1" effort="10" velocity="1"/>
  </joint>
</robot>"""

findings = urdfkin.check(URDF)
for finding in findings:
    print(finding)
errors = [finding for finding in findings if finding.severity is Severity.ERROR]

report = urdfkin.validate(URDF, samples=100)
robot = report.robots[0]
print(f"{robot.name}: {robot.results} results checked, {robot.failed} outside their bound")
if errors or not report.passed:
    raise SystemExit(1)  # the CI job fails
