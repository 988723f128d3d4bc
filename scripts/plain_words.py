"""List words that readers did not understand, each with a plain form, and list sentences that are too long.

    python scripts/plain_words.py [PATH ...]         # words of the list; exit 1 if there is one
    python scripts/plain_words.py --long [PATH ...]  # sentences of more than 30 words, for information
    python scripts/plain_words.py --sample 50 --seed 1             # random sentences, for a reader
    python scripts/plain_words.py --sample 50 --seed 1 --places    # the same sentences, with their places

The script reads the text of pages, docstrings, comments and messages. CONTRIBUTING.md states the rules of
style.
"""

import argparse
import ast
import io
import random
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
#: Maps a regular expression for words that readers did not understand to plainer words.
PLAIN = {
    r"\bwitness(es)?\b": "oracle",
    r"\b(stands?|stood) still\b": "fixed",
    r"\bodd poses?\b": "outlier",
    r"\b(the house|rooms?)\b": "architecture, package",
    r"\bhand(s|ed|ing)? out\b": "return, output",
    r"\b(held|holds?|holding) (\w+ ){0,3}against\b": "compare with",
    r"\bwhose doing\b": "contribution of each joint",
    r"\b(stands?|standing) alone\b": "disagrees with the two others",
    r"\bthe judge\b": "the accuracy study",
    r"\brates? of the rates?\b": "joint acceleration",
    r"\bfollowers?\b": "mimic joint",
    r"\bwhom\b": "name the person or the thing",
    r"\bwhoever\b": "name the person",
    r"\bnobody\b": "no one",
    r"\bdoes otherwise\b": "differs",
    r"\bis told (of|by|that)\b": "receives, reports",
    r"\bsays so\b": "reports it, states it",
    r"\bwhat people (read|ask|write)\b": "a noun: printed text, questions, input",
    r"\b(is|are) said (to be|up to|of|by)\b": "is reported, is stated",
}
LONGEST = 30
_SUFFIXES = (".py", ".md", ".toml")
_SKIPPED = {
    *(".venv", ".git", "site", "node_modules", "build", "dist", "data"),
    *("CHANGELOG.md", "plain_words.py"),
}


class Passage(NamedTuple):
    file: str  # the file, relative to the repository
    line: int  # first line of the passage
    text: str


def passages(paths: list[Path], code: str = "") -> Iterator[Passage]:
    """Yield the passages of text; `code` replaces each piece of code in backticks."""
    for file in (file for path in paths for file in (sorted(path.rglob("*")) if path.is_dir() else [path])):
        name = file.relative_to(ROOT)
        if file.suffix not in _SUFFIXES or _SKIPPED & set(name.parts):
            continue
        text, fenced = file.read_text(encoding="utf-8"), False
        if file.suffix != ".py":
            for number, line in enumerate(text.splitlines(), 1):
                if line.startswith("```"):
                    fenced = not fenced
                elif not fenced:
                    yield Passage(str(name), number, re.sub(r"`[^`]*`", code, line))
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
                yield Passage(str(name), node.lineno, re.sub(r"`[^`]*`", code, node.value))
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                yield Passage(str(name), token.start[0], token.string.lstrip("#: "))


def find_words(paths: list[Path]) -> list[str]:
    found = []
    for passage in passages(paths):
        for pattern, plain in PLAIN.items():
            for match in re.finditer(pattern, passage.text, re.IGNORECASE):
                line = passage.line + passage.text[: match.start()].count("\n")
                found.append(f"{passage.file}:{line}: {match[0]!r}; write: {plain}")
    return found


def find_long_sentences(paths: list[Path]) -> list[str]:
    found = []
    for passage in passages(paths):
        for sentence in re.split(r"(?<=[.!?:;])\s+|\n\s*\n", passage.text):
            words = sentence.split()
            if len(words) > LONGEST and "|" not in sentence:
                found.append(f"{passage.file}:{passage.line}: {len(words)} words: {' '.join(words)[:80]}")
    return found


def sample_sentences(paths: list[Path], number: int, seed: int) -> list[tuple[str, str]]:
    """Return (place, sentence) of random sentences with 7 to 45 words."""
    found = dict[str, str]()
    for passage in passages(paths, code=r"\g<0>"):
        for sentence in re.split(r"(?<=[.!?:])\s+(?=[A-Z`\"(])|\n\s*\n", passage.text):
            words = sentence.split()
            letters = sum(one.isalpha() or one == " " for one in sentence)
            if 7 <= len(words) <= 45 and letters > 0.75 * len(sentence) and "|" not in sentence:
                found.setdefault(" ".join(words), f"{passage.file}:{passage.line}")
    chosen = random.Random(seed).sample(sorted(found), min(number, len(found)))
    return [(found[sentence], sentence) for sentence in chosen]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = [ROOT / "urdfkin", ROOT / "docs", ROOT / "README.md"]
    parser.add_argument("paths", nargs="*", type=Path, default=default)
    parser.add_argument("--long", action="store_true", help="list long sentences instead")
    parser.add_argument("--sample", type=int, metavar="N", help="print N random sentences instead")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random sentences")
    parser.add_argument("--places", action="store_true", help="print the place of each random sentence")
    options = parser.parse_args()
    chosen = [path.resolve() for path in options.paths]
    if options.sample is not None:
        for i, (place, sentence) in enumerate(sample_sentences(chosen, options.sample, options.seed), 1):
            print(i, *([place] if options.places else []), sentence, sep="\t")
        sys.exit()
    lines = find_long_sentences(chosen) if options.long else find_words(chosen)
    print("\n".join(lines))
    sys.exit(bool(lines) and not options.long)
