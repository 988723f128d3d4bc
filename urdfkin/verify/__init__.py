"""Verification: compare results with an oracle, within derived bounds, and certify the agreement."""
