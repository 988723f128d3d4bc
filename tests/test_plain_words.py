"""Pages, docstrings, comments and messages avoid words that readers did not understand."""

from pathlib import Path

import pytest

from scripts import plain_words
from scripts.plain_words import PLAIN, ROOT, find_long_sentences, find_words, sample_sentences


def test_pages_docstrings_comments_and_messages_avoid_the_words_of_the_list() -> None:
    assert find_words([ROOT / "urdfkin", ROOT / "docs", ROOT / "README.md", ROOT / "CONTRIBUTING.md"]) == []


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("page.md", "First.\n\nMuJoCo is a second witness.\n", 3),
        ("module.py", '"""The house has rooms."""\n', 1),
        ("module.py", "x = 1\n# Held against Pinocchio.\n", 2),
        ("module.py", 'raise ValueError("a follower has no coordinate")\n', 1),
    ],
)
def test_a_word_of_the_list_is_reported_with_its_place_and_its_plain_form(
    name: str, text: str, line: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plain_words, "ROOT", tmp_path)
    (tmp_path / name).write_text(text, encoding="utf-8")
    found = find_words([tmp_path])
    assert found
    assert all(one.startswith(f"{name}:{line}: ") and "; write: " in one for one in found)


def test_code_on_a_page_is_not_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_words, "ROOT", tmp_path)
    (tmp_path / "page.md").write_text("```python\nfollower = 1  # witness\n```\nSee `follower`.\n")
    assert find_words([tmp_path]) == []


def test_only_long_sentences_are_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_words, "ROOT", tmp_path)
    (tmp_path / "page.md").write_text("Word " * 31 + ".\n" + "Word " * 20 + ".\n")
    (found,) = find_long_sentences([tmp_path])
    assert found.startswith("page.md:1: 32 words")


def test_a_sample_has_whole_sentences_with_their_code_and_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plain_words, "ROOT", tmp_path)
    text = "Too short. The function `jacobian` returns an array for each frame.\n\n```python\ncode = 1\n```\n"
    (tmp_path / "page.md").write_text(text)
    (tmp_path / "module.py").write_text("# The kernel reads eight numbers in each step.\nx = 1\n")
    expected = {
        ("page.md:1", "The function `jacobian` returns an array for each frame."),
        ("module.py:1", "The kernel reads eight numbers in each step."),
    }
    assert set(sample_sentences([tmp_path], 10, seed=0)) == expected
    (one,) = sample_sentences([tmp_path], 1, seed=3)
    assert one in expected
    assert sample_sentences([tmp_path], 1, seed=3) == [one]


def test_every_pattern_has_a_plain_form() -> None:
    assert all(PLAIN.values())
