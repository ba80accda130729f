"""`python -m jointplay COMMAND …`: what the program `jointplay` does not have."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Protocol, cast

from .errors import JointplayError


class CommandModule(Protocol):
    """A module with a command."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declares the arguments."""

    def main(self, arguments: argparse.Namespace) -> None:
        """Runs the command."""


COMMANDS: dict[str, tuple[str, str]] = {
    "paper": ("_paper", "Section 4 of the paper: every figure, number and statement beside what is computed here, on one page."),
    "sensitivity": ("_sensitivity_command", "Find which parameters influence an output most: each alone, and all together."),
    "tolerance": (
        "_tolerance_command",
        "Find what part of a manufactured lot meets its limits, what drives the rejects, and the cheapest fits that reach a yield.",
    ),
    "import": ("_robots_command", "Print a robot description, MJCF or URDF, as a scene file."),
}
"""Module within the package, and one line of help, of each command."""

OF_PROGRAM = ("view", "scenes", "lessons", "check", "run", "render", "tradeoff", "sweep", "map", "parameters", "reference", "schema")
"""Commands of the program."""


def main(given: Sequence[str] | None = None) -> int:
    """Runs a command; returns the exit code: 0, 2 for wrong input, 1 for a file that cannot be read or written, 130
    after Ctrl-C: those of the program."""
    words = sys.argv[1:] if given is None else list(given)
    if words and words[0] in OF_PROGRAM:
        print(f"error: `{words[0]}` is a command of the program: `./run {words[0]} …` or `jointplay {words[0]} …`", file=sys.stderr)
        return 2
    parser = argparse.ArgumentParser("python -m jointplay", description="Studies and reports of machines with play in their joints.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (module, text) in COMMANDS.items():
        own = commands.add_parser(name, help=text, description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
        # Its libraries are loaded only for the command that is asked for.
        if words and words[0] == name:
            cast(CommandModule, import_module(f".{module}", __package__)).add_arguments(own)
    arguments = parser.parse_args(words)
    command = cast(CommandModule, import_module(f".{COMMANDS[arguments.command][0]}", __package__))
    try:
        command.main(arguments)
    except JointplayError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
