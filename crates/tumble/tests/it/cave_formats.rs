//! Caves from files of other programs, and finished calibration patterns, on the command line.

use crate::common::*;

#[test]
fn a_cave_goes_to_an_archive_and_back() {
    let folder = Folder::new("mpcdi");
    let (wall, archive, again) =
        (folder.write("wall.toml", cave("size_px = [80, 60]")), text(&folder.path("a.mpcdi")), text(&folder.path("b")));
    let said = succeed(&["mpcdi", &wall, "--output", &archive]);
    assert!(said.contains("(1 projectors, profile a3)"), "{said}");
    succeed(&["mpcdi", &archive, "--output", &again, "--eye", "0,-0.5,1.5"]);
    let said = succeed(&["check", &format!("{again}/cave.toml")]);
    assert!(said.contains("a cave of 1 facet on 1 screen"), "{said}");
    let written = std::fs::read_to_string(format!("{again}/cave.toml")).unwrap();
    assert!(written.contains("eye_m = [0.0, -0.5, 1.5]") && written.contains("shape = \"mesh\""), "{written}");
    // nothing is overwritten without the word for it
    let before = std::fs::read(&archive).unwrap();
    let refused = "exists already; --overwrite replaces it";
    assert!(fail(&["mpcdi", &archive, "--output", &again], 2).contains(refused));
    assert!(fail(&["mpcdi", "cube4", "--output", &archive], 2).contains(refused));
    assert!(std::fs::read(&archive).unwrap() == before);
    succeed(&["mpcdi", &archive, "--output", &again, "--overwrite"]);
    let said = succeed(&["mpcdi", "cube4", "--output", &archive, "--overwrite"]);
    assert!(said.contains("(4 projectors, profile a3)"), "{said}");
    assert!(
        fail(&["mpcdi", "panorama", "--output", &archive, "--overwrite"], 2)
            .contains("facet \"panorama\": shows directions")
    );
    std::fs::write(&archive, b"no zip").unwrap();
    let said = fail(&["mpcdi", &archive, "--output", &text(&folder.path("c"))], 2);
    assert!(said.contains("a.mpcdi: the archive: is no zip archive"), "{said}");
    assert!(fail_often(&["mpcdi", "x", "--output", "y", "--eye", "1,2"], 2).contains("expected three numbers"));
}

/// A fifth of the light: the white band of 255 becomes 124.
#[test]
fn a_finished_pattern_is_blended() {
    let folder = Folder::new("pattern-finish");
    let with = folder.write("wall.toml", cave("size_px = [80, 60]\ncolor = { white = [0.2, 1, 1] }"));
    let draw = |more: &[&str], name: &str| {
        let file = text(&folder.path(name));
        let args = ["caves", "--pattern", "blend", "--cave", &with, "--facet", "f", "--screenshot", &file];
        succeed(&[&args, more].concat());
        tumble::render::Image::read_png(&file).unwrap()
    };
    // the lowest band is full light; the right edge is outside of the caption
    assert_eq!(draw(&[], "plain.png").pixel(78, 58), Some([255, 255, 255, 255]));
    assert_eq!(draw(&["--finish"], "finished.png").pixel(78, 58), Some([124, 255, 255, 255]));
}
