"""Whether two models are the same robot, proven: one idea a file."""

from __future__ import annotations
