fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (from, to): (f64, f64) = (args[1].parse().unwrap(), args[2].parse().unwrap());
    let file = tumble_scene::SceneFile::load(&args[0]).unwrap();
    let (mut world, _) = file.build().unwrap();
    let id = world.find(&args[3]).unwrap();
    while world.time() < to {
        let r = *world.step().unwrap();
        if world.time() < from { continue; }
        let s = world.site(id, 0).unwrap();
        println!("t={:.4} it={} unc={} res={:.1e} v={:.2e} {:.2e} {:.2e} w={:.2e} {:.2e} {:.2e}", world.time(), r.iterations, r.unconverged, r.residual, s.velocity.x, s.velocity.y, s.velocity.z, s.angular_velocity.x, s.angular_velocity.y, s.angular_velocity.z);
        for c in world.contacts().iter().filter(|c| c.a == id || c.b == id) {
            println!("   {:?}", c);
        }
    }
}
