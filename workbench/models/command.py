"""A solver behind a command line: decks from templates, an argument list without a shell, results from files.

Every run has a folder of its own, `work/<key>`, with the decks, the copied files and `output.log`. It is
removed when the run succeeded, but for an archive of the files that are kept, and kept whole when it failed.
In arguments `{study}` stands for the study's folder, `{python}` for this interpreter, and a parameter's name
in braces for its value.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.kept_files import LIMIT_UNASKED, leave_kept
from workbench.models.protocol import Answer, ModelSpec, settle
from workbench.models.readers import open_reader, read_response
from workbench.models.template import Deck, compiled, format_value
from workbench.system.confined import confined
from workbench.system.log_ends import ends_of
from workbench.system.processes.own_threads import environment_of_the_user
from workbench.system.processes.process_tree import end_group

__all__ = ["ENDED_BADLY", "LOG", "CommandModel", "command_digest"]

LOG = "output.log"
MOST_SHOWN = 12  # placeholders in a message
ENDED_BADLY = "ended with exit code"  # in the words of a failure: what such a run left is no result
BRACED = re.compile(r"\{([^\W\d]\w*)\}")
INTERPRETER = re.compile(r"(python|perl|ruby|node|julia|octave|Rscript|(ba|da|k|z|c|tc)?sh)[\d.]*")
# what was meant to be one: {dd.in}, { a }, {a:.3f}, but neither {"a": 1} nor {print $1} nor {2,3}
LIKE_BRACED = re.compile(r"\{(\s*[^\W\d][\w.:%+-]*\s*)\}")


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandModel:
    """Decks by their name in the run's folder, files to copy there, commands to run one after the other."""

    spec: ModelSpec
    decks: Mapping[str, Deck]
    files: tuple[Path, ...]
    commands: tuple[tuple[str, ...], ...]

    @classmethod
    def opened(cls, spec: ModelSpec) -> "CommandModel":
        """Read the templates and look for the programs.

        Raises:
            StudyError: a template, program or script is missing, leads out of the study's folder, or names no
            parameter; a parameter of the study stands in no deck and no command.
        """
        study = Path(spec.folder)
        decks = {}
        for k, table in enumerate(spec.options.get("templates", ()), start=1):
            with spec.placed(f"templates[{k}]"):
                source = confined(study, table["from"], what="template")
                target = table["to"]
                confined(study, target, what="deck")
                what = f"template {table['from']}"
                decks[target] = compiled(
                    _read(source, what), spec.names, style=table.get("style", "jinja"), what=what
                )
        with spec.placed("files"):
            files = tuple(confined(study, name, what="file") for name in spec.options.get("files", ()))
            for path in files:
                if not path.is_file():
                    raise StudyError(f"no file {path} to copy into the runs' folders")
        commands = tuple(tuple(c) for c in _commands(spec.options))
        with spec.placed("command"):
            for command in commands:
                _check_command(command, spec, study, files, first=command is commands[0])
        _check_used(spec, decks, commands)
        for name, rule in spec.options.get("read", {}).items():
            with spec.placed(f"read of {name}"):
                open_reader(rule, study)
        return cls(spec=spec, decks=decks, files=files, commands=commands)

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> Answer:
        """Write the decks, run the commands, read the responses."""
        if workdir is None:
            raise EvaluationFailed("a command needs a folder to run in")
        if workdir.exists():
            shutil.rmtree(workdir)
        workdir.mkdir(parents=True)
        for path in self.files:
            shutil.copy2(path, workdir / path.name)
        for name, render in self.decks.items():
            deck = confined(workdir, name, what="deck")
            deck.parent.mkdir(parents=True, exist_ok=True)
            deck.write_text(render(row), encoding="utf-8")
        answer = self._commands_run(row, workdir) or self._read(workdir)
        if answer.status == "ok":
            options = self.spec.options
            leave_kept(workdir, options.get("keep", ()), limit=options.get("keep_limit", LIMIT_UNASKED))
            return answer
        error = f"{answer.error} (kept in {workdir.parent.name}/{workdir.name})"
        return Answer(status=answer.status, error=error, log=ends_of(workdir / LOG))

    def close(self) -> None:
        """Nothing to release."""

    def _commands_run(self, row: Mapping[str, Any], workdir: Path) -> Answer | None:
        """None when all commands ended well, else how one of them did not."""
        environment = {**environment_of_the_user(), **self.spec.options.get("environment", {})}
        with open(workdir / LOG, "wb") as log:
            for command in self.commands:
                arguments = [_filled(a, row, self.spec.folder) for a in command]
                try:
                    process = subprocess.Popen(
                        arguments,
                        cwd=workdir,
                        stdin=subprocess.DEVNULL,
                        stdout=log,
                        stderr=subprocess.STDOUT,
                        env=environment,
                        process_group=0,
                    )
                except OSError as exc:
                    raise EvaluationFailed(f"cannot start {arguments[0]}: {exc.strerror}") from None
                try:
                    code = process.wait()
                finally:
                    end_group(process.pid)  # what it left running in its group
                    process.wait()
                if code != 0:
                    name = Path(arguments[0]).name
                    if code < 0:
                        return Answer(status="killed", error=f"{name} was ended by signal {-code}")
                    return Answer(status="failed", error=f"{name} {ENDED_BADLY} {code}")
        return None

    def _read(self, workdir: Path) -> Answer:
        study = Path(self.spec.folder)
        try:
            raw = {
                name: read_response(
                    self.spec.options["read"][name], workdir, study, history=reduction is not None
                )
                for name, reduction in self.spec.responses.items()
            }
            return settle(raw, self.spec.responses)
        except EvaluationFailed as exc:
            return Answer(status="failed", error=str(exc))


def command_digest(spec: ModelSpec) -> str:
    """A digest of templates, copied files and files of the study's folder that stand among the arguments."""
    study = Path(spec.folder)
    names = [t["from"] for t in spec.options.get("templates", ())] + list(spec.options.get("files", ()))
    names += [
        a.removeprefix("{study}/") for c in _commands(spec.options) for a in c if a.startswith("{study}/")
    ]
    total = blake2b(digest_size=16)
    for name in names:
        try:
            total.update(confined(study, name, what="file").read_bytes())
        except (OSError, StudyError):
            total.update(b"missing")
    return total.hexdigest()


def _commands(options: Mapping[str, Any]) -> Sequence[Sequence[str]]:
    command = options["command"]
    return command if command and not isinstance(command[0], str) else [command]


def _check_command(
    command: Sequence[str], spec: ModelSpec, study: Path, files: Sequence[Path], *, first: bool
) -> None:
    known = ("study", "python", *spec.names)
    for argument in command:
        unknown = next((name for name in LIKE_BRACED.findall(argument) if name not in known), None)
        if unknown is not None:
            shown = ", ".join(f"{{{name}}}" for name in known[:MOST_SHOWN])
            more = f" and {len(known) - MOST_SHOWN} more parameters" if len(known) > MOST_SHOWN else ""
            raise StudyError(
                f"command argument {argument!r} holds {{{unknown}}}, which stands for nothing; known are "
                f"{shown}{more}"
            )
        _check_there(argument, study)
    program = command[0].replace("{python}", sys.executable).replace("{study}", str(study))
    copied = {path.name: path for path in files}
    if BRACED.search(program):
        return
    place = copied.get(program.removeprefix("./")) if program.startswith("./") else None
    if place is None:
        if "/" in command[0]:  # else it is looked for on the path
            _check_in_folder(command[0], study)
        place = study / program
    if shutil.which(place if "/" in program else program) is None:
        if "/" in program and place.is_file():
            raise StudyError(
                f"{program!r} may not be executed; allow it by `chmod +x`, or begin the command with what "
                "runs it, such as '{python}' or 'sh'"
            )
        raise StudyError(
            f"no program {program!r}; give its path, '{{study}}/...' for one beside the study file"
        )
    script = command[1] if len(command) > 1 and INTERPRETER.fullmatch(Path(program).name) else ""
    made = {table["to"] for table in spec.options.get("templates", ())}
    if first and script and script.removeprefix("./") not in {*copied, *made}:
        _check_in_folder(script, study)


def _check_in_folder(path: str, study: Path) -> None:
    """Refuse a path from the run's folder to what stands beside the study file."""
    if path.startswith(("/", "{")) or not (study / path).is_file():
        return
    name = path.removeprefix("./")
    raise StudyError(
        f"{path!r} is looked for in the folder of each run, where it is not; write '{{study}}/{name}' for "
        f"the one beside the study file, or have it copied by files = [{name!r}]"
    )


def _check_there(argument: str, study: Path) -> None:
    """Refuse a file of the study's folder that is not there; the beginning of a name may stand alone."""
    name = argument.removeprefix("{study}/")
    if name == argument or not name or BRACED.search(name) or any(sign in name for sign in "*?["):
        return
    path = study / name
    if not path.exists() and not any(path.parent.glob(f"{path.name}*")):
        raise StudyError(f"no file {path}, which the command names as {argument!r}")


def _check_used(spec: ModelSpec, decks: Mapping[str, Deck], commands: Sequence[Sequence[str]]) -> None:
    """Refuse a parameter whose value nothing of a run is made from: its effect would be said to be none."""
    used = {name for deck in decks.values() for name in deck.uses}
    used |= {name for command in commands for argument in command for name in BRACED.findall(argument)}
    unused = [name for name in spec.names if name not in used]
    if not unused:
        return
    templates = ", ".join(table["from"] for table in spec.options.get("templates", ()))
    shown = ", ".join(map(repr, unused))
    what = f"parameter {shown} never reaches" if len(unused) == 1 else f"parameters {shown} never reach"
    with spec.placed(f"parameter {unused[0]}"):
        raise StudyError(
            f"{what} the solver: no {{{{ {unused[0]} }}}} in a template ({templates or 'there is none'}), no "
            f"{{{unused[0]}}} in an argument of the command. Put it in one of them, or leave the parameter "
            "out"
        )


def _filled(argument: str, row: Mapping[str, Any], study: str) -> str:
    special = {"study": study, "python": sys.executable}
    return BRACED.sub(lambda m: special.get(m[1]) or format_value(row[m[1]]), argument)


def _read(path: Path, what: str) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as exc:
        raise StudyError(f"{what} cannot be read: {exc.strerror}") from None
    except UnicodeDecodeError as exc:
        raise StudyError(f"{what} is not text in UTF-8 (byte {exc.start})") from None
