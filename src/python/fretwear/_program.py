"""The program, called as a process of its own."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    from fretwear._folder import Run

#: What a key of a scene may be set to: a text with its unit ("20 kN"), a word, a number, a truth value, a list of them, a table of
#: them. What NumPy makes of these is taken too.
Value = Union[str, bool, int, float, "os.PathLike[str]", Sequence["Value"], Mapping[str, "Value"]]

#: The path of a scene, or a scene as a mapping of sections: `{"joint": {"grid": [64, 48], …}, …}`.
Scene = Union[str, "os.PathLike[str]", Mapping[str, Value]]

#: A milestone of `when`, or several.
Milestone = Union[str, Sequence[str]]

#: Exit codes of the program: something failed, and a run stopped that can be continued.
FAILED = 1
STOPPED = 75

#: The first line of scenes that this module writes.
WRITTEN = "# Written by the Python module from a mapping; the next call may replace it.\n"


class Error(Exception):
    """What the program refused or failed at, in its own words.

    `code` is its exit code: 1 failure, 2 usage or scene, 3 not converged (the last commit is kept), 4 damaged or mismatched run,
    75 stopped (`Stopped`). It is None where this module itself found no program, run, table or column.
    """

    def __init__(self, message: str, code: int | None = None) -> None:
        super().__init__(message)
        self.code = code


class Stopped(Error):
    """A run ended before its goal, and can be continued: by `max_wall`, or by a signal to the program.

    `run` holds what is committed. The same call again goes on.
    """

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message, STOPPED)
        self.run = run

    def __reduce__(self) -> tuple[Any, ...]:
        return Stopped, (str(self), self.run)


def program() -> str:
    """The path of the program: what the variable FRETWEAR names, else what was installed with this module, else that of PATH."""
    named = os.environ.get("FRETWEAR")
    if named:
        return named
    schemes = [sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user")]
    folders = [sysconfig.get_path("scripts", scheme) for scheme in schemes]
    for folder in [*folders, None]:
        found = shutil.which("fretwear", path=folder)
        if found:
            return found
    raise Error("the program fretwear is neither beside Python nor on PATH; name it by the variable FRETWEAR")


def version() -> str:
    """The version of the installed package; of a module that is not installed, that of the program."""
    try:
        return metadata.version("fretwear")
    except metadata.PackageNotFoundError:
        return call("--version").split()[1]


def _listen(child: subprocess.Popen[str], said: list[str], show: bool) -> None:
    """Waits for the end of the program, and keeps what it says on stderr; with `show`, passes it on."""
    assert child.stderr
    for line in child.stderr:
        said.append(line)
        if show:
            sys.stderr.write(line)
            sys.stderr.flush()
    child.wait()


def call(*arguments: str, show: bool = False, codes: Collection[int] = (0,)) -> str:
    """Returns what the program prints on stdout. With `show`, its progress goes to stderr.

    Raises Error if the program ends with a code that is not among `codes`, or prints nothing with one that is not 0. KeyboardInterrupt
    stops the program as Ctrl-C does, and is raised again when the program has ended. A second one ends it at once, which costs no commit.
    """
    # In a session of its own the program does not see the Ctrl-C of the terminal, only that which is forwarded here: two would end it at
    # once. Other threads than the main one see no KeyboardInterrupt, and Windows forwards none: there the terminal's is the only one.
    apart = os.name != "nt" and threading.current_thread() is threading.main_thread()
    said: list[str] = []
    with tempfile.TemporaryFile() as results:
        try:
            child = subprocess.Popen(
                [program(), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=results,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                start_new_session=apart,
            )
        except OSError as error:
            raise Error(f"the program does not start: {error}") from error
        with child:
            try:
                _listen(child, said, show)
            except BaseException as error:
                interrupted = isinstance(error, KeyboardInterrupt)
                if apart or not interrupted:
                    child.send_signal(signal.SIGINT if os.name != "nt" else signal.SIGTERM)
                try:
                    _listen(child, said, show and interrupted)
                except BaseException:
                    child.kill()
                raise
        results.seek(0)
        printed = results.read().decode("utf-8", errors="replace")
    if child.returncode == 0 or (child.returncode in codes and printed):
        return printed
    # Notices may stand before the error; what `verify` finds is a result.
    text = "".join(said)
    error_at = re.search(r"^error: ", text, re.MULTILINE)
    message = (text[error_at.end() :] if error_at else text or printed).strip()
    if child.returncode < 0:
        raise Error(message or f"ended by signal {-child.returncode}", 128 - child.returncode)
    raise Error(message, child.returncode)


def toml(value: Value) -> str:
    """A value as TOML writes it; a text stays a text, also where it looks like a number."""
    if hasattr(value, "tolist"):  # NumPy's numbers and arrays
        value = value.tolist()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{toml(str(key))} = {toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray)):
        return "[" + ", ".join(map(toml, value)) + "]"
    raise TypeError(f"a key cannot be set to {value!r}: text with a unit, number, bool, list or table")


def scene_text(scene: Mapping[str, Value]) -> str:
    """A scene as TOML. Paths of type `os.PathLike` are relative to the working folder; texts stay as they are."""

    def absolute(value: Any) -> Any:
        if isinstance(value, os.PathLike):
            return os.path.abspath(value)
        if isinstance(value, Mapping):
            return {key: absolute(inner) for key, inner in value.items()}
        if isinstance(value, (list, tuple)):
            return [absolute(inner) for inner in value]
        return value

    def key(name: Any) -> str:
        if "." in str(name):
            raise Error(f'{name}: no key of a mapping has a dot; write {{"contact": {{"normal_load": …}}}} for contact.normal_load', 2)
        return str(name) if re.fullmatch(r"[A-Za-z0-9_-]+", str(name)) else toml(str(name))

    keys, sections = [], []
    for name, value in absolute(scene).items():
        if isinstance(value, Mapping):
            sections.append("\n".join([f"[{key(name)}]", *(f"{key(inner)} = {toml(each)}" for inner, each in value.items())]))
        else:
            keys.append(f"{key(name)} = {toml(value)}")
    return "\n\n".join([*(["\n".join(keys)] if keys else []), *sections]) + "\n"


@contextmanager
def _scene_beside(scene: Mapping[str, Value], run: Path) -> Iterator[str]:
    """The path of a scene as TOML beside the folder of its run. Raises Error if another file has that name.

    The scene is in a file of its own until the program has accepted it, so that a refused scene replaces nothing, and two calls at the
    same time do not share a scene.
    """
    run = Path(os.path.abspath(run))
    if not run.name:
        raise Error(f"{run} cannot be the folder of a run: the scene has no place beside it")
    path = run.with_name(f"{run.name}.toml")
    if path.exists() and not path.read_text(encoding="utf-8", errors="replace").startswith(WRITTEN):
        raise Error(f"{path} was not written by this module and stays; choose another folder for the run")
    text = (WRITTEN + scene_text(scene)).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, written = tempfile.mkstemp(".toml", f".{run.name}-", path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(text)
        yield written
        os.replace(written, path)
    except Error as error:
        if error.code == STOPPED:
            os.replace(written, path)
        error.args = (str(error).replace(written, str(path)),)
        raise
    finally:
        Path(written).unlink(missing_ok=True)


@contextmanager
def _scene_file(scene: Scene) -> Iterator[str]:
    """The path of a scene; a mapping is in a temporary file meanwhile."""
    if not isinstance(scene, Mapping):
        yield os.fspath(scene)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(scene_text(scene), encoding="utf-8")
        yield str(path)


def _execution(threads: int | None, max_wall: str | float | None, quiet: bool) -> list[str]:
    """The options that runs and campaigns share."""
    options = []
    if threads is not None:
        options.append(f"--threads={threads}")
    if max_wall is not None:
        options.append(f"--max-wall={max_wall if isinstance(max_wall, str) else f'{max_wall} s'}")
    if quiet:
        options.append("--quiet")
    return options


def _sets(changes: Mapping[str, Value] | None) -> list[str]:
    return [f"--set={key}={toml(value)}" for key, value in (changes or {}).items()]


def run(
    scene: Scene | None = None,
    *,
    run: str | os.PathLike[str] | None = None,
    set: Mapping[str, Value] | None = None,
    threads: int | None = None,
    max_wall: str | float | None = None,
    quiet: bool = True,
) -> Run:
    """Computes a scene, or continues its run; a finished run is returned at once.

    - `scene`: path of the scene, or the scene as a mapping of sections, which is written as TOML beside the run. Without a scene, the run
      continues with the scene that its folder has.
    - `run`: folder of the run. The default is `runs/NAME` in the working directory, with the name of the scene's file, or `runs/scene`.
    - `set`: keys of the scene to change, as `{"contact.normal_load": "20 kN", "joint.grid": [64, 48], "wear.cycles": 10**6}`.
    - `threads`: threads of the run, all cores by default; the results are the same bits.
    - `max_wall`: time after which to stop, in s or as "8 h"; within a stage if its iteration takes 2 s longer.
    - `quiet`: False shows the progress on stderr.

    Raises Stopped if the run ends before its goal, Error if it fails, with the words of the program. On KeyboardInterrupt the program
    gets SIGINT and ends with what is committed; the same call again goes on. Called from another thread than the main one, the
    terminal's Ctrl-C stops the program, and Stopped is raised.
    """
    from fretwear._folder import Run

    if run is None:
        if scene is None:
            raise TypeError("run() wants a scene, a run, or both")
        run = Path("runs") / ("scene" if isinstance(scene, Mapping) else Path(scene).stem)
    arguments = ["run", f"--run={os.fspath(run)}", *_sets(set), *_execution(threads, max_wall, quiet)]
    try:
        if isinstance(scene, Mapping):
            with _scene_beside(scene, Path(run)) as path:
                call(*arguments, "--", path, show=not quiet)
        else:
            call(*arguments, *([] if scene is None else ["--", os.fspath(scene)]), show=not quiet)
    except Error as error:
        if error.code == STOPPED:
            raise Stopped(str(error), Run(run)) from None
        raise
    return Run(run)


def plan(scene: Scene, *, set: Mapping[str, Value] | None = None, rehearsal: bool = True) -> dict[str, Any]:
    """What a scene will compute (`recipe`), why (`decisions`), what speaks against it (`warnings`), and what it costs (`cost`).

    `cost` contains the counted memory and disk per iteration [B], and ranges of wear iterations, FFT pairs and total disk [B].
    A mapping has no folder: give paths in it as `pathlib.Path`. `seconds["run"]` is the range of the time on this machine. A range is None if the coarse run gives no estimate; `cost["not_known"]`
    has the reason. The coarse run takes a few seconds; `rehearsal=False` skips it and returns no cost. `set` as in `run`. Raises Error.
    """
    without = [] if rehearsal else ["--no-rehearsal"]
    with _scene_file(scene) as path:
        planned: dict[str, Any] = json.loads(call("plan", "--json", *without, *_sets(set), "--", path))
    return planned


def campaign(
    file: str | os.PathLike[str],
    *,
    folder: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    threads: int | None = None,
    max_wall: str | float | None = None,
    retry: bool = False,
    quiet: bool = True,
) -> dict[str, Any]:
    """Plans a campaign, runs its rows and collects them. The same call again continues, and returns at once when all rows are done.

    - `file`: the campaign (TOML).
    - `folder`: folder of the campaign. The default is `campaigns/NAME` in the working directory, with the name of the file.
    - `jobs`: runs at once; by default as many as cores and memory allow. `threads`, `max_wall` and `quiet` as in `run`.
    - `retry`: True runs rows again that failed.

    Returns the object of `fretwear campaign run --json` (`rows`, `done`, `left`, `failed`, `stopped`, `in_use`) with `folder`. Failed rows
    do not stop the others; a warning gives their numbers and the folder with the reasons. The tables of all rows are in `folder/collected`. Raises Error.
    """
    folder = Path("campaigns") / Path(file).stem if folder is None else Path(folder)
    directory = f"--dir={folder.absolute()}"
    call("campaign", "plan", "--no-rehearsal", directory, "--", os.fspath(file))
    arguments = ["campaign", "run", "--json", directory, *_execution(threads, max_wall, quiet)]
    if jobs is not None:
        arguments.append(f"--jobs={jobs}")
    if retry:
        arguments.append("--retry")
    ended: dict[str, Any] = json.loads(call(*arguments, show=not quiet, codes=(0, FAILED, STOPPED)))
    if failed := ended["failed"]:
        reasons = f"{folder / 'failed'} has the reasons"
        warnings.warn(f"{len(failed)} of {ended['rows']} rows of {folder} failed ({failed}); {reasons}", stacklevel=2)
    if ended["done"]:
        call("campaign", "collect", directory)
    return ended | {"folder": str(folder)}


def when(
    run: Run | str | os.PathLike[str],
    *,
    preload: Milestone = (),
    resonance: Milestone = (),
    stiffness: Milestone = (),
    depth: Milestone = (),
    depth_99: Milestone = (),
    volume: Milestone = (),
) -> dict[str, Any]:
    """Returns after how many cycles a run, or the runs of a campaign, reach milestones: the object of `fretwear when --json`.

    - `run`: a run, or the folder of a run or of a campaign.
    - The milestones, each a text or a list of texts: `preload="90%"`, `resonance="+1Hz"`, `stiffness="kn+10%"`, `depth="10um"`,
      `depth_99="10um"` (depth that a hundredth of the cells exceed), `volume="1mm3"`. A percentage is of the unworn joint.

    For a run, `milestones` has per milestone the numbers of cycles `earliest`, `nominal` and `latest` by the error bars of the run (None
    if not within its cycles), and `done` is False for an unfinished run. For a campaign, it has quantiles. Raises Error.
    """
    asked = {"preload": preload, "resonance": resonance, "stiffness": stiffness, "depth": depth, "depth-99": depth_99, "volume": volume}
    options = [f"--{name}={each}" for name, texts in asked.items() for each in ([texts] if isinstance(texts, str) else texts or ())]
    if not options:
        raise TypeError('when() wants a milestone, as preload="90%"')
    found: dict[str, Any] = json.loads(call("when", "--json", *options, "--", os.fspath(run), codes=(0, STOPPED)))
    return found


def explain(key: str) -> dict[str, Any]:
    """What a key of a scene means, with its type, default and an example; of a section ("contact"), all of its keys. Raises Error."""
    about: dict[str, Any] = json.loads(call("schema", "--json", "--", key))
    if "section" in about:
        # The program also returns the table of the same name.
        return {name: about[name] for name in ("section", "meaning", "keys")}
    if "key" not in about:
        raise Error(f"{key}: there is no such key or section of a scene", 2)
    return about
