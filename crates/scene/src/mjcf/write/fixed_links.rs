//! Links that are fixed to others: bodies without a joint, or sites.

use std::collections::BTreeSet;

use tumble_core::Object;
use tumble_core::articulated::LinkMass;
use tumble_core::collide::Pose;

use super::MjcfWriter;
use super::geoms::{about_frame, visual_of};
use super::links::Tree;
use super::xml::Attributes;

impl MjcfWriter<'_> {
    /// Writes a link that is fixed to another one or to the base: a body without a joint, or a site if it has no mass and no shapes.
    pub(super) fn fixed_link(&mut self, tree: &Tree<'_>, number: usize) {
        let frame = &tree.body.model().frames()[number];
        let drawn = tree.body.visuals_of_links().any(|(own, visual)| own == number && visual.drawn().is_some());
        let collides = tree.body.parts_of_link(&frame.name).is_ok_and(|parts| !parts.is_empty());
        if frame.mass == LinkMass::none() && !drawn && !collides {
            let label = self.sites.unique(frame.name.clone());
            self.note_rename("site", (&frame.name, &frame.name), &label);
            let mut t = Attributes::of("name", label);
            t.put_pose(&frame.pose);
            return self.xml.leaf("site", &t);
        }
        let label = self.body_label(&frame.name);
        let mut t = Attributes::of("name", &label);
        t.put_pose(&frame.pose);
        self.xml.open("body", &t);
        self.link_bodies.insert((tree.id, number), label);
        if frame.mass != LinkMass::none() {
            self.inertial(&frame.name, &frame.mass);
        }
        self.shapes_of_frame(tree, number, &frame.pose);
        self.xml.close();
    }

    /// Writes the shapes and visuals of a link alone, whose frame has a pose in that of the body that carries it.
    pub(super) fn shapes_of_frame(&mut self, tree: &Tree<'_>, number: usize, at: &Pose) {
        let (body, frame) = (tree.body, &tree.body.model().frames()[number]);
        let back = at.inverse();
        let own = body.visuals_of_links().filter(|(link, visual)| *link == number && visual.drawn().is_some());
        let mut left: Vec<_> = own.map(|(_, visual)| visual).collect();
        let Some(parts) = body.collidable() else { return };
        for part in body.parts_of_link(&frame.name).unwrap_or_default() {
            let Some(shape) = parts.shape(part) else { continue };
            let pose = body.part_pose(part);
            let visual = visual_of(&mut left, shape, &pose);
            let common =
                self.surface(&frame.name, parts, part, tree.collidable, visual.map(|visual| &visual.appearance));
            let pose = back * pose * about_frame(shape);
            self.solid(&frame.name, (parts, part), &pose, (tree.collidable, None), &common);
        }
        for visual in left {
            self.visual_geom(&frame.name, &tumble_core::Visual { pose: back * visual.pose, ..visual.clone() });
        }
    }

    /// Returns the names of the bodies of a carrier and of the links fixed to it that collide.
    pub(super) fn colliding_bodies(&self, tree: &Tree<'_>, carrier: Option<usize>) -> Vec<String> {
        let frames: BTreeSet<usize> =
            tree.body.colliders_of(carrier).filter_map(|part| tree.body.frame_of(part)).collect();
        frames.into_iter().filter_map(|frame| self.link_bodies.get(&(tree.id, frame)).cloned()).collect()
    }
}
