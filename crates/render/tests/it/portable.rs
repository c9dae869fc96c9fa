//! Pictures as plain numbers, and the translation of the shaders.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use tumble_render::{
    CaveView, DrawList, GlslTranslator, Ground, Light, Material, MeshData, NumberFormat, PortableItems,
    PortablePicture, Quality, SoftSphere,
};
use tumble_scene::SceneFile;
use tumble_scene::cave::{Facet, Stereo, resolve_cave};

/// A list with every kind of item in every surface that presets have.
fn list() -> DrawList {
    let mut list = DrawList::default();
    let cube = list.add_mesh(MeshData::unit_box());
    for (k, name) in Material::PRESETS.iter().enumerate() {
        let material = Material::preset(name, None).unwrap();
        let at = Vector3::new(k as f32, 0.0, 0.5);
        list.add_instance(cube, Isometry3::from_parts(at.into(), UnitQuaternion::identity()), material);
        list.add_sphere(Point3::new(k as f32, 2.0, 0.5), 0.4, UnitQuaternion::identity(), material);
        list.add_capsule(Isometry3::translation(k as f32, 4.0, 0.5), 0.2, 0.4, material);
        let center = Point3::new(k as f32, 6.0, 0.5);
        let (color, shader) = (material.color, material.shader);
        list.soft_spheres.push(SoftSphere { center, radius: 0.4, color, opacity: 0.5, shader });
    }
    list.ground = Some(Ground::grid(0.0));
    list.lights.push(Light::sun(Vector3::new(0.4, 0.5, -1.0), 2.5));
    list.lights.push(Light::lamp(Point3::new(3.0, 3.0, 6.0), 1.0, 3.0));
    list.camera = list.framing_camera(Vector3::new(-1.0, 1.5, -0.8));
    list
}

/// Every program of lists in all qualities has a translation that naga's own reader of GLSL would not
/// judge; browsers do, in the tests of the command. Here: version, entry, and names of what is bound.
#[test]
fn all_programs_translate_to_glsl_for_browsers() {
    let translator = GlslTranslator::new().unwrap();
    let mut keys = BTreeSet::new();
    for quality in ["default", "fast", "fastest", "fast,samples=4", "default,shadows=off,reflections=off"] {
        let mut list = list();
        quality.parse::<Quality>().unwrap().apply(&mut list.settings);
        let picture = PortablePicture::new(&list, &list.camera, [320, 240]).unwrap();
        keys.extend(picture.draws.iter().chain(&picture.casters).map(|draw| draw.key));
    }
    assert!(keys.len() > 60, "{}", keys.len());
    for key in keys {
        let (program, recipe) = (translator.program(key).unwrap(), key.recipe());
        for stage in [&program.vertex, &program.fragment] {
            assert!(stage.starts_with("#version 300 es") && stage.contains("void main()"), "{stage}");
        }
        assert!(!recipe.vs.is_empty() && recipe.fs != Some(""));
        assert!(program.blocks.values().all(|name| ["view", "scene"].contains(&name.as_str())), "{:?}", program.blocks);
        let known = ["shadow_maps", "shadow_depths", "occlusion", "albedo"];
        assert!(program.textures.values().all(|name| known.contains(&name.as_str())), "{:?}", program.textures);
    }
}

/// The passes that put eyes into the whole, for flat and for curved screens.
#[test]
fn passes_translate_to_glsl_for_browsers() {
    let translator = GlslTranslator::new().unwrap();
    for is_surface in [false, true] {
        let program = translator.pass(is_surface).unwrap();
        let texts = [&program.vertex, &program.fragment];
        assert!(texts.iter().all(|stage| stage.starts_with("#version 300 es") && stage.contains("void main()")));
        assert_eq!(program.blocks.values().collect::<Vec<_>>(), ["place"]);
        let names: BTreeSet<&str> = program.textures.values().map(String::as_str).collect();
        assert_eq!(names, ["shares", "source", "table", "warp"].into());
    }
}

#[test]
fn a_facet_has_views_and_a_pass_for_each_eye() {
    let (list, scene) = (list(), SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "my.toml").unwrap());
    let portable = |name: &str, change: &dyn Fn(&mut Facet)| {
        let mut cave = resolve_cave(name).unwrap().load().unwrap();
        cave.facets[0].size_px = [96, 96];
        change(&mut cave.facets[0]);
        let view = CaveView::new(cave, &scene).unwrap();
        let facet = view.cave().facets[0].clone();
        (view.portable(&list, &facet).unwrap(), view, facet)
    };
    // a picture that is the whole is drawn as before
    let (plain, view, facet) = portable("cube4", &|facet| facet.stereo = Stereo::Mono);
    let picture = PortablePicture::new(&list, &view.eye(&facet, 0.0).unwrap().part(96, 96, 0), [96, 96]).unwrap();
    assert!(plain.eyes.is_empty() && plain.picture.view == picture.view && plain.picture.items == picture.items);
    assert_eq!(plain.whole_px, [96, 96]);
    let (rows, ..) = portable("cube4", &|facet| facet.stereo = Stereo::Rows);
    assert_eq!((rows.eyes.len(), rows.whole_px, rows.is_interlaced), (2, [96, 96], true));
    for (i, eye) in rows.eyes.iter().enumerate() {
        assert_eq!((eye.views.len(), eye.source_px, eye.pass.is_surface), (1, [96, 96], false));
        // (0 x + 1 y) mod 2 is the number of the eye
        assert_eq!(eye.pass.place[13..16], [0.0, 1.0, i as f32]);
        assert!(eye.pass.finish.is_none() && eye.pass.place.len() == 24);
    }
    assert_ne!(rows.eyes[0].views[0].0.floats, rows.eyes[1].views[0].0.floats);
    let (dome, ..) = portable("dome", &|facet| facet.stereo = Stereo::SideBySide);
    assert_eq!((dome.eyes.len(), dome.whole_px, dome.is_interlaced), (2, [192, 96], false));
    for (eye, at) in dome.eyes.iter().zip([[0, 0], [96, 0]]) {
        let (pass, side) = (&eye.pass, eye.source_px[0] / 3);
        assert!((4..=6).contains(&eye.views.len()) && eye.source_px == [3 * side, 2 * side], "{:?}", eye.source_px);
        // each face at a place of its own, and with the same order of soft spheres
        let places: BTreeSet<[u32; 2]> = eye.views.iter().map(|(_, at)| at.map(|x| x / side)).collect();
        assert_eq!(places.len(), eye.views.len());
        assert!(eye.views.iter().all(|(view, _)| view.soft == eye.views[0].0.soft));
        assert_eq!((pass.is_surface, pass.at_px, pass.size_px), (true, at, [96, 96]));
        let finish = pass.finish.as_ref().unwrap();
        let [shown, shares, table] = finish.textures();
        let shown = shown.unwrap();
        assert_eq!(
            (shown.size_px, shown.format, shown.bytes.len()),
            ([96, 96], NumberFormat::Rgba32Float, 96 * 96 * 16)
        );
        assert!(shares.is_none() && table.is_none() && finish.used() == [true, false, false]);
        assert!(finish.is_same(dome.eyes[0].pass.finish.as_ref().unwrap()));
    }
}

#[test]
fn all_items_of_a_list_are_drawn_once() {
    let list = list();
    let picture = PortablePicture::new(&list, &list.camera, [320, 240]).unwrap();
    let drawn = |items| picture.draws.iter().filter(|d| d.items == items).map(|d| d.count as usize).sum::<usize>();
    let floats = |items: PortableItems| picture.items[items as usize].len();
    for (items, count, each) in [
        (PortableItems::Meshes, list.instances.len(), 24),
        (PortableItems::Spheres, list.spheres.len(), 20),
        (PortableItems::Capsules, list.capsules.len(), 24),
        (PortableItems::Ground, 1, 24),
        (PortableItems::Soft, list.soft_spheres.len(), 20),
    ] {
        assert_eq!((drawn(items), floats(items)), (count, count * each), "{items:?}");
    }
    let cast: u32 = picture.casters.iter().map(|draw| draw.count).sum();
    assert_eq!(cast as usize, list.instances.len() + list.spheres.len() + list.capsules.len());
    assert_eq!(picture.view.len(), 16 + 24 + 16);
    assert!(
        picture.shadow_views.iter().all(|view| view.len() == picture.view.len()) && picture.shadow_views.len() == 2
    );
}
