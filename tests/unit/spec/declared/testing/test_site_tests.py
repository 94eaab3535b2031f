"""The schema of site tests: files that people write are read as they are declared."""

from __future__ import annotations

from aeros.spec.declared.decode import decode
from aeros.spec.declared.testing.site_tests import SiteTests
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml
from tests.repo.tree import ROOT


def test_the_example_is_read_with_every_field_in_its_place() -> None:
    diagnostics = Diagnostics()
    node = read_yaml(read_source(ROOT / "docs" / "examples" / "panda_cell_tests.yaml"), diagnostics)
    assert node is not None
    tests = decode(node, SiteTests, diagnostics)
    assert tests is not None
    found = {name.value: test for name, test in tests.tests}
    slower = found["slower_near_a_person"]
    assert (slower.expect.value, str(slower.skill), str(slower.action)) == (
        "ATTENUATE",
        "make_dumplings.wrap",
        "move_tool",
    )
    assert [name.value for name, _ in slower.becomes] == ["speed"]
    assert isinstance({name.value: value for name, value in slower.parameters}["target"], tuple)
    assert str(found["dumplings_are_proved"].verify) == "../../ecms/make_dumplings"
