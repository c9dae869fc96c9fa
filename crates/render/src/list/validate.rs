//! Checks of a draw list before anything is allocated or drawn: counts, ranges, finite numbers.

use super::{DrawList, Light};
use crate::{Material, RenderError};

/// Largest number of lights in a list.
pub const MAX_LIGHTS: usize = 8;
/// Largest number of lights with shadows; further lights have none.
pub const MAX_SHADOWS: usize = 4;
/// Largest number of textures.
pub const MAX_TEXTURES: usize = 256;
/// Largest number of items of each other kind.
pub const MAX_ITEMS: usize = 1 << 20;

impl DrawList {
    /// Checks the list: counts within their limits, mesh indices that exist, numbers finite and in
    /// range. [`crate::MeshData::validate`] checks meshes when they are first uploaded.
    ///
    /// # Errors
    /// The first fault, with the item, the field, its value and the valid range.
    pub fn validate(&self) -> Result<(), RenderError> {
        self.check_counts()?;
        for (i, x) in self.instances.iter().enumerate() {
            let at = Item("instance", i);
            at.check(x.mesh.0 < self.meshes.len(), "mesh", &x.mesh.0, "the number of a mesh of this list")?;
            at.finite("pose", x.pose.translation.vector.as_slice())?;
            at.finite("pose", x.pose.rotation.coords.as_slice())?;
            at.check(
                x.scale.iter().all(|s| s.is_finite() && *s != 0.0),
                "scale",
                &x.scale.as_slice(),
                "finite factors other than 0",
            )?;
            at.material(&x.material)?;
            at.texture(&x.material, self.textures.len())?;
        }
        for (i, s) in self.spheres.iter().enumerate() {
            let at = Item("sphere", i);
            at.finite("center", s.center.coords.as_slice())?;
            at.finite("orientation", s.orientation.coords.as_slice())?;
            at.check(s.radius > 0.0 && s.radius.is_finite(), "radius", &s.radius, "finite and above 0")?;
            at.material(&s.material)?;
            at.texture(&s.material, self.textures.len())?;
        }
        for (i, cloud) in self.clouds.iter().enumerate() {
            let at = Item("cloud", i);
            for (center, radius) in &cloud.spheres {
                at.finite("center", center.coords.as_slice())?;
                at.check(*radius > 0.0 && radius.is_finite(), "radius", radius, "finite and above 0")?;
            }
            at.material(&cloud.material)?;
            at.check(cloud.material.texture.is_none(), "texture", &cloud.material.texture, "none")?;
            let colors = cloud.colors.len();
            at.check([0, cloud.spheres.len()].contains(&colors), "colors", &colors, "none, or one for each sphere")?;
            cloud.colors.iter().try_for_each(|color| at.color("colors", *color))?;
        }
        for (i, s) in self.soft_spheres.iter().enumerate() {
            let at = Item("soft sphere", i);
            at.finite("center", s.center.coords.as_slice())?;
            at.check(s.radius > 0.0 && s.radius.is_finite(), "radius", &s.radius, "finite and above 0")?;
            at.color("color", s.color)?;
            at.check(in_range(s.opacity, 0.0, 1.0), "opacity", &s.opacity, "0 to 1")?;
        }
        for (i, c) in self.capsules.iter().enumerate() {
            let at = Item("capsule", i);
            at.finite("pose", c.pose.translation.vector.as_slice())?;
            at.finite("pose", c.pose.rotation.coords.as_slice())?;
            at.check(c.radius > 0.0 && c.radius.is_finite(), "radius", &c.radius, "finite and above 0")?;
            at.check(c.length >= 0.0 && c.length.is_finite(), "length", &c.length, "finite and not negative")?;
            at.material(&c.material)?;
            at.texture(&c.material, self.textures.len())?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            check_light(Item("light", i), light)?;
        }
        self.check_debug()?;
        self.check_surroundings()
    }

    fn check_counts(&self) -> Result<(), RenderError> {
        let counts = [
            ("meshes", self.meshes.len(), MAX_ITEMS),
            ("instances", self.instances.len(), MAX_ITEMS),
            ("spheres", self.sphere_count(), MAX_ITEMS),
            ("soft spheres", self.soft_spheres.len(), MAX_ITEMS),
            ("capsules", self.capsules.len(), MAX_ITEMS),
            ("lines", self.lines.len(), MAX_ITEMS),
            ("points", self.points.len(), MAX_ITEMS),
            ("debug spheres", self.debug_spheres.len(), MAX_ITEMS / 64),
            ("lights", self.lights.len(), MAX_LIGHTS),
            ("textures", self.textures.len(), MAX_TEXTURES),
        ];
        match counts.into_iter().find(|(_, count, cap)| count > cap) {
            Some((what, count, cap)) => Err(RenderError::TooMany { what, count, cap }),
            None => Ok(()),
        }
    }

    fn check_debug(&self) -> Result<(), RenderError> {
        for (i, l) in self.lines.iter().enumerate() {
            let at = Item("line", i);
            at.finite("start", l.start.coords.as_slice())?;
            at.finite("end", l.end.coords.as_slice())?;
            at.finite("style", &[l.head_m, l.style.opacity, l.style.width_px])?;
        }
        for (i, p) in self.points.iter().enumerate() {
            Item("point", i).finite("position", p.position.coords.as_slice())?;
            Item("point", i).finite("style", &[p.style.opacity, p.style.width_px])?;
        }
        for (i, s) in self.debug_spheres.iter().enumerate() {
            let at = Item("debug sphere", i);
            at.finite("center", s.center.coords.as_slice())?;
            at.check(s.radius >= 0.0 && s.radius.is_finite(), "radius", &s.radius, "finite and not negative")?;
            at.finite("style", &[s.style.opacity, s.style.width_px])?;
        }
        Ok(())
    }

    fn check_surroundings(&self) -> Result<(), RenderError> {
        let (sky, s) = (&self.sky, &self.settings);
        for (field, color) in [
            ("zenith", sky.zenith),
            ("horizon", sky.horizon),
            ("ground", sky.ground),
            ("backdrop", sky.backdrop.unwrap_or_default()),
        ] {
            Item("sky", 0).color(field, color)?;
        }
        Item("sky", 0).check(in_range(sky.ambient, 0.0, 1e6), "ambient", &sky.ambient, "0 or more")?;
        Item("sky", 0).check(in_range(sky.softbox, 0.0, 1e6), "softbox", &sky.softbox, "0 or more")?;
        if let Some(g) = &self.ground {
            Item("ground", 0).finite("height_m", &[g.height_m])?;
            Item("ground", 0).check(
                g.reach_m > 0.0 && g.reach_m.is_finite(),
                "reach_m",
                &g.reach_m,
                "finite and above 0",
            )?;
            Item("ground", 0).material(&g.material)?;
            Item("ground", 0).texture(&g.material, self.textures.len())?;
        }
        let at = Item("settings", 0);
        at.check(in_range(s.exposure, 0.0, 1e6), "exposure", &s.exposure, "0 or more")?;
        at.check(
            (256..=8192).contains(&s.shadow_map_size),
            "shadow_map_size",
            &s.shadow_map_size,
            "256 to 8192 texels",
        )?;
        at.check([1, 4].contains(&s.samples), "samples", &s.samples, "1 or 4")?;
        at.check(s.occlusion_m.is_none_or(|r| in_range(r, 0.0, 1e6)), "occlusion_m", &s.occlusion_m, "0 or more")
    }
}

fn check_light(at: Item, light: &Light) -> Result<(), RenderError> {
    let (color, intensity, size) = match light {
        Light::Directional { direction, color, intensity, angular_radius_rad, .. } => {
            at.finite("direction", direction.as_slice())?;
            at.check(direction.norm() > 1e-9, "direction", &direction.as_slice(), "a length above 0")?;
            (*color, *intensity, *angular_radius_rad)
        }
        Light::Point { position, color, intensity, radius_m, .. } => {
            at.finite("position", position.coords.as_slice())?;
            (*color, *intensity, *radius_m)
        }
    };
    at.color("color", color)?;
    at.check(in_range(intensity, 0.0, 1e9), "intensity", &intensity, "0 or more")?;
    at.check(in_range(size, 0.0, 1e6), "radius", &size, "0 or more")
}

/// The item that an error names.
#[derive(Clone, Copy)]
struct Item(&'static str, usize);

impl Item {
    fn check(
        self,
        ok: bool,
        field: &'static str,
        value: &dyn std::fmt::Debug,
        expected: &'static str,
    ) -> Result<(), RenderError> {
        if ok {
            Ok(())
        } else {
            Err(RenderError::BadValue { what: self.0, index: self.1, field, value: format!("{value:?}"), expected })
        }
    }

    fn finite(self, field: &'static str, numbers: &[f32]) -> Result<(), RenderError> {
        self.check(numbers.iter().all(|x| x.is_finite()), field, &numbers, "finite numbers")
    }

    fn color(self, field: &'static str, c: [f32; 3]) -> Result<(), RenderError> {
        self.check(c.iter().all(|&x| in_range(x, 0.0, 1.0)), field, &c, "three sRGB components from 0 to 1")
    }

    /// Checks that a texture exists and has a valid scale.
    fn texture(self, m: &Material, textures: usize) -> Result<(), RenderError> {
        let Some(texture) = m.texture else { return Ok(()) };
        self.check(texture.id < textures, "texture", &texture.id, "the number of a texture of this list")?;
        self.check(in_range(texture.repeat_m, 1e-6, 1e6), "texture repeat_m", &texture.repeat_m, "0.000001 to 1000000")
    }

    fn material(self, m: &Material) -> Result<(), RenderError> {
        self.color("color", m.color)?;
        self.check(in_range(m.roughness, 0.0, 1.0), "roughness", &m.roughness, "0 to 1")?;
        self.check(in_range(m.metallic, 0.0, 1.0), "metallic", &m.metallic, "0 to 1")?;
        self.check(in_range(m.clearcoat, 0.0, 1.0), "clearcoat", &m.clearcoat, "0 to 1")?;
        let (_, other, size) = m.pattern.packed();
        self.color("pattern color", other)?;
        self.finite("pattern size", &size)
    }
}

fn in_range(x: f32, lo: f32, hi: f32) -> bool {
    (lo..=hi).contains(&x)
}
