//! probe
fn main() {
    let name = std::env::args().nth(1).unwrap();
    let scene = tumble::scene::resolve_scene(&name, &[]).unwrap().load().unwrap();
    let (mut world, _) = scene.build().unwrap();
    let n = (scene.world.seconds / scene.world.dt_s) as usize;
    for f in 0..n {
        let t = std::time::Instant::now();
        let r = *world.step().unwrap();
        let ms = t.elapsed().as_secs_f64() * 1e3;
        if r.tries > 40 || ms > 20.0 { println!("{f} ms {ms:.1} sub {} tries {} floor {} n {} passes {} res {:.1e} unc {} it {} pen {:.1e}", r.substeps, r.tries, r.floor_hits, r.contacts, r.impact_passes, r.residual, r.unconverged, r.iterations, r.max_penetration); }
    }
}
