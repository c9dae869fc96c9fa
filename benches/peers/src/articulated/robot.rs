//! Robots: links, joints, masses. The numbers are pseudorandom and the same in every run.

/// A link and its joint.
#[derive(Clone, Debug)]
pub struct Part {
    /// Index of the parent, an earlier part; `None` for the base.
    pub parent: Option<usize>,
    /// The joint's motion.
    pub motion: Motion,
    /// Joint's origin in the parent, meters.
    pub at: [f64; 3],
    /// Rotation of the joint's axes about the parent's x, y and z in this order (URDF's `rpy`),
    /// rad.
    pub turn: [f64; 3],
    /// Mass, kg.
    pub mass: f64,
    /// Center of mass, meters.
    pub center: [f64; 3],
    /// Principal moments of inertia about it, link axes, kg·m².
    pub moments: [f64; 3],
}

/// One degree of freedom about or along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// A revolute joint.
    Turns([f64; 3]),
    /// A prismatic joint.
    Slides([f64; 3]),
}

/// A tree of parts on a base.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Name of the row.
    pub name: String,
    /// Whether the base floats; it then has the mass properties of [`base`](fn@base).
    pub floating: bool,
    /// Parts, parents first.
    pub parts: Vec<Part>,
    /// Time of the best peer for this shape, µs, and dynibo's time for a chain of 7 on the same
    /// machine.
    pub best: (f64, f64),
}

impl Robot {
    /// Returns the degrees of freedom.
    pub fn dof(&self) -> usize {
        self.parts.len() + if self.floating { 6 } else { 0 }
    }
}

/// Returns mass, center and moments of a floating base.
pub fn base() -> (f64, [f64; 3], [f64; 3]) {
    (12.0, [0.01, -0.02, 0.03], [0.3, 0.5, 0.6])
}

/// Numbers in [-1, 1), by a xorshift.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn three(&mut self, size: f64) -> [f64; 3] {
        [size * self.next(), size * self.next(), size * self.next()]
    }

    fn axis(&mut self) -> [f64; 3] {
        let k = ((self.next() + 1.0) * 1.5) as usize;
        std::array::from_fn(|i| f64::from(u8::from(i == k)))
    }

    fn part(&mut self, parent: Option<usize>) -> Part {
        let motion = Motion::Turns(self.axis());
        let (at, turn, center) = (self.three(0.3), self.three(1.5), self.three(0.1));
        let mass = 1.5 + self.next();
        let size = 0.02 + 0.01 * self.next();
        Part { parent, motion, at, turn, mass, center, moments: [size, 1.2 * size, 0.9 * size] }
    }
}

fn limbs(name: &str, floating: bool, limbs: &[(Option<usize>, usize)], best: f64) -> Robot {
    let mut numbers = Numbers(0x1234_5678_9ABC_DEF1);
    let mut parts: Vec<Part> = Vec::new();
    for &(root, length) in limbs {
        for k in 0..length {
            let parent = if k == 0 { root } else { Some(parts.len() - 1) };
            parts.push(numbers.part(parent));
        }
    }
    Robot { name: name.into(), floating, parts, best: (best, 1.10) }
}

/// Returns a chain of revolute joints on a fixed base.
pub fn chain(length: usize, best: f64) -> Robot {
    limbs(&format!("chain {length}"), false, &[(None, length)], best)
}

/// Returns a floating base with four legs of three revolute joints, like ANYmal.
pub fn anymal() -> Robot {
    limbs("ANYmal shape (18)", true, &[(None, 3); 4], 1.75)
}

/// Returns an arm of seven revolute joints and two prismatic fingers, like Franka's Panda.
pub fn panda() -> Robot {
    let mut robot = limbs("Panda shape (9)", false, &[(None, 7), (Some(6), 1), (Some(6), 1)], 1.09);
    robot.parts[7].motion = Motion::Slides([0.0, 1.0, 0.0]);
    robot.parts[8].motion = Motion::Slides([0.0, -1.0, 0.0]);
    robot
}

/// Returns a floating base with two legs of 6, a torso of 2, two arms of 7 with a gripper each, and
/// a neck of 2, like the reduced Talos: 38 degrees of freedom.
pub fn talos() -> Robot {
    limbs(
        "Talos shape (38)",
        true,
        &[(None, 6), (None, 6), (None, 2), (Some(13), 8), (Some(13), 8), (Some(13), 2)],
        4.41,
    )
}
