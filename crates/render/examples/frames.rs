//! Frames per second on this machine, the table of docs/pictures.md: `cargo run --release -p
//! tumble-render --example frames`.
//!
//! A frame is all the work of a window after the world has moved: the draw list is made from the
//! world, checked and sent, and every facet is drawn. The picture stays on the device, as in a
//! window, and the next list is made while the device draws. The whole table takes less than five
//! minutes on two idle cores: after a warm-up frame, a row runs for `--duration S` (default 1.5)
//! and three frames, but starts none after six seconds. Other options: `--only WORDS` (rows that
//! contain the words), `--quality WORDS` (instead of the five shown), `--readback` (with the copy
//! to memory), `--stages` (the time of each row by stage), `--pictures FOLDER` (the last picture of
//! each row), `--size WxH` (pixels of a facet, 1024x768 by default), `--step THREADS` (each frame also
//! steps the world by 1/60 s on that number of threads while its list is drawn, as a window does).

use nalgebra::Vector3;
use std::time::{Duration, Instant};
use tumble_core::World;
use tumble_render::{CaveView, DebugDraw, DrawList, Drawing, Quality, RenderError, Renderer};
use tumble_scene::SceneFile;
use tumble_scene::cave::{Stereo, resolve_cave};

/// Smallest number of frames of a row, and its longest time, s.
const ENOUGH_FRAMES: u32 = 3;
const LONGEST_S: f64 = 6.0;

type Failure = Box<dyn std::error::Error>;

struct Options {
    seconds: f64,
    only: String,
    quality: Option<String>,
    readback: bool,
    stages: bool,
    pictures: Option<std::path::PathBuf>,
    size: [u32; 2],
    step: Option<u32>,
}

/// The content of a row.
struct Subject {
    name: &'static str,
    world: World,
    scene: SceneFile,
    drawing: Drawing,
}

/// The viewpoints: the scene's own camera, or a cave.
struct Facets {
    cave: Option<CaveView>,
    shown: String,
    size: [u32; 2],
}

fn main() -> Result<(), Failure> {
    let options = options()?;
    let mut renderer = Renderer::new()?;
    let adapter = renderer.adapter().to_owned();
    println!("adapter: {adapter}; {} threads", std::thread::available_parallelism().map_or(1, |n| n.get()));
    println!(
        "\n| world | facets | quality | frames per second | ms per frame | processor ms per frame |\n|---|---|---|---|---|---|"
    );
    let words: Vec<String> = match &options.quality {
        Some(words) => vec![words.clone()],
        None => ["fastest", "fastest,samples=4", "fast", "fast,samples=4", "default"].map(String::from).to_vec(),
    };
    let qualities: Vec<Quality> = words.iter().map(|words| words.parse()).collect::<Result<_, _>>()?;
    let mut summary = Vec::new();
    let (few, many) = (bodies("1,000 bodies", [25, 20, 2])?, bodies("10,000 bodies", [50, 50, 4])?);
    let mut subjects = [billiards()?, few, many, boids()?, particles()?];
    for (index, subject) in subjects.iter_mut().enumerate() {
        for count in if index < 3 { vec![1, 4, 6] } else { vec![1] } {
            let facets = facets(&subject.scene, count, options.size, Stereo::Mono)?;
            let mut cells = Vec::new();
            for quality in &qualities {
                cells.push(row(&options, &mut renderer, subject, &facets, quality)?);
            }
            if cells.iter().any(Option::is_some) {
                let shown: Vec<String> =
                    cells.iter().map(|fps| fps.map_or(String::new(), |fps| format!("{fps:.1}"))).collect();
                summary.push(format!("| {} | {count} | {} |", subject.name, shown.join(" | ")));
            }
        }
    }
    if !["Cpu", "Other"].iter().any(|kind| adapter.contains(kind)) {
        let facets = facets(&subjects[2].scene, 6, [1920, 1080], Stereo::SideBySide)?;
        for quality in &qualities {
            row(&options, &mut renderer, &mut subjects[2], &facets, quality)?;
        }
    }
    println!(
        "\nFrames per second:\n\n| world | facets | `{}` |\n|---|---|{}",
        words.join("` | `"),
        "---|".repeat(words.len())
    );
    summary.iter().for_each(|row| println!("{row}"));
    Ok(())
}

fn options() -> Result<Options, Failure> {
    let mut options = Options {
        seconds: 1.5,
        only: String::new(),
        quality: None,
        readback: false,
        stages: false,
        pictures: None,
        size: [1024, 768],
        step: None,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} wants a value"));
        match word.as_str() {
            "--duration" => options.seconds = value()?.parse()?,
            "--only" => options.only = value()?,
            "--quality" => options.quality = Some(value()?),
            "--readback" => options.readback = true,
            "--pictures" => options.pictures = Some(value()?.into()),
            "--stages" => options.stages = true,
            "--step" => options.step = Some(value()?.parse()?),
            "--size" => {
                let size = value()?;
                let (width, height) = size.split_once('x').ok_or("--size wants WxH")?;
                options.size = [width.parse()?, height.parse()?];
            }
            _ => return Err(format!("no option {word}; expected --duration S, --only WORDS, --quality WORDS, --readback, --stages, --size WxH, --step THREADS or --pictures FOLDER").into()),
        }
    }
    Ok(options)
}

/// The table before the break, from the scene's own camera.
fn billiards() -> Result<Subject, Failure> {
    let shipped = tumble_scene::shipped().iter().find(|s| s.name == "billiards").ok_or("billiards is not shipped")?;
    subject("`billiards`", shipped.read()?)
}

fn subject(name: &'static str, scene: SceneFile) -> Result<Subject, Failure> {
    Ok(Subject { name, world: scene.build()?.0, drawing: Drawing::new(&scene), scene })
}

/// A bed of spheres of 0.1 m, `nx · ny · nz` of them, that fills the picture.
fn bodies(name: &'static str, [nx, ny, nz]: [usize; 3]) -> Result<Subject, Failure> {
    let wide = 0.21 * nx as f64;
    let scene = SceneFile::parse(
        &format!(
            "[ground]\n[[light]]\ntype = \"directional\"\ndirection = [0.36, 0.48, -0.8]\n[[grid]]\nname = \"ball\"\nshape = {{ type = \"sphere\", radius_m = 0.1 }}\n\
             density_kg_per_m3 = 1000\ncount = [{nx}, {ny}, {nz}]\nspacing_m = [0.21, 0.23, 0.22]\nposition_m = [0, 0, {}]\ncentered = true\n\
             colors = [\"#c0392b\", \"#2980b9\", \"#f1c40f\", \"#27ae60\", \"#8e44ad\", \"#ecf0f1\", \"#d35400\"]\nroughness = 0.3\n\
             [camera]\neye_m = [0, {}, {}]\ntarget_m = [0, {}, 0.2]\nvertical_fov_deg = 40\n",
            0.1 + 0.11 * (nz - 1) as f64,
            // the whole bed is in the picture
            -1.35 * wide,
            0.8 * wide,
            -0.08 * wide,
        ),
        "balls.toml",
    )?;
    subject(name, scene)
}

/// A flock that fills the picture, after three seconds: as dense as that of the example `flock` of `tumble-behaviors`.
fn boids() -> Result<Subject, Failure> {
    let text = "[[flock]]\nname = \"flock\"\n[[flock.group]]\ncount = 10000\nspread_m = 40\nvelocity_m_per_s = [10, 0, 0]\n\
                [camera]\neye_m = [5, -140, -5]\ntarget_m = [5, 0, -5]\nvertical_fov_deg = 40\n";
    let mut subject = subject("10,000 boids", SceneFile::parse(text, "boids.toml")?)?;
    let settings = subject.world.settings().with_dt(1.0 / 60.0);
    subject.world.set_settings(settings)?;
    for _ in 0..180 {
        subject.world.step()?;
    }
    Ok(subject)
}

/// Sparks in a ball above the ground.
fn particles() -> Result<Subject, Failure> {
    let text = "[ground]\n[[particle_system]]\nname = \"sparks\"\ncapacity = 100000\n[[particle_system.emitter]]\nburst = 100000\n\
                position_m = [0, 0, 3]\nspeed_m_per_s = [0.5, 4]\nhalf_angle_deg = 180\nlifetime_s = 10\n\
                [camera]\neye_m = [0, -8, 2.5]\ntarget_m = [0, 0, 2.5]\nvertical_fov_deg = 40\n";
    let mut subject = subject("100,000 particles", SceneFile::parse(text, "sparks.toml")?)?;
    for _ in 0..120 {
        subject.world.step()?;
    }
    Ok(subject)
}

/// One cell: frames per second, or none if it was not requested.
fn row(
    options: &Options,
    renderer: &mut Renderer,
    subject: &mut Subject,
    facets: &Facets,
    quality: &Quality,
) -> Result<Option<f64>, Failure> {
    let label = format!("{} | {} | {quality}", subject.name, facets.shown);
    if !label.contains(&options.only) {
        return Ok(None);
    }
    if let Some(threads) = options.step {
        let settings = subject.world.settings().with_dt(1.0 / 60.0).with_threads(threads);
        subject.world.set_settings(settings)?;
    }
    let mut stages = [Duration::ZERO; 3];
    let mut frame = |renderer: &mut Renderer| -> Result<(), Failure> {
        let begin = Instant::now();
        let mut list = subject.drawing.list(&subject.world, &DebugDraw::default())?;
        quality.apply(&mut list.settings);
        stages[0] += begin.elapsed();
        let (world, steps) = (&mut subject.world, options.step.is_some());
        let (stepped, drawn) = std::thread::scope(|scope| {
            let stepping = scope.spawn(move || {
                let begin = Instant::now();
                (if steps { world.step().map(|_| ()) } else { Ok(()) }, begin.elapsed())
            });
            let begin = Instant::now();
            let drawn = draw(renderer, &list, facets, options.readback);
            stages[1] += begin.elapsed();
            (stepping.join(), drawn)
        });
        drawn?;
        let (stepped, took) = stepped.map_err(|_| "the step panicked")?;
        stages[2] += took;
        Ok(stepped?)
    };
    // the first frame creates the pipelines
    frame(renderer)?;
    renderer.wait()?;
    if let Some(folder) = &options.pictures {
        let name = label.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        renderer.read()?.write_png(folder.join(format!("{name}.png")))?;
    }
    let (begin, spent) = (Instant::now(), processor_s());
    let mut frames = 0;
    while frames < 1 || begin.elapsed().as_secs_f64() < if frames < ENOUGH_FRAMES { LONGEST_S } else { options.seconds }
    {
        frame(renderer)?;
        frames += 1;
    }
    renderer.wait()?;
    let each = begin.elapsed().as_secs_f64() / f64::from(frames);
    let processor = 1e3 * (processor_s() - spent) / f64::from(frames);
    println!("| {label} | {:.1} | {:.1} | {processor:.0} |", 1.0 / each, 1e3 * each);
    if options.stages {
        let ms = |d: Duration| 1e3 * d.as_secs_f64() / f64::from(frames + 1);
        println!("  step {:.2} ms, list {:.2} ms, picture {:.2} ms", ms(stages[2]), ms(stages[0]), ms(stages[1]));
    }
    Ok(Some(1.0 / each))
}

fn draw(renderer: &mut Renderer, list: &DrawList, facets: &Facets, readback: bool) -> Result<(), RenderError> {
    match &facets.cave {
        None => renderer.draw(&list.camera, list, facets.size[0], facets.size[1])?,
        Some(cave) => {
            let stage = renderer.stage(list)?;
            for facet in &cave.cave().facets {
                cave.draw_on_device(renderer, &stage, facet)?;
                if readback {
                    renderer.read()?;
                }
            }
        }
    }
    if readback && facets.cave.is_none() {
        renderer.read()?;
    }
    renderer.end_frame(1)
}

/// The scene's camera, or a cube around the middle of the scene.
fn facets(scene: &SceneFile, count: usize, size: [u32; 2], stereo: Stereo) -> Result<Facets, Failure> {
    let shown = if stereo == Stereo::Mono {
        format!("{count}")
    } else {
        format!("{count} of {} x {} in stereo", size[0], size[1])
    };
    if count == 1 {
        return Ok(Facets { cave: None, shown, size });
    }
    let mut cave = resolve_cave(if count == 4 { "cube4" } else { "cube6" })?.load()?;
    cave.facets.iter_mut().for_each(|facet| (facet.size_px, facet.stereo) = (size, stereo));
    let mut scene = scene.clone();
    let eye: Vector3<f64> = cave.users[0].eye_m.coords;
    scene.cave =
        Some(tumble_scene::CavePlace { origin_m: [-eye.x, -eye.y, 1.2 - eye.z], heading_deg: 0.0, scale: 1.0 });
    Ok(Facets { cave: Some(CaveView::new(cave, &scene)?), shown, size })
}

/// Processor time of this process so far, all threads, s. With a software driver it is the cost of
/// a frame, however busy the machine is. 0 if the system does not report it.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or("");
    after_name.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
