//! Every shape on every other, in both orders and both contact modes: a known overlap is a contact
//! of about that depth, and separated shapes have no contact below 0.

use tumble_collide::{
    CompoundPart, Contact, ContactMode, Pose, Quat, Shape, SphereTree, TreeSettings, TriMesh, Vec3, contacts_in_mode,
};

/// A shape whose highest and lowest points lie on its z axis, or on a flat face across it.
struct Piece {
    name: &'static str,
    shape: Shape,
    /// Height of the highest and depth of the lowest point from the origin, meters. The half-space
    /// has no lowest point.
    top: f64,
    bottom: f64,
    /// Whether the shape collides by its sphere tree in the mode `surface` too.
    only_tree: bool,
}

fn mesh(mesh: &TriMesh) -> Shape {
    Shape::mesh(mesh.clone(), &TreeSettings::octree()).unwrap()
}

fn lathe(profile: &[(f64, f64)]) -> Shape {
    mesh(&TriMesh::lathe(profile, 24).unwrap())
}

/// Returns two bars that cross at the origin, as one mesh of two overlapping shells.
fn crossed_bars() -> Shape {
    let mut bars = TriMesh::cuboid(Vec3::new(0.4, 0.4, 1.0));
    let other = TriMesh::cuboid(Vec3::new(1.0, 0.3, 0.3));
    let first = bars.vertices.len() as u32;
    bars.vertices.extend(other.vertices);
    bars.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh(&bars)
}

/// Returns two flush boxes on each other.
fn stacked_boxes() -> Shape {
    let half = |z: f64| {
        let shape = Shape::cuboid(Vec3::new(1.0, 1.0, 0.5)).unwrap();
        CompoundPart::new(shape, Pose::translation(0.0, 0.0, z))
    };
    Shape::compound(vec![half(-0.25), half(0.25)]).unwrap()
}

fn pieces() -> Vec<Piece> {
    let spool = [(0.0, -0.5), (0.5, -0.5), (0.2, -0.1), (0.2, 0.1), (0.5, 0.5), (0.0, 0.5)];
    // the sides of the waist cross each other
    let crossing = [(0.0, -0.5), (0.5, -0.5), (0.2, 0.1), (0.2, -0.1), (0.5, 0.5), (0.0, 0.5)];
    let piece = |name, shape, half| Piece { name, shape, top: half, bottom: half, only_tree: false };
    vec![
        piece("half-space", Shape::half_space(), 0.0),
        piece("sphere", Shape::sphere(0.5).unwrap(), 0.5),
        piece("capsule", Shape::capsule(0.3, 0.6).unwrap(), 0.6),
        piece("box", Shape::cuboid(Vec3::repeat(1.0)).unwrap(), 0.5),
        piece("cylinder", Shape::cylinder(0.5, 1.0).unwrap(), 0.5),
        piece("ellipsoid", Shape::ellipsoid(Vec3::new(0.7, 1.3, 1.0)).unwrap(), 0.5),
        Piece { top: 0.75, ..piece("cone", Shape::cone(0.5, 1.0).unwrap(), 0.25) },
        piece("rounded box", Shape::rounded_cuboid(Vec3::repeat(1.0), 0.1).unwrap(), 0.5),
        piece("rounded cylinder", Shape::rounded_cylinder(0.5, 1.0, 0.1).unwrap(), 0.5),
        piece("compound", stacked_boxes(), 0.5),
        piece("cube mesh", mesh(&TriMesh::cuboid(Vec3::repeat(1.0))), 0.5),
        piece("hull", Shape::convex_hull(&TriMesh::cylinder(0.4, 1.0, 9).vertices).unwrap(), 0.5),
        piece("height field", Shape::height_field(&[0.5; 12], 4, [1.2, 1.0], Some(1.0)).unwrap(), 0.5),
        piece("spool", lathe(&spool), 0.5),
        piece("crossed bars", crossed_bars(), 0.5),
        Piece { only_tree: true, ..piece("spool with a crossing", lathe(&crossing), 0.5) },
    ]
}

/// Returns the direction from `lower` to `upper`, which stands on it with this gap, and the
/// contacts of the pair in both orders, upper first. The direction lies along no axis of the world.
fn stacked(mode: ContactMode, upper: &Piece, lower: &Piece, gap: f64) -> (Vec3, [Vec<Contact>; 2]) {
    let below = Pose::from_parts(Vec3::new(0.3, -0.7, 0.2).into(), Quat::from_euler_angles(0.4, -0.9, 1.3));
    let above = below * Pose::translation(0.0, 0.0, lower.top + upper.bottom + gap);
    let [mut first, mut second] = [Vec::new(), Vec::new()];
    contacts_in_mode(mode, &upper.shape, &above, &lower.shape, &below, 0.1, &mut first);
    contacts_in_mode(mode, &lower.shape, &below, &upper.shape, &above, 0.1, &mut second);
    (below.rotation * Vec3::z(), [first, second])
}

/// A pair in one contact mode.
struct Case<'a> {
    label: String,
    mode: ContactMode,
    upper: &'a Piece,
    lower: &'a Piece,
    /// Sum of the outward errors of the sphere trees by which the pair collides, meters; 0 without
    /// trees.
    error: f64,
}

/// Returns every pair in every mode.
fn cases(pieces: &[Piece]) -> Vec<Case<'_>> {
    let mut cases = Vec::new();
    for lower in pieces {
        for upper in pieces.iter().filter(|piece| piece.name != "half-space") {
            let exact = upper.name.ends_with("cylinder") && lower.name == "half-space";
            let only_tree = upper.only_tree || lower.only_tree;
            for &(word, mode) in ContactMode::NAMES {
                let by_tree = !exact && (only_tree || mode == ContactMode::Spheres);
                let error = |piece: &Piece| piece.shape.core().0.tree().map_or(0.0, SphereTree::outward_error);
                let error = if by_tree { error(upper) + error(lower) } else { 0.0 };
                let label = format!("{} on {} in mode {word}", upper.name, lower.name);
                cases.push(Case { label, mode, upper, lower, error });
            }
        }
    }
    cases
}

fn deepest(found: &[Contact]) -> Option<&Contact> {
    found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap))
}

/// Rounding of poses and distances of about 1 m, meters.
const ROUNDING: f64 = 1e-12;

#[test]
fn every_overlap_has_a_contact_of_its_depth() {
    for Case { label, mode, upper, lower, error } in cases(&pieces()) {
        // leaf spheres tilt the normal where the other surface is curved
        let least_cosine = match error > 0.0 {
            true if lower.name == "cone" => 0.9, // its tip is between leaf spheres
            true => 0.97,
            false => 1.0 - ROUNDING,
        };
        for depth in [0.01, 0.03] {
            let (up, found) = stacked(mode, upper, lower, -depth);
            for (found, direction) in found.iter().zip([up, -up]) {
                let deepest = deepest(found).unwrap_or_else(|| panic!("{label}: no contact at a depth of {depth} m"));
                let bounds = depth - ROUNDING..depth + error + ROUNDING;
                assert!(bounds.contains(&-deepest.gap), "{label}: depth {depth}, error {error}, but {deepest:?}");
                assert!(deepest.normal.dot(&direction) > least_cosine, "{label}: {direction:?}, but {deepest:?}");
            }
        }
    }
}

#[test]
fn separated_shapes_have_no_contact_below_zero() {
    for Case { label, mode, upper, lower, error } in cases(&pieces()) {
        let gap = 0.05;
        assert!(error < gap, "{label}: the trees are too coarse for this test");
        for found in &stacked(mode, upper, lower, gap).1 {
            // the pair is within the margin
            let nearest = deepest(found).unwrap_or_else(|| panic!("{label}: no contact at a gap of {gap} m"));
            let bounds = gap - error - ROUNDING..gap + ROUNDING;
            assert!(bounds.contains(&nearest.gap), "{label}: gap {gap}, error {error}, but {nearest:?}");
        }
    }
}
