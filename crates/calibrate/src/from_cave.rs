//! A cave as an archive of profile `a3`: the point that each pixel shows, and its masks.

use crate::mpcdi::{CalibrationError, Map, Mpcdi, Profile, Region};
use tumble_render::{Blend, CaveView, Pfm};

/// Makes an archive of all facets. Flat and curved screens become points, m; x right, y ahead, z up.
/// Transfer curves, white points and tables of colors have no place in an archive; a note says so.
///
/// # Errors
/// [`CalibrationError`] for facets whose pixels show directions instead of points, and for pictures smaller than
/// 2 x 2 pixels.
pub fn cave_to_mpcdi(view: &CaveView) -> Result<Mpcdi, CalibrationError> {
    let mut mpcdi = Mpcdi { profile: Profile::Advanced3D, regions: Vec::new(), notes: Vec::new() };
    for facet in &view.cave().facets {
        let fail = |reason: &str| CalibrationError::new(format!("facet \"{}\"", facet.name), reason);
        let [w, h] = facet.size_px;
        if w < 2 || h < 2 {
            return Err(fail("is smaller than 2 x 2 pixels"));
        }
        let points = view
            .points(facet)
            .ok_or_else(|| fail("shows directions; an archive has points, so give its screen a radius_m"))?;
        let nothing = [f32::NAN; 3];
        let values = points.into_iter().map(|point| point.map_or(nothing, |p| p.map(|x| x as f32))).collect();
        let png = |shares: Vec<[f32; 3]>| -> Result<Map, CalibrationError> {
            let png = Blend::png(&shares, facet.size_px).map_err(|e| fail(&e.to_string()))?;
            Ok(Map { png, gamma: 1.0 })
        };
        let masks = view.masks(facet);
        let alpha = masks.map(|masks| png(masks.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect())).transpose()?;
        let beta = match &facet.color {
            Some(color) if color.floor != color.black => {
                let lift: [f64; 3] =
                    std::array::from_fn(|k| (color.floor[k] - color.black[k]) / (1.0 - color.black[k]));
                let all = vec![[1.0; 4]; (w * h) as usize];
                let shares = masks.unwrap_or(&all).iter().map(|m| lift.map(|l| l as f32 * m[3])).collect();
                Some(png(shares)?)
            }
            _ => None,
        };
        if facet.color.is_some() {
            mpcdi.notes.push(format!("facet \"{}\": gamma, white and lut_file are not in the archive", facet.name));
        }
        // rows of a Pfm begin at the bottom, those of a picture at the top
        let warp = crate::mpcdi::upside_down(Pfm { size: [w as usize, h as usize], values });
        mpcdi.regions.push(Region {
            buffer: "cave".into(),
            buffer_aspect: None,
            id: facet.name.clone(),
            size_px: facet.size_px,
            part: [0.0, 0.0, 1.0, 1.0],
            frustum: None,
            position: [0.0; 3],
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            warp: Some(warp),
            unit_m: 1.0,
            alpha,
            beta,
        });
    }
    Ok(mpcdi)
}
