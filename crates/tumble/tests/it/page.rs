//! The page that runs scenes in a browser (`crates/page`): Chromium steps shipped scenes in WebAssembly to the bits of this machine.

use crate::chromium::Chromium;
use crate::desktop::skip;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Makes the page by its script. Returns `None`, which is printed, if this machine has no target for it.
fn page() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("page/tumble.html");
    let made = Command::new("sh").arg(root.join("scripts/page.sh")).arg(&file).output().unwrap();
    let said = String::from_utf8_lossy(&made.stderr);
    if made.status.code() == Some(3) {
        skip(&format!("the page is not tested: {}", said.trim()));
        return None;
    }
    assert!(made.status.success(), "{said}");
    Some(file.canonicalize().unwrap())
}

/// Returns the hash of a shipped scene after a number of frames on this machine, as the page computes it.
fn native_hash(scene: &str, frames: u32) -> String {
    let file = tumble::scene::resolve_scene(scene, &[]).unwrap().load().unwrap();
    let (mut world, _) = file.build().unwrap();
    (0..frames).for_each(|_| {
        world.step().unwrap();
    });
    let bytes: Vec<u8> = world.state().iter().flat_map(|x| x.to_le_bytes()).collect();
    blake3::hash(&bytes).to_hex().to_string()
}

/// Number of pixels that differ by more than rounding.
fn changed(a: &tumble::render::Image, b: &tumble::render::Image) -> usize {
    let pixels = a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4));
    pixels.filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 8)).count()
}

#[test]
fn scenes_in_a_browser_have_the_bits_of_this_machine() {
    let Some(file) = page() else { return };
    let Some(mut browser) = Chromium::start("page", [640, 400], &[]) else { return };
    browser.open(&format!("file://{}#paused&scene=falling", file.display()));
    browser.wait_for("window.tumble.ready || window.tumble.error !== ''");
    assert_eq!(browser.run("tumble.error"), "");
    for (scene, frames) in
        [("falling", 240), ("stack", 60), ("pendulum", 60), ("robot", 60), ("cloth", 5), ("sparks", 60)]
    {
        browser.run(&format!("tumble.open('{scene}')"));
        let before = browser.screenshot(&format!("page-{scene}-0"));
        assert_eq!(
            browser.run(&format!("tumble.step({frames}) && (tumble.draw(), tumble.frame())")),
            frames,
            "{scene}"
        );
        assert_eq!(browser.run("tumble.hash()"), native_hash(scene, frames).as_str(), "{scene} after {frames} frames");
        let after = browser.screenshot(&format!("page-{scene}-{frames}"));
        let pixels = changed(&before, &after);
        let still = scene == "stack"; // at rest
        assert!(still || pixels > 200, "{scene}: {pixels} pixels have changed");
    }
    // a text that is no scene is an error with its place, and the page goes on
    browser.run("tumble.open('[world]\\ndt = 1\\n')");
    let said = browser.run("tumble.error").as_str().unwrap().to_owned();
    assert!(said.contains("scene.toml:2") && said.contains("dt_s"), "{said}");
    browser
        .run("tumble.open('[[body]]\\nname = \"a\"\\nshape = { type = \"sphere\", radius_m = 1 }\\nmass_kg = 1\\n')");
    assert_eq!(browser.run("tumble.error"), "");
    // by itself it runs in real time
    browser.run("tumble.open('falling'); tumble.playing = true");
    browser.wait_for("tumble.frame() > 30");
    assert!(browser.errors.is_empty(), "{:?}", browser.errors);
}

/// A link to a scene that does not exist, and errors after the start, are shown in the page; it goes on with the next link.
#[test]
fn a_page_shows_errors_and_goes_on() {
    let Some(file) = page() else { return };
    let Some(mut browser) = Chromium::start("page-errors", [640, 400], &[]) else { return };
    browser.open(&format!("file://{}#scene=no_such_scene", file.display()));
    browser.wait_for("window.tumble.error !== ''");
    let note = "document.getElementById('note').textContent";
    let said = browser.run(note).as_str().unwrap().to_owned();
    assert!(said.contains("no_such_scene"), "{said}");
    browser.run("location.hash = '#scene=pendulum&paused&steps=3'");
    browser.wait_for("tumble.scene !== null && tumble.scene.name === 'pendulum' && tumble.frame() === 3");
    assert_eq!(browser.run(note), "");
    assert_eq!(browser.run("document.getElementById('scene').value"), "pendulum");
    assert_eq!(browser.run("tumble.hash()"), native_hash("pendulum", 3).as_str());
    // a link that fails after one that works
    browser.run("location.hash = '#scene=pendulum&steps=many'");
    browser.wait_for("tumble.error !== ''");
    assert!(browser.run(note).as_str().unwrap().contains("`steps`"));
    browser.run("location.hash = '#scene=gone'");
    browser.wait_for("tumble.error.includes('gone')");
    browser.run("document.getElementById('play').click(), document.getElementById('one').click()");
    assert!(browser.run(note).as_str().unwrap().contains("gone"));
    browser.run("location.hash = '#scene=falling'");
    browser.wait_for("tumble.playing && tumble.frame() > 5");
    assert!(browser.errors.is_empty(), "{:?}", browser.errors);
    // an exception and a rejected promise
    for throw in ["setTimeout(() => { throw new Error('too late'); })", "Promise.reject(new Error('too late'))"] {
        browser.run("tumble.open('falling')");
        browser.run(&format!("{throw}, 0"));
        browser.wait_for("tumble.error === 'too late'");
        assert_eq!(browser.run(note), "too late");
        assert_eq!(browser.run("tumble.playing"), false);
    }
}
