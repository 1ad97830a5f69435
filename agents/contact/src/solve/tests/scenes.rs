//! Scenes with an answer in closed form: rest, slopes, stacks, collisions.

use super::{Body, Case, Lattice, contact, is_open, rigid};
use crate::solve::{Contact, Hold, JointRow, Settings, Side, Solution, Solver, Spring};
use glam::DVec3;

const G: f64 = 9.81;
const HALF: f64 = 0.05;

/// Boxes of one size above each other over a floor, moved by small displacements and turns.
pub struct Stack {
    h: f64,
    pub gravity: DVec3,
    pub friction: f64,
    masses: Vec<f64>,
    /// Displacement and turn of each box.
    pub places: Vec<[DVec3; 2]>,
    pub velocities: Vec<[DVec3; 2]>,
    /// The impulse and the slip owed of the last step at each of the four corners of each box.
    impulses: Vec<DVec3>,
    owed: Vec<DVec3>,
    compliances: Vec<f64>,
    pub solver: Solver,
    pub factors: usize,
    /// Products of conjugate gradients.
    pub products: usize,
}

impl Stack {
    pub fn new(masses: &[f64]) -> Self {
        let count = masses.len();
        Self {
            h: 1.0 / 60.0,
            gravity: DVec3::Z * -G,
            friction: 0.5,
            masses: masses.to_vec(),
            places: vec![[DVec3::ZERO; 2]; count],
            velocities: vec![[DVec3::ZERO; 2]; count],
            impulses: vec![DVec3::ZERO; 4 * count],
            owed: vec![DVec3::ZERO; 4 * count],
            compliances: Vec::new(),
            solver: Solver::default(),
            factors: 0,
            products: 0,
        }
    }

    pub fn solved_by(self, settings: Settings) -> Self {
        Self { solver: Solver::new(settings), ..self }
    }

    fn exact(self) -> Self {
        self.solved_by(Settings { tolerance_m_s: 1e-11, ..Settings::default() })
    }

    fn contact(&self, upper: usize, corner: usize) -> Contact {
        let (x, y) = (if corner.is_multiple_of(2) { -HALF } else { HALF }, if corner < 2 { -HALF } else { HALF });
        let at = |body: usize, z: f64| {
            let arm = DVec3::new(x, y, z);
            (Side::rigid(body, arm), (self.places[body][0] + self.places[body][1].cross(arm)).z)
        };
        let (low, low_z) = if upper == 0 { (Side::FIXED, 0.0) } else { at(upper - 1, HALF) };
        let (high, high_z) = at(upper, -HALF);
        let index = 4 * upper + corner;
        Contact {
            gap_m: high_z - low_z,
            friction: self.friction,
            owed_slip_m: self.owed[index],
            warm_n_s: self.impulses[index],
            load_n_s: 0.0,
            ..contact([high, low], DVec3::Z)
        }
    }

    fn case(&self) -> Case {
        let bodies = self.masses.iter().zip(&self.velocities).map(|(&mass, v)| Body {
            free: vec![v[0] + self.gravity * self.h, v[1]],
            ..rigid(mass, DVec3::splat(HALF))
        });
        let contacts = (0..4 * self.masses.len()).map(|i| self.contact(i / 4, i % 4)).collect();
        Case { h_s: self.h, bodies: bodies.collect(), contacts, rows: Vec::new() }
    }

    fn step(&mut self) {
        let case = self.case();
        let solution = case.with(|problem| self.solver.solve(problem).unwrap().clone());
        assert!(!is_open(&solution.report), "{:?}", solution.report);
        for (k, contact) in case.contacts.iter().enumerate() {
            let (impulse, velocity) = (solution.contacts_n_s[k], solution.contacts_m_s[k]);
            self.owed[k] = contact.owed_slip_after(impulse, velocity, self.h);
            self.impulses[k] = impulse;
        }
        for body in 0..self.masses.len() {
            let v = solution.velocities(body);
            self.velocities[body] = [v[0], v[1]];
            self.places[body][0] += v[0] * self.h;
            self.places[body][1] += v[1] * self.h;
        }
        self.compliances = solution.compliances_per_kg;
        self.factors += solution.report.factors;
        self.products += solution.report.products;
    }

    pub fn steps(mut self, count: usize) -> Self {
        (0..count).for_each(|_| self.step());
        self
    }

    /// The load of the four contacts under a box, in shares of the weight above them.
    pub fn carried(&self, body: usize) -> f64 {
        let force: DVec3 = self.impulses[4 * body..4 * body + 4].iter().sum();
        force.z / (self.masses[body..].iter().sum::<f64>() * G * self.h)
    }
}

#[test]
fn a_block_at_rest_is_carried_and_lies_as_deep_as_is_chosen() {
    // a step long enough that a load of 7 N a corner reaches the depth within the bounds of eq. 5
    let stack = Stack { h: 1.0 / 30.0, ..Stack::new(&[3.0]).exact() }.steps(120);
    assert!((stack.carried(0) - 1.0).abs() < 1e-6, "{}", stack.carried(0));
    let depth = -stack.places[0][0].z;
    assert!((depth - 20e-6).abs() < 1e-9, "{depth}"); // the rest of the landing: 0.8 a step to the 120th
    let yields = 0.2 * 20e-6 / stack.h;
    for (r, impulse) in stack.compliances.iter().zip(&stack.impulses) {
        assert!((r * impulse.length() / yields - 1.0).abs() < 1e-4);
    }
}

#[test]
fn a_block_at_rest_takes_a_factor_in_few_steps() {
    let mut stack = Stack::new(&[3.0]).steps(120);
    stack.factors = 0;
    let stack = stack.steps(100);
    println!("one box: {} factors in 100 steps at rest", stack.factors);
    assert!(stack.factors <= 30); // errors below the tolerance add up until one is needed
}

#[test]
fn a_block_on_a_slope_slides_by_coulombs_law() {
    let (angle, friction) = (12.0_f64.to_radians(), 0.1);
    let gravity = DVec3::new(angle.sin(), 0.0, -angle.cos()) * G;
    let mut stack = Stack { gravity, friction, ..Stack::new(&[0.7]).exact() }.steps(150);
    let before = stack.velocities[0][0].x;
    stack = stack.steps(20);
    let acceleration = (stack.velocities[0][0].x - before) / (20.0 * stack.h);
    let wanted = G * (angle.sin() - friction * angle.cos());
    assert!((acceleration / wanted - 1.0).abs() < 1e-6, "{acceleration} is not {wanted}");
    assert!(stack.places[0][0].z < 1e-6, "it floats {} m high", stack.places[0][0].z);
}

#[test]
fn a_block_below_the_angle_of_friction_sticks() {
    let (angle, friction) = (20.0_f64.to_radians(), 0.4);
    let gravity = DVec3::new(angle.sin(), 0.0, -angle.cos()) * G;
    let stack = Stack { gravity, friction, ..Stack::new(&[0.7]).exact() }.steps(200);
    let (creep, way) = (stack.velocities[0][0].length(), stack.places[0][0].x);
    assert!(creep < 1e-7, "{creep} m/s"); // the slip owed is given back: 0.8 a step
    assert!(way < 1e-3, "{way} m");
}

#[test]
fn each_patch_of_a_stack_of_ten_carries_the_weight_above() {
    let mut stack = Stack::new(&[1.0; 10]).steps(240);
    for body in 0..10 {
        assert!((stack.carried(body) - 1.0).abs() < 1e-3, "{body}: {}", stack.carried(body));
        assert!((stack.places[body][0].z + 20e-6 * (body + 1) as f64).abs() < 1e-6);
    }
    stack.factors = 0;
    let stack = stack.steps(10);
    println!("ten boxes: {} factors in 10 steps at rest", stack.factors);
    assert!(stack.factors <= 20);
}

#[test]
fn a_heavy_block_lies_on_a_light_one() {
    let stack = Stack::new(&[0.01, 10.0]).steps(240);
    println!("1000 : 1: {} factors in 240 steps", stack.factors);
    for body in 0..2 {
        assert!((stack.carried(body) - 1.0).abs() < 1e-3, "{}", stack.carried(body));
        assert!((stack.places[body][0].z + 20e-6 * (body + 1) as f64).abs() < 1e-6, "{}", stack.places[body][0].z);
    }
}

#[test]
fn a_collision_keeps_momentum_to_rounding() {
    let mut bodies = [rigid(2.0, DVec3::new(0.1, 0.2, 0.3)), rigid(0.3, DVec3::splat(0.1))];
    bodies[0].free = vec![DVec3::new(1.0, 0.2, -0.1), DVec3::new(0.3, -2.0, 1.0)];
    bodies[1].free = vec![DVec3::new(-3.0, 0.0, 0.4), DVec3::new(0.0, 5.0, -1.0)];
    let centres = [DVec3::new(-0.1, 0.0, 0.0), DVec3::new(0.12, 0.03, 0.01)];
    let place = DVec3::new(0.0, 0.04, 0.02);
    let sides = [0, 1].map(|i| Side::rigid(i, place - centres[i]));
    let contacts = vec![contact(sides, DVec3::new(-1.0, 0.1, 0.2).normalize())];
    let case = Case { h_s: 0.01, bodies: bodies.to_vec(), contacts, rows: Vec::new() };
    let solution = case.with(|problem| Solver::default().solve(problem).unwrap().clone());
    assert!(solution.contacts_n_s[0].length() > 0.1);
    let momentum = |velocity: &dyn Fn(usize, usize) -> DVec3| {
        let of = |i: usize| {
            let linear = bodies[i].blocks[0].value * velocity(i, 0);
            [linear, bodies[i].blocks[1].value * velocity(i, 1) + centres[i].cross(linear)]
        };
        let (a, b) = (of(0), of(1));
        [a[0] + b[0], a[1] + b[1]]
    };
    let (before, after) = (momentum(&|i, k| bodies[i].free[k]), momentum(&|i, k| solution.velocities(i)[k]));
    for (a, b) in before.iter().zip(after) {
        assert!(a.distance(b) < 1e-14, "{a} became {b}"); // sums of numbers near 1
    }
}

/// A soft block of 0.3 kg, so many points to an edge, on the floor, under a plate of 2 kg that falls on it aslant.
pub fn plate_on_soft_block(side: usize, stiffness: f64) -> Case {
    let pitch = 0.06 / (side - 1) as f64;
    let lattice = Lattice { side, pitch, mass: 0.3, stiffness };
    let (mut soft, mut plate) = (lattice.body(), rigid(2.0, DVec3::new(0.05, 0.05, 0.01)));
    soft.free.fill(DVec3::new(0.05, 0.0, -0.16));
    plate.free[0] = DVec3::new(0.3, -0.1, -0.5);
    let centre = DVec3::new(0.03, 0.03, 0.07);
    let layer = side * side;
    let mut contacts = Vec::new();
    for (node, place) in lattice.places().into_iter().enumerate() {
        if node < layer {
            contacts.push(contact([Side::node(0, node), Side::FIXED], DVec3::Z));
        } else if node >= layer * (side - 1) {
            let under = Side::rigid(1, DVec3::new(place.x, place.y, 0.06) - centre);
            contacts.push(contact([under, Side::node(0, node)], DVec3::Z));
        }
    }
    Case { h_s: 1.0 / 60.0, bodies: vec![soft, plate], contacts, rows: Vec::new() }
}

#[test]
fn a_soft_block_between_a_plate_and_the_floor_keeps_momentum() {
    let case = plate_on_soft_block(4, 4.0);
    let solution = case.with(|problem| Solver::default().solve(problem).unwrap().clone());
    println!("soft block: {:?}", solution.report);
    assert!(!is_open(&solution.report) && solution.report.miss_m_s < 1e-5, "{:?}", solution.report);
    let gained = momentum_gained(&case, &solution, 64);
    let floor: DVec3 = solution.contacts_n_s[..16].iter().sum();
    assert!(gained.distance(floor) < 1e-12, "{gained} is not {floor}"); // of a few N s, by stiffness a thousand times the mass
}

/// The momentum that the block and the plate have gained together.
pub fn momentum_gained(case: &Case, solution: &Solution, nodes: usize) -> DVec3 {
    let soft_change: DVec3 = solution.velocities(0).iter().zip(&case.bodies[0].free).map(|(v, f)| *v - *f).sum();
    let plate_change = solution.velocities(1)[0] - case.bodies[1].free[0];
    soft_change * (0.3 / nodes as f64) + plate_change * 2.0
}

fn tip(spring: Option<Spring>, limit_n_s: f64) -> (DVec3, DVec3) {
    let mut body = rigid(0.5, DVec3::splat(HALF));
    body.free[0] = DVec3::new(1.0, 0.0, 0.0);
    let row = JointRow::new([Side::rigid(0, DVec3::ZERO), Side::FIXED], Hold::All { limit_n_s });
    let row = spring.map_or(row, |spring| row.with_spring(spring, 0.01));
    let case = Case { h_s: 0.01, bodies: vec![body], contacts: Vec::new(), rows: vec![row] };
    case.with(|problem| {
        let mut solver = Solver::default();
        let solution = solver.solve(problem).unwrap();
        (solution.velocities(0)[0], solution.rows_n_s[0])
    })
}

#[test]
fn a_joint_stops_what_it_holds() {
    let (velocity, impulse) = tip(None, f64::INFINITY);
    assert!(velocity.length() < 1e-3 && (impulse.x + 0.5).abs() < 1e-3, "{velocity} {impulse}"); // its compliance
}

#[test]
fn a_drive_gives_no_more_than_its_limit() {
    let (velocity, impulse) = tip(None, 0.2);
    assert!((impulse.x + 0.2).abs() < 1e-9 && (velocity.x - 0.6).abs() < 1e-8, "{velocity} {impulse}");
}

#[test]
fn a_spring_is_implicit_at_its_end() {
    let spring = Spring { stiffness_n_m: 300.0, damping_n_s_m: 2.0, stretch_m: DVec3::X * 0.01 };
    let (velocity, _) = tip(Some(spring), f64::INFINITY);
    // m (v − 1) = −h k (d + h v) − h c v
    let wanted = (0.5 - 0.01 * 300.0 * 0.01) / (0.5 + 0.01 * 0.01 * 300.0 + 0.01 * 2.0);
    assert!((velocity.x - wanted).abs() < 1e-6, "{} is not {wanted}", velocity.x);
}
