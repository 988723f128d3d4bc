"""Check results against Pinocchio, read the certificate, and check only a part of a large batch.

You learn how to check a single call with `verify`, and how `certificate()` lists all checked calls.
"""

import urdfkin

robot = urdfkin.load("ur10")
q = robot.sample(2000, seed=1)

robot.jacobian(q, robot.tip_frame)  # By default, Pinocchio computes every result again.
robot.placement(q, robot.tip_frame, verify="sample")  # Pinocchio checks 100 of the 2,000.
robot.velocity(q, q, robot.tip_frame, verify=False)  # The certificate counts unchecked results.

certificate = robot.certificate()
print(certificate)
for line in certificate.lines:
    print(
        f"{line.quantity}: {line.checked} checked, {line.unchecked} not checked,"
        f" worst {line.worst:.2g} eps*scale"
    )

print("verified as a whole:", certificate.verified)
