"""A worker process that reads its answers from files. It starts fast, because it does not import urdfkin."""

import hashlib
import os
import time
from multiprocessing.connection import Connection
from pathlib import Path


def file_name(chunk: bytes) -> str:
    return hashlib.sha256(chunk).hexdigest()


def serve(pipe: int, _: int) -> None:
    connection, folder = Connection(pipe), Path(os.environ["URDFKIN_TEST_ANSWERS"])
    try:
        while True:
            answer = (folder / file_name(connection.recv_bytes())).read_bytes()
            time.sleep(0.01)
            connection.send_bytes(answer)
    except EOFError:
        os._exit(0)
