//! Locked axes: a body that does not move along, or does not turn about, some axes of the world.
//!
//! With `S` the columns of the identity for the free axes of rotation, the angular velocity is `ω =
//! S·w`. The principle of d'Alembert gives
//!
//! ```text
//! l = Sᵀ I S·w        dl/dt = Sᵀ τ        W = S (Sᵀ I S)⁻¹ Sᵀ        ω = W·l        I = R I_b Rᵀ
//! L⁻ᵀ = S (Sᵀ I S)^-½ Sᵀ        Lᵀ = S (Sᵀ I S)^½ Sᵀ        L⁻ᵀ·Jᵀ has no entry for a locked axis
//! ```
//!
//! `W` is the inverse inertia of the rows: `K = Yᵀ·Y = J W Jᵀ`, so nothing moves a locked axis. The
//! state stores `l`, zero along locked axes. The same holds for translations, with the mass instead
//! of the inertia. The torques that hold a locked axis do no work.

use tumble_collide::{Mat3, Vec3};

/// Axes of the world along which a body cannot move, or about which it cannot turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct LockedAxes {
    /// Whether the center of mass cannot move along x, y and z.
    pub translation: [bool; 3],
    /// Whether the body cannot turn about x, y and z.
    pub rotation: [bool; 3],
}

/// Two maps of the angular momentum along the free axes.
pub(super) struct Roots {
    /// `S (Sᵀ I S)^½ Sᵀ`.
    pub root: Mat3,
    /// `S (Sᵀ I S)^-½ Sᵀ`.
    pub inverse_root: Mat3,
}

impl LockedAxes {
    /// The names of the axes in Python and in scene files: of translations, then of rotations.
    pub const NAMES: [&str; 6] = ["x", "y", "z", "rotation_x", "rotation_y", "rotation_z"];

    /// Returns the locks with these [names](Self::NAMES).
    ///
    /// # Errors
    /// The first name that is not known.
    pub fn of_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<LockedAxes, &'a str> {
        let mut locked = LockedAxes::default();
        for name in names {
            let axis = Self::NAMES.iter().position(|known| *known == name).ok_or(name)?;
            match axis {
                0..3 => locked.translation[axis] = true,
                _ => locked.rotation[axis - 3] = true,
            }
        }
        Ok(locked)
    }

    /// Returns the [names](Self::NAMES) of the locked axes.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + use<> {
        let flags = [self.translation, self.rotation].concat();
        Self::NAMES.into_iter().zip(flags).filter_map(|(name, locked)| locked.then_some(name))
    }

    /// Returns whether a rotation is locked.
    pub(super) fn rotates_freely(&self) -> bool {
        self.rotation == [false; 3]
    }

    /// Returns 1 for each free translation and 0 for each locked one.
    pub(super) fn free_translation(&self) -> Vec3 {
        free(self.translation)
    }

    /// Returns a vector without its entries about locked axes.
    pub(super) fn free_rotation(&self, v: &Vec3) -> Vec3 {
        v.component_mul(&free(self.rotation))
    }

    /// Returns `W` for an inertia in world axes.
    pub(super) fn inverse(&self, inertia: &Mat3) -> Mat3 {
        let root = self.roots(inertia).inverse_root;
        root * root
    }

    /// Returns the roots for an inertia in world axes.
    pub(super) fn roots(&self, inertia: &Mat3) -> Roots {
        let (mut root, mut inverse_root) = (Mat3::zeros(), Mat3::zeros());
        let free: Vec<usize> = (0..3).filter(|&k| !self.rotation[k]).collect();
        match free[..] {
            [i] => {
                root[(i, i)] = inertia[(i, i)].sqrt();
                inverse_root[(i, i)] = 1.0 / root[(i, i)];
            }
            [i, j] => {
                // √M = (M + s·1)/t with s = √det M and t = √(tr M + 2s)
                let (a, b, c) = (inertia[(i, i)], inertia[(i, j)], inertia[(j, j)]);
                let s = (a * c - b * b).sqrt();
                let t = (a + c + 2.0 * s).sqrt();
                let (p, q, r) = ((a + s) / t, b / t, (c + s) / t);
                // the determinant of the root is s
                for (to, [p, q, r]) in [(&mut root, [p, q, r]), (&mut inverse_root, [r / s, -q / s, p / s])] {
                    (to[(i, i)], to[(i, j)], to[(j, i)], to[(j, j)]) = (p, q, q, r);
                }
            }
            _ => {}
        }
        Roots { root, inverse_root }
    }
}

fn free(locked: [bool; 3]) -> Vec3 {
    Vec3::from(locked.map(|locked| if locked { 0.0 } else { 1.0 }))
}
