//! COLLADA (`.dae`): the triangles of a document's scene. Colors, textures, cameras, skins and
//! animations are ignored.
//!
//! ```text
//! vertex in meters = meter · T(root) · … · T(node) · position
//! ```
//!
//! `T` is the product of a node's `<matrix>`, `<translate>`, `<rotate>` and `<scale>` in the order
//! of the file. `meter` is the length of its unit. `<up_axis>` is not applied: robot files are
//! exported in the axes of their links, whatever they declare there, and the programs that they are
//! made for ignore it too.

use std::collections::BTreeMap;
use std::rc::Rc;

use nalgebra::{Matrix4, Rotation3, Unit};
use roxmltree::{Document, Node, ParsingOptions};
use tumble_core::collide::{PolygonTriangulator, TriMesh, Vec3};

/// Largest number of nodes of a document.
const MAX_NODES: u32 = 20_000_000;
/// Largest number of triangles, and of vertices, of a document; every instance counts. So does its length: a short
/// document may not make more than `FREE` of them, beside `PER_BYTE` for each byte.
const MAX_TRIANGLES: usize = 20_000_000;
const FREE: usize = 1_000_000;
const PER_BYTE: usize = 10;
/// Largest number of nodes that are walked through, with instances of nodes, beside one for each byte.
const FREE_NODES: usize = 100_000;
/// Largest depth of nested nodes.
const DEEPEST: usize = 64;

/// Returns the triangles of a document. Errors name the line.
pub(crate) fn read(text: &str) -> Result<TriMesh, String> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| e.to_string())?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(format!("the outermost element is <{}>; a COLLADA document has <COLLADA>", root.tag_name().name()));
    }
    let ids = root.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let most = MAX_TRIANGLES.min(FREE + PER_BYTE * text.len());
    let nodes = FREE_NODES + text.len();
    let mut reader = Reader { ids, geometries: BTreeMap::new(), made: TriMesh::default(), most, nodes, left: nodes };
    let unit =
        descendant(root, "unit").and_then(|unit| unit.attribute("meter")).map_or(Ok(1.0), |m| number(m).ok_or(m));
    let unit = unit.map_err(|m| format!("`meter` of <unit> is \"{m}\"; it must be a number"))?;
    match reader.scene(root) {
        Some(scene) => reader.children(scene, &Matrix4::new_scaling(unit), 0)?,
        None => {
            for geometry in root.descendants().filter(|node| node.has_tag_name((ns(root), "geometry"))) {
                reader.add(geometry, &Matrix4::new_scaling(unit))?;
            }
        }
    }
    Ok(reader.made)
}

fn ns<'a>(node: Node<'a, '_>) -> &'a str {
    node.tag_name().namespace().unwrap_or("")
}

fn is(node: &Node<'_, '_>, tag: &str) -> bool {
    node.is_element() && node.tag_name().name() == tag
}

fn child<'a, 'd>(node: Node<'a, 'd>, tag: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|child| is(child, tag))
}

fn descendant<'a, 'd>(node: Node<'a, 'd>, tag: &str) -> Option<Node<'a, 'd>> {
    node.descendants().find(|child| is(child, tag))
}

fn number(word: &str) -> Option<f64> {
    word.trim().parse().ok().filter(|x: &f64| x.is_finite())
}

fn fault(node: Node<'_, '_>, what: impl std::fmt::Display) -> String {
    format!("line {}: <{}> {what}", node.document().text_pos_at(node.range().start).row, node.tag_name().name())
}

/// Parses the numbers in an element, separated by white space.
fn numbers<T: std::str::FromStr>(node: Node<'_, '_>) -> Result<Vec<T>, String> {
    let words = node.text().unwrap_or("").split_whitespace();
    words
        .map(|word| word.parse().map_err(|_| fault(node, format_args!("holds \"{word}\"; it must be a number"))))
        .collect()
}

/// Triangles of one geometry, in its own axes.
type Geometry = (Vec<Vec3>, Vec<[u32; 3]>);

/// A face: first corner, number of corners, and the list of indices that they are in.
type Face = (usize, usize, Rc<Vec<u32>>);

struct Reader<'a, 'd> {
    ids: BTreeMap<&'a str, Node<'a, 'd>>,
    /// Geometries read so far, by the number of their element.
    geometries: BTreeMap<u32, Geometry>,
    made: TriMesh,
    /// Largest number of triangles and of vertices.
    most: usize,
    /// Largest number of nodes that are walked through, and how many of them are left.
    nodes: usize,
    left: usize,
}

impl<'a, 'd> Reader<'a, 'd> {
    /// Returns the element that `#id` in an attribute refers to.
    fn target(&self, node: Node<'a, 'd>, attribute: &str) -> Result<Node<'a, 'd>, String> {
        let uri = node.attribute(attribute).ok_or_else(|| fault(node, format_args!("has no `{attribute}`")))?;
        let id = uri.strip_prefix('#').unwrap_or(uri);
        self.ids.get(id).copied().ok_or_else(|| fault(node, format_args!("refers to \"{uri}\", which is not there")))
    }

    fn scene(&self, root: Node<'a, 'd>) -> Option<Node<'a, 'd>> {
        let named = child(root, "scene").and_then(|scene| child(scene, "instance_visual_scene"));
        named.and_then(|instance| self.target(instance, "url").ok()).or_else(|| descendant(root, "visual_scene"))
    }

    fn children(&mut self, parent: Node<'a, 'd>, pose: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        if depth > DEEPEST {
            return Err(fault(parent, format_args!("is nested more than {DEEPEST} deep")));
        }
        for node in parent.children().filter(Node::is_element) {
            match node.tag_name().name() {
                "node" => self.node(node, pose, depth)?,
                "instance_node" => self.node(self.target(node, "url")?, pose, depth)?,
                "instance_geometry" => self.add(self.target(node, "url")?, pose)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn node(&mut self, node: Node<'a, 'd>, pose: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        self.left = self
            .left
            .checked_sub(1)
            .ok_or_else(|| fault(node, format_args!("is one of more than {} nodes, instances included", self.nodes)))?;
        let mut pose = *pose;
        for step in node.children().filter(Node::is_element) {
            pose *= transform(step)?;
        }
        self.children(node, &pose, depth + 1)
    }

    /// Adds a geometry at a pose. A mirroring pose reverses the order of the corners.
    fn add(&mut self, geometry: Node<'a, 'd>, pose: &Matrix4<f64>) -> Result<(), String> {
        let key = geometry.id().get();
        if !self.geometries.contains_key(&key) {
            let read = self.geometry(geometry)?;
            self.geometries.insert(key, read);
        }
        let (vertices, triangles) = &self.geometries[&key];
        for (count, what) in [
            (self.made.triangles.len() + triangles.len(), "triangles"),
            (self.made.vertices.len() + vertices.len(), "vertices"),
        ] {
            if count > self.most {
                return Err(fault(geometry, format_args!("makes more than {} {what} in all", self.most)));
            }
        }
        let first = self.made.vertices.len() as u32;
        let mirrored = pose.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        self.made.vertices.extend(vertices.iter().map(|v| pose.transform_point(&(*v).into()).coords));
        self.made.triangles.extend(triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| first + v);
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }

    fn geometry(&self, geometry: Node<'a, 'd>) -> Result<Geometry, String> {
        let (mut vertices, mut triangles, mut triangulator) = (Vec::new(), Vec::new(), PolygonTriangulator::default());
        let Some(mesh) = child(geometry, "mesh") else { return Ok((vertices, triangles)) };
        for primitive in mesh.children().filter(Node::is_element) {
            let kind = primitive.tag_name().name();
            if !["triangles", "polylist", "polygons", "tristrips", "trifans"].contains(&kind) {
                continue;
            }
            let Some((offset, stride, points)) = self.inputs(primitive)? else { continue };
            let first = vertices.len() as u32;
            let polygons = ["polylist", "polygons"].contains(&kind);
            for (start, len, list) in faces(primitive, stride)? {
                let corner = |k: usize| -> Result<u32, String> {
                    let index = list[(start + k) * stride + offset];
                    let known = (index as usize) < points.len();
                    if known {
                        Ok(first + index)
                    } else {
                        Err(fault(primitive, format_args!("refers to vertex {index} of {}", points.len())))
                    }
                };
                if polygons && len > 3 {
                    let corners = (0..len).map(corner).collect::<Result<Vec<u32>, String>>()?;
                    let places: Vec<Vec3> = corners.iter().map(|c| points[(c - first) as usize]).collect();
                    let cut =
                        triangulator.triangulate(&places).map_err(|why| fault(primitive, format_args!("has {why}")))?;
                    triangles.extend(cut.iter().map(|t| t.map(|k| corners[k])));
                    continue;
                }
                for k in 2..len {
                    triangles.push(match kind {
                        "tristrips" if k % 2 == 1 => [corner(k - 1)?, corner(k - 2)?, corner(k)?],
                        "tristrips" => [corner(k - 2)?, corner(k - 1)?, corner(k)?],
                        "triangles" => [corner(0)?, corner(1)?, corner(2)?],
                        _ => [corner(0)?, corner(k - 1)?, corner(k)?],
                    });
                }
            }
            vertices.extend(points);
            if vertices.len() > self.most {
                return Err(fault(primitive, format_args!("makes more than {} vertices in all", self.most)));
            }
        }
        Ok((vertices, triangles))
    }

    /// Returns the offset of the position index within a corner, the number of indices per corner,
    /// and the positions.
    fn inputs(&self, primitive: Node<'a, 'd>) -> Result<Option<(usize, usize, Vec<Vec3>)>, String> {
        let inputs: Vec<Node<'a, 'd>> = primitive.children().filter(|node| is(node, "input")).collect();
        let offset = |input: &Node<'_, '_>| {
            input.attribute("offset").and_then(|o| o.trim().parse::<usize>().ok()).filter(|o| *o < 64).unwrap_or(0)
        };
        let stride = inputs.iter().map(offset).max().unwrap_or(0) + 1;
        let Some(vertex) = inputs.iter().find(|input| input.attribute("semantic") == Some("VERTEX")) else {
            return Ok(None);
        };
        let vertices = self.target(*vertex, "source")?;
        let position = vertices.children().find(|node| node.attribute("semantic") == Some("POSITION"));
        let source = self.target(position.ok_or_else(|| fault(vertices, "has no input POSITION"))?, "source")?;
        let array = child(source, "float_array").ok_or_else(|| fault(source, "has no <float_array>"))?;
        let accessor = descendant(source, "accessor");
        let step = accessor.and_then(|a| a.attribute("stride")?.trim().parse::<usize>().ok()).unwrap_or(3).max(3);
        let points = numbers::<f64>(array)?.chunks_exact(step).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        Ok(Some((offset(vertex), stride, points)))
    }
}

/// Returns all faces of a primitive.
fn faces(primitive: Node<'_, '_>, stride: usize) -> Result<Vec<Face>, String> {
    let mut faces = Vec::new();
    let counts = child(primitive, "vcount").map(numbers::<usize>).transpose()?;
    for p in primitive.children().filter(|node| is(node, "p")) {
        let list = Rc::new(numbers::<u32>(p)?);
        let corners = list.len() / stride;
        let lengths = match (primitive.tag_name().name(), &counts) {
            ("triangles", _) => vec![3; corners / 3],
            ("polylist", Some(counts)) => counts.clone(),
            _ => vec![corners],
        };
        let mut start: usize = 0;
        for len in lengths {
            if len > corners.saturating_sub(start) {
                return Err(fault(primitive, "counts more corners than it has"));
            }
            faces.push((start, len, list.clone()));
            start += len;
        }
    }
    Ok(faces)
}

/// Returns the matrix of one transformation element; the identity for any other element.
fn transform(step: Node<'_, '_>) -> Result<Matrix4<f64>, String> {
    let tag = step.tag_name().name();
    let expected = match tag {
        "matrix" => 16,
        "rotate" => 4,
        "translate" | "scale" => 3,
        _ => return Ok(Matrix4::identity()),
    };
    let n = numbers::<f64>(step)?;
    if n.len() != expected || n.iter().any(|x| !x.is_finite()) {
        return Err(fault(step, format_args!("must have {expected} finite numbers")));
    }
    Ok(match tag {
        "matrix" => Matrix4::from_row_slice(&n),
        "translate" => Matrix4::new_translation(&Vec3::new(n[0], n[1], n[2])),
        "scale" => Matrix4::new_nonuniform_scaling(&Vec3::new(n[0], n[1], n[2])),
        _ => {
            let axis = Unit::try_new(Vec3::new(n[0], n[1], n[2]), 1e-12);
            axis.map_or(Matrix4::identity(), |axis| {
                Rotation3::from_axis_angle(&axis, n[3].to_radians()).to_homogeneous()
            })
        }
    })
}

#[cfg(test)]
mod tests {
    use super::read;
    use tumble_core::collide::Vec3;

    /// A unit cube of six quads in a scene with the given transformation. Each corner has a
    /// position index and a normal index.
    fn cube(transform: &str) -> String {
        let quads = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
        let corners: String =
            quads.iter().enumerate().flat_map(|(n, quad)| quad.map(|v| format!("{v} {n} "))).collect();
        format!(
            "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\"><asset><unit meter=\"0.01\"/><up_axis>Y_UP</up_axis></asset>\n\
             <library_geometries><geometry id=\"g\"><mesh><source id=\"s\"><float_array count=\"24\">0 0 0 0 0 1 0 1 0 0 1 1 1 0 0 1 0 1 1 1 0 1 1 1</float_array></source>\n\
             <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\n\
             <polylist><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><input semantic=\"NORMAL\" source=\"#n\" offset=\"1\"/><vcount>4 4 4 4 4 4</vcount><p>{corners}</p></polylist></mesh></geometry></library_geometries>\n\
             <library_visual_scenes><visual_scene id=\"w\"><node>{transform}<node><scale>100 100 100</scale><instance_geometry url=\"#g\"/></node></node></visual_scene></library_visual_scenes>\n\
             <scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>"
        )
    }

    #[test]
    fn a_cube_in_centimetres_stands_where_its_nodes_put_it() {
        let mut mesh = read(&cube("<translate>200 0 0</translate><rotate>0 0 1 90</rotate>")).unwrap();
        assert!((mesh.check_closed().unwrap().volume - 1.0).abs() < 1e-12);
        let center = mesh.mass_properties(1.0).center_of_mass;
        assert!((center - Vec3::new(1.5, 0.5, 0.5)).norm() < 1e-12, "{center:?}");
    }

    #[test]
    fn a_mirrored_cube_is_not_inside_out() {
        let mirror = read(&cube("<matrix>-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>")).unwrap();
        assert!((mirror.signed_volume() - 1.0).abs() < 1e-12, "{}", mirror.signed_volume());
    }

    #[test]
    fn damage_is_an_error_with_its_line_or_a_mesh() {
        let text = cube("<translate>1 2 3</translate>");
        for end in 0..text.len() {
            let _ = read(&text[..end]);
            for other in ["9", "-", "#", " ", "<", "nan"] {
                let _ = read(&format!("{}{other}{}", &text[..end], &text[end + 1..]));
            }
        }
        let error_of = |from: &str, to: &str| read(&text.replace(from, to)).unwrap_err();
        assert_eq!(error_of("<p>0 0", "<p>8 0"), "line 4: <polylist> refers to vertex 8 of 8");
        assert_eq!(
            error_of("url=\"#g\"", "url=\"#h\""),
            "line 5: <instance_geometry> refers to \"#h\", which is not there"
        );
        assert_eq!(error_of("4 4 4 4 4 4<", "4 4 4 4 4 5<"), "line 4: <polylist> counts more corners than it has");
        assert_eq!(error_of("0 0 0 0 0 1", "0 0 0 0 x 1"), "line 2: <float_array> holds \"x\"; it must be a number");
    }
}
