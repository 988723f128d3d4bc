"""Find out whether Pinocchio and yourdfpy read a document, in processes that may die.

As a script, this module reads a JSON list of documents from standard input and prints a list of verdicts.
Each document is read in a forked process, because a document may end the process.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence

#: Verdict for each exit status of a forked process.
_VERDICTS = {0: "reads", 1: "refuses"}


def ask(documents: Sequence[str]) -> list[dict[str, str]]:
    """Return `{"pinocchio": ..., "yourdfpy": ...}` for each document: `reads`, `refuses` or `dies`."""
    data, command = json.dumps(list(documents)).encode(), [sys.executable, __file__]
    done = subprocess.run(command, input=data, capture_output=True, check=True, timeout=300)
    verdicts: list[dict[str, str]] = json.loads(done.stdout.splitlines()[-1])
    return verdicts


def _verdict_in_fork(question: Callable[[bytes], object], document: bytes) -> str:
    child = os.fork()
    if child == 0:
        try:
            question(document)
        except BaseException:
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    return _VERDICTS.get(os.waitstatus_to_exitcode(status), "dies")


def _main() -> None:
    import io

    import pinocchio as pin
    from yourdfpy import URDF

    questions: dict[str, Callable[[bytes], object]] = {
        "pinocchio": lambda x: pin.buildModelFromXML(x.decode("utf-8", "surrogateescape")),
        "yourdfpy": lambda x: URDF.load(io.BytesIO(x), build_scene_graph=False, load_meshes=False),
    }
    verdicts = [
        {name: _verdict_in_fork(question, text.encode()) for name, question in questions.items()}
        for text in json.load(sys.stdin)
    ]
    sys.stdout.write("\n" + json.dumps(verdicts) + "\n")


if __name__ == "__main__":
    _main()
