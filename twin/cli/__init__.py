"""The `twin` command: thin commands that parse, call one library function, print, and set the exit code."""


def main() -> None:
    """Run `twin`; a user's mistake ends as one sentence on stderr and exit code 2."""
    import os
    from signal import SIG_IGN, SIGINT, getsignal, signal

    def leave() -> None:
        if getsignal(SIGINT) is not SIG_IGN:
            signal(SIGINT, lambda number, frame: os._exit(130))

    leave()  # before anything is begun, and once all is done: wherever imports or the interpreter's end are
    from twin.cli.app import run_app
    from twin.cli.interrupted import ends_on_interrupt

    try:
        with ends_on_interrupt():
            run_app()
    finally:
        leave()
