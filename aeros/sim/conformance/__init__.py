"""The conformance suite: the promises of `aeros.runtime.ports.Plant`, as checks of any plant."""
