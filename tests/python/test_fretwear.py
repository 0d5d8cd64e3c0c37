"""Compares the Python module with pyarrow, with the schemas, and with the mechanics of a small joint.

    python tests/python/test_fretwear.py

The script tests the installed module and program. With PYTHONPATH=$PWD/src/python and FRETWEAR=$PWD/target/release/fretwear, it tests the
module and the program of the repository. The script needs Python 3.11 (for TOML), pyarrow, numpy, pandas, polars, xarray and matplotlib.
"""

import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest
from importlib import metadata
from pathlib import Path
from unittest import mock

import fretwear
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from fretwear import _program
from fretwear._folder import LAYOUT
from matplotlib.figure import Figure

REPOSITORY = Path(__file__).resolve().parents[2]

# Neither the grid nor its cells are square. Exchanged axes therefore fail.
SCENE = """
title = "A small rough joint"

[joint]
size = ["4 mm", "3 mm"]
grid = [24, 16]
hole = { diameter = "1 mm" }

[material]
youngs_modulus = "200 GPa"
poisson_ratio = 0.3

[surface]
kind = "gaussian"
rq = "2 um"
correlation_length = ["0.5 mm", "0.5 mm"]
seed = 1

[contact]
friction_coefficient = 0.6
normal_load = "500 N"

[motion]
amplitude = ["3 um", "0 um"]

[wear]
coefficient = "2e3 um^3/J"
cycles = 100_000
tolerance = 0.001
"""
SIZE = (4e-3, 3e-3)
GRID = (24, 16)
HOLE = 1e-3
NORMAL_LOAD = 500.0

# Very short steps: the run takes minutes, and a test waits only for the first iterations.
ENDLESS = {"wear.scheme": "explicit", "wear.depth_step": "1e-6 um"}
PATIENCE = 60.0


def files_of(run):
    """Committed tables of a run: relative path and pyarrow table. Each file is read singly, so that its path adds no column."""
    tables = (*run.folder.glob("iterations/*/*.parquet"), *run.folder.glob("once/*.parquet"))
    return {file.relative_to(run.folder): pq.ParquetFile(file).read() for file in sorted(tables)}


def place(file):
    """Table and iteration of a file. The iteration is None for a table that a run writes once."""
    folder = file.parent.name
    return file.stem, int(folder.removeprefix("wear_iteration=")) if folder != "once" else None


class Bench(unittest.TestCase):
    """Working folder of each test, with the scene."""

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        before = Path.cwd()
        self.addCleanup(os.chdir, before)
        os.chdir(self.folder)
        Path("joint.toml").write_text(SCENE, encoding="utf-8")

    def refused(self, code, words, do, *arguments, **named):
        """Checks that a call fails with this exit code and these words. Returns the error."""
        with self.assertRaises(fretwear.Error) as caught:
            do(*arguments, **named)
        self.assertEqual(caught.exception.code, code, str(caught.exception))
        for word in words:
            self.assertIn(word, str(caught.exception))
        return caught.exception


class Reading(Bench):
    def setUp(self):
        super().setUp()
        self.joint = fretwear.run("joint.toml")

    def test_a_run_is_the_folder_of_the_scenes_name(self):
        self.assertEqual(self.joint.folder, Path("runs/joint").absolute())
        self.assertEqual(os.fspath(fretwear.Run("runs/joint")), str(self.joint.folder))
        # The run remains valid in another working folder. The test restores its working folder at the end.
        os.chdir("/")
        self.assertGreater(len(self.joint.iterations), 2)
        self.assertEqual(self.joint.latest, self.joint.iterations[-1])
        self.assertEqual(self.joint.iterations, list(range(self.joint.latest + 1)))
        self.assertEqual(self.joint.scene["contact"]["normal_load"], NORMAL_LOAD)
        self.assertIsNone(self.joint.scene["structure"])

    def test_the_same_call_again_computes_nothing(self):
        commits = {file: file.read_bytes() for file in self.joint.folder.rglob("commit.json")}
        again = fretwear.run("joint.toml")
        self.assertEqual({file: file.read_bytes() for file in again.folder.rglob("commit.json")}, commits)
        self.assertEqual(fretwear.run(run="runs/joint").latest, again.latest)

    def test_tables_are_those_of_the_files(self):
        files = files_of(self.joint)
        self.assertGreater(len(files), 20)
        for file, expected in files.items():
            with self.subTest(file=str(file)):
                table, iteration = place(file)
                self.assertTrue(self.joint.table(table, iteration).equals(expected, check_metadata=True))
                self.assertTrue(self.joint.table(table, iteration, "polars").to_arrow().cast(expected.schema).equals(expected))
                frame = self.joint.table(table, iteration, library="pandas")
                self.assertTrue(pa.Table.from_pandas(frame, expected.schema).equals(expected))
        last = self.joint.table("summary")
        self.assertEqual(last["cycles"].to_pylist(), [100_000])
        with self.assertRaises(ValueError):
            self.joint.table("summary", library="excel")

    def test_all_iterations_of_a_table_stand_below_each_other(self):
        for table in ("summary", "contact_field", "hysteresis"):
            with self.subTest(table=table):
                found = self.joint.table(table, "all")
                self.assertEqual(found.column_names[0], "wear_iteration")
                of_files = {place(file): part for file, part in files_of(self.joint).items()}
                having = sorted(k for name, k in of_files if name == table)
                for k in having:
                    rows = found.filter(pc.equal(found["wear_iteration"], k)).drop_columns("wear_iteration")
                    self.assertTrue(rows.equals(of_files[table, k]), k)
                self.assertEqual(found["wear_iteration"].unique().to_pylist(), having)
                self.assertEqual(found.schema.field("wear_iteration").metadata, {b"unit": b"1"})
        curve = self.joint.table("summary", "all", library="polars")
        self.assertEqual(curve["wear_iteration"].to_list(), self.joint.iterations)

    def test_the_history_has_a_row_an_iteration(self):
        history, summaries = self.joint.history(), self.joint.table("summary", "all")
        for column in summaries.column_names:
            self.assertEqual(history[column].to_pylist(), summaries[column].to_pylist(), column)
        self.assertEqual(self.joint.history(library="pandas")["cycles"].iloc[-1], 100_000)

    def test_a_scan_has_the_rows_of_all_iterations(self):
        for table in ("summary", "contact_field", "hysteresis"):
            scanned = self.joint.scan(table).collect()
            self.assertTrue(scanned.equals(self.joint.table(table, "all", library="polars")), table)
        for table in ("surface", "history"):
            expected = self.joint.history("polars") if table == "history" else self.joint.table(table, library="polars")
            self.assertTrue(self.joint.scan(table).collect().equals(expected), table)
        self.refused(None, ["a table frf"], self.joint.scan, "frf")

    def test_figures_draw_the_values_of_the_tables(self):
        history = self.joint.history("pandas")
        axes = self.joint.plot("wear_volume").axes[0]
        np.testing.assert_array_equal(axes.lines[0].get_xydata(), history[["cycles", "wear_volume"]])
        band = axes.collections[0].get_datalim(axes.transData)
        last = history.iloc[-1]
        self.assertAlmostEqual(band.y1 / (last["wear_volume"] * (1 + last["error_wear_volume"])), 1.0)
        for iteration in (0, None):
            loop = self.joint.table("hysteresis", iteration, library="pandas")[["displacement", "load"]]
            np.testing.assert_array_equal(self.joint.plot("hysteresis", iteration).axes[0].lines[0].get_xydata(), loop)
            image = self.joint.plot("pressure", iteration).axes[0].images[0]
            np.testing.assert_array_equal(np.ma.filled(image.get_array(), np.nan).T, self.joint.field("pressure", iteration))
            np.testing.assert_allclose(image.get_extent(), [-SIZE[0] / 2, SIZE[0] / 2, -SIZE[1] / 2, SIZE[1] / 2], rtol=1e-12)
        given = Figure().add_subplot()
        self.assertIs(self.joint.plot("kt", axes=given), given.figure)
        self.refused(None, ["no figure nothing", "pressure", "hysteresis"], self.joint.plot, "nothing")

    def test_a_notebook_shows_the_figures_with_their_bars(self):
        self.assertEqual(repr(self.joint), f"Run({str(self.joint.folder)!r})")
        page = self.joint._repr_html_()
        for words in ("worn volume", "stiffness kt", "±", "100&#8239;000 cycles", "iteration", "done"):
            self.assertIn(words, page)

    def test_milestones_are_those_of_the_command(self):
        found = fretwear.when(self.joint, depth=["10 nm", "1 mm"], stiffness="kn+1%")
        done = subprocess.run(
            [_program.program(), "when", str(self.joint.folder), "--depth=10 nm", "--depth=1 mm", "--stiffness=kn+1%", "--json"],
            capture_output=True,
            check=True,
        )
        self.assertEqual({each["milestone"]: each for each in found["milestones"]}, {each["milestone"]: each for each in json.loads(done.stdout)["milestones"]})
        self.assertLess(found["milestones"][0]["earliest"], found["milestones"][0]["latest"])
        with self.assertRaises(TypeError):
            fretwear.when(self.joint)
        self.refused(2, ["3 Hz"], fretwear.when, self.joint, depth="3 Hz")

    def test_pruned_iterations_are_in_the_history_alone(self):
        run = fretwear.run("joint.toml", run="pruned", set={"output.keep": {"last": 2}})
        latest = self.joint.latest
        self.assertEqual(run.iterations, [0, latest - 1, latest])
        self.assertEqual(run.history()["wear_iteration"].to_pylist(), self.joint.iterations)
        self.assertEqual(run.table("summary", "all")["wear_iteration"].to_pylist(), run.iterations)
        self.refused(None, ["no iteration 1", str(run.iterations)], run.table, "summary", 1)
        self.refused(None, ["iteration 1", str(run.iterations)], run.field, "pressure", 1)

    def test_only_what_is_committed_is_an_iteration(self):
        shutil.copytree(self.joint.folder, "copy")
        (Path("copy/iterations") / f"wear_iteration={self.joint.latest}" / "commit.json").unlink()
        for stray in ("wear_iteration=", "wear_iteration=x", "notes"):
            (Path("copy/iterations") / stray).mkdir()
        self.assertEqual(fretwear.Run("copy").iterations, self.joint.iterations[:-1])

    def test_units_are_those_of_the_schemas(self):
        for table in {place(file)[0] for file in files_of(self.joint)}:
            schema = tomllib.loads((REPOSITORY / "schemas" / f"{table}.toml").read_text(encoding="utf-8"))
            declared = {column["name"]: column["unit"] for column in schema["column"]}
            units = self.joint.units(table)
            self.assertEqual(units, {name: declared[name] for name in self.joint.table(table).column_names}, table)
        self.assertEqual(self.joint.units("summary")["kn"], "N/m")
        self.assertEqual(self.joint.units("history")["wear_volume"], "m^3")

    def test_fields_are_on_the_cells_of_the_joint(self):
        x, y = self.joint.centres()
        self.assertEqual((len(x), len(y)), GRID)
        for at, n, size in zip((x, y), GRID, SIZE, strict=True):
            # The coordinate is 0 in the middle of the side. The outer centres are half a cell from its ends.
            np.testing.assert_allclose(at[[0, -1]], [-0.5 * size * (1 - 1 / n), 0.5 * size * (1 - 1 / n)], rtol=1e-12)
        pressure = self.joint.field("pressure")
        self.assertEqual(pressure.shape, GRID)
        np.testing.assert_array_equal(np.isnan(pressure), np.hypot(x[:, None], y) <= HOLE / 2)

        area = SIZE[0] * SIZE[1] / (GRID[0] * GRID[1])
        summary = self.joint.table("summary").to_pylist()[0]
        # The program sums in another order.
        rounding = 1e-9
        np.testing.assert_allclose(np.nansum(pressure) * area, NORMAL_LOAD, rtol=rounding)
        self.assertEqual(np.nanmax(pressure), summary["max_pressure"])
        np.testing.assert_allclose(abs(np.nansum(pressure * y) * area), abs(summary["moment_x"]), rtol=rounding)
        np.testing.assert_allclose(abs(np.nansum(pressure * x[:, None]) * area), abs(summary["moment_y"]), rtol=rounding)
        worn = self.joint.field("wear_depth")
        np.testing.assert_allclose(np.nansum(worn) * area, summary["wear_volume"], rtol=rounding)

    def test_fields_are_the_columns_of_their_tables(self):
        for iteration in (None, 0, 1):
            for table in ("surface", "contact_field", "wear_field"):
                cells = self.joint.table(table, iteration).to_pydict()
                for column in cells.keys() - {"i", "j"}:
                    field = self.joint.field(column, iteration)
                    found = [field[i, j] for i, j in zip(cells["i"], cells["j"], strict=True)]
                    self.assertEqual(found, cells[column], column)
                    self.assertEqual(np.count_nonzero(~np.isnan(field)), len(found))

    def test_a_field_as_xarray_knows_places_and_units(self):
        x, y = self.joint.centres()
        field = self.joint.field("pressure", 0, as_xarray=True)
        np.testing.assert_array_equal(field.values, self.joint.field("pressure", 0))
        self.assertEqual((field.dims, field.name, field.attrs["units"]), (("x", "y"), "pressure", "Pa"))
        for name, at in (("x", x), ("y", y)):
            np.testing.assert_array_equal(field[name].values, at)
            self.assertEqual(field[name].attrs["units"], "m")
        self.assertTrue(field.to_dataset().to_array().sel(x=1e-3, y=-1e-3, method="nearest").notnull().all())

    def test_what_is_not_there_is_said(self):
        self.refused(None, ["nowhere", "run.json"], fretwear.Run, "nowhere")
        self.refused(None, ["no table frf"], self.joint.table, "frf")
        self.refused(None, ["no iteration 99", str(self.joint.iterations)], self.joint.table, "summary", 99)
        self.refused(None, ["a table surface"], self.joint.table, "surface", "all")
        self.refused(None, ["no table nothing"], self.joint.units, "nothing")
        self.refused(None, ["nothing", "wear_depth"], self.joint.field, "nothing")
        self.refused(None, ["no iteration 99"], self.joint.field, "height", 99)
        middle = self.refused(None, ["hysteresis"], self.joint.table, "hysteresis", 1)
        self.assertIn(f"[0, {self.joint.latest}]", str(middle))

    def test_a_run_of_another_layout_is_rejected(self):
        shutil.copytree(self.joint.folder, "copy")
        record = Path("copy/run.json")
        sound = json.loads(record.read_text(encoding="utf-8"))
        for number in (LAYOUT - 1, LAYOUT + 1):
            record.write_text(json.dumps(sound | {"format": number, "program_version": "9.9.9"}), encoding="utf-8")
            said = [f"copy has layout {number} of fretwear 9.9.9", f"reads only layout {LAYOUT}", "another folder"]
            self.refused(4, said, fretwear.Run, "copy")
        record.write_text(json.dumps({"format": 1}), encoding="utf-8")
        self.refused(4, ["copy has layout 1; this"], fretwear.Run, "copy")

    def test_a_run_verifies_until_it_is_touched(self):
        self.joint.verify()
        shutil.copytree(self.joint.folder, "copy")
        file = Path("copy/iterations/wear_iteration=1/summary.parquet")
        file.write_bytes(file.read_bytes()[:-1] + b"!")
        self.refused(4, ["wear_iteration=1", "summary.parquet"], fretwear.Run("copy").verify)

    def test_a_report_is_written_where_asked(self):
        self.assertEqual(self.joint.report("page.html"), Path("page.html"))
        self.assertEqual(self.joint.report(), self.joint.folder / "report.html")
        for page in (Path("page.html"), self.joint.folder / "report.html"):
            self.assertIn("A small rough joint", page.read_text(encoding="utf-8"))


class Running(Bench):
    def test_keys_are_set_with_values_of_every_kind(self):
        changes = {
            "title": 'A "small" joint \\ µ',
            "contact.normal_load": "0.6 kN",
            "joint.grid": np.array([22, 14]),
            "surface.seed": np.int64(7),
            "wear.cycles": 50_000,
            "wear.tolerance": 1e-2,
            "fidelity.cycle_extrapolation": False,
            "output.keep": {"last": 2},
            "motion.amplitude": ("2 um", "0 um"),
        }
        run = fretwear.run("joint.toml", run=Path("set"), set=changes, threads=2, quiet=True)
        scene = run.scene
        self.assertEqual(scene["contact"]["normal_load"], 600.0)
        self.assertEqual(scene["joint"]["grid"], [22, 14])
        self.assertEqual(scene["surface"]["seed"], 7)
        self.assertEqual((scene["wear"]["cycles"], scene["wear"]["tolerance"]), (50_000, 1e-2))
        self.assertIs(scene["fidelity"]["cycle_extrapolation"], False)
        self.assertEqual(scene["motion"]["amplitude"], [2e-6, 0.0])
        self.assertEqual(run.field("pressure").shape, (22, 14))
        kept = tomllib.loads((run.folder / "scene.toml").read_text(encoding="utf-8"))
        self.assertEqual((kept["title"], kept["output"]["keep"]), (changes["title"], {"last": 2}))

    def test_a_scene_may_be_a_mapping(self):
        of_file = fretwear.run("joint.toml")
        scene = tomllib.loads(SCENE)
        run = fretwear.run(scene)
        self.assertEqual((run.folder, run.scene), (Path("runs/scene").absolute(), of_file.scene))
        self.assertEqual(tomllib.loads(Path("runs/scene.toml").read_text(encoding="utf-8")), scene)
        self.assertEqual(fretwear.run(scene).latest, run.latest)
        self.assertEqual(fretwear.plan(scene, rehearsal=False)["recipe"], fretwear.plan("joint.toml", rehearsal=False)["recipe"])
        # A rejected scene replaces no file and creates no file.
        before = Path("runs/scene.toml").read_bytes()
        self.refused(4, ["normal_load"], fretwear.run, {**scene, "contact": {**scene["contact"], "normal_load": "1 N"}})
        self.refused(2, ["contact.normal_load"], fretwear.run, {**scene, "contact.normal_load": "1 N"})
        self.refused(2, ["scene.toml", "contact.normal_laod"], fretwear.run, {**scene, "contact": {"normal_laod": "1 N"}})
        self.assertEqual(Path("runs/scene.toml").read_bytes(), before)
        self.assertEqual(sorted(path.name for path in Path("runs").iterdir()), ["joint", "scene", "scene.toml"])
        Path("here").mkdir()
        os.chdir("here")
        self.assertEqual(fretwear.run(scene, run=".").folder, self.folder.resolve() / "here")
        os.chdir("..")
        self.assertTrue(Path("here.toml").is_file())
        # A run without wear also has figures.
        static = {name: section for name, section in scene.items() if name not in ("motion", "wear")}
        self.assertEqual(len(fretwear.run(static, run="static").plot("kn").axes), 1)
        # The module does not overwrite a file of the user.
        Path("own.toml").write_text("# mine", encoding="utf-8")
        self.refused(None, ["own.toml", "not written by this module"], fretwear.run, scene, run="own")
        self.assertEqual(Path("own.toml").read_text(encoding="utf-8"), "# mine")
        # Path objects are relative to the working folder, and texts are relative to the file of the scene.
        text = _program.scene_text({"title": "x", "surface": {"file": Path("a.x3p"), "sides": [Path("b"), "c"]}})
        self.assertEqual(tomllib.loads(text)["surface"], {"file": str(Path("a.x3p").absolute()), "sides": [str(Path("b").absolute()), "c"]})

    def test_a_campaign_runs_its_rows(self):
        rows = 'scene = "joint.toml"\n[list]\ncontact.normal_load = ["400 N", "500 N"]\nmotion.amplitude = ["2 um", "3 um"]\n'
        Path("rows.toml").write_text(rows, encoding="utf-8")
        ended = fretwear.campaign("rows.toml", jobs=1)
        self.assertEqual((ended["rows"], ended["done"], ended["failed"], ended["folder"]), (2, 2, [], os.path.join("campaigns", "rows")))
        self.assertEqual(fretwear.campaign("rows.toml")["done_before"], 2)
        self.assertEqual(len(list(Path("campaigns/rows/collected").glob("shard-*.parquet"))), 1)
        of_campaign = fretwear.when(ended["folder"], depth="10 nm")["milestones"][0]["points"]
        self.assertEqual(sum(point["runs"] for point in of_campaign), 2)
        # A failed row causes a warning. The other rows are complete.
        printed = {"rows": 3, "done": 2, "failed": [{"index": 1, "message": "not converged"}]}
        with mock.patch.object(_program, "call", return_value=json.dumps(printed)), self.assertWarnsRegex(UserWarning, "1 of 3 rows"):
            self.assertEqual(fretwear.campaign("rows.toml")["failed"], printed["failed"])
        missing = 'scene = "joint.toml"\n[grid]\nwear.tolerance = [1e-3, 1e-2]\n[set]\nsurface = { kind = "measured", file = "gone.x3p" }\n'
        Path("missing.toml").write_text(missing, encoding="utf-8")
        self.refused(2, ["gone.x3p"], fretwear.campaign, "missing.toml", folder="f")
        self.refused(1, ["nowhere.toml"], fretwear.campaign, "nowhere.toml")

    def test_values_are_toml(self):
        texts = ["", "30 kN", "true", "3", 'a "b" \\ c', "line\nand\ttab", "\x7f\x01", "µm 😀", "[1]"]
        values = [*texts, 3, -2, 10**7, 0.1, 1e-6, 1e300, True, False, [1, 2], ["1 um", "2 um"], [[1.5, 2], []], {"a b": {"c": 1}}]
        for value in values:
            self.assertEqual(tomllib.loads(f"key = {_program.toml(value)}")["key"], value)
        self.assertEqual(_program.toml(Path("a/b.x3p")), '"' + os.path.join("a", "b.x3p").replace("\\", "\\\\") + '"')
        self.assertEqual(_program.toml(np.float64(0.1)), "0.1")
        for value in (None, object(), {1, 2}, b"bytes"):
            with self.assertRaises(TypeError):
                _program.toml(value)

    def test_the_words_and_codes_of_errors_are_those_of_the_program(self):
        self.refused(2, ["did you mean contact.normal_load?"], fretwear.run, "joint.toml", set={"contact.normal_laod": "3 kN"})
        # A text remains a text, even if it looks like a number.
        self.refused(2, ["seed"], fretwear.run, "joint.toml", set={"surface.seed": "7"})
        self.refused(2, ["nowhere.toml"], fretwear.run, "nowhere.toml")
        self.assertFalse(Path("runs").exists())
        fretwear.run("joint.toml", set={"wear.cycles": 1000})
        self.refused(4, ["surface.seed"], fretwear.run, "joint.toml", set={"surface.seed": 2})
        with self.assertRaises(TypeError):
            fretwear.run()

    def test_a_program_that_is_not_there_is_said(self):
        with mock.patch.dict(os.environ, {"FRETWEAR": str(self.folder / "nothing")}):
            self.refused(None, ["does not start"], fretwear.explain, "contact")
        nowhere = {"FRETWEAR": "", "PATH": str(self.folder)}
        with mock.patch.dict(os.environ, nowhere), mock.patch("sysconfig.get_path", return_value=str(self.folder)):
            self.refused(None, ["FRETWEAR"], fretwear.explain, "contact")

    def test_the_program_has_the_version_of_the_manifest(self):
        manifest = tomllib.loads((REPOSITORY / "Cargo.toml").read_text(encoding="utf-8"))
        version = manifest["package"]["version"]
        self.assertEqual(fretwear.__version__, version)
        self.assertEqual(_program.call("--version").split()[1], version)
        try:
            self.assertEqual(metadata.version("fretwear"), version)
        except metadata.PackageNotFoundError:
            self.assertIn("FRETWEAR", os.environ)

    def test_a_stopped_run_goes_on_to_the_same_bits(self):
        whole = fretwear.run("joint.toml", run="whole")
        for wall in (1e-6, "0.000001 s"):
            with self.assertRaises(fretwear.Stopped) as caught:
                fretwear.run("joint.toml", run="parts", max_wall=wall)
            self.assertEqual(caught.exception.code, 75)
            self.assertIn("stopped", str(caught.exception))
        self.assertEqual(caught.exception.run.iterations, [0, 1])
        again = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual((again.code, again.run.folder, str(again)), (75, Path("parts").absolute(), str(caught.exception)))

        parts = fretwear.run("joint.toml", run="parts")
        self.assertEqual(parts.iterations, whole.iterations)
        expected = files_of(whole)
        for file, table in files_of(parts).items():
            if file.stem != "timing":
                self.assertTrue(table.equals(expected[file]), file)

    def test_progress_is_shown_where_asked(self):
        code = "import fretwear; fretwear.run('joint.toml', quiet=False)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        self.assertIn("iteration 1", done.stderr)
        self.assertEqual(done.stdout, "")

    @unittest.skipIf(os.name == "nt", "no signal to a single process")
    def test_an_interrupt_stops_the_program_and_keeps_what_it_has(self):
        call = f"fretwear.run('joint.toml', set={ENDLESS!r}, quiet=False)"
        pool = "from concurrent.futures import ThreadPoolExecutor as Pool"
        for name, code in {
            "main thread": f"import fretwear; {call}",
            "other thread": f"import fretwear; {pool}\nwith Pool() as pool: pool.submit(lambda: {call}).result()",
        }.items():
            with self.subTest(name):
                child = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, start_new_session=True)
                begun = time.monotonic()
                before = len(list(Path("runs").glob("joint/iterations/*/commit.json")))
                while len(list(Path("runs").glob("joint/iterations/*/commit.json"))) < before + 3:
                    self.assertLess(time.monotonic() - begun, PATIENCE)
                    self.assertIsNone(child.poll())
                    time.sleep(0.01)
                # Signal to the process group of Python, as from a terminal. The program must receive one signal: a second one stops it immediately.
                os.killpg(child.pid, signal.SIGINT)
                said = child.communicate(timeout=PATIENCE)[1]
                self.assertIn("stopped; continue with", said)
                self.assertTrue(said.rstrip().endswith("KeyboardInterrupt"), said)
                run = fretwear.Run("runs/joint")
                run.verify()
                # The program has released the lock of the run.
                with self.assertRaises(fretwear.Stopped):
                    fretwear.run(run=run.folder, max_wall=1e-6)

    def test_a_scene_is_planned_and_keys_are_explained(self):
        planned = fretwear.plan("joint.toml", set={"joint.grid": [30, 20]}, rehearsal=False)
        self.assertEqual(planned["recipe"]["joints"][0]["surface"]["grid"], [30, 20])
        self.assertNotIn("cost", planned)
        self.assertGreater(fretwear.plan("joint.toml")["cost"]["iterations"]["expected"], 0)
        self.assertFalse(Path("runs").exists())
        self.refused(2, ["joint.grid"], fretwear.plan, "joint.toml", set={"joint.grid": [0, 20]})

        about = fretwear.explain("contact.normal_load")
        self.assertEqual(about["key"], "contact.normal_load")
        self.assertIn("contact.pressure_cap", fretwear.explain("contact")["keys"])
        self.refused(2, ["no such key"], fretwear.explain, "nothing")


if __name__ == "__main__":
    unittest.main()
