"""Compare urdfkin's results with Pinocchio's results, and print the certificate.

You learn how the argument `verify` chooses which results of a call are checked: all, a sample, or none. You
also learn that `certificate()` counts checked and unchecked results.
"""

import urdfkin

robot = urdfkin.load("ur10")
q = robot.sample(2000, seed=1)

robot.jacobian(q, robot.tip_frame)  # By default, Pinocchio checks all 2,000 Jacobians.
robot.placement(q, robot.tip_frame, verify="sample")  # Pinocchio checks 100 of the 2,000 placements.
robot.velocity(q, q, robot.tip_frame, verify=False)  # The certificate counts unchecked results.

certificate = robot.certificate()
print(certificate)
for line in certificate.lines:
    print(
        f"{line.quantity}: {line.checked} checked, {line.unchecked} not checked,"
        f" worst {line.worst:.2g} eps*scale"
    )

print("verified as a whole:", certificate.verified)
