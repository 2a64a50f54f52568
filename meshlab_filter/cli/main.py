"""The command group; a command's module is imported when the command is used."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

import click

from .._version import __version__

#: Command → (module, one line of help), in the order of the help page.
COMMANDS = {
    "demo": ("demo", "Run the whole chain on the bunny inside pymeshlab's wheel."),
    "simplify": ("simplify", "Thin a cloud; the points that stay keep all their attributes."),
    "run": ("run", "Simplify, rebuild the surface, measure the error, write a report."),
    "sweep": ("sweep", "Measure the error at several sizes, to choose one."),
    "annotate": ("annotate", "Write a cloud with the rank of every point, to cut in MeshLab."),
    "presets": ("presets", "List, show and copy the ready filter scripts of MeshLab."),
    "compare": ("compare", "Measure how far two clouds or meshes are from each other."),
    "methods": ("methods", "List the methods, their sources and their parameters."),
}

EPILOG = """\b
Exit codes: 0 done; 1 internal error; 2 wrong option or parameter; 3 cloud that
cannot be worked on; 4 file missing, damaged or of unknown type; 5 preset that
cannot be run; 6 MeshLab failed; 7 output cannot be written; 8 Dask or a
download failed; 130 interrupted.

\b
Method: A. Mahdaoui and E. H. Sbai, "3D Point Cloud Simplification Based on
k-Nearest Neighbor and Clustering", Advances in Multimedia 2020, 8825205."""


class LazyGroup(click.Group):
    """A group that knows its commands by name and imports one when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of ``COMMANDS``."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command's module and return its ``command``."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f".{COMMANDS[cmd_name][0]}", package=__package__)
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.group(cls=LazyGroup, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="meshlab-filter")
def cli() -> None:
    """Thin a dense 3D scan, keep what matters in it, rebuild its surface, know the error."""


def invoke(arguments: Sequence[str]) -> int:
    """Run a command line and return its exit code; errors end as one sentence on stderr."""
    from ..errors import MeshlabFilterError

    try:
        code = cli.main(args=list(arguments), prog_name="meshlab-filter", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        return 2
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        return _interrupted()
    except MeshlabFilterError as error:
        click.echo(f"Error: {error}", err=True)
        return error.exit_code
    except OSError as error:
        what = f"{error.strerror or error}{f': {error.filename}' if error.filename else ''}"
        click.echo(f"Error: {what}.", err=True)
        return 7
    except (RuntimeError, AssertionError) as error:
        # Interrupted just as the thread it waits for ends, Thread.join of Python 3.11 fails while
        # it handles the interrupt.
        if not isinstance(error.__context__, KeyboardInterrupt):
            raise
        return _interrupted()
    except SystemExit:
        # So click ends when whoever read standard output has gone.
        return 141
    except MemoryError:
        click.echo("Error: Not enough memory for this cloud on this machine.", err=True)
        return 3
    # Not standing alone, click returns what a command passes to ctx.exit.
    return code if isinstance(code, int) else 0


def _interrupted() -> int:
    click.echo("Interrupted; nothing was left half-written.", err=True)
    return 130
