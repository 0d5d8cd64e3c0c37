//! The claims: what the paper says, where, and the criterion. Criteria marked * are ours, the paper gives none.

use serde::Serialize;

/// A statement of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Claim {
    /// Its number, in the order of the paper's argument.
    pub number: u32,
    /// Section, equation or figure.
    pub place: &'static str,
    /// What is said.
    pub statement: &'static str,
    /// When it holds.
    pub criterion: &'static str,
    /// Which runs it takes, said where there are none.
    #[serde(skip)]
    pub needs: &'static str,
}

const fn claim(
    number: u32,
    place: &'static str,
    statement: &'static str,
    criterion: &'static str,
    needs: &'static str,
) -> Claim {
    Claim {
        number,
        place,
        statement,
        criterion,
        needs,
    }
}

const WEARS: &str = "needs a finished run that wears";
const MOVES: &str = "needs a finished run of a vibrating, wearing joint";
const VIBRATES: &str = "needs a finished run of a vibrating joint";
const ROUGHNESS: &str = "needs finished runs that differ by roughness alone";
const UPDATES: &str = "needs finished runs that differ by the criterion of the model update alone";
const PLASTIC: &str = "needs two finished runs that differ by the pressure cap alone";
const ROUGH: &str = "needs a finished run of a generated surface that wears";

/// All claims, by number.
pub const CLAIMS: [Claim; 46] = [
    claim(
        1,
        "4b",
        "Rq 5 µm: 231 wear iterations of at most 0.1 µm reach 10 041 928 cycles",
        "231 within a factor of 1.5*; of another wear scheme, the steps of 0.1 µm that its wear would take: ∫ dn · (deepest wear per cycle) / 0.1 µm",
        "needs a finished elastic run of Rq 5 µm to 10⁷ cycles",
    ),
    claim(
        2,
        "2e, eq. 2.7",
        "the cycles of an iteration are floor(Δh_max / max Δh), and vary",
        "exact for every step; the last ten steps longer than the first ten",
        WEARS,
    ),
    claim(
        3,
        "eq. 2.8",
        "wear only removes material; h + N Δh, explicitly",
        "no cell grows back; explicit steps exact to 1e-12 of the deepest wear*",
        WEARS,
    ),
    claim(
        4,
        "eq. 2.5, 2.6",
        "worn volume = α × dissipated energy, globally as locally",
        "sum of the depths and α times the energy: both the worn volume to 1e-10*",
        WEARS,
    ),
    claim(
        5,
        "derived",
        "no point wears deeper than the number of iterations × Δh_max",
        "deepest wear at most the steps of claim 1 × 0.1 µm, explicit: × Δh_max; 5 %* for the integral",
        WEARS,
    ),
    claim(
        6,
        "4b",
        "4 h 29 min for 10⁷ cycles",
        "less than that, on this machine",
        "needs a finished run to 10⁷ cycles",
    ),
    claim(
        7,
        "4",
        "10⁷ cycles are enough for a steady state",
        "dissipation per cycle changes by less than 5 %* per 10⁶ cycles over the last 2 × 10⁶",
        "needs a finished run to 10⁷ cycles",
    ),
    claim(
        8,
        "4b, fig. 10",
        "peaks are flattened, valleys stay as they are",
        "cells that never touched have worn by exactly 0; others have worn",
        WEARS,
    ),
    claim(
        9,
        "4b, fig. 11b",
        "Rq decreases with wear",
        "never rises (by more than 1e-4*), ends lower",
        ROUGH,
    ),
    claim(
        10,
        "4b, fig. 11a",
        "the mean height falls by what is removed",
        "drop = worn volume / area to 1e-9*, monotone",
        ROUGH,
    ),
    claim(
        11,
        "4b, fig. 11c",
        "skewness goes from 0 to negative",
        "|Sk| < 0.1* unworn, < −0.1* at the end",
        ROUGH,
    ),
    claim(
        12,
        "4b, fig. 11d",
        "kurtosis goes from 3 to above 3",
        "|Ku − 3| < 0.2* unworn, > 3 at the end",
        ROUGH,
    ),
    claim(
        13,
        "4b",
        "no longer Gaussian after only a few wear cycles",
        "|Sk| above 3 σ* of a surface of this size after ten* steps of claim 1 (0.01 µm at Rq ≤ 1 µm, else 0.1 µm)",
        "needs a finished run of a Gaussian surface that wears",
    ),
    claim(
        14,
        "4b, fig. 11",
        "all roughness parameters are strongly affected",
        "Rq, Sk, Ku change by more than 5 %* of Rq, 0.1*, 0.1*; from Rq 10 µm on Rq by more than 1 %*",
        ROUGH,
    ),
    claim(
        15,
        "4c, fig. 13",
        "the real contact area grows with wear",
        "never falls by more than 1 %* of itself, ends larger",
        ROUGH,
    ),
    claim(
        16,
        "4c, fig. 12",
        "peaks of pressure fall, flat patches of low pressure appear",
        "largest pressure, and that of 99 % of the cells in contact, end lower",
        ROUGH,
    ),
    claim(
        17,
        "4c, fig. 13",
        "smoother surfaces start with a larger contact area",
        "strictly ordered",
        ROUGHNESS,
    ),
    claim(
        18,
        "4c, fig. 13",
        "smoother: rapid rise, then an asymptote; rougher: nearly linear",
        "smoothest: slope of the first tenth above 5 times* that of the last half; roughest: R² of a line above 0.95*",
        ROUGHNESS,
    ),
    claim(
        19,
        "4c, fig. 14a",
        "kn: fast rise in running-in, then a slow one",
        "slope to 10⁵ cycles above 5 times* that after 5 × 10⁶, which is not negative",
        "needs a finished run of a generated surface to 10⁷ cycles",
    ),
    claim(
        20,
        "4c, fig. 14a",
        "kn tends to the same value for every roughness",
        "the spread over the runs falls to a third* or less",
        ROUGHNESS,
    ),
    claim(
        21,
        "4c, fig. 14b",
        "the same for kt",
        "as 19; kt/kn at the end within 10 %* of 2 (1 − ν) / (2 − ν)",
        "needs a finished run of a generated surface to 10⁷ cycles",
    ),
    claim(
        22,
        "4c",
        "local stiffness may fall while the global one rises",
        "median kn of the loaded contact elements falls, kn of the joint rises",
        "needs a finished run with contact.stiffness = \"tangent\": \"total\" and \"roughness\" have no local stiffness",
    ),
    claim(
        23,
        "4a, fig. 7, 8",
        "rougher: softer, larger slip, more dissipation",
        "unworn, over roughness: resonance strictly falls, amplitude of the relative displacement and dissipation of the fine contact strictly rise",
        ROUGHNESS,
    ),
    claim(
        24,
        "4a, fig. 8b",
        "the total normal load is the bolt load with a small harmonic part",
        "mean within 1 %* of it, half range below 5 %*",
        VIBRATES,
    ),
    claim(
        25,
        "4a",
        "bending moments are negligible",
        "|M| below 5 %* of N × half the side, at every iteration",
        VIBRATES,
    ),
    claim(
        26,
        "4d(ii), fig. 17b",
        "the loops are shifted by the static component",
        "mean relative displacement above 1 %* of its half range, unworn",
        VIBRATES,
    ),
    claim(
        27,
        "3",
        "three harmonics and the static component suffice",
        "with more harmonics the peak changes by less than 1 %* in amplitude, 0.05 %* in frequency",
        "needs two runs that differ by dynamics.harmonics alone, one with 0 to 3 (fretwear trade --knob harmonics makes them)",
    ),
    claim(
        28,
        "3",
        "normal and tangential contact are uncoupled",
        "Dundurs' β of the bodies is 0",
        "needs a finished run of a rough contact",
    ),
    claim(
        29,
        "4d(i), fig. 15a",
        "the wear rate falls at each update of the dynamic model",
        "dissipation falls by more than 1 %* at every update",
        "needs a finished run with updates",
    ),
    claim(
        30,
        "4d(i), fig. 15a",
        "after 10⁶ cycles the update criteria give nearly the same wear rate",
        "pairwise within 10 %*; within 5 %* it holds well",
        UPDATES,
    ),
    claim(
        31,
        "4d(i), fig. 15b",
        "kn hardly depends on the updates",
        "pairwise within 3 %* at all cycles",
        UPDATES,
    ),
    claim(
        32,
        "4d(i), fig. 16",
        "after 10⁷ cycles all criteria give the same forced response",
        "pairwise: frequency within 0.1 %*, peak within 2 %*",
        UPDATES,
    ),
    claim(
        33,
        "4d(i)",
        "no update is needed: the coupling is minimal",
        "never against the finest criterion: as 32",
        "needs two finished runs that differ by the model update alone, one of them never updated",
    ),
    claim(
        34,
        "4d(ii), fig. 17a",
        "the resonance rises slightly with wear",
        "never falls, ends higher by less than 5 %*",
        MOVES,
    ),
    claim(
        35,
        "4d(ii), fig. 17a, b",
        "the peak rises while friction dissipates less",
        "peak amplitude ends higher, dissipation of the fine contact ends lower",
        MOVES,
    ),
    claim(
        36,
        "4d(ii), fig. 17b",
        "loops: the stick part becomes steeper, the area smaller",
        "slope after a reversal ends higher, enclosed area lower",
        MOVES,
    ),
    claim(
        37,
        "4d(ii), fig. 18a",
        "the worn joints respond nearly alike, whatever their roughness was",
        "spread over the runs of frequency and peak falls to a third* or less",
        ROUGHNESS,
    ),
    claim(
        38,
        "4d(ii), fig. 18b",
        "rougher: higher wear rate at first; it falls to a steady value, and the rates converge",
        "ordered unworn; every rate ends lower; spread at the end at most 10 %*",
        ROUGHNESS,
    ),
    claim(
        39,
        "4d(iii), fig. 19",
        "Hertz with a hardness limit: a plateau at it, a slightly larger area",
        "largest pressure = cap, load to 1e-6*, area grows as the cap falls",
        "needs finished runs of a sphere that differ by the pressure cap alone, one without",
    ),
    claim(
        40,
        "4d(iii), fig. 20",
        "peaks above 600 MPa become 600 MPa",
        "unworn: largest pressure = cap, below that of the elastic run; more than 1 %* of the cells in contact at it",
        PLASTIC,
    ),
    claim(
        41,
        "4d(iii), fig. 21",
        "plastic: slightly larger area and lower kn at the start",
        "unworn area larger, kn lower than elastic",
        PLASTIC,
    ),
    claim(
        42,
        "4d(iii), fig. 21b",
        "later kn is nearly that of the elastic joint",
        "within 5 %* from 2 × 10⁶ cycles on",
        PLASTIC,
    ),
    claim(
        43,
        "4d(iii), fig. 22",
        "dissipation differs at first, and agrees after some 2 × 10⁶ cycles",
        "more than 5 %* apart somewhere before 10⁵ cycles, within 5 %* from 1.5 to 4 × 10⁶",
        PLASTIC,
    ),
    claim(
        44,
        "2e",
        "every contact solve is brought below a tolerance",
        "largest error of all iterations below that of the scene, normal and tangential",
        "needs a finished run of a rough contact",
    ),
    claim(
        45,
        "2a",
        "mass and stiffness of the structure are not changed by wear",
        "one reduced structure for the whole run, which verifies",
        VIBRATES,
    ),
    claim(
        46,
        "4a",
        "the joint is driven by displacement, so that it may slide as a whole",
        "tangential force reaches µ N within 0.1 %*, never above",
        MOVES,
    ),
];
