use std::collections::BTreeMap;
fn cpu() -> f64 { std::fs::read_to_string("/proc/thread-self/schedstat").unwrap().split(' ').next().unwrap().parse::<f64>().unwrap()*1e-6 }
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let get = |k: &str| args.iter().find_map(|a| a.strip_prefix(&format!("{k}=")).map(String::from));
    let path = &args[0];
    let mut text = std::fs::read_to_string(path).unwrap();
    for (key, sub) in [("stepper", "stepper"), ("contacts", "contacts")] {
        if let Some(v) = get(key) {
            text = text.lines().map(|l| if l.starts_with(&format!("{sub} =")) { format!("{sub} = \"{v}\"") } else { l.to_string() }).collect::<Vec<_>>().join("\n");
        }
    }
    let file = tumble_scene::SceneFile::parse(&text, path).unwrap();
    let (mut world, _) = file.build().unwrap();
    let mut seconds = file.world.seconds;
    if let Some(s) = get("seconds") { seconds = s.parse().unwrap(); }
    let frames = (seconds / world.settings().dt).round() as usize;
    let every: usize = get("every").map_or(0, |e| e.parse().unwrap());
    let from: f64 = get("from").map_or(0.0, |e| e.parse().unwrap());
    let mut times = vec![]; let mut hist: BTreeMap<u32, u32> = BTreeMap::new();
    let (mut worst, mut unconv, mut tries, mut floor, mut res, mut pen) = (0.0f64, 0, 0u64, 0, 0.0f64, 0.0f64);
    let total0 = cpu();
    for f in 0..frames {
        let t = cpu();
        let r = *world.step().unwrap();
        let ms = cpu() - t;
        times.push(ms); worst = worst.max(ms); unconv += r.unconverged; tries += r.tries as u64; floor += r.floor_hits; res = res.max(r.residual); pen = pen.max(r.max_penetration);
        *hist.entry(r.tries).or_default() += 1;
        if every > 0 && f % every == 0 && world.time() > from {
            println!("{f} t={:.4} ms={ms:.2} sub={} tries={} imp={} con={} unc={} it={} res={:.1e} pen={:.1e} floor={} ke={:.3e}", world.time(), r.substeps, r.tries, r.impact_passes, r.contacts, r.unconverged, r.iterations, r.residual, r.max_penetration, r.floor_hits, world.energy().kinetic);
        }
    }
    let total = cpu() - total0;
    let pic: Vec<f64> = times.chunks(4).map(|c| c.iter().sum()).collect();
    let mut s = pic.clone(); s.sort_by(f64::total_cmp);
    println!("{path} {:?} real-time factor {:.2}; total {:.0} ms; step worst {worst:.2} ms; picture worst {:.2} p99 {:.2} p50 {:.2}; unconverged {unconv} tries {tries} worst {} floor {floor} residual {res:.1e} pen {pen:.1e}", world.methods(), seconds*1000.0/total, total, s[s.len()-1], s[s.len()*99/100], s[s.len()/2], hist.keys().last().unwrap());
    let mut speeds: Vec<(f64, String)> = world.ids().iter().filter_map(|id| Some((world.site(*id,0)?.velocity.norm(), world.object(*id)?.name().to_string()))).collect();
    speeds.sort_by(|a,b| b.0.total_cmp(&a.0));
    println!("fastest at the end: {:?}; ke {:.2e}", &speeds[..3.min(speeds.len())], world.energy().kinetic);
}
