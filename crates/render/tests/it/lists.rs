//! Draw lists without a GPU: text form, checks, bounds.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tumble_render::{
    DebugDraw, DebugStyle, DrawList, Drawing, Ground, Image, Light, MAX_LIGHTS, Material, MeshData, MeshId, Pattern,
    Quality, RenderError, Sky, SphereCloud, Texture,
};
use tumble_scene::SceneFile;

fn sample() -> DrawList {
    let mut list = DrawList::default();
    let cube = list.add_mesh(MeshData::unit_box());
    list.add_instance(cube, Isometry3::translation(1.0, -0.00001, 0.5), Material::plastic([0.8, 0.3, 0.2]))
        .casts_shadow = false;
    list.add_sphere(Point3::new(0.0, 0.0, 0.25), 0.25, UnitQuaternion::identity(), Material::billiard_ball(11));
    let dust = vec![(Point3::new(1.0, 2.0, 3.0), 0.01), (Point3::new(0.0, 0.0, 4.0), 0.02)];
    list.clouds.push(SphereCloud { spheres: dust, colors: Vec::new(), material: Material::unlit([1.0, 0.5, 0.0]) });
    list.textures.push(std::sync::Arc::new(Image { width: 2, height: 1, rgba: vec![255; 8] }));
    let worn = Material { texture: Some(Texture { id: 0, repeat_m: 0.25 }), metallic: 1.0, ..Material::walnut() };
    list.add_capsule(Isometry3::translation(0.0, 2.0, 1.0), 0.125, 1.0, worn).casts_shadow = false;
    let square = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    let sign = list.add_mesh(
        MeshData::from_unwrapped(&square, &[[0, 1, 2]], &[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]], 0.0)
            .expect("a triangle"),
    );
    list.add_instance(
        sign,
        Isometry3::identity(),
        Material { texture: Some(Texture { id: 0, repeat_m: 1.0 }), ..Material::unlit([1.0; 3]) },
    )
    .scale
    .z = 2.0;
    list.arrow(Point3::origin(), Vector3::z(), DebugStyle::new([1.0, 0.0, 0.0]).on_top());
    list.line(Point3::origin(), Point3::new(1.0, 2.0, 3.0), DebugStyle::new([0.0, 1.0, 0.0]));
    list.point(Point3::new(0.12345678, 0.0, 0.0), DebugStyle::new([0.0, 0.0, 1.0]).width(8.0));
    list.wire_sphere(Point3::origin(), 2.0, DebugStyle::new([1.0, 1.0, 0.0]));
    list.shell(Point3::origin(), 1.0, DebugStyle::new([1.0, 1.0, 0.0]).opacity(0.25));
    list.lights.push(Light::sun(Vector3::new(0.0, 0.0, -1.0), 2.0));
    list.lights.push(Light::lamp(Point3::new(0.0, 0.0, 3.0), 1.0, 2.0));
    list.ground = Some(Ground::grid(0.0));
    "fast,reflections=off,map=512".parse::<Quality>().expect("a quality").apply(&mut list.settings);
    list.sky = Sky { backdrop: Some([0.1, 0.2, 0.3]), ..Sky::hall() };
    list
}

#[test]
fn text_form_is_stable_and_rounded() {
    let expected = "\
camera: eye (4 -4 3) target (0 0 0) up (0 0 1) fov 0.6981 near 0.05 far 500
settings: exposure 1 shadow map 512 occlusion 0 tone map true shadows hard samples 1 reflections false
sky: zenith (0.27 0.25 0.24) horizon (0.33 0.3 0.28) ground (0.22 0.19 0.17) ambient 2.4 softbox 5 backdrop (0.1 0.2 0.3)
ground: height 0 reach 60 color (0.6 0.61 0.63) rough 0.9 metal 0 coat 0 pattern grid (0.46 0.47 0.49) (1 0.02)
light 0: directional along (0 0 -1) color (1 0.97 0.92) intensity 2 radius 0.02 rad
light 1: point at (0 0 3) color (1 0.95 0.87) intensity 4 radius 0.1
mesh 0: 24 vertices 12 triangles from (-0.5 -0.5 -0.5) to (0.5 0.5 0.5)
mesh 1: 3 vertices 1 triangles from (0 0 0) to (2 2 0) unwrapped
texture 0: 2 x 1
instance 0: mesh 0 at (1 0 0.5) turned (0 0 0 1) scale (1 1 1) color (0.8 0.3 0.2) rough 0.45 metal 0 coat 0 no shadow
instance 1: mesh 1 at (0 0 0) turned (0 0 0 1) scale (1 1 2) color (1 1 1) rough 0.45 metal 0 coat 0 unlit texture 0 every 1
sphere 0: at (0 0 0.25) radius 0.25 turned (0 0 0 1) color (0.82 0.08 0.07) rough 0.25 metal 0 coat 1 pattern billiard_ball (0 0 0) (11 1)
cloud 0: 2 spheres color (1 0.5 0) rough 0.45 metal 0 coat 0 unlit
  at (1 2 3) radius 0.01
  at (0 0 4) radius 0.02
capsule 0: at (0 2 1) turned (0 0 0 1) length 1 radius 0.125 color (0.42 0.25 0.14) rough 0.5 metal 1 coat 0.2 pattern wood (0.2 0.1 0.05) (0.012 0) texture 0 every 0.25 no shadow
arrow 0: from (0 0 0) to (0 0 1) color (1 0 0) opacity 1 width 2 on top
line 1: from (0 0 0) to (1 2 3) color (0 1 0) opacity 1 width 2
point 0: at (0.1235 0 0) color (0 0 1) opacity 1 width 8
rings 0: at (0 0 0) radius 2 color (1 1 0) opacity 1 width 2
shell 1: at (0 0 0) radius 1 color (1 1 0) opacity 0.25 width 2
";
    assert_eq!(sample().to_text(), expected);
}

/// Particles are small spheres: none of 40 becomes triangles.
#[test]
fn a_flock_is_forty_cast_spheres_and_no_mesh() {
    let scene = SceneFile::parse(
        "[[grid]]\nname = \"boid\"\nshape = { type = \"sphere\", radius_m = 0.02 }\nmass_kg = 0.2\ncount = [5, 4, 2]\nspacing_m = [0.5, 0.5, 0.5]\nposition_m = [0, 0, 3]\ncentered = true\n",
        "flock.toml",
    )
    .expect("a scene");
    let list = Drawing::new(&scene).list(&scene.build().expect("a world").0, &DebugDraw::default()).expect("a list");
    assert_eq!((list.spheres.len(), list.meshes.len(), list.instances.len()), (40, 0, 0));
    // the corners of the grid, from the middle 2, 1.5 and 0.5 spacings away
    let text = list.to_text();
    for line in [
        "sphere 0: at (-1 -0.75 2.75) radius 0.02 turned (0 0 0 1)",
        "sphere 39: at (1 0.75 3.25) radius 0.02 turned (0 0 0 1)",
    ] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
}

#[test]
fn faults_are_named() {
    sample().validate().expect("the sample is good");
    let fault = |spoil: &dyn Fn(&mut DrawList)| {
        let mut list = sample();
        spoil(&mut list);
        list.validate().expect_err("spoiled").to_string()
    };
    assert!(fault(&|l| l.instances[0].mesh = MeshId(7)).starts_with("instance 0: mesh is 7"));
    assert!(fault(&|l| l.instances[0].pose.translation.x = f32::NAN).starts_with("instance 0: pose is [NaN"));
    assert!(fault(&|l| l.instances[0].scale.y = 0.0).starts_with("instance 0: scale"));
    assert!(fault(&|l| l.spheres[0].radius = -1.0).starts_with("sphere 0: radius is -1"));
    assert!(
        fault(&|l| l.spheres[0].material.roughness = 1.5).starts_with("sphere 0: roughness is 1.5, expected 0 to 1")
    );
    assert!(fault(&|l| l.spheres[0].material.color[1] = f32::INFINITY).starts_with("sphere 0: color"));
    assert!(fault(&|l| l.clouds[0].spheres[1].0.y = f32::NAN).starts_with("cloud 0: center is [0.0, NaN"));
    assert!(
        fault(&|l| l.clouds[0].spheres[0].1 = 0.0).starts_with("cloud 0: radius is 0.0, expected finite and above 0")
    );
    let texture = Some(Texture { id: 0, repeat_m: 1.0 });
    assert!(fault(&|l| l.clouds[0].material.texture = texture).starts_with("cloud 0: texture is "));
    assert!(fault(&|l| l.lines[1].end.z = f32::NAN).starts_with("line 1: end"));
    assert!(fault(&|l| l.lights[0] = Light::sun(Vector3::zeros(), 1.0)).starts_with("light 0: direction"));
    assert!(fault(&|l| l.settings.shadow_map_size = 1 << 20).starts_with("settings 0: shadow_map_size is 1048576"));
    assert!(fault(&|l| l.ground.as_mut().expect("has one").reach_m = 0.0).starts_with("ground 0: reach_m"));
    let mut crowded = sample();
    crowded.lights = vec![Light::sun(Vector3::z(), 1.0); MAX_LIGHTS + 1];
    assert!(matches!(crowded.validate(), Err(RenderError::TooMany { what: "lights", count: 9, cap: 8 })));
}

#[test]
fn bounds_follow_poses_and_scales() {
    let mut list = DrawList::default();
    assert_eq!(list.bounding_box(false), None);
    let cube = list.add_mesh(MeshData::unit_box());
    // an eighth of a turn about z: the half diagonal of the square is 1/sqrt 2, scaled by 2 along z
    let placed = list.add_instance(
        cube,
        Isometry3::new(Vector3::new(3.0, 0.0, 0.0), Vector3::z() * std::f32::consts::FRAC_PI_4),
        Material::default(),
    );
    placed.scale.z = 2.0;
    placed.casts_shadow = false;
    list.add_sphere(Point3::new(-1.0, 0.0, 0.0), 0.5, UnitQuaternion::identity(), Material::default());
    let (lo, hi) = list.bounding_box(false).expect("not empty");
    let d = 0.5f32.sqrt();
    assert!((lo - Point3::new(-1.5, -d, -1.0)).norm() < 1e-5, "{lo}");
    assert!((hi - Point3::new(3.0 + d, d, 1.0)).norm() < 1e-5, "{hi}");
    let (lo, hi) = list.bounding_box(true).expect("the sphere throws a shadow");
    assert_eq!((lo, hi), (Point3::new(-1.5, -0.5, -0.5), Point3::new(-0.5, 0.5, 0.5)));
}

#[test]
fn a_wide_floor_does_not_widen_the_framing() {
    let mut list = DrawList::default();
    list.add_sphere(Point3::new(1.0, 2.0, 3.0), 0.5, UnitQuaternion::identity(), Material::default());
    let alone = list.framing_camera(Vector3::y());
    let floor = list.add_mesh(MeshData::ground_quad(120.0));
    list.add_instance(floor, Isometry3::identity(), Material::default()).casts_shadow = false;
    assert_eq!(list.framing_camera(Vector3::y()), alone);
}

#[test]
fn a_body_that_flew_off_does_not_make_the_rest_a_dot() {
    let mut list = DrawList::default();
    for x in [0.0, 1.5, 4.0] {
        list.add_sphere(Point3::new(x, 0.0, 0.0), 0.5, UnitQuaternion::identity(), Material::default());
    }
    let before = list.framing_camera(Vector3::y());
    list.add_sphere(Point3::new(0.0, 0.0, -1e6), 0.5, UnitQuaternion::identity(), Material::default());
    assert_eq!(list.framing_camera(Vector3::y()), before);
}

#[test]
fn rings_stand_where_the_scene_says_though_the_body_turns_about_its_center_of_mass() {
    let text = "[meshes.cone]\ntype = \"lathe\"\nprofile_m = [[0, 0], [1, 0], [0, 4]]\n\
        [[body]]\nname = \"b\"\nmass_kg = 1\nshape = { type = \"mesh\", mesh = \"cone\" }\n\
        pattern = \"rings\"\npattern_offset_m = 3\npattern_scale_m = 0.5\nsecond_color = \"#ff0000\"\n";
    let scene = SceneFile::parse(text, "s.toml").expect("a right scene");
    let (world, _) = scene.build().expect("a right world");
    let list = Drawing::new(&scene).list(&world, &DebugDraw::default()).expect("a small mesh");
    // the center of mass of a cone is a quarter of its height above its base: 1 m
    let Pattern::Rings { other, from_m, to_m } = list.instances[0].material.pattern else {
        panic!("rings, not {:?}", list.instances[0].material.pattern)
    };
    assert_eq!(other, [1.0, 0.0, 0.0]);
    assert!((from_m - 2.0).abs() < 1e-6 && (to_m - 2.5).abs() < 1e-6, "{from_m} to {to_m}");
}

#[test]
fn every_preset_is_known_and_others_are_not() {
    for name in Material::PRESETS {
        let own = Material::preset(name, None).expect(name);
        assert_eq!(
            Material::preset(name, Some([0.1, 0.2, 0.3])).expect(name),
            Material { color: [0.1, 0.2, 0.3], ..own }
        );
    }
    assert_eq!(Material::preset("velvet", None), None);
}

/// A body with a camera and a lamp, one with a sphere tree, one of each detail.
const CARRIER: &str = "[camera]\neye_m = [0, -5, 2]\ntarget_m = [0, 0, 0]\n\
    [[body]]\nname = \"cart\"\nmode = \"static\"\nshape = { type = \"box\", size_m = [1, 1, 1] }\nposition_m = [2, 0, 1]\nrotation_deg = [0, 0, 90]\ndetail = \"wireframe\"\n\
    camera = { position_m = [0.5, 0, 0.5], vertical_fov_deg = 60 }\nlight = { type = \"point\", position_m = [0, 0, 1], color = \"#ff0000\", intensity = 2 }\n\
    [[body]]\nname = \"post\"\nmode = \"static\"\nshape = { type = \"cylinder\", radius_m = 0.2, length_m = 2 }\ndetail = \"simplified\"\n";

#[test]
fn bodies_carry_cameras_and_lights_with_them() {
    let scene = SceneFile::parse(CARRIER, "s.toml").unwrap_or_else(|e| panic!("{e}"));
    let (world, _) = scene.build().unwrap();
    let mut list = Drawing::new(&scene).list(&world, &DebugDraw::default()).unwrap();
    let views = list.views(&world);
    assert_eq!(views.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["scene", "cart"]);
    assert_eq!(views[0].camera, list.camera);
    // a quarter turn to the left: ahead is the world's y, and (0.5, 0, 0.5) of the cart lies at (2,
    // 0.5, 1.5)
    list.look_from(&world, "cart").unwrap();
    assert!(
        list.to_text()
            .starts_with("camera: eye (2 0.5 1.5) target (2 1.5 1.5) up (0 0 1) fov 1.0472 near 0.05 far 500\n"),
        "{}",
        list.to_text()
    );
    let lamp = list.to_text().lines().find(|l| l.contains("point at")).unwrap().to_owned();
    assert_eq!(lamp, "light 1: point at (2 0 2) color (1 0 0) intensity 3.4 radius 0.1 no shadow");
    let error = list.look_from(&world, "crat").unwrap_err().to_string();
    assert_eq!(error, "no camera is named 'crat'; expected one of scene, cart");
    let wrong =
        SceneFile::parse(&CARRIER.replace("vertical_fov_deg = 60", "vertical_fov_deg = 60, up = [1, 0, 0]"), "s.toml")
            .unwrap_err()
            .to_string();
    assert!(wrong.contains("the camera of body") && wrong.contains("looks along its `up`"), "{wrong}");
}

#[test]
fn quality_says_how_much_of_an_object_is_drawn() {
    let scene = SceneFile::parse(CARRIER, "s.toml").unwrap();
    let (world, _) = scene.build().unwrap();
    let mut drawing = Drawing::new(&scene);
    let list = drawing.list(&world, &DebugDraw::default()).unwrap();
    // the box has 12 edges; the post has one mesh, of fewer triangles than in full
    let triangles = |list: &DrawList| list.meshes.iter().map(|m| m.indices.len() / 3).sum::<usize>();
    assert_eq!((list.lines.len(), list.instances.len()), (12, 1));
    let corner = list.lines.iter().map(|l| (l.end - l.start).norm()).fold(0.0, f32::max);
    assert!((corner - 1.0).abs() < 1e-6, "edges of a cube of 1 m: {corner}");
    drawing.detail = Some("full".parse().unwrap());
    let full = drawing.list(&world, &DebugDraw::default()).unwrap();
    assert_eq!((full.lines.len(), full.instances.len()), (0, 2));
    drawing.detail = Some("simplified".parse().unwrap());
    let simple = drawing.list(&world, &DebugDraw::default()).unwrap();
    assert!(triangles(&simple) * 2 < triangles(&full), "{} of {}", triangles(&simple), triangles(&full));
    // level 0 of a tree is one sphere that contains the post: at least half its diagonal
    drawing.detail = Some("sphere_tree=0".parse().unwrap());
    let balls = drawing.list(&world, &DebugDraw::default()).unwrap();
    assert_eq!(balls.spheres.len(), 1);
    assert!(balls.spheres[0].radius >= 1.04_f32.sqrt() - 1e-4, "{}", balls.spheres[0].radius);
    assert!(
        SceneFile::parse(&CARRIER.replace("wireframe", "wirframe"), "s.toml")
            .unwrap_err()
            .to_string()
            .contains("expected full, simplified, wireframe or sphere_tree=LEVEL")
    );
    for detail in ["sphere_tree=99", "sphere_tree=64", "sphere_tree=-1", "sphere_tree="] {
        let why = SceneFile::parse(&CARRIER.replace("wireframe", detail), "s.toml").unwrap_err().to_string();
        assert!(why.contains(detail) && why.contains("sphere_tree=LEVEL, LEVEL from 0 to 63"), "{why}");
    }
    assert!("sphere_tree=63".parse::<tumble_core::Detail>().is_ok());
}

/// The checksum of a chunk of a PNG.
fn crc(bytes: &[u8]) -> u32 {
    let mut sum = u32::MAX;
    for byte in bytes {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = (sum >> 1) ^ if sum & 1 == 1 { 0xEDB8_8320 } else { 0 };
        }
    }
    !sum
}

#[test]
fn a_texture_is_listed_once_and_a_missing_one_is_reported_with_its_line() {
    let folder = std::env::temp_dir().join(format!("tumble-texture-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    tumble_render::Image { width: 2, height: 1, rgba: vec![255, 0, 0, 255, 0, 0, 255, 255] }
        .write_png(folder.join("t.png"))
        .unwrap();
    let text = "[materials.m]\ntexture = \"t.png\"\npattern_scale_m = 0.5\n[[grid]]\nname = \"b\"\nmass_kg = 1\nshape = { type = \"box\", size_m = [1, 1, 1] }\n\
        material = \"m\"\ncount = [3, 1, 1]\nspacing_m = [2, 0, 0]\n";
    let name = folder.join("s.toml").display().to_string();
    let scene = SceneFile::parse(text, &name).unwrap_or_else(|e| panic!("{e}"));
    let (world, _) = scene.build().unwrap();
    let list = Drawing::new(&scene).list(&world, &DebugDraw::default()).unwrap();
    assert!(list.to_text().contains("texture 0: 2 x 1\n"));
    assert_eq!(list.to_text().matches(" texture 0 every 0.5").count(), 3);
    list.validate().unwrap();
    let missing = SceneFile::parse(&text.replace("t.png", "u.png"), &name).unwrap_err().to_string();
    assert!(missing.contains("s.toml:2:") && missing.contains("expected a PNG file; there is none at"), "{missing}");
    // a file that is no PNG, one that is cut off, and one that is too large are refused before anything is drawn
    let whole = std::fs::read(folder.join("t.png")).unwrap();
    let mut large = whole.clone();
    large[16..20].copy_from_slice(&9000u32.to_be_bytes());
    let sum = crc(&large[12..29]).to_be_bytes();
    large[29..33].copy_from_slice(&sum);
    for (bytes, why) in [
        (&b"bark"[..], "t.png: the texture is no PNG: "),
        (&whole[..whole.len() - 6], "t.png: the texture is damaged: it has no end"),
        (&large, "t.png: the texture is 9000 x 1 pixels, and each side may have 8192"),
    ] {
        std::fs::write(folder.join("t.png"), bytes).unwrap();
        let wrong = SceneFile::parse(text, &name).unwrap_err().to_string();
        assert!(wrong.contains("s.toml:2:11:") && wrong.contains(why), "{wrong}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn islands_have_a_color_each_and_joints_their_axes() {
    // two stacks of two boxes, apart, on the floor; a pendulum
    let text = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n\
        [[grid]]\nname = \"b\"\nmass_kg = 1\nshape = { type = \"box\", size_m = [1, 1, 1] }\nposition_m = [0, 0, 0.5]\ncount = [2, 1, 2]\nspacing_m = [3, 0, 1]\n\
        [[articulated]]\nname = \"arm\"\nposition_m = [-4, 0, 3]\n[[articulated.link]]\nname = \"rod\"\njoint = \"revolute\"\naxis = [0, 1, 0]\n\
        shape = { type = \"capsule\", radius_m = 0.1, length_m = 1 }\nmass_kg = 1\n";
    let scene = SceneFile::parse(text, "s.toml").unwrap_or_else(|e| panic!("{e}"));
    let (mut world, _) = scene.build().unwrap();
    for _ in 0..5 {
        world.step().unwrap();
    }
    let draw: DebugDraw = "islands,joints,frames".parse().unwrap();
    let list = Drawing::new(&scene).list(&world, &draw).unwrap();
    let colors: Vec<_> = (1..5).map(|i| list.instances[i].material.color).collect();
    // the order of the grid: x first, then z
    assert!(colors[0] == colors[2] && colors[1] == colors[3] && colors[0] != colors[1], "{colors:?}");
    let arrows: Vec<_> = list.lines.iter().filter(|l| l.head_m > 0.0).collect();
    assert_eq!(arrows.len(), 1, "one joint");
    let along = (arrows[0].end - arrows[0].start).normalize();
    assert!((along.y.abs() - 1.0).abs() < 1e-6, "{along}");
    // three axes for each of the six parts that are drawn
    assert_eq!(list.lines.len() - 1, 18);
}

#[test]
fn static_and_moving_objects_are_distinguished() {
    let text = "[world]\nsleep_after_s = 0.1\n[[body]]\nname = \"ground\"\nmode = \"static\"\nshape = { type = \"half_space\" }\nvisible = false\n[[body]]\nname = \"lies\"\nmass_kg = 1\nshape = { type = \"box\", size_m = [1, 1, 1] }\nposition_m = [0, 0, 0.5]\n\
        [[body]]\nname = \"falls\"\nmass_kg = 1\nshape = { type = \"sphere\", radius_m = 0.5 }\nposition_m = [3, 0, 50]\n\
        [[body]]\nname = \"stands\"\nmode = \"static\"\nshape = { type = \"capsule\", radius_m = 0.5, length_m = 1 }\nposition_m = [6, 0, 1]\ncolor = \"#00ff00\"\n";
    let scene = SceneFile::parse(text, "s.toml").unwrap_or_else(|e| panic!("{e}"));
    let (mut world, _) = scene.build().unwrap();
    (0..60).for_each(|_| {
        world.step().unwrap();
    });
    let list = Drawing::new(&scene).list(&world, &"sleep".parse().unwrap()).unwrap();
    let [box_, ball, capsule] =
        [list.instances[0].material.color, list.spheres[0].material.color, list.capsules[0].material.color];
    assert!(world.asleep(world.find("lies").unwrap()));
    // blue-gray, orange, and unchanged
    assert!(
        box_[2] > box_[0] && ball[0] > 2.0 * ball[2] && capsule == [0.0, 1.0, 0.0],
        "{box_:?} {ball:?} {capsule:?}"
    );
    world.get_mut::<tumble_core::RigidBody>(world.find("lies").unwrap()).unwrap();
    let list = Drawing::new(&scene).list(&world, &"sleep".parse().unwrap()).unwrap();
    let awake = list.instances[0].material.color;
    assert!(awake[1] > awake[0] && awake[0] > awake[2], "olive when woken: {awake:?}");
}

/// A cube whose file has one corner at the origin is drawn where `position_m` puts that corner.
#[test]
fn a_mesh_is_drawn_in_the_frame_of_its_file() {
    let folder = std::env::temp_dir().join(format!("tumble-mesh-frame-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut obj = String::new();
    for v in 0..8 {
        obj += &format!("v {} {} {}\n", v & 1, v >> 1 & 1, v >> 2 & 1);
    }
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        obj += &format!("f {a} {b} {c} {d}\n");
    }
    std::fs::write(folder.join("cube.obj"), obj).expect("a file");
    let text = "[meshes.cube]\ntype = \"file\"\nfile = \"cube.obj\"\n\
        [[body]]\nname = \"cube\"\nshape = { type = \"mesh\", mesh = \"cube\" }\nmass_kg = 1\n\
        position_m = [3, -2, 5]\nrotation = { axis = [0, 0, 1], angle_deg = 90 }\n";
    let scene = SceneFile::parse(text, &folder.join("scene.toml").display().to_string()).expect("a scene");
    let (world, _) = scene.build().expect("a world");
    let id = world.find("cube").expect("the cube");
    let pose = world.pose(id, 0).expect("its pose");
    assert!((pose.translation.vector - Vector3::new(3.0, -2.0, 5.0)).norm() < 1e-14, "{pose}");
    let center = world.part_state(id, 0).expect("its site").position();
    assert!((center - Vector3::new(2.5, -1.5, 5.5)).norm() < 1e-14, "a quarter turn takes (½, ½, ½) to (-½, ½, ½)");
    let list = Drawing::new(&scene).list(&world, &DebugDraw::default()).expect("a list");
    let instance = &list.instances[0];
    let points = list.meshes[instance.mesh.0].positions.iter().map(|p| instance.pose * Point3::from(*p));
    let (low, high) = points.fold(([f32::MAX; 3], [f32::MIN; 3]), |(low, high), p| {
        ([0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k])))
    });
    let near = |a: [f32; 3], b: [f32; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-5);
    assert!(near(low, [2.0, -2.0, 5.0]) && near(high, [3.0, -1.0, 6.0]), "{low:?} {high:?}");
    std::fs::remove_dir_all(folder).expect("the folder");
}
