"""The textbook's kinematics. Each equation is written once and works for every kind of number."""
