"""The importer, held against SciPy, closed forms and, if it is there, CalculiX.

    PYTHONPATH=src/python python tests/python/test_import.py

Wants Python 3.11, numpy and scipy. Without meshio, pyyeti, h5py, ansys-mapdl-reader or SurfaceTopography the tests of their formats are skipped. FRETWEAR_LONG=1
reads 200 damaged files of each library in place of 15; FRETWEAR_SHARED is the folder of matrices of other projects, FRETWEAR_REAL_DATA that of topographies.
"""

import ast
import contextlib
import gzip
import hashlib
import importlib
import io
import json
import os
import random
import shutil
import stat
import struct
import subprocess
import sys
import tempfile
import tomllib
import unittest
import warnings
import zlib
from importlib.util import find_spec
from pathlib import Path
from unittest import mock

import fretwear
import numpy as np
import surfaces
from fretwear import _program
from fretwear.importing import axes, child, surface
from fretwear.importing.__main__ import main
from scipy import io as scipy_io
from scipy import sparse
from structures import FREE, STUCK, Blocks, Folder, block, dmig, grid, mtx

HERE = Path(__file__).resolve().parent
CASES = HERE / "cases"
SCHEMA = HERE.parents[1] / "schemas" / "structure.schema.json"
SHARED = Path(os.environ.get("FRETWEAR_SHARED", HERE.parents[2] / "shared" / "data" / "matrices"))
REAL = Path(os.environ.get("FRETWEAR_REAL_DATA") or HERE.parents[2] / "shared" / "data", "surfaces")
LONG = bool(os.environ.get("FRETWEAR_LONG"))
MUTANTS = 200 if LONG else 15
BLOCKS = Blocks()
PAIRS = list(zip(BLOCKS.top, BLOCKS.bottom, strict=True))
STEEL = "210000,0.3,7.85e-9"


def needs(library):
    return unittest.skipUnless(find_spec(library), f"{library} is not installed")


def rotation(axis, degrees):
    return axes.rotation(np.zeros(3), np.array(axis, float), degrees, "")[0]


class Import(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.out = self.folder / "out"
        patched = mock.patch.object(_program, "program", side_effect=_program.Error("none"))
        patched.start()
        self.addCleanup(patched.stop)

    def file(self, name, content):
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def case(self, name):
        """Files of a case, uncompressed."""
        for path in (CASES / name).iterdir():
            if path.suffix == ".gz":
                (self.folder / path.stem).write_bytes(gzip.decompress(path.read_bytes()))
            else:
                shutil.copy(path, self.folder)
        return lambda *names: [self.folder / name for name in names]

    def call(self, *arguments):
        """Exit code, and what was printed."""
        said = io.StringIO()
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
            code = main([*map(str, arguments), "-o", str(self.out)])
        left = [path.name for path in self.folder.iterdir() if path.name.startswith(".out")]
        self.assertEqual(left, [], "a staging folder is left")
        return code, said.getvalue()

    def imported(self, *arguments):
        shutil.rmtree(self.out, ignore_errors=True)
        code, said = self.call(*arguments)
        self.assertEqual(code, 0, said)
        folder = Folder(self.out)
        check_schema(self, folder.about)
        return folder

    def rejected(self, *arguments, said):
        code, printed = self.call(*arguments)
        self.assertEqual((code, self.out.exists()), (2, False), printed)
        self.assertRegex(printed, r"^error: [^\n]+\n$")
        self.assertRegex(printed, said)

    def same(self, folder, tolerance=1e-8):
        """Rows and matrices are those of the blocks."""
        self.assertEqual(folder.rows, BLOCKS.rows)
        for name, right in (("K", BLOCKS.K), ("M", BLOCKS.M)):
            self.assertLess(np.abs(folder.matrices[name] - right).max(), tolerance * np.abs(right).max(), name)
            self.assertEqual(np.abs(folder.matrices[name] - folder.matrices[name].T).max(), 0.0)
        for node, at in BLOCKS.nodes.items():
            if node in folder.nodes:
                self.assertLess(np.abs(folder.nodes[node] - at).max(), 1e-7, node)


def check_schema(test, about):
    """The record against schemas/structure.schema.json."""
    schema = json.loads(SCHEMA.read_text())
    if find_spec("jsonschema"):
        import jsonschema

        jsonschema.validate(about, schema, jsonschema.Draft202012Validator)
    test.assertEqual(set(schema["properties"]), set(about))


class Package(Import):
    def test_nothing_is_imported_before_it_is_used(self):
        code = "import sys, fretwear; bad = {'pyarrow', 'numpy', 'scipy', 'meshio', 'pyyeti', 'h5py'} & set(sys.modules); assert not bad, bad; fretwear.Error; dir(fretwear)"
        subprocess.run([sys.executable, "-c", code], check=True)

    def test_unknown_names_are_rejected(self):
        with self.assertRaises(AttributeError):
            fretwear.nothing  # noqa: B018

    def test_an_existing_folder_is_replaced_by_force_alone(self):
        files = self.case("abaqus_transform")("plain.inp")
        self.imported(*files)
        code, said = self.call(*files)
        self.assertEqual(code, 2)
        self.assertIn("--force", said)
        self.assertEqual(self.call(*files, "--force")[0], 0)
        shutil.rmtree(self.out)
        self.file("out", "mine")
        self.assertEqual(self.call(*files, "--force")[0], 2)
        self.assertEqual(self.out.read_text(), "mine")

    def test_the_record_has_every_file_and_the_scene_every_gap(self):
        files = self.case("include_first")("deck.inp")
        folder = self.imported(*files, "--unit", "mm,t,s", "--upper", "top", "--lower", "BOTTOM")
        right = [
            {"path": str(path), "bytes": path.stat().st_size, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
            for path in (files[0], self.folder / "two.msh")
        ]
        self.assertEqual(folder.about["files"], right)
        self.assertEqual(folder.about["contents"], {"mesh.inp": hashlib.sha256((self.out / "mesh.inp").read_bytes()).hexdigest()})
        self.assertEqual(folder.about["unit"], {"length": "mm", "mass": "t", "time": "s"})
        scene = (self.out / "scene.toml").read_text()
        for line in (
            'interface = { upper = "TOP", lower = "BOTTOM" }',
            'youngs_modulus = "2.1e+11 Pa"',
            "# normal_load = ",
            "# friction_coefficient = ",
            "# damping_ratio = ",
            "# rq = ",
        ):
            self.assertIn(line, scene)
        self.assertEqual(
            tomllib.loads(scene)["structure"],
            {"kind": "mesh", "file": ".", "unit": folder.about["unit"], "interface": {"upper": "TOP", "lower": "BOTTOM"}},
        )
        self.assertIsNone(self.imported(*files).about["unit"])
        inches = self.imported(*files, "--unit", "25.4 mm,175.1268 kg,s")
        self.assertEqual(inches.about["unit"]["mass"], "175.1268 kg")

    def test_the_program_is_called_or_named(self):
        files = self.case("include_first")("deck.inp")
        self.assertIn("fretwear inspect", self.call(*files)[1].splitlines()[-1])
        program = self.file("program", f"#!/bin/sh\necho $* >> {self.folder}/calls\n")
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        with mock.patch.object(_program, "program", return_value=str(program)):
            self.imported(*files)
        self.assertEqual((self.folder / "calls").read_text(), f"inspect {self.out}\ncheck {self.out / 'scene.toml'}\n")

    def test_formats_and_options_that_are_not_read(self):
        for name in ("a.unv", "a.med", "a.op2", "a.xyz"):
            self.rejected(self.file(name, "x"), said=rf"a\.{name[2:]}")
        self.rejected(self.folder / "none.msh", said="no such file")
        self.rejected(self.file("a.mat", ""), self.file("b.msh", ""), said="several programs")
        deck = self.case("include_first")("deck.inp")[0]
        self.rejected(deck, "--unit", "mm,t", said="--unit")
        self.rejected(deck, "--upper", "TOP", said="--lower")
        self.rejected(deck, "--upper", "TOPP", "--lower", "BOTTOM", said="no set of nodes.*TOP")
        self.rejected(deck, "--material", "A=1,2,3", said="--material")
        self.rejected(deck, "--pairs", self.file("p.csv", "upper,lower\n101,999\n"), said="101,999")

    def test_what_is_given_twice_is_rejected(self):
        deck = self.case("include_first")("deck.inp")[0]
        for twice in (["--unit", "mm,t,s"], ["--upper", "TOP"], ["--labels", "a.csv"], ["--fixed", "TOP"]):
            self.rejected(deck, *twice, *twice, said=f"{twice[0]} is given twice")
        self.rejected(deck, deck, said="deck.inp is given twice")
        pairs = "".join(f"{a},{b}\n" for a, b in (*PAIRS, PAIRS[3]))
        self.rejected(deck, "--pairs", self.file("p.csv", "upper_node,lower_node\n" + pairs), said="a pair twice")

    def test_a_child_that_dies_hangs_or_is_missing_says_so(self):
        for function, said in (
            ("die", "signal SIGSEGV"),
            ("hang", "did not finish within 2 s"),
            ("eat", "needs more than"),
            ("miss", r"pip install 'fretwear\[gmsh\]'"),
            ("leave", "returned nothing"),
        ):
            with (
                self.subTest(function),
                mock.patch.dict(
                    os.environ,
                    {
                        "FRETWEAR_IMPORT_SECONDS": "2" if function == "hang" else "30",
                        "FRETWEAR_IMPORT_MEMORY": "1",
                        "PYTHONPATH": str(HERE),
                    },
                ),
            ):
                with self.assertRaisesRegex(child.Rejected, said):
                    child.call(f"readers_that_fail:{function}", {}, files=[], library="meshio", extra="gmsh")


class Abaqus(Import):
    def test_transform_is_turned_into_global_axes(self):
        files = self.case("abaqus_transform")
        for name in ("plain", "turned"):
            folder = self.imported(*files(f"{name}.inp", f"{name}_STIF1.mtx", f"{name}_MASS1.mtx"))
            self.same(folder)
            self.assertAlmostEqual(folder.stuck(folder.nearest_pairs("TOP", "BOTTOM")), STUCK, places=2)
        # The deck beside the matrices is found.
        self.same(self.imported(*files("turned_STIF1.mtx", "turned_MASS1.mtx")))

    def test_a_cylindrical_transform_at_many_angles(self):
        origin, axis = np.array([-7.0, -11.0, 3.0]), np.array([0.0, 0.6, 0.8])
        turned = {}
        for node in BLOCKS.top:
            arm = BLOCKS.nodes[node] - origin
            radial = arm - axis * (arm @ axis)
            radial /= np.linalg.norm(radial)
            turned[node] = np.array([radial, np.cross(axis, radial), axis])
        K, M = BLOCKS.along(turned)
        end = origin + 5 * axis
        deck = self.deck() + "*TRANSFORM, NSET=TOP, TYPE=C\n" + ",".join(map(repr, map(float, [*origin, *end]))) + "\n"
        files = self.file("c.inp", deck), self.file("c_STIF1.mtx", mtx(K, BLOCKS.rows)), self.file("c_MASS1.mtx", mtx(M, BLOCKS.rows))
        self.same(self.imported(*files))
        # Rows of one direction alone cannot be turned.
        part = [k for k, row in enumerate(BLOCKS.rows) if row != (105, 2)]
        rows = [BLOCKS.rows[k] for k in part]
        self.file("c_STIF1.mtx", mtx(K[np.ix_(part, part)], rows))
        self.file("c_MASS1.mtx", mtx(M[np.ix_(part, part)], rows))
        shutil.rmtree(self.out)
        self.rejected(*files, said=r"node 105 .*no rows for the directions \[2\]")

    def deck(self, keyword="*NODE", at=lambda position: position):
        lines = [keyword, *(f"{node}, " + ", ".join(repr(float(x)) for x in at(position)) for node, position in BLOCKS.nodes.items())]
        return "\n".join([*lines, "*NSET, NSET=TOP, GENERATE", "101, 112, 1", "*NSET, NSET=BOTTOM, GENERATE", "25,36"]) + "\n"

    def test_positions_of_system_and_of_cylindrical_coordinates(self):
        turn = rotation([0, 0, 1], 30.0)
        system = "*SYSTEM\n" + ",".join(map(repr, map(float, [1, 2, 3, *(np.array([1, 2, 3]) + turn[:, 0])]))) + "\n"

        def polar(position):
            x, y, z = turn.T @ (position - [1, 2, 3])
            return np.hypot(x, y), np.degrees(np.arctan2(y, x)), z

        files = (
            self.file("s.inp", system + self.deck("*NODE, SYSTEM=C", polar)),
            self.file("s_STIF1.mtx", mtx(BLOCKS.K, BLOCKS.rows)),
            self.file("s_MASS1.mtx", mtx(BLOCKS.M, BLOCKS.rows)),
        )
        self.same(self.imported(*files))

    def test_a_turned_instance_and_its_labels(self):
        files = self.case("abaqus_instance_rotation")("job.inp", "job_STIF1.mtx")
        shutil.copy(CASES / "abaqus_transform" / "plain_MASS1.mtx", self.folder / "job_MASS1.mtx")
        files.append(self.folder / "job_MASS1.mtx")
        self.rejected(*files, said="--labels")
        labels = self.file("labels.csv", "label,instance,node\n" + "".join(f"{node},P-1,{node}\n" for node in BLOCKS.nodes))
        folder = self.imported(*files, "--labels", labels)
        self.assertAlmostEqual(folder.stuck(folder.nearest_pairs("TOP", "BOTTOM"), normal=1), STUCK, places=2)
        np.testing.assert_allclose(folder.nodes[101], [0.0, -10.0, 0.0], atol=1e-9)
        mesh = self.imported(files[0])
        np.testing.assert_allclose(mesh.frequencies()[0], FREE, rtol=1e-7)
        np.testing.assert_allclose(mesh.nodes[136], [20.0, -20.0, 30.0], atol=1e-9)

    def test_parts_with_labels_of_their_own(self):
        files = self.case("cae_parts")("job.inp")
        plain = self.case("abaqus_transform")
        for name in ("STIF1", "MASS1"):
            shutil.copy(plain(f"plain_{name}.mtx")[0], self.folder / f"job_{name}.mtx")
        matrices = plain("job_STIF1.mtx", "job_MASS1.mtx")
        self.rejected(*files, *matrices, said="--labels")
        # Lines are not in the order of the labels.
        lines = [f"{n + 100},UPPER-1,{n}\n" for n in range(36, 0, -1)] + [f"{n},lower-1,{n}\n" for n in range(1, 37)]
        labels = self.file("labels.csv", "label,instance,node\n" + "".join(lines))
        folder = self.imported(*files, *matrices, "--labels", labels)
        self.same(folder)
        self.assertAlmostEqual(folder.stuck(folder.nearest_pairs("TOP", "BOTTOM")), STUCK, places=2)
        table = "  GLOBAL TO LOCAL NODE AND ELEMENT MAPS\n\n node map\n  global  local  instance\n" + "".join(
            f"  {label} {node} {instance}\n" for label, instance, node in (line.strip().split(",") for line in lines)
        )
        folder = self.imported(*files, *matrices, self.file("job.dat", table + "  element map\n 1 1 UPPER-1\n"))
        self.same(folder)
        shutil.rmtree(self.out)
        self.rejected(*files, *matrices, "--labels", self.file("labels.csv", "label,instance,node\n1,NONE,1\n"), said="no instance NONE")
        self.rejected(
            *files,
            *matrices,
            "--labels",
            self.file("labels.csv", "label,instance,node\n" + "".join(lines[:-1])),
            said="labels of the matrices have no node in the deck, such as label 36",
        )
        labels = self.file("labels.csv", "label,instance,node\n" + "".join([*lines, "999,UPPER-1,1\n"]))
        self.rejected(*files, *matrices, "--labels", labels, said="two labels")
        mesh = self.imported(*files)
        np.testing.assert_allclose(mesh.frequencies()[0], FREE, rtol=1e-7)
        self.assertEqual(len(mesh.nodes), 72)
        self.assertIn("adds 36 to the node numbers", " ".join(mesh.about["left_out"]))

    def test_two_instances_of_one_part_in_another_order_than_the_labels(self):
        nodes, elements = block(1, 0.0)
        part = "*PART, NAME=P\n*NODE\n" + "".join(f"{n}, {p[0]}, {p[1]}, {p[2]}\n" for n, p in nodes.items())
        part += "*ELEMENT, TYPE=C3D8, ELSET=E\n" + "".join(f"{k}, " + ", ".join(map(str, e)) + "\n" for k, e in enumerate(elements, 1))
        part += "*NSET, NSET=FOOT, GENERATE\n1,12\n*NSET, NSET=HEAD, GENERATE\n25,36\n*SOLID SECTION, ELSET=E, MATERIAL=S\n*END PART\n"
        # The upper one is turned by 180 degrees about an axis that does not pass through the origin, x = 10, y = 15.
        assembly = "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=U, PART=P\n0,0,10.\n10,15,0, 10,15,1, 180.\n*END INSTANCE\n*INSTANCE, NAME=L, PART=P\n*END INSTANCE\n"
        assembly += "*NSET, NSET=BOTH, INSTANCE=L\nHEAD\n*NSET, NSET=BOTH, INSTANCE=U\nFOOT\n*END ASSEMBLY\n"
        assembly += "*MATERIAL, NAME=S\n*ELASTIC\n210000,.3\n*DENSITY\n7.85E-9\n*BOUNDARY\nL.FOOT, PINNED\n"
        deck = self.file("two.inp", part + assembly)
        # Labels: those of the blocks; the upper instance's node n lies at the place of the block's node 100 + turned(n).
        turned = {n: 1 + (2 - (n - 1) % 3) + 3 * (3 - (n - 1) // 3 % 4) + 12 * ((n - 1) // 12) for n in nodes}
        lines = [f"{n},L,{n}" for n in nodes] + [f"{100 + turned[n]},U,{n}" for n in nodes]
        random.Random(1).shuffle(lines)
        labels = self.file("labels.csv", "label,instance,node\n" + "\n".join(lines) + "\n")
        files = deck, self.file("two_STIF1.mtx", mtx(BLOCKS.K, BLOCKS.rows)), self.file("two_MASS1.mtx", mtx(BLOCKS.M, BLOCKS.rows))
        folder = self.imported(*files, "--labels", labels, "--upper", "U.FOOT", "--lower", "L.HEAD")
        self.same(folder)
        self.assertAlmostEqual(folder.stuck(folder.nearest_pairs("U.FOOT", "L.HEAD")), STUCK, places=2)
        self.assertEqual(sorted(folder.sets["BOTH"]), [*range(25, 37), *range(101, 113)])
        mesh = self.imported(deck)
        np.testing.assert_allclose(mesh.frequencies()[0], FREE, rtol=1e-7)
        self.assertEqual(len(mesh.held), 36)

    def test_structural_damping_is_not_viscous(self):
        case = self.case("structural_damping")
        for name, right in (("STIF1", "plain_STIF1"), ("MASS1", "plain_MASS1")):
            shutil.copy(self.case("abaqus_transform")(f"{right}.mtx")[0], self.folder / f"job_{name}.mtx")
        shutil.copy(self.folder / "plain.inp", self.folder / "job.inp")
        folder = self.imported(*case("job_STIF1.mtx", "job_MASS1.mtx", "job_DMPS1.mtx"))
        self.same(folder)
        self.assertEqual(set(folder.matrices), {"K", "M", "Ks"})
        ratio = folder.matrices["Ks"].max() / BLOCKS.K.max()
        np.testing.assert_allclose(folder.matrices["Ks"], ratio * BLOCKS.K, atol=1e-9 * BLOCKS.K.max())
        folder = self.imported(*case("job_STIF1.mtx", "job_MASS1.mtx", "job_DMPV1.mtx", "job_DMPS1.mtx"))
        self.assertEqual(set(folder.matrices), {"K", "M", "C", "Ks"})
        self.assertGreater(np.abs(folder.matrices["C"] - folder.matrices["Ks"]).max(), 0.0)

    def test_decks_of_cases(self):
        for case, names in (
            ("indented_keyword", ("plain", "boundary", "comment", "elastic")),
            ("include_first", ("deck",)),
            ("surface_elements", ("deck",)),
            ("nset_of_elset", ("deck",)),
        ):
            files = self.case(case)
            for name in names:
                with self.subTest(f"{case}/{name}"):
                    folder = self.imported(*files(f"{name}.inp"))
                    self.assertEqual(len(folder.held), 72 if case == "nset_of_elset" else 36)
                    np.testing.assert_allclose(folder.frequencies()[0], FREE, rtol=1e-7)
                    if case == "surface_elements":
                        self.assertIn("CPS4", " ".join(folder.about["left_out"]))
        folder = self.imported(*self.case("indented_keyword")("equation.inp"))
        np.testing.assert_allclose(folder.frequencies()[0], 9043.224, rtol=1e-6)
        self.assertEqual(len(folder.equations), 3)

    def test_what_is_held_along_other_axes_becomes_equations(self):
        deck = (CASES / "indented_keyword" / "plain.inp").read_text().replace("CLAMP, 1, 3", "CLAMP, 3, 3\nCLAMP, 1, 1")
        turned = deck.replace("*BOUNDARY", "*TRANSFORM, NSET=CLAMP\n0.6,0.8,0., -0.8,0.6,0.\n*BOUNDARY")
        folder = self.imported(self.file("t.inp", turned))
        self.assertEqual((len(folder.held), len(folder.equations)), (12, 12))
        for terms in folder.equations:
            values = {direction: factor for _, direction, factor in terms}
            self.assertAlmostEqual(values[1] / values[2], 0.6 / 0.8)
        self.assertEqual({direction for _, direction in folder.held}, {3})
        # All three directions are the same held in any axes.
        folder = self.imported(self.file("u.inp", turned.replace("CLAMP, 1, 1", "CLAMP, 1, 2")))
        self.assertEqual((len(folder.held), len(folder.equations)), (36, 0))

    def test_keywords_that_are_not_read_are_rejected_by_name(self):
        plain = (CASES / "indented_keyword" / "plain.inp").read_text()
        for text, said in (
            ("*COUPLING, CONSTRAINT NAME=C\n", r"x\.inp, line 119: .*\*COUPLING"),
            ("*MASS, ELSET=LOWER\n1.\n", r"\*MASS"),
            ("*NMAP\n", r"\*NMAP"),
            ("*ELEMENT, TYPE=C3D8R\n9999, 1,2,5,4,13,14,17,16\n*SOLID SECTION, ELSET=X, MATERIAL=STEEL\n", "X"),
            ("*INCLUDE, INPUT=nowhere.inp\n", "nowhere.inp"),
            ("*INCLUDE, INPUT=x.inp\n", "include each other"),
            ("*BOUNDARY\nTIP, 1, 1, 0.5\n", "0.5"),
            ("*BOUNDARY\nNOSET, 1, 1\n", "NOSET"),
            ("*NSET, NSET=A\nA\n*BOUNDARY\nA,1\n", "no set A"),
            ("*TRANSFORM, NSET=TIP, TYPE=Q\n0,0,0,1,0,0\n", "TYPE=Q"),
            ("*SYSTEM\n0,0,0,0,0,1\n", r"\*SYSTEM"),
            ("*INSTANCE, NAME=A, PART=B\n", "PART=B"),
            ("*NODE\n1,2,zwei,3\n", "zwei"),
            ("*EQUATION\n2\n101,1,1.\n", "number of terms"),
            ("*EQUATION\n2\n101,1,one,25,1,-1.\n", "the value is 'one'"),
            ("*EQUATION\n2\n1,1,1.,25,1,-1.\n", "node 1, direction 1 depends"),
            ("*BOUNDARY\nTIP, 1, 1, zero\n", "the value is 'zero'"),
            ("".join(f"*NSET, NSET=S{k}\nS{k + 1}\n" for k in range(3000)) + "*NSET, NSET=S3000\n1\n*BOUNDARY\nS0,1\n", "too deeply"),
        ):
            with self.subTest(text):
                self.rejected(self.file("x.inp", plain.replace("*STEP", text + "*STEP", 1)), said=said)
        self.rejected(self.file("x.inp", plain.replace("TYPE=C3D8, ELSET=UPPER", "TYPE=C3D8R, ELSET=UPPER")), said="C3D8R")
        self.rejected(self.file("x.inp", plain.replace("\n*ELASTIC", "\n*ELASTIC, TYPE=ORTHOTROPIC")), said="ORTHOTROPIC")
        self.rejected(self.file("x.inp", plain.replace("1, 1, 2, 5, 4, 13", "1, 2, 1, 5, 4, 13")), said="inside out")
        self.rejected(self.file("x.inp", plain), self.file("x_LOAD1.mtx", ""), said="_LOAD1.*the file name")
        for text, said in (
            ("1,1,2\n", "line 1"),
            ("*USER ELEMENT, NODES=2\n", "substructure"),
            ("1,1,1,1,1.\n1,1,1,1,1.\n", "twice"),
            ("", "zero|no stiffness|no mass"),
        ):
            self.rejected(self.file("x.inp", plain), self.file("x_STIF1.mtx", text), self.file("x_MASS1.mtx", "1,1,1,1,1.\n"), said=said)

    def test_damping_of_a_material(self):
        plain = (CASES / "indented_keyword" / "plain.inp").read_text()
        damping = "*DAMPING, STRUCTURAL=0.02\n"
        before, after = plain.split("*DENSITY")[0], plain[len(plain.split("*DENSITY")[0]) :]
        folder = self.imported(self.file("x.inp", before + damping + after))
        self.assertIn("*DAMPING, STRUCTURAL=0.02\n*SOLID SECTION", (self.out / "mesh.inp").read_text())
        self.assertNotIn("DAMPING", " ".join(folder.about["left_out"]))
        shutil.rmtree(self.out)
        section = plain.index("*SOLID SECTION")
        for text, said in (
            (damping + plain, r"x\.inp, line 1: \*DAMPING has no \*MATERIAL"),
            (plain[:section] + "*SOLID SECTION, ELSET=LOWER, MATERIAL=STEEL\n" + damping + plain[section:], r"DAMPING has no \*MATERIAL"),
            (plain.replace("*STEP", "*STEP\n" + damping), r"DAMPING has no \*MATERIAL"),
            (before + damping + damping + after, "DAMPING has a second occurrence in the material STEEL"),
            (before + damping.replace("0.02", "-0.02") + after, "STRUCTURAL=-0.02"),
            (before + damping.replace("STRUCTURAL", "ALPHA") + after, "DAMPING has ALPHA"),
            (before + "*DENSITY\n7.85E-9\n" + after, "DENSITY has a second occurrence in the material STEEL"),
            (plain.replace("*STEP", "*GLOBAL DAMPING, STRUCTURAL=0.02\n*STEP"), r"\*GLOBAL DAMPING"),
            (plain.replace("*END STEP", "*MODAL DAMPING\n1,9,0.02\n*END STEP"), r"\*MODAL DAMPING"),
        ):
            with self.subTest(said):
                self.rejected(self.file("x.inp", text), said=said)

    def test_an_instance_is_moved_and_then_turned(self):
        files = self.case("abaqus_instance_rotation")("job.inp")
        text, move = files[0].read_text(), "0., 0., 0.\n"
        turn = "0., 0., 0., 1., 0., 0., 90.\n"
        self.assertIn(move + turn, text)
        self.rejected(self.file("job.inp", text.replace(move + turn, turn)), said=r"line 114: \*INSTANCE, NAME=P-1 has the line 0\., 0\.")
        self.rejected(self.file("job.inp", text.replace(" 90.\n", "\n")), said=r"line 115: \*INSTANCE, NAME=P-1 .*an angle")

    def test_real_matrices_of_abaqus(self):
        if not (SHARED / "abaqus_mtx").is_dir():
            self.skipTest(f"{SHARED} has no matrices of other projects")
        files = [SHARED / "abaqus_mtx" / name for name in ("model.inp", "model_STIF1.mtx", "model_MASS1.mtx")]
        folder = self.imported(*files)
        self.assertEqual((len(folder.rows), sum(direction == 0 for _, direction in folder.rows)), (14, 2))
        self.assertIn("BEAM GENERAL SECTION", " ".join(folder.about["left_out"]))
        inner = SHARED / "abaqus_substructure" / "inner.mtx"
        shutil.rmtree(self.out)
        self.rejected(self.file("x.inp", "*NODE\n1,0,0,0\n"), inner, said="name")

    @unittest.skipUnless(shutil.which("ccx"), "CalculiX is not installed")
    def test_calculix_runs_the_deck(self):
        deck = (CASES / "cae_parts" / "job.inp").read_text()
        faces = "*Surface, name=A\nupper-1.all, S1\n*Surface, name=B\nlower-1.all, S2\n*Tie, name=T, position tolerance=0.1\nA, B\n*End Assembly"
        self.imported(self.file("tied.inp", deck.replace("*End Assembly", faces)))
        (self.out / "run.inp").write_text("*INCLUDE, INPUT=mesh.inp\n*STEP\n*FREQUENCY\n3\n*END STEP\n")
        subprocess.run(["ccx", "run"], cwd=self.out, check=True, capture_output=True, env=os.environ | {"OMP_NUM_THREADS": "1"}, timeout=60)
        lines = [line.split() for line in (self.out / "run.dat").read_text().splitlines()]
        first = next(float(line[3]) for line in lines if len(line) == 5 and line[0] == "1")
        np.testing.assert_allclose(first, tied(), rtol=1e-5)


def tied():
    """The lowest frequency of both blocks with equal displacements at the joint."""
    at = {row: k for k, row in enumerate(BLOCKS.rows)}
    keep = {row: k for k, row in enumerate(row for row in BLOCKS.rows if row[0] not in BLOCKS.top)}
    join = np.zeros((len(at), len(keep)))
    same = dict(zip(BLOCKS.top, BLOCKS.bottom, strict=True))
    for (node, d), k in at.items():
        join[k, keep[(same.get(node, node), d)]] = 1.0
    return Folder.eigen(join.T @ BLOCKS.K @ join, join.T @ BLOCKS.M @ join)[0]


class Gmsh(Import):
    """Files are written by hand in the orders of nodes of Gmsh's manual: meshio would write what it reads."""

    #: Gmsh's type, its elements on a unit cube by corners, and between which corners its middle nodes lie.
    CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    TETRA_EDGES = [(0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)]
    HEXA_EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
    WEDGE_EDGES = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)]
    TETRAS = [(0, 1, 3, 7), (0, 1, 7, 5), (0, 5, 7, 4), (0, 3, 2, 7), (0, 4, 7, 6), (0, 7, 2, 6)]
    WEDGES = [(0, 1, 3, 4, 5, 7), (0, 3, 2, 4, 7, 6)]
    KINDS = {
        4: (TETRAS, [], "C3D4"), 11: (TETRAS, TETRA_EDGES, "C3D10"),
        6: (WEDGES, [], "C3D6"), 18: (WEDGES, WEDGE_EDGES, "C3D15"),
        5: ([(0, 1, 3, 2, 4, 5, 7, 6)], [], "C3D8I"), 17: ([(0, 1, 3, 2, 4, 5, 7, 6)], HEXA_EDGES, "C3D20"),
    }  # fmt: skip
    #: Between which corners the middle nodes of decks lie.
    DECK = {
        "C3D10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
        "C3D15": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
        "C3D20": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
    }  # fmt: skip

    def mesh(self, kind):
        """Points and elements of a box of 3 × 2 × 1, and its foot at z = 0 as quadrangles or triangles."""
        cells, edges, _ = self.KINDS[kind]
        points = [tuple(p) for p in self.CUBE * [3.0, 2.0, 1.0]]
        elements = []
        for cell in cells:
            nodes = list(cell)
            for a, b in edges:
                middle = tuple((np.array(points[cell[a]]) + points[cell[b]]) / 2)
                if middle not in points:
                    points.append(middle)
                nodes.append(points.index(middle))
            elements.append(nodes)
        return np.array(points), np.array(elements), [(0, 1, 3), (0, 3, 2)]

    def written(self, kind, version, binary, name="box.msh"):
        points, elements, foot = self.mesh(kind)
        out = io.BytesIO()
        names = [(2, 1, "FOOT"), (3, 2, "BODY"), (3, 3, "all of it"), (2, 4, "UNDER")]

        def put(layout, *values):
            if binary:
                out.write(struct.pack("<" + layout, *values))
            else:
                out.write(
                    (" ".join(repr(float(v)) if c == "d" else str(int(v)) for c, v in zip(layout, values, strict=True)) + "\n").encode()
                )

        out.write(
            f"$MeshFormat\n{version} {int(binary)} 8\n".encode() + (struct.pack("<i", 1) + b"\n" if binary else b"") + b"$EndMeshFormat\n"
        )
        out.write(
            f"$PhysicalNames\n{len(names)}\n".encode() + b"".join(f'{d} {t} "{n}"\n'.encode() for d, t, n in names) + b"$EndPhysicalNames\n"
        )
        if version == "4.1":
            out.write(b"$Entities\n")
            put("QQQQ", 0, 0, 1, 1)
            put("iddddddQiiQ", 1, 0, 0, 0, 3, 2, 1, 2, 1, 4, 0)
            put("iddddddQiiQ", 1, 0, 0, 0, 3, 2, 1, 2, 2, 3, 0)
            out.write(b"\n$EndEntities\n$Nodes\n")
            put("QQQQ", 1, len(points), 11, 10 + len(points))
            put("iiiQ", 3, 1, 0, len(points))
            for k in range(len(points)):
                put("Q", k + 11)
            for point in points:
                put("ddd", *point)
            out.write(b"\n$EndNodes\n$Elements\n")
            put("QQQQ", 2, len(elements) + 2, 1, len(elements) + 2)
            put("iiiQ", 2, 1, 2, 2)
            for k, nodes in enumerate(foot):
                put("QQQQ", k + 1, *(n + 11 for n in nodes))
            put("iiiQ", 3, 1, kind, len(elements))
            for k, nodes in enumerate(elements):
                put("Q" * (1 + len(nodes)), k + 3, *(n + 11 for n in nodes))
        else:
            out.write(f"$Nodes\n{len(points)}\n".encode())
            for k, point in enumerate(points):
                put("iddd", k + 1, *point)
            # An element of two groups stands twice.
            lines = [(2, tag, nodes) for tag in (1, 4) for nodes in foot] + [(kind, tag, nodes) for tag in (2, 3) for nodes in elements]
            out.write((b"\n" if binary else b"") + f"$EndNodes\n$Elements\n{len(lines)}\n".encode())
            for k, (type_, tag, nodes) in enumerate(lines):
                if binary:
                    put("iii", type_, 1, 2)
                    put("i" * (3 + len(nodes)), k + 1, tag, 1, *(n + 1 for n in nodes))
                else:
                    put("i" * (5 + len(nodes)), k + 1, type_, 2, tag, 1, *(n + 1 for n in nodes))
        out.write((b"\n" if binary else b"") + (b"$EndElements\n"))
        return self.file(name, out.getvalue())

    @needs("meshio")
    def test_all_solids_in_all_versions(self):
        for kind, (cells, _, name) in self.KINDS.items():
            for version in ("2.2", "4.1"):
                for binary in (False, True):
                    with self.subTest(name, version=version, binary=binary):
                        folder = self.imported(self.written(kind, version, binary), "--material", f"BODY={STEEL}", "--fixed", "FOOT")
                        self.assertEqual([element[0] for element in folder.elements.values()], [name] * len(cells))
                        volume = 0.0
                        for _, nodes in folder.elements.values():
                            at = np.array([folder.nodes[n] for n in nodes])
                            corners = len(cells[0])
                            for (a, b), middle in zip(self.DECK.get(name, []), at[corners:], strict=True):
                                np.testing.assert_allclose(middle, (at[a] + at[b]) / 2, atol=1e-12)
                            split = {
                                4: [(0, 1, 2, 3)],
                                6: [(0, 1, 2, 3), (1, 2, 3, 4), (2, 3, 4, 5)],
                                8: [(0, 1, 2, 5), (0, 2, 7, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 7, 5, 6)],
                            }
                            volume += sum(abs(np.linalg.det(at[list(rest)] - at[first])) / 6 for first, *rest in split[corners])
                        self.assertAlmostEqual(volume, 6.0)
                        self.assertEqual(len(folder.sets["FOOT"]), 4)
                        self.assertEqual(folder.sets["FOOT"], folder.sets["UNDER"])
                        self.assertTrue(all(folder.nodes[n][2] == 0.0 for n in folder.sets["FOOT"]))
                        self.assertEqual(len(folder.held), 12)
                        self.assertEqual(sorted(folder.sets["all_of_it"]), sorted(folder.nodes))
                        self.assertIn("'all of it'", " ".join(folder.about["left_out"]))

    @needs("meshio")
    def test_rejections(self):
        file = self.written(5, "2.2", False)
        text = file.read_text()
        self.rejected(file, said="have no material; .*BODY")
        self.rejected(file, "--material", f"HEAD={STEEL}", said=r"box\.msh: .*no physical group of solids.*BODY")
        self.rejected(file, "--material", f"BODY={STEEL}", "--material", "BODY=1,0.3,1", said="BODY already has a material")
        self.rejected(file, "--material", "BODY=-1,0.3,1", said="E and rho must be finite and above zero")
        self.rejected(file, "--material", f"BODY={STEEL}", "--material", f"all of it={STEEL}", said="one material")
        self.rejected(file, "--material", f"BODY={STEEL}", "--fixed", "TOP", said="no set of nodes")
        for old, new, said in (
            ("2.2 0 8", "1.0 0 8", "mesh format 2.2 or 4.1"),
            ('"UNDER"', '"BODY"', "two physical groups"),
            ('"UNDER"', '"body"', "differ only in case"),
            ("$Elements\n6\n", "$Elements\n5\n", "declares 5 lines but has 6"),
            ("5 5 2 2 1 1 2 4 3 5 6 8 7", "5 5 2 2 1 2 4 3 5 6 8 7", "element line"),
            ("5 5 2 2 1 1 2 4 3 5 6 8 7", "5 5 2 2 1 1 2 4 3 5 6 8 99", "does not define|cannot read"),
            (" 1 2 4 3 5 6 8 7\n", " 5 6 8 7 1 2 4 3\n", "inside out"),
            ("$EndElements\n", "", "cut off"),
        ):
            with self.subTest(new):
                self.assertIn(old, text)
                self.rejected(self.file("bad.msh", text.replace(old, new)), "--material", f"BODY={STEEL}", said=said)
        points = np.array([(x, y, z) for z in (0, 1, 2) for y in (0, 1, 2) for x in (0, 1, 2)])
        nodes = "\n".join(f"{k + 1} {x} {y} {z}" for k, (x, y, z) in enumerate(points))
        whole = f'$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "B"\n$EndPhysicalNames\n$Nodes\n27\n{nodes}\n$EndNodes\n$Elements\n1\n1 12 2 1 1 {" ".join(map(str, range(1, 28)))}\n$EndElements\n'
        self.rejected(self.file("h27.msh", whole), "--material", f"B={STEEL}", said="hexahedron27")


class Nastran(Import):
    def grids(self, cd=None):
        return "".join(grid(node, at, cd=(cd or {}).get(node, 0)) for node, at in BLOCKS.nodes.items())

    def punch(self, K, M, before="", cd=None):
        return before + self.grids(cd) + dmig("KAAX", K, BLOCKS.rows) + dmig("MAAX", M, BLOCKS.rows)

    @needs("pyyeti")
    def test_cases_with_axes_of_displacements(self):
        case = self.case("nastran_cd")
        for name in ("plain", "turned"):
            folder = self.imported(*case(f"{name}.pch"), "--pairs", self.folder / "pairs.csv")
            self.same(folder)
            pairs = [tuple(map(int, line)) for line in folder.table("pairs.csv", "upper_node,lower_node")]
            self.assertAlmostEqual(folder.stuck(pairs), STUCK, places=2)
        self.assertEqual(folder.about["libraries"].keys(), {"pyyeti", "numpy", "scipy"})

    @needs("pyyeti")
    def test_cylindrical_and_spherical_axes_differ_from_node_to_node(self):
        origin = np.array([-30.0, -20.0, -10.0])
        base = rotation([1, 2, 3], 40.0)
        turned, cd = {}, {}
        for node, kind in [(n, "C") for n in BLOCKS.top] + [(n, "S") for n in BLOCKS.bottom]:
            local = base.T @ (BLOCKS.nodes[node] - origin)
            angle = np.arctan2(local[1], local[0])
            tangential = np.array([-np.sin(angle), np.cos(angle), 0])
            radial = np.array([np.cos(angle), np.sin(angle), 0]) if kind == "C" else local / np.linalg.norm(local)
            third = np.array([0, 0, 1.0]) if kind == "C" else tangential
            second = tangential if kind == "C" else np.cross(tangential, radial)
            turned[node], cd[node] = np.array([radial, second, third]) @ base.T, 20 if kind == "C" else 21
        # Axes 20 and 21 stand on 10, which is turned and shifted: chained.
        shift = np.array([1.0, 2.0, 3.0])
        inner = rotation([0, 1, 0], -25.0)

        def card(name, number, rid, frame, at):
            points = [at, at + frame[:, 2], at + frame[:, 0]]
            return (
                f"{name},{number},{rid},"
                + ",".join(f"{x:.12g}" for x in points[0])
                + ","
                + ",".join(f"{x:.12g}" for x in points[1])
                + "\n"
                + ","
                + ",".join(f"{x:.12g}" for x in points[2])
                + "\n"
            )

        axes_ = (
            card("CORD2R", 10, 0, inner, shift)
            + card("CORD2C", 20, 10, inner.T @ base, inner.T @ (origin - shift))
            + card("cord2s", 21, 10, inner.T @ base, inner.T @ (origin - shift))
        )
        K, M = BLOCKS.along(turned)
        self.same(self.imported(self.file("c.pch", self.punch(K, M, axes_, cd))), tolerance=1e-7)

    @needs("pyyeti")
    def test_axes_of_positions_are_apart_from_those_of_displacements(self):
        turn, origin = rotation([0, 0, 1], 30.0), np.array([5.0, 6.0, 7.0])
        lines = []
        for node, at in BLOCKS.nodes.items():
            x, y, z = turn.T @ (at - origin)
            lines.append(grid(node, (np.hypot(x, y), np.degrees(np.arctan2(y, x)), z), cp=5, cd=6 if node in BLOCKS.top else 0))
        # Axes 5 by three grids, which have the global axes; axes 6 turn x to y.
        lines += [grid(901 + k, origin + v) for k, v in enumerate((np.zeros(3), turn[:, 2], turn[:, 0]))]
        lines.append(
            "CORD1C         5     901     902     903\nCORD2R         6       0      0.      0.      0.      0.      0.      1.\n              0.      1.      0.\n"
        )
        K, M = BLOCKS.along({node: np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 1]]) for node in BLOCKS.top})
        text = "".join(lines) + dmig("KAAX", K, BLOCKS.rows) + dmig("MAAX", M, BLOCKS.rows)
        self.same(self.imported(self.file("p.pch", text)))
        # Lower case, free fields, comments and blank lines between continuations, and both widths in one entry.
        mixed = text.lower().replace(
            "cord1c         5     901     902     903", "$ axes\n cord1c , 5, 901,902, 903  $ of three grids, 901 to 903"
        )
        mixed = mixed.replace(
            "cord2r         6       0      0.      0.      0.      0.      0.      1.\n",
            "cord2r*                6               0              0.              0.\n$ between\n*                     0.              0.              0.              1.\n\n",
        )
        self.assertNotIn("cord2r  ", mixed)
        self.same(self.imported(self.file("p.pch", mixed)))
        self.rejected_again(self.file("p.pch", text.replace("CORD2R         6       0", "CORD2R         6       6")), "depends on itself")
        self.rejected_again(
            self.file("p.pch", text.replace("CORD2R         6       0", "CORD2R         7       0")), "has the coordinate system 6"
        )

    def rejected_again(self, *arguments):
        """Files, and what is said."""
        shutil.rmtree(self.out, ignore_errors=True)
        *files, said = arguments
        self.rejected(*files, said=said)

    @needs("pyyeti")
    def test_forms_of_dmig(self):
        K, M, rows = BLOCKS.K, BLOCKS.M, BLOCKS.rows
        self.same(self.imported(self.file("s.dmig", self.grids() + dmig("KAAX", K, rows, form=1) + dmig("MAAX", M, rows, form=1))))
        folder = self.imported(
            self.file(
                "c.dmig",
                self.grids()
                + dmig("K", K * (1 + 0.02j), rows, kind=4)
                + dmig("M", M, rows)
                + dmig("B2PP", 1e-6 * K, rows)
                + dmig("BAAX", 1e-5 * K, rows)
                + "PARAM,G,0.03\n",
            )
        )
        self.same(folder)
        self.assertEqual(set(folder.matrices), {"K", "M", "C", "Ks"})
        np.testing.assert_allclose(folder.matrices["Ks"], 0.05 * K, atol=1e-7 * K.max())
        np.testing.assert_allclose(folder.matrices["C"], 1e-5 * K, atol=1e-12 * K.max())
        short = self.grids() + dmig("KAAX", K, rows, decimals=7) + dmig("MAAX", M, rows, decimals=8)
        folder = self.imported(self.file("d.dmig", short))
        self.assertEqual([folder.matrices[name].dtype for name in "KM"], ["f4", "f8"])
        text = self.punch(K, M)
        head = "DMIG    KAAX           0       6       2       0"
        column = "DMIG*   KAAX                          13               1\n"
        for old, new, said in (
            (head, head.replace("6       2", "2       2"), "form 2"),
            (head, head.replace("6       2", "9       2"), "form 9"),
            (head, head + "       1", "POLAR 1"),
            (head, "", "before its header"),
            (column, column + "*                     13               1 1.000000000D+00\n", "twice"),
            (column, column + "*                     13               9 1.000000000D+00\n", "a direction"),
            (column, column + "*                     13               1            kilo\n", "kilo"),
            (column, "*       nothing\n", "a second header of KAAX"),
            ("MAAX", "XAAX", "no mass"),
        ):
            with self.subTest(new):
                self.assertIn(old, text)
                self.rejected_again(self.file("b.pch", text.replace(old, new, 1) if old != "MAAX" else text.replace(old, new)), said)
        one = [k for k, row in enumerate(rows) if row != (105, 2)]
        part = dmig("KAAX", K[np.ix_(one, one)], [rows[k] for k in one]) + dmig("MAAX", M[np.ix_(one, one)], [rows[k] for k in one])
        turned = "CORD2R,10,0,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n" + self.grids(dict.fromkeys(BLOCKS.top, 10)) + part
        self.rejected_again(self.file("b.pch", turned), r"node 105 .*\[2\]")
        self.rejected_again(self.file("b.pch", text + "CELAS2,1,1000.,13,1,14,1\n"), "CELAS2.*beside DMIG")
        self.rejected_again(self.file("b.pch", text), self.file("b.bdf", "BEGIN BULK\nSPC1,1,1,13\n"), "node 13 .*SPC")
        self.rejected_again(self.file("b.pch", text.replace(self.grids(), "")), "no GRID")
        self.imported(
            self.file("b.pch", text),
            self.file(
                "b.bdf",
                "K2GG = X\n".replace("K2GG", "$")
                + "SET 7 = 101 THRU 112, 25\nSPC = 4\nBEGIN BULK\nSPC1,4,123,1,THRU,12\nCBAR,1,1,2,3\nENDDATA\n",
            ),
        )
        folder = Folder(self.out)
        self.assertEqual(sorted(folder.sets["SET7"]), [25, *BLOCKS.top])
        self.assertIn("CBAR (1 ×)", " ".join(folder.about["left_out"]))

    @needs("pyyeti")
    def test_output4_in_all_its_forms(self):
        from pyyeti.nastran import op4

        order = (
            "EXTRN,"
            + "".join(
                f"{node},123," if k % 4 < 3 else f"{node},123\n," for k, node in enumerate(sorted({n for n, _ in BLOCKS.rows}))
            ).rstrip("\n,")
            + "\n"
        )
        nodes = self.file("s.pch", self.grids() + order)
        path = self.folder / "s.op4"
        for binary, form, endian in [(False, form, "") for form in ("dense", "bigmat", "nonbigmat")] + [
            (True, form, e) for form in ("dense", "bigmat", "nonbigmat") for e in "<>"
        ]:
            with self.subTest(form, binary=binary, endian=endian):
                op4.write(str(path), {"kaa": BLOCKS.K, "maa": BLOCKS.M}, binary=binary, sparse=form, endian=endian)
                self.same(self.imported(path, nodes))
                if not binary:
                    path.write_text(path.read_text().replace("E+", "D+").replace("E-", "D-"))
                    self.same(self.imported(path, nodes))
        for digits, kind in ((7, "f4"), (8, "f8")):
            op4.write(str(path), {"kaa": BLOCKS.K, "maa": BLOCKS.M}, binary=False, digits=digits)
            self.assertEqual(self.imported(path, nodes).matrices["K"].dtype, kind)
        op4.write(str(path), {"kaa": BLOCKS.K * (1 + 0.01j), "maa": BLOCKS.M, "k4aa": 0 * BLOCKS.K}, binary=True)
        folder = self.imported(path, nodes)
        np.testing.assert_allclose(folder.matrices["Ks"], 0.01 * BLOCKS.K, atol=1e-9 * BLOCKS.K.max())
        self.rejected_again(path, self.file("s.pch", self.grids()), "180 rows, but the count of six rows per GRID")
        self.rejected_again(path, "no GRID")
        self.rejected_again(path, self.file("s.pch", self.grids() + "EXTRN,14,123,13,123\n"), "ascend")
        op4.write(str(path), {"kaa": BLOCKS.K[:, :9], "maa": BLOCKS.M}, binary=True)
        self.rejected_again(path, nodes, "9 columns")
        skew = BLOCKS.K + np.triu(np.full(BLOCKS.K.shape, 1e5), 1)
        op4.write(str(path), {"kaa": skew, "maa": BLOCKS.M}, binary=True)
        self.file("s.pch", self.grids() + order)
        self.rejected_again(path, nodes, "not symmetric")
        op4.write(str(path), {"kaa": np.triu(BLOCKS.K), "maa": BLOCKS.M}, binary=True)
        self.rejected_again(path, nodes, "one side")
        op4.write(str(path), {"kaa": BLOCKS.K, "kgg": BLOCKS.K, "maa": BLOCKS.M}, binary=True)
        self.rejected_again(path, nodes, "both denote stiffness")

    @needs("pyyeti")
    def test_positions_are_those_of_pyyeti(self):
        from pyyeti.nastran import bulk

        turned = "CORD2C,30,31,1.,20.,3.,1.,20.,4.\n,2.,40.,3.\nCORD2S,31,32,4.,30.,60.,5.,30.,60.\n,4.,90.,10.\nCORD2R,32,0,1.,2.,3.,2.,3.,4.\n,0.,5.,3.\n"
        text = turned + self.grids().replace(
            "GRID*                 25               0", "GRID*                 25              30"
        ).replace("GRID*                 26               0", "GRID*                 26              31")
        K, M = BLOCKS.K, BLOCKS.M
        folder = self.imported(self.file("u.pch", text + dmig("KAAX", K, BLOCKS.rows) + dmig("MAAX", M, BLOCKS.rows)))
        uset = bulk.bulk2uset(str(self.file("u.bdf", text)))[0]
        for node in (25, 26, 27):
            np.testing.assert_allclose(folder.nodes[node], uset.loc[(node, 1), "x":"z"].to_numpy(float), atol=1e-9)
        self.assertGreater(np.abs(folder.nodes[25] - BLOCKS.nodes[25]).max(), 1.0)

    @needs("pyyeti")
    def test_matrices_of_nastran_itself(self):
        if not (SHARED / "nastran_op4").is_dir():
            self.skipTest(f"{SHARED} has no matrices of other projects")
        op4, dmig_ = SHARED / "nastran_op4", SHARED / "nastran_dmig"
        for nodes in ("se_test_n11.pch", "se_test_n11.asm"):
            folder = self.imported(op4 / "se_test_n11.op4", op4 / nodes)
            self.assertEqual(sum(direction == 0 for _, direction in folder.rows), 39)
            # With all grids held the modal coordinates stay.
            modal = [k for k, (_, direction) in enumerate(folder.rows) if direction == 0]
            K, M = (folder.matrices[name][np.ix_(modal, modal)] for name in "KM")
            np.testing.assert_allclose(Folder.eigen(K, M)[0], 365.26, atol=0.01)
            np.testing.assert_allclose(folder.frequencies()[0], 113.1312, rtol=1e-5)
        for name, right in (
            ("test_case", [132.8301 / 2 / np.pi, 134.1818 / 2 / np.pi]),
            ("sol103_swept_plane", [1.339207, 3.406026, 5.610046]),
        ):
            folder = self.imported(dmig_ / f"{name}.pch1", dmig_ / f"{name}.bdf")
            np.testing.assert_allclose(folder.frequencies()[: len(right)], right, rtol=1e-6)

    def bulk(self, *more, kind="CHEXA", case="SPC = 3"):
        lines = ["SOL 103", "CEND", case, "BEGIN BULK", "MAT1,1,210000.,,0.3,7.85-9", "PSOLID,1,1,,TWO,,FULL", *more]
        lines += [
            f"{kind},{k},1," + ",".join(map(str, e[:6])) + "\n," + ",".join(map(str, e[6:])) for k, e in enumerate(BLOCKS.elements, 1)
        ]
        return "\n".join(lines) + "\nSPC1,3,123456,1,THRU,12\nEIGRL,1,,,10\n" + self.grids() + "ENDDATA\n"

    @needs("pyyeti")
    def test_a_mesh_in_bulk_data(self):
        folder = self.imported(self.file("m.bdf", self.bulk("PARAM,POST,0")))
        self.assertEqual({element[0] for element in folder.elements.values()}, {"C3D8"})
        np.testing.assert_allclose(folder.frequencies()[0], FREE, rtol=1e-7)
        left = " ".join(folder.about["left_out"])
        self.assertIn("PARAM POST", left)
        self.assertIn("EIGRL", left)
        folder = self.imported(self.file("m.bdf", self.bulk("PARAM,WTMASS,4.").replace(",,0.3,7.85-9", ",80769.23,,7.85-9,,,0.02")))
        self.assertIn("*DENSITY\n3.14e-08\n", (self.out / "mesh.inp").read_text())
        self.assertRegex((self.out / "mesh.inp").read_text(), r"\*ELASTIC\n210000.0, 0.3000000")
        self.assertIn("*DENSITY\n3.14e-08\n*DAMPING, STRUCTURAL=0.02\n", (self.out / "mesh.inp").read_text())
        for text, said in (
            ("CBUSH,900,1,101,25", "CBUSH"),
            ("CQUAD4,900,1,101,102,105,104", "CQUAD4"),
            ("CONM2,900,101,0,1.", "CONM2"),
            ("RBE3,900,,101,123,1.,123,25", "RBE3"),
            ("RBE2,900,101,123", "RBE2.*no dependent node"),
            ("SPCADD,3,4", "SPCADD"),
            ("SPC,3,101,1,0.5", "not zero"),
            ("PARAM,CK1,2.", "CK1"),
            ("CHEXA,900,2,1,2,5,4,13,14\n,17,16", "property 2"),
            ("CHEXA,900,1,1,2,5,4,13,14\n,17", "7 nodes"),
            ("CTETRA,900,1,1,2,4,9999", "9999"),
            ("GRID,1,,7.,8.,9.", "GRID.*again"),
            ("MAT1,7,zwei,,0.3", "zwei|E, G"),
            ("  oops", "oops|OOPS"),
        ):
            with self.subTest(text):
                extra = "MAT1,7,1.,,.3,1.\nPSOLID,7,7\n" if "zwei" not in text else "PSOLID,7,7\n"
                self.rejected_again(self.file("m.bdf", self.bulk(extra + text)), said)
        self.rejected_again(self.file("m.bdf", self.bulk().replace("TWO,,FULL", "TWO,,")), "IN = TWO")
        self.rejected_again(self.file("m.bdf", self.bulk("INCLUDE 'nowhere.bdf'")), "nowhere.bdf")
        # A second set of SPC is not used.
        self.file("spc.bdf", "SPC1,4,123,TIP".replace("TIP", "101") + "\n")
        self.assertEqual(len(self.imported(self.file("m.bdf", self.bulk("include 'spc.bdf'"))).held), 36)
        self.assertEqual(len(Folder(self.out).about["files"]), 2)
        self.assertIn("SPC that the case control does not select: 4.", " ".join(Folder(self.out).about["left_out"]))

    @needs("pyyeti")
    def test_the_case_control_selects_constraints(self):
        mpc = "MPC,7,105,1,1.,29,1,-1."
        for case, held, equations, said in (
            ("SPC = 3\nMPC=7", 36, 1, None),
            ("subcase 1\nspc=3\nmpc=7\nSUBCASE 2\nMPC = 7\nSPC = 3", 36, 1, None),
            ("SPC = 3\nSUBCASE 1\nSPCFORCES = ALL\nSUBCASE 2\nLABEL = x", 36, 0, "MPC that the case control does not select: 7"),
            ("$", 0, 0, "SPC that the case control does not select: 3"),
        ):
            with self.subTest(case):
                folder = self.imported(self.file("m.bdf", self.bulk(mpc, case=case)))
                self.assertEqual((len(folder.held), len(folder.equations)), (held, equations))
                self.assertIn(said or "", " ".join(folder.about["left_out"]))
        for case, said in (
            ("SPC = 9", r"m\.bdf: .*SPC = 9, .*sets are 3"),
            ("SPC = 3\nMPC = 8", "MPC = 8, .*sets are 7"),
            ("SUBCASE 1\nSPC = 3\nSUBCASE 2\nSPC = 4", "3 in subcase 1; 4 in subcase 2"),
            ("SUBCASE 1\nSPC = 3\nSUBCASE 2\nLOAD = 1", "3 in subcase 1; none in subcase 2"),
        ):
            self.rejected_again(self.file("m.bdf", self.bulk(mpc, case=case)), said)
        alone = self.bulk(mpc).split("BEGIN BULK\n")[1]
        folder = self.imported(self.file("m.bdf", alone))
        self.assertEqual((len(folder.held), len(folder.equations)), (36, 1))
        self.assertIn("the only set of SPC, 3.", " ".join(folder.about["left_out"]))
        self.rejected_again(self.file("m.bdf", "SPC1,4,1,101\n" + alone), r"sets \[3, 4\]")

    @needs("pyyeti")
    def test_damping_of_parameters(self):
        for case, more in (("SPC = 3", "PARAM,G,.02"), ("SPC = 3\nparam,g,0.02", "PARAM,G,2.-2")):
            folder = self.imported(self.file("m.bdf", self.bulk(more, case=case)))
            self.assertEqual(tomllib.loads((self.out / "scene.toml").read_text())["dynamics"], {"loss_factor": 0.02})
            self.assertIn("writes PARAM G = 0.02 as dynamics.loss_factor", " ".join(folder.about["left_out"]))
        folder = self.imported(self.file("m.bdf", self.bulk("PARAM,ALPHA1,5.\nPARAM,W4,100.")))
        self.assertRegex(" ".join(folder.about["left_out"]), "ALPHA1 = 5.0: give damping proportional to the mass.* W4 = 100.0: structural damping")
        self.rejected_again(self.file("m.bdf", self.bulk("PARAM,G,.02", case="PARAM,G,.03")), "G = 0.02 beside G = 0.03")
        self.rejected_again(self.file("m.bdf", self.bulk("PARAM,G,-.02")), "G = -0.02")

    @needs("pyyeti")
    def test_no_warning_of_a_library_is_printed(self):
        far = self.bulk().replace(grid(107, BLOCKS.nodes[107]), "GRID,107,,1.+308,-1.+308,1.+308\n")
        self.rejected_again(self.file("m.bdf", far), "inside out")

    @needs("pyyeti")
    def test_orders_of_nodes_of_second_order(self):
        mesh = Gmsh("mesh").mesh
        upright = {
            "CHEXA": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)],
            "CPENTA": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)],
            "CTETRA": Gmsh.DECK["C3D10"],
        }
        for kind, name, deck in ((17, "CHEXA", "C3D20R"), (18, "CPENTA", "C3D15"), (11, "CTETRA", "C3D10")):
            points, elements, _ = mesh(kind)
            at = {tuple(p): k + 1 for k, p in enumerate(points)}
            lines = "".join(grid(k, p) for p, k in at.items()) + "MAT1,1,210000.,,0.3,7.85-9\nPSOLID,1,1\n"
            corners = len(Gmsh.KINDS[kind][0][0])
            for k, element in enumerate(elements, 1):
                nodes = [n + 1 for n in element[:corners]] + [
                    at[tuple((points[element[a]] + points[element[b]]) / 2)] for a, b in upright[name]
                ]
                fields = [str(k), "1", *map(str, nodes)]
                lines += name + "".join("," + ",".join(fields[i : i + 8]) + "\n" for i in range(0, len(fields), 8))
            folder = self.imported(self.file("o.bdf", lines))
            for type_, nodes in folder.elements.values():
                self.assertEqual(type_, deck)
                here = np.array([folder.nodes[n] for n in nodes])
                for (a, b), middle in zip(Gmsh.DECK[deck.removesuffix("R")], here[corners:], strict=True):
                    np.testing.assert_allclose(middle, (here[a] + here[b]) / 2)

    @needs("pyyeti")
    def test_mpc_and_rigid_bodies(self):
        equal = "".join(f"MPC,1,{u},{d},1.,{b},{d},-1.\n" for u, b in PAIRS for d in (1, 2, 3))
        folder = self.imported(self.file("m.bdf", self.bulk(equal, case="SPC = 3\nMPC = 1")))
        np.testing.assert_allclose(folder.frequencies()[0], tied(), rtol=1e-7)
        # The upper body's face is rigid, by a node of its own; its motions stay free.
        tip = [n for n in BLOCKS.nodes if BLOCKS.nodes[n][2] == 20.0]
        rigid = "GRID,900,,1.,2.,40.\nRBE2,900,900,123456,"

        def body(nodes):
            fields = [*map(str, nodes)]
            return rigid + ",".join(fields[:4]) + "".join("\n," + ",".join(fields[k : k + 8]) for k in range(4, len(fields), 8)) + "\n"

        right = self.rigid(tip)
        # Of a node of its own, or of one of the body.
        for text in (body(tip), body(tip[1:]).replace("RBE2,900,900", f"RBE2,900,{tip[0]}")):
            folder = self.imported(self.file("m.bdf", self.bulk(text)))
            np.testing.assert_allclose(folder.frequencies()[0], right, rtol=1e-6)
        # Held by its node: displacements and rotations.
        folder = self.imported(self.file("m.bdf", self.bulk(body(tip) + "SPC1,3,123456,900")))
        self.assertEqual(sorted({node for node, _ in folder.held}), sorted([*range(1, 13), *tip]))
        folder = self.imported(self.file("m.bdf", self.bulk(body(tip) + "SPC1,3,456,900")))
        np.testing.assert_allclose(folder.frequencies()[0], self.rigid(tip, turns=False), rtol=1e-6)
        text = self.bulk(body(tip) + f"MPC,1,{tip[4]},1,1.,{tip[5]},2,-1.", case="SPC = 3\nMPC = 1")
        self.rejected_again(self.file("m.bdf", text), "another entry|share")
        # SPC in axes of its own.
        text = (
            self.bulk("CORD2R,10,0,0.,0.,0.,0.,0.,1.\n,0.6,0.8,0.").replace(
                grid(107, BLOCKS.nodes[107]), grid(107, BLOCKS.nodes[107], cd=10)
            )
            + ""
        )
        folder = self.imported(self.file("m.bdf", text.replace("SPC1,3,123456", "SPC1,3,1,107\nSPC1,3,123456")))
        self.assertEqual(len(folder.equations), 1)
        values = {direction: factor for _, direction, factor in folder.equations[0]}
        self.assertAlmostEqual(values[1] / values[2], 0.75)

    def rigid(self, nodes, turns=True):
        """The lowest frequency with some nodes moving as a rigid body."""
        at = {row: k for k, row in enumerate(BLOCKS.rows)}
        others = [row for row in BLOCKS.rows if row[0] not in nodes]
        join = np.zeros((len(at), len(others) + (6 if turns else 3)))
        for k, row in enumerate(others):
            join[at[row], k] = 1.0
        for node in nodes:
            x, y, z = BLOCKS.nodes[node]
            spin = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
            for d in range(3):
                join[at[(node, d + 1)], len(others) + d] = 1.0
                if turns:
                    join[at[(node, d + 1)], len(others) + 3 :] = spin[d]
        found = Folder.eigen(join.T @ BLOCKS.K @ join, join.T @ BLOCKS.M @ join)
        return found[found > 10.0][0]


class Matlab(Import):
    NODES = np.array([[node, *BLOCKS.nodes[node]] for node in sorted({n for n, _ in BLOCKS.rows})])

    def written(self, version, **more):
        path = self.folder / f"v{version}.mat"
        values = {"K": sparse.csc_matrix(BLOCKS.K), "M": BLOCKS.M, "nodes": self.NODES, **more}
        if version == "7.3":
            import h5py

            with h5py.File(path, "w", userblock_size=512) as out:
                for name, value in values.items():
                    if sparse.issparse(value):
                        group = out.create_group(name)
                        group.attrs["MATLAB_sparse"] = np.uint64(value.shape[0])
                        group["data"], group["ir"], group["jc"] = value.data, value.indices.astype("u8"), value.indptr.astype("u8")
                    elif np.iscomplexobj(value):
                        out[name] = np.rec.fromarrays([value.T.real, value.T.imag], names="real,imag")
                    else:
                        out[name] = value.T
            with path.open("r+b") as out:
                out.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
        else:
            scipy_io.savemat(path, values, format=version, do_compression=version == "5")
        return path

    def versions(self):
        return ["4", "5", *(["7.3"] if find_spec("h5py") else [])]

    def test_all_versions(self):
        for version in self.versions():
            with self.subTest(version):
                self.same(self.imported(self.written(version)), 1e-15)
                folder = self.imported(self.written(version, K=BLOCKS.K * (1 + 0.02j), C=1e-5 * BLOCKS.K, X=np.eye(2)))
                self.same(folder, 1e-15)
                np.testing.assert_allclose(folder.matrices["Ks"], 0.02 * BLOCKS.K, atol=1e-9 * BLOCKS.K.max())
                np.testing.assert_allclose(folder.matrices["C"], 1e-5 * BLOCKS.K, atol=1e-14 * BLOCKS.K.max())
                self.assertIn("the variable X", " ".join(folder.about["left_out"]))
                if version != "4":
                    folder = self.imported(self.written(version, K=BLOCKS.K.astype("f4")))
                    self.assertEqual([folder.matrices[name].dtype for name in "KM"], ["f4", "f8"])

    def test_rows_and_tables_beside(self):
        order = random.Random(2).sample(range(len(BLOCKS.rows)), len(BLOCKS.rows))
        path = self.folder / "s.mat"
        scipy_io.savemat(path, {"model": {"K": BLOCKS.K[np.ix_(order, order)], "M": BLOCKS.M[np.ix_(order, order)]}})
        nodes = self.file("nodes.csv", "node,x,y,z\n" + "".join(f"{int(n)},{x},{y},{z}\n" for n, x, y, z in self.NODES))
        rows = self.file("rows.csv", "node,direction\n" + "".join("{},{}\n".format(*BLOCKS.rows[k]) for k in order))
        sets = self.file(
            "sets.csv", "set,node\n" + "".join(f"TOP,{n}\n" for n in BLOCKS.top) + "".join(f"BOTTOM,{n}\n" for n in BLOCKS.bottom)
        )
        folder = self.imported(path, nodes, rows, sets, "--upper", "TOP", "--lower", "BOTTOM", "--fixed", "TOP")
        self.assertEqual(folder.rows, [BLOCKS.rows[k] for k in order])
        self.assertAlmostEqual(folder.stuck(folder.nearest_pairs("TOP", "BOTTOM")), STUCK, places=2)
        self.assertIn('fixed = "TOP"', (self.out / "scene.toml").read_text())
        shutil.rmtree(self.out)
        self.rejected(path, said="no positions of nodes")
        self.rejected(path, nodes, self.file("x.csv", "a,b\n1,2\n"), said="the first line is a,b")
        self.rejected(path, nodes, self.file("rows.csv", "node,direction\n13,1\n"), said="180 rows, but the list of its rows has 1;")
        self.rejected(path, nodes, self.file("rows.csv", "node,direction\n" + "13,1\n" * 180), said="two rows")
        self.rejected(path, nodes, self.file("sets.csv", "set,node\nTOP,99\n"), said="node 99")
        self.rejected(path, self.file("nodes.csv", "node,x,y,z\n1,2,3,4\n"), said="neither three nor six")
        self.rejected(path, self.file("nodes.csv", "node,x,y,z\n1,nan,3,4\n"), said="not finite")

    def test_rejections(self):
        for change, said in (
            ({"K": np.ones((3, 4))}, "3 rows and 4 columns|for 60 nodes"),
            ({"M": np.triu(BLOCKS.M)}, "one side"),
            ({"M": BLOCKS.M * 1j}, "complex"),
            ({"M": np.full(BLOCKS.M.shape, np.nan)}, "not finite"),
            ({"M": -BLOCKS.M}, "zero|negative"),
            ({"nodes": np.eye(3)}, "4 columns"),
            ({"k": BLOCKS.K}, "second stiffness"),
        ):
            with self.subTest(said):
                self.rejected(self.written("5", **change), said=said)


class Ansys(Import):
    @needs("ansys.mapdl.reader" if find_spec("ansys") else "ansys")
    def test_a_file_of_ansys(self):
        from ansys.mapdl.reader import examples

        folder = self.imported(examples.fullfile, examples.hexarchivefile)
        self.assertEqual((len(folder.rows), len(folder.sets["NCOMP2"])), (900, 98))
        np.testing.assert_allclose(folder.frequencies()[:3], [1283.200, 1283.200, 5781.975], rtol=1e-6)
        shutil.rmtree(self.out)
        self.rejected(examples.fullfile, said=r"CDWRITE.*--axes global")
        nodes = self.file("nodes.csv", "node,x,y,z\n" + "".join(f"{n},{x},{y},{z}\n" for n, (x, y, z) in folder.nodes.items()))
        self.assertEqual(self.imported(examples.fullfile, nodes, "--axes", "global").rows, folder.rows)
        shutil.rmtree(self.out)
        cut = Path(examples.hexarchivefile).read_text().splitlines()[:60]
        self.rejected(examples.fullfile, self.file("t.cdb", "\n".join(cut) + "\n"), said="NBLOCK does not end")

    def test_nodes_with_angles(self):
        degrees = (30.0, 20.0, -50.0)
        turn = rotation([0, 0, 1], degrees[0]) @ rotation([1, 0, 0], degrees[1]) @ rotation([0, 1, 0], degrees[2])
        K, M = BLOCKS.along(dict.fromkeys(BLOCKS.top, turn.T))
        lines = ["NBLOCK,6,SOLID,  136,  72", "(3i9,6e21.13e3)"]
        for node, at in BLOCKS.nodes.items():
            lines.append(f"{node:9d}{0:9d}{0:9d}" + "".join(f"{x:21.13E}" for x in [*at, *(degrees if node in BLOCKS.top else ())]))
        lines += [
            "N,R5.3,LOC,       -1,",
            "CMBLOCK,TOP     ,NODE,       2  ! users node component",
            "(8i10)",
            f"{101:10d}{-112:10d}",
            "CMBLOCK,PART,ELEM,1",
            "(8i10)",
            f"{1:10d}",
        ]
        deck = self.file("t.cdb", "\n".join(lines) + "\n")
        shuffled = random.Random(3).sample(range(len(BLOCKS.rows)), len(BLOCKS.rows))
        found = {"rows": np.array([(BLOCKS.rows[k][0], BLOCKS.rows[k][1] - 1) for k in shuffled]), "held": np.zeros((0, 2), int)}
        for name, matrix in (("K", K), ("M", M)):
            upper = sparse.coo_array(np.triu(matrix[np.ix_(shuffled, shuffled)]))
            found |= {f"{name} at": np.array([upper.row, upper.col]), f"{name} values": upper.data, f"{name} shape": np.array(upper.shape)}
        with mock.patch.object(child, "call", return_value=found):
            folder = self.imported(self.file("t.full", ""), deck)
            self.same(folder)
            self.assertEqual(folder.sets["TOP"], BLOCKS.top)
            self.assertIn("PART", " ".join(folder.about["left_out"]))
            shutil.rmtree(self.out)
            self.rejected(self.folder / "t.full", deck, "--axes", "global", said="has angles")
            self.rejected(self.folder / "t.full", self.file("u.cdb", deck.read_text() + "NROTAT,ALL\n"), said="NROTAT")


class Truss(Import):
    """The files that the program read itself before: tests/structure/samples/make.py."""

    SAMPLES = HERE.parent / "structure" / "samples"
    NODES = ((0, 0, 0), (1.3, 0.1, 0), (0.2, 0.9, 0.3), (0.4, 0.3, 1.1), (0.9, 0.8, 0.7))

    def check(self, folder, tolerance):
        for name in "KM":
            right = scipy_io.mmread(self.SAMPLES / {"K": "coordinate_K.mtx", "M": "array_M.mtx"}[name])
            right = right.toarray() if sparse.issparse(right) else np.asarray(right)
            self.assertLess(np.abs(folder.matrices[name] - right).max(), tolerance * np.abs(right).max())
        self.assertEqual(folder.rows, [(n, d) for n in range(1, 6) for d in (1, 2, 3)])

    @needs("pyyeti")
    def test_files_of_nastran(self):
        grids = "".join(f"GRID,{n},,{x:.1f},{y:.1f},{z:.1f}\n" for n, (x, y, z) in enumerate(self.NODES, 1))
        grid = self.file("grids.pch", grids)
        rows = self.file("rows.pch", grids + "".join(f"EXTRN,{n},123\n" for n in range(1, 6)))
        for name, beside, tolerance in (
            *((f"{kind}_{form}.op4", rows, 1e-14) for kind in ("dense", "strings", "bigmat") for form in ("text", "binary")),
            ("single.op4", rows, 1e-6),
            ("large.pch", grid, 1e-9),
            ("free_fields.bdf", grid, 1e-14),
        ):
            with self.subTest(name):
                file = self.file(name, (self.SAMPLES / "imported" / name).read_bytes().replace(b"GRID,1,,0.,0.,0.\n", b""))
                folder = self.imported(file, beside)
                self.check(folder, tolerance)
                self.assertEqual(folder.matrices["K"].dtype, "f4" if name == "single.op4" else "f8")

    def test_files_of_matlab(self):
        table = "".join(f"{n},{x},{y},{z}\n" for n, (x, y, z) in enumerate(self.NODES, 1))
        nodes = self.file("nodes.csv", "node,x,y,z\n" + table)
        for name in ("sparse.mat", "sparse_compressed.mat", "dense.mat"):
            with self.subTest(name):
                self.check(self.imported(self.SAMPLES / "imported" / name, nodes), 1e-14)


class Map:
    """A table of `fretwear-import --surface`: heights[i, j] and spacing in um, and the record in it."""

    def __init__(self, path):
        from pyarrow import parquet

        table = parquet.read_table(path)
        assert [(field.name, field.metadata) for field in table.schema] == [(name, {b"unit": b"m"}) for name in "xyz"], table.schema
        self.about = json.loads(table.schema.metadata[b"fretwear_import"])
        shape = self.about["points"]
        x, y, z = (table[name].to_numpy(zero_copy_only=False).reshape(shape) * 1e6 for name in "xyz")
        self.heights, self.spacing = z, (x[1, 0] - x[0, 0], y[0, 1] - y[0, 0])
        assert table["z"].null_count == np.isnan(z).sum() == self.about["holes"] and not np.isinf(z).any()
        for line, step, axis in ((x[:, 0], self.spacing[0], x.T), (y[0], self.spacing[1], y)):
            assert (axis == line).all() and np.allclose(line, step * np.arange(len(line)), rtol=1e-12, atol=0.0)


class Surface(Import):
    """Topographies of instruments. The files are written byte by byte, so that heights and their places are known."""

    @classmethod
    def setUpClass(cls):
        if find_spec("SurfaceTopography"):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                importlib.import_module("SurfaceTopography.IO")

    def setUp(self):
        super().setUp()
        self.out = self.folder / "out.parquet"
        # The library takes seconds to import: here once for all, but where a test is of the child.
        direct = mock.patch.object(child, "call", side_effect=lambda function, arguments, **others: surface.library_map(**arguments))
        direct.start()
        self.addCleanup(mock.patch.stopall)

    def made(self, kind, *more, name=None, **options):
        writer, holes = surfaces.WRITERS[kind]
        return self.file(name or f"a.{kind}", writer(surfaces.heights(holes), surfaces.SPACING, *more, **options))

    def map(self, file, *options):
        self.out.unlink(missing_ok=True)
        code, said = self.call("--surface", file, *options)
        self.assertEqual(code, 0, said)
        return Map(self.out), said

    def rejected(self, file, *options, said):
        self.out.unlink(missing_ok=True)
        super().rejected("--surface", file, *options, said=said)

    def same(self, found, right, spacing=surfaces.SPACING, tolerance=2e-7):
        np.testing.assert_allclose(found.spacing, spacing, rtol=2e-7)
        np.testing.assert_array_equal(np.isnan(found.heights), np.isnan(right))
        np.testing.assert_allclose(found.heights, right, rtol=0.0, atol=tolerance * np.nanmax(right))

    @needs("SurfaceTopography")
    def test_every_height_and_hole_is_in_its_place(self):
        for kind, (_, holes) in surfaces.WRITERS.items():
            with self.subTest(kind):
                size = ["--size", "14 um,3.75 um"] if kind == "nms" else []
                found, said = self.map(self.made(kind), *size)
                # NMS has 16 bits between its lowest and its highest point.
                self.same(found, surfaces.heights(holes), tolerance=1e-5 if kind == "nms" else 2e-7)
                self.assertEqual(found.about["library"]["name"], "SurfaceTopography")
                self.assertEqual(found.about["file"]["sha256"], hashlib.sha256((self.folder / f"a.{kind}").read_bytes()).hexdigest())
                for line in ("points   7 x 5", "spacing  2 um x 0.75 um", f"holes    {2 * holes}", 'kind = "file"', f'path = "{self.out}"'):
                    self.assertIn(line, said)

    @needs("SurfaceTopography")
    def test_a_dat_is_read_by_its_first_bytes(self):
        heights = surfaces.heights(True)
        found, _ = self.map(self.file("a.dat", surfaces.metropro(heights, (2.0, 2.0))))
        self.same(found, heights, (2.0, 2.0), tolerance=1e-5)
        self.rejected(self.file("b.dat", "1 2 3\n"), said="reads this format directly")
        self.rejected(self.file("c.dat", b"\0" * 9), said=r"several formats.*--format NAME.*metropro \(\.dat\)")
        # The name of the reader decides over the extension.
        found, _ = self.map(self.made("os3d", name="d.dat"), "--format", "os3d")
        self.same(found, surfaces.heights(True))

    @needs("SurfaceTopography")
    def test_units_are_never_made_up(self):
        volts = self.made("mi", (("Deflection", "V"),))
        self.rejected(volts, said=r"a\.mi: the heights of 'Deflection' have the unit 'V', .*give the length of one unit of height")
        found, said = self.map(volts, "--unit", "500 nm")
        self.same(found, surfaces.heights(False) / 2)
        self.assertIn("from --unit 500 nm; the file has the unit 'V'", said)
        self.assertEqual(found.about["corrected"], ["unit from --unit 500 nm; the file has the unit 'V'"])
        # What is no length in a Nanoscope file is its digits: 4096 for 1 um here.
        digits = self.made("spm", (("Deflection", "V"),), name="a.003")
        self.rejected(digits, said="no unit")
        self.same(self.map(digits, "--unit", "0.244140625 nm")[0], surfaces.heights(False))
        # A wave without a unit of its values has none, whatever its sides have.
        wave = self.made("ibw", unit="")
        self.rejected(wave, said="no unit")
        self.same(self.map(wave, "--unit", "m")[0], surfaces.heights(True))
        # Values of a wave in nm over sides in m are lengths.
        self.rejected(self.made("ibw", unit="A"), said="the unit 'A'")
        self.rejected(self.made("os3d"), "--unit", "nm", said="--unit nm: .* states the unit µm")
        self.map(self.made("os3d"), "--unit", "um")
        for unit in ("V", "0 m", "1e999 m", "-1 m", "m,kg,s"):
            self.rejected(volts, "--unit", unit, said=f"--unit: the value is '{unit}'")

    @needs("SurfaceTopography")
    def test_sizes_are_never_made_up(self):
        heights = surfaces.heights(False)[:5, :5]
        tile = self.file("a.hgt", surfaces.hgt(heights * 8))
        self.rejected(tile, "--unit", "0.125 um", said="the file states no size.*--size")
        found, said = self.map(tile, "--unit", "0.125 um", "--size", "0.01mm,5 um")
        self.same(found, heights, (2.0, 1.0))
        self.assertIn("10 um x 5 um (from --size; the file states no size", said)
        self.rejected(self.made("nms"), said="states 14 m x 3.75 m; give the size")
        _, said = self.map(self.made("nms"), "--size", "14 um,3.75 um")
        self.assertIn("14 um x 3.75 um (from --size; the file states 14 m x 3.75 m)", said)
        # Sides in volts.
        self.rejected(self.made("ibw", side="V"), said="states 1.4e-05 x 3.75e-06 in the unit 'V'; give the size")
        for size in ("1 mm", "1 mm,2 km", "0.5 um,1 mm", "1 mm,1 mm,1 mm", "2,2"):
            self.rejected(tile, "--unit", "um", "--size", size, said="--size")

    @needs("SurfaceTopography")
    def test_a_channel_is_chosen_or_named(self):
        several = self.made("gwy", channels=(("Forth", "m"), ("Back", "m"), ("Back", "m")))
        self.rejected(several, said=r"3 channels contain heights; give one with --channel NAME.*'Forth' \(7 x 5, the unit 'm'\); 'Back#1'.*'Back#2'")
        self.rejected(several, "--channel", "Back", said="no channel 'Back'; its channels are 'Forth'")
        self.same(self.map(several, "--channel", "Forth")[0], surfaces.heights(True))
        self.same(self.map(several, "--channel", "Back#2")[0], surfaces.heights(True)[::-1, ::-1])
        # One of two is a height.
        for kind in ("mi", "spm"):
            both = self.made(kind, (("Height", "nm" if kind == "spm" else "um"), ("Deflection", "V")))
            self.same(self.map(both)[0], surfaces.heights(False))

    @needs("SurfaceTopography")
    def test_false_heights_and_profiles_are_rejected(self):
        heights = surfaces.heights(False)
        false = heights.copy()
        false[1, 2] = 1e30
        self.rejected(
            self.file("a.tmd", surfaces.tmd(false, surfaces.SPACING)), said=r"the heights span 1e\+24 m on a map of 14 um x 3.75 um"
        )
        self.rejected(self.file("b.tmd", surfaces.tmd(np.nan * heights, surfaces.SPACING)), said="has 0 heights for 7 x 5")
        self.rejected(self.file("a.os3d", surfaces.os3d(heights[:, :1], surfaces.SPACING)), said=r"is a profile \(7 x 1 points\)")

    @needs("SurfaceTopography")
    def test_the_child_returns_maps_and_sentences(self):
        mock.patch.stopall()
        self.same(self.map(self.made("gwy"))[0], surfaces.heights(True))
        heights = surfaces.heights(False)
        whole = surfaces.os3d(heights, surfaces.SPACING)
        self.rejected(self.file("b.os3d", whole[:-30]), said="SurfaceTopography cannot read the file.*damaged")
        self.rejected(self.file("c.os3d", b"text"), said="SurfaceTopography cannot read the file")
        many = whole.replace(struct.pack("<ii", 7, 5), struct.pack("<ii", 20000, 20000))
        self.rejected(self.file("d.os3d", many), said="more than 134217728|GB|cannot read")

    def test_files_that_never_go_to_the_library(self):
        with mock.patch.object(child, "call", side_effect=AssertionError):
            for extension in ("txt", "csv", "xyz", "asc", "tsv", "npy", "x3p", "sur", "SUR", "sdf", "al3d", "parquet"):
                self.rejected(self.file(f"a.{extension}", "1 2 3"), said=rf'reads this format directly; write surface.path = "a.{extension}"')
            self.rejected(self.file("a.dat", "1 2 3"), said="reads this format directly")
            self.rejected(self.file("a.bin", "DIGITAL SURF"), "--format", "sur", said="reads this format directly")
            self.rejected(self.file("a.lext", "x"), said="not measured")
            self.rejected(self.file("a.npz", "x"), said="without a unit")
            self.rejected(self.file("a.bin", "x"), said=r"give --format NAME with one of the readers bcr \(\.bcr \.bcrf\), datx")
            self.rejected(self.file("a.opd", "x"), "--format", "wyko", said="--format wyko: this reader does not exist; the known readers are bcr")
            self.rejected(self.folder / "none.opd", said="no such file")

    def test_options_and_outputs(self):
        file = self.file("a.opd", "x")
        self.rejected(file, "--upper", "TOP", "--lower", "BOTTOM", said="--upper applies only to structures")
        self.rejected(file, file, said="FILE... applies only to structures")
        for option in ("--format", "--channel", "--size"):
            super().rejected(file, option, "x", said=f"{option} applies only to surfaces")
        super().rejected(said="no input file")
        super().rejected(self.file("b.opd", "x"), said="--surface")
        self.out = self.folder / "map.csv"
        self.rejected(file, said=r"map\.csv: .*must end with \.parquet")

    @needs("SurfaceTopography")
    def test_an_existing_table_is_replaced_by_force_alone(self):
        self.out.write_text("old")
        code, said = self.call("--surface", self.made("os3d"))
        self.assertEqual((code, self.out.read_text()), (2, "old"), said)
        self.assertIn("--force to replace it", said)
        # What cannot be read replaces nothing.
        code, said = self.call("--surface", self.made("mi", (("Deflection", "V"),)), "--force")
        self.assertEqual((code, self.out.read_text()), (2, "old"), said)
        self.assertEqual(self.call("--surface", self.made("os3d"), "--force")[0], 0)
        self.same(Map(self.out), surfaces.heights(True))
        self.out = self.folder / "a.parquet"
        self.out.mkdir()
        code, said = self.call("--surface", self.made("os3d"), "--force")
        self.assertEqual((code, "give another name\n" in said), (2, True), said)

    def test_the_library_is_missing_or_old(self):
        file = self.file("a.opd", "x")
        package = self.folder / "SurfaceTopography-1.18.0.dist-info"
        package.mkdir()
        (package / "METADATA").write_text("Metadata-Version: 2.1\nName: SurfaceTopography\nVersion: 1.18.0\n")
        mock.patch.stopall()
        with mock.patch.dict(os.environ, {"PYTHONPATH": str(self.folder)}):
            self.rejected(file, said=r"needs SurfaceTopography \(version 1\.18\.0 is installed\); .*pip install 'fretwear\[surface\]'")

    def test_numpy_is_missing(self):
        for arguments, extra in ((["--surface", "a.opd"], "surface"), (["a.msh"], "abaqus")):
            code = f"import sys; sys.modules['numpy'] = None; from fretwear.importing.__main__ import main; sys.exit(main({[*arguments, '-o', 'a.parquet']}))"
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertRegex(done.stderr, rf"^error: .*numpy.*: pip install 'fretwear\[{extra}\]'\n$")

    def test_nothing_imports_the_library_under_the_gpl(self):
        for path in (HERE.parents[1] / "src" / "python").rglob("*.py"):
            self.assertNotIn("surfalize", path.read_text(encoding="utf-8"), path)
        if find_spec("SurfaceTopography"):
            code = "import sys; from fretwear.importing.surface import library_map as read; read(sys.argv[1], 'os3d', None); assert 'surfalize' not in sys.modules"
            subprocess.run([sys.executable, "-c", code, self.made("os3d")], check=True)

    @needs("SurfaceTopography")
    def test_a_real_file_and_its_false_size(self):
        real = REAL / "ST_nms-1.nms"
        if not real.is_file():
            self.skipTest("real topographies are not there")
        self.rejected(real, said="states 160 m x 160 m")
        found, _ = self.map(real, "--size", "160 um,160 um")
        head, counts = real.read_bytes()[:3468], np.frombuffer(real.read_bytes(), "<u2", 512 * 512, 3468)
        low, high = struct.unpack_from("<dd", head, 16)
        self.same(found, (low + counts.reshape(512, 512).T / 65534 * (high - low)), (0.3125, 0.3125), tolerance=1e-12)

    @needs("SurfaceTopography")
    def test_readers_are_those_of_the_library(self):
        code = "from SurfaceTopography.IO import readers; print({r.format(): sorted(r.file_extensions()) for r in readers})"
        known = ast.literal_eval(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout)
        for name, extensions in surface.READERS.items():
            self.assertLessEqual(set(extensions.split()), set(known[name]), name)
        # Profiles, and archives of any content.
        self.assertEqual(set(known) - set(surface.READERS) - surface.OWN - set(surface.REJECTED), {"mitutoyo", "nmm", "qep"})


class Damaged(Import):
    """Damaged files end in a sentence, or are read; never in a traceback, a hang, or half a folder."""

    def damaged(self, data, chance):
        data = bytearray(data)
        for _ in range(chance.choice((1, 1, 3))):
            at, kind = chance.randrange(max(1, len(data) - 16)), chance.randrange(6)
            if kind == 0:
                data[at] ^= 1 << chance.randrange(8)
            elif kind == 1:
                del data[at:]
                break
            elif kind == 2:
                other = chance.randrange(max(1, len(data) - 16))
                data[at : at + 8], data[other : other + 8] = data[other : other + 8], data[at : at + 8]
            elif kind == 3:
                data[at : at + 4] = struct.pack("<i", chance.choice((0, -1, 2**31 - 1, 10**8, len(data))))
            elif kind == 4:
                # A size near the front.
                head = chance.randrange(min(256, max(1, len(data) - 16)))
                data[head : head + 4] = struct.pack(chance.choice("<>") + "i", chance.choice((0, -1, 2**31 - 1, 10**8)))
            else:
                digits = [k for k in range(len(data)) if 48 <= data[k] < 58][:: max(1, len(data) // 2000)]
                if digits:
                    data[chance.choice(digits)] = chance.choice(b"0123456789-eE. ")
        return bytes(data)

    def check(self, files, *options):
        chance = random.Random(sum(len(file.name) for file in files))
        accepted = 0
        limits = {"FRETWEAR_IMPORT_SECONDS": "60", "FRETWEAR_IMPORT_MEMORY": "3"}
        for k in range(-(-MUTANTS // len(files))):
            for file in files:
                whole = file.read_bytes()
                bad = self.damaged(whole, chance)
                file.write_bytes(bad)
                self.out.unlink() if self.out.is_file() else shutil.rmtree(self.out, ignore_errors=True)
                with mock.patch.dict(os.environ, limits), self.subTest(file.name, k=k):
                    group = [file] if not options or not isinstance(options[0], dict) else options[0][file]
                    code, said = self.call(*group, *[o for o in options if not isinstance(o, dict)])
                    self.assertIn(code, (0, 2), said)
                    self.assertNotIn("Traceback", said)
                    self.assertNotIn("has a bug", said)
                    self.assertEqual(self.out.exists(), code == 0)
                    if code:
                        self.assertRegex(said, r"^error: [^\n]+\n$")
                    else:
                        Map(self.out) if self.out.is_file() else Folder(self.out)
                        accepted += 1
                file.write_bytes(whole)
        self.assertLess(accepted, MUTANTS)

    @needs("meshio")
    def test_gmsh(self):
        gmsh = Gmsh("mesh")
        gmsh.folder = self.folder
        files = [
            gmsh.written(17 if version == "2.2" else 5, version, binary, f"m{version}{binary}.msh")
            for version in ("2.2", "4.1")
            for binary in (False, True)
        ]
        self.check(files, "--material", f"BODY={STEEL}")

    @needs("pyyeti")
    def test_nastran(self):
        from pyyeti.nastran import op4

        nastran = Nastran("grids")
        small = [k for k, row in enumerate(BLOCKS.rows) if row[0] < 20]
        rows = [BLOCKS.rows[k] for k in small]
        K, M = (matrix[np.ix_(small, small)] for matrix in (BLOCKS.K, BLOCKS.M))
        nodes = self.file(
            "n.asm",
            nastran.grids()
            + "EXTRN,"
            + "".join(f"{node},123," if k % 4 < 3 else f"{node},123\n," for k, node in enumerate(sorted({n for n, _ in rows}))).rstrip(
                "\n,"
            )
            + "\n",
        )
        groups = {}
        for name, binary, form in (("a", False, "dense"), ("b", True, "dense"), ("c", True, "bigmat")):
            path = self.folder / f"{name}.op4"
            op4.write(str(path), {"kaa": K, "maa": M}, binary=binary, sparse=form)
            groups[path] = [path, nodes]
        punch = self.file("d.pch", nastran.grids() + dmig("KAAX", K, rows) + dmig("MAAX", M, rows))
        groups[punch] = [punch]
        bulk = self.file("e.bdf", nastran.bulk())
        groups[bulk] = [bulk]
        self.check(list(groups), groups)

    def test_matlab(self):
        matlab = Matlab("written")
        matlab.folder = self.folder
        self.check([matlab.written(version) for version in matlab.versions()])

    @needs("ansys.mapdl.reader" if find_spec("ansys") else "ansys")
    def test_ansys(self):
        from ansys.mapdl.reader import examples

        full = self.file("a.full", Path(examples.fullfile).read_bytes())
        deck = self.file("a.cdb", Path(examples.hexarchivefile).read_bytes())
        self.check([full, deck], {full: [full, deck], deck: [full, deck]})

    def test_abaqus(self):
        case = self.case("abaqus_transform")
        deck, *matrices = case("turned.inp", "turned_STIF1.mtx", "turned_MASS1.mtx")
        mesh = self.file("mesh.inp", (CASES / "cae_parts" / "job.inp").read_bytes())
        self.check([deck, mesh, *matrices], {mesh: [mesh]} | dict.fromkeys((deck, *matrices), [deck, *matrices]))

    @needs("SurfaceTopography")
    def test_surfaces(self):
        self.out = self.folder / "out.parquet"
        files = [
            self.file(f"a.{kind}", writer(surfaces.heights(holes), surfaces.SPACING))
            for kind, (writer, holes) in surfaces.WRITERS.items()
            if kind != "datx" or find_spec("h5py")
        ]
        # A child of this library takes seconds.
        files = files if LONG else files[::4]
        self.check(files, {file: ["--surface", file] for file in files}, "--size", "14 um,3.75 um")

    def test_bombs_and_false_sizes(self):
        limits = {"FRETWEAR_IMPORT_SECONDS": "60", "FRETWEAR_IMPORT_MEMORY": "0.7"}
        squeeze = zlib.compressobj(9)
        size = 8 * 8192 * 8192
        head = struct.pack("<IIIIiiIIBBBBHH", 6, 8, 6, 0, 5, 8, 8192, 8192, 75, 0, 0, 0, 1, 1)[:0]
        head = (
            struct.pack("<II", 6, 8)
            + struct.pack("<II", 6, 0)
            + struct.pack("<II", 5, 8)
            + struct.pack("<ii", 8192, 8192)
            + struct.pack("<HH", 1, 1)
            + b"K\0\0\0"
            + struct.pack("<II", 9, size)
        )
        packed = squeeze.compress(struct.pack("<II", 14, len(head) + size) + head)
        for _ in range(size >> 20):
            packed += squeeze.compress(bytes(1 << 20))
        packed += squeeze.flush()
        bomb = self.file(
            "bomb.mat", b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x100) + b"IM" + struct.pack("<II", 15, len(packed)) + packed
        )
        sizes = self.file("sizes.mat", struct.pack("<5i", 0, 2**30, 2**30, 0, 2) + b"K\0" + bytes(100))
        with mock.patch.dict(os.environ, limits):
            self.rejected(bomb, said="GB|cannot read")
            self.rejected(sizes, said="GB|cannot read")
            if find_spec("h5py"):
                import h5py

                with h5py.File(self.folder / "empty.mat", "w", userblock_size=512) as out:
                    out.create_dataset("K", (60000, 60000), "f8", chunks=(100, 100), compression="gzip")
                self.rejected(self.folder / "empty.mat", said="GB|cannot read")
            if find_spec("pyyeti"):
                nodes = self.file("n.bdf", "GRID,1,,0.,0.,0.\n")
                self.rejected(
                    self.file("s.op4", "100000000 100000000       6       2KAA     1P,3E23.16\n"),
                    nodes,
                    said="GB|cannot read|did not finish|no stiffness|no matrix",
                )
                self.rejected(
                    self.file("t.bdf", "GRID,1,,0.,0.,0.\nSPOINT,1,THRU,2000000000\nDMIG,K,0,6,2,0\n"),
                    said="ascending range|no mass|no stiffness|zero",
                )
            if find_spec("meshio"):
                self.rejected(
                    self.file(
                        "s.msh",
                        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 99999999999 1 1\n3 1 0 99999999999\n$EndNodes\n$Elements\n0 0 0 0\n$EndElements\n",
                    ),
                    said="GB|cannot read",
                )


if __name__ == "__main__":
    unittest.main()
