//! Quality of pictures against speed: shadows, edges, occlusion, reflections and resolution by name.

use super::Settings;
use std::fmt;
use std::str::FromStr;

/// How shadows are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shadows {
    /// No shadows.
    Off,
    /// Sharp, smoothed over one texel of the map.
    Hard,
    /// With penumbrae whose width follows from the light's size.
    #[default]
    Soft,
}

const SHADOWS: [(&str, Shadows); 3] = [("off", Shadows::Off), ("hard", Shadows::Hard), ("soft", Shadows::Soft)];

impl Shadows {
    /// The word for it in [`Quality`].
    pub fn name(self) -> &'static str {
        SHADOWS.iter().find(|(_, shadows)| *shadows == self).map_or("", |(name, _)| name)
    }

    /// Its number in the shaders.
    pub(crate) fn number(self) -> u32 {
        SHADOWS.iter().position(|(_, shadows)| *shadows == self).unwrap_or(0) as u32
    }
}

/// How many of the pixels of a picture are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Resolution {
    /// All.
    #[default]
    Full,
    /// Half of them in each direction, a quarter of all; the picture is enlarged before it is finished for a projector.
    /// Overlays are enlarged with it. Pages in a browser draw all pixels.
    Half,
}

/// The part of [`Settings`] that trades appearance for speed. As text: `default`, `fast` or
/// `fastest`, and after it or alone `shadows=off|hard|soft`, `samples=1|4`, `occlusion=on|off`,
/// `reflections=on|off`, `resolution=full|half`, `map=TEXELS`, separated by commas.
///
/// ```
/// use tumble_render::{Quality, Shadows};
/// let quality: Quality = "fast,samples=4".parse()?;
/// assert_eq!((quality.shadows, quality.samples), (Shadows::Hard, 4));
/// # Ok::<(), tumble_render::UnknownQuality>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quality {
    /// Shadows of lights.
    pub shadows: Shadows,
    /// Samples per pixel: 1 or 4.
    pub samples: u32,
    /// Whether corners and creases receive less light from the sky.
    pub occlusion: bool,
    /// Whether surfaces reflect the sky and have clear coats.
    pub reflections: bool,
    /// Side of a shadow map in texels, 256 to 8192.
    pub shadow_map_size: u32,
    /// How many of the pixels are drawn.
    pub resolution: Resolution,
}

/// A word that names no quality.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no quality '{0}'; expected default, fast, fastest, shadows=off|hard|soft, samples=1|4, occlusion=on|off, reflections=on|off, resolution=full|half or map=TEXELS (256 to 8192), separated by commas"
)]
pub struct UnknownQuality(String);

impl Default for Quality {
    /// The quality of screenshots: soft shadows, four samples, occlusion.
    fn default() -> Self {
        Quality {
            shadows: Shadows::Soft,
            samples: 4,
            occlusion: true,
            reflections: true,
            shadow_map_size: 2048,
            resolution: Resolution::Full,
        }
    }
}

impl Quality {
    /// For many bodies on a slow device: hard shadows, one sample, no occlusion.
    pub fn fast() -> Self {
        Quality {
            shadows: Shadows::Hard,
            samples: 1,
            occlusion: false,
            reflections: true,
            shadow_map_size: 1024,
            resolution: Resolution::Full,
        }
    }

    /// As [`Quality::fast`], without shadows and reflections.
    pub fn fastest() -> Self {
        Quality { shadows: Shadows::Off, reflections: false, ..Quality::fast() }
    }

    /// Sets it in the settings of a list. An explicit reach of occlusion stays, unless occlusion is
    /// off.
    pub fn apply(&self, settings: &mut Settings) {
        settings.shadows = self.shadows;
        settings.samples = self.samples;
        settings.reflections = self.reflections;
        settings.shadow_map_size = self.shadow_map_size;
        settings.resolution = self.resolution;
        if !self.occlusion {
            settings.occlusion_m = Some(0.0);
        }
    }
}

impl FromStr for Quality {
    type Err = UnknownQuality;

    fn from_str(words: &str) -> Result<Quality, UnknownQuality> {
        let mut quality = Quality::default();
        for word in words.split(',').map(str::trim) {
            let unknown = || UnknownQuality(word.to_string());
            match word.split_once('=') {
                None if word == "default" => quality = Quality::default(),
                None if word == "fastest" => quality = Quality::fastest(),
                None if word == "fast" => quality = Quality::fast(),
                Some(("shadows", name)) => {
                    quality.shadows = SHADOWS.iter().find(|(known, _)| *known == name).ok_or_else(unknown)?.1
                }
                Some(("samples", "1")) => quality.samples = 1,
                Some(("samples", "4")) => quality.samples = 4,
                Some(("occlusion", "on")) => quality.occlusion = true,
                Some(("occlusion", "off")) => quality.occlusion = false,
                Some(("reflections", "on")) => quality.reflections = true,
                Some(("reflections", "off")) => quality.reflections = false,
                Some(("resolution", "full")) => quality.resolution = Resolution::Full,
                Some(("resolution", "half")) => quality.resolution = Resolution::Half,
                Some(("map", side)) => {
                    quality.shadow_map_size =
                        side.parse().ok().filter(|n| (256..=8192).contains(n)).ok_or_else(unknown)?
                }
                _ => return Err(unknown()),
            }
        }
        Ok(quality)
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let occlusion = if self.occlusion { "on" } else { "off" };
        let reflections = if self.reflections { "" } else { "reflections=off," };
        let resolution = if self.resolution == Resolution::Half { "resolution=half," } else { "" };
        write!(
            f,
            "shadows={},samples={},occlusion={occlusion},{reflections}{resolution}map={}",
            self.shadows.name(),
            self.samples,
            self.shadow_map_size
        )
    }
}
