
use crate::against_parry::{to_parry, vector};
use crate::rng::Rng;
use crate::shared_meshes::text;
use parry3d_f64::query;
use parry3d_f64::shape::TriMesh as P;
use std::time::Instant;
use tumble_collide::*;
#[test]
fn debug_speed() {
    let m = TriMesh::from_obj(&text("bunny.obj").unwrap()).unwrap();
    let s = 1.0 / m.diagonal();
    let t0 = Instant::now();
    let (shape, _) = Shape::mesh(m.scaled(s), &TreeSettings { depth: 3, ..Default::default() }).unwrap();
    println!("build {:?}", t0.elapsed());
    let Shape::Mesh(ms) = &shape else { return };
    let p = P::new(ms.mesh().vertices.iter().map(vector).collect(), ms.mesh().triangles.clone()).unwrap();
    let mut rng = Rng::new(1);
    let mut poses = vec![];
    while poses.len() < 40 {
        let (mut a, b) = (rng.pose(0.3), rng.pose(0.3));
        let way = rng.direction();
        a.translation.vector = b.translation.vector + way * 3.0;
        for _ in 0..12 {
            let d = query::distance(&to_parry(&a), &p, &to_parry(&b), &p).unwrap().distance;
            a.translation.vector -= way * d;
        }
        a.translation.vector -= way * 1e-3;
        poses.push((a, b));
    }
    let mut out = vec![];
    for mode in [ContactMode::Surface, ContactMode::Spheres] {
        for margin in [2e-4, 1e-2] {
        let mut n = 0;
        let t = Instant::now();
        for _ in 0..20 { for (a, b) in &poses { out.clear(); contacts_in(mode, &shape, a, &shape, b, margin, &mut out); n += out.len(); } }
        println!("{mode:?} margin {margin}: {:.1} us, {:.1} contacts", t.elapsed().as_secs_f64() * 1e6 / 800.0, n as f64 / 800.0);
        }
    }
    let t = Instant::now();
    for (a, b) in &poses { let _ = query::distance(&to_parry(a), &p, &to_parry(b), &p); }
    println!("parry distance {:.1} us", t.elapsed().as_secs_f64() * 1e6 / 40.0);
    let t = Instant::now();
    for (a, b) in &poses { let _ = query::contact(&to_parry(a), &p, &to_parry(b), &p, 2e-4); }
    println!("parry contact {:.1} us", t.elapsed().as_secs_f64() * 1e6 / 40.0);
}
