"""PyTorch Kinematics in a batch, as it comes and through `torch.compile`; it has no accelerations."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator

import numpy as np
import pytorch_kinematics as pk
import torch

from scripts.benchmarking.conventions import positions, spread
from scripts.benchmarking.subject import Subject
from scripts.benchmarking.work import Work

LIBRARY = "pytorch-kinematics"
#: How many configurations at a time; with more it is slower for each.
MOST = 20_000
#: It reads a URDF's angles in single precision.
TOLERANCE = 1e-6
_REMARK = "the path's columns alone; its reader keeps seven digits of angles; all processors"


def batches(subject: Subject, quantity: str) -> Iterator[Work]:
    """Jacobians of the path's joints."""
    if quantity != "jacobian":
        return
    chain = pk.build_serial_chain_from_urdf(subject.urdf, subject.frame).to(dtype=torch.float64)
    columns = positions(subject.robot.joint_names, chain.get_joint_parameter_names())
    n = min(subject.n, MOST)
    q = torch.from_numpy(np.ascontiguousarray(subject.q[:n, columns]))

    def work(who: str, jacobian: Callable[[torch.Tensor], torch.Tensor]) -> Work:
        def result() -> np.ndarray:
            return spread(jacobian(q).numpy(), columns, subject.nv)

        return Work(who, n, lambda: jacobian(q), result, TOLERANCE, _REMARK)

    yield work("PyTorch Kinematics", chain.jacobian)
    if shutil.which("g++"):  # what torch.compile calls
        yield work("PyTorch Kinematics, compiled", torch.compile(chain.jacobian_tensor))
