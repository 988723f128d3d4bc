"""What it means that a result was verified, and how to spend less on it.

Learn: `verify` per call, `certificate()` as the account of all calls, and the error of a disagreement.
"""

import urdfkin

robot = urdfkin.load("ur10")
q = robot.sample(2000, seed=1)

robot.jacobian(q, robot.tip_frame)  # the default: Pinocchio computes all of it again
robot.placement(q, robot.tip_frame, verify="sample")  # 100 of the 2,000
robot.velocity(q, q, robot.tip_frame, verify=False)  # nobody looks, and the certificate says so

certificate = robot.certificate()
print(certificate)
for line in certificate.lines:
    print(f"{line.quantity}: {line.checked} checked, {line.unchecked} not, worst {line.worst:.2g} eps*scale")

print("verified as a whole:", certificate.verified)
