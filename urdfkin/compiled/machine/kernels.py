"""The compiled recursions, one for each function of the module `recursions`.

A kernel computes eight configurations at a time, one in each lane of a vector register. A single
configuration is computed in all eight lanes, so its result is exactly the same as in a batch.
"""

from __future__ import annotations

from typing import Any

from urdfkin.compiled import outputs, recursion, recursions
from urdfkin.compiled.machine import compiled_equations, memory, numbers, sine
from urdfkin.compiled.machine.compiling import CKernel, inline
from urdfkin.kinematics.arithmetic import rebind_functions

#: Compiled objects that replace Python objects of the same name.
_REPLACEMENTS = {
    name: x for part in (numbers, memory, sine) for name, x in vars(part).items() if not name.startswith("_")
} | {"eq": compiled_equations}
_INLINED_FUNCTIONS: dict[str, Any] = rebind_functions(
    recursion, outputs, decorate=inline, replacements=_REPLACEMENTS
)
_KERNELS: dict[str, CKernel] = rebind_functions(recursions, decorate=CKernel, replacements=_INLINED_FUNCTIONS)

placements, velocities, accelerations = (
    _KERNELS[name] for name in ("placements", "velocities", "accelerations")
)
local_velocities, local_accelerations = _KERNELS["local_velocities"], _KERNELS["local_accelerations"]
jacobians, jacobian_rates = _KERNELS["jacobians"], _KERNELS["jacobian_rates"]
hessians, imus = _KERNELS["hessians"], _KERNELS["imus"]
