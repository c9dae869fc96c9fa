//! Which rows of a view belong to whom: one for each rigid body, each moving link and each base.

use crate::errors::{Error, Result};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use tumble::collide::Vec3;
use tumble::dynamics::{ArticulatedBody, ObjectId, PartState, RigidBody as Rigid, WorldView, Wrench};

/// Which rows belong to whom: made once and kept until objects come or go.
pub struct Layout {
    ids: Vec<ObjectId>,
    /// Objects with rows: their id, name and rows.
    pub objects: Vec<(ObjectId, Arc<str>, Range<usize>)>,
    /// Of each articulated body the names of its links, the fixed ones too, and their places among its rows.
    links: Vec<(ObjectId, Vec<(String, usize)>)>,
    pub rows: Vec<Row>,
    /// How many sites the world has, and whether each of them is a row as it stands.
    sites: usize,
    plain: bool,
}

/// What a row shows: a rigid body, or a link at its centre of mass. Shapes on links have sites too, but no rows: they have no mass of their own.
pub struct Row {
    site: usize,
    /// In the frame of the site, m.
    center: Vec3,
    /// kg.
    pub mass: f64,
    /// Not of a base.
    pub may_move: bool,
}

impl Row {
    /// From the site to the centre of mass, world axes, m.
    fn arm(&self, sites: &[PartState]) -> Vec3 {
        sites[self.site].pose.rotation * self.center
    }

    /// The centre of mass as a site.
    fn shown(&self, sites: &[PartState]) -> PartState {
        let (mut site, arm) = (sites[self.site], self.arm(sites));
        let spin = site.angular_velocity;
        site.acceleration += site.angular_acceleration.cross(&arm) + spin.cross(&spin.cross(&arm));
        site.velocity += spin.cross(&arm);
        site.pose.translation.vector += arm;
        site
    }
}

impl Layout {
    /// Of the world as it is.
    pub fn of(view: &WorldView) -> Layout {
        let mut layout = Layout {
            ids: view.ids().to_vec(),
            objects: Vec::new(),
            links: Vec::new(),
            rows: Vec::new(),
            sites: view.part_states.len(),
            plain: true,
        };
        for &id in view.ids() {
            let (Some(span), Some(object)) = (view.state_range(id), view.object(id)) else { continue };
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
                        site: span.parts.start + part,
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
                    layout.rows.extend(span.parts.clone().map(|site| Row {
                        site,
                        center: Vec3::zeros(),
                        mass,
                        may_move: true,
                    }));
                }
            }
            layout.objects.push((id, object.name().into(), first..layout.rows.len()));
        }
        layout
    }

    /// Whether it still holds.
    pub fn fits(&self, view: &WorldView) -> bool {
        self.ids == view.ids() && self.sites == view.part_states.len()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// The rows as sites.
    pub fn shown<'a>(&self, sites: &'a [PartState]) -> Cow<'a, [PartState]> {
        if self.plain { Cow::Borrowed(sites) } else { self.rows.iter().map(|row| row.shown(sites)).collect() }
    }

    /// The site that a row belongs to, and what a wrench at the row is there.
    pub fn at_site(&self, row: usize, sites: &[PartState], mut wrench: Wrench) -> (usize, Wrench) {
        let row = &self.rows[row];
        if !self.plain {
            wrench.torque += row.arm(sites).cross(&wrench.force);
        }
        (row.site, wrench)
    }

    /// The place of a link among the rows of its body.
    pub fn link(&self, id: ObjectId, link: &str) -> Result<usize> {
        let names = self.links.iter().find(|(other, _)| *other == id).map_or(&[][..], |(_, names)| names);
        names.iter().find(|(name, _)| name == link).map(|(_, place)| *place).ok_or_else(|| {
            let names: Vec<&str> = names.iter().take(12).map(|(name, _)| &**name).collect();
            Error::Name(format!("the body has no link named '{link}'; there are: {}", names.join(", ")))
        })
    }

    /// Rows of an object.
    pub fn rows(&self, id: ObjectId) -> Option<Range<usize>> {
        Some(self.objects.iter().find(|(other, ..)| *other == id)?.2.clone())
    }

    /// Whose row it is, and which part of it.
    pub fn owner(&self, row: usize) -> Option<(ObjectId, usize, &Arc<str>)> {
        let (id, name, rows) = self.objects.iter().find(|(.., rows)| rows.contains(&row))?;
        Some((*id, row - rows.start, name))
    }
}
