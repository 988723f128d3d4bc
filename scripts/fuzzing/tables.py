"""Denavit-Hartenberg tables with damaged headers and cells, and the test that reads them."""

from __future__ import annotations

import random
import traceback
from functools import cache

from scripts.fuzzing import COMPARED, Case, Outcome
from urdfkin.dh.compare import compare
from urdfkin.dh.export import export
from urdfkin.dh.parse_table import read_table, reference_path, table_from_text
from urdfkin.errors import UrdfkinError
from urdfkin.model.chain import FrameChain
from urdfkin.robot.loading import load

FAMILY = "tables"
#: For each format of `urdfkin.dh.export`: the suffix of its files.
FORMS = {
    "csv": ".csv",
    "markdown": ".md",
    "latex": ".tex",
    "terminal": ".txt",
    "toml": ".toml",
    "json": ".json",
}
#: Texts that replace a character of the table, to damage it.
PIECES = (
    *",;\t|& \"'\n\\{}[]()_^$-+*/0123456789eqadtheta.\x00\ufeffα",
    "nan",
    "inf",
    "1e400",
    "1e155",
    "(i-1)",
)
#: On average, one of every `_ANYWHERE` changes is at a random place in the whole table.
#: All other changes are near the headings.
_ANYWHERE = 3


@cache
def _sheets() -> dict[str, str]:
    table = read_table(reference_path("ur5"))
    sheets = {ending: export(table, form) for form, ending in FORMS.items()}
    sheets[".tsv"] = "convention: standard\n" + "a\talpha\td\ttheta\n" + "0\tpi/2\t0,1\t0\n" * len(table.rows)
    return sheets


@cache
def _path() -> FrameChain:
    return load("ur5").chain("tool0", "base")


def sheet(seed: int, number: int) -> Case:
    """Return a table of the UR5 with a few characters changed, removed or repeated."""
    rng = random.Random(f"{seed} {FAMILY} {number}")
    ending = rng.choice(sorted(_sheets()))
    text = list(_sheets()[ending])
    head = max("".join(text).find("theta"), 40)
    damages = rng.randint(1, 5)
    for _ in range(damages):
        k = rng.randrange(len(text) if rng.randrange(_ANYWHERE) == 0 else min(head + 20, len(text)))
        kind = rng.random()
        if kind < 0.4:
            text[k] = rng.choice(PIECES)
        elif kind < 0.7:
            del text[k : k + rng.randint(1, 12)]
        else:
            text.insert(k, rng.choice(text) * rng.randint(1, 3))
    return Case(f"a {ending} sheet, damaged in {damages} places", "".join(text).encode(), suffix=ending)


def judge(case: Case) -> Outcome:
    """Test that a table is rejected with a message, or read and compared with the UR5."""
    try:
        table = table_from_text(case.data.decode(), case.suffix)
        compare(_path(), table)
    except UrdfkinError as error:
        return Outcome("refused", str(error))
    except Exception as error:
        return Outcome(f"traceback: {type(error).__name__}", traceback.format_exc())
    return Outcome(COMPARED)
