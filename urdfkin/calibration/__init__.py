"""Which numbers of a model measured poses determine, what they are then, and the model with them in it."""

from __future__ import annotations
