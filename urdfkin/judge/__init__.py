"""A judge for the last digits: the same quantities at 50 digits, and whose doubles are nearer to them."""

from urdfkin.judge.verdict import Errors, Judgement, Line, judge

__all__ = ["Errors", "Judgement", "Line", "judge"]
