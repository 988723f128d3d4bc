"""The textbook's kinematics: each equation is written once, for every kind of number."""
