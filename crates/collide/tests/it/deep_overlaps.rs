//! Random deep overlaps of all pairs of shapes: every contact lies at both bodies and is no deeper
//! than the two overlap along its normal, and convex bodies have the depth of the least translation.
//! `TUMBLE_SLOW=1` runs a million overlaps.

use crate::against_parry::to_parry;
use crate::rng::Rng;
use parry3d_f64::query;
use parry3d_f64::shape::{Capsule, Cuboid, Cylinder, Shape as ParryShape};
use tumble_collide::{CompoundPart, Contact, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts};

pub fn slow() -> bool {
    std::env::var_os("TUMBLE_SLOW").is_some()
}

pub fn mesh(mesh: &TriMesh) -> Shape {
    Shape::mesh(mesh.clone(), &TreeSettings::octree()).unwrap()
}

/// A prism over an L.
fn angle() -> TriMesh {
    let profile = [(0.0, 0.0), (0.6, 0.0), (0.6, 0.2), (0.2, 0.2), (0.2, 0.6), (0.0, 0.6)];
    let n = profile.len() as u32;
    let vertices = [0.0, 0.5].iter().flat_map(|&z| profile.map(|(x, y)| Vec3::new(x, y, z))).collect();
    let mut triangles = Vec::new();
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        triangles.extend([[a, c, b], [n + a, n + b, n + c]]);
    }
    for a in 0..n {
        let b = (a + 1) % n;
        triangles.extend([[a, b, n + b], [a, n + b, n + a]]);
    }
    TriMesh { vertices, triangles }
}

/// Points of a stone.
fn stone() -> Vec<Vec3> {
    let mut rng = Rng::new(3);
    (0..30).map(|_| rng.direction().component_mul(&Vec3::new(0.5, 0.4, 0.3))).collect()
}

/// A bar between a ball and a box.
fn dumbbell() -> Shape {
    let part = |shape, z| CompoundPart::new(shape, Pose::translation(0.0, 0.0, z));
    let (bar, ball) = (Shape::cylinder(0.1, 0.8).unwrap(), Shape::sphere(0.25).unwrap());
    let block = Shape::cuboid(Vec3::new(0.5, 0.4, 0.3)).unwrap();
    Shape::compound(vec![part(bar, 0.0), part(ball, 0.4), part(block, -0.4)]).unwrap()
}

pub fn shapes() -> Vec<(&'static str, Shape)> {
    let spool = [(0.0, -0.5), (0.5, -0.5), (0.2, -0.1), (0.2, 0.1), (0.5, 0.5), (0.0, 0.5)];
    vec![
        ("half-space", Shape::half_space()),
        ("sphere", Shape::sphere(0.4).unwrap()),
        ("capsule", Shape::capsule(0.25, 0.8).unwrap()),
        ("box", Shape::cuboid(Vec3::new(0.6, 0.8, 1.1)).unwrap()),
        ("plate", Shape::cuboid(Vec3::new(1.0, 1.2, 0.1)).unwrap()),
        ("cylinder", Shape::cylinder(0.4, 0.9).unwrap()),
        ("disc", Shape::cylinder(0.6, 0.12).unwrap()),
        ("rod", Shape::cylinder(0.1, 1.6).unwrap()),
        ("cube mesh", mesh(&TriMesh::cuboid(Vec3::repeat(0.8)))),
        ("sphere mesh", mesh(&TriMesh::icosphere(0.4, 2))),
        ("prism mesh", mesh(&TriMesh::cylinder(0.4, 0.8, 24))),
        ("torus mesh", mesh(&TriMesh::torus(0.4, 0.15, 24, 12))),
        ("angle mesh", mesh(&angle())),
        ("spool mesh", mesh(&TriMesh::lathe(&spool, 16).unwrap())),
        ("ellipsoid", Shape::ellipsoid(Vec3::new(0.5, 0.8, 1.1)).unwrap()),
        ("lens", Shape::ellipsoid(Vec3::new(1.2, 1.0, 0.2)).unwrap()),
        ("cone", Shape::cone(0.5, 0.8).unwrap()),
        ("needle", Shape::cone(0.1, 1.2).unwrap()),
        ("rounded box", Shape::rounded_cuboid(Vec3::new(0.6, 0.8, 1.1), 0.1).unwrap()),
        ("rounded cylinder", Shape::rounded_cylinder(0.4, 0.9, 0.1).unwrap()),
        ("hull", mesh(&TriMesh::hull_of(&stone()).unwrap())),
        ("compound", dumbbell()),
    ]
}

/// Returns the largest height of a shape along a direction of the world, m, by formula.
fn height(shape: &Shape, pose: &Pose, n: &Vec3) -> f64 {
    let local = pose.rotation.inverse() * n;
    let own = match shape {
        Shape::Sphere { radius } => *radius,
        Shape::Capsule { radius, half_length } => radius + half_length * local.z.abs(),
        Shape::Box { half_extents } => half_extents.dot(&local.abs()),
        Shape::Cylinder(c) => c.radius() * local.xy().norm() + c.half_length() * local.z.abs(),
        Shape::Ellipsoid { half_axes } => half_axes.component_mul(&local).norm(),
        Shape::Cone { radius, height } => {
            (0.75 * height * local.z).max(radius * local.xy().norm() - 0.25 * height * local.z)
        }
        Shape::RoundedBox { half_extents, rounding } => {
            (half_extents - Vec3::repeat(*rounding)).dot(&local.abs()) + rounding
        }
        Shape::RoundedCylinder { core, rounding } => {
            core.radius() * local.xy().norm() + core.half_length() * local.z.abs() + rounding
        }
        Shape::Compound(parts) => {
            return parts.placed().map(|(part, at)| height(part, &(pose * at), n)).fold(f64::NEG_INFINITY, f64::max);
        }
        Shape::Mesh(mesh) => mesh.mesh().vertices.iter().map(|v| v.dot(&local)).fold(f64::NEG_INFINITY, f64::max),
        Shape::HalfSpace if local.z > 1.0 - 1e-9 => 0.0,
        _ => f64::INFINITY,
    };
    own + n.dot(&pose.translation.vector)
}

/// Returns the translation of A along `n` that separates the two, m.
fn translation(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose, n: &Vec3) -> f64 {
    height(b, pb, n) + height(a, pa, &-n)
}

/// Feature of the contact of two hulls.
const HULLS: u64 = 5 << 56;

/// Checks that a contact is no deeper than the two overlap along its normal, and lies at both bodies:
/// midway between two surfaces, so up to half its depth outside the bounds of either. The contact of
/// two hulls, of bodies that are not convex, may be its depth away.
fn is_plausible(c: &Contact, (a, pa): (&Shape, &Pose), (b, pb): (&Shape, &Pose), margin: f64) -> Result<(), String> {
    let slack = 1e-6;
    for (shape, pose) in [(a, pa), (b, pb)] {
        let bounds = shape.aabb(pose);
        let outside = (bounds.min - c.point).sup(&(c.point - bounds.max)).max();
        let reach = if c.feature == HULLS { 1.0 } else { 0.5 };
        let near = outside <= margin + slack + reach * c.gap.abs();
        if !near {
            return Err(format!("{outside} m outside"));
        }
    }
    let most = translation(a, pa, b, pb, &c.normal);
    let valid = -c.gap <= most + slack && c.gap <= margin && (c.normal.norm() - 1.0).abs() < 1e-9;
    if !valid {
        return Err(format!("a translation by {most} m separates them"));
    }
    Ok(())
}

fn random_pair(rng: &mut Rng, a: &Shape, b: &Shape) -> [Pose; 2] {
    let reach = |shape: &Shape| if matches!(shape, Shape::HalfSpace) { 0.0 } else { shape.bounding_radius() };
    let below = rng.pose(1.0);
    let turn = match rng.below(3) {
        // aligned, nearly aligned, any
        0 => below.rotation,
        1 => below.rotation * Quat::from_scaled_axis(rng.direction() * 1e-6),
        _ => rng.pose(1.0).rotation,
    };
    let off = rng.direction() * (rng.unit() * 0.7 * (reach(a) + reach(b)));
    [Pose::from_parts((below.translation.vector + off).into(), turn), below]
}

#[test]
fn contacts_of_deep_overlaps_lie_at_both_bodies_full_length() {
    let (shapes, margin) = (shapes(), 0.01);
    let pairs: Vec<_> = (0..shapes.len()).flat_map(|i| (i.max(1)..shapes.len()).map(move |j| (i, j))).collect();
    let each = if slow() { 1_000_000 / pairs.len() + 1 } else { 200 };
    let (mut rng, mut found, mut wrong, mut count) = (Rng::new(84), Vec::new(), Vec::new(), 0);
    for (i, j) in pairs {
        let ((name_a, a), (name_b, b)) = (&shapes[j], &shapes[i]);
        for _ in 0..each {
            let [pa, pb] = random_pair(&mut rng, a, b);
            found.clear();
            contacts(a, &pa, b, &pb, margin, &mut found);
            count += found.len();
            for c in &found {
                if let Err(why) = is_plausible(c, (a, &pa), (b, &pb), margin) {
                    wrong.push(format!("{name_a} in {name_b}: {why}: {c:?}, {pa:?}, {pb:?}"));
                }
            }
        }
    }
    println!("{count} contacts, {} implausible", wrong.len());
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

/// Returns the least translation over directions on a spiral, improved locally.
pub fn least_translation(a: &Shape, pa: &Pose, b: &Shape, pb: &Pose) -> f64 {
    let count = 2000;
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let direction = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (r, phi) = ((1.0 - z * z).sqrt(), golden * i as f64);
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    let value = |n: &Vec3| translation(a, pa, b, pb, n);
    let mut tried: Vec<(f64, Vec3)> = (0..count).map(direction).map(|n| (value(&n), n)).collect();
    tried.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut least = f64::INFINITY;
    for (mut depth, mut n) in tried.into_iter().take(8) {
        let mut step = 0.05;
        while step > 1e-6 {
            let u = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
            let v = n.cross(&u);
            let around = (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
            let better = around
                .map(|phi| (n + (u * phi.cos() + v * phi.sin()) * step).normalize())
                .map(|m| (value(&m), m))
                .min_by(|x, y| x.0.total_cmp(&y.0))
                .filter(|m| m.0 < depth);
            match better {
                Some(better) => (depth, n) = better,
                None => step *= 0.5,
            }
        }
        least = least.min(depth);
    }
    least
}

/// Pairs of convex shapes of which one is round, overlapping by more than 5 % of the smaller one's
/// radius: the deepest contact is as deep as the translation along its normal, which is least. Also
/// no deeper than parry's, which is EPA.
#[test]
fn deep_curved_pairs_have_the_least_translation_full_length() {
    let shapes = shapes();
    let find = |name: &str| &shapes.iter().find(|s| s.0 == name).unwrap().1;
    let round = ["cylinder", "disc", "rod"];
    let others = ["cylinder", "disc", "rod", "capsule", "box", "plate", "cube mesh", "prism mesh"];
    let (mut rng, mut wrong, mut count) = (Rng::new(7), Vec::new(), 0);
    let mut worst = [0.0_f64; 2];
    for (name_a, name_b) in round.iter().flat_map(|a| others.map(|b| (*a, b))) {
        let (a, b) = (find(name_a), find(name_b));
        let size = a.bounding_radius().min(b.bounding_radius());
        for _ in 0..if slow() { 400 } else { 20 } {
            let [pa, pb] = random_pair(&mut rng, a, b);
            let least = least_translation(a, &pa, b, &pb);
            if least < 0.05 * size {
                continue;
            }
            let mut found = Vec::new();
            contacts(a, &pa, b, &pb, 0.01, &mut found);
            let deepest = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap));
            let (depth, along) = deepest.map_or((0.0, 0.0), |c| (-c.gap, translation(a, &pa, b, &pb, &c.normal)));
            count += 1;
            worst = [worst[0].max(along / least - 1.0), worst[1].max(1.0 - depth / along)];
            let parry = parry_depth((a, &pa), (b, &pb)).unwrap_or(f64::INFINITY);
            // parry misses some overlaps of aligned cylinders: less than the least translation
            let parry = if parry < 0.99 * least { f64::INFINITY } else { parry };
            let right = along <= 1.01 * least && depth >= 0.98 * along && depth <= 1.01 * parry + 1e-5;
            if !right {
                wrong.push(format!(
                    "{name_a} in {name_b}: {depth} deep, {along} along its normal, least {least}, parry {parry}: {pa:?}, {pb:?}"
                ));
            }
        }
    }
    println!(
        "{count} overlaps: above the least translation by up to {:.1e}, too shallow by up to {:.1e}",
        worst[0], worst[1]
    );
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

/// Returns parry's depth of two primitives.
fn parry_depth((a, pa): (&Shape, &Pose), (b, pb): (&Shape, &Pose)) -> Option<f64> {
    let upright = Quat::from_scaled_axis(Vec3::x() * std::f64::consts::FRAC_PI_2);
    let theirs = |shape: &Shape, pose: &Pose| -> Option<(Box<dyn ParryShape>, Pose)> {
        Some(match shape {
            Shape::Capsule { radius, half_length } => (Box::new(Capsule::new_z(*half_length, *radius)), *pose),
            Shape::Box { half_extents: h } => (Box::new(Cuboid::new(crate::against_parry::vector(h))), *pose),
            // parry's is along y
            Shape::Cylinder(c) => (Box::new(Cylinder::new(c.half_length(), c.radius())), pose * upright),
            _ => return None,
        })
    };
    let ((a, pa), (b, pb)) = (theirs(a, pa)?, theirs(b, pb)?);
    let contact = query::contact(&to_parry(&pa), &*a, &to_parry(&pb), &*b, 0.0).ok()??;
    Some(-contact.dist)
}

/// Returns a pose by its place and its quaternion, of which the real part is last.
fn pose(at: [f64; 3], [x, y, z, w]: [f64; 4]) -> Pose {
    Pose::from_parts(Vec3::from(at).into(), Quat::new_normalize(nalgebra::Quaternion::new(w, x, y, z)))
}

/// The side of a rod that crosses a box near its corner was overlooked: the only contact was one of
/// a rim, 0.8 mm apart.
#[test]
fn a_rod_through_a_corner_of_a_box_overlaps_it() {
    let (rod, block) = (Shape::cylinder(0.1, 1.6).unwrap(), Shape::cuboid(Vec3::new(0.6, 0.8, 1.1)).unwrap());
    let at_rod = pose(
        [0.48360638916696863, 0.06129435611964429, 1.212575056808812],
        [0.3921172790988866, -0.04050266563297842, -0.9080525149033862, 0.14157755361053756],
    );
    let at_block = pose(
        [0.5920659061159075, 0.3307108297990675, 0.8174067675326719],
        [-0.48274061328094836, -0.1500873993082567, -0.10474083426060184, 0.8564254961737249],
    );
    let mut found = Vec::new();
    contacts(&rod, &at_rod, &block, &at_block, 0.01, &mut found);
    let depth = -found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
    assert!((depth - 0.2799).abs() < 1e-3, "{depth}");
}

/// Meshes with places and quaternions of two bodies.
type Case = (&'static str, [[f64; 3]; 2], [[f64; 4]; 2]);

/// Returns the contacts of a shape with a mesh, both by name, and the two with their poses.
fn contacts_of(name: &str, (mesh, at, turns): Case) -> ([(Shape, Pose); 2], Vec<Contact>) {
    let find = |name: &str| shapes().into_iter().find(|s| s.0 == name).unwrap().1;
    let [a, b] = [0, 1].map(|k| (find([name, mesh][k]), pose(at[k], turns[k])));
    let mut found = Vec::new();
    contacts(&a.0, &a.1, &b.0, &b.1, 0.01, &mut found);
    ([a, b], found)
}

/// A needle through the middle of faces of a mesh, where no edge and no corner shows that it still
/// overlaps after it was moved: the contact was at its tip or base, as if the hull of the mesh touched
/// it, up to half a meter outside one of the two. It is midway between the two surfaces.
#[test]
fn a_needle_through_a_mesh_touches_it_where_the_mesh_is() {
    let cases: [Case; 17] = [
        (
            "torus mesh",
            [[0.910602, 1.192968, -0.483977], [0.686697, 0.669171, 0.248261]],
            [[0.264096, -0.066156, -0.900020, 0.340355], [0.264096, -0.066156, -0.900019, 0.340356]],
        ),
        (
            "torus mesh",
            [[-0.653337, 1.159785, -0.539290], [-0.894019, 0.901304, -0.071073]],
            [[-0.033933, -0.129568, -0.027199, 0.990616], [0.239777, -0.207382, 0.144823, 0.937297]],
        ),
        (
            "torus mesh",
            [[0.032862, 0.885451, 1.229663], [0.204866, 0.134192, 0.928766]],
            [[0.163330, 0.701744, -0.522895, 0.455477], [0.163330, 0.701744, -0.522894, 0.455478]],
        ),
        (
            "torus mesh",
            [[-1.228043, 0.189165, -1.026798], [-0.914833, 0.048711, -0.310566]],
            [[-0.100859, 0.391266, -0.367872, 0.837502], [-0.100858, 0.391266, -0.367873, 0.837501]],
        ),
        (
            "angle mesh",
            [[0.770772, -0.107520, 0.649751], [0.513736, -0.151394, 0.396206]],
            [[0.451321, -0.698951, -0.348473, 0.431675], [0.451321, -0.698951, -0.348473, 0.431675]],
        ),
        (
            "angle mesh",
            [[0.509573, -0.153377, 0.426377], [0.425219, 0.057479, 0.763103]],
            [[-0.097690, -0.074462, 0.055474, 0.990876], [0.064195, 0.143219, -0.057104, 0.985955]],
        ),
        (
            "angle mesh",
            [[-0.863330, -0.156271, 0.176157], [-0.607976, 0.001861, 0.229596]],
            [[-0.004868, 0.574681, 0.588635, 0.568530], [0.413257, 0.082117, -0.211399, 0.881922]],
        ),
        (
            "angle mesh",
            [[-0.046533, -0.232898, 0.075136], [-0.360064, -0.009730, -0.148290]],
            [[-0.866165, -0.274018, 0.364115, 0.205166], [-0.866165, -0.274018, 0.364115, 0.205166]],
        ),
        (
            "angle mesh",
            [[-0.555800, -0.207747, 0.388133], [-0.504408, 0.269380, 0.449995]],
            [[-0.414239, 0.180793, -0.049364, 0.890664], [0.772153, 0.271749, 0.557257, 0.139270]],
        ),
        (
            "angle mesh",
            [[0.618216, 0.686805, 0.657109], [0.591231, 0.774465, 0.499814]],
            [[-0.628802, -0.712965, -0.163461, 0.263760], [0.533409, -0.221392, 0.017156, 0.816190]],
        ),
        (
            "angle mesh",
            [[-0.760961, -0.159687, -0.118438], [-0.687526, -0.409506, 0.167532]],
            [[0.001760, -0.010856, 0.002593, 0.999936], [0.364258, 0.301244, 0.655407, 0.589075]],
        ),
        (
            "angle mesh",
            [[1.125047, 0.338918, -0.095205], [0.620716, 0.623823, -0.252852]],
            [[0.452880, -0.572517, -0.528984, 0.432782], [0.014275, 0.119509, -0.201321, 0.972103]],
        ),
        (
            "angle mesh",
            [[0.782751, -0.149907, -0.934455], [0.839333, -0.442477, -0.753305]],
            [[-0.014107, -0.012232, 0.001579, 0.999824], [0.303881, -0.059794, 0.818177, 0.484426]],
        ),
        (
            "spool mesh",
            [[-0.377597, 0.139051, 1.792620], [-0.479076, 0.510218, 0.889283]],
            [[0.575012, -0.811313, -0.005839, 0.105345], [0.575012, -0.811313, -0.005839, 0.105345]],
        ),
        (
            "spool mesh",
            [[0.393353, 0.314538, -1.422205], [0.579802, 0.152572, -0.783746]],
            [[-0.090996, -0.051443, -0.040164, 0.993710], [-0.812752, -0.424733, 0.227028, 0.327862]],
        ),
        (
            "spool mesh",
            [[-0.655406, 0.511349, -0.197746], [-0.287741, 0.683523, 0.425797]],
            [[-0.009446, -0.031171, 0.033192, 0.998918], [-0.009446, -0.031171, 0.033192, 0.998918]],
        ),
        (
            "spool mesh",
            [[-0.818884, -0.361507, 0.303836], [-0.662874, -0.636171, 0.562405]],
            [[0.957136, 0.273360, -0.069364, 0.065973], [0.957137, 0.273360, -0.069365, 0.065973]],
        ),
    ];
    for case in cases {
        let ([(a, pa), (b, pb)], found) = contacts_of("needle", case);
        assert!(!found.is_empty(), "{case:?}");
        for c in &found {
            is_plausible(c, (&a, &pa), (&b, &pb), 0.01).unwrap_or_else(|why| panic!("{case:?}: {why}"));
            for (shape, pose) in [(&a, &pa), (&b, &pb)] {
                let off = shape.closest_point(pose, &c.point).distance.abs();
                assert!(off <= 0.5 * c.gap.abs() + 1e-6, "{off} m from a surface: {c:?}, {case:?}");
            }
        }
    }
}

/// An edge of a mesh deep in a hull, below two faces that do not meet above it: its depth was that of
/// the place where the planes of these faces meet, beyond the hull, up to 2 % deeper than the hull.
#[test]
fn an_edge_in_a_hull_is_no_deeper_than_the_hull() {
    let cases: [Case; 3] = [
        (
            "torus mesh",
            [[-0.668242, -0.340307, 0.314336], [-0.359526, -0.354793, -0.302160]],
            [[-0.737565, 0.311419, -0.026727, 0.598583], [-0.737565, 0.311419, -0.026727, 0.598583]],
        ),
        (
            "angle mesh",
            [[-0.218399, 0.375542, -0.786176], [0.187199, 0.455022, -0.485488]],
            [[0.495219, 0.459637, 0.711093, 0.194523], [0.495219, 0.459637, 0.711093, 0.194523]],
        ),
        (
            "angle mesh",
            [[-0.264652, 0.051296, -0.990676], [-0.066495, -0.446411, -0.849514]],
            [[-0.274320, 0.607948, -0.594605, 0.448991], [-0.274320, 0.607948, -0.594605, 0.448991]],
        ),
    ];
    for case in cases {
        let ([(a, pa), (b, pb)], found) = contacts_of("hull", case);
        assert!(!found.is_empty(), "{case:?}");
        for c in &found {
            is_plausible(c, (&a, &pa), (&b, &pb), 0.01).unwrap_or_else(|why| panic!("{case:?}: {why}, {c:?}"));
        }
    }
}
