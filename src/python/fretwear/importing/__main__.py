"""The command `fretwear-import`, also available as `python -m fretwear.importing`.

    fretwear-import FILE... -o FOLDER
    fretwear-import --surface FILE -o map.parquet
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import subprocess
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

from fretwear.importing import Rejected
from fretwear.importing.scene import LENGTHS, MASSES, TIMES, scale

#: File extensions of each program.
FAMILIES = {
    "gmsh": {".msh"},
    "nastran": {".op4", ".pch", ".pch1", ".dmig", ".bdf", ".nas", ".asm"},
    "ansys": {".full", ".cdb", ".csv"},
    "matlab": {".mat", ".csv"},
    "abaqus": {".inp", ".mtx", ".dat"},
}
#: Extensions of files that the command does not read, with advice.
REJECTED = {
    ".unv": "convert the I-DEAS universal file to a Gmsh mesh (.msh) or an Abaqus deck (.inp)",
    ".med": "convert the MED file of Salome to a Gmsh mesh (.msh) or an Abaqus deck (.inp)",
    ".op2": "write the matrices of Nastran with OUTPUT4 or DMIG instead of OUTPUT2",
    ".sti": "`fretwear` reads the matrices of CalculiX directly; give the files as structure.file in the scene",
    ".mas": "`fretwear` reads the matrices of CalculiX directly; give the files as structure.file in the scene",
}


class _Once(argparse.Action):
    """Stores the value of an option. Raises Rejected if the option is given twice."""

    def __call__(self, parser: object, options: argparse.Namespace, values: object, option: str | None = None) -> None:
        if option and getattr(options, self.dest) is not None:
            raise Rejected(f"{option} is given twice; give the option once")
        setattr(options, self.dest, values)


def parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = argparse.ArgumentParser(
        prog="fretwear-import",
        description="Converts files of other programs for fretwear. The command writes a structure as a folder, "
        "and a measured surface as a table.",
    )
    parser.register("action", None, _Once)
    parser.add_argument(
        "files",
        nargs="*",
        type=Path,
        metavar="FILE",
        help="files of one structure: Gmsh (.msh), Nastran (.bdf, .nas, .op4, .pch, .dmig, .asm), ANSYS (.full, .cdb, .csv), "
        "MATLAB (.mat, .csv) or Abaqus (.inp, .mtx, .dat)",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FOLDER",
        help="folder that the command writes; with --surface, the table that the command writes, such as map.parquet",
    )
    parser.add_argument("--upper", metavar="SET", help="name of the node set of the upper body at the joint; requires --lower")
    parser.add_argument("--lower", metavar="SET", help="name of the node set of the lower body at the joint; requires --upper")
    parser.add_argument(
        "--pairs",
        type=Path,
        metavar="FILE",
        help="CSV file of the node pairs at the joint, with the columns upper_node,lower_node; replaces --upper and --lower",
    )
    parser.add_argument("--fixed", metavar="SET", help="name of the node set that is fixed in all directions")
    parser.add_argument(
        "--unit",
        metavar="LENGTH,MASS,TIME",
        help="units of the numbers in the files, such as mm,t,s or '25.4 mm,175.1268 kg,s'; without --unit, set structure.unit in "
        "the scene; with --surface, the length of one unit of height, such as um or '12.5 nm'",
    )
    parser.add_argument(
        "--material",
        action="append",
        default=[],
        metavar="SET=E,nu,rho",
        help="Young's modulus, Poisson's ratio and density of the physical group SET of a Gmsh mesh, in the units of the file; "
        "repeat the option for each group of solids",
    )
    parser.add_argument(
        "--labels",
        type=Path,
        metavar="FILE",
        help="CSV file with the columns label,instance,node, which gives the node of each label in Abaqus matrices; "
        "required for a deck with instances",
    )
    parser.add_argument(
        "--axes",
        choices=["global"],
        help="declares that all displacements of an ANSYS .full file are along the global axes; required without a .cdb file",
    )
    parser.add_argument("--force", action="store_true", help="replace the folder or the table of an earlier import")
    surface = parser.add_argument_group(
        "surfaces", "These options convert a measured topography in a binary format that fretwear does not read directly."
    )
    surface.add_argument("--surface", type=Path, metavar="FILE", help="topography file of an instrument; replaces the files of a structure")
    surface.add_argument(
        "--format",
        metavar="NAME",
        help="name of the reader; required if the extension does not identify the format; an unknown name lists all readers",
    )
    surface.add_argument(
        "--channel",
        metavar="NAME",
        help="name of the channel; required if several channels contain heights; an unknown name lists all channels",
    )
    surface.add_argument(
        "--size",
        metavar="X,Y",
        help="lengths of the map along x and y, such as '1.2 mm,0.9 mm'; required if the file states no size or a wrong size",
    )
    return parser


def _arguments(given: list[str] | None) -> argparse.Namespace:
    """Returns the options. Raises Rejected if options contradict each other."""
    options = parser().parse_args(given)
    options.units = None
    structural = ["files", "upper", "lower", "pairs", "fixed", "material", "labels", "axes"]
    others = structural if options.surface else ["format", "channel", "size"]
    if strange := [name for name in others if getattr(options, name)]:
        name = "FILE..." if strange[0] == "files" else f"--{strange[0]}"
        raise Rejected(
            f"{name} applies only to {'structures; remove it, or remove' if options.surface else 'surfaces; remove it, or give'} --surface"
        )
    if options.surface:
        return options
    if not options.files:
        raise Rejected("no input file is given; give the files of a structure, or give --surface FILE")
    if options.unit:
        parts = [part.strip() for part in options.unit.split(",")]
        try:
            for part, units in zip(parts, (LENGTHS, MASSES, TIMES), strict=True):
                scale(part, units)
        except ValueError:
            known = "; ".join(", ".join(units) for units in (LENGTHS, MASSES, TIMES))
            raise Rejected(
                f"--unit {options.unit} is not valid; give a length, a mass and a time such as mm,t,s or '25.4 mm,kg,s'; "
                f"the known units are {known}"
            ) from None
        options.units = dict(zip(("length", "mass", "time"), parts, strict=True))
    if bool(options.upper) != bool(options.lower) or (options.upper and options.pairs):
        raise Rejected("the joint needs both --upper SET and --lower SET, or only --pairs FILE")
    return options


@contextlib.contextmanager
def _reading(files: list[Path]) -> Iterator[None]:
    """Suppresses warnings of libraries, and adds the file names to a rejection that names no file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except Rejected as error:
        if any(file.name in str(error) for file in files):
            raise
        raise Rejected(f"{', '.join(map(str, files))}: {error}") from None


def _family(files: list[Path]) -> str:
    for file in files:
        if file.suffix.lower() in REJECTED:
            raise Rejected(f"{file}: fretwear-import does not read {file.suffix.lower()} files; {REJECTED[file.suffix.lower()]}")
        if not file.is_file():
            raise Rejected(f"{file}: there is no such file; check the path")
        if files.count(file) > 1:
            raise Rejected(f"{file} is given twice; give the file once")
    found = {name for name, suffixes in FAMILIES.items() if any(file.suffix.lower() in suffixes - {".csv"} for file in files)}
    if len(found) > 1:
        raise Rejected(f"the files belong to several programs ({', '.join(sorted(found))}); give the files of one program")
    known = ", ".join(sorted(suffix for suffixes in FAMILIES.values() for suffix in suffixes))
    strange = [file for file in files if not found or file.suffix.lower() not in FAMILIES[next(iter(found))]]
    if strange:
        raise Rejected(
            f"{strange[0]}: this extension does not identify a program, or does not belong to the program of the other files; "
            f"the known extensions are {known}; give a measured surface with --surface FILE"
        )
    return found.pop()


def convert(options: argparse.Namespace) -> str:
    """Reads the files and writes the folder or the table. Returns the text to print. Raises Rejected."""
    if options.surface:
        from fretwear.importing import surface

        return surface.convert(options)
    from fretwear.importing import folder, mesh, scene

    folder.check_new(options.output, options.force)
    family = _family(options.files)
    with _reading(options.files):
        if options.material and family != "gmsh":
            raise Rejected("--material applies only to Gmsh meshes (.msh); remove --material, because the files contain their materials")
        structure = importlib.import_module(f"fretwear.importing.{family}").read(options.files, options)
        for option in ("upper", "lower", "fixed"):
            if name := getattr(options, option):
                setattr(options, option, structure.set_named(name, f"--{option}"))
        if options.pairs:
            folder.read_pairs(structure, options.pairs)
        if options.fixed and structure.is_mesh:
            structure.held |= {(node, direction) for node in structure.sets[options.fixed] for direction in (1, 2, 3)}
        if structure.is_mesh:
            mesh.check_constraints(structure)
    if options.units is None:
        structure.left_out.append(
            "The import has no units, because no file states units and --unit is not given: set structure.unit in the scene."
        )
    folder.write(structure, options.output, scene.write(structure, options), options.units, force=options.force)
    return f"fretwear-import wrote the folder {options.output}{os.sep}"


def _look(folder: Path) -> None:
    """Runs `fretwear inspect` and `fretwear check` on the new folder, or prints both commands if `fretwear` is missing."""
    from fretwear import _program

    try:
        program = _program.program()
    except _program.Error:
        print(f"Next, run `fretwear inspect {folder}` and `fretwear check {folder / 'scene.toml'}`.")
        return
    for arguments in (["inspect", str(folder)], ["check", str(folder / "scene.toml")]):
        print(f"fretwear {' '.join(arguments)}", flush=True)
        try:
            subprocess.run([program, *arguments], stdin=subprocess.DEVNULL, check=False)
        except OSError as error:
            print(f"The program {program} does not start: {error}")
            return


def main(given: list[str] | None = None) -> int:
    """Runs the command. Returns the exit code: 0 for success, 2 for a rejected input, 1 for a bug of fretwear-import."""
    try:
        options = _arguments(given)
        written = convert(options)
    except Rejected as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except ImportError as error:
        print(
            f"error: a package is missing ({error}); install it with: pip install 'fretwear[{'surface' if options.surface else 'abaqus'}]'",
            file=sys.stderr,
        )
        return 2
    except (RecursionError, OverflowError) as error:
        print(
            f"error: entries of the files refer to each other too deeply, or a number is too large ({error}); the files may be damaged",
            file=sys.stderr,
        )
        return 2
    except (MemoryError, OSError) as error:
        print(f"error: {error or 'these files need more memory than is available'}", file=sys.stderr)
        return 2
    except Exception as error:
        at = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(at.filename).name}:{at.lineno}"
        print(
            f"error: fretwear-import has a bug at {where}: {type(error).__name__}: {error}; please report this message with the files",
            file=sys.stderr,
        )
        return 1
    try:
        print(written)
        if not options.surface:
            _look(options.output)
    except BrokenPipeError:
        # The reader has closed the pipe. Further output goes to the null device.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main())
