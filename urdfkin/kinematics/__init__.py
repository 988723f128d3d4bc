"""The chapter's kinematics, each equation written once."""
