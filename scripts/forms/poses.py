"""Compute the poses of Denavit-Hartenberg tables that are exported as Python code.

    python scripts/forms/poses.py JOBS RESULTS

The JSON file JOBS contains a list of jobs. A job has the entries `form` (name of the format), `text` (Python
code of the table) and `q` (list of configurations). The script computes a pose for each configuration. The
JSON file RESULTS then contains a list of poses for each job.

The interpreter needs the library that the code imports. The script does not import urdfkin, because the
Robotics Toolbox may have its own environment.
"""

import json
import sys
from pathlib import Path
from typing import Any


def compute_poses(form: str, text: str, q: list[list[float]]) -> list[list[list[float]]]:
    scope: dict[str, Any] = {"__name__": "table"}
    exec(compile(text, form, "exec"), scope)
    if form in ("roboticstoolbox", "ets"):
        return [scope["robot"].fkine(configuration).A.tolist() for configuration in q]
    placement = scope["placement"]
    if form == "sympy":
        from sympy import Float

        exact = [placement([Float(x, 30) for x in configuration]) for configuration in q]
        return [[[float(x) for x in row] for row in T.tolist()] for T in exact]
    if form == "casadi":
        from casadi import DM, SX, Function

        symbols = SX.sym("q", len(q[0]))
        function = Function("placement", [symbols], [placement(symbols)])
        return [DM(function(DM(configuration))).full().tolist() for configuration in q]
    return placement(q).tolist()  # type: ignore[no-any-return]


if __name__ == "__main__":
    jobs = json.loads(Path(sys.argv[1]).read_text("utf-8"))
    Path(sys.argv[2]).write_text(json.dumps([compute_poses(**job) for job in jobs]), "utf-8")
