//! Catalogue of the claims: statement, place in the paper, and criterion. Criteria marked * are ours, because the paper
//! gives no criterion.

use serde::Serialize;

/// Kind of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A result of the paper, which a run may contradict.
    Result,
    /// A property that follows from the definition of the method. A run shows that the program applies the definition,
    /// but does not confirm a result of the paper.
    Method,
    /// A check of the runs that the verdicts depend on. The paper does not state the check.
    Check,
}

/// Statement of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Claim {
    /// Number, in the order of the paper's argument.
    pub number: u32,
    /// Kind of the claim.
    pub kind: Kind,
    /// Section, equation or figure.
    pub place: &'static str,
    /// Short statement.
    pub statement: &'static str,
    /// Words of the paper. Empty for a check.
    pub words: &'static str,
    /// Criterion of the verdict.
    pub criterion: &'static str,
    /// Runs that the claim needs. If no run meets the needs of the claim, the finding reports the needed runs.
    #[serde(skip)]
    pub needs: &'static str,
}

const RQ5: &str = "needs a finished run of a generated surface that wears, in the setting";
const ALL: &str = "needs finished runs of generated surfaces that wear, in the setting";
const MOVES: &str = "needs a finished run of a vibrating, wearing joint, in the setting";
const EXPLICIT: &str = "needs a finished run with wear.scheme = \"explicit\" (preset paper)";
const ROUGHNESS: &str = "needs finished runs that differ by roughness alone";
const UPDATES: &str = "needs finished runs that differ by the criterion of the model update alone";
const UPDATES_BEYOND: &str =
    "needs finished runs beyond 10⁶ cycles that differ by the criterion of the model update alone";
const UPDATES_TO_THE_END: &str =
    "needs finished runs to 10⁷ cycles that differ by the criterion of the model update alone";
const PLASTIC_LATER: &str =
    "needs two finished runs to 4 × 10⁶ cycles that differ by the pressure cap alone";
const PLASTIC: &str = "needs two finished runs that differ by the pressure cap alone";

/// Creates an entry of [`CLAIMS`].
const fn claim(
    number: u32,
    kind: Kind,
    place: &'static str,
    [statement, words, criterion, needs]: [&'static str; 4],
) -> Claim {
    Claim {
        number,
        kind,
        place,
        statement,
        words,
        criterion,
        needs,
    }
}

use Kind::{Check, Method, Result};

/// All claims, by number.
pub const CLAIMS: [Claim; 47] = [
    claim(
        1,
        Result,
        "4b",
        [
            "231 wear iterations reach 10⁷ cycles",
            "thanks to the acceleration factor, only 231 iterations were needed to reach 10 million cycles",
            "iterations of the explicit run of Rq 5 µm to 10⁷ cycles: 231 within a factor of 1.5*",
            "needs a finished explicit run of Rq 5 µm to 10⁷ cycles",
        ],
    ),
    claim(
        2,
        Method,
        "2e, eq. 2.7",
        [
            "the cycles of an iteration are floor(Δh_max / max Δh), and vary",
            "based on this formula, each wear iteration can correspond to a different number of cycles",
            "exact for every explicit step, and not all alike",
            EXPLICIT,
        ],
    ),
    claim(
        3,
        Method,
        "2e, eq. 2.8",
        [
            "the profile becomes h + N Δh: wear only removes material",
            "the stability of the explicit scheme used to update the contacting surface profile with wear",
            "no cell of the explicit run grows back, and its steps are exact to 1e-12 of the deepest wear*",
            EXPLICIT,
        ],
    ),
    claim(
        4,
        Method,
        "2d, eq. 2.5, 2.6",
        [
            "worn volume = α × dissipated energy, globally as locally",
            "the total wear volume calculated after N cycles is considered to be proportional to the dissipated energy",
            "all runs: the sum of the depths and α times the energy are both the worn volume to 1e-10*",
            ALL,
        ],
    ),
    claim(
        5,
        Result,
        "4b, fig. 9",
        [
            "no point wears deeper than the iterations allow: 231 × 0.1 µm",
            "a maximum allowed wear depth of 0.1 µm; only 231 iterations were needed",
            "Rq 5 µm: deepest wear at 10⁷ cycles at most 23.1 µm",
            "needs a finished run of Rq 5 µm to 10⁷ cycles, in the setting",
        ],
    ),
    claim(
        6,
        Result,
        "4b",
        [
            "a fretting cycle takes 70 s, and 10⁷ cycles 4 h 29 min",
            "Each fretting cycle took approximately 70 s to run […] which took approximately 4 h 29 min",
            "explicit run, CPU time: at most 70 s per iteration, and 4 h 29 min in total, on this machine",
            "needs a finished explicit run to 10⁷ cycles",
        ],
    ),
    claim(
        7,
        Result,
        "4",
        [
            "10⁷ cycles are enough for a steady state",
            "up to 10 million vibration cycles, which was shown to be enough to reach a steady state",
            "each roughness: the dissipation per cycle changes by less than 5 %* per 10⁶ cycles over the last 2 × 10⁶",
            "needs finished runs to 10⁷ cycles, in the setting",
        ],
    ),
    claim(
        8,
        Result,
        "4b, fig. 10",
        [
            "peaks are flattened, valleys stay as they are",
            "wear, which only affects the peaks of the profile (in contact), while the valleys (not in contact) maintain their shape",
            "Rq 5 µm: some cells have never touched, and their wear is exactly 0; other cells have worn",
            RQ5,
        ],
    ),
    claim(
        9,
        Result,
        "4b, fig. 11b",
        [
            "Rq decreases with wear",
            "As the surface wears out, its RMS roughness tends to decrease",
            "each roughness, Rq of the heights by eq. 4.1: never above the unworn value (by more than 1e-4*), lower at the end",
            ALL,
        ],
    ),
    claim(
        10,
        Method,
        "4b, fig. 11a",
        [
            "the mean height falls by what is removed",
            "the evolution of the mean height",
            "all runs that wear for more than a cycle: drop = worn volume / area to 1e-9*, monotone",
            ALL,
        ],
    ),
    claim(
        11,
        Result,
        "4b, fig. 11c",
        [
            "skewness goes from 0 to negative",
            "the distribution of heights becomes negatively skewed as the surface wears out",
            "each roughness, by eq. 4.1: |Sk| < 0.1* unworn, < −0.1* at the end",
            ALL,
        ],
    ),
    claim(
        12,
        Result,
        "4b, fig. 11d",
        [
            "kurtosis goes from 3 to above 3",
            "the profile distribution is closer to its mean value and therefore the kurtosis is increasing with wear",
            "each roughness, by eq. 4.2: |Ku − 3| < 0.2* unworn, above 3 and above the unworn value at the end",
            ALL,
        ],
    ),
    claim(
        13,
        Result,
        "4b",
        [
            "no longer Gaussian after only a few wear cycles",
            "after only a few wear cycles, the four Gaussian rough surfaces used here are no longer Gaussian",
            "each roughness: at 1 %* of 10⁷ cycles |Sk| above 3 σ* of a surface of this size",
            "needs finished runs of Gaussian surfaces that wear to 10⁵ cycles, in the setting",
        ],
    ),
    claim(
        14,
        Result,
        "4b, fig. 11",
        [
            "all roughness parameters are strongly affected",
            "all roughness parameters of the surface are strongly affected by wear",
            "each roughness, in the directions of fig. 11: mean height and Rq fall by more than 5 %* of the unworn Rq, Sk falls by more than 0.3*, Ku rises by more than 0.3*",
            ALL,
        ],
    ),
    claim(
        15,
        Result,
        "4c, fig. 13",
        [
            "the real contact area grows with wear",
            "the asperities are progressively removed, the contact area increases",
            "each roughness: never falls by more than 1 %* of itself, ends larger",
            ALL,
        ],
    ),
    claim(
        16,
        Result,
        "4c, fig. 12",
        [
            "peaks of pressure fall, flat patches of much lower pressure appear",
            "the peaks of pressure are decreasing until nearly flat patches of much lower pressure are obtained",
            "Rq 5 µm: at the end at most half* of the unworn value, both for the largest pressure along a section (median over the sections along x) and for the pressure that 99 % of the cells in contact do not exceed; the ratio of the latter to the mean falls",
            RQ5,
        ],
    ),
    claim(
        17,
        Result,
        "4c, fig. 13",
        [
            "smoother surfaces start with a larger contact area",
            "smoother profiles start with a much larger real contact area compared with rougher profiles",
            "unworn: strictly ordered, the smoothest above twice* the roughest",
            ROUGHNESS,
        ],
    ),
    claim(
        18,
        Result,
        "4c, fig. 13",
        [
            "smoother: rapid rise of the area, then an asymptote; rougher: nearly linear",
            "the smoother profiles are characterized by a more rapid initial increase followed by an asymptotic behaviour, compared to the rougher ones which exhibit a quasi-linear increase",
            "Rq ≤ 1 µm: slope of the first tenth above 5 times* that of the last half; above: R² of a line above 0.95*",
            ROUGHNESS,
        ],
    ),
    claim(
        19,
        Result,
        "4c, fig. 14a",
        [
            "kn: fast rise in running-in, then a slow one",
            "a running-in phase during which the contact stiffness rapidly increases and a steady phase during which it keeps increasing, but at a much lower rate",
            "each roughness: slope to 10⁵ cycles above 5 times* that after 5 × 10⁶, which is not negative",
            "needs finished runs of generated surfaces to 10⁷ cycles, in the setting",
        ],
    ),
    claim(
        20,
        Result,
        "4c, fig. 14a",
        [
            "kn tends to the same value for every roughness",
            "the global contact stiffness tends to the same value no matter what the initial RMS roughness is",
            "the spread over the roughnesses falls to a third* or less",
            ROUGHNESS,
        ],
    ),
    claim(
        21,
        Result,
        "4c, fig. 14b",
        [
            "the same for kt",
            "The same observations can be made on the global tangential contact stiffness",
            "criteria of claims 19 and 20",
            "needs finished runs of generated surfaces to 10⁷ cycles, in the setting",
        ],
    ),
    claim(
        22,
        Result,
        "4c",
        [
            "local stiffness falls while the global one rises",
            "the local values of contact stiffness are decreasing, but the overall contact stiffness keeps increasing because the global contact area does so",
            "contact elements with individual stiffness, updated as the joint wears: kn of an element over its area in contact falls (median), kn of the joint and its contact area rise",
            "needs a finished run with updates and contact.stiffness = \"tangent\"",
        ],
    ),
    claim(
        23,
        Result,
        "4a, fig. 7, 8a",
        [
            "rougher: softer, larger slip, more dissipation",
            "higher values of roughness […] lower the global stiffness of the interface. This generally was found to lead to larger relative tangential displacement, and in turn to higher energy dissipation",
            "unworn, over roughness: frequency of the peak strictly falls, relative displacement and the response's own friction energy strictly rise",
            ROUGHNESS,
        ],
    ),
    claim(
        24,
        Result,
        "4a, fig. 8b",
        [
            "the total normal load is the bolt load with a small harmonic part",
            "equal to the bolt load (30 kN) plus a small harmonic oscillation due to the dynamic load",
            "each roughness, unworn: mean within 1 %* of the bolt load, half range below 5 %* of it",
            MOVES,
        ],
    ),
    claim(
        25,
        Result,
        "4a",
        [
            "bending moments are negligible",
            "the bending moments were found to be negligible, as the mode excited is mainly causing shear stresses at the interface",
            "each roughness, unworn: largest |M| of the cycle, static part included, below 5 %* of N × half the side",
            MOVES,
        ],
    ),
    claim(
        26,
        Result,
        "4d(ii), fig. 17b",
        [
            "the loops are shifted by the static component",
            "A clear shift of the loops due to the static component of the dynamic response can be observed",
            "Rq 5 µm, unworn: |mean| above 5 %* of the half range of the relative displacement; undecided if the joint slides as a whole, because its mean is then indeterminate",
            MOVES,
        ],
    ),
    claim(
        27,
        Result,
        "3",
        [
            "three harmonics and the static component suffice",
            "Three harmonics plus the static term […] were shown to be enough for capturing the contact nonlinearity",
            "unworn: with more harmonics the peak changes by less than 1 %* in amplitude, 0.05 %* in frequency",
            "needs runs that differ by dynamics.harmonics alone, one with 0 to 3",
        ],
    ),
    claim(
        28,
        Method,
        "3",
        [
            "normal and tangential contact are uncoupled",
            "the same linear elastic material is used for the entire structure. Therefore, the normal and tangential contact problems at the interface of the joint are uncoupled",
            "a premise of both programs: Dundurs' β of the bodies is 0",
            "needs a finished run of a rough contact",
        ],
    ),
    claim(
        29,
        Result,
        "4d(i), fig. 15a",
        [
            "the wear rate jumps down at each update of the dynamic model",
            "a jump in the wear rate is obtained after each update […] smaller tangential relative displacements at the contact interface, and therefore […] a lower wear rate",
            "at every update, for the same state of wear: dissipation falls by more than 1 %* from the vibration before the update to the one after it",
            "needs a finished run with updates",
        ],
    ),
    claim(
        30,
        Result,
        "4d(i), fig. 15a",
        [
            "after 10⁶ cycles the update criteria give nearly the same wear rate",
            "after only one million cycles, the three update criteria are yielding to nearly the same wear rate",
            "pairwise within 5 %* from 10⁶ cycles on",
            UPDATES_BEYOND,
        ],
    ),
    claim(
        31,
        Result,
        "4d(i), fig. 15b",
        [
            "kn hardly depends on the updates",
            "the global contact stiffness is barely affected by the updates",
            "pairwise within 3 %* at all cycles",
            UPDATES,
        ],
    ),
    claim(
        32,
        Result,
        "4d(i), fig. 16",
        [
            "after 10⁷ cycles all criteria give the same forced response",
            "the nonlinear dynamic response after these 10 million cycles is expected to be the same for all update criteria, which is confirmed by the FRFs",
            "pairwise: frequency of the peak within 0.1 %*, amplitude within 2 %*",
            UPDATES_TO_THE_END,
        ],
    ),
    claim(
        33,
        Result,
        "4d(i)",
        [
            "no update is needed: the coupling is minimal",
            "no update of the nonlinear dynamic model is needed to discuss the effects of roughness and wear on the dynamic response up to 10 million cycles",
            "the run without updates against the finest criterion: criterion of claim 32",
            "needs two finished runs that differ by the model update alone, one of them never updated, and wear to 10⁷ cycles",
        ],
    ),
    claim(
        34,
        Result,
        "4d(ii), fig. 17a",
        [
            "the resonance rises slightly with wear",
            "drives the slight tendency towards higher resonance frequencies observed in figure 17a",
            "Rq 5 µm: the frequency of the peak is above the unworn one in every worn state, in the last by less than 5 %*",
            MOVES,
        ],
    ),
    claim(
        35,
        Result,
        "4d(ii), fig. 17",
        [
            "the peak rises while friction dissipates less",
            "a higher amplitude of the FRFs can be observed with the wear progressing, which indicates a lower energy dissipation due to friction at the contact interface",
            "Rq 5 µm: the peak ends higher, and the worn response's own friction energy lower, than unworn",
            MOVES,
        ],
    ),
    claim(
        36,
        Result,
        "4d(ii), fig. 17b",
        [
            "loops: steeper where they stick, a sharper transition, a smaller area",
            "the stick part of the loop increases its slope (stiffness), and the micro-slip transition to sliding becomes sharper, leading to a lower enclosed area of the cycle (energy dissipated)",
            "Rq 5 µm: kt of the joint ends higher, the loop of the fine contact fills more of the parallelogram of its slope and force, and the worn response's own friction energy ends lower",
            MOVES,
        ],
    ),
    claim(
        37,
        Result,
        "4d(ii), fig. 18a",
        [
            "the worn joints respond nearly alike, whatever their roughness was",
            "due to wear, the responses are getting closer to each other and are nearly identical after 10 million cycles",
            "spread over the roughnesses of frequency and amplitude of the peak falls to a third* or less",
            ROUGHNESS,
        ],
    ),
    claim(
        38,
        Result,
        "4d(ii), fig. 18b",
        [
            "rougher: higher wear rate at first; it falls to a steady value, and the rates converge",
            "the higher the initial RMS roughness, the higher the wear rates, and […] the wear rate decreases to a steady-state value",
            "ordered unworn; every rate ends lower; spread at the end at most 10 %*",
            ROUGHNESS,
        ],
    ),
    claim(
        39,
        Result,
        "4d(iii), fig. 19",
        [
            "Hertz with a hardness limit: a plateau at it, a slightly larger area",
            "A circular region of plasticity, in which the pressure is equal to the imposed limited value […] A small extension of the overall contact area can also be observed",
            "largest pressure = cap on more than 1 %* of the cells in contact, load to 1e-6*, area grows as the cap falls, by less than half*",
            "needs finished runs of a sphere that differ by the pressure cap alone, one without",
        ],
    ),
    claim(
        40,
        Result,
        "4d(iii), fig. 20",
        [
            "peaks above 600 MPa become 600 MPa",
            "the numerous peaks that were higher than 600 MPa in the elastic contact, are now all equal to 600 MPa",
            "unworn: largest pressure = cap, lower than in the elastic run; more than 1 %* of the cells in contact are at the cap",
            PLASTIC,
        ],
    ),
    claim(
        41,
        Result,
        "4d(iii), fig. 21",
        [
            "plastic: slightly larger area and lower kn at the start",
            "a slight increase of contact area could be observed […] in the initial phase […] the contact with plasticity exhibits lower stiffness",
            "unworn: area larger, by less than half*, kn lower than elastic",
            PLASTIC,
        ],
    ),
    claim(
        42,
        Result,
        "4d(iii), fig. 21b",
        [
            "later kn is nearly that of the elastic joint",
            "the global stiffness tend to become nearly equal to the elastic case",
            "within 5 %* from 2 × 10⁶ cycles on",
            PLASTIC_LATER,
        ],
    ),
    claim(
        43,
        Result,
        "4d(iii), fig. 22",
        [
            "wear rates differ at first, and agree after some 2 × 10⁶ cycles",
            "the wear rates […] show a significantly different behaviour during the initial phase, until they reach a similar value after approximately 2 million cycles",
            "more than 5 %* apart somewhere before 10⁵ cycles, within 5 %* from 2 to 4 × 10⁶",
            PLASTIC_LATER,
        ],
    ),
    claim(
        44,
        Method,
        "2e",
        [
            "every contact solve is brought below a tolerance",
            "By enforcing the residuals of the conjugate gradient to be minimum within a given tolerance, the convergence of the solution is ensured for each time step",
            "all runs: largest error of all iterations below that of the scene, normal and tangential",
            "needs a finished run of a rough contact",
        ],
    ),
    claim(
        45,
        Result,
        "2a",
        [
            "wear is too shallow to change mass and stiffness of the structure",
            "The depth of wear is considered to be very small relative to the characteristic dimensions of the structures in contact",
            "each roughness: deepest wear below a thousandth* of the shorter side of the joint, whose structure is one and the same for the whole run",
            MOVES,
        ],
    ),
    claim(
        46,
        Result,
        "4a",
        [
            "the joint slides as a whole",
            "The simulations of the tangential contact problem are displacement-controlled to allow macro-slip",
            "Rq 5 µm: the tangential force of the fine contact reaches µN at the same instant within 0.1 %*, and never exceeds it",
            MOVES,
        ],
    ),
    claim(
        47,
        Check,
        "–",
        [
            "friction takes no more than the exciter supplies",
            "",
            "each roughness, every iteration: friction energy of the fine contact, and of each worn response, at most the input energy of the vibration that it belongs to",
            MOVES,
        ],
    ),
];
