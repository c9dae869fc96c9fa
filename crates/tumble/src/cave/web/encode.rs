//! Frames for one browser, as what has changed since the frame before.
//!
//! A message is a sequence of records `[kind, words, …]` of little-endian words of 32 bits, read by
//! `screen.js`. Arrays of numbers are sent by vectors of four that differ from those sent before, so a
//! body at rest costs one bit, and one that moves 48 bytes.

use crate::failure::Failure;
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble::net::browser::Backend;
use tumble::render::{
    GlslProgram, GlslTranslator, Image, MeshData, NumberFormat, PortableDraw, PortableFacet, PortableFinish,
    PortableItems, PortableKey, PortablePicture, Recipe, portable_pass_wgsl, portable_wgsl,
};

/// Maximum length of a message, bytes: what a browser can be expected to hold.
const MAX_MESSAGE_BYTES: usize = 256 << 20;

/// Kinds of records.
const SIZE: u32 = 1;
const MODULE: u32 = 2;
const PROGRAM: u32 = 3;
const MESH: u32 = 4;
const TEXTURE: u32 = 5;
const ARRAY: u32 = 6;
const DRAWS: u32 = 7;
const FORGET_MESH: u32 = 8;
const FORGET_TEXTURE: u32 = 9;
const FRAME: u32 = 10;
const SHOW: u32 = 11;
const PASSES: u32 = 12;
const NUMBERS: u32 = 13;
const EYES: u32 = 14;

/// Numbers of the arrays after those of the instances: uniform blocks.
const VIEW: u32 = 8;
const SCENE: u32 = 9;
const SHADOW_VIEW: u32 = 10;
/// Numbers of the first array of a view after the first one, and of the first uniform block of a pass.
const FIRST_OF_VIEWS: u32 = 256;
const FIRST_OF_PASSES: u32 = 1024;

/// Data that a browser has, so that only changes are sent.
pub struct Encoder {
    backend: Backend,
    /// Samples per pixel of the shaders that were sent.
    samples: Option<u32>,
    size: Vec<u32>,
    programs: Vec<PortableKey>,
    meshes: Shared<MeshData>,
    textures: Shared<Image>,
    arrays: BTreeMap<u32, Vec<u32>>,
    draws: Vec<u32>,
    /// Description of the eyes' passes as it was sent; empty for none.
    eyes: String,
    /// Whether the shaders of passes were sent.
    has_passes: bool,
    /// Warps, blends and colors that were sent; the textures of one have its index, times three.
    finishes: Vec<PortableFinish>,
}

impl Encoder {
    /// Creates an encoder for a browser that has nothing.
    pub fn new(backend: Backend) -> Encoder {
        Encoder {
            backend,
            samples: None,
            size: Vec::new(),
            programs: Vec::new(),
            meshes: Shared::default(),
            textures: Shared::default(),
            arrays: BTreeMap::new(),
            draws: Vec::new(),
            eyes: String::new(),
            has_passes: false,
            finishes: Vec::new(),
        }
    }

    /// Returns the message of a frame.
    ///
    /// # Errors
    /// A shader without a translation, or a message that no browser could hold.
    pub fn frame(&mut self, frame: u64, facet: &PortableFacet, glsl: &GlslTranslator) -> Result<Vec<u8>, Failure> {
        let (picture, mut out) = (&facet.picture, Records::default());
        self.encode_size(picture, &mut out);
        self.encode_eyes(facet, glsl, &mut out)?;
        self.encode_meshes(picture, &mut out);
        self.encode_textures(picture, &mut out);
        let arrays = picture.items.iter().zip(0..).chain([(&picture.view, VIEW), (&picture.scene, SCENE)]);
        for (floats, id) in arrays.chain(picture.shadow_views.iter().zip(SHADOW_VIEW..)) {
            self.encode_array(id, floats, &mut out);
        }
        let mut draws = vec![picture.casters.len() as u32];
        for draw in picture.casters.iter().chain(&picture.draws) {
            let program = self.program(draw.key, glsl, &mut out)?;
            draws.extend(self.draw(program, draw, picture));
        }
        if draws != self.draws {
            out.push(DRAWS, draws.iter().copied());
            self.draws = draws;
        }
        out.push(FRAME, [frame as u32, (frame >> 32) as u32]);
        out.finish()
    }

    fn encode_size(&mut self, picture: &PortablePicture, out: &mut Records) {
        let [width, height] = picture.size_px;
        let layers = picture.shadow_views.len() as u32;
        let size = vec![width, height, picture.samples, picture.shadow_map_size, layers];
        if self.samples != Some(picture.samples) {
            self.samples = Some(picture.samples);
            self.programs.clear();
            if self.backend == Backend::Webgpu {
                out.text(MODULE, &[], &portable_wgsl(picture.samples));
            }
        }
        if size != self.size {
            out.push(SIZE, size.iter().copied());
            self.size = size;
        }
    }

    /// Sends what the passes of a facet need and have not got.
    fn encode_eyes(&mut self, facet: &PortableFacet, glsl: &GlslTranslator, out: &mut Records) -> Result<(), Failure> {
        if facet.eyes.is_empty() {
            return Ok(());
        }
        if !std::mem::replace(&mut self.has_passes, true) {
            let passes = match self.backend {
                Backend::Webgpu => json!({ "wgsl": portable_pass_wgsl() }),
                Backend::Webgl2 => {
                    let pass = |is_surface| glsl.pass(is_surface).map(|glsl| program_words(&glsl));
                    let failed = |e| Failure::run("a browser", e);
                    json!({ "place": pass(false).map_err(failed)?, "surface": pass(true).map_err(failed)? })
                }
            };
            out.text(PASSES, &[], &passes.to_string());
        }
        let mut eyes = Vec::new();
        // arrays of views that were sent in this frame, by their content
        let mut sent: Vec<(&[f32], u32)> = vec![
            (&facet.picture.view, VIEW),
            (&facet.picture.items[PortableItems::Soft as usize], PortableItems::Soft as u32),
            (&facet.picture.items[PortableItems::Shells as usize], PortableItems::Shells as u32),
        ];
        for (eye, id) in facet.eyes.iter().zip(FIRST_OF_PASSES..) {
            let mut views = Vec::new();
            for (view, [x, y]) in &eye.views {
                let ids = [&view.floats, &view.soft, &view.shells].map(|array| {
                    if let Some((_, id)) = sent.iter().find(|(known, _)| known == array) {
                        return *id;
                    }
                    let id = FIRST_OF_VIEWS + sent.len() as u32;
                    sent.push((array, id));
                    self.encode_array(id, array, out);
                    id
                });
                views.push(json!({ "at": [x, y], "view": ids[0], "soft": ids[1], "shells": ids[2] }));
            }
            let pass = &eye.pass;
            self.encode_array(id, &pass.place, out);
            let numbers = pass.finish.as_ref().map_or([None; 3], |finish| self.numbers(finish, out));
            eyes.push(json!({
                "views": views, "place": id, "surface": pass.is_surface, "numbers": numbers,
                "at": pass.at_px, "size": pass.size_px, "channels": pass.channels, "source": eye.source_px,
            }));
        }
        let eyes = json!({ "whole": facet.whole_px, "exact": facet.is_interlaced, "eyes": eyes }).to_string();
        if eyes != self.eyes {
            out.text(EYES, &[], &eyes);
            self.eyes = eyes;
        }
        Ok(())
    }

    /// Returns the numbers of the textures of a finish, which are sent if they are new.
    fn numbers(&mut self, finish: &PortableFinish, out: &mut Records) -> [Option<u32>; 3] {
        let known = self.finishes.iter().position(|known| known.is_same(finish));
        let first = 3 * known.unwrap_or(self.finishes.len()) as u32;
        if known.is_none() {
            self.finishes.push(finish.clone());
            for (texture, id) in finish.textures().iter().zip(first..) {
                let Some(texture) = texture else { continue };
                let format = match texture.format {
                    NumberFormat::Rg32Float => 0,
                    NumberFormat::Rgba32Float => 1,
                    NumberFormat::Rgba16Float => 2,
                };
                let words = texture.bytes.as_chunks::<4>().0.iter().map(|&word| u32::from_le_bytes(word));
                let [width, height] = texture.size_px;
                out.push(NUMBERS, [id, format, width, height].into_iter().chain(words));
            }
        }
        let used = finish.used();
        [0, 1, 2].map(|i| used[i as usize].then_some(first + i))
    }

    fn encode_meshes(&mut self, picture: &PortablePicture, out: &mut Records) {
        self.meshes.sync(&picture.meshes, |change| match change {
            Change::Forget(id) => out.push(FORGET_MESH, [id]),
            Change::Add(id, mesh) => {
                let place = |i: usize| mesh.unwrapped.get(i).copied().unwrap_or_default();
                let corners = mesh.positions.iter().zip(&mesh.normals).enumerate();
                let floats = corners.flat_map(|(i, (p, n))| [p, n, &place(i)].map(|v| v.map(f32::to_bits)));
                let vertices: Vec<u32> = floats.flatten().collect();
                out.push(MESH, [id, vertices.len() as u32].into_iter().chain(vertices).chain(mesh.indices.clone()));
            }
        });
    }

    fn encode_textures(&mut self, picture: &PortablePicture, out: &mut Records) {
        self.textures.sync(&picture.textures, |change| match change {
            Change::Forget(id) => out.push(FORGET_TEXTURE, [id]),
            Change::Add(id, image) => {
                let pixels = image.rgba.as_chunks::<4>().0.iter().map(|&pixel| u32::from_le_bytes(pixel));
                out.push(TEXTURE, [id, image.width, image.height].into_iter().chain(pixels));
            }
        });
    }

    /// Sends the vectors of an array that have changed.
    fn encode_array(&mut self, id: u32, floats: &[f32], out: &mut Records) {
        let now: Vec<u32> = floats.iter().map(|x| x.to_bits()).collect();
        let before = self.arrays.entry(id).or_default();
        let (vectors, known) = (now.as_chunks::<4>().0, before.as_chunks::<4>().0);
        let changed = |i: usize| known.get(i) != Some(&vectors[i]);
        let mut bits = vec![0u32; vectors.len().div_ceil(32)];
        (0..vectors.len()).filter(|&i| changed(i)).for_each(|i| bits[i / 32] |= 1 << (i % 32));
        if bits.iter().any(|&word| word != 0) || vectors.len() != known.len() {
            let sent: Vec<u32> = (0..vectors.len()).filter(|&i| changed(i)).flat_map(|i| vectors[i]).collect();
            out.push(ARRAY, [id, vectors.len() as u32].into_iter().chain(bits).chain(sent));
            *before = now;
        }
    }

    /// Returns the number of a program, which is sent if it is new.
    fn program(&mut self, key: PortableKey, glsl: &GlslTranslator, out: &mut Records) -> Result<u32, Failure> {
        if let Some(known) = self.programs.iter().position(|known| *known == key) {
            return Ok(known as u32);
        }
        let recipe = recipe(&key.recipe());
        let program = match self.backend {
            Backend::Webgpu => json!({ "recipe": recipe }),
            Backend::Webgl2 => {
                let glsl = glsl.program(key).map_err(|e| Failure::run("a browser", e))?;
                let mut program = program_words(&glsl);
                program["recipe"] = recipe;
                program
            }
        };
        let id = self.programs.len() as u32;
        self.programs.push(key);
        out.text(PROGRAM, &[id], &program.to_string());
        Ok(id)
    }

    fn draw(&self, program: u32, draw: &PortableDraw, picture: &PortablePicture) -> [u32; 6] {
        let mesh = draw.mesh.map_or(0, |i| self.meshes.id(&picture.meshes[i]) + 1);
        let texture = draw.texture.map_or(0, |i| self.textures.id(&picture.textures[i]) + 1);
        [program, draw.items as u32, mesh, texture, draw.first, draw.count]
    }
}

/// Returns the message that shows a drawn frame.
pub fn show(frame: u64) -> Vec<u8> {
    let mut out = Records::default();
    out.push(SHOW, [frame as u32, (frame >> 32) as u32]);
    out.bytes()
}

fn program_words(glsl: &GlslProgram) -> serde_json::Value {
    let GlslProgram { vertex, fragment, blocks, textures } = glsl;
    json!({ "vertex": vertex, "fragment": fragment, "blocks": blocks, "textures": textures })
}

fn recipe(recipe: &Recipe) -> serde_json::Value {
    let Recipe { vs, fs, constants, samples, color, compare, write, bias, blend, cull_front, .. } = recipe;
    let Recipe { strip, vertices, mesh, floats, bounds, .. } = recipe;
    let constants: BTreeMap<_, _> = constants.iter().copied().collect();
    json!({
        "vs": vs, "fs": fs, "constants": constants, "samples": samples, "color": color, "compare": compare,
        "write": write, "bias": bias, "blend": blend, "cull_front": cull_front, "strip": strip,
        "vertices": vertices, "mesh": mesh, "floats": floats, "bounds": bounds,
    })
}

/// Shared data that a browser has, by its `Arc`.
struct Shared<T> {
    known: Vec<(Arc<T>, u32)>,
    next: u32,
}

impl<T> Default for Shared<T> {
    fn default() -> Self {
        Shared { known: Vec::new(), next: 0 }
    }
}

enum Change<'a, T> {
    Add(u32, &'a T),
    Forget(u32),
}

impl<T> Shared<T> {
    /// Makes the browser's data those of a picture.
    fn sync(&mut self, now: &[Arc<T>], mut send: impl FnMut(Change<'_, T>)) {
        self.known.retain(|(known, id)| {
            let kept = now.iter().any(|one| Arc::ptr_eq(one, known));
            if !kept {
                send(Change::Forget(*id));
            }
            kept
        });
        for one in now {
            if !self.known.iter().any(|(known, _)| Arc::ptr_eq(one, known)) {
                send(Change::Add(self.next, one));
                self.known.push((one.clone(), self.next));
                self.next += 1;
            }
        }
    }

    fn id(&self, one: &Arc<T>) -> u32 {
        self.known.iter().find(|(known, _)| Arc::ptr_eq(one, known)).map_or(0, |(_, id)| *id)
    }
}

/// Records of a message.
#[derive(Default)]
struct Records(Vec<u32>);

impl Records {
    fn push(&mut self, kind: u32, words: impl IntoIterator<Item = u32>) {
        self.0.extend([kind, 0]);
        let begin = self.0.len();
        self.0.extend(words);
        self.0[begin - 1] = (self.0.len() - begin) as u32;
    }

    fn text(&mut self, kind: u32, before: &[u32], text: &str) {
        let (words, rest) = text.as_bytes().as_chunks::<4>();
        let mut last = [0; 4];
        last[..rest.len()].copy_from_slice(rest);
        let bytes = words.iter().copied().chain((!rest.is_empty()).then_some(last)).map(u32::from_le_bytes);
        self.push(kind, before.iter().copied().chain([text.len() as u32]).chain(bytes));
    }

    fn bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    fn finish(self) -> Result<Vec<u8>, Failure> {
        let length = 4 * self.0.len();
        if length > MAX_MESSAGE_BYTES {
            let why = format!(
                "a frame of {length} bytes is more than a browser can be expected to hold ({MAX_MESSAGE_BYTES})"
            );
            return Err(Failure::run("a browser", why));
        }
        Ok(self.bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble::render::{DrawList, Light, Material};

    /// Reads the records of a message.
    fn read(bytes: &[u8]) -> Vec<(u32, Vec<u32>)> {
        let words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|&w| u32::from_le_bytes(w)).collect();
        let (mut rest, mut out) = (&words[..], Vec::new());
        while let [kind, length, more @ ..] = rest {
            let (words, after) = more.split_at(*length as usize);
            out.push((*kind, words.to_vec()));
            rest = after;
        }
        out
    }

    fn list(height: f32) -> DrawList {
        let mut list = DrawList::default();
        let mesh = list.add_mesh(MeshData::unit_box());
        list.add_instance(mesh, nalgebra::Isometry3::translation(0.0, 0.0, height), Material::matte([0.5; 3]));
        list.add_instance(mesh, nalgebra::Isometry3::translation(9.0, 0.0, 0.5), Material::matte([0.5; 3]));
        list.lights.push(Light::sun(nalgebra::Vector3::new(0.4, 0.5, -1.0), 2.5));
        list.settings.shadows = tumble::render::Shadows::Off;
        list
    }

    /// After the first frame only the moved vectors travel, and a browser that applies them has the
    /// numbers of the picture.
    #[test]
    fn a_browser_gets_what_has_changed() {
        let glsl = GlslTranslator::new().unwrap();
        let (mut encoder, mesh) = (Encoder::new(Backend::Webgl2), list(0.0).meshes[0].clone());
        let mut known: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (frame, height) in [1.0, 2.0, 2.0].into_iter().enumerate() {
            let mut list = list(height);
            list.meshes[0] = mesh.clone();
            let picture = PortablePicture::new(&list, &list.camera, [64, 48]).unwrap();
            let facet = PortableFacet { picture, whole_px: [64, 48], is_interlaced: false, eyes: Vec::new() };
            let message = encoder.frame(frame as u64, &facet, &glsl).unwrap_or_else(|e| panic!("{}", e.report()));
            let records = read(&message);
            let kinds: Vec<u32> = records.iter().map(|(kind, _)| *kind).collect();
            match frame {
                0 => assert!([SIZE, PROGRAM, MESH, ARRAY, DRAWS, FRAME].iter().all(|kind| kinds.contains(kind))),
                1 => assert!(kinds.iter().all(|kind| [ARRAY, FRAME].contains(kind)), "{kinds:?}"),
                _ => assert_eq!(kinds, [FRAME]),
            }
            for (_, words) in records.iter().filter(|(kind, _)| *kind == ARRAY) {
                let (id, count) = (words[0], words[1] as usize);
                let array = known.entry(id).or_default();
                array.resize(4 * count, 0);
                let mut changed = words[2 + count.div_ceil(32)..].chunks(4);
                for i in (0..count).filter(|i| words[2 + i / 32] >> (i % 32) & 1 == 1) {
                    array[4 * i..4 * i + 4].copy_from_slice(changed.next().unwrap());
                }
                assert_eq!(changed.next(), None);
                if frame == 1 && id == 1 {
                    // one row of one of the two bodies
                    assert_eq!(words.len(), 2 + 1 + 4);
                }
            }
            let picture = &facet.picture;
            let bits = |floats: &Vec<f32>| floats.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(known[&1], bits(&picture.items[1]));
            assert_eq!((&known[&VIEW], &known[&SCENE]), (&bits(&picture.view), &bits(&picture.scene)));
            assert_eq!(records.last().unwrap().1, [frame as u32, 0]);
        }
    }

    #[test]
    fn texts_keep_their_length() {
        for text in ["", "a", "abcd", "abcde ü"] {
            let mut out = Records::default();
            out.text(PROGRAM, &[7], text);
            let words = &read(&out.bytes())[0].1;
            let bytes: Vec<u8> = words[2..].iter().flat_map(|w| w.to_le_bytes()).collect();
            assert_eq!((words[0], &bytes[..words[1] as usize]), (7, text.as_bytes()));
        }
    }
}
