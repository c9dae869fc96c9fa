//! The console's page as an operator sees and clicks it, in Chromium.

use crate::cave_place::*;
use crate::chromium::Chromium;
use serde_json::json;
use std::time::Duration;

const SIZE: [u32; 2] = [1100, 760];

/// Clicks the middle of the button with this text, by the mouse.
fn click(page: &mut Chromium, text: &str) {
    let find = format!("[...document.querySelectorAll('button')].find((b) => b.textContent === '{text}')");
    let at = page.run(&format!(
        "(() => {{ const r = {find}.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
    ));
    for kind in ["mousePressed", "mouseReleased"] {
        page.ask(
            "Input.dispatchMouseEvent",
            json!({ "type": kind, "x": at[0], "y": at[1], "button": "left", "clickCount": 1 }),
        );
    }
}

fn says(page: &mut Chromium, text: &str) {
    page.wait_for(&format!("document.body.innerText.includes('{text}')"));
}

#[test]
fn an_operator_directs_a_run_by_its_page() {
    let place = Place::new("console-page", &cube());
    let Some(mut page) = Chromium::start("console", SIZE, &[]) else { return };
    let second = place.folder.write("second.toml", SCENE.replace("Things that fall", "The second scene"));
    let run = place.start("cave", &["--offscreen", "--console", "127.0.0.1:0", "--then", &second]);
    wait("the console", || run_info(&place.folder)["console"].is_object());
    let link = run_info(&place.folder)["console"].clone();
    let (address, token) = (link["address"].as_str().unwrap(), link["token"].as_str().unwrap());
    // without the token the page says what is missing
    page.open(&format!("http://{address}/"));
    page.wait_for("document.body.textContent.includes('open the address that the run prints')");
    page.errors.clear();
    page.open("about:blank");
    page.open(&format!("http://{address}/#{token}"));
    says(&mut page, "scene.toml in");
    // a picture of each facet arrives and is seen
    let seen = "[...document.querySelectorAll('figure img')].filter((i) => i.naturalWidth > 0).length === 4";
    page.wait_for(seen);
    page.wait_for("document.getElementById('alarms').children.length === 0");
    page.screenshot("console_running");
    click(&mut page, "Pause");
    says(&mut page, "PAUSED");
    page.screenshot("console_paused");
    click(&mut page, "Reset");
    says(&mut page, "the world is as before the first step");
    says(&mut page, "· 0.0 s ·");
    click(&mut page, "Resume");
    page.wait_for("!document.body.innerText.includes('PAUSED')");
    click(&mut page, "Record");
    says(&mut page, "recording run ");
    page.screenshot("console_recording");
    click(&mut page, "End recording");
    says(&mut page, "recorded run ");
    // patterns are drawn by the facets
    let before = page.run("document.querySelector('figure img').src");
    page.run("(() => { const s = document.getElementById('patterns'); s.value = 'name'; s.onchange(); })()");
    says(&mut page, "the facets show the pattern name");
    page.wait_for(&format!("document.querySelector('figure img').src !== {before}"));
    std::thread::sleep(Duration::from_millis(2500)); // a small picture is sent once a second
    let pattern = page.screenshot("console_pattern");
    page.run("(() => { const s = document.getElementById('patterns'); s.value = 'off'; s.onchange(); })()");
    says(&mut page, "the facets show the scene");
    // the recording is replayed, then the scene begins again
    page.run("window.prompt = (text, file) => file");
    click(&mut page, "Replay");
    says(&mut page, "REPLAY");
    page.screenshot("console_replay");
    page.wait_for("!document.body.innerText.includes('REPLAY')");
    says(&mut page, "scene.toml in");
    page.wait_for(seen);
    let scene = page.screenshot("console_after_replay");
    assert!(pattern != scene);
    page.run("window.prompt = () => '../other.mcap'");
    click(&mut page, "Replay");
    says(&mut page, "expected the name of a recording without folders");
    // the browser calls the refusal an error
    assert!(page.errors.len() == 1 && page.errors[0].contains("400"), "{:?}", page.errors);
    page.errors.clear();
    // the log has what was done, and facets of the end
    page.wait_for("document.getElementById('log').textContent.includes('console: pause: paused')");
    click(&mut page, "Next scene");
    says(&mut page, "second.toml in");
    page.screenshot("console_second");
    assert_eq!(page.errors, Vec::<String>::new());
    // a question first
    page.run("window.asked = ''; window.confirm = (text) => { window.asked = text; return true; }");
    click(&mut page, "Stop");
    let (code, _, wrong) = run.end();
    assert_eq!((code, page.run("asked")), (Some(0), "End the run?".into()), "{wrong}");
    says(&mut page, "no run");
    page.screenshot("console_ended");
}
