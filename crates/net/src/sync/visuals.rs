//! Visuals of objects that the scene file does not have, as bytes: shapes, poses and appearances.
//!
//! A mesh that the scene file draws anywhere is sent as a reference (object and index of the
//! visual). Any other mesh is sent whole, once per snapshot and object. It is only drawn by the
//! receiver, so it need not be closed.

use super::viewer::{exact_pose, put_exact_pose};
use super::wire::{ByteReader, MessageError, put_f64, put_name};
use std::sync::Arc;
use tumble_collide::{Shape, TriMesh, Vec3};
use tumble_core::{Appearance, Drawn, PartSurface, Visual, VisualGeometry, VisualMesh, World};

/// Maximum number of visuals of one object.
pub const MAX_VISUALS: usize = 4096;
/// Maximum number of properties of an appearance.
const MAX_PROPERTIES: usize = 64;
/// Maximum length of the name of a shader or property, bytes.
const MAX_TEXT: usize = 255;

/// Appends the visuals. `base` is the world as the scene file makes it.
pub(crate) fn put_visuals(out: &mut Vec<u8>, visuals: &[Visual], base: &World) {
    let drawn: Vec<(&Visual, Drawn<'_>)> =
        visuals.iter().filter_map(|visual| Some((visual, visual.drawn()?))).take(MAX_VISUALS).collect();
    out.extend((drawn.len() as u32).to_le_bytes());
    for (visual, drawn) in drawn {
        out.extend((visual.part as u32).to_le_bytes());
        put_exact_pose(out, &visual.pose);
        put_geometry(out, drawn, base);
        put_appearance(out, &visual.appearance);
    }
}

fn put_geometry(out: &mut Vec<u8>, drawn: Drawn<'_>, base: &World) {
    let shape = match drawn {
        Drawn::Mesh(mesh) => {
            return put_triangles(
                out,
                mesh,
                place_of(
                    base,
                    |other| matches!(other, VisualGeometry::Mesh(other) if other.triangles().is_ok_and(|other| Arc::ptr_eq(mesh, other))),
                ),
            );
        }
        Drawn::Shape(shape) => shape,
    };
    let mut tagged = |tag: u8, numbers: &[f64]| {
        out.push(tag);
        put_f64(out, numbers);
    };
    match shape {
        Shape::HalfSpace => tagged(0, &[]),
        Shape::Sphere { radius } => tagged(1, &[*radius]),
        Shape::Box { half_extents: h } => tagged(2, &[h.x, h.y, h.z]),
        Shape::Capsule { radius, half_length } => tagged(3, &[*radius, *half_length]),
        Shape::Cylinder(c) => tagged(4, &[c.radius(), c.half_length()]),
        Shape::Ellipsoid { half_axes: e } => tagged(7, &[e.x, e.y, e.z]),
        Shape::Cone { radius, height } => tagged(8, &[*radius, *height]),
        Shape::RoundedBox { half_extents: h, rounding } => tagged(9, &[h.x, h.y, h.z, *rounding]),
        Shape::RoundedCylinder { core, rounding } => {
            tagged(10, &[core.radius() + rounding, core.half_length() + rounding, *rounding])
        }
        Shape::Mesh(mesh) => put_triangles(
            out,
            mesh.mesh(),
            place_of(
                base,
                |other| matches!(other, VisualGeometry::Shape(Shape::Mesh(other)) if Arc::ptr_eq(mesh, other)),
            ),
        ),
        Shape::Compound(compound) => put_triangles(
            out,
            &compound.mesh(),
            place_of(
                base,
                |other| matches!(other, VisualGeometry::Shape(Shape::Compound(other)) if Arc::ptr_eq(compound, other)),
            ),
        ),
    }
}

/// Appends a surface through parts: 1, its triangles, crease and appearance; 0 if there is none.
pub(crate) fn put_surface(out: &mut Vec<u8>, surface: Option<&PartSurface>) {
    out.push(surface.is_some() as u8);
    let Some(surface) = surface else { return };
    out.extend((surface.triangles.len() as u32).to_le_bytes());
    out.extend(surface.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
    put_f64(out, &[surface.crease]);
    put_appearance(out, &surface.appearance);
}

fn get_surface(rest: &mut ByteReader<'_>, parts: usize) -> Result<Option<PartSurface>, MessageError> {
    match rest.u8()? {
        0 => return Ok(None),
        1 => {}
        _ => return Err(MessageError::Malformed("an unknown kind of surface")),
    }
    let count = rest.u32()? as u64;
    let mut indices = ByteReader(rest.take(12 * count)?); // checked against what is there before anything is kept
    let triangle = |_| Ok([indices.u32()?, indices.u32()?, indices.u32()?]);
    let triangles: Vec<[u32; 3]> = (0..count).map(triangle).collect::<Result<_, MessageError>>()?;
    if triangles.iter().flatten().any(|&i| i as usize >= parts) {
        return Err(MessageError::Malformed("a surface through an unknown part"));
    }
    let crease = rest.f64()?;
    Ok(Some(PartSurface { triangles: triangles.into(), crease, appearance: get_appearance(rest)? }))
}

/// Finds the same geometry in the scene of the file. Returns the object's name and the index of the
/// visual.
fn place_of(base: &World, same: impl Fn(&VisualGeometry) -> bool) -> Option<(&str, usize)> {
    base.ids().iter().find_map(|&id| {
        Some((
            base.name(id)?,
            base.object(id)?.renderable()?.visuals().iter().position(|visual| same(&visual.geometry))?,
        ))
    })
}

fn put_triangles(out: &mut Vec<u8>, mesh: &TriMesh, place: Option<(&str, usize)>) {
    match place {
        Some((name, index)) => {
            out.push(5);
            put_name(out, name);
            out.extend((index as u32).to_le_bytes());
        }
        None => {
            out.push(6);
            put_mesh(out, mesh);
        }
    }
}

fn put_mesh(out: &mut Vec<u8>, mesh: &TriMesh) {
    out.extend((mesh.vertices.len() as u32).to_le_bytes());
    out.extend((mesh.triangles.len() as u32).to_le_bytes());
    mesh.vertices.iter().for_each(|v| put_f64(out, v.as_slice()));
    out.extend(mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
}

pub(crate) fn put_appearance(out: &mut Vec<u8>, appearance: &Appearance) {
    let [r, g, b] = appearance.color;
    out.extend([r, g, b, appearance.roughness, appearance.metallic].iter().flat_map(|x| x.to_le_bytes()));
    put_text(out, &appearance.shader);
    let properties = &appearance.properties[..appearance.properties.len().min(MAX_PROPERTIES)];
    out.push(properties.len() as u8);
    for (name, value) in properties {
        put_text(out, name);
        put_f64(out, &[*value]);
    }
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    let end = (0..=text.len().min(MAX_TEXT)).rev().find(|&n| text.is_char_boundary(n)).unwrap_or(0);
    out.push(end as u8);
    out.extend(&text.as_bytes()[..end]);
}

/// The visuals of a described object.
pub(crate) struct Looks {
    pub visuals: Vec<Visual>,
    pub surface: Option<PartSurface>,
    /// Appearance of its cloud.
    pub cloud: Option<Appearance>,
}

/// Reads what an object with `parts` parts shows, and the appearance of its cloud if it has one; `base` as in [`put_visuals`].
pub(crate) fn get_looks(bytes: &[u8], parts: usize, cloud: bool, base: &World) -> Result<Looks, MessageError> {
    let mut rest = ByteReader(bytes);
    let count = rest.u32()? as usize;
    if count > MAX_VISUALS {
        return Err(MessageError::Malformed("more than 4096 visuals of an object"));
    }
    let mut visuals = Vec::new();
    for _ in 0..count {
        let part = rest.u32()? as usize;
        if part >= parts {
            return Err(MessageError::Malformed("a visual of an unknown part"));
        }
        let pose = exact_pose(&mut rest)?;
        let geometry = get_geometry(&mut rest, base)?;
        visuals.push(Visual {
            part,
            pose,
            geometry,
            appearance: get_appearance(&mut rest)?,
            stands_in_for: Vec::new(),
        });
    }
    let surface = get_surface(&mut rest, parts)?;
    let cloud = cloud.then(|| get_appearance(&mut rest)).transpose()?;
    rest.end()?;
    Ok(Looks { visuals, surface, cloud })
}

fn get_geometry(rest: &mut ByteReader<'_>, base: &World) -> Result<VisualGeometry, MessageError> {
    let shape = match rest.u8()? {
        0 => Ok(Shape::half_space()),
        1 => Shape::sphere(rest.f64()?),
        2 => Shape::cuboid(2.0 * Vec3::from(rest.f64s::<3>()?)),
        3 => rest.f64s().map(|[radius, half]| Shape::capsule(radius, 2.0 * half))?,
        4 => rest.f64s().map(|[radius, half]| Shape::cylinder(radius, 2.0 * half))?,
        5 => return mesh_of(base, rest.name()?, rest.u32()? as usize),
        6 => {
            let mesh = get_mesh(rest)?;
            let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
            let mesh = VisualMesh::new("a mesh of the server", mesh).map_err(|why| {
                MessageError::Unfit(format!("a mesh of {vertices} vertices and {triangles} triangles: {why}"))
            })?;
            return Ok(VisualGeometry::Mesh(Arc::new(mesh)));
        }
        7 => Shape::ellipsoid(2.0 * Vec3::from(rest.f64s::<3>()?)),
        8 => rest.f64s().map(|[radius, height]| Shape::cone(radius, height))?,
        9 => rest.f64s().map(|[x, y, z, rounding]| Shape::rounded_cuboid(2.0 * Vec3::new(x, y, z), rounding))?,
        10 => rest.f64s().map(|[radius, half, rounding]| Shape::rounded_cylinder(radius, 2.0 * half, rounding))?,
        _ => return Err(MessageError::Malformed("an unknown shape")),
    };
    shape.map(VisualGeometry::Shape).map_err(|_| MessageError::Malformed("a shape with a wrong size"))
}

fn mesh_of(base: &World, name: &str, index: usize) -> Result<VisualGeometry, MessageError> {
    let object = base.find(name).and_then(|id| base.object(id));
    let visual = object.and_then(|o| o.renderable()).and_then(|r| r.visuals().get(index));
    visual
        .map(|v| v.geometry.clone())
        .ok_or_else(|| MessageError::Unfit(format!("visual {index} of '{name}', which the scene does not have")))
}

fn get_mesh(rest: &mut ByteReader<'_>) -> Result<TriMesh, MessageError> {
    let (vertices, triangles) = (rest.u32()? as u64, rest.u32()? as u64);
    let mut corners = ByteReader(rest.take(24 * vertices)?); // checked against what is there before anything is kept
    let mut indices = ByteReader(rest.take(12 * triangles)?);
    let vertices: Vec<Vec3> = (0..vertices).map(|_| corners.f64s::<3>().map(Vec3::from)).collect::<Result<_, _>>()?;
    let triangle = |_| Ok([indices.u32()?, indices.u32()?, indices.u32()?]);
    let triangles: Vec<[u32; 3]> = (0..triangles).map(triangle).collect::<Result<_, MessageError>>()?;
    if triangles.iter().flatten().any(|&i| i as usize >= vertices.len()) {
        return Err(MessageError::Malformed("a triangle with an unknown vertex"));
    }
    Ok(TriMesh { vertices, triangles })
}

fn get_appearance(rest: &mut ByteReader<'_>) -> Result<Appearance, MessageError> {
    let mut shares = [0.0f32; 5];
    for x in &mut shares {
        *x = f32::from_le_bytes(rest.array()?);
        if !(0.0..=1.0).contains(x) {
            return Err(MessageError::Malformed("a color or surface outside 0 to 1"));
        }
    }
    let [r, g, b, roughness, metallic] = shares;
    let shader = text(rest)?;
    let count = rest.u8()?;
    let properties = (0..count).map(|_| Ok((text(rest)?, rest.f64()?))).collect::<Result<_, MessageError>>()?;
    Ok(Appearance { color: [r, g, b], roughness, metallic, shader, properties, ..Appearance::default() })
}

fn text(rest: &mut ByteReader<'_>) -> Result<String, MessageError> {
    let length = rest.u8()?;
    let bytes = rest.take(length as u64)?;
    std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| MessageError::Malformed("a text that is not UTF-8"))
}
