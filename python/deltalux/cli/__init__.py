# SPDX-License-Identifier: Apache-2.0
"""The command line: `commands` has a module per verb; this one assembles them and sets exit codes."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from deltalux.errors import Cancelled
from deltalux.version import __version__

from .commands import bake, compare, compare_methods, demo, info, plan, render, serve, study, update, view
from .console import print_error
from .failures import failure_text, is_expected
from .streams import flush_output, unheard_streams

EXIT_FAILURE, EXIT_USAGE, EXIT_CANCELLED = 1, 2, 130

app = typer.Typer(
    name="deltalux",
    help="""Global illumination that follows your edits: bake a scene once, move an object,
    and get the new light of every point, equal to baking again to the last bit.

    Start with [bold]deltalux demo[/], then [bold]deltalux bake office -o office.png[/].
    Each command explains itself: [bold]deltalux bake --help[/].""",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
for module in (demo, info, plan, bake, update, render, compare, compare_methods, study, view, serve):
    app.command(module.__name__.rpartition(".")[2].replace("_", "-"))(module.run)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"deltalux {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code.

    Parameters
    ----------
    arguments : the words after "deltalux"; None = those of this process

    Returns
    -------
    0 good, 1 failure, 2 wrong usage, 130 cancelled. Failures print one line on stderr.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    with unheard_streams():
        try:
            code = app(args=words, prog_name="deltalux", standalone_mode=False, obj=words)
            flush_output()
        except typer.TyperException as error:
            return _wrong_usage(error)
        except (KeyboardInterrupt, typer.Abort, Cancelled):
            print_error("cancelled")
            return EXIT_CANCELLED
        except Exception as error:
            if not is_expected(error):
                raise
            print_error(failure_text(error))
            return EXIT_FAILURE
        if code == EXIT_CANCELLED:  # typer has turned Ctrl-C into an exit
            print_error("cancelled")
        return code or 0


def _wrong_usage(error: typer.TyperException) -> int:
    """Print what is wrong with a command line, and return the exit code."""
    usage = getattr(error, "exit_code", EXIT_FAILURE) == EXIT_USAGE
    context = getattr(error, "ctx", None)
    hint = f" (see: {context.command_path} --help)" if usage and context else ""
    message = error.format_message()
    if message:  # there is none if help was shown because no command was given
        print_error(message + hint)
    return EXIT_USAGE if usage else EXIT_FAILURE
