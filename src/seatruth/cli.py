"""The command line: `seatruth identify|predict|diagnose|compare|init|trials|check|simulate|list|explain|demo`.

Exit codes: 0 done, 1 failed, 2 bad input, 130 interrupted. Whatever happens ends in one message, never in a traceback.
The module of a command is loaded when the command is called, so that `--help` need not wait for numerical libraries.
"""

from __future__ import annotations

import functools
import importlib
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

try:
    import typer
    from typer.core import TyperGroup

    from seatruth.commands.common import Result, Session, fail, note, version, write_json
    from seatruth.errors import PluginError, SeatruthWarning
    from seatruth.processes import interrupt_at_signals
except KeyboardInterrupt:  # loading takes a moment, and nothing has been begun in it
    sys.stderr.write("seatruth: interrupted. Run the same command again.\n")
    sys.exit(130)

COMMANDS = {
    "identify": ("identify", "Identify a study's parameters and write a report."),
    "predict": ("predict", "Predict advance, overshoots and so on, with intervals."),
    "diagnose": ("diagnose", "Find the effect that a model lacks."),
    "init": ("init", "List what a log holds, guess its channels and write a commented study file."),
    "trials": ("trials", "Split a log into trials and draw a map of it."),
    "check": ("check", "List the faults of a study and its data."),
    "compare": ("compare", "Compare solvers on problems under noise."),
    "simulate": ("simulate", "Simulate the model against the trials, without a fit."),
    "list": ("list_installed", "List what is installed, plug-ins included."),
    "explain": ("explain", "Say what an error, a finding, an effect or a kind of verdict means, and what to do."),
    "demo": ("demo", "Identify and diagnose synthetic example trials."),
}
"""Commands by name: the module of `seatruth.commands` that holds a function of the same name, and what it does."""


class _Commands(TyperGroup):
    """Loads a command when it is called; lists all without loading any."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS:
            return None
        module = COMMANDS[cmd_name][0]
        command = getattr(importlib.import_module(f"seatruth.commands.{module}"), module)
        alone = typer.Typer(add_completion=False, rich_markup_mode=None, context_settings=_HELP)
        alone.command(cmd_name)(_carried(command))
        return typer.main.get_command(alone)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


_HELP = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="seatruth",
    cls=_Commands,
    help="Identifies the parameters of a marine vehicle's model from its trials and says where the two disagree.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=_HELP,
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"seatruth {version()}")
        raise typer.Exit


@app.callback()
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    if isinstance(context.obj, Session):
        context.obj.command = context.invoked_subcommand or ""


class _Ended(Exception):
    """Carries whatever a command raised past typer, which would swallow interrupts and broken pipes."""

    def __init__(self, problem: BaseException) -> None:
        super().__init__(str(problem))
        self.problem = problem


def _carried(command: Callable[..., Result]) -> Callable[..., Result]:
    @functools.wraps(command)
    def carry(*arguments: Any, **options: Any) -> Result:
        try:
            return command(*arguments, **options)
        except SystemExit:
            # Ours never do: a model, an effect or a solver of the user's did.
            ended = PluginError("the code of a plug-in ended the program", do="Let it raise an error instead.")
            raise _Ended(ended) from None
        except (Exception, KeyboardInterrupt) as problem:
            raise _Ended(problem) from problem

    return carry


def run(arguments: Sequence[str]) -> int:
    """Runs one command and gives its exit code."""
    session = Session(json_file=_json_file(arguments))
    try:
        return _answer(session, arguments)
    except BrokenPipeError:
        # The reader of a pipe has gone (`| head`): nothing is wrong, and nothing more can be said.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (Exception, KeyboardInterrupt) as problem:
        return fail(session, problem)


def _answer(session: Session, arguments: Sequence[str]) -> int:
    try:
        answer: Any = typer.main.get_command(app).main(
            args=list(arguments) or ["--help"], prog_name="seatruth", standalone_mode=False, obj=session
        )
    except _Ended as ended:
        raise ended.problem from None
    if isinstance(answer, Result):
        write_json(session, answer.exit_code, answer.data, None)
        sys.stdout.flush()
        return answer.exit_code
    return answer if isinstance(answer, int) else 0


def _json_file(arguments: Sequence[str]) -> Path | None:
    """The file of `--json`, read before anything else so that even a wrong option is reported there."""
    for position, argument in enumerate(arguments):
        if argument.startswith("--json="):
            return Path(argument.removeprefix("--json="))
        if argument == "--json" and position + 1 < len(arguments):
            return Path(arguments[position + 1])
    return None


def main() -> None:
    """Entry point of the `seatruth` command."""
    interrupt_at_signals()
    warnings.showwarning = _warned
    sys.exit(run(sys.argv[1:]))


def _warned(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
    """Shows a warning of seatruth as one line; those of libraries as Python does."""
    if issubclass(category, SeatruthWarning):
        note(f"seatruth: {message}", style="yellow")
    else:
        _plain_warning(message, category, *place, **more)


_plain_warning = warnings.showwarning


if __name__ == "__main__":
    main()
