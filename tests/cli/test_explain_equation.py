"""`urdfkin explain 7.130`: the equation, its meaning, its function and its check."""

from tests.cli.running import Done, urdfkin


def explain(topic: str) -> Done:
    return urdfkin("explain", topic)


def test_an_equations_number_gives_its_page() -> None:
    page = explain("7.130")
    assert page.code == 0, page.err
    for part in ("Equation 7.130", "w-dot_0i x d_{i-1,i}", "Robot.acceleration", "Pinocchio", "tests/text/"):
        assert part in page.text


def test_a_lost_equation_is_said_to_be_lost() -> None:
    assert "page 2" in explain("7.8").text


def test_a_number_that_the_chapter_does_not_have_is_no_topic() -> None:
    answer = explain("7.131")
    assert answer.code == 2
    assert answer.text == ""
