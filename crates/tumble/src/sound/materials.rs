//! Materials that sound: elastic constants and losses.

/// Constants of a material that sounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoundMaterial {
    /// Name in scene files: `sound`.
    pub name: &'static str,
    /// kg/m³.
    pub density: f64,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Loss factor `η`: the share of the energy that a vibration loses in a radian.
    pub loss: f64,
}

/// The materials, by density. Young's modulus, density and loss factor are typical values of handbooks
/// (Ashby, *Materials Selection in Mechanical Design*; Cremer, Heckl and Petersson, *Structure-Borne Sound*).
pub const SOUND_MATERIALS: [SoundMaterial; 6] = [
    SoundMaterial { name: "wood", density: 700.0, young: 11e9, loss: 0.012 },
    SoundMaterial { name: "rubber", density: 1100.0, young: 10e6, loss: 0.3 },
    SoundMaterial { name: "plastic", density: 1200.0, young: 3e9, loss: 0.03 },
    SoundMaterial { name: "glass", density: 2500.0, young: 70e9, loss: 0.0015 },
    SoundMaterial { name: "stone", density: 2700.0, young: 50e9, loss: 0.006 },
    SoundMaterial { name: "steel", density: 7850.0, young: 200e9, loss: 0.0006 },
];

impl SoundMaterial {
    /// Returns the material of a name.
    pub fn of_name(name: &str) -> Option<SoundMaterial> {
        SOUND_MATERIALS.into_iter().find(|material| material.name == name)
    }

    /// Returns the default material of a density, kg/m³: wood below 1000, plastic below 2000, stone below 5000, else steel.
    pub fn of_density(density: f64) -> SoundMaterial {
        let name = match density {
            d if d < 1000.0 => "wood",
            d if d < 2000.0 => "plastic",
            d if d < 5000.0 => "stone",
            _ => "steel",
        };
        SOUND_MATERIALS.into_iter().find(|material| material.name == name).unwrap_or(SOUND_MATERIALS[0])
    }

    /// Returns the speed of longitudinal waves in a bar, m/s.
    pub fn wave_speed(&self) -> f64 {
        (self.young / self.density).sqrt()
    }
}
