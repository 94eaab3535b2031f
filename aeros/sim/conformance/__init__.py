"""The conformance suite: what `aeros.runtime.ports.Plant` promises, as checks of anybody's plant."""
