from __future__ import annotations

import pytest

from aeros.spec.theorems.loop_forms import loop_forms


def faults(body: str, head: str = "def f(ones, limit):") -> dict[str, tuple[str, ...]]:
    """Return the faults by place of a function with this body, which is indented by two."""
    return {form.place: form.faults for form in loop_forms(f"{head}\n{body}")}


@pytest.mark.parametrize(
    "body",
    [
        "  for one in ones:\n    yield one",
        "  for one in ones:\n    found.append(one)",
        "  for one in ones:\n    found += [one]",
        "  for one in ones:\n    by_name[one.name] = one",
        "  for one in ones:\n    first = one.a\n    print(first)",
        "  for one in ones:\n    if one:\n      first = 1\n    else:\n      first = 2\n    print(first)",
        "  for one in ones:\n    if not one:\n      continue\n    else:\n      first = 2\n    print(first)",
        "  for one in ones:\n    with one as first:\n      other = first\n      print(other)",
        "  for one in ones:\n    for part in one:\n      print(part)",
        "  return [one for one in ones if one > limit]",
        "  for one, other in zip(ones, limit, strict=True):\n    print(one, other)",
        "  for one in ones:\n    note: int | None = one\n    print(note)",
        "  for one in ones:\n    self.write(one)\n    print(self.depth)",
    ],
)
def test_a_loop_that_treats_each_element_by_itself_has_no_fault(body: str) -> None:
    found = faults(body)
    assert found
    assert set(found.values()) == {()}


@pytest.mark.parametrize(
    ("body", "place", "expected"),
    [
        ("  for one in ones:\n    if one:\n      break", "f: for one in ones", ("ends early",)),
        ("  for one in ones:\n    return one", "f: for one in ones", ("ends early",)),
        ("  for one in ones:\n    total = total + one", "f: for one in ones", ("carries total",)),
        ("  for one in ones:\n    total *= one", "f: for one in ones", ("carries total",)),
        ("  for one in ones:\n    print(last)\n    last = one", "f: for one in ones", ("carries last",)),
        (
            "  for one in ones:\n    if one:\n      last = one\n    print(last)",
            "f: for one in ones",
            ("carries last",),
        ),
        ("  for one in ones:\n    self.n = self.n + 1", "f: for one in ones", ("carries self.n",)),
        (
            "  for one in ones:\n    if len(seen) < 2:\n      seen.append(one)",
            "f: for one in ones",
            ("carries seen",),
        ),
        (
            "  for one in ones:\n    if 'x' not in by_name:\n      by_name[one] = 1",
            "f: for one in ones",
            ("carries by_name",),
        ),
        ("  for one in ones:\n    del rest[one]\n    print(rest)", "f: for one in ones", ("carries rest",)),
        ("  while ones:\n    ones.pop()", "f: while ones", ("while",)),
        ("  for one in ones[:2]:\n    print(one)", "f: ones[:2]", ("slice",)),
        ("  first = ones[:limit]\n  return first", "f: ones[:limit]", ("slice",)),
        ("  return [one for one in islice(ones, 2)]", "f: islice(ones, 2)", ("part",)),
        ("  return next(iter(ones))", "f: next(iter(ones))", ("part",)),
        ("  return list(zip(ones, limit, strict=False))", "f: zip(ones, limit, strict=False)", ("part",)),
        ("  return list(zip(ones, limit))", "f: zip(ones, limit)", ("part",)),
        ("  for n, one in enumerate(ones):\n    print(one)", "f: enumerate(ones)", ("number",)),
        ("  for n in range(2):\n    print(ones[n])", "f: range(2)", ("number",)),
        ("  return ones[limit + 1]", "f: ones[limit + 1]", ("number",)),
        ("  return sum(itertools.islice(ones, 2))", "f: itertools.islice(ones, 2)", ("part",)),
    ],
)
def test_a_form_that_may_depend_on_the_number_of_elements_is_reported(
    body: str, place: str, expected: tuple[str, ...]
) -> None:
    assert faults(body)[place] == expected


def test_functions_are_named_by_class_and_surrounding_function() -> None:
    source = (
        "class A:\n  def b(self, ones):\n    def c():\n      return [one for one in ones]\n"
        "    return sorted(ones, key=lambda one: one[:2])\n"
    )
    assert [form.place for form in loop_forms(source)] == ["A.b: one[:2]", "A.b.c: for one in ones"]


def test_annotations_are_no_part_of_the_code() -> None:
    assert faults("  return ones", "def f(ones: dict[str, int | None]) -> Iterator[int | None]:") == {}
