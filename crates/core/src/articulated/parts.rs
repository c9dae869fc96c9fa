//! The parts of an articulated body besides its model and its dof settings, for archives.

use super::body::{ArticulatedBody, ArticulatedError};
use super::collider::{Collider, LinkCollider};
use crate::BodyError;
use crate::articulated::model::dof::Coupling;
use crate::object::mounts::{CameraMount, LightMount};
use crate::object::visual::Visual;
use tumble_collide::Pose;

/// Everything that is fixed to the links, and the state at time 0.
pub(crate) struct ArticulatedParts {
    /// Each with its link, an index in [`Model::frames`](super::Model::frames).
    pub colliders: Vec<(usize, Collider)>,
    /// Likewise.
    pub visuals: Vec<(usize, Visual)>,
    pub cameras: Vec<CameraMount>,
    pub lights: Vec<LightMount>,
    pub couplings: Vec<Coupling>,
    /// Pairs of links that do not collide, sorted.
    pub excluded_pairs: Vec<[Option<usize>; 2]>,
    pub start: Vec<f64>,
}

impl ArticulatedBody {
    /// Returns the colliders in the order of their parts, each with the moving link that carries it;
    /// `None` for the base. Poses are in the frame of that link or of the base, about the center of
    /// the shape.
    pub fn colliders(&self) -> impl Iterator<Item = (Option<usize>, &Collider)> {
        self.colliders.iter().map(|part| (part.link, &part.collider))
    }

    /// Returns the couplings of its degrees of freedom.
    pub fn couplings(&self) -> &[Coupling] {
        &self.couplings
    }

    /// Returns the pairs of moving links that do not collide, sorted; `None` is the base.
    pub fn excluded_pairs(&self) -> &[[Option<usize>; 2]] {
        &self.excluded_pairs
    }

    pub(crate) fn to_parts(&self) -> ArticulatedParts {
        ArticulatedParts {
            colliders: self.colliders.iter().map(|part| (part.frame, part.collider.clone())).collect(),
            visuals: self.visual_links.iter().copied().zip(self.visuals.iter().cloned()).collect(),
            cameras: self.cameras.clone(),
            lights: self.lights.clone(),
            couplings: self.couplings.clone(),
            excluded_pairs: self.excluded_pairs.clone(),
            start: self.start.clone(),
        }
    }

    /// Checks a collider of damaged bytes.
    fn check_read(&self, link: usize, collider: &Collider) -> Result<(), ArticulatedError> {
        let wrong = |why| ArticulatedError::Collider {
            body: self.name.clone(),
            link: self.model.frames()[link].name.clone(),
            why,
        };
        let range = |what, value, expected| wrong(BodyError::Range { what, value, expected });
        let material = collider.material.validate();
        material.map_err(|(what, value, expected)| range(what, value, expected))?;
        let unit = collider.pose.rotation.norm();
        if unit.is_nan() || (unit - 1.0).abs() >= 1e-6 {
            return Err(range("norm of the orientation", unit, "1"));
        }
        if let Some(value) = collider.pose.translation.vector.iter().find(|x| !x.is_finite()) {
            return Err(range("a position", *value, "finite"));
        }
        self.check_collider(link, collider).map_err(wrong)
    }

    /// Adds the parts to a body without any, whose model is already placed on `base`.
    pub(crate) fn with_parts(mut self, base: Pose, parts: ArticulatedParts) -> Result<Self, ArticulatedError> {
        if !self.is_state(&parts.start) {
            return Err(ArticulatedError::Start { body: self.name, what: "positions", expected: self.start.len() });
        }
        let ArticulatedParts { colliders, visuals, cameras, lights, couplings, excluded_pairs, start } = parts;
        for (frame, collider) in colliders {
            let Some(link) = self.model.frames().get(frame).map(|found| found.link) else {
                return Err(self.no_link(&format!("number {frame}")));
            };
            self.check_read(frame, &collider)?;
            self.colliders.push(LinkCollider { intersect: None, link, frame, collider });
        }
        (self.visual_links, self.visuals) = visuals.into_iter().unzip();
        let parts = self.model.links().len() + 1;
        let shown = self.visuals.iter().map(|visual| visual.part);
        let mounted = cameras.iter().map(|camera| camera.part).chain(lights.iter().map(|light| light.part));
        if let Some(part) = shown.chain(mounted).find(|part| *part >= parts) {
            return Err(self.no_link(&format!("number {part}")));
        }
        if let Some(frame) = self.visual_links.iter().find(|frame| **frame >= self.model.frames().len()) {
            return Err(self.no_link(&format!("number {frame}")));
        }
        (self.base, self.cameras, self.lights) = (base, cameras, lights);
        couplings.into_iter().try_for_each(|coupling| self.couple(coupling))?;
        let links = self.model.links().len();
        if let Some(link) = excluded_pairs.iter().flatten().flatten().find(|link| **link >= links) {
            return Err(self.no_link(&format!("number {link}")));
        }
        self.excluded_pairs = excluded_pairs.into_iter().map(|[a, b]| [a.min(b), a.max(b)]).collect();
        self.excluded_pairs.sort_unstable();
        self.excluded_pairs.dedup();
        self.start = start;
        Ok(self)
    }
}
