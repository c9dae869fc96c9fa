//! Kinds of loop joints.

/// The motion that a loop joint leaves free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LoopJointKind {
    /// The origins coincide; all rotations are free. Three rows. Its position is the swing: the angle between the
    /// z axes, in [0, π].
    Spherical,
    /// The origins and the z axes coincide; one rotation is free. Five rows.
    Revolute,
    /// Both frames coincide. Six rows.
    Fixed,
    /// All but the displacement along the z axes is held: a piston in its cylinder. Five rows.
    Prismatic,
    /// The z axes coincide: displacement along them and rotation about them are free. Four rows.
    Cylindrical,
    /// The origins coincide, and A's z axis is perpendicular to B's x axis: rotations about these two
    /// are free, as of a Cardan shaft. Four rows.
    Universal,
    /// A's origin is in the plane of B's x and y axes, and the z axes are parallel: displacements in
    /// the plane and the rotation about its normal are free. Three rows.
    Planar,
    /// The origins keep their distance. One row.
    Distance,
    /// The distance of the origins is at most the length. One row, active while it is taut.
    Rope,
    /// A spring between the origins. No row is held.
    Spring,
    /// A and B turn about their z axes in the ratio of their teeth; the axes do not move in the world.
    /// One row, between two parts that other joints hold.
    Gear,
    /// A turns about its z axis, and B moves along its own by `radius` per radian; the axes do not move
    /// in the world. One row, between two parts that other joints hold.
    Rack,
    /// A cylindrical joint whose displacement is `pitch` per turn. Five rows.
    Screw,
    /// A rope from A over two points of the world to B: the length on the side of A plus `ratio` times
    /// that on the side of B is at most the length. One row, active while it is taut.
    Pulley,
}

impl LoopJointKind {
    /// All kinds with their names in Python and in scene files.
    pub const NAMES: &[(&str, LoopJointKind)] = &[
        ("fixed", LoopJointKind::Fixed),
        ("revolute", LoopJointKind::Revolute),
        ("prismatic", LoopJointKind::Prismatic),
        ("spherical", LoopJointKind::Spherical),
        ("cylindrical", LoopJointKind::Cylindrical),
        ("universal", LoopJointKind::Universal),
        ("planar", LoopJointKind::Planar),
        ("distance", LoopJointKind::Distance),
        ("rope", LoopJointKind::Rope),
        ("spring", LoopJointKind::Spring),
        ("gear", LoopJointKind::Gear),
        ("rack", LoopJointKind::Rack),
        ("screw", LoopJointKind::Screw),
        ("pulley", LoopJointKind::Pulley),
    ];

    /// Returns the name.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    /// Returns the number of degrees of freedom that have settings of their own: displacements of A along the axes of B's
    /// frame before rotations, or one length.
    ///
    /// | kind | degrees of freedom |
    /// |---|---|
    /// | revolute | angle about z |
    /// | prismatic, screw | displacement along z |
    /// | cylindrical | displacement along z, angle about z |
    /// | universal | angles about z of A and about x of B |
    /// | planar | displacements along x and y of B, angle about z |
    /// | spherical | rotations about x, y, z of B: the components of the rotation vector |
    /// | distance, rope, spring, pulley | length |
    /// | fixed, gear, rack | none |
    pub fn dofs(self) -> usize {
        use LoopJointKind::*;
        match self {
            Fixed | Gear | Rack => 0,
            Revolute | Prismatic | Screw | Distance | Rope | Spring | Pulley => 1,
            Cylindrical | Universal => 2,
            Planar | Spherical => 3,
        }
    }

    /// Returns whether degree of freedom `k` is an angle, rad, and no distance, m.
    pub fn turns_at(self, k: usize) -> bool {
        use LoopJointKind::*;
        match self {
            Revolute | Spherical | Universal => true,
            Cylindrical => k == 1,
            Planar => k == 2,
            _ => false,
        }
    }

    /// Returns whether it has a position: that of its first degree of freedom, or the swing of a spherical joint.
    pub fn has_position(self) -> bool {
        self.dofs() > 0
    }

    /// Returns whether its position is an angle, rad, and no distance, m.
    pub fn turns(self) -> bool {
        self.turns_at(0)
    }

    /// Returns whether the parts that it joins stay together: with less than the distance of two points between them.
    pub fn holds_together(self) -> bool {
        !self.has_length()
    }

    /// Returns whether its position is a length: the distance of its origins, or that of a pulley.
    pub fn has_length(self) -> bool {
        use LoopJointKind::*;
        matches!(self, Distance | Rope | Spring | Pulley)
    }

    /// Returns why limits of a length, m, contradict the length that the joint keeps: the limit, its value and its admissible
    /// range. A distance keeps its length within a billionth of it, a rope and a pulley keep theirs at most.
    pub fn limits_fault(self, [lower, upper]: [f64; 2], length: f64) -> Option<(&'static str, f64, &'static str)> {
        use LoopJointKind::{Distance, Pulley, Rope};
        let rounding = 1e-9 * length.max(1.0);
        match self {
            _ if !self.has_length() => None,
            _ if upper < 0.0 => Some(("the upper limit of its length", upper, "at least 0: it is a length")),
            Distance | Rope | Pulley if lower > length + rounding => {
                Some(("the lower limit of its length", lower, "at most the length of the joint"))
            }
            Distance if upper < length - rounding => {
                Some(("the upper limit of its length", upper, "at least the length of the joint"))
            }
            _ => None,
        }
    }

    /// Returns whether joints of this kind have a parameter, by its name in Python's `World.add_joint`. True for those of all kinds.
    pub fn has(self, parameter: &str) -> bool {
        use LoopJointKind::*;
        match parameter {
            "length" | "second_point" => self.has_length(),
            "second_axis" => matches!(self, Universal | Planar | Spherical | Gear | Rack),
            "teeth" => self == Gear,
            "radius" => self == Rack,
            "pitch" => self == Screw,
            "ratio" | "ground" => self == Pulley,
            "cone" | "twist_limits" => self == Spherical,
            "angle" => self == Revolute,
            "limits" => self.dofs() > 0 && self != Spherical,
            "armature" => self.dofs() > 0 && !self.has_length(),
            "drive" | "stiffness" | "rest" | "damping" | "friction" | "max_velocity" | "effort" | "dofs" => {
                self.dofs() > 0
            }
            _ => true,
        }
    }

    /// Returns the names of the kinds that have a parameter.
    pub fn names_with(parameter: &str) -> Vec<&'static str> {
        Self::NAMES.iter().filter(|(_, kind)| kind.has(parameter)).map(|(name, _)| *name).collect()
    }

    /// Returns whether it needs a part on both sides.
    pub fn joins_two_parts(self) -> bool {
        matches!(self, LoopJointKind::Gear | LoopJointKind::Rack | LoopJointKind::Pulley)
    }

    /// Returns whether it has an axis.
    pub fn has_axis(self) -> bool {
        use LoopJointKind::*;
        matches!(self, Revolute | Prismatic | Cylindrical | Universal | Planar | Screw | Gear | Rack)
    }
}
