"""AEROS: capability packages proved safe before installation, actions decided safe before motion."""

__version__ = "0.1.0"

__all__ = [
    "Action",
    "Decision",
    "Gate",
    "Observation",
    "Plant",
    "Report",
    "Session",
    "__version__",
    "act",
    "check_conformance",
    "load_gate",
    "open_session",
    "verify",
]

# Not `typing.TYPE_CHECKING`: importing AEROS imports nothing else, and type checkers know the name.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from aeros.api import (
        Action,
        Decision,
        Gate,
        Observation,
        Plant,
        Report,
        Session,
        act,
        check_conformance,
        load_gate,
        open_session,
        verify,
    )
else:

    def __getattr__(name):
        """Import a public name from `aeros.api` when it is first used.

        Raises:
            AttributeError: the package has no such name.
        """
        if name not in __all__:
            raise AttributeError(f"module 'aeros' has no attribute {name!r}")
        from importlib import import_module

        value = globals()[name] = getattr(import_module("aeros.api"), name)
        return value

    def __dir__():
        """List the public names, imported or not."""
        return sorted({*globals(), *__all__})
