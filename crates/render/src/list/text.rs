//! The text form of a draw list: rounded, in list order. Golden tests without a GPU compare it.

use super::{DebugStyle, DrawList, Light, SphereStyle};
use crate::{Camera, Material, Pattern, Resolution, Shader};
use std::fmt::{Display, Formatter, Result};

impl DrawList {
    /// Returns the list as text: one line per item, lengths rounded to 0.1 mm, other numbers to
    /// four decimals.
    pub fn to_text(&self) -> String {
        self.to_string()
    }
}

impl Display for DrawList {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write_camera(f, &self.camera)?;
        let (s, k) = (&self.settings, &self.sky);
        write!(
            f,
            "settings: exposure {} shadow map {} occlusion {} tone map {}",
            n(s.exposure),
            s.shadow_map_size,
            s.occlusion_m.map_or("auto".into(), n),
            s.tone_map
        )?;
        let half = if s.resolution == Resolution::Half { " resolution half" } else { "" };
        writeln!(f, " shadows {} samples {} reflections {}{half}", s.shadows.name(), s.samples, s.reflections)?;
        writeln!(
            f,
            "sky: zenith {} horizon {} ground {} ambient {} softbox {} backdrop {}",
            v(&k.zenith),
            v(&k.horizon),
            v(&k.ground),
            n(k.ambient),
            n(k.softbox),
            k.backdrop.map_or("none".into(), |c| v(&c))
        )?;
        if let Some(g) = &self.ground {
            writeln!(f, "ground: height {} reach {} {}", n(g.height_m), n(g.reach_m), material(&g.material))?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            write_light(f, i, light)?;
        }
        for (i, mesh) in self.meshes.iter().enumerate() {
            let (lo, hi) = mesh.bounds().unwrap_or_default();
            let unwrapped = if mesh.unwrapped.is_empty() { "" } else { " unwrapped" };
            writeln!(
                f,
                "mesh {i}: {} vertices {} triangles from {} to {}{unwrapped}",
                mesh.positions.len(),
                mesh.indices.len() / 3,
                v(&lo),
                v(&hi)
            )?;
        }
        for (i, image) in self.textures.iter().enumerate() {
            writeln!(f, "texture {i}: {} x {}", image.width, image.height)?;
        }
        for (i, x) in self.instances.iter().enumerate() {
            let (t, q) = (x.pose.translation.vector, x.pose.rotation.coords);
            write!(f, "instance {i}: mesh {} at {} turned {}", x.mesh.0, v(t.as_slice()), v(q.as_slice()))?;
            writeln!(f, " scale {} {}{}", v(x.scale.as_slice()), material(&x.material), shadow(x.casts_shadow))?;
        }
        for (i, s) in self.spheres.iter().enumerate() {
            let q = s.orientation.coords;
            writeln!(
                f,
                "sphere {i}: at {} radius {} turned {} {}{}",
                v(s.center.coords.as_slice()),
                n(s.radius),
                v(q.as_slice()),
                material(&s.material),
                shadow(s.casts_shadow)
            )?;
        }
        for (i, cloud) in self.clouds.iter().enumerate() {
            writeln!(f, "cloud {i}: {} spheres {}", cloud.spheres.len(), material(&cloud.material))?;
            for (center, radius) in &cloud.spheres {
                writeln!(f, "  at {} radius {}", v(center.coords.as_slice()), n(*radius))?;
            }
            for color in &cloud.colors {
                writeln!(f, "  color {}", v(color))?;
            }
        }
        for (i, s) in self.soft_spheres.iter().enumerate() {
            let (at, color, lit) = (v(s.center.coords.as_slice()), v(&s.color), s.shader == Shader::Lit);
            write!(f, "soft sphere {i}: at {at} radius {} color {color} opacity {}", n(s.radius), n(s.opacity))?;
            writeln!(f, "{}", if lit { "" } else { " unlit" })?;
        }
        for (i, c) in self.capsules.iter().enumerate() {
            let (t, q) = (c.pose.translation.vector, c.pose.rotation.coords);
            write!(f, "capsule {i}: at {} turned {} length {}", v(t.as_slice()), v(q.as_slice()), n(c.length))?;
            writeln!(f, " radius {} {}{}", n(c.radius), material(&c.material), shadow(c.casts_shadow))?;
        }
        for (i, l) in self.lines.iter().enumerate() {
            let kind = if l.head_m > 0.0 { "arrow" } else { "line" };
            writeln!(
                f,
                "{kind} {i}: from {} to {} {}",
                v(l.start.coords.as_slice()),
                v(l.end.coords.as_slice()),
                style(&l.style)
            )?;
        }
        for (i, p) in self.points.iter().enumerate() {
            writeln!(f, "point {i}: at {} {}", v(p.position.coords.as_slice()), style(&p.style))?;
        }
        for (i, s) in self.debug_spheres.iter().enumerate() {
            let kind = if s.kind == SphereStyle::Rings { "rings" } else { "shell" };
            writeln!(f, "{kind} {i}: at {} radius {} {}", v(s.center.coords.as_slice()), n(s.radius), style(&s.style))?;
        }
        Ok(())
    }
}

fn write_camera(f: &mut Formatter<'_>, camera: &Camera) -> Result {
    match camera {
        Camera::LookAt { eye, target, up, vertical_fov_rad, near_m, far_m } => writeln!(
            f,
            "camera: eye {} target {} up {} fov {} near {} far {}",
            v(eye.coords.as_slice()),
            v(target.coords.as_slice()),
            v(up.as_slice()),
            n(*vertical_fov_rad),
            n(*near_m),
            n(*far_m)
        ),
        Camera::Raw { view, projection } => {
            writeln!(f, "camera: view {} projection {} (columns)", v(view.as_slice()), v(projection.as_slice()))
        }
    }
}

fn write_light(f: &mut Formatter<'_>, i: usize, light: &Light) -> Result {
    match light {
        Light::Directional { direction, color, intensity, angular_radius_rad, casts_shadow } => writeln!(
            f,
            "light {i}: directional along {} color {} intensity {} radius {} rad{}",
            v(direction.as_slice()),
            v(color),
            n(*intensity),
            n(*angular_radius_rad),
            shadow(*casts_shadow)
        ),
        Light::Point { position, color, intensity, radius_m, casts_shadow } => writeln!(
            f,
            "light {i}: point at {} color {} intensity {} radius {}{}",
            v(position.coords.as_slice()),
            v(color),
            n(*intensity),
            n(*radius_m),
            shadow(*casts_shadow)
        ),
    }
}

fn material(m: &Material) -> String {
    let (_, other, size) = m.pattern.packed();
    let pattern = match m.pattern {
        Pattern::Plain => String::new(),
        _ => format!(" pattern {} {} {}", m.pattern.name(), v(&other), v(&size)),
    };
    let shader = if m.shader == Shader::Unlit { " unlit" } else { "" };
    let texture = m.texture.map_or(String::new(), |t| format!(" texture {} every {}", t.id, n(t.repeat_m)));
    format!(
        "color {} rough {} metal {} coat {}{pattern}{shader}{texture}",
        v(&m.color),
        n(m.roughness),
        n(m.metallic),
        n(m.clearcoat)
    )
}

fn style(s: &DebugStyle) -> String {
    let top = if s.on_top { " on top" } else { "" };
    format!("color {} opacity {} width {}{top}", v(&s.color), n(s.opacity), n(s.width_px))
}

fn shadow(casts: bool) -> &'static str {
    if casts { "" } else { " no shadow" }
}

/// Formats a number with four decimals, without trailing zeros and without a negative zero.
fn n(x: f32) -> String {
    let text = format!("{x:.4}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

fn v(numbers: &[f32]) -> String {
    format!("({})", numbers.iter().map(|&x| n(x)).collect::<Vec<_>>().join(" "))
}
