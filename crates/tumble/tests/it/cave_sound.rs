//! `--play` of a cave: a program gets the sound of the run, and one that fails ends nothing.

use crate::cave_place::*;

#[test]
fn a_program_gets_the_sound_of_a_run() {
    let place = Place::new("cave-play", &wall());
    let file = place.path("heard.raw");
    let summary =
        place.succeed("cave", &["--no-pictures", "--duration", "1", &format!("--play=dd status=none of={file}")]);
    let played = &summary["played"];
    // steps of 10 ms, one in a frame
    assert_eq!(played["frames"].as_u64().unwrap() + played["not_heard"].as_u64().unwrap(), 100, "{played}");
    assert_eq!((&played["player"], &played["left_out"]), (&"dd".into(), &0.into()));
    // two channels of 16 bits, at 48 kHz
    let heard = std::fs::read(&file).unwrap();
    assert!(heard.len().is_multiple_of(4) && heard.len() > 4 * 12_000, "{} bytes", heard.len());
    assert!(heard.iter().any(|byte| *byte != 0), "the ball arrives after 0.6 s");
    place.assert_clean();
}

#[test]
fn a_program_that_ends_does_not_end_the_run() {
    let place = Place::new("cave-play-ends", &wall());
    let summary = place.succeed("cave", &["--no-pictures", "--duration", "0.5", "--play=true"]);
    assert!(summary["played"]["not_heard"].as_u64().unwrap() > 0, "{}", summary["played"]);
    assert_eq!(summary["facets"].as_array().unwrap().iter().filter(|facet| facet["not_shown"] == 0).count(), 2);
    place.assert_clean();
}
