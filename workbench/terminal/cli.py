"""The command line: a thin shell over the functions that a notebook calls too.

Exit codes: 0 done, 2 a file or argument is not usable, 3 done with failed evaluations, 4 interrupted and
resumable, 5 the store failed.
"""

import json
import signal
import sys
from shutil import get_terminal_size
from typing import Annotated

import typer

from workbench.errors import HoldfastError
from workbench.system.processes.own_threads import limit_own_threads
from workbench.terminal import other_commands, stage_commands

__all__ = ["app", "main"]

app = typer.Typer(
    help="Which uncertain parameters matter, where the worst case lies, which layout holds fast in it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _tell_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"holdfast {version('holdfast')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """What may stand before the name of a command."""


for _part in (stage_commands, other_commands):  # in the order of `holdfast --help`
    app.add_typer(_part.commands)

OK, INTERRUPTED = 0, 4
STOPPED = "interrupted; the same command continues"


def main() -> None:
    """The console command."""
    limit_own_threads()
    # not the handler of SIGINT: that is "ignore" in the background of a script, where SIGTERM means stop
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        app()
    except HoldfastError as exc:
        _fail(str(exc), exc.exit_code)
    except KeyboardInterrupt:
        _fail(STOPPED, INTERRUPTED)
    except SystemExit as exc:
        if _was_interrupted(exc):
            _fail(STOPPED, INTERRUPTED)
        raise
    except BrokenPipeError:
        sys.stderr.close()
        raise SystemExit(OK) from None


def _was_interrupted(exc: BaseException) -> bool:
    """Whether Ctrl-C or SIGTERM stands behind it: typer takes a KeyboardInterrupt and leaves with a code."""
    behind = exc.__context__
    return behind is not None and (isinstance(behind, KeyboardInterrupt) or _was_interrupted(behind))


def _fail(text: str, code: int) -> None:
    if "--json" in sys.argv:
        print(json.dumps({"error": text, "exit_code": code}))
    message = f"holdfast: {text}"
    if sys.stderr.isatty():  # a log file keeps it in one line
        from workbench.report.lines.tables import hanging

        columns = max(40, get_terminal_size().columns)
        message = "\n".join(hanging("", message, indent=2, width=columns))
    print(message, file=sys.stderr)
    raise SystemExit(code)
