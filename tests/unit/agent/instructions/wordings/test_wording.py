from __future__ import annotations

from aeros.agent.instructions import english
from aeros.agent.instructions.wordings.wording import Wording, without_each


def test_forms_of_a_form_keep_that_its_object_comes_first() -> None:
    form = Wording(("it",)).with_object_first(("the", "table", "cleaned"), is_perfect=True)
    again = form.with_words(("table",)).with_object_first(("table",))
    assert again == Wording(("table",), is_perfect=True, needs_object_first=True)


def test_a_phrase_is_left_out_at_each_place_but_the_first() -> None:
    assert list(without_each(("is", "it", "is", "it"), english.COPULAS)) == [("is", "it", "it")]
