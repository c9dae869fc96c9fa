//! The description of an archive, and the files that it names.

use super::archive::Archive;
use super::{CalibrationError, Frustum, Map, Mpcdi, Profile, Region};
use roxmltree::{Document, Node, ParsingOptions};
use std::ops::RangeInclusive;
use tumble_render::Pfm;

/// Largest number of regions.
const MAX_REGIONS: usize = 256;
/// Largest number of elements, attributes and texts of a description.
const MAX_NODES: u32 = 1 << 18;
/// Longest side of a region, pixels.
const MAX_SIDE: f64 = 16384.0;

/// Directions of a file without a frame: x to the right, y ahead, z up.
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Reads a description and its files.
pub(super) fn parse(name: &str, bytes: &[u8], archive: &mut Archive<'_>) -> Result<Mpcdi, CalibrationError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|e| CalibrationError::new(name, format!("byte {} is not UTF-8", e.valid_up_to())))?;
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|e| CalibrationError::new(format!("{name}:{}:{}", e.pos().row, e.pos().col), e.to_string()))?;
    let reader = Reader { name, document: &document };
    let root = document.root_element();
    if !root.tag_name().name().eq_ignore_ascii_case("MPCDI") {
        return Err(reader.fail(root, format!("<{}>, expected <MPCDI>", root.tag_name().name())));
    }
    let word = attribute(root, "profile").unwrap_or("");
    let profile = Profile::NAMES.iter().find(|(name, _)| word.eq_ignore_ascii_case(name)).map(|(_, profile)| *profile);
    let profile = profile.ok_or_else(|| reader.fail(root, format!("profile \"{word}\", expected 2d, 3d, a3 or sl")))?;
    let mut mpcdi = Mpcdi { profile, regions: Vec::new(), notes: Vec::new() };
    for buffer in root.descendants().filter(|node| is(*node, "buffer")) {
        for region in children(buffer, "region") {
            let read = reader.region(buffer, region)?;
            if mpcdi.regions.iter().any(|other| other.id == read.id) {
                return Err(reader.fail(region, format!("a second region \"{}\"", read.id)));
            }
            mpcdi.regions.push(read);
            if mpcdi.regions.len() > MAX_REGIONS {
                return Err(reader.fail(region, format!("more than {MAX_REGIONS} regions")));
            }
        }
    }
    if mpcdi.regions.is_empty() {
        return Err(reader.fail(root, "has no <region> in a <buffer>".into()));
    }
    for set in root.descendants().filter(|node| is(*node, "fileset")) {
        reader.files(set, archive, &mut mpcdi)?;
    }
    Ok(mpcdi)
}

struct Reader<'a> {
    name: &'a str,
    document: &'a Document<'a>,
}

impl Reader<'_> {
    fn fail(&self, node: Node<'_, '_>, reason: String) -> CalibrationError {
        let at = self.document.text_pos_at(node.range().start);
        CalibrationError::new(format!("{}:{}:{}", self.name, at.row, at.col), reason)
    }

    fn region(&self, buffer: Node<'_, '_>, node: Node<'_, '_>) -> Result<Region, CalibrationError> {
        let id = attribute(node, "id").filter(|id| !id.is_empty());
        let id = id.ok_or_else(|| self.fail(node, "a region without an id".into()))?.to_owned();
        let side = |of, name| self.attribute_number(of, name, 1.0..=MAX_SIDE);
        let size = [side(node, "xResolution")?, side(node, "yResolution")?];
        let [Some(width), Some(height)] = size else {
            return Err(self.fail(node, format!("region \"{id}\" has no xResolution and yResolution")));
        };
        let aspect = match [side(buffer, "xResolution")?, side(buffer, "yResolution")?] {
            [Some(w), Some(h)] => Some(w / h),
            _ => None,
        };
        let share = |name, default| Ok(self.attribute_number(node, name, -16.0..=16.0)?.unwrap_or(default));
        let part = [share("x", 0.0)?, share("y", 0.0)?, share("xsize", 1.0)?, share("ysize", 1.0)?];
        let frustum = children(node, "frustum").next().map(|frustum| self.frustum(frustum)).transpose()?;
        let (position, axes) = match children(node, "coordinateFrame").next() {
            Some(frame) => self.frame(frame)?,
            None => ([0.0; 3], AXES),
        };
        Ok(Region {
            buffer: attribute(buffer, "id").unwrap_or("").to_owned(),
            buffer_aspect: aspect,
            id,
            size_px: [width as u32, height as u32],
            part,
            frustum,
            position,
            axes,
            warp: None,
            unit_m: 1.0,
            alpha: None,
            beta: None,
        })
    }

    fn frustum(&self, node: Node<'_, '_>) -> Result<Frustum, CalibrationError> {
        let turn = |name| self.number(node, name, -360.0..=360.0);
        let edge = |name| self.number(node, name, -89.9..=89.9);
        let edges = [edge("leftAngle")?, edge("rightAngle")?, edge("downAngle")?, edge("upAngle")?];
        if edges[0] >= edges[1] || edges[2] >= edges[3] {
            return Err(self.fail(node, format!("the edges of the frustum are {edges:?} degrees (left, right, down, up), expected left below right and down below up")));
        }
        Ok(Frustum { yaw_pitch_roll_deg: [turn("yaw")?, turn("pitch")?, turn("roll")?], edges_deg: edges })
    }

    /// Returns the position, and the directions to the right (pitch axis), ahead (roll axis) and up
    /// (against the yaw axis).
    fn frame(&self, node: Node<'_, '_>) -> Result<([f64; 3], [[f64; 3]; 3]), CalibrationError> {
        let three = |names: [&str; 3]| -> Result<[f64; 3], CalibrationError> {
            let at = |name| self.number(node, name, -1e9..=1e9);
            Ok([at(names[0])?, at(names[1])?, at(names[2])?])
        };
        let axes = [
            three(["pitchx", "pitchy", "pitchz"])?,
            three(["rollx", "rolly", "rollz"])?,
            three(["yawx", "yawy", "yawz"])?.map(|x| -x),
        ];
        let dot = |a: [f64; 3], b: [f64; 3]| -> f64 { (0..3).map(|k| a[k] * b[k]).sum() };
        let off = |i: usize, j: usize| (dot(axes[i], axes[j]) - f64::from(u8::from(i == j))).abs();
        if (0..3).any(|i| (0..3).any(|j| off(i, j) > 1e-3)) {
            return Err(self.fail(node, "the axes of the frame are not unit vectors at right angles".into()));
        }
        Ok((three(["posx", "posy", "posz"])?, axes))
    }

    fn files(&self, set: Node<'_, '_>, archive: &mut Archive<'_>, mpcdi: &mut Mpcdi) -> Result<(), CalibrationError> {
        let id = attribute(set, "region").unwrap_or("");
        let region = mpcdi.regions.iter_mut().find(|region| region.id == id);
        let region = region.ok_or_else(|| self.fail(set, format!("files of region \"{id}\", which there is not")))?;
        for file in set.children().filter(Node::is_element) {
            let kind = file.tag_name().name().to_ascii_lowercase();
            if !["geometrywarpfile", "alphamap", "betamap"].contains(&kind.as_str()) {
                mpcdi.notes.push(format!("<{}> of region \"{id}\" is not used", file.tag_name().name()));
                continue;
            }
            let path = self.text(file, "path")?;
            let bytes = archive.file(path)?;
            if kind == "geometrywarpfile" {
                region.warp = Some(flipped(Pfm::parse(&bytes).map_err(|reason| CalibrationError::new(path, reason))?));
                region.unit_m = self.unit(set, file)?;
                continue;
            }
            let gamma = match children(file, "gammaEmbedded").next() {
                Some(_) => self.number(file, "gammaEmbedded", 0.1..=10.0)?,
                None => 1.0,
            };
            let map = Some(Map { png: bytes, gamma });
            if kind == "alphamap" { region.alpha = map } else { region.beta = map }
        }
        Ok(())
    }

    /// Returns the meters of a unit of a warp's points.
    fn unit(&self, set: Node<'_, '_>, file: Node<'_, '_>) -> Result<f64, CalibrationError> {
        let node = [file, set].into_iter().flat_map(|node| children(node, "geometricUnit")).next();
        let Some(node) = node else { return Ok(1.0) };
        match node.text().unwrap_or("").trim() {
            "mm" => Ok(1e-3),
            "cm" => Ok(1e-2),
            "dm" => Ok(1e-1),
            "m" | "" => Ok(1.0),
            "in" => Ok(0.0254),
            "ft" => Ok(0.3048),
            "yd" => Ok(0.9144),
            other => Err(self.fail(node, format!("the unit \"{other}\", expected mm, cm, dm, m, in, ft or yd"))),
        }
    }

    fn text<'a>(&self, node: Node<'a, '_>, name: &str) -> Result<&'a str, CalibrationError> {
        let text = children(node, name).next().and_then(|child| child.text()).map(str::trim).unwrap_or("");
        if text.is_empty() {
            return Err(self.fail(node, format!("<{}> has no <{name}>", node.tag_name().name())));
        }
        Ok(text)
    }

    fn number(&self, node: Node<'_, '_>, name: &str, range: RangeInclusive<f64>) -> Result<f64, CalibrationError> {
        let text = self.text(node, name)?;
        let number = text.parse::<f64>().ok().filter(|x| range.contains(x));
        number.ok_or_else(|| {
            self.fail(node, format!("<{name}> is {text}, expected a number from {} to {}", range.start(), range.end()))
        })
    }

    fn attribute_number(
        &self,
        node: Node<'_, '_>,
        name: &str,
        range: RangeInclusive<f64>,
    ) -> Result<Option<f64>, CalibrationError> {
        let Some(text) = attribute(node, name).filter(|text| !text.is_empty()) else { return Ok(None) };
        match text.parse::<f64>().ok().filter(|x| range.contains(x)) {
            Some(number) => Ok(Some(number)),
            None => Err(self
                .fail(node, format!("{name} is {text}, expected a number from {} to {}", range.start(), range.end()))),
        }
    }
}

/// Turns the order of rows around.
pub(crate) fn flipped(mut pfm: Pfm) -> Pfm {
    pfm.values = pfm.values.chunks(pfm.size[0]).rev().flatten().copied().collect();
    pfm
}

fn is(node: Node<'_, '_>, name: &str) -> bool {
    node.is_element() && node.tag_name().name().eq_ignore_ascii_case(name)
}

fn children<'a, 'b>(node: Node<'a, 'b>, name: &str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.children().filter(move |child| is(*child, name))
}

/// Returns an attribute by its name in any case: writers differ.
fn attribute<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.attributes().find(|attribute| attribute.name().eq_ignore_ascii_case(name)).map(|attribute| attribute.value())
}
