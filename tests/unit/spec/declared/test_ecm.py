"""A required capability may be written as a range of versions, or with the interface that is relied on."""

from __future__ import annotations

from aeros.spec.declared.decode import decode
from aeros.spec.declared.ecm import Dependencies
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.yaml_reader import read_yaml

TEXT = """\
aeros: ">=0.1"
capabilities:
  grasping: ">=1.2"
  fetching: {version: ">=2", interface: {achieves: holding}}
"""


def test_both_forms_of_a_required_capability_are_read_alike() -> None:
    problems = Diagnostics()
    node = read_yaml(Source("ecm.yaml", TEXT), problems)
    assert node is not None
    found = decode(node, Dependencies, problems)
    assert found is not None
    (grasping, plain), (fetching, full) = found.required_capabilities
    assert (grasping.value, plain.version.value, plain.interface) == ("grasping", ">=1.2", None)
    assert (fetching.value, full.version.value) == ("fetching", ">=2")
    assert full.interface is not None
    assert full.interface.achieves is not None
    assert full.interface.achieves.value == "holding"
