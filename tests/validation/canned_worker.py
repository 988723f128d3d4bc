"""A worker that knows each answer beforehand and imports nothing: many can be killed in little time."""

import hashlib
import os
import time
from multiprocessing.connection import Connection
from pathlib import Path


def name(chunk: bytes) -> str:
    """The file of an answer."""
    return hashlib.sha256(chunk).hexdigest()


def serve(pipe: int, _: int) -> None:
    """As the worker's."""
    connection, folder = Connection(pipe), Path(os.environ["URDFKIN_TEST_ANSWERS"])
    try:
        while True:
            found = (folder / name(connection.recv_bytes())).read_bytes()
            time.sleep(0.01)
            connection.send_bytes(found)
    except EOFError:
        os._exit(0)
