//! The input deck, read by an independent reader. `tests/peers/calculix.py` runs the deck in CalculiX.

use std::collections::HashMap;

use fretwear::material::{Elastic, Material};
use fretwear::structure::StructureError;
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::deck::Deck;
use fretwear::structure::element::Formulation;
use fretwear::structure::mesh::{Hexahedron, Mesh};
use fretwear::structure::resonator::{Resonator, ResonatorMesh};

/// Relative rounding of coordinates and stiffnesses, which the deck writes with twelve digits.
const WRITTEN: f64 = 5e-12;
/// Relative difference of frequencies for numbers of twelve digits, at the tolerance of the mode solver.
const SAME: f64 = 1e-8;
/// Number of characters that CalculiX reads of a number.
const READ: usize = 20;

/// A resonator with few elements and without a symmetry between x and y.
fn coarse(tied: bool) -> ResonatorMesh {
    let resonator = Resonator {
        lap_cells: 9,
        lap_length: 36e-3,
        half_depth_cells: 2,
        block_cells: 3,
        window_cells: 4,
        wall_cells: 2,
        inner_cells: 3,
        rim_cells: 1,
        tied,
        ..Resonator::default()
    };
    resonator.mesh().unwrap()
}

/// Keyword with its parameters and data lines.
struct Card {
    keyword: String,
    parameters: HashMap<String, String>,
    lines: Vec<Vec<String>>,
}

impl Card {
    fn numbers(&self) -> Vec<Vec<f64>> {
        let number = |text: &String| text.parse().unwrap();
        let line = |line: &Vec<String>| line.iter().map(number).collect();
        self.lines.iter().map(line).collect()
    }
}

fn read(text: &str) -> Vec<Card> {
    let mut cards: Vec<Card> = Vec::new();
    let fields = |line: &str| -> Vec<String> {
        line.split(',')
            .map(|field| field.trim().to_owned())
            .collect()
    };
    for line in text.lines().filter(|line| !line.starts_with("**")) {
        if let Some(keyword) = line.strip_prefix('*') {
            let fields = fields(keyword);
            let pair = |field: &String| {
                let (name, value) = field.split_once('=').unwrap();
                (name.to_owned(), value.to_owned())
            };
            cards.push(Card {
                keyword: fields[0].clone(),
                parameters: fields[1..].iter().map(pair).collect(),
                lines: Vec::new(),
            });
        } else {
            cards.last_mut().unwrap().lines.push(fields(line));
        }
    }
    cards
}

fn of<'a>(cards: &'a [Card], keyword: &str) -> Vec<&'a Card> {
    cards.iter().filter(|c| c.keyword == keyword).collect()
}

/// Mesh of a deck without springs. Parts and materials are numbered in the order of the deck.
fn mesh_of(cards: &[Card]) -> Mesh {
    let mut nodes = Vec::new();
    for line in of(cards, "NODE")[0].numbers() {
        assert_eq!(line[0], (nodes.len() + 1) as f64);
        nodes.push([line[1], line[2], line[3]]);
    }
    let elastic = of(cards, "ELASTIC").into_iter().zip(of(cards, "DENSITY"));
    let materials = elastic.map(|(elastic, density)| Material {
        elastic: Elastic {
            youngs_modulus: elastic.numbers()[0][0],
            poisson_ratio: elastic.numbers()[0][1],
        },
        density: density.numbers()[0][0],
    });
    let mut elements = HashMap::new();
    let hexahedra = of(cards, "ELEMENT").into_iter();
    for (part, card) in hexahedra
        .filter(|c| c.parameters["TYPE"] == "C3D8I")
        .enumerate()
    {
        let mut sections = of(cards, "SOLID SECTION").into_iter();
        let section = sections.find(|s| s.parameters["ELSET"] == card.parameters["ELSET"]);
        let mut names = of(cards, "MATERIAL").into_iter();
        let wanted = &section.unwrap().parameters["MATERIAL"];
        let material = names.position(|m| m.parameters["NAME"] == *wanted).unwrap();
        for line in card.numbers() {
            let nodes = std::array::from_fn(|n| line[1 + n] as usize - 1);
            let element = Hexahedron {
                nodes,
                material,
                part,
            };
            assert!(elements.insert(line[0] as usize, element).is_none());
        }
    }
    Mesh {
        elements: (1..=elements.len()).map(|e| elements[&e]).collect(),
        nodes,
        materials: materials.collect(),
    }
}

/// Springs of a deck. The equation of the node and direction defines the displacement of each spring.
fn springs_of(cards: &[Card]) -> Vec<Spring> {
    let mut equations = HashMap::new();
    for card in of(cards, "EQUATION") {
        let numbers = card.numbers();
        let terms: Vec<(usize, usize, f64)> = numbers[1..]
            .iter()
            .flat_map(|line| line.chunks(3))
            .map(|t| (t[0] as usize, t[1] as usize, t[2]))
            .collect();
        assert_eq!(terms.len() as f64, numbers[0][0]);
        let (node, axis, factor) = terms[0];
        let on = terms[1..].iter();
        let on = on.map(|&(n, a, f)| (3 * (n - 1) + a - 1, -f / factor));
        assert!(equations.insert((node, axis), on.collect()).is_none());
    }
    let mut springs = Vec::new();
    for card in of(cards, "SPRING") {
        let numbers = card.numbers();
        let set = &card.parameters["ELSET"];
        let mut elements = of(cards, "ELEMENT").into_iter();
        let elements = elements.find(|e| e.parameters["ELSET"] == *set).unwrap();
        assert_eq!(elements.parameters["TYPE"], "SPRING1");
        for line in elements.numbers() {
            let on = equations.remove(&(line[1] as usize, numbers[0][0] as usize));
            springs.push(Spring {
                on: on.unwrap(),
                stiffness: numbers[1][0],
            });
        }
    }
    assert!(equations.is_empty(), "an equation without a spring");
    springs
}

#[test]
fn the_deck_has_the_mesh() {
    let tied = coarse(true);
    let text = Deck::new(&tied, &[], 5).unwrap().to_string();
    let cards = read(&text);
    let found = mesh_of(&cards);
    assert_eq!(found.elements, tied.mesh.elements);
    assert_eq!(found.materials.len(), 2);
    for (found, expected) in found.materials.iter().zip(&tied.mesh.materials) {
        let modulus = found.elastic.youngs_modulus / expected.elastic.youngs_modulus;
        assert!((modulus - 1.0).abs() <= WRITTEN, "{modulus}");
        assert_eq!(found.elastic.poisson_ratio, expected.elastic.poisson_ratio);
        assert_eq!(found.density, expected.density);
    }
    assert_eq!(found.nodes.len(), tied.mesh.nodes.len());
    for (found, expected) in found.nodes.iter().zip(&tied.mesh.nodes) {
        for axis in 0..3 {
            let error = (found[axis] - expected[axis]).abs();
            assert!(error <= WRITTEN * expected[axis].abs(), "{found:?}");
        }
    }
    assert!(of(&cards, "EQUATION").is_empty() && of(&cards, "SPRING").is_empty());
    // Five elastic modes and six rigid modes.
    assert_eq!(of(&cards, "FREQUENCY")[0].numbers(), [[11.0]]);
    let sets: Vec<&String> = of(&cards, "NSET")
        .iter()
        .map(|c| &c.parameters["NSET"])
        .collect();
    assert_eq!(sets, ["FAR_WALL", "BLOCK"]);
    let wall = of(&cards, "NSET")[0].numbers();
    for node in wall.iter().flatten() {
        assert_eq!(
            found.nodes[*node as usize - 1][0],
            tied.points[0].position[0]
        );
    }
}

#[test]
fn the_deck_has_springs_on_means() {
    let open = coarse(false);
    let stiffness: Vec<[f64; 3]> = (0..open.contacts.len())
        // Stiffness of a worn joint: elements differ, one element is open, and one element has no tangential stiffness.
        .map(|e| match e {
            3 => [0.0; 3],
            5 => [0.0, 0.0, 2e7],
            _ => [1e7 + 1e5 * e as f64, 1.1e7, 2e7],
        })
        .collect();
    let deck = Deck::new(&open, &stiffness, 4).unwrap();
    let cards = read(&deck.to_string());
    let springs = springs_of(&cards);
    assert_eq!(springs.len(), 3 * stiffness.len() - 5);
    // Mean over the pairs as a plain sum, for an arbitrary displacement.
    let displacement = |dof: usize| (1.7 * dof as f64).sin();
    let mut expected = 0.0;
    for (contact, stiffness) in open.contacts.iter().zip(&stiffness) {
        for axis in 0..3 {
            let opening = contact.pairs.map(|(lower, upper)| {
                displacement(3 * upper + axis) - displacement(3 * lower + axis)
            });
            let mean = opening.iter().sum::<f64>() / 4.0;
            expected += 0.5 * stiffness[axis] * mean * mean;
        }
    }
    let energy = springs.iter().map(|spring| {
        let on = spring.on.iter();
        let value: f64 = on.map(|&(dof, weight)| weight * displacement(dof)).sum();
        0.5 * spring.stiffness * value * value
    });
    let found: f64 = energy.sum();
    assert!((found / expected - 1.0).abs() < 1e-11, "{found} {expected}");

    // `frequencies` returns the frequencies of the written deck.
    let system = System::assemble(&mesh_of(&cards), Formulation::IncompatibleModes, &springs);
    let read_back = super::resonator::frequencies(&system.unwrap(), 4);
    let own = deck.frequencies().unwrap();
    assert_eq!((own.rigid, own.elastic.len()), (6, 4));
    for (found, expected) in own.elastic.iter().zip(&read_back) {
        assert!((found / expected - 1.0).abs() < SAME, "{found} {expected}");
    }
}

#[test]
fn the_contact_faces_face_each_other() {
    let open = coarse(false);
    let count = open.contacts.len();
    let springs = vec![[0.0; 3]; count];
    let cards = read(&Deck::new(&open, &springs, 1).unwrap().to_string());
    assert!(springs_of(&cards).is_empty());
    // Centres of the faces of both sides, in the face numbering of the CalculiX manual.
    let faces = ["1234", "5876", "1562", "2673", "3784", "4851"];
    let centres = |name: &str| -> Vec<[f64; 3]> {
        let mut surfaces = of(&cards, "SURFACE").into_iter();
        let surface = surfaces.find(|s| s.parameters["NAME"] == name).unwrap();
        let lines = surface.lines.iter().map(|line| {
            let element: usize = line[0].parse().unwrap();
            let face: usize = line[1].strip_prefix('S').unwrap().parse().unwrap();
            let corners = open.mesh.corners_of(element - 1);
            let places = faces[face - 1].bytes().map(|b| usize::from(b - b'1'));
            let corners: Vec<[f64; 3]> = places.map(|p| corners[p]).collect();
            [0, 1, 2].map(|a| corners.iter().map(|c| c[a]).sum::<f64>() / 4.0)
        });
        lines.collect()
    };
    let (lower, upper) = (
        centres("CONTACT_LOWER_FACES"),
        centres("CONTACT_UPPER_FACES"),
    );
    assert_eq!((lower.len(), upper.len()), (count, count));
    for ((lower, upper), contact) in lower.iter().zip(&upper).zip(&open.contacts) {
        let [x, y] = contact.centre;
        for axis in 0..3 {
            for side in [lower, upper] {
                assert!((side[axis] - [x, y, 0.0][axis]).abs() < 1e-15, "{side:?}");
            }
        }
    }
}

#[test]
fn every_number_is_short_enough_to_be_read() {
    let mut open = coarse(false);
    open.mesh.nodes[7] = [-1.0 / 3.0 * 1e-120, 2.0 / 3.0 * 1e15, 1.0 / 3.0];
    let springs = vec![[1e10 / 3.0, 1e-10 / 3.0, 0.0]; open.contacts.len()];
    for card in read(&Deck::new(&open, &springs, 1).unwrap().to_string()) {
        if card.keyword == "HEADING" {
            continue;
        }
        for field in card.lines.iter().flatten() {
            assert!(field.len() <= READ, "{field}");
        }
    }
}

#[test]
fn what_makes_no_deck_is_refused() {
    let (open, tied) = (coarse(false), coarse(true));
    let springs = vec![[1e7, 1e7, f64::INFINITY]; open.contacts.len()];
    let name = |error: StructureError| match error {
        StructureError::OutOfRange { name, .. } | StructureError::Contradiction { name, .. } => {
            name
        }
        other => panic!("{other}"),
    };
    let refused = |mesh, springs, modes| name(Deck::new(mesh, springs, modes).unwrap_err());
    let stiffness = "the stiffness of a contact spring";
    assert_eq!(refused(&open, &springs, 4), stiffness);
    let negative = vec![[-1.0, 1.0, 1.0]; open.contacts.len()];
    assert_eq!(refused(&open, &negative, 4), stiffness);
    let count = "the number of contact springs";
    assert_eq!(refused(&open, &springs[1..], 4), count);
    assert_eq!(refused(&tied, &springs, 4), count);
    assert_eq!(refused(&tied, &[], 0), "the number of modes");
}
