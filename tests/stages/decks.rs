//! Decks of two bodies in contact.

use std::fmt::Write;

/// Test of whether a node of a body, at a position \[mm\], belongs to a set.
pub type Holds = fn(usize, [f64; 3]) -> bool;

/// Two equal bodies of steel, meshed with boxes.
pub struct TwoBodies {
    /// Edges of a box \[mm\].
    pub edge: [f64; 3],
    /// Number of boxes along each axis.
    pub counts: [usize; 3],
    /// Offset of the upper body from the lower body \[mm\].
    pub shift: [f64; 3],
}

impl TwoBodies {
    /// Deck with the given sets of nodes. The nodes of the first set are fixed.
    pub fn deck(&self, sets: &[(&str, Holds)]) -> String {
        let [nx, ny, _] = self.counts;
        let number = |body: usize, [i, j, k]: [usize; 3]| {
            1 + i + (nx + 1) * (j + (ny + 1) * k) + body * 1000
        };
        let grid =
            |[a, b, c]: [usize; 3]| (0..a * b * c).map(move |n| [n % a, n / a % b, n / (a * b)]);
        let nodes = || {
            (0..2).flat_map(move |body| {
                grid(self.counts.map(|n| n + 1)).map(move |at| {
                    let along =
                        |d: usize| at[d] as f64 * self.edge[d] + body as f64 * self.shift[d];
                    (number(body, at), body, [0, 1, 2].map(along))
                })
            })
        };
        let mut deck = String::from("*NODE\n");
        for (n, _, [x, y, z]) in nodes() {
            writeln!(deck, "{n}, {x}, {y}, {z}").expect("text");
        }
        deck += "*ELEMENT, TYPE=C3D8I, ELSET=ALL\n";
        for body in 0..2 {
            for (e, [i, j, k]) in grid(self.counts).enumerate() {
                let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
                let all =
                    [0, 1].map(|up| corners.map(|[a, b]| number(body, [i + a, j + b, k + up])));
                let all: Vec<String> = all.iter().flatten().map(usize::to_string).collect();
                writeln!(deck, "{}, {}", 1 + e + 1000 * body, all.join(", ")).expect("text");
            }
        }
        for (name, holds) in sets {
            writeln!(deck, "*NSET, NSET={name}").expect("text");
            for (n, ..) in nodes().filter(|(_, body, place)| holds(*body, *place)) {
                writeln!(deck, "{n},").expect("text");
            }
        }
        deck += "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.85E-9\n*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n";
        deck + &format!("*BOUNDARY\n{}, 1, 3\n", sets[0].0)
    }
}
