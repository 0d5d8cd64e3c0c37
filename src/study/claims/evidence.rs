//! Evidence for the claims: numbers of a run, read once from its tables.

use std::collections::BTreeMap;

use super::form;
use super::setting::Setting;
use crate::recipe::Recipe;
use crate::report::{ReportError, RunTables, WEAR_ITERATION, numeric_column, text_column};
use crate::tables::{TableName, typed};

/// Columns of a table of the iterations. A column has one value per iteration that stores the table.
pub type Columns = BTreeMap<String, Vec<f64>>;

/// Hysteresis loop: tangential load over relative displacement, for one cycle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HysteresisLoop {
    /// Relative displacement \[m\].
    pub displacement: Vec<f64>,
    /// Tangential load \[N\].
    pub load: Vec<f64>,
}

/// Numbers from the fields and curves of one iteration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moment {
    /// Pressure that 99 % of the cells in contact do not reach \[Pa\].
    pub high_pressure: f64,
    /// Mean over the cells in contact \[Pa\].
    pub mean_pressure: f64,
    /// Largest pressure along each section along x \[Pa\].
    pub section_peaks: Vec<f64>,
    /// Share of the cells in contact at the pressure cap.
    pub share_at_cap: f64,
    /// Σ p dA \[N\].
    pub load: f64,
    /// Dissipation of the cell with the largest pressure, over the largest dissipation of all cells.
    pub peak_dissipation: f64,
    /// Hysteresis loop, if the run stores it.
    pub hysteresis: Option<HysteresisLoop>,
    /// Mean and half range of the normal load over a cycle \[N\].
    pub normal_load: Option<[f64; 2]>,
    /// Mean and half range of the relative displacement over a cycle \[m\].
    pub displacement: Option<[f64; 2]>,
    /// Ratio of fine contact to contact elements of the structure, by quantity.
    pub fine_over_elements: BTreeMap<String, f64>,
    /// Largest magnitude of the moments about x and y, and of the moment about the normal, over a cycle \[N m\].
    pub moments: Option<[f64; 2]>,
}

/// Contact elements that carry load, right after an update.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ElementDistribution {
    /// Normal stiffness of each loaded element \[N/m\].
    pub kn: Vec<f64>,
    /// Normal stiffness of each loaded element over its area in contact \[N/m³\].
    pub density: Vec<f64>,
}

/// Numbers from all wear fields of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WornSurface {
    /// Smallest growth of the depth of a cell in a step \[m\]. A growth below 0 means that material came back.
    pub least_growth: f64,
    /// Deepest wear at the end \[m\].
    pub deepest: f64,
    /// Σ depth dA at the end \[m³\].
    pub volume: f64,
    /// Number of cells that are in contact at no committed iteration.
    pub never_touched: usize,
    /// Deepest wear of the cells that are in contact at no committed iteration \[m\].
    pub never_touched_depth: f64,
    /// Largest deviation of an explicit step from N α q·v, over the deepest wear.
    pub rule_error: f64,
}

/// Numbers of a run that claims are judged by. Series have one value per committed iteration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    /// Name of the run.
    pub name: String,
    /// Setting of the run, which determines its role in a study.
    pub scene: Setting,
    /// True if the run has reached its end.
    pub done: bool,
    /// Columns of `summary`.
    pub summary: Columns,
    /// Area of the joint \[m²\], or `None` for a joint without a surface.
    pub area: Option<f64>,
    /// Columns of `dynamic_response`.
    pub response: Columns,
    /// Columns of `worn_response`, with the cycles of each response.
    pub worn_response: Columns,
    /// Columns of `wear_step`.
    pub step: Columns,
    /// `rq`, `sk` and `ku` of the heights without their form, for a run of a generated surface with wear.
    pub formless: Columns,
    /// Deepest wear per cycle: α times the largest dissipation of a cell \[m\].
    pub depth_rate: Vec<f64>,
    /// Numbers from the wear fields, for a run with wear.
    pub worn: Option<WornSurface>,
    /// The unworn state.
    pub first: Moment,
    /// The last state.
    pub last: Moment,
    /// Contact elements of the unworn state, and of the last update.
    pub local: Option<[ElementDistribution; 2]>,
    /// Largest ratio of the tangential force to µN at the same instant, over the cycle of each iteration.
    pub sliding: Vec<f64>,
    /// CPU time of all stages, or wall time if the CPU time is unknown \[s\].
    pub seconds: f64,
    /// Number of retained modes of the reduced structure, if its tables exist and verify.
    pub modes: Option<usize>,
}

impl Evidence {
    /// Reads a run.
    ///
    /// # Errors
    /// [`ReportError`] for a table that cannot be read.
    pub fn read(run: &RunTables) -> Result<Evidence, ReportError> {
        let recipe = run.recipe();
        let setting = Setting::of(recipe, &run.record().scene);
        let summary = columns(run, TableName::Summary)?;
        let last = |name: &str| summary.get(name).and_then(|values| values.last()).copied();
        let done = recipe.wear.as_ref().is_none_or(|wear| {
            let (cycles, volume) = (last("cycles"), last("wear_volume"));
            wear.is_reached(cycles.unwrap_or(0.0) as u64, volume.unwrap_or(0.0))
        });
        let mut worn_response = Columns::new();
        if let Some(frame) = run.series(TableName::WornResponse)? {
            worn_response = frame_columns(&frame, TableName::WornResponse);
            let history = run.history()?;
            let iterations = numeric_column(&frame, WEAR_ITERATION).unwrap_or_default();
            let row = |k: &f64| history.row::<typed::Summary>(*k as u64).ok().flatten();
            let history_column = |value: fn(&typed::Summary) -> f64| -> Vec<f64> {
                let each = iterations.iter();
                each.map(|k| row(k).as_ref().map_or(0.0, value)).collect()
            };
            let cycles = history_column(|row| row.cycles.unwrap_or(0) as f64);
            worn_response.insert("cycles".to_owned(), cycles);
            let volumes = history_column(|row| row.wear_volume.unwrap_or(0.0));
            worn_response.insert("wear_volume".to_owned(), volumes);
            let place = |k: &f64| {
                run.iterations()
                    .partition_point(|stored| *stored < *k as u64) as f64
            };
            worn_response.insert("place".to_owned(), iterations.iter().map(place).collect());
        }
        let cell_area = recipe.surface().map_or(0.0, |s| s.grid().cell_area());
        let fields = Fields::of(run, &setting, &summary, cell_area)?;
        let costs = run.history()?.cost();
        let updated = summary
            .get("updated")
            .map(Vec::as_slice)
            .unwrap_or_default();
        let last_update = updated.iter().rposition(|flag| *flag > 0.0);
        let local = match last_update.map(|place| run.iterations()[place]) {
            Some(k) if k > 0 => {
                element_distribution(run, run.iterations()[0])?.zip(element_distribution(run, k)?)
            }
            _ => None,
        };
        Ok(Evidence {
            name: run.name().to_owned(),
            done,
            area: area(&summary),
            response: columns(run, TableName::DynamicResponse)?,
            worn_response,
            step: columns(run, TableName::WearStep)?,
            formless: fields.formless,
            local: local.map(|(first, last)| [first, last]),
            depth_rate: fields.depth_rate,
            worn: fields.worn,
            first: moment(run, run.iterations()[0], recipe, cell_area)?,
            last: moment(run, run.latest(), recipe, cell_area)?,
            sliding: fields.sliding,
            seconds: costs
                .values()
                .map(|cost| cost.cpu_seconds.unwrap_or(cost.seconds))
                .sum(),
            modes: modes(run)?,
            summary,
            scene: setting,
        })
    }

    /// Returns a column of the summary.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.summary.get(name).map(Vec::as_slice)
    }

    /// Returns the cycles up to each iteration, for a run with wear.
    pub fn cycles(&self) -> Option<&[f64]> {
        self.column("cycles")
    }

    /// Returns the first and the last value of a column of the summary.
    pub fn ends(&self, name: &str) -> Option<[f64; 2]> {
        let values = self.column(name)?;
        Some([*values.first()?, *values.last()?])
    }

    /// Returns the first and the last value of a column of the responses of worn states.
    pub fn worn_ends(&self, name: &str) -> Option<[f64; 2]> {
        let values = self.worn_response.get(name)?;
        Some([*values.first()?, *values.last()?])
    }

    /// Returns the number of updates of the contact elements after the first one.
    pub fn updates(&self) -> usize {
        let updated = self.column("updated").unwrap_or_default();
        updated.iter().skip(1).filter(|flag| **flag > 0.0).count()
    }
}

fn area(summary: &Columns) -> Option<f64> {
    let first = |name: &str| summary.get(name)?.first().copied();
    Some(first("contact_area")? / first("contact_area_fraction")?)
}

fn frame_columns(frame: &polars::prelude::DataFrame, table: TableName) -> Columns {
    let names = table.schema().columns.iter().map(|column| &column.name);
    names
        .filter_map(|name| Some((name.clone(), numeric_column(frame, name)?)))
        .filter(|(_, values)| values.iter().any(|value| !value.is_nan()))
        .collect()
}

/// Reads a table with one row per iteration, for the iterations whose fields are stored.
fn columns(run: &RunTables, table: TableName) -> Result<Columns, ReportError> {
    let Some(frame) = run.series(table)? else {
        return Ok(Columns::new());
    };
    let rows = numeric_column(&frame, WEAR_ITERATION).unwrap_or_default();
    let is_stored = |k: &f64| run.iterations().contains(&(*k as u64));
    let is_stored: Vec<bool> = rows.iter().map(is_stored).collect();
    let mut columns = frame_columns(&frame, table);
    for values in columns.values_mut() {
        let mut is_stored = is_stored.iter();
        values.retain(|_| is_stored.next() == Some(&true));
    }
    Ok(columns)
}

/// Numbers from the fields of all iterations.
struct Fields {
    depth_rate: Vec<f64>,
    worn: Option<WornSurface>,
    sliding: Vec<f64>,
    formless: Columns,
}

/// * Cutoff wavelength of the form, in correlation lengths: the 2.5 mm of ISO 4288 for the roughest surface of the
///   paper.
const FORM: f64 = 5.0;

/// Unworn heights on the grid of a joint, with the cutoff of their form.
struct Surface {
    cells: [usize; 2],
    steps: [f64; 2],
    heights: Vec<f64>,
    cutoff: f64,
}

impl Surface {
    fn of(run: &RunTables, scene: &Setting) -> Result<Option<Surface>, ReportError> {
        let grid = run.recipe().surface().map(|surface| surface.grid());
        let (Some(grid), Some(lengths)) = (grid, scene.correlation_length) else {
            return Ok(None);
        };
        let Some(frame) = run.run_table(TableName::Surface)? else {
            return Ok(None);
        };
        let [i, j, height] =
            ["i", "j", "height"].map(|name| numeric_column(&frame, name).unwrap_or_default());
        let mut heights = vec![0.0; grid.len()];
        for ((i, j), height) in i.iter().zip(&j).zip(&height) {
            heights[grid.index(*i as usize, *j as usize)] = *height;
        }
        Ok(Some(Surface {
            cells: [grid.nx, grid.ny],
            steps: [grid.dx, grid.dy],
            heights,
            cutoff: FORM * lengths[0].max(lengths[1]),
        }))
    }

    /// Returns Rq, Sk and Ku of the worn surface without the form. `depth` is the wear depth at the cells (i, j).
    fn worn(&self, i: &[f64], j: &[f64], depth: &[f64]) -> [f64; 3] {
        let mut heights = self.heights.clone();
        let mut kept = vec![false; heights.len()];
        for ((i, j), depth) in i.iter().zip(j).zip(depth) {
            let cell = *i as usize * self.cells[1] + *j as usize;
            (heights[cell], kept[cell]) = (heights[cell] - depth, true);
        }
        form::roughness(&heights, &kept, self.cells, self.steps, self.cutoff)
    }
}

impl Fields {
    fn of(
        run: &RunTables,
        scene: &Setting,
        summary: &Columns,
        cell_area: f64,
    ) -> Result<Fields, ReportError> {
        let mut result = Fields {
            depth_rate: Vec::new(),
            worn: None,
            sliding: Vec::new(),
            formless: Columns::new(),
        };
        let Some(coefficient) = scene.coefficient else {
            return Ok(result);
        };
        let steps = summary.get("n_cycles").cloned().unwrap_or_default();
        let mut worn = WornSurface {
            least_growth: f64::INFINITY,
            ..WornSurface::default()
        };
        let (mut touched, mut before, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        let surface = Surface::of(run, scene)?;
        for (place, &k) in run.iterations().iter().enumerate() {
            let field = run.iteration_table(k, TableName::ContactField)?;
            let column = |name| {
                field
                    .as_ref()
                    .and_then(|field| numeric_column(field, name))
                    .unwrap_or_default()
            };
            let (pressure, dissipation) = (column("pressure"), column("dissipation"));
            let wear = run.iteration_table(k, TableName::WearField)?;
            let column = |name| {
                let column = wear.as_ref().and_then(|field| numeric_column(field, name));
                column.unwrap_or_default()
            };
            let depth = column("wear_depth");
            if let Some(surface) = &surface {
                let worn = surface.worn(&column("i"), &column("j"), &depth);
                for (name, value) in ["rq", "sk", "ku"].into_iter().zip(worn) {
                    let column: &mut Vec<f64> = result.formless.entry(name.to_owned()).or_default();
                    column.push(value);
                }
            }
            if touched.is_empty() {
                touched = vec![false; pressure.len()];
                before = vec![0.0; depth.len()];
            }
            for (cell, pressure) in touched.iter_mut().zip(&pressure) {
                *cell |= *pressure > 0.0;
            }
            let n_cycles = steps.get(place).copied().unwrap_or(0.0);
            for (cell, (now, then)) in depth.iter().zip(&before).enumerate() {
                worn.least_growth = worn.least_growth.min(now - then);
                let rate: f64 = rates.get(cell).copied().unwrap_or(0.0);
                worn.rule_error = worn.rule_error.max((now - then - n_cycles * rate).abs());
            }
            let most = dissipation.iter().copied().fold(0.0, f64::max);
            result.depth_rate.push(coefficient * most);
            let cycle = run.iteration_table(k, TableName::Cycle)?;
            let column = |name| {
                let column = cycle.as_ref().and_then(|cycle| numeric_column(cycle, name));
                column.unwrap_or_default()
            };
            let friction = scene.friction_coefficient.unwrap_or(f64::INFINITY);
            let forces = column("force_x").into_iter().zip(column("force_y"));
            let shares = forces.zip(column("normal_load"));
            let shares = shares.map(|((x, y), load)| x.hypot(y) / (friction * load));
            result.sliding.push(shares.fold(0.0, f64::max));
            rates = dissipation
                .iter()
                .map(|energy| coefficient * energy)
                .collect();
            before = depth;
        }
        worn.deepest = before.iter().copied().fold(0.0, f64::max);
        worn.volume = before.iter().sum::<f64>() * cell_area;
        worn.rule_error /= worn.deepest.max(f64::MIN_POSITIVE);
        for (depth, _) in before
            .iter()
            .zip(&touched)
            .filter(|(_, touched)| !**touched)
        {
            worn.never_touched += 1;
            worn.never_touched_depth = worn.never_touched_depth.max(*depth);
        }
        result.worn = Some(worn);
        Ok(result)
    }
}

/// A cell counts as capped if its pressure is at least `AT_CAP` times the pressure cap.
const AT_CAP: f64 = 1.0 - 1e-12;

fn moment(run: &RunTables, k: u64, recipe: &Recipe, cell_area: f64) -> Result<Moment, ReportError> {
    let mut moment = Moment::default();
    if let Some(field) = run.iteration_table(k, TableName::ContactField)? {
        let pressure = numeric_column(&field, "pressure").unwrap_or_default();
        let dissipation = numeric_column(&field, "dissipation").unwrap_or_default();
        moment.load = pressure.iter().sum::<f64>() * cell_area;
        let mut loaded: Vec<f64> = pressure.iter().copied().filter(|p| *p > 0.0).collect();
        loaded.sort_by(f64::total_cmp);
        let sections = numeric_column(&field, "j").unwrap_or_default();
        let count = sections.iter().fold(-1.0, |most: f64, j| j.max(most)) + 1.0;
        moment.section_peaks = vec![0.0; count as usize];
        for (j, pressure) in sections.iter().zip(&pressure) {
            let peak = &mut moment.section_peaks[*j as usize];
            *peak = peak.max(*pressure);
        }
        if !loaded.is_empty() {
            moment.mean_pressure = loaded.iter().sum::<f64>() / loaded.len() as f64;
            moment.high_pressure = loaded[(0.99 * (loaded.len() - 1) as f64) as usize];
            let cap = recipe
                .contact()
                .and_then(|contact| contact.conditions.pressure_cap);
            let at_cap = loaded
                .iter()
                .filter(|p| cap.is_some_and(|cap| **p >= AT_CAP * cap))
                .count();
            moment.share_at_cap = at_cap as f64 / loaded.len() as f64;
        }
        let most = dissipation.iter().copied().fold(0.0, f64::max);
        let peak = pressure
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1));
        if let (Some((cell, _)), true) = (peak, most > 0.0) {
            moment.peak_dissipation = dissipation[cell] / most;
        }
    }
    if let Some(frame) = run.iteration_table(k, TableName::Hysteresis)? {
        let column = |name| numeric_column(&frame, name).unwrap_or_default();
        moment.hysteresis = Some(HysteresisLoop {
            displacement: column("displacement"),
            load: column("load"),
        });
    }
    if let Some(frame) = run.iteration_table(k, TableName::JointCycle)? {
        moment.normal_load = numeric_column(&frame, "normal_load").map(|v| mean_and_half_range(&v));
        moment.displacement =
            numeric_column(&frame, "displacement_x").map(|v| mean_and_half_range(&v));
        let most = |name| {
            let moments = numeric_column(&frame, name)?;
            Some(moments.iter().fold(0.0, |most: f64, m| m.abs().max(most)))
        };
        moment.moments = most("moment_x")
            .zip(most("moment_y"))
            .zip(most("moment_z"))
            .map(|((x, y), normal)| [x.max(y), normal]);
    }
    if let Some(frame) = run.iteration_table(k, TableName::Ledger)? {
        let column = |name| numeric_column(&frame, name).unwrap_or_default();
        let ratios = column("fine")
            .into_iter()
            .zip(column("dynamic"))
            .map(|(fine, dynamic)| fine / dynamic);
        moment.fine_over_elements = text_column(&frame, "quantity")
            .unwrap_or_default()
            .into_iter()
            .zip(ratios)
            .collect();
    }
    Ok(moment)
}

/// Returns the contact elements of an iteration, each with its area in contact.
fn element_distribution(
    run: &RunTables,
    k: u64,
) -> Result<Option<ElementDistribution>, ReportError> {
    let grid = run.recipe().surface().map(|surface| surface.grid());
    let frames = (
        run.iteration_table(k, TableName::ContactElement)?,
        run.iteration_table(k, TableName::ContactField)?,
    );
    let (Some(grid), (Some(elements), Some(field))) = (grid, frames) else {
        return Ok(None);
    };
    let element = |name| numeric_column(&elements, name).unwrap_or_default();
    let (x, y, area, kn, load) = (
        element("x"),
        element("y"),
        element("area"),
        element("kn"),
        element("normal_load"),
    );
    let cell = |name| numeric_column(&field, name).unwrap_or_default();
    let (i, j, pressure) = (cell("i"), cell("j"), cell("pressure"));
    let mut touching = vec![0.0; x.len()];
    for ((i, j), _) in i.iter().zip(&j).zip(&pressure).filter(|(_, p)| **p > 0.0) {
        let (cx, cy) = grid.centre(*i as usize, *j as usize);
        // Elements are adjacent squares.
        let owner = (0..x.len()).find(|&e| {
            let half = 0.5 * area[e].sqrt() * (1.0 + 1e-9);
            (cx - x[e]).abs() <= half && (cy - y[e]).abs() <= half
        });
        if let Some(owner) = owner {
            touching[owner] += grid.cell_area();
        }
    }
    let mut distribution = ElementDistribution::default();
    for e in (0..x.len()).filter(|&e| load[e] > 0.0 && touching[e] > 0.0) {
        distribution.kn.push(kn[e]);
        distribution.density.push(kn[e] / touching[e]);
    }
    Ok(Some(distribution))
}

fn mean_and_half_range(values: &[f64]) -> [f64; 2] {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    [
        values.iter().sum::<f64>() / values.len() as f64,
        0.5 * (most - least),
    ]
}

/// Returns the number of modes of a reduction whose tables all exist and verify.
fn modes(run: &RunTables) -> Result<Option<usize>, ReportError> {
    let tables = [
        TableName::Structure,
        TableName::StructurePort,
        TableName::StructureResidual,
    ];
    for table in tables {
        if run.run_table(table)?.is_none() {
            return Ok(None);
        }
    }
    let modes = run.run_table(TableName::StructureMode)?;
    let numbers = modes.and_then(|frame| numeric_column(&frame, "mode"));
    Ok(numbers.map(|modes| modes.iter().fold(0.0, |most, mode| mode.max(most)) as usize + 1))
}
