//! Writing of archives.

use super::read::flipped;
use super::{CalibrationError, Mpcdi, Profile, Region};
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Writes the archive; equal content gives equal bytes.
pub(super) fn archive(mpcdi: &Mpcdi) -> Result<Vec<u8>, CalibrationError> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    let mut put = |name: &str, bytes: &[u8]| -> Result<(), CalibrationError> {
        let fail = |reason: String| CalibrationError::new(name, format!("cannot be written: {reason}"));
        zip.start_file(name, options).map_err(|e| fail(e.to_string()))?;
        zip.write_all(bytes).map_err(|e| fail(e.to_string()))
    };
    put("mpcdi.xml", description(mpcdi).as_bytes())?;
    for (i, region) in mpcdi.regions.iter().enumerate() {
        if let Some(warp) = &region.warp {
            put(&format!("region{i}_warp.pfm"), &flipped(warp.clone()).to_bytes())?;
        }
        for (map, name) in [(&region.alpha, "alpha"), (&region.beta, "beta")] {
            if let Some(map) = map {
                put(&format!("region{i}_{name}.png"), &map.png)?;
            }
        }
    }
    let done = zip.finish().map_err(|e| CalibrationError::new("the archive", format!("cannot be written: {e}")))?;
    Ok(done.into_inner())
}

fn description(mpcdi: &Mpcdi) -> String {
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
    let profile = mpcdi.profile.name();
    out += &format!("<MPCDI profile=\"{profile}\" geometry=\"1\" color=\"1\" version=\"2.0\">\n  <display>\n");
    let mut buffers: Vec<&str> = mpcdi.regions.iter().map(|region| region.buffer.as_str()).collect();
    buffers.dedup();
    for buffer in buffers {
        let regions: Vec<&Region> = mpcdi.regions.iter().filter(|region| region.buffer == buffer).collect();
        let aspect = regions[0].buffer_aspect.unwrap_or(1.0);
        let _ = writeln!(
            out,
            "    <buffer id=\"{}\" xResolution=\"{}\" yResolution=\"1000\">",
            escaped(buffer),
            (1000.0 * aspect).round().clamp(1.0, 16384.0)
        );
        regions.iter().for_each(|region| out += &region_text(region));
        out += "    </buffer>\n";
    }
    out += "  </display>\n  <files>\n";
    for (i, region) in mpcdi.regions.iter().enumerate() {
        out += &files_text(region, i, mpcdi.profile);
    }
    out + "  </files>\n</MPCDI>\n"
}

fn region_text(region: &Region) -> String {
    let ([w, h], [x, y, wide, high]) = (region.size_px, region.part);
    let mut out = format!(
        "      <region id=\"{}\" xResolution=\"{w}\" yResolution=\"{h}\" x=\"{x}\" y=\"{y}\" xsize=\"{wide}\" ysize=\"{high}\">\n",
        escaped(&region.id)
    );
    let tag = |name: &str, value: f64| format!("          <{name}>{value}</{name}>\n");
    if let Some(frustum) = &region.frustum {
        let ([yaw, pitch, roll], [left, right, down, up]) = (frustum.yaw_pitch_roll_deg, frustum.edges_deg);
        out += "        <frustum>\n";
        for (name, value) in [
            ("yaw", yaw),
            ("pitch", pitch),
            ("roll", roll),
            ("rightAngle", right),
            ("leftAngle", left),
            ("upAngle", up),
            ("downAngle", down),
        ] {
            out += &tag(name, value);
        }
        out += "        </frustum>\n";
    }
    out += "        <coordinateFrame>\n";
    let down = region.axes[2].map(|x| -x);
    for (axis, vector) in [("pos", region.position), ("yaw", down), ("pitch", region.axes[0]), ("roll", region.axes[1])]
    {
        for (letter, value) in ["x", "y", "z"].iter().zip(vector) {
            // no minus before a zero
            out += &tag(&format!("{axis}{letter}"), value + 0.0);
        }
    }
    out + "        </coordinateFrame>\n      </region>\n"
}

fn files_text(region: &Region, i: usize, profile: Profile) -> String {
    let mut out = format!("    <fileset region=\"{}\">\n", escaped(&region.id));
    if region.warp.is_some() {
        let unit = match profile {
            Profile::Advanced3D => "<geometricUnit>m</geometricUnit>",
            _ => "",
        };
        let _ = writeln!(
            out,
            "      <geometryWarpFile><path>region{i}_warp.pfm</path><interpolation>linear</interpolation>{unit}</geometryWarpFile>"
        );
    }
    for (map, tag, name) in [(&region.alpha, "alphaMap", "alpha"), (&region.beta, "betaMap", "beta")] {
        if let Some(map) = map {
            let _ = writeln!(
                out,
                "      <{tag}><path>region{i}_{name}.png</path><componentDepth>3</componentDepth><bitDepth>16</bitDepth><gammaEmbedded>{}</gammaEmbedded></{tag}>",
                map.gamma
            );
        }
    }
    out + "    </fileset>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
