//! Fits spheres to the union of a link's shapes.
//!
//! Two sets of spheres grow side by side. The one covers the outer surface of all shapes together
//! ([`Covering`]). The other covers capsules and spheres by formula ([`Chain`]) and the outer
//! surface of the other shapes as the first does; the member that extends furthest outside gets the
//! next sphere. Neither depends on the allowed number, and no step makes the worst value of either
//! worse. So the better one of the two never extends further with more spheres.

use tumble_core::collide::{
    Builder, CoveredShape, Covering, CoveringSphere, Pose, SolidSamples, SphereTree, TreeSettings, TriMesh, Vec3,
};

use super::chain::{Chain, chains};
use super::solid::Solid;
use super::spheres::SphereOptions;
use super::weigh;

/// Sides of the prism of a round shape.
const SIDES: usize = 64;
/// Spheres per chain up to which the shapes of a link of capsules are also covered together.
const CHAIN_SPHERES: usize = 4;
/// Largest number of children in a sphere tree.
const MAX_BRANCHES: usize = 64;
/// Sphere trees are tried from this number of spheres on, at each doubling.
const FIRST_TREE: usize = 4;

/// A shape of a link, in the link's frame.
pub(super) enum Form {
    /// All points within the radius of a segment of the z axis; a sphere if its length is 0.
    Capsule { radius: f64, length: f64, pose: Pose },
    /// A cylinder along z.
    Cylinder { radius: f64, length: f64, pose: Pose },
    /// The surface to cover, and a closed surface around it if it is open.
    Mesh { given: TriMesh, closed: Option<TriMesh> },
}

/// A sphere of a link.
pub(super) struct FittedSphere {
    pub center: Vec3,
    pub radius: f64,
    pub outward: f64,
    /// The shape that it is written instead of.
    pub shape: usize,
    /// Whether it is that shape.
    pub exact: bool,
}

/// The spheres of a link.
pub(super) struct Fit {
    pub spheres: Vec<FittedSphere>,
    /// Share of the outer surface that is covered, by area.
    pub coverage: f64,
}

/// How much is covered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    /// Least share of the outer surface, by area.
    pub coverage: f64,
    /// Weight of coverage against tightness ([`weigh`]); `None` takes the tightest set.
    pub weight: Option<f64>,
}

/// Returns spheres around the shapes of a link, at most `most`.
///
/// # Errors
/// A tree cannot be built.
pub(super) fn fit(forms: &[Form], most: usize, aim: Aim, options: &SphereOptions) -> Result<Fit, String> {
    let members = Members::of(forms);
    let Some(weight) = aim.weight else { return Ok(tightest(&members, most, aim.coverage, options)?.0) };
    let (full, covering) = tightest(&members, most, 1.0, options)?;
    if weight >= 1.0 || full.spheres.iter().all(|sphere| sphere.outward <= 0.0) {
        return Ok(full);
    }
    let covering = match covering {
        Some(covering) => covering,
        None => grown(&members, most, 1.0, options)?.covering,
    };
    let solid = Solid::of(forms);
    let distance = |p: &Vec3| solid.distance(p);
    let samples = SolidSamples::new(solid.bounds(), covering.worst() + members.slack(), &distance);
    let fitted = |one: weigh::Candidate<Vec<CoveringSphere>>| {
        let spheres = one.spheres.into_iter().map(|sphere| members.fitted(sphere)).collect();
        weigh::Candidate {
            spheres: Fit { spheres, coverage: 1.0 - one.uncovered },
            uncovered: one.uncovered,
            outside: one.outside,
        }
    };
    let balls: Vec<(Vec3, f64)> = full.spheres.iter().map(|s| (s.center, s.radius)).collect();
    let outside = samples.volume_outside(&balls) / samples.volume();
    let mut candidates = vec![weigh::Candidate { uncovered: 1.0 - full.coverage, outside, spheres: full }];
    candidates.extend(weigh::candidates(covering, aim.coverage, &samples).into_iter().map(fitted));
    weigh::best(candidates, weight).map(|best| best.spheres).ok_or_else(|| "it has no sphere".into())
}

/// Returns the spheres that reach the least far outside and cover the share `coverage`, and the covering
/// of all shapes together if it has as many.
fn tightest(
    members: &Members,
    most: usize,
    coverage: f64,
    options: &SphereOptions,
) -> Result<(Fit, Option<Covering>), String> {
    let enough = options.error * CoveredShape::union(&members.shapes).diagonal();
    let by_formula = ByFormula::new(members, coverage, most);
    let by_formula = by_formula.map(|set| set.grown(most, enough, options)).transpose()?;
    if let Some(set) = &by_formula
        && (set.worst() <= 0.0 || coverage >= 1.0 && set.is_one_chain())
    {
        return Ok((set.fit(members), None));
    }
    let fewer = if coverage >= 1.0 { most.min(members.most_together()) } else { most };
    let whole = grown(members, fewer, coverage, options)?;
    let worst = whole.covering.worst() + members.slack();
    let order = |worst: f64, count: usize| if worst <= enough { (enough, count) } else { (worst, 0) };
    let fit = match by_formula {
        Some(set) if order(set.worst(), set.count()) <= order(worst, whole.covering.count()) => set.fit(members),
        _ => Fit { spheres: whole.spheres(members), coverage: whole.covering.coverage() },
    };
    Ok((fit, (fewer == most).then_some(whole.covering)))
}

/// Returns a covering of all shapes together, of at most `most` spheres.
fn grown(members: &Members, most: usize, coverage: f64, options: &SphereOptions) -> Result<Refined, String> {
    let union = CoveredShape::union(&members.shapes);
    let enough = options.error * union.diagonal();
    let Some(covering) = Covering::new(&members.shapes, coverage) else {
        return Err("its shapes hide each other's surface".into());
    };
    let mut whole = Refined::new(covering, union);
    while whole.covering.count() < most && whole.wants_more(enough) {
        whole.add(enough, options)?;
        let count = whole.covering.count();
        if count.is_power_of_two() {
            whole.covering.suggest(&members.centers(count), count);
        }
    }
    Ok(whole)
}

/// The shapes of a link, with a capsule for each chain.
struct Members {
    /// The first members.
    chains: Vec<Chain>,
    shapes: Vec<CoveredShape>,
    /// Index of the shape that each member is, or that its spheres are written instead of.
    origins: Vec<usize>,
}

impl Members {
    fn of(forms: &[Form]) -> Members {
        let (chains, by_chain) = chains(forms);
        let capsules =
            chains.iter().map(|chain| (chain.shape, forms[chain.shape].rounded(chain.radius + chain.deviation)));
        let rest = (0..forms.len()).filter(|k| !by_chain[*k]).map(|k| (k, forms[k].covered()));
        let (origins, shapes) = capsules.chain(rest).unzip();
        Members { chains, shapes, origins }
    }

    /// Returns the shapes, of which only those without a chain are to be covered, and the solids of
    /// these; `None` if each has a chain.
    fn rest(&self) -> Option<(Vec<CoveredShape>, TriMesh)> {
        let count = self.chains.len();
        let hide = |(k, shape): (usize, &CoveredShape)| CoveredShape { covered: k >= count, ..shape.clone() };
        let shapes: Vec<CoveredShape> = self.shapes.iter().enumerate().map(hide).collect();
        (count < shapes.len()).then(|| (shapes, CoveredShape::union(&self.shapes[count..])))
    }

    /// Returns how far capsules, enlarged by their deviation, may extend outside the shapes that they
    /// stand for.
    fn slack(&self) -> f64 {
        self.chains.iter().map(|chain| 2.0 * chain.deviation).fold(0.0, f64::max)
    }

    /// Returns a sphere of a covering as one of the link.
    fn fitted(&self, s: CoveringSphere) -> FittedSphere {
        let outward = s.outward + self.slack();
        FittedSphere { center: s.center, radius: s.radius, outward, shape: self.origins[s.shape], exact: false }
    }

    /// Returns the number of spheres up to which all shapes are covered together. Chains gain more
    /// from each sphere.
    fn most_together(&self) -> usize {
        if self.chains.len() == self.shapes.len() { CHAIN_SPHERES * self.chains.len() } else { usize::MAX }
    }

    /// Returns the centers of `count` spheres on chains; none if there are other shapes.
    fn centers(&self, count: usize) -> Vec<Vec3> {
        if self.chains.len() < self.shapes.len() || self.chains.len() > count {
            return Vec::new();
        }
        let mut set = ByFormula { chains: self.chains.clone(), rest: None };
        while set.count() < count {
            let Some(chain) = set.worst_chain().filter(|chain| !chain.is_sphere()) else { break };
            chain.count += 1;
        }
        set.chains.iter().flat_map(Chain::spheres).map(|sphere| sphere.0).collect()
    }
}

/// Chains, and the covering of the shapes that have none.
struct ByFormula {
    chains: Vec<Chain>,
    rest: Option<Refined>,
}

impl ByFormula {
    /// Returns one sphere for each chain, and one for the other shapes; `None` if there is no chain,
    /// or if that is more than `most`.
    fn new(members: &Members, coverage: f64, most: usize) -> Option<ByFormula> {
        if members.chains.is_empty() || members.chains.len() > most {
            return None;
        }
        let rest =
            members.rest().and_then(|(shapes, solid)| Some(Refined::new(Covering::new(&shapes, coverage)?, solid)));
        let set = ByFormula { chains: members.chains.clone(), rest };
        (set.count() <= most).then_some(set)
    }

    fn grown(mut self, most: usize, enough: f64, options: &SphereOptions) -> Result<ByFormula, String> {
        while self.count() < most {
            let rest = self.rest.as_ref().filter(|rest| rest.wants_more(enough)).map(|rest| rest.covering.worst());
            let chain = self.worst_chain().filter(|chain| chain.outward() > enough);
            match (chain, rest) {
                (Some(chain), rest) if rest.is_none_or(|worst| chain.outward() >= worst) => chain.count += 1,
                (_, Some(_)) => self.rest.as_mut().map_or(Ok(()), |rest| rest.add(enough, options))?,
                _ => break,
            }
        }
        Ok(self)
    }

    /// Returns the chain that extends furthest outside and can be refined.
    fn worst_chain(&mut self) -> Option<&mut Chain> {
        let key = |chain: &Chain| if chain.is_sphere() { -1.0 } else { chain.outward() };
        self.chains.iter_mut().rev().max_by(|a, b| key(a).total_cmp(&key(b)))
    }

    fn count(&self) -> usize {
        self.chains.iter().map(|chain| chain.count).sum::<usize>()
            + self.rest.as_ref().map_or(0, |r| r.covering.count())
    }

    fn worst(&self) -> f64 {
        let chains = self.chains.iter().map(Chain::outward);
        chains.chain(self.rest.iter().map(|rest| rest.covering.worst())).fold(0.0, f64::max)
    }

    fn is_one_chain(&self) -> bool {
        self.rest.is_none() && self.chains.len() == 1
    }

    fn fit(&self, members: &Members) -> Fit {
        let of_chain = |chain: &Chain| {
            let (outward, shape, exact) = (chain.outward(), chain.shape, chain.is_sphere());
            let fitted = move |(center, radius)| FittedSphere { center, radius, outward, shape, exact };
            chain.spheres().into_iter().map(fitted).collect::<Vec<_>>()
        };
        let mut spheres: Vec<FittedSphere> = self.chains.iter().flat_map(of_chain).collect();
        spheres.extend(self.rest.iter().flat_map(|rest| rest.spheres(members)));
        // the rest covers its share, the chains all
        Fit { spheres, coverage: self.rest.as_ref().map_or(1.0, |rest| rest.covering.coverage()) }
    }
}

/// A covering, and the trees that are tried for it.
struct Refined {
    covering: Covering,
    solid: TriMesh,
    /// Number of spheres at which trees are tried next.
    next_tree: usize,
    /// Octrees of depth 1, 2, …, as far as they are built.
    octrees: Vec<SphereTree>,
    stuck: bool,
}

impl Refined {
    fn new(covering: Covering, solid: TriMesh) -> Refined {
        Refined { covering, solid, next_tree: FIRST_TREE, octrees: Vec::new(), stuck: false }
    }

    fn wants_more(&self, enough: f64) -> bool {
        !self.stuck && self.covering.worst() > enough
    }

    fn spheres(&self, members: &Members) -> Vec<FittedSphere> {
        self.covering.spheres().map(|sphere| members.fitted(sphere)).collect()
    }

    fn add(&mut self, enough: f64, options: &SphereOptions) -> Result<(), String> {
        self.stuck = !self.covering.refine();
        let count = self.covering.count();
        if count >= self.next_tree {
            self.next_tree = 2 * count;
            for centers in self.trees(count, enough, options)? {
                self.covering.suggest(&centers, count);
            }
            self.covering.settle();
        }
        self.covering.improve();
        Ok(())
    }

    /// Returns the centers of trees' spheres, at most `count` of each tree.
    fn trees(&mut self, count: usize, enough: f64, options: &SphereOptions) -> Result<Vec<Vec<Vec3>>, String> {
        let build = |settings: TreeSettings| {
            SphereTree::build_cached(&self.solid, &settings, &options.cache)
                .map(|built| built.tree)
                .map_err(|e| e.to_string())
        };
        let cut = |tree: &SphereTree| tree.select(count, enough).iter().map(|&n| tree.nodes()[n].center).collect();
        if options.tree.builder != Builder::Octree {
            let settings = TreeSettings { branch: count as u32, depth: 1, ..options.tree };
            return if count <= MAX_BRANCHES { Ok(vec![cut(&build(settings)?)]) } else { Ok(Vec::new()) };
        }
        while self.octrees.len() < options.tree.depth as usize
            && self.octrees.last().is_none_or(|tree| tree.leaves().count() <= count)
        {
            self.octrees.push(build(TreeSettings { depth: self.octrees.len() as u32 + 1, ..options.tree })?);
        }
        Ok(self.octrees.iter().rev().take(2).map(cut).collect())
    }
}

impl Form {
    /// Returns the ends of the axis of a capsule or cylinder; of a mesh its origin twice.
    pub(super) fn ends(&self) -> [Vec3; 2] {
        match self {
            Form::Capsule { length, pose, .. } | Form::Cylinder { length, pose, .. } => {
                [-0.5, 0.5].map(|at| (pose * nalgebra::Point3::new(0.0, 0.0, at * length)).coords)
            }
            Form::Mesh { .. } => [Vec3::zeros(); 2],
        }
    }

    /// Returns the shape as a mesh. The corners of round shapes lie on their surface.
    pub(super) fn covered(&self) -> CoveredShape {
        match self {
            Form::Capsule { radius, .. } => self.rounded(*radius),
            Form::Cylinder { radius, length, pose } => CoveredShape {
                given: placed(TriMesh::cylinder(*radius, *length, SIDES), pose),
                closed: None,
                bulge: radius * (1.0 - (std::f64::consts::PI / SIDES as f64).cos()),
                covered: true,
            },
            Form::Mesh { given, closed } => {
                CoveredShape { given: given.clone(), closed: closed.clone(), bulge: 0.0, covered: true }
            }
        }
    }

    /// Returns the capsule of a radius about the axis of a capsule or cylinder.
    fn rounded(&self, radius: f64) -> CoveredShape {
        let (Form::Capsule { length, pose, .. } | Form::Cylinder { length, pose, .. }) = self else {
            return self.covered();
        };
        let mesh = if *length > 0.0 {
            TriMesh::capsule(radius, *length, SIDES, SIDES / 4)
        } else {
            TriMesh::uv_sphere(radius, SIDES, SIDES / 2)
        };
        let bulge = capsule_bulge(&mesh, radius, *length);
        CoveredShape { given: placed(mesh, pose), closed: None, bulge, covered: true }
    }
}

/// Returns a mesh in the frame of the link.
pub(super) fn placed(mut mesh: TriMesh, pose: &Pose) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|v| *v = (pose * nalgebra::Point3::from(*v)).coords);
    mesh
}

/// Returns how far a capsule along z is outside a mesh with corners on it: the radius less the
/// smallest distance of a face's plane from its end of the axis.
fn capsule_bulge(mesh: &TriMesh, radius: f64, length: f64) -> f64 {
    let inner = (0..mesh.triangles.len()).map(|t| {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(&(c - a)).normalize();
        normal.dot(&(a - Vec3::z() * (0.5 * length * normal.z.signum())))
    });
    radius - inner.fold(radius, f64::min)
}
