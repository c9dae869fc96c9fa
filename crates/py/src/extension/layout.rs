//! The rows of a view: one for each rigid body, each moving link and each base.

use crate::errors::{Error, Result};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use tumble::collide::Vec3;
use tumble::dynamics::{ArticulatedBody, ObjectId, PartState, RigidBody as Rigid, WorldView, Wrench};

/// Assignment of rows to objects. It is kept until objects are added or removed.
pub struct Layout {
    ids: Vec<ObjectId>,
    /// Objects with rows: their id, name and rows.
    pub objects: Vec<(ObjectId, Arc<str>, Range<usize>)>,
    /// For each articulated body, the names of its links, including fixed ones, and their indices
    /// among its rows.
    links: Vec<(ObjectId, Vec<(String, usize)>)>,
    pub rows: Vec<Row>,
    /// The number of parts in the world, and whether each part is a row without change.
    part_states: usize,
    plain: bool,
}

/// A row: a rigid body, or a link at its center of mass. Shapes on links are parts as well but have
/// no rows, since they have no mass of their own.
pub struct Row {
    part_index: usize,
    /// In the frame of the part, m.
    center: Vec3,
    /// kg.
    pub mass: f64,
    /// False for a base.
    pub may_move: bool,
}

impl Row {
    /// Returns the vector from the part's origin to the center of mass, world axes, m.
    fn arm(&self, part_states: &[PartState]) -> Vec3 {
        part_states[self.part_index].pose.rotation * self.center
    }

    /// Returns the part state at the center of mass.
    fn shown(&self, part_states: &[PartState]) -> PartState {
        let (mut part_state, arm) = (part_states[self.part_index], self.arm(part_states));
        let spin = part_state.angular_velocity;
        part_state.acceleration += part_state.angular_acceleration.cross(&arm) + spin.cross(&spin.cross(&arm));
        part_state.velocity += spin.cross(&arm);
        part_state.pose.translation.vector += arm;
        part_state
    }
}

impl Layout {
    /// Returns the layout of a world.
    pub fn of(view: &WorldView) -> Layout {
        let mut layout = Layout {
            ids: view.ids().to_vec(),
            objects: Vec::new(),
            links: Vec::new(),
            rows: Vec::new(),
            part_states: view.part_states.len(),
            plain: true,
        };
        for &id in view.ids() {
            let Some(span) = view.state_range(id) else { continue };
            if span.parts.is_empty() {
                continue;
            }
            let first = layout.rows.len();
            match view.get::<ArticulatedBody>(id) {
                Some(body) => {
                    let links = body.model().links();
                    let moving = links.iter().enumerate().map(|(i, link)| (i, link.mass.center, link.mass.mass, true));
                    let rows = moving.chain([(links.len(), Vec3::zeros(), 0.0, false)]);
                    layout.rows.extend(rows.map(|(part, center, mass, may_move)| Row {
                        part_index: span.parts.start + part,
                        center,
                        mass,
                        may_move,
                    }));
                    let names = body
                        .model()
                        .frames()
                        .iter()
                        .map(|frame| (frame.name.clone(), frame.link.unwrap_or(links.len())));
                    layout.links.push((id, names.collect()));
                    layout.plain = false;
                }
                None => {
                    let mass = view.get::<Rigid>(id).filter(|body| !body.is_fixed()).map_or(0.0, |body| body.mass());
                    layout.rows.extend(span.parts.clone().map(|part_index| Row {
                        part_index,
                        center: Vec3::zeros(),
                        mass,
                        may_move: true,
                    }));
                }
            }
            layout.objects.push((id, view.name(id).unwrap_or_default().into(), first..layout.rows.len()));
        }
        layout
    }

    /// Returns whether the layout is still valid.
    pub fn fits(&self, view: &WorldView) -> bool {
        self.ids == view.ids() && self.part_states == view.part_states.len()
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns the rows as part states.
    pub fn shown<'a>(&self, part_states: &'a [PartState]) -> Cow<'a, [PartState]> {
        if self.plain {
            Cow::Borrowed(part_states)
        } else {
            self.rows.iter().map(|row| row.shown(part_states)).collect()
        }
    }

    /// Returns the part that a row belongs to, and a wrench at the row as a wrench at the part's
    /// origin.
    pub fn at_part(&self, row: usize, part_states: &[PartState], mut wrench: Wrench) -> (usize, Wrench) {
        let row = &self.rows[row];
        if !self.plain {
            wrench.torque += row.arm(part_states).cross(&wrench.force);
        }
        (row.part_index, wrench)
    }

    /// Returns the index of a link among the rows of its body.
    pub fn link(&self, id: ObjectId, link: &str) -> Result<usize> {
        let names = self.links.iter().find(|(other, _)| *other == id).map_or(&[][..], |(_, names)| names);
        names.iter().find(|(name, _)| name == link).map(|(_, place)| *place).ok_or_else(|| {
            let names: Vec<&str> = names.iter().take(12).map(|(name, _)| &**name).collect();
            Error::Name(format!("the body has no link named '{link}'; there are: {}", names.join(", ")))
        })
    }

    /// Returns the rows of an object.
    pub fn rows(&self, id: ObjectId) -> Option<Range<usize>> {
        Some(self.objects.iter().find(|(other, ..)| *other == id)?.2.clone())
    }

    /// Returns the object that a row belongs to and the part.
    pub fn owner(&self, row: usize) -> Option<(ObjectId, usize, &Arc<str>)> {
        let (id, name, rows) = self.objects.iter().find(|(.., rows)| rows.contains(&row))?;
        Some((*id, row - rows.start, name))
    }
}
