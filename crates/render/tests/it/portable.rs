//! Pictures as plain numbers, and the translation of the shaders.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use tumble_render::{
    DrawList, GlslTranslator, Ground, Light, Material, MeshData, PortableItems, PortablePicture, Quality, SoftSphere,
};

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
