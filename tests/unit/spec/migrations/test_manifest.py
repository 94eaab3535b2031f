"""Manifests of version 1 keep what they meant."""

from __future__ import annotations

from pathlib import PurePath

import pytest

from aeros.spec.migrations import formats
from aeros.spec.migrations.format import UnmigratableError
from aeros.spec.migrations.rewriting import rewrite

PATH = PurePath("tidy/ecm.yaml")
OLD = """\
schema: aeros/ecm/1 # by hand
skills:
  on_failure: {inputs: {on_failure: {type: bool}}}
compositions:
  both:
    do:
      seq:
        - {skill: wipe, retry: 1, on_failure: "recover", inputs: {on_failure: true}}
        - par:
            - {skill: look, on_failure: stop}
            - if: holding
              then: {skill: drop, retry: 2, on_failure: recover} # twice
    handlers:
      recover: {skill: rise, retry: 1, on_failure: look_around}
      look_around: {skill: look}
tasks:
  tidy:
    rules:
      - {unless: table_wiped, do: wipe, retry: 1, on_failure: recover}
models:
  net: {description: a net, kind: model, file: net.onnx}
  notes: {description: notes, kind: 'tool'}
"""


def test_the_step_renames_recoveries_between_tries_and_nothing_that_a_user_named() -> None:
    assert rewrite(PATH, OLD, formats.ECM).text == (
        OLD.replace("aeros/ecm/1", "aeros/ecm/2")
        .replace('on_failure: "recover"', 'between_tries: "recover"')
        .replace("retry: 2, on_failure: recover", "retry: 2, between_tries: recover")
        .replace("on_failure: look_around", "between_tries: look_around")
        .replace("retry: 1, on_failure: recover", "retry: 1, between_tries: recover")
        .replace("kind: model", "kind: file")
        .replace("kind: 'tool'", "kind: 'file'")
    )


def test_a_manifest_that_has_both_words_is_refused_with_its_line() -> None:
    text = OLD.replace("retry: 2,", "retry: 2, between_tries: rise,")
    with pytest.raises(UnmigratableError, match="`on_failure` becomes `between_tries`, which line 12"):
        rewrite(PATH, text, formats.ECM)
