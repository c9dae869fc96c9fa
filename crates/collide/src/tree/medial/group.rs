//! Groups: the assignment of the spheres of a level to the spheres of the level above.
//!
//! The worst spheres lie where the surface is difficult, and need spheres from regions where it is
//! easy. But a sphere has at most `branch` children. So an exchange across groups includes a chain
//! of transfers: a group with one sphere too many gives one to a neighbor, and so on, up to a group
//! with room. The chain has the least cost (Bellman and Ford). It is accepted only if the spheres
//! around all changed groups stay within an error budget.

use super::refit::keep;
use super::site::Site;
use crate::MeshDistance;
use crate::tree::TreeSettings;
use crate::tree::sphere::{Sphere, min_outward_enclosing};

/// Maximum number of groups for exchanges between groups; with more, spheres are exchanged within
/// groups only.
const MAX_GROUPS: usize = 128;
/// Error budget of the spheres above the leaves, relative to the worst error of their level before
/// any exchange, the sum over all levels.
const SLACK: f64 = 0.2;
/// The same for spheres two and more levels above the exchanged ones.
const SLACK_ABOVE: f64 = 0.05;

/// The groups of a level.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    /// Maximum number of spheres of a group.
    pub room: usize,
    /// Maximum outward error of the sphere around a group, meters.
    pub budget: f64,
    /// Group of each sphere.
    pub of: Vec<usize>,
    pub spheres: Vec<Sphere>,
    /// Center of the sphere around each group.
    sites: Vec<Site>,
    /// The spheres around the groups.
    around: Vec<Sphere>,
    /// The groups of these spheres in the level above.
    above: Option<Box<Groups>>,
}

/// An exchange of spheres.
pub(super) struct Change {
    /// Spheres that change.
    pub spheres: Vec<(usize, Sphere)>,
    /// The new sphere; it can replace a removed one.
    pub new: (usize, Sphere),
    /// The sphere that was split. The new sphere starts in its group.
    pub split: usize,
}

impl Groups {
    /// Makes groups of spheres below those of the level above; `of` is the group of each sphere.
    /// The budget is a little above the worst error.
    pub fn new(
        spheres: Vec<Sphere>,
        of: Vec<usize>,
        settings: &TreeSettings,
        above: Option<Groups>,
        distance: &MeshDistance,
    ) -> Groups {
        let levels = f64::from(settings.depth.max(2) - 1);
        let room = settings.branch as usize;
        let count = of.iter().max().map_or(0, |g| g + 1);
        let nowhere = Site { center: crate::Vec3::zeros(), depth: 0.0, parent_bound: None };
        let sites = vec![nowhere; count];
        let around = vec![Sphere { center: nowhere.center, radius: 0.0 }; count];
        let above = above.map(Box::new);
        let mut groups = Groups { room, budget: f64::INFINITY, of, spheres, sites, around, above };
        groups.refit(distance);
        groups.set_budget(1.0 + SLACK / levels);
        groups
    }

    fn set_budget(&mut self, slack: f64) {
        self.budget = slack * self.worst();
        if let Some(above) = &mut self.above {
            above.set_budget(1.0 + SLACK_ABOVE);
        }
    }

    /// Fits all spheres around groups again, on all levels.
    pub fn refit(&mut self, distance: &MeshDistance) {
        (0..self.sites.len()).for_each(|g| self.fit(g, distance));
        if let Some(above) = &mut self.above {
            above.spheres.clone_from(&self.around);
            above.refit(distance);
        }
    }

    /// Returns the largest outward error of the spheres around the groups.
    fn worst(&self) -> f64 {
        self.around.iter().zip(&self.sites).map(|(b, s)| b.radius - s.depth).fold(0.0, f64::max)
    }

    /// Drops the spheres that are not marked. Returns the groups of the others.
    pub fn keep(&mut self, kept: &[bool]) -> Vec<usize> {
        keep(&mut self.of, kept);
        keep(&mut self.spheres, kept);
        self.of.clone()
    }

    /// Returns the sphere within which sphere `k` has to stay.
    pub fn parent_bound(&self, k: usize) -> Option<Sphere> {
        let site = &self.sites[self.of[k]];
        Some(Sphere { center: site.center, radius: site.depth + self.budget })
    }

    /// Fits the sphere around a group.
    fn fit(&mut self, g: usize, distance: &MeshDistance) {
        let own: Vec<Sphere> = self.of.iter().zip(&self.spheres).filter(|(of, _)| **of == g).map(|(_, b)| *b).collect();
        if !own.is_empty() {
            self.around[g] = min_outward_enclosing(&own, distance);
            self.sites[g] = Site::at(self.around[g].center, distance);
        }
    }

    /// Fits the spheres around the stale groups. Returns whether they and all above stay within
    /// their budgets. A group gets a new center only if its present one does not suffice.
    fn fit_groups(&mut self, mut stale: Vec<usize>, distance: &MeshDistance) -> bool {
        stale.sort_unstable();
        stale.dedup();
        for &g in &stale {
            let own = self.of.iter().zip(&self.spheres).filter(|(of, _)| **of == g);
            let reach = own.map(|(_, b)| (b.center - self.sites[g].center).norm() + b.radius).fold(0.0, f64::max);
            self.around[g] = Sphere { center: self.sites[g].center, radius: reach };
            if reach - self.sites[g].depth > self.budget {
                self.fit(g, distance);
            }
            if self.around[g].radius - self.sites[g].depth > self.budget {
                return false;
            }
        }
        if self.above.is_none() {
            return true;
        }
        stale.retain(|&g| {
            let above = |groups: &Groups| groups.above.as_ref().is_none_or(|a| a.would_fit(g, &groups.around[g]));
            if !above(self) {
                self.fit(g, distance);
            }
            let fits = above(self);
            if let Some(a) = &mut self.above {
                a.spheres[g] = self.around[g];
            }
            !fits
        });
        let Some(above) = &mut self.above else { return true };
        above.fit_groups(stale.into_iter().map(|g| above.of[g]).collect(), distance)
    }

    /// Returns whether `sphere`, instead of sphere `k`, would fit its group within the budget at
    /// the group's present center.
    fn would_fit(&self, k: usize, sphere: &Sphere) -> bool {
        need(&self.sites[self.of[k]], sphere) <= self.budget
    }

    /// Returns the groups after a change, if it is possible within the budget.
    pub fn with_change(&self, change: &Change, distance: &MeshDistance) -> Option<Groups> {
        let mut next = self.clone();
        for &(k, sphere) in &change.spheres {
            next.spheres[k] = sphere;
        }
        let home = next.of[change.split];
        let (new, sphere) = change.new;
        if new == next.of.len() {
            next.of.push(home);
            next.spheres.push(sphere);
        } else {
            next.of[new] = home;
            next.spheres[new] = sphere;
        }
        let mut size = vec![0; next.sites.len()];
        next.of.iter().for_each(|&g| size[g] += 1);
        let mut stale: Vec<usize> = change
            .spheres
            .iter()
            .map(|(k, _)| *k)
            .filter(|&k| !next.would_fit(k, &next.spheres[k]))
            .map(|k| next.of[k])
            .collect();
        stale.push(home);
        if size[home] > next.room {
            for (sphere, to) in next.chain(&size, home)? {
                next.of[sphere] = to;
                stale.push(to);
            }
        }
        next.fit_groups(stale, distance).then_some(next)
    }

    /// Returns transfers `(sphere, to)` from `full` to a group with room, of least total cost.
    fn chain(&self, size: &[usize], full: usize) -> Option<Vec<(usize, usize)>> {
        let groups = size.len();
        if groups > MAX_GROUPS {
            return None;
        }
        let mut hand = vec![vec![(f64::INFINITY, 0); groups]; groups];
        for (k, (sphere, &from)) in self.spheres.iter().zip(&self.of).enumerate() {
            let here = self.cost(&self.sites[from], sphere).min(1.0);
            for (to, site) in self.sites.iter().enumerate() {
                // a group is refitted after a transfer, which makes some room
                let extra = (self.cost(site, sphere) - here).max(1e-6);
                if to != from && extra < 3.0 && extra < hand[from][to].0 {
                    hand[from][to] = (extra, k);
                }
            }
        }
        let mut reached = vec![(f64::INFINITY, full); groups];
        reached[full].0 = 0.0;
        for _ in 1..groups {
            let mut changed = false;
            for from in (0..groups).filter(|&g| size[g] > 0) {
                for to in (0..groups).filter(|&to| to != full) {
                    let through = reached[from].0 + hand[from][to].0;
                    if through < reached[to].0 {
                        reached[to] = (through, from);
                        changed = true;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        let ends = (0..groups).filter(|&g| size[g] < self.room && reached[g].0.is_finite());
        let mut to = ends.min_by(|&a, &b| reached[a].0.total_cmp(&reached[b].0))?;
        let mut chain = Vec::new();
        while to != full && chain.len() < groups {
            let from = reached[to].1;
            chain.push((hand[from][to].1, to));
            to = from;
        }
        (to == full).then_some(chain)
    }

    /// Returns the cost of a sphere in a group: 1 at the budget.
    fn cost(&self, site: &Site, sphere: &Sphere) -> f64 {
        (need(site, sphere) / self.budget).max(0.0).powi(4)
    }
}

/// Returns the outward error of the sphere about the site that contains `sphere`, meters.
fn need(site: &Site, sphere: &Sphere) -> f64 {
    (sphere.center - site.center).norm() + sphere.radius - site.depth
}
