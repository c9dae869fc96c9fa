//! Drives of all degrees of freedom of an articulation at once.

use crate::errors::{Error, Result};
use crate::objects::joints::drive;
use tumble::dynamics::{ArticulatedBody, Drive};

/// Settings of drives, each with one number for each degree of freedom.
pub struct AllDrives {
    pub target: Option<Vec<f64>>,
    pub velocity: Option<Vec<f64>>,
    pub stiffness: Option<Vec<f64>>,
    pub damping: Option<Vec<f64>>,
    pub max_force: Option<Vec<f64>>,
}

impl AllDrives {
    /// Returns the drives of a body, one for each degree of freedom. A setting with the same number for all leaves out degrees of
    /// freedom that cannot have a drive.
    pub fn drives(&self, body: &ArticulatedBody) -> Result<Vec<Drive>> {
        let gains = self.stiffness.is_some() || self.damping.is_some();
        let mut drives = Vec::with_capacity(body.dofs().len());
        for link in body.model().links() {
            for (dof, settings) in (link.v..link.v + link.joint.dof()).zip(&body.dofs()[link.v..]) {
                let driveless = !matches!(link.joint.dof(), 1 | 3);
                let of = |setting: &Option<Vec<f64>>| {
                    let numbers = setting.as_ref()?;
                    let one_for_all = numbers.iter().all(|number| *number == numbers[0]);
                    (!(driveless && one_for_all)).then(|| numbers[dof])
                };
                let (target, velocity, limit) = (of(&self.target), of(&self.velocity), of(&self.max_force));
                drives.push(match (&settings.drive, gains) {
                    (&Drive::Position { stiffness, damping, target: before, velocity: speed, limit: most }, false)
                        if target.is_some() =>
                    {
                        let (target, velocity) = (target.unwrap_or(before), velocity.unwrap_or(speed));
                        Drive::Position { stiffness, damping, target, velocity, limit: limit.unwrap_or(most) }
                    }
                    (_, false) if target.is_some_and(|target| !driveless || target != 0.0) => {
                        return Err(Error::value(format!(
                            "target: degree of freedom {dof} has no drive to a position yet; set its stiffness or damping too"
                        )));
                    }
                    _ => {
                        let number = |setting| of(setting).unwrap_or(0.0);
                        let (stiffness, damping) = (number(&self.stiffness), number(&self.damping));
                        let driven = stiffness != 0.0 || damping != 0.0;
                        let velocity = velocity.filter(|v| driven || *v != 0.0);
                        let limit = limit.unwrap_or(settings.effort);
                        drive(target.filter(|_| driven), velocity, stiffness, damping, limit)?
                    }
                });
            }
        }
        Ok(drives)
    }
}
