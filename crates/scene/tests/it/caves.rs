//! Cave files: values that are read, errors with their places, notes; the shipped caves.

use tumble_scene::cave::{Cave, Display, Flip, Output, Stereo, Transport, gaps, is_cave, resolve_cave, shipped_caves};

/// A cave of one screen.
pub const SMALL: &str = "
[[user]]
name = \"u\"
eye_m = [0, 0, 1.5]
[[screen]]
name = \"s\"
lower_left_m = [-1, 2, 0.5]
lower_right_m = [1, 2, 0.5]
upper_left_m = [-1, 2, 2.0]
[[facet]]
name = \"f\"
screen = \"s\"
size_px = [800, 600]
";

/// Returns the only problem of a text: its place and its message.
fn problem(text: &str) -> (usize, String) {
    let error = Cave::parse(text, "my.toml").expect_err("it is wrong");
    assert_eq!(error.problems().len(), 1, "{error}");
    (error.problems()[0].line, error.to_string())
}

#[test]
fn a_small_cave_has_its_defaults() {
    let cave = Cave::parse(SMALL, "my.toml").unwrap();
    let facet = &cave.facets[0];
    assert_eq!((facet.screen, facet.user, facet.node), (0, 0, None));
    assert_eq!((facet.stereo, facet.flip, facet.critical), (Stereo::Mono, Flip::None, true));
    assert_eq!(facet.output, Output::Window { position_px: [0, 0] });
    assert_eq!((facet.near_m, facet.far_m, facet.size_px), (0.05, 500.0, [800, 600]));
    assert_eq!(
        (cave.sync.transport, cave.sync.ready_timeout_ms, cave.users[0].interpupillary_m),
        (Transport::SharedMemory, 100, 0.063)
    );
    // 2 m x 1.5 m and 800 x 600: square pixels, one screen: no note
    assert!(cave.notes().is_empty(), "{:?}", cave.notes());
    // the right eye is 31.5 mm to the right of a user facing y
    let eye = cave.users[0].eye(1.0);
    assert!((eye.x - 0.0315).abs() < 1e-15 && eye.y == 0.0 && eye.z == 1.5);
}

#[test]
fn what_is_wrong_is_reported_with_its_place_and_the_expected_value() {
    let cases = [
        (
            "interpupillary = 0.06",
            "eye_m = [0, 0, 1.5]\ninterpupillary = 0.06",
            "eye_m = [0, 0, 1.5]",
            5,
            "unknown key `interpupillary` in user \"u\"; did you mean `interpupillary_m`?",
        ),
        ("a screen by another name", "screen = \"t\"", "screen = \"s\"", 12, "did you mean `s`?"),
        (
            "no such stereo",
            "size_px = [800, 600]\nstereo = \"side_by\"",
            "size_px = [800, 600]",
            14,
            "did you mean `side_by_side`?",
        ),
        (
            "a monitor of no window",
            "size_px = [800, 600]\noutput = \"offscreen\"\nmonitor = \"DP-1\"",
            "size_px = [800, 600]",
            10,
            "facet \"f\" is offscreen, and has a monitor",
        ),
        (
            "a rate of no display",
            "size_px = [800, 600]\nrefresh_hz = 0",
            "size_px = [800, 600]",
            14,
            "a rate from 1 to 1000 Hz",
        ),
        (
            "eyes of one eye",
            "size_px = [800, 600]\nstereo = \"left\"\nswap_eyes = true",
            "size_px = [800, 600]",
            15,
            "`swap_eyes` of facet \"f\": its image has one eye",
        ),
        ("no pixels", "size_px = [0, 600]", "size_px = [800, 600]", 13, "an integer from 1 to 16384"),
        (
            "more pixels than can be drawn",
            "size_px = [16384, 16384]",
            "size_px = [800, 600]",
            13,
            "the image with its rim of 48 pixels is 16480 x 16480",
        ),
        (
            "two eyes wider than can be drawn",
            "size_px = [9000, 100]\nstereo = \"side_by_side\"",
            "size_px = [800, 600]",
            13,
            "the image with both eyes is 18000 x 100 pixels",
        ),
        (
            "two eyes of too many pixels",
            "size_px = [5000, 4000]\nstereo = \"top_bottom\"",
            "size_px = [800, 600]",
            13,
            "the image with both eyes is 5000 x 8000 pixels",
        ),
        ("one number of pixels", "size_px = [600]", "size_px = [800, 600]", 13, "width and height in pixels"),
        (
            "not square",
            "upper_left_m = [-0.9, 2, 2.0]",
            "upper_left_m = [-1, 2, 2.0]",
            5,
            "is not square: its edges meet at 86.186 degrees",
        ),
        ("no area", "upper_left_m = [-1, 2, 0.5]", "upper_left_m = [-1, 2, 2.0]", 5, "has no area: `upper_left_m`"),
        (
            "behind",
            "eye_m = [0, 2.25, 1.5]",
            "eye_m = [0, 0, 1.5]",
            12,
            "the eye of user \"u\" is 0.250 m behind screen \"s\"",
        ),
        ("not finite", "eye_m = [0, nan, 1.5]", "eye_m = [0, 0, 1.5]", 4, "a finite number"),
        (
            "near beyond far",
            "size_px = [800, 600]\nnear_m = 9\nfar_m = 3",
            "size_px = [800, 600]",
            10,
            "`near_m` of facet \"f\" is 9 and `far_m` is 3",
        ),
        (
            "a warp by another ending",
            "size_px = [800, 600]\nwarp_file = \"a.png\"",
            "size_px = [800, 600]",
            14,
            "a file that ends in .obj or .pfm",
        ),
        (
            "along up",
            "eye_m = [0, 0, 1.5]\nforward = [0, 0, 1]",
            "eye_m = [0, 0, 1.5]",
            2,
            "`forward` of user \"u\" is parallel to its `up`",
        ),
    ];
    for (what, wrong, right, line, said) in cases {
        assert_eq!(SMALL.matches(right).count(), 1, "{what}");
        let (at, message) = problem(&SMALL.replace(right, wrong));
        assert!(at == line && message.contains(said), "{what}: line {at}, {message}");
    }
    let (line, message) = problem(&format!("{SMALL}[[facet]]\nname = \"f\"\nscreen = \"s\"\nsize_px = [8, 6]\n"));
    assert!(line == 15 && message.contains("a second facet \"f\"; the first is at line 11"), "{line}: {message}");
    let twice = format!(
        "{}[[screen]]\nname = \"s\"\nlower_left_m = [5, 2, 0.5]\nlower_right_m = [7, 2, 0.5]\nupper_left_m = [5, 2, 2]\n",
        SMALL.replace("screen = \"s\"", "screen = \"wall\"")
    );
    let said = Cave::parse(&twice, "my.toml").unwrap_err().report(false);
    assert!(said.contains("expected `s`") && !said.contains("`s` or `s`"), "a name used twice is listed once: {said}");
    let (_, message) = problem(
        "description = \"nothing\"\n[[user]]\nname = \"u\"\neye_m = [0, 0, 1]\n[[screen]]\nname = \"s\"\nlower_left_m = [0, 1, 0]\nlower_right_m = [1, 1, 0]\nupper_left_m = [0, 1, 1]\n",
    );
    assert!(message.contains("has no `facet`"), "{message}");
}

#[test]
fn swapped_corners_are_reported_as_an_eye_behind_the_screen() {
    let text = SMALL
        .replace("lower_left_m = [-1,", "lower_left_m = [1,")
        .replace("lower_right_m = [1,", "lower_right_m = [-1,")
        .replace("upper_left_m = [-1,", "upper_left_m = [1,");
    let (_, message) = problem(&text);
    assert!(message.contains("2.000 m behind") && message.contains("left and right may be swapped"), "{message}");
}

#[test]
fn nothing_leaves_the_machine_without_a_key() {
    let far = "[[node]]\nname = \"n\"\naddress = \"10.0.0.7\"\n";
    let (_, message) = problem(&format!("{SMALL}{far}"));
    assert!(message.contains("shared_memory, which works on one machine only"), "{message}");
    let (_, message) = problem(&format!("{SMALL}{far}[sync]\ntransport = \"udp\"\n"));
    assert!(message.contains("there is no [security]"), "{message}");
    let cave = Cave::parse(
        &format!("{SMALL}{far}[sync]\ntransport = \"udp\"\n[security]\nkey_file = \"wall.key\"\n"),
        "walls/my.toml",
    )
    .unwrap();
    assert_eq!(cave.security.unwrap().key_file, std::path::Path::new("walls/wall.key"));
    let (_, message) = problem(&format!("{SMALL}[[node]]\nname = \"n\"\naddress = \"10.0.0.7:99\"\n"));
    assert!(message.contains("an address without a port"), "{message}");
    let (_, message) = problem(&format!("{SMALL}[[node]]\nname = \"n\"\naddress = \"127.0.0.1\"\nport = 47100\n"));
    assert!(message.contains("unknown key `port` in node \"n\""), "nodes listen nowhere; the server does: {message}");
    assert_eq!(Cave::parse(&format!("{SMALL}[sync]\nport = 5000\n"), "my.toml").unwrap().sync.port, 5000);
}

#[test]
fn gaps_are_what_a_tape_measure_says() {
    // a second screen to the right, turned by 90 degrees, 3 mm too far back and 4 mm too far right:
    // 5 mm
    let second = "[[screen]]\nname = \"t\"\nlower_left_m = [1.004, 1.997, 0.5]\nlower_right_m = [1.004, 0, 0.5]\nupper_left_m = [1.004, 1.997, 2.0]\n";
    let cave = Cave::parse(&format!("{SMALL}{second}"), "my.toml").unwrap();
    let found = gaps(&cave.screens);
    assert_eq!(found.len(), 1);
    assert!(
        (found[0].gap_m - 0.005).abs() < 1e-12 && found[0].first == (0, 1) && found[0].second == (1, 3),
        "{found:?}"
    );
    let notes = cave.notes().join("\n");
    assert!(
        notes.contains("right edge of \"s\" and left edge of \"t\": 5.000 mm apart")
            && notes.contains("screen \"t\" has no facet"),
        "{notes}"
    );
    let wide = Cave::parse(&SMALL.replace("[800, 600]", "[1000, 600]"), "my.toml").unwrap().notes().join("\n");
    assert!(wide.contains("1.250 times denser horizontally than vertically; 1000 x 750 would be square"), "{wide}");
}

#[test]
fn a_facet_has_a_card_and_a_monitor() {
    let keys = "gpu = \"RTX\"\nmonitor = \"DP-2\"\nfull_screen = true\nrefresh_hz = 120";
    let cave = Cave::parse(&SMALL.replace("[800, 600]", &format!("[800, 600]\n{keys}")), "my.toml").unwrap();
    let Display { gpu, monitor, full_screen, refresh_hz } = cave.facets[0].display.clone();
    assert_eq!(
        (gpu.as_deref(), monitor.as_deref(), full_screen, refresh_hz),
        (Some("RTX"), Some("DP-2"), true, Some(120.0))
    );
    assert_eq!(Cave::parse(SMALL, "my.toml").unwrap().facets[0].display, Display::default());
}

#[test]
fn facets_of_a_process_share_node_and_adapter() {
    let second = "[[facet]]\nname = \"g\"\nscreen = \"s\"\nsize_px = [800, 600]\nprocess = \"walls\"";
    let with = |keys: &str| {
        let first = SMALL.replace("[800, 600]", "[800, 600]\nprocess = \"walls\"\ngpu = \"RTX\"");
        Cave::parse(&format!("{first}\n{second}\n{keys}\n"), "my.toml")
    };
    let cave = with("gpu = \"RTX\"").unwrap();
    assert!(cave.facets.iter().all(|facet| facet.process.as_deref() == Some("walls")));
    assert_eq!(Cave::parse(SMALL, "my.toml").unwrap().facets[0].process, None);
    let other_card = with("").unwrap_err().to_string();
    let place = "facet \"g\" is in the process \"walls\" of facet \"f\", which has another `gpu`";
    assert!(other_card.contains(place), "{other_card}");
    let node = "gpu = \"RTX\"\nnode = \"n\"\n[[node]]\nname = \"n\"\naddress = \"127.0.0.1\"";
    let other_node = with(node).unwrap_err().to_string();
    assert!(other_node.contains("which has another `node`"), "{other_node}");
    let wrong = SMALL.replace("[800, 600]", "[800, 600]\nprocess = \"a/b\"");
    let wrong = Cave::parse(&wrong, "my.toml").unwrap_err().to_string();
    assert!(wrong.contains("1 to 64 letters"), "{wrong}");
}

#[test]
fn eyes_have_their_order_in_each_stereo_mode() {
    let facet = |keys: &str| {
        let text = SMALL.replace("[800, 600]", &format!("[800, 600]\n{keys}"));
        Cave::parse(&text, "my.toml").unwrap().facets[0].clone()
    };
    for (keys, even, odd, whole) in [
        ("", &[0.0][..], &[0.0][..], [800, 600]),
        ("stereo = \"left\"", &[-1.0], &[-1.0], [800, 600]),
        ("stereo = \"right\"", &[1.0], &[1.0], [800, 600]),
        ("stereo = \"side_by_side\"", &[-1.0, 1.0], &[-1.0, 1.0], [1600, 600]),
        ("stereo = \"top_bottom\"\nswap_eyes = true", &[1.0, -1.0], &[1.0, -1.0], [800, 1200]),
        ("stereo = \"rows\"", &[-1.0, 1.0], &[-1.0, 1.0], [800, 600]),
        ("stereo = \"columns\"\nswap_eyes = true", &[1.0, -1.0], &[1.0, -1.0], [800, 600]),
        ("stereo = \"frame_sequential\"", &[-1.0], &[1.0], [800, 600]),
        ("stereo = \"frame_sequential\"\nswap_eyes = true", &[1.0], &[-1.0], [800, 600]),
    ] {
        let facet = facet(keys);
        assert_eq!((facet.eyes(4), facet.eyes(7), facet.whole_px()), (even, odd, whole), "{keys}");
    }
}

/// 2^25 pixels, rows padded to multiples of 64, and a margin of 48: 16288 + 96 = 16384 = 2^14
/// leaves 2^11 - 96 rows.
#[test]
fn the_largest_pictures_are_let_through_and_no_larger_ones() {
    let read = |size: &str, stereo: &str| {
        Cave::parse(&SMALL.replace("[800, 600]", &format!("{size}\nstereo = \"{stereo}\"")), "my.toml").is_ok()
    };
    for (size, larger, stereo) in [
        ("[16288, 1952]", "[16289, 1952]", "mono"),
        ("[16288, 1952]", "[16288, 1953]", "mono"),
        ("[8192, 100]", "[8193, 100]", "side_by_side"),
        ("[4096, 4096]", "[4096, 4097]", "top_bottom"),
        ("[4096, 4096]", "[4097, 4096]", "side_by_side"),
    ] {
        assert!(read(size, stereo) && !read(larger, stereo), "{size} {larger} {stereo}");
    }
}

/// Returns a cave with a second screen to the right of the first, which ends at x = 1 and is 1.5 m
/// high.
fn beside(lower_left: [f64; 3], lower_right: [f64; 3], upper_left: [f64; 3]) -> Cave {
    let second = format!(
        "[[screen]]\nname = \"t\"\nlower_left_m = {lower_left:?}\nlower_right_m = {lower_right:?}\nupper_left_m = {upper_left:?}\n[[facet]]\nname = \"g\"\nscreen = \"t\"\nsize_px = [800, 600]\n"
    );
    Cave::parse(&format!("{SMALL}{second}"), "my.toml").unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_badly_placed_screen_is_reported_as_one_without_a_neighbor() {
    // turned by 90 degrees, 0.4 m off to the right, and tilted by 8 degrees about the normal of its
    // plane: 1.5 m high, its left edge leans back to y - 1.5 sin 8
    let (sin, cos) = 8f64.to_radians().sin_cos();
    let cave =
        beside([1.4, 2.0, 0.5], [1.4, 2.0 - 2.0 * cos, 0.5 - 2.0 * sin], [1.4, 2.0 - 1.5 * sin, 0.5 + 1.5 * cos]);
    assert!(gaps(&cave.screens).is_empty());
    // the edge's upper end is 0.4 m to the right and 1.5 sin 8 = 0.2088 m nearer: 451 mm
    assert_eq!(
        cave.notes(),
        [
            "screen \"s\" has no neighbor along its right edge: the nearest, the left edge of \"t\", is 451 mm and 8.0 degrees off"
        ]
    );
    // at a distance of a meter it is another wall
    assert!(beside([2.0, 2.0, 0.5], [2.0, 0.0, 0.5], [2.0, 2.0, 2.0]).notes().is_empty());
}

#[test]
fn screens_that_cover_a_strip_twice_overlap() {
    let cave = beside([0.988, 2.0, 0.5], [2.988, 2.0, 0.5], [0.988, 2.0, 2.0]);
    assert_eq!(cave.notes(), ["right edge of \"s\" and left edge of \"t\": overlap by 12.000 mm"]);
    let cave = beside([1.012, 2.0, 0.5], [3.012, 2.0, 0.5], [1.012, 2.0, 2.0]);
    assert_eq!(cave.notes(), ["right edge of \"s\" and left edge of \"t\": 12.000 mm apart"]);
}

#[test]
fn shipped_caves_are_whole_and_found_from_anywhere() {
    // screens, facets, and pairs of edges that coincide: a cube has 12 edges, and 4 or 6 of its
    // faces share these numbers of them
    let known = [
        ("wall3", 3, 2),
        ("cube4", 4, 5),
        ("cube6", 6, 12),
        ("cylinder5", 5, 4),
        ("sphere5", 5, 4),
        ("curve", 1, 0),
        ("dome", 1, 0),
        ("panorama", 1, 0),
        ("cube_map", 1, 0),
    ];
    assert_eq!(shipped_caves().iter().map(|c| c.name).collect::<Vec<_>>(), known.map(|k| k.0));
    for (name, screens, edges) in known {
        for written in [name.to_owned(), format!("caves/{name}.toml")] {
            let cave = resolve_cave(&written).unwrap().load().unwrap_or_else(|e| panic!("{e}"));
            assert_eq!((cave.screens.len(), cave.facets.len()), (screens, screens), "{name}");
            let found = gaps(&cave.screens);
            assert_eq!(found.len(), edges, "{name}");
            assert!(found.iter().all(|gap| gap.gap_m < 1e-8), "{name}: {found:?}");
            // only those edges are noted
            assert_eq!(cave.notes().len(), edges, "{name}: {:?}", cave.notes());
        }
        assert!(!shipped_caves().iter().any(|c| c.description().is_empty()));
    }
    let error = resolve_cave("cube5").unwrap_err().to_string();
    assert!(error.contains("did you mean `cube"), "{error}");
    assert!(resolve_cave("nowhere/cube4.toml").unwrap_err().to_string().contains("cannot read the cave"));
    let error = resolve_cave("cube4").unwrap().load().unwrap().facet("floors").unwrap_err().to_string();
    assert!(error.contains("did you mean `floor`?"), "{error}");
}

#[test]
fn caves_and_scenes_are_distinguished() {
    assert!(shipped_caves().iter().all(|cave| is_cave(cave.text)));
    assert!(!tumble_scene::shipped().iter().any(|scene| is_cave(scene.text)));
    assert!(is_cave("[[screeen]]\nname = \"a\"\n") && !is_cave("[[screeen]]\n[world]\n"), "a table by nearly the name");
    assert!(is_cave("[[screen]]\nname = [[[\n") && !is_cave("") && !is_cave("[cave]\norigin_m = [0, 0, 0]\n"));
}

#[test]
fn half_a_cave_is_an_error_and_never_a_panic() {
    for cave in shipped_caves() {
        for cut in (0..cave.text.len()).step_by(37).filter(|&cut| cave.text.is_char_boundary(cut)) {
            if let Err(error) = Cave::parse(&cave.text[..cut], "cut.toml") {
                assert!(!error.report(false).is_empty());
            }
        }
    }
}
