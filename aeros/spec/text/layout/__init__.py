"""Layout of YAML files: one way to write each, with comments kept."""

from aeros.spec.text.layout.layout import LayoutRefusedError, format_yaml

__all__ = ["LayoutRefusedError", "format_yaml"]
