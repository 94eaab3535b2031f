"""Entry point of `aeros` and of `python -m aeros`; it handles Ctrl-C before it imports the rest."""

# The built-in part of `signal`, which would import `enum` before Ctrl-C is handled.
import _signal as signal  # type: ignore[import-not-found]
import os
import sys

_INTERRUPTED = 130  # `Exit.INTERRUPTED`, whose module is not imported yet
_STDERR = 2  # file descriptor


def start() -> int:
    """Run the command of `sys.argv`; Ctrl-C ends the program with exit code 130 at any moment.

    Returns:
        The exit code.
    """
    former = signal.getsignal(signal.SIGINT)
    if former is not signal.default_int_handler:  # such as ignored, by `nohup`
        from aeros.cli.main import main

        return main()
    # While there is nothing to clean up, as an import may catch an exception and go on.
    signal.signal(signal.SIGINT, _end)
    try:
        from aeros.cli.main import main

        return main(begin=lambda: signal.signal(signal.SIGINT, former))
    except KeyboardInterrupt:
        _end()
        raise
    finally:
        signal.signal(signal.SIGINT, _end)


def _end(*_: object) -> None:
    """End the program, before its command has begun or after it is done."""
    try:
        os.write(_STDERR, b"interrupted\n")
    finally:
        os._exit(_INTERRUPTED)


if __name__ == "__main__":
    sys.exit(start())
